"""Functions that choose the figure that displays the results of a study."""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.plots import _panel
from rsfstudy.plots._axis_formatting import describe_point
from rsfstudy.rig import DatasetUnits
from rsfstudy.storage import StoredDataset
from rsfstudy.study import Figure as Declared
from rsfstudy.study import Panel, Study, list_study_names, load_study
from rsfstudy.vocabulary import FORMULAS_OF_DERIVED_COORDINATES

#: Names of the generic figures that can display any study.
_GENERIC_FIGURE_NAMES = ("lines", "maps")
#: Name of the figure that shows fits of records.
_NAME_OF_FITS_FIGURE = "fits"
#: Names of all figures, including the figures of the named studies.
FIGURE_NAMES = (*_GENERIC_FIGURE_NAMES, _NAME_OF_FITS_FIGURE, *list_study_names())
#: The panels of a figure are repeated for each point of additional axes. The first value is the
#: maximum number of such points, and the second value is the maximum number of panels after the
#: repetition.
_MAX_POINTS_OF_REPEATED_AXES, _MAX_PANELS_AFTER_REPEATING = 4, 12


def choose_figure_and_build_panels(
    dataset: xr.Dataset, requested_figure: Any = None, variable: str | None = None
) -> tuple[Declared, xr.Dataset]:
    """Choose the figure that displays a dataset, and create all its panels.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    requested_figure : callable, module, Figure or str, optional
        User-defined figure, as for ``draw_figure``.
    variable : str, optional
        Name of a variable to draw instead of the declared figure.

    Returns
    -------
    figure : rsfstudy.Figure
        Figure with all its panels. If the dataset has more axes than the declared figure can
        display, the result is a generic figure of maps or lines.
    dataset : xarray.Dataset
        Dataset with the axes that the figure expects.
    """
    name, sizes = StoredDataset(dataset).study_declaration.plot, dataset["status"].sizes
    study = load_study(name) if name in list_study_names() else None
    if name == _NAME_OF_FITS_FIGURE and variable == "posterior" and variable in dataset:
        from rsfstudy.plots import corner_plots

        return corner_plots.build_posterior_corner_figure(dataset)
    if name == _NAME_OF_FITS_FIGURE and requested_figure is variable is None:
        return Declared(
            importlib.import_module(f"{__package__}.{_NAME_OF_FITS_FIGURE}").build_fit_panels(
                dataset
            )
        ), dataset
    if (
        requested_figure is None
        and study is None
        and name not in (*_GENERIC_FIGURE_NAMES, _NAME_OF_FITS_FIGURE)
    ):
        raise InvalidValue("plot", name, "is unknown", choices=FIGURE_NAMES)
    known = {str(dimension) for dimension in sizes}
    if study is not None and requested_figure in (None, study.plot):
        requested_figure, dataset = study.plot, _restore_single_point_dimensions(dataset, study)
        if isinstance(requested_figure, Declared) and not requested_figure.allow_extra_dims:
            known = set(study.dimensions)
    elif isinstance(requested_figure, Declared):
        known -= (
            set(StoredDataset(dataset).study_declaration.overrides)
            - requested_figure.used_dimension_names
        )
    varied = {str(dimension) for dimension, points in sizes.items() if points > 1}
    further = sorted(varied - known)
    many = math.prod(sizes[dimension] for dimension in further) > _MAX_POINTS_OF_REPEATED_AXES
    plain = variable is not None or requested_figure is None or isinstance(requested_figure, str)
    if plain or many or DatasetUnits(dataset).has_units_other_than_display_units:
        return _build_generic_figure(dataset, variable), dataset
    drawing = (
        requested_figure
        if isinstance(requested_figure, Declared)
        else Declared([getattr(requested_figure, "draw", requested_figure)])
    )
    dataset = dataset.squeeze(sorted(set(map(str, sizes)) - known - varied), drop=False)
    panels = _repeat_panels_for_facets_and_extra_axes(drawing, dataset, further)
    few = panels and (len(panels) <= _MAX_PANELS_AFTER_REPEATING or not further)
    return (replace(drawing, panels=panels) if few else _build_generic_figure(dataset)), dataset


def _repeat_panels_for_facets_and_extra_axes(
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
            one
            for panel in figure_declaration.panels
            for one in _panel.split_panel_by_facets(panel, part)
        ]
        found += (
            [_panel.restrict_panel_to_point_of_extra_dims(panel, where, said) for panel in each]
            if extra_dimensions
            else each
        )
    named = [panel.y for panel in figure_declaration.panels if isinstance(panel.y, str) and panel.y]
    if not found and named and not any(name in dataset for name in named):
        rule = "does not fit these results, because the results do not contain its variables"
        raise InvalidValue("plot", StoredDataset(dataset).study_declaration.plot, rule)
    return found


def _restore_single_point_dimensions(dataset: xr.Dataset, study: Study) -> xr.Dataset:
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


def _build_generic_figure(dataset: xr.Dataset, variable: str | None = None) -> Declared:
    """Return a generic figure that can display any study.

    The figure is a corner plot for studies with samples, a set of maps if there are two numeric
    axes, and a line plot otherwise.
    """
    from rsfstudy.plots import _axis_formatting, corner_plots, lines, maps

    logarithms = [n for n in map(str, dataset.data_vars) if "log10_" in n]
    dataset = dataset.drop_vars([n for n in logarithms if n.replace("log10_", "") in dataset])
    if corner := corner_plots.build_corner_figure(dataset, variable):
        return corner
    for build_panels in (maps.build_map_panels, lines.build_line_panels):
        if found := build_panels(dataset, variable):
            return Declared(found)
    choices = [
        str(name)
        for name, values in dataset.data_vars.items()
        if _axis_formatting.is_numeric_variable(values)
    ]
    raise InvalidValue(
        "variable", variable, "is not a numeric variable of these results", choices=choices
    )
