"""Bokeh figures of curves and maps of results.

Each figure keeps its Bokeh data sources. When the user moves a slider, only the data are replaced,
so the browser does not have to build the figure again.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from bokeh.events import Tap
from bokeh.models import (
    ColorBar,
    ColumnDataSource,
    HoverTool,
    LinearScale,
    Range1d,
    TapTool,
    Whisker,
)
from bokeh.plotting import figure

from rsfstudy.explorer.curve_and_map_data import (
    CellStatusMarks,
    CurveData,
    MapData,
    choose_evenly_spaced_indices,
    convert_mathtext_to_unicode,
    describe_selected_points,
    extract_curves_of_panel,
    extract_map_of_panel,
    find_cells_to_mark_with_status,
    format_status_name,
    sample_map_at_pixels,
)
from rsfstudy.explorer.plot_selections import PlotSelection
from rsfstudy.explorer.result_colours_and_ticks import (
    build_colour_mapper_of_dimension,
    build_colour_mapper_of_map,
    build_ticker_and_labels,
    find_colour_of_value,
    find_used_flag_names,
    has_numeric_dtype,
    is_log_spaced_coordinate,
    set_tick_labels,
)
from rsfstudy.plots import (
    are_log_spaced,
    are_positive_and_span_decades,
    compute_cell_edges,
    cycle_marker,
    cycle_style,
    format_axis_label,
    style_context,
)
from rsfstudy.status import Status

#: Function that receives the number of the cell that the user clicks.
CellClickCallback = Callable[[int], None]

#: Number of points of a curve above which its markers are small, and maximum number of points that
#: the pointer can select.
_MAX_POINTS_WITH_MARKERS, _MAX_SELECTABLE_POINTS = 60, 6000
#: Maximum number of cells in an image with one pixel per cell, and number of pixels of the image of
#: a larger lattice.
_MAX_CELLS_OF_IMAGE, _PIXELS = 2**21, (1000, 1400)
#: Number of rows of status symbols at the bottom of a figure.
_MAX_STATUS_SYMBOL_ROWS = 8
_BOKEH_DASH_BY_MATPLOTLIB_LINESTYLE = {"-": [], "--": [6, 3], ":": [2, 3], "-.": [6, 3, 2, 3]}
_BOKEH_MARKER_BY_MATPLOTLIB_MARKER = {
    "o": "circle", "s": "square", "^": "triangle", "D": "diamond", "v": "inverted_triangle",
    "<": "hex", ">": "plus", "P": "cross", "*": "star", "X": "square_pin",
}  # fmt: skip
_BOKEH_MARKERS_OF_STATUSES = (
    "x", "asterisk", "triangle_dot", "square_x", "circle_y", "diamond_cross", "y",
)  # fmt: skip
#: Colours of symbols of failures and of other statuses, and colour of cells without a value.
_FAILURE_COLOUR, _ANSWER_COLOUR, _EMPTY_COLOUR = "#D55E00", "#444444", "#e4e4e4"


class ResultPlot(ABC):
    """Base class of plots in which symbols mark the statuses of cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, in the units of the plot.
    panel : PlotSelection
        Selection without a facet.
    on_cell : callable
        Function that receives the number of the cell that the user clicks.
    height : int
        Height of the figure in pixels.

    Attributes
    ----------
    figure : bokeh.plotting.figure
        Figure.
    """

    def __init__(
        self, dataset: xr.Dataset, panel: PlotSelection, on_cell: CellClickCallback, height: int
    ) -> None:
        """Create the figure, and draw the panel."""
        self.on_cell = on_cell
        codes = np.unique(dataset["status"].values).tolist()
        self._symbols = dict(zip(codes, _BOKEH_MARKERS_OF_STATUSES * 4, strict=False))
        self.marks = ColumnDataSource(
            _build_status_symbol_columns({}, CellStatusMarks(*[np.array([], int)] * 4), [], [])
        )
        self.figure: Any = figure(
            height=height,
            sizing_mode="stretch_width",
            x_axis_type="log" if is_log_spaced_coordinate(dataset, panel.x) else "linear",
            y_axis_type=self.choose_y_axis_type(dataset, panel),
            tools="pan,wheel_zoom,box_zoom,reset,tap",
            toolbar_location="above",
            active_drag="box_zoom",
        )
        self.figure.xaxis.axis_label = convert_mathtext_to_unicode(
            format_axis_label(dataset, panel.x, 200)
        )
        self.figure.axis.axis_label_text_font_style = "normal"
        self.figure.axis.axis_label_text_font_size = "12px"
        if not has_numeric_dtype(dataset[panel.x]):
            set_tick_labels(self.figure.xaxis, dict(enumerate(map(str, dataset[panel.x].values))))
        self.add_glyphs_and_tools(dataset, panel)
        if self.figure.legend:
            self.figure.add_layout(self.figure.legend[0], "below")
            self.figure.legend.update(
                ncols=3, border_line_color=None, label_text_font_size="11px", location="left"
            )
        self.update_data(dataset, panel)

    @abstractmethod
    def choose_y_axis_type(self, dataset: xr.Dataset, panel: PlotSelection) -> str:
        """Return "log" or "linear"."""

    @abstractmethod
    def add_glyphs_and_tools(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Add the glyphs and tools to the figure."""

    def update_data(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Replace the data of the plot.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of a study, in the units of the plot.
        panel : PlotSelection
            Selection that differs only in its points.
        """
        title = describe_selected_points(dataset, panel.point_index_by_dimension)
        self.figure.title.text = convert_mathtext_to_unicode(title[:1].upper() + title[1:])

    def share_axis_limits_with(self, other_plot: ResultPlot) -> None:
        """Use the axis limits of another plot, so that panels can be compared."""
        self.figure.x_range, self.figure.y_range = (
            other_plot.figure.x_range,
            other_plot.figure.y_range,
        )
        for limits in (other_plot.figure.x_range, other_plot.figure.y_range):
            if isinstance(limits.renderers, list):
                limits.renderers = [*limits.renderers, *self.figure.renderers[:2]]

    def draw_status_symbols(self, **options: Any) -> Any:
        """Draw the symbols of the statuses, and return their renderer."""
        drawn = self.figure.scatter(
            "x", "y", marker="marker", color="color", fill_alpha=0.0, size=9, line_width=1.5,
            source=self.marks, legend_field="status", **options,
        )  # fmt: skip
        self.figure.add_tools(HoverTool(renderers=[drawn], tooltips=[("status", "@status")]))
        return drawn

    def set_status_symbols(self, status_marks: CellStatusMarks, x: Any, y: Any) -> None:
        """Replace the symbols of the statuses."""
        self.marks.data = _build_status_symbol_columns(self._symbols, status_marks, x, y)


def _build_status_symbol_columns(
    marker_by_status: dict[int, str], status_marks: CellStatusMarks, x: Any, y: Any
) -> dict[str, Any]:
    """Return the columns of the data source from which the status symbols are drawn."""
    failed = status_marks.status_codes >= int(Status.WORK_BUDGET_SPENT)
    codes = status_marks.status_codes.tolist()
    return {
        "x": x,
        "y": y,
        "cell": status_marks.cell_numbers,
        "status": [format_status_name(code) for code in codes],
        "marker": [marker_by_status[code] for code in codes],
        "color": np.where(failed, _FAILURE_COLOUR, _ANSWER_COLOUR).tolist(),
    }


class CurvesPlot(ResultPlot):
    """Plot that shows curves with error bars, and status symbols at the bottom."""

    def choose_y_axis_type(self, dataset: xr.Dataset, panel: PlotSelection) -> str:
        """Return "log" if the values are positive and span at least two decades."""
        is_log = are_positive_and_span_decades(dataset[panel.variable].values)
        return "log" if is_log and not find_used_flag_names(dataset, panel.variable) else "linear"

    def add_glyphs_and_tools(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Add curves, points, error bars, statuses, tooltips and a colour scale."""
        self.lines = ColumnDataSource({n: [] for n in ("xs", "ys", "color", "dash", "alpha")})
        self.points = ColumnDataSource(_build_point_columns([], []))
        label = format_axis_label(dataset, panel.variable, 200)
        self.figure.yaxis.axis_label = convert_mathtext_to_unicode(label)
        line = {"color": "color", "line_dash": "dash", "line_alpha": "alpha", "line_width": 1.6}
        self.figure.multi_line("xs", "ys", source=self.lines, **line)
        bars = Whisker(base="x", lower="low", upper="high", source=self.points)
        bars.upper_head.size = bars.lower_head.size = 6
        self.figure.add_layout(bars)
        mapper = build_colour_mapper_of_dimension(dataset, panel.second_dimension)
        named: Any = {"legend_field": "name"} if panel.second_dimension and not mapper else {}
        points = self.figure.scatter(
            "x", "y", marker="marker", color="color", size="size", source=self.points,
            nonselection_alpha=0.5, **named,
        )  # fmt: skip
        self.figure.y_range.update(renderers=[points], range_padding=0.2)
        self.figure.extra_y_ranges = {"status": Range1d(0.0, 1.0)}
        self.figure.extra_y_scales = {"status": LinearScale()}
        marks = self.draw_status_symbols(y_range_name="status", nonselection_line_alpha=0.4)
        tips = [("value", "@y{0.000000e+0} ± @error{0.0e+0}"), ("x", "@x{0.000000e+0}")]
        tips += [("curve", "@name")] * bool(panel.second_dimension) + [("status", "@status")]
        self.figure.add_tools(HoverTool(renderers=[points], tooltips=tips))
        self.figure.select_one(TapTool).renderers = [points, marks]
        for source in (self.points, self.marks):
            source.selected.on_change("indices", self._handle_point_selection)
        if mapper:
            title = convert_mathtext_to_unicode(
                format_axis_label(dataset, panel.second_dimension, 200)
            )
            bar = ColorBar(color_mapper=mapper, title=title, title_text_font_style="normal")
            self.figure.add_layout(bar, "right")
        set_tick_labels(self.figure.yaxis, find_used_flag_names(dataset, panel.variable))

    def _handle_point_selection(self, _name: str, _old: Any, _new: Any) -> None:
        """Call ``on_cell`` with the cell of the selected point or symbol."""
        for source in (self.points, self.marks):
            for index in source.selected.indices[:1]:
                if (cell := int(source.data["cell"][index])) >= 0:
                    self.on_cell(cell)
                    return

    def update_data(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Replace the data of the plot. See ``ResultPlot.update_data``."""
        super().update_data(dataset, panel)
        curves = extract_curves_of_panel(dataset, panel)
        styles = _choose_curve_styles(dataset, panel, curves)
        self.points.selected.indices = self.marks.selected.indices = []
        self.lines.data = {
            "xs": [c.x for c in curves],
            "ys": [c.y for c in curves],
            **{name: [s[name] for s in styles] for name in ("color", "dash", "alpha")},
        }
        self.points.data = _build_point_columns(curves, styles)
        pairs = [
            find_cells_to_mark_with_status(c.status_codes[None], c.cell_numbers[None])
            for c in curves
        ]
        at = [c.x[m.column_indices] for c, m in zip(curves, pairs, strict=True)]
        rows = [
            np.full(m.row_indices.size, 0.03 + 0.05 * (i % _MAX_STATUS_SYMBOL_ROWS))
            for i, m in enumerate(pairs)
        ]
        marks = CellStatusMarks(*(np.concatenate(parts) for parts in zip(*pairs, strict=True)))
        self.set_status_symbols(marks, np.concatenate(at), np.concatenate(rows))


def _choose_curve_styles(
    dataset: xr.Dataset, panel: PlotSelection, curves: Sequence[CurveData]
) -> list[dict[str, Any]]:
    """Return the colour, dashes, opacity, marker and marker size of each curve."""
    with style_context():
        cycled = [cycle_style(c.index_on_colour_dimension) for c in curves]
    colours, dashes = [s["color"] for s in cycled], [s["linestyle"] for s in cycled]
    if mapper := build_colour_mapper_of_dimension(dataset, panel.second_dimension):
        points = dataset[panel.second_dimension].values.astype(float)
        colours = [
            find_colour_of_value(mapper, points[c.index_on_colour_dimension]) for c in curves
        ]
        dashes = ["-"] * len(curves)
    is_recorded = panel.x in dataset.data_vars
    is_number = has_numeric_dtype(dataset[panel.x]) and not find_used_flag_names(
        dataset, panel.variable
    )
    has_line = is_number and (is_recorded or all(_is_strictly_monotonic(c.x) for c in curves))
    return [
        {
            "color": colour,
            "dash": _BOKEH_DASH_BY_MATPLOTLIB_LINESTYLE.get(dash)
            if isinstance(dash, str)
            else list(dash[1]),
            "alpha": float(has_line),
            "marker": _BOKEH_MARKER_BY_MATPLOTLIB_MARKER[
                cycle_marker(curve.index_on_colour_dimension)
            ],
            "size": 6 if curve.x.size <= _MAX_POINTS_WITH_MARKERS or not has_line else 2,
        }
        for curve, colour, dash in zip(curves, colours, dashes, strict=True)
    ]


def _is_strictly_monotonic(values: np.ndarray) -> bool:
    """Return True if values increase or decrease strictly."""
    steps = np.diff(values)
    return bool((steps > 0.0).all() or (steps < 0.0).all())


def _build_point_columns(
    curves: Sequence[CurveData], styles: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """Return the data source columns of the points and error bars."""
    total = sum(c.x.size for c in curves)
    each = total if total <= _MAX_SELECTABLE_POINTS else _MAX_SELECTABLE_POINTS // len(curves)
    kept = [choose_evenly_spaced_indices(c.x.size, each) for c in curves]
    numbers = [
        np.stack([c.x, c.y, c.y_error, c.cell_numbers])[:, k]
        for c, k in zip(curves, kept, strict=True)
    ]
    rows: dict[str, Any] = dict(
        zip(("x", "y", "error", "cell"), np.hstack([np.empty((4, 0)), *numbers]), strict=True)
    )
    codes = [code for c, k in zip(curves, kept, strict=True) for code in c.status_codes[k].tolist()]
    rows["status"] = [format_status_name(code) for code in codes]
    rows["name"] = [c.label for c, k in zip(curves, kept, strict=True) for _ in k]
    for name in ("color", "marker", "size"):
        rows[name] = [s[name] for s, k in zip(styles, kept, strict=True) for _ in k]
    low = rows["y"] - rows["error"]
    positive = rows["y"][rows["y"] > 0.0]
    # A logarithmic axis cannot show an error bar that includes zero.
    least = 0.1 * positive.min() if positive.size == np.isfinite(rows["y"]).sum() > 0 else -np.inf
    return rows | {"low": np.maximum(low, least), "high": rows["y"] + rows["error"]}


class MapPlot(ResultPlot):
    """Colour map with status symbols, in which cells without a value are grey."""

    def choose_y_axis_type(self, dataset: xr.Dataset, panel: PlotSelection) -> str:
        """Return "log" if the points along y are spaced logarithmically."""
        return "log" if is_log_spaced_coordinate(dataset, panel.second_dimension) else "linear"

    def add_glyphs_and_tools(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Add the image, its colour scale, the symbols of statuses and the tooltips."""
        self.figure.yaxis.axis_label = convert_mathtext_to_unicode(
            format_axis_label(dataset, panel.second_dimension, 200)
        )
        self.image = ColumnDataSource({n: [] for n in ("image", "x", "y", "dw", "dh")})
        self.chosen = ColumnDataSource({"x": [], "y": []})
        self.figure.grid.visible = False
        self.figure.background_fill_color = _EMPTY_COLOUR
        flags = find_used_flag_names(dataset, panel.variable)
        mapper = build_colour_mapper_of_map(dataset[panel.variable].values, flags)
        drawn = self.figure.image(
            image="image", x="x", y="y", dw="dw", dh="dh", source=self.image, color_mapper=mapper
        )
        self.draw_status_symbols()
        self.figure.scatter(
            "x", "y", source=self.chosen, marker="square", size=14, fill_alpha=0.0,
            line_color="black", line_width=2.5,
        )  # fmt: skip
        tips = [("value", "@image{0.000000e+0}"), ("x", "$x{0.0000e+0}"), ("y", "$y{0.0000e+0}")]
        self.figure.add_tools(HoverTool(renderers=[drawn], tooltips=tips))
        title = convert_mathtext_to_unicode(format_axis_label(dataset, panel.variable, 200))
        bar = ColorBar(color_mapper=mapper, title=title, title_text_font_style="normal")
        if flags:
            bar.ticker, bar.major_label_overrides = build_ticker_and_labels(
                dict(enumerate(flags.values()))
            )
        self.figure.add_layout(bar, "right")
        self.figure.on_event(Tap, self._handle_click)

    def _handle_click(self, event: Any) -> None:
        """Call ``on_cell`` with the cell at the position of the pointer."""
        if event.x is None or (cell := self.map.find_cell_number_at(event.x, event.y)) < 0:
            return
        row, column = np.argwhere(self.map.cell_numbers == cell)[0]
        self.chosen.data = {"x": [self.map.x[column]], "y": [self.map.y[row]]}
        self.on_cell(cell)

    def update_data(self, dataset: xr.Dataset, panel: PlotSelection) -> None:
        """Replace the data of the plot. See ``ResultPlot.update_data``."""
        super().update_data(dataset, panel)
        self.map = found = extract_map_of_panel(dataset, panel)
        values, (x, y) = _convert_map_to_image(found)
        if flags := find_used_flag_names(dataset, panel.variable):
            numbers = np.searchsorted(list(flags), values).astype(float)
            values = np.where(np.isfinite(values), numbers, np.nan)
        self.image.data = {
            "image": [values.astype(np.float32)], "x": [x[0]], "y": [y[0]],
            "dw": [x[1] - x[0]], "dh": [y[1] - y[0]],
        }  # fmt: skip
        marks = find_cells_to_mark_with_status(found.status_codes, found.cell_numbers)
        self.set_status_symbols(marks, found.x[marks.column_indices], found.y[marks.row_indices])
        self.chosen.data = {"x": [], "y": []}


def _convert_map_to_image(map_data: MapData) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Return the image of a map, and the limits of the image along x and y.

    If all cells have the same size on the axes, each pixel of the image is one cell.
    """
    limits, is_even = [], map_data.cell_values.size <= _MAX_CELLS_OF_IMAGE
    for points in (map_data.x, map_data.y):
        is_log = are_log_spaced(points)
        edges = compute_cell_edges(points, is_log)
        sizes = np.diff(np.log(edges) if is_log else edges)
        is_even = is_even and bool(np.ptp(sizes) < 1e-6 * sizes[0])
        limits.append((float(edges[0]), float(edges[-1])))
    return (
        map_data.cell_values
        if is_even
        else sample_map_at_pixels(map_data, limits[0], limits[1], _PIXELS)
    ), limits
