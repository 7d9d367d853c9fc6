"""Functions that choose the scales, colours and tick labels of Bokeh figures."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from bokeh.models import FixedTicker, LinearColorMapper, LogColorMapper
from bokeh.palettes import Viridis256

from rsfstudy.formatting import read_flag_meanings
from rsfstudy.plots import are_log_spaced, are_positive_and_span_decades

#: Number of curves above which a numeric colour dimension has a colour scale.
_MAX_CURVES_WITHOUT_COLOUR_SCALE = 7
#: Palette of Okabe and Ito for variables with flags.
_COLOURS_OF_FLAG_VALUES = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    "#F0E442",
    "#D55E00",
)


def has_numeric_dtype(values: xr.DataArray) -> bool:
    """Return True if values are numbers."""
    return values.dtype.kind in "iuf"


def is_log_spaced_coordinate(dataset: xr.Dataset, coordinate_name: str) -> bool:
    """Return True if the values of a coordinate are spaced logarithmically."""
    values = dataset[coordinate_name]
    return has_numeric_dtype(values) and values.ndim == 1 and are_log_spaced(values.values)


def build_colour_mapper_of_dimension(dataset: xr.Dataset, dimension: str) -> Any:
    """Return the colour mapper of a numeric dimension with many points, or None."""
    if not dimension or not has_numeric_dtype(dataset[dimension]):
        return None
    points = dataset[dimension].values.astype(float)
    if points.size <= _MAX_CURVES_WITHOUT_COLOUR_SCALE:
        return None
    kind = LogColorMapper if are_log_spaced(points) else LinearColorMapper
    return kind(palette=Viridis256, low=float(points.min()), high=float(points.max()))


def find_colour_of_value(colour_mapper: Any, value: float) -> str:
    """Return the colour of a value."""
    low, high = colour_mapper.low, colour_mapper.high
    if isinstance(colour_mapper, LogColorMapper):
        low, high, value = np.log(low), np.log(high), np.log(value)
    return str(Viridis256[round(255 * (value - low) / (high - low))])


def build_colour_mapper_of_map(map_values: np.ndarray, flag_names_by_code: dict[float, str]) -> Any:
    """Return the colour mapper of the values of a map."""
    clear: Any = {"nan_color": (0, 0, 0, 0)}
    if flag_names_by_code:
        palette = [
            _COLOURS_OF_FLAG_VALUES[i % len(_COLOURS_OF_FLAG_VALUES)]
            for i in range(len(flag_names_by_code))
        ]
        return LinearColorMapper(
            palette=palette, low=-0.5, high=len(flag_names_by_code) - 0.5, **clear
        )
    finite = map_values[np.isfinite(map_values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    high = high if high > low else low + (abs(low) or 1.0)
    kind = LogColorMapper if are_positive_and_span_decades(map_values) else LinearColorMapper
    return kind(palette=Viridis256, low=low, high=high, **clear)


def find_used_flag_names(dataset: xr.Dataset, variable_name: str) -> dict[float, str]:
    """Return the meanings of the flags that occur in a variable."""
    meanings = read_flag_meanings(dataset[variable_name].attrs)
    present = {*np.unique(dataset[variable_name].values).tolist()} if meanings else set()
    return {code: text.replace("_", " ") for code, text in meanings.items() if code in present}


def set_tick_labels(axis: Any, label_by_value: dict[Any, str]) -> None:
    """Use the names of points as tick labels, if the points have names."""
    if label_by_value:
        axis.ticker, axis.major_label_overrides = build_ticker_and_labels(label_by_value)


def build_ticker_and_labels(label_by_value: dict[Any, str]) -> tuple[FixedTicker, dict[Any, str]]:
    """Return the ticker and the tick labels of an axis whose values have names."""
    return FixedTicker(ticks=list(label_by_value)), {
        int(value): name for value, name in label_by_value.items()
    }
