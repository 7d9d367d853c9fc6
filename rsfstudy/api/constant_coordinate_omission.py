"""Function that simplifies datasets for plotting and tabulating with plain xarray."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.quantities import replace_comment_on_scales

#: Attribute of a simplified dataset with the values of the omitted coordinates as JSON.
CONSTANT_COORDINATES_ATTRIBUTE = "constants"
_COMMENT_ON_SIMPLIFIED_UNITS = (
    "Variables have the units in their attributes. For dimensionless variables, the units are the "
    "scale: sigma_* for stress, D_c for slip, D_c/V_* for time, V_* for slip rate. Pure numbers "
    "have no units."
)


def omit_constants_and_simplify_units(dataset: xr.Dataset) -> xr.Dataset:
    """Omit constant coordinates, and replace unit attributes by readable units.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a dataset of one scene.

    Returns
    -------
    xarray.Dataset
        Dataset as returned by ``DatasetAccessor.simplify``.
    """
    constants: dict[str, Any] = {}
    for name, values in dataset.coords.items():
        # A coordinate of a dimension with several points is needed to select the points.
        if (values.ndim == 0 or name not in dataset.dims) and _is_constant_coordinate(values):
            constants[str(name)] = _read_constant_coordinate_value(values)
    # The copy has variables of its own, so that their attributes can be replaced.
    simple = dataset.drop_vars(list(constants)).copy()
    for name in simple.variables:
        simple[name].attrs = _use_scale_attribute_as_units(dataset[name].attrs)
    simple.attrs = replace_comment_on_scales(dataset.attrs, _COMMENT_ON_SIMPLIFIED_UNITS)
    return simple.assign_attrs({CONSTANT_COORDINATES_ATTRIBUTE: json.dumps(constants)})


def _is_constant_coordinate(coordinate: xr.DataArray) -> bool:
    """Return True if all values of a coordinate are equal or all are missing."""
    return bool(coordinate.size) and len(np.unique(coordinate.values.astype(str))) == 1


def _read_constant_coordinate_value(coordinate: xr.DataArray) -> Any:
    """Return the value of a constant coordinate as a number, a string or a boolean."""
    value = coordinate.values.flat[0]
    plain = value.item() if hasattr(value, "item") else value
    missing = isinstance(plain, float) and not np.isfinite(plain)
    return None if missing else plain if isinstance(plain, int | float | str) else str(plain)


def _use_scale_attribute_as_units(attributes: dict[Any, Any]) -> dict[Any, Any]:
    """Return the attributes of a variable with readable units.

    If a variable is normalised, the ``units`` attribute is set to the scale of the variable. For a
    dimensionless variable without a scale, the ``units`` attribute is omitted.
    """
    replaced = {name: value for name, value in attributes.items() if name != "scale"}
    if replaced.get("units") == "1":
        del replaced["units"]
        if scale := attributes.get("scale"):
            replaced["units"] = scale
    return replaced
