"""Case folders: sim.toml, fit.parquet and hold.parquet as gyroid reads them, and truth.json, which it never sees."""

import json
import zlib

from drives import Controller, drive
from folders import sim_toml, write_log
from sensors import Unit, columns
from worlds import Body, nominal


def make(case, folder):
    """Writes a case's folder; its seeds follow from its name."""
    folder.mkdir(parents=True, exist_ok=True)
    believed, noise = nominal(case.robot, case.believed), case.robot.torque_noise_n_m_sqrt_s
    (folder / "sim.toml").write_text(sim_toml(believed | {"torque_noise_n_m_sqrt_s": noise}, Unit()))
    seed = zlib.crc32(case.name.encode())
    for run, name in enumerate(("fit", "hold")):
        body, controller = Body(case.robot, case.world), lambda draw: Controller(nominal(case.robot), 0.02, draw)
        made = drive(body, controller, noise, case.course, [seed, run], case.world.noise_within_row)
        write_log(folder / f"{name}.parquet", columns(made, case.sensors, [seed, run], case.without))
    (folder / "truth.json").write_text(json.dumps({"kind": case.kind, "effects": case.truth, "note": case.note}, indent=2) + "\n")
