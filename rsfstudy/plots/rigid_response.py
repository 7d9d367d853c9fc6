"""Stress less its future steady value against slip, as in Figs. 3 and 4 of the paper."""

from __future__ import annotations

import math

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._style import legend, look
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "normal_stress", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The slip law at variable normal stress (Fig. 3a)."""
    return _panel(dataset, axes, 0, -1)


def _panel(dataset: xr.Dataset, axes: Axes, law: int, stress: int) -> Axes:
    """One law and normal stress condition: steps up solid, steps down dashed."""
    cell = dataset.isel(law=law, normal_stress=stress)
    future = cell["mu_star"] + cell["steady_stress_change"]
    left = (cell["shear_stress"] - future) / cell["a"]
    for rate in cell["load_velocity_ratio"].values:
        decades = math.log10(rate) if rate > 0.0 else 0.0
        if round(decades) == 0 or abs(decades - round(decades)) > 1e-9:
            continue  # steps between decades are there for their numbers
        axes.plot(
            cell["slip"],
            left.sel(load_velocity_ratio=rate),
            "-" if rate > 1.0 else "--",
            color=look(round(abs(decades)) - 1)["color"],
            linewidth=1.0,
            label=f"$10^{{{round(decades)}}}$",
        )
    axes.axhline(0.0, color="0.7", linewidth=0.8, linestyle="-")
    axes.set_xlabel(f"Slip, {quantity('slip').symbol}")
    axes.set_ylabel(r"Stress left, $(\tau - \tau_{ss})/(a\,\sigma_*)$")
    names = cell["law"].item(), cell["normal_stress"].item()
    axes.set_title(f"{str(names[0]).capitalize()} law, {names[1]} normal stress")
    legend(axes, 4, f"Slip rate after the step, {quantity('slip_rate_after_step').symbol}")
    return axes


def _other(law: int, stress: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        return _panel(dataset, axes, law, stress)

    return panel


PANELS = (draw, _other(0, 0), _other(-1, -1), _other(-1, 0))
