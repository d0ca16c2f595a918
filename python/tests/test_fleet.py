"""Fits of many logs by executors: the same table as by one process, whatever happens on the way."""

from __future__ import annotations

import os
import signal
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyroid.fleet
from conftest import program

OPTIONS = ["--accept", "--draws", "99"]


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    """Forty logs of ten robots; every tenth is damaged."""
    rng = np.random.default_rng(3)
    t_s = np.arange(0.0, 400.0, 0.5)
    for k in range(40):
        folder = tmp_path / "fleet" / f"robot_{k % 10}"
        folder.mkdir(parents=True, exist_ok=True)
        rate = -5e-3 + 2e-4 * rng.normal() + 2e-3 * (1 - np.exp(-t_s / 50)) + 3e-4 * rng.normal(size=t_s.size)
        text = "t_s,gyro_z_rad_s\n" + "".join(f"{t},{r:.9f}\n" for t, r in zip(t_s, rate))
        (folder / f"{k}.csv").write_text(text[:100] + "x,\n" if k % 10 == 9 else text)
    return tmp_path / "fleet"


def by_one(fleet: Path) -> bytes:
    """The table of one process."""
    table = fleet.parent / "one.parquet"
    made = program("fit", fleet, *OPTIONS, "--results", table)
    assert made.returncode == 3, made.stderr
    return table.read_bytes()


def test_processes_make_the_table_of_one(fleet: Path, tmp_path: Path) -> None:
    table = tmp_path / "many.parquet"
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        found = gyroid.fleet.fit(executor, [fleet], table, parts=5, options=OPTIONS, config=tmp_path / "fleet.toml")
        assert (len(found["rows"]), found["failed"], found["parts"]) == (40, 4, 5)
        assert table.read_bytes() == by_one(fleet)
        assert (tmp_path / "fleet.toml").exists() and not list(tmp_path.glob(".*.parts"))
        with pytest.raises(gyroid.Error, match="no_such"):
            gyroid.fleet.fit(executor, [tmp_path / "no_such"], table, parts=2, options=["--axis", "no_such"])


def test_a_dask_worker_that_is_killed_costs_nothing(fleet: Path, tmp_path: Path) -> None:
    distributed: Any = pytest.importorskip("distributed")
    table = tmp_path / "dask.parquet"
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True)
    with cluster, distributed.Client(cluster) as client:
        pids = list(client.run(os.getpid).values())
        client.submit(kill_when_there, str(table.with_name(".dask.parquet.parts")), pids[0], pure=False, workers=list(client.nthreads())[1:])
        found = gyroid.fleet.fit(client, [fleet], table, parts=8, options=OPTIONS)
    assert (len(found["rows"]), found["failed"]) == (40, 4)
    assert table.read_bytes() == by_one(fleet)
    assert not Path(f"/proc/{pids[0]}/exe").exists()


def kill_when_there(folder: str, pid: int) -> None:
    """Kills a process as soon as there is a part."""
    while not list(Path(folder).glob("*.parquet")):
        time.sleep(0.01)
    os.kill(pid, signal.SIGKILL)
