"""Static stress drop (filled) and dynamic stress drop (open) against ln V_0, with the fitted
lines.
"""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "normal_stress", "stiffness_ratio", "load_velocity_ratio")

_DROPS = {"static": "full", "dynamic": "none"}
_MARKERS = {"slip": "o", "slowness": "^"}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The stiffest spring of each law and normal stress condition."""
    x = dataset["log_load_velocity_ratio"]
    stiffest = float(dataset["stiffness_ratio"].max())
    number = 0
    for law in dataset["law"].values:
        for stress in dataset["normal_stress"].values:
            row = dataset.sel(law=law, normal_stress=stress, stiffness_ratio=stiffest)
            for drop, fill in _DROPS.items():
                values, slope = row[f"{drop}_stress_drop"], float(row[f"{drop}_slope"])
                label = f"{law} law, {stress}, {drop}: {slope:.4f}"
                points = axes.plot(x, values, _MARKERS.get(str(law), "s"), label=label)[0]
                points.set(color=f"C{number}", fillstyle=fill, markersize=5)
                line = float(values.mean()) + slope * (x - float(x.where(values.notnull()).mean()))
                axes.plot(x, line, color=f"C{number}", linewidth=0.8)
            number += 1
    axes.set_xlabel(quantity("log_load_velocity_ratio").symbol)
    axes.set_ylabel(r"Stress drop, $\Delta\tau/\sigma_*$")
    axes.set_title(
        rf"Stress drops of limit cycles, $k = {stiffest:g}\,k_{{cr}}$; slopes", fontsize="medium"
    )
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize="x-small", ncols=2, loc="lower left")
    axes.grid(alpha=0.3)
    return axes
