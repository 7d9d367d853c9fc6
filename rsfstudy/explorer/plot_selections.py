"""Selections of the results of a study.

A selection consists of a variable, the dimensions along the axes of the plot, and one point of each
remaining dimension. The function ``complete_plot_selection`` completes and checks a selection.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import read_flag_meanings
from rsfstudy.rig import DatasetUnits
from rsfstudy.storage import StoredDataset
from rsfstudy.vocabulary import find_coverage_content_type

#: Kinds of plots.
LINES, MAP = "lines", "map"
#: Maximum number of curves that a new selection shows.
_MAX_CURVES_OF_DEFAULT_SELECTION = 12
#: Minimum number of points of both axes for which a new selection shows a map.
_MIN_AXIS_POINTS_FOR_DEFAULT_MAP = 6
#: Variables of each cell that are offered although they are not results.
_STATUS_AND_COST_VARIABLES = ("status", "rhs_evaluations", "wall_time")


@dataclass(frozen=True)
class PlotSelection:
    """Selected variable, plot axes, and fixed points of the remaining dimensions.

    Parameters
    ----------
    variable : str
        Name of the variable.
    kind : {"lines", "map"}
        Kind of the plot.
    x : str
        Name of the dimension, coordinate or variable along x.
    second_dimension : str
        Dimension whose points have separate curves, or the vertical axis of a map. If the string is
        empty, there is a single curve.
    facet : str
        Dimension whose points have separate panels. If the string is empty, there is one panel.
    point_index_by_dimension : mapping of str to int
        Index of the selected point on each remaining dimension of the results.
    """

    variable: str
    kind: str
    x: str
    second_dimension: str
    facet: str
    point_index_by_dimension: Mapping[str, int] = field(default_factory=dict)


def list_plottable_variables(dataset: xr.Dataset) -> list[str]:
    """Return the names of the variables that can be plotted.

    The primary output is the first name, followed by the other results, the status and the costs.
    """
    main = StoredDataset(dataset).primary_output_name
    if main is not None and main not in dataset:
        main = DatasetUnits.convert_to_dimensional_variable_name(main)
    names = [
        str(name)
        for name, values in dataset.data_vars.items()
        if values.ndim and (values.dtype.kind in "iuf" or read_flag_meanings(values.attrs))
    ]
    results = [n for n in names if find_coverage_content_type(n) == "modelResult" and n != main]
    return [n for n in (main, *results, *_STATUS_AND_COST_VARIABLES) if n in names]


def list_x_axis_choices(dataset: xr.Dataset, variable_name: str) -> list[str]:
    """Return the names of all quantities that can be plotted along x.

    Besides the dimensions of the variable, the list contains the numeric coordinates along one of
    these dimensions. If the variable was recorded inside each cell, for example along an orbit, the
    list also contains the other variables that were recorded at the same points.
    """
    values, inner = dataset[variable_name], _list_non_lattice_dimensions(dataset, variable_name)
    coordinates = [
        str(name)
        for name, found in dataset.coords.items()
        if name not in values.dims and found.ndim == 1 and found.dims[0] in values.dims
    ]
    recorded = [
        str(name)
        for name, found in dataset.data_vars.items()
        if name != variable_name and {*inner} & {*found.dims} and {*found.dims} <= {*values.dims}
    ]
    varying = [n for n in coordinates if len(np.unique(dataset[n].values.astype(str))) > 1]
    numeric = [n for n in (*varying, *recorded) if dataset[n].dtype.kind in "iuf"]
    return [*map(str, values.dims), *numeric]


def _list_non_lattice_dimensions(dataset: xr.Dataset, variable_name: str) -> list[str]:
    """Return the dimensions of a variable that do not belong to the lattice."""
    return [str(d) for d in dataset[variable_name].dims if d not in dataset["status"].dims]


def find_dimension_along_x(dataset: xr.Dataset, variable_name: str, x_name: str) -> str:
    """Return the dimension that is plotted along x."""
    if x_name in dataset[variable_name].dims:
        return x_name
    inner = _list_non_lattice_dimensions(dataset, variable_name)
    return next((d for d in inner if d in dataset[x_name].dims), str(dataset[x_name].dims[0]))


def list_map_dimensions(dataset: xr.Dataset, variable_name: str) -> list[str]:
    """Return the numeric dimensions of a variable that have at least two points."""
    dims = map(str, dataset[variable_name].dims)
    return [d for d in dims if dataset.sizes[d] > 1 and dataset[d].dtype.kind in "iuf"]


def complete_plot_selection(
    dataset: xr.Dataset,
    variable: str | None = None,
    kind: str | None = None,
    x: str | None = None,
    second_dimension: str | None = None,
    facet: str | None = None,
    points: Mapping[str, int] | None = None,
) -> PlotSelection:
    """Complete a selection by adding defaults to the requested choices.

    A default replaces each choice that is missing or that contradicts another choice. For example,
    a dimension along x cannot also be the dimension of the facets. If two choices contradict each
    other, the earlier parameter takes precedence.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    variable, kind, x, second_dimension, facet : str, optional
        Requested choices, as in ``PlotSelection``.
    points : mapping of str to int, optional
        Requested indices on the remaining dimensions.

    Returns
    -------
    PlotSelection
        Complete selection.

    Raises
    ------
    InvalidValue
        If a name or an index does not exist in the results.
    """
    names = list_plottable_variables(dataset)
    if not names:
        raise InvalidValue("variable", None, "is missing: the results contain no numbers")
    variable = _check_choice_exists("variable", variable, names) or names[0]
    plane = list_map_dimensions(dataset, variable)
    if _check_choice_exists("kind", kind, (LINES, MAP)) is None:
        large = [d for d in plane if dataset.sizes[d] >= _MIN_AXIS_POINTS_FOR_DEFAULT_MAP]
        kind = (
            MAP if len(large) > 1 and not _list_non_lattice_dimensions(dataset, variable) else LINES
        )
    kind = kind if len(plane) > 1 else LINES
    across = plane if kind == MAP else list_x_axis_choices(dataset, variable)
    known = [str(name) for name in dataset.variables]
    if _check_choice_exists("x", x, known) not in across:
        x = _choose_default_x_name(dataset, variable, plane if kind == MAP else plane or across)
    along = find_dimension_along_x(dataset, variable, str(x))
    others = [d for d in map(str, dataset[variable].dims) if d != along]
    candidates = [d for d in others if d in plane or kind == LINES]
    if _check_choice_exists(
        "second_dimension", second_dimension, ["", *known]
    ) not in candidates + [""] * (kind == LINES):
        second_dimension = _choose_default_second_dimension(dataset, candidates, kind)
    left = [d for d in others if d != second_dimension]
    facet = facet if _check_choice_exists("facet", facet, ["", *known]) in left else ""
    given = points or {}
    if not isinstance(given, Mapping):
        raise InvalidValue("points", given, "must map names of dimensions to indices")
    for name, index in given.items():
        _check_choice_exists("points", name, list(map(str, dataset.dims)))
        if not isinstance(index, int) or not 0 <= index < dataset.sizes[name]:
            rule = f"is not an index of {name}, which has {dataset.sizes[name]} points"
            raise InvalidValue("points", index, rule)
    chosen = {d: given.get(d, 0) for d in left if d != facet}
    return PlotSelection(variable, str(kind), str(x), second_dimension or "", facet or "", chosen)


def _check_choice_exists(choice_name: str, value: Any, choices: Sequence[str]) -> Any:
    """Return a requested choice, or raise ``InvalidValue`` if the choice does not exist."""
    if value is not None and value not in choices:
        raise InvalidValue(choice_name, value, "does not exist in these results", choices=choices)
    return value


def _choose_default_x_name(dataset: xr.Dataset, variable_name: str, choices: Sequence[str]) -> str:
    """Return the last choice that is not an axis of the study, or else the longest choice."""
    if inner := [d for d in _list_non_lattice_dimensions(dataset, variable_name) if d in choices]:
        return inner[-1]
    return max(reversed(choices), key=lambda name: dataset[name].size)


def _choose_default_second_dimension(
    dataset: xr.Dataset, candidates: Sequence[str], plot_kind: str | None
) -> str:
    """Return the largest candidate dimension.

    For curves, dimensions with too many points are excluded, so that all curves can be
    distinguished.
    """
    if plot_kind == MAP:
        return max(candidates, key=lambda name: dataset.sizes[name])
    few = [d for d in candidates if 1 < dataset.sizes[d] <= _MAX_CURVES_OF_DEFAULT_SELECTION]
    return max(few, key=lambda name: dataset.sizes[name]) if few else ""
