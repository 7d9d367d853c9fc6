"""Default values that the Python functions and the command line share.

The module imports no other module of the package, so that ``rsfstudy --help`` starts quickly.
"""

from __future__ import annotations

from pathlib import Path


class Defaults:
    """Default values and formats of the functions and commands."""

    #: Default directory of results files.
    OUTPUT_DIRECTORY = Path("outputs")
    #: Formats of results files. The first format is the default.
    RESULT_FORMATS = ("netcdf", "zarr")
    #: Formats of figures, which are also the file name extensions. The first format is the default.
    FIGURE_FORMATS = ("png", "pdf", "svg")
    #: CPU time limit in s for one cell on a worker. A cell exhausts the default budget of
    #: right-hand-side evaluations long before this time.
    CELL_CPU_TIME_LIMIT = 600.0
    #: Maximum number of right-hand-side evaluations of a fit to a record.
    FIT_EVALUATION_BUDGET = 50_000_000
