"""Functions that choose the scales, ticks and colours for the axes of a lattice.

A lattice is the grid of all parameter combinations of a study, and the points of an axis are its
parameter values. The functions in this module determine whether the points are numbers, whether the
axis needs a log scale, and how to label the points.
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
from rsfstudy.plots._style import estimate_text_capacity_in_characters
from rsfstudy.plots._text_formatting import (
    convert_symbols_to_mathtext,
    estimate_visible_character_count,
    find_quantity_symbol_or_name,
    format_number,
    format_quantity_axis_label,
    format_stiffness_ratio,
    format_units,
    wrap_text,
)
from rsfstudy.storage import StoredDataset
from rsfstudy.study import read_quantities_not_in_vocabulary
from rsfstudy.vocabulary import find_coverage_content_type, find_quantity

#: If the ratio of the largest to the smallest value along an axis exceeds this limit, the axis has
#: a log scale.
_MIN_RATIO_FOR_LOG_SCALE = 100.0
#: If the ratio of the upper to the lower limit of a log axis is less than this value, the axis has
#: additional tick labels between powers of ten.
_MAX_AXIS_LIMIT_RATIO_FOR_MINOR_LABELS = 50.0
#: Maximum number of tick labels along the y axis and along the x axis, if the tick labels are
#: names.
_MAX_POINT_NAMES_ALONG_Y, _MAX_POINT_NAMES_ALONG_X = 45, 30
#: Maximum number of horizontal tick labels with names along x. If there are more names, the tick
#: labels are vertical.
_MAX_UNROTATED_X_TICK_LABELS = 12
#: Height of the title and the labels below a panel, in characters.
_TITLE_AND_LABEL_HEIGHT_IN_CHARACTERS = 6
#: Smallest font size of figures in points.
MIN_FONT_SIZE = 6.0
#: Templates of phrases that describe the points of some axes, for example in titles.
_POINT_DESCRIPTION_TEMPLATE_BY_AXIS = {
    "law": "{} law",
    "normal_stress": "{} normal stress",
    "load": "load point {}",
}
#: Phrases that describe state evolution laws, if the name of the law is not part of the phrase.
_DESCRIPTION_BY_LAW_NAME = {
    "cut_off": "slowness law with cut-off",
    "flash_heating": "slip law with flash heating",
    "perrin_rice_zheng": "Perrin-Rice-Zheng law",
    "two_slip_states": "slip law with two states",
    "two_slowness_states": "slowness law with two states",
}


def has_numeric_points(dataset: xr.Dataset, dimension: str) -> bool:
    """Return True if the points of a dimension are numbers.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the dimension.
    dimension : str
        Name of the dimension.

    Returns
    -------
    bool
        True if the coordinate of the dimension is numeric. Names, flags and Boolean values are not
        numbers.
    """
    return is_numeric_variable(dataset[dimension]) and dataset[dimension].dtype.kind != "b"


def is_numeric_variable(variable: xr.DataArray) -> bool:
    """Return True if a variable contains numbers that can be plotted.

    Parameters
    ----------
    variable : xarray.DataArray
        Variable of a dataset.

    Returns
    -------
    bool
        True for numbers and Boolean values. The result is False for variables with flags, which
        represent categories.
    """
    return variable.dtype.kind in "fiub" and "flag_values" not in variable.attrs


def read_flag_meanings_of_variable(variable: xr.DataArray) -> dict[float, str]:
    """Return the meanings of the flags of a variable.

    Parameters
    ----------
    variable : xarray.DataArray
        Variable of a dataset. The flags are described by the CF attributes ``flag_values`` and
        ``flag_meanings``.

    Returns
    -------
    dict of float to str
        Meaning of each flag. The dictionary is empty if the variable has no flags.
    """
    return {
        value: word.replace("_", " ") for value, word in read_flag_meanings(variable.attrs).items()
    }


def list_numeric_result_variables(dataset: xr.Dataset) -> list[str]:
    """Return the names of the measured variables of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study. The dimensions of the variable ``status`` are the dimensions of the
        lattice.

    Returns
    -------
    list of str
        Names of the numeric variables that have the dimensions of the lattice and at least one
        finite value. The primary output is the first variable, and the other variables are in
        the order of the dataset. Error estimates, computational costs, and variables with the
        suffix ``_stable`` or ``_unstable`` are excluded.
    """
    cells = set(dataset["status"].dims)
    values = {str(name): dataset[name] for name in dataset.data_vars}
    beside = tuple(f"{name}_{end}" for name in values for end in ("stable", "unstable"))
    measured = [
        name
        for name, found in values.items()
        if set(found.dims) == cells
        and is_numeric_variable(found)
        and find_coverage_content_type(name) == "modelResult"
        and name not in beside
        and bool(np.isfinite(found).any())
    ]
    declared = "declaration" in dataset.attrs
    primary = StoredDataset(dataset).primary_output_name if declared else None
    return sorted(measured, key=lambda name: name != primary)


def list_primary_and_varying_variables(dataset: xr.Dataset) -> list[str]:
    """Return the names of the primary output and of the other variables that vary.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, with the variable ``status``.

    Returns
    -------
    list of str
        Name of the primary output, followed by the names of all other measured variables that have
        at least two different values.
    """
    names = list_numeric_result_variables(dataset)
    return names[:1] + [n for n in names[1:] if float(dataset[n].max()) > float(dataset[n].min())]


def are_log_spaced(points: np.ndarray) -> bool:
    """Return True if points are spaced logarithmically.

    Parameters
    ----------
    points : ndarray, shape (n,)
        Points of an axis in any order.

    Returns
    -------
    bool
        True if there are at least three points, if all points are positive and span at least a
        factor of ten, and if the ratios of neighbouring points vary less than the differences of
        neighbouring points.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.plots import are_log_spaced
    >>> are_log_spaced(np.array([1.0, 10.0, 100.0])), are_log_spaced(np.array([1.0, 2.0, 3.0]))
    (True, False)
    """
    at = np.sort(points.astype(float))
    if at.size < 3 or at[0] <= 0.0 or at[-1] < 10.0 * at[0]:
        return False
    factors, differences = np.diff(np.log(at)), np.diff(at)
    return bool(factors.max() / factors.min() < differences.max() / differences.min())


def are_positive_and_span_decades(values: np.ndarray) -> bool:
    """Return True if all values are positive and span more than two orders of magnitude.

    Parameters
    ----------
    values : ndarray
        Values of any shape. NaN and infinite values are ignored.

    Returns
    -------
    bool
        True if the smallest value is positive and the largest value is more than 100 times the
        smallest value.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.plots import are_positive_and_span_decades
    >>> are_positive_and_span_decades(np.array([0.1, 20.0]))
    True
    """
    known = values[np.isfinite(values)]
    return bool(
        known.size and known.min() > 0.0 and known.max() > _MIN_RATIO_FOR_LOG_SCALE * known.min()
    )


def compute_cell_edges(points: np.ndarray, is_log_scale: bool = False) -> np.ndarray:
    """Compute the edges of lattice cells from their centres.

    The edges are midpoints between neighbouring centres, on a linear or logarithmic scale.

    Parameters
    ----------
    points : ndarray, shape (n,)
        Centres of the cells along one axis, in increasing order.
    is_log_scale : bool, default: False
        If True, the midpoints are computed on a logarithmic scale.

    Returns
    -------
    ndarray, shape (n + 1,)
        Edges of the cells.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.plots import compute_cell_edges
    >>> compute_cell_edges(np.array([1.0, 2.0, 4.0]))
    array([0.5, 1.5, 3. , 5. ])
    """
    if points.size < 2:
        return np.asarray(
            [0.9 * points[0], 1.1 * points[0]]
            if is_log_scale
            else [points[0] - 0.5, points[0] + 0.5]
        )
    at = np.log(points) if is_log_scale else points.astype(float)
    halfway = 0.5 * (at[1:] + at[:-1])
    ends = np.concatenate([[2.0 * at[0] - halfway[0]], halfway, [2.0 * at[-1] - halfway[-1]]])
    return np.asarray(np.exp(ends) if is_log_scale else ends)


def format_axis_label(
    dataset: xr.Dataset, variable_name: str, max_line_characters: int = 45
) -> str:
    """Return an axis label with the name, symbol and units of a variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study. If the variable has the attributes ``long_name``, ``symbol`` and
        ``units``, these attributes override the vocabulary of rsfstudy.
    variable_name : str
        Name of the variable.
    max_line_characters : int, default: 45
        Maximum number of visible characters per line.

    Returns
    -------
    str
        Label with formulas in mathtext.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.plots import format_axis_label
    >>> format_axis_label(xr.Dataset(), "b_over_a", 80)
    'Ratio of evolution effect to direct effect, $b/a$'
    """
    quantity = find_quantity(variable_name, read_quantities_not_in_vocabulary(dataset))
    return format_quantity_axis_label(quantity, max_line_characters)


def describe_point(cell: xr.Dataset | xr.DataArray, dimension: str) -> str:
    """Describe the coordinate value of a lattice cell along a dimension.

    Parameters
    ----------
    cell : xarray.Dataset or xarray.DataArray
        Results of one lattice cell, with a scalar coordinate for the dimension. If the coordinate
        has the attributes ``long_name``, ``symbol`` and ``units``, these attributes override the
        vocabulary of rsfstudy.
    dimension : str
        Name of the dimension.

    Returns
    -------
    str
        Description for a legend or a title, with formulas in mathtext.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.plots import describe_point
    >>> cell = xr.Dataset(coords={"law": "slip", "b_over_a": 2.0})
    >>> describe_point(cell, "law")
    'slip law'
    >>> describe_point(cell, "b_over_a")
    '$b/a$ = 2'
    """
    value = cell[dimension].item()
    about = find_quantity(dimension, read_quantities_not_in_vocabulary(cell.coords.to_dataset()))
    if isinstance(value, str):
        if dimension == "law" and value in _DESCRIPTION_BY_LAW_NAME:
            return _DESCRIPTION_BY_LAW_NAME[value]
        return _POINT_DESCRIPTION_TEMPLATE_BY_AXIS.get(dimension, "{}").format(
            convert_symbols_to_mathtext(value)
        )
    if dimension == "stiffness_ratio":
        return format_stiffness_ratio(value)
    if dimension == "inertia":
        return "with inertia" if value else "without inertia"
    units = {"": "", "1": "", "degree": "°"}.get(about.units, f" {format_units(about.units)}")
    return f"{find_quantity_symbol_or_name(about)} = {format_number(value, 4)}{units}"


def set_up_x_axis_for_dimension(axes: Axes, dataset: xr.Dataset, dimension: str) -> np.ndarray:
    """Set up the x axis for the points of a dimension.

    If the coordinate contains names instead of numbers, the names become tick labels.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to set up.
    dataset : xarray.Dataset
        Dataset with a coordinate for the dimension.
    dimension : str
        Name of the dimension along x.

    Returns
    -------
    ndarray, shape (n,)
        Position of each point along x. Numbers are drawn at their values, and names are drawn at 0,
        1, and so on.
    """
    points = dataset[dimension].values
    if has_numeric_points(dataset, dimension):
        return np.asarray(points, dtype=float)
    names, width = [str(point) for point in points], max(8, 48 // points.size)
    longest = max(
        estimate_visible_character_count(part)
        for name in names
        for part in wrap_text(convert_symbols_to_mathtext(name), width).split("\n")
    )
    upright = points.size > _MAX_UNROTATED_X_TICK_LABELS or longest > 1.4 * width
    set_tick_labels_to_point_names(
        axes.xaxis, names, 40 if upright else width, _MAX_POINT_NAMES_ALONG_X
    )
    if upright:
        axes.tick_params(axis="x", labelrotation=90.0, labelsize=MIN_FONT_SIZE)
    axes.set_xlim(-0.5, points.size - 0.5)
    return np.arange(points.size, dtype=float)


def set_log_scale(axes: Axes, axis_name: str) -> None:
    """Set a log scale with tick labels that do not overlap.

    Call this function after the limits of the axis are set, because the ticks depend on the limits.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to change.
    axis_name : {"x", "y"}
        Axis that is changed to a log scale.
    """
    axes.set(**{f"{axis_name}scale": "log"})
    axis: Axis = getattr(axes, f"{axis_name}axis")
    low, high = sorted(axis.get_view_interval())
    if high < 3.0 * low:
        axis.set_major_locator(MaxNLocator(3))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: format_number(value)))
    elif high < _MAX_AXIS_LIMIT_RATIO_FOR_MINOR_LABELS * low:
        between: tuple[float, ...] = (3.0,)
        if high < 10.0 * low:
            between = (2.0, 5.0) if axis_name == "x" else (2.0, 3.0, 4.0, 6.0, 8.0)
        axis.set_major_locator(LogLocator(subs=(1.0, *between)))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: format_number(value)))
    axis.set_minor_formatter(NullFormatter())


def set_tick_labels_to_point_names(
    axis: Axis,
    point_names: list[str],
    max_line_characters: int,
    max_ticks: int = _MAX_POINT_NAMES_ALONG_Y,
) -> None:
    """Use names as tick labels at the positions 0, 1, 2, ... of an axis.

    Parameters
    ----------
    axis : matplotlib.axis.Axis
        Axis to label.
    point_names : list of str
        Names of the points.
    max_line_characters : int
        Maximum number of characters per line of a label.
    max_ticks : int, default: 45
        Maximum number of labels. If there are more names, some names are omitted at regular
        intervals.
    """
    some = slice(None, None, -(-len(point_names) // max_ticks))
    texts = [
        wrap_text(convert_symbols_to_mathtext(name), max_line_characters)
        for name in point_names[some]
    ]
    axis.set_ticks(range(len(point_names))[some], texts)


def label_rows(axes: Axes, names: list[str], width: int = 60) -> None:
    """Use names as y tick labels, from top to bottom.

    The y axis is inverted, and its limits include a margin of half a row at both ends.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes with rows at y = 0, 1, 2, and so on.
    names : list of str
        Names of the rows.
    width : int, default: 60
        Maximum number of characters per line of a label.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from rsfstudy.plots import label_rows
    >>> axes = Figure().add_subplot()
    >>> label_rows(axes, ["slip law", "ageing law"])
    >>> [label.get_text() for label in axes.get_yticklabels()]
    ['slip law', 'ageing law']
    >>> [float(limit) for limit in axes.get_ylim()]
    [1.5, -0.5]
    """
    set_tick_labels_to_point_names(axes.yaxis, names, width)
    axes.set_ylim(len(names) - 0.5, -0.5)


# ---- colour scales ------------------------------------------------------------------------------


def compute_point_colours(dataset: xr.Dataset, dimension: str) -> np.ndarray:
    """Return one colour for each point of a numeric dimension.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with a numeric coordinate for the dimension.
    dimension : str
        Name of the dimension.

    Returns
    -------
    ndarray, shape (n, 4)
        RGBA colour of each point. If the points are spaced logarithmically, the colour scale is
        logarithmic.
    """
    points = dataset[dimension].values.astype(float)
    return np.asarray(_build_colour_scale(dataset, dimension).to_rgba(points))


def add_colour_bar_of_dimension(dataset: xr.Dataset, axes: Axes, dimension: str) -> None:
    """Add a colour bar for the points of a numeric dimension.

    The colour bar has the same colour scale as ``compute_point_colours``.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with a numeric coordinate for the dimension.
    axes : matplotlib.axes.Axes
        Axes of the panel. The colour bar is placed to the right of the axes.
    dimension : str
        Name of the dimension.
    """
    add_colour_bar_of_variable(_build_colour_scale(dataset, dimension), dataset, axes, dimension)


def add_colour_bar_of_variable(
    colour_scale: ScalarMappable, dataset: xr.Dataset, axes: Axes, variable_name: str
) -> None:
    """Add a colour bar with the label of a variable.

    Parameters
    ----------
    colour_scale : matplotlib.cm.ScalarMappable
        Colour scale.
    dataset : xarray.Dataset
        Dataset with the variable.
    axes : matplotlib.axes.Axes
        Axes of the panel. The colour bar is placed to the right of the axes.
    variable_name : str
        Name of the variable.
    """
    bar = cast(Figure, axes.figure).colorbar(colour_scale, ax=axes, pad=0.02)
    longest = estimate_text_capacity_in_characters(axes)[1] - _TITLE_AND_LABEL_HEIGHT_IN_CHARACTERS
    bar.set_label(format_axis_label(dataset, variable_name, min(34, longest)))


def _build_colour_scale(dataset: xr.Dataset, dimension: str) -> ScalarMappable:
    """Return the colour scale of a numeric dimension."""
    points = dataset[dimension].values.astype(float)
    kind = LogNorm if are_log_spaced(points) else Normalize
    return ScalarMappable(kind(points.min(), points.max()), colormaps["viridis"])
