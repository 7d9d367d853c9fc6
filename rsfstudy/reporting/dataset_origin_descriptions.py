"""Functions that describe the scene, the rig and the provenance of results."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import xarray as xr

from rsfstudy.formatting import format_count_with_noun, format_fields_except_none
from rsfstudy.measures import CriticalStep
from rsfstudy.reporting.cell_tables import format_status_counts
from rsfstudy.reporting.fit_tables import list_scene_fields_set_by_fit
from rsfstudy.rig import DatasetUnits, Rig
from rsfstudy.status import Status
from rsfstudy.storage import StoredDataset


def describe_scene_and_rig_fields(
    nonzero_fields_heading: str,
    scene_fields: Mapping[str, Any],
    rig_quantities: Mapping[str, float],
    varied_field_names: Collection[str] = (),
) -> dict[str, str]:
    """Describe the fields of a scene and the quantities of a rig.

    Parameters
    ----------
    nonzero_fields_heading : str
        Key of the nonzero fields in the returned dictionary.
    scene_fields : mapping of str to object
        Fields of the scene.
    rig_quantities : mapping of str to float
        Quantities of the rig in SI units.
    varied_field_names : collection of str, optional
        Names of the fields that vary along an axis. The description omits these fields.

    Returns
    -------
    dict of str to str
        Descriptions of the nonzero fields, of the fields that are zero, of the rig, and of the slip
        rate at the instability norm. Empty descriptions are omitted.
    """
    scene_fields = {n: v for n, v in scene_fields.items() if n not in varied_field_names}
    sizes = Rig.convert_quantities_for_display(rig_quantities, varied_field_names)
    told = {
        nonzero_fields_heading: format_fields_except_none(
            {n: v for n, v in scene_fields.items() if v}
        ),
        "fields equal to 0": ", ".join(
            n for n, v in scene_fields.items() if not v and v is not None
        ),
        "rig": format_fields_except_none({n: f"{v:g} {units}" for n, (v, units) in sizes.items()}),
    }
    norm, period = scene_fields.get("instability_norm"), scene_fields.get("period")
    if norm and period and {"slip_distance", "reference_velocity"} <= set(sizes):
        rate = norm * math.tau * sizes["slip_distance"][0] / period
        # An instability norm below the reference velocity is not described, because the slip rate
        # of steady sliding would exceed this norm.
        if rate > sizes["reference_velocity"][0]:
            told["instability threshold"] = f"slip rate of {rate:.4g} um/s"
    return {name: text for name, text in told.items() if text}


def find_constant_scene_and_rig_fields(
    dataset: xr.Dataset,
) -> tuple[dict[str, Any], dict[str, float]]:
    """Find the scene fields and rig quantities that are equal in all cells.

    Fields that a fit has determined are not included.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    scene : dict of str to object
        Fields of the scene. The value of a field is None if the scene does not have this field.
    rig : dict of str to float
        Quantities of the rig in SI units. The dictionary is empty if the study has no rig.
    """
    declared = StoredDataset(dataset).study_declaration
    varied = {
        str(n).removeprefix(DatasetUnits.DIMENSIONLESS_FIELD_NAME_PREFIX)
        for n, along in dataset.coords.items()
        if along.dims
    } | list_scene_fields_set_by_fit(dataset)
    scene = {n: v for n, v in declared.base.items() if n not in varied}
    rig = declared.rig_quantities or {}
    return scene, {name: rig[name] for name in Rig.convert_quantities_for_display(rig, varied)}


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
    attrs, about = dataset.attrs, StoredDataset(dataset).provenance
    dims = dataset["status"].dims
    scene, rig = find_constant_scene_and_rig_fields(dataset)
    reduced = attrs.get("reduced_despite")
    versions = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    return {
        "axes": " x ".join(f"{dataset.sizes[d]} {d}" for d in dims),
        **describe_scene_and_rig_fields("fixed fields", scene, rig),
        "cells": f"{attrs['completeness']}; {format_status_counts(dataset)}",
        **({"reductions": reduced} if reduced else {}),
        "command": f"{about['command']}, {about['time']}",
        "software versions": f"{versions}; git {about['git']}; {about['machine']}",
    }


def format_note_on_low_instability_norms(dataset: xr.Dataset) -> str:
    """Return a note if an instability norm is close to the load point velocity.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str
        String with the number of results whose instability norm is close to the load point
        velocity, and with the message of the first of these results. The string is empty if there
        is no such result, or if the study has no rig.
    """
    if StoredDataset(dataset).study_declaration.rig_quantities is None:
        return ""
    ok = dataset["message"].values[dataset["status"].values == int(Status.OK)]
    near = [text for text in ok.tolist() if text.startswith(CriticalStep.SLOW_NORM_WARNING_PREFIX)]
    return f"{len(near)} of {format_count_with_noun(len(ok), 'result')}: {near[0]}" if near else ""
