"""View of a laboratory record, for selecting a window and steps to fit."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
import panel as pn
import xarray as xr

from rsfstudy.api import fit
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.explorer.base_view import ExplorerView
from rsfstudy.explorer.error_messages import escape_markdown
from rsfstudy.explorer.fit_choice_widgets import create_fit_choice_widgets, describe_loading_step
from rsfstudy.explorer.fit_choices import FitChoices, format_fit_command
from rsfstudy.explorer.record_plot import RecordPlot
from rsfstudy.explorer.scene_settings import format_python_call, format_values_as_python_code
from rsfstudy.fitting import Record
from rsfstudy.plots import Figure
from rsfstudy.reporting import (
    SummaryTableOrSentence,
    TextTable,
    build_summary_tables_and_sentences,
    summarise_fits_as_json_fields,
)
from rsfstudy.rig import read_record

#: Choices that decide how the file is read.
_FILE_READING_CHOICES = ("columns", "decimal", "normal_stress")
#: Keys of a state that are not fields of ``FitChoices``.
_X_KEY, _FITTED_KEY = "x", "fitted"
#: Argument in the messages about decimal commas, and the remedy on the page.
_DECIMAL_ARGUMENT = "decimal=','"
_DECIMAL_REMEDY = "On this page, select ',' as the Decimal separator in the card Columns."


class RecordView(ExplorerView):
    """View of a laboratory record and its fits.

    Parameters
    ----------
    source : Path, xarray.Dataset or Record
        File of a record, or record in memory.
    """

    title = "Record"
    download_file_stem = "fit"

    def __init__(self, source: Any) -> None:
        """Create the widgets, and read the record."""
        super().__init__(source)
        self._record: Record | None = None
        self._window: Record | None = None
        self._reading: dict[str, Any] = {}
        self._fit: xr.Dataset | None = None
        self._excluded: tuple[float, ...] = ()
        self._is_updating = False
        self._widgets = create_fit_choice_widgets()
        self._columns_card = pn.Card(
            *(self._widgets[name] for name in ("columns", "decimal")),
            title="Columns",
            collapsed=True,
        )
        self._x = pn.widgets.RadioButtonGroup(
            label="Horizontal axis", value="time",
            options={"Time": "time", "Displacement": "displacement"},
        )  # fmt: skip
        self._steps = pn.widgets.CheckBoxGroup(label="Steps to fit", options={}, value=[])
        self._fit_button = pn.widgets.Button(label="Fit", color="primary")
        self._whole_button = pn.widgets.Button(label="Whole record")
        self._plot = RecordPlot(self._select_fit_window, self._toggle_step_exclusion)
        drawn = pn.pane.Bokeh(self._plot.layout, sizing_mode="stretch_width")
        self._plots = pn.Column(drawn, sizing_mode="stretch_width")
        self._summary = pn.Column(sizing_mode="stretch_width")
        self._statuses = pn.pane.DataFrame(pd.DataFrame(), index=False)
        self._connect_widgets()
        self._read_record()

    # ---- parts of the page ----------------------------------------------------------------------

    def list_control_widgets(self) -> list[Any]:
        """Return the widgets in the left column."""
        named = self._widgets
        details = [named[n] for n in ("slip_distance", "before", "after", "noise", "loading")]
        return [
            pn.pane.Markdown("Drag in a plot to choose the window. Click a step to exclude it."),
            self._x,
            self._columns_card,
            named["normal_stress"],
            pn.Row(named["begin"], named["end"]),
            self._whole_button,
            pn.pane.Markdown("Steps to fit", margin=(5, 10, 0, 10)),
            pn.Column(self._steps, max_height=170, scroll=True),
            *(named[name] for name in ("laws", "stiffness", "trend_degree", "more_free")),
            pn.Card(*details, named["together"], title="More choices", collapsed=True),
            self._fit_button,
        ]

    def list_plot_panes(self) -> list[Any]:
        """Return the plots and the tables in the right column."""
        return [self._plots, self._summary]

    def build_status_tables(self) -> list[Any]:
        """Return the table of the statuses of the fits."""
        return [self._statuses]

    # ---- choices --------------------------------------------------------------------------------

    @property
    def fit_choices(self) -> FitChoices:
        """Choices of the user."""
        values = {name: widget.value for name, widget in self._widgets.items()}
        values["laws"], values["more_free"] = tuple(values["laws"]), tuple(values["more_free"])
        return FitChoices(**values, excluded=self._excluded)

    def get_widget_state(self) -> dict[str, Any]:
        """Return the choices that differ from their defaults."""
        default = asdict(FitChoices())
        state = {n: value for n, value in asdict(self.fit_choices).items() if value != default[n]}
        state |= {_X_KEY: self._x.value} if self._x.value != "time" else {}
        return state | ({_FITTED_KEY: True} if self._fit is not None else {})

    def set_widget_state(self, widget_state: Mapping[str, Any]) -> None:
        """Set the choices, read the record, and fit it if the state contains a fit."""
        rest = {
            name: widget_state[name] for name in widget_state if name not in (_X_KEY, _FITTED_KEY)
        }
        chosen = FitChoices.from_widget_state(asdict(self.fit_choices) | rest)
        with self._ignore_widget_changes():
            self._x.value = widget_state.get(_X_KEY, self._x.value)
            self._excluded = chosen.excluded
            for name, widget in self._widgets.items():
                value = getattr(chosen, name)
                widget.value = [*value] if isinstance(value, tuple) else value
        self._read_record()
        if widget_state.get(_FITTED_KEY):
            self._start_fit()

    @contextmanager
    def _ignore_widget_changes(self) -> Iterator[None]:
        """Ignore widget changes that are made by the view and not by the user."""
        self._is_updating = True
        try:
            yield
        finally:
            self._is_updating = False

    def _connect_widgets(self) -> None:
        """Call the methods of the view when the user changes a widget."""

        def watch(widget: Any, method: Callable[[], None]) -> None:
            widget.param.watch(
                lambda _event: None if self._is_updating else _call_with_document_lock(method),
                "value",
            )

        methods = dict.fromkeys(_FILE_READING_CHOICES, self._read_record)
        methods |= dict.fromkeys(("begin", "end"), self._detect_and_show_steps_in_window)
        methods["stiffness"] = self._apply_new_stiffness
        for name, widget in self._widgets.items():
            watch(widget, methods.get(name, self._discard_outdated_fit))
        watch(self._x, self._show_record)
        watch(self._steps, self._store_excluded_step_times)
        self._fit_button.on_click(lambda _event: _call_with_document_lock(self._start_fit))
        self._whole_button.on_click(
            lambda _event: _call_with_document_lock(lambda: self._select_fit_window(None, None))
        )

    # ---- record, window and steps ---------------------------------------------------------------

    def _read_record(self) -> None:
        """Read the record with the chosen columns and normal stress."""
        self.hide_error()
        self._record = self._window = None
        with self.show_raised_errors():
            self._reading = self.fit_choices.build_read_record_arguments()
            try:
                self._record = read_record(self.source, **self._reading)
            except InvalidValue as error:
                if _DECIMAL_ARGUMENT in str(error):
                    self._columns_card.collapsed = False
                    raise DataError(f"{error} {_DECIMAL_REMEDY}") from error
                if error.name != "slip":
                    raise
                self._reading = self.fit_choices.add_stiffness_for_slip_record(self._reading)
                self._record = read_record(self.source, **self._reading)
        self._show_record()

    def _show_record(self) -> None:
        """Show the record against time or displacement."""
        self._plots.visible = self._record is not None
        if self._record is not None:
            self._plot.show_record(self._record, self._x.value)
        self._detect_and_show_steps_in_window()

    def _detect_and_show_steps_in_window(self) -> None:
        """Detect the steps in the window, and show them."""
        if self._record is not None:
            self.hide_error()
            with self.show_raised_errors():
                self._window = self.fit_choices.extract_fit_window(self._record)
        self._plot.shade_rows_outside_window(self.fit_choices.begin, self.fit_choices.end)
        self._show_steps_to_fit()

    def _show_steps_to_fit(self) -> None:
        """Show which steps are fitted."""
        steps = self._window.loading_steps if self._window is not None else ()
        excluded = self.fit_choices.find_excluded_step_numbers(steps)
        with self._ignore_widget_changes():
            self._steps.options = {
                describe_loading_step(n, s): n for n, s in enumerate(steps, start=1)
            }
            self._steps.value = [n for n in range(1, len(steps) + 1) if n not in excluded]
        self._plot.mark_steps_and_holds(steps, excluded)
        self._discard_outdated_fit()

    def _apply_new_stiffness(self) -> None:
        """Apply a new stiffness, and read the record again if necessary."""
        if self._record is None or "stiffness" in self._reading:
            self._read_record()
        else:
            self._discard_outdated_fit()

    def _select_fit_window(self, start_time: float | None, end_time: float | None) -> None:
        """Restrict the fit to the rows between two times, which are given in s."""
        with self._ignore_widget_changes():
            self._widgets["begin"].value, self._widgets["end"].value = start_time, end_time
        self._detect_and_show_steps_in_window()

    def _toggle_step_exclusion(self, step_index: int) -> None:
        """Include or exclude a step."""
        number = step_index + 1
        included = {*self._steps.value} ^ {number}
        self._steps.value = sorted(included)

    def _store_excluded_step_times(self) -> None:
        """Store the times of the excluded steps in the window."""
        assert self._window is not None
        steps, choices = self._window.loading_steps, self.fit_choices
        kept = [
            time
            for time in self._excluded
            if choices.find_step_number_at_excluded_time(steps, time) is None
        ]
        excluded = [
            float(f"{s.start:.9g}") for n, s in enumerate(steps, 1) if n not in self._steps.value
        ]
        self._excluded = (*kept, *excluded)
        self._show_steps_to_fit()

    # ---- fit ------------------------------------------------------------------------------------

    def _discard_outdated_fit(self) -> None:
        """Remove the outdated fit, and update the displayed code."""
        self.jobs.cancel_all()
        self._show_fit(None)

    def _start_fit(self) -> None:
        """Fit the record in the background."""
        if self._window is None:
            return
        self.hide_error()
        with self.show_raised_errors():
            record, choices, arguments = self._window, self.fit_choices, self._build_fit_arguments()

            def compute(report: Callable[[float, str], None]) -> xr.Dataset:
                def progress(done: int, total: int, _remaining: float | None = None) -> None:
                    report(done / total, f"{done} of {total} fits")

                return fit(record, progress=progress, **arguments)

            def deliver(dataset: xr.Dataset) -> None:
                if self.fit_choices == choices:
                    self._show_fit(dataset)

            self.jobs.start(compute, deliver, self.show_error, progress_label="Fitting")

    def _show_fit(self, fit_dataset: xr.Dataset | None) -> None:
        """Show the fitted curves, the residuals and the tables."""
        self._fit = fit_dataset
        self._plot.show_fit(fit_dataset)
        pieces = [] if fit_dataset is None else build_summary_tables_and_sentences(fit_dataset)
        self._summary[:] = [_create_summary_pane(piece) for piece in pieces]
        values = [] if fit_dataset is None else summarise_fits_as_json_fields(fit_dataset)
        names = ("record", "step", "law", "status", "message")
        self._statuses.object = pd.DataFrame([{n: v[n] for n in names} for v in values])
        self.update_displayed_code_and_url()

    def _require_finished_fit(self) -> xr.Dataset:
        """Return the fit, or raise ``DataError`` if the record is not fitted."""
        if self._fit is None:
            raise DataError("The record is not fitted with these choices. Press the button Fit.")
        return self._fit

    # ---- code and downloads ---------------------------------------------------------------------

    def format_equivalent_python_code(self) -> str:
        """Return Python code that reads and fits the record, and prints the fit table."""
        path, lines = self._record_file_path, ["import rsfstudy", ""]
        source = json.dumps(path) if path else "record"
        if not path:
            lines.append("# `record` is the object that was passed to rsfstudy.explore.")
        reading, fitting = (
            self._reading | self.fit_choices.build_window_limit_arguments(),
            self._build_fit_arguments(),
        )
        if path or reading:
            arguments = format_values_as_python_code(reading)
            lines.append(
                f"record = {format_python_call('rsfstudy.read_record', arguments, source)}"
            )
        lines.append(
            "fit = "
            f"{format_python_call('rsfstudy.fit', format_values_as_python_code(fitting), 'record')}"
        )
        return "\n".join([*lines, "print(fit.rsf.fit_table().T)"])

    def format_equivalent_command_line(self) -> str:
        """Return the ``rsfstudy fit`` command with the options that match the user's choices."""
        if not self._record_file_path:
            return "# The command line needs a record in a file."
        reading = self._reading | self.fit_choices.build_window_limit_arguments()
        return format_fit_command(self._record_file_path, reading | self._build_fit_arguments())

    @property
    def _record_file_path(self) -> str:
        """Path of the file, or an empty string if the record is in memory."""
        return str(self.source) if isinstance(self.source, str | Path) else ""

    def _build_fit_arguments(self) -> dict[str, Any]:
        """Return the keyword arguments of ``rsfstudy.fit``."""
        return self.fit_choices.build_fit_arguments(
            self._window.loading_steps if self._window else ()
        )

    def draw_figure_for_download(self) -> Figure:
        """Return the figure of the fit."""
        drawn: Figure = self._require_finished_fit().rsf.plot()
        return drawn

    def build_table_for_download(self) -> pd.DataFrame:
        """Return the table of the fit, with one row per law and step."""
        fits: pd.DataFrame = self._require_finished_fit().rsf.fit_table()
        return fits

    def build_dataset_for_download(self) -> xr.Dataset:
        """Return the dataset of the fit."""
        return self._require_finished_fit()


def _call_with_document_lock(method: Callable[[], None]) -> None:
    """Hold the document lock while calling a method that changes Bokeh models."""
    document = pn.state.curdoc
    if document is None or not document.session_context:
        method()
    else:
        document.add_next_tick_callback(method)


def _create_summary_pane(table_or_sentence: SummaryTableOrSentence) -> Any:
    """Return a Panel object that shows a table or a sentence."""
    if not isinstance(table_or_sentence, TextTable):
        return _create_sentence_pane(str(table_or_sentence))
    table = pn.pane.DataFrame(pd.DataFrame(table_or_sentence.rows), index=False)
    return pn.Column(_create_sentence_pane(table_or_sentence.caption), table)


def _create_sentence_pane(text: str) -> Any:
    """Return a Panel object that shows a sentence with line breaks."""
    return pn.pane.Markdown(escape_markdown(text), margin=(0, 10), sizing_mode="stretch_width")
