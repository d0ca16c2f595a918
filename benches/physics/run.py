"""gyroid's diagnosis of drives on a physics engine that others wrote (MuJoCo).

    python benches/physics/run.py --gyroid target/release/gyroid --out DIR [--cases NAME...] [--jobs 2] [--strict] [--check] [--remake] [--table]

Makes each case's folder in DIR (sim.toml, fit.parquet, hold.parquet), has `gyroid gap diagnose` diagnose it, and scores the
answers; prints a table, writes DIR/results.json and DIR/table.md. Folders that are there are used again; --remake makes them
anew, and --table prints what the last diagnoses of all cases said; with --strict it is an error if one is wrong. --check instead measures how far the engine's robot without
effects departs from the nominal equations.
Where a constant that was found has a place in the nominal simulator, it is entered there and the case diagnosed once more: the
effect must not be named again. Needs mujoco, numpy, polars.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[2] / "examples" / folder) for folder in ("common", "mujoco")]

from battery import all_cases
from making import make
from scoring import AIMS, judged, rates, table

ENTRIES = {  # effect: {key of sim.toml: factor by which the effect changes it}
    "wheel.radius_scale": {"wheel_radius_m": lambda p: 1 + p["relative"]},
    "vehicle.track_width": {"half_track_m": lambda p: 1 + p["relative"]},
    "vehicle.payload": {"mass_kg": lambda p: 1 + p["mass_relative"],
                        "yaw_inertia_kg_m2": lambda p: 1 + p.get("inertia_relative", p["mass_relative"])},
    "gyro.noise_level": {"angle_random_walk_rad_sqrt_s": lambda p: p["noise_over_nominal"]},
    "encoder.noise_level": {"speed_noise_std_rad_s": lambda p: p["noise_over_nominal"]},
    "pose.noise_level": {k: lambda p: p["noise_over_nominal"] for k in ("position_std_m", "heading_std_rad")},
}


def diagnose(gyroid, folder, config, answer, *more):
    """The answer (None if refused), seconds of processor time, and what the program said."""
    command = [gyroid, "gap", "diagnose", config, "--fit", "fit.parquet", "--hold", "hold.parquet", "--json", answer, *more]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    path = folder / answer
    read = json.loads(path.read_text()) if run.returncode == 0 else None
    return read, seconds, (run.stderr or run.stdout).strip()


def entered(folder, answer):
    """sim.toml with what was found entered where the nominal simulator has a place for it; the effects entered."""
    text, done = (folder / "sim.toml").read_text(), []
    for effect in answer["effects"]:
        if effect["id"] in answer["together"] and effect["id"] in ENTRIES:
            for key, factor in ENTRIES[effect["id"]].items():
                text = re.sub(rf"^{key} = (.*)$", lambda m, f=factor: f"{key} = {float(m[1]) * f(effect['parameters'])!r}", text, flags=re.M)
            done.append(effect["id"])
    (folder / "entered.toml").write_text(text)
    return done


def one(gyroid, out, remake, case):
    """Makes a case, diagnoses it, and again with what was found; its row of the table, which is kept in the folder."""
    folder = out / case.name
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)  # where MuJoCo writes its warnings
    if remake or not (folder / "truth.json").exists():
        make(case, folder)
    answer, seconds, said = diagnose(gyroid, folder, "sim.toml", "answer.json", "--write-sim", "augmented.toml")
    if answer is None:
        raise RuntimeError(f"{case.name}: {said}")
    row = judged(case, answer) | {"seconds": seconds}
    if answer["verdict"] == "identified" and case.kind in ("single", "pair"):
        again, _, said = diagnose(gyroid, folder, "augmented.toml", "again.json")
        row["augmented"] = said.splitlines()[0] if again is None else again["together"]
        done = entered(folder, answer)
        if done:
            again = diagnose(gyroid, folder, "entered.toml", "again.json")[0]
            row["again"] = sorted(set(again["together"]) & set(done))
            row["again_verdict"], row["again_together"] = again["verdict"], again["together"]
    (folder / "row.json").write_text(json.dumps(row) + "\n")
    print(f"{case.name:26} {row['verdict']:10} {row['main'] or '-':28} {'' if row['right'] else 'MISS':5} {', '.join(row['together'])}", flush=True)
    return row


def check():
    """Prints slip, sideways slide and the misfit of the nominal equations over a row in a world without effects."""
    import numpy as np

    from drives import ROW_S, Controller, Course, drive
    from worlds import STEP_S, Body, Robot, World, nominal

    body, n = Body(Robot(), World()), nominal(Robot())
    d, steps = drive(body, lambda draw: Controller(n, 0.02, draw), 0.0, Course(60.0), 1), round(ROW_S / STEP_S)
    r, b, j = n["wheel_radius_m"], n["half_track_m"], n["wheel_inertia_kg_m2"]
    v, w = d.speed_m_s, d.yaw_rate_rad_s
    slip = d.wheels_rad_s - np.column_stack([v - b * w, v + b * w]) / r
    across = d.velocity_m_s[:, 1] * np.cos(d.heading_rad) - d.velocity_m_s[:, 0] * np.sin(d.heading_rad)
    k = -(across @ (v * w)) / ((v * w) @ (v * w))
    friction = n["viscous_friction_n_m_s"] * d.wheels_rad_s[:-1].reshape(-1, steps, 2).mean(1)
    net = d.torques_n_m - friction
    dv = np.diff(v[::steps]) - ROW_S * net.sum(1) / r / (n["mass_kg"] + 2 * j / r**2)
    dw = np.diff(w[::steps]) - ROW_S * b * (net[:, 1] - net[:, 0]) / r / (n["yaw_inertia_kg_m2"] + 2 * j * b**2 / r**2)
    print(f"step of the engine {body.model.opt.timestep} s, row {ROW_S} s, 60 s of driving")
    print(f"slip of the wheels: rms {slip.std():.1e}, greatest {abs(slip).max():.1e} rad/s, of speeds of {d.wheels_rad_s.std():.1f} rad/s rms")
    print(f"sideways speed: {k:.1e} s times v ω")
    print(f"speed over a row: rms {dv.std():.1e} m/s off the equation, of {np.diff(v[::steps]).std():.1e}")
    print(f"yaw rate over a row: rms {dw.std():.1e} rad/s off the equation, of {np.diff(w[::steps]).std():.1e}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gyroid")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--cases", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--remake", action="store_true")
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--strict", action="store_true")
    options = parser.parse_args()
    if options.check:
        return check()
    if not options.out or not (options.gyroid or options.table):
        parser.error("--gyroid and --out, --table and --out, or --check")
    cases = [c for c in all_cases() if not options.cases or c.name in options.cases]
    out = options.out.resolve()
    if options.table:
        rows = [json.loads(row.read_text()) for row in (out / c.name / "row.json" for c in cases) if row.exists()]
    else:
        with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
            rows = list(pool.map(partial(one, os.path.abspath(options.gyroid), out, options.remake), cases))
    found = rates(rows)
    (out / "results.json").write_text(json.dumps({"rates": found, "cases": rows}, indent=1) + "\n")
    (out / "table.md").write_text(table(rows) + "\n")
    print("\n" + table(rows) + "\n")
    for name, (right, of) in found.items():
        if of:
            aim = f"   aim {AIMS[name]:.2f}" if name in AIMS else ""
            print(f"{name:32} {right}/{of} = {right / of:.3f}{aim}")
    wrong = [row["case"] for row in rows if not row["right"]]
    if options.strict and (wrong or len(rows) != len(options.cases or cases)):
        raise SystemExit(f"wrong: {wrong}; {len(rows)} cases")


if __name__ == "__main__":
    main()
