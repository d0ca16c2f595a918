"""What the robot's sensors write of a drive: the log's columns, with what may be wrong with a sensor."""

from dataclasses import dataclass, field

import numpy as np

from drives import ROW_S

GYRO = {  # of the unit, as its configuration states it
    "c1_rad_s": 0.0028,
    "c2_rad_s": -0.0041,
    "time_constant_s": 160.0,
    "angle_random_walk_rad_sqrt_s": 1.8e-4,
    "turn_on_bias_std_rad_s": 2.0e-4,
    "warm_up_relative_std": 0.03,
}
ENCODER_STD_RAD_S = 0.02
POSE = {"rate_hz": 10.0, "position_std_m": 0.002, "heading_std_rad": 0.002}


@dataclass(frozen=True)
class Unit:
    """What the team believes of its sensors."""

    gyro: dict = field(default_factory=lambda: GYRO)
    encoder_std_rad_s: float = ENCODER_STD_RAD_S
    pose: dict = field(default_factory=lambda: POSE)


def unit_of(simulator):
    """The unit of a simulator, a module with the constants of its sensors: its gyro does not warm up."""
    root = ROW_S**0.5
    gyro = {"c1_rad_s": 0.0, "c2_rad_s": 0.0, "time_constant_s": 100.0, "angle_random_walk_rad_sqrt_s": simulator.GYRO_STD_RAD_S * root,
            "turn_on_bias_std_rad_s": simulator.GYRO_BIAS_STD_RAD_S, "warm_up_relative_std": 0.03}
    pose = {"rate_hz": 1 / ROW_S / simulator.POSE_EVERY, "position_std_m": simulator.POSE_STD_M, "heading_std_rad": simulator.POSE_STD_RAD}
    return Unit(gyro, simulator.ENCODER_STD_RAD_S, pose)


@dataclass(frozen=True)
class Sensors:
    """What is so with the sensors and not in the nominal simulator; the defaults hold nothing."""

    scale: float = 0.0  # gain error of the gyro
    asymmetry: float = 0.0  # its gain at positive rates minus that at negative ones
    rectification: float = 0.0  # bias over speed squared, rad/s per (m/s)²
    step_rad_s: float = 0.0  # a jump of its bias, at a time drawn anew in each drive
    gyro_delay_s: float = 0.0
    gyro_noise: float = 1.0  # over nominal
    gyro_limit_rad_s: float = np.inf  # where its output saturates
    acceleration: float = 0.0  # rad/s per m/s² of forward acceleration
    wheel_delay_s: float = 0.0
    wheel_noise: float = 1.0
    wheel_low_pass_s: float = 0.0  # time constant
    lattice_rad_s: float = 0.0  # of the wheels' speeds
    ticks: int = 0  # a revolution: speed is the count of ticks in a row over the row
    bursts: tuple = None  # loss inside bursts, their mean length s, their share of the time; right wheel
    single_losses: tuple = None  # probability that a tick is lost, ticks a revolution; right wheel
    pose_delay_s: float = 0.0
    pose_noise: float = 1.0


def late(values, delay_s, step_s):
    """`values` at each step as they were `delay_s` before (at rest before the first)."""
    if not delay_s:
        return values
    times = np.arange(len(values)) * step_s
    of = [np.interp(times - delay_s, times, column) for column in np.atleast_2d(values.T)]
    return np.array(of).T.reshape(values.shape)


def low_pass(values, constant_s, step_s):
    """First order, from rest."""
    out, share = np.empty_like(values), 1 - np.exp(-step_s / constant_s)
    state = values[0].copy()
    for k, value in enumerate(values):
        state = state + share * (value - state)
        out[k] = state
    return out


def gyro(drive, sensors, believed, since_power_on_s, draw):
    """Readings at each row, rad/s: warm-up and turn-on bias drawn within their stated repeatability."""
    rate = drive.yaw_rate_rad_s
    gain = 1 + sensors.scale + 0.5 * sensors.asymmetry * np.sign(rate)
    rate = np.clip(gain * rate, -sensors.gyro_limit_rad_s, sensors.gyro_limit_rad_s)
    rate = drive.rows(late(rate, sensors.gyro_delay_s, drive.step_s))
    speed = drive.rows(drive.speed_m_s)
    pushed = drive.rows(np.gradient(drive.speed_m_s, drive.step_s))
    spread = believed["warm_up_relative_std"]
    c1 = believed["c1_rad_s"] * (1 + spread * draw.standard_normal())
    constant = believed["time_constant_s"] * (1 + spread * draw.standard_normal())
    c2 = believed["c2_rad_s"] + believed["turn_on_bias_std_rad_s"] * draw.standard_normal()
    error = c1 * (1 - np.exp(-since_power_on_s / constant)) + c2
    rows = len(rate)
    error = error + sensors.step_rad_s * (np.arange(rows) >= rows * draw.uniform(0.25, 0.75))
    error = error + sensors.rectification * speed**2 + sensors.acceleration * pushed
    std = sensors.gyro_noise * believed["angle_random_walk_rad_sqrt_s"] / np.sqrt(ROW_S)
    return rate + error + std * draw.standard_normal(rows)


def wheels(drive, sensors, std_rad_s, draw):
    """Readings at each row, (rows, 2), rad/s."""
    true = drive.wheels_rad_s
    if sensors.wheel_low_pass_s:
        true = low_pass(true, sensors.wheel_low_pass_s, drive.step_s)
    read = drive.rows(late(true, sensors.wheel_delay_s, drive.step_s)).copy()
    if sensors.ticks:
        unit = 2 * np.pi / sensors.ticks
        counts = np.floor(drive.rows(drive.turned_rad) / unit + draw.uniform(size=2))
        return np.diff(counts, axis=0, prepend=counts[:1]) * unit / ROW_S
    if sensors.bursts:
        loss, mean_s, share = sensors.bursts
        inside = in_bursts(len(read), mean_s, share, draw)
        read[inside, 1] *= 1 - loss
    if sensors.single_losses:
        probability, ticks = sensors.single_losses
        unit = 2 * np.pi / ticks / ROW_S
        lost = draw.binomial(np.rint(np.abs(read[:, 1]) / unit).astype(int), probability)
        read[:, 1] -= np.sign(read[:, 1]) * lost * unit
    read = read + sensors.wheel_noise * std_rad_s * draw.standard_normal(read.shape)
    if sensors.lattice_rad_s:
        read = sensors.lattice_rad_s * np.rint(read / sensors.lattice_rad_s)
    return read


def in_bursts(rows, mean_s, share, draw):
    """Which rows lie in bursts: lengths and gaps exponential."""
    inside, k = np.zeros(rows, bool), 0
    while k < rows:
        k += round(draw.exponential(mean_s * (1 / share - 1)) / ROW_S)
        end = k + max(1, round(draw.exponential(mean_s) / ROW_S))
        inside[k:end] = True
        k = end
    return inside


def pose(drive, sensors, believed, draw):
    """x, y (m) and heading (rad) at each row; NaN between the reference's samples."""
    true = np.column_stack([drive.position_m, drive.heading_rad])
    read = drive.rows(late(true, sensors.pose_delay_s, drive.step_s)).copy()
    std = np.array([believed["position_std_m"]] * 2 + [believed["heading_std_rad"]])
    read += sensors.pose_noise * std * draw.standard_normal(read.shape)
    every = round(1 / believed["rate_hz"] / ROW_S)
    read[np.arange(len(read)) % every != 0] = np.nan
    return read


def columns(drive, sensors, seed, without=(), unit=Unit()):
    """The log: a dict of column to values, one a row of 10 ms. `without` leaves out "torque", "pose" or "gyro"."""
    draw = np.random.default_rng([*seed, 1])
    rows = len(drive.yaw_rate_rad_s) // round(ROW_S / drive.step_s)
    t = np.arange(rows) * ROW_S
    since = t + draw.uniform(5.0, 200.0)
    z = gyro(drive, sensors, unit.gyro, since, draw)
    turning, where = wheels(drive, sensors, unit.encoder_std_rad_s, draw), pose(drive, sensors, unit.pose, draw)
    log = {"t_s": t, "time_since_power_on_s": since}
    if "torque" not in without:
        log |= {"torque_left_n_m": drive.torques_n_m[:, 0], "torque_right_n_m": drive.torques_n_m[:, 1]}
    if drive.commands_rad_s is not None:
        log |= {"command_left_rad_s": drive.commands_rad_s[:, 0], "command_right_rad_s": drive.commands_rad_s[:, 1]}
    if "gyro" not in without:
        log["gyro_z_rad_s"] = z
    log |= {"wheel_left_rad_s": turning[:, 0], "wheel_right_rad_s": turning[:, 1]}
    if "pose" not in without:
        log |= {"x_m": where[:, 0], "y_m": where[:, 1], "heading_rad": where[:, 2]}
    return log
