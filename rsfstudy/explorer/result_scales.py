"""Scales, colours and tick labels of the Bokeh figures of results."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from bokeh.models import FixedTicker, LinearColorMapper, LogColorMapper
from bokeh.palettes import Viridis256

from rsfstudy.formatting import read_flag_meanings
from rsfstudy.plots import are_log_spaced, are_positive_and_span_decades

#: Number of curves above which a numeric colour dimension has a colour scale.
_MAX_CURVES_WITH_NAMES = 7
#: Palette of Okabe and Ito for variables with flags.
_FLAG_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#F0E442", "#D55E00")


def is_numeric(values: xr.DataArray) -> bool:
    """Return True if values are numbers."""
    return values.dtype.kind in "iuf"


def is_log_axis(dataset: xr.Dataset, name: str) -> bool:
    """Return True if the values of a coordinate are spaced logarithmically."""
    values = dataset[name]
    return is_numeric(values) and values.ndim == 1 and are_log_spaced(values.values)


def colour_scale(dataset: xr.Dataset, dimension: str) -> Any:
    """Return the colour mapper of a numeric dimension with many points, or None."""
    if not dimension or not is_numeric(dataset[dimension]):
        return None
    points = dataset[dimension].values.astype(float)
    if points.size <= _MAX_CURVES_WITH_NAMES:
        return None
    kind = LogColorMapper if are_log_spaced(points) else LinearColorMapper
    return kind(palette=Viridis256, low=float(points.min()), high=float(points.max()))


def map_colour(mapper: Any, value: float) -> str:
    """Return the colour of a value."""
    low, high = mapper.low, mapper.high
    if isinstance(mapper, LogColorMapper):
        low, high, value = np.log(low), np.log(high), np.log(value)
    return str(Viridis256[round(255 * (value - low) / (high - low))])


def value_mapper(values: np.ndarray, flags: dict[float, str]) -> Any:
    """Return the colour mapper of the values of a map."""
    clear: Any = {"nan_color": (0, 0, 0, 0)}
    if flags:
        palette = [_FLAG_COLOURS[i % len(_FLAG_COLOURS)] for i in range(len(flags))]
        return LinearColorMapper(palette=palette, low=-0.5, high=len(flags) - 0.5, **clear)
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    high = high if high > low else low + (abs(low) or 1.0)
    kind = LogColorMapper if are_positive_and_span_decades(values) else LinearColorMapper
    return kind(palette=Viridis256, low=low, high=high, **clear)


def flag_names(dataset: xr.Dataset, variable: str) -> dict[float, str]:
    """Return the meanings of the flags that occur in a variable."""
    meanings = read_flag_meanings(dataset[variable].attrs)
    present = {*np.unique(dataset[variable].values).tolist()} if meanings else set()
    return {code: text.replace("_", " ") for code, text in meanings.items() if code in present}


def label_ticks(axis: Any, names: dict[Any, str]) -> None:
    """Use the names of points as tick labels, if the points have names."""
    if names:
        axis.ticker, axis.major_label_overrides = ticks(names)


def ticks(names: dict[Any, str]) -> tuple[FixedTicker, dict[Any, str]]:
    """Return the ticker and the tick labels of named values."""
    return FixedTicker(ticks=list(names)), {int(value): name for value, name in names.items()}
