"""NetCDF files: written under a temporary name, read back, compared, and only then renamed. They
carry digests, so that damage is noticed, and the damaged variable named.

A digest of all bytes is appended to the HDF5 file, where HDF5 ignores it. It is checked before HDF5
opens the file, because HDF5 may hang on damaged bytes. The digests of the variables are an
attribute, which stays with the dataset when a notebook saves it elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import dask
import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, brief
from rsfstudy.files import contents

#: Root attributes that verdicts and reruns depend on.
_SEALED = ("id", "title", "completeness", "declaration", "provenance", "reduced_despite")
#: Variables that every results file has. Those that a user added have no digests.
_OF_EVERY_LATTICE = ("status", "message", "rhs_evaluations", "wall_time")
_DIGESTS = "digests"
#: How Zarr stores are opened: lazily, and none of an older format.
ZARR: Mapping[str, Any] = {
    "engine": "zarr",
    "chunks": None,
    "consolidated": False,
    "cache": False,
    "zarr_format": 3,
}
#: Codecs of our Zarr stores. Any other might run code that the store names.
_CODECS = {"bytes", "vlen-utf8", "zstd"}
_MARK = b"\nrsfstudy sha256 "
_TRAILER = len(_MARK) + 64


class Digests:
    """Digests of the values of variables, each added whole or in consecutive pieces."""

    def __init__(self) -> None:
        self._of: dict[str, Any] = {}
        self._about: dict[str, str] = {}

    def add(self, dataset: xr.Dataset) -> None:
        """Add the values of each variable; if they come in pieces, in row-major order."""
        for name in dataset.variables:
            values = dataset[name].values
            digest = self._of.setdefault(str(name), hashlib.sha256())
            if values.dtype.kind in "OUST":
                digest.update("".join(f"{text}\0" for text in values.ravel().tolist()).encode())
            else:
                little = values.dtype.newbyteorder("<")
                digest.update(np.ascontiguousarray(values, dtype=little).tobytes())

    def describe(self, dataset: xr.Dataset) -> None:
        """Add the dimensions and attributes of each variable, as they are written."""
        for name, variable in dataset.variables.items():
            sizes = [[str(d), int(n)] for d, n in variable.sizes.items()]
            attrs = {str(key): np.asarray(v).tolist() for key, v in variable.attrs.items()}
            self._about[f"{name}()"] = json.dumps(sizes)
            self._about[f"{name}:"] = json.dumps(attrs, sort_keys=True)

    def sealing(self, dataset: xr.Dataset) -> xr.Dataset:
        """The dataset with these digests, and those of its root attributes, as an attribute."""
        return dataset.assign_attrs({_DIGESTS: json.dumps(self._all(dataset.attrs))})

    def _all(self, attrs: Mapping[Any, Any]) -> dict[str, str]:
        texts = {f":{name}": str(attrs[name]) for name in _SEALED if name in attrs} | self._about
        digests = self._of | {name: hashlib.sha256(t.encode()) for name, t in texts.items()}
        return {name: digest.hexdigest()[:16] for name, digest in digests.items()}

    def check(self, dataset: xr.Dataset, where: str) -> None:
        """Check a dataset against the digests it carries.

        Raises
        ------
        DataError
            Where it carries none, or a variable or attribute is missing or was changed; where it is
            of one scene.
        """
        contents.check_of_a_study(dataset, where)
        try:
            carried = dict(json.loads(dataset.attrs[_DIGESTS]))
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(
                f"{where} carries no digests: it was not written by rsfstudy, or damaged."
            ) from error
        ours = _digests_of(dataset)._all(dataset.attrs)
        for name in [n for n in ours if n.startswith(":") or n in _OF_EVERY_LATTICE]:
            carried.setdefault(name, "")
        for name, digest in carried.items():
            if ours.get(name) != digest:
                what = "missing" if name not in ours else "not what was written"
                raise DataError(
                    f"{where} is damaged, or was edited: {_named(name)} is {what}. "
                    "Run the study again; its finished cells are kept beside it."
                )


def _named(name: str) -> str:
    """A variable, an attribute of one, or a root attribute, as their digests are named."""
    if name.endswith("()"):
        return f"the shape of {name[:-2]!r}"
    if name.endswith(":"):
        return f"an attribute of {name[:-1]!r}"
    return f"the attribute {name[1:]!r}" if name.startswith(":") else repr(name)


def _digests_of(dataset: xr.Dataset) -> Digests:
    digests = Digests()
    digests.add(dataset)
    digests.describe(dataset)
    return digests


def sealed(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset as it is written: with attributes that NetCDF keeps unchanged, and digests."""
    clean = clean_attributes(dataset)
    return _digests_of(clean).sealing(clean)


def write(dataset: xr.Dataset, path: Path) -> xr.Dataset:
    """Write a dataset so that `path` always holds either the old file or the complete new one.

    A reader that has the old file open keeps its data. If a write is killed, the next one
    overwrites the temporary file it left.

    Returns
    -------
    xarray.Dataset
        The dataset as the file holds it; ``encoding["source"]`` says where.

    Raises
    ------
    DataError
        If the directory cannot be written, or what is read back differs from what was written.
    """
    clean = sealed(dataset)
    beside = path.with_name(f".{path.name}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _remove(beside)  # were it a link or a pipe, writing would go elsewhere
        # with a Dask client, xarray would wait for a lock of the cluster, perhaps for ever
        with dask.config.set(scheduler="synchronous"):
            clean.to_netcdf(beside, engine="netcdf4", format="NETCDF4", encoding=_encoding(clean))
        with open(beside, "ab") as file:
            file.write(_MARK + _digest_of_bytes(beside, beside.stat().st_size))
        with xr.open_dataset(beside, engine="netcdf4") as back:
            if not clean.identical(back.load()):
                raise DataError(f"{path} was not written: what was read back differs.")
        with open(beside, "rb") as file:
            os.fsync(file.fileno())
        os.replace(beside, path)
    except (OSError, RuntimeError) as error:
        # HDF5 reports a full disk as a RuntimeError
        raise DataError(
            f"cannot write {path}: {error}. Nothing was replaced; make room, or choose another "
            "--output."
        ) from error
    finally:
        _remove(beside)
    clean.encoding["source"] = str(path)
    return clean


def _digest_of_bytes(path: Path, size: int) -> bytes:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while size > 0 and (part := file.read(min(size, 2**20))):
            digest.update(part)
            size -= len(part)
    return digest.hexdigest().encode()


def _check_bytes(path: Path) -> None:
    """Check a file against the digest of its bytes, if one is appended to it."""
    size = path.stat().st_size - _TRAILER
    if size < 0:
        return
    with open(path, "rb") as file:
        file.seek(size)
        trailer = file.read()
    if trailer.startswith(_MARK) and trailer != _MARK + _digest_of_bytes(path, size):
        raise DataError(f"{path} is damaged, or was edited: its bytes are not what was written.")


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return  # its directory is not a directory; the error that is being raised says so


def read(path: Path) -> xr.Dataset:
    """Load a results file into memory and close it; a Zarr store is opened, not loaded.

    Raises
    ------
    DataError
        If it is missing, unreadable, not written by rsfstudy, or damaged.
    """
    where = brief(path)
    try:
        _check_there(path, where)
        if path.is_dir():
            _check_codecs(path)
            dataset = xr.open_dataset(path, **ZARR)
        else:
            _check_bytes(path)
            dataset = xr.load_dataset(path, engine="netcdf4")
        Digests().check(dataset, where)
    except DataError:
        raise
    except (
        Exception
    ) as error:  # HDF5, Zarr, netCDF4 and xarray raise almost anything on damaged data
        raise DataError(f"{where} cannot be read: {brief(error)}") from error
    try:
        contents.check(dataset)
    except DataError as error:
        raise DataError(f"{where}: {error}") from error
    return dataset


def _check_there(path: Path, where: str) -> None:
    """Refuse anything but a file or a Zarr store: opening a pipe could wait for ever."""
    if not path.exists():
        raise DataError(f"{where} does not exist. Run the study first, or name another file.")
    if path.is_dir() and not (path / "zarr.json").is_file():
        raise DataError(f"{where} is a directory, and no Zarr store.")
    for part in path.rglob("*") if path.is_dir() else [path]:
        if not (part.is_file() or part.is_dir()):
            raise DataError(f"{brief(part)} is no file, but a pipe, a device or a broken link.")


def _check_codecs(path: Path) -> None:
    """Refuse a Zarr store with a codec that our stores do not use."""
    for file in path.rglob("zarr.json"):
        about = json.loads(file.read_text())
        for codec in about.get("codecs", []):
            if codec["name"] not in _CODECS:
                raise DataError(
                    f"{path} was not written by rsfstudy: {file.parent.name} is coded by "
                    f"{codec['name']!r}, which may run code."
                )


def clean_attributes(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with attributes of the types that NetCDF keeps unchanged: text, numbers, and
    arrays of two or more.
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
