"""Drives of a robot in a MuJoCo world: a random course, the controller that follows it, and what the engine makes of it."""

from dataclasses import dataclass

import mujoco
import numpy as np

from worlds import ENGINE_STEP_S, STEP_S, compiled, nominal, wheel_dofs

ROW_S = 0.01  # one row of the log, s
STEPS = round(ROW_S / STEP_S)  # times in a row at which the engine's state is taken down
WITHIN = round(STEP_S / ENGINE_STEP_S)


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
    """What the engine made: at n + 1 times, STEP_S apart, the truth, at each row the torques."""

    yaw_rate_rad_s: np.ndarray  # about the chassis' own z: what a gyro there reads
    wheels_rad_s: np.ndarray  # (n + 1, 2), wheel against chassis
    turned_rad: np.ndarray  # (n + 1, 2), the wheels' angles
    position_m: np.ndarray  # (n + 1, 2), the axle's middle
    heading_rad: np.ndarray  # unwrapped
    velocity_m_s: np.ndarray  # (n + 1, 2), of the axle's middle, in the world's axes
    torques_n_m: np.ndarray  # (rows, 2), commanded

    @property
    def speed_m_s(self):
        """Forward speed at each step."""
        c, s = np.cos(self.heading_rad), np.sin(self.heading_rad)
        return self.velocity_m_s[:, 0] * c + self.velocity_m_s[:, 1] * s

    def rows(self, values):
        """`values` at the rows' times."""
        return values[:-1:STEPS]


class Controller:
    """Torques (N m) from targets: the nominal model's forces, and a PI loop on wheel speeds that are measured with noise."""

    def __init__(self, robot, noise_rad_s, draw):
        n = nominal(robot)
        r, b, j = n["wheel_radius_m"], n["half_track_m"], n["wheel_inertia_kg_m2"]
        self.r, self.b, self.friction = r, b, n["viscous_friction_n_m_s"]
        self.forward = (n["mass_kg"] + 2 * j / r**2) * r / 2
        self.turning = (n["yaw_inertia_kg_m2"] + 2 * j * b**2 / r**2) * r / (2 * b)
        self.gain = self.forward * r * 4.0
        self.sum, self.seen, self.last = np.zeros(2), np.zeros(2), np.zeros(2)
        self.noise_rad_s, self.draw = noise_rad_s, draw

    def torques(self, asked, wheels_rad_s):
        rate = (asked - self.last) / ROW_S
        self.last = asked
        want = np.array([asked[0] - self.b * asked[1], asked[0] + self.b * asked[1]]) / self.r
        self.seen += 0.3 * (wheels_rad_s + self.noise_rad_s * self.draw.standard_normal(2) - self.seen)
        error = want - self.seen
        self.sum = np.clip(self.sum + error * ROW_S, -1.0, 1.0)
        turn = self.turning * rate[1]
        feed = self.forward * rate[0] + np.array([-turn, turn]) + self.friction * want
        return feed + self.gain * error + 2.0 * self.gain * self.sum


def drive(robot, world, course, seed):
    """One drive in a world, from rest at the origin."""
    model = compiled(robot, world)
    data = mujoco.MjData(model)
    draw = np.random.default_rng(seed)
    asked = course.targets(draw)
    controller = Controller(robot, 0.02, draw)
    rows = len(asked)
    left_right = wheel_dofs(model)
    angles = [model.jnt_qposadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, n)] for n in ("left", "right")]
    q, v, ctrl = data.qpos, data.qvel, data.ctrl
    told_q, told_v = np.empty((rows * STEPS + 1, model.nq)), np.empty((rows * STEPS + 1, model.nv))
    torques = np.empty((rows, 2))
    noise = draw.standard_normal((rows, STEPS, 2))
    if world.noise_within_row:
        noise *= robot.torque_noise_n_m_sqrt_s / np.sqrt(STEP_S)
    else:
        noise[:] = noise[:, :1] * robot.torque_noise_n_m_sqrt_s / np.sqrt(ROW_S)
    i = 0
    for k in range(rows):
        torques[k] = controller.torques(asked[k], v[left_right])
        for s in range(STEPS):
            told_q[i], told_v[i] = q, v
            ctrl[:] = torques[k] + noise[k, s]
            for hook in world.hooks:
                hook(model, data, i * STEP_S)
            mujoco.mj_step(model, data, WITHIN)
            i += 1
    told_q[i], told_v[i] = q, v
    if world.guided:
        heading, rate = told_q[:, 3], told_v[:, 3]
    else:
        w, x, y, z = told_q[:, 3:7].T
        heading, rate = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))), told_v[:, 5]
    return Drive(rate, told_v[:, left_right], told_q[:, angles], told_q[:, :2], heading, told_v[:, :2], torques)
