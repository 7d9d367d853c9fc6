"""Zarr stores: for a lattice that does not fit in memory, written slab by slab.

Needs the extra ``zarr``. A store is written under a temporary name, read back, and then renamed. An
existing store is never replaced: a reader that has it open would mix old chunks with new ones.
"""

from __future__ import annotations

import importlib.util
import math
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.declare.study import Study
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.files.journal import Columns, Layout
from rsfstudy.files.lattice import attributes, coordinates, variables
from rsfstudy.files.store import ZARR, seal
from rsfstudy.status import Status

#: Numbers in one piece: 32 MB of float64.
_NUMBERS = 4_000_000
#: How stores are written; consolidated metadata have no specification in Zarr's format 3.
_STORE: Mapping[str, Any] = {"consolidated": False, "zarr_format": 3}

#: What is known of the cells from one number to another, in row-major order.
Read = Callable[[int, int], Columns]
Reduce = Callable[[xr.Dataset], xr.Dataset]


def check_installed() -> None:
    """Refuse the format where the package zarr is missing."""
    if importlib.util.find_spec("zarr") is None:
        remedy = "pip install 'rsfstudy[zarr]'."
        raise InvalidValue("format", "zarr", "needs a package", remedy=remedy)


def check_free(path: Path) -> None:
    """Refuse to replace a store."""
    if path.exists():
        raise DataError(
            f"{path} is there already, and whoever has it open would read half of each. "
            "Move it away, or choose another --output."
        )


def write(
    study: Study, read: Read, provenance: Mapping[str, Any], reduce: Reduce, path: Path
) -> xr.Dataset:
    """Write the lattice of a study slab by slab, then its reductions, and open it.

    Raises
    ------
    DataError
        If the disk takes no more, or what is read back differs from what was written.
    """
    beside = path.with_name(f".{path.name}.new")
    try:
        shutil.rmtree(beside, ignore_errors=True)
        finished = _write_lattice(study, read, beside)
        lattice = xr.open_dataset(beside, **ZARR)
        results = reduce(lattice)
        reductions = _as_objects(results.drop_vars(list(lattice.variables)))
        about = {**attributes(study, finished, provenance), **results.attrs}
        reductions.assign_attrs(about).to_zarr(beside, mode="a", **_STORE)
        seal(beside)
        beside.rename(path)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error}.") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return xr.open_dataset(path, **ZARR)


def _as_objects(dataset: xr.Dataset) -> xr.Dataset:
    """Text of any length, which Zarr has a specification for, in place of that of a fixed one."""
    texts = {n: v.astype(object) for n, v in dataset.variables.items() if v.dtype.kind == "U"}
    return dataset.assign(texts).set_coords([name for name in texts if name in dataset.coords])


def _write_lattice(study: Study, read: Read, path: Path) -> int:
    """Write the variables of the lattice; the number of cells that are finished."""
    from dask.array.core import normalize_chunks, slices_from_chunks

    width = Layout(study.measure).width
    chunk = _chunk(study.shape, _NUMBERS // width)
    template = _template(study, Columns.pending(1, width), chunk)
    template.to_zarr(path, mode="w-", compute=False, **_STORE)
    finished = 0
    for region in slices_from_chunks(normalize_chunks(chunk, study.shape)):
        shape = tuple(part.stop - part.start for part in region)
        start = int(np.ravel_multi_index([part.start for part in region], study.shape))
        columns = read(start, start + math.prod(shape))
        slab = xr.Dataset(variables(study, columns, shape))
        where = dict(zip(study.dimensions, region, strict=True))
        slab.to_zarr(path, region=where, **_STORE)
        back = xr.open_dataset(path, **ZARR)[list(slab)].isel(where)
        if not slab.equals(back.drop_vars(list(back.coords))):
            raise DataError(f"{path} was not written: what was read back differs.")
        finished += int((columns.status != int(Status.PENDING)).sum())
    return finished


def _template(study: Study, pending: Columns, chunk: tuple[int, ...]) -> xr.Dataset:
    """The lattice without its numbers: each variable holds one, that of a pending cell, as often
    as it takes. A chunk of the store that is lost reads as pending too.
    """
    import dask.array

    one_cell = variables(study, pending, (1,) * len(chunk))
    lattice = {}
    for name, (dims, values, about) in one_cell.items():
        inner = values.shape[len(chunk) :]
        full = dask.array.full(
            study.shape + inner,
            values.flat[0],
            chunks=chunk + inner,
            dtype="T" if values.dtype == object else values.dtype,
        )
        lattice[name] = (dims, full, about, {"fill_value": values.flat[0]})
    return _as_objects(xr.Dataset(lattice, coordinates(study)))


def _chunk(shape: tuple[int, ...], most: int) -> tuple[int, ...]:
    """The largest slab of consecutive cells with no more than `most` of them."""
    for place, length in enumerate(shape):
        within = math.prod(shape[place + 1 :])
        if within <= most:
            along = min(length, most // within)
            return (1,) * place + (along, *shape[place + 1 :])
    return (1,) * len(shape)
