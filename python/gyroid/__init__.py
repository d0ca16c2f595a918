"""Gyro bias warm-up models from recorded logs, the filter that uses them, and the diagnosis of the sim-to-real gap.

Logs are paths, arrays, or data frames with the Arrow PyCapsule interface (polars, pandas, pyarrow); configurations are paths
or :class:`Configuration`. Quantities are in SI, and names carry the unit. A result that is not fit for use is returned, and
says so in ``fit_for_use``; what cannot be computed raises :class:`Error`. The GIL is released during work.
"""

from gyroid._drive import diagnose, explain, navigate, simulate
from gyroid._errors import Error, FileError
from gyroid._files import export, inspect, read, study
from gyroid._gyroid import __version__
from gyroid._input import Frame, Log
from gyroid._next import plan, power
from gyroid._options import Drive, DriveOptions, RestOptions
from gyroid._record import Array, Estimate, Record, Result, Rows
from gyroid._rest import fit, noise, validate
from gyroid._results import (
    Check,
    Comparison,
    Diagnosis,
    Explanation,
    Export,
    Fit,
    Inspection,
    Navigation,
    Noise,
    Plan,
    Power,
    Simulation,
    Study,
)
from gyroid._simulator import compare
from gyroid._values import Config, Configuration, Picture, Recording

__all__ = [
    "Array",
    "Check",
    "Comparison",
    "Config",
    "Configuration",
    "Diagnosis",
    "Drive",
    "DriveOptions",
    "Error",
    "Estimate",
    "Explanation",
    "Export",
    "FileError",
    "Fit",
    "Frame",
    "Inspection",
    "Log",
    "Navigation",
    "Noise",
    "Picture",
    "Plan",
    "Power",
    "Record",
    "Recording",
    "RestOptions",
    "Result",
    "Rows",
    "Simulation",
    "Study",
    "__version__",
    "compare",
    "diagnose",
    "explain",
    "export",
    "fit",
    "inspect",
    "navigate",
    "noise",
    "plan",
    "power",
    "read",
    "simulate",
    "study",
    "validate",
]
