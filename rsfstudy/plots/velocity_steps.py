"""Velocity steps: records of friction on machines of several stiffnesses, and what is read off them
over what is true.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import log_scale, same_height
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import number as written
from rsfstudy.plots._text import stiffness
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Dimensions the figure has room for.
DIMENSIONS = ("law", "velocity_ratio", "stiffness_ratio")

#: Of a panel, in mm.
HEIGHT = 48.0

#: Load point displacement that is shown of the records, in D_c.
_SHOWN = 8.0
_MACHINES = 5
#: What is left of the evolution at 1/e, by what the load point moved and by what slipped.
_MOVED, _SLIPPED = "apparent_slip_distance", "corrected_slip_distance"
#: Of laws: lines, and how markers are filled.
_STYLES = (("-", "full"), ("--", "none"))


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Records of the first law."""
    return _records(dataset, axes, 0)


def draw_slowness(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Records of the last law."""
    return _records(dataset, axes, -1)


def _records(dataset: xr.Dataset, axes: Axes, law: int) -> Axes:
    """A step up and a step down, on some machines, from dark to light as they are stiffer."""
    rows = dataset.isel(law=law).sortby("velocity_ratio")
    steps = rows["velocity_ratio"].values
    middle = [s for s in (steps[steps < 1.0][-1:], steps[steps > 1.0][:1]) if len(s)]
    places = np.unique(np.linspace(0, rows.sizes["stiffness_ratio"] - 1, _MACHINES).astype(int))
    drawn = dataset.sel(velocity_ratio=np.ravel(middle)).isel(stiffness_ratio=places)
    same_height(axes, _change(drawn).where(drawn["load_point_displacement"] <= _SHOWN))
    for shade, place in zip(np.linspace(0.0, 0.85, len(places)), places, strict=True):
        for step, (style, _fill) in zip(middle, _STYLES, strict=False):
            row = rows.sel(velocity_ratio=step[0]).isel(stiffness_ratio=place)
            label = stiffness(float(row["stiffness_ratio"])) if style == "-" else None
            colour = colormaps["viridis"](shade)
            axes.plot(
                row["load_point_displacement"], _change(row), style, color=colour, label=label
            )
    axes.set_xlim(-0.3, _SHOWN)
    axes.set_xlabel(quantity("load_point_displacement", stated_by(dataset)).axis_label)
    axes.set_ylabel(r"Change of friction, $\Delta\mu/a$")
    ratios = ", ".join(
        f"{s[0]:g} ({word})" for s, word in zip(middle, ("solid", "dashed"), strict=False)
    )
    axes.set_title(f"{rows['law'].item()} law, $r$ = {ratios}".capitalize())
    legend(axes, 3)
    return axes


def _change(row: xr.Dataset) -> xr.DataArray:
    return (row["friction_coefficient"] - row["friction_before"]) / row["a"]


def _rows(dataset: xr.Dataset) -> Iterator[tuple[xr.Dataset, str, dict[str, Any]]]:
    """Each law and step, what it is called, and its line: colours and markers tell steps, and lines
    and how markers are filled laws.
    """
    for law, (line, fill) in zip(dataset["law"].values, _STYLES, strict=False):
        for number, ratio in enumerate(dataset["velocity_ratio"].values):
            style = {"color": look(number)["color"], "marker": marker(number)}
            row = dataset.sel(law=law, velocity_ratio=ratio)
            text = f"{law} law, $r$ = {written(ratio)}"
            yield row, text, style | {"linestyle": line, "fillstyle": fill, "linewidth": 0.9}


def _read(
    name: str, title: str, label: str, true: tuple[str, ...] = (), beside: str | None = None
) -> Panel:
    """What draws a number as read off over the product of some of the scene's own, against
    stiffness; as high as another needs it, too.
    """

    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        axes.axhline(1.0, color="0.6", linewidth=0.8, zorder=0)
        for row, text, style in _rows(dataset):
            over = math.prod(float(row[factor]) for factor in true)
            axes.plot(row["stiffness_ratio"], row[name] / over, label=text, **style)
        if beside is not None:
            same_height(axes, dataset[name], dataset[beside])
        log_scale(axes, "x")
        axes.set_xlabel(f"Stiffness, {quantity('stiffness_ratio').symbol}")
        axes.set_ylabel(label)
        axes.set_title(title)
        legend(axes)
        return axes

    return panel


PANELS = (
    draw,
    draw_slowness,
    _read("apparent_a", "Direct effect as read off", "$a_{read}/a$", ("a",)),
    _read("apparent_b", "Evolution as read off", "$b_{read}/b$", ("a", "b_over_a")),
    _read(_MOVED, "Slip distance, by the load point", "$D_{read}/D_c$", beside=_SLIPPED),
    _read(_SLIPPED, "Slip distance, by slip", "$D_{read}/D_c$", beside=_MOVED),
    _read("a_minus_b_over_true", "Rate dependence as read off", "$(a-b)_{read}/(a-b)$"),
)
