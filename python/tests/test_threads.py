"""Work leaves the interpreter to others."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import gyroid
from conftest import DATA


def test_python_runs_while_the_library_works() -> None:
    done = threading.Event()
    worker = threading.Thread(target=lambda: (gyroid.noise(DATA / "cats_coldsoak_a.csv"), done.set()))
    ticks = 0
    worker.start()
    while not done.is_set():
        time.sleep(0.001)
        ticks += 1
    worker.join()
    # a held interpreter lets nothing run between the beginning and the end
    assert ticks > 20


def test_calls_in_threads_do_not_meet() -> None:
    seeds = range(8)
    alone = [gyroid.simulate(DATA / "truth.toml", duration_s=30, seed=seed).recording for seed in seeds]
    with ThreadPoolExecutor(4) as pool:
        together = list(
            pool.map(lambda seed: gyroid.simulate(DATA / "truth.toml", duration_s=30, seed=seed).recording, seeds)
        )
    for one, other in zip(alone, together, strict=True):
        assert one.to_dict().keys() == other.to_dict().keys()
        assert all((one[k] == other[k]).all() for k in one)
