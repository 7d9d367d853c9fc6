"""Maps of a variable as a function of two numeric axes.

The function ``build_map_panels`` builds one map for each point of the other axes of the study. A
map shows the variable as colours with labelled contours. Lattice cells without a value are hatched
according to their status. The module ``_figure_choice`` chooses between maps, line plots and corner
plots.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm, CenteredNorm, LogNorm, Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator
from scipy.spatial import cKDTree

from rsfstudy.plots._axis_formatting import (
    MIN_FONT_SIZE,
    add_colour_bar_of_variable,
    are_log_spaced,
    are_positive_and_span_decades,
    compute_cell_edges,
    format_axis_label,
    has_numeric_points,
    is_numeric_variable,
    list_numeric_result_variables,
    read_flag_meanings_of_variable,
)
from rsfstudy.plots._style import estimate_text_capacity_in_characters
from rsfstudy.plots._text_formatting import convert_symbols_to_mathtext, format_number
from rsfstudy.status import Status
from rsfstudy.study import Panel

#: Minimum number of points of each axis of a map, and maximum number of maps.
_MIN_POINTS_PER_MAP_AXIS, _MAX_MAPS = 3, 12
#: Hatch patterns of cells without a value, in the order of the status codes.
_HATCH_PATTERNS_OF_STATUSES = ("////", "\\\\\\\\", "....", "xxxx", "||||", "----", "++++", "oooo")
#: Minimum distance of a contour label from the frame of the panel and from other contours, as a
#: fraction of the panel size.
_MIN_CONTOUR_LABEL_GAP_OVER_PANEL_SIZE = 0.06
#: Minimum extent of labelled contours, as a fraction of the panel size.
_MIN_LABELLED_CONTOUR_OVER_PANEL_SIZE = 0.2
#: If an axis has fewer points than this number, contours are not drawn.
_MIN_AXIS_POINTS_FOR_CONTOURS = 6
_STATUS_LABEL_BY_CODE = {int(status): status.label for status in Status}


def build_map_panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """Build the maps of a variable.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, with the variable ``status`` along all dimensions of the lattice. A map
        requires a variable with at least two numeric dimensions of three or more points.
    variable : str, optional
        Name of a variable of the lattice. The default is the primary output.

    Returns
    -------
    list of Panel
        One map per point of the other axes, for at most 12 points. The list is empty if the dataset
        does not contain the variable, or if the variable does not have two numeric dimensions.
    """
    names = list_numeric_result_variables(dataset)[:1] if variable is None else [variable]
    if not names or names[0] not in dataset:
        return []
    values = dataset[names[0]]
    if not (is_numeric_variable(values) or read_flag_meanings_of_variable(values)):
        return []
    plane, cells = _choose_map_dimensions(dataset, values), dataset["status"].dims
    if plane is None or not set(values.dims) <= set(cells):
        return []
    others = [str(d) for d in values.dims if d not in plane]
    places = list(np.ndindex(*(values.sizes[d] for d in others)))[:_MAX_MAPS]
    panel = partial(
        Panel,
        x=plane[1],
        overlays=[
            partial(draw_map, names[0], plane, _choose_colour_scale_and_contour_levels(values)),
            partial(_label_y_axis, plane[0]),
        ],
        title=None if others else convert_symbols_to_mathtext(dataset.attrs.get("title", "")),
        legend_title=format_axis_label(dataset, names[0], 60)
        if read_flag_meanings_of_variable(values)
        else None,
    )
    return [panel(isel=dict(zip(others, at, strict=True))) for at in places]


def _choose_map_dimensions(dataset: xr.Dataset, variable: xr.DataArray) -> tuple[str, str] | None:
    """Return the names of the y axis and the x axis of a map.

    The axes are the last two numeric dimensions with at least three points. The result is None if
    the variable has fewer than two such dimensions.
    """
    numeric = [
        str(dimension)
        for dimension in variable.dims
        if dataset.sizes[dimension] >= _MIN_POINTS_PER_MAP_AXIS
        and has_numeric_points(dataset, str(dimension))
    ]
    return (numeric[-2], numeric[-1]) if len(numeric) > 1 else None


def draw_map(
    variable_name: str,
    map_dimensions: tuple[str, str],
    colour_scale_and_contour_levels: tuple[Normalize, Sequence[float]] | None,
    dataset: xr.Dataset,
    axes: Axes,
) -> None:
    """Draw a map of a variable with contours and hatched cells.

    Parameters
    ----------
    variable_name : str
        Name of the variable.
    map_dimensions : tuple of (str, str)
        Names of the y axis and the x axis.
    colour_scale_and_contour_levels : tuple of (Normalize, sequence of float), or None
        Colour scale and contour levels. For a variable with flags, pass the flag values instead of
        contour levels. If the argument is None, the scale is computed from the values in the map.
    dataset : xarray.Dataset
        Results with the variable and the variable ``status`` along the dimensions of the map.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    dataset = dataset.sortby(list(map_dimensions))
    values = dataset[variable_name].astype(float).transpose(*map_dimensions)
    y, x = (values[dimension].values.astype(float) for dimension in map_dimensions)
    at = compute_cell_edges(x, are_log_spaced(x)), compute_cell_edges(y, are_log_spaced(y))
    axes.set(**{f"{w}scale": "log" for w, points in (("x", x), ("y", y)) if are_log_spaced(points)})
    axes.set(xlim=(at[0][0], at[0][-1]), ylim=(at[1][0], at[1][-1]))
    if found := colour_scale_and_contour_levels or _choose_colour_scale_and_contour_levels(
        dataset[variable_name]
    ):
        axes.grid(False)
        known = np.ma.masked_invalid(values.values)
        # A diverging colour map is centred at zero if the values have both signs.
        colour_map = "RdBu_r" if isinstance(found[0], CenteredNorm) else None
        drawn = axes.pcolormesh(*at, known, rasterized=True, norm=found[0], cmap=colour_map)
        if meanings := read_flag_meanings_of_variable(dataset[variable_name]):
            for flag in found[1]:
                colour = drawn.to_rgba(np.array(flag))
                axes.add_collection(PolyCollection([], facecolor=colour, label=meanings[flag]))
        else:
            add_colour_bar_of_variable(drawn, dataset, axes, variable_name)
            draw_contours(axes, values, found[1])
    status = dataset["status"]
    status = status.squeeze(
        [d for d in status.dims if status.sizes[d] == 1 and d not in map_dimensions]
    )
    if set(status.dims) == set(map_dimensions):
        unknown = ~np.isfinite(values.values)
        _hatch_cells_without_value_by_status(
            axes, at, status.transpose(*map_dimensions).values, unknown
        )


def _choose_colour_scale_and_contour_levels(
    map_values: xr.DataArray,
) -> tuple[Normalize, Sequence[float]] | None:
    """Return the colour scale and the contour levels of a variable.

    For a variable with flags, the function returns the flag values instead of contour levels. The
    result is None if the variable has no finite value.
    """
    values = map_values.values.astype(float)
    if not np.isfinite(values).any():
        return None
    if read_flag_meanings_of_variable(map_values):
        flags = np.unique(values[np.isfinite(values)])
        return BoundaryNorm(compute_cell_edges(flags), 256), flags.tolist()
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if are_positive_and_span_decades(values):
        subs = (1.0, 3.0) if high < 1e4 * low else (1.0,)
        return LogNorm(low, high), LogLocator(subs=subs).tick_values(low, high)
    if low < 0.0 < high:
        return CenteredNorm(0.0, max(-low, high)), MaxNLocator(8).tick_values(low, high)
    return Normalize(low, high), MaxNLocator(8).tick_values(low, high)


def _label_y_axis(dimension: str, dataset: xr.Dataset, axes: Axes) -> None:
    """Label the y axis of a map, with a short label if the panel is small."""
    _across, up = estimate_text_capacity_in_characters(axes)
    axes.set_ylabel(format_axis_label(dataset, dimension, up))


# ---- contents of a map --------------------------------------------------------------------------


def draw_contours(axes: Axes, map_values: xr.DataArray, contour_levels: Sequence[float]) -> None:
    """Draw labelled contours of a variable.

    Contours are drawn only if both axes have at least six points.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to draw on.
    map_values : xarray.DataArray, shape (ny, nx)
        Values of the variable, with coordinates for both dimensions.
    contour_levels : sequence of float
        Values of the variable at the contours.
    """
    y, x = (map_values[dimension].values for dimension in map_values.dims)
    if min(map_values.shape) < _MIN_AXIS_POINTS_FOR_CONTOURS or not len(contour_levels):
        return
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "No contour levels were found")
        found = axes.contour(
            x, y, map_values, contour_levels, colors="white", linewidths=0.6, linestyles="-"
        )
    for text in axes.clabel(
        found,
        fontsize=MIN_FONT_SIZE,
        fmt=format_number,
        manual=_choose_contour_label_positions(axes, found),
    ):
        text.set_path_effects([withStroke(linewidth=1.0, foreground="0.2")])


def _choose_contour_label_positions(
    axes: Axes, contour_set: QuadContourSet
) -> list[tuple[float, float]]:
    """Choose the positions of the contour labels.

    The label of a contour level is placed on the longest contour of the level, at the point with
    the largest distance from other contour levels and from the frame. A level has no label if this
    distance is too small, or if the contour is too short.
    """
    panel = axes.transData + axes.transAxes.inverted()
    levels = [
        [panel.transform(part) for part in parts if len(part)] for parts in contour_set.allsegs
    ]
    places = []
    for level in filter(None, levels):
        others = [part for other in levels if other is not level for part in other]
        line = max(level, key=len)
        apart = cKDTree(np.concatenate(others)).query(line)[0] if others else np.ones(len(line))
        room = np.minimum(apart, np.minimum(line, 1.0 - line).min(axis=1))
        if (
            room.max() > _MIN_CONTOUR_LABEL_GAP_OVER_PANEL_SIZE
            and np.ptp(line, axis=0).max() > _MIN_LABELLED_CONTOUR_OVER_PANEL_SIZE
        ):
            x, y = panel.inverted().transform(line[room.argmax()]).tolist()
            places.append((x, y))
    return places


def _hatch_cells_without_value_by_status(
    axes: Axes,
    cell_edges: tuple[np.ndarray, np.ndarray],
    status_codes: np.ndarray,
    missing_mask: np.ndarray,
) -> None:
    """Hatch the cells without a value according to their status.

    Each status has a different hatch pattern, and the legend shows the name of the status.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to draw on.
    cell_edges : tuple of (ndarray, ndarray)
        Edges of the cells along x and along y.
    status_codes : ndarray, shape (ny, nx)
        Status codes of the cells.
    missing_mask : ndarray of bool, shape (ny, nx)
        True for the cells to be hatched.
    """
    for hatch, code in zip(
        _HATCH_PATTERNS_OF_STATUSES, np.unique(status_codes[missing_mask]), strict=False
    ):
        rows = [
            _compute_outline_of_cell_run(cell_edges, *run)
            for run in _find_horizontal_cell_runs(missing_mask & (status_codes == code))
        ]
        name = _STATUS_LABEL_BY_CODE[int(code)].replace("_", " ") if code else "no number"
        grey: dict[str, Any] = {"facecolor": "0.93", "edgecolor": "0.55", "linewidth": 0.0}
        axes.add_collection(PolyCollection(rows, hatch=hatch, label=name, **grey), autolim=False)


def _find_horizontal_cell_runs(cell_mask: np.ndarray) -> list[tuple[int, int, int]]:
    """Find runs of consecutive True values in the rows of an array.

    Each run is represented by a tuple: its row, its first column, and the column after its last
    column.
    """
    change = np.diff(np.pad(cell_mask.astype(int), ((0, 0), (1, 1))), axis=1)
    first, last = np.argwhere(change == 1), np.argwhere(change == -1)
    return [(int(r), int(a), int(b)) for (r, a), (_r, b) in zip(first, last, strict=True)]


def _compute_outline_of_cell_run(
    cell_edges: tuple[np.ndarray, np.ndarray], row: int, first_column: int, stop_column: int
) -> list[tuple[Any, Any]]:
    """Return the corners of the rectangle covered by consecutive cells."""
    (left, right), (low, high) = (
        cell_edges[0][[first_column, stop_column]],
        cell_edges[1][row : row + 2],
    )
    return [(left, low), (right, low), (right, high), (left, high)]
