"""Critical stiffness of a dilatant fault against drainage, between its undrained and drained
limits.
"""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._axes import log_scale, place
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("dilatancy", "drainage")

#: Of the panel, in mm.
HEIGHT = 70.0


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve a dilatancy; markers are thresholds found from growth of the assembled equations,
    every fourth; short lines at the left the limit of no drainage, across that of fast drainage.
    """
    rate = dataset["drainage"]
    weakening = float(dataset["a"]) * (float(dataset["b_over_a"]) - 1.0)
    axes.axhline(weakening, color="0.75", linewidth=2.2, label="drained, $b-a$")
    for number, dilatancy in enumerate(dataset["dilatancy"].values):
        row = dataset.sel(dilatancy=dilatancy)
        axes.plot(rate, row["critical_stiffness"], **look(number), label=place(row, "dilatancy"))
    for number, dilatancy in enumerate(dataset["dilatancy"].values):
        row, colour = dataset.sel(dilatancy=dilatancy), look(number)["color"]
        axes.plot(
            rate[::4],
            row["critical_stiffness_from_growth"][::4],
            marker(number),
            color=colour,
            markersize=3,
            label="from growth" if number == 0 else None,
        )
        undrained = weakening - float(dataset["mu_star"]) * dilatancy
        if undrained > 0.0:
            text = r"undrained, $b-a-\mu_*\epsilon/(\beta\sigma_*)$" if number == 0 else None
            axes.axhline(undrained, xmax=0.16, color=colour, linewidth=2.2, alpha=0.45, label=text)
    axes.set_xlim(float(rate.min()) / 1.5, float(rate.max()) * 1.5)
    log_scale(axes, "x")
    axes.set_ylim(-0.03 * weakening, 1.12 * weakening)
    axes.set_xlabel(f"Drainage, {quantity('drainage').symbol}")
    axes.set_ylabel(f"Critical stiffness, {quantity('critical_stiffness').symbol}")
    axes.set_title("Stable above, unstable below")
    legend(axes)
    return axes
