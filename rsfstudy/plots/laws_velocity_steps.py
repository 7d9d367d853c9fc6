"""Critical load point velocity step against stiffness, one line a law."""

from __future__ import annotations

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
    """At the first case of normal stress."""
    return _boundaries(dataset, axes, 0)


def draw_last(dataset: xr.Dataset, axes: Axes) -> Axes:
    """At the last case of normal stress."""
    return _boundaries(dataset, axes, -1)


PANELS = (draw, draw_last)


def _boundaries(dataset: xr.Dataset, axes: Axes, number: int) -> Axes:
    curves(dataset, axes, "critical_velocity_ratio", "stiffness_ratio", number, log=True)
    axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    axes.set_ylabel(f"Critical load point velocity, {quantity('critical_velocity_ratio').symbol}")
    legend(axes)
    return axes
