"""Maps over load point velocity and stiffness: peak slip rate of limit cycles, and once more close
to the edge, with the linear boundary of steady sliding. Other variables are drawn on request.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.plots import Panel
from rsfstudy.plots._map import colours, contours, edges, statuses
from rsfstudy.plots._style import legend
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "normal_stress", "stiffness_ratio", "load_velocity_ratio")
#: Millimetres of a panel.
HEIGHT = 52.0

_PEAK = "max_log10_slip_rate"
_LINEAR = "#D55E00"
#: Stiffness ratio from which on the edge is shown enlarged.
_CLOSE = 0.8


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first law at the first normal stress condition, with the regimes."""
    return _mapped(dataset, axes, {"law": 0, "normal_stress": 0}, 0.0)


def _panel(law: int, normal_stress: int, softest: float) -> Panel:
    where = {"law": law, "normal_stress": normal_stress}
    return lambda dataset, axes: _mapped(dataset, axes, where, softest)


PANELS = tuple(
    _panel(law, stress, softest)
    for softest in (0.0, _CLOSE)
    for law in (0, -1)
    for stress in (0, -1)
)


def _mapped(dataset: xr.Dataset, axes: Axes, where: dict[str, int], softest: float) -> Axes:
    """One map, from a stiffness on."""
    case = dataset.isel(where).transpose("stiffness_ratio", "load_velocity_ratio", ...)
    x, y = np.log10(case["load_velocity_ratio"].values), case["stiffness_ratio"].values
    peak = case[_PEAK].assign_coords(load_velocity_ratio=x)
    at = edges(x), edges(y)
    softest = softest if y.min() < softest < y.max() else 0.0
    axes.set(xlim=(at[0][0], at[0][-1]), ylim=(softest or at[1][0], at[1][-1]))
    statuses(axes, at, case["status"].values, peak.isnull().values)
    if bool(peak.notnull().any()):
        low, high = float(dataset[_PEAK].min()), float(dataset[_PEAK].max())
        drawn = colours(axes, at, peak.values, vmin=low, vmax=high)
        bar = cast(Figure, axes.figure).colorbar(drawn, ax=axes, pad=0.02)
        bar.set_label(r"Peak slip rate, $\log_{10}(V/V_*)$")
        near = peak.where(peak["stiffness_ratio"] > softest, drop=True)
        contours(axes, near, np.arange(math.ceil(low), high, 2.0 if softest else 1.0).tolist())
    if "cycling_edge_linear" in case:
        linear = case["cycling_edge_linear"]
        axes.plot(x, linear, "-", color=_LINEAR, linewidth=1.3, label="linear boundary")
    _regimes(case, axes, peak)
    axes.set_xlabel(r"Load point velocity, $\log_{10}(V_0/V_*)$")
    axes.set_ylabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    law, stress = str(case["law"].item()), str(case["normal_stress"].item())
    axes.set_title(f"{law.capitalize()} law, {stress} normal stress")
    legend(axes)
    return axes


def _regimes(case: xr.Dataset, axes: Axes, peak: xr.DataArray) -> None:
    """The peak slip rate at which the instability norm is reached, and names of the regimes."""
    inertial_time = float(case["period"]) * float(case["reference_rate"]) / (2.0 * math.pi)
    norm = math.log10(float(case["instability_norm"]) / inertial_time)
    low, high = axes.get_ylim()
    seen = peak.where((peak["stiffness_ratio"] > low) & (peak["stiffness_ratio"] < high), drop=True)
    if not seen.size:
        return
    x, y = seen["load_velocity_ratio"].values, seen["stiffness_ratio"].values
    if min(seen.shape) > 1 and float(seen.min()) < norm < float(seen.max()):
        lines = axes.contour(x, y, seen, [norm], colors="black", linewidths=1.0, linestyles="--")
        axes.clabel(lines, fmt="norm", fontsize=6)
    settled = case["status"].sel(stiffness_ratio=y).values == Status.NO_LIMIT_CYCLE
    regimes = {
        "steady sliding": settled,
        "slow oscillation": (seen < norm).values,
        "stick-slip": (seen >= norm).values,
    }
    margin = 0.06 * (high - low)
    box = {"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0}
    for name, here in regimes.items():
        rows, columns = np.nonzero(here)
        if rows.size > 0.02 * seen.size and np.ptp(y[rows]) > 2.0 * margin:
            inside = low + margin, high - margin
            middle = float(np.median(x[columns])), float(np.clip(np.median(y[rows]), *inside))
            axes.text(*middle, name, bbox=box, ha="center", va="center", fontsize=6)
