"""One cell of a lattice, apart from studies: workers need no more of a study than its cells."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.slider.scene import Scene


class Cell(NamedTuple):
    """A scene, and what the axes change of the fields of the study's measure there."""

    scene: Scene
    changes: dict[str, Any]
