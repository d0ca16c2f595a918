"""Schemas in `docs/schema` are those of the answers, and refuse what is not."""

from __future__ import annotations

import copy
import json
import re
from typing import Any

import jsonschema
import pytest

import gyroid
from conftest import DATA, ROOT, answer, program, validate

SCHEMAS = {path.stem: json.loads(path.read_text()) for path in (ROOT / "docs" / "schema").glob("*.json")}
#: Schemas of files that a command writes beside its answer.
FILES = {"gap.ranges"}
#: Answers without a schema, and why.
WITHOUT = {"gap.bench.calibrate": "diagnoses fifty cases and more"}


def test_the_schemas_are_schemas() -> None:
    for command, schema in SCHEMAS.items():
        jsonschema.Draft202012Validator.check_schema(schema)
        for variant in schema.get("oneOf", [schema]):
            assert variant["properties"]["schema"] == {"const": f"gyroid.{command}/1"}
            assert variant["additionalProperties"] is False


def commands(*line: str) -> list[str]:
    """Commands below this one, each as its words."""
    text = program(*line, "--help").stdout
    if "\nCommands:\n" not in text:
        return [".".join(line)] if "--json" in text else []
    listed = text.split("\nCommands:\n")[1].split("\n\n")[0]
    names = [name for name in re.findall(r"^  ([a-z]+)", listed, re.M) if name != "help"]
    return [found for name in names for found in commands(*line, name)]


def test_every_command_that_answers_has_a_schema() -> None:
    known = commands()
    assert len(known) > 12 and set(known) == {*SCHEMAS, *WITHOUT} - FILES
    page = (ROOT / "docs" / "src" / "json.md").read_text()
    assert [command for command in SCHEMAS if f"(schema/{command}.json)" not in page] == []


@pytest.mark.parametrize(
    "line",
    [
        ("fit", "power_on.csv"),
        ("noise", "power_on.csv", "--draws", 99),
        ("validate", "truth.toml", "power_on.csv"),
        ("navigate", "truth.toml", "drive.parquet"),
        ("simulate", "truth.toml", "--duration", 20, "-o", "OUT"),
        ("inspect", "drive.parquet"),
        ("gap", "explain", "truth.toml", "--fit", "drives/rover_fit.parquet", "--effect", "wheel.radius_mismatch"),
        ("gap", "diagnose", "truth.toml", "--fit", "drives/rover_fit.parquet", "--hold", "drives/rover_hold.parquet"),
        ("export", "truth.toml", "--to", "kalibr"),
    ],
    ids=lambda line: line[1] if line[0] == "gap" else line[0],
)
def test_an_answer_fits_and_a_changed_one_does_not(tmp_path: Any, line: tuple[object, ...]) -> None:
    words = [DATA / str(w) if (DATA / str(w)).is_file() else tmp_path / "out.csv" if w == "OUT" else w for w in line]
    found = answer(*words)
    for change in (added, renamed, retyped):
        with pytest.raises(jsonschema.ValidationError):
            validate(change(copy.deepcopy(found)))


def test_ranges_for_isaac_lab_fit_their_schema(tmp_path: Any) -> None:
    effects = {"vehicle.payload": "mass_relative = 0.3", "sensor.gyro_delay": "delay_s = 0.05"}
    tables = "".join(f'\n[[effect]]\nid = "{name}"\n{line}\n' for name, line in effects.items())
    (tmp_path / "real.toml").write_text((DATA / "truth.toml").read_text() + tables)
    made = program("simulate", tmp_path / "real.toml", "--course", "random", "--duration", 60, "-o", tmp_path / "real.parquet")
    assert made.returncode == 0, made.stderr
    answer("gap", "diagnose", DATA / "truth.toml", "--fit", tmp_path / "real.parquet", "--ranges", tmp_path / "ranges.json")
    found = json.loads((tmp_path / "ranges.json").read_text())
    validate(found)
    assert [event["effect"] for event in found["events"]] == ["vehicle.payload"]
    assert [one["effect"] for one in found["observations"]] == ["sensor.gyro_delay"]
    for change in (added, renamed, retyped):
        with pytest.raises(jsonschema.ValidationError):
            validate(change(copy.deepcopy(found)))


def added(found: dict[str, Any]) -> dict[str, Any]:
    return {**found, "new_key": 1}


def renamed(found: dict[str, Any]) -> dict[str, Any]:
    last = [key for key in found if key != "schema"][0]
    found["another_name"] = found.pop(last)
    return found


def retyped(found: dict[str, Any]) -> dict[str, Any]:
    first = [key for key in found if key != "schema"][0]
    found[first] = [[found[first]]]
    return found


def test_curves_of_a_drive_are_its_channels_before_and_after() -> None:
    found = gyroid.diagnose(DATA / "truth.toml", DATA / "drives" / "rover_fit.parquet", DATA / "drives" / "rover_hold.parquet")
    curves = {curve.shown: curve for curve in found.curves}
    assert set(curves) == {"wheel_left_rad_s", "wheel_right_rad_s", "gyro_z_rad_s", "x_m", "y_m", "heading_rad"}
    recording = gyroid.read(DATA / "drives" / "rover_hold.parquet")
    for name, curve in curves.items():
        assert 50 < len(curve.x) <= 500 and curve.by_torques
        assert curve.x.shape == curve.recorded.shape == curve.before.shape == curve.after.shape
        rows = [list(recording.t_s).index(t) for t in curve.x]
        assert list(curve.recorded) == list(recording[name][rows])
    x, y = curves["x_m"], curves["y_m"]
    assert list(x.x) == list(y.x)

    def off(which: str) -> float:
        return sum((curve.recorded - getattr(curve, which)) ** 2 for curve in (x, y)).mean() ** 0.5  # type: ignore[union-attr]

    # the finding brings the simulated path nearer to the recorded one
    assert off("after") < 0.6 * off("before")
