"""Functions that tabulate reductions and explain why some reductions have no results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.formatting import format_number_or_text
from rsfstudy.reporting.text_tables import (
    TextTable,
    TextTableColumn,
    build_table_along_dimensions,
    format_axis_name,
    format_units,
)
from rsfstudy.rig import DatasetUnits
from rsfstudy.storage import StoredDataset

#: Headings and formats of the columns of a slope table, by the suffix of the variable name.
_SLOPE_TABLE_COLUMN_BY_SUFFIX = {
    "stderr": ("standard error", ".2g"),
    "misfit": ("largest misfit", ".2g"),
    "points": ("points", ".0f"),
    "error": ("numerical error", ".2g"),
}
#: Dimension of the statuses in the results of the reduction ``StatusShares``.
_STATUS_SHARES_DIMENSION = "ended"
#: Maximum number of points that a note on missing results lists.
_MAX_MISSING_POINTS_SHOWN = 4
#: Columns of the comparison of integrators.
_INTEGRATOR_COMPARISON_COLUMNS = (
    TextTableColumn("cheapest integrator", "cheapest_integrator", str, "integrator"),
    TextTableColumn("evaluations (cheapest integrator)", "cheapest_work", "{:,.0f}".format, "work"),
    TextTableColumn(
        "evaluations (default integrator)",
        "cheapest_default_work",
        "{:,.0f}".format,
        "default_work",
    ),
    TextTableColumn(
        "rtol (default integrator)",
        "cheapest_default_request",
        lambda digits: f"{10.0**-digits:.1g}",
        "default_request",
    ),
)


def build_reduction_tables(dataset: xr.Dataset) -> Iterator[TextTable]:
    """Yield tables that list the slopes of a study and compare integrators.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Yields
    ------
    TextTable
        One table for each reduction with a standard error, such as a slope. If the study compares
        integrators, a final table lists the cheapest integrator for each accuracy.
    """
    converted = DatasetUnits(dataset).convert_to_display_units()
    for slope in list_names_of_slope_reductions(converted):
        yield _build_slope_table(converted, slope)
    if {column.variable_name for column in _INTEGRATOR_COMPARISON_COLUMNS} <= set(
        dataset.data_vars
    ):
        dims = dataset["cheapest_work"].dims
        yield build_table_along_dimensions(
            dataset, dims, _INTEGRATOR_COMPARISON_COLUMNS, wrappable_columns={"problem", "cheapest"}
        )


def _build_slope_table(dataset: xr.Dataset, reduction_name: str) -> TextTable:
    """Return a table that lists a slope, its standard error and the largest deviation."""
    slope = dataset[reduction_name]
    units, description = format_units(slope), slope.attrs.get("comment", reduction_name)
    heading = f"{reduction_name} ({units})" if units != "1" else reduction_name
    columns = [TextTableColumn(heading, reduction_name, format_number_or_text, "value")]
    for suffix, (heading, form) in _SLOPE_TABLE_COLUMN_BY_SUFFIX.items():
        if (name := f"{reduction_name}_{suffix}") in dataset:
            if suffix != "points" and (own := format_units(dataset[name])) != units:
                heading += f" ({own})"
            columns.append(TextTableColumn(heading, name, f"{{:{form}}}".format, suffix))
    names = {format_axis_name(dataset[d]) for d in slope.dims}
    table = build_table_along_dimensions(dataset, slope.dims, columns, description, names)
    about = {"name": reduction_name, "units": units}
    rows = [{**about, **row} for row in table.unformatted_rows]
    if _STATUS_SHARES_DIMENSION in slope.dims:
        # Most statuses do not occur. The JSON output contains all statuses.
        occurs = (slope != 0.0).any([d for d in slope.dims if d != _STATUS_SHARES_DIMENSION])
        few = dataset.isel({_STATUS_SHARES_DIMENSION: occurs.values})
        text = f"{description}, without statuses whose share is 0"
        table = build_table_along_dimensions(few, slope.dims, columns, text, names)
    return replace(table, unformatted_rows=rows)


def list_names_of_slope_reductions(dataset: xr.Dataset) -> list[str]:
    """Return the names of the reductions that have a standard error.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    list of str
        Names in the order of the declaration.
    """
    named = [reduction["name"] for reduction in StoredDataset(dataset).study_declaration.reductions]
    return [name for name in named if {name, f"{name}_stderr"} <= set(dataset.data_vars)]


def build_reduction_tables_and_sentences(dataset: xr.Dataset) -> Iterator[TextTable | str]:
    """Yield the tables of reductions, and the reasons why results are missing.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Yields
    ------
    TextTable or str
        Tables, followed by notes on reductions.
    """
    yield from build_reduction_tables(dataset)
    yield from format_notes_on_reductions(dataset, find_reasons_of_missing_reductions(dataset))


def format_notes_on_reductions(dataset: xr.Dataset, reasons: Mapping[str, str]) -> list[str]:
    """Format the reasons why results are missing, and notes on inaccurate results.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    reasons : mapping of str to str
        Reasons for missing results, by reduction name.

    Returns
    -------
    list of str
        One sentence per reduction without results, followed by the notes that reductions store in
        the attribute ``note`` of their results.
    """
    missing = describe_missing_reduction_results(dataset, reasons)
    notes = [str(v.attrs["note"]) for v in dataset.data_vars.values() if "note" in v.attrs]
    return [*map(": ".join, missing.items()), *dict.fromkeys(notes)]


def find_reasons_of_refused_reductions(dataset: xr.Dataset) -> dict[str, str]:
    """Find the reasons why reductions were not computed, such as failed cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    dict of str to str
        Reasons by reduction name.
    """
    named = [
        str(reduction["name"]) for reduction in StoredDataset(dataset).study_declaration.reductions
    ]
    # The name of one reduction may begin with the name of another reduction.
    named.sort(key=len, reverse=True)
    found: dict[str, str] = {}
    for result, values in dataset.data_vars.items():
        name = next((n for n in named if f"{result}_".startswith(f"{n}_")), "")
        if name and "refused" in values.attrs:
            found.setdefault(name, str(values.attrs["refused"]))
    return found


def describe_missing_reduction_results(
    dataset: xr.Dataset, reasons: Mapping[str, str]
) -> dict[str, str]:
    """Describe the missing results of reductions.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    reasons : mapping of str to str
        Reasons for missing results, by reduction name.

    Returns
    -------
    dict of str to str
        Descriptions by heading. If a reduction has no results, the heading is ``no NAME``. If only
        some values are missing, the heading is ``NAME``, and the description lists their points.
    """
    notes = {}
    for name, reason in reasons.items():
        variables = [
            str(n)
            for n, values in dataset.data_vars.items()
            if f"{n}_".startswith(f"{name}_") and "refused" in values.attrs
        ]
        values = dataset[min(variables, key=len)] if variables else xr.DataArray()
        missing = values.isnull()
        if 0 < (count := int(missing.sum())) < values.size:
            points = [
                _format_point_coordinates(values, at.tolist())
                for at in np.argwhere(missing.values)[:_MAX_MISSING_POINTS_SHOWN]
            ]
            points += ["..."] * (count > len(points))
            which = f"{count} of {values.size} values are missing ({'; '.join(points)})"
            notes[name] = f"{which}: {reason}"
        else:
            notes[f"no {name}"] = reason
    return notes


def _format_point_coordinates(values: xr.DataArray, indices: Sequence[int]) -> str:
    """Format the coordinates that locate a value in an array."""
    point = values.isel(dict(zip(values.dims, indices, strict=True)))
    return ", ".join(f"{d} = {format_number_or_text(point[d].item())}" for d in values.dims)


def find_reasons_of_missing_reductions(dataset: xr.Dataset) -> dict[str, str]:
    """Find the reasons why reductions have no results.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    dict of str to str
        Reasons by reduction name.
    """
    found, there = find_reasons_of_refused_reductions(dataset), tuple(map(str, dataset.data_vars))
    for stated_as in StoredDataset(dataset).study_declaration.reductions:
        about: Mapping[str, Any] = {**stated_as}
        if not any(name.startswith(about["name"]) for name in there):
            least, most = map(format_number_or_text, about.get("within") or ("", ""))
            on = format_axis_name(dataset[about["on"]]) if most else ""
            span = f", with {least} <= {on} <= {most}" if most else ""
            found[about["name"]] = f"too few suitable cells{span}"
    return found
