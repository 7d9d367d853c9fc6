"""Classes that declare the figure of a study.

A figure consists of panels, or is a user-defined function or module. This module does not import
matplotlib, so that worker processes do not load matplotlib.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rsfstudy._deprecation import accept_former_keyword_names, build_getattr_for_former_names
from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import is_valid_variable_name
from rsfstudy.study.named_study_index import list_study_names

if TYPE_CHECKING:
    import xarray as xr

__getattr__ = build_getattr_for_former_names(__name__)

#: Name of a variable, or a function of a dataset that computes the values.
VariableNameOrFunction = str | Callable[["xr.Dataset"], "xr.DataArray"]
TextOrFunction = str | Callable[["xr.Dataset"], str]
#: Type of `matplotlib.axes.Axes` in annotations. Worker processes load this module, so the module
#: must not import matplotlib.
MatplotlibAxes = Any
#: Function ``draw(dataset, axes)`` that draws a dataset on matplotlib axes.
DrawFunction = Callable[[Any, Any], Any]

#: Names of the figures that can draw the results of any study.
BUILT_IN_FIGURE_NAMES = frozenset(
    module.name for module in pkgutil.iter_modules([str(Path(__file__).parent.parent / "plots")])
)


@accept_former_keyword_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Panel:
    """Panel of a figure, which is drawn once for each combination of points along the `facet` axes.

    A function that takes a dataset receives the results shown in the panel. A function that takes
    the data of one curve receives only the results of this curve.

    Parameters
    ----------
    x : str or callable
        Name of the variable along x, or a function that receives the data of one curve and returns
        the values. If the values are strings, the points are equally spaced.
    y : str or callable
        Name of the variable along y, or a function that receives the data of one curve and returns
        the values. If the values are strings, the points are equally spaced.
    hue : sequence of str, optional
        Axes whose points are drawn as separate curves in one panel. The first axis is distinguished
        by colours and markers, and the second axis by line styles and open markers.
    facet : sequence of str, optional
        Axes whose points are shown in separate panels.
    isel : mapping of str to int, list of int, slice or callable, optional
        Indices of the selected points on each axis, by axis name. If a value is a function such as
        ``min``, the function receives the list of coordinate values and returns one value or a list
        of values. A scalar coordinate with the index 0 is shown in the title.
    markers_only : bool, default: False
        If True, draw markers without lines.
    style : mapping or callable, optional
        Keyword arguments for `matplotlib.axes.Axes.plot`, or a function that receives the data of
        one curve and returns keyword arguments. The keyword arguments override the default style of
        the curve.
    error_bars : str, optional
        Name of the variable with the half lengths of the error bars.
    fit_line : callable, optional
        Function that receives the data of one curve and returns x and y of a fitted or theoretical
        line. The line has the colour of the curve.
    curve_label : callable, optional
        Function that receives the data of one curve and returns its legend entry. By default, the
        legend entry contains the coordinates of the curve on the axes of ``hue``.
    annotation : str, optional
        Name of a slope. The slope and its standard error are shown in the legend entry of each
        curve. The slope is omitted if the standard error is not finite.
    overlays : sequence of callable, optional
        Functions ``draw(dataset, axes)`` that add elements to the panel.
    title : str or callable, optional
        Title, or a function that receives the dataset and returns the title. By default, the title
        contains the coordinates of the panel on the axes of ``facet`` and ``isel``.
    x_label, y_label : str or callable, optional
        Labels of the x and y axes, or functions that receive the dataset and return the labels. By
        default, a label contains the long name, symbol and units of the variable.
    log : {"", "x", "y", "xy"} or None, default: ""
        Axes with a logarithmic scale. None selects a logarithmic scale if the coordinates are
        logarithmically spaced, or if the values span decades.
    x_limits, y_limits : tuple of (float or None, float or None), default: (None, None)
        Lower and upper limits of the axes. A limit of None is computed from the data.
    y_scale_group : str, optional
        Name of a group of panels with the same limits of the y axis.
    condition : callable, optional
        Function that receives the dataset. If the function returns False, the panel is omitted.
    legend_columns : int, default: 2
        Largest number of columns of the legend.
    legend_title : str, optional
        Title of the legend.
    is_custom : bool, default: False
        If True, the overlays define the scales, the legend and the title.

    Raises
    ------
    InvalidValue
        If ``log`` contains characters other than x and y.

    Examples
    --------
    >>> from rsfstudy import Panel
    >>> panel = Panel(x="stiffness_ratio", y="critical_displacement", hue=["phi"], log="y")
    >>> panel.hue
    ['phi']
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
        """Check the argument ``log``."""
        if isinstance(self.log, str) and not set(self.log) <= {"x", "y"}:
            raise InvalidValue(
                "log", self.log, "must contain only x and y", choices=("x", "y", "xy")
            )


@accept_former_keyword_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Figure:
    """Figure that consists of panels.

    Parameters
    ----------
    panels : sequence of Panel or callable
        Panels from left to right and from top to bottom. A function ``draw(dataset, axes)`` is
        converted to a panel whose only overlay is the function.
    columns : int, default: 2
        Largest number of panels in a row.
    height : float or callable, optional
        Height of a panel without its legend in mm, or a function that receives the dataset and
        returns the height. The default is the height of the current style.
    allow_extra_dims : bool, default: False
        If True, the panels also show additional dimensions of the lattice. If False, the panels are
        repeated for each point of the additional dimensions.

    Examples
    --------
    >>> from rsfstudy import Figure, Panel
    >>> figure = Figure([Panel(x="b_over_a", y="critical_displacement", hue=["phi"])])
    >>> sorted(figure.used_dimension_names)
    ['b_over_a', 'phi']
    """

    panels: Sequence[Any]
    columns: int = 2
    height: float | Callable[[Any], float] | None = None
    allow_extra_dims: bool = False

    def __post_init__(self) -> None:
        """Convert functions to panels."""
        panels = [
            panel if isinstance(panel, Panel) else Panel(overlays=[panel], is_custom=True)
            for panel in self.panels
        ]
        object.__setattr__(self, "panels", panels)

    @property
    def used_dimension_names(self) -> set[str]:
        """Names of all axes that the panels use."""
        named = (name for p in self.panels for name in (p.x, *p.hue, *p.facet, *p.isel))
        return {name for name in named if isinstance(name, str)}


def build_horizontal_line_overlay(y_position: float, **style: Any) -> DrawFunction:
    """Create an overlay that draws a horizontal line.

    Parameters
    ----------
    y_position : float
        Position of the line along y.
    **style : object
        Keyword arguments for `matplotlib.axes.Axes.axhline`.

    Returns
    -------
    callable
        Function ``draw(dataset, axes)``.
    """
    thin = {"color": "0.6", "linewidth": 0.8, "linestyle": "-", "zorder": 0}
    return lambda _dataset, axes: axes.axhline(y_position, **thin | style)


def build_reference_line_overlay(
    x_variable: str,
    y_function: Callable[[Any], Any],
    legend_label: str,
    min_x: float | None = None,
    **style: Any,
) -> DrawFunction:
    """Create an overlay that draws a wide grey line behind the points.

    Parameters
    ----------
    x_variable : str
        Name of the variable along x.
    y_function : callable
        Function of the x values that returns the y values.
    legend_label : str
        Legend entry.
    min_x : float, optional
        First x value of the line. The default is the smallest value of the variable ``x_variable``.
    **style : object
        Keyword arguments for `matplotlib.axes.Axes.plot`.

    Returns
    -------
    callable
        Function ``draw(dataset, axes)``.
    """

    def draw_line(dataset: xr.Dataset, axes: MatplotlibAxes) -> None:
        """Draw the line."""
        low, high = float(dataset[x_variable].min()), float(dataset[x_variable].max())
        low = low if min_x is None else min_x
        at = np.linspace(low, high + 0.03 * (high - low), 200)
        wide = {"color": "0.8", "linewidth": 2.2, "linestyle": "-", "zorder": 1.5}
        axes.plot(at, y_function(at), label=legend_label, **wide | style)

    return draw_line


def get_figure_name_for_declaration(figure_or_name: Any, study_name: str) -> str:
    """Return the name by which a study declaration refers to a figure.

    Parameters
    ----------
    figure_or_name : Figure, callable, module or str
        Figure of a study.
    study_name : str
        Name of the study.

    Returns
    -------
    str
        If ``figure_or_name`` is a `Figure`, the name of the study. If ``figure_or_name`` is a
        string, the string itself. Otherwise, the name of the function or module.
    """
    if isinstance(figure_or_name, Figure):
        return study_name
    return (
        figure_or_name
        if isinstance(figure_or_name, str)
        else str(figure_or_name.__name__).rpartition(".")[2]
    )


def check_is_figure(figure_or_name: Any) -> None:
    """Raise InvalidValue if an object is not a figure.

    Parameters
    ----------
    figure_or_name : object
        Figure of a study.

    Raises
    ------
    InvalidValue
        If the object cannot draw a figure, or if a user-defined function or module has the name of
        a figure of the package.
    """
    if isinstance(figure_or_name, str):
        Axis.check_storable_text("plot", figure_or_name)
        return
    if isinstance(figure_or_name, Figure):
        return
    if not hasattr(figure_or_name, "__name__") or not callable(
        getattr(figure_or_name, "draw", figure_or_name)
    ):
        rule = "must be a figure name, a Figure, or a function or module that draws a figure"
        raise InvalidValue(
            "plot",
            figure_or_name,
            rule,
            remedy="A function must have the signature name(dataset, axes).",
        )
    name = get_figure_name_for_declaration(figure_or_name, "")
    if not is_valid_variable_name(name):
        rule = "must be a function or module whose name is a Python identifier"
        raise InvalidValue("plot", name, rule, remedy="Define the function with def.")
    if name in BUILT_IN_FIGURE_NAMES or name in list_study_names():
        rule = "must differ from the names of built-in figures"
        raise InvalidValue("plot", name, rule, remedy="Rename the function or module.")
