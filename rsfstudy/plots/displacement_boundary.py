"""Critical load point displacement against a/(b-a), as in Fig. 7 of the paper, and how far it is
from D_c a/(b-a).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty, stiffness
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "load", "case", "stiffness_ratio", "b_over_a")

_STYLES = ("-", "--", ":")


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Fig. 7, and one panel for each law and motion of the load point."""
    places = np.ndindex(dataset.sizes["law"], dataset.sizes["load"])
    return [draw, *(_over(law, load) for law, load in places)]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points of the softest spring, and the closed form; markers that lie on each other show all
    the same, the larger behind.
    """
    dataset = dataset.isel(law=0, load=0)
    x = dataset["a_over_b_minus_a"]
    reach = np.array([0.0, float(x.max()) * 1.03])
    axes.plot(
        reach, reach, "-", color="0.8", linewidth=2.5, label=r"$D_c\,a/(b-a)$ (Gu et al. 1984)"
    )
    softest = dataset["stiffness_ratio"].values.min()
    for number, case in enumerate(dataset["case"].values):
        row = dataset["critical_displacement"].sel(case=case, stiffness_ratio=softest)
        axes.plot(
            x,
            row,
            marker(number),
            color=look(number)["color"],
            markersize=max(2.0, 7.0 - 2.5 * number),
            fillstyle="none" if number < 2 else "full",
            label=pretty(case),
        )
    axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
    axes.set_ylabel(f"Critical displacement, {quantity('critical_displacement').symbol}")
    axes.set_title(f"{_which(dataset)}, {stiffness(softest)}")
    axes.set_xlim(0.0, reach[1])
    axes.set_ylim(0.0, reach[1])
    legend(axes)
    return axes


def _over(law: int, load: int) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        """Critical steps over D_c a/(b-a), every case and stiffness."""
        part = dataset.isel(law=law, load=load)
        x = part["a_over_b_minus_a"]
        axes.axhline(1.0, color="0.7", linewidth=0.8)
        for number, case in enumerate(part["case"].values):
            for ratio, style in zip(part["stiffness_ratio"].values, _STYLES, strict=False):
                row = part["critical_displacement"].sel(case=case, stiffness_ratio=ratio)
                axes.plot(
                    x,
                    row / x,
                    style,
                    color=look(number)["color"],
                    marker=marker(number),
                    markersize=2.5,
                    linewidth=0.9,
                    label=f"{pretty(case)}, {stiffness(ratio)}",
                )
        axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
        axes.set_ylabel(rf"Critical {quantity('critical_displacement').symbol} over $a/(b-a)$")
        axes.set_title(_which(part))
        legend(axes)
        return axes

    return panel


def _which(part: xr.Dataset) -> str:
    law, load = str(part["law"].item()), str(part["load"].item())
    return pretty(f"{law.capitalize()} law, load point {load}")
