"""Plot that shows a record, the detected steps and holds, the fitted window and the fits.

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

from rsfstudy.explorer.pixel_thinning import thin_curve_to_pixels
from rsfstudy.fitting import LoadingStep, Record
from rsfstudy.plots import cycle_style, style_context
from rsfstudy.reporting import split_into_single_fits

#: Width of a figure in pixels before the browser reports the actual width.
_ASSUMED_FIGURE_WIDTH_PIXELS = 900
#: Widths below this number of pixels are ignored, because the browser has not drawn the figure.
_MIN_FIGURE_WIDTH_PIXELS = 50
#: Largest distance between a click and a step, as a fraction of the visible range.
_MAX_CLICK_DISTANCE_OVER_X_RANGE = 0.02
#: Margin on both sides of the record, as a fraction of the visible range.
_X_MARGIN_FRACTION = 0.02
#: Columns of the record in the second to the fourth figure, and heights of all figures in pixels.
_PLOTTED_RECORD_COLUMNS = ("friction", "displacement", "normal_stress")
_FIGURE_HEIGHT_PIXELS_BY_NAME = {
    "steps": 60,
    "friction": 300,
    "displacement": 150,
    "normal_stress": 150,
    "fit": 170,
}
#: Axis labels, and the factor from the units of the record to the units of the label.
_AXIS_LABEL_AND_FACTOR_BY_COLUMN = {
    "time": ("Time (s)", 1.0),
    "displacement": ("Displacement (µm)", 1.0),
    "friction": ("Friction", 1.0),
    "normal_stress": ("Normal stress (MPa)", 1e-6),
}
#: Markers and line dashes of the laws, which differ for readers who cannot tell the colours apart.
_MARKERS_OF_LAWS = ("circle", "triangle", "square", "diamond", "cross")
_LINE_DASHES_OF_LAWS = ("solid", "dashed", "dotdash", "dotted", "dashdot")
_STEP_COLOR, _EXCLUDED_COLOR = "#333333", "#999999"
_HOLD_SHADING_STYLE = {"color": "#f0e442", "fill_alpha": 0.25, "line_alpha": 0.0}


def find_hold_intervals(loading_steps: Sequence[LoadingStep]) -> list[tuple[float, float]]:
    """Return the times in s at which holds begin and end.

    Parameters
    ----------
    loading_steps : sequence of LoadingStep
        Steps of a record.

    Returns
    -------
    list of (float, float)
        Intervals between a step to velocity 0 and the next step.
    """
    return [
        (step.end, later.start)
        for step, later in itertools.pairwise(loading_steps)
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
        self.figures = {name: self._create_figure(name) for name in _FIGURE_HEIGHT_PIXELS_BY_NAME}
        self._curves = {name: self._add_record_curve(name) for name in _PLOTTED_RECORD_COLUMNS}
        self._steps, self._holds = ColumnDataSource(), ColumnDataSource()
        self._fit_curves, self._fit_residuals = ColumnDataSource(), ColumnDataSource()
        self._outside = [BoxAnnotation(visible=False, level="overlay") for _side in range(2)]
        self._add_step_and_window_marks()
        self._add_fit_curves_and_residuals()
        self.layout = gridplot(
            [[each] for each in self.figures.values()], sizing_mode="stretch_width"
        )
        for bar in (self.layout.toolbar, *(each.toolbar for each in self.figures.values())):
            bar.active_drag = next(filter(_is_box_selection_tool, bar.tools), None)

    def show_record(self, record: Record, x_column_name: str) -> None:
        """Show a record against time or displacement.

        Parameters
        ----------
        record : Record
            Whole record.
        x_column_name : {"time", "displacement"}
            Column on the horizontal axis.
        """
        self._record, self._x_name = record, x_column_name
        x = self._get_x_values()
        margin = _X_MARGIN_FRACTION * float(np.ptp(x))
        limits = float(x.min()) - margin, float(x.max()) + margin
        self._x_range.update(start=limits[0], end=limits[1], reset_start=limits[0])
        self._x_range.reset_end = limits[1]
        self._limits = limits
        self.figures["normal_stress"].visible = "normal_stress" in record.columns
        other = "displacement" if x_column_name == "time" else "time"
        self.figures["displacement"].yaxis.axis_label = _AXIS_LABEL_AND_FACTOR_BY_COLUMN[other][0]
        self._label_x_axis_of_lowest_figure()
        self._thin_visible_rows()

    def shade_rows_outside_window(self, start_time: float | None, end_time: float | None) -> None:
        """Shade the rows outside the window.

        Parameters
        ----------
        start_time, end_time : float or None
            Limits of the window in s. None means the first or the last row.
        """
        before, after = self._outside
        before.update(visible=start_time is not None, right=self._convert_time_to_x(start_time))
        after.update(visible=end_time is not None, left=self._convert_time_to_x(end_time))

    def mark_steps_and_holds(
        self, steps: Sequence[LoadingStep], excluded_step_numbers: Sequence[int]
    ) -> None:
        """Mark steps and holds.

        Parameters
        ----------
        steps : sequence of LoadingStep
            Steps in the window.
        excluded_step_numbers : sequence of int
            Numbers of the steps that are not fitted, starting from 1.
        """
        self._step_times = np.array([step.middle_time for step in steps])
        numbers = range(1, len(steps) + 1)
        self._steps.data = {
            "x": [self._convert_time_to_x(time) for time in self._step_times],
            "y": [0.72 if n % 2 else 0.28 for n in numbers],  # Steps of a hold may coincide.
            "number": [str(n) for n in numbers],
            "marker": ["square_x" if n in excluded_step_numbers else "square" for n in numbers],
            "color": [
                _EXCLUDED_COLOR if n in excluded_step_numbers else _STEP_COLOR for n in numbers
            ],
            "dash": ["dotted" if n in excluded_step_numbers else "solid" for n in numbers],
        }
        holds = find_hold_intervals(steps)
        self._holds.data = {
            name: [self._convert_time_to_x(hold[side]) for hold in holds]
            for side, name in enumerate(("x0", "x1"))
        }

    def show_fit(self, fit_dataset: xr.Dataset | None) -> None:
        """Draw the fitted curves and the whitened residuals.

        Parameters
        ----------
        fit_dataset : xarray.Dataset or None
            Dataset from ``rsfstudy.fit``. With None, the curves are removed.
        """
        self._fitted = [] if fit_dataset is None else [*_iterate_fit_curves_and_styles(fit_dataset)]
        self.figures["fit"].visible = bool(self._fitted)
        self.figures["friction"].legend.visible = bool(self._fitted)
        self._label_x_axis_of_lowest_figure()
        self._thin_fit_curves_and_residuals()

    def _create_figure(self, figure_name: str) -> Any:
        """Create an empty figure with its tools and events."""
        select = BoxSelectTool(dimensions="width", renderers=[], description="Select the window")
        made = new_figure(
            height=_FIGURE_HEIGHT_PIXELS_BY_NAME[figure_name],
            sizing_mode="stretch_width",
            x_range=self._x_range,
            tools=[select, "xpan", "xwheel_zoom", "xbox_zoom", "reset"]
            if figure_name != "steps"
            else "",
            active_scroll=None,
            output_backend="canvas",
            name=figure_name,
        )
        made.min_border_left = 70
        made.yaxis.axis_label_text_font_size = "12px"
        made.xaxis.visible = figure_name != "steps"
        if figure_name == "steps":
            made.y_range = Range1d(0.0, 1.0)
            made.yaxis.visible = made.xgrid.visible = made.ygrid.visible = False
        else:
            made.yaxis.axis_label = _AXIS_LABEL_AND_FACTOR_BY_COLUMN.get(
                figure_name, ("Whitened residual", 1.0)
            )[0]
        made.on_event(RangesUpdate, self._handle_zoom)
        made.on_event(Tap, self._handle_click)
        made.on_event(SelectionGeometry, self._handle_window_drag)
        return made

    def _label_x_axis_of_lowest_figure(self) -> None:
        """Label the horizontal axis of the lowest visible figure only."""
        visible = [each for each in self.figures.values() if each.visible]
        for each in visible:
            each.xaxis.axis_label = (
                _AXIS_LABEL_AND_FACTOR_BY_COLUMN[self._x_name][0] if each is visible[-1] else None
            )

    def _add_record_curve(self, column_name: str) -> ColumnDataSource:
        """Add an empty curve for a column of the record."""
        source = ColumnDataSource({"x": [], "y": []})
        self.figures[column_name].line("x", "y", source=source, color="#8c8c8c", line_width=1)
        return source

    def _add_step_and_window_marks(self) -> None:
        """Add marks for the steps, the holds and the window to all figures."""
        self.mark_steps_and_holds((), ())
        strip = self.figures["steps"]
        marks = {"source": self._steps, "color": "color"}
        strip.scatter("x", "y", marker="marker", size=18, fill_alpha=0.15, **marks)
        strip.text("x", "y", text="number", text_align="center", text_baseline="middle",
                   text_font_size="11px", source=self._steps, text_color="color")  # fmt: skip
        for each in self.figures.values():
            each.vstrip("x0", "x1", source=self._holds, level="underlay", **_HOLD_SHADING_STYLE)
            if each is not strip:
                each.vspan("x", line_dash="dash", line_width=1.5, **marks)
            for box in self._outside:
                each.add_layout(box)
        for box in self._outside:
            box.update(fill_color="#b0b0b0", fill_alpha=0.4, line_alpha=0.0)

    def _add_fit_curves_and_residuals(self) -> None:
        """Add the fitted curves and the figure of the whitened residuals."""
        friction, residuals = self.figures["friction"], self.figures["fit"]
        fitted = {"color": "color", "legend_field": "law"}
        self._thin_fit_curves_and_residuals()
        friction.multi_line(
            "xs", "ys", source=self._fit_curves, line_width=2.5, line_dash="dash", **fitted
        )
        residuals.scatter("x", "y", marker="marker", source=self._fit_residuals, size=4, **fitted)
        for height in (-2.0, 2.0):
            residuals.add_layout(Span(dimension="width", location=height, line_dash="dotted"))
        self.show_fit(None)

    def _get_x_values(self) -> np.ndarray:
        """Return the column that is plotted along the horizontal axis."""
        assert self._record is not None
        return self._record.columns[self._x_name]

    def _convert_time_to_x(self, time: float | None) -> float | None:
        """Convert a time in s to a position on the horizontal axis."""
        if time is None or self._record is None:
            return None
        return float(np.interp(time, self._record.time, self._get_x_values()))

    def _convert_x_limits_to_times(self, x_limits: tuple[float, float]) -> tuple[float, float]:
        """Return the times in s between two positions on the horizontal axis."""
        assert self._record is not None
        time, ordered = self._record.time, np.maximum.accumulate(self._get_x_values())
        first = int(np.searchsorted(ordered, x_limits[0]))
        last = int(np.searchsorted(ordered, x_limits[1], "right")) - 1
        return float(time[min(first, len(time) - 1)]), float(time[max(last, 0)])

    def _thin_visible_rows(self) -> None:
        """Thin the visible rows to the pixel resolution of the figures."""
        if self._record is None:
            return
        x, columns = self._get_x_values(), self._record.columns
        other = "displacement" if self._x_name == "time" else "time"
        for name, source in self._curves.items():
            values = columns.get(other if name == "displacement" else name)
            if values is not None:
                thin_x, thin_y = thin_curve_to_pixels(
                    x, values, self._limits, self._get_horizontal_pixel_count()
                )
                source.data = {"x": thin_x, "y": thin_y * _AXIS_LABEL_AND_FACTOR_BY_COLUMN[name][1]}
        self._thin_fit_curves_and_residuals()

    def _thin_fit_curves_and_residuals(self) -> None:
        """Thin the fitted curves and the whitened residuals."""
        curves: dict[str, list[Any]] = {n: [] for n in ("xs", "ys", "color", "law", "dash")}
        points: dict[str, list[Any]] = {n: [] for n in ("x", "y", "color", "law", "marker")}
        for rows in self._fitted:
            x, y = self._thin_fit_variable(rows, "fitted_friction")
            for name, value in (rows | {"xs": x, "ys": y}).items():
                curves.get(name, []).append(value)
            x, y = self._thin_fit_variable(rows, "whitened_residual")
            looks = {name: [rows[name]] * len(x) for name in ("color", "law", "marker")}
            for name, values in (looks | {"x": x, "y": y}).items():
                points[name].extend(values)
        self._fit_curves.data, self._fit_residuals.data = curves, points

    def _thin_fit_variable(
        self, fit_variables: dict[str, Any], variable_name: str
    ) -> tuple[np.ndarray, np.ndarray]:
        """Thin the curve of a fit variable, ignoring the rows in which the variable is NaN."""
        known = np.isfinite(fit_variables[variable_name])
        x = fit_variables[f"record_{self._x_name}"][known]
        return thin_curve_to_pixels(
            x, fit_variables[variable_name][known], self._limits, self._get_horizontal_pixel_count()
        )

    def _get_horizontal_pixel_count(self) -> int:
        """Return the number of pixels between the ends of the horizontal axis."""
        try:
            width = int(self.figures["friction"].inner_width)
        except UnsetValueError:  # The browser has not drawn the figure yet.
            return _ASSUMED_FIGURE_WIDTH_PIXELS
        # The browser reports a width close to 0 while the figure is hidden.
        return width if width >= _MIN_FIGURE_WIDTH_PIXELS else _ASSUMED_FIGURE_WIDTH_PIXELS

    def _handle_zoom(self, event: RangesUpdate) -> None:
        """Thin the rows again after the user has changed the visible range."""
        limits = float(event.x0), float(event.x1)
        if limits != self._limits and limits[0] < limits[1]:
            self._limits = limits
            self._thin_visible_rows()

    def _handle_click(self, event: Tap) -> None:
        """Report the step at the position of a click."""
        if event.x is None or not len(self._step_times):
            return
        apart = np.abs(np.array(self._steps.data["x"], dtype=float) - event.x)
        near = np.flatnonzero(
            apart <= _MAX_CLICK_DISTANCE_OVER_X_RANGE * (self._limits[1] - self._limits[0])
        )
        if event.model is self.figures["steps"]:
            apart = np.abs(np.array(self._steps.data["y"]) - event.y)
        if len(near):
            self._on_step(int(near[apart[near].argmin()]))

    def _handle_window_drag(self, event: SelectionGeometry) -> None:
        """Report the time interval that the user has selected by dragging."""
        if event.final and self._record is not None:
            left, right = sorted(float(event.geometry[name]) for name in ("x0", "x1"))
            begin, end = self._convert_x_limits_to_times((left, right))
            if begin < end:
                self._on_window(begin, end)


def _is_box_selection_tool(tool: Any) -> bool:
    """Return True if a tool is a box selection tool, or a group of box selection tools."""
    return isinstance(getattr(tool, "tools", [tool])[0], BoxSelectTool)


def _iterate_fit_curves_and_styles(fit_dataset: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the curves of each fit in a dataset, with the plot style of the friction law."""
    laws = fit_dataset["law"].values.tolist()
    with style_context():
        colors = [cycle_style(number)["color"] for number in range(len(laws))]
    looks = {
        law: {"law": law, "color": color, "marker": marker, "dash": dash}
        for law, color, marker, dash in zip(
            laws,
            colors,
            itertools.cycle(_MARKERS_OF_LAWS),
            itertools.cycle(_LINE_DASHES_OF_LAWS),
            strict=False,
        )
    }
    names = ("record_time", "record_displacement", "fitted_friction", "whitened_residual")
    for one in split_into_single_fits(fit_dataset):
        yield {name: one[name].values for name in names} | looks[one["law"].item()]
