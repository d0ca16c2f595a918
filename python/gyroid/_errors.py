"""Errors of the library, with what it knows about them as attributes."""

from __future__ import annotations

from typing import Any


class Error(Exception):
    """A fault in an input, with where it lies and how to mend it.

    Attributes
    ----------
    kind : str
        ``format``, ``column``, ``unit``, ``time``, ``value``, ``too_short``, ``config``, ``checksum``, ``numeric``,
        ``usage``; ``io`` and ``exists`` of a :class:`FileError`; ``unfit`` for a result that is not fit for use.
    file : str
        The file, the arrays or the argument at fault.
    place : str or None
        Row, column, key or byte in it.
    finding : str
        What was found there.
    hint : str or None
        How to mend it. Options of the command line (``--start-offset``) are arguments here (``start_offset_s``).
    """

    def __init__(self, kind: str, file: str, place: str | None, finding: str, hint: str | None) -> None:
        where = f"{file}: {place}" if place else file
        super().__init__(f"{where}: {finding}" + (f"\n  hint: {hint}" if hint else ""))
        self.kind, self.file, self.place, self.finding, self.hint = kind, file, place, finding, hint

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.kind, self.file, self.place, self.finding, self.hint)


class FileError(Error, OSError):
    """A file that the operating system does not open or write, or that gyroid would have to replace."""


def of_kind(kind: str, file: str, place: str | None, finding: str, hint: str | None) -> Error:
    """The exception of a kind."""
    return (FileError if kind in ("io", "exists") else Error)(kind, file, place, finding, hint)
