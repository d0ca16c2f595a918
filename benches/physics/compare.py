"""`gyroid gap compare` on a physics engine that others wrote: MuJoCo is the simulator, and MuJoCo with an effect the robot.

    python benches/physics/compare.py --gyroid target/release/gyroid --out DIR [--cases NAME...] [--jobs 2]

Each case's folder gets a third drive, sim.parquet: the same robot in what the team believes of the world, with its own noise. gyroid
identifies the simulator from that log (a configuration is given where the log lacks torques or pose), and is scored as run.py scores a diagnosis; prints a table
and writes DIR/compare.json. Needs mujoco, numpy, polars.
"""

import argparse
import json
import os
import subprocess
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from zlib import crc32

from battery import all_cases
from making import make
from scoring import judged, rates, table


def simulate(case, path):
    """The simulator's log: what the team believes, on a course and with noise of its own."""
    import polars as pl

    from driving import drive
    from sensors import Sensors, columns

    seed = [crc32(case.name.encode()), 2]
    made = drive(case.robot, case.believed, case.course, seed)
    pl.DataFrame(columns(made, Sensors(), seed, case.without), nan_to_null=True).write_parquet(path)


def one(gyroid, out, case):
    """Makes a case and its simulator's log, compares them; its row of the table."""
    folder = out / case.name
    folder.mkdir(parents=True, exist_ok=True)
    os.chdir(folder)  # where MuJoCo writes its warnings
    if not (folder / "truth.json").exists():
        make(case, folder)
    if not (folder / "sim.parquet").exists():
        simulate(case, folder / "sim.parquet")
    command = [gyroid, "gap", "compare", "--sim", "sim.parquet", "--real", "fit.parquet", "--hold", "hold.parquet", "--json", "compare.json"]
    if case.without:  # nothing else tells mass or radius then
        command += ["--init", "sim.toml"]
    begin = time.monotonic()
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        raise RuntimeError(f"{case.name}: {run.stderr.strip()}")
    row = judged(case, json.loads((folder / "compare.json").read_text())) | {"seconds": time.monotonic() - begin}
    print(f"{case.name:26} {row['verdict']:10} {row['main'] or '-':28} {'' if row['right'] else 'MISS':5} {', '.join(row['together'])}", flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gyroid", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cases", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    cases = [c for c in all_cases() if not options.cases or c.name in options.cases]
    out = options.out.resolve()
    with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
        rows = list(pool.map(partial(one, os.path.abspath(options.gyroid), out), cases))
    found = rates(rows)
    (out / "compare.json").write_text(json.dumps({"rates": found, "cases": rows}, indent=1) + "\n")
    print("\n" + table(rows) + "\n")
    for name, (right, of) in found.items():
        if of:
            print(f"{name:32} {right}/{of} = {right / of:.3f}")


if __name__ == "__main__":
    main()
