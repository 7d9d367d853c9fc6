"""NetCDF files: written beside, read back, compared, and only then put in place."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError


def write(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset so that `path` holds the old file or the whole new one, whatever happens.

    A reader that has the old file open keeps its data.

    Raises
    ------
    DataError
        If the directory cannot be written, or what is read back differs from what was written.
    """
    clean = clean_attributes(dataset)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=".nc", dir=path.parent)
    except OSError as error:
        raise DataError(
            f"cannot write {path}: {error.strerror}. Choose another --output."
        ) from error
    os.close(handle)
    beside = Path(name)
    try:
        clean.to_netcdf(beside, engine="netcdf4", format="NETCDF4", encoding=_encoding(clean))
        with xr.open_dataset(beside, engine="netcdf4") as back:
            if not clean.identical(back.load()):
                raise DataError(f"{path} was not written: what was read back differs.")
        with open(beside, "rb") as file:
            os.fsync(file.fileno())
        beside.chmod(0o666 & ~_umask())
        os.replace(beside, path)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error}. Nothing was replaced.") from error
    finally:
        beside.unlink(missing_ok=True)


def read(path: Path) -> xr.Dataset:
    """Load a results file into memory and close it.

    Raises
    ------
    DataError
        If it is missing, no NetCDF file, or not written by rsfstudy.
    """
    if not path.is_file():
        raise DataError(f"{path} does not exist. Run the study first, or name another file.")
    try:
        dataset = xr.load_dataset(path, engine="netcdf4")
    except (OSError, ValueError) as error:
        raise DataError(f"{path} cannot be read as NetCDF: {error}") from error
    declaration(dataset, str(path))
    return dataset


def declaration(dataset: xr.Dataset, where: str = "the dataset") -> dict[str, Any]:
    """The study declaration a dataset carries, as plain data.

    Raises
    ------
    DataError
        If it carries none.
    """
    try:
        found = json.loads(dataset.attrs["declaration"])
    except (KeyError, TypeError, ValueError) as error:
        raise DataError(
            f"{where} carries no study declaration: it was not written by rsfstudy, or damaged."
        ) from error
    if not isinstance(found, dict) or not {"name", "claims", "plot"} <= set(found):
        raise DataError(f"{where} carries a study declaration that is damaged.")
    return found


def clean_attributes(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with attributes NetCDF holds without changing them: text, numbers, arrays of more
    than one.
    """
    clean = dataset.copy()
    clean.attrs = _clean(dataset.attrs)
    for name in clean.variables:
        clean[name].attrs = _clean(dataset[name].attrs)
    return clean


def _clean(attrs: Mapping[Any, Any]) -> dict[str, Any]:
    return {str(name): _plain(value) for name, value in attrs.items() if value is not None}


def _plain(value: Any) -> Any:
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, dict):
        return json.dumps(value)
    if isinstance(value, list | tuple | np.ndarray):
        values = np.asarray(value)
        return values if values.size > 1 else _plain(values.item()) if values.size else ""
    return value


def _encoding(dataset: xr.Dataset) -> dict[Any, dict[str, Any]]:
    """No fill values on coordinates and flags, where they would mean that data are missing."""
    plain: dict[Any, dict[str, Any]] = {name: {"_FillValue": None} for name in dataset.coords}
    for name, values in dataset.data_vars.items():
        if values.dtype.kind in "iu":
            plain[name] = {"_FillValue": None}
    return plain


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
