"""Functions on drives, and on the gap between a simulator and a recording."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, Unpack

from gyroid import _input, _results
from gyroid._call import Call
from gyroid._input import Log
from gyroid._options import Drive, DriveOptions, RestOptions, drives, files
from gyroid._values import Config, Configuration, Recording, config


def navigate(
    configuration: Config,
    drive: Drive,
    *,
    filtered: bool = False,
    no_error_model: bool = False,
    use_pose: bool = False,
    start_at_reference: bool = False,
    align: float | None = None,
    wheels: Literal["auto", "rolling", "slip"] | None = None,
    start_offset_s: float | None = None,
    off_time_s: float | None = None,
    save_config: bool = False,
    zero_updates: bool = False,
    no_zero_updates: bool = False,
    gate: float | None = None,
    **reading: Unpack[DriveOptions],
) -> _results.Navigation:
    """The bundled filter over a drive, beside the filter without error model, encoders alone and the gyro as it is.

    Parameters
    ----------
    configuration
        Configuration with ``[gyro]``, ``[vehicle]`` and ``[encoder]``.
    drive
        A log, or a tuple of logs on one clock.
    filtered
        Poses given the readings up to them, instead of smoothed ones.
    no_error_model
        The pose of the filter that takes the gyro for free of error.
    use_pose
        Use the log's reference pose as a measurement.
    start_at_reference
        Start at the reference's first pose instead of zero.
    align
        Share of the way that is laid on the reference before tracks are compared.
    wheels
        How the wheels move [default: auto].
    start_offset_s
        Time since power-on at the first row, s, where no log says.
    off_time_s
        Warm restart: how long the gyro was off before, s.
    save_config
        Keep the configuration with how warm the drive left the gyro: ``config()`` of the result.
    zero_updates, no_zero_updates
        Take wheels that read zero within their noise for standing still; never do.
    gate
        Leave out readings beyond this quantile of chi-squared.
    **reading
        See :class:`DriveOptions`.

    Returns
    -------
    Navigation
        ``fit_for_use`` is false where a sensor's innovations are not as the filter expects them.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    outputs = {"out": "pose", "plot": "drive.svg"} | ({"save_config": "gyroid.toml"} if save_config else {})
    call = Call("navigate", unnamed=[config(configuration), *files(drive)], outputs=outputs)
    call.options({
        "filtered": filtered,
        "no_error_model": no_error_model,
        "use_pose": use_pose,
        "start_at_reference": start_at_reference,
        "align": align,
        "wheels": wheels,
        "start_offset_s": start_offset_s,
        "off_time_s": off_time_s,
        "zero_updates": zero_updates,
        "no_zero_updates": no_zero_updates,
        "gate": gate,
        **reading,
    })
    result = _results.Navigation(*call.run("navigate"), call.outputs["plot"].bytes())
    text = call.text("save_config")
    pose = Recording(call.outputs["out"].log() or {}, "pose")
    _results.attach(result, pose=pose, _configuration=None if text is None else Configuration(text))
    return result


def simulate(
    configuration: Config,
    *,
    course: str | None = None,
    inputs: Log | None = None,
    duration_s: float | None = None,
    seed: int | None = None,
    sensor_seed: int | None = None,
    start_offset_s: float | None = None,
    off_time_s: float | None = None,
    sample_time_s: float | None = None,
    load_kg: float | None = None,
    vary_turn_on: bool = False,
    **reading: Unpack[DriveOptions],
) -> _results.Simulation:
    """A log as the configuration would have it: a gyro at rest, a drive along a course, or recorded torques replayed.

    Parameters
    ----------
    configuration
        The simulator; effects of reality that it holds as ``[[effect]]`` are simulated.
    course
        Course to drive; without it and without `inputs` the gyro stands at rest.
    inputs
        Log whose torques, or else wheel speeds, are replayed; at rest its rows, temperature and supply.
    duration_s
        Length, s [default: 180 on a course, 1800 at rest].
    seed, sensor_seed
        Seed of all random numbers [1]; of the sensors' noise alone.
    start_offset_s
        Time since power-on at the first row, s [default: 0].
    off_time_s
        Warm restart: how long the gyro was off before, s.
    sample_time_s
        Sample time, s [default: the configuration's].
    load_kg
        Known load that the robot carries, a point mass at its centre of mass, kg.
    vary_turn_on
        Draw C1, C2 and T inside the configuration's repeatability.
    **reading
        How to read `inputs`: see :class:`DriveOptions`.

    Returns
    -------
    Simulation
        ``recording``, and ``truth`` of a drive. The same seed gives the same numbers.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    given = config(configuration)
    driven = course is not None or (inputs is not None and _drives_by(configuration))
    outputs = {"out": "simulated"} | ({"truth": "truth"} if driven else {})
    call = Call("simulate", unnamed=[given], outputs=outputs)
    call.options({
        "course": course,
        "inputs": None if inputs is None else _input.log(inputs),
        "duration_s": duration_s,
        "seed": seed,
        "sensor_seed": sensor_seed,
        "start_offset_s": start_offset_s,
        "off_time_s": off_time_s,
        "sample_time_s": sample_time_s,
        "load_kg": load_kg,
        "vary_turn_on": vary_turn_on,
        **reading,
    })
    result = _results.Simulation(*call.run("simulate"), None)
    truth = call.outputs["truth"].log() if driven else None
    _results.attach(
        result,
        recording=Recording(call.outputs["out"].log() or {}, "simulated"),
        truth=None if truth is None else Recording(truth, "truth"),
    )
    return result


def _drives_by(configuration: Config) -> bool:
    """Whether a configuration is of a drive; one that cannot be read is told of when the command reads it."""
    try:
        text = configuration.text if isinstance(configuration, Configuration) else Path(configuration).read_text()
        return tomllib.loads(text).get("kind") == "driving"
    except (OSError, ValueError):
        return False


def diagnose(
    configuration: Config,
    fit: Drive | list[Drive],
    hold: Drive | list[Drive] | None = None,
    *,
    load_kg: float | Sequence[float] | None = None,
    hold_load_kg: float | Sequence[float] | None = None,
    seed: int | None = None,
    without: Sequence[str] | None = None,
    map: Mapping[str, str] | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Diagnosis:
    """The gap between a simulator and a recording: where it lies, which effect causes it, how far it shrinks.

    Parameters
    ----------
    configuration
        The nominal simulator; its ``kind`` says whether the recordings are at rest or of a drive.
    fit
        Recording to diagnose from; of a drive also a tuple of its sensors' logs, or a list of drives.
    hold
        Another recording of the same unit, only to measure how far the gap shrinks.
    load_kg, hold_load_kg
        Of drives: known load that the robot carried in each, a point mass at its centre of mass, kg.
    seed
        Seed of the simulated recordings [1].
    without
        Effects to leave out of the library, by id.
    map
        Of a drive: columns that are certain channels.
    **reading
        See :class:`RestOptions`.

    Returns
    -------
    Diagnosis
        Verdict, probabilities of the effects, the gap before and after, and what cannot be told apart.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    outputs = {"write_sim": "augmented.toml", "why": "why.md", "plot": "gap.svg"}
    call = Call("diagnose", unnamed=[config(configuration)], outputs=outputs)
    fits, holds = drives(fit), drives(hold)
    call.named("fit", fits)
    call.named("hold", holds)
    call.loads("load_kg", fits, load_kg)
    call.loads("hold_load_kg", holds, hold_load_kg)
    call.options({"seed": seed, "without": without, "map": map, **reading})
    result = _results.Diagnosis(*call.run("gap", "diagnose"), call.outputs["plot"].bytes())
    augmented = Configuration(call.text("write_sim") or "", "augmented.toml")
    _results.attach(result, _configuration=augmented, _why=call.text("why") or "")
    return result


def explain(
    configuration: Config,
    fit: Drive,
    effect: str | Sequence[str],
    *,
    load_kg: float | None = None,
    map: Mapping[str, str] | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Explanation:
    """Just these effects, fitted together to a recording: parameters with 95 % intervals.

    Parameters
    ----------
    configuration
        The nominal simulator.
    fit
        Recording, at rest or of a drive as the configuration's ``kind`` says.
    effect
        The effects, by id.
    load_kg
        Of a drive: known load that the robot carried, a point mass at its centre of mass, kg.
    map
        Of a drive: columns that are certain channels.
    **reading
        See :class:`RestOptions`.

    Returns
    -------
    Explanation
        The effects with their parameters. Whether they are at work is not asked; :func:`diagnose` does that.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    call = Call("explain", unnamed=[config(configuration)])
    given = [files(fit)]
    call.named("fit", given)
    call.loads("load_kg", given, load_kg)
    call.options({"effect": [effect] if isinstance(effect, str) else effect, "map": map, **reading})
    return _results.Explanation(*call.run("gap", "explain"), None)
