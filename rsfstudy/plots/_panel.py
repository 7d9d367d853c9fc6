"""Drawing of the panels of a figure.

The function ``split_panel_by_facets`` creates one panel per facet, and ``draw_panel`` draws the
curves, labels and title of a panel. After all panels are drawn, ``finalize_scales_and_legends``
applies common scales and adds legends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.errors import DataError
from rsfstudy.plots._axis_formatting import (
    add_colour_bar_of_dimension,
    are_log_spaced,
    are_positive_and_span_decades,
    compute_point_colours,
    describe_point,
    format_axis_label,
    has_numeric_points,
    label_rows,
    set_log_scale,
    set_up_x_axis_for_dimension,
)
from rsfstudy.plots._style import (
    add_grey_legend_entry,
    add_legend,
    cycle_marker,
    cycle_style,
    estimate_text_capacity_in_characters,
    mark_failed_cells,
)
from rsfstudy.plots._text_formatting import convert_symbols_to_mathtext, format_slope, wrap_text
from rsfstudy.status import Status
from rsfstudy.study import Panel, read_quantities_not_in_vocabulary
from rsfstudy.vocabulary import find_quantity

#: Line styles and marker fill styles for the points of the second lattice axis in ``hue``.
_LINE_AND_FILL_STYLES_OF_SECOND_HUE = (
    ("-", "full"),
    ("--", "none"),
    (":", "none"),
    ("-.", "full"),
)
#: If a numeric axis has more points than the first value, a colour bar replaces the legend. If a
#: curve has more points than the second value, markers are omitted.
_MIN_POINTS_FOR_COLOUR_SCALE, _MAX_POINTS_WITH_MARKERS = 7, 60
#: Maximum number of decimal places of a slope.
_MAX_DECIMALS_OF_SLOPE = 6
#: Width of the panel letter and of the y tick labels, in characters.
_PANEL_LEFT_MARGIN_IN_CHARACTERS = 10
_ARRAY_OF_ONE_MISSING_VALUE = xr.DataArray(np.nan)


def split_panel_by_facets(panel: Panel, dataset: xr.Dataset) -> list[Panel]:
    """Create one panel for each combination of points along the ``facet`` axes.

    Parameters
    ----------
    panel : Panel
        Panel. The field ``facet`` of the panel contains the names of lattice axes.
    dataset : xarray.Dataset
        Results of a study, with the variables of the panel and the variable ``status``.

    Returns
    -------
    list of Panel
        Panels without facets. Panels without data are omitted. The list is empty if the dataset
        does not meet the condition of the panel.
    """
    if (
        isinstance(panel.y, str)
        and panel.y
        and not dataset.get(panel.y, _ARRAY_OF_ONE_MISSING_VALUE).notnull().any()
    ):
        return []
    if panel.condition and not panel.condition(dataset):
        return []
    places = np.ndindex(*(dataset.sizes[d] for d in panel.facet))
    found = [
        replace(panel, facet=(), isel={**dict(zip(panel.facet, at, strict=True)), **panel.isel})
        for at in places
    ]
    return [one for one in found if not panel.y or _has_data(one, dataset)]


def _has_data(panel: Panel, dataset: xr.Dataset) -> bool:
    """Return True if a panel has data to display."""
    part = _select_data_of_panel(panel, dataset)
    if isinstance(panel.y, str):
        return bool(part[panel.y].notnull().any() or (part["status"] == Status.OK).any())
    found = (
        _evaluate_variable_or_function(panel.y, row)
        for row, _style in iterate_curves_and_styles(panel, part)
    )
    return any(np.isfinite(values.astype(float)).any() for values in found)


def _select_data_of_panel(panel: Panel, dataset: xr.Dataset) -> xr.Dataset:
    """Select the data that a panel displays."""
    at = {d: place for d, place in panel.isel.items() if d in dataset.dims}
    return dataset.isel(
        {d: _find_indices_of_selected_points(dataset[d], place) for d, place in at.items()}
    )


def restrict_panel_to_point_of_extra_dims(
    panel: Panel, point_indices: Mapping[str, int], title_suffix: str
) -> Panel:
    """Restrict a panel to a single point along each additional dimension.

    Parameters
    ----------
    panel : Panel
        Panel without facets.
    point_indices : mapping of str to int
        Index of the point along each additional dimension.
    title_suffix : str
        Description of the point, which is appended to the title of the panel.

    Returns
    -------
    Panel
        Copy of the panel that is restricted to the point and has no condition.
    """
    own = {dimension: at for dimension, at in panel.isel.items() if dimension not in point_indices}

    def title(part: xr.Dataset) -> str:
        """Return the title of the panel, including the description of the point."""
        return _join_and_capitalise_phrases(
            _evaluate_text_or_function(panel.title, part, _describe_selected_points(part, own)),
            title_suffix,
        )

    return replace(panel, isel={**own, **point_indices}, title=title, condition=None)


def draw_panel(panel: Panel, dataset: xr.Dataset, axes: Axes) -> None:
    """Draw the curves, scales, labels and title of a panel.

    Parameters
    ----------
    panel : Panel
        Panel without facets.
    dataset : xarray.Dataset
        Results of a study, with the variables that the panel displays.
    axes : matplotlib.axes.Axes
        Axes to draw on.

    Raises
    ------
    DataError
        If the x and y values of a curve are not one-dimensional arrays of the same size.
    """
    part = _select_data_of_panel(panel, dataset)
    places = "" if panel.is_custom else _describe_selected_points(part, panel.isel)
    if panel.x and (panel.y in part if isinstance(panel.y, str) else panel.y):
        values = [
            _draw_curve(panel, row, axes, style)
            for row, style in iterate_curves_and_styles(panel, part)
        ]
        _add_second_hue_legend(panel, part, axes)
        _set_axis_scales(panel, part, axes, np.concatenate(values))
    for mark in panel.overlays:
        mark(part, axes)
    for which, limits in (("x", panel.x_limits), ("y", panel.y_limits)):
        if any(end is not None for end in limits):
            getattr(axes, f"set_{which}lim")(*limits)
        if which == "y" and limits[1] is None is not limits[0]:
            # A margin above the highest point keeps the marker of the highest point inside the
            # panel.
            top = float(axes.dataLim.ymax)
            axes.set_ylim(top=max(axes.get_ylim()[1], top + 0.05 * (top - limits[0])))
    across, up = estimate_text_capacity_in_characters(axes)
    if label := _format_panel_axis_label(
        panel.x, panel.x_label, part, across - _PANEL_LEFT_MARGIN_IN_CHARACTERS
    ):
        axes.set_xlabel(label)
    if label := _format_panel_axis_label(panel.y, panel.y_label, part, up):
        axes.set_ylabel(label)
    title = ", ".join(
        filter(None, [axes.get_title(), _evaluate_text_or_function(panel.title, part, places)])
    )
    axes.set_title(wrap_text(title, across - _PANEL_LEFT_MARGIN_IN_CHARACTERS))


def finalize_scales_and_legends(panels: Sequence[Panel], axes_of_panels: Sequence[Axes]) -> None:
    """Apply common scales to the panels and add legends.

    Panels with the same ``y_scale_group`` get the same y limits and the same colour limits. Panels
    that are drawn by a user-defined function are not changed.

    Parameters
    ----------
    panels : sequence of Panel
        All panels of the figure.
    axes_of_panels : sequence of matplotlib.axes.Axes
        Axes of the panels, in the order of ``panels``.
    """
    pairs = [(p, axes) for p, axes in zip(panels, axes_of_panels, strict=True) if not p.is_custom]
    for name in {panel.y_scale_group for panel, _axes in pairs if panel.y_scale_group}:
        group = [axes for panel, axes in pairs if panel.y_scale_group == name and axes.has_data()]
        ends = [end for axes in group for end in axes.get_ylim()]
        for axes in group:
            axes.set_ylim(min(ends), max(ends))
        maps = [drawn for axes in group for drawn in axes.collections if drawn.colorbar]
        for drawn in maps:
            drawn.set_clim(min(m.get_clim()[0] for m in maps), max(m.get_clim()[1] for m in maps))
    for panel, axes in pairs:
        for which in "xy":
            if getattr(axes, f"get_{which}scale")() == "log":
                set_log_scale(axes, which)
        add_legend(axes, panel.legend_columns, panel.legend_title)


def iterate_curves_and_styles(
    panel: Panel, panel_data: xr.Dataset
) -> Iterator[tuple[xr.Dataset, dict[str, Any]]]:
    """Iterate over the curves of a panel.

    Parameters
    ----------
    panel : Panel
        Panel. The field ``hue`` of the panel contains the names of lattice axes.
    panel_data : xarray.Dataset
        Data that the panel displays.

    Yields
    ------
    row : xarray.Dataset
        Data that the curve displays.
    style : dict of str to object
        Properties of the curve, as for ``matplotlib.axes.Axes.plot``.
    """
    several = [d for d in panel.hue if panel_data.sizes[d] > 1]
    shades = (
        None
        if callable(panel.style) or not panel.hue
        else _compute_curve_colours(panel_data, panel.hue[0])
    )
    named = [d for d in panel.hue if shades is None or d != panel.hue[0]]
    for at in np.ndindex(*(panel_data.sizes[d] for d in panel.hue)):
        row = panel_data.isel(dict(zip(panel.hue, at, strict=True)))
        number = at[0] if at else 0
        style = cycle_style(number) | {"marker": cycle_marker(number)}
        if shades is not None:
            style |= {"color": shades[number], "linestyle": "-"}
        if panel.hue[1:] and panel.hue[1] in several:
            style |= _choose_line_style_for_second_hue(at[1])
        style["label"] = _format_curve_label(panel, row, named[:1] if len(several) > 1 else named)
        own = panel.style
        yield row, style | dict(own(row) if callable(own) else own)


def _choose_line_style_for_second_hue(point_number: int) -> dict[str, str]:
    """Return the line style and the marker fill style for a point of the second ``hue`` axis."""
    line, fill = _LINE_AND_FILL_STYLES_OF_SECOND_HUE[
        point_number % len(_LINE_AND_FILL_STYLES_OF_SECOND_HUE)
    ]
    return {"linestyle": line, "fillstyle": fill}


def _add_second_hue_legend(panel: Panel, panel_data: xr.Dataset, axes: Axes) -> None:
    """Add legend entries for the line styles of the second ``hue`` axis.

    The legend entries are grey. No entries are added if only one ``hue`` axis varies, if the first
    axis has a colour scale, or if the panel defines its own curve labels.
    """
    if panel.curve_label is None and len([d for d in panel.hue if panel_data.sizes[d] > 1]) > 1:
        second = panel.hue[1]
        shades = (
            not callable(panel.style)
            and _compute_curve_colours(panel_data, panel.hue[0]) is not None
        )
        own = {} if callable(panel.style) else dict(panel.style)
        line = {"linestyle": "none"} if panel.markers_only else {}
        for number in range(panel_data.sizes[second] if not shades else 0):
            style = {"marker": "o"} | _choose_line_style_for_second_hue(number) | own | line
            add_grey_legend_entry(
                axes, describe_point(panel_data.isel({second: number}), second), style
            )


def _compute_curve_colours(panel_data: xr.Dataset, dimension: str) -> np.ndarray | None:
    """Return one colour per point of a numeric axis with many points.

    The result is None if the axis has few points or is not numeric.
    """
    long = panel_data.sizes[dimension] > _MIN_POINTS_FOR_COLOUR_SCALE and has_numeric_points(
        panel_data, dimension
    )
    return compute_point_colours(panel_data, dimension) if long else None


def _format_curve_label(
    panel: Panel, curve_data: xr.Dataset, dimensions: Sequence[str]
) -> str | None:
    """Return the legend label of a curve, including its slope if available."""
    name = (
        convert_symbols_to_mathtext(panel.curve_label(curve_data))
        if panel.curve_label
        else ", ".join(describe_point(curve_data, d) for d in dimensions) or None
    )
    if name is None or not np.isfinite(curve_data.get(f"{panel.annotation}_stderr", np.nan)):
        return name
    symbol = find_quantity(panel.annotation, read_quantities_not_in_vocabulary(curve_data)).symbol
    slope = format_slope(curve_data, panel.annotation, _MAX_DECIMALS_OF_SLOPE)
    slope = f"{symbol} = {slope}".removeprefix(" = ")
    # The equation is a single formula, so that a line break at the equals sign is impossible.
    return f"{name}: {slope.replace('$ = $', ' = ')}"


def _draw_curve(
    panel: Panel, curve_data: xr.Dataset, axes: Axes, style: dict[str, Any]
) -> np.ndarray:
    """Draw one curve and return its y values.

    Raises
    ------
    DataError
        If the x and y values are not one-dimensional arrays of the same size.
    """
    values = (
        _evaluate_variable_or_function(panel.x, curve_data),
        _evaluate_variable_or_function(panel.y, curve_data),
    )
    if values[0].shape != values[1].shape or values[0].ndim != 1:
        shapes = " and ".join(f"shape {found.shape}" for found in values)
        remedy = "Assign each other axis to hue=, facet= or isel= of the panel."
        raise DataError(
            f"x and y of a curve have {shapes}, but must be one-dimensional arrays of the same "
            f"size. {remedy}"
        )
    named = [found.dtype.kind not in "fiu" for found in values]
    x, y = (
        np.arange(found.size) if by_name else np.asarray(found, dtype=float)
        for found, by_name in zip(values, named, strict=True)
    )
    style = style | ({"linestyle": "none"} if any(named) else {})
    if y.size > _MAX_POINTS_WITH_MARKERS and not panel.markers_only:
        style = style | {"marker": ""}
    if np.isfinite(y).sum() == 1 and not style["marker"]:
        # A line with a single point is invisible without a marker.
        style = style | {"marker": "o"}
    points = {"linestyle": "none"} if panel.markers_only or panel.fit_line else {}
    axes.plot(x, y, **style | points)
    if (
        panel.fit_line
        and np.isfinite(line := np.broadcast_arrays(*panel.fit_line(curve_data))).any()
    ):
        # The line is drawn without markers, but its legend entry shows the marker of the points.
        axes.plot(*line, **style | {"linewidth": 0.9, "markevery": []})
    if panel.error_bars:
        bars = {"fmt": "none", "ecolor": style["color"], "elinewidth": 0.8, "capsize": 3}
        axes.errorbar(x, y, _evaluate_variable_or_function(panel.error_bars, curve_data), **bars)
    if (status := curve_data.get("status")) is not None and np.shape(status) == y.shape:
        mark_failed_cells(status.values, x, y, axes)
    return y


def _evaluate_variable_or_function(variable_or_function: Any, curve_data: xr.Dataset) -> np.ndarray:
    """Return the values of a variable, or the result of a function."""
    return np.atleast_1d(
        np.asarray(
            variable_or_function(curve_data)
            if callable(variable_or_function)
            else curve_data[variable_or_function]
        )
    )


def _find_indices_of_selected_points(points: xr.DataArray, index_or_function: Any) -> Any:
    """Convert a selection of axis points to indices without duplicates.

    The selection may be a function such as ``min``, which takes a list of all coordinate values and
    returns one value or a list of values.
    """
    if callable(index_or_function):
        values, wanted = points.values.tolist(), index_or_function(points.values.tolist())
        index_or_function = (
            [values.index(v) for v in wanted] if isinstance(wanted, list) else values.index(wanted)
        )
    return (
        list(dict.fromkeys(n % points.size for n in index_or_function))
        if isinstance(index_or_function, list)
        else index_or_function
    )


def _set_axis_scales(
    panel: Panel, panel_data: xr.Dataset, axes: Axes, y_values: np.ndarray
) -> None:
    """Set the scales of a panel, set tick labels and add a colour bar."""
    named = isinstance(panel.x, str) and panel_data[panel.x].dtype.kind not in "fiu"
    if named:
        set_up_x_axis_for_dimension(axes, panel_data, str(panel.x))
    if isinstance(panel.y, str) and panel_data[panel.y].dtype.kind in "OU":
        label_rows(axes, list(map(str, panel_data[panel.y].values)))
    log = panel.log
    if log is None:
        along = isinstance(panel.x, str) and panel.x in panel_data.coords and not named
        log = "x" * (
            along and are_log_spaced(panel_data[panel.x].values)
        ) + "y" * are_positive_and_span_decades(y_values)
    positive = {"x": axes.dataLim.minposx, "y": axes.dataLim.minposy}
    axes.set(**{f"{which}scale": "log" for which in log if math.isfinite(positive[which])})
    first = next(iter(panel.hue), "")
    if (
        first
        and not callable(panel.style)
        and _compute_curve_colours(panel_data, first) is not None
    ):
        add_colour_bar_of_dimension(panel_data, axes, first)


def _format_panel_axis_label(
    variable_or_function: Any, declared_label: Any, panel_data: xr.Dataset, max_line_characters: int
) -> str:
    """Return the label of an axis, wrapped to the width of the panel."""
    if declared_label is not None:
        return wrap_text(
            _evaluate_text_or_function(declared_label, panel_data, ""), max_line_characters
        )
    return (
        format_axis_label(panel_data, variable_or_function, max_line_characters)
        if isinstance(variable_or_function, str) and variable_or_function
        else ""
    )


def _evaluate_text_or_function(
    text_or_function: Any, panel_data: xr.Dataset, default_text: str
) -> str:
    """Return a label or title of a panel, or a default if the text is None.

    If the label or title is a function, it is called with the dataset as its argument.
    """
    if text_or_function is None:
        return default_text
    return str(text_or_function(panel_data) if callable(text_or_function) else text_or_function)


def _describe_selected_points(panel_data: xr.Dataset, selected_indices: Mapping[str, Any]) -> str:
    """Return a title that describes the selected axis points of a panel."""
    return _join_and_capitalise_phrases(
        *(
            describe_point(panel_data, dimension)
            for dimension in selected_indices
            if panel_data[dimension].ndim == 0
        )
    )


def _join_and_capitalise_phrases(*phrases: str) -> str:
    """Join phrases with commas and capitalise the first letter.

    The function omits empty phrases.
    """
    text = ", ".join(filter(None, phrases))
    return f"{text[:1].upper()}{text[1:]}"
