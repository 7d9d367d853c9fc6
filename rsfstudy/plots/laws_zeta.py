"""Critical load point velocity step against a/(b-a), one line a member of the family of laws."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._laws import shade
from rsfstudy.plots._style import legend, marker
from rsfstudy.plots._text import slope_with_error
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law_exponent", "normal_stress", "b_over_a")

#: Of the panel, in mm.
HEIGHT = 70.0

#: Of constant normal stress, and of variable.
_STYLES = (("-", "full"), ("--", "none"))


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points, and the line each fit draws through them."""
    x = dataset["a_over_b_minus_a"]
    reach = np.array([0.0, 1.04 * float(x.max())])
    largest = float(dataset["law_exponent"].max()) or 1.0
    for stress, (style, fill) in zip(dataset["normal_stress"].values, _STYLES, strict=False):
        for number, exponent in enumerate(dataset["law_exponent"].values):
            row = dataset.sel(law_exponent=exponent, normal_stress=stress)
            colour = shade(float(exponent) / largest)
            label = rf"{stress}, $\epsilon$ = {exponent:g}"
            if "zeta" in row:
                axes.plot(
                    reach, 1.0 + float(row["zeta"]) * reach, style, color=colour, linewidth=0.9
                )
                label += rf": $\zeta$ = {slope_with_error(row, 'zeta', 4)}"
            points = {"color": colour, "fillstyle": fill, "linestyle": "none"}
            axes.plot(
                x, row["critical_velocity_ratio"], marker=marker(number), label=label, **points
            )
    axes.set_xlim(*reach)
    axes.set_ylim(bottom=1.0)
    axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
    axes.set_ylabel(f"Critical load point velocity, {quantity('critical_velocity_ratio').symbol}")
    axes.set_title("Family of laws, $k = k_{cr}$; by normal stress")
    legend(axes)
    return axes
