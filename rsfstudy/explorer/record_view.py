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
from rsfstudy.explorer.fit_choices import FitChoices, format_fit_command
from rsfstudy.explorer.messages import escape_markdown
from rsfstudy.explorer.record_plot import RecordPlot
from rsfstudy.explorer.record_widgets import create_choice_widgets, format_step
from rsfstudy.explorer.scene_settings import format_call, quote_values
from rsfstudy.explorer.view import View
from rsfstudy.fitting import Record
from rsfstudy.plots import Figure
from rsfstudy.reporting import (
    SummaryTableOrSentence,
    TextTable,
    build_summary_tables_and_sentences,
    list_fit_values,
)
from rsfstudy.rig import read_record

#: Choices that decide how the file is read.
_READING_CHOICES = ("columns", "decimal", "normal_stress")
#: Keys of a state that are not fields of ``FitChoices``.
_X_KEY, _FITTED_KEY = "x", "fitted"


class RecordView(View):
    """View of a laboratory record and its fits.

    Parameters
    ----------
    source : Path, xarray.Dataset or Record
        File of a record, or record in memory.
    """

    title = "Record"
    file_stem = "fit"

    def __init__(self, source: Any) -> None:
        """Create the widgets, and read the record."""
        super().__init__(source)
        self._record: Record | None = None
        self._window: Record | None = None
        self._reading: dict[str, Any] = {}
        self._fit: xr.Dataset | None = None
        self._excluded: tuple[float, ...] = ()
        self._is_updating = False
        self._widgets = create_choice_widgets()
        self._x = pn.widgets.RadioButtonGroup(
            label="Horizontal axis", value="time",
            options={"Time": "time", "Displacement": "displacement"},
        )  # fmt: skip
        self._steps = pn.widgets.CheckBoxGroup(label="Steps to fit", options={}, value=[])
        self._fit_button = pn.widgets.Button(label="Fit", color="primary")
        self._whole_button = pn.widgets.Button(label="Whole record")
        self._plot = RecordPlot(self._choose_window, self._toggle_step)
        drawn = pn.pane.Bokeh(self._plot.layout, sizing_mode="stretch_width")
        self._plots = pn.Column(drawn, sizing_mode="stretch_width")
        self._summary = pn.Column(sizing_mode="stretch_width")
        self._statuses = pn.pane.DataFrame(pd.DataFrame(), index=False)
        self._connect()
        self._read()

    # ---- parts of the page ----------------------------------------------------------------------

    def controls(self) -> list[Any]:
        """Return the widgets in the left column."""
        named = self._widgets
        details = [named[n] for n in ("slip_distance", "before", "after", "noise", "loading")]
        reading = pn.Card(
            *(named[name] for name in ("columns", "decimal")), title="Columns", collapsed=True
        )
        return [
            pn.pane.Markdown("Drag in a plot to choose the window. Click a step to exclude it."),
            self._x,
            reading,
            named["normal_stress"],
            pn.Row(named["begin"], named["end"]),
            self._whole_button,
            pn.pane.Markdown("Steps to fit", margin=(5, 10, 0, 10)),
            pn.Column(self._steps, max_height=170, scroll=True),
            *(named[name] for name in ("laws", "stiffness", "trend_degree", "more_free")),
            pn.Card(*details, named["together"], title="More choices", collapsed=True),
            self._fit_button,
        ]

    def plots(self) -> list[Any]:
        """Return the plots and the tables in the right column."""
        return [self._plots, self._summary]

    def status(self) -> list[Any]:
        """Return the table of the statuses of the fits."""
        return [self._statuses]

    # ---- choices --------------------------------------------------------------------------------

    @property
    def choices(self) -> FitChoices:
        """Choices of the user."""
        values = {name: widget.value for name, widget in self._widgets.items()}
        values["laws"], values["more_free"] = tuple(values["laws"]), tuple(values["more_free"])
        return FitChoices(**values, excluded=self._excluded)

    def state(self) -> dict[str, Any]:
        """Return the choices that differ from their defaults."""
        default = asdict(FitChoices())
        state = {n: value for n, value in asdict(self.choices).items() if value != default[n]}
        state |= {_X_KEY: self._x.value} if self._x.value != "time" else {}
        return state | ({_FITTED_KEY: True} if self._fit is not None else {})

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Set the choices, read the record, and fit it if the state contains a fit."""
        rest = {name: state[name] for name in state if name not in (_X_KEY, _FITTED_KEY)}
        chosen = FitChoices.from_state(asdict(self.choices) | rest)
        with self._updating():
            self._x.value = state.get(_X_KEY, self._x.value)
            self._excluded = chosen.excluded
            for name, widget in self._widgets.items():
                value = getattr(chosen, name)
                widget.value = [*value] if isinstance(value, tuple) else value
        self._read()
        if state.get(_FITTED_KEY):
            self._start_fit()

    @contextmanager
    def _updating(self) -> Iterator[None]:
        """Ignore widget changes that are made by the view and not by the user."""
        self._is_updating = True
        try:
            yield
        finally:
            self._is_updating = False

    def _connect(self) -> None:
        """Call the methods of the view when the user changes a widget."""

        def watch(widget: Any, method: Callable[[], None]) -> None:
            widget.param.watch(
                lambda _event: None if self._is_updating else _call_with_lock(method), "value"
            )

        methods = dict.fromkeys(_READING_CHOICES, self._read)
        methods |= dict.fromkeys(("begin", "end"), self._show_window)
        methods["stiffness"] = self._change_stiffness
        for name, widget in self._widgets.items():
            watch(widget, methods.get(name, self._change_choices))
        watch(self._x, self._show_record)
        watch(self._steps, self._change_steps)
        self._fit_button.on_click(lambda _event: _call_with_lock(self._start_fit))
        self._whole_button.on_click(
            lambda _event: _call_with_lock(lambda: self._choose_window(None, None))
        )

    # ---- record, window and steps ---------------------------------------------------------------

    def _read(self) -> None:
        """Read the record with the chosen columns and normal stress."""
        self.hide_error()
        self._record = self._window = None
        with self.errors_shown():
            self._reading = self.choices.reading_arguments()
            try:
                self._record = read_record(self.source, **self._reading)
            except InvalidValue as error:
                if error.name != "slip":
                    raise
                self._reading = self.choices.add_stiffness_for_slip(self._reading)
                self._record = read_record(self.source, **self._reading)
        self._show_record()

    def _show_record(self) -> None:
        """Show the record against time or displacement."""
        self._plots.visible = self._record is not None
        if self._record is not None:
            self._plot.show_record(self._record, self._x.value)
        self._show_window()

    def _show_window(self) -> None:
        """Detect the steps in the window, and show them."""
        if self._record is not None:
            self.hide_error()
            with self.errors_shown():
                self._window = self.choices.select_window(self._record)
        self._plot.show_window(self.choices.begin, self.choices.end)
        self._show_steps()

    def _show_steps(self) -> None:
        """Show which steps are fitted."""
        steps = self._window.loading_steps if self._window is not None else ()
        excluded = self.choices.find_excluded_steps(steps)
        with self._updating():
            self._steps.options = {format_step(n, s): n for n, s in enumerate(steps, start=1)}
            self._steps.value = [n for n in range(1, len(steps) + 1) if n not in excluded]
        self._plot.show_steps(steps, excluded)
        self._change_choices()

    def _change_stiffness(self) -> None:
        """Apply a new stiffness, and read the record again if necessary."""
        if self._record is None or "stiffness" in self._reading:
            self._read()
        else:
            self._change_choices()

    def _choose_window(self, begin: float | None, end: float | None) -> None:
        """Select the rows between two times in s for the fit."""
        with self._updating():
            self._widgets["begin"].value, self._widgets["end"].value = begin, end
        self._show_window()

    def _toggle_step(self, index: int) -> None:
        """Include or exclude a step."""
        number = index + 1
        included = {*self._steps.value} ^ {number}
        self._steps.value = sorted(included)

    def _change_steps(self) -> None:
        """Store the times of the steps that the user excluded in the window."""
        assert self._window is not None
        steps, choices = self._window.loading_steps, self.choices
        kept = [time for time in self._excluded if choices.find_step(steps, time) is None]
        excluded = [
            float(f"{s.start:.9g}") for n, s in enumerate(steps, 1) if n not in self._steps.value
        ]
        self._excluded = (*kept, *excluded)
        self._show_steps()

    # ---- fit ------------------------------------------------------------------------------------

    def _change_choices(self) -> None:
        """Remove the outdated fit, and update the displayed code."""
        self.jobs.cancel()
        self._show_fit(None)

    def _start_fit(self) -> None:
        """Fit the record in the background."""
        if self._window is None:
            return
        self.hide_error()
        with self.errors_shown():
            record, choices, arguments = self._window, self.choices, self._fit_arguments()

            def compute(report: Callable[[float, str], None]) -> xr.Dataset:
                def progress(done: int, total: int, _remaining: float | None = None) -> None:
                    report(done / total, f"{done} of {total} fits")

                return fit(record, progress=progress, **arguments)

            def deliver(dataset: xr.Dataset) -> None:
                if self.choices == choices:
                    self._show_fit(dataset)

            self.jobs.start(compute, deliver, self.show_error, label="Fitting")

    def _show_fit(self, dataset: xr.Dataset | None) -> None:
        """Show the fitted curves, the residuals and the tables."""
        self._fit = dataset
        self._plot.show_fit(dataset)
        pieces = [] if dataset is None else build_summary_tables_and_sentences(dataset)
        self._summary[:] = [_to_pane(piece) for piece in pieces]
        values = [] if dataset is None else list_fit_values(dataset)
        names = ("record", "step", "law", "status", "message")
        self._statuses.object = pd.DataFrame([{n: v[n] for n in names} for v in values])
        self.refresh()

    def _finished_fit(self) -> xr.Dataset:
        """Return the fit, or raise ``DataError`` if the record is not fitted."""
        if self._fit is None:
            raise DataError("The record is not fitted with these choices. Press the button Fit.")
        return self._fit

    # ---- code and downloads ---------------------------------------------------------------------

    def python_code(self) -> str:
        """Return Python code that reads and fits the record, and prints the fit table."""
        path, lines = self._path, ["import rsfstudy", ""]
        source = json.dumps(path) if path else "record"
        if not path:
            lines.append("# `record` is the object that was passed to rsfstudy.explore.")
        reading, fitting = self._reading | self.choices.window_arguments(), self._fit_arguments()
        if path or reading:
            lines.append(
                f"record = {format_call('rsfstudy.read_record', quote_values(reading), source)}"
            )
        lines.append(f"fit = {format_call('rsfstudy.fit', quote_values(fitting), 'record')}")
        return "\n".join([*lines, "print(fit.rsf.fit_table().T)"])

    def command_line(self) -> str:
        """Return the command ``rsfstudy fit`` with the options of the choices."""
        if not self._path:
            return "# The command line needs a record in a file."
        reading = self._reading | self.choices.window_arguments()
        return format_fit_command(self._path, reading | self._fit_arguments())

    @property
    def _path(self) -> str:
        """Path of the file, or an empty string if the record is in memory."""
        return str(self.source) if isinstance(self.source, str | Path) else ""

    def _fit_arguments(self) -> dict[str, Any]:
        """Return the keyword arguments of ``rsfstudy.fit``."""
        return self.choices.fit_arguments(self._window.loading_steps if self._window else ())

    def figure(self) -> Figure:
        """Return the figure of the fit."""
        drawn: Figure = self._finished_fit().rsf.plot()
        return drawn

    def table(self) -> pd.DataFrame:
        """Return the table of the fit, with one row per law and step."""
        fits: pd.DataFrame = self._finished_fit().rsf.fit_table()
        return fits

    def dataset(self) -> xr.Dataset:
        """Return the dataset of the fit."""
        return self._finished_fit()


def _call_with_lock(method: Callable[[], None]) -> None:
    """Call a method that changes Bokeh models while holding the document lock."""
    document = pn.state.curdoc
    if document is None or not document.session_context:
        method()
    else:
        document.add_next_tick_callback(method)


def _to_pane(piece: SummaryTableOrSentence) -> Any:
    """Return a Panel object that shows a table or a sentence."""
    if not isinstance(piece, TextTable):
        return _sentence(str(piece))
    table = pn.pane.DataFrame(pd.DataFrame(piece.rows), index=False)
    return pn.Column(_sentence(piece.caption), table)


def _sentence(text: str) -> Any:
    """Return a Panel object that shows a sentence with line breaks."""
    return pn.pane.Markdown(escape_markdown(text), margin=(0, 10), sizing_mode="stretch_width")
