"""Assembles finished cells into one self-describing dataset."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.axes import classify_rows_by_fields
from rsfstudy.quantities import Quantity
from rsfstudy.rig import DIMENSIONLESS_PREFIX
from rsfstudy.status import Status
from rsfstudy.storage import stored_loadings
from rsfstudy.storage.cell_journal import CellColumns, OutputPacking
from rsfstudy.storage.schema import FILE_LAYOUT_VERSION
from rsfstudy.study import Study
from rsfstudy.vocabulary import (
    FORMULAS_OF_DERIVED_COORDINATES,
    coverage_content_type,
    find_quantity,
)

CF_AND_ACDD_CONVENTIONS = "CF-1.11, ACDD-1.3"
_COMMENT_ON_DIMENSIONLESS_UNITS = (
    "Quantities are dimensionless: stress in sigma_*, slip in D_c, time in D_c/V_*, slip rate in "
    "V_*; the attribute scale of a variable says which."
)
_COMMENT_ON_RIG_UNITS = (
    " Axes are in the units that they state; sigma_star, slip_distance and reference_velocity are "
    "the scales of each cell."
)
#: Attributes that the user sets in the environment: RSFSTUDY_LICENSE and so on.
_CREDIT_ATTRIBUTES_FROM_ENVIRONMENT = (
    "creator_name",
    "creator_email",
    "institution",
    "license",
    "acknowledgement",
)


def assemble_dataset(
    study: Study, cell_columns: CellColumns, provenance: Mapping[str, Any]
) -> xr.Dataset:
    """The lattice of a study.

    Parameters
    ----------
    study : Study
    cell_columns : CellColumns
        What is known of each cell, in row-major order.
    provenance : mapping
        What else decided the numbers, as plain data.
    """
    dataset = xr.Dataset(
        build_lattice_variables(study, cell_columns, study.shape), build_lattice_coordinates(study)
    )
    known = int((cell_columns.statuses != int(Status.PENDING)).sum())
    return dataset.assign_attrs(root_attributes(study, known, provenance))


def build_lattice_variables(
    study: Study, cell_columns: CellColumns, block_shape: tuple[int, ...]
) -> dict[Any, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Variables for a block of cells: the numbers of the measure, and how each cell ended.

    Parameters
    ----------
    study : Study
    cell_columns : CellColumns
        What is known of the cells, in row-major order.
    block_shape : tuple of int
        Shape of the block.
    """
    layout, dims, own = OutputPacking(study.measure), study.dimensions, study.quantities
    described = {}
    for name, inner in study.measure.variables.items():
        values = cell_columns.packed_outputs[:, layout.slices[name]].reshape(
            block_shape + layout.shapes[name]
        )
        described[name] = ((*dims, *inner), values, _variable_attributes(name, own))
    kept = {
        "status": cell_columns.statuses,
        "rhs_evaluations": cell_columns.rhs_evaluations,
        "wall_time": cell_columns.wall_times,
        "message": cell_columns.messages,
    }
    for name, values in kept.items():
        described[name] = (dims, values.reshape(block_shape), _variable_attributes(name, {}))
    described["status"][2].update(
        flag_values=np.array([int(s) for s in Status], dtype=np.int8),
        flag_meanings=" ".join(s.label for s in Status),
        comment="; ".join(f"{s.label}: {s.meaning}" for s in Status),
    )
    for name, (_dims, _values, about) in described.items():
        about["coverage_content_type"] = coverage_content_type(name)
    for name in study.measure.variables:
        companions = [n for n in (f"{name}_error", "status") if n in described and n != name]
        described[name][2]["ancillary_variables"] = " ".join(companions)
    return described


def build_lattice_coordinates(study: Study) -> dict[Any, Any]:
    """Dimension coordinates, what follows from them, and the fixed values as scalars."""
    strides = np.cumprod([1, *study.shape[::-1]])[::-1][1:]
    coords: dict[Any, Any] = {}
    own = study.quantities
    sample = []
    for axis, stride in zip(study.axes, strides, strict=True):
        firsts = np.unique(
            classify_rows_by_fields(axis.rows), return_index=True, return_inverse=True
        )[1:]
        scenes = [study.scene(int(i * stride)).as_dict() for i in firsts[0]]
        sample += scenes
        if axis.labels is not None:
            about = {"long_name": axis.dimension.replace("_", " ")}
            coords[axis.dimension] = (axis.dimension, np.array(axis.labels, dtype=object), about)
        elif axis.has_numbered_points:
            about = {"units": "1", "long_name": f"number of the {axis.dimension.replace('_', ' ')}"}
            about |= {"drawn": json.dumps(axis.sampling_info)} if axis.sampling_info else {}
            coords[axis.dimension] = (axis.dimension, np.arange(len(axis), dtype=np.int32), about)
        # an axis shows its own values, even where its first cells make no use of them
        fixed = [{**study.measure.plain_fields, **scene} for scene in scenes]
        points = [{**fixed[n], **row} for n, row in zip(firsts[1], axis.rows, strict=True)]
        for name in axis.fields:
            varied = [point.get(name) for point in points]
            coords[name] = (
                axis.dimension,
                _to_storable_array(varied),
                _variable_attributes(name, own, _first_value_not_none(varied)),
            )
    for name, units in study.units.items():
        of_axis = {key: v for key, v in coords[name][2].items() if key != "scale"}
        coords[name] = (*coords[name][:2], of_axis | {"units": units})
    for name, (dims, values) in (
        study.scene_builder.build_scale_coordinates().items() if study.scene_builder else ()
    ):
        coords[name] = (
            dims,
            values,
            _variable_attributes(name.removeprefix(DIMENSIONLESS_PREFIX), own),
        )
    for name in study.scene_fields:
        present = {scene.get(name) for scene in sample} - {None}
        if name not in {*coords, *study.measure.variables} and len(present) == 1:
            value = present.pop()
            coords[name] = (
                (),
                _to_storable_array([value])[0],
                _variable_attributes(name, own, value),
            )
    for name, (source, formula) in FORMULAS_OF_DERIVED_COORDINATES.items():
        if source in coords:
            dims, values, _attrs = coords[source]
            derived = [formula(value) for value in np.ravel(values).tolist()]
            coords[name] = (
                dims,
                np.reshape(derived, np.shape(values)),
                _variable_attributes(name, {}),
            )
    for name, values in study.measure.inner_coordinates.items():
        coords[name] = (name, np.asarray(values), _variable_attributes(name, own))
    return coords | stored_loadings.loading_variables(study.user_parts.values())


def _to_storable_array(values: list[Any]) -> np.ndarray:
    """Values of one field as NetCDF can hold them: text, flags as int8, numbers with NaN where a
    value is missing.
    """
    if isinstance(_first_value_not_none(values), str):
        return np.array([value or "" for value in values], dtype=object)
    if isinstance(_first_value_not_none(values), bool) and None not in values:
        return np.array(values, dtype=np.int8)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _first_value_not_none(values: list[Any]) -> Any:
    """The first value that is not None, if any."""
    return next((value for value in values if value is not None), None)


def _variable_attributes(
    variable_name: str, study_quantities: Mapping[str, Quantity], example_value: Any = None
) -> dict[str, Any]:
    """Attributes of a variable, whether the vocabulary or the study (`own`) describes it; `value`
    is an example of what a coordinate holds.
    """
    about = find_quantity(variable_name, study_quantities)
    attrs: dict[str, Any] = {"long_name": about.long_name}
    if variable_name in study_quantities and about.symbol:
        attrs["symbol"] = about.symbol  # which the vocabulary does not hold
    if about.units and not isinstance(example_value, str | bool):
        attrs["units"] = about.units
    if about.scale:
        attrs["scale"] = about.scale
    attrs |= about.flag_attributes
    if isinstance(example_value, bool):
        attrs |= {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "false true"}
    return attrs


def root_attributes(
    study: Study, finished_cell_count: int, provenance: Mapping[str, Any]
) -> dict[str, Any]:
    """Root attributes: what the lattice is, where it comes from, how many of its cells are `known`,
    and the whole declaration.
    """
    complete = finished_cell_count == study.size
    when, version = provenance["time"], provenance["versions"]["rsfstudy"]
    texts = {
        "title": study.title,
        "summary": study.summary or study.title,
        "keywords": "rate and state friction, spring-slider, stability, stick-slip",
        "comment": _COMMENT_ON_DIMENSIONLESS_UNITS + (_COMMENT_ON_RIG_UNITS if study.rig else ""),
        "Conventions": CF_AND_ACDD_CONVENTIONS,
        "project": "rsfstudy",
        "naming_authority": "rsfstudy",
        "processing_level": "numerical model results, and what they are reduced to",
        "id": study.name,
        "source": f"rsfstudy {version}, numerical model of a spring-slider",
        "history": f"{when} {provenance['command']}",
        "references": "; ".join(study.references) or "none",
        "date_created": when,
        "product_version": str(study.version),
        "completeness": "complete"
        if complete
        else f"partial: {finished_cell_count} of {study.size} cells",
        "declaration": json.dumps(study.describe()),
        "provenance": json.dumps(dict(provenance)),
        **{
            name: os.environ.get(f"RSFSTUDY_{name.upper()}", "not stated")
            for name in _CREDIT_ATTRIBUTES_FROM_ENVIRONMENT
        },
    }
    # a command, or the environment, may hold bytes that are no text
    plain = {name: text.encode(errors="backslashreplace").decode() for name, text in texts.items()}
    return {**plain, "layout": FILE_LAYOUT_VERSION}
