"""Fits of a fleet's logs on a local Dask cluster, one of whose workers is killed on the way, against one process.

    python examples/fleet.py --out DIR [--logs 5000] [--workers 2] [--parts 50]

Makes the logs in DIR/logs, a tenth of them damaged, fits them by one process and by the cluster, and compares the tables byte by byte.
Prints both times, what a million logs would take by these figures, and how many tasks a second the scheduler hands out. Needs gyroid,
distributed, numpy.
"""

import argparse
import os
import shutil
import signal
import subprocess
import sysconfig
import threading
import time
from pathlib import Path

import numpy as np
from distributed import Client, LocalCluster

import gyroid.fleet

OPTIONS = ["--accept", "--draws", "99"]
DAMAGED = 10  # every so many


def make(folder, logs):
    """Logs of 300 s at 2 Hz, twenty of each robot, from a gyro that is another at each power-on."""
    t_s = np.arange(0.0, 300.0, 0.5)
    for k in range(logs):
        rng = np.random.default_rng(k)
        place = folder / f"robot_{k // 20:05}" / f"{k % 20:02}.csv"
        place.parent.mkdir(parents=True, exist_ok=True)
        c1, c2, tau = 2e-3 + 1e-4 * rng.normal(), -5e-3 + 2e-4 * rng.normal(), 40 * np.exp(0.05 * rng.normal())
        rate = c2 + c1 * (1 - np.exp(-t_s / tau)) + 3e-4 * rng.normal(size=t_s.size)
        text = "t_s,gyro_z_rad_s\n" + "".join(f"{t},{r:.7f}\n" for t, r in zip(t_s, rate))
        place.write_text(text[:500] + "#\n" + text[:100] if k % DAMAGED == DAMAGED - 1 else text)


def kill(client, folder):
    """Kills a worker as soon as there are two parts; its process."""
    pid = next(iter(client.run(os.getpid).values()))

    def when_there():
        while len(list(folder.glob("*.parquet"))) < 2:
            time.sleep(0.01)
        os.kill(pid, signal.SIGKILL)

    thread = threading.Thread(target=when_there)
    thread.start()
    return thread, pid


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--logs", type=int, default=5000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", type=int, default=50)
    options = parser.parse_args()
    logs, one, many = (options.out / name for name in ("logs", "one.parquet", "many.parquet"))
    if not logs.exists():
        make(logs, options.logs)
    program = Path(sysconfig.get_path("scripts")) / "gyroid"
    begin = time.perf_counter()
    subprocess.run([program, "fit", logs, *OPTIONS, "--jobs", "1", "--results", one, "--quiet", "--force"], check=False)
    alone_s = time.perf_counter() - begin
    shutil.rmtree(options.out / f".{many.name}.parts", ignore_errors=True)
    cluster = LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
    with cluster, Client(cluster) as client:
        client.wait_for_workers(options.workers)
        thread, pid = kill(client, options.out / f".{many.name}.parts")
        begin = time.perf_counter()
        found = gyroid.fleet.fit(client, [logs], many, parts=options.parts, options=[*OPTIONS, "--jobs", "1"])
        cluster_s = time.perf_counter() - begin
        thread.join()
        begin = time.perf_counter()
        client.gather(client.map(int, range(options.logs), pure=False))
        tasks_per_s = options.logs / (time.perf_counter() - begin)
    rows, failed = len(found["rows"]), found["failed"]
    million = 1e6 / options.logs
    read = sum(path.stat().st_size for path in logs.rglob("*.csv"))
    print(f"{rows} rows, {failed} of damaged logs; worker {pid} killed; tables equal: {one.read_bytes() == many.read_bytes()}")
    print(f"one process {alone_s:.1f} s, {options.workers} workers {cluster_s:.1f} s: {alone_s / cluster_s:.2f} times as fast")
    print(f"a million logs: {million * read / 1e9:.1f} GB read, {million * alone_s / 3600:.2f} core hours, {options.parts * million:.0f} tasks, "
          f"a table of {million * many.stat().st_size / 1e6:.0f} MB")
    print(f"the scheduler hands out {tasks_per_s:.0f} tasks a second")
    if one.read_bytes() != many.read_bytes():
        raise SystemExit("the tables differ")


if __name__ == "__main__":
    main()
