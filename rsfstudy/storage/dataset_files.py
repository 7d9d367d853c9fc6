"""Functions that read and write results files.

A NetCDF file is written under a temporary name, read back and compared with the dataset. The file
is renamed only if the contents are identical. Each NetCDF file ends with a digest of all preceding
bytes. HDF5 ignores this digest. When a file is read, the digest is checked before HDF5 opens the
file, because HDF5 may hang if the file is damaged. The digest at the end is missing if another
program saved the file or if the file was truncated. In this case, the file is checked against the
digest of its contents (see ``content_digest``).
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dask
import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, RsfStudyError, RsfStudyWarning, shorten_text
from rsfstudy.exception_conversion import find_stacklevel_of_user_code
from rsfstudy.former_data_names import rename_former_variables
from rsfstudy.netcdf_encoding import build_encoding_without_fill_values, copy_with_cf_encoding
from rsfstudy.path_checks import check_path_is_valid
from rsfstudy.storage import content_digest, schema
from rsfstudy.storage.attribute_checks import (
    check_motion_variables_are_numeric,
    check_variable_attributes,
)
from rsfstudy.storage.schema import FILE_LAYOUT_VERSION

#: Options for opening a Zarr store lazily. Only version 3 of the Zarr format is supported.
ZARR_OPEN_OPTIONS: Mapping[str, Any] = {
    "engine": "zarr",
    "chunks": None,
    "consolidated": False,
    "cache": False,
    "zarr_format": 3,
}
#: Names of the codecs that a Zarr store may use. A store with any other codec is rejected, because
#: the codec could run arbitrary code.
_ALLOWED_ZARR_CODECS = {"bytes", "vlen-utf8", "zstd"}
_PREFIX_OF_DIGEST_AT_FILE_END = b"\nrsfstudy sha256 "
_LENGTH_OF_DIGEST_AT_FILE_END = len(_PREFIX_OF_DIGEST_AT_FILE_END) + 64
_ZARR_DIGEST_ATTRIBUTE = "digest"


def write_dataset(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Write a dataset to a NetCDF file.

    At any time, the file at ``path`` is either the old file or the complete new file. A program
    that has opened the old file can continue to read the old data. If a process is killed while it
    writes the temporary file, the temporary file remains until the next write overwrites it.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to write.
    path : Path
        Path of the file. Missing directories are created.

    Returns
    -------
    xarray.Dataset
        Dataset with the same attributes as in the file. The entry ``encoding["source"]`` is the
        path of the file.

    Raises
    ------
    DataError
        If the file cannot be written, or if the data in the written file differ from the dataset.
    """
    clean = convert_attributes_for_netcdf(
        dataset.assign_attrs({"layout": FILE_LAYOUT_VERSION, **dataset.attrs})
    )
    clean.attrs.pop(content_digest.CONTENT_DIGEST_ATTRIBUTE, None)
    digest = {content_digest.CONTENT_DIGEST_ATTRIBUTE: content_digest.compute_content_digest(clean)}
    stored = clean.assign_attrs(digest)
    beside = path.with_name(f".{path.name}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.unlink(missing_ok=True)  # Writing through an existing link would change its target.
        # With a Dask client, xarray would wait for a lock of the cluster, possibly forever.
        how: dict[str, Any] = {"engine": "netcdf4", "format": "NETCDF4"}
        with dask.config.set(scheduler="synchronous"), warnings.catch_warnings():
            # Older versions of Dask warn that the client is not used, which is intended here.
            warnings.filterwarnings("ignore", "Running on a single-machine scheduler", UserWarning)
            stored.to_netcdf(beside, **how, encoding=build_encoding_without_fill_values(clean))
        with open(beside, "ab") as file:
            file.write(
                _PREFIX_OF_DIGEST_AT_FILE_END
                + _hash_first_bytes_of_file(beside, beside.stat().st_size)
            )
        with xr.open_dataset(beside, engine="netcdf4") as back:
            if not stored.identical(back.load()):
                raise DataError(
                    f"{path} was not written, because the stored data differ from the computed "
                    "data. Run the command again."
                )
        with open(beside, "rb") as file:
            os.fsync(file.fileno())
        os.replace(beside, path)
    except (OSError, RuntimeError) as error:
        # HDF5 reports a full disk as a RuntimeError.
        raise DataError(
            f"cannot write {path}: {error}. No file was replaced. Free some disk space, or choose "
            "another --output."
        ) from error
    finally:
        # The error above has already reported an invalid directory.
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)
    clean.encoding["source"] = str(path)
    return clean


def _hash_first_bytes_of_file(path: Path, byte_count: int) -> bytes:
    """Compute the SHA-256 digest of the first bytes of a file."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while byte_count > 0 and (part := file.read(min(byte_count, 2**20))):
            digest.update(part)
            byte_count -= len(part)
    return digest.hexdigest().encode()


def open_zarr_store(path: Path) -> xr.Dataset:
    """Open a Zarr store lazily.

    Zarr stores attributes as JSON, and JSON does not distinguish numeric types. The function
    therefore converts the flag values of each variable to the dtype of the variable. The function
    also removes the dtype of string variables from their encoding, because older versions of xarray
    cannot write this dtype to a NetCDF file.

    Parameters
    ----------
    path : Path
        Directory of the store.

    Returns
    -------
    xarray.Dataset
        Contents of the store.
    """
    dataset = xr.open_dataset(path, **ZARR_OPEN_OPTIONS)
    for variable in dataset.variables.values():
        if getattr(variable.encoding.get("dtype"), "kind", "") == "T":
            del variable.encoding["dtype"]
        if "flag_values" in variable.attrs:
            flags = np.asarray(variable.attrs["flag_values"], dtype=variable.dtype)
            variable.attrs["flag_values"] = flags
    return dataset


def write_zarr_store_digest(store: Path) -> None:
    """Store a digest of all files of a Zarr store in the attributes of the store.

    Parameters
    ----------
    store : Path
        Directory of the store.
    """
    root = store / "zarr.json"
    about = json.loads(root.read_text())
    about["attributes"][_ZARR_DIGEST_ATTRIBUTE] = _hash_zarr_store(store)
    root.write_text(json.dumps(about, indent=2))


def _hash_zarr_store(store: Path) -> str:
    """Compute the digest of all files of a Zarr store.

    The root attribute that contains the digest is not included.
    """
    digest = hashlib.sha256()
    for file in sorted(file for file in store.rglob("*") if file.is_file()):
        content = file.read_bytes()
        if file == store / "zarr.json":
            about = json.loads(content)
            about["attributes"].pop(_ZARR_DIGEST_ATTRIBUTE, None)
            content = json.dumps(about, sort_keys=True).encode()
        digest.update(f"{file.relative_to(store)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _check_zarr_store_digest(path: Path) -> bool:
    """Check a Zarr store against its digest.

    If the store has no digest, the function returns False.
    """
    attributes = json.loads((path / "zarr.json").read_text())["attributes"]
    if _ZARR_DIGEST_ATTRIBUTE in attributes and attributes[
        _ZARR_DIGEST_ATTRIBUTE
    ] != _hash_zarr_store(path):
        raise DataError(
            f"{path} is damaged or was edited, because its files do not match the digest."
        )
    return _ZARR_DIGEST_ATTRIBUTE in attributes


def _check_digest_at_file_end(path: Path) -> bool:
    """Check a file against the digest that is stored at the end of the file.

    If the file has no digest at its end, the function returns False.
    """
    size = path.stat().st_size - _LENGTH_OF_DIGEST_AT_FILE_END
    with open(path, "rb") as file:
        file.seek(max(0, size))
        trailer = file.read()
    if not trailer.startswith(_PREFIX_OF_DIGEST_AT_FILE_END):
        return False
    if trailer != _PREFIX_OF_DIGEST_AT_FILE_END + _hash_first_bytes_of_file(path, size):
        raise DataError(
            f"{path} is damaged or was edited, because its contents do not match the digest."
        )
    return True


def read_dataset(path: Path, *, allow_tables: bool = False) -> xr.Dataset:
    """Read a results file, or a dataset of a single scene.

    A NetCDF file is loaded into memory and closed. A Zarr store is opened lazily.

    Parameters
    ----------
    path : Path
        NetCDF file, or directory of a Zarr store.
    allow_tables : bool, default: False
        If True, the file may also contain a table of holds, events or steps.

    Returns
    -------
    xarray.Dataset
        Contents of the file or store.

    Raises
    ------
    DataError
        If the file does not exist, cannot be read, is damaged, or was not written by rsfstudy, or
        if the file contains a table and ``allow_tables`` is False.

    Warns
    -----
    RsfStudyWarning
        If the file has the digest of its contents, but no digest of all bytes, because another
        program read the file and saved it again. Datasets in memory have no digest, so no warning
        is issued if a dataset from rsfstudy was saved with ``to_netcdf``.
    """
    where = shorten_text(path)
    try:
        _check_is_file_or_zarr_store(path, where)
        if path.is_dir():
            _check_zarr_codecs(path)
            sealed = _check_zarr_store_digest(path)
            dataset = open_zarr_store(path)
        else:
            sealed = _check_digest_at_file_end(path)
            dataset = xr.load_dataset(path, engine="netcdf4")
            if not sealed:
                content_digest.check_content_digest(dataset, where)
        was_saved_again = not sealed and content_digest.CONTENT_DIGEST_ATTRIBUTE in dataset.attrs
        dataset.attrs.pop(content_digest.CONTENT_DIGEST_ATTRIBUTE, None)
    except RsfStudyError:
        raise
    except Exception as error:  # HDF5, Zarr and xarray raise errors of many types.
        raise DataError(f"{where} cannot be read: {shorten_text(error)}") from error
    dataset = rename_former_variables(copy_with_cf_encoding(dataset))
    try:
        check_variable_attributes(dataset)
        if schema.is_of_single_scene(dataset):
            check_motion_variables_are_numeric(dataset)
            return dataset  # Users save motions with xarray, which writes no digest.
        if contents := schema.describe_table_contents(dataset):
            if not allow_tables:
                raise DataError(
                    f"the file contains {contents}, not the results of a study. Open the file with "
                    f"xarray.open_dataset, or print it with `rsfstudy show {where}`."
                )
            return dataset
        schema.check_results_dataset(dataset)
    except DataError as error:
        raise DataError(f"{where}: {error}") from error
    if was_saved_again:
        said = (
            f"{where} has no digest, because another program saved the file and may have changed it"
        )
        warnings.warn(said, RsfStudyWarning, stacklevel=find_stacklevel_of_user_code())
    return dataset


def _check_is_file_or_zarr_store(path: Path, file_description: str) -> None:
    """Raise ``DataError`` unless a path is a regular file or a Zarr store.

    The check is needed because opening a pipe could block forever.
    """
    check_path_is_valid("file", path)
    if not path.exists():
        raise DataError(
            f"{file_description} does not exist. Run the study first, or pass the path of another "
            "file."
        )
    if path.is_dir() and not (path / "zarr.json").is_file():
        raise DataError(f"{file_description} is a directory, but not a Zarr store.")
    for part in path.rglob("*") if path.is_dir() else [path]:
        if not (part.is_file() or part.is_dir()) or (part != path and part.is_symlink()):
            raise DataError(
                f"{shorten_text(part)} is a pipe, a device or a link, and not a regular file."
            )


def _check_zarr_codecs(path: Path) -> None:
    """Raise ``DataError`` if a Zarr store uses a codec that is not allowed."""
    for file in path.rglob("zarr.json"):
        about = json.loads(file.read_text())
        for codec in about.get("codecs", []):
            if codec["name"] not in _ALLOWED_ZARR_CODECS:
                raise DataError(
                    f"{path} was not written by rsfstudy: {file.parent.name} uses the codec "
                    f"{codec['name']!r}, which could run arbitrary code."
                )


def convert_attributes_for_netcdf(dataset: xr.Dataset) -> xr.Dataset:
    """Convert attributes to types that a NetCDF file preserves.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset whose attributes are converted.

    Returns
    -------
    xarray.Dataset
        Copy of the dataset with converted attributes. Boolean values become the strings "true" and
        "false". Dictionaries become JSON strings. Sequences become arrays, and sequences with one
        element become scalars. Attributes that are None are removed.
    """
    clean = dataset.copy()
    clean.attrs = _convert_attribute_mapping_for_netcdf(dataset.attrs)
    for name in clean.variables:
        clean[name].attrs = _convert_attribute_mapping_for_netcdf(dataset[name].attrs)
    return clean


def _convert_attribute_mapping_for_netcdf(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Convert a mapping of attributes, and omit attributes that are None."""
    return {
        str(name): _convert_attribute_value_for_netcdf(value)
        for name, value in attributes.items()
        if value is not None
    }


def _convert_attribute_value_for_netcdf(value: Any) -> Any:
    """Convert the value of an attribute to a type that NetCDF preserves."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, dict):
        return json.dumps(value)
    if isinstance(value, list | tuple | np.ndarray):
        values = np.asarray(value)
        return (
            values
            if values.size > 1
            else _convert_attribute_value_for_netcdf(values.item())
            if values.size
            else ""
        )
    return value
