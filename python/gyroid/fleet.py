"""Work on many logs by many machines: the parts of ``--shard`` by Dask or another executor, and ``gyroid merge``.

Logs and results are paths that all machines see, or addresses of a store that fsspec_ reads, such as ``s3://bucket/logs``: a worker then
copies the files of its part, and keeps no more than these.

.. _fsspec: https://filesystem-spec.readthedocs.io
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from typing import Any, Protocol

from gyroid._store import Parts

__all__ = ["diagnose", "fit", "noise"]


class Submits(Protocol):
    """An executor of :mod:`concurrent.futures`, or a Dask client."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Any:
        """The future of a call."""


Logs = Sequence[str | os.PathLike[str]]


def fit(
    executor: Submits,
    logs: Logs,
    results: str | os.PathLike[str],
    *,
    parts: int,
    retries: int = 3,
    options: Sequence[str] = (),
    config: str | os.PathLike[str] | None = None,
) -> dict[str, Any]:
    """The warm-up model of each of many logs, fitted by the workers of an executor, as one table.

    Each worker fits parts of the logs, which depend on the logs' names alone, and writes the rows of a part whole or not at all. A part that a
    lost worker had is done again by another; a part that is there is not fitted again. The table is the same as that of one process.

    Parameters
    ----------
    executor
        A Dask client, or an executor of :mod:`concurrent.futures`. Its workers see the same files under the same paths.
    logs
        Logs, or folders of them; paths, or addresses such as ``s3://bucket/logs``.
    results
        The table, ``.parquet`` or ``.csv``, a path or an address. Parts lie in a folder beside it until all are there.
    parts
        Number of parts: a few for each worker, so that none waits for the slowest.
    retries
        How often Dask tries a part again that failed.
    options
        Further options of ``gyroid fit``, such as ``["--axis", "z", "--accept"]``.
    config
        Where the configuration of the population is written: its means, and how far one power-on lies from them.

    Returns
    -------
    dict
        The JSON of ``gyroid merge``: ``rows``, ``populations``, ``failed``. A log that cannot be fitted is a row with its ``error``.

    Raises
    ------
    Error
        With the file, the place in it, what was found, and how to mend it.
    """
    table = Parts("fit", logs, results, parts)
    _submit(executor, table, ["fit", *options], retries)
    accept = [option for option in options if option in ("--accept", "--keep-outlying")]
    return table.merge([*accept, *([] if config is None else [f"--config={os.fspath(config)}"])])


def noise(
    executor: Submits,
    logs: Logs,
    results: str | os.PathLike[str],
    *,
    parts: int,
    retries: int = 3,
    options: Sequence[str] = (),
) -> dict[str, Any]:
    """The noise terms of each of many logs, as one table; else as :func:`fit`.

    Parameters
    ----------
    executor, logs, results, parts, retries
        As of :func:`fit`.
    options
        Further options of ``gyroid noise``, such as ``["--terms", "N,K"]``.

    Returns
    -------
    dict
        The JSON of ``gyroid merge``: ``rows``, ``populations``, ``failed``.

    Raises
    ------
    Error
        As :func:`fit`.
    """
    table = Parts("noise", logs, results, parts)
    _submit(executor, table, ["noise", *options], retries)
    return table.merge([])


def diagnose(
    executor: Submits,
    config: str | os.PathLike[str],
    logs: Logs,
    results: str | os.PathLike[str],
    *,
    parts: int,
    retries: int = 3,
    options: Sequence[str] = (),
    unit: str | None = None,
) -> dict[str, Any]:
    """The gap of each of many recordings, and which effects are common to the robots, as one table; else as :func:`fit`.

    The parts are done twice: the second time the effects that any diagnosis named are fitted to every recording.

    Parameters
    ----------
    executor, logs, results, parts, retries
        As of :func:`fit`.
    config
        The nominal simulator of all robots, a path that all machines see.
    options
        Further options of ``gyroid gap fleet``.
    unit
        Regular expression that finds the robot in the path of a recording; without one, its folder.

    Returns
    -------
    dict
        The JSON of ``gyroid merge``: ``rows``, ``effects``, ``failed``.

    Raises
    ------
    Error
        As :func:`fit`.
    """
    table = Parts("diagnose", logs, results, parts)
    command = ["gap", "fleet", *options]
    _submit(executor, table, command, retries, [os.path.abspath(config)])
    by = [] if unit is None else [f"--unit={unit}"]
    found = table.merge(by, keep=True)
    named = sorted({name for row in found["rows"] for name in (row["named"] or "").split(",") if name})
    if named and "--effect" not in options:
        # what each worker has made of its parts is kept, and the sizes of these effects are added
        _submit(executor, table, [*command, *(f"--effect={name}" for name in named)], retries, [os.path.abspath(config)])
    return table.merge(by)


def _submit(executor: Submits, table: Parts, command: Sequence[str], retries: int, before: Sequence[str] = ()) -> None:
    """Has all parts made. ``before`` stands before the logs."""
    # executors of the standard library know no retries
    again: dict[str, Any] = {} if isinstance(executor, Executor) else {"retries": retries, "pure": False}
    futures = [executor.submit(table.make, part, list(command), list(before), **again) for part in range(1, table.parts + 1)]
    for future in futures:
        future.result()
