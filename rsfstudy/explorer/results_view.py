"""View of the results of a study."""

from __future__ import annotations

import html
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import panel as pn
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.base_view import ExplorerView
from rsfstudy.explorer.cell_recomputation import (
    RecomputedCell,
    draw_motion_figures,
    find_cell_coordinates,
    recompute_cell_and_motion,
    tabulate_recomputed_outcome,
)
from rsfstudy.explorer.curve_and_map_data import (
    convert_mathtext_to_unicode,
    describe_selected_points,
    format_status_name,
    iterate_panel_selections,
    list_plotted_variable_names,
)
from rsfstudy.explorer.plot_selections import (
    LINES,
    MAP,
    PlotSelection,
    complete_plot_selection,
    find_dimension_along_x,
    list_map_dimensions,
    list_plottable_variables,
    list_x_axis_choices,
)
from rsfstudy.explorer.reproduction_code import (
    draw_figure_of_selection,
    format_selection_as_python_code,
    format_selection_as_shell_commands,
)
from rsfstudy.explorer.result_figures import CurvesPlot, MapPlot, ResultPlot
from rsfstudy.formatting import format_fields_except_none
from rsfstudy.plots import Figure, draw_figure, render_figure
from rsfstudy.reporting import build_failed_cells_table, count_cells_by_status
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Height in pixels of a single panel and of one of several panels.
_HEIGHT, _HEIGHT_OF_FACET = 420, 330
#: Style of a column that shows panels side by side if the page is wide enough.
_SIDE_BY_SIDE_GRID_STYLE = {
    "display": "grid",
    "grid-template-columns": "repeat(auto-fit, minmax(380px, 1fr))",
}
#: Number of points of a dimension above which the cell is chosen by its index.
_MAX_OPTIONS_OF_SELECT_WIDGET = 100
_STRETCH_WIDTH_OPTIONS: dict[str, Any] = {"sizing_mode": "stretch_width"}
_SELECTION_FIELD_NAMES = ("variable", "kind", "x", "second_dimension", "facet")
_LABEL_OF_NO_DIMENSION = "(none)"
_PLOT_KIND_BY_LABEL = {"Lines": LINES, "Map": MAP}


class ResultsView(ExplorerView):
    """View that shows a plot of study results, the figure of the study, and single cells.

    Parameters
    ----------
    source : xarray.Dataset
        Results of a study, as ``rsfstudy.open`` or ``rsfstudy.run`` returns them.

    Attributes
    ----------
    selection : PlotSelection
        Variable, axes and points that the plot shows.
    """

    def __init__(self, source: xr.Dataset) -> None:
        """Create the widgets and the first plot."""
        super().__init__(source)
        StoredDataset(source).check_contains_study_results("the dataset")
        self.results = source
        self.shown = DatasetUnits(source).convert_to_display_units()
        self.file = str(source.encoding.get("source", ""))
        self.title = str(source.attrs.get("title", "Results of a study"))
        self.download_file_stem = str(source.attrs.get("id", "results"))
        self.selection = complete_plot_selection(self.shown)
        self.cell: RecomputedCell | None = None
        self._cell_number = -1
        self._plots: list[ResultPlot] = []
        self._is_updating = False
        self._create_widgets()
        self._update_widgets()
        self._build_plots()

    # ---- widgets --------------------------------------------------------------------------------

    def _create_widgets(self) -> None:
        """Create the widgets, and connect them with the plot."""
        names = ("Variable", "Plot", "x", "Colour", "Facets")
        self._choices = {
            key: pn.widgets.Select(label=name, **_STRETCH_WIDTH_OPTIONS)
            for key, name in zip(_SELECTION_FIELD_NAMES, names, strict=True)
        }
        for key, widget in self._choices.items():
            widget.param.watch(partial(self._handle_choice_change, key), "value")
        self._sliders: dict[str, Any] = {}
        self._slider_column = pn.Column(**_STRETCH_WIDTH_OPTIONS)
        self._plot_area = pn.Column(styles=_SIDE_BY_SIDE_GRID_STYLE, **_STRETCH_WIDTH_OPTIONS)
        self._cell_area = pn.Column(**_STRETCH_WIDTH_OPTIONS)
        self._figure_area = pn.Column(**_STRETCH_WIDTH_OPTIONS, min_height=200)
        self._tabs = pn.Tabs(
            ("Plot", pn.Column(self._plot_area, self._cell_area, **_STRETCH_WIDTH_OPTIONS)),
            ("Figure of the study", self._figure_area),
            **_STRETCH_WIDTH_OPTIONS,
        )
        self._tabs.param.watch(self._handle_tab_change, "active")
        self._cell_choices = {
            str(d): _create_cell_choice_widget(self.results, str(d))
            for d in self.results["status"].dims
        }
        self._cell_button = pn.widgets.Button(label="Show the cell", color="primary")
        self._cell_button.on_click(lambda _event: self._show_chosen_cell())

    def list_control_widgets(self) -> list[Any]:
        """Return the selectors, the sliders and the widgets that select a cell."""
        hint = "Click a point or a position of a map, or choose the cell here."
        cell = pn.Card(
            pn.pane.Markdown(hint, margin=(0, 5)),
            *self._cell_choices.values(),
            self._cell_button,
            title="Cell",
            **_STRETCH_WIDTH_OPTIONS,
        )
        return [*self._choices.values(), self._slider_column, cell]

    def list_plot_panes(self) -> list[Any]:
        """Return the tabs that show the plot and the figure declared by the study."""
        return [self._tabs]

    def build_status_tables(self) -> list[Any]:
        """Return tables of the statuses and of the failed cells."""
        counts = [
            {"status": label, "cells": count, "meaning": Status[label.upper()].meaning}
            for label, count in count_cells_by_status(self.results).items()
        ]
        tables = [pn.pane.DataFrame(pd.DataFrame(counts), index=False)]
        failures = build_failed_cells_table(self.results, self.file)
        if failures.rows:
            tables.append(pn.pane.Str(failures.caption))
            tables.append(pn.pane.DataFrame(pd.DataFrame(failures.rows), index=False))
        return tables

    def _update_widgets(self) -> None:
        """Update the options and values of all widgets to match the selection."""
        shown, selection = self.shown, self.selection
        plane = list_map_dimensions(shown, selection.variable)
        is_map = selection.kind == MAP
        along = find_dimension_along_x(shown, selection.variable, selection.x)
        others = [d for d in map(str, shown[selection.variable].dims) if d != along]
        nothing = {_LABEL_OF_NO_DIMENSION: ""}
        named = {d: d for d in others if shown.sizes[d] > 1}
        facets = {d: d for d in named if d != selection.second_dimension}
        options: dict[str, Any] = {
            "variable": list_plottable_variables(shown),
            "kind": _PLOT_KIND_BY_LABEL if len(plane) > 1 else {"Lines": LINES},
            "x": plane if is_map else list_x_axis_choices(shown, selection.variable),
            "second_dimension": [d for d in plane if d != selection.x]
            if is_map
            else nothing | named,
            "facet": nothing | facets,
        }
        self._is_updating = True
        try:
            for key, widget in self._choices.items():
                widget.param.update(options=options[key], value=getattr(selection, key))
            self._choices["second_dimension"].label = "Vertical axis" if is_map else "Colour"
            self._update_dimension_sliders()
        finally:
            self._is_updating = False

    def _update_dimension_sliders(self) -> None:
        """Create a slider for each remaining dimension, and set its value."""
        points = {
            d: i
            for d, i in self.selection.point_index_by_dimension.items()
            if self.shown.sizes[d] > 1
        }
        if list(points) != list(self._sliders):
            self._sliders = {d: _create_dimension_slider(self.shown, d) for d in points}
            for name, slider in self._sliders.items():
                watched = "value_throttled" if hasattr(slider, "value_throttled") else "value"
                slider.param.watch(partial(self._handle_slider_change, name), watched)
            self._slider_column[:] = list(self._sliders.values())
        for name, slider in self._sliders.items():
            slider.value = points[name]
            if isinstance(slider, pn.widgets.IntSlider):
                slider.label = convert_mathtext_to_unicode(
                    describe_selected_points(self.shown, {name: points[name]})
                )

    def _handle_choice_change(self, selection_field: str, event: Any) -> None:
        """Change one choice of the selection."""
        if self._is_updating or event.new == getattr(self.selection, selection_field):
            return
        wishes = {name: getattr(self.selection, name) for name in _SELECTION_FIELD_NAMES} | {
            selection_field: event.new
        }
        if selection_field == "kind":
            wishes |= {"x": None, "second_dimension": None}
        with self.show_raised_errors():
            self._show_selection(
                complete_plot_selection(
                    self.shown, **wishes, points=self.selection.point_index_by_dimension
                )
            )

    def _handle_slider_change(self, dimension: str, event: Any) -> None:
        """Change the point of a dimension."""
        if self._is_updating or event.new == self.selection.point_index_by_dimension.get(dimension):
            return
        with self.show_raised_errors():
            self._show_selection(
                self._build_selection_with_points(
                    {**self.selection.point_index_by_dimension, dimension: event.new}
                )
            )

    def _build_selection_with_points(self, point_indices: Mapping[str, int]) -> PlotSelection:
        """Return a copy of the selection with different fixed points."""
        wishes = {name: getattr(self.selection, name) for name in _SELECTION_FIELD_NAMES}
        return complete_plot_selection(self.shown, **wishes, points=point_indices)

    def _show_selection(self, selection: PlotSelection) -> None:
        """Show another selection.

        If only the points of fixed dimensions have changed, the existing figures are updated.
        """
        old, self.selection = self.selection, selection
        self.hide_error()
        self._update_widgets()
        if all(getattr(old, name) == getattr(selection, name) for name in _SELECTION_FIELD_NAMES):
            for plot, panel in zip(
                self._plots, iterate_panel_selections(self.shown, selection), strict=True
            ):
                plot.update_data(self.shown, panel)
        else:
            self._build_plots()
        self.update_displayed_code_and_url()

    # ---- plots ----------------------------------------------------------------------------------

    def _build_plots(self) -> None:
        """Build the figures of all panels."""
        panels = list(iterate_panel_selections(self.shown, self.selection))
        kind: Any = MapPlot if self.selection.kind == MAP else CurvesPlot
        height = _HEIGHT if len(panels) == 1 else _HEIGHT_OF_FACET
        self._plots = [
            kind(self.shown, panel, self._start_cell_recomputation, height) for panel in panels
        ]
        for plot in self._plots[1:]:
            plot.share_axis_limits_with(self._plots[0])
        self._plot_area[:] = [
            pn.pane.Bokeh(plot.figure, **_STRETCH_WIDTH_OPTIONS) for plot in self._plots
        ]

    def _handle_tab_change(self, event: Any) -> None:
        """Draw the figure declared by the study when its tab is first opened."""
        if event.new == 1 and not len(self._figure_area):
            self.jobs.start(
                lambda _report: render_figure(draw_figure(self.results), "png"),
                self._show_figure_of_study,
                self.show_error,
                progress_label="Drawing the figure of the study",
            )

    def _show_figure_of_study(self, png_image: bytes) -> None:
        """Show the declared figure."""
        self._figure_area[:] = [
            pn.pane.PNG(
                png_image, sizing_mode="scale_width", max_width=1000, alt_text="figure of the study"
            )
        ]

    # ---- cells ----------------------------------------------------------------------------------

    def _show_chosen_cell(self) -> None:
        """Show the cell that the widgets select."""
        index = [widget.value for widget in self._cell_choices.values()]
        self._start_cell_recomputation(
            int(np.ravel_multi_index(index, self.results["status"].shape))
        )

    def _start_cell_recomputation(self, cell_number: int) -> None:
        """Show the stored status of a cell, and compute the cell again in a thread."""
        index = np.unravel_index(cell_number, self.results["status"].shape)
        for widget, at in zip(self._cell_choices.values(), index, strict=True):
            widget.value = int(at)
        self.cell, self._cell_number = None, cell_number
        place = find_cell_coordinates(self.results, cell_number)
        stored = self.results[["status", "message"]].sel(place)
        text = format_status_name(int(stored["status"]))
        message = str(stored["message"].item())
        self._cell_area[:] = [
            _create_text_pane(format_fields_except_none(place), "bold"),
            _create_text_pane(f"{text}{': ' * bool(message)}{message}"),
        ]
        self.jobs.start(
            partial(recompute_cell_and_motion, self.results, cell_number),
            self._show_recomputed_cell,
            self.show_error,
            progress_label="Computing the cell",
        )
        self.update_displayed_code_and_url()

    def _show_recomputed_cell(self, recomputed_cell: RecomputedCell) -> None:
        """Show the scene, the outcome and the motion of a cell."""
        self.cell, outcome = recomputed_cell, recomputed_cell.measure_outcome
        fields = _create_text_pane(format_fields_except_none(recomputed_cell.scene.as_dict()))
        table = pn.pane.DataFrame(
            tabulate_recomputed_outcome(recomputed_cell, self.results),
            index=False,
            float_format="{:.9g}".format,
        )
        figures = [
            pn.pane.Bokeh(figure, **_STRETCH_WIDTH_OPTIONS)
            for figure in draw_motion_figures(recomputed_cell.motion)
        ]
        self._cell_area[:] = [
            *self._cell_area[:2],
            pn.Card(fields, title="Scene", collapsed=True, **_STRETCH_WIDTH_OPTIONS),
            _create_text_pane(
                f"Computed again: {format_status_name(int(outcome.status))}, "
                f"{outcome.rhs_evaluations:,} right-hand-side evaluations"
            ),
            table,
            pn.Column(*figures, styles=_SIDE_BY_SIDE_GRID_STYLE, **_STRETCH_WIDTH_OPTIONS),
            _create_text_pane(recomputed_cell.motion_explanation),
        ]
        self.update_displayed_code_and_url()

    # ---- state, code and downloads --------------------------------------------------------------

    def get_widget_state(self) -> dict[str, Any]:
        """Return the selection and the cell. See ``ExplorerView.get_widget_state``."""
        choices = {name: getattr(self.selection, name) for name in _SELECTION_FIELD_NAMES}
        state = choices | {"points": dict(self.selection.point_index_by_dimension)}
        return state | ({"cell": self._cell_number} if self._cell_number >= 0 else {})

    def set_widget_state(self, widget_state: Mapping[str, Any]) -> None:
        """Set the selection and the cell. See ``ExplorerView.set_widget_state``."""
        known = (*_SELECTION_FIELD_NAMES, "points", "cell")
        for name in widget_state:
            if name not in known:
                raise InvalidValue("state", name, "is not a setting of this view", choices=known)
        wishes = {name: widget_state[name] for name in widget_state if name != "cell"}
        self._show_selection(complete_plot_selection(self.shown, **wishes))
        if "cell" in widget_state:
            number, size = widget_state["cell"], self.results["status"].size
            if not isinstance(number, int) or not 0 <= number < size:
                rule = f"is not the number of a cell, from 0 to {size - 1}"
                raise InvalidValue("cell", number, rule)
            self._start_cell_recomputation(number)

    def format_equivalent_python_code(self) -> str:
        """Return code that prints the numbers of the plot.

        See ``ExplorerView.format_equivalent_python_code``.
        """
        return format_selection_as_python_code(
            self.shown, self.selection, self.file, self.cell, self._find_chosen_cell_coordinates()
        )

    def format_equivalent_command_line(self) -> str:
        """Return commands that export the results.

        See ``ExplorerView.format_equivalent_command_line``.
        """
        return format_selection_as_shell_commands(
            self.selection, self.file, self.widget_state_json, self._find_chosen_cell_coordinates()
        )

    def _find_chosen_cell_coordinates(self) -> dict[str, Any] | None:
        """Return the coordinates of the chosen cell, or None."""
        number = self._cell_number
        return find_cell_coordinates(self.results, number) if number >= 0 else None

    def draw_figure_for_download(self) -> Figure:
        """Return the figure of the open tab. See ``ExplorerView.draw_figure_for_download``."""
        if self._tabs.active == 1:
            return draw_figure(self.results)
        return draw_figure_of_selection(self.shown, self.selection)

    def build_table_for_download(self) -> pd.DataFrame:
        """Return the numbers of the plot. See ``ExplorerView.build_table_for_download``."""
        part = self.build_dataset_for_download()
        kept = {
            *map(str, part.data_vars),
            *map(str, part.dims),
            *self.selection.point_index_by_dimension,
        }
        kept |= {self.selection.x}
        table = part.drop_vars([n for n in part.coords if n not in kept]).to_dataframe()
        table = table.reset_index()
        if "status" in table:
            table["status"] = table["status"].map(Status.labels_by_code())
        return table

    def build_dataset_for_download(self) -> xr.Dataset:
        """Return the results that the plot shows.

        See ``ExplorerView.build_dataset_for_download``.
        """
        names = list_plotted_variable_names(self.shown, self.selection)
        return self.shown[names].isel(dict(self.selection.point_index_by_dimension))


def _create_text_pane(text: str, font_weight: str = "normal") -> pn.pane.HTML:
    """Return a pane that displays text and wraps long lines."""
    return pn.pane.HTML(
        html.escape(text), styles={"font-weight": font_weight}, **_STRETCH_WIDTH_OPTIONS
    )


def _create_dimension_slider(dataset: xr.Dataset, dimension: str) -> Any:
    """Return a widget whose value is the index of a point of a dimension."""
    points = dataset[dimension].values
    if points.dtype.kind in "iuf":
        return pn.widgets.IntSlider(start=0, end=points.size - 1, **_STRETCH_WIDTH_OPTIONS)
    options = {str(point): index for index, point in enumerate(points)}
    return pn.widgets.Select(label=dimension, options=options, **_STRETCH_WIDTH_OPTIONS)


def _create_cell_choice_widget(results: xr.Dataset, dimension: str) -> Any:
    """Return a widget that selects a point of a dimension by its value or its index."""
    points = results[dimension].values
    if points.size > _MAX_OPTIONS_OF_SELECT_WIDGET:
        return pn.widgets.IntInput(
            label=f"Index of {dimension}",
            start=0,
            end=points.size - 1,
            value=0,
            **_STRETCH_WIDTH_OPTIONS,
        )
    options = {str(point): index for index, point in enumerate(points.tolist())}
    return pn.widgets.Select(label=dimension, options=options, value=0, **_STRETCH_WIDTH_OPTIONS)
