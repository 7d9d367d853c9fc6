"""Functions that choose the NetCDF encoding of datasets according to the CF conventions."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import xarray as xr


def build_encoding_without_fill_values(dataset: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    """Return an encoding that omits unwanted fill values.

    Coordinates, flags and counts are written without the attribute ``_FillValue``.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to write.

    Returns
    -------
    dict
        Encoding by variable name, for ``xarray.Dataset.to_netcdf``.

    Notes
    -----
    xarray writes ``_FillValue = NaN`` for every floating-point variable. The CF conventions do not
    allow the attribute on coordinates. If an integer variable has the attribute, xarray converts
    the variable to floats when reading the file.
    """
    return {
        name: {"_FillValue": None}
        for name, variable in dataset.variables.items()
        if name in dataset.coords or variable.dtype.kind in "iu"
    }


def copy_with_cf_encoding(dataset: xr.Dataset) -> xr.Dataset:
    """Return a copy of a dataset whose encoding omits unwanted fill values.

    The method ``to_netcdf`` of the copy writes no fill values for coordinates, flags and counts.
    The encoding is stored with the variables, so selections and renamed copies of the dataset keep
    the encoding.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to copy.

    Returns
    -------
    xarray.Dataset
        Copy with the updated encoding.
    """
    encoded = dataset.copy()
    for name, encoding in build_encoding_without_fill_values(encoded).items():
        encoded[name].encoding.update(encoding)
    return encoded
