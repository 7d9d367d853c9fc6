"""Stick-slip cycles in the plane of stress and slip rate, as in Figs. 9 and 10 of the paper."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Spring stress against slip rate, one orbit a cell, with the steady-state line of constant
    normal stress.
    """
    cells = dataset["shear_stress"].dims[:-1]
    orbits = dataset.stack(cell=cells) if cells else dataset.expand_dims("cell")
    for number in range(orbits.sizes["cell"]):
        orbit = orbits.isel(cell=number)
        if int(orbit["status"]) != 0:
            continue
        point = np.atleast_1d(np.asarray(orbit["cell"].item(), dtype=object))
        axes.plot(
            orbit["log10_slip_rate"],
            orbit["shear_stress"],
            linestyle="--" if "constant" in point else "-",
            color=f"C{number // 2}",
            linewidth=1.2,
            label=", ".join(map(str, point)),
        )
    reach = np.array(axes.get_xlim())
    weakening = (dataset["b_over_a"] - 1.0) * dataset["a"]
    if weakening.ndim == 0 and dataset["mu_star"].ndim == 0:
        steady = float(dataset["mu_star"]) - float(weakening) * np.log(10.0) * reach
        axes.plot(reach, steady, ":", color="0.5", label="steady state, constant normal stress")
    axes.axhline(0.0, color="0.8", linewidth=0.8)
    axes.set_xlim(*reach)
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(f"Shear stress, {quantity('shear_stress').symbol}")
    axes.set_title(str(dataset.attrs.get("title", "")), fontsize="medium")
    axes.legend(fontsize="small")
    return axes
