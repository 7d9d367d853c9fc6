"""Functions that build the tables of frictional healing that the commands print."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from rsfstudy.reporting.fit_summaries import format_value_with_stderr
from rsfstudy.reporting.text_tables import TextTable

#: Headings of the quantities in the table that are printed with and without their errors.
_HEADING_BY_QUANTITY_WITHOUT_ERROR = {"friction_before": "mu_0", "peak_friction": "peak"}
_HEADING_BY_QUANTITY_WITH_ERROR = {"healing": "healing", "relaxation": "relaxation"}


def is_hold_table(dataset: xr.Dataset) -> bool:
    """Return True if a dataset is a table of holds.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to check.

    Returns
    -------
    bool
        True if the dataset contains the healing of holds.
    """
    return "hold" in dataset.dims and {"healing", "healing_rate"} <= set(dataset.variables)


def summarise_holds(hold_table: xr.Dataset) -> Iterator[TextTable | str]:
    """Yield a table of the holds, and sentences about the healing rate.

    Parameters
    ----------
    hold_table : xarray.Dataset
        Table of holds, as returned by ``rsfstudy.healing``.

    Yields
    ------
    TextTable or str
        Table with one row per hold, followed by the healing rate and remarks.
    """
    rows = []
    for number in range(hold_table.sizes["hold"]):
        hold = hold_table.isel(hold=number)
        suffix = "stderr" if "healing_stderr" in hold else "error"
        row = {"hold": f"{hold['hold'].item()}", "duration (s)": f"{hold['duration'].item():.5g}"}
        for name, heading in _HEADING_BY_QUANTITY_WITHOUT_ERROR.items():
            row[heading] = f"{hold[name].item():.5f}".replace("nan", "-")
        for name, heading in _HEADING_BY_QUANTITY_WITH_ERROR.items():
            row[heading] = format_value_with_stderr(
                hold[name].item(), hold[f"{name}_{suffix}"].item()
            )
        rows.append(row)
    yield TextTable(rows)
    rate, stderr = (hold_table[name].item() for name in ("healing_rate", "healing_rate_stderr"))
    if math.isfinite(rate):
        yield f"healing rate: {format_value_with_stderr(rate, stderr)} per decade of hold duration"
    else:
        yield "healing rate: unknown, because fewer than two hold durations have a peak of friction"
    if peakless := (np.flatnonzero(np.isnan(hold_table["healing"].values)) + 1).tolist():
        yield f"no peak of friction on reloading after hold {', '.join(map(str, peakless))}"
