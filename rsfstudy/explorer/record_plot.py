"""Plot of a record, with its steps, its holds, the fitted window and the fits.

The plot consists of Bokeh figures with a common horizontal axis. Only the minimum and the maximum
of each curve in each column of pixels are sent to the browser. When the user zooms, the visible
rows are thinned again.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from bokeh.core.property.descriptors import UnsetValueError
from bokeh.events import RangesUpdate, SelectionGeometry, Tap
from bokeh.layouts import gridplot
from bokeh.models import BoxAnnotation, BoxSelectTool, ColumnDataSource, Range1d, Span
from bokeh.plotting import figure as new_figure

from rsfstudy.explorer.pixel_thinning import thin_to_pixels
from rsfstudy.fitting import LoadingStep, Record
from rsfstudy.plots import cycle_style, style_context
from rsfstudy.reporting import split_into_single_fits

#: Width of a figure in pixels before the browser reports the actual width.
_ASSUMED_WIDTH = 900
#: Largest distance between a click and a step, as a fraction of the visible range.
_CLICK_REACH = 0.02
#: Margin on both sides of the record, as a fraction of the visible range.
_MARGIN = 0.02
#: Columns of the record in the second to the fourth figure, and heights of all figures in pixels.
_COLUMNS = ("friction", "displacement", "normal_stress")
_HEIGHTS = {"steps": 60, "friction": 300, "displacement": 150, "normal_stress": 150, "fit": 170}
#: Axis labels, and the factor from the units of the record to the units of the label.
_LABELS = {
    "time": ("Time (s)", 1.0),
    "displacement": ("Displacement (µm)", 1.0),
    "friction": ("Friction", 1.0),
    "normal_stress": ("Normal stress (MPa)", 1e-6),
}
#: Markers and line dashes of the laws, which differ for readers who cannot tell the colours apart.
_MARKERS = ("circle", "triangle", "square", "diamond", "cross")
_DASHES = ("solid", "dashed", "dotdash", "dotted", "dashdot")
_STEP_COLOR, _EXCLUDED_COLOR = "#333333", "#999999"
_HOLD_STYLE = {"color": "#f0e442", "fill_alpha": 0.25, "line_alpha": 0.0}


def find_holds(steps: Sequence[LoadingStep]) -> list[tuple[float, float]]:
    """Return the times in s at which holds begin and end.

    Parameters
    ----------
    steps : sequence of LoadingStep
        Steps of a record.

    Returns
    -------
    list of (float, float)
        Intervals between a step to velocity 0 and the next step.
    """
    return [
        (step.end, later.start)
        for step, later in itertools.pairwise(steps)
        if step.changes_velocity and not step.velocity_after
    ]


class RecordPlot:
    """Bokeh figures of a record and its fits.

    Parameters
    ----------
    on_window : callable
        Function that is called with the ends in s of the interval that the user selects by
        dragging.
    on_step : callable
        Function that is called with the index of the step that the user clicks.
    """

    def __init__(
        self, on_window: Callable[[float, float], None], on_step: Callable[[int], None]
    ) -> None:
        self._on_window, self._on_step = on_window, on_step
        self._record: Record | None = None
        self._x_name = "time"
        self._step_times: np.ndarray = np.zeros(0)
        self._fitted: list[dict[str, Any]] = []
        self._limits = (0.0, 0.0)
        self._x_range = Range1d(0.0, 1.0)
        self.figures = {name: self._create_figure(name) for name in _HEIGHTS}
        self._curves = {name: self._add_curve(name) for name in _COLUMNS}
        self._steps, self._holds = ColumnDataSource(), ColumnDataSource()
        self._fit_curves, self._fit_residuals = ColumnDataSource(), ColumnDataSource()
        self._outside = [BoxAnnotation(visible=False, level="overlay") for _side in range(2)]
        self._add_marks()
        self._add_fits()
        self.layout = gridplot(
            [[each] for each in self.figures.values()], sizing_mode="stretch_width"
        )
        for bar in (self.layout.toolbar, *(each.toolbar for each in self.figures.values())):
            bar.active_drag = next(filter(_is_selection_tool, bar.tools), None)

    def show_record(self, record: Record, x_name: str) -> None:
        """Show a record against time or displacement.

        Parameters
        ----------
        record : Record
            Whole record.
        x_name : {"time", "displacement"}
            Column on the horizontal axis.
        """
        self._record, self._x_name = record, x_name
        x = self._x()
        margin = _MARGIN * float(np.ptp(x))
        limits = float(x.min()) - margin, float(x.max()) + margin
        self._x_range.update(start=limits[0], end=limits[1], reset_start=limits[0])
        self._x_range.reset_end = limits[1]
        self._limits = limits
        self.figures["normal_stress"].visible = "normal_stress" in record.columns
        other = "displacement" if x_name == "time" else "time"
        self.figures["displacement"].yaxis.axis_label = _LABELS[other][0]
        self._label_lowest_axis()
        self._thin_again()

    def show_window(self, begin: float | None, end: float | None) -> None:
        """Shade the rows outside the window.

        Parameters
        ----------
        begin, end : float or None
            Limits of the window in s. None means the first or the last row.
        """
        before, after = self._outside
        before.update(visible=begin is not None, right=self._place(begin))
        after.update(visible=end is not None, left=self._place(end))

    def show_steps(self, steps: Sequence[LoadingStep], excluded: Sequence[int]) -> None:
        """Mark steps and holds.

        Parameters
        ----------
        steps : sequence of LoadingStep
            Steps in the window.
        excluded : sequence of int
            Numbers of the steps that are not fitted, starting from 1.
        """
        self._step_times = np.array([step.middle for step in steps])
        numbers = range(1, len(steps) + 1)
        self._steps.data = {
            "x": [self._place(time) for time in self._step_times],
            "y": [0.72 if n % 2 else 0.28 for n in numbers],  # Steps of a hold may coincide.
            "number": [str(n) for n in numbers],
            "marker": ["square_x" if n in excluded else "square" for n in numbers],
            "color": [_EXCLUDED_COLOR if n in excluded else _STEP_COLOR for n in numbers],
            "dash": ["dotted" if n in excluded else "solid" for n in numbers],
        }
        holds = find_holds(steps)
        self._holds.data = {
            name: [self._place(hold[side]) for hold in holds]
            for side, name in enumerate(("x0", "x1"))
        }

    def show_fit(self, dataset: xr.Dataset | None) -> None:
        """Draw the fitted curves and the whitened residuals.

        Parameters
        ----------
        dataset : xarray.Dataset or None
            Dataset from ``rsfstudy.fit``. With None, the curves are removed.
        """
        self._fitted = [] if dataset is None else [*_iterate_fitted_rows(dataset)]
        self.figures["fit"].visible = bool(self._fitted)
        self.figures["friction"].legend.visible = bool(self._fitted)
        self._label_lowest_axis()
        self._thin_fits()

    def _create_figure(self, name: str) -> Any:
        """Create an empty figure with its tools and events."""
        select = BoxSelectTool(dimensions="width", renderers=[], description="Select the window")
        made = new_figure(
            height=_HEIGHTS[name],
            sizing_mode="stretch_width",
            x_range=self._x_range,
            tools=[select, "xpan", "xwheel_zoom", "xbox_zoom", "reset"] if name != "steps" else "",
            active_scroll=None,
            output_backend="canvas",
            name=name,
        )
        made.min_border_left = 70
        made.yaxis.axis_label_text_font_size = "12px"
        made.xaxis.visible = name != "steps"
        if name == "steps":
            made.y_range = Range1d(0.0, 1.0)
            made.yaxis.visible = made.xgrid.visible = made.ygrid.visible = False
        else:
            made.yaxis.axis_label = _LABELS.get(name, ("Whitened residual", 1.0))[0]
        made.on_event(RangesUpdate, self._zoomed)
        made.on_event(Tap, self._tapped)
        made.on_event(SelectionGeometry, self._dragged)
        return made

    def _label_lowest_axis(self) -> None:
        """Label the horizontal axis of the lowest visible figure only."""
        visible = [each for each in self.figures.values() if each.visible]
        for each in visible:
            each.xaxis.axis_label = _LABELS[self._x_name][0] if each is visible[-1] else None

    def _add_curve(self, name: str) -> ColumnDataSource:
        """Add the line of a column of the record."""
        source = ColumnDataSource({"x": [], "y": []})
        self.figures[name].line("x", "y", source=source, color="#8c8c8c", line_width=1)
        return source

    def _add_marks(self) -> None:
        """Add the marks of steps, of holds and of the window to all figures."""
        self.show_steps((), ())
        strip = self.figures["steps"]
        marks = {"source": self._steps, "color": "color"}
        strip.scatter("x", "y", marker="marker", size=18, fill_alpha=0.15, **marks)
        strip.text("x", "y", text="number", text_align="center", text_baseline="middle",
                   text_font_size="11px", source=self._steps, text_color="color")  # fmt: skip
        for each in self.figures.values():
            each.vstrip("x0", "x1", source=self._holds, level="underlay", **_HOLD_STYLE)
            if each is not strip:
                each.vspan("x", line_dash="dash", line_width=1.5, **marks)
            for box in self._outside:
                each.add_layout(box)
        for box in self._outside:
            box.update(fill_color="#b0b0b0", fill_alpha=0.4, line_alpha=0.0)

    def _add_fits(self) -> None:
        """Add the fitted curves and the figure of the whitened residuals."""
        friction, residuals = self.figures["friction"], self.figures["fit"]
        fitted = {"color": "color", "legend_field": "law"}
        self._thin_fits()
        friction.multi_line(
            "xs", "ys", source=self._fit_curves, line_width=2.5, line_dash="dash", **fitted
        )
        residuals.scatter("x", "y", marker="marker", source=self._fit_residuals, size=4, **fitted)
        for height in (-2.0, 2.0):
            residuals.add_layout(Span(dimension="width", location=height, line_dash="dotted"))
        self.show_fit(None)

    def _x(self) -> np.ndarray:
        """Return the column that is plotted along the horizontal axis."""
        assert self._record is not None
        return self._record.columns[self._x_name]

    def _place(self, time: float | None) -> float | None:
        """Convert a time in s to a position on the horizontal axis."""
        if time is None or self._record is None:
            return None
        return float(np.interp(time, self._record.time, self._x()))

    def _times_between(self, limits: tuple[float, float]) -> tuple[float, float]:
        """Return the times in s between two positions on the horizontal axis."""
        assert self._record is not None
        time, ordered = self._record.time, np.maximum.accumulate(self._x())
        first = int(np.searchsorted(ordered, limits[0]))
        last = int(np.searchsorted(ordered, limits[1], "right")) - 1
        return float(time[min(first, len(time) - 1)]), float(time[max(last, 0)])

    def _thin_again(self) -> None:
        """Thin the visible rows to the pixel resolution of the figures."""
        if self._record is None:
            return
        x, columns = self._x(), self._record.columns
        other = "displacement" if self._x_name == "time" else "time"
        for name, source in self._curves.items():
            values = columns.get(other if name == "displacement" else name)
            if values is not None:
                thin_x, thin_y = thin_to_pixels(x, values, self._limits, self._pixel_count())
                source.data = {"x": thin_x, "y": thin_y * _LABELS[name][1]}
        self._thin_fits()

    def _thin_fits(self) -> None:
        """Thin the fitted curves and the whitened residuals."""
        curves: dict[str, list[Any]] = {n: [] for n in ("xs", "ys", "color", "law", "dash")}
        points: dict[str, list[Any]] = {n: [] for n in ("x", "y", "color", "law", "marker")}
        for rows in self._fitted:
            x, y = self._thin_rows(rows, "fitted_friction")
            for name, value in (rows | {"xs": x, "ys": y}).items():
                curves.get(name, []).append(value)
            x, y = self._thin_rows(rows, "whitened_residual")
            looks = {name: [rows[name]] * len(x) for name in ("color", "law", "marker")}
            for name, values in (looks | {"x": x, "y": y}).items():
                points[name].extend(values)
        self._fit_curves.data, self._fit_residuals.data = curves, points

    def _thin_rows(self, rows: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
        """Thin the rows of a fit, without the rows in which a variable is NaN."""
        known = np.isfinite(rows[name])
        x = rows[f"record_{self._x_name}"][known]
        return thin_to_pixels(x, rows[name][known], self._limits, self._pixel_count())

    def _pixel_count(self) -> int:
        """Return the number of pixels between the ends of the horizontal axis."""
        try:
            return int(self.figures["friction"].inner_width)
        except UnsetValueError:  # The browser has not drawn the figure yet.
            return _ASSUMED_WIDTH

    def _zoomed(self, event: RangesUpdate) -> None:
        """Thin the rows again after the user has changed the visible range."""
        limits = float(event.x0), float(event.x1)
        if limits != self._limits and limits[0] < limits[1]:
            self._limits = limits
            self._thin_again()

    def _tapped(self, event: Tap) -> None:
        """Report the step at the position of a click."""
        if event.x is None or not len(self._step_times):
            return
        apart = np.abs(np.array(self._steps.data["x"], dtype=float) - event.x)
        near = np.flatnonzero(apart <= _CLICK_REACH * (self._limits[1] - self._limits[0]))
        if event.model is self.figures["steps"]:
            apart = np.abs(np.array(self._steps.data["y"]) - event.y)
        if len(near):
            self._on_step(int(near[apart[near].argmin()]))

    def _dragged(self, event: SelectionGeometry) -> None:
        """Report the time interval that the user has selected by dragging."""
        if event.final and self._record is not None:
            left, right = sorted(float(event.geometry[name]) for name in ("x0", "x1"))
            begin, end = self._times_between((left, right))
            if begin < end:
                self._on_window(begin, end)


def _is_selection_tool(tool: Any) -> bool:
    """Return True if a tool is the selection tool of a figure or the toolbar."""
    return isinstance(getattr(tool, "tools", [tool])[0], BoxSelectTool)


def _iterate_fitted_rows(dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the curves of each fit in a dataset, in the line style of its law."""
    laws = dataset["law"].values.tolist()
    with style_context():
        colors = [cycle_style(number)["color"] for number in range(len(laws))]
    looks = {
        law: {"law": law, "color": color, "marker": marker, "dash": dash}
        for law, color, marker, dash in zip(
            laws, colors, itertools.cycle(_MARKERS), itertools.cycle(_DASHES), strict=False
        )
    }
    names = ("record_time", "record_displacement", "fitted_friction", "whitened_residual")
    for one in split_into_single_fits(dataset):
        yield {name: one[name].values for name in names} | looks[one["law"].item()]
