"""Stable and unstable steps of load point velocity, and the boundary between them (Fig. 6)."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._style import legend, look
from rsfstudy.plots._text import pretty
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "stiffness_ratio", "load_velocity_ratio")
#: Beside each other.
COLUMNS = 3

_ANSWERS = ((0.0, "none", "stable"), (1.0, "0.6", "unstable"))


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """One panel a case."""
    return [_panel(number) for number in range(dataset.sizes["case"])]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first case."""
    return _panel(0)(dataset, axes)


def _panel(number: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """The cells of one case, and its boundary with its bracket."""
        case = dataset.isel(case=number)
        cells = case["unstable"].transpose("stiffness_ratio", "load_velocity_ratio")
        ratio, velocity = xr.broadcast(dataset["stiffness_ratio"], dataset["load_velocity_ratio"])
        for answer, face, text in _ANSWERS:
            here = cells.values == answer
            axes.scatter(
                ratio.values[here],
                velocity.values[here],
                s=8,
                facecolors=face,
                edgecolors="0.6",
                linewidths=0.5,
                label=text,
            )
        if "lattice_boundary" in case:
            axes.errorbar(
                case["stiffness_ratio"],
                case["lattice_boundary"],
                yerr=case["lattice_boundary_error"],
                fmt="o-",
                color=look(0)["color"],
                capsize=3,
                label="boundary with its bracket",
            )
        axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
        axes.set_ylabel(f"Load point velocity, {quantity('load_velocity_ratio').symbol}")
        axes.set_title(pretty(case["case"].item()))
        legend(axes, 3)
        return axes

    return panel
