"""Compares one results dataset with another, and finds a cell by its place on the axes."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.declare.wording import listed
from rsfstudy.errors import InvalidValue
from rsfstudy.files.contents import provenance
from rsfstudy.status import Status
from rsfstudy.vocabulary import MEASURED_TIMES

_COLUMNS = ["variable", "values", "identical", "largest_difference", "beyond_errors"]


def compared(theirs: xr.Dataset, ours: xr.Dataset) -> pd.DataFrame:
    """How two datasets of one study agree, variable by variable, in the cells that both have.

    Returns
    -------
    pandas.DataFrame
        ``variable``, ``values``, ``identical``, ``largest_difference`` and ``beyond_errors``, how
        many differ by more than the sum of both error estimates, NaN where there are none; in
        ``attrs["differs"]`` what decides a number and differs between them. Measured times, which
        no two runs share, are left out.
    """
    pending = [d["status"] == int(Status.PENDING) for d in (theirs, ours)]
    both = ~(pending[0] | pending[1])
    rows = []
    for name in theirs.data_vars:
        if name in MEASURED_TIMES:
            continue
        if name not in ours or not _comparable(theirs[name], ours[name]):
            missing = dict.fromkeys(("largest_difference", "beyond_errors"), np.nan)
            rows.append({"variable": name, "values": theirs[name].size, "identical": 0, **missing})
            continue
        a, b = theirs[name], ours[name]
        known = np.broadcast_to(True, a.shape)
        if set(both.dims) <= set(a.dims):
            known = np.asarray(both.broadcast_like(a).transpose(*a.dims))
        elif not bool(both.all()):
            continue  # a reduction that draws on cells missing in one of them
        e = f"{name}_error"
        beside = [d[e].values for d in (theirs, ours) if e in d and d[e].dims == a.dims]
        errors = [values[known] for values in beside if values.shape == known.shape]
        rows.append({"variable": name, **_agreement(a.values[known], b.values[known], errors)})
    frame = pd.DataFrame(rows, columns=_COLUMNS)
    frame.attrs["differs"] = differences(*(provenance(d)["fingerprint"] for d in (theirs, ours)))
    return frame


def _comparable(theirs: xr.DataArray, ours: xr.DataArray) -> bool:
    """Whether two variables have the same shape, and both or neither hold real numbers."""
    return theirs.shape == ours.shape and (theirs.dtype.kind == "f") == (ours.dtype.kind == "f")


def _agreement(
    theirs: np.ndarray, ours: np.ndarray, errors: Sequence[np.ndarray]
) -> dict[str, Any]:
    """How two arrays of values agree; their error estimates are none, or one for each."""
    if theirs.dtype.kind != "f":
        same, largest = np.asarray(theirs == ours), np.nan
    else:
        same = (theirs == ours) | (np.isnan(theirs) & np.isnan(ours))
        largest = float(np.max(gap)) if (gap := np.abs(theirs - ours)[~same]).size else 0.0
    beyond = np.nan
    if len(errors) == 2:
        # a number that one of them lacks, or whose error is unknown, is beyond any estimate
        beyond = int((~same & ~(np.abs(theirs - ours) <= errors[0] + errors[1])).sum())
    return dict(zip(_COLUMNS[1:], (same.size, int(same.sum()), largest, beyond), strict=True))


def differences(theirs: Mapping[str, Any], ours: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """Entries in which two fingerprints differ: theirs and ours, by name. Either may come from a
    file.
    """
    theirs, ours = (json.loads(json.dumps(fingerprint)) for fingerprint in (theirs, ours))
    return {
        name: (theirs.get(name), ours.get(name))
        for name in sorted({*theirs, *ours})
        if theirs.get(name) != ours.get(name)
    }


def cell_number(dataset: xr.Dataset, place: Mapping[str, Any]) -> int:
    """The number of the cell at a place, in row-major order.

    Raises
    ------
    InvalidValue
        Where the place names no dimension, leaves one out, or is not on its axis.
    """
    status = dataset["status"]
    for name in place:
        if name not in status.dims:
            raise InvalidValue("cell", name, "is no axis", choices=[str(d) for d in status.dims])
    index = []
    for dimension in map(str, status.dims):
        values = dataset[dimension].values
        if dimension not in place:
            if values.size > 1:
                rule = f"leaves {dimension} open"
                remedy = (
                    f"Name one value of each axis (--cell is repeated). {dimension} has "
                    f"{listed(values.tolist(), ', ')}."
                )
                raise InvalidValue("cell", dict(place), rule, remedy=remedy)
            index.append(0)
            continue
        number = _on_axis(values, place[dimension])
        if number is None:
            rule = "is not on its axis"
            raise InvalidValue(dimension, place[dimension], rule, choices=map(str, values))
        index.append(number)
    return int(np.ravel_multi_index(index, status.shape))


def _on_axis(values: np.ndarray, wanted: Any) -> int | None:
    """Index of a value on an axis: an equal label, or the nearest number if it is close enough."""
    if values.dtype.kind in "iuf":
        try:
            number = float({"true": 1.0, "false": 0.0}.get(str(wanted).lower(), wanted))
        except (TypeError, ValueError):
            return None
        if not math.isfinite(number):
            return None
        gaps = np.abs(values - number)
        nearest = int(np.argmin(gaps))
        return nearest if gaps[nearest] <= 1e-5 * abs(number) else None
    places = np.flatnonzero(values.astype(object).astype(str) == str(wanted))
    return int(places[0]) if places.size else None
