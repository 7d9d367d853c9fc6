"""Boundaries against the instability norm, and the norm that published values imply."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import number as numbered
from rsfstudy.plots._text import pretty
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("boundary", "instability_norm")


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Critical velocities of the slowness law, with the norms their published values imply."""
    for number, row in enumerate(_rows(dataset, "slowness")):
        name, style = pretty(row["boundary"].item()), look(number)
        axes.plot(row["instability_norm"], row["critical_velocity_ratio"], **style, label=name)
        if "implied_norm" in row and np.isfinite(row["implied_norm"]):
            norm = float(row["implied_norm"])
            axes.errorbar(
                norm,
                float(row["critical_velocity_ratio"].interp(instability_norm=norm)),
                xerr=float(row["implied_norm_error"]),
                fmt=marker(number),
                color=style["color"],
                label=f"published value: norm {numbered(norm, 4)}",
            )
    axes.set_yscale("log")
    symbol = quantity("critical_velocity_ratio").symbol
    return _finish(axes, "Slowness law", f"Critical load point velocity, {symbol}")


def draw_slip(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Critical velocities of the slip law, less 1, over a/(b-a): 1 for a norm without bound."""
    for number, row in enumerate(_rows(dataset, "slip")):
        scaled = (row["critical_velocity_ratio"] - 1.0) * (float(row["b_over_a"]) - 1.0)
        name = pretty(row["boundary"].item())
        axes.plot(row["instability_norm"], scaled, **look(number), label=name)
    axes.axhline(1.0, color="0.5", linestyle="-", linewidth=0.6)
    return _finish(axes, "Slip law, $k = k_{cr}$", r"$(V_0/V_* - 1)\,(b-a)/a$")


PANELS = (draw, draw_slip)


def _rows(dataset: xr.Dataset, law: str) -> list[xr.Dataset]:
    laws = dataset["law"].broadcast_like(dataset["boundary"]).values
    return [dataset.isel(boundary=i) for i in np.flatnonzero(laws == law)]


def _finish(axes: Axes, title: str, label: str) -> Axes:
    axes.set_xscale("log")
    axes.set_xlabel(f"Instability norm, {quantity('instability_norm').symbol}")
    axes.set_ylabel(label)
    axes.set_title(title)
    axes.axvline(5e-4, color="0.7", linewidth=0.8, linestyle=":", label="norm of our studies")
    legend(axes)
    return axes
