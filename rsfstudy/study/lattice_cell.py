"""Cells of a lattice, apart from studies: workers need no more of a study than its cells."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.slider import Scene


class Cell(NamedTuple):
    """A scene, and what the axes change of the fields of the study's measure there."""

    scene: Scene
    measure_changes: dict[str, Any]


class CellChanges(NamedTuple):
    """What the axes change in a cell: fields of the base scene, and fields of the measure."""

    scene_fields: dict[str, Any]
    measure_fields: dict[str, Any]

    def build_cell(self, base_scene: Scene) -> Cell:
        """The cell."""
        return Cell(base_scene.with_(**self.scene_fields), self.measure_fields)
