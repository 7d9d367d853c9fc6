"""Critical load point velocity against stiffness, as in Fig. 6 of the paper, and with the slowness
law beside it.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "case", "stiffness_ratio")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """One curve a case for the first law, with the published approximation for the slip law (eq.
    11).
    """
    law = str(dataset["law"].values[0])
    if law == "slip":
        x = dataset["stiffness_ratio"]
        closed = np.exp(x) / (float(dataset["b_over_a"]) - 1.0)
        axes.plot(
            x, closed, "-", color="0.8", linewidth=2.2, label=r"$\exp(k/k_{cr})/\lambda$ (eq. 11)"
        )
    _curves(dataset, axes, law)
    axes.set_title(_title(f"{law.capitalize()} law", dataset))
    legend(axes)
    return axes


def draw_laws(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Every law, on a log axis."""
    for law, fill in zip(dataset["law"].values, ("full", "none"), strict=False):
        _curves(dataset, axes, str(law), fill, f"{law}, ")
    axes.set_yscale("log")
    axes.set_title(_title("Both laws", dataset))
    legend(axes)
    return axes


PANELS = (draw, draw_laws)


def _curves(dataset: xr.Dataset, axes: Axes, law: str, fill: str = "full", of: str = "") -> None:
    for number, case in enumerate(dataset["case"].values):
        row = dataset["critical_velocity_ratio"].sel(law=law, case=case)
        axes.plot(
            row["stiffness_ratio"],
            row,
            **look(number),
            marker=marker(number),
            fillstyle=fill,
            label=of + pretty(case),
        )
    axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    axes.set_ylabel(f"Critical load point velocity, {quantity('critical_velocity_ratio').symbol}")


def _title(what: str, dataset: xr.Dataset) -> str:
    return rf"{what}, $b/a = {float(dataset['b_over_a']):.4g}$"
