"""Motions after large steps with the slowness law, as in Figs. 8 and 12 of the paper, and what mass
takes off their peaks.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._phase_plane import label_axes, steady_line
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("normal_stress", "stiffness_ratio", "load_velocity_ratio", "inertia")

_MASS = {0: "quasi-static", 1: "with mass"}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Quasi-static motions after the smallest and the largest step (Fig. 8)."""
    softest = _softest(dataset).sortby("load_velocity_ratio").sortby("inertia").isel(inertia=0)
    for number, end in enumerate((-1, 0)):
        cell = softest.isel(load_velocity_ratio=end)
        axes.plot(
            cell["log10_slip_rate"],
            cell["frictional_stress"],
            color=f"C{number}",
            linewidth=1.0,
            label=rf"$V_0 = {float(cell['load_velocity_ratio']):g}\,V_*$",
        )
    _steady(softest, axes)
    return _finish(axes, f"{_MASS[int(softest['inertia'])]}, {_which(softest)}".capitalize())


def draw_mass(dataset: xr.Dataset, axes: Axes) -> Axes:
    """With mass and without it, after the largest step (Fig. 12)."""
    softest = _softest(dataset).sortby("load_velocity_ratio").isel(load_velocity_ratio=-1)
    for number, mass in enumerate(softest["inertia"].values):
        cell = softest.isel(inertia=number)
        axes.plot(
            cell["log10_slip_rate"],
            cell["frictional_stress"],
            "-" if mass else "--",
            color="C3" if mass else "C1",
            linewidth=1.2,
            label=_MASS[int(mass)],
        )
    if "paths_parting" in softest:
        for name, text in (("paths_parting", "part"), ("paths_merging", "merge")):
            axes.axvline(float(softest[name]), color="0.7", linewidth=0.8, linestyle=":")
            axes.text(
                float(softest[name]),
                0.02,
                f" {text}",
                transform=axes.get_xaxis_transform(),
                color="0.4",
                fontsize="small",
            )
    _steady(softest, axes)
    rate = float(softest["load_velocity_ratio"])
    return _finish(axes, rf"$V_0 = {rate:g}\,V_*$, {_which(softest)}")


def draw_peaks(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Highest slip rate against the size of the step, with mass and without it."""
    for number, stress in enumerate(dataset["normal_stress"].values):
        for stiffness, marker in zip(dataset["stiffness_ratio"].values, "os^v", strict=False):
            for mass in dataset["inertia"].values:
                row = dataset.sel(normal_stress=stress, stiffness_ratio=stiffness, inertia=mass)
                axes.plot(
                    row["load_velocity_ratio"],
                    row["max_log10_slip_rate"],
                    marker + ("-" if mass else "--"),
                    color=f"C{number}",
                    fillstyle="full" if mass else "none",
                    markersize=4,
                    linewidth=0.9,
                    label=f"{stress}, {stiffness:g} $k_{{cr}}$, {_MASS[int(mass)]}",
                )
    axes.set_xscale("log")
    axes.set_ylim(0.0, 16.0)
    axes.set_xlabel(quantity("load_velocity_ratio").symbol)
    axes.set_ylabel(rf"Highest {quantity('log10_slip_rate').symbol}")
    axes.set_title("Peaks: filled with mass, open without", fontsize="medium")
    axes.legend(fontsize="xx-small")
    axes.grid(alpha=0.3)
    return axes


def draw_decay(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Peak after peak without mass, after the smallest step: decaying, or periodic."""
    rows = dataset.sortby("load_velocity_ratio").sortby("inertia")
    rows = rows.isel(load_velocity_ratio=0, inertia=0)
    for number, stress in enumerate(dataset["normal_stress"].values):
        for stiffness, marker in zip(dataset["stiffness_ratio"].values, "os^v", strict=False):
            row = rows.sel(normal_stress=stress, stiffness_ratio=stiffness)
            axes.plot(
                row["peak"],
                row["peak_log10_slip_rate"],
                f"{marker}-",
                color=f"C{number}",
                markersize=4,
                linewidth=0.9,
                label=f"{stress}, {stiffness:g} $k_{{cr}}$",
            )
    axes.set_xlabel("Number of the peak")
    axes.set_ylabel(quantity("peak_log10_slip_rate").symbol)
    rate = float(rows["load_velocity_ratio"])
    axes.set_title(
        rf"Peaks, {_MASS[int(rows['inertia'])]}, $V_0 = {rate:g}\,V_*$", fontsize="medium"
    )
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)
    return axes


PANELS = (draw, draw_mass, draw_peaks, draw_decay)


def _softest(dataset: xr.Dataset) -> xr.Dataset:
    """The softest spring, and variable normal stress where the lattice has it."""
    stress = "variable" if "variable" in dataset["normal_stress"].values else "constant"
    return dataset.sortby("stiffness_ratio").sel(normal_stress=stress).isel(stiffness_ratio=0)


def _which(cell: xr.Dataset) -> str:
    stress, ratio = str(cell["normal_stress"].item()), float(cell["stiffness_ratio"])
    return rf"{stress} normal stress, $k = {ratio:g}\,k_{{cr}}(V_*)$"


def _steady(cell: xr.Dataset, axes: Axes) -> None:
    reach = np.linspace(*axes.get_xlim(), 200)
    axes.plot(reach, steady_line(cell, reach), ":", color="0.5", label="steady state")


def _finish(axes: Axes, title: str) -> Axes:
    label_axes(axes)
    axes.set_title(title, fontsize="medium")
    axes.legend(fontsize="small")
    axes.grid(alpha=0.3)
    return axes
