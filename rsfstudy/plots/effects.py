"""Effects as a table of bars: work, what a right-hand side costs, and the numbers of the cycle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "coupling", "dynamics")

_COLOURS = {"slip": "C0", "slowness": "C1"}


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
            place, values, height=0.38, color=_COLOURS.get(str(law), "C2"), label=f"{law} law"
        )
        for y, value in zip(place, values, strict=True):
            text = f" {value:.{digits}g}" if np.isfinite(value) else " no cycle"
            axes.text(value if value > 0.0 else 0.0, y, text, va="center", fontsize="xx-small")
    axes.set_yticks(at, [f"{c}\n{d}" for c, d in rows], fontsize="xx-small")
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.margins(x=0.15)
    axes.set_xlabel(label)
    axes.set_ylabel("Effects")
    axes.set_title(label, fontsize="medium")
    axes.legend(fontsize="x-small")
    return axes


def _panel(name: str, label: str, digits: int = 4) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return _bars(dataset, axes, name, label, digits)

    return panel


PANELS: tuple[Callable[[xr.Dataset, Axes], Axes], ...] = (
    draw,
    _panel("evaluation_cost", "Time of a right-hand side, over quasi-static, constant stress", 2),
    _panel("static_stress_drop", r"Static stress drop, $\sigma_*$"),
    _panel("max_log10_slip_rate", r"Fastest slip, $\log_{10}(V/V_*)$"),
)
