from __future__ import annotations

import json
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
DATA = ROOT / "data"
PROGRAM = Path(sysconfig.get_path("scripts")) / "gyroid"


def program(*args: object) -> subprocess.CompletedProcess[str]:
    """Runs the program that came with the wheel."""
    return subprocess.run([PROGRAM, *map(str, args)], capture_output=True, text=True, check=False)


def answer(*args: object) -> dict[str, Any]:
    """What the program writes with --json."""
    done = program(*args, "--json", "-")
    assert done.returncode in (0, 3), done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="session")
def power_on() -> Path:
    return DATA / "power_on.csv"


@pytest.fixture(scope="session")
def fitted(power_on: Path) -> Any:
    import gyroid

    return gyroid.fit(power_on, base=DATA / "robot.toml")
