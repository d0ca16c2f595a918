"""One task of `cargo bench --bench peers`, by a library that Python users have.

    python peers.py LIBRARY TASK FILE STEP_S

Prints as JSON the median of the seconds of RUNS runs, the peak memory of the process, the library's version, and its answers: of
each quantity the estimate and, where the library gives one, the standard deviation. Some have a curve, as pairs of numbers.
`python peers.py mujoco.sysid make FILE STEP_S` writes the drive with the payload and prints the true values.
"""

import importlib.metadata
import json
import math
import os
import resource
import statistics
import sys
import time
from pathlib import Path

# a second thread of the linear algebra makes these tasks slower, many times beside other work
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
RUNS = max(1, int(os.environ.get("RUNS", "3")))
LAGS, WHITE_LAGS = 1000, 40


def of_array(path):
    import numpy

    return numpy.fromfile(path)


def bare(**answers):
    return {name: {"estimate": float(value)} for name, value in answers.items()}


def warm_up(path, step):
    """The model, the log and a start."""
    import numpy

    y = of_array(path)
    t = numpy.arange(len(y)) * step
    model = lambda t, c1, c2, tau: c1 * (1 - numpy.exp(-t / tau)) + c2
    return model, t, y, {"c1": y[-1000:].mean() - y[:1000].mean(), "c2": y[:1000].mean(), "tau": t[-1] / 5}


def warm_up_answers(estimates, stds):
    names, scales = ("C1, mrad/s", "C2, mrad/s", "T, s"), (1e3, 1e3, 1.0)
    return {n: {"estimate": float(k * e), "std": float(k * s)} for n, k, e, s in zip(names, scales, estimates, stds)}


def fit_scipy(path, step):
    from scipy.optimize import curve_fit

    model, t, y, start = warm_up(path, step)
    work = lambda: curve_fit(model, t, y, p0=list(start.values()))
    return work, lambda found: (warm_up_answers(found[0], found[1].diagonal() ** 0.5), None)


def fit_lmfit(path, step):
    import lmfit

    model, t, y, start = warm_up(path, step)
    work = lambda: lmfit.Model(model).fit(y, t=t, **start)
    values = lambda found: [found.params[name] for name in ("c1", "c2", "tau")]
    return work, lambda found: (warm_up_answers([p.value for p in values(found)], [p.stderr for p in values(found)]), None)


def deviations(path, step):
    """allantools at the averaging times that allan-variance takes."""
    import allantools
    import numpy

    y = of_array(path)
    samples = numpy.unique(numpy.round(numpy.logspace(0, numpy.log2(len(y) // 10), num=100, base=2))).astype(int)
    return lambda: allantools.oadev(y, rate=1 / step, data_type="freq", taus=samples * step)[:2]


def allan_allantools(path, step):
    return deviations(path, step), lambda found: ({}, [(round(tau / step), d) for tau, d in zip(*found)])


def noise_allantools(path, step):
    """Read off the curve as textbooks do: N at one second, B at the lowest point."""
    import numpy

    curve = deviations(path, step)

    def work():
        tau, deviation = curve()
        return numpy.exp(numpy.interp(0.0, numpy.log(tau), numpy.log(deviation))), deviation.min() / math.sqrt(2 * math.log(2) / math.pi)

    return work, lambda found: (terms(*found), None)


def allan_allan_variance(path, step):
    from allan_variance import compute_avar

    y = of_array(path)
    return lambda: compute_avar(y, step), lambda found: ({}, [(round(t / step), v**0.5) for t, v in zip(*found)])


def noise_allan_variance(path, step):
    from allan_variance import compute_avar, estimate_parameters

    y = of_array(path)
    work = lambda: estimate_parameters(*compute_avar(y, step))[0]
    others = lambda found: bare(**{"other terms": sum(found[["quantization", "walk", "ramp"]] > 0)})
    return work, lambda found: (terms(found["white"], found["flicker"]) | others(found), None)


def terms(n, b):
    return bare(**{"N, mrad/√s": 1e3 * n, "B, mrad/s": 1e3 * b})


def autocorrelation_statsmodels(path, _):
    from statsmodels.tsa.stattools import acf

    y = of_array(path)
    told = lambda r: (bare(**{"at lag 1": r[1], "at lag 10": r[10]}), list(enumerate(map(float, r))))
    return lambda: acf(y, nlags=LAGS, fft=True), told


def whiteness_statsmodels(path, _):
    from statsmodels.stats.diagnostic import acorr_ljungbox

    y = of_array(path)
    told = lambda found: (bare(Q=found["lb_stat"].iloc[0], p=found["lb_pvalue"].iloc[0]), None)
    return lambda: acorr_ljungbox(y, lags=[WHITE_LAGS]), told


def filterpy(path, _):
    import filterpy_filter

    return filterpy_filter.task(path)


rolling_filterpy = slip_filterpy = filterpy


def payload_mujoco_sysid(path, _):
    import payload

    return payload.fit(path), lambda found: (found, None)


def make_mujoco_sysid(path, _):
    import payload

    print(json.dumps(payload.write(path)))
    sys.exit()


def read(table, path):
    """Rows, and how far the z axis is off what was written."""
    import numpy

    z = numpy.asarray(table["gyro_z_rad_s"])
    return bare(**{"rows": len(z), "largest error of z, rad/s": abs(z - of_array(Path(path).with_name("raw.bin"))).max()}), None


def csv_pandas(path, _):
    import pandas

    return lambda: pandas.read_csv(path), lambda table: read(table, path)


def csv_polars(path, _):
    import polars

    return lambda: polars.read_csv(path), lambda table: read(table, path)


def parquet_pyarrow(path, _):
    import pyarrow.parquet

    return lambda: pyarrow.parquet.read_table(path), lambda table: read(table, path)


def parquet_polars(path, _):
    import polars

    return lambda: polars.read_parquet(path), lambda table: read(table, path)


def main():
    library, task, path, step = sys.argv[1:]
    work, tell = globals()[f"{task}_{library}".replace("-", "_").replace(".", "_")](path, float(step))
    seconds = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - begin)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    answers, curve = tell(result)
    version = importlib.metadata.version(library.partition(".")[0])
    print(json.dumps({"seconds": statistics.median(seconds), "peak_mib": peak, "version": version, "answers": answers, "curve": curve}))


if __name__ == "__main__":
    main()
