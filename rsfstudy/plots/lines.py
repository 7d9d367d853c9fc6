"""Any lattice: what was measured against an axis, one line for each point of the others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.declare.figure import Panel
from rsfstudy.files.contents import declaration
from rsfstudy.plots._axes import (
    axis_of,
    colour_bar,
    colours,
    flag_meanings,
    is_log_spaced,
    is_number,
    is_numeric,
    is_wide,
    place,
    varied,
)
from rsfstudy.plots._style import in_grey, look, marker
from rsfstudy.plots._text import label, pretty
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Most panels, and most lines that a legend names; lines along a longer axis of numbers are told
#: apart by a scale of colours.
_PANELS, _NAMED, _COLOURED = 4, 12, 6
#: Most curves that lie on each other and are all named.
_FEW = 3
#: Most points of a line with markers.
_MARKED = 60


def panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """One panel for each variable that was measured, or one for that which is named; none where
    that is no number.
    """
    if variable is None:
        names = varied(dataset)[:_PANELS] or ["status"]
    else:
        known = variable in dataset
        drawn = known and (is_number(dataset[variable]) or flag_meanings(dataset[variable]))
        names = [variable] if drawn else []
    named = len(names) == 1 and not declaration(dataset).overrides
    return [
        _panel(dataset, name, dataset.attrs.get("title", "") if named else "") for name in names
    ]


def _panel(dataset: xr.Dataset, name: str, title: str) -> Panel:
    """All values of a variable."""
    along = _along(dataset, dataset[name]) if dataset[name].ndim else ""
    return Panel(
        x=along,
        marks=[partial(_lines, name, along)],
        y_label=label(quantity(name, stated_by(dataset)), 200),
        title=pretty(title),
    )


def _lines(name: str, along: str, dataset: xr.Dataset, axes: Axes) -> None:
    values = dataset[name]
    if told := flag_meanings(values):
        flags, places = np.unique(values.values, return_inverse=True)
        values = values.copy(data=np.reshape(places, values.shape).astype(float))
        axes.set_yticks(range(flags.size), [told[flag] for flag in flags.tolist()])
        axes.set_ylim(-0.5, flags.size - 0.5)
    x = axis_of(axes, dataset, along) if along else np.zeros(1)
    numeric = bool(along) and is_numeric(dataset, along)
    coloured = _coloured(dataset, values, along)
    others = [str(d) for d in values.dims if d not in (along, coloured)]
    curves = _different(list(_points(values, others)), others)
    for number, (group, text) in enumerate(curves):
        style = look(number) | {"label": text if number < _NAMED and text else None}
        style["marker"] = marker(number) if x.size <= _MARKED or not numeric else ""
        style |= {} if numeric else {"linestyle": "none"}
        if coloured is None:
            axes.plot(x, np.atleast_1d(group.values), **style)
            continue
        shades = colours(dataset, coloured)
        for row, colour in zip(_points(group, [coloured]), shades, strict=True):
            axes.plot(x, row.values, **style | {"color": colour})
            style["label"] = None
    if coloured is not None:
        colour_bar(dataset, axes, coloured)
    if numeric and is_log_spaced(x):
        axes.set_xscale("log")
    if is_wide(np.asarray(values.values, dtype=float)):
        axes.set_yscale("log")
    if len(curves) > _NAMED:
        in_grey(axes, f"the first {_NAMED} of {len(curves)}", {"linestyle": "none"})


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
    several = [d for d in dimensions if len({str(group[d].item()) for group in groups}) > 1]
    return [(same[0], ", ".join(_named(same, several))) for same in alike.values()]


def _named(same: Sequence[xr.DataArray], dimensions: Sequence[str]) -> tuple[str, ...]:
    """Places of curves that lie on each other: what they have in common, or else all of the two or
    three that there are, or the first.
    """
    places = [list(dict.fromkeys(place(group, d) for group in same)) for d in dimensions]
    if not places or any(len(names) == 1 for names in places):
        return tuple(names[0] for names in places if len(names) == 1)
    every = [", ".join(place(one, d) for d in dimensions) for one in same]
    if len(every) <= _FEW:
        return (" and ".join(every),)
    return (f"{every[0]} and {len(every) - 1} more",)
