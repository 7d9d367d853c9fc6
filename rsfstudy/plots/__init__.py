"""Figures: ``draw(dataset, axes)`` draws a results dataset and computes nothing; one file each,
found by name, or a function or module of the user's own.

A figure of several panels lists its functions of that kind in ``PANELS``, or gives those that a
dataset needs by ``panels(dataset)``; ``COLUMNS`` says how many stand beside each other, and
``HEIGHT`` how many mm one is high. How figures look is in ``rsfstudy.mplstyle``.
"""

from __future__ import annotations

import importlib
import io
import os
import pkgutil
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Figure

from rsfstudy.declare.wording import settings
from rsfstudy.defaults import FIGURES
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.files.contents import declaration
from rsfstudy.plots._style import hold_ticks, letter, make_room, settle, share_legends, size
from rsfstudy.plots._style import styled as styled
from rsfstudy.plots._text import pretty, symbol, wrapped
from rsfstudy.reduce.base import failed as is_failed
from rsfstudy.reduce.base import stated_by
from rsfstudy.status import Status
from rsfstudy.vocabulary import quantity

Panel = Callable[[xr.Dataset, Axes], Axes]

NAMES = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))

#: Points an inch of what a notebook shows.
_ON_SCREEN = 150
#: What would make two files of one figure differ.
_DATES: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
#: Most panels beside each other.
_COLUMNS = 2


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
        What `matplotlib.style.use` takes, to be laid over the style that ships.

    Raises
    ------
    InvalidValue
        Where the declaration names no module of `rsfstudy.plots`; nothing else is ever imported.
        Where there is no such variable or style.
    """
    with styled(style):
        module = _module(dataset, own) if variable is None else _drawing(dataset, variable)
        dataset = dataset.squeeze(sorted(_single(dataset, module)), drop=False)
        panels = _panels(module, dataset)
        columns = min(getattr(module, "COLUMNS", _COLUMNS), len(panels))
        rows = -(-len(panels) // columns)
        height = getattr(module, "HEIGHT", None)
        figure = Drawing(figsize=size(columns, rows, height), layout="constrained")
        drawn = [figure.add_subplot(rows, columns, number + 1) for number in range(len(panels))]
        for axes, panel in zip(drawn, panels, strict=True):
            hold_ticks(axes)
            _draw(dataset, axes, panel)
        for scale in figure.axes:
            if scale not in drawn:
                hold_ticks(scale)
        letter(drawn)
        share_legends(figure, drawn)
        overrides = declaration(dataset).overrides
        if overrides:
            figure.suptitle(_not_as_declared(dataset, columns), color="0.4")
        make_room(figure, [drawn[i : i + columns] for i in range(0, len(drawn), columns)])
        settle(figure)
    return figure


def draw(dataset: xr.Dataset, axes: Axes, panel: Panel | None = None) -> Axes:
    """Draw a results dataset as its study declares it: its main panel, or another."""
    module = _module(dataset)
    dataset = dataset.squeeze(sorted(_single(dataset, module)), drop=False)
    return _draw(dataset, axes, panel or _panels(module, dataset)[0])


def _draw(dataset: xr.Dataset, axes: Axes, panel: Panel) -> Axes:
    panel(dataset, axes)
    lacking = _lacking(dataset)
    if lacking:
        axes.set_title(f"{axes.get_title()}\n[{lacking}]".strip(), color="tab:red")
    return axes


def _lacking(dataset: xr.Dataset) -> str:
    """The cells that a figure cannot show, in words."""
    completeness = dataset.attrs.get("completeness", "complete")
    failed = int((is_failed(dataset["status"]) & (dataset["status"] != Status.PENDING)).sum())
    parts = [
        "" if completeness == "complete" else completeness,
        f"{failed} cells failed" * (failed > 0),
    ]
    return ", ".join(filter(None, parts))


def _not_as_declared(dataset: xr.Dataset, columns: int) -> str:
    own = stated_by(dataset)
    names = {n: symbol(quantity(n, own)) for n in declaration(dataset).overrides}
    values = {names[name]: value for name, value in declaration(dataset).overrides.items()}
    text = pretty(settings(values).replace("=", " = ").replace(",", ", ").replace(",  ", ", "))
    return wrapped(f"not as declared: {text}", 55 if columns == 1 else 120)


# ---- which module draws, and what ---------------------------------------------------------------


def _module(dataset: xr.Dataset, own: Any = None) -> Any:
    """The module, or an object like one, that draws a dataset: the one it declares, or plain lines
    or maps if the dataset has more axes than that can show.
    """
    name = declaration(dataset).plot
    if name in NAMES:
        module: Any = importlib.import_module(f"{__name__}.{name}")
    elif own is None:
        raise InvalidValue("plot", name, "is unknown", choices=NAMES)
    else:
        module = own if hasattr(own, "draw") else SimpleNamespace(draw=own)
    varied = {str(d) for d in dataset["status"].dims if dataset.sizes[d] > 1}
    fits = varied <= set(getattr(module, "DIMENSIONS", varied))
    return module if fits and name != "lines" else _drawing(dataset)


def _drawing(dataset: xr.Dataset, variable: str | None = None) -> Any:
    """What draws any lattice: maps where it has two numeric axes, else lines."""
    from rsfstudy.plots import _axes, lines, maps

    for module in (maps, lines):
        if found := module.panels(dataset, variable):
            return SimpleNamespace(PANELS=found)
    choices = [str(name) for name, values in dataset.data_vars.items() if _axes.is_number(values)]
    raise InvalidValue("variable", variable, "is no number of these results", choices=choices)


def _panels(module: Any, dataset: xr.Dataset) -> Sequence[Panel]:
    if hasattr(module, "panels"):
        return list(module.panels(dataset))
    return [panel or module.draw for panel in getattr(module, "PANELS", (None,))]


def _single(dataset: xr.Dataset, module: Any) -> set[str]:
    """Dimensions of one point that a figure does not expect."""
    known = getattr(module, "DIMENSIONS", dataset["status"].dims)
    return {str(d) for d in dataset["status"].dims if dataset.sizes[d] == 1 and d not in known}


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
        raise InvalidValue("plot", declaration(dataset).plot, rule, choices=NAMES) from error
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
