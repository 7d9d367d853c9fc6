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

from rsfstudy.declare import catalogue, names
from rsfstudy.declare.figure import Figure as Declared
from rsfstudy.declare.figure import Panel
from rsfstudy.declare.study import Study
from rsfstudy.defaults import FIGURES
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.files.contents import declaration
from rsfstudy.plots import _panel
from rsfstudy.plots._axes import name_rows as name_rows
from rsfstudy.plots._axes import place as place
from rsfstudy.plots._style import hold_ticks, letter, make_room, settle, share_legends, size
from rsfstudy.plots._style import in_grey as in_grey
from rsfstudy.plots._style import look as look
from rsfstudy.plots._style import marker as marker
from rsfstudy.plots._style import styled as styled
from rsfstudy.plots._text import number as number
from rsfstudy.plots._text import pretty, symbol, wrapped
from rsfstudy.plots._text import slope_with_error as slope_with_error
from rsfstudy.reduce.base import failed as is_failed
from rsfstudy.reduce.base import stated_by
from rsfstudy.rig.scales import in_units_of_rig, is_in_other_units
from rsfstudy.status import Status
from rsfstudy.vocabulary import DERIVED, quantity
from rsfstudy.wording import counted, settings

#: What draws any lattice.
_ANY = ("lines", "maps")
#: What draws fits of records.
_FITS = "fits"
#: Names of figures: those, and those of the named studies.
NAMES = (*_ANY, _FITS, *names.names())

#: Points an inch of what a notebook shows.
_ON_SCREEN = 150
#: What would make two files of one figure differ.
_DATES: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
#: Most points of axes that a figure does not know for which its panels are repeated, and panels
#: that there may be then.
_REPEATED, _MOST = 4, 12
#: Height in mm of a panel of a scatter matrix.
_OF_SQUARE = 44.0


class Drawing(Figure):
    """A figure that a notebook shows, without pyplot."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        FigureCanvasAgg(self)  # keeps its renderer, and with it how large texts are

    def _repr_png_(self) -> bytes:
        image = io.BytesIO()
        self.savefig(image, format="png", dpi=_ON_SCREEN)
        return image.getvalue()


def figure(
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
    dataset = in_units_of_rig(dataset)
    with styled(style):
        drawing, dataset = _fitting(dataset, own, variable)
        panels = drawing.panels
        columns = min(drawing.columns, len(panels))
        rows = -(-len(panels) // columns)
        height = drawing.height(dataset) if callable(drawing.height) else drawing.height
        figure = Drawing(figsize=size(columns, rows, height), layout="constrained")
        drawn = [figure.add_subplot(rows, columns, number + 1) for number in range(len(panels))]
        for axes, panel in zip(drawn, panels, strict=True):
            hold_ticks(axes)
            _panel.draw(panel, dataset, axes)
        _panel.settle(panels, drawn)
        for scale in figure.axes:
            if scale not in drawn:
                hold_ticks(scale)
        letter(drawn)
        share_legends(figure, drawn)
        lacking, overrides = _lacking(dataset), declaration(dataset).overrides
        said = [_not_as_declared(dataset, columns)] if overrides else []
        if said or lacking:
            color = "tab:red" if lacking else "0.4"
            figure.suptitle("\n".join(filter(None, (*said, lacking))), color=color)
        make_room(figure, [drawn[i : i + columns] for i in range(0, len(drawn), columns)])
        settle(figure)
    return figure


def _lacking(dataset: xr.Dataset) -> str:
    """The cells that a figure cannot show, in brackets; nothing where it shows all."""
    completeness = dataset.attrs.get("completeness", "complete")
    failed = int((is_failed(dataset["status"]) & (dataset["status"] != Status.PENDING)).sum())
    parts = [completeness] * (completeness != "complete")
    parts += [f"{counted(failed, 'cell')} failed"] * (failed > 0)
    return f"[{', '.join(parts)}]" * bool(parts)


def _not_as_declared(dataset: xr.Dataset, columns: int) -> str:
    own = stated_by(dataset)
    names = {n: symbol(quantity(n, own)) for n in declaration(dataset).overrides}
    values = {names[name]: value for name, value in declaration(dataset).overrides.items()}
    text = pretty(settings(values).replace("=", " = ").replace(",", ", ").replace(",  ", ", "))
    return wrapped(f"not as declared: {text}", 55 if columns == 1 else 120)


# ---- what draws ---------------------------------------------------------------------------------


def _fitting(
    dataset: xr.Dataset, own: Any = None, variable: str | None = None
) -> tuple[Declared, xr.Dataset]:
    """Figure of a dataset with all its panels, and the dataset with the axes that it expects: the
    one that the study declares, or plain lines or maps if there are more axes than that can show.
    """
    name, sizes = declaration(dataset).plot, dataset["status"].sizes
    study = catalogue.load(name) if name in names.names() else None
    if name == _FITS and own is variable is None:
        return Declared(importlib.import_module(f"{__name__}.{_FITS}").panels(dataset)), dataset
    if own is None and study is None and name not in (*_ANY, _FITS):
        raise InvalidValue("plot", name, "is unknown", choices=NAMES)
    known = {str(dimension) for dimension in sizes}
    if study is not None and own in (None, study.plot):
        own, dataset = study.plot, _with_axes(dataset, study)
        if isinstance(own, Declared) and not own.more_axes:
            known = set(study.dimensions)
    elif isinstance(own, Declared):
        known -= set(declaration(dataset).overrides) - own.dimensions
    varied = {str(dimension) for dimension, points in sizes.items() if points > 1}
    further = sorted(varied - known)
    many = math.prod(sizes[dimension] for dimension in further) > _REPEATED
    plain = variable is not None or own is None or isinstance(own, str)
    if plain or many or is_in_other_units(dataset):
        return _of_any(dataset, variable), dataset
    drawing = own if isinstance(own, Declared) else Declared([getattr(own, "draw", own)])
    dataset = dataset.squeeze(sorted(set(map(str, sizes)) - known - varied), drop=False)
    panels = _expanded(drawing, dataset, further)
    few = panels and (len(panels) <= _MOST or not further)
    return (replace(drawing, panels=panels) if few else _of_any(dataset)), dataset


def _expanded(drawing: Declared, dataset: xr.Dataset, further: Sequence[str]) -> list[Panel]:
    """The panels of a figure, each of one point of the axes that have a panel for each; and of each
    point of axes that it does not know, which titles say.
    """
    found: list[Panel] = []
    for at in np.ndindex(*(dataset.sizes[dimension] for dimension in further)):
        where = dict(zip(further, at, strict=True))
        part = dataset.isel(where)
        said = ", ".join(place(part, dimension) for dimension in further)
        each = [one for panel in drawing.panels for one in _panel.expanded(panel, part)]
        found += [_panel.within(panel, where, said) for panel in each] if further else each
    named = [panel.y for panel in drawing.panels if isinstance(panel.y, str) and panel.y]
    if not found and named and not any(name in dataset for name in named):
        rule = "does not fit these results (they have none of its variables)"
        raise InvalidValue("plot", declaration(dataset).plot, rule)
    return found


def _with_axes(dataset: xr.Dataset, study: Study) -> xr.Dataset:
    """The dataset with the axes of its study of which one point was selected."""
    gone = [d for d in study.dimensions if d not in dataset.dims and d in dataset.coords]
    if not gone:
        return dataset
    reduced = tuple(reduction.name for reduction in study.reductions)
    cells = [name for name in dataset.data_vars if not str(name).startswith(reduced)]
    derived = {
        name: (axis, np.atleast_1d(dataset[name]), dataset[name].attrs)
        for name, (axis, _formula) in DERIVED.items()
        if axis in gone and name in dataset.coords
    }
    measured = dataset[cells].drop_vars(derived).expand_dims(gone)
    return dataset.drop_vars([*cells, *derived, *gone]).merge(measured).assign_coords(derived)


def _of_any(dataset: xr.Dataset, variable: str | None = None) -> Declared:
    """Figure of any lattice: histograms and scatters of samples, maps where it has two numeric
    axes, else lines.
    """
    from rsfstudy.plots import _axes, lines, maps, samples

    logarithms = [n for n in map(str, dataset.data_vars) if "log10_" in n]
    dataset = dataset.drop_vars([n for n in logarithms if n.replace("log10_", "") in dataset])
    if square := samples.panels(dataset, variable):
        return Declared(square, samples.square(square), _OF_SQUARE)
    for module in (maps, lines):
        if found := module.panels(dataset, variable):
            return Declared(found)
    choices = [str(name) for name, values in dataset.data_vars.items() if _axes.is_number(values)]
    raise InvalidValue("variable", variable, "is no number of these results", choices=choices)


# ---- files --------------------------------------------------------------------------------------


def save(
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
    if form not in FIGURES:
        raise InvalidValue("figure", path.name, "needs an ending we write", choices=FIGURES)
    try:
        drawn = figure(dataset, own, variable=variable, style=style)
        drawn.set_layout_engine(None)  # everything has its place
        with styled(style):
            image = rendered(drawn, form)
    except RsfStudyError:
        raise
    except Exception as error:
        rule = f"does not fit these results ({type(error).__name__}: {error})"
        raise InvalidValue("plot", declaration(dataset).plot, rule) from error
    write_image(image, path)


def rendered(drawn: Figure, form: str) -> bytes:
    """A figure as PNG, PDF or SVG."""
    image = io.BytesIO()
    drawn.savefig(image, format=form, metadata=_DATES.get(form))
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
