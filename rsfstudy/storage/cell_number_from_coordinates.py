"""Function that finds the number of a cell from the coordinates of the cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_abbreviated_list


def find_cell_number(dataset: xr.Dataset, coordinate_values: Mapping[str, Any]) -> int:
    """Find the number of a cell from its coordinates.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    coordinate_values : mapping of str to object
        Coordinate of the cell on each dimension. Dimensions with a single point can be omitted. A
        number selects the nearest point of the axis. The relative difference between the number and
        this point must not exceed 1e-5.

    Returns
    -------
    int
        Number of the cell in row-major order.

    Raises
    ------
    InvalidValue
        If a dimension is unknown or missing, or if a value is not a point of its axis.
    """
    status = dataset["status"]
    for name in coordinate_values:
        if name not in status.dims:
            raise InvalidValue("cell", name, "is no axis", choices=[str(d) for d in status.dims])
    index = []
    for dimension in map(str, status.dims):
        values = dataset[dimension].values
        if dimension not in coordinate_values:
            if values.size > 1:
                rule = f"must contain a value of {dimension}"
                remedy = (
                    f"Pass one value for each axis (repeat --cell). The values of {dimension} are "
                    f"{format_abbreviated_list(values.tolist(), ', ')}."
                )
                raise InvalidValue("cell", dict(coordinate_values), rule, remedy=remedy)
            index.append(0)
            continue
        number = _find_index_on_axis(values, coordinate_values[dimension])
        if number is None:
            rule = "is not a point of its axis"
            raise InvalidValue(
                dimension, coordinate_values[dimension], rule, choices=map(str, values)
            )
        index.append(number)
    return int(np.ravel_multi_index(index, status.shape))


def _find_index_on_axis(axis_values: np.ndarray, wanted_value: Any) -> int | None:
    """Find the index of the axis point with a given label or number.

    A number selects the axis point with the nearest value. The relative difference between the two
    numbers must not exceed 1e-5.
    """
    if axis_values.dtype.kind in "iuf":
        try:
            number = float({"true": 1.0, "false": 0.0}.get(str(wanted_value).lower(), wanted_value))
        except (TypeError, ValueError):
            return None
        nearest = int(np.argmin(np.abs(axis_values - number)))
        return nearest if math.isclose(axis_values[nearest], number, rel_tol=1e-5) else None
    places = np.flatnonzero(axis_values.astype(object).astype(str) == str(wanted_value))
    return int(places[0]) if places.size else None
