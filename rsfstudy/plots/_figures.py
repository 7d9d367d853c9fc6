"""Figures of results: the `Figure` that a study declares, lines or maps of any lattice, or a
function ``draw(dataset, axes)`` of the user's own, or a module with one. How figures look is in
``rsfstudy.mplstyle``.
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

from rsfstudy.defaults import FIGURE_FORMATS
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
    freeze_ticks,
    share_legends,
)
from rsfstudy.plots._style import cycle_marker as cycle_marker
from rsfstudy.plots._style import cycle_style as cycle_style
from rsfstudy.plots._style import style_context as style_context
from rsfstudy.plots._text import format_number as format_number
from rsfstudy.plots._text import format_slope as format_slope
from rsfstudy.plots._text import quantity_symbol, to_mathtext, wrap_text
from rsfstudy.rig import convert_to_display_units, has_unexpected_units
from rsfstudy.status import Status
from rsfstudy.storage import read_declaration
from rsfstudy.study import Figure as Declared
from rsfstudy.study import Panel, Study, load_study, read_quantities, study_names
from rsfstudy.study import is_failed as is_failed
from rsfstudy.vocabulary import DERIVED_COORDINATES, find_quantity

#: What draws any lattice.
_GENERIC_NAMES = ("lines", "maps")
#: What draws fits of records.
_FITS_NAME = "fits"
#: Names of figures: those, and those of the named studies.
FIGURE_NAMES = (*_GENERIC_NAMES, _FITS_NAME, *study_names())

#: Points an inch of what a notebook shows.
_SCREEN_DPI = 150
#: What would make two files of one figure differ.
_METADATA_WITHOUT_DATES: dict[str, dict[str, Any]] = {
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}
#: Most points of axes that a figure does not know for which its panels are repeated, and panels
#: that there may be then.
_MAX_REPEATS, _MAX_REPEATED_PANELS = 4, 12
#: Height in mm of a panel of a scatter matrix.
_SCATTER_PANEL_HEIGHT = 44.0


class NotebookFigure(Figure):
    """A figure that a notebook shows, without pyplot."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        FigureCanvasAgg(self)  # keeps its renderer, and with it how large texts are

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=_SCREEN_DPI)
        return image.getvalue()


def draw_figure(
    dataset: xr.Dataset, own: Any = None, *, variable: str | None = None, style: Any = None
) -> Figure:
    """The figure of a results dataset, as its study declares it, with all its panels.

    Parameters
    ----------
    dataset : xarray.Dataset
    own : function or module, optional
        What draws it where that is no module of `rsfstudy.plots`.
    variable : str, optional
        Draw this variable instead: as maps over two numeric axes, else as lines.
    style : path, str, dict or list of those, optional
        Style sheets (files that end in ``.mplstyle``), names of styles of matplotlib, or settings,
        applied on top of the style of rsfstudy.

    Raises
    ------
    InvalidValue
        Where the declaration names no module of `rsfstudy.plots`; nothing else is ever imported.
        Where there is no such variable or style.
    """
    draws = own is None or isinstance(own, str | Declared) or callable(getattr(own, "draw", own))
    if not draws:
        rule = "must be a Figure, or a function or module of yours that draws"
        raise InvalidValue("own", own, rule, remedy="Write def name(dataset, axes): ...")
    dataset = convert_to_display_units(dataset)
    with style_context(style):
        drawing, dataset = _choose_figure(dataset, own, variable)
        panels = drawing.panels
        columns = min(drawing.columns, len(panels))
        rows = -(-len(panels) // columns)
        height = drawing.height(dataset) if callable(drawing.height) else drawing.height
        figure = NotebookFigure(figsize=figure_size(columns, rows, height), layout="constrained")
        drawn = [figure.add_subplot(rows, columns, number + 1) for number in range(len(panels))]
        for axes, panel in zip(drawn, panels, strict=True):
            freeze_ticks(axes)
            _panel.draw_panel(panel, dataset, axes)
        _panel.finalize_panels(panels, drawn)
        for scale in figure.axes:
            if scale not in drawn:
                freeze_ticks(scale)
        add_panel_letters(drawn)
        share_legends(figure, drawn)
        lacking, overrides = _missing_cells_note(dataset), read_declaration(dataset).overrides
        said = [_overrides_note(dataset, columns)] if overrides else []
        if said or lacking:
            color = "tab:red" if lacking else "0.4"
            figure.suptitle("\n".join(filter(None, (*said, lacking))), color=color)
        enlarge_for_legends(figure, [drawn[i : i + columns] for i in range(0, len(drawn), columns)])
        finalize_layout(figure)
    return figure


def _missing_cells_note(dataset: xr.Dataset) -> str:
    """The cells that a figure cannot show, in brackets; nothing where it shows all."""
    completeness = dataset.attrs.get("completeness", "complete")
    failed = int((is_failed(dataset["status"]) & (dataset["status"] != Status.PENDING)).sum())
    parts = [completeness] * (completeness != "complete")
    parts += [f"{pluralize(failed, 'cell')} failed"] * (failed > 0)
    return f"[{', '.join(parts)}]" * bool(parts)


def _overrides_note(dataset: xr.Dataset, columns: int) -> str:
    own = read_quantities(dataset)
    names = {n: quantity_symbol(find_quantity(n, own)) for n in read_declaration(dataset).overrides}
    values = {names[name]: value for name, value in read_declaration(dataset).overrides.items()}
    text = to_mathtext(
        format_overrides(values).replace("=", " = ").replace(",", ", ").replace(",  ", ", ")
    )
    return wrap_text(f"not as declared: {text}", 55 if columns == 1 else 120)


# ---- what draws ---------------------------------------------------------------------------------


def _choose_figure(
    dataset: xr.Dataset, own: Any = None, variable: str | None = None
) -> tuple[Declared, xr.Dataset]:
    """Figure of a dataset with all its panels, and the dataset with the axes that it expects: the
    one that the study declares, or plain lines or maps if there are more axes than that can show.
    """
    name, sizes = read_declaration(dataset).plot, dataset["status"].sizes
    study = load_study(name) if name in study_names() else None
    if name == _FITS_NAME and own is variable is None:
        return Declared(
            importlib.import_module(f"{__package__}.{_FITS_NAME}").panels(dataset)
        ), dataset
    if own is None and study is None and name not in (*_GENERIC_NAMES, _FITS_NAME):
        raise InvalidValue("plot", name, "is unknown", choices=FIGURE_NAMES)
    known = {str(dimension) for dimension in sizes}
    if study is not None and own in (None, study.plot):
        own, dataset = study.plot, _restore_axes(dataset, study)
        if isinstance(own, Declared) and not own.allow_extra_dims:
            known = set(study.dimensions)
    elif isinstance(own, Declared):
        known -= set(read_declaration(dataset).overrides) - own.dimensions
    varied = {str(dimension) for dimension, points in sizes.items() if points > 1}
    further = sorted(varied - known)
    many = math.prod(sizes[dimension] for dimension in further) > _MAX_REPEATS
    plain = variable is not None or own is None or isinstance(own, str)
    if plain or many or has_unexpected_units(dataset):
        return _generic_figure(dataset, variable), dataset
    drawing = own if isinstance(own, Declared) else Declared([getattr(own, "draw", own)])
    dataset = dataset.squeeze(sorted(set(map(str, sizes)) - known - varied), drop=False)
    panels = _expand_panels(drawing, dataset, further)
    few = panels and (len(panels) <= _MAX_REPEATED_PANELS or not further)
    return (replace(drawing, panels=panels) if few else _generic_figure(dataset)), dataset


def _expand_panels(drawing: Declared, dataset: xr.Dataset, further: Sequence[str]) -> list[Panel]:
    """The panels of a figure, each of one point of the axes that have a panel for each; and of each
    point of axes that it does not know, which titles say.
    """
    found: list[Panel] = []
    for at in np.ndindex(*(dataset.sizes[dimension] for dimension in further)):
        where = dict(zip(further, at, strict=True))
        part = dataset.isel(where)
        said = ", ".join(describe_point(part, dimension) for dimension in further)
        each = [one for panel in drawing.panels for one in _panel.expand_facets(panel, part)]
        found += [_panel.at_extra_dims(panel, where, said) for panel in each] if further else each
    named = [panel.y for panel in drawing.panels if isinstance(panel.y, str) and panel.y]
    if not found and named and not any(name in dataset for name in named):
        rule = "does not fit these results (they have none of its variables)"
        raise InvalidValue("plot", read_declaration(dataset).plot, rule)
    return found


def _restore_axes(dataset: xr.Dataset, study: Study) -> xr.Dataset:
    """The dataset with the axes of its study of which one point was selected."""
    gone = [d for d in study.dimensions if d not in dataset.dims and d in dataset.coords]
    if not gone:
        return dataset
    reduced = tuple(reduction.name for reduction in study.reductions)
    cells = [name for name in dataset.data_vars if not str(name).startswith(reduced)]
    derived = {
        name: (axis, np.atleast_1d(dataset[name]), dataset[name].attrs)
        for name, (axis, _formula) in DERIVED_COORDINATES.items()
        if axis in gone and name in dataset.coords
    }
    measured = dataset[cells].drop_vars(derived).expand_dims(gone)
    return dataset.drop_vars([*cells, *derived, *gone]).merge(measured).assign_coords(derived)


def _generic_figure(dataset: xr.Dataset, variable: str | None = None) -> Declared:
    """Figure of any lattice: histograms and scatters of samples, maps where it has two numeric
    axes, else lines.
    """
    from rsfstudy.plots import _axes, lines, maps, samples

    logarithms = [n for n in map(str, dataset.data_vars) if "log10_" in n]
    dataset = dataset.drop_vars([n for n in logarithms if n.replace("log10_", "") in dataset])
    if square := samples.panels(dataset, variable):
        return Declared(square, samples.square_side(square), _SCATTER_PANEL_HEIGHT)
    for module in (maps, lines):
        if found := module.panels(dataset, variable):
            return Declared(found)
    choices = [
        str(name) for name, values in dataset.data_vars.items() if _axes.is_numeric_variable(values)
    ]
    raise InvalidValue("variable", variable, "is no number of these results", choices=choices)


# ---- files --------------------------------------------------------------------------------------


def save_figure(
    dataset: xr.Dataset,
    path: Path,
    own: Any = None,
    *,
    variable: str | None = None,
    style: Any = None,
) -> None:
    """Write the figure of a results dataset, as PNG, PDF or SVG by the ending of the path: the old
    file stays, or the whole new one.

    Parameters
    ----------
    dataset : xarray.Dataset
    path : Path
    own, variable, style : optional
        As in `figure`.

    Raises
    ------
    InvalidValue
        Where the figure the study declares does not fit its results.
    OSError
        Where it cannot be written.
    """
    form = path.suffix[1:].lower()
    if form not in FIGURE_FORMATS:
        raise InvalidValue("figure", path.name, "needs an ending we write", choices=FIGURE_FORMATS)
    try:
        drawn = draw_figure(dataset, own, variable=variable, style=style)
        drawn.set_layout_engine(None)  # everything has its place
        with style_context(style):
            image = render_figure(drawn, form)
    except RsfStudyError:
        raise
    except Exception as error:
        rule = f"does not fit these results ({type(error).__name__}: {error})"
        raise InvalidValue("plot", read_declaration(dataset).plot, rule) from error
    write_image(image, path)


def render_figure(drawn: Figure, form: str) -> bytes:
    """A figure as PNG, PDF or SVG."""
    image = io.BytesIO()
    drawn.savefig(image, format=form, metadata=_METADATA_WITHOUT_DATES.get(form))
    return image.getvalue()


def write_image(image: bytes, path: Path) -> None:
    """Write an image, so that the old file stays, or the whole new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.unlink(missing_ok=True)  # were it a link or a pipe, writing would go elsewhere
        beside.write_bytes(image)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
