"""A drive of the robot of `examples/mujoco` with a payload, and the fit of its mass and yaw inertia by mujoco.sysid.

The drive is logged by `examples/mujoco/run.py` with noise of torques, gyro and encoders; the pose is left out. The payload sits
in the chassis's centre of mass.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
import polars

EXAMPLE = Path(__file__).parents[2] / "examples" / "mujoco"
sys.path.insert(0, str(EXAMPLE))
import run

PAYLOAD_KG, PAYLOAD_KG_M2 = 1.5, 0.021
NAMES = "payload, kg", "added yaw inertia, kg m²"
DRIVE_S = 20.0


def torques():
    """Torques (N m) of each row, left and right: a straight part and a turning part, two sines each."""
    t = np.arange(0.0, DRIVE_S, run.ROW_S)
    wave = lambda hz: np.cos(2 * np.pi * hz * t)
    straight, turning = 0.15 * wave(0.2) + 0.1 * wave(0.7), 0.06 * wave(0.3) + 0.06 * wave(1.1)
    return np.column_stack([straight - turning, straight + turning])


def write(path):
    """Writes the log of the loaded robot; gives the true mass and yaw inertia of the payload."""
    spec = mujoco.MjSpec.from_file(str(EXAMPLE / "robot.xml"))
    chassis = spec.body("chassis")
    chassis.mass += PAYLOAD_KG
    chassis.inertia = chassis.inertia + [0, 0, PAYLOAD_KG_M2]
    draw, commanded = np.random.default_rng(1), torques()
    log = run.log(commanded, run.simulate(spec.compile(), commanded, draw), draw)
    log.drop("wheel_left_rad", "wheel_right_rad", "x_m", "y_m", "heading_rad").write_parquet(path)
    return dict(zip(NAMES, (PAYLOAD_KG, PAYLOAD_KG_M2), strict=True))


def fit(path):
    """The fit as a function: estimates, standard deviations and intervals of both, from the speeds of the wheels."""
    from mujoco import sysid

    if not hasattr(sysid, "optimize"):
        raise ModuleNotFoundError("mujoco.sysid lacks what it needs: pip install 'mujoco[sysid]'")
    spec = mujoco.MjSpec.from_file(str(EXAMPLE / "robot.xml"))
    for side in ("left", "right"):
        spec.add_sensor(name=f"{side}_speed", type=mujoco.mjtSensor.mjSENS_JOINTVEL, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=side)
    model = spec.compile()
    log = polars.read_parquet(path)
    t = log["t_s"].to_numpy()
    # a row's torques hold until the next row
    within = round(run.ROW_S / model.opt.timestep)
    held = np.repeat(log.select("torque_left_n_m", "torque_right_n_m").to_numpy(), within, axis=0)
    control = sysid.TimeSeries(np.arange(len(held)) * model.opt.timestep, held)
    speeds = log.select("wheel_left_rad_s", "wheel_right_rad_s").to_numpy()
    measured = sysid.TimeSeries.from_names(t, speeds, model)
    data = mujoco.MjData(model)
    start = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
    chassis = spec.body("chassis")
    mass, inertia = chassis.mass, np.array(chassis.inertia)

    def loaded(spec, parameter):
        spec.body("chassis").mass = mass + parameter.value[0]

    def turned(spec, parameter):
        spec.body("chassis").inertia = inertia + [0, 0, parameter.value[0]]

    sequences = sysid.ModelSequences("robot", spec, "drive", start, control, measured)
    residual = sysid.build_residual_fn(models_sequences=[sequences])

    def work():
        parameters = sysid.ParameterDict()
        parameters.add(sysid.Parameter("payload", nominal=0.0, min_value=-5.0, max_value=30.0, modifier=loaded))
        parameters.add(sysid.Parameter("yaw inertia", nominal=0.0, min_value=-0.1, max_value=1.0, modifier=turned))
        found, result = sysid.optimize(initial_params=parameters, residual_fn=residual, verbose=False)
        residuals, _, _ = residual(result.x, found)
        covariance, half = sysid.calculate_intervals(residuals, result.jac)
        found = zip(NAMES, result.x, np.sqrt(np.diag(covariance)), half, strict=True)
        return {n: {"estimate": x, "std": std, "ci95": [x - by, x + by]} for n, x, std, by in found}

    return work
