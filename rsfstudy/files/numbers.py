"""The numbers of a results file at a glance: its headline, and a sample of its cells."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.files import contents, restore
from rsfstudy.vocabulary import coverage


def headline(dataset: xr.Dataset) -> str | None:
    """The number a dataset is about: what its measure says, or the first that was measured in each
    cell, where the measure is a user's own; None where no cell has a plain number.
    """
    cells = set(dataset["status"].dims)
    plain = [
        str(name)
        for name, values in dataset.data_vars.items()
        if set(values.dims) == cells
        and values.dtype.kind == "f"
        and coverage(str(name)) == "modelResult"
    ]
    try:
        described = contents.declaration(dataset).measure
        stated = restore.measure(described, "declaration.measure").headline
    except (DataError, InvalidValue):
        stated = ""
    return stated if stated in plain else next(iter(plain), None)


def sample(sizes: Mapping[str, int], most: int) -> dict[str, np.ndarray]:
    """Points of each dimension, both ends and some between, that make so many cells at most.

    Parameters
    ----------
    sizes : mapping of str to int
    most : int
        The longest dimensions are thinned first.
    """
    kept = {dimension: min(size, most) for dimension, size in sizes.items()}
    while math.prod(kept.values()) > most:
        kept[max(kept, key=kept.__getitem__)] -= 1
    return {
        dimension: np.unique(np.linspace(0, size - 1, kept[dimension]).round().astype(int))
        for dimension, size in sizes.items()
    }
