"""Logs drawn at random, damaged as logs are, and the commands that are asked about them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

ROBOT = Path(__file__).parents[2] / "data" / "truth.toml"
RATE, WHEELS = "gyro_z_rad_s", ("wheel_left_rad_s", "wheel_right_rad_s")
Values: TypeAlias = np.ndarray[Any, np.dtype[np.float64]]
#: Runs a line of the program, and says whether it ended without an error.
Ask: TypeAlias = Callable[..., bool]


def of_rest(seed: int, folder: Path, ask: Ask) -> None:
    """Asks about a gyro at rest."""
    draw, log, config = np.random.default_rng(seed), folder / "log.csv", folder / "gyroid.toml"
    write(log, at_rest(draw))
    ask("inspect", log)
    ask("noise", log, "--draws", 99)
    ask("fit", log)
    ask("fit", log, "--axis", "z", "-o", config, "--accept", "--no-plot")
    if config.exists():
        ask("validate", config, log, "--axis", "z")
        ask("export", config, "--to", draw.choice(["kalibr", "px4", "gazebo", "c"]), "-o", folder / "exported")
        ask("gap", "diagnose", config, "--fit", log, "--axis", "z")


def of_drive(seed: int, folder: Path, ask: Ask) -> None:
    """Asks about a drive."""
    draw, log = np.random.default_rng(seed), folder / "drive.csv"
    course = ("--course", draw.choice(["square", "random", "figure_eight"]), "--duration", round(10 ** draw.uniform(0.3, 1.8), 2))
    if not ask("simulate", ROBOT, *course, "--seed", draw.integers(1000), "-o", log):
        return
    columns = read(log)
    for name in [name for name in columns if name not in ("t_s", RATE, *WHEELS) and draw.random() < 0.4]:
        del columns[name]
    hurt = draw.choice([name for name in columns if name != "t_s"])
    log = folder / "log.csv"
    write(log, columns | {hurt: damaged(columns[hurt], draw)})
    ask("inspect", log)
    ask("navigate", ROBOT, log)
    ask("gap", "diagnose", ROBOT, "--fit", log)
    ask("gap", "explain", ROBOT, "--fit", log, "--effect", draw.choice(["wheel.radius_scale", "gyro.scale_factor", "vehicle.payload"]))


def at_rest(draw: np.random.Generator) -> dict[str, Values]:
    """Two axes of a gyro that warms up, sometimes with its temperature: up to 3000 rows."""
    rows, step_s = int(10 ** draw.uniform(0.5, 3.5)), 10 ** draw.uniform(-2, 0.5)
    t_s = stamps(rows, step_s, draw)
    warm = -np.expm1(-(t_s - t_s[0]) / max(1e-3, draw.uniform(0.01, 1.0) * rows * step_s))

    def rate() -> Values:
        return damaged(10 ** draw.uniform(-5, -2) * warm + 10 ** draw.uniform(-6, -2) * draw.normal(size=rows), draw)

    columns = {"t_s": t_s, "gyro_x_rad_s": rate(), RATE: rate()}
    if draw.random() < 0.4:
        columns["temperature_c"] = damaged(20 + 15 * warm, draw)
    return columns


def stamps(rows: int, step_s: float, draw: np.random.Generator) -> Values:
    """Times of the rows, s: even, with jitter, with a gap, or since 1970."""
    t_s = step_s * np.arange(rows)
    match draw.integers(4):
        case 0:
            t_s = t_s + draw.uniform(0.0, 0.3 * step_s, rows)
        case 1:
            t_s[rows // 2 :] += draw.uniform(0.0, 100.0)
        case 2:
            t_s = t_s + 1.8e9
    return t_s


def damaged(values: Values, draw: np.random.Generator) -> Values:
    """Values with a burst of NaN, outliers, printed decimals, a sensor that is stuck or another scale, or as they are."""
    values, at = values.copy(), int(draw.integers(values.size))
    match draw.integers(8):
        case 0:
            values[at : at + values.size // 5] = np.nan
        case 1:
            values[draw.integers(values.size, size=3)] = 1e3
        case 2:
            values = np.round(values, int(draw.integers(1, 5)))
        case 3:
            values[at:] = values[at]
        case 4:
            values *= 10.0 ** draw.uniform(-9, 9)
    return values


def read(path: Path) -> dict[str, Values]:
    """Columns of a CSV file; empty cells are NaN."""
    names, *rows = (line.split(",") for line in path.read_text().splitlines())
    table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    return {name: table[:, i] for i, name in enumerate(names)}


def write(path: Path, columns: dict[str, Values]) -> None:
    """Writes columns as CSV; NaN are empty cells."""
    rows = zip(*([repr(float(v)) if np.isfinite(v) else "" for v in values] for values in columns.values()))
    path.write_text("\n".join([",".join(columns), *map(",".join, rows)]) + "\n")
