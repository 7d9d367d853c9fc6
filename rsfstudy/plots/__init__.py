"""Figures: ``draw(dataset, axes)`` draws a results dataset and computes nothing; one file each,
found by name.
"""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from types import ModuleType

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rsfstudy.errors import InvalidValue
from rsfstudy.store import declaration

NAMES = tuple(sorted(module.name for module in pkgutil.iter_modules(__path__)))


def figure(dataset: xr.Dataset) -> Figure:
    """The figure of a results dataset, as its study declares it.

    Raises
    ------
    InvalidValue
        Where the declaration names no module of `rsfstudy.plots`; nothing else is ever imported.
    """
    found = Figure(figsize=(6.4, 4.8), layout="constrained")
    draw(dataset, found.add_subplot())
    return found


def draw(dataset: xr.Dataset, axes: Axes) -> Axes:
    """Draw a results dataset as its study declares it."""
    name = declaration(dataset)["plot"]
    if name not in NAMES:
        raise InvalidValue("plot", name, "is unknown", choices=NAMES)
    module = importlib.import_module(f"{__name__}.{name}")
    varied = {str(d) for d in dataset["status"].dims if dataset.sizes[d] > 1}
    if not varied <= set(getattr(module, "DIMENSIONS", varied)):
        module = importlib.import_module(
            f"{__name__}.lines"
        )  # more axes than the figure has room for
    drawn: Axes = module.draw(dataset.squeeze(sorted(_single(dataset, module)), drop=False), axes)
    completeness = dataset.attrs.get("completeness", "complete")
    if completeness != "complete":
        drawn.set_title(f"{drawn.get_title()} [{completeness}]".strip(), color="tab:red")
    return drawn


def _single(dataset: xr.Dataset, module: ModuleType) -> set[str]:
    """Dimensions of one point that a figure does not know of."""
    known = getattr(module, "DIMENSIONS", dataset["status"].dims)
    return {str(d) for d in dataset["status"].dims if dataset.sizes[d] == 1 and d not in known}


def save(dataset: xr.Dataset, path: Path) -> None:
    """Write the figure of a results dataset as PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure(dataset).savefig(path, dpi=160)
