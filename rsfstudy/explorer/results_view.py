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
from rsfstudy.explorer.result_arrays import (
    describe_points,
    describe_status,
    iterate_panels,
    part_names,
    to_plain_text,
)
from rsfstudy.explorer.result_cells import (
    RecomputedCell,
    cell_coordinates,
    motion_figures,
    recompute,
    tabulate_outcome,
)
from rsfstudy.explorer.result_code import draw_selection, write_commands, write_python
from rsfstudy.explorer.result_figures import CurvesPlot, MapPlot, Plot
from rsfstudy.explorer.result_selections import (
    LINES,
    MAP,
    Selection,
    complete_selection,
    dimension_along_x,
    list_map_dimensions,
    list_x_choices,
    plotted_variables,
)
from rsfstudy.explorer.view import View
from rsfstudy.formatting import format_nonempty_fields
from rsfstudy.plots import Figure, draw_figure, render_figure
from rsfstudy.reporting import count_statuses, failures_table
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset

#: Height in pixels of a single panel and of one of several panels.
_HEIGHT, _HEIGHT_OF_FACET = 420, 330
#: Style of a column that shows panels side by side if the page is wide enough.
_GRID = {"display": "grid", "grid-template-columns": "repeat(auto-fit, minmax(380px, 1fr))"}
#: Number of points of a dimension above which the cell is chosen by its index.
_MAX_OPTIONS = 100
_WIDE: dict[str, Any] = {"sizing_mode": "stretch_width"}
_CHOICES = ("variable", "kind", "x", "second", "facet")
_NAME_OF_NO_DIMENSION = "(none)"
_KINDS = {"Lines": LINES, "Map": MAP}


class ResultsView(View):
    """View of study results: a plot, the figure declared by the study, and cells.

    Parameters
    ----------
    source : xarray.Dataset
        Results of a study, as ``rsfstudy.open`` or ``rsfstudy.run`` returns them.

    Attributes
    ----------
    selection : Selection
        Variable, axes and points that the plot shows.
    """

    def __init__(self, source: xr.Dataset) -> None:
        """Create the widgets and the first plot."""
        super().__init__(source)
        StoredDataset(source).check_contains_study_results("the dataset")
        self.results = source
        self.shown = DatasetUnits(source).convert_for_display()
        self.file = str(source.encoding.get("source", ""))
        self.title = str(source.attrs.get("title", "Results of a study"))
        self.file_stem = str(source.attrs.get("id", "results"))
        self.selection = complete_selection(self.shown)
        self.cell: RecomputedCell | None = None
        self._cell_number = -1
        self._plots: list[Plot] = []
        self._is_updating = False
        self._create_widgets()
        self._update_widgets()
        self._build_plots()

    # ---- widgets --------------------------------------------------------------------------------

    def _create_widgets(self) -> None:
        """Create the widgets, and connect them with the plot."""
        names = ("Variable", "Plot", "x", "Colour", "Facets")
        self._choices = {
            key: pn.widgets.Select(label=name, **_WIDE)
            for key, name in zip(_CHOICES, names, strict=True)
        }
        for key, widget in self._choices.items():
            widget.param.watch(partial(self._on_choice, key), "value")
        self._sliders: dict[str, Any] = {}
        self._slider_column = pn.Column(**_WIDE)
        self._plot_area = pn.Column(styles=_GRID, **_WIDE)
        self._cell_area = pn.Column(**_WIDE)
        self._figure_area = pn.Column(**_WIDE, min_height=200)
        self._tabs = pn.Tabs(
            ("Plot", pn.Column(self._plot_area, self._cell_area, **_WIDE)),
            ("Figure of the study", self._figure_area),
            **_WIDE,
        )
        self._tabs.param.watch(self._on_tab, "active")
        self._cell_choices = {
            str(d): _create_point_widget(self.results, str(d)) for d in self.results["status"].dims
        }
        self._cell_button = pn.widgets.Button(label="Show the cell", color="primary")
        self._cell_button.on_click(lambda _event: self._show_chosen_cell())

    def controls(self) -> list[Any]:
        """Return the selectors, the sliders and the widgets that select a cell."""
        hint = "Click a point or a position of a map, or choose the cell here."
        cell = pn.Card(
            pn.pane.Markdown(hint, margin=(0, 5)),
            *self._cell_choices.values(),
            self._cell_button,
            title="Cell",
            **_WIDE,
        )
        return [*self._choices.values(), self._slider_column, cell]

    def plots(self) -> list[Any]:
        """Return the tabs that show the plot and the figure declared by the study."""
        return [self._tabs]

    def status(self) -> list[Any]:
        """Return tables of the statuses and of the failed cells."""
        counts = [
            {"status": label, "cells": count, "meaning": Status[label.upper()].meaning}
            for label, count in count_statuses(self.results).items()
        ]
        tables = [pn.pane.DataFrame(pd.DataFrame(counts), index=False)]
        failures = failures_table(self.results, self.file)
        if failures.rows:
            tables.append(pn.pane.Str(failures.caption))
            tables.append(pn.pane.DataFrame(pd.DataFrame(failures.rows), index=False))
        return tables

    def _update_widgets(self) -> None:
        """Update the options and values of all widgets to match the selection."""
        shown, selection = self.shown, self.selection
        plane = list_map_dimensions(shown, selection.variable)
        is_map = selection.kind == MAP
        along = dimension_along_x(shown, selection.variable, selection.x)
        others = [d for d in map(str, shown[selection.variable].dims) if d != along]
        nothing = {_NAME_OF_NO_DIMENSION: ""}
        named = {d: d for d in others if shown.sizes[d] > 1}
        facets = {d: d for d in named if d != selection.second}
        options: dict[str, Any] = {
            "variable": plotted_variables(shown),
            "kind": _KINDS if len(plane) > 1 else {"Lines": LINES},
            "x": plane if is_map else list_x_choices(shown, selection.variable),
            "second": [d for d in plane if d != selection.x] if is_map else nothing | named,
            "facet": nothing | facets,
        }
        self._is_updating = True
        try:
            for key, widget in self._choices.items():
                widget.param.update(options=options[key], value=getattr(selection, key))
            self._choices["second"].label = "Vertical axis" if is_map else "Colour"
            self._update_sliders()
        finally:
            self._is_updating = False

    def _update_sliders(self) -> None:
        """Create a slider for each remaining dimension, and set its value."""
        points = {d: i for d, i in self.selection.points.items() if self.shown.sizes[d] > 1}
        if list(points) != list(self._sliders):
            self._sliders = {d: _create_slider(self.shown, d) for d in points}
            for name, slider in self._sliders.items():
                watched = "value_throttled" if hasattr(slider, "value_throttled") else "value"
                slider.param.watch(partial(self._on_slider, name), watched)
            self._slider_column[:] = list(self._sliders.values())
        for name, slider in self._sliders.items():
            slider.value = points[name]
            if isinstance(slider, pn.widgets.IntSlider):
                slider.label = to_plain_text(describe_points(self.shown, {name: points[name]}))

    def _on_choice(self, key: str, event: Any) -> None:
        """Change one choice of the selection."""
        if self._is_updating or event.new == getattr(self.selection, key):
            return
        wishes = {name: getattr(self.selection, name) for name in _CHOICES} | {key: event.new}
        if key == "kind":
            wishes |= {"x": None, "second": None}
        with self.errors_shown():
            self._select(complete_selection(self.shown, **wishes, points=self.selection.points))

    def _on_slider(self, name: str, event: Any) -> None:
        """Change the point of a dimension."""
        if self._is_updating or event.new == self.selection.points.get(name):
            return
        with self.errors_shown():
            self._select(self._replace_points({**self.selection.points, name: event.new}))

    def _replace_points(self, points: Mapping[str, int]) -> Selection:
        """Return the selection with other points."""
        wishes = {name: getattr(self.selection, name) for name in _CHOICES}
        return complete_selection(self.shown, **wishes, points=points)

    def _select(self, selection: Selection) -> None:
        """Show another selection.

        If the selections differ only in their points, the existing figures are updated.
        """
        old, self.selection = self.selection, selection
        self.hide_error()
        self._update_widgets()
        if all(getattr(old, name) == getattr(selection, name) for name in _CHOICES):
            for plot, panel in zip(self._plots, iterate_panels(self.shown, selection), strict=True):
                plot.update(self.shown, panel)
        else:
            self._build_plots()
        self.refresh()

    # ---- plots ----------------------------------------------------------------------------------

    def _build_plots(self) -> None:
        """Build the figures of all panels."""
        panels = list(iterate_panels(self.shown, self.selection))
        kind: Any = MapPlot if self.selection.kind == MAP else CurvesPlot
        height = _HEIGHT if len(panels) == 1 else _HEIGHT_OF_FACET
        self._plots = [kind(self.shown, panel, self._on_cell, height) for panel in panels]
        for plot in self._plots[1:]:
            plot.share_axes(self._plots[0])
        self._plot_area[:] = [pn.pane.Bokeh(plot.figure, **_WIDE) for plot in self._plots]

    def _on_tab(self, event: Any) -> None:
        """Draw the figure declared by the study when its tab is first opened."""
        if event.new == 1 and not len(self._figure_area):
            self.jobs.start(
                lambda _report: render_figure(draw_figure(self.results), "png"),
                self._show_figure,
                self.show_error,
                label="Drawing the figure of the study",
            )

    def _show_figure(self, image: bytes) -> None:
        """Show the declared figure."""
        self._figure_area[:] = [
            pn.pane.PNG(
                image, sizing_mode="scale_width", max_width=1000, alt_text="figure of the study"
            )
        ]

    # ---- cells ----------------------------------------------------------------------------------

    def _show_chosen_cell(self) -> None:
        """Show the cell that the widgets select."""
        index = [widget.value for widget in self._cell_choices.values()]
        self._on_cell(int(np.ravel_multi_index(index, self.results["status"].shape)))

    def _on_cell(self, number: int) -> None:
        """Show the stored status of a cell, and compute the cell again in a thread."""
        index = np.unravel_index(number, self.results["status"].shape)
        for widget, at in zip(self._cell_choices.values(), index, strict=True):
            widget.value = int(at)
        self.cell, self._cell_number = None, number
        place = cell_coordinates(self.results, number)
        stored = self.results[["status", "message"]].sel(place)
        text = describe_status(int(stored["status"]))
        message = str(stored["message"].item())
        self._cell_area[:] = [
            _show_text(format_nonempty_fields(place), "bold"),
            _show_text(f"{text}{': ' * bool(message)}{message}"),
        ]
        self.jobs.start(
            partial(recompute, self.results, number),
            self._show_cell,
            self.show_error,
            label="Computing the cell",
        )
        self.refresh()

    def _show_cell(self, cell: RecomputedCell) -> None:
        """Show the scene, the outcome and the motion of a cell."""
        self.cell = cell
        fields = _show_text(format_nonempty_fields(cell.scene.as_dict()))
        table = pn.pane.DataFrame(
            tabulate_outcome(cell, self.results), index=False, float_format="{:.9g}".format
        )
        figures = [pn.pane.Bokeh(figure, **_WIDE) for figure in motion_figures(cell.motion)]
        self._cell_area[:] = [
            *self._cell_area[:2],
            pn.Card(fields, title="Scene", collapsed=True, **_WIDE),
            _show_text(
                f"Computed again: {describe_status(int(cell.outcome.status))}, "
                f"{cell.outcome.rhs_evaluations:,} right-hand-side evaluations"
            ),
            table,
            pn.Column(*figures, styles=_GRID, **_WIDE),
            _show_text(cell.note),
        ]
        self.refresh()

    # ---- state, code and downloads --------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return the selection and the cell. See ``View.state``."""
        choices = {name: getattr(self.selection, name) for name in _CHOICES}
        state = choices | {"points": dict(self.selection.points)}
        return state | ({"cell": self._cell_number} if self._cell_number >= 0 else {})

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Set the selection and the cell. See ``View.set_state``."""
        known = (*_CHOICES, "points", "cell")
        for name in state:
            if name not in known:
                raise InvalidValue("state", name, "is not a setting of this view", choices=known)
        wishes = {name: state[name] for name in state if name != "cell"}
        self._select(complete_selection(self.shown, **wishes))
        if "cell" in state:
            number, size = state["cell"], self.results["status"].size
            if not isinstance(number, int) or not 0 <= number < size:
                rule = f"is not the number of a cell, from 0 to {size - 1}"
                raise InvalidValue("cell", number, rule)
            self._on_cell(number)

    def python_code(self) -> str:
        """Return code that prints the numbers of the plot. See ``View.python_code``."""
        return write_python(self.shown, self.selection, self.file, self.cell, self._cell_place())

    def command_line(self) -> str:
        """Return commands that export the results. See ``View.command_line``."""
        return write_commands(self.selection, self.file, self.state_text, self._cell_place())

    def _cell_place(self) -> dict[str, Any] | None:
        """Return the coordinates of the chosen cell, or None."""
        number = self._cell_number
        return cell_coordinates(self.results, number) if number >= 0 else None

    def figure(self) -> Figure:
        """Return the figure of the open tab. See ``View.figure``."""
        if self._tabs.active == 1:
            return draw_figure(self.results)
        return draw_selection(self.shown, self.selection)

    def table(self) -> pd.DataFrame:
        """Return the numbers of the plot. See ``View.table``."""
        part = self.dataset()
        kept = {*map(str, part.data_vars), *map(str, part.dims), *self.selection.points}
        kept |= {self.selection.x}
        table = part.drop_vars([n for n in part.coords if n not in kept]).to_dataframe()
        table = table.reset_index()
        if "status" in table:
            table["status"] = table["status"].map(Status.labels_by_code())
        return table

    def dataset(self) -> xr.Dataset:
        """Return the results that the plot shows. See ``View.dataset``."""
        names = part_names(self.shown, self.selection)
        return self.shown[names].isel(dict(self.selection.points))


def _show_text(text: str, weight: str = "normal") -> pn.pane.HTML:
    """Return a pane that displays text and wraps long lines."""
    return pn.pane.HTML(html.escape(text), styles={"font-weight": weight}, **_WIDE)


def _create_slider(dataset: xr.Dataset, dimension: str) -> Any:
    """Return a widget whose value is the index of a point of a dimension."""
    points = dataset[dimension].values
    if points.dtype.kind in "iuf":
        return pn.widgets.IntSlider(start=0, end=points.size - 1, **_WIDE)
    options = {str(point): index for index, point in enumerate(points)}
    return pn.widgets.Select(label=dimension, options=options, **_WIDE)


def _create_point_widget(results: xr.Dataset, dimension: str) -> Any:
    """Return a widget that selects a point of a dimension by its value or its index."""
    points = results[dimension].values
    if points.size > _MAX_OPTIONS:
        return pn.widgets.IntInput(
            label=f"Index of {dimension}", start=0, end=points.size - 1, value=0, **_WIDE
        )
    options = {str(point): index for index, point in enumerate(points.tolist())}
    return pn.widgets.Select(label=dimension, options=options, value=0, **_WIDE)
