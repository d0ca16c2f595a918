"""Makes expected.json: the Allan family, degrees of freedom and noise types by allantools.

    pip install allantools && python tests/allan/make.py

The series are the 1000 numbers of NIST SP 1065, section 12.4 (the series that allantools tests itself with), and the same
generator with a random walk under it, 4000 numbers.
"""

import json
import pathlib

import allantools
import numpy as np
from allantools import ci


def uniform(count):
    """n' = 16807 n mod 2147483647 from 1234567890, over 2147483647."""
    numbers, n = [], 1234567890
    for _ in range(count):
        numbers.append(n / 2147483647)
        n = 16807 * n % 2147483647
    return np.array(numbers)


def main():
    white = uniform(1000)
    noise = uniform(4000) - 0.5
    walk = noise + 0.05 * np.cumsum(noise)
    out = {"allantools": allantools.__version__, "series": {}, "edf": [], "total_edf": []}
    for name, rates, step in [("sp1065", white, 1.0), ("walk", walk, 0.01)]:
        entry = {"step_s": step, "samples": len(rates), "deviations": {}, "noise": []}
        averaged = [1, 2, 3, 5, 8, 10, 16, 33, 64, 100, 128, 250, 256, 330]
        taus = [m * step for m in averaged]
        for key, function in [
            ("overlapping_allan", allantools.oadev),
            ("modified_allan", allantools.mdev),
            ("overlapping_hadamard", allantools.ohdev),
            ("total", allantools.totdev),
        ]:
            t, d, _, _ = function(rates, rate=1.0 / step, data_type="freq", taus=taus)
            entry["deviations"][key] = [[int(round(a / step)), float(b)] for a, b in zip(t, d)]
        for m in [1, 4, 16, 30]:
            for most in [1, 2]:
                alpha = ci.autocorr_noise_id(rates, m, data_type="freq", dmax=most)[0]
                entry["noise"].append([m, most, int(alpha)])
        out["series"][name] = entry
    for alpha in range(2, -5, -1):
        for d in [2, 3]:
            if alpha + 2 * d <= 1:
                continue
            for m, angles in [(1, 1001), (2, 1001), (10, 1001), (10, 51), (40, 200), (100, 1001), (250, 1001), (300, 100_001), (3000, 10_001)]:
                if angles < 1 + m * d:
                    continue
                for modified in [False, True]:
                    if modified and angles < m + m * d:
                        continue
                    # allantools has no formula for white noise of the angle over less than d windows, and no last row in its table
                    count = 1 + angles - (m + m * d if modified else 1 + m * d)
                    if alpha == 2 and not modified and np.ceil(count / m) <= d:
                        continue
                    if alpha == -4 and not modified and count / m > d + 1:
                        continue
                    edf = ci.edf_greenhall(alpha, d, m, angles, overlapping=True, modified=modified)
                    out["edf"].append([alpha, d, m, angles, modified, float(edf)])
    for alpha in [0, -1, -2]:
        out["total_edf"].append([alpha, 7, 1000, float(ci.edf_totdev(1000, 7, alpha))])
    path = pathlib.Path(__file__).with_name("expected.json")
    path.write_text(json.dumps(out, indent=None, separators=(",", ":")).replace('],"', '],\n"') + "\n")


main()
