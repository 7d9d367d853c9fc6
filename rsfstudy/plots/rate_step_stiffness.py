"""Critical load point velocity against stiffness, as in Fig. 6 of the paper, with the slowness law
beside it.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "case", "stiffness_ratio")

_MARKERS = {"slip": "o", "slowness": "^"}


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve a case and law, the published approximation for the slip law (eq. 11), and the slip
    law magnified.
    """
    x = dataset["stiffness_ratio"]
    weakening = float(dataset["b_over_a"]) - 1.0
    axes.plot(
        x, np.exp(x) / weakening, "--", color="0.5", label=r"$\exp(k/k_{cr})/\lambda$ (eq. 11)"
    )
    for law in dataset["law"].values:
        for number, case in enumerate(dataset["case"].values):
            row = dataset.sel(law=law, case=case)
            axes.plot(
                x,
                row["critical_velocity_ratio"],
                marker=_MARKERS.get(str(law), "s"),
                markersize=3.5,
                linewidth=0.8,
                color=f"C{number}",
                label=f"{law} law, {case}",
            )
    axes.set_yscale("log")
    inset = axes.inset_axes((0.62, 0.3, 0.36, 0.32))
    inset.plot(x, np.exp(x) / weakening, "--", color="0.5")
    if "slip" in dataset["law"].values:
        for case in dataset["case"].values:
            inset.plot(x, dataset["critical_velocity_ratio"].sel(law="slip", case=case))
    inset.set_title("slip law", fontsize="x-small")
    inset.tick_params(labelsize="x-small")
    axes.set_xlabel(quantity("stiffness_ratio").symbol)
    axes.set_ylabel(f"Critical {quantity('critical_velocity_ratio').symbol}")
    axes.set_title(f"Rate-step boundary, b/a = {weakening + 1.0:.5g}", fontsize="medium")
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3, which="both")
    return axes
