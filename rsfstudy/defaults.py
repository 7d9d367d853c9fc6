"""What is so unless told otherwise. Nothing else is imported here: the command line states it in
its help, which answers at once.
"""

from __future__ import annotations

from pathlib import Path

#: Directory of results.
OUTPUT_DIRECTORY = Path("outputs")
#: Formats of results; the first is the usual one.
RESULT_FORMATS = ("netcdf", "zarr")
#: Formats of figures, by the ending of the file; the first is the usual one.
FIGURE_FORMATS = ("png", "pdf", "svg")
#: CPU time in s a cell may take on a worker, far beyond what the usual work budget allows.
CELL_TIME_LIMIT = 600.0
#: Right-hand sides that a fit of a record may evaluate.
FIT_BUDGET = 50_000_000
