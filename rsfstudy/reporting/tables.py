"""Tables of results as plain text, for commands and reports."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.critical_steps import SLOW_INSTABILITY_NORM_WARNING_PREFIX
from rsfstudy.formatting import (
    format_list,
    format_nonempty_fields,
    format_value,
    pluralize,
    read_flag_meanings,
)
from rsfstudy.quantities import units_or_scale_of_variable
from rsfstudy.rig import (
    DIMENSIONLESS_PREFIX,
    convert_to_dimensional_name,
    convert_to_display_units,
    in_display_units,
)
from rsfstudy.status import STATUS_LABELS, Status
from rsfstudy.storage import find_primary_output, read_declaration, read_provenance
from rsfstudy.study import NOT_APPLICABLE_VERDICT, VERDICTS, format_verdict_row
from rsfstudy.vocabulary import find_quantity

#: Maximum number of cells in a table that shows a selection of cells, maximum number of cells in a
#: table that shows all cells, and maximum number of failed cells in a table.
MAX_CELLS_SHOWN, _MAX_CELLS_SHOWN_WITHOUT_THINNING, _MAX_FAILURES = 24, 36, 20
#: If each point of a numbered axis has more fields than this number, a table shows fewer cells.
_MAX_FIELDS_PER_POINT_WITHOUT_THINNING = 4
#: Maximum number of significant digits of a float.
_MAX_DIGITS = 15
#: Headings and formats of the columns of a slope table, by the suffix of the variable name.
_COLUMNS_OF_SLOPE_TABLE = {
    "stderr": ("standard error", ".2g"),
    "misfit": ("largest misfit", ".2g"),
    "points": ("points", ".0f"),
    "error": ("numerical error", ".2g"),
}
#: Mapping from a column heading to the name of a variable and to the function that formats the
#: values of the variable.
VariableAndFormatterByHeading = dict[str, tuple[str, Callable[[Any], str]]]


@dataclass(frozen=True)
class TextTable:
    """Table whose cells are strings.

    Parameters
    ----------
    rows : sequence of mapping of str to str
        Rows of the table. The keys are the column headings.
    caption : str, optional
        Caption of the table.
    wrappable_columns : collection of str, optional
        Headings of the columns whose texts may be wrapped between words.
    row_colours : sequence of str, optional
        Colour of the last cell of each row.
    """

    rows: Sequence[Mapping[str, str]]
    caption: str = ""
    wrappable_columns: Collection[str] = ()
    row_colours: Sequence[str] = ()


def format_number_or_dash(value: float, format_specification: str = ".8g") -> str:
    """Format a number, or return a dash for NaN.

    Parameters
    ----------
    value : float
        Number to format.
    format_specification : str, default: ".8g"
        Format specification.

    Returns
    -------
    str
        Formatted number.
    """
    return "-" if np.isnan(value) else format(value, format_specification)


def format_rounded_to_error(value: float, error: float) -> str:
    """Format a number, rounded to two significant digits of its error.

    Parameters
    ----------
    value : float
        Number to format.
    error : float
        Error of the number.

    Returns
    -------
    str
        Formatted number. If the error is zero, NaN, or larger than the number, the number has eight
        significant digits.
    """
    if not 0.0 < error < abs(value):
        return format_number_or_dash(value)
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 2
    return format(value, f".{min(digits, _MAX_DIGITS)}g")


def build_single_scene_result_table(dataset: xr.Dataset) -> TextTable:
    """Build a table of the scalar variables of a dataset of one scene.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset of one scene, such as a critical step.

    Returns
    -------
    TextTable
        Table with one row per variable: name, value with units, error estimate, and description.
        Codes of categorical variables are replaced by their meanings.
    """
    rows = []
    for name, values in dataset.data_vars.items():
        if values.dims or str(name).removesuffix("_error") in set(dataset) - {name}:
            continue
        value, error = values.item(), float(dataset.get(f"{name}_error", np.nan))
        units, flags = format_units(values), read_flag_meanings(values.attrs)
        text = flags.get(value, format_rounded_to_error(value, error))
        row = {
            "number": str(name),
            "value": text if units == "1" or text == "-" else f"{text} {units}",
            "error": format_number_or_dash(error, ".1e"),
            "what": str(values.attrs.get("long_name", "")),
        }
        rows.append(row)
    return TextTable(rows, wrappable_columns={"what"})


def format_units(variable: xr.DataArray) -> str:
    """Format the units of a variable.

    Parameters
    ----------
    variable : xarray.DataArray
        Variable with the attribute ``units`` or ``scale``.

    Returns
    -------
    str
        Units, or the scale by which the variable is normalised. The string is "1" if the variable
        is a pure number.
    """
    units = re.sub(r" (s|[num]?m)-1\b", r"/\1", units_or_scale_of_variable(variable.attrs) or "1")
    return re.sub(r" \((\w+)\)-1| (\(.*?\))-1", r"/\1\2", units)


def format_axis_name(axis_coordinate: xr.DataArray) -> str:
    """Format the name of an axis, with units if the axis has units.

    Parameters
    ----------
    axis_coordinate : xarray.DataArray
        Coordinate of the axis.

    Returns
    -------
    str
        Name, followed by the units in brackets if the units differ from the units in the
        vocabulary.
    """
    name, units = str(axis_coordinate.name), axis_coordinate.attrs.get("units", "1")
    return name if units in ("1", find_quantity(name).units) else f"{name} ({units})"


def format_status_counts(dataset: xr.Dataset) -> str:
    """Format the number of cells with each status, and the computational work.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str
        Number of cells per status, and total number of right-hand-side evaluations. If no cell has
        the status ``ok``, each status is followed by its meaning.
    """
    work, counts = int(dataset["rhs_evaluations"].sum()), count_statuses(dataset)
    nothing = Status.OK.label not in counts
    told = ", ".join(
        f"{count} {label}" + f" ({Status[label.upper()].meaning})" * nothing
        for label, count in counts.items()
    )
    return f"{told}; {work:,} right-hand sides"


def describe_scene_and_rig_fields(
    heading: str,
    scene_fields: Mapping[str, Any],
    rig_values: Mapping[str, float],
    varied_names: Collection[str] = (),
) -> dict[str, str]:
    """Describe the fields of a scene and of a rig.

    Parameters
    ----------
    heading : str
        Key in the returned dictionary for the fields that have a nonzero value.
    scene_fields : mapping of str to object
        Fields of the scene.
    rig_values : mapping of str to float
        Quantities of the rig in SI units.
    varied_names : collection of str, optional
        Names of the fields that vary along an axis. These fields are omitted.

    Returns
    -------
    dict of str to str
        Descriptions of the nonzero fields, the zero fields, the rig, and the slip rate of the
        instability norm. Empty descriptions are omitted.
    """
    scene_fields = {n: v for n, v in scene_fields.items() if n not in varied_names}
    sizes = in_display_units(rig_values, varied_names)
    told = {
        heading: format_nonempty_fields({n: v for n, v in scene_fields.items() if v}),
        "0 or absent": ", ".join(n for n, v in scene_fields.items() if not v and v is not None),
        "laboratory": format_nonempty_fields(
            {n: f"{v:g} {units}" for n, (v, units) in sizes.items()}
        ),
    }
    norm, period = scene_fields.get("instability_norm"), scene_fields.get("period")
    if norm and period and {"slip_distance", "reference_velocity"} <= set(sizes):
        rate = norm * math.tau * sizes["slip_distance"][0] / period
        # A norm below the reference velocity does not indicate an instability.
        if rate > sizes["reference_velocity"][0]:
            told["unstable from"] = f"a slip rate of {rate:.4g} um/s on"
    return {name: text for name, text in told.items() if text}


def describe_study_origin(dataset: xr.Dataset) -> dict[str, str]:
    """Describe the lattice and the provenance of the results of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    dict of str to str
        Descriptions of the lattice, the fixed fields, the cells, the command and the versions.
    """
    attrs, about = dataset.attrs, read_provenance(dataset)
    dims, declared = dataset["status"].dims, read_declaration(dataset)
    varied = {
        str(n).removeprefix(DIMENSIONLESS_PREFIX)
        for n, along in dataset.coords.items()
        if along.dims
    }
    reduced = attrs.get("reduced_despite")
    versions = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    return {
        "lattice": " x ".join(f"{dataset.sizes[d]} {d}" for d in dims),
        **describe_scene_and_rig_fields("fixed", declared.base, declared.laboratory or {}, varied),
        "cells": f"{attrs['completeness']}; {format_status_counts(dataset)}",
        **({"reductions": reduced} if reduced else {}),
        "made by": f"{about['command']}, {about['time']}",
        "with": f"{versions}; git {about['git']}; {about['machine']}",
    }


def build_rows_along_dimensions(
    dataset: xr.Dataset, dimensions: Iterable[Hashable], columns: VariableAndFormatterByHeading
) -> list[dict[str, str]]:
    """Build one table row for each combination of points of several dimensions.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the variables of the columns.
    dimensions : iterable of hashable
        Dimensions along which the points become rows.
    columns : dict of str to (str, callable)
        Mapping from a column heading to the name of the variable in the column and to the function
        that formats its values.

    Returns
    -------
    list of dict of str to str
        Rows with the coordinates of a point, followed by the formatted values.
    """
    dimensions, found = list(map(str, dimensions)), []
    for at in np.ndindex(*(dataset.sizes[d] for d in dimensions)):
        one = dataset.isel(dict(zip(dimensions, at, strict=True)))
        row = {format_axis_name(one[d]): format_value(one[d].item()) for d in dimensions}
        found.append(row | {head: form(one[n].item()) for head, (n, form) in columns.items()})
    return found


def build_primary_output_table(dataset: xr.Dataset) -> TextTable:
    """Build a table of the primary output along the axes.

    The table contains the coordinates, the error estimates, and the status if some cells have no
    result. If the lattice has many cells, the table contains a selection of the cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    TextTable
        Table of the primary output. The table is empty if the study has no primary output.
    """
    name = find_primary_output(dataset)
    if name is None:
        return TextTable([])
    dataset = convert_to_display_units(dataset)
    name = name if name in dataset else convert_to_dimensional_name(name)
    dims = dataset["status"].dims
    drawn = [n for n in _find_fields_along_numbered_axes(dataset) if n in dataset.coords]
    columns = VariableAndFormatterByHeading(
        {format_axis_name(dataset[n]): (n, format_value) for n in drawn}
    )
    columns[name] = name, format_number_or_dash
    if f"{name}_error" in dataset:
        columns["error"] = (
            f"{name}_error",
            partial(format_number_or_dash, format_specification=".1e"),
        )
    size, fewer = dataset["status"].size, 1 + len(drawn) // _MAX_FIELDS_PER_POINT_WITHOUT_THINNING
    most = size if size <= _MAX_CELLS_SHOWN_WITHOUT_THINNING // fewer else MAX_CELLS_SHOWN // fewer
    at = select_thinned_points({str(d): dataset.sizes[d] for d in dims}, most)
    few = dataset[[*(n for n, _form in columns.values()), "status"]].isel(at).load()
    if (few["status"] != int(Status.OK)).any():
        columns["status"] = "status", STATUS_LABELS.__getitem__
    units, shown = format_units(dataset[name]), few["status"].size
    caption = str(dataset[name].attrs.get("long_name", name)) + f", in {units}" * (units != "1")
    if shown < size:
        full = dataset.sizes
        every = [f"{n} of {full[d]} {d}" for d, n in few.sizes.items() if n < full[d]]
        which = f"{shown} of {size:,} cells, {', '.join(every)}, from first to last"
        caption += f" ({which}; rsfstudy export --csv writes all)"
    return TextTable(build_rows_along_dimensions(few, dims, columns), caption)


def _find_fields_along_numbered_axes(dataset: xr.Dataset) -> list[str]:
    """Return the fields that vary along numbered axes, such as samples."""
    axes = [axis.values for axis in read_declaration(dataset).axes]
    columns = [
        v for v in axes if isinstance(v, Mapping) and isinstance(next(iter(v.values())), list)
    ]
    return [name for column in columns for name in column]


def summarise_study_as_text_lines(dataset: xr.Dataset) -> list[str]:
    """Summarise the results of a study in lines of text.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    list of str
        Range of the primary output, one line per slope, and the number of cells per status.
    """
    lines, converted = [], convert_to_display_units(dataset)
    if (name := find_primary_output(dataset)) is not None:
        values = converted[name if name in converted else convert_to_dimensional_name(name)]
        told, units = np.unique(values.values[np.isfinite(values.values)]), format_units(values)
        ends = " to ".join(map(format_value, dict.fromkeys((*told[:1], *told[-1:]))))
        text = f"{ends}{f' {units}' * (units != '1')}" if ends else "no number"
        lines.append(f"{values.name}: {text}")
    for slope in _names_of_slope_reductions(converted):
        slopes, units = converted[slope].values.ravel().tolist(), format_units(converted[slope])
        lines.append(f"{slope}: {format_list(slopes, ', ')}{f' {units}' * (units != '1')}")
    return [*lines, format_status_counts(dataset)]


def reduction_tables(dataset: xr.Dataset) -> Iterator[TextTable]:
    """Yield tables of the slopes and of the comparison of integrators.

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
    converted = convert_to_display_units(dataset)
    for slope in _names_of_slope_reductions(converted):
        yield _slope_table(converted, slope)
    columns: VariableAndFormatterByHeading = {
        "cheapest": ("cheapest_integrator", str),
        "its work": ("cheapest_work", "{:,.0f}".format),
        "work of the default": ("cheapest_default_work", "{:,.0f}".format),
        "rtol to ask for": ("cheapest_default_request", lambda digits: f"{10.0**-digits:.1g}"),
    }
    if {name for name, _form in columns.values()} <= set(dataset.data_vars):
        dims = dataset["cheapest_work"].dims
        yield TextTable(
            build_rows_along_dimensions(dataset, dims, columns),
            wrappable_columns={"problem", "cheapest"},
        )


def build_reduction_tables_and_sentences(dataset: xr.Dataset) -> Iterator[TextTable | str]:
    """Yield the tables of reductions, and the reasons for missing reductions.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Yields
    ------
    TextTable or str
        Tables, followed by one sentence per reduction without results.
    """
    yield from reduction_tables(dataset)
    for name, why in missing_result_reasons(dataset).items():
        yield f"no {name}: {why}"


def find_refusal_reasons_of_reductions(dataset: xr.Dataset) -> dict[str, str]:
    """Find the reasons why reductions were refused, such as failed cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    dict of str to str
        Reasons by reduction name.
    """
    named = [str(reduction["name"]) for reduction in read_declaration(dataset).reductions]
    named.sort(key=len, reverse=True)  # A name may begin with another name.
    found: dict[str, str] = {}
    for result, values in dataset.data_vars.items():
        name = next((n for n in named if f"{result}_".startswith(f"{n}_")), "")
        if name and "refused" in values.attrs:
            found.setdefault(name, str(values.attrs["refused"]))
    return found


def format_notes_on_incomplete_results(results: xr.Dataset) -> list[str]:
    """Describe failed cells and reductions that could not be computed.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.

    Returns
    -------
    list of str
        Notes, or an empty list if the results are complete.
    """
    told = [
        f"no {name}: {why}" for name, why in find_refusal_reasons_of_reductions(results).items()
    ]
    if failed := count_failures(results):
        each = ", ".join(f"{label} {number}" for label, number in failed.items())
        first = f"{sum(failed.values())} of {results['status'].size} cells failed: {each}"
        told = [first, *told, "dataset.rsf.failures() lists them"]
    return told


def missing_result_reasons(dataset: xr.Dataset) -> dict[str, str]:
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
    found, there = find_refusal_reasons_of_reductions(dataset), tuple(map(str, dataset.data_vars))
    for stated_as in read_declaration(dataset).reductions:
        about: Mapping[str, Any] = {**stated_as}
        if not any(name.startswith(about["name"]) for name in there):
            least, most = map(format_value, about.get("within") or ("", ""))
            on = format_axis_name(dataset[about["on"]]) if most else ""
            span = f", with {least} <= {on} <= {most}" if most else ""
            found[about["name"]] = f"among these cells are none, or too few, to draw on{span}"
    return found


def note_on_norms_near_load_velocity(dataset: xr.Dataset) -> str:
    """Describe results whose instability norm is close to the load velocity.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str
        Number of results whose instability norm is close to the load point velocity, and the
        message of the first such result. The string is empty if there is no such result, or if the
        study has no rig.
    """
    if read_declaration(dataset).laboratory is None:
        return ""
    ok = dataset["message"].values[dataset["status"].values == int(Status.OK)]
    near = [text for text in ok.tolist() if text.startswith(SLOW_INSTABILITY_NORM_WARNING_PREFIX)]
    return f"{len(near)} of {pluralize(len(ok), 'answer')}: {near[0]}" if near else ""


def _names_of_slope_reductions(dataset: xr.Dataset) -> list[str]:
    """Return the names of the reductions that have a standard error."""
    named = [reduction["name"] for reduction in read_declaration(dataset).reductions]
    return [name for name in named if {name, f"{name}_stderr"} <= set(dataset.data_vars)]


def _slope_table(dataset: xr.Dataset, reduction_name: str) -> TextTable:
    """Return a table of a slope with its standard error and misfit."""
    dims, words = (
        dataset[reduction_name].dims,
        dataset[reduction_name].attrs.get("comment", reduction_name),
    )
    units = format_units(dataset[reduction_name])
    columns: VariableAndFormatterByHeading = {
        f"{reduction_name} ({units})" if units != "1" else reduction_name: (
            reduction_name,
            format_value,
        )
    }
    for end, (heading, form) in _COLUMNS_OF_SLOPE_TABLE.items():
        if (beside := f"{reduction_name}_{end}") in dataset:
            if end != "points" and (own := format_units(dataset[beside])) != units:
                heading += f" ({own})"
            columns[heading] = beside, f"{{:{form}}}".format
    return TextTable(
        build_rows_along_dimensions(dataset, dims, columns),
        words,
        {format_axis_name(dataset[d]) for d in dims},
    )


def claims_table(verdicts: pd.DataFrame) -> TextTable | str:
    """Build a table of claims and their verdicts.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts of one or several studies, from ``rsfstudy.check``.

    Returns
    -------
    TextTable or str
        Table of the claims. If no claim applies, the function returns a sentence. The sentence is
        empty if there are no claims.
    """
    rows = verdicts.to_dict("records")
    if not any(row["verdict"] != NOT_APPLICABLE_VERDICT for row in rows):
        return f"{pluralize(len(rows), 'claim')} not checked: {count_verdicts(verdicts)}" * bool(
            rows
        )
    colours = [
        "red" if row["moved"] else "green" if row["verdict"] == "reproduced" else "yellow"
        for row in rows
    ]
    return TextTable(
        [format_verdict_row(row) for row in rows],
        wrappable_columns={"claim", "tolerance, and why"},
        row_colours=colours,
    )


def count_verdicts(verdicts: pd.DataFrame) -> str:
    """Count the claims per verdict.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts, from ``rsfstudy.check``.

    Returns
    -------
    str
        Number of claims per verdict. If no claim applies, the string contains the reason.
    """
    given = list(verdicts["verdict"])
    if set(given) == {NOT_APPLICABLE_VERDICT}:
        return "other values or units have no published numbers"
    return ", ".join(f"{given.count(v)} {v}" for v in VERDICTS if v in given)


def summarise_verdicts(dataset: xr.Dataset, verdicts: pd.DataFrame) -> tuple[str, list[str]]:
    """Summarise the verdicts of claims and the failures of cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    verdicts : pandas.DataFrame
        Verdicts, from ``rsfstudy.check``.

    Returns
    -------
    counts : str
        Number of claims per verdict.
    problems : list of str
        Descriptions of failed cells, and of claims whose verdict differs from the expected verdict.
    """
    wrong = [f"{count} {label}" for label, count in count_failures(dataset).items()]
    wrong += [f"{claim} moved" for claim in dict.fromkeys(verdicts["id"][verdicts["moved"]])]
    return count_verdicts(verdicts), wrong


def build_frame_of_cells(
    dataset: xr.Dataset, cell_mask: xr.DataArray, axis_names: Sequence[str]
) -> pd.DataFrame:
    """Build a table of selected cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    cell_mask : xarray.DataArray
        True for the selected cells.
    axis_names : sequence of str
        Names of the axes.

    Returns
    -------
    pandas.DataFrame
        Table with one row per cell: coordinates on the axes, ``status`` and ``message``.
    """
    at = cell_mask.values
    columns = {name: dataset[name].broadcast_like(cell_mask).values[at] for name in axis_names}
    columns["status"] = [STATUS_LABELS[code] for code in dataset["status"].values[at].tolist()]
    return pd.DataFrame(columns | {"message": dataset["message"].values[at]})


def failures_table(dataset: xr.Dataset, file: str) -> tuple[TextTable, list[str]]:
    """Build a table of the first failed cells, and the commands to rerun them.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    file : str
        Path of the results file.

    Returns
    -------
    table : TextTable
        Table with up to 20 failed cells.
    commands : list of str
        Commands that recompute the cells in the table, one command per cell.
    """
    status = dataset["status"]
    failed = (status >= int(Status.WORK_BUDGET_SPENT)) & (status != int(Status.PENDING))
    found = build_frame_of_cells(dataset, failed, list(map(str, failed.dims)))
    first = found[:_MAX_FAILURES]
    places: list[dict[Any, Any]] = first[list(failed.dims)].to_dict("records")
    rows = [
        {"cell": format_nonempty_fields(place), "status": label, "message": message}
        for place, label, message in zip(places, first["status"], first["message"], strict=True)
    ]
    caption = f"{pluralize(len(found), 'cell')} failed"
    if len(found) > len(rows):
        caption += f", of which the first {len(rows)}"
    return TextTable(rows, caption, wrappable_columns={"cell", "message"}), [
        format_recompute_command(dataset, file, place) for place in places
    ]


def format_recompute_command(
    dataset: xr.Dataset, results_file: str, cell_coordinates: Mapping[str, Any]
) -> str:
    """Format the command that recomputes one cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    results_file : str
        Path of the results file.
    cell_coordinates : mapping of str to object
        Coordinates of the cell on the axes.

    Returns
    -------
    str
        Command for a shell.
    """
    words = ["rsfstudy", "rerun", results_file]
    declared_in = read_provenance(dataset)["declared_in"]
    if declared_in:
        words += ["--study", declared_in]
    for name, value in cell_coordinates.items():
        words += ["--cell", f"{name}={value}"]
    return shlex.join(words)


def count_pending_cells(dataset: xr.Dataset) -> int:
    """Count the cells that have not been computed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    int
        Number of cells.
    """
    return int((dataset["status"] == int(Status.PENDING)).sum())


def select_thinned_points(
    dimension_sizes: Mapping[str, int], max_cells: int
) -> dict[str, np.ndarray]:
    """Select points of each dimension so that the number of cells is limited.

    The first and the last point of a dimension are selected if at least two points of the dimension
    are selected.

    Parameters
    ----------
    dimension_sizes : mapping of str to int
        Size of each dimension.
    max_cells : int
        Maximum number of selected cells. The longest dimensions are thinned first.

    Returns
    -------
    dict of str to numpy.ndarray
        Indices of the selected points of each dimension.
    """
    kept = {dimension: min(size, max_cells) for dimension, size in dimension_sizes.items()}
    while math.prod(kept.values()) > max_cells:
        kept[max(kept, key=kept.__getitem__)] -= 1
    return {
        dimension: np.unique(np.linspace(0, size - 1, kept[dimension]).round().astype(int))
        for dimension, size in dimension_sizes.items()
    }


def count_statuses(dataset: xr.Dataset) -> Mapping[str, int]:
    """Count the cells per status.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    mapping of str to int
        Number of cells by status label.
    """
    status = np.asarray(dataset["status"].values)
    return {s.label: int((status == int(s)).sum()) for s in Status if (status == int(s)).any()}


def count_failures(dataset: xr.Dataset) -> Mapping[str, int]:
    """Count the failed cells per status.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    mapping of str to int
        Number of failed cells by status label.
    """
    return {
        label: n
        for label, n in count_statuses(dataset).items()
        if not Status[label.upper()].is_answer
    }
