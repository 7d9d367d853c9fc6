"""Functions that list study cells in tables and count the cells with each status."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.formatting import format_count_with_noun, format_fields_except_none
from rsfstudy.reporting.reduction_tables import (
    describe_missing_reduction_results,
    find_reasons_of_refused_reductions,
)
from rsfstudy.reporting.text_tables import TextTable
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Maximum number of failed cells in a table.
_MAX_FAILED_CELLS_IN_TABLE = 20


def count_cells_by_status(dataset: xr.Dataset) -> Mapping[str, int]:
    """Count the cells with each status.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    mapping of str to int
        Number of cells by status label.
    """
    status = np.asarray(dataset["status"].values)
    return {s.label: int((status == int(s)).sum()) for s in Status if (status == int(s)).any()}


def count_failed_cells_by_status(dataset: xr.Dataset) -> Mapping[str, int]:
    """Count the failed cells with each status.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    mapping of str to int
        Number of failed cells by status label.
    """
    return {
        label: n
        for label, n in count_cells_by_status(dataset).items()
        if not Status[label.upper()].is_answer
    }


def find_failed_cells(dataset: xr.Dataset) -> xr.DataArray:
    """Find the cells whose status is a failure.

    Cells that have not been computed are not counted as failures.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    xarray.DataArray
        True for each failed cell.
    """
    found: xr.DataArray = Status.find_failures(dataset["status"])
    return found


def count_pending_cells(dataset: xr.Dataset) -> int:
    """Count the cells that have not been computed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    int
        Number of cells.
    """
    return int((dataset["status"] == int(Status.PENDING)).sum())


def format_status_counts(dataset: xr.Dataset) -> str:
    """Format the number of cells with each status, and the computational work.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str
        String with the number of cells with each status, and with the total number of
        right-hand-side evaluations. If no cell has the status ``ok``, the string also explains each
        status.
    """
    work, counts = int(dataset["rhs_evaluations"].sum()), count_cells_by_status(dataset)
    nothing = Status.OK.label not in counts
    told = ", ".join(
        f"{count} {label}" + f" ({Status[label.upper()].meaning})" * nothing
        for label, count in counts.items()
    )
    return f"{told}; {work:,} right-hand-side evaluations"


def format_notes_on_incomplete_results(results: xr.Dataset) -> list[str]:
    """Describe the failed cells, and the reductions that have no results.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.

    Returns
    -------
    list of str
        Notes for the user. The list is empty if no cell failed and all reductions have results.
    """
    reasons = find_reasons_of_refused_reductions(results)
    told = [
        ": ".join(note) for note in describe_missing_reduction_results(results, reasons).items()
    ]
    if failed := count_failed_cells_by_status(results):
        each = ", ".join(f"{label} {number}" for label, number in failed.items())
        first = f"{sum(failed.values())} of {results['status'].size} cells failed: {each}"
        told = [first, *told, "use dataset.rsf.failures() for a list"]
    return told


def build_failed_cells_table(dataset: xr.Dataset, results_file: str) -> TextTable:
    """Build a table of failed cells, with commands that recompute the cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    results_file : str
        Path of the results file.

    Returns
    -------
    TextTable
        Table of the first 20 failed cells. Each entry of ``unformatted_rows`` has the keys
        ``coordinates``, ``status``, ``message`` and ``command``. The value of ``command`` is a
        shell command that recomputes the cell.
    """
    failed = find_failed_cells(dataset)
    found = build_data_frame_of_cells(dataset, failed, list(map(str, failed.dims)))
    first = found[:_MAX_FAILED_CELLS_IN_TABLE]
    places: list[dict[Any, Any]] = first[list(failed.dims)].to_dict("records")
    rows = [
        {"cell": format_fields_except_none(place), "status": label, "message": message}
        for place, label, message in zip(places, first["status"], first["message"], strict=True)
    ]
    commands = [format_recompute_command(dataset, results_file, place) for place in places]
    values = [
        {"coordinates": place, "status": label, "message": message, "command": command}
        for place, label, message, command in zip(
            places, first["status"], first["message"], commands, strict=True
        )
    ]
    caption = f"{format_count_with_noun(len(found), 'cell')} failed"
    if len(found) > len(rows):
        caption += f" (first {len(rows)} shown)"
    return TextTable(rows, caption, {"cell", "message"}, unformatted_rows=values)


def build_data_frame_of_cells(
    dataset: xr.Dataset, cell_mask: xr.DataArray, axis_names: Sequence[str]
) -> pd.DataFrame:
    """Build a table of selected cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    cell_mask : xarray.DataArray
        True for the selected cells.
    axis_names : sequence of str
        Names of the axes.

    Returns
    -------
    pandas.DataFrame
        Table with one row per selected cell. The columns are the coordinates of the cell,
        ``status`` and ``message``.
    """
    at = cell_mask.values
    columns = {name: dataset[name].broadcast_like(cell_mask).values[at] for name in axis_names}
    labels = Status.labels_by_code()
    columns["status"] = [labels[code] for code in dataset["status"].values[at].tolist()]
    return pd.DataFrame(columns | {"message": dataset["message"].values[at]})


def format_recompute_command(
    dataset: xr.Dataset, results_file: str, cell_coordinates: Mapping[str, Any]
) -> str:
    """Format the shell command that recomputes one cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    results_file : str
        Path of the results file.
    cell_coordinates : mapping of str to object
        Coordinates of the cell on the axes.

    Returns
    -------
    str
        Shell command.
    """
    words = ["rsfstudy", "rerun", results_file]
    declared_in = StoredDataset(dataset).provenance["declared_in"]
    if declared_in:
        words += ["--study", declared_in]
    for name, value in cell_coordinates.items():
        words += ["--cell", f"{name}={value}"]
    return shlex.join(words)
