"""Cells of a lattice.

The module does not depend on ``Study``, because workers need only the cells of a study.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.slider import Scene


class Cell(NamedTuple):
    """Scene of a cell, and the measure fields that vary along axes.

    Parameters
    ----------
    scene : Scene
        Scene of the cell.
    measure_changes : dict of str to object
        Values of the measure fields that the axes change.
    """

    scene: Scene
    measure_changes: dict[str, Any]


class CellChanges(NamedTuple):
    """Changes that the axes make in a cell.

    Parameters
    ----------
    scene_fields : dict of str to object
        Changed fields of the base scene.
    measure_fields : dict of str to object
        Changed fields of the measure.
    """

    scene_fields: dict[str, Any]
    measure_fields: dict[str, Any]

    def build_cell(self, base_scene: Scene) -> Cell:
        """Build the cell from a base scene.

        Parameters
        ----------
        base_scene : Scene
            Scene to change.

        Returns
        -------
        Cell
            Cell with the changed scene.
        """
        return Cell(base_scene.with_(**self.scene_fields), self.measure_fields)
