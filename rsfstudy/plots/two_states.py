"""Bifurcation diagram of slow oscillations, and Floquet multipliers on the same abscissa; all, and
magnified where periods double.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from rsfstudy.plots import Panel
from rsfstudy.plots._style import legend, look
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "stiffness_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Peaks of the events that are kept."""
    return _diagram(dataset, axes, magnified=False)


def _diagram(dataset: xr.Dataset, axes: Axes, *, magnified: bool) -> Axes:
    data = _of_one_law(dataset)
    ratio, peaks = data["stiffness_ratio"], data["peak_log10_slip_rate"]
    chaotic = data["status"] == int(Status.NOT_PERIODIC)
    for number, (where, shape, label) in enumerate(
        ((~chaotic, "o", "repeats itself"), (chaotic, "x", "does not repeat itself"))
    ):
        shown = peaks.where(where).transpose("stiffness_ratio", "event")
        axes.plot(
            *_points(ratio, shown),
            shape,
            color=look(number)["color"],
            markersize=2.6 - 0.6 * number,
            markeredgewidth=0.5,
            label=label,
        )
    label = "cycle of one event"
    axes.plot(ratio, data["one_event_log10_peak"], "--", color="0.4", linewidth=0.8, label=label)
    axes.set_ylabel(f"Peak slip rate, {quantity('peak_log10_slip_rate').symbol}")
    axes.set_title("Peaks, magnified" if magnified else "Peaks of slip rate, event by event")
    return _abscissa(data, axes, magnified)


def _points(x: xr.DataArray, values: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """All values that there are, and where."""
    at, known = xr.broadcast(x, values)
    there = np.isfinite(known.values)
    return at.values[there], known.values[there]


def _multipliers(dataset: xr.Dataset, axes: Axes, *, magnified: bool) -> Axes:
    data = _of_one_law(dataset)
    ratio, complex_ = data["stiffness_ratio"], data["floquet_multiplier_imaginary"]
    for limit in (-1.0, 1.0):
        axes.axhline(limit, color="0.6", linewidth=0.7)
    for number, (values, shape, label) in enumerate(
        (
            (data["floquet_multiplier"], "o", r"multiplier, $\mathrm{Re}\,\Lambda_1$"),
            (data["lyapunov_exponent"], "s", r"growth per event, $\lambda$"),
            (complex_.where(complex_ > 0.0), "x", r"$\mathrm{Im}\,\Lambda_1$, where complex"),
        )
    ):
        style = look(number) | ({"linestyle": "none"} if shape == "x" else {"linewidth": 0.9})
        if shape != "x" or not magnified:
            axes.plot(ratio, values, marker=shape, markersize=2.5, label=label, **style)
    axes.set_ylabel(r"$\Lambda_1$ of the cycle of one event; $\lambda$")
    more = ", magnified" if magnified else ": beyond $-1$ the cycle repels"
    axes.set_title(f"Multipliers{more}")
    return _abscissa(data, axes, magnified)


def _abscissa(data: xr.Dataset, axes: Axes, magnified: bool) -> Axes:
    """The stiffness of all springs, or of those around where periods double; and where they do."""
    ratio = data["stiffness_ratio"].values
    beyond = ratio[(data["status"] == int(Status.SLIP_RATE_UNBOUNDED)).values]
    bounded = ratio[np.isfinite(data["peak_spread"].values)]
    low, high = float(ratio.min()), float(ratio.max())
    if magnified and bounded.size:
        low = float(bounded.min()) - 0.001
        high = min(high, low + 0.02)
    axes.set_xlim(low, high)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    if beyond.size:
        end = float(bounded.min()) if bounded.size else high
        axes.axvspan(low, end, color="0.9", linewidth=0.0, zorder=0, label="slip rate unbounded")
    if "doubling_by_multiplier" in data and np.isfinite(data["doubling_by_multiplier"]):
        doubling = float(data["doubling_by_multiplier"])
        label = rf"$\Lambda_1 = -1$ at $k = {doubling:.5f}\,k_{{cr}}$"
        axes.axvline(doubling, color="k", linestyle=":", linewidth=0.9, label=label)
    axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    legend(axes)
    return axes


def _of_one_law(dataset: xr.Dataset) -> xr.Dataset:
    return dataset.isel(law=0) if "law" in dataset.dims else dataset


def _panel(function: Callable[..., Axes], magnified: bool) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return function(dataset, axes, magnified=magnified)

    return panel


PANELS = (
    draw,
    _panel(_diagram, True),
    _panel(_multipliers, False),
    _panel(_multipliers, True),
)
