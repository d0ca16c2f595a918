#!/usr/bin/env python3
"""Writes `gyroid/_shapes/`: the types of all answers, as the library gives them on the data of the repository.

python shapes.py [--check]: with `--check` the files are compared instead, and the exit code is 1 where one differs.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

PACKAGE = Path(__file__).parents[1] / "gyroid"
DATA = PACKAGE.parents[1] / "data"
HEAD = '"Types of {}, as the JSON has them. Written by shapes.py: do not edit."'
#: Files and the answers in each.
FILES = {
    "_rest": ("answers on logs at rest", ("Fit", "Noise", "Validate")),
    "_drive": ("answers on drives and gaps", ("Navigate", "Simulate", "GapDiagnose", "GapExplain")),
    "_other": ("other answers", ("Export", "Inspect", "Study")),
}
#: Objects whose keys are data, by the end of their path.
MAPS = ("parameters", "std", "axes", "ci95_of", "rms", "rms_ci95", "factors", "nees", "convergence", "estimates")
#: The parameters of a fit are the same in every answer.
FIXED = ("Fit.parameters",)


def answers() -> dict[str, list[dict[str, Any]]]:
    """Answers by the name of their class."""
    import gyroid

    power_on, robot, cold = DATA / "power_on.csv", DATA / "robot.toml", DATA / "cats_coldsoak_a.csv"
    rng = np.random.default_rng(1)
    t_s = np.arange(0.0, 1800.0, 0.5)
    temperature_c = 40 - 15 * np.exp(-t_s / 300)
    walk = 1e-5 * np.cumsum(rng.normal(size=t_s.size)) + 1e-3 * np.sin(2 * np.pi * 0.2 * t_s)
    warm = walk + 2e-5 * temperature_c + 2e-4 * rng.normal(size=t_s.size)
    fits = [
        gyroid.fit(power_on, base=robot, latitude_deg=45.0),
        gyroid.fit(power_on, fix={"c2_rad_s": 0.0}, loss="huber"),
        gyroid.fit(cold),
        gyroid.fit(cold, weighting="walk"),
        gyroid.fit(t_s, warm, temperature_c),
        gyroid.fit(t_s, warm, temperature_c, against="temperature"),
        gyroid.fit(power_on, memory_mb=0),
    ]
    config = fits[0].config()
    noises = [
        gyroid.noise(power_on, datasheet="mpu6050", write=config),
        gyroid.noise(cold, draws=99),
        gyroid.noise(t_s, warm, temperature_c, draws=99),
    ]
    checks = [gyroid.validate(config, power_on), gyroid.validate(fits[5].config(accept=True), cold)]
    square = gyroid.simulate(config, course="square", duration_s=60, start_offset_s=20)
    drives = [
        gyroid.navigate(config, DATA / "drive.parquet", save_config=True),
        gyroid.navigate(config, square.recording, gate=0.9999),
    ]
    rest = gyroid.simulate(config, duration_s=600, seed=3)
    late = np.roll(square.recording["gyro_z_rad_s"], 25)
    heavy = {**square.recording, "gyro_z_rad_s": 1.1 * late}
    standing = standing_simulator(config)
    gaps = [
        gyroid.diagnose(config, heavy, square.recording),
        gyroid.diagnose(standing, {"t_s": t_s, "gyro_z_rad_s": warm}, rest.recording),
    ]
    explained = [
        gyroid.explain(config, heavy, ["gyro.scale_factor"]),
        gyroid.explain(standing, {"t_s": t_s, "gyro_z_rad_s": warm}, ["gyro.rate_random_walk", "gyro.tone"]),
    ]
    exports = [gyroid.export(config, to) for to in ("kalibr", "px4", "gazebo")]
    looks = [gyroid.inspect(power_on), gyroid.inspect(DATA / "drive.parquet")]
    studies = [gyroid.study(runs=2, duration_s=10, sweeps=True, convergence=2), gyroid.study(runs=2, rest=cold)]
    all_of = {
        "Fit": fits,
        "Noise": noises,
        "Validate": checks,
        "Navigate": drives,
        "Simulate": [square, rest],
        "GapDiagnose": gaps,
        "GapExplain": explained,
        "Export": exports,
        "Inspect": looks,
        "Study": studies,
    }
    return {name: [result.to_dict() for result in results] for name, results in all_of.items()}


def standing_simulator(config: Any) -> Any:
    """The configuration of the gyro alone, standing still."""
    import gyroid

    gyro = config.to_dict()["gyro"]
    keys = ("c1_rad_s", "c2_rad_s", "time_constant_s", "angle_random_walk_rad_sqrt_s")
    lines = [f"{key} = {gyro[key]!r}" for key in keys]
    return gyroid.Configuration("\n".join(['schema = 1\nkind = "stationary"\nsample_time_s = 0.5\n[gyro]', *lines, ""]))


class Shapes:
    """Classes by what they hold, so that what is alike is one class."""

    def __init__(self) -> None:
        self.classes: dict[str, tuple[str, str, list[tuple[str, str]]]] = {}
        self.by_content: dict[tuple[str, tuple[tuple[str, str], ...]], str] = {}

    def type_of(self, values: list[Any], path: str) -> str:
        """The type that all of these values have."""
        there = [value for value in values if value is not None]
        optional = " | None" if len(there) < len(values) else ""
        if not there:
            return "Any"
        if all(isinstance(value, bool) for value in there):
            return "bool" + optional
        if all(isinstance(value, int) and not isinstance(value, bool) for value in there):
            return "int" + optional
        if all(isinstance(value, int | float) and not isinstance(value, bool) for value in there):
            return "float" + optional
        if all(isinstance(value, str) for value in there):
            return "str" + optional
        if all(isinstance(value, dict) for value in there):
            return self.object(there, path) + optional
        if all(isinstance(value, list) for value in there):
            return self.list([item for value in there for item in value], path) + optional
        return "Any"

    def list(self, items: list[Any], path: str) -> str:
        """The type of a list of these items."""
        if items and all(isinstance(item, dict) for item in items):
            return f"Rows[{self.object(items, path)}]"
        if items and all(isinstance(item, str) for item in items):
            return "tuple[str, ...]"
        if items and all(isinstance(item, int | float | list) or item is None for item in items):
            return "Array"
        return "tuple[Any, ...]"

    def object(self, values: list[dict[str, Any]], path: str) -> str:
        """The class of these objects."""
        keys = [key for key in dict.fromkeys(key for value in values for key in value) if key.isidentifier()]
        if path.endswith(tuple("." + name for name in MAPS)) and path not in FIXED:
            inner = self.type_of([item for value in values for item in value.values()], path + ".value")
            return f"dict[str, {inner}]"
        base = "Estimate" if {"estimate", "std"} <= set(keys) else "Record"
        if base == "Estimate" and set(keys) <= {"estimate", "std", "std_white", "ci95"}:
            return "Estimate"
        fields = []
        for key in keys:
            kind = self.type_of([value.get(key) for value in values], f"{path}.{key}")
            if not (base == "Estimate" and key in ("estimate", "std", "std_white", "ci95")):
                fields.append((key, kind))
        content = (base, tuple(fields))
        if "." not in path or content not in self.by_content:
            words = path.replace(".", "_").split("_")
            name = ("_" if "." in path else "") + "".join(word[:1].upper() + word[1:] for word in words)
            self.by_content[content] = name
            self.classes[name] = (path.split(".")[0], base, fields)
        return self.by_content[content]


def files() -> dict[str, str]:
    """The modules by name."""
    shapes = Shapes()
    for name, values in answers().items():
        shapes.object(values, name)
    made: dict[str, str] = {}
    where: dict[str, str] = {}
    for file, (what, roots) in FILES.items():
        own = {name: rest for name, (root, *rest) in shapes.classes.items() if root in roots}
        parts, used = [], set()
        for name, (base, fields) in own.items():
            used |= {word for _, kind in fields for word in re.findall(r"\w+", kind)} | {base}
            lines = [f"    {key}: {kind}" for key, kind in fields] or ["    pass"]
            parts.append("\n".join([f"class {name}({base}):", *lines, ""]))
        known = {word: "gyroid._record" for word in ("Array", "Estimate", "Record", "Rows")} | where
        imports = ["from typing import Any", ""] if "Any" in used else []
        for module in dict.fromkeys(known.values()):
            names = sorted(word for word in used if known.get(word) == module)
            imports += [f"from {module} import {name}" for name in names]
        head = "\n".join([f'""{HEAD.format(what)}""', "", "from __future__ import annotations", "", *imports, ""])
        made[file] = "\n\n".join([head, *parts])
        where |= dict.fromkeys(own, f"gyroid._shapes.{file}")
    lines = [f"from {module} import {name} as {name}" for name, module in where.items()]
    made["__init__"] = "\n".join([f'""{HEAD.format("the answers")}""', "", *lines, ""])
    return made


def main() -> int:
    """Write the files, or compare them."""
    folder = PACKAGE / "_shapes"
    made = {folder / f"{name}.py": text for name, text in files().items()}
    if "--check" in sys.argv:
        return int(any(file.read_text() != text for file, text in made.items()))
    folder.mkdir(exist_ok=True)
    for file, text in made.items():
        file.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
