"""Arguments that functions share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias, TypedDict

from gyroid import _input
from gyroid._input import Given, Log

Against: TypeAlias = Literal["time", "temperature"]
#: A drive: one log, or a tuple of logs of its sensors on one clock.
Drive: TypeAlias = Log | tuple[Log, ...]


class _ReaderOptions(TypedDict, total=False):
    #: Topic of a log that holds several; of a drive also several.
    topic: str | Sequence[str]
    #: Which time of a message counts: that in it, or that of its receipt.
    clock: Literal["header", "receipt"]
    #: How the sensor is mounted in the robot: roll, pitch, yaw about the robot's fixed axes, degrees.
    mounting_deg: Sequence[float]
    #: The same as a unit quaternion x, y, z, w from the sensor's frame to the robot's.
    mounting_quaternion: Sequence[float]
    #: Column that holds the time.
    time: str
    #: Unit of the time.
    time_unit: Literal["s", "ms", "us", "ns"]
    #: Factors on columns or channels, with their unit: ``{"gz_raw": "1/131:deg/s"}``.
    scale: Mapping[str, str | float]
    #: Leave out rows of text that do not parse, instead of refusing the file.
    skip_bad_rows: bool


class RestOptions(_ReaderOptions, total=False):
    """How to read a log of a gyro at rest, where it leaves a choice."""

    #: Axis of the gyro: ``x``, ``y``, ``z``, or ``-z`` for one that points the other way.
    axis: str
    #: Column that holds the rate.
    column: str
    #: Unit of the rate.
    unit: Literal["rad/s", "deg/s", "mrad/s", "mdeg/s", "deg/h"]
    #: Sample rate of a log without a time column, Hz.
    rate_hz: float
    #: Sort rows whose time goes backwards instead of refusing them.
    sort_time: bool
    #: Leave out the seconds in which the sensor moved.
    trim_motion: bool
    #: The log's first sample is this long after power-on, s; of several drives also one for each.
    start_offset_s: float | Sequence[float]


class DriveOptions(_ReaderOptions, total=False):
    """How to read a drive, where its files leave a choice."""

    #: Columns that are certain channels: ``{"gyro_z_rad_s": "-wz:deg/s", "x_m": "east_m"}``.
    map: Mapping[str, str]


def files(drive: Drive) -> list[Given]:
    """The logs of a drive."""
    return [_input.log(one) for one in (drive if isinstance(drive, tuple) else (drive,))]


def drives(drives: Drive | list[Drive] | None) -> list[list[Given]]:
    """The logs of each drive."""
    if drives is None:
        return []
    return [files(drive) for drive in (drives if isinstance(drives, list) else [drives])]
