from __future__ import annotations

import functools
import json
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import jsonschema
import pytest

ROOT = Path(__file__).parents[2]
DATA = ROOT / "data"
PROGRAM = Path(sysconfig.get_path("scripts")) / "gyroid"


def program(*args: object) -> subprocess.CompletedProcess[str]:
    """Runs the program that came with the wheel."""
    return subprocess.run([PROGRAM, *map(str, args)], capture_output=True, text=True, check=False)


def answer(*args: object) -> dict[str, Any]:
    """What the program writes with --json, held against its schema."""
    done = program(*args, "--json", "-")
    assert done.returncode in (0, 3), done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    validate(found)
    return found


@functools.cache
def validator(command: str) -> Any:
    """Of the answers of a command."""
    return jsonschema.Draft202012Validator(json.loads((ROOT / "docs" / "schema" / f"{command}.json").read_text()))


def validate(found: dict[str, Any]) -> None:
    """Raises a ValidationError where an answer does not fit the schema that it names."""
    command, _, version = found["schema"].removeprefix("gyroid.").partition("/")
    assert version == "1"
    validator(command).validate(found)


@pytest.fixture(scope="session")
def power_on() -> Path:
    return DATA / "power_on.csv"


@pytest.fixture(scope="session")
def fitted(power_on: Path) -> Any:
    import gyroid

    return gyroid.fit(power_on, base=DATA / "robot.toml")
