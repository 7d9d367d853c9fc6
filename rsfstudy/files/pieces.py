"""Zarr stores: a lattice too large for one piece of memory, written slab by slab.

Needs the extra ``zarr``. A store is written beside, read back, and then moved into place; one that
is there already is never replaced, because whoever has it open reads its chunks one by one.
"""

from __future__ import annotations

import importlib.util
import itertools
import math
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.declare.study import Study
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.files.journal import Columns
from rsfstudy.files.lattice import attributes, coordinates, variables
from rsfstudy.files.store import ZARR, Digests
from rsfstudy.status import Status

#: Numbers in one piece: 32 MB of float64.
_NUMBERS = 4_000_000

#: What is known of the cells from one number to another, in row-major order.
Read = Callable[[int, int], Columns]
Reduce = Callable[[xr.Dataset], xr.Dataset]


def check_installed() -> None:
    """Refuse a Zarr store where nothing can write one."""
    if importlib.util.find_spec("zarr") is None:
        raise InvalidValue(
            "format", "zarr", "needs a package", remedy="pip install 'rsfstudy[zarr]'."
        )


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
    """Write the lattice of a study piece by piece, then its reductions, and open it.

    Raises
    ------
    DataError
        If the disk takes no more, or what is read back differs from what was written.
    """
    beside = path.with_name(f".{path.name}.new")
    try:
        shutil.rmtree(beside, ignore_errors=True)
        coords = _as_objects(xr.Dataset(coords=coordinates(study)))
        coords.to_zarr(beside, mode="w", consolidated=False, zarr_format=3)
        digests = Digests()
        for name in coords.variables:
            digests.add(str(name), coords[name].values)
            digests.describe(str(name), coords[name].sizes, coords[name].attrs)
        known = _lattice(study, read, beside, digests)
        lattice = xr.open_dataset(beside, **ZARR)
        made = reduce(lattice)
        new = made.drop_vars([name for name in made.variables if name in lattice.variables])
        for name in new.variables:
            digests.add(str(name), new[name].values)
            digests.describe(str(name), new[name].sizes, new[name].attrs)
        about = {**attributes(study, known, provenance), **made.attrs, **_named(lattice)}
        sealed = digests.sealing(_as_objects(new).assign_attrs(about))
        sealed.to_zarr(beside, mode="a", consolidated=False)
        digests.check(xr.open_dataset(beside, **ZARR), str(path))
        beside.rename(path)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error}.") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return xr.open_dataset(path, **ZARR)


def _named(lattice: xr.Dataset) -> dict[str, str]:
    """The attribute that tells xarray which variables are coordinates, as it writes it itself."""
    return {"coordinates": " ".join(str(n) for n in lattice.coords if n not in lattice.dims)}


def _as_objects(dataset: xr.Dataset) -> xr.Dataset:
    """Text of any length, which Zarr has a specification for, in place of that of a fixed one."""
    texts = {n: v.astype(object) for n, v in dataset.variables.items() if v.dtype.kind == "U"}
    return dataset.assign(texts).set_coords([name for name in texts if name in dataset.coords])


def _lattice(study: Study, read: Read, path: Path, digests: Digests) -> int:
    """Write the variables of the lattice; the number of cells that are known."""
    import zarr

    group = zarr.open_group(path, mode="a")
    chunk = _chunk(study.shape, _NUMBERS // read(0, 1).numbers.shape[1])
    arrays: dict[str, Any] = {}
    known = 0
    for region in _regions(study.shape, chunk):
        shape = tuple(part.stop - part.start for part in region)
        start = int(np.ravel_multi_index([part.start for part in region], study.shape))
        columns = read(start, start + math.prod(shape))
        known += int((columns.status != int(Status.PENDING)).sum())
        for name, (dims, values, about) in variables(study, columns, shape).items():
            if name not in arrays:
                inner = values.shape[len(shape) :]
                arrays[name] = group.create_array(
                    name,
                    shape=study.shape + inner,
                    chunks=chunk + inner,
                    dtype=str if values.dtype == object else values.dtype,
                    # a chunk that is lost must not read as the status ok
                    fill_value=_FILL.get(values.dtype.kind, int(Status.PENDING)),
                    dimension_names=dims,
                    attributes={k: _json(v) for k, v in about.items()},
                )
            arrays[name][region] = values
            digests.add(name, values)
            sizes = dict(zip(dims, arrays[name].shape, strict=True))
            digests.describe(name, sizes, about)
    return known


_FILL: Mapping[str, Any] = {"f": np.nan, "O": ""}


def _json(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _chunk(shape: tuple[int, ...], most: int) -> tuple[int, ...]:
    """The largest slab of consecutive cells with no more than `most` of them."""
    for place, length in enumerate(shape):
        within = math.prod(shape[place + 1 :])
        if within <= most:
            along = min(length, most // within)
            return (1,) * place + (along, *shape[place + 1 :])
    return (1,) * len(shape)


def _regions(shape: tuple[int, ...], chunk: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Slabs of that size that fill a lattice, in row-major order."""
    starts = (range(0, length, part) for length, part in zip(shape, chunk, strict=True))
    for corner in itertools.product(*starts):
        yield tuple(
            slice(start, min(start + part, length))
            for start, part, length in zip(corner, chunk, shape, strict=True)
        )
