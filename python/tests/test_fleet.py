"""Fits of many logs by executors: the same table as by one process, whatever happens on the way."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
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


def test_logs_in_a_store_make_the_table_of_one(fleet: Path, tmp_path: Path) -> None:
    """Addresses, as of S3; here those of fsspec for the disk, and of its memory, which only threads share."""
    fsspec: Any = pytest.importorskip("fsspec")
    one = tmp_path / "one.parquet"
    made = program("noise", fleet, "--draws", "99", "--results", one)
    assert made.returncode == 3, made.stderr
    expected = pyarrow.parquet.read_table(one).drop_columns(["path", "modified", "error"])
    # neither notes nor what is hidden is a log
    (fleet / "README.md").write_text("ours")
    (fleet / ".robot_1.csv").write_text("hidden")
    table = f"file://{tmp_path}/store.parquet"
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        found = gyroid.fleet.noise(executor, [f"file://{fleet}"], table, parts=7, options=["--draws", "99"])
    assert (len(found["rows"]), found["failed"]) == (40, 4)
    got = pyarrow.parquet.read_table(tmp_path / "store.parquet")
    assert got.drop_columns(["path", "modified", "error"]).equals(expected)
    assert got["path"][0].as_py() == f"{str(fleet).strip('/')}/robot_0/0.csv"
    assert not list(tmp_path.glob(".*.parts"))

    memory = fsspec.filesystem("memory")
    memory.put(str(fleet / "robot_3"), "/bucket/robot_3", recursive=True)
    with ThreadPoolExecutor(2) as executor:
        gyroid.fleet.noise(executor, ["memory://bucket/robot_3"], "memory://bucket/few.csv", parts=2, options=["--draws", "99"])
    few = memory.cat("/bucket/few.csv").decode().splitlines()
    assert len(few) == 5 and few[1].startswith("bucket/robot_3/13.csv"), few[:2]
    with ThreadPoolExecutor(1) as executor, pytest.raises(gyroid.FileError, match="no file"):
        gyroid.fleet.noise(executor, ["memory://nothing"], "memory://bucket/none.csv", parts=2)


@pytest.fixture
def s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Files of an S3 server, which is moto's; processes that are started find it by their environment."""
    pytest.importorskip("moto")
    s3fs: Any = pytest.importorskip("s3fs")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    for name, value in [("ENDPOINT_URL", f"http://127.0.0.1:{port}"), ("ACCESS_KEY_ID", "us"), ("SECRET_ACCESS_KEY", "ours"), ("REGION", "eu-central-1")]:
        monkeypatch.setenv(f"AWS_{name}", value)
    with subprocess.Popen([sys.executable, "-m", "moto.server", "-p", str(port)], stderr=subprocess.DEVNULL) as server:
        try:
            # a cache of listings would not see what the workers write
            store = s3fs.S3FileSystem(use_listings_cache=False, skip_instance_cache=True)
            until_s = time.monotonic() + 60
            while True:
                try:
                    store.mkdir("fleet-of-ours")
                    break
                except OSError:
                    assert time.monotonic() < until_s, "the server does not answer"
                    time.sleep(0.1)
            yield store
        finally:
            server.kill()


def test_logs_in_s3_make_the_table_of_one(fleet: Path, s3: Any, tmp_path: Path) -> None:
    made = program("fit", fleet, *OPTIONS, "--results", tmp_path / "one.parquet")
    assert made.returncode == 3, made.stderr
    expected = pyarrow.parquet.read_table(tmp_path / "one.parquet").drop_columns(["path", "modified", "error"])
    s3.put(str(fleet), "fleet-of-ours/logs", recursive=True)
    address, table = "s3://fleet-of-ours/logs", "s3://fleet-of-ours/results/fleet.parquet"
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        found = gyroid.fleet.fit(executor, [address], table, parts=5, options=OPTIONS, config=tmp_path / "fleet.toml")
        assert (len(found["rows"]), found["failed"]) == (40, 4)
        s3.get("fleet-of-ours/results/fleet.parquet", str(tmp_path / "many.parquet"))
        assert pyarrow.parquet.read_table(tmp_path / "many.parquet").drop_columns(["path", "modified", "error"]).equals(expected)
        assert s3.find("fleet-of-ours/results") == ["fleet-of-ours/results/fleet.parquet"]
        assert (tmp_path / "fleet.toml").exists()
        # a log that somebody else adds meanwhile is seen
        s3.pipe("fleet-of-ours/logs/robot_0/new.csv", (fleet / "robot_0" / "0.csv").read_bytes().rsplit(b"\n", 2)[0] + b"\n")
        found = gyroid.fleet.fit(executor, [address], table, parts=5, options=OPTIONS)
        assert len(found["rows"]) == 41
        with pytest.raises(gyroid.FileError, match="no-such"):
            gyroid.fleet.fit(executor, ["s3://no-such/logs"], table, parts=2)


def test_effects_of_robots_are_told_by_processes(tmp_path: Path) -> None:
    rest = "schema = 1\nkind = 'stationary'\nsample_time_s = 0.2\n[gyro]\nc1_rad_s = 1e-3\nc2_rad_s = -2e-3\ntime_constant_s = 120.0\n"
    rest += "angle_random_walk_rad_sqrt_s = 1e-4\nturn_on_bias_std_rad_s = 2e-4\nwarm_up_relative_std = 0.03\n"
    (tmp_path / "sim.toml").write_text(rest)
    tone = "[[effect]]\nid = 'gyro.tone'\nfrequency_hz = 0.31\namplitude_rad_s = 2.2e-4\n"
    (tmp_path / "real.toml").write_text(rest + tone)
    for robot in range(4):
        folder = tmp_path / "fleet" / f"robot_{robot}"
        folder.mkdir(parents=True)
        real = tmp_path / ("sim.toml" if robot == 2 else "real.toml")
        program("simulate", real, "--duration", "900", "--seed", robot, "-o", folder / "still.csv")
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        found = gyroid.fleet.diagnose(
            executor, tmp_path / "sim.toml", [tmp_path / "fleet"], tmp_path / "gap.parquet", parts=3, unit=r"robot_(\d)"
        )
    [effect] = found["effects"]
    assert (effect["id"], effect["reach"], effect["units"]) == ("gyro.tone", "some", ["0", "1", "2", "3"])
    assert [unit["probability"] > 0.5 for unit in effect["shared"]["units"]] == [True, True, False, True]


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
