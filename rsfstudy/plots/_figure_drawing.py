"""Functions that draw and save the figures of studies.

The function ``draw_figure`` draws the figure that a study declares, a generic figure that can
display any study, or a user-defined figure. The function ``save_figure`` writes the figure of a
study to a file. The style sheet ``rsfstudy.mplstyle`` defines the appearance of all figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.formatting import format_count_with_noun, format_overrides
from rsfstudy.plots import _panel
from rsfstudy.plots._figure_choice import choose_figure_and_build_panels
from rsfstudy.plots._figure_size import (
    compute_figure_size_in_inches,
    compute_max_header_line_characters,
    limit_panel_column_count_to_width,
)
from rsfstudy.plots._image_files import Figure, NotebookFigure, render_figure, write_image
from rsfstudy.plots._style import (
    add_panel_letters,
    finalize_layout,
    freeze_tick_label_size,
    increase_figure_height_for_legends,
    merge_common_legends,
    style_context,
)
from rsfstudy.plots._text_formatting import (
    convert_symbols_to_mathtext,
    find_quantity_symbol_or_name,
    wrap_text,
)
from rsfstudy.plots.corner_plots import CornerFigure
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset
from rsfstudy.study import Figure as Declared
from rsfstudy.study import is_failed_or_pending, read_quantities_not_in_vocabulary
from rsfstudy.vocabulary import find_quantity

#: Colours of the header. The header is red if cells are missing, or if the fraction of failed cells
#: exceeds the limit.
_HEADER_COLOUR, _WARNING_COLOUR = "0.4", "tab:red"
_MAX_FAILED_FRACTION_WITHOUT_WARNING = 0.01


@accept_former_keyword_names
def draw_figure(
    dataset: xr.Dataset,
    user_figure: Any = None,
    *,
    variable: str | None = None,
    style: Any = None,
    width: Any = None,
    header: bool = True,
) -> Figure:
    """Draw the figure of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study. The dataset must contain the variable ``status`` along the dimensions of
        the lattice, the variables that the figure displays, and the attributes that
        ``rsfstudy.run`` adds.
    user_figure : callable, module, Figure or str, optional
        User-defined figure: a function ``draw(dataset, axes)``, a module with a function ``draw``,
        or an ``rsfstudy.Figure``. A string is the name of a generic figure, ``"maps"`` or
        ``"lines"``. The default is the figure that the study declares.
    variable : str, optional
        Name of a variable to draw instead of the declared figure. The variable is drawn as maps if
        the lattice has two numeric axes, and as lines otherwise.
    style : path, str, dict or list, optional
        Styles that override the style of rsfstudy: style sheets with the suffix ``.mplstyle``,
        names of matplotlib styles, or dictionaries of matplotlib settings.
    width : quantity, optional
        Width of the figure, from "60 mm" to "600 mm". If the panels of a row would be narrower than
        55 mm, the row has fewer panels. By default, the figure is as wide as a column (84 mm) or
        the text (174 mm) of a journal page.
    header : bool, default: True
        If False, the figure has no header. The header lists overrides of the study, and missing and
        failed cells.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with all its panels. The attribute ``axes`` of the figure contains the panels,
        followed by the colour bars.

    Raises
    ------
    InvalidValue
        If the declaration of the study contains an unknown figure, if ``user_figure`` cannot draw,
        if the variable is missing or not numeric, or if a style or the width is invalid.
    DataError
        If the dataset has no attribute with a declaration, or if x and y of a curve have different
        sizes.

    Notes
    -----
    Only figures of rsfstudy can be selected by name. The function never imports a module whose name
    is stored in a results file.

    If the results have more axes than the declared figure can display, the function draws a generic
    figure of maps or lines instead.

    Examples
    --------
    >>> import rsfstudy
    >>> from rsfstudy.measures import LinearStability
    >>> from rsfstudy.plots import draw_figure
    >>> axis = rsfstudy.Axis("b_over_a", [1.5, 2.0, 3.0])
    >>> study = rsfstudy.Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=rsfstudy.Scene(),
    ...     axes=[axis],
    ...     measure=LinearStability(),
    ... )
    >>> results = rsfstudy.run(study, workers=0, output=None, progress=False)
    >>> figure = draw_figure(results, variable="critical_stiffness")
    >>> figure.axes[0].get_title()
    'Critical stiffness'
    """
    draws = (
        user_figure is None
        or isinstance(user_figure, str | Declared)
        or callable(getattr(user_figure, "draw", user_figure))
    )
    if not draws:
        rule = "must be a Figure, or a function or module that draws a figure"
        raise InvalidValue(
            "own",
            user_figure,
            rule,
            remedy="A function must have the signature name(dataset, axes).",
        )
    dataset = DatasetUnits(dataset).convert_to_display_units()
    with style_context(style, width):
        drawing, dataset = choose_figure_and_build_panels(dataset, user_figure, variable)
        is_corner = isinstance(drawing, CornerFigure)
        columns = min(drawing.columns, len(drawing.panels))
        columns = columns if is_corner else limit_panel_column_count_to_width(columns)
        figure, drawn = _create_empty_panels(drawing, dataset, columns)
        for axes, panel in zip(drawn, drawing.panels, strict=True):
            freeze_tick_label_size(axes)
            _panel.draw_panel(panel, dataset, axes)
        _panel.finalize_scales_and_legends(drawing.panels, drawn)
        for scale in figure.axes:
            if scale not in drawn:
                freeze_tick_label_size(scale)
        if isinstance(drawing, CornerFigure):
            drawing.align_x_axes_and_hide_inner_labels(drawn)
        else:
            add_panel_letters(drawn)
        # Only the panels of the primary output in a corner plot have several colours and a legend.
        merge_common_legends(figure, [a for a in drawn if a.get_legend()] if is_corner else drawn)
        if header:
            _add_header_with_notes(figure, dataset)
        rows = [[a for a in drawn if _find_row_index_of_panel(a) == n] for n in range(len(drawn))]
        increase_figure_height_for_legends(figure, list(filter(None, rows)))
        finalize_layout(figure)
    return figure


def _create_empty_panels(
    figure_declaration: Declared, dataset: xr.Dataset, column_count: int
) -> tuple[NotebookFigure, list[Axes]]:
    """Create a figure with empty panels."""
    rows, places = (
        -(-len(figure_declaration.panels) // column_count),
        list(range(len(figure_declaration.panels))),
    )
    height = (
        figure_declaration.height(dataset)
        if callable(figure_declaration.height)
        else figure_declaration.height
    )
    size = compute_figure_size_in_inches(column_count, rows, height)
    if isinstance(figure_declaration, CornerFigure):
        rows, places, size = (
            column_count,
            figure_declaration.subplot_positions,
            figure_declaration.compute_size_in_inches(),
        )
    figure = NotebookFigure(figsize=size, layout="constrained")
    return figure, [figure.add_subplot(rows, column_count, place + 1) for place in places]


def _find_row_index_of_panel(axes: Axes) -> int:
    """Return the index of the row that contains a panel."""
    place = axes.get_subplotspec()
    return 0 if place is None else place.rowspan.start


def _add_header_with_notes(figure: Figure, dataset: xr.Dataset) -> None:
    """Add a header that lists overridden settings, missing cells and failed cells."""
    overrides = StoredDataset(dataset).study_declaration.overrides
    missing, is_warning = _format_note_on_missing_cells(dataset)
    lines = (
        [_format_note_on_overrides(dataset, compute_max_header_line_characters(figure))]
        if overrides
        else []
    )
    if lines or missing:
        color = _WARNING_COLOUR if is_warning else _HEADER_COLOUR
        figure.suptitle("\n".join(filter(None, (*lines, missing))), color=color)


def _format_note_on_missing_cells(dataset: xr.Dataset) -> tuple[str, bool]:
    """Return a note about missing and failed cells, and a flag that marks it as a warning.

    The note is in brackets. If the results are complete, the note is empty.
    """
    completeness = dataset.attrs.get("completeness", "complete")
    failed = is_failed_or_pending(dataset["status"]) & (dataset["status"] != Status.PENDING)
    count = int(failed.sum())
    parts = [completeness] * (completeness != "complete")
    parts += [f"{format_count_with_noun(count, 'cell')} failed"] * (count > 0)
    many = count > _MAX_FAILED_FRACTION_WITHOUT_WARNING * failed.size
    return f"[{', '.join(parts)}]" * bool(parts), many or completeness != "complete"


def _format_note_on_overrides(dataset: xr.Dataset, max_line_characters: int) -> str:
    """Return a note about settings that differ from the study declaration."""
    own = read_quantities_not_in_vocabulary(dataset)
    names = {
        n: find_quantity_symbol_or_name(find_quantity(n, own))
        for n in StoredDataset(dataset).study_declaration.overrides
    }
    values = {
        names[name]: value
        for name, value in StoredDataset(dataset).study_declaration.overrides.items()
    }
    text = convert_symbols_to_mathtext(
        format_overrides(values).replace("=", " = ").replace(",", ", ").replace(",  ", ", ")
    )
    return wrap_text(f"overrides: {text}", max_line_characters)


@accept_former_keyword_names
def save_figure(
    dataset: xr.Dataset,
    path: Path,
    user_figure: Any = None,
    *,
    variable: str | None = None,
    style: Any = None,
    width: Any = None,
    header: bool = True,
) -> None:
    """Write the figure of a study to a file.

    If an error occurs, an existing file with the same path is not changed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, with the variables and attributes that ``draw_figure`` needs.
    path : Path
        Path of the file. The suffix ``.png``, ``.pdf`` or ``.svg`` determines the format.
    user_figure : callable, module, Figure or str, optional
        User-defined figure, as for ``draw_figure``.
    variable : str, optional
        Name of a variable to draw instead of the declared figure, as for ``draw_figure``.
    style : path, str, dict or list, optional
        Styles that override the style of rsfstudy, as for ``draw_figure``.
    width : quantity, optional
        Width of the figure, as for ``draw_figure``.
    header : bool, default: True
        If False, the figure has no header, as for ``draw_figure``.

    Raises
    ------
    InvalidValue
        If the suffix of the file is unknown, or if the figure cannot display the results.
    DataError
        If the dataset has no attribute with a declaration.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import rsfstudy
    >>> from rsfstudy.measures import LinearStability
    >>> from rsfstudy.plots import save_figure
    >>> axis = rsfstudy.Axis("b_over_a", [1.5, 2.0, 3.0])
    >>> study = rsfstudy.Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=rsfstudy.Scene(),
    ...     axes=[axis],
    ...     measure=LinearStability(),
    ... )
    >>> results = rsfstudy.run(study, workers=0, output=None, progress=False)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = Path(directory, "figure.png")
    ...     save_figure(results, path, variable="critical_stiffness")
    ...     path.exists()
    True
    """
    form = path.suffix[1:].lower()
    if form not in Defaults.FIGURE_FORMATS:
        raise InvalidValue(
            "figure", path.name, "has an unsupported suffix", choices=Defaults.FIGURE_FORMATS
        )
    try:
        drawn = draw_figure(
            dataset, user_figure, variable=variable, style=style, width=width, header=header
        )
        # The layout is final, so it must not be computed again when the figure is saved.
        drawn.set_layout_engine(None)
        with style_context(style):
            image = render_figure(drawn, form)
    except RsfStudyError:
        raise
    except Exception as error:
        rule = f"does not fit these results ({type(error).__name__}: {error})"
        raise InvalidValue("plot", StoredDataset(dataset).study_declaration.plot, rule) from error
    write_image(image, path)
