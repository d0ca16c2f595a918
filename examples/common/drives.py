"""Drives of a robot in a physics engine: a random course, the controller that follows it, and what the engine makes of it."""

from dataclasses import dataclass

import numpy as np

ROW_S = 0.01  # one row of the log, s


@dataclass(frozen=True)
class Course:
    """How a drive goes: its length (s) and the greatest speed (m/s), acceleration (m/s²), yaw rate (rad/s) and yaw
    acceleration (rad/s²) asked for."""

    length_s: float = 150.0
    speed_m_s: float = 0.8
    acceleration_m_s2: float = 0.9
    yaw_rate_rad_s: float = 1.5
    yaw_acceleration_rad_s2: float = 4.0

    def targets(self, draw):
        """Speed (m/s) and yaw rate (rad/s) asked for at each row: legs of 1 to 4 s, straight, curved, backwards, on the spot
        or at rest, joined by ramps; the first second is at rest."""
        rows = round(self.length_s / ROW_S)
        asked = np.zeros((rows, 2))
        k = round(1.0 / ROW_S)
        while k < rows:
            end = k + round(draw.uniform(1.0, 4.0) / ROW_S)
            kind = draw.uniform()
            v = draw.uniform(0.2, 1.0) * self.speed_m_s * (1.0 if draw.uniform() < 0.7 else -1.0)
            w = draw.uniform(-1.0, 1.0) * self.yaw_rate_rad_s
            asked[k:end] = (v, 0.0) if kind < 0.3 else (0.0, w) if kind < 0.42 else (0.0, 0.0) if kind < 0.5 else (v, w)
            k = end
        most = np.array([self.acceleration_m_s2, self.yaw_acceleration_rad_s2]) * ROW_S
        for k in range(1, rows):
            asked[k] = asked[k - 1] + np.clip(asked[k] - asked[k - 1], -most, most)
        return asked


@dataclass
class Drive:
    """What the engine made: at n + 1 times, step_s apart, the truth, at each row the torques."""

    step_s: float
    yaw_rate_rad_s: np.ndarray  # about the chassis' own z: what a gyro there reads
    wheels_rad_s: np.ndarray  # (n + 1, 2), wheel against chassis
    turned_rad: np.ndarray  # (n + 1, 2), the wheels' angles
    position_m: np.ndarray  # (n + 1, 2), the axle's middle
    heading_rad: np.ndarray  # unwrapped
    velocity_m_s: np.ndarray  # (n + 1, 2), of the axle's middle, in the world's axes
    torques_n_m: np.ndarray  # (rows, 2), commanded, or of a robot that takes speeds as its motors measure them
    commands_rad_s: np.ndarray = None  # (rows, 2), of a robot that takes speeds

    @property
    def speed_m_s(self):
        """Forward speed at each step."""
        c, s = np.cos(self.heading_rad), np.sin(self.heading_rad)
        return self.velocity_m_s[:, 0] * c + self.velocity_m_s[:, 1] * s

    def rows(self, values):
        """`values` at the rows' times."""
        return values[: -1 : round(ROW_S / self.step_s)]


class Controller:
    """Torques (N m) from targets: the forces of the nominal model `n`, and a PI loop on wheel speeds that are measured with
    noise."""

    def __init__(self, n, noise_rad_s, draw):
        r, b, j = n["wheel_radius_m"], n["half_track_m"], n["wheel_inertia_kg_m2"]
        self.r, self.b, self.friction = r, b, n["viscous_friction_n_m_s"]
        self.forward = (n["mass_kg"] + 2 * j / r**2) * r / 2
        self.turning = (n["yaw_inertia_kg_m2"] + 2 * j * b**2 / r**2) * r / (2 * b)
        self.gain = self.forward * r * 4.0
        self.sum, self.seen, self.last = np.zeros(2), np.zeros(2), np.zeros(2)
        self.noise_rad_s, self.draw = noise_rad_s, draw

    def __call__(self, asked, wheels_rad_s):
        rate = (asked - self.last) / ROW_S
        self.last = asked
        want = np.array([asked[0] - self.b * asked[1], asked[0] + self.b * asked[1]]) / self.r
        self.seen += 0.3 * (wheels_rad_s + self.noise_rad_s * self.draw.standard_normal(2) - self.seen)
        error = want - self.seen
        self.sum = np.clip(self.sum + error * ROW_S, -1.0, 1.0)
        turn = self.turning * rate[1]
        feed = self.forward * rate[0] + np.array([-turn, turn]) + self.friction * want
        return feed + self.gain * error + 2.0 * self.gain * self.sum


class Speeds:
    """Wheel speeds (rad/s) from targets, for a robot whose motors hold speeds."""

    def __init__(self, n):
        self.r, self.b = n["wheel_radius_m"], n["half_track_m"]

    def __call__(self, asked, _wheels_rad_s):
        return np.array([asked[0] - self.b * asked[1], asked[0] + self.b * asked[1]]) / self.r


def drive(body, controller, noise_per_root_hz, course, seed, noise_within_row=False, way=None):
    """One drive of `body` from rest at the origin.

    body: has step_s, begin(steps), wheels_rad_s(), step(inputs), and drive(inputs of the rows) at the end
    controller: of a random generator, what makes inputs, left and right, of targets and the wheels' speeds
    noise_per_root_hz: white noise of each input, held over a row, else white within it
    way: seed of the course, where it is not to come from `seed`
    """
    draw = np.random.default_rng(seed)
    asked = course.targets(draw if way is None else np.random.default_rng(way))
    control = controller(draw)
    rows, steps = len(asked), round(ROW_S / body.step_s)
    noise = draw.standard_normal((rows, steps, 2))
    if noise_within_row:
        noise *= noise_per_root_hz / np.sqrt(body.step_s)
    else:
        noise[:] = noise[:, :1] * noise_per_root_hz / np.sqrt(ROW_S)
    inputs = np.empty((rows, 2))
    body.begin(rows * steps)
    for k in range(rows):
        inputs[k] = control(asked[k], body.wheels_rad_s())
        for s in range(steps):
            body.step(inputs[k] + noise[k, s])
    return body.drive(inputs)
