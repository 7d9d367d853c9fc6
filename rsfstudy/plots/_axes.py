"""Axes of a lattice as axes of a figure: which are numbers, which of those want a log scale, and
what their points are called.
"""

from __future__ import annotations

from typing import cast

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from rsfstudy.formatting import read_flag_meanings
from rsfstudy.plots._text import (
    axis_label,
    format_number,
    format_stiffness_ratio,
    format_units,
    quantity_symbol,
    to_mathtext,
    visible_length,
    wrap_text,
)
from rsfstudy.study import read_quantities
from rsfstudy.vocabulary import coverage_content_type, find_quantity

#: Values that span more than this are drawn on a log axis.
_LOG_SCALE_RATIO = 100.0
#: Log axes that span less than this have numbers between decades too.
_MAX_RATIO_FOR_MINOR_LABELS = 50.0
#: Most names along y, and along x.
_MAX_NAMES_ALONG_Y, _MAX_NAMES_ALONG_X = 45, 30
#: Most names along x that lie side by side; more stand upright.
_MAX_HORIZONTAL_NAMES = 12
#: What the points of some axes are said to be.
_POINT_PHRASES = {"law": "{} law", "normal_stress": "{} normal stress", "load": "load point {}"}


def has_numeric_points(dataset: xr.Dataset, dimension: str) -> bool:
    """True if the points of a dimension are numbers, not names or flags."""
    return is_numeric_variable(dataset[dimension]) and dataset[dimension].dtype.kind != "b"


def is_numeric_variable(values: xr.DataArray) -> bool:
    """True if a variable holds numbers to be drawn."""
    return values.dtype.kind in "fiub" and "flag_values" not in values.attrs


def flag_meanings(values: xr.DataArray) -> dict[float, str]:
    """What the flags mean that a variable holds, in words; empty for one of numbers."""
    return {
        value: word.replace("_", " ") for value, word in read_flag_meanings(values.attrs).items()
    }


def measured_variables(dataset: xr.Dataset) -> list[str]:
    """Variables measured in each cell: no error estimates nor costs, the headline first."""
    cells = set(dataset["status"].dims)
    values = {str(name): dataset[name] for name in dataset.data_vars}
    beside = tuple(f"{name}_{end}" for name in values for end in ("stable", "unstable"))
    return [
        name
        for name, found in values.items()
        if set(found.dims) == cells
        and is_numeric_variable(found)
        and coverage_content_type(name) == "modelResult"
        and name not in beside
        and bool(np.isfinite(found).any())
    ]


def varying_variables(dataset: xr.Dataset) -> list[str]:
    """Of what was measured, the headline and all that is not the same everywhere."""
    names = measured_variables(dataset)
    return names[:1] + [n for n in names[1:] if float(dataset[n].max()) > float(dataset[n].min())]


def is_log_spaced(points: np.ndarray) -> bool:
    """True if points are spaced by factors rather than by differences."""
    at = np.sort(points.astype(float))
    if at.size < 3 or at[0] <= 0.0 or at[-1] < 10.0 * at[0]:
        return False
    factors, differences = np.diff(np.log(at)), np.diff(at)
    return bool(factors.max() / factors.min() < differences.max() / differences.min())


def spans_decades(values: np.ndarray) -> bool:
    """True if values are positive and span decades."""
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > _LOG_SCALE_RATIO * known.min())


def describe_point(cell: xr.Dataset | xr.DataArray, dimension: str) -> str:
    """Place of a cell on one dimension, in a few words."""
    value = cell[dimension].item()
    about = find_quantity(dimension, read_quantities(cell.coords.to_dataset()))
    if isinstance(value, str):
        return _POINT_PHRASES.get(dimension, "{}").format(to_mathtext(value))
    if dimension == "stiffness_ratio":
        return format_stiffness_ratio(value)
    if dimension == "inertia":
        return "with mass" if value else "without mass"
    units = {"": "", "1": "", "degree": "°"}.get(about.units, f" {format_units(about.units)}")
    return f"{quantity_symbol(about)} = {format_number(value, 4)}{units}"


def set_up_x_axis(axes: Axes, dataset: xr.Dataset, dimension: str) -> np.ndarray:
    """Places of the points of a dimension along x; those that are no numbers are named there."""
    points = dataset[dimension].values
    if has_numeric_points(dataset, dimension):
        return np.asarray(points, dtype=float)
    names, width = [str(point) for point in points], max(8, 48 // points.size)
    longest = max(
        visible_length(part)
        for name in names
        for part in wrap_text(to_mathtext(name), width).split("\n")
    )
    upright = points.size > _MAX_HORIZONTAL_NAMES or longest > 1.4 * width
    label_points(axes.xaxis, names, 40 if upright else width, _MAX_NAMES_ALONG_X)
    if upright:
        axes.tick_params(axis="x", labelrotation=90.0, labelsize=5.0)
    axes.set_xlim(-0.5, points.size - 0.5)
    return np.arange(points.size, dtype=float)


def set_log_scale(axes: Axes, which: str) -> None:
    """Have a log axis, with numbers that do not touch each other; call it where limits are known.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    which : {"x", "y"}
    """
    axes.set(**{f"{which}scale": "log"})
    axis: Axis = getattr(axes, f"{which}axis")
    low, high = sorted(axis.get_view_interval())
    if high < 3.0 * low:
        axis.set_major_locator(MaxNLocator(3))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: format_number(value)))
    elif high < _MAX_RATIO_FOR_MINOR_LABELS * low:
        between: tuple[float, ...] = (3.0,)
        if high < 10.0 * low:
            between = (2.0, 5.0) if which == "x" else (2.0, 3.0, 4.0, 6.0, 8.0)
        axis.set_major_locator(LogLocator(subs=(1.0, *between)))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: format_number(value)))
    axis.set_minor_formatter(NullFormatter())


def label_points(axis: Axis, names: list[str], width: int, most: int = _MAX_NAMES_ALONG_Y) -> None:
    """Ticks at 0, 1, ... with names: of all points, or of some where there are many."""
    some = slice(None, None, -(-len(names) // most))
    texts = [wrap_text(to_mathtext(name), width) for name in names[some]]
    axis.set_ticks(range(len(names))[some], texts)


def label_rows(axes: Axes, names: list[str], width: int = 60) -> None:
    """Rows with names, from the top down, and half a row beyond either end."""
    label_points(axes.yaxis, names, width)
    axes.set_ylim(len(names) - 0.5, -0.5)


# ---- scales of colours --------------------------------------------------------------------------


def point_colours(dataset: xr.Dataset, dimension: str) -> np.ndarray:
    """Colours for the points of an axis of numbers."""
    points = dataset[dimension].values.astype(float)
    return np.asarray(_colour_scale(dataset, dimension).to_rgba(points))


def add_colour_bar(dataset: xr.Dataset, axes: Axes, dimension: str) -> None:
    """Say beside a panel what `point_colours` stand for."""
    scale = _colour_scale(dataset, dimension)
    bar = cast(Figure, axes.figure).colorbar(scale, ax=axes, pad=0.02)
    bar.set_label(axis_label(find_quantity(dimension, read_quantities(dataset)), 34))


def _colour_scale(dataset: xr.Dataset, dimension: str) -> ScalarMappable:
    points = dataset[dimension].values.astype(float)
    kind = LogNorm if is_log_spaced(points) else Normalize
    return ScalarMappable(kind(points.min(), points.max()), colormaps["viridis"])
