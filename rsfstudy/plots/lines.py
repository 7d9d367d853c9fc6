"""Line plots of the variables of any study.

The function ``build_line_panels`` builds one panel per variable. Each panel shows the variable
against one axis of the study, with one line for each point of the other axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.plots._axis_formatting import (
    add_colour_bar_of_dimension,
    are_log_spaced,
    are_positive_and_span_decades,
    compute_point_colours,
    describe_point,
    format_axis_label,
    has_numeric_points,
    is_numeric_variable,
    list_primary_and_varying_variables,
    read_flag_meanings_of_variable,
    set_up_x_axis_for_dimension,
)
from rsfstudy.plots._style import (
    add_grey_legend_entry,
    cycle_marker,
    cycle_style,
    mark_failed_cells,
)
from rsfstudy.plots._text_formatting import convert_symbols_to_mathtext
from rsfstudy.storage import StoredDataset
from rsfstudy.study import Panel

#: Maximum number of panels, maximum number of lines with a legend entry, and number of points of a
#: numeric axis above which a colour scale is used.
_MAX_PANELS, _MAX_LEGEND_LINES, _MAX_CYCLED_COLOURS = 4, 12, 6
#: Maximum number of identical curves whose names are all listed in the legend.
_MAX_IDENTICAL_CURVES_LISTED_IN_LEGEND = 3
#: Number of points of a line above which markers are omitted.
_MAX_POINTS_WITH_MARKERS = 60


def build_line_panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """Build the line plots of one or several variables.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, with the variable ``status`` and the attribute ``declaration``.
    variable : str, optional
        Name of a variable. By default, the figure shows the primary output and the first measured
        variables that vary. If the measure has no numeric variables, the figure shows the status.

    Returns
    -------
    list of Panel
        One panel per variable, for at most four variables. The list is empty if the dataset does
        not contain ``variable``, or if the variable is neither numeric nor a flag.
    """
    if variable is None:
        names = list_primary_and_varying_variables(dataset)[:_MAX_PANELS] or ["status"]
    else:
        known = variable in dataset
        drawn = known and (
            is_numeric_variable(dataset[variable])
            or read_flag_meanings_of_variable(dataset[variable])
        )
        names = [variable] if drawn else []
    named = len(names) == 1 and not StoredDataset(dataset).study_declaration.overrides
    return [
        _build_line_panel(dataset, name, dataset.attrs.get("title", "") if named else "")
        for name in names
    ]


def _build_line_panel(dataset: xr.Dataset, variable_name: str, title: str) -> Panel:
    """Build the panel of one variable."""
    along = (
        _choose_x_dimension(dataset, dataset[variable_name]) if dataset[variable_name].ndim else ""
    )
    return Panel(
        x=along,
        overlays=[partial(_draw_lines_of_variable, variable_name, along)],
        y_label=format_axis_label(dataset, variable_name, 200),
        title=convert_symbols_to_mathtext(title),
    )


def _draw_lines_of_variable(
    variable_name: str, x_dimension: str, dataset: xr.Dataset, axes: Axes
) -> None:
    """Draw the lines of a variable along a dimension."""
    values = dataset[variable_name]
    if told := read_flag_meanings_of_variable(values):
        flags, places = np.unique(values.values, return_inverse=True)
        values = values.copy(data=np.reshape(places, values.shape).astype(float))
        axes.set_yticks(range(flags.size), [told[flag] for flag in flags.tolist()])
        axes.set_ylim(-0.5, flags.size - 0.5)
    x = set_up_x_axis_for_dimension(axes, dataset, x_dimension) if x_dimension else np.zeros(1)
    numeric = bool(x_dimension) and has_numeric_points(dataset, x_dimension)
    coloured = _choose_colour_dimension(dataset, values, x_dimension)
    others = [str(d) for d in values.dims if d not in (x_dimension, coloured)]
    curves = _group_and_describe_identical_curves(
        list(_iterate_values_at_points(values, others)), others
    )
    for number, (group, text) in enumerate(curves):
        style = cycle_style(number) | {
            "label": text if number < _MAX_LEGEND_LINES and text else None
        }
        style["marker"] = (
            cycle_marker(number) if x.size <= _MAX_POINTS_WITH_MARKERS or not numeric else ""
        )
        style |= {} if numeric else {"linestyle": "none"}
        if coloured is None:
            axes.plot(x, np.atleast_1d(group.values), **style)
            _draw_standard_errors(dataset, group, x, axes, style)
            continue
        shades = compute_point_colours(dataset, coloured)
        for row, colour in zip(_iterate_values_at_points(group, [coloured]), shades, strict=True):
            axes.plot(x, row.values, **style | {"color": colour})
            style["label"] = None
    if x_dimension in dataset["status"].dims:
        status, found = xr.broadcast(dataset["status"], values)
        along = (x_dimension, ...)
        mark_failed_cells(status.transpose(*along).values, x, found.transpose(*along).values, axes)
    if coloured is not None:
        add_colour_bar_of_dimension(dataset, axes, coloured)
    if numeric and are_log_spaced(x):
        axes.set_xscale("log")
    if are_positive_and_span_decades(np.asarray(values.values, dtype=float)):
        axes.set_yscale("log")
    if len(curves) > _MAX_LEGEND_LINES:
        add_grey_legend_entry(
            axes, f"first {_MAX_LEGEND_LINES} of {len(curves)} curves", {"linestyle": "none"}
        )


def _draw_standard_errors(
    dataset: xr.Dataset, curve: xr.DataArray, x: np.ndarray, axes: Axes, style: dict[str, Any]
) -> None:
    """Draw the standard errors of a curve if the dataset contains them."""
    name = f"{curve.name}_stderr"
    if name not in dataset or not set(curve.dims) <= set(dataset[name].dims):
        return
    at = {
        str(d): curve.coords[d]
        for d in dataset[name].dims
        if d in curve.coords and not curve[d].ndim
    }
    errors = np.atleast_1d(dataset[name].sel(at).values).astype(float)
    if errors.shape == x.shape:
        axes.errorbar(
            x, np.atleast_1d(curve.values), errors, fmt="none", ecolor=style["color"],
            elinewidth=0.8, capsize=3,
        )  # fmt: skip


def _choose_x_dimension(dataset: xr.Dataset, variable: xr.DataArray) -> str:
    """Choose the dimension along x.

    The function chooses the longest numeric dimension, or the last dimension if no dimension is
    numeric.
    """
    names = [str(dimension) for dimension in variable.dims]
    numeric = [
        name for name in names if name in dataset.coords and has_numeric_points(dataset, name)
    ]
    return max(reversed(numeric), key=lambda name: variable.sizes[name]) if numeric else names[-1]


def _choose_colour_dimension(
    dataset: xr.Dataset, variable: xr.DataArray, x_dimension: str
) -> str | None:
    """Choose the dimension that is represented by a colour scale.

    The function chooses the longest numeric dimension except the dimension along x. The result is
    None if this dimension has at most six points.
    """
    numeric = [
        str(d) for d in variable.dims if d != x_dimension and has_numeric_points(dataset, str(d))
    ]
    long = [name for name in numeric if variable.sizes[name] > _MAX_CYCLED_COLOURS]
    return max(long, key=lambda name: variable.sizes[name]) if long else None


def _iterate_values_at_points(
    values: xr.DataArray, dimensions: Sequence[str]
) -> Iterator[xr.DataArray]:
    """Iterate over all combinations of points of several dimensions."""
    for places in np.ndindex(*(values.sizes[d] for d in dimensions)):
        yield values.isel(dict(zip(dimensions, places, strict=True)))


def _group_and_describe_identical_curves(
    curves: Sequence[xr.DataArray], dimensions: Sequence[str]
) -> list[tuple[xr.DataArray, str]]:
    """Group identical curves and describe the points of each group.

    Curves without a finite value are omitted.
    """
    alike: dict[bytes, list[xr.DataArray]] = {}
    for group in curves:
        if bool(np.isfinite(group).any()):
            alike.setdefault(group.values.tobytes(), []).append(group)
    several = [d for d in dimensions if len({str(group[d].item()) for group in curves}) > 1]
    return [
        (same[0], ", ".join(_describe_points_of_identical_curves(same, several)))
        for same in alike.values()
    ]


def _describe_points_of_identical_curves(
    identical_curves: Sequence[xr.DataArray], dimensions: Sequence[str]
) -> tuple[str, ...]:
    """Describe the points of a group of identical curves.

    The description contains the coordinates that are equal for all curves. If all coordinates
    differ, the description lists all points. If the group is large, the description contains only
    the first point and the number of remaining points.
    """
    places = [
        list(dict.fromkeys(describe_point(group, d) for group in identical_curves))
        for d in dimensions
    ]
    if not places or any(len(names) == 1 for names in places):
        return tuple(names[0] for names in places if len(names) == 1)
    every = [", ".join(describe_point(one, d) for d in dimensions) for one in identical_curves]
    if len(every) <= _MAX_IDENTICAL_CURVES_LISTED_IN_LEGEND:
        return (" and ".join(every),)
    return (f"{every[0]} and {len(every) - 1} more",)
