"""How wrong K is when the gyro warms up: `gyroid noise` beside what other tools read off the Allan deviation.

    python benches/random_walk.py --gyroid target/release/gyroid [--logs 50] [--json FILE]

Logs of three hours at 10 Hz with N = 1.7e-4 rad/s/sqrt(Hz), K = 2e-6 rad/s/sqrt(s) and a warm-up of 2e-3 rad/s in 600 s, seeds
1, 2, ... Needs numpy, pandas, scipy and allan-variance (PyPI).

- allan-variance: compute_avar and estimate_parameters, with all its terms and with white noise and walk alone.
- slope: the procedure of allan_variance_ros (scripts/analysis.py, Rate Random Walk): a line of slope 1/2 laid through the
  logarithms of the deviation by least squares, read at 3 s; through all averaging times up to 1000 s as it does, and through those
  beyond the lowest point, as textbooks do.

Prints the root mean square error of K of each. Ends with 1 unless that of gyroid is at least ten times smaller than the others'.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from allan_variance import compute_avar, estimate_parameters

STEP_S, SAMPLES = 0.1, 108_000
N, K, C1, T = 1.7e-4, 2e-6, 2e-3, 600.0


def simulated(seed):
    draw = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * STEP_S
    walk = np.cumsum(K * np.sqrt(STEP_S) * draw.standard_normal(SAMPLES))
    white = N / np.sqrt(STEP_S) * draw.standard_normal(SAMPLES)
    return t, -5e-3 + C1 * (1 - np.exp(-t / T)) + walk + white


def ours(gyroid, t, rate, folder):
    path = Path(folder) / "log.csv"
    np.savetxt(path, np.column_stack([t, rate]), delimiter=",", header="t_s,gyro_z_rad_s", comments="", fmt="%.17g")
    run = subprocess.run([gyroid, "noise", path, "--draws", "99", "--json", "-"], capture_output=True, text=True)
    if run.returncode not in (0, 3):
        sys.exit(run.stderr)
    found = [t["estimate"] for t in json.loads(run.stdout)["terms"] if t["id"] == "rate_random_walk"]
    # where no walk is supported, none is reported
    return found[0] if found else 0.0


def of_allan_variance(rate, effects):
    parameters, _ = estimate_parameters(*compute_avar(rate, STEP_S), effects=effects)
    return float(parameters["walk"])


def overlapping(rate, averaged):
    theta = np.concatenate([[0.0], np.cumsum(rate)])
    return np.array(
        [np.sqrt(np.mean((theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m]) ** 2) / (2 * m * m)) for m in averaged]
    )


def by_slope(tau, deviation):
    return np.exp(np.mean(np.log(deviation) - 0.5 * np.log(tau)) + 0.5 * np.log(3.0))


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--gyroid", default="gyroid")
    options.add_argument("--logs", type=int, default=50)
    options.add_argument("--json")
    options = options.parse_args()
    averaged = np.arange(50, 10_001, 50)
    errors = {}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, options.logs + 1):
            t, rate = simulated(seed)
            deviation, tau = overlapping(rate, averaged), averaged * STEP_S
            beyond = slice(int(np.argmin(deviation)), None)
            for name, found in {
                "gyroid": ours(options.gyroid, t, rate, folder),
                "allan-variance": of_allan_variance(rate, None),
                "allan-variance, white and walk": of_allan_variance(rate, ["white", "walk"]),
                "slope, all averaging times": by_slope(tau, deviation),
                "slope, beyond the lowest point": by_slope(tau[beyond], deviation[beyond]),
            }.items():
                errors.setdefault(name, []).append(found - K)
    rms = {name: float(np.sqrt(np.mean(np.square(e)))) for name, e in errors.items()}
    print(f"{options.logs} logs, K = {K:g} rad/s/sqrt(s): root mean square error, times gyroid's")
    for name, value in rms.items():
        print(f"  {name:<32}{value:10.2e}{value / rms['gyroid']:8.1f}")
    if options.json:
        Path(options.json).write_text(json.dumps({"logs": options.logs, "true": K, "rms_error": rms}, indent=2) + "\n")
    best = min(value for name, value in rms.items() if name != "gyroid")
    return 0 if best >= 10 * rms["gyroid"] else 1


sys.exit(main())
