"""Any lattice with two axes of numbers: a map of a variable for each point of the other axes, in
colours with contours; cells that end without a number are hatched, and named.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator

from rsfstudy.plots import Panel
from rsfstudy.plots._axes import (
    axis_of,
    is_log_spaced,
    is_number,
    is_numeric,
    is_wide,
    log_scale,
    measured,
    place,
)
from rsfstudy.plots._map import colours, contours, edges, statuses
from rsfstudy.plots._style import legend
from rsfstudy.plots._text import label, pretty, wrapped
from rsfstudy.reduce.base import stated_by
from rsfstudy.vocabulary import quantity

#: Fewest points of an axis of a map, and most maps.
_FEWEST, _MOST = 3, 12


def panels(dataset: xr.Dataset, variable: str | None = None) -> Sequence[Panel]:
    """A map of what is named, or of the headline, for each point of the axes that it has beside
    the two; none where there are no two.
    """
    names = measured(dataset)[:1] if variable is None else [variable]
    if not names or names[0] not in dataset or not is_number(dataset[names[0]]):
        return []
    values = dataset[names[0]]
    plane, cells = _plane(dataset, values), dataset["status"].dims
    if plane is None or not set(values.dims) <= set(cells):
        return []
    others = [d for d in values.dims if d not in plane]
    places = list(np.ndindex(*(values.sizes[d] for d in others)))[:_MOST]
    return [_panel(names[0], plane, dict(zip(others, at, strict=True))) for at in places]


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """The first map."""
    return panels(dataset)[0](dataset, axes)


def _plane(dataset: xr.Dataset, values: xr.DataArray) -> tuple[str, str] | None:
    """The axes of y and x: the last two of numbers."""
    numeric = [
        str(dimension)
        for dimension in values.dims
        if dataset.sizes[dimension] >= _FEWEST and is_numeric(dataset, str(dimension))
    ]
    return (numeric[-2], numeric[-1]) if len(numeric) > 1 else None


def _panel(name: str, plane: tuple[str, str], where: dict[Any, int]) -> Panel:
    return lambda dataset, axes: _map(dataset, axes, name, plane, where)


def _map(
    dataset: xr.Dataset, axes: Axes, name: str, plane: tuple[str, str], where: dict[Any, int]
) -> Axes:
    here = dataset.isel(where)
    values = here[name].astype(float).transpose(*plane).sortby(list(plane))
    here, everywhere = here.sortby(list(plane)), dataset[name].values.astype(float)
    y, x = (values[dimension].values.astype(float) for dimension in plane)
    at = edges(x, is_log_spaced(x)), edges(y, is_log_spaced(y))
    axes.set(xlim=(at[0][0], at[0][-1]), ylim=(at[1][0], at[1][-1]))
    for which, points in (("x", x), ("y", y)):
        if is_log_spaced(points):
            log_scale(axes, which)
    if np.isfinite(everywhere).any():
        norm, levels = _scale(everywhere)
        drawn = colours(axes, at, values.values, norm=norm)
        bar = cast(Figure, axes.figure).colorbar(drawn, ax=axes, pad=0.02)
        bar.set_label(label(quantity(name, stated_by(dataset)), 34))
        contours(axes, values, levels)
    status = here["status"].squeeze()
    if set(status.dims) == set(plane):
        unknown = ~np.isfinite(values.values)
        statuses(axes, at, status.transpose(*plane).values, unknown)
    axis_of(axes, dataset, plane[1], 40)
    axes.set_ylabel(label(quantity(plane[0], stated_by(dataset)), 34))
    title = ", ".join(place(here, str(d)) for d in where if dataset.sizes[d] > 1)
    axes.set_title(wrapped(title or pretty(dataset.attrs.get("title", "")), 44))
    legend(axes)
    return axes


def _scale(values: np.ndarray) -> tuple[Normalize, Sequence[float]]:
    """A scale of colours, the same in all maps, and where contours are on it."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if is_wide(values):
        subs = (1.0, 3.0) if high < 1e4 * low else (1.0,)
        return LogNorm(low, high), LogLocator(subs=subs).tick_values(low, high)
    return Normalize(low, high), MaxNLocator(8).tick_values(low, high)
