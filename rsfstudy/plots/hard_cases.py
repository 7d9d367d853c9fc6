"""Hard cases: measured error beside its estimate, and the work of each case."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._axes import name_points
from rsfstudy.plots._style import legend, look
from rsfstudy.status import Status

#: Dimensions the figure has room for.
DIMENSIONS = ("hard_case",)
#: Millimetres of a panel: one line a case.
HEIGHT = 150.0


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Measured errors (filled) and their estimates (open), one row a case; names of statuses, and
    "exact" where there is no error.
    """
    rows = np.arange(dataset.sizes["hard_case"])
    by_status = dataset["answer"].isnull().values
    error, estimate = (
        dataset[name].where(~dataset["answer"].isnull()).values
        for name in ("measured_error", "error_estimate")
    )
    wrong = dataset["status"].values != int(Status.OK)
    colour = look(0)["color"]
    axes.plot(_above(estimate), rows, "o", fillstyle="none", color=colour, label="estimate")
    axes.plot(_above(error), rows, "o", markersize=2, color=colour, label="measured error")
    axes.set_xscale("log")
    labels = {int(s): s.label.replace("_", " ") for s in Status}
    across = axes.get_yaxis_transform()
    for row in rows[by_status | (error == 0.0)]:
        text = labels[int(dataset["ended_as"].values[row])] if by_status[row] else "exact"
        colour = look(1)["color"] if wrong[row] else "0.35"
        axes.text(0.02, row, text, va="center", fontsize=5.5, color=colour, transform=across)
    if wrong.any():
        axes.plot(
            np.ones(int(wrong.sum())), rows[wrong], "x", color=look(1)["color"], label="wrong"
        )
    axes.set_xlabel("Error; in words: what came out")
    _cases(dataset, axes)
    legend(axes, 3)
    return axes


def _above(values: np.ndarray) -> np.ndarray:
    """Values that a log axis can show."""
    return np.where(values > 0.0, values, np.nan)


def draw_work(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Right-hand sides of each case; 0 where none was needed."""
    rows, work = np.arange(dataset.sizes["hard_case"]), dataset["rhs_evaluations"].values
    axes.barh(rows[work > 0], work[work > 0], color="0.6", left=0.0)
    axes.set_xscale("log")
    for row in rows[work == 0]:
        across = axes.get_yaxis_transform()
        axes.text(0.02, row, "none", va="center", fontsize=5.5, color="0.35", transform=across)
    axes.set_xlabel("Right-hand sides")
    return _cases(dataset, axes)


PANELS = (draw, draw_work)


def _cases(dataset: xr.Dataset, axes: Axes) -> Axes:
    name_points(axes.yaxis, [str(name) for name in dataset["hard_case"].values], 60)
    axes.tick_params(axis="y", labelsize=5.5)
    axes.set_ylim(dataset.sizes["hard_case"] - 0.5, -0.5)
    axes.set_ylabel("Case")
    return axes
