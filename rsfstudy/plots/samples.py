"""Samples or cases: histograms and a scatter matrix of what was measured and of the fields that
vary, a colour for each point of the other axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from rsfstudy.plots._axes import (
    describe_point,
    has_numeric_points,
    is_numeric_variable,
    varying_variables,
)
from rsfstudy.plots._style import cycle_style
from rsfstudy.plots._text import format_units, quantity_symbol, wrap_text
from rsfstudy.storage import build_axis, read_declaration
from rsfstudy.study import DrawFunction, Panel, read_quantities
from rsfstudy.vocabulary import find_quantity

#: Most quantities that are shown, the headline among them, and most ticks of each.
_MAX_QUANTITIES, _MAX_TICKS = 4, 3
#: Points of a scatter; in a file of lines they are one image, since there may be 10^5 of them.
_POINT_STYLE = {"marker": ".", "markersize": 2.0, "markeredgewidth": 0.0, "rasterized": True}
#: Bins of a histogram, at most, and characters of a line of a label.
_MAX_BINS, _LABEL_WIDTH = 30, 17


def panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """A square of panels; none where no axis is numbered, or what is named lies along another."""
    fields = _sampled_fields(dataset)
    along = next((d for d in fields if variable is None or d in dataset[variable].dims), None)
    if along is None or (variable is not None and not is_numeric_variable(dataset[variable])):
        return []
    names = [variable] if variable else varying_variables(dataset)[:1]
    names += [name for name in fields[along] if has_numeric_points(dataset, name)][
        : _MAX_QUANTITIES - len(names)
    ]
    return [_build_panel(dataset, along, x, y) for y in names for x in names]


def square_side(panels: Sequence[Panel]) -> int:
    """Panels beside each other."""
    return math.isqrt(len(panels))


def _sampled_fields(dataset: xr.Dataset) -> dict[str, list[str]]:
    """Fields along each axis whose points are numbered, by its dimension."""
    found: dict[str, list[str]] = {}
    for axis in map(build_axis, read_declaration(dataset).axes):
        if axis.has_numbered_points and dataset.sizes.get(axis.dimension, 1) > 1:
            found[axis.dimension] = [name for name in axis.fields if name in dataset.coords]
    return found


def _build_panel(dataset: xr.Dataset, along: str, x: str, y: str) -> Panel:
    by = dict.fromkeys(str(d) for name in (x, y) for d in dataset[name].dims if d != along)
    few_ticks = partial(_limit_ticks, _MAX_TICKS - x.endswith("_error"))
    if x == y:
        marks: list[DrawFunction] = [partial(draw_histogram, x, list(by)), few_ticks]
        return Panel(overlays=marks, x_label=_short_label(dataset, x), y_label="Number", title="")
    return Panel(
        x=x,
        y=y,
        hue=list(by),
        markers_only=True,
        style=_POINT_STYLE,
        overlays=[few_ticks],
        title="",
        x_label=_short_label(dataset, x),
        y_label=_short_label(dataset, y),
    )


def _short_label(dataset: xr.Dataset, name: str) -> str:
    """Symbol and units, in short lines: panels are small, and the power of ten of the numbers along
    an axis stands beside the first line.
    """
    about = find_quantity(name.removesuffix("_error"), read_quantities(dataset))
    units = "" if about.units in ("", "1") or about.scale else f" ({format_units(about.units)})"
    text = wrap_text(f"{quantity_symbol(about)}{units}", _LABEL_WIDTH)
    return f"error of\n{text}" if name.endswith("_error") else text


def _limit_ticks(along_x: int, _dataset: xr.Dataset, axes: Axes) -> None:
    """A mark: ticks that do not touch each other; errors have long numbers."""
    axes.xaxis.set_major_locator(MaxNLocator(along_x))
    axes.yaxis.set_major_locator(MaxNLocator(_MAX_TICKS))


def draw_histogram(name: str, by: Sequence[str], dataset: xr.Dataset, axes: Axes) -> None:
    """A mark: how often a value is met, at each point of other axes."""
    values = dataset[name]
    known = values.values[np.isfinite(values.values)]
    edges = np.histogram_bin_edges(known, min(_MAX_BINS, max(5, round(known.size**0.5))))
    for number, at in enumerate(np.ndindex(*(values.sizes[d] for d in by))):
        part = values.isel(dict(zip(by, at, strict=True)))
        text = ", ".join(describe_point(part, d) for d in by) or None
        style = {"color": cycle_style(number)["color"], "alpha": 0.5, "label": text}
        axes.hist(part.values[np.isfinite(part.values)], list(edges), **style)
