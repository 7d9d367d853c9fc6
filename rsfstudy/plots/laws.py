"""Critical displacement step against stiffness, one line a law; the closed forms beside it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._laws import curves
from rsfstudy.plots._style import legend
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("evolution", "normal_stress", "stiffness_ratio")

#: Of a panel, in mm.
HEIGHT = 70.0


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """At the first case of normal stress, with closed forms where there are any."""
    return _boundaries(dataset, axes, 0)


def draw_last(dataset: xr.Dataset, axes: Axes) -> Axes:
    """At the last case of normal stress."""
    return _boundaries(dataset, axes, -1)


PANELS = (draw, draw_last)


def _boundaries(dataset: xr.Dataset, axes: Axes, number: int) -> Axes:
    case = curves(dataset, axes, "critical_displacement", "stiffness_ratio", number, log=True)
    if case["normal_stress"].item() == "constant" and "over_closed_form_closed_form" in case:
        exact = case["over_closed_form_closed_form"]
        axes.plot(
            *_points(exact),
            "o",
            color="0.2",
            markersize=5.0,
            markeredgewidth=0.6,
            fillstyle="none",
            label="closed form",
        )
    axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    axes.set_ylabel(f"Critical displacement, {quantity('critical_displacement').symbol}")
    legend(axes)
    return axes


def _points(values: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and value wherever there is a value."""
    stiffness, known = xr.broadcast(values["stiffness_ratio"], values)
    there = np.isfinite(known.values)
    return stiffness.values[there], known.values[there]
