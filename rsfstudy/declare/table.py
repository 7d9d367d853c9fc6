"""The cells of a study as columns of numbers: blocks of cells whose scenes differ in numbers only.

What an axis sets decides with which parts a scene is made; most of its rows differ in nothing but a
number. A block has one scene, of which those of its cells are made: once to be checked, and again
where the cell is computed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rsfstudy.declare.axis import Row, alike, kinds
from rsfstudy.declare.cell import Rows
from rsfstudy.declare.study import Study
from rsfstudy.errors import InvalidValue
from rsfstudy.slider.scene import Scene

#: Cells that are checked at a time: their numbers are in memory meanwhile.
_CHECKED_AT_A_TIME = 50_000


@dataclass(frozen=True)
class Block:
    """The cells whose rows are of the same kind on each axis.

    Attributes
    ----------
    rows : tuple of ndarray of int
        Their rows on each axis.
    head : Scene
        The scene of the first.
    names : tuple of str
        Fields of the scene in which the others differ from it.
    """

    rows: tuple[np.ndarray, ...]
    head: Scene
    names: tuple[str, ...]


class Table:
    """The cells of a study, checked along its axes.

    Parameters
    ----------
    study : Study

    Attributes
    ----------
    blocks : list of Block
        In the order of their first cells.

    Raises
    ------
    InvalidValue
        For a cell that makes no meaningful scene, naming its place on the axes; and for a field
        that no cell has.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self._of_scene = study.of_scene
        #: The axis of each field of the measure that varies, and of each of the scene.
        self._of_measure = [p for p, a in enumerate(study.axes) if set(a.fields) - self._of_scene]
        self._places = {
            name: place
            for place, axis in enumerate(study.axes)
            for name in axis.fields
            if name in self._of_scene
        }
        self._kind = [kinds(axis.rows) for axis in study.axes]
        self._shape = tuple(int(kind.max()) + 1 for kind in self._kind)
        self._columns = {name: self._column(name) for name in self._places}
        self.blocks: list[Block] = []
        wrong: list[int] = []
        for rows in alike(study.axes):
            wrong += self._add(rows)
        if wrong:
            raise self._refused(min(wrong))
        study.refuse(self._unused())

    def _refused(self, number: int) -> InvalidValue:
        """Why a cell is no meaningful scene, and of how many samples or cases the same holds."""
        place = list(map(int, np.unravel_index(number, self.study.shape)))
        first = _error(self.study, number)
        assert first is not None
        for varied, axis in enumerate(self.study.axes):
            if not axis.is_numbered:
                continue
            count = len(axis)
            along = [self._number([*place[:varied], n, *place[varied + 1 :]]) for n in range(count)]
            names = [error.name for n in along if (error := _error(self.study, n))]
            by = ", ".join(f"{n} in {names.count(n)}" for n in sorted(set(names)))
            told = f"{len(names)} of {count} points of the axis {axis.dimension}"
            return first.at(f"{told} ({len(names) / count:.2g}) make no meaningful scene, by {by}")
        return first

    def _column(self, name: str) -> np.ndarray:
        """A field along its axis; NaN where it is no number."""
        values = (row.get(name) for row in self.study.axes[self._places[name]].rows)
        return np.array([v if isinstance(v, float) else math.nan for v in values])

    def _unused(self) -> set[str]:
        scenes = [block.head.as_dict() for block in self.blocks]
        names = set(self._places) & set(self.study.scene_fields)
        return {n for n in names if all(scene.get(n) is None for scene in scenes)}

    # ---- checking -------------------------------------------------------------------------------

    def _add(self, rows: tuple[np.ndarray, ...]) -> Iterator[int]:
        """Add the block of the cells with these rows; the number of the first that is no meaningful
        scene, if there is one.
        """
        first = self._number([int(along[0]) for along in rows])
        try:
            head = self.study.scene(first)
        except InvalidValue:
            yield first
            return
        block = Block(rows, head, self._varying(head, rows))
        self.blocks.append(block)
        varied = {self._places[name] for name in self._numeric([along[:1] for along in rows])}
        rows = tuple(r if place in varied else r[:1] for place, r in enumerate(rows))
        shape = tuple(map(len, rows))
        for start in range(0, math.prod(shape), _CHECKED_AT_A_TIME):
            numbers = np.arange(start, min(start + _CHECKED_AT_A_TIME, math.prod(shape)))
            at = [r[i] for r, i in zip(rows, np.unravel_index(numbers, shape), strict=True)]
            for place, row in enumerate(self.columns(block, at).T.tolist()):
                try:
                    head.with_numbers(dict(zip(block.names, row, strict=True)))
                except InvalidValue:
                    yield self._number([int(along[place]) for along in at])
                    return

    def _varying(self, head: Scene, rows: tuple[np.ndarray, ...]) -> tuple[str, ...]:
        """The fields of the block's scenes that hold numbers of their own."""
        made = self.study.fields_of(self._numeric([along[:1] for along in rows]))
        return tuple(n for n in made if n in head.layout.places and made[n] is not True)

    def _numeric(self, rows: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
        """What axes hold in cells of one block, where it is numbers, by field."""
        found = {n: self._columns[n][rows[place]] for n, place in self._places.items()}
        return {name: column for name, column in found.items() if not np.isnan(column[0])}

    def _number(self, rows: Sequence[int]) -> int:
        return int(np.ravel_multi_index(tuple(rows), self.study.shape))

    # ---- cells ----------------------------------------------------------------------------------

    @cached_property
    def _block_of(self) -> dict[int, Block]:
        """The blocks, by the numbers of their kinds."""
        return {int(self._kinds_at([r[:1] for r in b.rows])[0]): b for b in self.blocks}

    def _kinds_at(self, rows: Sequence[np.ndarray]) -> np.ndarray:
        along = [kind[row] for kind, row in zip(self._kind, rows, strict=True)]
        return np.asarray(np.ravel_multi_index(along, self._shape))

    def split(self, numbers: np.ndarray) -> Iterator[tuple[np.ndarray, Block, list[np.ndarray]]]:
        """Cells by their blocks: their places among the numbers, the block, and their rows."""
        rows = np.unravel_index(numbers, self.study.shape)
        found = self._kinds_at(rows)
        for kind in np.unique(found).tolist():
            at = np.flatnonzero(found == kind)
            yield at, self._block_of[kind], [along[at] for along in rows]

    def columns(self, block: Block, rows: Sequence[np.ndarray]) -> np.ndarray:
        """The numbers that vary in a block, a row of them for each field."""
        made, count = self.study.fields_of(self._numeric(rows)), len(rows[0])
        values = [np.broadcast_to(made[name], count) for name in block.names]
        return np.array(values).reshape(len(values), count)

    def changes(self, rows: Sequence[np.ndarray]) -> list[dict[str, Any]]:
        """Fields of the measure that differ in each cell; none, where no axis varies them."""
        if not self._of_measure:
            return []
        axes = [(self.study.axes[p].rows, rows[p].tolist()) for p in self._of_measure]
        return [
            {n: v for (all_, _), r in zip(axes, at, strict=True) for n, v in self._of(all_[r])}
            for at in zip(*(places for _all, places in axes), strict=True)
        ]

    def _of(self, row: Row) -> Iterator[tuple[str, Any]]:
        return ((n, v) for n, v in row.items() if n not in self._of_scene)

    def rows(self, numbers: np.ndarray) -> Iterator[Rows]:
        """Cells, block after block, to be computed."""
        for _at, block, rows in self.split(numbers):
            yield Rows(block.head, block.names, self.columns(block, rows), self.changes(rows))

    def ordered(self, numbers: np.ndarray) -> np.ndarray:
        """Cells ordered block after block."""
        return np.concatenate([numbers[at] for at, _block, _rows in self.split(numbers)])


def _error(study: Study, number: int) -> InvalidValue | None:
    """Why a cell is no meaningful scene."""
    try:
        study.cell(number)
    except InvalidValue as error:
        return error
    return None
