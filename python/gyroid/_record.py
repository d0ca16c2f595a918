"""Answers as typed views on their JSON: an attribute a key, arrays as NumPy's."""

from __future__ import annotations

import base64
import functools
import html
import typing
from collections.abc import Iterator, Sequence
from typing import Any, ClassVar, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from gyroid._values import Picture

#: Numbers in the order of the JSON, read-only; null is NaN.
Array: typing.TypeAlias = NDArray[np.float64]


class Record:
    """An object of an answer. Attributes are the keys of its JSON; one that may be missing there is None."""

    __slots__ = ("__dict__", "_data")
    _data: dict[str, Any]

    def __init__(self, data: dict[str, Any]) -> None:
        self._data = data

    @classmethod
    @functools.cache
    def _types(cls) -> dict[str, Any]:
        # keys of the JSON are those of estimates and of the generated classes
        from gyroid import _shapes

        known = {**globals(), **vars(_shapes)}
        own = [base for base in reversed(cls.__mro__) if base is Estimate or base.__module__.startswith(_shapes.__name__)]
        return {key: eval(kind, known) for base in own for key, kind in base.__annotations__.items()}

    # hidden from type checkers, which would take any name for an attribute
    if not typing.TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_"):
                raise AttributeError(name)
            types = self._types()
            if name in self._data:
                value = _view(self._data[name], types.get(name))
            elif name in types:
                value = None
            else:
                raise AttributeError(f"{type(self).__name__} has no {name!r}; there are {', '.join(self._data)}")
            self.__dict__[name] = value
            return value

    def __setattr__(self, name: str, value: Any) -> None:
        if not name.startswith("_"):
            raise AttributeError(f"answers cannot be changed; to_dict() gives a copy that can: {name!r}")
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._data})

    def __repr__(self) -> str:
        short = ", ".join(f"{k}={_short(v)}" for k, v in self._data.items() if k != "schema")
        return f"{type(self).__name__.lstrip('_')}({short})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Record) and self._data == other._data

    __hash__ = None  # type: ignore[assignment]

    def __getstate__(self) -> dict[str, Any]:
        return {"_data": self._data}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            super().__setattr__(name, value)

    def to_dict(self) -> dict[str, Any]:
        """The same as the JSON has it: dicts, lists, numbers, text, None."""
        return typing.cast(dict[str, Any], _copy(self._data))


class Estimate(Record):
    """An estimate: ``float(e)`` is its value, beside it stands how well it is known."""

    #: The value; its unit stands at the end of the attribute's name, or in ``unit``.
    estimate: float
    #: Standard deviation that allows for autocorrelated residuals.
    std: float
    #: The classical standard deviation, for white residuals.
    std_white: float | None
    #: 95 % interval, low and high.
    ci95: Array | None

    def __float__(self) -> float:
        return float("nan") if self.estimate is None else float(self.estimate)

    def __format__(self, spec: str) -> str:
        return format(float(self), spec)


_R = TypeVar("_R", bound=Record)


class Rows(Sequence[_R], Generic[_R]):
    """Objects of one kind, one after another; an attribute of numbers is that of all of them as an array."""

    def __init__(self, data: list[dict[str, Any]], kind: type[_R]) -> None:
        self._data, self._kind = data, kind

    @overload
    def __getitem__(self, index: int) -> _R: ...
    @overload
    def __getitem__(self, index: slice) -> Rows[_R]: ...
    def __getitem__(self, index: int | slice) -> _R | Rows[_R]:
        if isinstance(index, slice):
            return Rows(self._data[index], self._kind)
        return typing.cast(_R, _record(self._data[index], self._kind))

    def __len__(self) -> int:
        return len(self._data)

    def __iter__(self) -> Iterator[_R]:
        return (self[i] for i in range(len(self)))

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_") or not (any(name in row for row in self._data) or name in self._kind._types()):
            raise AttributeError(name)
        cells = [row.get(name) for row in self._data]
        if any(isinstance(cell, str | dict) for cell in cells):
            return np.array(cells, dtype=object)
        return np.array([np.nan if cell is None else cell for cell in cells])

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(key for row in self._data for key in row)})

    def __repr__(self) -> str:
        return f"Rows([{', '.join(repr(row) for row in self[:3])}{', …' if len(self) > 3 else ''}])"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Rows) and self._data == other._data

    __hash__ = None  # type: ignore[assignment]


class Result(Record):
    """The answer of a command.

    Attributes
    ----------
    fit_for_use : bool
        Whether the result may be relied on; why not stands in its text and its keys.
    """

    fit_for_use: bool
    _text: str = ""
    _picture: bytes | None = None
    #: Attributes that a notebook shows as tables.
    _shown: ClassVar[tuple[str, ...]] = ()

    def __init__(self, data: dict[str, Any], text: str, fit_for_use: bool, picture: bytes | None) -> None:
        super().__init__(data)
        self._text, self._picture = text, picture
        self.__dict__["fit_for_use"] = fit_for_use

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in self.__dict__.items() if k.startswith("_") and k != "_again"}
        return {"_data": self._data, **kept, "_fit": self.fit_for_use}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__["fit_for_use"] = state.pop("_fit")
        super().__setstate__(state)

    def __str__(self) -> str:
        """The page that the command line prints."""
        return self._text.rstrip("\n")

    def plot(self) -> Picture:
        """The picture that the command line draws.

        Raises
        ------
        TypeError
            If there is none of this answer.
        """
        if self._picture is None:
            raise TypeError(f"there is no picture of a {type(self).__name__}")
        return Picture(self._picture.decode())

    def _repr_html_(self) -> str:
        head = self._data.get("verdict_text") or self._text.strip().split("\n")[0]
        parts = [f"<p><b>{html.escape(str(head))}</b></p>"]
        parts += [_table(name, getattr(self, name)) for name in self._shown]
        if self._picture is not None:
            text = base64.b64encode(self._picture).decode()
            parts.append(f'<img alt="{html.escape(str(head))}" src="data:image/svg+xml;base64,{text}"/>')
        return "".join(parts)


def _view(value: Any, kind: Any = None) -> Any:
    """A value of the JSON as its type has it."""
    options = [k for k in typing.get_args(kind) if k is not type(None)] if _is_union(kind) else [kind]
    kind = options[0] if options else None
    if isinstance(value, dict):
        if typing.get_origin(kind) is dict:
            return {key: _view(item, typing.get_args(kind)[1]) for key, item in value.items()}
        return _record(value, kind)
    if isinstance(value, list):
        if typing.get_origin(kind) is Rows or any(isinstance(item, dict) for item in value):
            inner = (typing.get_args(kind) or (Record,))[0]
            return Rows(value, Estimate if _all_estimates(value) and inner is Record else inner)
        if typing.get_origin(kind) is tuple or any(isinstance(item, str) for item in value):
            return tuple(_view(item) for item in value)
        numbers = np.array(_numbers(value), dtype=bool if value and _all_bool(value) else np.float64)
        numbers.flags.writeable = False
        return numbers
    return value


def _record(value: dict[str, Any], kind: Any) -> Record:
    if isinstance(kind, type) and issubclass(kind, Record) and kind is not Record:
        return kind(value)
    return Estimate(value) if "estimate" in value and "std" in value else Record(value)


def _is_union(kind: Any) -> bool:
    return type(None) in typing.get_args(kind)


def _all_estimates(value: list[Any]) -> bool:
    return bool(value) and all("estimate" in item and "std" in item for item in value)


def _all_bool(value: list[Any]) -> bool:
    return all(isinstance(item, bool) for item in value)


def _numbers(value: list[Any]) -> list[Any]:
    return [_numbers(v) if isinstance(v, list) else np.nan if v is None else v for v in value]


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _copy(v) for k, v in value.items()}
    return [_copy(v) for v in value] if isinstance(value, list) else value


def _short(value: Any) -> str:
    if isinstance(value, dict) and "estimate" in value and "std" in value:
        return f"{_number(value['estimate'])}±{_number(value['std'])}"
    if isinstance(value, dict):
        return "{…}"
    if isinstance(value, list):
        return f"[{len(value)}]"
    return _number(value) if isinstance(value, float) else repr(value)


def _number(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


#: Rows of a table in a notebook.
_MOST_ROWS = 20


def _cell(value: Any) -> str:
    if isinstance(value, list) and len(value) == 2:
        return html.escape(" … ".join(map(_number, value)))
    return html.escape(value if isinstance(value, str) else _short(value))


def _row(value: Any, keys: Sequence[str]) -> list[Any]:
    return [value.get(key) for key in keys] if isinstance(value, dict) and keys else [value]


def _table(name: str, value: Any) -> str:
    """A table of an object or of rows."""
    if isinstance(value, Rows):
        rows = value._data[:_MOST_ROWS]
        keys = list(dict.fromkeys(key for row in rows for key in row))
        cells = [_row(row, keys) for row in rows]
    elif isinstance(value, Record):
        inner = value._data
        estimates = all(isinstance(v, dict) and "estimate" in v for v in inner.values())
        keys = ["estimate", "std", "ci95"] if estimates else []
        cells = [[key, *_row(item, keys)] for key, item in inner.items()]
        keys = ["", *keys] if estimates else ["", ""]
    else:
        return ""
    if not cells:
        return ""
    head = "".join(f"<th>{html.escape(key)}</th>" for key in keys)
    body = "".join("<tr>" + "".join(f"<td>{_cell(v)}</td>" for v in row) + "</tr>" for row in cells)
    return f"<table><caption>{html.escape(name)}</caption><tr>{head}</tr>{body}</table>"
