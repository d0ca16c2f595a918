"""Errors carry what the library knows, in the words of Python."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import gyroid
from conftest import DATA, program


def test_an_error_has_file_place_finding_and_hint(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t_s,gyro_z_rad_s\n0,0.1\n1,oops\n2,0.2\n3,0.1\n")
    with pytest.raises(gyroid.Error) as caught:
        gyroid.fit(log)
    error = caught.value
    assert (error.kind, error.file) == ("value", str(log))
    assert error.place is not None and "line 3" in error.place and "oops" in error.finding
    # the program says the same, in the words of a shell
    assert error.finding in program("fit", log).stderr
    assert error.hint is not None and "skip_bad_rows" in error.hint and "--" not in error.hint
    again = pickle.loads(pickle.dumps(error))
    assert (again.place, str(again)) == (error.place, str(error))


def test_a_file_that_is_not_there_is_an_error_of_the_system_too() -> None:
    with pytest.raises(OSError) as caught:
        gyroid.fit("no/such.csv")
    assert isinstance(caught.value, gyroid.FileError) and caught.value.kind == "io"
    assert caught.value.file == "no/such.csv" and caught.value.hint == "check the path"


def test_nothing_of_the_users_is_overwritten(tmp_path: Path, fitted: gyroid.Fit) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text("mine")
    with pytest.raises(gyroid.FileError, match="force") as caught:
        fitted.config().save(mine)
    assert caught.value.kind == "exists" and mine.read_text() == "mine"
    fitted.config().save(mine, force=True)
    fitted.config().save(mine)
    assert mine.read_text() == fitted.config().text


def test_wrong_arguments_are_told_with_what_was_meant() -> None:
    with pytest.raises(gyroid.Error) as caught:
        gyroid.fit(DATA / "power_on.csv", weigting="walk")  # type: ignore[call-arg]
    assert caught.value.kind == "usage" and "weighting" in str(caught.value.hint)
    with pytest.raises(gyroid.Error, match="squares, huber"):
        gyroid.fit(DATA / "power_on.csv", loss="cubic")  # type: ignore[arg-type]
    with pytest.raises(gyroid.Error, match="kalibr"):
        gyroid.export(DATA / "robot.toml", "kalibre")


def test_arrays_that_are_no_log_are_refused_by_name() -> None:
    with pytest.raises(gyroid.Error) as caught:
        gyroid.fit(np.arange(10.0), np.arange(9.0))
    assert caught.value.kind == "value" and caught.value.place == "gyro_z_rad_s" and "(9,)" in caught.value.finding
    with pytest.raises(gyroid.Error, match="not of numbers"):
        gyroid.fit({"t_s": [0.0, 1.0], "gyro_z_rad_s": ["a", "b"]})
    with pytest.raises(gyroid.Error) as caught:
        gyroid.fit({"t_s": [0.0, 2.0, 1.0, 3.0], "gyro_z_rad_s": [0.1, 0.2, 0.1, 0.3]})
    assert caught.value.kind == "time" and caught.value.file == "arrays"
    assert "sort_time" in str(caught.value.hint)
    with pytest.raises(gyroid.Error, match="give a path, a mapping"):
        gyroid.fit(3.0)
    with pytest.raises(gyroid.Error, match="once for each axis"):
        gyroid.fit(DATA / "power_on.csv", axis="all")
    with pytest.raises(gyroid.Error, match="holds no columns"):
        gyroid.fit({})


def test_a_configuration_at_fault_is_told_by_its_key() -> None:
    with pytest.raises(gyroid.Error) as caught:
        gyroid.simulate(gyroid.Configuration("schema = 1\nkind = 'driving'\nsampel_time_s = 1\n"))
    assert caught.value.kind == "config" and caught.value.file == "gyroid.toml" and "sampel_time_s" in str(caught.value)


def test_the_program_that_comes_along_is_the_program(tmp_path: Path) -> None:
    assert program("--version").stdout.split() == ["gyroid", gyroid.__version__]
    assert program("fit", "no/such.csv").returncode == 1
    assert program("fit", "--no-such").returncode == 2
    log = tmp_path / "log.csv"
    log.write_text("t_s,gyro_z_rad_s\n" + "".join(f"{i / 10},{(i * 7919 % 13 - 6) / 1000}\n" for i in range(3000)))
    done = program("fit", log)
    assert done.returncode == 3 and "NOT FIT FOR USE" in done.stdout
