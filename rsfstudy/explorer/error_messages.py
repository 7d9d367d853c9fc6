"""Functions that convert error messages to Markdown."""

from __future__ import annotations

import logging
from typing import Any

import panel as pn

from rsfstudy.errors import RsfStudyError
from rsfstudy.exception_conversion import format_exception


def create_error_page(error: Exception) -> Any:
    """Return a page with an error message, for display instead of a view.

    Parameters
    ----------
    error : Exception
        Error, which is logged unless rsfstudy has raised it.

    Returns
    -------
    panel.pane.Alert
        Page.
    """
    return pn.pane.Alert(format_error_as_markdown(error), alert_type="danger")


def format_error_as_markdown(error: Exception) -> str:
    """Return the message of an error as Markdown, and log an unexpected error.

    Parameters
    ----------
    error : Exception
        Error.

    Returns
    -------
    str
        Message without a traceback.
    """
    if isinstance(error, RsfStudyError):
        return escape_markdown(str(error))
    logging.getLogger(__name__).error("the view failed", exc_info=error)
    text = f"The view failed: {format_exception(error)}. Change a setting and try again."
    return escape_markdown(text)


def escape_markdown(text: str) -> str:
    """Escape characters with a special meaning in Markdown or HTML.

    Parameters
    ----------
    text : str
        Plain text.

    Returns
    -------
    str
        Markdown that shows the text.
    """
    return text.translate({ord(c): f"&#{ord(c)};" for c in "\\`*_{}[]<>#|~&"})
