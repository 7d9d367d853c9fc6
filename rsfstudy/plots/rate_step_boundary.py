"""Critical load point velocity against a/(b-a), as in Fig. 5 of the paper."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty, slope_with_error, stiffness
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "b_over_a")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points with their error bars, the fitted lines, and the closed form for constant normal
    stress.
    """
    x = dataset["a_over_b_minus_a"]
    reach = np.array([0.0, float(x.max()) * 1.03])
    axes.plot(
        reach, 1.0 + reach, "-", color="0.8", linewidth=2.2, label=r"$1 + a/(b-a)$ (Gu et al. 1984)"
    )
    for number, case in enumerate(dataset["case"].values):
        row = dataset.sel(case=case)
        style = look(number)
        text = pretty(case)
        if "zeta" in row:
            text += rf": $\zeta$ = {slope_with_error(row, 'zeta')}"
            axes.plot(reach, 1.0 + float(row["zeta"]) * reach, **style, linewidth=0.9)
        axes.errorbar(
            x,
            row["critical_velocity_ratio"],
            yerr=row["critical_velocity_ratio_error"],
            fmt=marker(number),
            color=style["color"],
            label=text,
        )
    axes.axvspan(0.25, 1.0, color="0.94", zorder=0)
    axes.text(0.27, 0.97, "fitted", transform=axes.get_xaxis_transform(), va="top", color="0.45")
    axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
    axes.set_ylabel(f"Critical load point velocity, {quantity('critical_velocity_ratio').symbol}")
    law = str(dataset["law"].item()).capitalize()
    axes.set_title(f"{law} law, {stiffness(float(dataset['stiffness_ratio']))}")
    axes.set_xlim(0.0, reach[1])
    axes.set_ylim(1.0, 1.0 + reach[1])
    legend(axes, 1)
    return axes
