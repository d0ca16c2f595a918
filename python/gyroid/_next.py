"""The next experiment, and what a log could have found."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Unpack

from gyroid import _gyroid, _results
from gyroid._call import Call
from gyroid._input import Given
from gyroid._options import Drive, RestOptions, files
from gyroid._values import Config, Recording, config


def plan(
    configuration: Config,
    fit: Drive,
    *,
    answer: _results.Diagnosis | None = None,
    among: Sequence[str] | None = None,
    experiment: Sequence[str] | None = None,
    duration_s: float | None = None,
    load_kg: float | None = None,
    seed: int | None = None,
    without: Sequence[str] | None = None,
    map: Mapping[str, str] | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Plan:
    """The next experiment: what a log cannot tell apart, and which further recording would.

    Parameters
    ----------
    configuration
        The simulator.
    fit
        Recording, at rest or of a drive; of a drive also a tuple of its sensors' logs.
    answer
        Its diagnosis [default: it is diagnosed].
    among
        Ids of the effects to tell apart [default: those that the diagnosis cannot].
    experiment
        Names of the experiments to compare [default: all that this log could be followed by].
    duration_s
        Least length of a course, s [default: that of the log, within 30 and 300, and where none tells what the best one needs, up to 600].
    load_kg
        Known load that the robot carried in the log, and carries in every experiment, kg.
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
    Plan
        ``experiments``, best first, and ``inputs`` of the first one that separates the effects.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    given = config(configuration)
    call = Call("plan", unnamed=[given], outputs={"out": "next"})
    drive = [files(fit)]
    call.named("fit", drive)
    call.loads("load_kg", drive, load_kg)
    told = None
    if answer is not None:
        place = _gyroid.Place("answer.json", json.dumps(answer.to_dict()).encode())
        told = Given(place.path, "answer", place)
    call.options({
        "answer": told,
        "among": among,
        "experiment": experiment,
        "duration_s": duration_s,
        "seed": seed,
        "without": without,
        "map": map,
        **reading,
    })
    result = _results.Plan(*call.run("gap", "plan"), None)
    inputs = call.outputs["out"].log()
    _results.attach(result, inputs=None if inputs is None else Recording(inputs, "next"))
    return result


def power(
    configuration: Config,
    inputs: Drive,
    *,
    probability: float | None = None,
    effect: Sequence[str] | None = None,
    cases: int | None = None,
    check: int | None = None,
    load_kg: float | None = None,
    seed: int | None = None,
    without: Sequence[str] | None = None,
    map: Mapping[str, str] | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Power:
    """The smallest size of each effect that a diagnosis of such a log would name.

    Parameters
    ----------
    configuration
        The simulator.
    inputs
        Log whose rows, inputs and channels are simulated; of a drive also a tuple of its sensors' logs.
    probability
        Probability with which an effect is to be named, 0.5 to 0.99 [0.9].
    effect
        Ids of the effects [default: all that the log can show].
    cases
        Logs that are simulated for each effect and direction [12].
    check
        Further logs with each effect as large as was told, in which the names are counted [0].
    load_kg
        Known load that the robot carries, kg.
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
    Power
        ``effects``, each with the sizes that are named and their intervals; :meth:`plot` draws them.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    given = config(configuration)
    call = Call("power", unnamed=[given], outputs={"plot": "power.svg"})
    drive = [files(inputs)]
    call.named("inputs", drive)
    call.loads("load_kg", drive, load_kg)
    call.options({
        "probability": probability,
        "effect": effect,
        "cases": cases,
        "check": check,
        "seed": seed,
        "without": without,
        "map": map,
        **reading,
    })
    return _results.Power(*call.run("gap", "power"), call.outputs["plot"].bytes())
