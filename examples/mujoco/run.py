"""A team's simulator: the two-wheel robot of robot.xml in MuJoCo, driven by wheel torques.

    python run.py --model robot.xml --inputs inputs.csv --out log.parquet [--seed 1]

Inputs, CSV or Parquet: t_s, torque_left_n_m, torque_right_n_m; each row's torques hold until the next row's time.
The log has a row of 10 ms: the torques, the encoders, the gyro, and ten times a second the pose. Needs mujoco, numpy, polars.
"""

import argparse

import mujoco
import numpy as np
import polars as pl

ROW_S = 0.01
TORQUE_STD_N_M = 0.01  # noise of each motor, drawn anew each row
GYRO_STD_RAD_S = 0.0018
GYRO_BIAS_STD_RAD_S = 2e-4  # drawn at power-on
ENCODER_STD_RAD_S = 0.02
POSE_EVERY, POSE_STD_M, POSE_STD_RAD = 10, 0.002, 0.002


def simulate(model, torques, draw):
    """Of each row: the wheels' angles (rad) and speeds (rad/s), the yaw rate (rad/s), position (m) and heading (rad)."""
    data = mujoco.MjData(model)
    wheels = [model.joint(name) for name in ("left", "right")]
    angle, speed = [w.qposadr[0] for w in wheels], [w.dofadr[0] for w in wheels]
    steps = round(ROW_S / model.opt.timestep)
    rows = np.empty((len(torques), 8))
    for row, torque in zip(rows, torques, strict=True):
        w, x, y, z = data.qpos[3:7]
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        row[:] = *data.qpos[angle], *data.qvel[speed], data.qvel[5], *data.qpos[:2], heading
        data.ctrl[:] = torque + TORQUE_STD_N_M * draw.standard_normal(2)
        mujoco.mj_step(model, data, steps)
    rows[:, 7] = np.unwrap(rows[:, 7])
    return rows


def log(torques, rows, draw):
    """What the robot's computer would write."""
    n = len(rows)
    speed = rows[:, 2:4] + ENCODER_STD_RAD_S * draw.standard_normal((n, 2))
    gyro = rows[:, 4] + GYRO_BIAS_STD_RAD_S * draw.standard_normal() + GYRO_STD_RAD_S * draw.standard_normal(n)
    pose = rows[:, 5:] + [POSE_STD_M, POSE_STD_M, POSE_STD_RAD] * draw.standard_normal((n, 3))
    pose[np.arange(n) % POSE_EVERY != 0] = np.nan
    columns = {
        "t_s": np.arange(n) * ROW_S,
        "torque_left_n_m": torques[:, 0], "torque_right_n_m": torques[:, 1],
        "wheel_left_rad_s": speed[:, 0], "wheel_right_rad_s": speed[:, 1],
        "wheel_left_rad": rows[:, 0], "wheel_right_rad": rows[:, 1],
        "gyro_z_rad_s": gyro,
        "x_m": pose[:, 0], "y_m": pose[:, 1], "heading_rad": pose[:, 2],
    }
    return pl.DataFrame(columns, nan_to_null=True)


def read_inputs(path):
    """Torques (N m) at each row of the log, left and right."""
    read = pl.read_csv(path, infer_schema_length=None) if path.endswith(".csv") else pl.read_parquet(path)
    t = read["t_s"].to_numpy() - read["t_s"][0]
    at = np.searchsorted(t, np.arange(0, t[-1] + ROW_S / 2, ROW_S) + 1e-9, side="right") - 1
    return read.select("torque_left_n_m", "torque_right_n_m").to_numpy()[at].astype(float)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="robot.xml")
    parser.add_argument("--inputs", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = np.random.default_rng(options.seed)
    torques = read_inputs(options.inputs)
    rows = simulate(mujoco.MjModel.from_xml_path(options.model), torques, draw)
    log(torques, rows, draw).write_parquet(options.out)


if __name__ == "__main__":
    main()
