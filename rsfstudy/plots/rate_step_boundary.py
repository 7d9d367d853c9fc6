"""Critical load point velocity against a/(b-a), as in Fig. 5 of the paper."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._text import with_error
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("case", "b_over_a")

_MARKERS = "os^Dv<>"


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Points with their error bars, the fitted lines, and the closed form for constant normal
    stress.
    """
    x = dataset["a_over_b_minus_a"]
    reach = np.array([0.0, float(x.max()) * 1.03])
    axes.plot(reach, 1.0 + reach, "--", color="0.5", label=r"$1 + a/(b-a)$ (Gu et al. 1984)")
    for number, case in enumerate(dataset["case"].values):
        row = dataset.sel(case=case)
        text = str(case).replace("alpha", r"$\alpha$")
        if "zeta" in row:
            text += rf": $\zeta$ = {with_error(float(row['zeta']), float(row['zeta_stderr']))}"
        points = axes.errorbar(
            x,
            row["critical_velocity_ratio"],
            yerr=row["critical_velocity_ratio_error"],
            fmt=_MARKERS[number % len(_MARKERS)],
            markersize=4.5,
            label=text,
        )
        if "zeta" in row:
            fitted = 1.0 + float(row["zeta"]) * reach
            axes.plot(reach, fitted, color=points[0].get_color(), linewidth=0.9)
    axes.axvspan(0.25, 1.0, color="0.94", zorder=0)
    axes.text(0.27, 0.97, "fitted", transform=axes.get_xaxis_transform(), va="top", color="0.45")
    axes.set_xlabel(quantity("a_over_b_minus_a").symbol)
    axes.set_ylabel(f"Critical {quantity('critical_velocity_ratio').symbol}")
    axes.set_title(r"Rate-step boundary, slip law, $k = k_{cr}(V_*)$", fontsize="medium")
    axes.set_xlim(0.0, reach[1])
    axes.set_ylim(1.0, 1.0 + reach[1])
    axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(0.0, 0.93))
    return axes
