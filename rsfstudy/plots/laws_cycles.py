"""Static stress drop and slowest slip rate of stick-slip against V_0, one line a law."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale
from rsfstudy.plots._laws import curves
from rsfstudy.plots._style import legend
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("evolution", "normal_stress", "load_velocity_ratio")

_LABELS = {
    "static_stress_drop": rf"Static stress drop, {quantity('static_stress_drop').symbol}",
    "min_log10_slip_rate": r"Slowest slip rate, $\log_{10}(V/V_*)$",
}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Static stress drop at the first case of normal stress."""
    return _panel(dataset, axes, "static_stress_drop", 0)


def _panel(dataset: xr.Dataset, axes: Axes, variable: str, number: int) -> Axes:
    curves(dataset, axes, variable, "load_velocity_ratio", number, log=False)
    log_scale(axes, "x")
    axes.set_xlabel(f"Load point velocity, {quantity('load_velocity_ratio').symbol}")
    axes.set_ylabel(_LABELS[variable])
    legend(axes)
    return axes


def _of(variable: str, number: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Another quantity, or the last case of normal stress."""
        return _panel(dataset, axes, variable, number)

    return panel


PANELS = (
    draw,
    _of("static_stress_drop", -1),
    _of("min_log10_slip_rate", 0),
    _of("min_log10_slip_rate", -1),
)
