"""Looks of figures: the style sheet, widths of journal columns, letters of panels, and legends
that lie beside the data.
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

from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import InvalidValue, RsfStudyError, shorten
from rsfstudy.plots._text import visible_length, wrap_text

#: The style sheet that ships.
STYLE_SHEET = Path(__file__).with_name("rsfstudy.mplstyle")
#: Ending of style sheets.
_STYLE_SHEET_SUFFIX = ".mplstyle"
INCHES_PER_MM = 1.0 / 25.4
#: Between the two columns of a journal, in inches.
_COLUMN_GAP = 6.0 * INCHES_PER_MM
_MARKERS = "os^Dv<>P*X"
#: Part of the width of a panel that a scale of colours takes, with its label.
_COLOUR_BAR_SHARE = 0.24


@contextlib.contextmanager
def style_context(over: Any = None) -> Iterator[None]:
    """Apply the style sheet of rsfstudy and any additional styles.

    Parameters
    ----------
    over : path, str, dict or list of those, optional
        A style sheet (a file with the suffix ``.mplstyle``), the name of a style in
        ``matplotlib.style.available``, or a dictionary of matplotlib settings. Later styles
        override earlier styles.

    Raises
    ------
    InvalidValue
        If an argument is not a valid style, if a style contains an unknown setting, or if a figure
        cannot be drawn in this style, for example because the style needs LaTeX and LaTeX is not
        installed.
    """
    others = over if isinstance(over, list | tuple) else [over]
    settings = [_to_matplotlib_style(other) for other in others if other is not None]
    with style.context([STYLE_SHEET, *settings]):
        try:
            yield
        except (RsfStudyError, OSError):
            raise
        except Exception as error:  # settings that are valid alone may not be together
            if not settings:
                raise
            rule = f"a figure cannot be drawn in it: {shorten(error).rstrip('.')}"
            remedy = "Draw it without this style to find out if the style is the reason."
            raise InvalidValue("style", _printable_style(over), rule, remedy=remedy) from error


def _to_matplotlib_style(over: Any) -> str | dict[str, Any]:
    """Convert a style to an argument of ``matplotlib.style.use``.

    The result is the name of a style or a dictionary of checked settings. Other arguments are not
    passed on to matplotlib. Matplotlib would import a package for a dotted name, download a style
    sheet from a URL, or parse any text file with one warning per line.
    """
    if isinstance(over, Mapping):
        return _validate_settings(over)
    if isinstance(over, str) and over in ("default", *style.available):
        return over
    if isinstance(over, str | Path) and Path(over).suffix == _STYLE_SHEET_SUFFIX:
        return _read_style_sheet(Path(over))
    rule = f"is neither a style sheet, which ends in {_STYLE_SHEET_SUFFIX}, nor the name of a style"
    raise InvalidValue("style", _printable_style(over), rule, choices=["default", *style.available])


def _printable_style(over: Any) -> Any:
    return str(over) if isinstance(over, Path) else over


def _validate_settings(settings: Mapping[Any, Any]) -> dict[str, Any]:
    """Validate settings and convert the values as matplotlib does.

    Raises
    ------
    InvalidValue
        If a name is unknown or a value is invalid.
    """
    checked: Any = RcParams()
    for name, value in settings.items():
        if name not in rcParams:
            rule = "is not a setting of matplotlib"
            raise InvalidValue("style", name, rule, choices=rcParams)
        try:
            checked[name] = value
        except Exception as error:  # validators of matplotlib raise anything
            reason = shorten(error).removeprefix(f"Key {name}: ").rstrip(".")
            rule = f"is not a valid value of {name}: {reason}"
            raise InvalidValue("style", value, rule) from error
    return dict(checked)


def _read_style_sheet(path: Path) -> dict[str, Any]:
    """Read and validate the settings of a style sheet."""
    check_regular_file("style", path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text in UTF-8"
        raise InvalidValue("style", str(path), f"cannot be read: {reason}") from error
    settings: dict[str, Any] = {}
    for number, line in enumerate(lines, start=1):
        name, colon, value = _strip_comment(line).partition(":")
        if not name.strip():
            continue
        try:
            if not colon:
                raise InvalidValue("style", line, "must read NAME: VALUE")
            settings |= _validate_settings({name.strip(): _strip_quotes(value.strip())})
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
    return value[1:-1] if len(value) > 1 and value[0] == value[-1] == '"' else value


def figure_size(columns: int, rows: int, height: float | None = None) -> tuple[float, float]:
    """Inches of a figure of panels: one journal column wide, or two.

    Parameters
    ----------
    columns, rows : int
        How many panels it has beside, and above each other.
    height : float, optional
        Of a panel, in mm; that of the style by default.
    """
    width, usual = rcParams["figure.figsize"]
    each = usual if height is None else height * INCHES_PER_MM
    return (width if columns == 1 else 2.0 * width + _COLUMN_GAP), rows * each


def cycle_style(number: int) -> dict[str, Any]:
    """Colour and line style of the `number`-th of several, from the cycle of the style."""
    return dict(next(itertools.islice(itertools.cycle(rcParams["axes.prop_cycle"]), number, None)))


def cycle_marker(number: int) -> str:
    """Marker of the `number`-th of several."""
    return _MARKERS[number % len(_MARKERS)]


def add_panel_letters(panels: Sequence[Axes]) -> None:
    """Write (a), (b), ... left of the titles of panels, where there are several."""
    for panel, text in zip(panels, itertools.cycle(string.ascii_lowercase), strict=False):
        if len(panels) > 1:
            panel.set_title(f"({text}) ", loc="left", fontweight="bold", ha="right")


def text_capacity(axes: Axes) -> tuple[int, int]:
    """Characters that a line of text along x, and along y, may have."""
    figure, (left, right) = cast(Figure, axes.figure), _horizontal_extent(axes)
    place = axes.get_subplotspec()
    rows = 1 if place is None else place.get_gridspec().nrows
    width, height = figure.get_size_inches()
    across, up = (right - left) * width, height / rows
    letter = 0.53 * rcParams["font.size"] / 72.0
    return max(12, int(0.9 * across / letter)), max(12, int(0.9 * up / letter))


# ---- legends ------------------------------------------------------------------------------------


def add_legend(axes: Axes, columns: int = 2, title: str | None = None) -> None:
    """Name what is drawn below the axes, where it covers nothing; call it after the label of x.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    columns : int
        Most entries beside each other; fewer where they would be wider than the panel.
    title : str, optional
    """
    shown = _legend_entries(axes)
    if not shown:
        return
    lines = axes.get_xlabel().count("\n") + _tick_label_lines(axes)
    drop = rcParams["font.size"] * (2.9 + 1.3 * lines)
    figure, (left, right) = cast(Figure, axes.figure), _horizontal_extent(axes)
    if getattr(axes, "_colorbars", ()):  # else the layout leaves the panel what is beside both
        right -= _COLOUR_BAR_SHARE * (right - left)
    below = offset_copy(axes.transAxes, figure, 0.0, -drop, "points")
    made = partial(
        axes.legend,
        loc="upper center",
        bbox_to_anchor=(0.5 * (left + right), 0.0),
        bbox_transform=blended_transform_factory(figure.transFigure, below),
        title=title,
    )
    _fit_legend(made, shown, columns, 0.97 * (right - left) * figure.bbox.width)


def _tick_label_lines(axes: Axes) -> float:
    """Lines of text that the names of ticks along x are high."""

    def lines(tick: Text) -> float:
        parts = tick.get_text().split("\n")
        return 0.3 * max(map(len, parts)) if tick.get_rotation() == 90.0 else float(len(parts))

    return max([1.0, *map(lines, axes.get_xticklabels())])


def _legend_entries(axes: Axes) -> dict[str, Any]:
    """What is drawn on the axes, by its name."""
    named: dict[str, Any] = {}
    for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
        if _is_visible(handle):
            named.setdefault(wrap_text(label, 48), handle)
    return named


def _fit_legend(
    made: Callable[..., Legend], named: Mapping[str, Any], columns: int, width: float
) -> None:
    """Make a legend of so many columns, or of fewer, until it is no wider than that. It is read
    line by line: matplotlib fills columns.
    """
    for beside in range(min(columns, len(named)), 0, -1):
        texts = [text for column in range(beside) for text in list(named)[column::beside]]
        legend = made([named[text] for text in texts], texts, ncols=beside)
        if legend.get_window_extent().width <= width:
            return


def add_grey_legend_entry(axes: Axes, name: str, style: Mapping[str, Any]) -> None:
    """Name in the legend what is drawn in several colours; the line is out of sight."""
    line = {"color": "0.3", **style}
    axes.add_artist(Line2D([-1.0], [-1.0], transform=axes.transAxes, label=name, **line))


def _horizontal_extent(axes: Axes) -> tuple[float, float]:
    """From where to where a panel may reach from side to side, as fractions of the figure."""
    place = axes.get_subplotspec()
    if place is None:
        return 0.0, 1.0
    columns = place.get_gridspec().ncols
    return place.colspan.start / columns, place.colspan.stop / columns


def _is_visible(handle: Any) -> bool:
    """True if there is anything of it to be seen."""
    if isinstance(handle, ErrorbarContainer):
        handle = handle.lines[0]
    if isinstance(handle, Line2D):
        points = np.asarray(handle.get_xydata(), dtype=float)
        return bool(np.isfinite(points).all(axis=1).any())
    if isinstance(handle, PathCollection):
        return np.size(handle.get_offsets()) > 0
    return True


def share_legends(figure: Figure, panels: Sequence[Axes]) -> None:
    """Name what most panels name, or some of it, once and below them all."""
    named = {panel: _legend_entries(panel) for panel in panels if panel.get_legend()}
    alike: list[Axes] = []
    for fullest in named:
        within = [panel for panel, texts in named.items() if texts.keys() <= named[fullest].keys()]
        if len(within) > max(1, len(alike), len(panels) // 2):
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

    _fit_legend(made, named[chosen], 5, figure.bbox.width)


def enlarge_for_legends(figure: Figure, rows: Sequence[Sequence[Axes]]) -> None:
    """Make a figure as much taller as its legends and names of ticks are, so that they take nothing
    from the data.
    """
    beside = [[legend for panel in row if (legend := panel.get_legend())] for row in rows]
    heights = [
        max(map(_legend_height, legends), default=0.0) for legends in (*beside, figure.legends)
    ]
    line = 1.3 * float(rcParams["font.size"]) / 72.0
    heights += [line * (max(map(_tick_label_lines, row)) - 1.0) for row in rows]
    figure.set_figheight(figure.get_figheight() + sum(heights))


def _legend_height(legend: Legend) -> float:
    """Inches, with a line and a half between it and what it belongs to."""
    figure = cast(Figure, legend.figure)
    height = float(legend.get_window_extent().height)
    return height / figure.dpi + 1.5 * float(rcParams["font.size"]) / 72.0


def freeze_ticks(axes: Axes) -> None:
    """Have ticks that come when the style is no longer in force look as those that come now."""
    axes.tick_params(axis="x", labelsize=rcParams["xtick.labelsize"])
    axes.tick_params(axis="y", labelsize=rcParams["ytick.labelsize"])


def finalize_layout(figure: Figure) -> None:
    """Give everything its place: ticks take their style when they are made, and how much room they
    need is known only then.
    """
    layout = figure.get_layout_engine()
    if layout is None:  # a figure of the user's own may have taken it away
        figure.draw_without_rendering()
        return
    layout.execute(figure)
    for axes in figure.axes:
        _wrap_title(axes)
    layout.execute(figure)


def _wrap_title(axes: Axes) -> None:
    """Break a title that would be cut where the figure ends, or touch the letter of its panel: long
    names along y move the panel, and a scale of colours makes it narrow.
    """
    title, edges, panel = axes.title, cast(Figure, axes.figure).bbox, axes.get_window_extent()
    extent, middle = title.get_window_extent(), 0.5 * sum(panel.intervalx)
    left = panel.x0 if axes.get_title(loc="left") else edges.x0
    free = 1.9 * min(middle - left, edges.x1 - middle)
    if title.get_text() and extent.width > free:
        longest = max(map(visible_length, title.get_text().split("\n")))
        text = title.get_text().replace("\n", " ")
        title.set_text(wrap_text(text, int(0.95 * longest * free / extent.width)))
