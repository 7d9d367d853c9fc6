"""Rate-step boundary the plain way: a lattice of cells that are stable or unstable (Fig. 6).

Each cell follows one motion and says whether it reaches the instability norm; the boundary between
the cells is all such a lattice can tell, to within its spacing. It costs 40 motions for two digits
where rate_step_stiffness has ten from a few paths.
"""

import math

import numpy as np
import xarray as xr

from rsfstudy import Axis, Claim, Figure, Panel, Scene, Study
from rsfstudy.measures import Triggered
from rsfstudy.reductions import Boundary
from rsfstudy.study.figure_declarations import Axes

from ._paper import CONSTANT_NORMAL_STRESS, NORMAL_STRESS_CASES, PAPER, REFERENCE


def plot_cells(dataset: xr.Dataset, axes: Axes) -> None:
    """Stable cells open, and unstable ones filled; and the boundary, where they have one."""
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
            reason="half of the spacing of the lattice there",
        )
    ],
    plot=figure,
    references=[REFERENCE],
)
