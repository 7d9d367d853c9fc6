"""Draws a `Panel`: its curves, its scales, and what its axes, curves and places are called."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.declare.figure import Panel
from rsfstudy.plots._axes import (
    axis_of,
    colour_bar,
    colours,
    is_log_spaced,
    is_numeric,
    is_wide,
    log_scale,
    name_rows,
    place,
)
from rsfstudy.plots._style import in_grey, legend, look, marker, room
from rsfstudy.plots._text import label as labelled
from rsfstudy.plots._text import pretty, slope_with_error, wrapped
from rsfstudy.reduce.base import stated_by
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

#: Of the second axis of `by`: dashes, and how markers are filled.
_SECOND = (("-", "full"), ("--", "none"), (":", "none"), ("-.", "full"))
#: Points of an axis of numbers from which on a scale of colours tells curves apart, and points of
#: curves from which on they have no markers.
_SCALE, _DENSE = 7, 60
#: Digits of a slope.
_DIGITS = 6
#: Characters left of a title for the letter of a panel, and for numbers along y.
_LETTER = 10
_NONE = xr.DataArray(np.nan)


def expanded(panel: Panel, dataset: xr.Dataset) -> list[Panel]:
    """The panel at each point of the axes of its `each`; none where there is nothing to draw."""
    if isinstance(panel.y, str) and panel.y and not dataset.get(panel.y, _NONE).notnull().any():
        return []
    if panel.when and not panel.when(dataset):
        return []
    places = np.ndindex(*(dataset.sizes[d] for d in panel.each))
    found = [
        replace(panel, each=(), at={**dict(zip(panel.each, at, strict=True)), **panel.at})
        for at in places
    ]
    return [one for one in found if not panel.y or _is_known(one, dataset)]


def _is_known(panel: Panel, dataset: xr.Dataset) -> bool:
    """True if there is anything to draw in a panel."""
    part = _part(panel, dataset)
    if isinstance(panel.y, str):
        return bool(part[panel.y].notnull().any() or (part["status"] == Status.OK).any())
    found = (_values(panel.y, row) for row, _style in rows(panel, part))
    return any(np.isfinite(values.astype(float)).any() for values in found)


def _part(panel: Panel, dataset: xr.Dataset) -> xr.Dataset:
    """The part of a dataset that a panel shows."""
    at = {d: place for d, place in panel.at.items() if d in dataset.dims}
    return dataset.isel({d: _numbers(dataset[d], place) for d, place in at.items()})


def within(panel: Panel, where: Mapping[str, int], said: str) -> Panel:
    """The panel at a place on further axes, which its title says too."""

    own = {dimension: at for dimension, at in panel.at.items() if dimension not in where}

    def title(part: xr.Dataset) -> str:
        return _sentence(_text(panel.title, part, _places(part, own)), said)

    return replace(panel, at={**own, **where}, title=title, when=None)


def draw(panel: Panel, dataset: xr.Dataset, axes: Axes) -> None:
    """Draw all of a panel that does not depend on others."""
    part = _part(panel, dataset)
    places = "" if panel.as_marked else _places(part, panel.at)
    if panel.x and (panel.y in part if isinstance(panel.y, str) else panel.y):
        values = [_curve(panel, row, axes, style) for row, style in rows(panel, part)]
        _name_second(panel, part, axes)
        _scales(panel, part, axes, np.concatenate(values))
    for mark in panel.marks:
        mark(part, axes)
    for which, limits in (("x", panel.x_limits), ("y", panel.y_limits)):
        if any(end is not None for end in limits):
            getattr(axes, f"set_{which}lim")(*limits)
        if which == "y" and limits[1] is None is not limits[0]:
            top = float(axes.dataLim.ymax)  # what lies highest is seen whole
            axes.set_ylim(top=max(axes.get_ylim()[1], top + 0.05 * (top - limits[0])))
    across, up = room(axes)
    if label := _label(panel.x, panel.x_label, part, across - _LETTER):
        axes.set_xlabel(label)
    if label := _label(panel.y, panel.y_label, part, up):
        axes.set_ylabel(label)
    title = ", ".join(filter(None, [axes.get_title(), _text(panel.title, part, places)]))
    axes.set_title(wrapped(title, across - _LETTER))


def settle(panels: Sequence[Panel], axes_of: Sequence[Axes]) -> None:
    """Have panels that are to be alike the same scales along y and of colours, and then numbers and
    legends.
    """
    pairs = [(p, axes) for p, axes in zip(panels, axes_of, strict=True) if not p.as_marked]
    for name in {panel.alike for panel, _axes in pairs if panel.alike}:
        group = [axes for panel, axes in pairs if panel.alike == name and axes.has_data()]
        ends = [end for axes in group for end in axes.get_ylim()]
        for axes in group:
            axes.set_ylim(min(ends), max(ends))
        maps = [drawn for axes in group for drawn in axes.collections if drawn.colorbar]
        for drawn in maps:
            drawn.set_clim(min(m.get_clim()[0] for m in maps), max(m.get_clim()[1] for m in maps))
    for panel, axes in pairs:
        for which in "xy":
            if getattr(axes, f"get_{which}scale")() == "log":
                log_scale(axes, which)
        legend(axes, panel.columns, panel.legend_title)


def rows(panel: Panel, part: xr.Dataset) -> Iterator[tuple[xr.Dataset, dict[str, Any]]]:
    """Each curve of a panel, and how it is drawn."""
    several = [d for d in panel.by if part.sizes[d] > 1]
    shades = None if callable(panel.style) or not panel.by else _shades(part, panel.by[0])
    named = [d for d in panel.by if shades is None or d != panel.by[0]]
    for at in np.ndindex(*(part.sizes[d] for d in panel.by)):
        row = part.isel(dict(zip(panel.by, at, strict=True)))
        number = at[0] if at else 0
        style = look(number) | {"marker": marker(number)}
        if shades is not None:
            style |= {"color": shades[number], "linestyle": "-"}
        if panel.by[1:] and panel.by[1] in several:
            style |= _second(at[1])
        style["label"] = _name(panel, row, named[:1] if len(several) > 1 else named)
        own = panel.style
        yield row, style | dict(own(row) if callable(own) else own)


def _second(number: int) -> dict[str, str]:
    """Dashes and markers of a point of the second axis of `by`."""
    line, fill = _SECOND[number % len(_SECOND)]
    return {"linestyle": line, "fillstyle": fill}


def _name_second(panel: Panel, part: xr.Dataset, axes: Axes) -> None:
    """Say what dashes and open markers stand for, where colours stand for something else."""
    if panel.name is None and len([d for d in panel.by if part.sizes[d] > 1]) > 1:
        second = panel.by[1]
        shades = not callable(panel.style) and _shades(part, panel.by[0]) is not None
        own = {} if callable(panel.style) else dict(panel.style)
        line = {"linestyle": "none"} if panel.points else {}
        for number in range(part.sizes[second] if not shades else 0):
            style = {"marker": "o"} | _second(number) | own | line
            in_grey(axes, place(part.isel({second: number}), second), style)


def _shades(part: xr.Dataset, dimension: str) -> np.ndarray | None:
    """Colours of a scale for the points of a long axis of numbers."""
    long = part.sizes[dimension] > _SCALE and is_numeric(part, dimension)
    return colours(part, dimension) if long else None


def _name(panel: Panel, row: xr.Dataset, by: Sequence[str]) -> str | None:
    name = pretty(panel.name(row)) if panel.name else ", ".join(place(row, d) for d in by) or None
    if name is None or not np.isfinite(row.get(f"{panel.says}_stderr", np.nan)):
        return name
    symbol = quantity(panel.says, stated_by(row)).symbol
    slope = f"{symbol} = {slope_with_error(row, panel.says, _DIGITS)}".removeprefix(" = ")
    return f"{name}: {slope.replace('$ = $', ' = ')}"  # a formula is never broken


def _curve(panel: Panel, row: xr.Dataset, axes: Axes, style: dict[str, Any]) -> np.ndarray:
    """Draw one curve, and give its values."""
    values = _values(panel.x, row), _values(panel.y, row)
    named = [found.dtype.kind not in "fiu" for found in values]
    x, y = (
        np.arange(found.size) if by_name else np.asarray(found, dtype=float)
        for found, by_name in zip(values, named, strict=True)
    )
    style = style | ({"linestyle": "none"} if any(named) else {})
    if y.size > _DENSE and not panel.points:
        style = style | {"marker": ""}
    if np.isfinite(y).sum() == 1 and not style["marker"]:
        style = style | {"marker": "o"}  # a line of one point is not seen
    points = {"linestyle": "none"} if panel.points or panel.through else {}
    axes.plot(x, y, **style | points)
    if panel.through and np.isfinite(line := np.broadcast_arrays(*panel.through(row))).any():
        # its legend has the marker, too
        axes.plot(*line, **style | {"linewidth": 0.9, "markevery": []})
    if panel.error:
        bars = {"fmt": "none", "ecolor": style["color"], "elinewidth": 0.8, "capsize": 3}
        axes.errorbar(x, y, _values(panel.error, row), **bars)
    return y


def _values(what: Any, row: xr.Dataset) -> np.ndarray:
    return np.atleast_1d(np.asarray(what(row) if callable(what) else row[what]))


def _numbers(points: xr.DataArray, at: Any) -> Any:
    """Numbers of points: of the lowest, for `min`; each once."""
    if callable(at):
        values, wanted = points.values.tolist(), at(points.values.tolist())
        at = [values.index(v) for v in wanted] if isinstance(wanted, list) else values.index(wanted)
    return list(dict.fromkeys(n % points.size for n in at)) if isinstance(at, list) else at


def _scales(panel: Panel, part: xr.Dataset, axes: Axes, values: np.ndarray) -> None:
    named = isinstance(panel.x, str) and part[panel.x].dtype.kind not in "fiu"
    if named:
        axis_of(axes, part, str(panel.x))
    if isinstance(panel.y, str) and part[panel.y].dtype.kind in "OU":
        name_rows(axes, list(map(str, part[panel.y].values)))
    log = panel.log
    if log is None:
        along = isinstance(panel.x, str) and panel.x in part.coords and not named
        log = "x" * (along and is_log_spaced(part[panel.x].values)) + "y" * is_wide(values)
    positive = {"x": axes.dataLim.minposx, "y": axes.dataLim.minposy}
    axes.set(**{f"{which}scale": "log" for which in log if math.isfinite(positive[which])})
    first = next(iter(panel.by), "")
    if first and not callable(panel.style) and _shades(part, first) is not None:
        colour_bar(part, axes, first)


def _label(what: Any, said: Any, part: xr.Dataset, width: int) -> str:
    if said is not None:
        return wrapped(_text(said, part, ""), width)
    return (
        labelled(quantity(what, stated_by(part)), width) if isinstance(what, str) and what else ""
    )


def _text(said: Any, part: xr.Dataset, otherwise: str) -> str:
    """Text that a panel states, or else another."""
    if said is None:
        return otherwise
    return str(said(part) if callable(said) else said)


def _places(part: xr.Dataset, at: Mapping[str, Any]) -> str:
    """Place of a panel on the axes that it shows one point of, as a title."""
    return _sentence(*(place(part, dimension) for dimension in at if part[dimension].ndim == 0))


def _sentence(*parts: str) -> str:
    """Parts one after the other, with a capital letter; empty ones are left out."""
    text = ", ".join(filter(None, parts))
    return f"{text[:1].upper()}{text[1:]}"
