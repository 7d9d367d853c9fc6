"""Functions that apply the style sheet, place the legends and compute the layout of figures.

The context manager ``style_context`` applies the style sheet of rsfstudy. The other functions in
this module compute the size of a figure, cycle through colours and markers, place legends outside
the data area, and compute the layout after all panels are drawn.
"""

from __future__ import annotations

import contextlib
import itertools
import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib import RcParams, rcParams, style
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.transforms import blended_transform_factory, offset_copy

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.errors import InvalidValue, RsfStudyError, shorten_text
from rsfstudy.exception_conversion import check_regular_file
from rsfstudy.plots._figure_size import figure_width_context
from rsfstudy.plots._text_formatting import estimate_visible_character_count, wrap_text
from rsfstudy.status import Status

#: Default style sheet of rsfstudy.
DEFAULT_STYLE_SHEET_PATH = Path(__file__).with_name("rsfstudy.mplstyle")
#: File name suffix of style sheets.
_STYLE_SHEET_SUFFIX = ".mplstyle"
_MARKER_CYCLE = "os^Dv<>P*X"
#: Fraction of the panel width that a colour bar and its label occupy.
_COLOUR_BAR_WIDTH_OVER_PANEL_WIDTH = 0.24


@accept_former_keyword_names
@contextlib.contextmanager
def style_context(user_styles: Any = None, width: Any = None) -> Iterator[None]:
    """Apply the style sheet of rsfstudy and any additional styles, and set the figure width.

    Parameters
    ----------
    user_styles : path, str, dict or list, optional
        A style sheet (a file with the suffix ``.mplstyle``), the name of a style in
        ``matplotlib.style.available``, a dictionary of matplotlib settings, or a list of such
        styles. Later styles override earlier styles. By default, only the style sheet of rsfstudy
        is applied.
    width : quantity, optional
        Width of the figures that rsfstudy creates inside the ``with`` block, for example "85 mm".
        By default, each figure has its own default width.

    Yields
    ------
    None
        The styles are active inside the ``with`` block.

    Raises
    ------
    InvalidValue
        If an argument is not a valid style, if a style contains an unknown setting, if the width is
        invalid, or if a figure cannot be drawn in the style, for example because the style needs
        LaTeX and LaTeX is not installed.

    Examples
    --------
    >>> from matplotlib import rcParams
    >>> from rsfstudy.plots import style_context
    >>> with style_context({"font.size": 9}):
    ...     print(rcParams["font.size"], rcParams["axes.titlesize"])
    9.0 8.0
    """
    others = user_styles if isinstance(user_styles, list | tuple) else [user_styles]
    settings = [_to_matplotlib_style(other) for other in others if other is not None]
    with style.context([DEFAULT_STYLE_SHEET_PATH, *settings]), figure_width_context(width):
        try:
            yield
        except (RsfStudyError, OSError):
            raise
        # Settings that are individually valid may be invalid in combination.
        except Exception as error:
            if not settings:
                raise
            rule = f"cannot be used to draw a figure: {shorten_text(error).rstrip('.')}"
            remedy = "Draw the figure without this style to check whether the style is the cause."
            raise InvalidValue(
                "style", _format_style_for_message(user_styles), rule, remedy=remedy
            ) from error


def _to_matplotlib_style(user_style: Any) -> str | dict[str, Any]:
    """Convert a style to an argument of ``matplotlib.style.use``.

    The result is the name of a style or a dictionary of checked settings. Other styles are
    rejected. If rsfstudy did not reject such styles, matplotlib would import a package for a dotted
    name, download a style sheet from a URL, or parse any text file and print a warning for each
    line.
    """
    if isinstance(user_style, Mapping):
        return _validate_matplotlib_settings(user_style)
    if isinstance(user_style, str) and user_style in ("default", *style.available):
        return user_style
    if isinstance(user_style, str | Path) and Path(user_style).suffix == _STYLE_SHEET_SUFFIX:
        return _read_style_sheet(Path(user_style))
    rule = f"is neither a style sheet (suffix {_STYLE_SHEET_SUFFIX}) nor the name of a style"
    raise InvalidValue(
        "style", _format_style_for_message(user_style), rule, choices=["default", *style.available]
    )


def _format_style_for_message(user_style: Any) -> Any:
    """Format a style for an error message."""
    return str(user_style) if isinstance(user_style, Path) else user_style


def _validate_matplotlib_settings(settings: Mapping[Any, Any]) -> dict[str, Any]:
    """Validate matplotlib settings and convert their values.

    Raises
    ------
    InvalidValue
        If the name of a setting is unknown, or if a value is invalid.
    """
    checked: Any = RcParams()
    for name, value in settings.items():
        if name not in rcParams:
            rule = "is not a setting of matplotlib"
            raise InvalidValue("style", name, rule, choices=rcParams)
        try:
            checked[name] = value
        # The validators of matplotlib raise exceptions of any type.
        except Exception as error:
            reason = shorten_text(error).removeprefix(f"Key {name}: ").rstrip(".")
            rule = f"is not a valid value of {name}: {reason}"
            raise InvalidValue("style", value, rule) from error
    return dict(checked)


def _read_style_sheet(path: Path) -> dict[str, Any]:
    """Read and validate the settings of a style sheet."""
    check_regular_file("style", path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "the file is not encoded in UTF-8"
        raise InvalidValue("style", str(path), f"cannot be read: {reason}") from error
    settings: dict[str, Any] = {}
    for number, line in enumerate(lines, start=1):
        name, colon, value = _strip_comment(line).partition(":")
        if not name.strip():
            continue
        try:
            if not colon:
                raise InvalidValue("style", line, "must have the form NAME: VALUE")
            settings |= _validate_matplotlib_settings({name.strip(): _strip_quotes(value.strip())})
        except InvalidValue as error:
            raise error.with_location(f"{path}, line {number}") from error
    return settings


def _strip_comment(line: str) -> str:
    """Remove the comment from a line of a style sheet.

    As in matplotlib, a comment starts at the first ``#`` outside double quotes.
    """
    parts = line.split('"')
    for number in range(0, len(parts), 2):
        before, mark, _comment = parts[number].partition("#")
        if mark:
            return '"'.join([*parts[:number], before])
    return line


def _strip_quotes(value: str) -> str:
    """Remove the double quotes around a value."""
    return value[1:-1] if len(value) > 1 and value[0] == value[-1] == '"' else value


def cycle_style(number: int) -> dict[str, Any]:
    """Return the colour and line style of a curve.

    Parameters
    ----------
    number : int
        Index of the curve, starting at 0. The styles are repeated cyclically.

    Returns
    -------
    dict of str to object
        Properties of the curve from ``axes.prop_cycle`` of the current style. The style of rsfstudy
        defines the properties ``color`` and ``linestyle``.

    Examples
    --------
    >>> from rsfstudy.plots import cycle_style, style_context
    >>> with style_context():
    ...     style = cycle_style(1)
    >>> style["linestyle"]
    '--'
    """
    return dict(next(itertools.islice(itertools.cycle(rcParams["axes.prop_cycle"]), number, None)))


def cycle_marker(number: int) -> str:
    """Return the marker of a curve.

    Parameters
    ----------
    number : int
        Index of the curve, starting at 0. The markers are repeated after ten curves.

    Returns
    -------
    str
        Marker in the notation of matplotlib.

    Examples
    --------
    >>> from rsfstudy.plots import cycle_marker
    >>> [cycle_marker(number) for number in range(3)]
    ['o', 's', '^']
    """
    return _MARKER_CYCLE[number % len(_MARKER_CYCLE)]


def add_panel_letters(panel_axes: Sequence[Axes]) -> None:
    """Label the panels of a figure with (a), (b), and so on.

    The letters are placed to the left of the panel titles. If the figure has only one panel, no
    letter is added.

    Parameters
    ----------
    panel_axes : sequence of matplotlib.axes.Axes
        Panels in the order of their letters.
    """
    for panel, text in zip(panel_axes, itertools.cycle(string.ascii_lowercase), strict=False):
        if len(panel_axes) > 1:
            panel.set_title(f"({text}) ", loc="left", fontweight="bold", ha="right")


def estimate_text_capacity_in_characters(axes: Axes) -> tuple[int, int]:
    """Estimate how many characters fit along the axes of a panel.

    The estimate uses the average width of a letter in the current font size.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes of the panel.

    Returns
    -------
    across : int
        Number of characters along x, at least 12.
    up : int
        Number of characters along y, at least 12.
    """
    figure, (left, right) = cast(Figure, axes.figure), _compute_horizontal_extent_of_panel(axes)
    place = axes.get_subplotspec()
    rows = 1 if place is None else place.get_gridspec().nrows
    width, height = figure.get_size_inches()
    across, up = (right - left) * width, height / rows
    letter = 0.53 * rcParams["font.size"] / 72.0
    return max(12, int(0.9 * across / letter)), max(12, int(0.9 * up / letter))


# ---- legends ------------------------------------------------------------------------------------


def mark_failed_cells(
    status_codes: np.ndarray, x: np.ndarray, values: np.ndarray, axes: Axes
) -> None:
    """Mark failed cells with crosses at the lower edge of the axes.

    Without the crosses, a failed cell would be visible only as a gap in its curve.

    Parameters
    ----------
    status_codes : ndarray, shape (n, ...)
        Status codes of the cells along x.
    x : ndarray, shape (n,)
        Positions along x.
    values : ndarray, shape (n, ...)
        Displayed values. Failed cells that have a value are not marked.
    axes : matplotlib.axes.Axes
        Axes to draw on.
    """
    failed = Status.find_failures(status_codes) & ~np.isfinite(values)
    marked = x[failed.reshape(x.size, -1).any(axis=1)]
    if marked.size:
        lower_edge = axes.get_xaxis_transform()
        (crosses,) = axes.plot(marked, np.zeros(marked.size), "kx", transform=lower_edge)
        crosses.set(label="failed cell", clip_on=False, markersize=4, markeredgewidth=0.8)


def add_legend(axes: Axes, legend_column_count: int = 2, title: str | None = None) -> None:
    """Add a legend below the axes, outside the data area.

    Call this function after the x label is set, because the position of the legend depends on the
    height of the x label. If the axes have no visible data with a label, no legend is added.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that the legend describes.
    legend_column_count : int, default: 2
        Maximum number of columns of the legend. Fewer columns are used if the legend would be wider
        than the panel.
    title : str, optional
        Title of the legend.
    """
    shown = _find_visible_artists_by_label(axes)
    if not shown:
        return
    lines = axes.get_xlabel().count("\n") + _estimate_tick_label_line_count(axes)
    drop = rcParams["font.size"] * (2.9 + 1.3 * lines)
    figure, (left, right) = cast(Figure, axes.figure), _compute_horizontal_extent_of_panel(axes)
    # If the legend extended below the colour bar, the layout engine would reduce the width of the
    # panel.
    if getattr(axes, "_colorbars", ()):
        right -= _COLOUR_BAR_WIDTH_OVER_PANEL_WIDTH * (right - left)
    below = offset_copy(axes.transAxes, figure, 0.0, -drop, "points")
    made = partial(
        axes.legend,
        loc="upper center",
        bbox_to_anchor=(0.5 * (left + right), 0.0),
        bbox_transform=blended_transform_factory(figure.transFigure, below),
        title=title,
    )
    _create_legend_that_fits_width(
        made, shown, legend_column_count, 0.97 * (right - left) * figure.bbox.width
    )


def _estimate_tick_label_line_count(axes: Axes) -> float:
    """Estimate the height of the x tick labels, in lines of text."""

    def lines(tick: Text) -> float:
        parts = tick.get_text().split("\n")
        return 0.3 * max(map(len, parts)) if tick.get_rotation() == 90.0 else float(len(parts))

    return max([1.0, *map(lines, axes.get_xticklabels())])


def _find_visible_artists_by_label(axes: Axes) -> dict[str, Any]:
    """Return a dictionary of the visible artists, keyed by their labels."""
    named: dict[str, Any] = {}
    # The handle of an entry is as wide as about six characters.
    longest = min(48, estimate_text_capacity_in_characters(axes)[0] - 6)
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        if _has_visible_data(handle):
            named.setdefault(wrap_text(label, longest), handle)
    return named


def _create_legend_that_fits_width(
    make_legend: Callable[..., Legend],
    handles_by_label: Mapping[str, Any],
    max_columns: int,
    max_width: float,
) -> None:
    """Create a legend with as many columns as fit into a given width.

    The width is in pixels. Matplotlib fills the columns of a legend one after another. The function
    therefore reorders the entries so that they can be read row by row.
    """
    for beside in range(min(max_columns, len(handles_by_label)), 0, -1):
        texts = [
            text for column in range(beside) for text in list(handles_by_label)[column::beside]
        ]
        legend = make_legend([handles_by_label[text] for text in texts], texts, ncols=beside)
        if legend.get_window_extent().width <= max_width:
            return


def add_grey_legend_entry(axes: Axes, name: str, style: Mapping[str, Any]) -> None:
    """Add a grey entry to the legend of the axes.

    A grey entry explains a line style or a marker that is drawn in several colours. Call this
    function before the legend is created.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes to which the entry belongs.
    name : str
        Label of the entry.
    style : mapping of str to object
        Properties of the line, as for ``matplotlib.lines.Line2D``. The default colour is grey.

    Notes
    -----
    The function draws a line outside the visible area of the axes, because a legend entry needs an
    artist.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> from rsfstudy.plots import add_grey_legend_entry
    >>> axes = Figure().add_subplot()
    >>> add_grey_legend_entry(axes, "theory", {"linestyle": "--"})
    >>> axes.get_legend_handles_labels()[1]
    ['theory']
    """
    line = {"color": "0.3", **style}
    axes.add_artist(Line2D([-1.0], [-1.0], transform=axes.transAxes, label=name, **line))


def _compute_horizontal_extent_of_panel(axes: Axes) -> tuple[float, float]:
    """Return the left and right limits of the space available to a panel.

    The limits are fractions of the figure width.
    """
    place = axes.get_subplotspec()
    if place is None:
        return 0.0, 1.0
    columns = place.get_gridspec().ncols
    return place.colspan.start / columns, place.colspan.stop / columns


def _has_visible_data(artist: Any) -> bool:
    """Return True if an artist has visible data."""
    if isinstance(artist, ErrorbarContainer):
        artist = artist.lines[0]
    if isinstance(artist, Line2D):
        points = np.asarray(artist.get_xydata(), dtype=float)
        return bool(np.isfinite(points).all(axis=1).any())
    if isinstance(artist, PathCollection):
        return np.size(artist.get_offsets()) > 0
    return True


def merge_common_legends(figure: Figure, panel_axes: Sequence[Axes]) -> None:
    """Replace the legends of similar panels with a common figure legend.

    Panels are similar if one of their legends contains all entries of the other legends. The common
    legend is placed below the panels. The legends are only replaced if more than half of the
    panels, and at least two panels, are similar.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure that contains the panels.
    panel_axes : sequence of matplotlib.axes.Axes
        Panels of the figure.
    """
    named = {
        panel: _find_visible_artists_by_label(panel) for panel in panel_axes if panel.get_legend()
    }
    alike: list[Axes] = []
    for fullest in named:
        within = [panel for panel, texts in named.items() if texts.keys() <= named[fullest].keys()]
        if len(within) > max(1, len(alike), len(panel_axes) // 2):
            alike, chosen = within, fullest
    if not alike:
        return
    title = cast(Legend, chosen.get_legend()).get_title().get_text()
    for panel in alike:
        cast(Legend, panel.get_legend()).remove()

    def made(shown: Sequence[Any], texts: Sequence[str], ncols: int) -> Legend:
        figure.legends.clear()
        place: Any = "outside lower center"
        return figure.legend(shown, texts, loc=place, ncols=ncols, title=title)

    _create_legend_that_fits_width(made, named[chosen], 5, figure.bbox.width)


def increase_figure_height_for_legends(
    figure: Figure, panel_rows: Sequence[Sequence[Axes]]
) -> None:
    """Increase the figure height by the height of its legends, header and long labels.

    The additional height ensures that legends, headers and long labels do not reduce the height of
    the panels.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure that contains the panels.
    panel_rows : sequence of sequence of matplotlib.axes.Axes
        Panels in each row of the figure.
    """
    beside = [[legend for panel in row if (legend := panel.get_legend())] for row in panel_rows]
    heights = [
        max(map(_measure_legend_height, legends), default=0.0)
        for legends in (*beside, figure.legends)
    ]
    line = 1.3 * float(rcParams["font.size"]) / 72.0
    lines = [max(map(_estimate_tick_label_line_count, row)) - 1.0 for row in panel_rows]
    lines += [float(max(panel.get_title().count("\n") for panel in row)) for row in panel_rows]
    if header := figure.get_suptitle():
        lines.append(header.count("\n") + 1.5)
    figure.set_figheight(figure.get_figheight() + sum(heights) + line * sum(lines))


def _measure_legend_height(legend: Legend) -> float:
    """Return the height of a legend in inches.

    The height includes a margin of 1.5 times the font size.
    """
    figure = cast(Figure, legend.figure)
    height = float(legend.get_window_extent().height)
    return height / figure.dpi + 1.5 * float(rcParams["font.size"]) / 72.0


def freeze_tick_label_size(axes: Axes) -> None:
    """Set the font size of the tick labels to the size in the current style.

    Matplotlib may create ticks after the style context has ended. The explicit size ensures that
    later tick labels have the same size.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes whose ticks are changed.
    """
    axes.tick_params(axis="x", labelsize=rcParams["xtick.labelsize"])
    axes.tick_params(axis="y", labelsize=rcParams["ytick.labelsize"])


def finalize_layout(figure: Figure) -> None:
    """Compute the final layout of a figure.

    The function runs the layout engine twice. The first run creates the ticks, which change the
    positions of the panels. Next, the function wraps long titles. The second run adjusts the layout
    to the wrapped titles.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure with all its panels and legends.
    """
    layout = figure.get_layout_engine()
    # A user-defined figure function may have removed the layout engine.
    if layout is None:
        figure.draw_without_rendering()
        return
    layout.execute(figure)
    for axes in figure.axes:
        _wrap_panel_title(axes)
    layout.execute(figure)


def _wrap_panel_title(axes: Axes) -> None:
    """Wrap the title of a panel if the title is too long for one line.

    A title must not extend beyond the figure or overlap the letter of the panel. The available
    width depends on other elements of the figure, because long y tick labels move the panel and a
    colour bar makes the panel narrower.
    """
    title, edges, panel = axes.title, cast(Figure, axes.figure).bbox, axes.get_window_extent()
    extent, middle = title.get_window_extent(), 0.5 * sum(panel.intervalx)
    left = panel.x0 if axes.get_title(loc="left") else edges.x0
    free = 1.9 * min(middle - left, edges.x1 - middle)
    if title.get_text() and extent.width > free:
        longest = max(map(estimate_visible_character_count, title.get_text().split("\n")))
        text = title.get_text().replace("\n", " ")
        title.set_text(wrap_text(text, int(0.95 * longest * free / extent.width)))
