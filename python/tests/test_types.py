"""Types and signatures are what the library and its command line have."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, get_type_hints

import pytest

import gyroid
from conftest import ROOT, program
from gyroid import _gyroid
from gyroid._call import option

#: Options of the commands that are no arguments, and why: outputs are parts of results; a copy of a robot's description and ranges for
#: another program are the command line's; the rest has a word of its own.
ELSEWHERE = {
    *("accept", "force", "help", "json", "quiet", "version"),
    *("out", "plot", "no-plot", "html", "save-config", "truth", "why", "write-sim", "write-twin"),
    *("patch", "simulate", "ranges", "mcap"),
    *("axes", "config", "jobs", "keep-outlying", "list", "results", "resume", "shard"),
}

GAP = ("diagnose", "compare", "explain", "plan", "power")


@pytest.mark.parametrize(
    "name", ["fit", "noise", "validate", "navigate", "simulate", *GAP, "export", "inspect", "study"]
)
def test_every_option_of_the_command_is_an_argument(name: str) -> None:
    command = ["gap", name] if name in GAP else [name]
    options = set(re.findall(r"^\s+(?:-\w, )?--([a-z][a-z-]*)", program(*command, "--help").stdout, re.M)) - ELSEWHERE
    function = getattr(gyroid, name)
    known = {option(argument) for argument in inspect.signature(function).parameters}
    hints = get_type_hints(function)
    for typed in (gyroid.RestOptions, gyroid.DriveOptions):
        if typed in getattr(hints.get("reading"), "__args__", ()):
            known |= {option(argument) for argument in get_type_hints(typed)}
    assert len(options) > 2 and options <= known, f"{name} lacks {sorted(options - known)}: add them, or to ELSEWHERE"


def test_the_stub_has_what_the_extension_has() -> None:
    stub = (Path(gyroid.__file__).parent / "_gyroid.pyi").read_text()
    public = {name for name in vars(_gyroid) if not name.startswith("__")} | {"__version__"}
    assert set(re.findall(r"^(?:def |class |)(\w+)[(:]", stub, re.M)) == public
    for name in public - {"Place", "__version__"}:
        [stubbed] = re.findall(rf"^def {name}\((.*?)\) ->", stub, re.M)
        assert re.findall(r"(\w+):", stubbed) == list(inspect.signature(getattr(_gyroid, name)).parameters)
    methods = {name for name in vars(_gyroid.Place) if not name.startswith("__")}
    assert set(re.findall(r"^    def ([a-z]\w*)\(", stub, re.M)) == methods


def test_the_types_of_results_are_those_of_the_answers() -> None:
    script = ROOT / "python" / "tests" / "shapes.py"
    for source in (ROOT / "python" / "gyroid" / "_shapes").glob("*.py"):
        assert (Path(gyroid.__file__).parent / "_shapes" / source.name).read_text() == source.read_text()
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"the JSON has changed: run {script}\n{done.stdout}{done.stderr}"


def test_types_hold(tmp_path: Path) -> None:
    use = tmp_path / "use.py"
    use.write_text(
        "import gyroid\n"
        "f = gyroid.fit('x.csv')\n"
        "reveal_type(f.parameters.c1_rad_s.std)\n"
        "reveal_type(f.validation.levels[0].averaging_time_s)\n"
        "reveal_type(gyroid.noise('x.csv').deviations.overlapping_allan)\n"
        "f.no_such_key\n"
    )
    done = mypy("--strict", use, cwd=tmp_path)
    assert done.stdout.count('Revealed type is "float"') + done.stdout.count('"builtins.float"') == 2, done.stdout
    assert "Rows[" in done.stdout and 'has no attribute "no_such_key"' in done.stdout
    package = mypy("--strict", "-p", "gyroid", cwd=tmp_path)
    assert package.returncode == 0, package.stdout


def mypy(*args: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    command: list[Any] = [sys.executable, "-m", "mypy", "--cache-dir", cwd / "cache", *args]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)
