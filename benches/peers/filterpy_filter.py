"""The filters of `gyroid::navigate` as a user of filterpy would write them: a task of `peers.py`.

MODEL.json holds the model's numbers, the first mean and covariance, and the last ones of gyroid's filter; MODEL.bin holds rows of
seven little-endian doubles: gyro, left and right wheel (rad/s), left and right torque (N m), true x and y at the row's end (m).
A step is one prediction and one update by the three readings at once, which costs filterpy less than three.
States: x, y, theta, v, omega, e, s, ln T; with slip also the speeds of the wheels.
"""

import json
import math
from pathlib import Path

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

X, Y, HEADING, SPEED, YAW_RATE, ERROR, WARM, LN_T, LEFT, RIGHT = range(10)
# Gauss and Legendre's nodes and weights on [0, 1]
NODES = [(0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18)]


def phi(z):
    """exp(-z), (1 - exp(-z))/z and the next of the kind, by their series where z is small."""
    if z < 1e-3:
        p2 = 0.5 - z * (1 / 6 - z * (1 / 24 - z * (1 / 120 - z / 720)))
        p1 = 1 - z * p2
        return 1 - z * p1, p1, p2
    p1 = -math.expm1(-z) / z
    return math.exp(-z), p1, (1 - p1) / z


class NavigationFilter(ExtendedKalmanFilter):
    """The part that both filters share: the sensors, the pose, the gyro's error."""

    def __init__(self, model, damping=0.0, yaw_damping=0.0):
        self.n = len(model["first_mean"])
        super().__init__(dim_x=self.n, dim_z=3)
        self.dt = dt = model["dt_s"]
        self.ln_t_bounds = model["ln_t_bounds"]
        self.x = np.array(model["first_mean"])
        self.P = np.array(model["first_covariance"])
        self.R = np.diag(model["reading_variances"])
        self.H = np.array(model["reading_rows"])
        self.F = np.eye(self.n)
        self.gain = np.zeros((self.n, 2))
        self.noise = np.array(model["disturbance_variances"])
        self.walk = np.zeros((self.n, self.n))
        self.walk[ERROR : WARM + 1, ERROR : WARM + 1] = model["walk_variance"]
        # the step's length never changes, and so neither does friction's part in it
        self.nodes = []
        for node, weight in NODES:
            t = node * dt
            (ev, pv, _), (_, pw, qw) = phi(damping * t), phi(yaw_damping * t)
            self.nodes.append((weight * dt, ev, t * pv, t * pw, t * t * qw))
        (ev, pv, _), (ew, pw, qw) = phi(damping * dt), phi(yaw_damping * dt)
        self.end = (ev, dt * pv, ew, dt * pw, dt * dt * qw)

    def way(self, heading, v, w, a, alpha):
        """The way over a step in x and y, and its derivatives by v, w, a and alpha."""
        dx = dy = xv = yv = xw = yw = xa = ya = xl = yl = 0.0
        for by, ev, pv, pw, qw in self.nodes:
            speed = v * ev + a * pv
            angle = heading + w * pw + alpha * qw
            c, n = by * math.cos(angle), by * math.sin(angle)
            vx, vy = speed * c, speed * n
            dx += vx
            dy += vy
            xv += ev * c
            yv += ev * n
            xa += pv * c
            ya += pv * n
            xw -= pw * vy
            yw += pw * vx
            xl -= qw * vy
            yl += qw * vx
        return dx, dy, xv, yv, xw, yw, xa, ya, xl, yl

    def predict_x(self, u):
        state = self.x.tolist()
        e, s, ln_t = state[ERROR : LN_T + 1]
        self.move(state, u)
        rate = math.exp(-ln_t)
        gone = -math.expm1(-rate * self.dt)
        decay = 1 - gone
        state[ERROR] = e + gone * (s - e)
        self.F[ERROR, ERROR : LN_T + 1] = decay, gone, -(s - e) * self.dt * rate * decay
        self.x = np.array(state)
        self.Q = (self.gain * self.noise) @ self.gain.T + self.walk

    def jacobian(self, _):
        return self.H

    def expected(self, x):
        return self.H @ x

    def step(self, readings, torques):
        self.update(readings, self.jacobian, self.expected)
        low, high = self.ln_t_bounds
        if not low <= self.x[LN_T] <= high:
            self.x[LN_T] = min(max(self.x[LN_T], low), high)
        self.predict(torques)


class RollingFilter(NavigationFilter):
    def __init__(self, model):
        super().__init__(model, model["speed_damping_per_s"], model["yaw_damping_per_s"])
        self.a_by_torque = model["acceleration_by_torque"]
        self.alpha_by_torque = model["yaw_acceleration_by_torque"]
        ev, pv, ew, pw, qw = self.end
        by = np.array([[self.a_by_torque, self.a_by_torque], [-self.alpha_by_torque, self.alpha_by_torque]])
        self.by_torque = by
        self.gain[SPEED], self.gain[HEADING], self.gain[YAW_RATE] = pv * by[0], qw * by[1], pw * by[1]
        self.F[SPEED, SPEED], self.F[YAW_RATE, YAW_RATE], self.F[HEADING, YAW_RATE] = ev, ew, pw

    def move(self, state, u):
        heading, v, w = state[HEADING : YAW_RATE + 1]
        a = self.a_by_torque * (u[0] + u[1])
        alpha = self.alpha_by_torque * (u[1] - u[0])
        dx, dy, xv, yv, xw, yw, xa, ya, xl, yl = self.way(heading, v, w, a, alpha)
        ev, pv, ew, pw, qw = self.end
        state[X] += dx
        state[Y] += dy
        state[HEADING] = heading + w * pw + alpha * qw
        state[SPEED] = v * ev + a * pv
        state[YAW_RATE] = w * ew + alpha * pw
        self.F[X, HEADING : YAW_RATE + 1] = -dy, xv, xw
        self.F[Y, HEADING : YAW_RATE + 1] = dx, yv, yw
        self.gain[:2] = np.array([[xa, xl], [ya, yl]]) @ self.by_torque


class SlipFilter(NavigationFilter):
    """Burckhardt's law; two implicit stages (Alexander 1977), each solved by Newton's method for the two forces."""

    MOVING = np.array([SPEED, YAW_RATE, LEFT, RIGHT])
    GAMMA = 1 - math.sqrt(0.5)

    def __init__(self, model):
        super().__init__(model)
        for key in ("radius_m", "half_track_m", "inverse_mass", "inverse_yaw_inertia", "inverse_wheel_inertia"):
            setattr(self, key, model[key])
        self.low_speed, self.loads, self.law = model["low_speed_m_s"], model["loads_n"], model["burckhardt"]
        g, b = self.GAMMA * self.dt, self.half_track_m
        self.own = g * (self.inverse_mass + b * b * self.inverse_yaw_inertia)
        self.other = g * (self.inverse_mass - b * b * self.inverse_yaw_inertia)
        self.by_torque = g * self.inverse_wheel_inertia
        self.keep = 1 / (1 + self.by_torque * model["viscous_friction_n_m_s"])
        # derivatives by (v, w, left, right; torque left, right) are rows of six
        self.start = np.eye(4, 6)
        self.torques = self.by_torque * np.eye(2, 6, 4)
        self.to_ground = np.array([[1, -b], [1, b]])
        self.by_forces = g * np.array(
            [[self.inverse_mass, self.inverse_mass], [-b * self.inverse_yaw_inertia, b * self.inverse_yaw_inertia]]
        )
        self.unit = np.eye(2)

    def force(self, wheel, ground, load):
        """Force, and its derivatives by the speed of the wheel and of the ground below it."""
        rim = self.radius_m * wheel
        scale = max(abs(rim), abs(ground), self.low_speed)
        inverse = 1 / scale
        slip = (rim - ground) * inverse
        by_rim, by_ground = inverse, -inverse
        if scale > self.low_speed:
            if abs(rim) >= abs(ground):
                by_rim -= slip * inverse * math.copysign(1, rim)
            else:
                by_ground -= slip * inverse * math.copysign(1, ground)
        c1, c2, c3 = self.law
        size = min(abs(slip), 1.0)
        left = math.exp(-c2 * size)
        mu = math.copysign(c1 * (1 - left) - c3 * size, slip)
        slope = load * (c1 * c2 * left - c3) if abs(slip) <= 1 else 0.0
        return load * mu, slope * by_rim * self.radius_m, slope * by_ground

    def stage(self, base, torques, forces):
        """Velocities z = base + g f(z), and their derivatives by base and torques as a function of those of the base."""
        v, w, left, right = base
        b, r, by, keep = self.half_track_m, self.radius_m, self.by_torque, self.keep
        ground_left, ground_right = v - b * w, v + b * w
        tolerance = (1e-11 * sum(self.loads)) ** 2

        def tried(fl, fr):
            wheel_left = keep * (left + by * (torques[0] - r * fl))
            wheel_right = keep * (right + by * (torques[1] - r * fr))
            on_left = self.force(wheel_left, ground_left + self.own * fl + self.other * fr, self.loads[0])
            on_right = self.force(wheel_right, ground_right + self.own * fr + self.other * fl, self.loads[1])
            miss = on_left[0] - fl, on_right[0] - fr
            return wheel_left, wheel_right, on_left, on_right, miss, miss[0] * miss[0] + miss[1] * miss[1]

        fl, fr = forces
        trial = tried(fl, fr)
        for _ in range(25):
            wheel_left, wheel_right, (_, wl, ll), (_, wr, lr), miss, size = trial
            a, d = 1 + wl * keep * by * r - ll * self.own, 1 + wr * keep * by * r - lr * self.own
            b12, b21 = -ll * self.other, -lr * self.other
            scale = 1 / (a * d - b12 * b21)
            if size <= tolerance:
                break
            step = scale * (d * miss[0] - b12 * miss[1]), scale * (a * miss[1] - b21 * miss[0])
            part = 1.0
            while part > 0.02:
                next_l, next_r = fl + part * step[0], fr + part * step[1]
                trial = tried(next_l, next_r)
                if trial[-1] < size:
                    break
                part *= 0.5
            fl, fr = next_l, next_r
        g = self.by_forces.tolist()
        after = (v + g[0][0] * (fl + fr), w + g[1][1] * (fr - fl), wheel_left, wheel_right)
        inverse = scale * np.array([[d, -b12], [-b21, a]])

        def derivative(of_base):
            free = of_base[2:] + self.torques
            cause = np.array([[wl * keep], [wr * keep]]) * free + np.array([[ll], [lr]]) * (self.to_ground @ of_base[:2])
            forces = inverse @ cause
            return np.vstack([of_base[:2] + self.by_forces @ forces, keep * (free - by * r * forces)])

        return after, derivative

    def move(self, state, u):
        heading = state[HEADING]
        before = v, w, left, right = state[SPEED], state[YAW_RATE], state[LEFT], state[RIGHT]
        b, carry = self.half_track_m, (1 - self.GAMMA) / self.GAMMA
        forces = self.force(left, v - b * w, self.loads[0])[0], self.force(right, v + b * w, self.loads[1])[0]
        middle, by_first = self.stage(before, u, forces)
        v1, w1, left1, right1 = middle
        forces = self.force(left1, v1 - b * w1, self.loads[0])[0], self.force(right1, v1 + b * w1, self.loads[1])[0]
        base = [z + carry * (m - z) for z, m in zip(before, middle)]
        after, by_second = self.stage(base, u, forces)
        a, alpha = (after[0] - v) / self.dt, (after[1] - w) / self.dt
        dx, dy, xv, yv, xw, yw, xa, ya, xl, yl = self.way(heading, v, w, a, alpha)
        pw, qw = self.end[3:]
        state[X] += dx
        state[Y] += dy
        state[HEADING] = heading + w * pw + alpha * qw
        state[SPEED], state[YAW_RATE], state[LEFT], state[RIGHT] = after

        velocities = by_second(self.start + carry * (by_first(self.start) - self.start))
        accelerations = (velocities[:2] - self.start[:2]) / self.dt
        pose = np.array([[xv, xw], [yv, yw], [0, pw]]) @ self.start[:2]
        pose += np.array([[xa, xl], [ya, yl], [0, qw]]) @ accelerations
        self.F[np.ix_(self.MOVING, self.MOVING)] = velocities[:, :4]
        self.F[:3, self.MOVING] = pose[:, :4]
        self.F[0, HEADING], self.F[1, HEADING] = -dy, dx
        self.gain[self.MOVING] = velocities[:, 4:]
        self.gain[:3] = pose[:, 4:]


def task(path):
    """A pass over the drive as a function, and what is told of it: how far x and y are off, and x. Fails if its last state is
    not that of gyroid's filter."""
    with open(path) as file:
        model = json.load(file)
    drive = np.fromfile(Path(path).with_suffix(".bin")).reshape(-1, 7)[model["settling_rows"] :]
    readings, torques, ends = np.ascontiguousarray(drive[:, :3]), drive[:, 3:5].tolist(), drive[:, 5:]
    make = SlipFilter if "burckhardt" in model else RollingFilter

    def work():
        ekf, positions = make(model), np.empty((len(drive), 2))
        for z, u, position in zip(readings, torques, positions):
            ekf.step(z, u)
            position[:] = ekf.x[:2]
        return ekf, positions

    def tell(result):
        ekf, positions = result
        std = np.array(model["last_std"])
        apart = np.max(np.abs(ekf.x - model["last_mean"]) / std)
        spread = np.max(np.abs(np.sqrt(np.diag(ekf.P)) / std - 1))
        if not (apart < 1e-6 and spread < 1e-6):
            raise ValueError(f"filterpy's filter is another one: {apart:.1e} standard deviations apart, those {spread:.1e}")
        error_m = float(np.sqrt(np.mean(np.sum((positions - ends) ** 2, axis=1))))
        return {"position error, m rms": {"estimate": error_m}}, list(enumerate(positions[:, 0].tolist()))

    return work, tell
