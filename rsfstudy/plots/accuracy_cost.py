"""Work-precision diagrams: error against right-hand sides, one small panel a problem, and the
digits that come out of those asked for. Times are drawn on request, as any variable.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty, wrapped
from rsfstudy.status import Status

#: Dimensions the figure has room for.
DIMENSIONS = ("problem", "integrator", "requested_digits")
#: Small panels on one page.
COLUMNS, HEIGHT = 3, 58.0

#: What others are measured against.
_DEFAULT = "DOP853"
_LOST = "accuracy out of reach"


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """One panel a problem, and that of the digits."""
    diagrams = [_diagram(number) for number in range(dataset.sizes["problem"])]
    return [*diagrams, draw_digits] if _DEFAULT in dataset["integrator"].values else diagrams


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first problem."""
    return _diagram(0)(dataset, axes)


def _diagram(problem: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Error against right-hand sides, and the best that the answer is known to."""
        cell = dataset.isel(problem=problem)
        for number, integrator in enumerate(cell["integrator"].values):
            runs = cell.sel(integrator=integrator)
            style = look(number) | {"linewidth": 1.6 if integrator == _DEFAULT else 0.8}
            work, name = runs["run_evaluations"], str(integrator)
            error = runs["measured_error"]
            axes.plot(work, error.where(error > 0.0), **style, marker=marker(number), label=name)
            lost = runs["status"] == Status.ACCURACY_OUT_OF_REACH
            asked = (10.0 ** -runs["requested_digits"]).where(lost)
            axes.plot(work.where(lost), asked, "x", color=style["color"], label=_LOST)
        floor = float(cell["measured_error_error"].max())
        axes.axhline(max(floor, 1e-16), color="0.6", linewidth=0.8, linestyle=":")
        log_scale(axes, "x")
        log_scale(axes, "y")
        axes.set_xlabel("Right-hand sides")
        axes.set_ylabel("Measured error")
        axes.set_title(wrapped(pretty(cell["problem"].item()), 30))
        legend(axes)
        return axes

    return panel


def draw_digits(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Digits reached against digits asked for, by the default integrator."""
    default = dataset.sel(integrator=_DEFAULT)
    for number, problem in enumerate(dataset["problem"].values):
        row = default.sel(problem=problem)
        name = pretty(problem)
        axes.plot(
            row["requested_digits"],
            row["achieved_digits"],
            **look(number),
            marker=marker(number),
            label=name,
        )
    reach = np.unique(dataset["requested_digits"].values)
    axes.plot(reach, reach, "-", color="0.7", label="as asked")
    axes.set_xlabel("Digits asked for")
    axes.set_ylabel("Digits reached")
    axes.set_title(_DEFAULT)
    legend(axes, 1)
    return axes
