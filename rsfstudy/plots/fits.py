"""Fits of records: the record with its curves, what they leave, and how parameters go together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from rsfstudy.declare.figure import Panel
from rsfstudy.plots._axes import place
from rsfstudy.plots._style import look
from rsfstudy.plots._text import symbol
from rsfstudy.vocabulary import quantity

#: Lags of the autocorrelation, most rows of a record that are drawn, and how correlations read.
_LAGS, _ROWS, _DIGITS = 40, 20_000, 2


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """The record with every fit; and of the first step, what is left, and correlations."""
    first = dataset.isel({d: 0 for d in dataset["rows_fitted"].dims if d not in ("law",)})
    one = first.isel(law=0) if "law" in first.dims else first
    law = f" ({place(one, 'law')})" if "law" in one.coords else ""
    displacement = "Load point displacement (um)"
    return (
        Panel(marks=[_record], x_label=displacement, y_label="Friction coefficient"),
        Panel(
            marks=[partial(_residuals, first)],
            x_label=displacement,
            y_label="Friction less that of the fit",
        ),
        Panel(
            marks=[partial(_autocorrelation, first)],
            x_label="Lag (rows)",
            y_label="Autocorrelation of residuals",
        ),
        Panel(marks=[partial(_correlation, one)], title=f"Correlation of parameters{law}"),
    )


def _each(dataset: xr.Dataset) -> Iterator[tuple[xr.Dataset, str, int]]:
    """Each fit, its name and number."""
    dims = [str(d) for d in dataset["rows_fitted"].dims]
    for number, at in enumerate(np.ndindex(*(dataset.sizes[d] for d in dims))):
        one = dataset.isel(dict(zip(dims, at, strict=True)))
        yield one, ", ".join(place(one, d) for d in dims), number


def _rows(one: xr.Dataset, names: Sequence[str]) -> list[np.ndarray]:
    """Columns of the rows that hold numbers, thinned."""
    columns = np.array([one[name].values for name in names])
    columns = columns[:, np.isfinite(columns).all(axis=0)]
    return list(columns[:, :: max(1, columns.shape[1] // _ROWS)])


def _record(dataset: xr.Dataset, axes: Axes) -> None:
    told: set[bytes] = set()
    for one, name, number in _each(dataset):
        x, y = _rows(one, ("record_displacement", "record_friction"))
        if len(x) and y.tobytes() not in told:
            axes.plot(x, y, ".", color="0.7", markersize=2, zorder=0)
            told.add(y.tobytes())
        x, y, error = _rows(
            one, ("record_displacement", "fitted_friction", "fitted_friction_stderr")
        )
        style = look(number)
        axes.plot(x, y, **style | {"label": name, "marker": ""})
        axes.fill_between(
            x, y - 2.0 * error, y + 2.0 * error, color=style["color"], alpha=0.3, lw=0
        )


def _residuals(first: xr.Dataset, _dataset: xr.Dataset, axes: Axes) -> None:
    axes.axhline(0.0, color="0.6", lw=0.8)
    for one, name, number in _each(first):
        x, y = _rows(one, ("record_displacement", "residual"))
        style = look(number) | {"label": name, "marker": "", "linestyle": "-", "linewidth": 0.6}
        axes.plot(x, y, **style)


def _autocorrelation(first: xr.Dataset, _dataset: xr.Dataset, axes: Axes) -> None:
    axes.axhline(0.0, color="0.6", lw=0.8)
    for one, name, number in _each(first):
        left, freed = _rows(one, ("residual", "innovation"))
        if len(left) <= _LAGS:
            continue
        color = look(number)["color"]
        axes.plot(_correlated(left), color=color, marker="", linestyle="-", label=name)
        axes.plot(
            _correlated(freed), color=color, marker="", linestyle="--", label=f"{name}, freed"
        )
        chance = 2.0 / len(left) ** 0.5
        axes.axhspan(-chance, chance, color="0.9", zorder=0)


def _correlated(values: np.ndarray) -> np.ndarray:
    seen = values - values.mean()
    size = float(seen @ seen) or 1.0
    return np.array([1.0, *(seen[lag:] @ seen[:-lag] / size for lag in range(1, _LAGS + 1))])


def _correlation(one: xr.Dataset, _dataset: xr.Dataset, axes: Axes) -> None:
    names = [symbol(quantity(str(name), {})) or str(name) for name in one["parameter"].values]
    values = one["correlation"].values
    axes.imshow(values, vmin=-1.0, vmax=1.0, cmap="RdBu_r")
    places = range(len(names))
    axes.set_xticks(places, names)
    axes.set_yticks(places, names)
    for row in places:
        for column in places:
            value = values[row, column]
            shade = "white" if abs(value) > 0.6 else "black"
            axes.text(column, row, f"{value:.{_DIGITS}f}", ha="center", va="center", color=shade)
