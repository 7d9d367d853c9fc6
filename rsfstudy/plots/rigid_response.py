"""Stress less its future steady value against slip, as in Figs. 3 and 4 of the paper."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "normal_stress", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve a step; the laws by colour, variable normal stress solid and constant normal stress
    dashed.
    """
    future = dataset["mu_star"] + dataset["steady_stress_change"]
    left = (dataset["shear_stress"] - future) / dataset["a"]
    keys = []
    for number, law in enumerate(dataset["law"].values):
        for stress in dataset["normal_stress"].values:
            line, label = f"C{number}", f"{law} law, {stress} normal stress"
            line += "--" if stress == "constant" else "-"
            keys += axes.plot([], [], line, label=label)
            for rate in dataset["load_velocity_ratio"].values:
                curve = left.sel(law=law, normal_stress=stress, load_velocity_ratio=rate)
                axes.plot(dataset["slip"], curve, line, linewidth=0.9)
    axes.axhline(0.0, color="0.7", linewidth=0.8)
    axes.set_xlabel(quantity("slip").symbol)
    axes.set_ylabel(r"$(\tau - \tau_{ss})/(a\,\sigma_*)$")
    axes.set_title("Rigid slider: steps of slip rate by 1 to 4 decades", fontsize="medium")
    axes.legend(handles=keys, fontsize="small")
    return axes
