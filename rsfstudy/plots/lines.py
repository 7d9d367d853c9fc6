"""Any lattice: what was measured against an axis, one line for each point of the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from rsfstudy.files.contents import declaration
from rsfstudy.plots import Panel
from rsfstudy.plots._axes import (
    axis_of,
    is_log_spaced,
    is_number,
    is_numeric,
    is_wide,
    log_scale,
    place,
    varied,
)
from rsfstudy.plots._style import legend, look, marker
from rsfstudy.plots._text import label, pretty, wrapped
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Most panels, and most lines that a legend names; lines along a longer axis of numbers are told
#: apart by a scale of colours.
_PANELS, _NAMED, _COLOURED = 4, 24, 6
#: Most points of a line with markers.
_MARKED = 60


def panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """One panel for each variable that was measured, or one for that which is named; none where
    that is no number.
    """
    if variable is None:
        names = varied(dataset)[:_PANELS] or [str(next(iter(dataset.data_vars)))]
    else:
        names = [variable] if variable in dataset and is_number(dataset[variable]) else []
    named = len(names) == 1 and not declaration(dataset).overrides
    return [_panel(name, dataset.attrs.get("title", "") if named else "") for name in names]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first variable that was measured."""
    return panels(dataset)[0](dataset, axes)


def _panel(name: str, title: str) -> Panel:
    def panel(dataset: xr.Dataset, axes: Axes) -> Axes:
        _lines(dataset, axes, name)
        axes.set_title(wrapped(pretty(title), 48))
        return axes

    return panel


def _lines(dataset: xr.Dataset, axes: Axes, name: str) -> None:
    values = dataset[name].squeeze()
    if values.ndim == 0:
        values = values.expand_dims(dataset[name].dims[-1:] or "point")
        dataset = dataset if dataset[name].dims else dataset.assign_coords(point=[name])
    along = _along(dataset, values)
    x = axis_of(axes, dataset, along)
    coloured = _coloured(dataset, values, along)
    others = [str(d) for d in values.dims if d not in (along, coloured)]
    curves = _different(list(_points(values, others)), others)
    for number, (group, text) in enumerate(curves):
        style = look(number) | {"label": text if number < _NAMED and text else None}
        style["marker"] = marker(number) if x.size <= _MARKED else ""
        if not is_numeric(dataset, along):
            style |= {"linestyle": "none", "marker": marker(number)}
        if coloured is None:
            axes.plot(x, group.values, **style)
            continue
        for row, colour in _scaled(dataset, group, coloured):
            axes.plot(x, row.values, **style | {"color": colour})
            style["label"] = None
    if coloured is not None:
        _scale_beside(dataset, axes, coloured)
    if is_numeric(dataset, along) and is_log_spaced(x):
        log_scale(axes, "x")
    if is_wide(np.asarray(values.values, dtype=float)):
        log_scale(axes, "y")
    axes.set_ylabel(label(quantity(name, stated_by(dataset)), 34))
    count = len(curves)
    legend(axes, 2, f"the first {_NAMED} of {count}" if count > _NAMED else None)


def _along(dataset: xr.Dataset, values: xr.DataArray) -> str:
    """The axis of x: the longest of numbers, or the last."""
    names = [str(dimension) for dimension in values.dims]
    numeric = [name for name in names if name in dataset.coords and is_numeric(dataset, name)]
    return max(reversed(numeric), key=lambda name: values.sizes[name]) if numeric else names[-1]


def _coloured(dataset: xr.Dataset, values: xr.DataArray, along: str) -> str | None:
    """The axis whose points a scale of colours tells apart: one of many numbers."""
    numeric = [str(d) for d in values.dims if d != along and is_numeric(dataset, str(d))]
    long = [name for name in numeric if values.sizes[name] > _COLOURED]
    return max(long, key=lambda name: values.sizes[name]) if long else None


def _points(values: xr.DataArray, dimensions: Sequence[str]) -> Iterator[xr.DataArray]:
    """The values at each point of some dimensions."""
    for places in np.ndindex(*(values.sizes[d] for d in dimensions)):
        yield values.isel(dict(zip(dimensions, places, strict=True)))


def _different(
    groups: Sequence[xr.DataArray], dimensions: Sequence[str]
) -> list[tuple[xr.DataArray, str]]:
    """Curves that differ, each with what all of its places have in common, in words."""
    alike: dict[bytes, list[xr.DataArray]] = {}
    for group in groups:
        if bool(np.isfinite(group).any()):
            alike.setdefault(group.values.tobytes(), []).append(group)
    common = {
        first: [d for d in dimensions if len({str(group[d].item()) for group in same}) == 1]
        for first, same in alike.items()
    }
    return [
        (same[0], ", ".join(place(same[0], d) for d in common[first]))
        for first, same in alike.items()
    ]


def _scale(dataset: xr.Dataset, dimension: str) -> ScalarMappable:
    """Colours for the points of an axis."""
    points = dataset[dimension].values.astype(float)
    kind = LogNorm if is_log_spaced(points) else Normalize
    return ScalarMappable(kind(points.min(), points.max()), colormaps["viridis"])


def _scaled(
    dataset: xr.Dataset, group: xr.DataArray, dimension: str
) -> Iterator[tuple[xr.DataArray, Any]]:
    """The values at each point of an axis, with its colour."""
    colours = _scale(dataset, dimension).to_rgba(dataset[dimension].values.astype(float))
    return zip(_points(group, [dimension]), colours, strict=True)


def _scale_beside(dataset: xr.Dataset, axes: Axes, dimension: str) -> None:
    scale = _scale(dataset, dimension)
    bar = cast(Figure, axes.figure).colorbar(scale, ax=axes, pad=0.02)
    bar.set_label(label(quantity(dimension, stated_by(dataset)), 34))
