"""One task of `cargo bench --bench beside`, by the libraries that Python users have.

    python beside.py LIBRARY TASK FILE STEP_S        prints {"seconds": median of the runs, "peak_mib": of the process}

TASK: fit (FILE: raw float64), allan (its averaging times in samples on standard input), autocorrelation, csv, parquet.
"""

import json
import os
import resource
import statistics
import sys
import time

library, task, path, step = sys.argv[1], sys.argv[2], sys.argv[3], float(sys.argv[4])
RUNS = max(1, int(os.environ.get("RUNS", "3")))


def rates():
    import numpy

    return numpy.fromfile(path)


def fit_scipy():
    import numpy
    from scipy.optimize import curve_fit

    y = rates()
    t = numpy.arange(len(y)) * step
    model = lambda t, c1, c2, tau: c1 * (1 - numpy.exp(-t / tau)) + c2
    start = [y[-1000:].mean() - y[:1000].mean(), y[:1000].mean(), t[-1] / 5]
    return lambda: curve_fit(model, t, y, p0=start)


def fit_lmfit():
    import lmfit
    import numpy

    y = rates()
    t = numpy.arange(len(y)) * step
    model = lmfit.Model(lambda t, c1, c2, tau: c1 * (1 - numpy.exp(-t / tau)) + c2)
    start = dict(c1=y[-1000:].mean() - y[:1000].mean(), c2=y[:1000].mean(), tau=t[-1] / 5)
    return lambda: model.fit(y, t=t, **start)


def allan_allantools():
    import allantools

    y = rates()
    taus = [int(m) * step for m in sys.stdin.read().split()]
    return lambda: allantools.oadev(y, rate=1 / step, data_type="freq", taus=taus)


def autocorrelation_statsmodels():
    from statsmodels.tsa.stattools import acf

    y = rates()
    return lambda: acf(y, nlags=1000, fft=True)


def csv_pandas():
    import pandas

    return lambda: pandas.read_csv(path)


def csv_polars():
    import polars

    return lambda: polars.read_csv(path)


def parquet_pyarrow():
    import pyarrow.parquet

    return lambda: pyarrow.parquet.read_table(path, columns=["t_s", "gyro_z_rad_s"])


work = globals()[f"{task}_{library}"]()
seconds = []
for _ in range(RUNS):
    begin = time.perf_counter()
    work()
    seconds.append(time.perf_counter() - begin)
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps({"seconds": statistics.median(seconds), "peak_mib": peak}))
