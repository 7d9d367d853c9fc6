"""Static stress drop (filled) and dynamic stress drop (open) against ln V_0, with the fitted
lines.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import pretty, slope_with_error, stiffness
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "case", "stiffness_ratio", "load_velocity_ratio")

_DROPS = {"static": "full", "dynamic": "none"}
#: Where a line misses by more than this part of what it spans, no line fits.
_CURVED = 0.05


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first law, on its stiffest spring."""
    return _drops(dataset, axes, 0)


def _drops(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    x = dataset["log_load_velocity_ratio"]
    stiffest = float(dataset["stiffness_ratio"].max())
    for number, case in enumerate(dataset["case"].values):
        row = dataset.isel(law=law).sel(case=case, stiffness_ratio=stiffest)
        for drop, fill in _DROPS.items():
            values, colour = row[f"{drop}_stress_drop"], look(number)["color"]
            slope, text = _slope(row, drop)
            if np.isfinite(slope):
                centre = float(x.where(values.notnull()).mean())
                line = (float(values.mean()) + slope * (x - centre)).where(values.notnull())
                axes.plot(x, line, "-" if drop == "static" else "--", color=colour, linewidth=0.8)
            axes.plot(
                x,
                values,
                marker(number),
                color=colour,
                fillstyle=fill,
                markersize=4.5,
                label=f"{pretty(case)}, {drop}{text}",
            )
    axes.set_xlabel(f"Load point velocity, {quantity('log_load_velocity_ratio').symbol}")
    axes.set_ylabel(r"Stress drop, $\Delta\tau/\sigma_*$")
    name = str(dataset["law"].values[law]).capitalize()
    axes.set_title(f"{name} law, {stiffness(stiffest)}; slopes")
    axes.set_ylim(bottom=0.0)
    legend(axes, 1)
    return axes


def _slope(row: xr.Dataset, drop: str) -> tuple[float, str]:
    """The slope of a drop, if a line fits it, and what to say of it."""
    name = f"{drop}_slope"
    if name not in row or not np.isfinite(row[name]):
        return np.nan, ""
    if not bool(_is_straight(row, drop)):
        return np.nan, ": no line fits"
    return float(row[name]), f": {slope_with_error(row, name)}"


def _is_straight(dataset: xr.Dataset, drop: str) -> xr.DataArray:
    """Whether a line in ln V_0 fits a stress drop."""
    values = dataset[f"{drop}_stress_drop"]
    span = values.max("load_velocity_ratio") - values.min("load_velocity_ratio")
    return dataset[f"{drop}_slope_misfit"] <= _CURVED * span


def draw_slowness(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The last law."""
    return _drops(dataset, axes, -1)


def draw_scaled(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Slopes of the static drop over (a-b) sigma_*, against stiffness: f(k), where a line fits."""
    if "static_slope_scaled" in dataset:
        slopes = dataset["static_slope_scaled"].where(_is_straight(dataset, "static"))
        for row, style in _curves(slopes):
            axes.plot(row["stiffness_ratio"], row, **style)
    axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
    axes.set_ylabel(r"Slope of static drop over $(a-b)\,\sigma_*$")
    axes.set_title("Slopes of lines that fit, $f(k)$")
    legend(axes)
    return axes


def draw_drift(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Local slopes between neighbouring points: where a law in ln V_0 holds, they are level."""
    x = dataset["log_load_velocity_ratio"].values
    middle = 0.5 * (x[1:] + x[:-1])
    for row, style in _curves(dataset["static_stress_drop"].isel(stiffness_ratio=-1)):
        axes.plot(middle, np.diff(row.values) / np.diff(x), **style)
    axes.set_xlabel(f"Load point velocity, {quantity('log_load_velocity_ratio').symbol}")
    axes.set_ylabel(r"Local slope of static drop, $\sigma_*$")
    axes.set_title("Local slopes: level where the law holds")
    legend(axes)
    return axes


def _curves(values: xr.DataArray) -> Iterator[tuple[xr.DataArray, dict[str, Any]]]:
    """What there is of each law and case, and how it is drawn."""
    for law, line, fill in zip(values["law"].values, ("-", "--"), ("full", "none"), strict=False):
        for number, case in enumerate(values["case"].values):
            style = {
                "color": look(number)["color"],
                "linestyle": line,
                "marker": marker(number),
                "fillstyle": fill,
                "label": f"{law} law, {pretty(case)}",
            }
            yield values.sel(law=law, case=case), style


PANELS = (draw, draw_slowness, draw_scaled, draw_drift)
