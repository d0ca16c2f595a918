"""Values that go in and out: configurations and recordings."""

from __future__ import annotations

import html
import os
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gyroid import _gyroid, _input


class Text:
    """What can be written as a file."""

    def _content(self) -> str:
        raise NotImplementedError

    def save(self, path: _input.Path, *, force: bool = False) -> None:
        """Write it; a file that gyroid did not write is replaced only by `force`.

        Raises
        ------
        FileError
            If there is such a file, or the place cannot be written.
        Error
            Of kind ``unfit`` where there is nothing to write.
        """
        _gyroid.write_file(_input.path(path).path, self._content().encode(), force)


class Picture(Text):
    """A picture of an answer, as ``--plot`` draws it, in SVG; notebooks show it."""

    def __init__(self, svg: str) -> None:
        self.svg = svg

    def _content(self) -> str:
        return self.svg

    def _repr_svg_(self) -> str:
        return self.svg

    def __repr__(self) -> str:
        return f"Picture({len(self.svg)} bytes of SVG)"


class Configuration(Text):
    """A configuration (schema 1) in memory; every function that takes the path of one takes this too.

    Attributes
    ----------
    text : str
        Its TOML, with provenance and checksum.
    """

    def __init__(self, text: str, name: str = "gyroid.toml") -> None:
        self.text, self._name = text, name

    def to_dict(self) -> dict[str, Any]:
        """Its tables and keys; the unit stands in each key."""
        return tomllib.loads(self.text)

    def _content(self) -> str:
        return self.text

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return f"Configuration({self._name!r}, tables {', '.join(self.to_dict())})"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Configuration) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)


#: A configuration: its file, or one in memory.
Config: TypeAlias = _input.Path | Configuration


def config(source: Config) -> _input.Given:
    """A configuration, wherever it is."""
    if isinstance(source, Configuration):
        place = _gyroid.Place(source._name, source.text.encode())
        return _input.Given(place.path, "configuration", place)
    return _input.path(source)


class Recording(Mapping[str, NDArray[np.float64]]):
    """A log: arrays of one length by the name of the channel, the time first, in SI, NaN where a row lacks a value.

    Names are those of the library where it knows the quantity (``gyro_z_rad_s``, ``wheel_left_rad_s``, ``temperature_c``),
    and the file's own elsewhere. It goes wherever a log goes, and into a data frame: ``polars.DataFrame(dict(recording))``.

    Attributes
    ----------
    name : str
        The file, or what it was made of.
    notes : tuple of str
        What the reader decided about columns, units and times.
    """

    def __init__(self, columns: Mapping[str, bytearray], name: str, notes: tuple[str, ...] = ()) -> None:
        self._arrays = {key: np.frombuffer(cells, dtype=np.float64) for key, cells in columns.items()}
        self.name, self.notes = name, notes

    @property
    def t_s(self) -> NDArray[np.float64]:
        """Time of each row, s."""
        return self._arrays["t_s"]

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        try:
            return self._arrays[channel]
        except KeyError:
            raise KeyError(f"no channel {channel!r}; there are {', '.join(self._arrays)}") from None

    def __contains__(self, channel: object) -> bool:
        return channel in self._arrays

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def to_dict(self) -> dict[str, NDArray[np.float64]]:
        """The arrays by name, not copied."""
        return dict(self._arrays)

    def save(self, path: _input.Path, *, force: bool = False) -> None:
        """Write it as ``.parquet``, ``.csv`` or ``.csv.gz``; a file that gyroid did not write is replaced only by `force`.

        Raises
        ------
        FileError
            If there is such a file, or the place cannot be written.
        Error
            Of kind ``usage`` for another ending.
        """
        columns = _input.arrays(self._arrays)
        assert columns.place is not None
        _gyroid.write_log(_input.path(path).path, columns.place, force)

    def __repr__(self) -> str:
        return f"Recording({os.path.basename(self.name)!r}, {len(self.t_s)} rows: {', '.join(self)})"

    def _repr_html_(self) -> str:
        cells = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{_end(np.nanmin, v)}</td><td>{_end(np.nanmax, v)}</td></tr>"
            for name, v in self.items()
        )
        title = f"{html.escape(os.path.basename(self.name))}: {len(self.t_s)} rows"
        return f"<table><caption>{title}</caption><tr><th>channel</th><th>least</th><th>greatest</th></tr>{cells}</table>"


def _end(of: Any, values: NDArray[np.float64]) -> str:
    return "" if not np.isfinite(values).any() else f"{of(values):.6g}"
