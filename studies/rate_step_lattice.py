"""Critical velocity step from stable and unstable cells (Fig. 6).

Each cell computes one motion and reports whether the slip rate reaches the instability norm. The
critical step lies between the last stable and the first unstable cell, so its accuracy is limited
by the spacing of the lattice. Two digits require 40 motions, whereas the study rate_step_stiffness
obtains ten digits from a few paths.
"""

import math

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import Triggered
from rsfstudy.reductions import Boundary
from rsfstudy.study.figure_declarations import MatplotlibAxes

from ._paper import CONSTANT_NORMAL_STRESS, NORMAL_STRESS_CASES, PAPER, REFERENCE


def plot_cells(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
    """Draw the boundary, and mark stable cells (open) and unstable cells (filled).

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    if "lattice_boundary" in dataset:
        boundary, half = dataset["lattice_boundary"], dataset["lattice_boundary_error"]
        bars = {"fmt": "o-", "elinewidth": 0.8, "capsize": 3, "label": "boundary with its bracket"}
        axes.errorbar(dataset["stiffness_ratio"], boundary, half, **bars)
    ratio, velocity = xr.broadcast(dataset["stiffness_ratio"], dataset["load_velocity_ratio"])
    for answer, face, text in ((0.0, "none", "stable"), (1.0, "0.6", "unstable")):
        here = dataset["unstable"].transpose(*ratio.dims).values == answer
        places = ratio.values[here], velocity.values[here]
        look = {"facecolors": face, "edgecolors": "0.6", "linewidths": 0.5}
        axes.scatter(*places, s=8, label=text, **look)


figure = Figure(
    [
        Panel(
            x="stiffness_ratio",
            facet=["case"],
            overlays=[plot_cells],
            y_label="Load point velocity, $V_0/V_*$",
            legend_columns=3,
        )
    ],
    columns=3,
)


study = Study(
    name="rate_step_lattice",
    title="Stable and unstable steps of load point velocity, slip law, b/a = e",
    summary=Study.caption(__doc__),
    base=Scene(law="slip", b_over_a=math.e),
    axes=[
        Axis("case", NORMAL_STRESS_CASES),
        Axis("stiffness_ratio", [1.0, 1.25, 1.5, 1.75, 2.0]),
        Axis("load_velocity_ratio", np.geomspace(1.1, 5.0, 40)),
    ],
    measure=Triggered(),
    reductions=[Boundary(name="lattice_boundary", of="unstable", on="load_velocity_ratio")],
    claims=[
        Claim(
            id="C8",
            statement="constant normal stress, k = k_cr: V_0/V_* = 1 + 1/(e - 1)",
            source=f"{PAPER}, eqs. 10 and 11",
            variable="lattice_boundary",
            where={"case": CONSTANT_NORMAL_STRESS, "stiffness_ratio": 1.0},
            published=1.0 + 1.0 / (math.e - 1.0),
            tolerance=0.0309,
            reason="half of the spacing of the lattice at this point",
        )
    ],
    plot=figure,
    references=[REFERENCE],
)
