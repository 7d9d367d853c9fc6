"""Fits of records: each record with its curves, what they leave, and how parameters go together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.text import Text

from rsfstudy.analysis.fitting.joint import parted
from rsfstudy.analysis.fitting.model import PARAMETERS
from rsfstudy.declare.figure import Panel
from rsfstudy.plots._axes import place
from rsfstudy.plots._style import in_grey, look

#: Lags of the autocorrelation, most rows of a record that are drawn, and most records with a panel.
_LAGS, _ROWS, _RECORDS = 40, 20_000, 4
#: Part of the windows that is drawn beside them, and of a window that residuals are averaged over.
_BESIDE, _AVERAGED = 0.15, 0.02
#: Standard errors that the band is wide to each side.
_BAND = 2.0
_POINTS: dict[str, Any] = {
    "color": "0.7",
    "markersize": 1.5,
    "linestyle": "none",
    "marker": ".",
    "zorder": 1,
}
_DISPLACEMENT = r"Load point displacement ($\mu$m)"


def panels(dataset: xr.Dataset) -> Sequence[Panel]:
    """Each record with its fits; and of the first one, what is left, and correlations."""
    records = dataset.sizes.get("record", 1)
    part, record = ([d] if d in dataset.dims else [] for d in ("part", "record"))
    named = Panel(title=partial(_named, records), x_label=_DISPLACEMENT)
    of_record = [
        replace(
            named,
            at=dict.fromkeys(part, 0) | dict.fromkeys(record, number),
            marks=[_record],
            y_label="Friction coefficient",
        )
        for number in range(min(records, _RECORDS))
    ]
    first = replace(named, at=of_record[0].at)
    return (
        *of_record,
        replace(first, marks=[_residuals], y_label="Residual friction"),
        replace(
            first,
            marks=[_autocorrelation],
            title=_step,
            x_label="Lag (rows)",
            y_label="Autocorrelation of residuals",
        ),
        Panel(at=first.at, marks=[_correlation], title=_whose),
    )


def _named(records: int, dataset: xr.Dataset) -> str:
    """The record, where there are several."""
    if records == 1:
        return ""
    return f"{dataset['record'].item()}{f' (of {records})' * (records > _RECORDS)}"


def _step(dataset: xr.Dataset) -> str:
    return f"Step {dataset['step'].values[0]:g}" if "step" in dataset.dims else ""


def _each(dataset: xr.Dataset, *, first: bool = False) -> Iterator[tuple[xr.Dataset, str, int]]:
    """Each fit, its law, and the number of that; those of the first step, or of all."""
    steps = range(1 if first else dataset.sizes.get("step", 1))
    for number in range(dataset.sizes["law"]):
        for step in steps:
            one = dataset.isel(
                {d: n for d, n in (("law", number), ("step", step)) if d in dataset.dims}
            )
            yield one, place(one, "law"), number


def _rows(one: xr.Dataset, names: Sequence[str]) -> list[np.ndarray]:
    """Columns of the rows that hold numbers, thinned."""
    columns = np.array([one[name].values for name in names])
    columns = columns[:, np.isfinite(columns).all(axis=0)]
    return list(columns[:, :: max(1, columns.shape[1] // _ROWS)])


def _pieces(one: xr.Dataset, names: Sequence[str]) -> Iterator[list[np.ndarray]]:
    """Columns of each window: a run of rows of one record that hold numbers."""
    rows = np.flatnonzero(one[names[-1]].notnull().values)
    late = np.diff(one["record_time"].values[rows]) > 0.0
    for part in np.split(rows, np.flatnonzero((np.diff(rows) > 1) | ~late) + 1):
        if len(part):
            yield _rows(one.isel(row=part), names)


def _record(dataset: xr.Dataset, axes: Axes) -> None:
    windows = []
    for number, (one, name, law) in enumerate(_each(dataset)):
        if not number:
            record = _rows(one, ("record_displacement", "record_friction"))
            axes.plot(*record, label="record", **_POINTS)
        names = "record_displacement", "fitted_friction", "fitted_friction_stderr"
        style = look(law) | {"marker": "", "label": name, "linewidth": 1.2, "zorder": 3}
        for x, y, error in _pieces(one, names):
            if not law:
                axes.axvspan(x[0], x[-1], color="0.94", lw=0, zorder=0, label="what is fitted")
            windows += [x[0], x[-1]]
            band = {"color": style["color"], "alpha": 0.3, "lw": 0, "zorder": 2}
            said = f"within {_BAND:g} standard errors"
            axes.fill_between(x, y - _BAND * error, y + _BAND * error, label=said, **band)
            axes.plot(x, y, **style)
    if windows:
        beside = _BESIDE * (max(windows) - min(windows))
        axes.set_xlim(min(windows) - beside, max(windows) + beside)


def _residuals(dataset: xr.Dataset, axes: Axes) -> None:
    axes.axhline(0.0, color="0.5", lw=0.8, zorder=2)
    for one, name, law in _each(dataset):
        style = look(law) | {"label": name, "marker": "", "linewidth": 1.0, "zorder": 3}
        for x, y in _pieces(one, ("record_displacement", "residual")):
            if not law:
                axes.plot(x, y, label=f"each row, {name}", **_POINTS)
            count = max(1, round(_AVERAGED * len(x)))
            mean = np.ones(count) / count
            axes.plot(np.convolve(x, mean, "valid"), np.convolve(y, mean, "valid"), **style)


def _autocorrelation(dataset: xr.Dataset, axes: Axes) -> None:
    axes.axhline(0.0, color="0.5", lw=0.8)
    for one, name, law in _each(dataset, first=True):
        left, freed = _rows(one, ("residual", "innovation"))
        if len(left) <= _LAGS:
            continue
        style = look(law) | {"marker": ""}
        axes.plot(_correlated(left), **style | {"label": name})
        axes.plot(_correlated(freed), **style | {"linestyle": ":"})
        chance = 2.0 / len(left) ** 0.5
        if not law:
            axes.axhspan(-chance, chance, color="0.9", lw=0, zorder=0, label="white noise (95 %)")
    in_grey(axes, "freed of correlation", {"linestyle": ":"})


def _correlated(values: np.ndarray) -> np.ndarray:
    seen = values - values.mean()
    size = float(seen @ seen) or 1.0
    return np.array([1.0, *(seen[lag:] @ seen[:-lag] / size for lag in range(1, _LAGS + 1))])


def _whose(dataset: xr.Dataset) -> str:
    laws = [str(law) for law in dataset["law"].values]
    if len(laws) == 1:
        return f"Correlation: {place(dataset.isel(law=0), 'law')}"
    return f"Correlation: {laws[0]} below, {laws[1]} above".replace("_", " ")


def _symbol(name: str) -> str:
    """That of a parameter, with the number of its window, where several are fitted together."""
    plain, number = parted(name)
    symbol = PARAMETERS[plain].symbol
    return f"{symbol[:-1]}^{{({number})}}$" if number else symbol


def _correlation(dataset: xr.Dataset, axes: Axes) -> None:
    """Correlations of parameters: by the first law below the diagonal, by the second above."""
    fits = [one for one, _name, _law in _each(dataset, first=True)][:2]
    lower, upper = fits[0]["correlation"].values, fits[-1]["correlation"].values
    values = np.tril(lower) + np.triu(upper, 1)
    names = [_symbol(str(name)) for name in dataset["parameter"].values]
    colours = colormaps["RdBu_r"].with_extremes(bad="0.85")
    axes.imshow(values, vmin=-1.0, vmax=1.0, cmap=colours, aspect="auto")
    axes.grid(visible=False)
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(length=0)
    for (row, column), value in np.ndenumerate(values):
        shade = "white" if abs(value) > 0.6 else "black"
        text = f"{value:.2f}".replace("0.", ".") if row != column else ""
        if np.isfinite(value):
            drawn: Text = axes.text(column, row, text, ha="center", va="center", color=shade)
            drawn.set_fontsize(min(7.0, 50.0 / len(names)))
