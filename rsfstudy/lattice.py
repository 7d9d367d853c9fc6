"""From outcomes of cells to one self-describing dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.measures import Outcome
from rsfstudy.scene import FIELDS, Scene
from rsfstudy.status import Status
from rsfstudy.study import Study
from rsfstudy.vocabulary import DERIVED, quantity

CONVENTIONS = "CF-1.11, ACDD-1.3"


def assemble(
    study: Study,
    scenes: Sequence[Scene],
    outcomes: Mapping[int, tuple[Outcome, float]],
    provenance: Mapping[str, Any],
) -> xr.Dataset:
    """The lattice of a study.

    Parameters
    ----------
    study : Study
    scenes : sequence of Scene
        The scene of each cell, in row-major order.
    outcomes : mapping of int to (Outcome, float)
        Outcome and wall time in s by cell number; cells that are missing are `pending`.
    provenance : mapping
        What else decided the numbers, as plain data.
    """
    dataset = xr.Dataset(coords=_coordinates(study, scenes))
    dims, shape = study.dimensions, study.shape
    for name, inner in study.measure.variables.items():
        inner_shape = tuple(len(study.measure.inner_coordinates[d]) for d in inner)
        values = np.full((study.size, *inner_shape), np.nan)
        for cell, (outcome, _wall) in outcomes.items():
            values[cell] = outcome.values.get(name, np.nan)
        dataset[name] = ((*dims, *inner), values.reshape(*shape, *inner_shape), _about(name))
    for name, values in _bookkeeping(study.size, outcomes).items():
        dataset[name] = (dims, values.reshape(shape), _about(name))
    dataset["status"].attrs |= {
        "flag_values": np.array([int(s) for s in Status], dtype=np.int8),
        "flag_meanings": " ".join(s.label for s in Status),
        "comment": "; ".join(f"{s.label}: {s.meaning}" for s in Status),
    }
    for name in study.measure.variables:
        companions = [n for n in (f"{name}_error", "status") if n in dataset and n != name]
        dataset[name].attrs["ancillary_variables"] = " ".join(companions)
    dataset.attrs = _attributes(study, outcomes, provenance)
    return dataset


def _coordinates(study: Study, scenes: Sequence[Scene]) -> dict[str, Any]:
    """Dimension coordinates, what follows from them, and the fixed values as scalars."""
    strides = np.cumprod([1, *study.shape[::-1]])[::-1][1:]
    coords: dict[str, Any] = {}
    for axis, stride in zip(study.axes, strides, strict=True):
        along = scenes[: int(stride) * len(axis) : int(stride)]
        if axis.labels is not None:
            about = {"long_name": axis.dimension.replace("_", " ")}
            coords[axis.dimension] = (axis.dimension, np.array(axis.labels, dtype=object), about)
        for name in axis.fields:
            # a plain axis bears its own values, even where a first cell has no use for them
            own = [row[name] for row in axis.rows] if axis.labels is None else None
            varied = _array(own or [getattr(scene, name) for scene in along])
            coords[name] = (axis.dimension, varied, _about(name))
    for name in FIELDS:
        present = {getattr(scene, name) for scene in scenes} - {None}
        if name not in coords and len(present) == 1:
            coords[name] = ((), _array([present.pop()])[0], _about(name))
    for name, (source, formula) in DERIVED.items():
        if source in coords:
            dims, values, _attrs = coords[source]
            derived = [formula(value) for value in np.ravel(values).tolist()]
            coords[name] = (dims, np.reshape(derived, np.shape(values)), _about(name))
    for name, values in study.measure.inner_coordinates.items():
        coords[name] = (name, values, _about(name))
    return coords


def _array(values: list[Any]) -> np.ndarray:
    """Values of one field as NetCDF can hold them: text, flags as int8, numbers with NaN for
    none.
    """
    if isinstance(values[0], str):
        return np.array(values, dtype=object)
    if isinstance(values[0], bool):
        return np.array(values, dtype=np.int8)
    return np.array([np.nan if value is None else value for value in values], dtype=float)


def _bookkeeping(size: int, outcomes: Mapping[int, tuple[Outcome, float]]) -> dict[str, np.ndarray]:
    status = np.full(size, int(Status.PENDING), dtype=np.int8)
    work = np.zeros(size, dtype=np.int32)
    wall = np.full(size, np.nan)
    message = np.full(size, "", dtype=object)
    for cell, (outcome, seconds) in outcomes.items():
        status[cell], work[cell] = int(outcome.status), outcome.rhs_evaluations
        wall[cell], message[cell] = seconds, outcome.message
    return {"status": status, "rhs_evaluations": work, "wall_time": wall, "message": message}


def _about(name: str) -> dict[str, Any]:
    about = quantity(name)
    attrs: dict[str, Any] = {"long_name": about.long_name}
    if about.units:
        attrs["units"] = about.units
    if about.scale:
        attrs["scale"] = about.scale
    if name == "inertia":
        attrs |= {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "false true"}
    return attrs


def _attributes(
    study: Study,
    outcomes: Mapping[int, tuple[Outcome, float]],
    provenance: Mapping[str, Any],
) -> dict[str, Any]:
    done = len(outcomes)
    complete = done == study.size
    when, version = provenance["time"], provenance["versions"]["rsfstudy"]
    return {
        "title": study.title,
        "summary": study.summary or study.title,
        "keywords": "rate and state friction, spring-slider, stability, stick-slip",
        "Conventions": CONVENTIONS,
        "id": study.name,
        "source": f"rsfstudy {version}, numerical model of a spring-slider",
        "history": f"{when} {provenance['command']}",
        "references": "; ".join(study.references) or "none",
        "date_created": when,
        "product_version": str(study.version),
        "completeness": "complete" if complete else f"partial: {done} of {study.size} cells",
        "declaration": json.dumps(study.describe()),
        "provenance": json.dumps(dict(provenance)),
    }
