"""Encoding of datasets for NetCDF files that follow the CF conventions."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import xarray as xr


def fill_value_encoding(dataset: xr.Dataset) -> dict[Hashable, dict[str, Any]]:
    """Return an encoding without fill values for coordinates, flags and counts.

    xarray writes ``_FillValue = NaN`` for every variable of floats. The CF conventions forbid the
    attribute on coordinates, and on integers it would turn them into floats when they are read.
    """
    return {
        name: {"_FillValue": None}
        for name, variable in dataset.variables.items()
        if name in dataset.coords or variable.dtype.kind in "iu"
    }


def with_cf_encoding(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset that ``to_netcdf`` writes without fill values on coordinates and flags.

    The encoding travels with the variables, so that selections and renamed copies keep it.
    """
    encoded = dataset.copy()
    for name, encoding in fill_value_encoding(encoded).items():
        encoded[name].encoding.update(encoding)
    return encoded
