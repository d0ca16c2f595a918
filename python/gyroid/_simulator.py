"""The gap between anybody's simulator and the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Unpack

from gyroid import _results
from gyroid._call import Call
from gyroid._options import Drive, RestOptions, drives
from gyroid._values import Config, Configuration, config


def compare(
    sim: Drive | list[Drive],
    real: Drive | list[Drive],
    hold: Drive | list[Drive] | None = None,
    *,
    load_kg: float | Sequence[float] | None = None,
    hold_load_kg: float | Sequence[float] | None = None,
    init: Config | None = None,
    paired: bool = False,
    seed: int | None = None,
    without: Sequence[str] | None = None,
    map: Mapping[str, str] | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Comparison:
    """The gap between a simulator of anybody's and the robot, from a log of each: what the robot has and the simulator has not.

    Parameters
    ----------
    sim
        Log of the simulator, at rest or of a drive; of a drive also a tuple of its sensors' logs, or a list of runs.
    real
        Recording of the robot, likewise.
    hold
        Another recording of the same robot, only to measure how far the gap shrinks.
    load_kg, hold_load_kg
        Of drives of the robot: known load that it carried in each, a point mass at its centre of mass, kg.
    init
        What the simulator's log cannot tell: mass and inertia without torques, radius without a pose.
    paired
        The logs have the same commands, the first of `sim` with the first of `real` and so on: they are aligned by these.
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
    Comparison
        As :func:`diagnose` gives it, with the model that stands for the simulator in ``twin``.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    outputs = {"write_twin": "twin.toml", "write_sim": "augmented.toml", "why": "why.md", "plot": "gap.svg"}
    call = Call("compare", outputs=outputs)
    call.named("sim", drives(sim))
    reals, holds = drives(real), drives(hold)
    call.named("real", reals)
    call.named("hold", holds)
    call.loads("load_kg", reals, load_kg)
    call.loads("hold_load_kg", holds, hold_load_kg)
    begun = None if init is None else config(init)
    call.options({"init": begun, "paired": paired, "seed": seed, "without": without, "map": map, **reading})
    result = _results.Comparison(*call.run("gap", "compare"), call.outputs["plot"].bytes())
    augmented = Configuration(call.text("write_sim") or "", "augmented.toml")
    twin = Configuration(call.text("write_twin") or "", "twin.toml")
    _results.attach(result, _configuration=augmented, _why=call.text("why") or "", _twin=twin)
    return result
