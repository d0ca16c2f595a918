"""How far the gap of each case shrinks in its own simulator: under the model that gyroid patches, and under the true one.

    python examples/shrinkage.py --gyroid gyroid --out DIR [--only mujoco pybullet] [--cases N]

DIR holds cases that bench.py made, asked and opened. Asked again, with --patch and --simulate, are those with one effect that a
model file can hold. Both shares are those of `gyroid gap compare`, on the recording held out. Needs what bench.py needs.
"""

import argparse
import ast
import importlib
import json
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from bench import HERE, SIMULATORS, compared


def engine_of(simulator):
    """Of its module `make`: both simulators have one of that name, so that one process takes one of them."""
    sys.path[:0] = [str(HERE / "common"), str(HERE / simulator)]
    return importlib.import_module("make").Engine


def world_of(label):
    """Settings of the real robot's world; none where its effect is no one effect of the model file."""
    if len(label["effects"]) != 1 or not label["world"] or next(iter(label["effects"])).startswith("x."):
        return None
    return {name: ast.literal_eval(told) for name, told in label["world"].items()}


def closed(gyroid, case, engine, true=None):
    """Share of the gap that the patched model closes, or the model `true` in its place; none where nothing is written."""
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder, engine.model.name)
        model.write_text(engine.model.read_text())
        command = f'm={{model}}; [ "$m" = {shlex.quote(str(model))} ] || m={shlex.quote(str(true))}; ' if true else "m={model}; "
        command += f'{shlex.quote(sys.executable)} {shlex.quote(str(engine.run_py.resolve()))} --model "$m" --inputs {{inputs}} --out {{log}}'
        written = ["--patch", model, "-o", Path(folder, "copy" + model.suffix), "--simulate", command, "--json", "-", "-q"]
        asked = [gyroid, "gap", *compared(case), *written]
        told = subprocess.run(asked, capture_output=True, text=True, check=False)
    if told.returncode not in (0, 3):
        print(f"{case.name}: refused: {told.stderr.strip()}", flush=True)
        return None
    patch = json.loads(told.stdout).get("patch") or {}
    return (patch.get("replay") or {}).get("closed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gyroid", required=True, help="the program")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="+", choices=SIMULATORS, default=SIMULATORS)
    parser.add_argument("--cases", type=int, help="so many of each simulator at most")
    options = parser.parse_args()
    if len(options.only) > 1:
        for simulator in options.only:
            again = [sys.executable, __file__, *sys.argv[1:], "--only", simulator]
            subprocess.run(again, check=True)
        return
    [simulator] = options.only
    engine = engine_of(simulator)
    from folders import unsealed

    cases = options.out / simulator
    worlds = {name: world_of(label) for name, label in sorted(unsealed(cases, options.out / f"{simulator}.key").items())}
    shares = {}
    for name, world in [(name, world) for name, world in worlds.items() if world][: options.cases]:
        with tempfile.NamedTemporaryFile("w", suffix=engine.model.suffix) as true:
            true.write(engine.described(world))
            true.flush()
            patched, best = closed(options.gyroid, cases / name, engine), closed(options.gyroid, cases / name, engine, true.name)
        shares[name] = patched, best
        print(f"{name}: {world}: patched {patched}, true {best}", flush=True)
    # a true model that closes next to nothing says nothing of a patch
    ratios = [(patched or 0.0) / best for patched, best in shares.values() if best and best > 0.2]
    print(f"{simulator}: {len(shares)} cases, {sum(patched is not None for patched, _ in shares.values())} with a patch")
    if ratios:
        print(f"of what the true model closes the patched one closes, median of {len(ratios)}: {np.median(ratios):.3f}, "
              f"0.8 or more in {sum(r >= 0.8 for r in ratios)}")


if __name__ == "__main__":
    main()
