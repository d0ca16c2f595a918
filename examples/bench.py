"""gyroid's diagnosis of the gap of two simulators that others wrote, MuJoCo and PyBullet, on cases whose truth is sealed.

    python examples/bench.py --gyroid gyroid --out DIR [--cases N] [--only mujoco pybullet] [--length 90] [--diagnose]

Makes the cases in DIR/SIMULATOR (mujoco/make.py and pybullet/make.py; all of them are 100 and 50), prints the commitment to
their labels, asks `gyroid gap compare` what the real robot has and the simulator lacks, opens the labels and has
`gyroid gap bench score` count. What is there already is used again. With --diagnose it asks `gyroid gap diagnose` instead, which
is told the simulator's true sizes. Needs mujoco, pybullet, numpy, polars, pynacl.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

SIMULATORS = ("mujoco", "pybullet")
HERE = Path(__file__).parent


def cases(options, simulator):
    """The folder of a simulator's cases, made where it is not there, and the key to its labels."""
    folder, key = options.out / simulator, options.out / f"{simulator}.key"
    if not (folder / "commitment.txt").exists():
        command = [sys.executable, HERE / simulator / "make.py", "--out", folder, "--key", key, "--length", str(options.length), "--gyroid", options.gyroid]
        # Bullet warns of every link without inertia on the standard output
        subprocess.run(command + (["--cases", str(options.cases)] if options.cases else []), check=True, stdout=subprocess.DEVNULL)
    print(f"{simulator}: commitment {(folder / 'commitment.txt').read_text().strip()}", flush=True)
    return folder, key


def compared(case):
    """The command that compares the simulator with the robot of a case."""
    return ["compare", "--sim", case / "sim.parquet", "--real", case / "fit.parquet", "--hold", case / "hold.parquet"]


def question(options, case):
    """The command that asks about a case."""
    if options.diagnose:
        return ["diagnose", case / "sim.toml", "--fit", case / "fit.parquet", "--hold", case / "hold.parquet"]
    return compared(case)


def answer(options, case, path):
    """Asks once, and says whether there is an answer; a case without one counts as wrong."""
    if not path.exists():
        run = subprocess.run([options.gyroid, "gap", *question(options, case), "--json", path, "-q"], capture_output=True, text=True, check=False)
        if run.returncode:
            print(f"{case.name}: refused: {run.stderr.strip()}", flush=True)
            return False
    told = json.loads(path.read_text())
    closed = next((e["gap_closed"] for e in told["effects"] if e["id"] == told["main"]), None)
    shrunk = "" if closed is None else f"   gap closed {closed:.3f}"
    print(f"{case.name}: {told['verdict']:10} {told['main'] or '-':28} {', '.join(told['together'])}{shrunk}", flush=True)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gyroid", required=True, help="the program")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--cases", type=int, help="so many of each simulator")
    parser.add_argument("--only", nargs="+", choices=SIMULATORS, default=SIMULATORS)
    parser.add_argument("--length", type=float, default=90.0, help="length of a drive, s")
    parser.add_argument("--diagnose", action="store_true")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    refused = []
    for simulator in options.only:
        folder, key = cases(options, simulator)
        answers = options.out / f"{simulator}_{'diagnose' if options.diagnose else 'compare'}"
        answers.mkdir(exist_ok=True)
        asked = sorted(path.parent for path in folder.glob("*/sim.toml"))
        refused += [case.name for case in asked if not answer(options, case, answers / f"{case.name}.json")]
        score = [options.gyroid, "gap", "bench", "score", folder, "--answers", answers, "--key", key, "--json", options.out / f"{answers.name}_score.json", "--force"]
        subprocess.run(score, check=True)
    if refused:
        raise SystemExit(f"no answer: {', '.join(refused)}")


if __name__ == "__main__":
    main()
