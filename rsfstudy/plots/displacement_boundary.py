"""Critical load point displacement against a/(b-a), as in Fig. 7 of the paper, and how far it is
from D_c a/(b-a).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "stiffness_ratio", "b_over_a")

_MARKERS = "os^"


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points of the softest spring, the closed form, and an inset with the ratio of the two at
    every stiffness.
    """
    x = dataset["a_over_b_minus_a"]
    reach = np.array([0.0, float(x.max()) * 1.03])
    axes.plot(reach, reach, "--", color="0.5", label=r"$D_c\,a/(b-a)$ (Gu et al. 1984)")
    inset = axes.inset_axes((0.6, 0.13, 0.37, 0.36))
    softest = dataset["stiffness_ratio"].values.min()
    for number, case in enumerate(dataset["case"].values):
        row = dataset["critical_displacement"].sel(case=case)
        points = axes.plot(
            x,
            row.sel(stiffness_ratio=softest),
            _MARKERS[number % len(_MARKERS)],
            markersize=4.5,
            label=str(case).replace("alpha", r"$\alpha$"),
        )
        for stiffness, style in zip(
            dataset["stiffness_ratio"].values, ("-", "--", ":"), strict=False
        ):
            colour = points[0].get_color()
            inset.plot(
                x, row.sel(stiffness_ratio=stiffness) / x, style, color=colour, linewidth=1.0
            )
    inset.set_title(r"over $D_c\,a/(b-a)$; solid to dotted: stiffer", fontsize="x-small")
    inset.tick_params(labelsize="x-small")
    axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
    axes.set_ylabel(f"Critical {quantity('critical_displacement').symbol}")
    axes.set_title(
        rf"Displacement boundary, slip law, load point held, $k = {softest:g}\,k_{{cr}}$",
        fontsize="medium",
    )
    axes.set_xlim(0.0, reach[1])
    axes.set_ylim(0.0, reach[1])
    axes.legend(fontsize="small", loc="upper left")
    return axes
