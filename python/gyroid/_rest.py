"""Functions on logs of a gyro at rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Unpack

from numpy.typing import ArrayLike

from gyroid import _input, _results
from gyroid._call import Call
from gyroid._errors import Error
from gyroid._input import Given, Log
from gyroid._options import Against, RestOptions
from gyroid._values import Config, Configuration, config


def _rest_log(source: Any, rate_rad_s: Any, temperature_c: Any, reading: Mapping[str, Any]) -> Given:
    """A log at rest: whole, or as arrays."""
    axis = str(reading.get("axis", "z"))
    if "," in axis or axis == "all":
        raise Error("usage", "axis", None, f"{axis!r} names several axes", "call once for each axis")
    if rate_rad_s is not None:
        rate = f"gyro_{axis.lstrip('+-')}_rad_s"
        return _input.arrays({"t_s": source, rate: rate_rad_s, "temperature_c": temperature_c})
    if temperature_c is not None:
        raise Error("usage", "temperature_c", None, "stands beside no rate_rad_s", "give both, or a log that has both")
    if isinstance(source, list | tuple):
        raise Error("usage", "log", None, "several logs are given", "call once for each log")
    given = _input.log(source)
    if given.place is None and Path(given.path).is_dir():
        raise Error("usage", given.path, None, "is a folder", "call once for each log, or use the command gyroid fit")
    return given


def fit(
    log: Log | ArrayLike,
    rate_rad_s: ArrayLike | None = None,
    temperature_c: ArrayLike | None = None,
    /,
    *,
    fix: Mapping[str, float] | None = None,
    latitude_deg: float | None = None,
    loss: Literal["squares", "huber"] | None = None,
    weighting: Literal["uniform", "walk"] | None = None,
    against: Against | None = None,
    base: Config | None = None,
    scheme: Literal["exact", "backward-euler", "forward-euler"] | None = None,
    sample_time_s: float | None = None,
    level: float | None = None,
    draws: int | None = None,
    seed: int | None = None,
    memory_mb: int | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Fit:
    """The warm-up model of a gyro at rest, e(t) = C1 (1 - exp(-t/T)) + C2, fitted and validated.

    Parameters
    ----------
    log
        A log; or, with `rate_rad_s`, the times of its samples, s since power-on, shape (n,).
    rate_rad_s
        Rate of the gyro at these times, rad/s, shape (n,).
    temperature_c
        Temperature of the sensor at these times, °C, shape (n,).
    fix
        Parameters kept at a value: ``c1_rad_s``, ``c2_rad_s``, ``time_constant_s``.
    latitude_deg
        Latitude of the place, degrees, negative in the south: which part of C2 is the Earth's rotation.
    loss
        ``huber`` is robust to outliers [default: squares].
    weighting
        ``walk`` finds a warm-up that a random walk of the bias hides [default: uniform].
    against
        Independent variable of the model that is judged [default: time].
    base
        Configuration that brings ``[vehicle]``, ``[encoder]`` and the filter's sample time.
    scheme
        How the model is carried from sample to sample [default: exact].
    sample_time_s
        The filter's sample time, s [default: the base's, else the log's].
    level, draws, seed
        Of the whiteness test: probability at which white residuals fail [0.05], permutations [999], their seed [1].
    memory_mb
        A log that takes more is read in one pass and not held, MB.
    **reading
        See :class:`RestOptions`.

    Returns
    -------
    Fit
        ``fit_for_use`` is false where there is no warm-up, T is not identifiable, or the residuals are not white.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    given = _rest_log(log, rate_rad_s, temperature_c, reading)
    arguments: dict[str, Any] = {
        "fix": fix,
        "latitude_deg": latitude_deg,
        "loss": loss,
        "weighting": weighting,
        "against": against,
        "base": None if base is None else config(base),
        "scheme": scheme,
        "sample_time_s": sample_time_s,
        "level": level,
        "draws": draws,
        "seed": seed,
        "memory_mb": memory_mb,
        **reading,
    }

    def done(accept: bool) -> _results.Fit:
        call = Call("fit", unnamed=[given], outputs={"out": "gyroid.toml", "plot": "fit.svg"})
        call.options({**arguments, "accept": accept})
        result = _results.Fit(*call.run("fit"), call.outputs["plot"].bytes())
        text = call.text("out")
        _results.attach(result, _configuration=None if text is None else Configuration(text))
        return result

    result = done(False)
    _results.attach(result, _again=lambda: done(True).config())
    return result


def noise(
    log: Log | ArrayLike,
    rate_rad_s: ArrayLike | None = None,
    temperature_c: ArrayLike | None = None,
    /,
    *,
    terms: Sequence[str] | None = None,
    no_selection: bool = False,
    warm_up: Literal["found", "always", "never"] | None = None,
    max_frequency_hz: float | None = None,
    datasheet: str | None = None,
    horizon_s: float | None = None,
    turn_on_std_rad_s: float | None = None,
    configuration: Config | None = None,
    write: Config | None = None,
    other_log: bool = False,
    other_axis: bool = False,
    level: float | None = None,
    draws: int | None = None,
    seed: int | None = None,
    memory_mb: int | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Noise:
    """The noise terms of a gyro at rest, estimated together, and the deviations of the Allan family.

    Parameters
    ----------
    log, rate_rad_s, temperature_c
        As in :func:`fit`.
    terms
        Terms to choose from, by letter or name: Q, N, B, K, R, GM, BW, NB [default: all].
    no_selection
        Fit all of `terms` instead of choosing among them.
    warm_up
        When the warm-up is taken out before [default: found].
    max_frequency_hz
        Fit no frequencies above this, Hz.
    datasheet
        Name of a gyro whose datasheet is compared.
    horizon_s
        How long a heading is carried without correction, s [default: 60].
    turn_on_std_rad_s
        Standard deviation of the bias from one power-on to the next, rad/s [default: the configuration's].
    configuration
        One that says how much the bias varies from one power-on to the next.
    write
        The configuration that :func:`fit` made of this log; ``config()`` of the result is that with the terms.
    other_log, other_axis
        Write them although it was fitted to another log of the same gyro, or to another axis.
    level, draws, seed
        Of the goodness of fit: probability at which a model that fits is called unfit [0.01], logs drawn [199], seed [1].
    memory_mb
        A log that takes more is read in one pass and not held, MB.
    **reading
        See :class:`RestOptions`.

    Returns
    -------
    Noise
        ``fit_for_use`` is false where the terms do not explain the log.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    outputs = {"plot": "noise.svg"} | ({} if write is None else {"out": "gyroid.toml"})
    call = Call("noise", unnamed=[_rest_log(log, rate_rad_s, temperature_c, reading)], outputs=outputs)
    call.options({
        "terms": terms,
        "no_selection": no_selection,
        "warm_up": warm_up,
        "max_frequency_hz": max_frequency_hz,
        "datasheet": datasheet,
        "horizon_s": horizon_s,
        "turn_on_std_rad_s": turn_on_std_rad_s,
        "config": None if configuration is None else config(configuration),
        "write": None if write is None else config(write),
        "other_log": other_log,
        "other_axis": other_axis,
        "level": level,
        "draws": draws,
        "seed": seed,
        "memory_mb": memory_mb,
        **reading,
    })
    result = _results.Noise(*call.run("noise"), call.outputs["plot"].bytes())
    text = call.text("out")
    written = None if text is None else Configuration(text)
    _results.attach(result, _configuration=written, _given=write is not None)
    return result


def validate(
    configuration: Config,
    log: Log | ArrayLike,
    rate_rad_s: ArrayLike | None = None,
    temperature_c: ArrayLike | None = None,
    /,
    *,
    against: Against | None = None,
    level: float | None = None,
    draws: int | None = None,
    seed: int | None = None,
    memory_mb: int | None = None,
    **reading: Unpack[RestOptions],
) -> _results.Check:
    """A model held against another log at rest: its offset, and whether the residuals are white.

    Parameters
    ----------
    configuration
        The configuration with the model.
    log, rate_rad_s, temperature_c
        As in :func:`fit`.
    against
        Which of its models [default: that by temperature where there is one].
    level, draws, seed, memory_mb
        As in :func:`fit`.
    **reading
        See :class:`RestOptions`.

    Returns
    -------
    Check
        ``fit_for_use`` is false where the model does not explain the log.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    given = _rest_log(log, rate_rad_s, temperature_c, reading)
    call = Call("validate", unnamed=[config(configuration), given])
    call.options(
        {"against": against, "level": level, "draws": draws, "seed": seed, "memory_mb": memory_mb, **reading}
    )
    return _results.Check(*call.run("validate"), None)
