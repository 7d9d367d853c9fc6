"""Hard cases: measured error beside its estimate, and the work of each case."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.status import Status

#: Dimensions the figure has room for.
DIMENSIONS = ("hard_case",)

#: Errors below this are drawn there.
_FLOOR = 1e-17


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Measured errors (filled) and their estimates (open), one row a case; names of statuses."""
    rows = np.arange(dataset.sizes["hard_case"])
    exact = dataset["answer"].isnull().values
    error = np.maximum(dataset["measured_error"].values, _FLOOR)
    wrong = dataset["status"].values != int(Status.OK)
    axes.plot(dataset["error_estimate"], rows, "o", fillstyle="none", color="C0", label="estimate")
    axes.plot(np.where(exact, np.nan, error), rows, "o", markersize=3, color="C0", label="measured")
    if wrong.any():
        axes.plot(np.full(wrong.sum(), 1.0), rows[wrong], "x", color="tab:red", label="wrong")
    labels = {int(s): s.label for s in Status}
    for row in rows[exact]:
        text = labels[int(dataset["ended_as"].values[row])]
        axes.text(_FLOOR * 2.0, row, text, va="center", fontsize="xx-small", color="0.35")
    axes.set_xscale("log")
    axes.set_xlim(_FLOOR, 10.0)
    axes.set_xlabel("Error")
    axes.legend(fontsize="x-small", loc="lower right")
    return _cases(dataset, axes, "What comes out: measured error and estimate, or status")


def draw_work(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Right-hand sides of each case."""
    rows = np.arange(dataset.sizes["hard_case"])
    axes.barh(rows, np.maximum(dataset["rhs_evaluations"].values, 1.0), color="0.6")
    axes.set_xscale("log")
    axes.set_xlabel("Right-hand sides")
    return _cases(dataset, axes, "Work")


PANELS = (draw, draw_work)
#: Inches of each panel: one line a case.
PANEL = (7.5, 8.5)


def _cases(dataset: xr.Dataset, axes: Axes, title: str) -> Axes:
    names = [str(name) for name in dataset["hard_case"].values]
    axes.set_yticks(np.arange(len(names)), names, fontsize=6)
    axes.set_ylabel("Case")
    axes.invert_yaxis()
    axes.set_title(title, fontsize="medium")
    axes.grid(alpha=0.3)
    return axes
