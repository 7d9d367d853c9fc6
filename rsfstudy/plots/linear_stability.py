"""Critical stiffness against slip rate for several driving angles, as in Fig. 2 of the paper."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("phi", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve an angle; dots mark thresholds found from growth of the assembled equations."""
    rate = np.log10(dataset["load_velocity_ratio"])
    for number, phi in enumerate(dataset["phi"].values):
        row = dataset.sel(phi=phi)
        axes.plot(rate, row["critical_stiffness"], color=f"C{number}", label=f"{phi:g}°")
        axes.plot(
            rate, row["critical_stiffness_from_growth"], ".", color=f"C{number}", markersize=3
        )
    axes.set_yscale("log")
    axes.set_xlabel(quantity("log10_slip_rate").symbol)
    axes.set_ylabel(quantity("critical_stiffness").symbol)
    axes.set_title("Stable above, unstable below; dots: from growth", fontsize="medium")
    axes.legend(title=quantity("phi").symbol, fontsize="small")
    axes.grid(alpha=0.3, which="both")
    return axes
