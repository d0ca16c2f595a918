"""Answers of the functions, with what can be done with each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gyroid import _shapes
from gyroid._errors import Error
from gyroid._record import Estimate, Record, Result
from gyroid._values import Configuration, Recording, Text


def _unfit(kind: str, why: str) -> Error:
    return Error("unfit", kind, None, why, "pass accept=True if it is to be used all the same")


class Fit(Result, _shapes.Fit):
    """The warm-up model e(t) = C1 (1 - exp(-t/T)) + C2 of a gyro at rest.

    ``float(f.time_constant_s)`` is T in s, ``f.time_constant_s.std`` its standard deviation, ``f.time_constant_s.ci95`` its
    95 % interval. Keys are those of ``gyroid fit --json``.
    """

    _shown = ("parameters",)
    _again: Callable[[], Configuration] | None = None
    _configuration: Configuration | None = None

    @property
    def c1_rad_s(self) -> Estimate:
        """C1, rad/s: how far the error moves while the gyro warms up."""
        return self.parameters.c1_rad_s

    @property
    def c2_rad_s(self) -> Estimate:
        """C2, rad/s: the error at power-on."""
        return self.parameters.c2_rad_s

    @property
    def time_constant_s(self) -> Estimate:
        """T, s; NaN where the log does not know it."""
        return self.parameters.time_constant_s

    def error_rad_s(self, t_s: ArrayLike) -> NDArray[np.float64]:
        """The gyro's error at `t_s`, s since power-on: an array of its shape, rad/s."""
        c1, c2, t = map(float, (self.c1_rad_s, self.c2_rad_s, self.time_constant_s))
        return np.asarray(c2 - c1 * np.expm1(-np.asarray(t_s, dtype=np.float64) / t))

    def config(self, *, accept: bool = False) -> Configuration:
        """The configuration with the model, its covariance, validation and provenance.

        Parameters
        ----------
        accept : bool
            Also of a fit that is not fit for use; it is then fitted once more, from the same log.

        Raises
        ------
        Error
            Of kind ``unfit`` without `accept`; of kind ``config`` where the model has no numbers that could be written.
        """
        if self._configuration is not None:
            return self._configuration
        if not accept or self._again is None:
            raise _unfit("fit", self.verdict_text)
        return self._again()


class Noise(Result, _shapes.Noise):
    """The noise of a gyro at rest: terms, each with estimate, unit and interval, and the deviations of the Allan family."""

    _shown = ("terms",)
    _configuration: Configuration | None = None

    def term(self, id: str) -> Estimate | None:
        """A term by its id, such as ``angle_random_walk``; None where the log does not show it."""
        return next((term for term in self.terms if term.id == id), None)

    def config(self) -> Configuration:
        """The configuration given as `write`, with the terms.

        Raises
        ------
        Error
            Of kind ``unfit`` where the terms do not explain the log; of kind ``usage`` where none was given.
        """
        if self._configuration is None and self._given:
            raise _unfit("noise", self.verdict_text)
        if self._configuration is None:
            raise Error("usage", "noise", None, "no configuration was given", "pass write=CONFIGURATION")
        return self._configuration

    _given: bool = False


class Check(Result, _shapes.Validate):
    """A model held against a log that it was not fitted to: ``explained`` says whether it explains it."""


class Navigation(Result, _shapes.Navigate):
    """The filter over a drive, beside the filter without error model, encoders alone and the gyro as it is.

    Attributes
    ----------
    pose : Recording
        Pose, gyro error and their standard deviations at each row, as the library names them.
    """

    pose: Recording
    _configuration: Configuration | None = None

    def config(self, *, accept: bool = False) -> Configuration:
        """The configuration with how warm the drive left the gyro; `save_config` has to be asked for.

        Raises
        ------
        Error
            Of kind ``usage`` where it was not asked for; of kind ``unfit`` where the filter is not consistent.
        """
        if self._configuration is None and not self.fit_for_use:
            raise _unfit("navigate", "the filter is not consistent with the drive")
        if self._configuration is None:
            raise Error("usage", "navigate", None, "no configuration was asked for", "pass save_config=True")
        return self._configuration


class Simulation(Result, _shapes.Simulate):
    """A log as the configuration would have it.

    Attributes
    ----------
    recording : Recording
        What the sensors would have recorded.
    truth : Recording or None
        True pose, velocities and gyro error of a drive.
    """

    recording: Recording
    truth: Recording | None


class _Traced:
    """What a diagnosis writes beside its answer."""

    _configuration: Configuration
    _why: str

    @property
    def why(self) -> str:
        """Everything that was tried, and why it was taken or not, as Markdown."""
        return self._why

    def config(self) -> Configuration:
        """The simulator with the effects that were found, as tables ``[[effect]]``."""
        return self._configuration


class Diagnosis(_Traced, Result, _shapes.GapDiagnose):
    """The gap between simulator and recording: where it lies, which effect causes it, how far it shrinks."""

    _shown = ("effects", "gap")


class Comparison(_Traced, Result, _shapes.GapCompare):
    """The gap between a simulator of anybody's and the robot, and the model that stands for that simulator."""

    _shown = ("effects", "gap")
    _twin: Configuration

    def twin_config(self) -> Configuration:
        """The model that stands for the simulator."""
        return self._twin


class Explanation(Result, _shapes.GapExplain):
    """The effects that were asked for, fitted together: parameters with intervals."""

    _shown = ("effects",)


class Plan(Result, _shapes.GapPlan):
    """Experiments that would tell apart what a log leaves open, best first.

    Attributes
    ----------
    inputs : Recording or None
        Commands, wheel speeds and torques of the first one that separates the effects; None where none does.
    """

    _shown = ("experiments",)
    inputs: Recording | None


class Power(Result, _shapes.GapPower):
    """The smallest size of each effect that a diagnosis of such a log would name."""

    _shown = ("effects",)


class Export(Result, Text, _shapes.Export):
    """The file of another program; :meth:`save` writes it.

    Attributes
    ----------
    content : str or None
        The file; None where the model failed its validation and `accept` was not given.
    """

    content: str | None

    def _content(self) -> str:
        if self.content is None:
            raise _unfit("export", str(self._data.get("why")))
        return self.content


class Inspection(Result, _shapes.Inspect):
    """What is in a log: topics, columns, rates, gaps, units, rest and motion."""

    _shown = ("columns",)


class Study(Result, _shapes.Study):
    """The filters with and without slip over many simulated runs."""


def attach(result: Record, **attributes: Any) -> None:
    """Sets attributes that are no keys of the JSON."""
    result.__dict__.update(attributes)
