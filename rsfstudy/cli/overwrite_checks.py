"""Checks that the ``simulate`` and ``fit`` commands make before they overwrite data files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import check_regular_file


def check_output_may_be_replaced(
    output_path: Path, same_kind_predicate: Callable[[xr.Dataset], bool], kind_of_contents: str
) -> None:
    """Check that a command does not overwrite a different kind of data.

    Parameters
    ----------
    output_path : Path
        File that the command will write. The file need not exist.
    same_kind_predicate : callable
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
            if same_kind_predicate(there):
                return
    except (OSError, RuntimeError, ValueError):
        pass  # the file has no dataset
    rule = f"already exists and does not contain a {kind_of_contents}"
    remedy = "Choose another --output, or move the file first."
    raise InvalidValue("--output", str(output_path), rule, remedy=remedy)
