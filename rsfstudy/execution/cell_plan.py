"""Plan of a study, which determines the keys, order, batches and cost of the cells.

``CellPlan`` computes the keys of all cells before any cell is computed. ``CellBatchIterator``
divides the cells into batches.
"""

from __future__ import annotations

import functools
import hashlib
import math
import struct
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.motion import Engine
from rsfstudy.slider import Scene
from rsfstudy.storage import LatticeCoordinatesBuilder
from rsfstudy.study import CellFieldChanges, Study

_CELL_KEY_DTYPE = np.dtype("V16")
_GOLDEN_SECTION_RATIO = (math.sqrt(5.0) - 1.0) / 2.0
#: Target computation time of a batch in s, and maximum number of cells in a batch. The batches are
#: small because all cells of a batch must be computed again if a machine fails.
_TARGET_SECONDS_PER_BATCH, MAX_BATCH_SIZE = 0.3, 5000
#: Typical time per right-hand-side evaluation in s, by engine, including all overheads.
_SECONDS_PER_RHS_EVALUATION_BY_ENGINE = {
    Engine.SCIPY: 1.2e-5,
    Engine.PYTHON: 8e-6,
    Engine.COMPILED: 5e-7,
}


def compute_cell_key(scene: Scene, measure: Measure) -> bytes:
    """Compute the key that identifies a cell.

    The key is a digest of the exact values of the scene fields and the measure fields. The key does
    not depend on the number of the cell or on the axes. Cells with equal fields therefore have the
    same key.

    Parameters
    ----------
    scene : Scene
        Scene of the cell.
    measure : Measure
        Measure of the cell.

    Returns
    -------
    bytes
        Key of 16 bytes.
    """
    of_scene, of_measure = scene.stored_fields(), measure.scalar_field_values
    for name in measure.fields_omitted_from_storage:
        del of_measure[name]
    values = (*of_scene.values(), *of_measure.values())
    floats = [value for value in values if type(value) is float]
    others = tuple(None if type(value) is float else value for value in values)
    digest = _digest_cell_fields(tuple(of_scene), tuple(of_measure), others).copy()
    digest.update(struct.pack(f"<{len(floats)}d", *floats))
    return bytes(digest.digest()[: _CELL_KEY_DTYPE.itemsize])


@functools.lru_cache(maxsize=256)
def _digest_cell_fields(
    scene_field_names: tuple[str, ...],
    measure_field_names: tuple[str, ...],
    field_values: tuple[Any, ...],
) -> Any:
    """Compute a digest of the names of all fields and of the values that are not floats."""
    names = [
        *(("scene", n) for n in scene_field_names),
        *(("measure", n) for n in measure_field_names),
    ]
    return hashlib.sha256(repr(list(zip(names, field_values, strict=True))).encode())


class CellPlan:
    """Plan of a study, with the keys of all cells in row-major order.

    A plan does not store the scenes of all cells, so that the plan of a large lattice fits in
    memory.

    Parameters
    ----------
    study : Study
        Study to plan.

    Attributes
    ----------
    keys : ndarray of bytes, shape (n,)
        Key of each cell. Cells with equal fields have equal keys.
    unique_cell_numbers : ndarray of int
        Numbers of the cells that must be computed. If several cells have the same key, only the
        first of these cells is included.
    example_scenes : list of Scene
        One scene for each combination of slider parts in the lattice.

    Raises
    ------
    InvalidValue
        If the scene of a cell is invalid. The message contains the coordinates of the cell.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.keys = np.empty(study.size, dtype=_CELL_KEY_DTYPE)
        example_scenes = dict[tuple[type, ...], Scene]()
        self._coordinates = LatticeCoordinatesBuilder(study)
        self._scenes_for_coordinates = dict[int, Scene]()
        number = 0
        try:
            for scene, changes in study.cells():
                self.keys[number] = compute_cell_key(scene, study.measure.with_(**changes))
                example_scenes.setdefault(scene.field_lookup.part_classes, scene)
                if number in self._coordinates.cell_numbers:
                    self._scenes_for_coordinates[number] = scene
                number += 1
        except InvalidValue as error:
            raise _add_invalid_point_counts_to_error(study, number, error) from None
        self.example_scenes = list(example_scenes.values())
        self.unique_cell_numbers = np.sort(np.unique(self.keys, return_index=True)[1])

    @functools.cached_property
    def lattice_coordinates(self) -> dict[Any, Any]:
        """Coordinates of the lattice, in a form that ``xarray.Dataset`` accepts."""
        return self._coordinates.build_coordinates(self._scenes_for_coordinates)

    def iterate_keys_and_field_changes(
        self, cell_numbers: np.ndarray
    ) -> Iterator[tuple[bytes, CellFieldChanges]]:
        """Select cells by their numbers.

        Parameters
        ----------
        cell_numbers : ndarray of int
            Numbers of the cells.

        Returns
        -------
        iterator of tuple of (bytes, CellFieldChanges)
            Key of each cell, and the field values of the cell that differ from the base scene or
            from the measure of the study.
        """
        keys: list[bytes] = self.keys[cell_numbers].tolist()
        return zip(
            keys, map(self.study.compute_cell_field_changes, cell_numbers.tolist()), strict=True
        )

    def estimate_evaluations_and_time(self) -> tuple[int, float]:
        """Estimate the cost of the distinct cells of a study.

        The estimate uses a typical number of right-hand-side evaluations for the measure. The
        estimate does not depend on the scenes of the cells.

        Returns
        -------
        rhs_evaluations : int
            Expected number of right-hand-side evaluations at the accuracy of the study.
        seconds : float
            Expected time in s on one core.
        """
        accuracy = self.study.accuracy
        work = len(self.unique_cell_numbers) * self.study.measure.expected_work(accuracy)
        return round(work), work * _SECONDS_PER_RHS_EVALUATION_BY_ENGINE.get(
            accuracy.engine, _SECONDS_PER_RHS_EVALUATION_BY_ENGINE[Engine.SCIPY]
        )


def _add_invalid_point_counts_to_error(
    study: Study, cell_number: int, first_error: InvalidValue
) -> InvalidValue:
    """Add the count of invalid points on an axis to the error message of a cell.

    The count is added only if the points of an axis are numbered, for example the points of an axis
    of random samples.
    """
    if cell_number == study.size:
        return first_error
    place: list[Any] = [*np.unravel_index(cell_number, study.shape)]
    for varied, axis in enumerate(study.axes):
        if not axis.has_numbered_points:
            continue
        place[varied], names = np.arange(len(axis)), Counter[str]()
        for cell in np.ravel_multi_index(np.broadcast_arrays(*place), study.shape).tolist():
            try:
                study.cell(cell)
            except InvalidValue as error:
                names[error.name] += 1
        by = ", ".join(f"{name} ({count})" for name, count in sorted(names.items()))
        told = f"{names.total()} of {len(axis)} points of the axis {axis.dimension}"
        share = f"{names.total() / len(axis):.2g}"
        return first_error.with_location(
            f"{told} (fraction {share}) give invalid scenes because of {by}"
        )
    return first_error


class CellBatchIterator(Iterator[np.ndarray]):
    """Iterator over batches of cell numbers.

    The iterator chooses the size of each batch so that the computation of the batch takes about 0.3
    s. The computation time of a batch is estimated from the wall times of finished cells. These
    wall times affect only the sizes of the batches, and never the results.

    Parameters
    ----------
    plan : CellPlan
        Plan that contains the cells.
    cell_numbers : ndarray of int
        Numbers of the cells to compute.
    worker_count : int
        Number of cells that are computed at the same time.
    """

    def __init__(self, plan: CellPlan, cell_numbers: np.ndarray, worker_count: int) -> None:
        self.plan, self._cell_numbers, self._next_cell_index = plan, cell_numbers, 0
        # Each worker computes several batches, so that all workers finish at about the same time.
        self._max_size = min(MAX_BATCH_SIZE, math.ceil(len(cell_numbers) / (4 * worker_count)))
        self._timed_cells, self._timed_seconds = 0, 0.0

    def __next__(self) -> np.ndarray:
        """Return an array with the cell numbers of the next batch."""
        numbers = self._cell_numbers[
            self._next_cell_index : self._next_cell_index + self.compute_next_batch_size()
        ]
        if not len(numbers):
            raise StopIteration
        self._next_cell_index += len(numbers)
        return numbers

    def compute_next_batch_size(self) -> int:
        """Compute the number of cells in the next batch.

        Returns
        -------
        int
            Number of cells. The number is 1 until the first cell has finished.
        """
        if not self._timed_seconds:
            return 1
        return max(
            1,
            min(
                self._max_size,
                round(_TARGET_SECONDS_PER_BATCH * self._timed_cells / self._timed_seconds),
            ),
        )

    def record_cell_time(self, seconds: float) -> None:
        """Record the wall time of a finished cell.

        Parameters
        ----------
        seconds : float
            Wall time in s. NaN is ignored.
        """
        if not math.isnan(seconds):
            self._timed_cells += 1
            self._timed_seconds += seconds


def order_cells_by_golden_section(cell_numbers: np.ndarray) -> np.ndarray:
    """Reorder cells so that the first few cells are typical of all cells.

    Neighbouring cells in the new order are about ``0.618 * n`` positions apart in ``cell_numbers``
    (modulo ``n``), where ``n`` is the number of cells. The first few cells are therefore spread
    over the whole lattice. The computation times and failures of these cells are therefore typical
    of the remaining cells.

    Parameters
    ----------
    cell_numbers : ndarray of int
        Numbers of the cells.

    Returns
    -------
    ndarray of int
        Reordered numbers.
    """
    count = len(cell_numbers)
    stride = max(1, round(_GOLDEN_SECTION_RATIO * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return np.asarray(cell_numbers[np.arange(count) * stride % max(1, count)])
