"""The figure of a study: one of rsfstudy by its name, or a function or module of a user's own."""

from __future__ import annotations

import pkgutil
from pathlib import Path
from typing import Any

from rsfstudy.declare.axis import check_text
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name

#: Names of the figures of rsfstudy.
_FIGURES = frozenset(
    module.name for module in pkgutil.iter_modules([str(Path(__file__).parent.parent / "plots")])
)


def figure_name(plot: Any) -> str:
    """Name of a figure in a declaration: one of rsfstudy by its name, one of the user's own by that
    of its function or module.
    """
    return plot if isinstance(plot, str) else str(plot.__name__).rpartition(".")[2]


def check_figure(plot: Any) -> None:
    """Raise InvalidValue for something that cannot draw, or a name that another figure has."""
    if isinstance(plot, str):
        check_text("plot", plot)
        return
    if not hasattr(plot, "__name__") or not callable(getattr(plot, "draw", plot)):
        rule = "must be a name, or a function or module of yours that draws"
        raise InvalidValue("plot", plot, rule, remedy="Write def name(dataset, axes): ...")
    name = figure_name(plot)
    if not is_name(name) or name in _FIGURES:
        rule = "needs a name of its own, which no figure of rsfstudy has"
        raise InvalidValue("plot", name, rule)
