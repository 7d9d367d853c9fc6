"""Critical load point displacement against a/(b-a), as in Fig. 7 of the paper, and how far it is
from D_c a/(b-a).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "load", "case", "stiffness_ratio", "b_over_a")

_MARKERS = "os^"


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points of the softest spring, the closed form, and an inset with the ratio of the two at
    every stiffness.
    """
    dataset = dataset.isel(law=0, load=0)
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
        rf"{_which(dataset)}, $k = {softest:g}\,k_{{cr}}$",
        fontsize="medium",
    )
    axes.set_xlim(0.0, reach[1])
    axes.set_ylim(0.0, reach[1])
    axes.legend(fontsize="small", loc="upper left")
    return axes


def _over(law: int, load: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Critical steps over D_c a/(b-a), every case and stiffness."""
        part = dataset.isel(law=law, load=load)
        x = part["a_over_b_minus_a"]
        for number, case in enumerate(part["case"].values):
            for stiffness, style in zip(
                part["stiffness_ratio"].values, ("-", "--", ":"), strict=False
            ):
                row = part["critical_displacement"].sel(case=case, stiffness_ratio=stiffness)
                label = f"{case}, {stiffness:g} $k_{{cr}}$"
                axes.plot(x, row / x, style, color=f"C{number}", linewidth=1.0, label=label)
        axes.axhline(1.0, color="0.7", linewidth=0.8)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
        axes.set_ylabel(rf"Critical {quantity('critical_displacement').symbol} over $a/(b-a)$")
        axes.set_title(_which(part), fontsize="medium")
        axes.legend(fontsize="xx-small", ncols=3)
        axes.grid(alpha=0.3)
        return axes

    return panel


def _which(part: xr.Dataset) -> str:
    law, load = str(part["law"].item()), str(part["load"].item())
    return f"{law.capitalize()} law, load point {load.replace('V_*', '$V_*$')}"


PANELS = (draw, _over(0, -1), _over(-1, 0), _over(-1, -1))
