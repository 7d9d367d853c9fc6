"""The figure of a study: panels, or a function or module of a user's own. Nothing here loads what
draws.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rsfstudy._deprecation import renamed_keywords, renamed_names
from rsfstudy.axes import check_storable_text
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import is_variable_name
from rsfstudy.study.study_index import study_names

if TYPE_CHECKING:
    import xarray as xr

__getattr__ = renamed_names(__name__)

#: A variable by its name, or a function that computes it; and a text in the same way.
VariableNameOrFunction = str | Callable[["xr.Dataset"], "xr.DataArray"]
TextOrFunction = str | Callable[["xr.Dataset"], str]
#: `matplotlib.axes.Axes`, for annotations: what workers load must not load matplotlib.
Axes = Any
#: A function of a dataset and of axes, which draws the one on the other.
DrawFunction = Callable[[Any, Any], Any]

#: Names of the figures that draw any study.
GENERIC_FIGURE_NAMES = frozenset(
    module.name for module in pkgutil.iter_modules([str(Path(__file__).parent.parent / "plots")])
)


@renamed_keywords
@guard_methods
@dataclass(frozen=True, kw_only=True)
class Panel:
    """One panel of a figure, or one for each point of some axes.

    Functions of a dataset are given the part of it that the panel shows, those of a row the part
    that one curve shows. Labels come from names, symbols and units of what is drawn.

    Parameters
    ----------
    x, y : str or function of dataset
        What curves are drawn of: variables by their names, or what a function makes of them.
        Points of an axis of names lie beside each other, or below each other.
    hue : sequence of str
        Axes whose points are curves: the first is told by colours and markers, and the second by
        dashes and open markers.
    facet : sequence of str
        Axes whose points have a panel each.
    isel : mapping of str to int, list of int, slice or function
        Places on other axes: numbers of points, or what gives one of their values, or several, as
        `min` and `max` do; of what is the same everywhere, 0, for the title to say it.
    markers_only : bool
        Have markers without a line.
    style : mapping, or function of row
        What `matplotlib.axes.Axes.plot` takes, laid over that of the curve.
    error_bars : str
        Variable of the bars of error.
    fit_line : function of row
        x and y of a line through the points of a curve, in its colour: a fit or a theory.
    curve_label : function of row
        Name of a curve in the legend. By default, the name is its point on the axes of ``hue``.
    annotation : str
        Name of a slope that the legend shows for each curve, with its standard error. Curves
        without a slope have no such entry.
    overlays : sequence of function of (dataset, axes)
        What is drawn beside the curves.
    title : str, or function of dataset
        By default the place on the axes of `facet` and `isel`.
    x_label, y_label : str, optional
        For what has no name, symbol and units.
    log : str
        Which of x and y have log scales; None for those along which points or values span decades.
    x_limits, y_limits : tuple of float or None
        Ends of the scales; None leaves an end to what is drawn.
    y_scale_group : str
        Panels that say the same have the same scale along y.
    condition : function of dataset
        Whether there is such a panel; always by default.
    legend_columns : int
        Most entries of the legend beside each other.
    legend_title : str
    is_custom : bool
        Leave scales, legend and title as marks leave them: a figure of the user's own.
    """

    x: VariableNameOrFunction = ""
    y: VariableNameOrFunction = ""
    hue: Sequence[str] = ()
    facet: Sequence[str] = ()
    isel: Mapping[str, Any] = field(default_factory=dict)
    markers_only: bool = False
    style: Mapping[str, Any] | Callable[[xr.Dataset], Mapping[str, Any]] = field(
        default_factory=dict
    )
    error_bars: str = ""
    fit_line: Callable[[xr.Dataset], tuple[Any, Any]] | None = None
    curve_label: Callable[[xr.Dataset], str] | None = None
    annotation: str = ""
    overlays: Sequence[DrawFunction] = ()
    title: TextOrFunction | None = None
    x_label: TextOrFunction | None = None
    y_label: TextOrFunction | None = None
    log: str | None = ""
    x_limits: tuple[float | None, float | None] = (None, None)
    y_limits: tuple[float | None, float | None] = (None, None)
    y_scale_group: str = ""
    condition: Callable[[xr.Dataset], bool] | None = None
    legend_columns: int = 2
    legend_title: str | None = None
    is_custom: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.log, str) and not set(self.log) <= {"x", "y"}:
            raise InvalidValue("log", self.log, "must name axes", choices=("x", "y", "xy"))


@renamed_keywords
@guard_methods
@dataclass(frozen=True)
class Figure:
    """Panels, from left to right and from top to bottom.

    Parameters
    ----------
    panels : sequence of Panel, or function of (dataset, axes)
    columns : int
        Most panels beside each other.
    height : float or function of dataset, optional
        Of a panel without its legend, in mm; that of the style by default.
    allow_extra_dims : bool
        Whether it shows further axes of the lattice too.
    """

    panels: Sequence[Any]
    columns: int = 2
    height: float | Callable[[Any], float] | None = None
    allow_extra_dims: bool = False

    def __post_init__(self) -> None:
        panels = [
            panel if isinstance(panel, Panel) else Panel(overlays=[panel], is_custom=True)
            for panel in self.panels
        ]
        object.__setattr__(self, "panels", panels)

    @property
    def dimensions(self) -> set[str]:
        """Axes that its panels name."""
        named = (name for p in self.panels for name in (p.x, *p.hue, *p.facet, *p.isel))
        return {name for name in named if isinstance(name, str)}


def horizontal_line(height: float, **style: Any) -> DrawFunction:
    """A mark: a thin line across the panel."""
    thin = {"color": "0.6", "linewidth": 0.8, "linestyle": "-", "zorder": 0}
    return lambda _dataset, axes: axes.axhline(height, **thin | style)


def reference_line(
    x: str, function: Callable[[Any], Any], name: str, start: float | None = None, **style: Any
) -> DrawFunction:
    """A mark: a wide grey line behind the points.

    Parameters
    ----------
    x : str
        Variable along x.
    function : function of array
    name : str
        What the legend calls it.
    start : float, optional
        Where it begins, by default at the first point.
    **style
        As `matplotlib.axes.Axes.plot` takes.
    """

    def draw_line(dataset: xr.Dataset, axes: Axes) -> None:
        low, high = float(dataset[x].min()), float(dataset[x].max())
        low = low if start is None else start
        at = np.linspace(low, high + 0.03 * (high - low), 200)
        wide = {"color": "0.8", "linewidth": 2.2, "linestyle": "-", "zorder": 1.5}
        axes.plot(at, function(at), label=name, **wide | style)

    return draw_line


def name_of_figure(plot: Any, study_name: str) -> str:
    """Name of a figure in a declaration: one that draws any study by its name, panels by that of
    their study, others by that of their function or module.
    """
    if isinstance(plot, Figure):
        return study_name
    return plot if isinstance(plot, str) else str(plot.__name__).rpartition(".")[2]


def check_figure(plot: Any) -> None:
    """Raise InvalidValue for something that cannot draw, or a name that another figure has."""
    if isinstance(plot, str):
        check_storable_text("plot", plot)
        return
    if isinstance(plot, Figure):
        return
    if not hasattr(plot, "__name__") or not callable(getattr(plot, "draw", plot)):
        rule = "must be a name, a Figure, or a function or module of yours that draws"
        raise InvalidValue("plot", plot, rule, remedy="Write def name(dataset, axes): ...")
    name = name_of_figure(plot, "")
    if not is_variable_name(name) or name in GENERIC_FIGURE_NAMES or name in study_names():
        rule = "needs a name of its own, which no figure of rsfstudy has"
        raise InvalidValue("plot", name, rule)
