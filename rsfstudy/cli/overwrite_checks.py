"""Checks before the commands ``simulate`` and ``fit`` overwrite data files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import InvalidValue


def check_output_may_be_replaced(
    output_path: Path, is_of_same_kind: Callable[[xr.Dataset], bool], kind_of_contents: str
) -> None:
    """Check that a command does not overwrite a different kind of data.

    Parameters
    ----------
    output_path : Path
        File that the command will write. The file need not exist.
    is_of_same_kind : callable
        Function that takes the dataset in the existing file and returns True if the command may
        replace the dataset.
    kind_of_contents : str
        Noun for the data that the command writes, such as "motion".

    Raises
    ------
    InvalidValue
        If the file exists and contains a different kind of data.
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
