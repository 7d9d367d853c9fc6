"""Stable and unstable steps of load point velocity, and the boundary between them (Fig. 6)."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "stiffness_ratio", "load_velocity_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The cells of the last case, and every case's boundary with its bracket."""
    x = dataset["stiffness_ratio"]
    cells = dataset["unstable"].isel(case=-1).transpose("stiffness_ratio", "load_velocity_ratio")
    ratio, velocity = xr.broadcast(x, dataset["load_velocity_ratio"])
    for answer, face, text in ((0.0, "none", "stable"), (1.0, "0.6", "unstable")):
        here = cells.values == answer
        axes.scatter(
            ratio.values[here],
            velocity.values[here],
            s=12,
            facecolors=face,
            edgecolors="0.6",
            linewidths=0.6,
            label=f"{text} ({dataset['case'].values[-1]})",
        )
    for number, case in enumerate(dataset["case"].values):
        row = dataset.sel(case=case)
        if "lattice_boundary" in row:
            axes.errorbar(
                x,
                row["lattice_boundary"],
                yerr=row["lattice_boundary_error"],
                fmt="o-",
                color=f"C{number}",
                markersize=3,
                linewidth=0.9,
                capsize=4,
                label=str(case),
            )
    axes.set_xlabel(quantity("stiffness_ratio").symbol)
    axes.set_ylabel(quantity("load_velocity_ratio").symbol)
    axes.set_title("Boundary between stable and unstable cells, with brackets", fontsize="medium")
    axes.legend(fontsize="small", loc="upper left")
    return axes
