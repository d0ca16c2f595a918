"""gap_floors.py FULL SMALL: fails where the small bench is worse than chance allows, given the full one."""
import json
import math
import sys

CHANCE = 1e-3


def at_most(right, of, rate):
    """Probability of at most `right` of `of` at `rate`."""
    return sum(math.comb(of, k) * rate**k * (1.0 - rate) ** (of - k) for k in range(right + 1))


def rates(path):
    with open(path, encoding="utf-8") as file:
        return {r["what"]: r["rate"] for r in json.load(file)["rates"] if "false alarm" not in r["what"]}


def main(full_path, small_path):
    full, small = rates(full_path), rates(small_path)
    bad = 0
    for name, rate in small.items():
        known = full.get(name)
        if not rate["of"] or not known or not known["of"]:
            continue
        low = known["ci95"][0]
        chance = at_most(rate["right"], rate["of"], low)
        bad += chance < CHANCE
        mark = "BELOW ITS FLOOR" if chance < CHANCE else "ok"
        print(f"{name:64} {rate['right']:3}/{rate['of']:<3} full {known['rate']:.3f} (from {low:.3f})  {mark}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
