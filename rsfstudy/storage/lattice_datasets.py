"""Assembly of finished cells into a self-describing dataset.

``assemble_dataset`` builds the variables, the coordinates and the root attributes. To write a Zarr
store, the same functions are called for blocks of cells.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.axes import classify_axis_rows_by_fields_and_texts
from rsfstudy.quantities import Quantity
from rsfstudy.rig import DIMENSIONLESS_PREFIX
from rsfstudy.status import Status
from rsfstudy.storage import stored_loadings
from rsfstudy.storage.cell_journal import CellColumns, OutputPacker
from rsfstudy.storage.schema import FILE_LAYOUT_VERSION
from rsfstudy.study import Study
from rsfstudy.vocabulary import (
    FORMULAS_OF_DERIVED_COORDINATES,
    find_coverage_content_type,
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
#: Root attributes that users can set with environment variables, for example ``RSFSTUDY_LICENSE``.
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
    """Assemble the dataset of a study.

    Parameters
    ----------
    study : Study
        Study whose cells are assembled.
    cell_columns : CellColumns
        Columns of all cells, in row-major order.
    provenance : mapping of str to object
        Provenance of the run, as plain data (see ``execution.provenance.collect_provenance``).

    Returns
    -------
    xarray.Dataset
        Dataset with one value per cell and output, before any reductions.
    """
    dataset = xr.Dataset(
        build_lattice_variables(study, cell_columns, study.shape), build_lattice_coordinates(study)
    )
    known = int((cell_columns.statuses != int(Status.PENDING)).sum())
    return dataset.assign_attrs(root_attributes(study, known, provenance))


def build_lattice_variables(
    study: Study, cell_columns: CellColumns, block_shape: tuple[int, ...]
) -> dict[Any, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Build the variables of a block of cells.

    The variables are the outputs of the measure, and the status, message, wall time and number of
    right-hand-side evaluations of each cell.

    Parameters
    ----------
    study : Study
        Study to which the cells belong.
    cell_columns : CellColumns
        Columns of the cells in the block, in row-major order.
    block_shape : tuple of int
        Shape of the block.

    Returns
    -------
    dict of str to tuple
        Dimensions, values and attributes of each variable.
    """
    layout, dims, own = OutputPacker(study.measure), study.dimensions, study.quantities
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
        about["coverage_content_type"] = find_coverage_content_type(name)
    for name in study.measure.variables:
        companions = [n for n in (f"{name}_error", "status") if n in described and n != name]
        described[name][2]["ancillary_variables"] = " ".join(companions)
    return described


def build_lattice_coordinates(study: Study) -> dict[Any, Any]:
    """Build the coordinates of the lattice of a study.

    The coordinates include the dimension coordinates, the fields that vary along each axis, and the
    fixed scene fields as scalars. The coordinates also include the tables of user-defined loadings,
    and the coordinates of array outputs of the measure.

    Parameters
    ----------
    study : Study
        Study that declares the lattice.

    Returns
    -------
    dict of str to tuple or xarray.Variable
        Coordinates by name, in a form that ``xarray.Dataset`` accepts.
    """
    strides = np.cumprod([1, *study.shape[::-1]])[::-1][1:]
    coords: dict[Any, Any] = {}
    own = study.quantities
    sample = []
    for axis, stride in zip(study.axes, strides, strict=True):
        firsts = np.unique(
            classify_axis_rows_by_fields_and_texts(axis.rows),
            return_index=True,
            return_inverse=True,
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
        # An axis shows its own values, even if the scenes of its first cells do not use them.
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
    """Convert the values of a field to an array that NetCDF can store.

    Strings become an object array and Boolean values become int8. All other values become floats,
    and None becomes NaN.
    """
    if isinstance(_first_value_not_none(values), str):
        return np.array([value or "" for value in values], dtype=object)
    if isinstance(_first_value_not_none(values), bool) and None not in values:
        return np.array(values, dtype=np.int8)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _first_value_not_none(values: list[Any]) -> Any:
    """Return the first value that is not None, or None if all values are None."""
    return next((value for value in values if value is not None), None)


def _variable_attributes(
    variable_name: str, study_quantities: Mapping[str, Quantity], example_value: Any = None
) -> dict[str, Any]:
    """Build the attributes of a variable from the vocabulary or the study.

    The argument ``example_value`` is one value of the variable. The type of this value determines
    if the variable has units or flags.
    """
    about = find_quantity(variable_name, study_quantities)
    attrs: dict[str, Any] = {"long_name": about.long_name}
    if variable_name in study_quantities and about.symbol:
        attrs["symbol"] = about.symbol  # Symbols of studies are not in the vocabulary.
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
    """Build the root attributes of a dataset.

    The attributes follow the CF and ACDD conventions. The attributes also contain the declaration
    of the study and the provenance of the run as JSON.

    Parameters
    ----------
    study : Study
        Study that produced the dataset.
    finished_cell_count : int
        Number of finished cells.
    provenance : mapping of str to object
        Provenance of the run, as plain data.

    Returns
    -------
    dict of str to object
        Root attributes by name.
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
    # The command line and environment variables may contain bytes that are not valid text.
    plain = {name: text.encode(errors="backslashreplace").decode() for name, text in texts.items()}
    return {**plain, "layout": FILE_LAYOUT_VERSION}
