"""Class that writes lattices that do not fit in memory to Zarr stores.

Zarr stores need the optional dependency ``rsfstudy[zarr]``. ``ZarrStore.write_study_results``
writes a lattice slab by slab under a temporary name, reads each slab back, and finally renames the
store. An existing store is never replaced, because a program that has opened the store would read a
mixture of old and new chunks.
"""

from __future__ import annotations

import importlib.util
import math
import shutil
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.status import Status
from rsfstudy.storage.cell_result_arrays import CellOutputPacker, CellResultArrays
from rsfstudy.storage.dataset_files import (
    ZARR_OPEN_OPTIONS,
    open_zarr_store,
    write_zarr_store_digest,
)
from rsfstudy.storage.lattice_datasets import (
    build_lattice_variables,
    build_root_attributes,
)
from rsfstudy.study import Study

#: Maximum number of values in a slab (32 MB of float64). A slab consists of complete rows along the
#: first axis, and has at least one row.
_MAX_VALUES_PER_SLAB = 4_000_000
#: Options for writing a slab. The metadata are not consolidated after each slab, but only once,
#: when the reductions are written.
_ZARR_WRITE_OPTIONS: Mapping[str, Any] = {"consolidated": False, "zarr_format": 3}

#: Function that reads a slice of the cells, in row-major order.
ReadCellsFunction = Callable[[slice], CellResultArrays]
ApplyReductionsFunction = Callable[[xr.Dataset], xr.Dataset]


@dataclass(frozen=True)
class ZarrStore:
    """Zarr store with the results of a study.

    Parameters
    ----------
    path : Path
        Directory of the store. An existing store is never replaced.
    """

    path: Path

    @staticmethod
    def check_zarr_is_installed() -> None:
        """Check that the package zarr is installed.

        Raises
        ------
        InvalidValue
            If the package zarr is not installed.
        """
        if importlib.util.find_spec("zarr") is None:
            remedy = "pip install 'rsfstudy[zarr]'."
            raise InvalidValue(
                "format", "zarr", "requires a package that is not installed", remedy=remedy
            )

    def check_does_not_exist(self) -> None:
        """Check that the store does not exist.

        Raises
        ------
        DataError
            If the path exists.
        """
        if self.path.exists():
            raise DataError(
                f"{self.path} already exists, and replacing it would corrupt the data of programs "
                "that have opened it. Move the store, or choose another --output."
            )

    def write_study_results(
        self,
        study: Study,
        coordinates: Mapping[Any, Any],
        read_cells: ReadCellsFunction,
        provenance: Mapping[str, Any],
        apply_reductions: ApplyReductionsFunction,
    ) -> xr.Dataset:
        """Write the lattice of a study and its reductions to a Zarr store.

        Parameters
        ----------
        study : Study
            Study whose results are written.
        coordinates : mapping of str to tuple or xarray.Variable
            Coordinates of the lattice.
        read_cells : callable
            Function that returns the ``CellResultArrays`` of a slice of cells, in row-major order.
        provenance : mapping of str to object
            Provenance of the run, as plain data.
        apply_reductions : callable
            Function that adds the reductions to the lattice dataset.

        Returns
        -------
        xarray.Dataset
            Contents of the store, opened lazily.

        Raises
        ------
        DataError
            If the store cannot be written, or if the data that were read back differ from the
            lattice.
        """
        path = self.path
        beside = path.with_name(f".{path.name}.new")
        try:
            shutil.rmtree(beside, ignore_errors=True)
            finished = _write_lattice_in_slabs(study, coordinates, read_cells, beside)
            lattice = open_zarr_store(beside)
            results = apply_reductions(lattice)
            reductions = _convert_strings_to_object_dtype(
                results.drop_vars(list(lattice.variables))
            )
            about = {**build_root_attributes(study, finished, provenance), **results.attrs}
            with warnings.catch_warnings():
                # Version 3 of the Zarr format does not specify consolidated metadata yet, but
                # xarray looks for them.
                warnings.filterwarnings("ignore", "Consolidated metadata")
                reductions.assign_attrs(about).to_zarr(beside, mode="a", zarr_format=3)
            write_zarr_store_digest(beside)
            beside.rename(path)
        except OSError as error:
            raise DataError(f"cannot write {path}: {error}.") from error
        finally:
            shutil.rmtree(beside, ignore_errors=True)
        return open_zarr_store(path)


def _convert_strings_to_object_dtype(dataset: xr.Dataset) -> xr.Dataset:
    """Convert fixed-length strings to variable-length strings.

    The Zarr format specifies only strings of variable length.
    """
    texts = {n: v.astype(object) for n, v in dataset.variables.items() if v.dtype.kind == "U"}
    return dataset.assign(texts).set_coords([name for name in texts if name in dataset.coords])


def _write_lattice_in_slabs(
    study: Study, coordinates: Mapping[Any, Any], read_cells: ReadCellsFunction, path: Path
) -> int:
    """Write the variables of the lattice, and count the finished cells."""
    width, first, finished = (
        CellOutputPacker(study.measure).packed_number_count,
        study.dimensions[0],
        0,
    )
    length, *within = study.shape
    row = math.prod(within)  # number of cells per point of the first axis
    rows = min(length, max(1, _MAX_VALUES_PER_SLAB // (width * row)))
    coords = _convert_strings_to_object_dtype(xr.Dataset(coords=coordinates))
    # The fill values are the values of pending cells. If a chunk is lost, its cells are therefore
    # read as pending cells.
    pending = build_lattice_variables(
        study, CellResultArrays.build_for_pending_cells(1, width), (1,) * len(study.shape)
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
            raise DataError(
                f"{path} was not written, because the stored data differ from the computed "
                "data. Run the command again."
            )
        finished += int((columns.statuses != int(Status.PENDING)).sum())
    return finished
