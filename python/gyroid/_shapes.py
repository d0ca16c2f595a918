"""Types of the answers, as the JSON has them. Written by shapes.py: do not edit."""

from __future__ import annotations

from typing import Any

from gyroid._record import Array, Estimate, Record, Rows


class Fit(Record):
    pass


class Noise(Record):
    pass


class Validate(Record):
    pass


class Navigate(Record):
    pass


class Simulate(Record):
    pass


class GapDiagnose(Record):
    pass


class GapExplain(Record):
    pass


class Export(Record):
    pass


class Inspect(Record):
    pass


class Study(Record):
    pass
