"""The parts of a table of many logs, and where they are kept."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from gyroid import _gyroid
from gyroid._errors import Error, of_kind

#: The program in a process of its own, whose folder is not this one's.
_PROGRAM = [sys.executable, "-c", "import sys; from gyroid._cli import main; sys.exit(main())"]
#: Endings of logs in a folder: ``gyroid::population::find``.
_ENDINGS = (
    *(".csv", ".tsv", ".csv.gz", ".tsv.gz", ".jsonl", ".jsonl.gz", ".parquet", ".bag", ".mcap", ".db3", ".ulg", ".ulog", ".bin"),
    *(".mat", ".h5", ".hdf5", ".npy", ".npz"),
)


def _remote(path: str) -> bool:
    return "://" in path


class Parts:
    """So many parts of the logs, each a file of results, and the table of all.

    Parameters
    ----------
    function
        The function that is told in messages.
    logs
        Logs or folders of them, paths or addresses.
    results
        The table, a path or an address.
    parts
        Number of parts.
    """

    def __init__(self, function: str, logs: Sequence[str | os.PathLike[str]], results: str | os.PathLike[str], parts: int) -> None:
        self.function, self.parts = f"gyroid.fleet.{function}()", parts
        self.logs = [os.fspath(log) for log in logs]
        self.table = os.fspath(results)
        head, _, name = self.table.rpartition("/")
        # hidden: a search for logs passes it over
        self.folder = f"{head}/.{name}.parts" if head else f".{name}.parts"
        if not _remote(self.folder):
            Path(self.folder).mkdir(parents=True, exist_ok=True)
            self.table, self.folder = os.path.abspath(self.table), os.path.abspath(self.folder)
        if not any(map(_remote, self.logs)):
            return
        if not all(map(_remote, self.logs)):
            raise Error("usage", "logs", None, "some are paths and others addresses", "give one kind")
        if not any(map(_files, self.logs)):
            raise of_kind("io", self.logs[0], None, "there is no file", "logs are files called .csv, .parquet, .mcap and so on")

    def make(self, part: int, command: Sequence[str], before: Sequence[str]) -> int:
        """Makes one part, and returns the number of its rows. What is there of it is taken over."""
        file = f"{self.folder}/{part}.parquet"
        if not any(map(_remote, [*self.logs, file])):
            made = [*command, f"--shard={part}/{self.parts}", f"--results={file}", "--resume", "--", *before, *self.logs]
            answer, _, _ = _gyroid.answer(made, self.function)
            return len(json.loads(answer)["rows"])
        with tempfile.TemporaryDirectory(prefix="gyroid-") as here:
            local = os.path.join(here, f"{part}.parquet")
            _fetch(file, local)
            logs, shard = self.logs, [f"--shard={part}/{self.parts}"]
            if _remote(self.logs[0]):
                # the part was chosen here, by the rule of --shard
                logs, shard = [_mirror(log, here, part, self.parts) for log in self.logs], []
                logs = [log for log in logs if os.path.exists(os.path.join(here, log))]
                if not logs:
                    return 0
            rows = self._run([*command, *shard, f"--results={local}", "--resume", "--", *before, *logs], here)
            _keep(local, file)
        return rows

    def _run(self, command: Sequence[str], folder: str) -> int:
        """Rows that the program made in a folder, whose paths are then those of the rows."""
        answer = os.path.join(folder, "answer.json")
        done = subprocess.run([*_PROGRAM, *command[: command.index("--")], f"--json={answer}", "--quiet", *command[command.index("--") :]],
                              cwd=folder, capture_output=True, text=True, check=False)
        if os.path.exists(answer):
            with open(answer, encoding="utf-8") as file:
                return len(json.load(file)["rows"])
        finding, _, hint = done.stderr.strip().removeprefix("error: ").partition("\n  hint: ")
        raise of_kind("format", self.function, None, finding, hint or None)

    def merge(self, options: Sequence[str], keep: bool = False) -> dict[str, Any]:
        """The JSON of the table, which is written; the parts are taken away unless they are to be kept."""
        with tempfile.TemporaryDirectory(prefix="gyroid-") as here:
            files = [f"{self.folder}/{part}.parquet" for part in range(1, self.parts + 1)]
            table = self.table
            if _remote(self.folder):
                local = [os.path.join(here, f"{part}.parquet") for part in range(1, self.parts + 1)]
                for file, to in zip(files, local):
                    _fetch(file, to)
                files, table = local, os.path.join(here, PurePosixPath(self.table).name)
            files = [file for file in files if os.path.exists(file)]
            answer, _, _ = _gyroid.answer(["merge", *options, f"--out={table}", "--force", "--", *files], self.function)
            if _remote(self.folder):
                _keep(table, self.table)
        if not keep:
            self._remove()
        found: dict[str, Any] = json.loads(answer)
        return found

    def _remove(self) -> None:
        if not _remote(self.folder):
            shutil.rmtree(self.folder)
            return
        with _store(self.folder) as (system, path):
            if system.exists(path):
                system.rm(path, recursive=True)


@contextlib.contextmanager
def _store(address: str) -> Iterator[tuple[Any, str]]:
    """The file system of an address, and the path there; what goes wrong with it is told in our words."""
    try:
        from fsspec.core import url_to_fs  # type: ignore[import-untyped]
    except ImportError:
        raise Error("usage", address, None, "reading it needs fsspec", "pip install fsspec, with s3fs, gcsfs or adlfs") from None
    try:
        # listings that are kept would not show what others wrote meanwhile
        yield url_to_fs(address, use_listings_cache=False)
    except Error:
        raise
    except Exception as error:  # each driver has its own
        raise of_kind("io", address, None, f"{type(error).__name__}: {error}", "check the address, and what the store lets you do") from error


def _files(address: str) -> dict[str, str]:
    """Paths of the files of an address, by their names within it, as ``--shard`` has them."""
    with _store(address) as (system, path):
        if system.isfile(path):
            return {PurePosixPath(path).name: path}
        found = {str(PurePosixPath(file).relative_to(path)): str(file) for file in map(str, system.find(path))}
    shown = (name for name in found if not any(piece.startswith(".") for piece in name.split("/")))
    return {name: found[name] for name in shown if name.lower().endswith(_ENDINGS)}


def _mirror(address: str, folder: str, part: int, parts: int) -> str:
    """Copies the files of a part into a folder; returns what the address is called there."""
    files = _files(address)
    name = address.partition("://")[2].strip("/")
    alone = list(files) == [PurePosixPath(name).name]
    with _store(address) as (system, _):
        for within, path in files.items():
            # gyroid::population::Shard
            if int(hashlib.sha256(within.encode()).hexdigest()[:16], 16) % parts == part - 1:
                to = os.path.join(folder, name) if alone else os.path.join(folder, name, within)
                os.makedirs(os.path.dirname(to), exist_ok=True)
                system.get_file(path, to)
    return name


def _fetch(address: str, to: str) -> None:
    """Copies a file that may not be there."""
    if not _remote(address):
        if os.path.exists(address):
            shutil.copy(address, to)
        return
    with _store(address) as (system, path):
        if system.exists(path):
            system.get_file(path, to)


def _keep(file: str, address: str) -> None:
    """Copies a file to a place where it is there whole or not at all."""
    if _remote(address):
        with _store(address) as (system, path):
            system.makedirs(str(PurePosixPath(path).parent), exist_ok=True)
            system.put_file(file, path)
    else:
        shutil.copy(file, f"{address}.new")
        os.replace(f"{address}.new", address)
