"""The cells of a study before any is computed: how each is found again, and in which order they
are computed.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator

import numpy as np

from rsfstudy.declare.study import Cell, Study
from rsfstudy.measures import Measure
from rsfstudy.slider.scene import Scene

_KEY = np.dtype("V16")
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


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
        Name of each cell; equal ones share one.
    different : ndarray of int
        The first of equal cells.

    Raises
    ------
    InvalidValue
        For a cell that makes no meaningful scene, naming its place on the axes.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        names = bytearray()
        for scene, changes in study.cells():
            names += cell_key(scene, study.measure.with_(**changes))
        self.keys = np.frombuffer(names, dtype=_KEY)
        self.different = np.sort(np.unique(self.keys, return_index=True)[1])

    def batches(self, cells: np.ndarray, size: int) -> Iterator[list[tuple[bytes, Cell]]]:
        """Cells by their names, as many at a time; each batch is made when it is asked for."""
        for start in range(0, len(cells), size):
            batch = cells[start : start + size]
            yield [(self.keys[cell].tobytes(), self.study.cell(int(cell))) for cell in batch]


def scattered(cells: np.ndarray) -> np.ndarray:
    """The same cells in strides of the golden section: the first few are a sample of all, so that
    what they show (all fail, or how long they take) holds for the rest.
    """
    count = len(cells)
    stride = max(1, round(_GOLDEN * count))
    while math.gcd(stride, count) > 1:
        stride += 1
    return np.asarray(cells[np.arange(count) * stride % max(1, count)])
