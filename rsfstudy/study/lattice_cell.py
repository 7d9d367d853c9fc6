"""Cells, which are the points of the lattice of a study.

The module does not depend on ``Study``, because workers need only the cells of a study.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.slider import Scene


class Cell(NamedTuple):
    """Cell of a lattice, with its scene and the measure fields that the axes change.

    Parameters
    ----------
    scene : Scene
        Scene of the cell.
    measure_field_changes : dict of str to object
        Values of the measure fields that the axes change.
    """

    scene: Scene
    measure_field_changes: dict[str, Any]


class CellFieldChanges(NamedTuple):
    """Values of the scene fields and measure fields that the axes change in a cell.

    Parameters
    ----------
    scene_field_changes : dict of str to object
        Scene fields that differ from the base scene.
    measure_field_changes : dict of str to object
        Measure fields that differ from the measure of the study.
    """

    scene_field_changes: dict[str, Any]
    measure_field_changes: dict[str, Any]

    def build_cell(self, base_scene: Scene) -> Cell:
        """Build the cell from a base scene.

        Parameters
        ----------
        base_scene : Scene
            Scene with the fields that all cells share.

        Returns
        -------
        Cell
            Cell whose scene contains the changed fields.
        """
        return Cell(base_scene.with_(**self.scene_field_changes), self.measure_field_changes)
