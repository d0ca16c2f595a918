"""Case folders: sim.toml, fit.parquet and hold.parquet as gyroid reads them, and truth.json, which it never sees."""

import json
import zlib

import polars as pl

from driving import ROW_S, drive
from sensors import ENCODER_STD_RAD_S, GYRO, POSE, columns
from worlds import nominal


def toml(steering, tables):
    """A configuration of schema 1 of a drive."""
    lines = ["schema = 1", 'kind = "driving"', f"sample_time_s = {ROW_S}"]
    for name, table in tables.items():
        lines += ["", f"[{name}]"] + ([f'steering = "{steering}"'] if name == "vehicle" else [])
        lines += [f"{key} = {float(value)!r}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def sim_toml(case):
    """The nominal simulator: what the team believes of robot and sensors."""
    vehicle = nominal(case.robot, case.believed) | {"torque_noise_n_m_sqrt_s": case.robot.torque_noise_n_m_sqrt_s}
    return toml("differential", {"gyro": GYRO, "vehicle": vehicle, "encoder": {"speed_noise_std_rad_s": ENCODER_STD_RAD_S}, "pose": POSE})


def make(case, folder):
    """Writes a case's folder; its seeds follow from its name."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "sim.toml").write_text(sim_toml(case))
    seed = zlib.crc32(case.name.encode())
    for run, name in enumerate(("fit", "hold")):
        made = drive(case.robot, case.world, case.course, [seed, run])
        log = columns(made, case.sensors, [seed, run], case.without)
        pl.DataFrame(log, nan_to_null=True).write_parquet(folder / f"{name}.parquet")
    (folder / "truth.json").write_text(json.dumps({"kind": case.kind, "effects": case.truth, "note": case.note}, indent=2) + "\n")
