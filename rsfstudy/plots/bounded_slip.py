"""Motions after large steps with the slowness law, as in Figs. 8 and 12 of the paper, and what mass
takes off their peaks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale
from rsfstudy.plots._phase_plane import label_axes, mark_reversed, steady_line
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import stiffness
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("normal_stress", "stiffness_ratio", "load_velocity_ratio", "inertia")

_MASS = {0: "quasi-static", 1: "with mass"}


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Figs. 8 and 12, peaks against the step for each kind of dynamics, and peak after peak."""
    return [draw, draw_mass, *(_peaks(n) for n in range(dataset.sizes["inertia"])), draw_decay]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Quasi-static motions after the smallest and the largest step (Fig. 8)."""
    softest = _softest(dataset).sortby("load_velocity_ratio").sortby("inertia").isel(inertia=0)
    for number, end in enumerate((-1, 0)):
        cell = softest.isel(load_velocity_ratio=end)
        rate = float(cell["load_velocity_ratio"])
        style = {"color": look(number)["color"], "linewidth": 1.1 - 0.5 * number}
        _orbit(axes, cell, rf"$V_0 = {rate:g}\,V_*$", style)
    return _finish(axes, softest, _MASS[int(softest["inertia"])].capitalize())


def draw_mass(dataset: xr.Dataset, axes: Axes) -> Axes:
    """With mass and without it, after the largest step (Fig. 12)."""
    softest = _softest(dataset).sortby("load_velocity_ratio").isel(load_velocity_ratio=-1)
    for number, mass in enumerate(softest["inertia"].values):
        _orbit(axes, softest.isel(inertia=number), _MASS[int(mass)], look(number))
    found = [float(softest[n]) for n in ("paths_parting", "paths_merging") if n in softest]
    for number, where in enumerate(x for x in found if np.isfinite(x)):
        text = "paths part and merge" if number == 0 else None
        axes.axvline(where, color="0.5", linewidth=0.8, linestyle="-.", label=text)
    rate = float(softest["load_velocity_ratio"])
    return _finish(axes, softest, rf"$V_0 = {rate:g}\,V_*$")


def draw_decay(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Peak after peak without mass, after the smallest step: decaying, or periodic."""
    rows = dataset.sortby("load_velocity_ratio").sortby("inertia")
    rows = rows.isel(load_velocity_ratio=0, inertia=0)
    for row, style in _rows(rows):
        axes.plot(row["peak"], row["peak_log10_slip_rate"], **style)
    axes.set_xlabel("Number of the peak")
    axes.set_ylabel(f"Peak slip rate, {quantity('peak_log10_slip_rate').symbol}")
    rate = float(rows["load_velocity_ratio"])
    axes.set_title(rf"Peaks, {_MASS[int(rows['inertia'])]}, $V_0 = {rate:g}\,V_*$")
    legend(axes)
    return axes


def _peaks(mass: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Highest slip rate against the size of the step."""
        part = dataset.isel(inertia=mass)
        for row, style in _rows(part):
            axes.plot(row["load_velocity_ratio"], row["max_log10_slip_rate"], **style)
        log_scale(axes, "x")
        axes.set_xlabel(f"Load point velocity, {quantity('load_velocity_ratio').symbol}")
        axes.set_ylabel(rf"Highest slip rate, {quantity('log10_slip_rate').symbol}")
        axes.set_title(f"Peaks, {_MASS[int(part['inertia'])]}")
        legend(axes)
        return axes

    return panel


def _rows(dataset: xr.Dataset) -> Iterator[tuple[xr.Dataset, dict[str, Any]]]:
    """What there is at each normal stress condition and stiffness, and how it is drawn."""
    for number, stress in enumerate(dataset["normal_stress"].values):
        for other, ratio in enumerate(dataset["stiffness_ratio"].values):
            style = look(number) | {
                "marker": marker(other),
                "label": f"{stress}, {stiffness(ratio)}",
            }
            yield dataset.sel(normal_stress=stress, stiffness_ratio=ratio), style


def _softest(dataset: xr.Dataset) -> xr.Dataset:
    """The softest spring, and variable normal stress where the lattice has it."""
    stress = "variable" if "variable" in dataset["normal_stress"].values else "constant"
    return dataset.sortby("stiffness_ratio").sel(normal_stress=stress).isel(stiffness_ratio=0)


def _orbit(axes: Axes, cell: xr.Dataset, label: str, style: Mapping[str, Any]) -> None:
    drawn = {"linestyle": "-", **style}
    axes.plot(cell["log10_slip_rate"], cell["frictional_stress"], **drawn, label=label)


def _finish(axes: Axes, cell: xr.Dataset, title: str) -> Axes:
    """The steady state, as far as the motions reach, and what the axes and the panel are."""
    reach, height = axes.get_xlim(), axes.get_ylim()
    axes.set(xlim=reach, ylim=height)
    rates = np.linspace(*reach, 400)
    axes.plot(rates, steady_line(cell, rates), ":", color="0.5", label="steady state")
    mark_reversed(axes)
    label_axes(axes)
    stress, ratio = str(cell["normal_stress"].item()), float(cell["stiffness_ratio"])
    axes.set_title(f"{title}, {stress} normal stress, {stiffness(ratio)}")
    legend(axes, 3)
    return axes
