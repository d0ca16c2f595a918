"""A fleet's logs on a local Dask cluster, one of whose workers is killed on the way, against one process.

    python examples/fleet.py --out DIR [--command fit|noise|diagnose] [--logs 5000] [--workers 2] [--parts 50] [--report FILE.html]

Makes the logs in DIR/COMMAND, a tenth of them damaged, has them fitted, or their noise estimated, or their gap diagnosed, by one process
and by the cluster, and compares the tables byte by byte. Prints both times, what a million logs would take by these figures, and how
many tasks a second the scheduler hands out. --report writes Dask's page of the run. Needs gyroid, distributed, numpy, and bokeh for the
page.
"""

import argparse
import contextlib
import os
import shutil
import signal
import subprocess
import sysconfig
import threading
import time
from pathlib import Path

import numpy as np
from distributed import Client, LocalCluster, performance_report

import gyroid.fleet

OPTIONS = {"fit": ["--accept", "--draws", "99"], "noise": ["--draws", "99"], "diagnose": []}
DAMAGED = 10  # every so many
ROBOT = Path(__file__).parents[1] / "data" / "robot.toml"
GYRO = """
[gyro]
c1_rad_s = -2.4e-3
c2_rad_s = 8e-3
time_constant_s = 240.0
angle_random_walk_rad_sqrt_s = 1.5e-4
"""


def program():
    return Path(sysconfig.get_path("scripts")) / "gyroid"


def make_drives(folder, logs):
    """Drives of 10 s by the simulator, two of each robot, whose right wheel is larger by 1.8 to 2.2 %; and the nominal simulator."""
    folder.mkdir(parents=True)
    nominal = ROBOT.read_text() + GYRO
    (folder / "sim.toml").write_text(nominal)
    for k in range(logs):
        ratio = 0.02 + 0.001 * np.random.default_rng(k // 2).normal()
        robot, place = folder / "robot.toml", folder / "logs" / f"robot_{k // 2:05}" / f"{k % 2}.csv"
        robot.write_text(f'{nominal}[[effect]]\nid = "wheel.radius_mismatch"\nright_over_left_minus_one = {ratio}\n')
        place.parent.mkdir(parents=True, exist_ok=True)
        course = ["--course", "random", "--duration", "10", "--seed", str(k)]
        subprocess.run([program(), "simulate", robot, *course, "-o", place, "--quiet"], check=True)
        if k % DAMAGED == DAMAGED - 1:
            place.write_text(place.read_text()[:500] + "#\n")


def make_logs(folder, logs):
    """Logs of 300 s at 2 Hz, twenty of each robot, from a gyro that is another at each power-on."""
    t_s = np.arange(0.0, 300.0, 0.5)
    for k in range(logs):
        rng = np.random.default_rng(k)
        place = folder / "logs" / f"robot_{k // 20:05}" / f"{k % 20:02}.csv"
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
    parser.add_argument("--command", choices=OPTIONS, default="fit")
    parser.add_argument("--logs", type=int, default=5000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--parts", type=int, default=50)
    parser.add_argument("--report", type=Path)
    options = parser.parse_args()
    place, asked = options.out / options.command, OPTIONS[options.command]
    logs, one, many = (place / name for name in ("logs", "one.parquet", "many.parquet"))
    drives = options.command == "diagnose"
    if not logs.exists():
        (make_drives if drives else make_logs)(place, options.logs)
    words = ["gap", "fleet", place / "sim.toml"] if drives else [options.command]
    begin = time.perf_counter()
    subprocess.run([program(), *words, logs, *asked, "--jobs", "1", "--results", one, "--quiet", "--force"], check=False)
    alone_s = time.perf_counter() - begin
    shutil.rmtree(place / f".{many.name}.parts", ignore_errors=True)
    cluster = LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
    with cluster, Client(cluster) as client:
        client.wait_for_workers(options.workers)
        thread, pid = kill(client, place / f".{many.name}.parts")
        begin = time.perf_counter()
        before = [place / "sim.toml"] if drives else []
        work = getattr(gyroid.fleet, options.command)
        with performance_report(filename=options.report, mode="inline") if options.report else contextlib.nullcontext():
            found = work(client, *before, [logs], many, parts=options.parts, options=[*asked, "--jobs", "1"])
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
