"""Functions that assemble finished cells into a self-describing dataset.

``assemble_study_dataset`` assembles the dataset of a complete lattice. For Zarr stores, the
functions that build the variables are called for one block of cells at a time. The module
``lattice_coordinates`` builds the coordinates.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.quantities import COMMENT_ON_UNITS_AND_SCALES
from rsfstudy.status import Status
from rsfstudy.storage.cell_result_arrays import CellOutputPacker, CellResultArrays
from rsfstudy.storage.lattice_coordinates import build_variable_attributes
from rsfstudy.storage.schema import FILE_LAYOUT_VERSION
from rsfstudy.study import Study
from rsfstudy.vocabulary import find_coverage_content_type

CF_AND_ACDD_CONVENTIONS = "CF-1.11, ACDD-1.3"
_COMMENT_ON_SCALES_OF_RIG = (
    " sigma_star, slip_distance and reference_velocity are the scales of each cell."
)
#: Names of the root attributes that users can set with environment variables. For example, the
#: variable ``RSFSTUDY_LICENSE`` sets the attribute ``license``.
_ROOT_ATTRIBUTES_FROM_ENV_VARIABLES = (
    "creator_name",
    "creator_email",
    "institution",
    "license",
    "acknowledgement",
)


def assemble_study_dataset(
    study: Study,
    coordinates: Mapping[Any, Any],
    cell_arrays: CellResultArrays,
    provenance: Mapping[str, Any],
) -> xr.Dataset:
    """Assemble the dataset of a study.

    Parameters
    ----------
    study : Study
        Study whose cells are assembled.
    coordinates : mapping of str to tuple or xarray.Variable
        Coordinates of the lattice (see ``LatticeCoordinatesBuilder``).
    cell_arrays : CellResultArrays
        Columns of all cells, in row-major order.
    provenance : mapping of str to object
        Provenance of the run, as plain data (see ``execution.provenance.collect_provenance``).

    Returns
    -------
    xarray.Dataset
        Dataset with one value per cell and output, before any reductions.
    """
    dataset = xr.Dataset(build_lattice_variables(study, cell_arrays, study.shape), coordinates)
    known = int((cell_arrays.statuses != int(Status.PENDING)).sum())
    return dataset.assign_attrs(build_root_attributes(study, known, provenance))


def build_lattice_variables(
    study: Study, cell_arrays: CellResultArrays, block_shape: tuple[int, ...]
) -> dict[Any, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Build the dataset variables for a block of cells.

    The variables include all outputs of the measure. The variables also include the status, the
    message, the wall time and the number of right-hand-side evaluations of each cell.

    Parameters
    ----------
    study : Study
        Study to which the cells belong.
    cell_arrays : CellResultArrays
        Columns of the cells in the block, in row-major order.
    block_shape : tuple of int
        Shape of the block.

    Returns
    -------
    dict of str to tuple
        Dimensions, values and attributes of each variable.
    """
    layout, dims, own = (
        CellOutputPacker(study.measure),
        study.dimensions,
        study.quantities_not_in_vocabulary,
    )
    described = {}
    for name, inner in study.measure.variables.items():
        values = cell_arrays.packed_outputs[:, layout.slices[name]].reshape(
            block_shape + layout.shapes[name]
        )
        described[name] = ((*dims, *inner), values, build_variable_attributes(name, own))
    kept = {
        "status": cell_arrays.statuses,
        "rhs_evaluations": cell_arrays.rhs_evaluations,
        "wall_time": cell_arrays.wall_times,
        "message": cell_arrays.messages,
    }
    for name, values in kept.items():
        described[name] = (dims, values.reshape(block_shape), build_variable_attributes(name, {}))
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


def build_root_attributes(
    study: Study, finished_cell_count: int, provenance: Mapping[str, Any]
) -> dict[str, Any]:
    """Build the root attributes of a dataset.

    The attributes follow the CF and ACDD conventions. Two attributes contain the declaration of the
    study and the provenance of the run as JSON.

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
        "comment": COMMENT_ON_UNITS_AND_SCALES + _COMMENT_ON_SCALES_OF_RIG * bool(study.rig),
        "Conventions": CF_AND_ACDD_CONVENTIONS,
        "project": "rsfstudy",
        "naming_authority": "rsfstudy",
        "processing_level": "numerical model results and reductions",
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
            for name in _ROOT_ATTRIBUTES_FROM_ENV_VARIABLES
        },
    }
    # The command line and environment variables may contain bytes that are not valid text.
    plain = {name: text.encode(errors="backslashreplace").decode() for name, text in texts.items()}
    return {**plain, "layout": FILE_LAYOUT_VERSION}
