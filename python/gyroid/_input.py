"""Logs and configurations as the library takes them: paths, or places in memory that hold what Python has."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol, TypeAlias, runtime_checkable

import nanoarrow  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gyroid import _gyroid
from gyroid._errors import Error


@runtime_checkable
class Frame(Protocol):
    """A data frame with the Arrow PyCapsule interface, as those of polars, pandas and pyarrow."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """Its record batches."""


Path: TypeAlias = str | os.PathLike[str]
#: Anything that holds a log: a file, named arrays of one length, a data frame.
Log: TypeAlias = Path | Mapping[str, ArrayLike] | Frame

_Column: TypeAlias = tuple[str, str, bool, Sequence[int], Sequence[object]]


class Given:
    """An argument: the path that stands for it, how it is called, and what has to live as long as it is used."""

    def __init__(self, path: str, name: str, place: _gyroid.Place | None = None) -> None:
        self.path, self.name, self.place = path, name, place


def log(source: Log) -> Given:
    """A log, whatever holds it."""
    if isinstance(source, str | os.PathLike):
        return path(source)
    # a frame of pandas has keys as a mapping has them, and its own capsule needs pyarrow
    if isinstance(source, Frame):
        try:
            return _held("frame", list(_of_frame(source)))
        except ImportError:
            if not hasattr(source, "items"):
                raise
    if hasattr(source, "items"):
        return _held("arrays", [_of_array(str(name), np.asarray(cells)) for name, cells in source.items()])
    found = f"is a {type(source).__name__}"
    raise Error("usage", "log", None, found, "give a path, a mapping of names to arrays, or a data frame")


def arrays(columns: Mapping[str, ArrayLike | None]) -> Given:
    """Arrays of one length as a log; those that are None are left out."""
    there = {name: np.asarray(cells) for name, cells in columns.items() if cells is not None}
    first, *others = there
    for name in others:
        if there[name].shape[:1] != there[first].shape[:1]:
            found = f"has the shape {there[name].shape}, and {first} {there[first].shape}"
            raise Error("value", "arrays", name, found, "give arrays of one length")
    return _held("arrays", [_of_array(name, cells) for name, cells in there.items()])


def path(source: Path) -> Given:
    """The path of a file; one that begins like an option is no option."""
    text = os.fspath(source)
    return Given(os.path.join(os.curdir, text) if text.startswith("-") else text, repr(text))


def _held(name: str, columns: list[_Column]) -> Given:
    if not columns:
        raise Error("column", name, None, "holds no columns", "give the times in t_s and the rates in gyro_z_rad_s")
    place = _gyroid.Place.of_columns(name, columns)
    return Given(place.path, name, place)


def _of_array(name: str, cells: NDArray[Any]) -> _Column:
    if cells.dtype.kind == "O":
        cells = _as_numbers(name, cells)
    return _column(name, cells.shape, [cells])


def _as_numbers(name: str, cells: NDArray[Any]) -> NDArray[Any]:
    try:
        return cells.astype(np.float64)
    except (TypeError, ValueError) as error:
        found = f"column {name!r} is not of numbers: {error}"
        raise Error("value", "arrays", name, found, "give an array of numbers or of datetime64") from None


def _column(name: str, shape: Sequence[int], chunks: Sequence[NDArray[Any]]) -> _Column:
    kind = chunks[0].dtype.kind if chunks else "f"
    if kind == "M":
        chunks = [chunk.astype("datetime64[ns]", copy=False).view(np.int64) for chunk in chunks]
    elif kind == "m":
        chunks = [chunk / np.timedelta64(1, "s") for chunk in chunks]
    elif kind in "iu" and all(chunk.dtype != np.uint64 for chunk in chunks):
        chunks = [chunk.astype(np.int64, copy=False) for chunk in chunks]
    elif any(chunk.dtype not in (np.float32, np.float64) for chunk in chunks):
        chunks = [_as_numbers(name, chunk) for chunk in chunks]
    chunks = [np.ascontiguousarray(chunk) for chunk in chunks]
    dtype = str(chunks[0].dtype) if chunks else "float64"
    return name, dtype, kind == "M", list(shape), chunks


def _of_frame(frame: Frame) -> Iterator[_Column]:
    stream = nanoarrow.c_array_stream(frame)
    schema = nanoarrow.Schema(stream.get_schema())
    fields = [schema.field(i) for i in range(schema.n_fields)]
    batches = list(stream)
    for i, field in enumerate(fields):
        chunks = [numbers for batch in batches if (numbers := _numbers(batch, i, field)) is not None]
        # words and lists are no columns of a log
        if len(chunks) == len(batches) > 0:
            yield _column(field.name, [sum(map(len, chunks))], chunks)


#: Types of Arrow's numbers, as NumPy calls them.
_DTYPES = {"double": "f8", "float": "f4", "half_float": "f2"} | {
    f"{sign}int{bits}": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)
}
_UNITS = {"second": "s", "milli": "ms", "micro": "us", "nano": "ns"}


def _numbers(batch: Any, index: int, field: Any) -> NDArray[Any] | None:
    """The cells of a column where they lie, or a copy with NaN where some are missing; None if they are no numbers."""
    kind = field.type.name.lower()
    if kind in ("timestamp", "duration"):
        dtype: np.dtype[Any] = np.dtype(f"{'M' if kind == 'timestamp' else 'm'}8[{_UNITS[field.unit.name.lower()]}]")
    elif kind in _DTYPES:
        dtype = np.dtype(_DTYPES[kind])
    else:
        return None
    array = batch.child(index)
    if not batch.length:
        return np.empty(0, dtype)
    view = array.view()
    begin, end = batch.offset + array.offset, batch.offset + array.offset + batch.length
    values = np.frombuffer(view.buffer(1), dtype=dtype, count=end)[begin:]
    if not array.null_count:
        return values
    missing = np.unpackbits(np.frombuffer(view.buffer(0), np.uint8), count=end, bitorder="little")[begin:] == 0
    if dtype.kind in "mM":
        return np.where(missing, np.array("NaT", dtype), values)
    return np.where(missing, np.nan, values)
