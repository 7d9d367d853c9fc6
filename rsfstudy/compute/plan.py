"""The cells of a study before any is computed: their keys, their order, and their batches."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from rsfstudy.declare.cell import Rows
from rsfstudy.declare.study import Study
from rsfstudy.declare.table import Table
from rsfstudy.measures import Measure
from rsfstudy.motion.engines import COMPILED, PYTHON, SCIPY
from rsfstudy.slider.scene import Scene

_KEY = np.dtype("V16")
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
#: Time a batch should last in s, and the most cells it may hold: as many are lost with the machine.
_SECONDS_PER_TASK, LARGEST_BATCH = 0.3, 5000
#: Typical time of one right-hand side in s, by engine, with its share of everything else.
_SECONDS_PER_RHS = {SCIPY: 1.2e-5, PYTHON: 8e-6, COMPILED: 5e-7}
#: Cells that are named at a time: their numbers are in memory meanwhile.
_NAMED_AT_A_TIME = 50_000


def _values(scene: Scene, measure: Measure) -> dict[tuple[str, str], Any]:
    """All that a cell is named by: the exact values of its scene and of its measure's fields."""
    of_scene = {("scene", name): value for name, value in scene.as_dict().items()}
    return of_scene | {("measure", name): value for name, value in measure.plain_fields.items()}


def _digests(
    values: Mapping[tuple[str, str], Any], names: Sequence[str], columns: np.ndarray
) -> Iterator[bytes]:
    """The names of cells: of all that is no float as text, then of the bytes of each float.

    Parameters
    ----------
    values : mapping
        Those of one cell.
    names : sequence of str
        Fields of the scene in which the cells differ from it,
    columns : ndarray, shape (fields, cells)
        and what they hold.
    """
    floats = {name: value for name, value in values.items() if type(value) is float}
    text = [(name, None if name in floats else value) for name, value in values.items()]
    begun = hashlib.sha256(repr(text).encode())
    table = np.empty((columns.shape[1], len(floats)), dtype="<f8")
    table[:] = list(floats.values())
    places = {name: place for place, name in enumerate(floats)}
    for name, column in zip(names, columns, strict=True):
        table[:, places["scene", name]] = column
    width, numbers = table.strides[0], table.tobytes()
    for start in range(0, width * len(table), width):
        digest = begun.copy()
        digest.update(numbers[start : start + width])
        yield digest.digest()[: _KEY.itemsize]


class Plan:
    """The cells of a study in row-major order; it holds no scenes, so that large lattices fit.

    Parameters
    ----------
    study : Study

    Attributes
    ----------
    table : Table
        The cells as columns of numbers.
    keys : ndarray of bytes, shape (cells,)
        Name of each cell; equal cells have the same name.
    different : ndarray of int
        Numbers of the cells that differ: of equal ones, the first.
    examples : list of Scene
        One of each combination of parts.

    Raises
    ------
    InvalidValue
        For a cell that is no meaningful scene; the text names its place on the axes.
    """

    def __init__(self, study: Study) -> None:
        self.study, self.table = study, Table(study)
        examples = dict[tuple[type, ...], Scene]()
        for block in self.table.blocks:
            examples.setdefault(block.head.layout.kinds, block.head)
        self.examples = list(examples.values())
        self.keys = np.empty(study.size, dtype=_KEY)
        for start in range(0, study.size, _NAMED_AT_A_TIME):
            self._name(np.arange(start, min(start + _NAMED_AT_A_TIME, study.size)))
        self.different = _first_of_equals(self.keys)

    def named(self, numbers: np.ndarray) -> list[bytes]:
        """Names of some cells."""
        names, width = self.keys[numbers].tobytes(), _KEY.itemsize
        return [names[at : at + width] for at in range(0, len(names), width)]

    def _name(self, numbers: np.ndarray) -> None:
        """Name these cells."""
        for at, block, rows in self.table.split(numbers):
            columns = self.table.columns(block, rows)
            for some, measure in self._measures(rows):
                values, those = _values(block.head, measure), columns[:, some]
                names = b"".join(_digests(values, block.names, those))
                self.keys[numbers[at[some]]] = np.frombuffer(names, dtype=_KEY)

    def _measures(self, rows: Sequence[np.ndarray]) -> Iterator[tuple[np.ndarray, Measure]]:
        """Places of the cells with the same changes of the measure, and the measure there."""
        places: dict[str, list[int]] = {}
        changes = self.table.changes(rows) or [{}]
        for place, changed in enumerate(changes):
            places.setdefault(repr(changed), []).append(place)
        everywhere = np.arange(len(rows[0]))
        for same in places.values():
            some = everywhere if len(places) == 1 else np.array(same)
            yield some, self.study.measure.with_(**changes[same[0]])


def _first_of_equals(keys: np.ndarray) -> np.ndarray:
    """Places of the names that differ: of equal ones, the first."""
    halves = keys.view("<u8").reshape(-1, 2)
    order = np.lexsort(halves.T)  # which keeps the order of equals
    new = np.ones(len(order), dtype=bool)
    new[1:] = (np.diff(halves[order], axis=0) != 0).any(axis=1)
    return np.sort(order[new])


class Batch:
    """Some cells of a plan, to be computed together.

    Parameters
    ----------
    plan : Plan
    numbers : ndarray of int
        Which, block after block.
    """

    def __init__(self, plan: Plan, numbers: np.ndarray) -> None:
        self._plan, self._numbers = plan, numbers

    def __len__(self) -> int:
        return len(self._numbers)

    def after(self, count: int) -> Batch:
        """All but the first."""
        return Batch(self._plan, self._numbers[count:])

    def singly(self) -> list[Batch]:
        """Each cell alone."""
        return [Batch(self._plan, self._numbers[i : i + 1]) for i in range(len(self))]

    @property
    def keys(self) -> list[bytes]:
        """Names of the cells."""
        return self._plan.named(self._numbers)

    def rows(self) -> list[Rows]:
        """The cells as columns of numbers."""
        return list(self._plan.table.rows(self._numbers))


class Batches(Iterator[Batch]):
    """Cells in batches that last a fraction of a second each, as far as the cells finished so far
    can tell; each batch is made when it is asked for.

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
        self._plan, self._cells, self._next = plan, cells, 0
        # several batches for each worker, so that all end at about the same time
        self._most = min(LARGEST_BATCH, math.ceil(len(cells) / (4 * workers)))
        self._timed, self._seconds = 0, 0.0

    def __next__(self) -> Batch:
        numbers = self._cells[self._next : self._next + self.size()]
        if not len(numbers):
            raise StopIteration
        self._next += len(numbers)
        return Batch(self._plan, self._plan.table.ordered(numbers))

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
    """Cells in another order, in strides of the golden section: the first few are a sample
    of all, so that what they show (how long cells take, whether all fail) holds for the rest.
    """
    count = len(cells)
    stride = max(1, round(_GOLDEN * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return np.asarray(cells[np.arange(count) * stride % max(1, count)])


def estimated_cost(plan: Plan) -> tuple[int, float]:
    """Right-hand sides that the cells of a study usually take at its accuracy, and seconds on one
    core: a guess, because it is the measure that states them, whatever its scenes are.
    """
    accuracy = plan.study.accuracy
    work = len(plan.different) * plan.study.measure.expected_work(accuracy)
    return round(work), work * _SECONDS_PER_RHS.get(accuracy.engine, _SECONDS_PER_RHS[SCIPY])
