"""Functions on files, and the study."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Literal, Unpack

from gyroid import _input, _results
from gyroid._call import Call
from gyroid._input import Log, Path
from gyroid._options import DriveOptions
from gyroid._values import Config, Recording, config


def read(*logs: Log, **reading: Unpack[DriveOptions]) -> Recording:
    """Every channel of a log, in SI.

    Parameters
    ----------
    *logs
        One log, or several on one clock.
    **reading
        See :class:`DriveOptions`.

    Returns
    -------
    Recording
        Arrays by channel; those of several logs on the union of their times.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    call = Call("read", unnamed=[_input.log(log) for log in logs])
    call.options(reading)
    columns, notes = call.read()
    names = [str(log) if isinstance(log, str | os.PathLike) else "arrays" for log in logs]
    return Recording(columns, ", ".join(names), notes)


def inspect(
    log: Log,
    *,
    topic: str | None = None,
    clock: Literal["header", "receipt"] | None = None,
    skip_bad_rows: bool = False,
) -> _results.Inspection:
    """What is in a log: topics, columns, rates, gaps, units, rest and motion.

    Raises
    ------
    Error
        If it cannot be read.
    """
    call = Call("inspect", unnamed=[_input.log(log)])
    call.options({"topic": topic, "clock": clock, "skip_bad_rows": skip_bad_rows})
    return _results.Inspection(*call.run("inspect"), None)


def export(
    configuration: Config,
    to: str,
    *,
    accept: bool = False,
    axis: Literal["x", "y", "z"] | None = None,
    rate_hz: float | None = None,
    step_s: float | None = None,
    topic: str | None = None,
    device_id: int | None = None,
    power_on_temperature_c: float | None = None,
) -> _results.Export:
    """A configuration as the file of another program.

    Parameters
    ----------
    configuration
        The configuration.
    to
        Program to export to; the message about a wrong one names them all.
    accept
        Export also a model that failed its validation.
    axis
        Axis of the target's IMU that was fitted [default: what the column's name says, else z].
    rate_hz
        Rate at which the target reads the gyro, Hz [default: the configuration's].
    step_s
        Step of the target's filter, s.
    topic
        Topic of the IMU.
    device_id
        PX4's device id of the gyro.
    power_on_temperature_c
        Temperature at power-on, °C, where thermal polynomials begin [default: the log's lowest].

    Returns
    -------
    Export
        ``content`` is the file; ``left_out`` tells what the configuration does not support, and why.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    call = Call("export", unnamed=[config(configuration)], outputs={"out": "export"})
    call.options({
        "to": to,
        "accept": accept,
        "axis": axis,
        "rate_hz": rate_hz,
        "step_s": step_s,
        "topic": topic,
        "device_id": device_id,
        "power_on_temperature_c": power_on_temperature_c,
    })
    result = _results.Export(*call.run("export"), None)
    _results.attach(result, content=call.text("out"))
    return result


def study(
    configuration: Config | None = None,
    *,
    runs: int | None = None,
    seed: int | None = None,
    duration_s: float | None = None,
    course: str | None = None,
    surface: str | None = None,
    start_offset_s: float | None = None,
    sweeps: bool = False,
    convergence: int | None = None,
    estimators: Sequence[str] | None = None,
    rest: Path | None = None,
    axis: Literal["x", "y", "z"] | None = None,
    threads: int | None = None,
    out: Path | None = None,
) -> _results.Study:
    """The filters with and without slip, with and without the gyro's error model, over many simulated runs.

    Parameters
    ----------
    configuration
        Robot and gyro [default: a small robot on snow].
    runs, seed, duration_s
        Number of runs [100], seed of the first [1], length of a run, s [60].
    course, surface
        Course to drive [brisk]; ground [default: the configuration's].
    start_offset_s
        Time since power-on at the begin of a run, s [20].
    sweeps
        Study also every ground, and filters that are wrong about traction.
    convergence
        Follow the errors up to this many runs [default: `runs`].
    estimators
        Estimators of the pose.
    rest, axis
        Log of a gyro at rest whose error model is identified, and its axis [default: one is simulated].
    threads
        Threads to run on [default: as many as there are cores].
    out
        Folder for the figures and the report.

    Returns
    -------
    Study
        Root mean square errors, their intervals, and what the figures show.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    call = Call("study", unnamed=[] if configuration is None else [config(configuration)])
    call.options({
        "runs": runs,
        "seed": seed,
        "duration_s": duration_s,
        "course": course,
        "surface": surface,
        "start_offset_s": start_offset_s,
        "sweeps": sweeps,
        "convergence": convergence,
        "estimators": estimators,
        "rest": None if rest is None else _input.path(rest),
        "axis": axis,
        "threads": threads,
        "out": None if out is None else _input.path(out),
    })
    return _results.Study(*call.run("study"), None)
