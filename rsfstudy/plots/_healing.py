"""Figure that shows frictional healing in a slide-hold-slide test."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.errors import DataError
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.fitting import Record
from rsfstudy.plots._axis_formatting import set_log_scale
from rsfstudy.plots._figure_size import (
    compute_figure_size_in_inches,
    limit_panel_column_count_to_width,
)
from rsfstudy.plots._image_files import NotebookFigure
from rsfstudy.plots._style import (
    add_legend,
    add_panel_letters,
    cycle_style,
    finalize_layout,
    increase_figure_height_for_legends,
    style_context,
)

#: Height of a panel in mm, and largest number of record rows to draw.
_PANEL_HEIGHT_MM, _MAX_DRAWN_ROWS = 60.0, 20_000
#: Number of standard errors in half the length of an error bar.
_ERROR_BAR_HALF_LENGTH_IN_STDERRS = 2.0


@partial(raise_only_rsfstudy_errors, applies_to_internal_calls=True)
def plot_healing(
    table: xr.Dataset, record: Record | None = None, *, style: Any = None, width: Any = None
) -> Figure:
    """Plot healing and relaxation against the hold duration.

    Parameters
    ----------
    table : xarray.Dataset
        Table of holds, as returned by ``rsfstudy.healing``, ``Record.holds`` or
        ``dataset.rsf.holds()``. The required variables are ``duration``, ``healing`` and
        ``relaxation`` along ``hold``, their errors, and the scalars ``healing_rate``,
        ``healing_rate_stderr`` and ``healing_intercept``.
    record : Record, optional
        Record that contains the holds. If you pass a record, the first panel shows the recorded
        friction, the friction before each hold, and the peak friction after each hold. By default,
        the figure does not have this panel.
    style : path, str, dict or list, optional
        Styles that override the style of rsfstudy, as for ``rsfstudy.plot``.
    width : quantity, optional
        Width of the figure, from "60 mm" to "600 mm". If the figure is narrower than 110 mm, the
        panels are stacked vertically.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with one or two panels. Error bars show two standard errors.

    Raises
    ------
    DataError
        If the dataset is not a table of holds, or if it contains no holds.
    InvalidValue
        If the style or the width is invalid.

    Examples
    --------
    >>> from rsfstudy import Scene, plot_healing, simulate
    >>> scene = Scene(normal_stress="constant", hold_time=1000, stiffness_ratio=10)
    >>> figure = plot_healing(simulate(scene, duration=1100.0).rsf.holds())
    >>> len(figure.axes)
    1
    """
    if not {"healing", "duration", "healing_rate"} <= set(table.variables):
        raise DataError("the dataset is not a table of holds. Pass the result of rsfstudy.healing.")
    if not table.sizes["hold"]:
        raise DataError("the table contains no holds, so there is nothing to draw.")
    count = 1 if record is None else 2
    with style_context(style, width):
        columns = limit_panel_column_count_to_width(count)
        rows = count // columns
        figure = NotebookFigure(
            figsize=compute_figure_size_in_inches(columns, rows, _PANEL_HEIGHT_MM),
            layout="constrained",
        )
        panels = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
        if record is not None:
            _draw_record_with_holds(table, record, panels[0])
        _draw_healing_against_hold_duration(table, panels[-1])
        if count > 1:
            add_panel_letters(panels)
        increase_figure_height_for_legends(
            figure, [panels] if rows == 1 else [[panel] for panel in panels]
        )
        finalize_layout(figure)
    return figure


def _draw_record_with_holds(hold_table: xr.Dataset, record: Record, axes: Axes) -> None:
    """Plot friction against load point displacement, and mark the measured values."""
    moved, friction = record.columns["displacement"], record.columns["friction"]
    thinned = slice(None, None, max(1, len(record) // _MAX_DRAWN_ROWS))
    axes.plot(moved[thinned], friction[thinned], ".", color="0.7", markersize=1.5, label="record")
    stops = np.interp(hold_table["begins"], record.time, moved)
    starts = np.interp(hold_table["begins"] + hold_table["duration"], record.time, moved)
    trend = float(hold_table.get("trend", 0.0))
    peaks = hold_table["peak_friction"] + trend * hold_table["peak_displacement"]
    for x, y, marker, name in (
        (stops, hold_table["friction_before"], "v", "friction before the hold"),
        (starts + hold_table["peak_displacement"].values, peaks, "^", "peak friction"),
    ):
        axes.plot(x, y, marker, color=cycle_style(marker == "^")["color"], label=name)
    axes.set_xlabel(r"Load point displacement ($\mu$m)")
    axes.set_ylabel(r"Friction coefficient, $\mu$")
    add_legend(axes, 2)


def _draw_healing_against_hold_duration(hold_table: xr.Dataset, axes: Axes) -> None:
    """Plot healing and relaxation against the hold duration."""
    duration = hold_table["duration"].values
    for number, (name, label, sign) in enumerate(
        (
            ("healing", r"healing, $\Delta\mu$", 1.0),
            ("relaxation", r"relaxation, $-\Delta\mu_c$", -1.0),
        )
    ):
        suffix = "stderr" if f"{name}_stderr" in hold_table else "error"
        error = hold_table[f"{name}_{suffix}"].values
        axes.errorbar(
            duration, sign * hold_table[name].values, _ERROR_BAR_HALF_LENGTH_IN_STDERRS * error,
            fmt="os"[number], color=cycle_style(number)["color"], markersize=3.5, label=label,
        )  # fmt: skip
    rate, stderr, level = (
        float(hold_table[n]) for n in ("healing_rate", "healing_rate_stderr", "healing_intercept")
    )
    if math.isfinite(rate):
        ends = np.array([duration.min(), duration.max()])
        digits = 4 if not stderr > 0.0 else max(0, 1 - math.floor(math.log10(stderr)))
        label = rf"{rate:.{digits}f} $\pm$ {stderr:.{digits}f} per decade"
        axes.plot(ends, level + rate * np.log10(ends), label=label, **cycle_style(0))
    if duration.min() < duration.max():
        set_log_scale(axes, "x")
    units = hold_table["duration"].attrs
    unit = "$D_c/V_*$" if "scale" in units else units.get("units", "s")
    axes.set_xlabel(f"Duration of the hold ({unit})")
    axes.set_ylabel("Change of friction")
    add_legend(axes, 2)
