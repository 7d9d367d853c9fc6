"""Checks of the data files that ``simulate`` and ``fit`` write next to their figures."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import InvalidValue


def check_output_may_be_replaced(
    output_path: Path, is_of_same_kind: Callable[[xr.Dataset], bool], kind_of_contents: str
) -> None:
    """Check that an output file does not contain another kind of data.

    Parameters
    ----------
    output_path : Path
        File to write, which need not exist.
    is_of_same_kind : callable
        Function that returns True if a dataset may be replaced.
    kind_of_contents : str
        Noun for the contents, such as "motion".

    Raises
    ------
    InvalidValue
        If the file contains another kind of data.
    """
    check_regular_file("--output", output_path)
    if not output_path.exists():
        return
    try:
        with xr.open_dataset(output_path, engine="netcdf4") as there:
            if is_of_same_kind(there):
                return
    except (OSError, RuntimeError, ValueError):
        pass  # the file has no dataset
    rule = f"already exists and does not contain a {kind_of_contents}"
    remedy = "Choose another --output, or move the file first."
    raise InvalidValue("--output", str(output_path), rule, remedy=remedy)
