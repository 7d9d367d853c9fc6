"""The cells of a study before any is computed: their keys, their order, and their batches."""

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
from rsfstudy.motion import COMPILED, PYTHON, SCIPY
from rsfstudy.slider import Scene
from rsfstudy.study import CellChanges, Study

_CELL_KEY_DTYPE = np.dtype("V16")
_GOLDEN_SECTION_RATIO = (math.sqrt(5.0) - 1.0) / 2.0
#: Time a batch should last in s, and the most cells it may hold: as many are lost with the machine.
_TARGET_SECONDS_PER_BATCH, MAX_BATCH_SIZE = 0.3, 5000
#: Typical time of one right-hand side in s, by engine, with its share of everything else.
_SECONDS_PER_RHS_EVALUATION = {SCIPY: 1.2e-5, PYTHON: 8e-6, COMPILED: 5e-7}


def compute_cell_key(scene: Scene, measure: Measure) -> bytes:
    """Name of a cell: a digest of the exact values of its scene and of its measure's fields."""
    of_scene, of_measure = scene.as_dict(), measure.plain_fields
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
    """Digest of the fields of a cell and of what they hold that is no float."""
    names = [
        *(("scene", n) for n in scene_field_names),
        *(("measure", n) for n in measure_field_names),
    ]
    return hashlib.sha256(repr(list(zip(names, field_values, strict=True))).encode())


class CellPlan:
    """The cells of a study in row-major order; it holds no scenes, so that large lattices fit.

    Parameters
    ----------
    study : Study

    Attributes
    ----------
    keys : ndarray of bytes, shape (cells,)
        Name of each cell; equal cells have the same name.
    unique_cell_numbers : ndarray of int
        Numbers of the cells that differ: of equal ones, the first.
    example_scenes : list of Scene
        One of each combination of parts.

    Raises
    ------
    InvalidValue
        For a cell that is no meaningful scene; the text names its place on the axes.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.keys = np.empty(study.size, dtype=_CELL_KEY_DTYPE)
        example_scenes = dict[tuple[type, ...], Scene]()
        number = 0
        try:
            for scene, changes in study.cells():
                self.keys[number] = compute_cell_key(scene, study.measure.with_(**changes))
                example_scenes.setdefault(scene.field_index.part_classes, scene)
                number += 1
        except InvalidValue as error:
            raise _add_failure_counts_to_error(study, number, error) from None
        self.example_scenes = list(example_scenes.values())
        self.unique_cell_numbers = np.sort(np.unique(self.keys, return_index=True)[1])

    def select_cells(self, cell_numbers: np.ndarray) -> Iterator[tuple[bytes, CellChanges]]:
        """Some cells by their keys, each as what it changes of the study's scene and measure."""
        keys: list[bytes] = self.keys[cell_numbers].tolist()
        return zip(keys, map(self.study.cell_changes, cell_numbers.tolist()), strict=True)


def _add_failure_counts_to_error(
    study: Study, cell_number: int, first_error: InvalidValue
) -> InvalidValue:
    """The error of a cell that is no meaningful scene; where its axis is of samples or cases, with
    how many of them are none.
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
        by = ", ".join(f"{name} in {count}" for name, count in sorted(names.items()))
        told = f"{names.total()} of {len(axis)} points of the axis {axis.dimension}"
        share = f"{names.total() / len(axis):.2g}"
        return first_error.with_location(f"{told} ({share}) make no meaningful scene, by {by}")
    return first_error


class CellBatchIterator(Iterator[np.ndarray]):
    """Numbers of cells in batches that last a fraction of a second each, as far as the cells
    finished so far can tell; each batch is made when it is asked for.

    Clocks decide which cells travel together, and nothing else.

    Parameters
    ----------
    plan : Plan
    cells : ndarray of int
        Numbers of the cells to compute.
    workers : int
        How many cells are computed at a time.
    """

    def __init__(self, plan: CellPlan, cell_numbers: np.ndarray, worker_count: int) -> None:
        self.plan, self._cell_numbers, self._next_cell_index = plan, cell_numbers, 0
        # several batches for each worker, so that all end at about the same time
        self._max_size = min(MAX_BATCH_SIZE, math.ceil(len(cell_numbers) / (4 * worker_count)))
        self._timed_cells, self._timed_seconds = 0, 0.0

    def __next__(self) -> np.ndarray:
        numbers = self._cell_numbers[
            self._next_cell_index : self._next_cell_index + self.compute_next_batch_size()
        ]
        if not len(numbers):
            raise StopIteration
        self._next_cell_index += len(numbers)
        return numbers

    def compute_next_batch_size(self) -> int:
        """Cells in the next batch: one, until some are finished."""
        if not self._timed_seconds:
            return 1
        return max(
            1,
            min(
                self._max_size,
                round(_TARGET_SECONDS_PER_BATCH * self._timed_cells / self._timed_seconds),
            ),
        )

    def record_time(self, seconds: float) -> None:
        """Record how long a cell took; NaN where that is unknown."""
        if not math.isnan(seconds):
            self._timed_cells += 1
            self._timed_seconds += seconds


def order_cells_by_golden_section(cell_numbers: np.ndarray) -> np.ndarray:
    """Cells in another order, in strides of the golden section: the first few are a sample
    of all, so that what they show (how long cells take, whether all fail) holds for the rest.
    """
    count = len(cell_numbers)
    stride = max(1, round(_GOLDEN_SECTION_RATIO * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return np.asarray(cell_numbers[np.arange(count) * stride % max(1, count)])


def estimate_cost(plan: CellPlan) -> tuple[int, float]:
    """Right-hand sides that the cells of a study usually take at its accuracy, and seconds on one
    core: a guess, because it is the measure that states them, whatever its scenes are.
    """
    accuracy = plan.study.accuracy
    work = len(plan.unique_cell_numbers) * plan.study.measure.expected_work(accuracy)
    return round(work), work * _SECONDS_PER_RHS_EVALUATION.get(
        accuracy.engine, _SECONDS_PER_RHS_EVALUATION[SCIPY]
    )
