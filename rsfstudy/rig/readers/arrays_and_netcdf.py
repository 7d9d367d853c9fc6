"""Readers that load tables from arrays in memory or from NetCDF files."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.fitting import RECORD_COLUMNS, Record
from rsfstudy.rig.readers.tables_from_files_or_objects import (
    LazyTable,
    TableSource,
    append_units_to_headings,
)
from rsfstudy.rig.table_columns import Column

_NETCDF_SIGNATURES = (b"CDF\x01", b"CDF\x02", b"CDF\x05", b"\x89HDF\r\n\x1a\n")


def is_mapping_or_dataframe(source: TableSource) -> bool:
    """Return True if the source is a mapping of arrays or a DataFrame.

    Parameters
    ----------
    source : TableSource
        Source.

    Returns
    -------
    bool
        True if the source is a mapping or a DataFrame.
    """
    return isinstance(source.path_or_object, Mapping | pd.DataFrame) and not is_xarray_dataset(
        source
    )


def read_mapping_or_dataframe(source: TableSource) -> LazyTable:
    """Build a table from a mapping of arrays or from a DataFrame.

    Parameters
    ----------
    source : TableSource
        Mapping of headings to arrays, or DataFrame. If no heading contains units, the arrays are in
        the default units.

    Returns
    -------
    LazyTable
        Table of the arrays.
    """
    keys = [*source.path_or_object]
    headings = [*map(str, keys)]
    has_units = any("(" in heading or "[" in heading for heading in headings)
    table = _build_table_of_mapping(source.path_or_object, keys, headings)
    return replace(
        table, columns_have_no_units=not has_units, headings_are_column_names=not has_units
    )


def is_xarray_dataset(source: TableSource) -> bool:
    """Return True if the source is an xarray Dataset.

    Parameters
    ----------
    source : TableSource
        Source.

    Returns
    -------
    bool
        True if the source is a Dataset.
    """
    return isinstance(source.path_or_object, xr.Dataset)


def read_xarray_dataset(source: TableSource) -> LazyTable:
    """Build a table from the variables and coordinates of an xarray Dataset.

    Parameters
    ----------
    source : TableSource
        Dataset. The units of variables are read from their attribute ``units``.

    Returns
    -------
    LazyTable
        Table of the one-dimensional variables.
    """
    return _build_table_of_dataset(source.path_or_object)


def is_netcdf_file(source: TableSource) -> bool:
    """Return True if the file is a NetCDF file.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file is a NetCDF file or another HDF5 file.
    """
    return source.first_bytes_of_file.startswith(_NETCDF_SIGNATURES)


def read_netcdf_file(source: TableSource) -> LazyTable:
    """Read the variables of a NetCDF file.

    Parameters
    ----------
    source : TableSource
        NetCDF file.

    Returns
    -------
    LazyTable
        Table of the one-dimensional variables.

    Raises
    ------
    DataError
        If the file is damaged, or if the file is compressed.
    """
    if source.file_bytes is not None:
        raise DataError(
            f"{source.path_or_object}: is a compressed NetCDF file. Decompress the file first."
        )
    try:
        with xr.open_dataset(source.path, engine="netcdf4", decode_times=False) as dataset:
            loaded = dataset.load()
    except Exception as error:  # The NetCDF library raises errors of many types.
        raise DataError(f"{source.path_or_object}: cannot be read as NetCDF ({error})") from error
    return _build_table_of_dataset(loaded)


def is_record_object(source: TableSource) -> bool:
    """Return True if the source is a ``Record``.

    Parameters
    ----------
    source : TableSource
        Source.

    Returns
    -------
    bool
        True if the source is a record.
    """
    return isinstance(source.path_or_object, Record)


def read_columns_of_record(source: TableSource) -> LazyTable:
    """Build a table from the columns of a ``Record``.

    Parameters
    ----------
    source : TableSource
        Record.

    Returns
    -------
    LazyTable
        Table of the columns, whose headings contain their units.
    """
    columns = source.path_or_object.columns
    units = {about.name: about.units for about in RECORD_COLUMNS}
    headings = append_units_to_headings([*columns], [units.get(name, "") for name in columns])
    return _build_table_of_mapping(columns, [*columns], headings)


def _build_table_of_dataset(dataset: xr.Dataset) -> LazyTable:
    names: list[Hashable] = [name for name, of in dataset.variables.items() if of.ndim == 1]
    units = [str(dataset[name].attrs.get("units", "")) for name in names]
    table = _build_table_of_mapping(
        dataset, names, append_units_to_headings([*map(str, names)], units)
    )
    return replace(table, columns_have_no_units=not any(units))


def _build_table_of_mapping(mapping: Any, keys: list[Any], headings: list[str]) -> LazyTable:
    """Build a table whose columns are the values of a mapping."""

    def load(index: int, quantity_name: str) -> Column:
        values, units = _convert_to_floats_and_units(quantity_name, mapping[keys[index]])
        if values.ndim != 1:
            raise InvalidValue(quantity_name, values.shape, "must have one dimension")
        return Column(values, units)

    return LazyTable(headings, "record", load)


def _convert_to_floats_and_units(column_name: str, values: Any) -> tuple[np.ndarray, str]:
    """Convert an array to floats, and return the units implied by the type of the array.

    Masked values become NaN. Times are converted to seconds. Dates are converted to seconds since
    the first date.
    """
    kind = getattr(getattr(values, "dtype", None), "kind", "")
    if kind == "c":
        raise InvalidValue(column_name, values.dtype.name, "must be real numbers")
    if kind not in ("m", "M"):
        try:
            return np.ma.asarray(values, dtype=float).filled(math.nan), ""
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidValue(column_name, values, "must be a list of numbers") from error
    times = np.asarray(values, dtype=f"{'datetime' if kind == 'M' else 'timedelta'}64[ns]")
    first = times[:1] if times.ndim else times
    return (times - first if kind == "M" else times) / np.timedelta64(1, "s"), "s"
