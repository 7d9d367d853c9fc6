"""Functions that summarise datasets for the JSON output of commands.

The functions return dictionaries whose values are numbers and strings. The numbers are the same as
in the printed tables, but they are not rounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray as xr

from rsfstudy.reporting.cell_tables import (
    build_failed_cells_table,
    count_cells_by_status,
    count_pending_cells,
)
from rsfstudy.reporting.dataset_origin_descriptions import find_constant_scene_and_rig_fields
from rsfstudy.reporting.dataset_summaries import (
    compute_duration_and_peaks_of_motion,
    is_motion_dataset,
)
from rsfstudy.reporting.fit_tables import contains_fits, summarise_fits_as_json_fields
from rsfstudy.reporting.lattice_tables import build_primary_output_table
from rsfstudy.reporting.reduction_tables import (
    build_reduction_tables,
    find_reasons_of_missing_reductions,
)
from rsfstudy.reporting.text_tables import TextTable, build_single_scene_result_table
from rsfstudy.storage import StoredDataset
from rsfstudy.vocabulary import find_coverage_content_type


def summarise_study_as_json_fields(dataset: xr.Dataset, file: str) -> dict[str, Any]:
    """Summarise the results of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    file : str
        Path of the results file. The path is part of the shell commands that recompute failed
        cells.

    Returns
    -------
    dict of str to object
        Number of cells by status, reductions, missing reductions and failed cells.
    """
    rows = [row for table in build_reduction_tables(dataset) for row in table.unformatted_rows]
    return {
        "study": dataset.attrs["id"],
        "title": dataset.attrs["title"],
        "file": file,
        "completeness": dataset.attrs["completeness"],
        "overrides": StoredDataset(dataset).study_declaration.overrides,
        "statuses": count_cells_by_status(dataset),
        "rhs_evaluations": int(dataset["rhs_evaluations"].sum()),
        "pending_cells": count_pending_cells(dataset),
        "failed_cells": build_failed_cells_table(dataset, file).unformatted_rows,
        "reductions": [row for row in rows if "name" in row],
        "cheapest_integrators": [row for row in rows if "name" not in row],
        "missing_reductions": find_reasons_of_missing_reductions(dataset),
    }


def classify_file_contents(dataset: xr.Dataset) -> str:
    """Return the kind of data in a file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of a file.

    Returns
    -------
    str
        The string "results" for the results of a study, "fit" for fits, "table" for a table of
        holds, events or steps, "motion" for a motion, or "scene" for other results of a single
        scene.
    """
    if contains_fits(dataset):
        return "fit"
    if StoredDataset(dataset).table_contents:
        return "table"
    if not StoredDataset(dataset).is_of_single_scene:
        return "results"
    return "motion" if is_motion_dataset(dataset) else "scene"


def summarise_file_as_json_fields(dataset: xr.Dataset, file: str) -> dict[str, Any]:
    """Summarise the data in a file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of the file.
    file : str
        Path of the file.

    Returns
    -------
    dict of str to object
        Kind of the data, and the fields that the JSON output contains for this kind.
    """
    kind = classify_file_contents(dataset)
    about = {"kind": kind, "file": file}
    if kind == "results":
        return about | _summarise_results_as_json_fields(dataset, file)
    if kind == "fit":
        return about | {"fits": summarise_fits_as_json_fields(dataset)}
    if kind == "table":
        return about | {"title": dataset.attrs.get("title", ""), "table": _list_table_rows(dataset)}
    about["status"] = dataset.attrs["status"]
    about["message"] = dataset.attrs.get("message", "")
    scene = {"scene": _omit_fields_with_value_none(StoredDataset(dataset).scene_fields)}
    if kind == "motion":
        return about | scene | {"motion": compute_duration_and_peaks_of_motion(dataset)}
    return about | scene | {"values": build_single_scene_result_table(dataset).unformatted_rows}


def _list_table_rows(dataset: xr.Dataset) -> dict[str, Any]:
    """Return a mapping from the variable names of a table to lists or single values."""
    return {str(name): values.values.tolist() for name, values in dataset.variables.items()}


def _summarise_results_as_json_fields(dataset: xr.Dataset, file: str) -> dict[str, Any]:
    """Summarise the results and the provenance of a study."""
    about, sizes = StoredDataset(dataset).provenance, dataset.sizes
    scene, rig = find_constant_scene_and_rig_fields(dataset)
    return summarise_study_as_json_fields(dataset, file) | {
        "lattice": {str(dimension): sizes[dimension] for dimension in dataset["status"].dims},
        "scene": _omit_fields_with_value_none(scene),
        "rig": rig,
        "primary_output": build_primary_output_table(dataset).unformatted_rows,
        "variables": _list_result_variables(dataset),
        "provenance": {
            "command_line": about["command"],
            **{name: about[name] for name in ("time", "git", "machine", "versions")},
        },
    }


def _omit_fields_with_value_none(fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a scene that are not None."""
    return {name: value for name, value in fields.items() if value is not None}


def _list_result_variables(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return the name, description and dimensions of each result in a dataset."""
    return [
        {
            "name": str(name),  # Users may add variables without the attribute ``long_name``.
            "description": str(values.attrs.get("long_name", "")),
            "dimensions": list(map(str, values.dims)),
        }
        for name, values in dataset.data_vars.items()
        if find_coverage_content_type(str(name)) == "modelResult"
    ]


def build_result_variables_table(dataset: xr.Dataset) -> TextTable:
    """Build a table of the result variables in a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    TextTable
        Table with the name, the description and the dimensions of each result variable.
    """
    found = _list_result_variables(dataset)
    rows = [
        {
            "variable": one["name"],
            "description": f"{one['description']} ({', '.join(one['dimensions'])})".strip(),
        }
        for one in found
    ]
    return TextTable(rows, "", {"description"}, unformatted_rows=found)
