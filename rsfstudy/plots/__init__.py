"""Figures: ``draw(dataset, axes)`` draws a results dataset and computes nothing; one file each,
found by name, or a function or module of the user's own.

A figure of several panels lists its functions of that kind in ``PANELS``.
"""

from __future__ import annotations

import importlib
import io
import os
import pkgutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.declare.study import settings
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.files.contents import declaration
from rsfstudy.reduce.base import failed as is_failed
from rsfstudy.status import Status

Panel = Callable[[xr.Dataset, Axes], Axes]

NAMES = tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))

#: Size of one panel in inches, and most panels in a row; a module may state its own as ``PANEL``
#: and ``COLUMNS``.
_PANEL, _COLUMNS = (6.4, 4.8), 2


def figure(dataset: xr.Dataset, own: Any = None) -> Figure:
    """The figure of a results dataset, as its study declares it, with all its panels.

    Parameters
    ----------
    dataset : xarray.Dataset
    own : function or module, optional
        What draws it where that is no module of `rsfstudy.plots`.

    Raises
    ------
    InvalidValue
        Where the declaration names no module of `rsfstudy.plots`; nothing else is ever imported.
    """
    module = _module(dataset, own)
    panels, size = getattr(module, "PANELS", (None,)), getattr(module, "PANEL", _PANEL)
    columns = min(getattr(module, "COLUMNS", _COLUMNS), len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    for number, panel in enumerate(panels, start=1):
        _draw(dataset, module, figure.add_subplot(rows, columns, number), panel or module.draw)
    overrides = declaration(dataset).overrides
    if overrides:
        figure.supxlabel(f"not as declared: {settings(overrides)}", fontsize="small", color="0.4")
    return figure


def draw(dataset: xr.Dataset, axes: Axes, panel: Panel | None = None) -> Axes:
    """Draw a results dataset as its study declares it: its main panel, or another."""
    module = _module(dataset)
    return _draw(dataset, module, axes, panel or module.draw)


def _draw(dataset: xr.Dataset, module: Any, axes: Axes, panel: Panel) -> Axes:
    panel(dataset.squeeze(sorted(_single(dataset, module)), drop=False), axes)
    lacking = _lacking(dataset)
    if lacking:
        axes.set_title(f"{axes.get_title()} [{lacking}]".strip(), color="tab:red")
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


def _module(dataset: xr.Dataset, own: Any = None) -> Any:
    """The module, or an object like one, that draws a dataset: the one it declares, or plain lines
    if the dataset has more axes than that can show.
    """
    name = declaration(dataset).plot
    if name in NAMES:
        module: Any = importlib.import_module(f"{__name__}.{name}")
    elif own is None:
        raise InvalidValue("plot", name, "is unknown", choices=NAMES)
    else:
        module = own if hasattr(own, "draw") else SimpleNamespace(draw=own)
    varied = {str(d) for d in dataset["status"].dims if dataset.sizes[d] > 1}
    if varied <= set(getattr(module, "DIMENSIONS", varied)):
        return module
    return importlib.import_module(f"{__name__}.lines")


def _single(dataset: xr.Dataset, module: Any) -> set[str]:
    """Dimensions of one point that a figure does not expect."""
    known = getattr(module, "DIMENSIONS", dataset["status"].dims)
    return {str(d) for d in dataset["status"].dims if dataset.sizes[d] == 1 and d not in known}


def save(dataset: xr.Dataset, path: Path, own: Any = None) -> None:
    """Write the figure of a results dataset as PNG: the old file stays, or the whole new one.

    Parameters
    ----------
    dataset : xarray.Dataset
    path : Path
    own : function or module, optional
        As in `figure`.

    Raises
    ------
    InvalidValue
        Where the figure the study declares does not fit its results.
    OSError
        Where it cannot be written.
    """
    image = io.BytesIO()
    try:
        figure(dataset, own).savefig(image, format="png", dpi=160)
    except RsfStudyError:
        raise
    except Exception as error:
        rule = f"does not fit these results ({type(error).__name__}: {error})"
        raise InvalidValue("plot", declaration(dataset).plot, rule, choices=NAMES) from error
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.unlink(missing_ok=True)  # were it a link or a pipe, writing would go elsewhere
        beside.write_bytes(image.getvalue())
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
