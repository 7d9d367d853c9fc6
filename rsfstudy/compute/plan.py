"""The cells of a study before any is computed: their keys, their order, and their batches."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Iterator

import numpy as np

from rsfstudy.declare.cell import Cell
from rsfstudy.declare.study import Study
from rsfstudy.measures import Measure
from rsfstudy.slider.scene import Scene

_KEY = np.dtype("V16")
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
#: Time a batch should last in s, and the most cells it may hold: as many are lost with the machine.
_SECONDS_PER_TASK, LARGEST_BATCH = 0.3, 2000
#: Typical time of one right-hand side in s.
_SECONDS_PER_RHS = 6e-6


def cell_key(scene: Scene, measure: Measure) -> bytes:
    """Name of a cell: a digest of the exact values of its scene and of its measure's fields."""
    values = f"{tuple(scene.as_dict().values())!r} {measure.plain_fields!r}"
    return hashlib.sha256(values.encode()).digest()[: _KEY.itemsize]


class Plan:
    """The cells of a study in row-major order; it holds no scenes, so that large lattices fit.

    Parameters
    ----------
    study : Study

    Attributes
    ----------
    keys : ndarray of bytes, shape (cells,)
        Name of each cell; equal cells have the same name.
    different : ndarray of int
        Numbers of the cells that differ: of equal ones, the first.

    Raises
    ------
    InvalidValue
        For a cell that is no meaningful scene; the text names its place on the axes.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        names = bytearray()
        for scene, changes in study.cells():
            names += cell_key(scene, study.measure.with_(**changes))
        self.keys = np.frombuffer(names, dtype=_KEY)
        self.different = np.sort(np.unique(self.keys, return_index=True)[1])


class Batches(Iterator[list[tuple[bytes, Cell]]]):
    """Cells by their names, in batches that last a fraction of a second each, as far as the cells
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

    def __init__(self, plan: Plan, cells: np.ndarray, workers: int) -> None:
        self._plan, self._cells = plan, iter(cells)
        # several batches for each worker, so that all end at about the same time
        self._most = min(LARGEST_BATCH, math.ceil(len(cells) / (4 * workers)))
        self._timed, self._seconds = 0, 0.0

    def __next__(self) -> list[tuple[bytes, Cell]]:
        numbers = list(itertools.islice(self._cells, self.size()))
        if not numbers:
            raise StopIteration
        return [(self._plan.keys[n].tobytes(), self._plan.study.cell(int(n))) for n in numbers]

    def size(self) -> int:
        """Cells in the next batch: one, until some are finished."""
        if not self._seconds:
            return 1
        return max(1, min(self._most, round(_SECONDS_PER_TASK * self._timed / self._seconds)))

    def learn(self, seconds: float) -> None:
        """Record how long a cell took; NaN where that is unknown."""
        if not math.isnan(seconds):
            self._timed += 1
            self._seconds += seconds


def scattered(cells: np.ndarray) -> np.ndarray:
    """The same cells in another order, in strides of the golden section: the first few are a sample
    of all, so that what they show (how long cells take, whether all fail) holds for the rest.
    """
    count = len(cells)
    stride = max(1, round(_GOLDEN * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return np.asarray(cells[np.arange(count) * stride % max(1, count)])


def estimated_cost(study: Study) -> tuple[int, float]:
    """Right-hand sides that the cells of a study usually take at its accuracy, and seconds on one
    core.
    """
    work = len(Plan(study).different) * study.measure.expected_work(study.accuracy)
    return round(work), work * _SECONDS_PER_RHS
