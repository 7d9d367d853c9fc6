"""Drawing and saving of the figures of study results.

The function ``draw_figure`` draws the figure that a study declares, a generic figure that can
display any study, or a user-defined figure. The function ``save_figure`` writes the figure of a
study to a file. The style sheet ``rsfstudy.mplstyle`` defines the appearance of all figures.
"""

from __future__ import annotations

import importlib
import io
import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Figure

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.formatting import format_overrides, pluralize
from rsfstudy.plots import _panel
from rsfstudy.plots._axes import describe_point as describe_point
from rsfstudy.plots._axes import label_rows as label_rows
from rsfstudy.plots._style import add_grey_legend_entry as add_grey_legend_entry
from rsfstudy.plots._style import (
    add_panel_letters,
    enlarge_for_legends,
    figure_size,
    finalize_layout,
    freeze_tick_label_size,
    merge_common_legends,
)
from rsfstudy.plots._style import cycle_marker as cycle_marker
from rsfstudy.plots._style import cycle_style as cycle_style
from rsfstudy.plots._style import style_context as style_context
from rsfstudy.plots._text import format_number as format_number
from rsfstudy.plots._text import format_slope as format_slope
from rsfstudy.plots._text import quantity_symbol, to_mathtext, wrap_text
from rsfstudy.rig import DatasetUnits
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset
from rsfstudy.study import Figure as Declared
from rsfstudy.study import Panel, Study, load_study, read_quantities_not_in_vocabulary, study_names
from rsfstudy.study import failed_cell_mask as failed_cell_mask
from rsfstudy.vocabulary import FORMULAS_OF_DERIVED_COORDINATES, find_quantity

#: Names of the generic figures that can display any study.
_NAMES_OF_FIGURES_FOR_ANY_LATTICE = ("lines", "maps")
#: Name of the figure that shows fits of records.
_NAME_OF_FITS_FIGURE = "fits"
#: Names of all figures, including the figures of the named studies.
FIGURE_NAMES = (*_NAMES_OF_FIGURES_FOR_ANY_LATTICE, _NAME_OF_FITS_FIGURE, *study_names())

#: Resolution of figures in notebooks, in dots per inch.
_SCREEN_DPI = 150
#: Metadata that remove the creation date from an image file, so that two files of the same figure
#: are identical.
_IMAGE_METADATA_WITHOUT_DATES: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}
#: The panels of a figure are repeated for each point of additional axes. The first value is the
#: maximum number of such points, and the second value is the maximum number of panels after the
#: repetition.
_MAX_POINTS_OF_REPEATED_AXES, _MAX_PANELS_AFTER_REPEATING = 4, 12
#: Height of a panel of a scatter matrix in mm.
_SCATTER_PANEL_HEIGHT = 44.0


class NotebookFigure(Figure):
    """Figure that notebooks display without pyplot.

    Parameters
    ----------
    *args : object
        Positional arguments of ``matplotlib.figure.Figure``.
    **options : object
        Keyword arguments of ``matplotlib.figure.Figure``.

    Examples
    --------
    >>> from rsfstudy.plots import NotebookFigure
    >>> figure = NotebookFigure(figsize=(3.0, 2.0))
    >>> axes = figure.add_subplot()
    >>> len(figure.axes)
    1
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        """Create the figure with a canvas that can render images."""
        super().__init__(*args, **options)
        # The canvas keeps its renderer, which is used to measure the size of text.
        FigureCanvasAgg(self)

    def _repr_png_(self) -> bytes:
        """Return the figure as a PNG image for notebooks."""
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=_SCREEN_DPI)
        return image.getvalue()


@accept_former_keyword_names
def draw_figure(
    dataset: xr.Dataset, user_figure: Any = None, *, variable: str | None = None, style: Any = None
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

    Returns
    -------
    matplotlib.figure.Figure
        Figure with all its panels. The attribute ``axes`` of the figure contains the panels,
        followed by the colour bars.

    Raises
    ------
    InvalidValue
        If the declaration of the study contains an unknown figure, if ``user_figure`` cannot draw,
        if the variable is missing or not numeric, or if a style is invalid.
    DataError
        If the dataset has no attribute with a declaration, or if x and y of a curve have different
        sizes.

    Notes
    -----
    Only figures of rsfstudy can be selected by name. The function never imports a module that a
    results file names.

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
        rule = "must be a Figure, or a user-defined function or module that draws"
        raise InvalidValue(
            "own", user_figure, rule, remedy="Define, for example, def name(dataset, axes): ..."
        )
    dataset = DatasetUnits(dataset).convert_for_display()
    with style_context(style):
        drawing, dataset = _choose_figure(dataset, user_figure, variable)
        panels = drawing.panels
        columns = min(drawing.columns, len(panels))
        rows = -(-len(panels) // columns)
        height = drawing.height(dataset) if callable(drawing.height) else drawing.height
        figure = NotebookFigure(figsize=figure_size(columns, rows, height), layout="constrained")
        drawn = [figure.add_subplot(rows, columns, number + 1) for number in range(len(panels))]
        for axes, panel in zip(drawn, panels, strict=True):
            freeze_tick_label_size(axes)
            _panel.draw_panel(panel, dataset, axes)
        _panel.finalize_scales_and_legends(panels, drawn)
        for scale in figure.axes:
            if scale not in drawn:
                freeze_tick_label_size(scale)
        add_panel_letters(drawn)
        merge_common_legends(figure, drawn)
        lacking, overrides = (
            _missing_cells_note(dataset),
            StoredDataset(dataset).declaration.overrides,
        )
        said = [_format_note_on_overrides(dataset, columns)] if overrides else []
        if said or lacking:
            color = "tab:red" if lacking else "0.4"
            figure.suptitle("\n".join(filter(None, (*said, lacking))), color=color)
        enlarge_for_legends(figure, [drawn[i : i + columns] for i in range(0, len(drawn), columns)])
        finalize_layout(figure)
    return figure


def _missing_cells_note(dataset: xr.Dataset) -> str:
    """Return a note in brackets about missing and failed lattice cells.

    The note is empty if the results are complete.
    """
    completeness = dataset.attrs.get("completeness", "complete")
    failed = int(
        (failed_cell_mask(dataset["status"]) & (dataset["status"] != Status.PENDING)).sum()
    )
    parts = [completeness] * (completeness != "complete")
    parts += [f"{pluralize(failed, 'cell')} failed"] * (failed > 0)
    return f"[{', '.join(parts)}]" * bool(parts)


def _format_note_on_overrides(dataset: xr.Dataset, max_line_characters: int) -> str:
    """Return a note about settings that differ from the study declaration."""
    own = read_quantities_not_in_vocabulary(dataset)
    names = {
        n: quantity_symbol(find_quantity(n, own))
        for n in StoredDataset(dataset).declaration.overrides
    }
    values = {
        names[name]: value for name, value in StoredDataset(dataset).declaration.overrides.items()
    }
    text = to_mathtext(
        format_overrides(values).replace("=", " = ").replace(",", ", ").replace(",  ", ", ")
    )
    return wrap_text(f"overrides: {text}", 55 if max_line_characters == 1 else 120)


# ---- choice of the figure -----------------------------------------------------------------------


def _choose_figure(
    dataset: xr.Dataset, user_figure: Any = None, variable: str | None = None
) -> tuple[Declared, xr.Dataset]:
    """Choose the figure of a dataset and create all its panels.

    The function also returns the dataset with the axes that the figure expects. If the dataset has
    more axes than the declared figure can display, the function chooses a generic figure of maps or
    lines.
    """
    name, sizes = StoredDataset(dataset).declaration.plot, dataset["status"].sizes
    study = load_study(name) if name in study_names() else None
    if name == _NAME_OF_FITS_FIGURE and user_figure is variable is None:
        return Declared(
            importlib.import_module(f"{__package__}.{_NAME_OF_FITS_FIGURE}").panels(dataset)
        ), dataset
    if (
        user_figure is None
        and study is None
        and name not in (*_NAMES_OF_FIGURES_FOR_ANY_LATTICE, _NAME_OF_FITS_FIGURE)
    ):
        raise InvalidValue("plot", name, "is unknown", choices=FIGURE_NAMES)
    known = {str(dimension) for dimension in sizes}
    if study is not None and user_figure in (None, study.plot):
        user_figure, dataset = study.plot, _restore_dimensions_of_selected_axes(dataset, study)
        if isinstance(user_figure, Declared) and not user_figure.allow_extra_dims:
            known = set(study.dimensions)
    elif isinstance(user_figure, Declared):
        known -= set(StoredDataset(dataset).declaration.overrides) - user_figure.dimensions
    varied = {str(dimension) for dimension, points in sizes.items() if points > 1}
    further = sorted(varied - known)
    many = math.prod(sizes[dimension] for dimension in further) > _MAX_POINTS_OF_REPEATED_AXES
    plain = variable is not None or user_figure is None or isinstance(user_figure, str)
    if plain or many or DatasetUnits(dataset).are_unexpected_by_figures:
        return _generic_figure(dataset, variable), dataset
    drawing = (
        user_figure
        if isinstance(user_figure, Declared)
        else Declared([getattr(user_figure, "draw", user_figure)])
    )
    dataset = dataset.squeeze(sorted(set(map(str, sizes)) - known - varied), drop=False)
    panels = _expand_panels_of_figure(drawing, dataset, further)
    few = panels and (len(panels) <= _MAX_PANELS_AFTER_REPEATING or not further)
    return (replace(drawing, panels=panels) if few else _generic_figure(dataset)), dataset


def _expand_panels_of_figure(
    figure_declaration: Declared, dataset: xr.Dataset, extra_dimensions: Sequence[str]
) -> list[Panel]:
    """Create the panels of a figure for all facets and additional axes.

    Additional axes are axes that the declaration of the figure does not mention. The panels are
    repeated for each point of the additional axes, and the titles describe the points.
    """
    found: list[Panel] = []
    for at in np.ndindex(*(dataset.sizes[dimension] for dimension in extra_dimensions)):
        where = dict(zip(extra_dimensions, at, strict=True))
        part = dataset.isel(where)
        said = ", ".join(describe_point(part, dimension) for dimension in extra_dimensions)
        each = [
            one for panel in figure_declaration.panels for one in _panel.expand_facets(panel, part)
        ]
        found += (
            [_panel.restrict_panel_to_point_of_extra_dims(panel, where, said) for panel in each]
            if extra_dimensions
            else each
        )
    named = [panel.y for panel in figure_declaration.panels if isinstance(panel.y, str) and panel.y]
    if not found and named and not any(name in dataset for name in named):
        rule = "does not fit these results, because the results do not contain its variables"
        raise InvalidValue("plot", StoredDataset(dataset).declaration.plot, rule)
    return found


def _restore_dimensions_of_selected_axes(dataset: xr.Dataset, study: Study) -> xr.Dataset:
    """Restore the dimensions of axes that were reduced to a single point."""
    gone = [d for d in study.dimensions if d not in dataset.dims and d in dataset.coords]
    if not gone:
        return dataset
    reduced = tuple(reduction.name for reduction in study.reductions)
    cells = [name for name in dataset.data_vars if not str(name).startswith(reduced)]
    derived = {
        name: (axis, np.atleast_1d(dataset[name]), dataset[name].attrs)
        for name, (axis, _formula) in FORMULAS_OF_DERIVED_COORDINATES.items()
        if axis in gone and name in dataset.coords
    }
    measured = dataset[cells].drop_vars(derived).expand_dims(gone)
    return dataset.drop_vars([*cells, *derived, *gone]).merge(measured).assign_coords(derived)


def _generic_figure(dataset: xr.Dataset, variable: str | None = None) -> Declared:
    """Return a generic figure that can display any study.

    The figure is a scatter matrix for studies with samples, a set of maps if there are two numeric
    axes, and a line plot otherwise.
    """
    from rsfstudy.plots import _axes, lines, maps, samples

    logarithms = [n for n in map(str, dataset.data_vars) if "log10_" in n]
    dataset = dataset.drop_vars([n for n in logarithms if n.replace("log10_", "") in dataset])
    if square := samples.panels(dataset, variable):
        return Declared(
            square, samples.count_panels_per_side_of_scatter_matrix(square), _SCATTER_PANEL_HEIGHT
        )
    for module in (maps, lines):
        if found := module.panels(dataset, variable):
            return Declared(found)
    choices = [
        str(name) for name, values in dataset.data_vars.items() if _axes.is_numeric_variable(values)
    ]
    raise InvalidValue(
        "variable", variable, "is not a numeric variable of these results", choices=choices
    )


# ---- files --------------------------------------------------------------------------------------


@accept_former_keyword_names
def save_figure(
    dataset: xr.Dataset,
    path: Path,
    user_figure: Any = None,
    *,
    variable: str | None = None,
    style: Any = None,
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
        drawn = draw_figure(dataset, user_figure, variable=variable, style=style)
        # The layout is final, so it must not be computed again when the figure is saved.
        drawn.set_layout_engine(None)
        with style_context(style):
            image = render_figure(drawn, form)
    except RsfStudyError:
        raise
    except Exception as error:
        rule = f"does not fit these results ({type(error).__name__}: {error})"
        raise InvalidValue("plot", StoredDataset(dataset).declaration.plot, rule) from error
    write_image(image, path)


@accept_former_keyword_names
def render_figure(figure: Figure, image_format: str) -> bytes:
    r"""Render a figure as an image.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to render.
    image_format : {"png", "pdf", "svg"}
        Format of the image.

    Returns
    -------
    bytes
        Contents of an image file without a creation date.

    Examples
    --------
    >>> from rsfstudy.plots import NotebookFigure, render_figure
    >>> image = render_figure(NotebookFigure(figsize=(1.0, 1.0)), "png")
    >>> image[:4]
    b'\x89PNG'
    """
    image = io.BytesIO()
    figure.savefig(
        image, format=image_format, metadata=_IMAGE_METADATA_WITHOUT_DATES.get(image_format)
    )
    return image.getvalue()


def write_image(image: bytes, path: Path) -> None:
    """Write an image to a file atomically.

    The function writes the image to a temporary file in the same directory, and renames the
    temporary file. Missing parent directories are created.

    Parameters
    ----------
    image : bytes
        Encoded image.
    path : Path
        Path of the file.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from rsfstudy.plots import NotebookFigure, render_figure, write_image
    >>> image = render_figure(NotebookFigure(figsize=(1.0, 1.0)), "svg")
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = Path(directory, "figures", "empty.svg")
    ...     write_image(image, path)
    ...     path.read_bytes() == image
    True
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.new")
    try:
        # If the temporary file were a link or a pipe, the image would be written to another place.
        beside.unlink(missing_ok=True)
        beside.write_bytes(image)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
