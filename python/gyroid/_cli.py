"""The command line that comes with the wheel."""

from __future__ import annotations

import signal
import sys

from gyroid import _gyroid


def main() -> int:
    """Run ``gyroid`` with the arguments of the process; the exit code."""
    # without this an interrupt would wait for the end of the work
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _gyroid.run(sys.argv[1:])
