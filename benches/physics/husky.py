"""A four-wheel robot that skids to turn: Clearpath's husky of pybullet_data (URDF by others) on Bullet.

    python benches/physics/husky.py --out DIR [--friction 0.8] [--seed 1]

Writes DIR/husky-FRICTION: a case folder as `run.py` makes them, without torques, whose nominal simulator has the geometry of the
URDF; then `gyroid gap diagnose sim.toml --fit fit.parquet --hold hold.parquet` in it. Prints the effective track by least squares
of the true yaw rate on the wheels' speeds. Needs pybullet.
"""

import argparse
from pathlib import Path

import numpy as np
import polars as pl
import pybullet as bullet
import pybullet_data

from driving import ROW_S, STEPS, Course, Drive
from making import toml
from sensors import ENCODER_STD_RAD_S, GYRO, POSE, Sensors, columns
from worlds import STEP_S

LEFT, RIGHT = (2, 4), (3, 5)  # joints of the wheels
RADIUS_M, HALF_TRACK_M = 0.17775, 0.2854  # of the URDF
FORCE_N_M = 40.0  # greatest torque of a wheel's motor


def drive(friction, course, seed):
    """One drive; the state is taken down at the engine's steps."""
    bullet.connect(bullet.DIRECT)
    bullet.setAdditionalSearchPath(pybullet_data.getDataPath())
    bullet.setGravity(0, 0, -9.81)
    bullet.setTimeStep(STEP_S)
    plane, robot = bullet.loadURDF("plane.urdf"), bullet.loadURDF("husky/husky.urdf", [0, 0, 0.0])
    bullet.changeDynamics(plane, -1, lateralFriction=1.0)
    for joint in LEFT + RIGHT:
        bullet.changeDynamics(robot, joint, lateralFriction=friction)
    asked = course.targets(np.random.default_rng(seed))
    n = len(asked) * STEPS
    told = np.empty((n + 1, 8))  # yaw rate, wheels, x, y, heading, velocity x, y

    def at(i):
        (x, y, _), q = bullet.getBasePositionAndOrientation(robot)
        v, w = bullet.getBaseVelocity(robot)
        turn = np.array(bullet.getMatrixFromQuaternion(q)).reshape(3, 3)
        left, right = (np.mean([bullet.getJointState(robot, j)[1] for j in side]) for side in (LEFT, RIGHT))
        told[i] = turn[:, 2] @ w, left, right, x, y, np.arctan2(turn[1, 0], turn[0, 0]), v[0], v[1]

    for _ in range(2000):  # comes to rest on its wheels
        for joint in LEFT + RIGHT:
            bullet.setJointMotorControl2(robot, joint, bullet.VELOCITY_CONTROL, targetVelocity=0, force=FORCE_N_M)
        bullet.stepSimulation()
    i = 0
    for v, w in asked:
        for side, sign in ((LEFT, -1), (RIGHT, 1)):
            for joint in side:
                speed = (v + sign * HALF_TRACK_M * w) / RADIUS_M
                bullet.setJointMotorControl2(robot, joint, bullet.VELOCITY_CONTROL, targetVelocity=speed, force=FORCE_N_M)
        for _ in range(STEPS):
            at(i)
            bullet.stepSimulation()
            i += 1
    at(i)
    bullet.disconnect()
    heading = np.unwrap(told[:, 5])
    place, c, s = told[:, 3:5] - told[0, 3:5], np.cos(heading[0]), np.sin(heading[0])
    place = place @ np.array([[c, -s], [s, c]])
    return Drive(told[:, 0], told[:, 1:3], np.zeros((n + 1, 2)), place, heading - heading[0], told[:, 6:8], np.zeros((len(asked), 2)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--friction", type=float, default=0.8)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    folder = options.out / f"husky-{options.friction}"
    folder.mkdir(parents=True, exist_ok=True)
    vehicle = {"mass_kg": 50.0, "yaw_inertia_kg_m2": 5.5, "half_track_m": HALF_TRACK_M, "wheel_radius_m": RADIUS_M, "wheel_inertia_kg_m2": 0.115,
               "viscous_friction_n_m_s": 0.0, "torque_noise_n_m_sqrt_s": 0.0}
    (folder / "sim.toml").write_text(toml("skid", {"gyro": GYRO, "vehicle": vehicle, "encoder": {"speed_noise_std_rad_s": ENCODER_STD_RAD_S}, "pose": POSE}))
    course = Course(120.0, speed_m_s=0.8, yaw_rate_rad_s=1.5)
    for run, name in enumerate(("fit", "hold")):
        made = drive(options.friction, course, [options.seed, run])
        turn = RADIUS_M * (made.wheels_rad_s[:, 1] - made.wheels_rad_s[:, 0]) / 2
        ahead = RADIUS_M * made.wheels_rad_s.mean(1)
        half = (turn @ turn) / (turn @ made.yaw_rate_rad_s)
        speed = made.speed_m_s
        across = made.velocity_m_s[:, 1] * np.cos(made.heading_rad) - made.velocity_m_s[:, 0] * np.sin(made.heading_rad)
        left = np.std(made.yaw_rate_rad_s - turn / half), np.std(speed - ahead), np.std(across)
        print(f"{name}: half track {half / HALF_TRACK_M - 1:+.3f} over nominal; left: yaw rate {left[0]:.4f} rad/s, speed {left[1]:.4f} m/s, sideways {left[2]:.4f} m/s")
        log = columns(made, Sensors(), [options.seed, run], ("torque",))
        pl.DataFrame(log, nan_to_null=True).write_parquet(folder / f"{name}.parquet")


if __name__ == "__main__":
    main()
