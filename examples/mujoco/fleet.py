"""Fleets of the two-wheel robot in MuJoCo: an effect that all robots have, one that a single robot has, and what
`gyroid gap fleet` says of them.

    python fleet.py --out DIR --gyroid gyroid [--fleets 12] [--robots 5] [--drives 2] [--length 45] [--seed 1]

Each fleet has a folder a robot. Of all robots an effect is drawn, or none; from robot to robot its size scatters by a tenth. Of one
robot another effect is drawn, or none. A line a fleet tells what is so and what was said, and the last one counts. What is there
already is used again.
"""

import argparse
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / "common"), str(Path(__file__).parent)]

from cases import Case, sides
from drives import Course, drive
from folders import sim_toml, write_log
from make import ROBOT, Engine
from sensors import Sensors, columns


# size of the effect, and what it is in the engine's world or sensors
EFFECTS = {
    "wheel.radius_mismatch": (0.01, lambda s: Case(world={"radius": sides(s)})),
    "vehicle.track_width": (0.03, lambda s: Case(world={"track": 1 + s})),
    "motor.torque_gain": (0.05, lambda s: Case(world={"gain": sides(s)})),
    "vehicle.com_offset": (0.02, lambda s: Case(world={"com_ahead_m": s})),
    "vehicle.payload": (0.15, lambda s: Case(world={"load_kg": s * ROBOT.mass_kg, "load_inertia_kg_m2": s * ROBOT.yaw_inertia_kg_m2})),
    "gyro.scale_factor": (0.01, lambda s: Case(sensors=Sensors(scale=s))),
    "sensor.wheel_delay": (0.02, lambda s: Case(sensors=Sensors(wheel_delay_s=s))),
}


def together(first, second):
    """A case with what both have."""
    sensors = {k: v for k, v in vars(second.sensors).items() if v != getattr(Sensors(), k)}
    return Case(world=first.world | second.world, sensors=replace(first.sensors, **sensors))


def make(folder, options, number):
    """Writes a fleet; what is so in it: the effect of all, that of one, and which robot that is."""
    draw = np.random.default_rng([options.seed, number])
    names = [None, *EFFECTS]
    common = names[number % len(names)]
    single = draw.choice([n for n in names if n != common])
    which = int(draw.integers(options.robots))
    noise = {"torque_noise_n_m_sqrt_s": Engine.torque_noise_n_m_sqrt_s}
    folder.mkdir(parents=True)
    (folder / "sim.toml").write_text(sim_toml(Engine.nominal | noise, Engine.unit, Engine.steering))
    for robot in range(options.robots):
        case = Case()
        for effect in [common, single if robot == which else None]:
            if effect:
                mean, made_of = EFFECTS[effect]
                case = together(case, made_of(mean * (1 + 0.1 * draw.standard_normal())))
        place = folder / "drives" / f"robot_{robot + 1}"
        place.mkdir(parents=True)
        for run in range(options.drives):
            seed = [options.seed, number, robot, run]
            made = drive(Engine.body(case.world), Engine.controller, Engine.noise_per_root_hz, Course(options.length), seed)
            write_log(place / f"{run + 1}.parquet", columns(made, case.sensors, seed, unit=Engine.unit))
    truth = {"common": common, "single": single, "robot": f"robot_{which + 1}" if single else None}
    (folder / "truth.json").write_text(json.dumps(truth) + "\n")


def told(folder, options):
    """Effects that were said to be of all robots, and those of some with the robots."""
    answer = folder / "answer.json"
    if not answer.exists():
        command = [options.gyroid, "gap", "fleet", folder / "sim.toml", folder / "drives", "--json", answer, "-q"]
        subprocess.run([str(word) for word in command], check=True)
    effects = json.loads(answer.read_text())["effects"]
    common = [e["id"] for e in effects if e["reach"] == "common"]
    some = {e["id"]: [Path(u).name for u, s in zip(e["units"], e["shared"]["units"]) if s["probability"] >= 0.5]
            for e in effects if e["reach"] == "some"}
    return common, some


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--gyroid", required=True, help="the program")
    parser.add_argument("--fleets", type=int, default=12)
    parser.add_argument("--robots", type=int, default=5)
    parser.add_argument("--drives", type=int, default=2, help="of each robot")
    parser.add_argument("--length", type=float, default=45.0, metavar="S", help="length of a drive")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    count = {"common": [0, 0], "of one robot": [0, 0], "beyond them": 0}
    for number in range(options.fleets):
        folder = options.out / f"fleet_{number:02}"
        if not folder.exists():
            make(folder, options, number)
        truth, (common, some) = json.loads((folder / "truth.json").read_text()), told(folder, options)
        right_common, right_one = truth["common"] in common, some.get(truth["single"]) == [truth["robot"]]
        beyond = [e for e in common if e != truth["common"]] + [e for e, robots in some.items() if (e, robots) != (truth["single"], [truth["robot"]])]
        for kind, there, right in [("common", truth["common"], right_common), ("of one robot", truth["single"], right_one)]:
            if there:
                count[kind][0] += right
                count[kind][1] += 1
        count["beyond them"] += len(beyond)
        print(f"{folder.name}: all have {truth['common'] or 'nothing'}, {truth['robot'] or 'none'} {truth['single'] or 'nothing'}; said: all {common}, some {some}", flush=True)
    print(", ".join(f"{kind} {found[0]} of {found[1]}" if isinstance(found, list) else f"{kind} {found}" for kind, found in count.items()))


if __name__ == "__main__":
    main()
