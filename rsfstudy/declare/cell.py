"""Cells of a lattice, apart from studies: workers need no more of a study than its cells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.slider.scene import Scene


class Cell(NamedTuple):
    """A scene, and what the axes change of the fields of the study's measure there."""

    scene: Scene
    changes: dict[str, Any]


class Rows(NamedTuple):
    """Cells of one block, as they are sent: a scene and the numbers in which theirs differ.

    Attributes
    ----------
    head : Scene
        One of the block.
    names : tuple of str
        The fields that vary,
    columns : ndarray of float64, shape (fields, cells)
        and their values.
    changes : sequence of dict
        What each cell changes of the fields of the measure; empty where none does.
    """

    head: Scene
    names: tuple[str, ...]
    columns: np.ndarray
    changes: Sequence[dict[str, Any]] = ()

    def cells(self) -> Iterator[Cell]:
        """Each cell with its scene."""
        rows = self.columns.T.tolist()
        changes = self.changes or [{}] * len(rows)
        for row, changed in zip(rows, changes, strict=True):
            yield Cell(self.head.with_numbers(dict(zip(self.names, row, strict=True))), changed)
