"""Base class of the views of the explorer."""

from __future__ import annotations

import io
import json
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Self
from urllib.parse import urlencode

import pandas as pd
import panel as pn
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.explorer.background_jobs import BackgroundJobRunner
from rsfstudy.explorer.error_messages import escape_markdown as escape_markdown
from rsfstudy.explorer.error_messages import format_error_as_markdown
from rsfstudy.plots import Figure, render_figure, style_context
from rsfstudy.storage import write_dataset

#: Name of the argument of the URL that contains the state of a view.
URL_ARGUMENT_OF_WIDGET_STATE = "state"
#: Width of the column with the widgets in pixels. The plots have the remaining width.
CONTROL_COLUMN_WIDTH_PIXELS = 290
_CODE_BOX_STYLESHEET = (
    "textarea.bk-input.bk-input:disabled {font-family: monospace; color: #222; opacity: 1}"
)
_COPY_BUTTON_JAVASCRIPT = """
navigator.clipboard.writeText(source.value)
button.label = "Copied"
setTimeout(() => { button.label = "Copy" }, 1500)
"""


class ExplorerView(ABC):
    """Base class of views, which show code, download buttons and error messages.

    A subclass creates its widgets in ``__init__``, and implements the abstract methods. The
    subclass calls ``update_displayed_code_and_url`` after each change to its widgets. To handle
    errors of computations, the subclass calls ``show_error`` or uses the context manager
    ``show_raised_errors``. The methods ``draw_figure_for_download``, ``build_table_for_download``
    and ``build_dataset_for_download`` are called when the user downloads a file.

    Parameters
    ----------
    source : object
        Object that the view shows.

    Attributes
    ----------
    jobs : BackgroundJobRunner
        Runner of computations that take longer than a fraction of a second.
    """

    #: Title of the page, and beginning of the names of downloaded files.
    title = "rsfstudy"
    download_file_stem = "rsfstudy"

    def __init__(self, source: Any) -> None:
        """Create the parts of the page that all views share."""
        self.source = source
        self.jobs = BackgroundJobRunner(self.show_warnings)
        self._alert = pn.pane.Alert("", alert_type="danger", visible=False)
        self._warnings = pn.pane.Alert("", alert_type="warning", visible=False)
        self._codes = {
            label: pn.widgets.TextAreaInput(
                label=label, disabled=True, auto_grow=True, max_rows=40, rows=2,
                sizing_mode="stretch_width", stylesheets=[_CODE_BOX_STYLESHEET],
            )
            for label in ("Python", "Command line", "State")
        }  # fmt: skip

    # ---- methods that subclasses implement ------------------------------------------------------

    @abstractmethod
    def list_control_widgets(self) -> list[Any]:
        """Return the widgets in the left column.

        Returns
        -------
        list
            Panel objects.
        """

    @abstractmethod
    def list_plot_panes(self) -> list[Any]:
        """Return the plots in the right column.

        Returns
        -------
        list
            Panel or Bokeh objects.
        """

    @abstractmethod
    def get_widget_state(self) -> dict[str, Any]:
        """Return the settings of the widgets.

        Returns
        -------
        dict of str to object
            Settings as plain Python values, which JSON can represent.
        """

    @abstractmethod
    def set_widget_state(self, widget_state: Mapping[str, Any]) -> None:
        """Set the widgets to the settings that ``get_widget_state`` returned.

        Parameters
        ----------
        widget_state : mapping of str to object
            Settings. Missing settings keep their values.

        Raises
        ------
        InvalidValue
            If a setting is unknown or invalid.
        """

    @abstractmethod
    def format_equivalent_python_code(self) -> str:
        """Return Python code that reproduces the numbers shown in the view.

        Returns
        -------
        str
            Code that uses public functions only.
        """

    @abstractmethod
    def format_equivalent_command_line(self) -> str:
        """Return a command line that reproduces the numbers shown in the view.

        Returns
        -------
        str
            Command for a shell. If no command reproduces the view, a comment with the reason.
        """

    @abstractmethod
    def draw_figure_for_download(self) -> Figure:
        """Return a figure of the view that is suitable for a publication.

        Returns
        -------
        matplotlib.figure.Figure
            Figure drawn by the functions of ``rsfstudy.plots``.
        """

    @abstractmethod
    def build_table_for_download(self) -> pd.DataFrame:
        """Return the table of the view.

        Returns
        -------
        pandas.DataFrame
            Table with one row per time, cell or fit.
        """

    @abstractmethod
    def build_dataset_for_download(self) -> xr.Dataset:
        """Return the data of the view.

        Returns
        -------
        xarray.Dataset
            Dataset that ``rsfstudy`` reads again.
        """

    def build_status_tables(self) -> list[Any]:
        """Return the contents of the "Status" tab.

        Returns
        -------
        list
            Panel objects, for example a table of statuses. By default the tab is empty.
        """
        return []

    # ---- state ----------------------------------------------------------------------------------

    @classmethod
    def create_with_widget_state(cls, source: Any, widget_state: Mapping[str, Any]) -> Self:
        """Create a view with the settings of an earlier view.

        Parameters
        ----------
        source : object
            Object that the view shows.
        widget_state : mapping of str to object
            Settings that ``get_widget_state`` returned. The mapping may be empty.

        Returns
        -------
        ExplorerView
            View of the source.
        """
        view = cls(source)
        if widget_state:
            with view.show_raised_errors():
                view.set_widget_state(widget_state)
        return view

    @staticmethod
    def parse_widget_state(state_json: str | None) -> dict[str, Any]:
        """Parse the settings of a view.

        Parameters
        ----------
        state_json : str or None
            Settings as JSON.

        Returns
        -------
        dict of str to object
            Settings by name. Without a text, the dictionary is empty.

        Raises
        ------
        InvalidValue
            If the text is not a JSON object.
        """
        remedy = "Copy the text from the tab Code of a view."
        try:
            state = json.loads(state_json) if state_json else {}
        except ValueError as error:
            raise InvalidValue("state", state_json, "is not JSON", remedy=remedy) from error
        if not isinstance(state, dict):
            raise InvalidValue("state", state_json, "is not a JSON object", remedy=remedy)
        return state

    @property
    def widget_state_json(self) -> str:
        """Settings of the widgets as compact JSON."""
        return json.dumps(self.get_widget_state(), separators=(",", ":"))

    def update_displayed_code_and_url(self) -> None:
        """Update the code and the address of the page after the view has changed."""
        with self.show_raised_errors():
            texts = (
                self.format_equivalent_python_code(),
                self.format_equivalent_command_line(),
                self.widget_state_json,
            )
            for box, text in zip(self._codes.values(), texts, strict=True):
                box.value = text
        if pn.state.location is not None:
            pn.state.location.search = "?" + urlencode(
                {URL_ARGUMENT_OF_WIDGET_STATE: self.widget_state_json}
            )

    # ---- messages -------------------------------------------------------------------------------

    def show_error(self, error: Exception) -> None:
        """Show the message of an error above the plots.

        Parameters
        ----------
        error : Exception
            Error. An error that rsfstudy does not raise itself is also logged.
        """
        self._alert.object = format_error_as_markdown(error)
        self._alert.visible = True

    def show_warnings(self, messages: Sequence[str]) -> None:
        """Show the warnings of a computation above the plots.

        Parameters
        ----------
        messages : sequence of str
            Messages. Without messages, the warnings of the last computation are hidden.
        """
        self._warnings.object = "\n\n".join(map(escape_markdown, dict.fromkeys(messages)))
        self._warnings.visible = bool(messages)

    def hide_error(self) -> None:
        """Hide the message of the last error."""
        self._alert.visible = False

    @contextmanager
    def show_raised_errors(self) -> Iterator[None]:
        """Show the message of any error that is raised inside a ``with`` block.

        Yields
        ------
        None
            Nothing.
        """
        try:
            yield
        except Exception as error:
            self.show_error(error)

    # ---- page -----------------------------------------------------------------------------------

    def build_page(self) -> pn.viewable.Viewable:
        """Return the page: widgets on the left, plots and tabs on the right.

        Returns
        -------
        panel.viewable.Viewable
            Page, which a notebook displays and the server serves.
        """
        load_panel_extension()
        controls = pn.Column(
            *self.list_control_widgets(), width=CONTROL_COLUMN_WIDTH_PIXELS, margin=(0, 10, 0, 0)
        )
        tabs = pn.Tabs(
            ("Code", self._build_code_tab()),
            ("Download", self._build_download_tab()),
            ("Status", pn.Column(*self.build_status_tables(), sizing_mode="stretch_width")),
            sizing_mode="stretch_width",
        )
        plots = pn.Column(
            self._alert,
            self._warnings,
            self.jobs.indicator,
            *self.list_plot_panes(),
            tabs,
            sizing_mode="stretch_width",
        )
        pn.state.onload(self.update_displayed_code_and_url)
        if pn.state.curdoc is not None and pn.state.curdoc.session_context is not None:
            pn.config.exception_handler = self.show_error  # of this browser tab only
            pn.state.curdoc.on_session_destroyed(lambda _context: self.jobs.cancel_all())
        return pn.Column(
            pn.pane.Markdown(f"# {escape_markdown(self.title)}", margin=(0, 5)),
            pn.Row(controls, plots, sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
            margin=(0, 15),
        )

    def _build_code_tab(self) -> pn.Column:
        """Return the code that reproduces the view, with copy buttons."""
        rows = []
        for text in self._codes.values():
            button = pn.widgets.Button(label="Copy", width=80, margin=(25, 5, 5, 5))
            button.js_on_click(
                args={"source": text, "button": button}, code=_COPY_BUTTON_JAVASCRIPT
            )
            rows.append(pn.Row(text, button, sizing_mode="stretch_width"))
        return pn.Column(*rows, sizing_mode="stretch_width")

    def _build_download_tab(self) -> pn.FlexBox:
        """Return the download buttons of the view."""
        writers: dict[str, Callable[[], bytes]] = {
            suffix: partial(self._render_figure, suffix) for suffix in ("pdf", "svg", "png")
        }
        writers |= {"csv": self._encode_table_as_csv, "nc": self._encode_dataset_as_netcdf}
        labels = {"csv": "Table (CSV)", "nc": "Data (NetCDF)"}
        return pn.FlexBox(
            *(
                pn.widgets.FileDownload(
                    label=labels.get(suffix, f"Figure ({suffix.upper()})"),
                    filename=f"{self.download_file_stem}.{suffix}",
                    callback=partial(_create_download_buffer, writer),
                    color="primary",
                    width=150,
                )
                for suffix, writer in writers.items()
            )
        )

    def _render_figure(self, image_format: str) -> bytes:
        """Return the figure as an image."""
        with style_context():
            return render_figure(self.draw_figure_for_download(), image_format)

    def _encode_table_as_csv(self) -> bytes:
        """Return the table as a CSV file."""
        return self.build_table_for_download().to_csv(index=False).encode()

    def _encode_dataset_as_netcdf(self) -> bytes:
        """Return the dataset as a NetCDF file."""
        with tempfile.TemporaryDirectory() as directory:
            write_dataset(self.build_dataset_for_download(), path := Path(directory, "data.nc"))
            return path.read_bytes()


def _create_download_buffer(encode_file: Callable[[], bytes]) -> io.BytesIO:
    """Return the contents of a file that the user downloads."""
    return io.BytesIO(encode_file())


def load_panel_extension() -> None:
    """Load the JavaScript of Panel in a notebook, or configure Panel elsewhere.

    The resources are loaded from the installed package, so the page does not need an internet
    connection.
    """
    if not pn.extension._loaded:
        pn.extension(inline=True, notifications=False)
