"""Draws a `Panel`: its curves, its scales, and what its axes, curves and places are called."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.errors import DataError
from rsfstudy.plots._axes import (
    add_colour_bar,
    describe_point,
    has_numeric_points,
    is_log_spaced,
    label_rows,
    point_colours,
    set_log_scale,
    set_up_x_axis,
    spans_decades,
)
from rsfstudy.plots._style import (
    add_grey_legend_entry,
    add_legend,
    cycle_marker,
    cycle_style,
    text_capacity,
)
from rsfstudy.plots._text import axis_label as labelled
from rsfstudy.plots._text import format_slope, to_mathtext, wrap_text
from rsfstudy.status import Status
from rsfstudy.study import Panel, read_quantities
from rsfstudy.vocabulary import find_quantity

#: Of the second axis of `hue`: dashes, and how markers are filled.
_SECOND_HUE_STYLES = (("-", "full"), ("--", "none"), (":", "none"), ("-.", "full"))
#: Points of an axis of numbers from which on a scale of colours tells curves apart, and points of
#: curves from which on they have no markers.
_MIN_POINTS_FOR_COLOUR_SCALE, _MAX_POINTS_WITH_MARKERS = 7, 60
#: Digits of a slope.
_SLOPE_DIGITS = 6
#: Characters left of a title for the letter of a panel, and for numbers along y.
_LETTER_WIDTH = 10
_MISSING = xr.DataArray(np.nan)


def expand_facets(panel: Panel, dataset: xr.Dataset) -> list[Panel]:
    """The panel at each point of the axes of its `facet`; none where there is nothing to draw."""
    if isinstance(panel.y, str) and panel.y and not dataset.get(panel.y, _MISSING).notnull().any():
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
    """True if there is anything to draw in a panel."""
    part = _select_part(panel, dataset)
    if isinstance(panel.y, str):
        return bool(part[panel.y].notnull().any() or (part["status"] == Status.OK).any())
    found = (_evaluate(panel.y, row) for row, _style in iterate_curves(panel, part))
    return any(np.isfinite(values.astype(float)).any() for values in found)


def _select_part(panel: Panel, dataset: xr.Dataset) -> xr.Dataset:
    """The part of a dataset that a panel shows."""
    at = {d: place for d, place in panel.isel.items() if d in dataset.dims}
    return dataset.isel({d: _point_indices(dataset[d], place) for d, place in at.items()})


def at_extra_dims(panel: Panel, where: Mapping[str, int], said: str) -> Panel:
    """The panel at a place on further axes, which its title says too."""

    own = {dimension: at for dimension, at in panel.isel.items() if dimension not in where}

    def title(part: xr.Dataset) -> str:
        return _join_phrases(_resolve_text(panel.title, part, _describe_places(part, own)), said)

    return replace(panel, isel={**own, **where}, title=title, condition=None)


def draw_panel(panel: Panel, dataset: xr.Dataset, axes: Axes) -> None:
    """Draw all of a panel that does not depend on others."""
    part = _select_part(panel, dataset)
    places = "" if panel.is_custom else _describe_places(part, panel.isel)
    if panel.x and (panel.y in part if isinstance(panel.y, str) else panel.y):
        values = [
            _draw_curve(panel, row, axes, style) for row, style in iterate_curves(panel, part)
        ]
        _add_second_hue_legend(panel, part, axes)
        _set_scales(panel, part, axes, np.concatenate(values))
    for mark in panel.overlays:
        mark(part, axes)
    for which, limits in (("x", panel.x_limits), ("y", panel.y_limits)):
        if any(end is not None for end in limits):
            getattr(axes, f"set_{which}lim")(*limits)
        if which == "y" and limits[1] is None is not limits[0]:
            top = float(axes.dataLim.ymax)  # what lies highest is seen whole
            axes.set_ylim(top=max(axes.get_ylim()[1], top + 0.05 * (top - limits[0])))
    across, up = text_capacity(axes)
    if label := _axis_label(panel.x, panel.x_label, part, across - _LETTER_WIDTH):
        axes.set_xlabel(label)
    if label := _axis_label(panel.y, panel.y_label, part, up):
        axes.set_ylabel(label)
    title = ", ".join(filter(None, [axes.get_title(), _resolve_text(panel.title, part, places)]))
    axes.set_title(wrap_text(title, across - _LETTER_WIDTH))


def finalize_panels(panels: Sequence[Panel], axes_of: Sequence[Axes]) -> None:
    """Have panels that are to be alike the same scales along y and of colours, and then numbers and
    legends.
    """
    pairs = [(p, axes) for p, axes in zip(panels, axes_of, strict=True) if not p.is_custom]
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


def iterate_curves(panel: Panel, part: xr.Dataset) -> Iterator[tuple[xr.Dataset, dict[str, Any]]]:
    """Each curve of a panel, and how it is drawn."""
    several = [d for d in panel.hue if part.sizes[d] > 1]
    shades = None if callable(panel.style) or not panel.hue else _curve_colours(part, panel.hue[0])
    named = [d for d in panel.hue if shades is None or d != panel.hue[0]]
    for at in np.ndindex(*(part.sizes[d] for d in panel.hue)):
        row = part.isel(dict(zip(panel.hue, at, strict=True)))
        number = at[0] if at else 0
        style = cycle_style(number) | {"marker": cycle_marker(number)}
        if shades is not None:
            style |= {"color": shades[number], "linestyle": "-"}
        if panel.hue[1:] and panel.hue[1] in several:
            style |= _second_hue_style(at[1])
        style["label"] = _curve_name(panel, row, named[:1] if len(several) > 1 else named)
        own = panel.style
        yield row, style | dict(own(row) if callable(own) else own)


def _second_hue_style(number: int) -> dict[str, str]:
    """Dashes and markers of a point of the second axis of `hue`."""
    line, fill = _SECOND_HUE_STYLES[number % len(_SECOND_HUE_STYLES)]
    return {"linestyle": line, "fillstyle": fill}


def _add_second_hue_legend(panel: Panel, part: xr.Dataset, axes: Axes) -> None:
    """Say what dashes and open markers stand for, where colours stand for something else."""
    if panel.curve_label is None and len([d for d in panel.hue if part.sizes[d] > 1]) > 1:
        second = panel.hue[1]
        shades = not callable(panel.style) and _curve_colours(part, panel.hue[0]) is not None
        own = {} if callable(panel.style) else dict(panel.style)
        line = {"linestyle": "none"} if panel.markers_only else {}
        for number in range(part.sizes[second] if not shades else 0):
            style = {"marker": "o"} | _second_hue_style(number) | own | line
            add_grey_legend_entry(axes, describe_point(part.isel({second: number}), second), style)


def _curve_colours(part: xr.Dataset, dimension: str) -> np.ndarray | None:
    """Colours of a scale for the points of a long axis of numbers."""
    long = part.sizes[dimension] > _MIN_POINTS_FOR_COLOUR_SCALE and has_numeric_points(
        part, dimension
    )
    return point_colours(part, dimension) if long else None


def _curve_name(panel: Panel, row: xr.Dataset, by: Sequence[str]) -> str | None:
    name = (
        to_mathtext(panel.curve_label(row))
        if panel.curve_label
        else ", ".join(describe_point(row, d) for d in by) or None
    )
    if name is None or not np.isfinite(row.get(f"{panel.annotation}_stderr", np.nan)):
        return name
    symbol = find_quantity(panel.annotation, read_quantities(row)).symbol
    slope = f"{symbol} = {format_slope(row, panel.annotation, _SLOPE_DIGITS)}".removeprefix(" = ")
    return f"{name}: {slope.replace('$ = $', ' = ')}"  # a formula is never broken


def _draw_curve(panel: Panel, row: xr.Dataset, axes: Axes, style: dict[str, Any]) -> np.ndarray:
    """Draw one curve, and return its y values.

    Raises
    ------
    DataError
        If x and y are not one-dimensional arrays of the same size.
    """
    values = _evaluate(panel.x, row), _evaluate(panel.y, row)
    if values[0].shape != values[1].shape or values[0].ndim != 1:
        shapes = " and ".join(f"shape {found.shape}" for found in values)
        remedy = "Assign each other axis to hue=, facet= or isel= of the panel."
        raise DataError(
            f"x and y of a curve have {shapes}, but must be equally long lists. {remedy}"
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
        style = style | {"marker": "o"}  # a line of one point is not seen
    points = {"linestyle": "none"} if panel.markers_only or panel.fit_line else {}
    axes.plot(x, y, **style | points)
    if panel.fit_line and np.isfinite(line := np.broadcast_arrays(*panel.fit_line(row))).any():
        # its legend has the marker, too
        axes.plot(*line, **style | {"linewidth": 0.9, "markevery": []})
    if panel.error_bars:
        bars = {"fmt": "none", "ecolor": style["color"], "elinewidth": 0.8, "capsize": 3}
        axes.errorbar(x, y, _evaluate(panel.error_bars, row), **bars)
    return y


def _evaluate(what: Any, row: xr.Dataset) -> np.ndarray:
    return np.atleast_1d(np.asarray(what(row) if callable(what) else row[what]))


def _point_indices(points: xr.DataArray, at: Any) -> Any:
    """Numbers of points: of the lowest, for `min`; each once."""
    if callable(at):
        values, wanted = points.values.tolist(), at(points.values.tolist())
        at = [values.index(v) for v in wanted] if isinstance(wanted, list) else values.index(wanted)
    return list(dict.fromkeys(n % points.size for n in at)) if isinstance(at, list) else at


def _set_scales(panel: Panel, part: xr.Dataset, axes: Axes, values: np.ndarray) -> None:
    named = isinstance(panel.x, str) and part[panel.x].dtype.kind not in "fiu"
    if named:
        set_up_x_axis(axes, part, str(panel.x))
    if isinstance(panel.y, str) and part[panel.y].dtype.kind in "OU":
        label_rows(axes, list(map(str, part[panel.y].values)))
    log = panel.log
    if log is None:
        along = isinstance(panel.x, str) and panel.x in part.coords and not named
        log = "x" * (along and is_log_spaced(part[panel.x].values)) + "y" * spans_decades(values)
    positive = {"x": axes.dataLim.minposx, "y": axes.dataLim.minposy}
    axes.set(**{f"{which}scale": "log" for which in log if math.isfinite(positive[which])})
    first = next(iter(panel.hue), "")
    if first and not callable(panel.style) and _curve_colours(part, first) is not None:
        add_colour_bar(part, axes, first)


def _axis_label(what: Any, said: Any, part: xr.Dataset, width: int) -> str:
    if said is not None:
        return wrap_text(_resolve_text(said, part, ""), width)
    return (
        labelled(find_quantity(what, read_quantities(part)), width)
        if isinstance(what, str) and what
        else ""
    )


def _resolve_text(said: Any, part: xr.Dataset, otherwise: str) -> str:
    """Text that a panel states, or else another."""
    if said is None:
        return otherwise
    return str(said(part) if callable(said) else said)


def _describe_places(part: xr.Dataset, at: Mapping[str, Any]) -> str:
    """Place of a panel on the axes that it shows one point of, as a title."""
    return _join_phrases(
        *(describe_point(part, dimension) for dimension in at if part[dimension].ndim == 0)
    )


def _join_phrases(*parts: str) -> str:
    """Parts one after the other, with a capital letter; empty ones are left out."""
    text = ", ".join(filter(None, parts))
    return f"{text[:1].upper()}{text[1:]}"
