"""A team's simulator: Clearpath's Husky (husky.urdf of pybullet_data) on Bullet, driven by its rear wheels, its motors hold speeds.

    python run.py --inputs inputs.csv --out log.parquet [--model husky.urdf] [--seed 1]

Inputs, CSV or Parquet: t_s, command_left_rad_s, command_right_rad_s; each row's speeds hold until the next row's time.
The log has a row of 10 ms: the commands, the encoders, the gyro, and ten times a second the pose. Needs pybullet, numpy, polars.
"""

import argparse
import re
import tempfile
from pathlib import Path

import numpy as np
import polars as pl
import pybullet as bullet
import pybullet_data

HUSKY = Path(pybullet_data.getDataPath()) / "husky" / "husky.urdf"
LEFT, RIGHT = ("front_left_wheel", "rear_left_wheel"), ("front_right_wheel", "rear_right_wheel")
STEP_S, ROW_S = 0.0025, 0.01
FLOOR_FRICTION = 0.6
# The rear wheels drive, rubber on a rough floor; the front ones roll without grip, as omni-wheels do. With four that grip alike
# Bullet's Husky hops, and it turns by a tenth to a third of what its wheels say, at every heading by another share.
FRONT_FRICTION, REAR_FRICTION = 0.0, 3.0
# A cylinder of Bullet stands on one edge, then on the other: the track of the file's wheels jumps by a fifth. Spheres stand on a point.
CYLINDER, SPHERE = r'<cylinder length="[^"]*" radius="([^"]*)" */>', r'<sphere radius="\1"/>'
COMMAND_STD_RAD_S = 0.02  # noise of each side, drawn anew each row
FORCE_N_M = 40.0  # greatest torque of a wheel's motor
GYRO_STD_RAD_S = 0.0018
GYRO_BIAS_STD_RAD_S = 2e-4  # drawn at power-on
ENCODER_STD_RAD_S = 0.02
POSE_EVERY, POSE_STD_M, POSE_STD_RAD = 10, 0.002, 0.002


class Husky:
    """The robot on a plane, at rest on its wheels."""

    def __init__(self, model=HUSKY):
        self.client = bullet.connect(bullet.DIRECT)
        bullet.setGravity(0, 0, -9.81)
        bullet.setTimeStep(STEP_S)
        plane = bullet.loadURDF(str(HUSKY.parents[1] / "plane.urdf"))
        bullet.changeDynamics(plane, -1, lateralFriction=FLOOR_FRICTION)
        with tempfile.TemporaryDirectory() as folder:  # a copy of the model lies beside no meshes
            Path(folder, "robot.urdf").write_text(re.sub(CYLINDER, SPHERE, Path(model).read_text()))
            Path(folder, "meshes").symlink_to(HUSKY.with_name("meshes"))
            self.robot = bullet.loadURDF(folder + "/robot.urdf", [0, 0, 0], flags=bullet.URDF_USE_INERTIA_FROM_FILE)
        joints = {bullet.getJointInfo(self.robot, j)[1].decode(): j for j in range(bullet.getNumJoints(self.robot))}
        self.wheels = [joints[name] for name in LEFT + RIGHT]
        for wheel, friction in zip(self.wheels, [FRONT_FRICTION, REAR_FRICTION] * 2, strict=True):
            bullet.changeDynamics(self.robot, wheel, lateralFriction=friction)
        self.axle_m = bullet.getLinkState(self.robot, self.wheels[1])[0][0] - self.centre()[0]
        for _ in range(400):
            self.step((0, 0))
        self.start, self.turned = self.place(), self.sides()[0]

    def step(self, speeds_rad_s):
        left, right = speeds_rad_s
        bullet.setJointMotorControlArray(self.robot, self.wheels, bullet.VELOCITY_CONTROL, targetVelocities=[left, left, right, right], forces=[FORCE_N_M] * 4)
        bullet.stepSimulation()

    def sides(self):
        """Of left and right, the mean of two wheels: angles (rad), speeds (rad/s), torques (N m)."""
        states = np.array([(angle, speed, torque) for angle, speed, _, torque in bullet.getJointStates(self.robot, self.wheels)])
        return states.reshape(2, 2, 3).mean(1).T

    def centre(self):
        """x, y (m) of the base's centre of mass, and the heading (rad)."""
        (x, y, _), turn = bullet.getBasePositionAndOrientation(self.robot)
        return np.array([x, y, bullet.getEulerFromQuaternion(turn)[2]])

    def place(self):
        """x, y (m) of the middle between the rear wheels, and the heading (rad)."""
        x, y, heading = self.centre()
        return np.array([x + self.axle_m * np.cos(heading), y + self.axle_m * np.sin(heading), heading])

    def moved(self):
        """The same from where and as it began; the heading between -pi and pi."""
        x, y, heading = self.place() - self.start
        c, s = np.cos(self.start[2]), np.sin(self.start[2])
        return np.array([c * x + s * y, c * y - s * x, (heading + np.pi) % (2 * np.pi) - np.pi])

    def yaw_rate_rad_s(self):
        """About its own vertical axis."""
        turn = bullet.getMatrixFromQuaternion(bullet.getBasePositionAndOrientation(self.robot)[1])
        return np.dot(turn[2::3], bullet.getBaseVelocity(self.robot)[1])

    def close(self):
        bullet.disconnect(self.client)


def simulate(husky, commands, draw):
    """Of each row: the wheels' angles (rad) and speeds (rad/s), the yaw rate (rad/s), position (m) and heading (rad)."""
    rows = np.empty((len(commands), 8))
    for row, command in zip(rows, commands, strict=True):
        angles, speeds, _ = husky.sides()
        row[:] = *(angles - husky.turned), *speeds, husky.yaw_rate_rad_s(), *husky.moved()
        asked = command + COMMAND_STD_RAD_S * draw.standard_normal(2)
        for _ in range(round(ROW_S / STEP_S)):
            husky.step(asked)
    rows[:, 7] = np.unwrap(rows[:, 7])
    return rows


def log(commands, rows, draw):
    """What the robot's computer would write."""
    n = len(rows)
    speed = rows[:, 2:4] + ENCODER_STD_RAD_S * draw.standard_normal((n, 2))
    gyro = rows[:, 4] + GYRO_BIAS_STD_RAD_S * draw.standard_normal() + GYRO_STD_RAD_S * draw.standard_normal(n)
    pose = rows[:, 5:] + [POSE_STD_M, POSE_STD_M, POSE_STD_RAD] * draw.standard_normal((n, 3))
    pose[np.arange(n) % POSE_EVERY != 0] = np.nan
    columns = {
        "t_s": np.arange(n) * ROW_S,
        "command_left_rad_s": commands[:, 0], "command_right_rad_s": commands[:, 1],
        "wheel_left_rad_s": speed[:, 0], "wheel_right_rad_s": speed[:, 1],
        "wheel_left_rad": rows[:, 0], "wheel_right_rad": rows[:, 1],
        "gyro_z_rad_s": gyro,
        "x_m": pose[:, 0], "y_m": pose[:, 1], "heading_rad": pose[:, 2],
    }
    return pl.DataFrame(columns, nan_to_null=True)


def read_inputs(path):
    """Speeds (rad/s) at each row of the log, left and right."""
    read = pl.read_csv(path, infer_schema_length=None) if path.endswith(".csv") else pl.read_parquet(path)
    t = read["t_s"].to_numpy() - read["t_s"][0]
    at = np.searchsorted(t, np.arange(0, t[-1] + ROW_S / 2, ROW_S) + 1e-9, side="right") - 1
    return read.select("command_left_rad_s", "command_right_rad_s").to_numpy()[at].astype(float)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default=HUSKY)
    parser.add_argument("--inputs", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = np.random.default_rng(options.seed)
    commands = read_inputs(options.inputs)
    log(commands, simulate(Husky(options.model), commands, draw), draw).write_parquet(options.out)


if __name__ == "__main__":
    main()
