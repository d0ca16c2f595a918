#!/usr/bin/env python3
"""Time of `gyroid.fit` on arrays over that of the library alone on the same numbers.

    cargo build --release -p gyroid-python --example library
    pip install ./python
    python python/benches/overhead.py target/release/examples/library [--samples 10000000] [--repeats 3]

Prints both times, s, their ratio, and what of the second passes outside the library; the least of the repeats counts.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import gyroid
import numpy as np
from gyroid import _gyroid


def main() -> None:
    """Make the arrays, time both."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library", type=Path, help="the compiled example")
    parser.add_argument("--samples", type=int, default=10_000_000)
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    rng = np.random.default_rng(1)
    t_s = np.arange(args.samples) * (3600.0 / args.samples)
    rate_rad_s = 2e-3 * (1 - np.exp(-t_s / 240)) - 5e-3 + 2e-3 * rng.normal(size=t_s.size)
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / name for name in ("times", "rates")]
        for file, values in zip(files, (t_s, rate_rad_s), strict=True):
            values.tofile(file)
        done = subprocess.run([args.library, *files, str(args.repeats)], capture_output=True, text=True, check=True)
    command_s, functions_s = map(float, done.stdout.split())
    python_s = outside_s = np.inf
    inside_s, answer = 0.0, _gyroid.answer

    def timed(*given: Any) -> Any:
        nonlocal inside_s
        begin = time.perf_counter()
        found = answer(*given)
        inside_s = time.perf_counter() - begin
        return found

    _gyroid.answer = timed
    for _ in range(args.repeats):
        begin = time.perf_counter()
        gyroid.fit(t_s, rate_rad_s)
        whole_s = time.perf_counter() - begin
        python_s, outside_s = min(python_s, whole_s), min(outside_s, whole_s - inside_s)
    print(f"{args.samples} samples")
    print(f"library, fit and whiteness alone     {functions_s:8.3f} s")
    print(f"library, log audited and hashed too  {command_s:8.3f} s")
    print(f"gyroid.fit, with its picture         {python_s:8.3f} s   ratio {python_s / command_s:.3f}")
    print(f"  of which outside the library       {outside_s:8.3f} s")


if __name__ == "__main__":
    main()
