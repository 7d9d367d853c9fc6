"""Critical load point velocity of a dilatant fault against drainage."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator

from rsfstudy.plots._axes import log_scale, same_height
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("fault", "drainage")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve a dilatancy, and a line for the drained fault."""
    rate, dilatant = dataset["drainage"], 0
    for fault in dataset["fault"].values:
        row = dataset["critical_velocity_ratio"].sel(fault=fault)
        if dataset["fluid"].sel(fault=fault) == "drained":
            axes.plot(rate, row, "-", color="0.75", linewidth=2.2, label=pretty(fault))
        else:
            style = look(dilatant) | {"marker": marker(dilatant)}
            axes.plot(rate, row, label=pretty(fault), **style)
            dilatant += 1
    axes.set_xlim(float(rate.min()) / 1.5, float(rate.max()) * 1.5)
    log_scale(axes, "x")
    same_height(axes, dataset["critical_velocity_ratio"], log=True)
    if axes.get_yscale() == "log":
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 4.0, 6.0, 8.0)))
    axes.set_xlabel(f"Drainage, {quantity('drainage').symbol}")
    axes.set_ylabel(f"Critical load point velocity, {quantity('critical_velocity_ratio').symbol}")
    axes.set_title("Stable below, unstable above")
    legend(axes)
    return axes
