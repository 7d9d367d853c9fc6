"""Effects as a table of bars: work, what a right-hand side costs, and the numbers of the cycle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import name_points
from rsfstudy.plots._style import legend, look

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "coupling", "dynamics")

#: Millimetres of a panel: one line a combination and law.
HEIGHT = 88.0


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Right-hand sides of one cycle."""
    return _bars(dataset, axes, "work_per_cycle", "Right-hand sides per cycle", 4)


def _bars(dataset: xr.Dataset, axes: Axes, name: str, label: str, digits: int) -> Axes:
    rows = [(c, d) for c in dataset["coupling"].values for d in dataset["dynamics"].values]
    laws = list(dataset["law"].values)
    at = np.arange(len(rows))
    for number, law in enumerate(laws):
        values = [float(dataset[name].sel(law=law, coupling=c, dynamics=d)) for c, d in rows]
        place = at + (number - 0.5 * (len(laws) - 1)) * 0.4
        axes.barh(
            place,
            values,
            height=0.36,
            color=look(number)["color"],
            hatch=("", "/////")[number % 2],
            edgecolor="white",
            linewidth=0.0,
            label=f"{law} law",
        )
        for y, value in zip(place, values, strict=True):
            text = f" {value:.{digits}g}" if np.isfinite(value) else " no cycle"
            where = value if value > 0.0 else 0.0
            axes.text(where, y, text, va="center", fontsize=5.5, clip_on=True)
    name_points(axes.yaxis, [f"{c}, {d}" for c, d in rows], 20)
    axes.tick_params(axis="y", labelsize=6)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.margins(x=0.25)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel(label)
    axes.set_ylabel("Effects")
    legend(axes)
    return axes


def _panel(name: str, label: str, digits: int = 4) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return _bars(dataset, axes, name, label, digits)

    return panel


PANELS: tuple[Callable[[xr.Dataset, Axes], Axes], ...] = (
    draw,
    _panel("evaluation_cost", "Time of a right-hand side, relative", 2),
    _panel("static_stress_drop", r"Static stress drop, $\sigma_*$"),
    _panel("max_log10_slip_rate", r"Fastest slip, $\log_{10}(V/V_*)$"),
)
