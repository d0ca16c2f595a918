"""Fits of many logs on many machines: the parts of ``gyroid fit --shard`` by Dask or another executor, and ``gyroid merge``."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Protocol

from gyroid import _gyroid

__all__ = ["fit"]


class Submits(Protocol):
    """An executor of :mod:`concurrent.futures`, or a Dask client."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Any:
        """The future of a call."""


def fit(
    executor: Submits,
    logs: Sequence[str | os.PathLike[str]],
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
        Logs, or folders of them.
    results
        The table, ``.parquet`` or ``.csv``. Parts lie in a folder beside it until all are there.
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
    table = Path(results)
    # hidden: a search for logs passes it over
    folder = table.with_name(f".{table.name}.parts")
    folder.mkdir(parents=True, exist_ok=True)
    named = [os.fspath(log) for log in logs]
    files = [str(folder / f"{part}.parquet") for part in range(1, parts + 1)]
    # executors of the standard library know no retries
    again: dict[str, Any] = {} if isinstance(executor, Executor) else {"retries": retries, "pure": False}
    futures = [
        executor.submit(_part, named, f"{part}/{parts}", file, list(options), **again) for part, file in enumerate(files, 1)
    ]
    for future in futures:
        future.result()
    accept = [option for option in options if option in ("--accept", "--keep-outlying")]
    written = [f"--out={table}", "--force", *([] if config is None else [f"--config={os.fspath(config)}"])]
    answer, _, _ = _gyroid.answer(["merge", *accept, *written, "--", *files], "gyroid.fleet.fit()")
    shutil.rmtree(folder)
    found: dict[str, Any] = json.loads(answer)
    return found


def _part(logs: list[str], shard: str, file: str, options: list[str]) -> int:
    """Fits one part, and returns the number of its rows."""
    command = ["fit", *options, f"--shard={shard}", f"--results={file}", "--resume", "--", *logs]
    answer, _, _ = _gyroid.answer(command, "gyroid.fleet.fit()")
    return len(json.loads(answer)["rows"])
