"""Width and height of figures.

The context manager ``figure_width_context`` sets the width of all figures that the package creates
inside a ``with`` block. If no width is set, figures with several columns of panels are as wide as a
journal page, and other figures are as wide as one column of the page.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any

from matplotlib import rcParams
from matplotlib.figure import Figure

from rsfstudy.errors import InvalidValue
from rsfstudy.rig import convert_to_si

_MM_PER_INCH = 25.4
#: Gap between the two columns of a journal page in mm.
_JOURNAL_COLUMN_GAP_MM = 6.0
#: Smallest and largest width of a figure in mm.
_MIN_FIGURE_WIDTH_MM, _MAX_FIGURE_WIDTH_MM = 60.0, 600.0
#: Smallest width of a panel with its labels in mm. If the panels of a row would be narrower, the
#: row has fewer panels.
_MIN_PANEL_WIDTH_MM = 55.0
#: Width of a letter of a header relative to the font size.
_LETTER_WIDTH_OVER_FONT_SIZE = 0.58
#: Width of figures in mm that the user requested, or None.
_requested_figure_width_mm: ContextVar[float | None] = ContextVar(
    "requested_width_mm", default=None
)


@contextlib.contextmanager
def figure_width_context(width: Any) -> Iterator[None]:
    """Set the width of the figures that are created inside a ``with`` block.

    Parameters
    ----------
    width : quantity or None
        Width of figures, for example "85 mm". A number without units is in m. If the width is
        None, the block uses the width of the enclosing block.

    Yields
    ------
    None
        The width is active inside the ``with`` block.

    Raises
    ------
    InvalidValue
        If the width is not a length, or if the width is less than 60 mm or more than 600 mm.
    """
    if width is None:
        yield
        return
    token = _requested_figure_width_mm.set(_convert_width_to_mm(width))
    try:
        yield
    finally:
        _requested_figure_width_mm.reset(token)


def _convert_width_to_mm(width: Any) -> float:
    """Convert the width of a figure to mm, and check its range."""
    width_mm = 1e3 * convert_to_si("width", width, "m")
    if not _MIN_FIGURE_WIDTH_MM <= width_mm <= _MAX_FIGURE_WIDTH_MM:
        rule = f"must be from {_MIN_FIGURE_WIDTH_MM:g} mm to {_MAX_FIGURE_WIDTH_MM:g} mm"
        remedy = "For example, pass '85 mm' for one column of a journal page."
        raise InvalidValue("width", width, rule, remedy=remedy)
    return width_mm


def compute_figure_size_in_inches(
    panel_column_count: int, panel_row_count: int, panel_height_mm: float | None = None
) -> tuple[float, float]:
    """Compute the size of a figure in inches.

    Parameters
    ----------
    panel_column_count : int
        Number of columns of panels. If no width is requested, a figure with one column of panels is
        as wide as a column of a journal page, and all other figures are as wide as the page.
    panel_row_count : int
        Number of rows of panels.
    panel_height_mm : float, optional
        Height of a panel in mm. The default is the figure height of the current style.

    Returns
    -------
    width : float
        Width of the figure in inches.
    height : float
        Height of the figure in inches.
    """
    width, usual = rcParams["figure.figsize"]
    each = usual if panel_height_mm is None else panel_height_mm / _MM_PER_INCH
    if (requested := _requested_figure_width_mm.get()) is not None:
        width = requested / _MM_PER_INCH
    elif panel_column_count > 1:
        width = 2.0 * width + _JOURNAL_COLUMN_GAP_MM / _MM_PER_INCH
    return width, panel_row_count * each


def limit_panel_column_count_to_width(panel_column_count: int) -> int:
    """Return the number of columns of panels that fit into the requested width.

    Parameters
    ----------
    panel_column_count : int
        Number of panel columns if no width is requested.

    Returns
    -------
    int
        Number of columns, at most ``panel_column_count``.
    """
    width = _requested_figure_width_mm.get()
    if width is None:
        return panel_column_count
    return min(panel_column_count, max(1, int(width / _MIN_PANEL_WIDTH_MM)))


def compute_max_header_line_characters(figure: Figure) -> int:
    """Return the number of characters that fit into a line above the panels.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure with its final width.

    Returns
    -------
    int
        Number of characters.
    """
    letter_width = _LETTER_WIDTH_OVER_FONT_SIZE * _find_header_font_size() / 72.0
    return int(figure.get_figwidth() / letter_width)


def _find_header_font_size() -> float:
    """Return the font size of the header in points."""
    size = rcParams["figure.titlesize"]
    return float(size) if isinstance(size, int | float) else float(rcParams["font.size"])
