"""Zarr stores: for a lattice that does not fit in memory, written slab by slab.

Needs the extra ``zarr``. A store is written under a temporary name, read back, and then renamed. An
existing store is never replaced: a reader that has it open would mix old chunks with new ones.
"""

from __future__ import annotations

import importlib.util
import math
import shutil
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.status import Status
from rsfstudy.storage.cell_journal import CellColumns, OutputPacking
from rsfstudy.storage.dataset_files import ZARR_OPEN_OPTIONS, open_zarr_store, write_store_digest
from rsfstudy.storage.lattice_datasets import (
    build_lattice_coordinates,
    build_lattice_variables,
    root_attributes,
)
from rsfstudy.study import Study

#: Numbers in one piece, 32 MB of float64: whole rows along the first axis, one at least.
_NUMBERS_PER_SLAB = 4_000_000
#: How slabs are written; the metadata are consolidated once, with the reductions.
_ZARR_WRITE_OPTIONS: Mapping[str, Any] = {"consolidated": False, "zarr_format": 3}

#: What is known of some cells, in row-major order.
ReadCellsFunction = Callable[[slice], CellColumns]
ReduceLatticeFunction = Callable[[xr.Dataset], xr.Dataset]


def check_zarr_installed() -> None:
    """Refuse the format where the package zarr is missing."""
    if importlib.util.find_spec("zarr") is None:
        remedy = "pip install 'rsfstudy[zarr]'."
        raise InvalidValue("format", "zarr", "needs a package", remedy=remedy)


def check_store_does_not_exist(path: Path) -> None:
    """Refuse to replace a store."""
    if path.exists():
        raise DataError(
            f"{path} is there already, and whoever has it open would read half of each. "
            "Move it away, or choose another --output."
        )


def write_store(
    study: Study,
    read_cells: ReadCellsFunction,
    provenance: Mapping[str, Any],
    apply_reductions: ReduceLatticeFunction,
    path: Path,
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
        finished = _write_lattice(study, read_cells, beside)
        lattice = open_zarr_store(beside)
        results = apply_reductions(lattice)
        reductions = _convert_strings_to_object_dtype(results.drop_vars(list(lattice.variables)))
        about = {**root_attributes(study, finished, provenance), **results.attrs}
        with warnings.catch_warnings():
            # Zarr's format 3 does not specify consolidated metadata yet, but xarray looks for them.
            warnings.filterwarnings("ignore", "Consolidated metadata")
            reductions.assign_attrs(about).to_zarr(beside, mode="a", zarr_format=3)
        write_store_digest(beside)
        beside.rename(path)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error}.") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return open_zarr_store(path)


def _convert_strings_to_object_dtype(dataset: xr.Dataset) -> xr.Dataset:
    """Text of any length, which Zarr has a specification for, in place of that of a fixed one."""
    texts = {n: v.astype(object) for n, v in dataset.variables.items() if v.dtype.kind == "U"}
    return dataset.assign(texts).set_coords([name for name in texts if name in dataset.coords])


def _write_lattice(study: Study, read_cells: ReadCellsFunction, path: Path) -> int:
    """Write the variables of the lattice; the number of cells that are finished."""
    width, first, finished = (
        OutputPacking(study.measure).packed_number_count,
        study.dimensions[0],
        0,
    )
    length, *within = study.shape
    row = math.prod(within)  # of cells
    rows = min(length, max(1, _NUMBERS_PER_SLAB // (width * row)))
    coords = _convert_strings_to_object_dtype(xr.Dataset(coords=build_lattice_coordinates(study)))
    # a chunk of the store that is lost reads as pending
    pending = build_lattice_variables(
        study, CellColumns.build_pending_cells(1, width), (1,) * len(study.shape)
    )
    encoding = {
        name: {"chunks": (rows, *within, *v.shape[len(study.shape) :]), "fill_value": v.flat[0]}
        for name, (_dims, v, _about) in pending.items()
    }
    how: dict[str, Any] = {"mode": "w-", "encoding": encoding}
    for start in range(0, length, rows):
        some = slice(start, min(start + rows, length))
        columns = read_cells(slice(some.start * row, some.stop * row))
        slab = build_lattice_variables(study, columns, (some.stop - start, *within))
        coords.isel({first: some}).assign(slab).to_zarr(path, **how, **_ZARR_WRITE_OPTIONS)
        how = {"append_dim": first}
        back = xr.open_dataset(path, **ZARR_OPEN_OPTIONS)[list(slab)].isel({first: some})
        if not xr.Dataset(slab).equals(back.drop_vars(list(back.coords))):
            raise DataError(f"{path} was not written: what was read back differs.")
        finished += int((columns.statuses != int(Status.PENDING)).sum())
    return finished
