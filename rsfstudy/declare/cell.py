"""Cells of a lattice, apart from studies: workers need no more of a study than its cells."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.slider.scene import Scene


class Cell(NamedTuple):
    """A scene, and what the axes change of the fields of the study's measure there."""

    scene: Scene
    changes: dict[str, Any]


class Changes(NamedTuple):
    """What the axes change in a cell: fields of the base scene, and fields of the measure."""

    of_scene: dict[str, Any]
    of_measure: dict[str, Any]

    def of(self, base: Scene) -> Cell:
        """The cell."""
        return Cell(base.with_(**self.of_scene), self.of_measure)
