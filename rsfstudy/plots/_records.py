"""Figure that shows a laboratory record and marks its steps and holds."""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.fitting import Record
from rsfstudy.plots._figure_size import compute_figure_size_in_inches
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
_PANEL_HEIGHT_MM, _MAX_DRAWN_ROWS = 45.0, 20_000
#: Labels of the columns, and factors from the units of the record to the units of the labels.
_LABEL_AND_FACTOR_BY_COLUMN = {
    "time": ("Time (s)", 1.0),
    "friction": (r"Friction coefficient, $\mu$", 1.0),
    "displacement": (r"Displacement ($\mu$m)", 1.0),
    "normal_stress": (r"Normal stress, $\sigma$ (MPa)", 1e-6),
}
#: Margin above and below the curves as a fraction of their range. The step numbers need the space.
_Y_MARGIN = 0.12
_STEP_COLOR, _HOLD_COLOR = "0.3", "0.9"
#: Minimum distance between the numbers of steps, as a fraction of the horizontal axis.
_MIN_DISTANCE_OF_STEP_NUMBERS = 0.03


@partial(raise_only_rsfstudy_errors, applies_to_internal_calls=True)
def plot_record(
    record: Any, *, against: str = "time", style: Any = None, width: Any = None
) -> Figure:
    """Plot a laboratory record, and mark its steps and holds.

    Parameters
    ----------
    record : Record
        Record from ``rsfstudy.read_record``.
    against : {"time", "displacement"}, default: "time"
        Column along x. The lower panel shows the other of the two columns.
    style : path, str, dict or list, optional
        Styles that override the style of rsfstudy, as for ``rsfstudy.plot``.
    width : quantity, optional
        Width of the figure, from "60 mm" to "600 mm".

    Returns
    -------
    matplotlib.figure.Figure
        Figure with a panel of friction and a panel of load point displacement. If the normal stress
        of the record varies, a third panel shows the normal stress. Dashed lines with the numbers
        of ``record.steps()`` mark the beginnings of the steps. Gradual steps and holds are shaded.

    Raises
    ------
    InvalidValue
        If ``record`` is not a record, if ``against`` is unknown, or if the style or the width is
        invalid.

    See Also
    --------
    rsfstudy.fit : Fit a record. The method ``rsf.plot`` of the result plots the record and the fit.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy import plot_record, read_record
    >>> time = np.arange(0.0, 100.0, 0.5)
    >>> displacement = np.where(time < 50.0, time, 50.0 + 10.0 * (time - 50.0))
    >>> friction = np.full(200, 0.6)
    >>> record = read_record({"time": time, "displacement": displacement, "friction": friction})
    >>> figure = plot_record(record)
    >>> len(figure.axes)
    2
    """
    if not isinstance(record, Record):
        remedy = "Pass a record from rsfstudy.read_record."
        raise InvalidValue("record", record, "must be a record", remedy=remedy)
    choices = ("time", "displacement")
    if against not in choices:
        raise InvalidValue("against", against, "is unknown", choices=choices)
    shown = ["friction", choices[against == "time"]]
    if "normal_stress" in record.columns and np.ptp(record.columns["normal_stress"]) > 0.0:
        shown.append("normal_stress")
    with style_context(style, width):
        figure = NotebookFigure(
            figsize=compute_figure_size_in_inches(1, len(shown), _PANEL_HEIGHT_MM),
            layout="constrained",
        )
        panels = figure.subplots(len(shown), 1, sharex=True).tolist()
        for axes, name in zip(panels, shown, strict=True):
            _draw_column(record, axes, against, name)
            _mark_steps_and_holds(record, axes, against)
        _write_step_numbers(record, panels[0], against)
        panels[-1].set_xlabel(_LABEL_AND_FACTOR_BY_COLUMN[against][0])
        if record.loading_steps:
            add_legend(panels[-1], 3)
        add_panel_letters(panels)
        increase_figure_height_for_legends(figure, [[panel] for panel in panels])
        finalize_layout(figure)
    return figure


def _draw_column(record: Record, axes: Axes, x_name: str, y_name: str) -> None:
    """Draw a column of a record. Some rows of a long record are omitted."""
    label, factor = _LABEL_AND_FACTOR_BY_COLUMN[y_name]
    thinned = slice(None, None, max(1, len(record) // _MAX_DRAWN_ROWS))
    x, y = record.columns[x_name][thinned], factor * record.columns[y_name][thinned]
    style = cycle_style(0) | {"marker": "", "linewidth": 0.8, "zorder": 2}
    axes.plot(x, y, label="record", **style)
    axes.margins(y=_Y_MARGIN)
    axes.set_ylabel(label)


def _mark_steps_and_holds(record: Record, axes: Axes, x_name: str) -> None:
    """Draw a line at the beginning of each step, and shade gradual steps and holds."""
    steps, x = record.loading_steps, record.columns[x_name]
    for step in steps:
        start, end = np.interp([step.start, step.end], record.time, x)
        axes.axvline(start, color=_STEP_COLOR, ls="--", lw=0.8, zorder=1, label="step")
        if end > start:
            axes.axvspan(start, end, color=_STEP_COLOR, alpha=0.2, lw=0, zorder=0)
    for step, later in itertools.pairwise(steps):
        if step.changes_velocity and not step.velocity_after:
            start, end = np.interp([step.end, later.start], record.time, x)
            axes.axvspan(start, end, color=_HOLD_COLOR, lw=0, zorder=0, label="hold")


def _write_step_numbers(record: Record, axes: Axes, x_name: str) -> None:
    """Write the step numbers along the upper edge of a panel, without overlaps."""
    x = record.columns[x_name]
    least = _MIN_DISTANCE_OF_STEP_NUMBERS * float(np.ptp(axes.get_xlim()))
    previous = -np.inf
    for number, step in enumerate(record.loading_steps, start=1):
        start = float(np.interp(step.start, record.time, x))
        if start - previous >= least:
            axes.annotate(
                str(number), (start, 1.0), (2.0, -2.0), xycoords=axes.get_xaxis_transform(),
                textcoords="offset points", ha="left", va="top", fontsize="small",
            )  # fmt: skip
            previous = start
