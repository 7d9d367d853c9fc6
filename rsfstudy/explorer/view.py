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
from rsfstudy.explorer.jobs import Jobs
from rsfstudy.explorer.messages import escape_markdown as escape_markdown
from rsfstudy.explorer.messages import format_message
from rsfstudy.plots import Figure, render_figure, style_context
from rsfstudy.storage import write_dataset

#: Name of the argument of the URL that contains the state of a view.
STATE_ARGUMENT = "state"
#: Width of the column with the widgets in pixels. The plots have the remaining width.
CONTROLS_WIDTH = 290
_CODE_STYLE = (
    "textarea.bk-input.bk-input:disabled {font-family: monospace; color: #222; opacity: 1}"
)
_COPY_SCRIPT = """
navigator.clipboard.writeText(source.value)
button.label = "Copied"
setTimeout(() => { button.label = "Copy" }, 1500)
"""


class View(ABC):
    """Base class that adds code, downloads and messages to the widgets of a view.

    A subclass creates its widgets in ``__init__``, and implements the abstract methods. The
    subclass calls ``refresh`` after each change to its widgets. To handle errors of computations,
    the subclass calls ``show_error`` or uses the context manager ``errors_shown``. The methods
    ``figure``, ``table`` and ``dataset`` are called when the user downloads a file.

    Parameters
    ----------
    source : object
        Object that the view shows.

    Attributes
    ----------
    jobs : Jobs
        Runner of computations that take longer than a fraction of a second.
    """

    #: Title of the page, and beginning of the names of downloaded files.
    title = "rsfstudy"
    file_stem = "rsfstudy"

    def __init__(self, source: Any) -> None:
        """Create the parts of the page that all views share."""
        self.source = source
        self.jobs = Jobs(self.show_warnings)
        self._alert = pn.pane.Alert("", alert_type="danger", visible=False)
        self._warnings = pn.pane.Alert("", alert_type="warning", visible=False)
        self._codes = {
            label: pn.widgets.TextAreaInput(
                label=label, disabled=True, auto_grow=True, max_rows=40, rows=2,
                sizing_mode="stretch_width", stylesheets=[_CODE_STYLE],
            )
            for label in ("Python", "Command line", "State")
        }  # fmt: skip

    # ---- methods that subclasses implement ------------------------------------------------------

    @abstractmethod
    def controls(self) -> list[Any]:
        """Return the widgets in the left column.

        Returns
        -------
        list
            Panel objects.
        """

    @abstractmethod
    def plots(self) -> list[Any]:
        """Return the plots in the right column.

        Returns
        -------
        list
            Panel or Bokeh objects.
        """

    @abstractmethod
    def state(self) -> dict[str, Any]:
        """Return the settings of the widgets.

        Returns
        -------
        dict of str to object
            Settings as plain Python values, which JSON can represent.
        """

    @abstractmethod
    def set_state(self, state: Mapping[str, Any]) -> None:
        """Set the widgets to the settings that ``state`` returned.

        Parameters
        ----------
        state : mapping of str to object
            Settings. Missing settings keep their values.

        Raises
        ------
        InvalidValue
            If a setting is unknown or invalid.
        """

    @abstractmethod
    def python_code(self) -> str:
        """Return Python code that reproduces the numbers of the view.

        Returns
        -------
        str
            Code that uses public functions only.
        """

    @abstractmethod
    def command_line(self) -> str:
        """Return a command line that reproduces the numbers of the view.

        Returns
        -------
        str
            Command for a shell. If no command reproduces the view, a comment with the reason.
        """

    @abstractmethod
    def figure(self) -> Figure:
        """Return the figure for a publication.

        Returns
        -------
        matplotlib.figure.Figure
            Figure drawn by the functions of ``rsfstudy.plots``.
        """

    @abstractmethod
    def table(self) -> pd.DataFrame:
        """Return the table of the view.

        Returns
        -------
        pandas.DataFrame
            Table with one row per time, cell or fit.
        """

    @abstractmethod
    def dataset(self) -> xr.Dataset:
        """Return the data of the view.

        Returns
        -------
        xarray.Dataset
            Dataset that ``rsfstudy`` reads again.
        """

    def status(self) -> list[Any]:
        """Return the contents of the tab "Status".

        Returns
        -------
        list
            Panel objects, for example a table of statuses. By default the tab is empty.
        """
        return []

    # ---- state ----------------------------------------------------------------------------------

    @classmethod
    def restore(cls, source: Any, state: Mapping[str, Any]) -> Self:
        """Create a view with the settings of an earlier view.

        Parameters
        ----------
        source : object
            Object that the view shows.
        state : mapping of str to object
            Settings that ``state`` returned. The mapping may be empty.

        Returns
        -------
        View
            View of the source.
        """
        view = cls(source)
        if state:
            with view.errors_shown():
                view.set_state(state)
        return view

    @staticmethod
    def parse_state(text: str | None) -> dict[str, Any]:
        """Parse the settings of a view.

        Parameters
        ----------
        text : str or None
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
            state = json.loads(text) if text else {}
        except ValueError as error:
            raise InvalidValue("state", text, "is not JSON", remedy=remedy) from error
        if not isinstance(state, dict):
            raise InvalidValue("state", text, "is not a JSON object", remedy=remedy)
        return state

    @property
    def state_text(self) -> str:
        """Settings of the widgets as compact JSON."""
        return json.dumps(self.state(), separators=(",", ":"))

    def refresh(self) -> None:
        """Update the code and the address of the page after the view has changed."""
        with self.errors_shown():
            texts = self.python_code(), self.command_line(), self.state_text
            for box, text in zip(self._codes.values(), texts, strict=True):
                box.value = text
        if pn.state.location is not None:
            pn.state.location.search = "?" + urlencode({STATE_ARGUMENT: self.state_text})

    # ---- messages -------------------------------------------------------------------------------

    def show_error(self, error: Exception) -> None:
        """Show the message of an error above the plots.

        Parameters
        ----------
        error : Exception
            Error. An error that rsfstudy does not raise itself is also logged.
        """
        self._alert.object = format_message(error)
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
    def errors_shown(self) -> Iterator[None]:
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

    def panel(self) -> pn.viewable.Viewable:
        """Return the page: widgets on the left, plots and tabs on the right.

        Returns
        -------
        panel.viewable.Viewable
            Page, which a notebook displays and the server serves.
        """
        load_panel()
        controls = pn.Column(*self.controls(), width=CONTROLS_WIDTH, margin=(0, 10, 0, 0))
        tabs = pn.Tabs(
            ("Code", self._code_tab()),
            ("Download", self._download_tab()),
            ("Status", pn.Column(*self.status(), sizing_mode="stretch_width")),
            sizing_mode="stretch_width",
        )
        plots = pn.Column(
            self._alert,
            self._warnings,
            self.jobs.indicator,
            *self.plots(),
            tabs,
            sizing_mode="stretch_width",
        )
        pn.state.onload(self.refresh)
        if pn.state.curdoc is not None and pn.state.curdoc.session_context is not None:
            pn.config.exception_handler = self.show_error  # of this browser tab only
            pn.state.curdoc.on_session_destroyed(lambda _context: self.jobs.cancel())
        return pn.Column(
            pn.pane.Markdown(f"# {escape_markdown(self.title)}", margin=(0, 5)),
            pn.Row(controls, plots, sizing_mode="stretch_width"),
            sizing_mode="stretch_width",
            margin=(0, 15),
        )

    def _code_tab(self) -> pn.Column:
        """Return the code that reproduces the view, with copy buttons."""
        rows = []
        for text in self._codes.values():
            button = pn.widgets.Button(label="Copy", width=80, margin=(25, 5, 5, 5))
            button.js_on_click(args={"source": text, "button": button}, code=_COPY_SCRIPT)
            rows.append(pn.Row(text, button, sizing_mode="stretch_width"))
        return pn.Column(*rows, sizing_mode="stretch_width")

    def _download_tab(self) -> pn.FlexBox:
        """Return the download buttons of the view."""
        writers: dict[str, Callable[[], bytes]] = {
            suffix: partial(self._render_figure, suffix) for suffix in ("pdf", "svg", "png")
        }
        writers |= {"csv": self._encode_table, "nc": self._encode_dataset}
        labels = {"csv": "Table (CSV)", "nc": "Data (NetCDF)"}
        return pn.FlexBox(
            *(
                pn.widgets.FileDownload(
                    label=labels.get(suffix, f"Figure ({suffix.upper()})"),
                    filename=f"{self.file_stem}.{suffix}",
                    callback=partial(_write_to_memory, writer),
                    color="primary",
                    width=150,
                )
                for suffix, writer in writers.items()
            )
        )

    def _render_figure(self, suffix: str) -> bytes:
        """Return the figure as an image."""
        with style_context():
            return render_figure(self.figure(), suffix)

    def _encode_table(self) -> bytes:
        """Return the table as a CSV file."""
        return self.table().to_csv(index=False).encode()

    def _encode_dataset(self) -> bytes:
        """Return the dataset as a NetCDF file."""
        with tempfile.TemporaryDirectory() as directory:
            write_dataset(self.dataset(), path := Path(directory, "data.nc"))
            return path.read_bytes()


def _write_to_memory(write: Callable[[], bytes]) -> io.BytesIO:
    """Return the contents of a file that the user downloads."""
    return io.BytesIO(write())


def load_panel() -> None:
    """Load the JavaScript of Panel in a notebook, or configure Panel elsewhere.

    The resources are loaded from the installed package, so the page does not need an internet
    connection.
    """
    if not pn.extension._loaded:
        pn.extension(inline=True, notifications=False)
