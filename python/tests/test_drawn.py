"""Answers about logs drawn at random fit their schemas, or the log is refused with a hint.

The schemas were made from other seeds. `GYROID_CASES=200 pytest python/tests/test_drawn.py` draws as many.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from conftest import program, validate
from drawn import Ask, of_drive, of_rest

CASES = int(os.environ.get("GYROID_CASES", "6"))


def fits(*line: object) -> bool:
    """Whether a line is answered: its answer fits the schema, an error is a line and a hint."""
    done = program(*line, "--json", "-")
    if done.returncode in (1, 2):
        assert done.stdout == "" and done.stderr.startswith("error: ") and "\n  hint: " in done.stderr, f"{line}: {done.stderr}"
        return False
    assert done.returncode in (0, 3), f"{line}: {done.stderr}"
    validate(json.loads(done.stdout))
    return True


@pytest.mark.parametrize("seed", range(CASES))
@pytest.mark.parametrize("draw", [of_rest, of_drive])
def test_answers_about_a_drawn_log_fit(tmp_path: Path, draw: Ask, seed: int) -> None:
    draw(seed, tmp_path, fits)
