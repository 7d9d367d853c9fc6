"""Two results files side by side: their declarations, what made them, and the numbers of the cells
that both have, whatever their lattices.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.files.comparison import compared, differences
from rsfstudy.files.contents import provenance
from rsfstudy.files.numbers import headline
from rsfstudy.status import Status

#: Relative distance up to which two points of an axis are one: what rounding makes of them.
_ROUNDING = 1e-12
#: Of a fingerprint, what the declaration states too.
_DECLARED = {"study", "measure", "rtol", "budget", "methods", "engine"}

Pair = tuple[Any, Any]


@dataclass(frozen=True)
class Comparison:
    """What differs between two results datasets.

    Attributes
    ----------
    declaration : mapping of str to (object, object)
        Parts of the declarations that differ, by their paths; None where one has no such part.
    origin : mapping of str to (object, object)
        Versions and machines that differ.
    points : mapping of str to (list, list)
        Points that only the first has, and only the second, of axes that differ.
    cells : tuple of int
        Finished cells that both have, that only the first has, and only the second.
    statuses : pandas.DataFrame
        One row for each cell that both have and that ended otherwise: its place on each axis,
        ``first`` and ``second``.
    numbers : pandas.DataFrame
        One row a variable that both have, over the cells that both have: ``variable``, ``values``,
        ``identical``, ``largest_difference``, and ``beyond_errors``, how many differ by more than
        the sum of both error estimates (NaN where there are none; a headline without an estimate
        counts as exact).
    left_out : mapping of str to str
        Variables that are not compared, and why.
    """

    declaration: Mapping[str, Pair]
    origin: Mapping[str, Pair]
    points: Mapping[str, tuple[list[Any], list[Any]]]
    cells: tuple[int, int, int]
    statuses: pd.DataFrame
    numbers: pd.DataFrame
    left_out: Mapping[str, str]

    @property
    def beyond_errors(self) -> list[str]:
        """Variables with numbers that differ by more than both error estimates allow."""
        return list(self.numbers["variable"][self.numbers["beyond_errors"] > 0])

    @property
    def agrees(self) -> bool:
        """True where both have cells in common, which ended alike, with the same numbers within
        their error estimates.
        """
        return self.cells[0] > 0 and self.statuses.empty and not self.beyond_errors


def side_by_side(first: xr.Dataset, second: xr.Dataset) -> Comparison:
    """Compare two results datasets, cell by cell where both have the same place on every axis.

    Raises
    ------
    InvalidValue
        Where an axis of one has no counterpart in the other, not even a fixed value.
    """
    one, other = both = _with_axes(first, second), _with_axes(second, first)
    dims = [str(d) for d in one["status"].dims]
    inner = sorted({str(d) for d in one.dims if d in other.dims} - set(dims))
    places = {d: _in_both(one[d].values, other[d].values) for d in [*dims, *inner]}
    shared = [
        dataset.isel({d: at[number] for d, at in places.items()}).transpose(*dims, ...)
        for number, dataset in enumerate(both)
    ]
    # of the same values to the last bit, because xarray aligns by them
    shared[1] = shared[1].assign_coords({d: shared[0][d] for d in places})
    unequal = [d for d in dims if {one.sizes[d], other.sizes[d]} != {len(places[d][0])}]
    left_out = _left_out(shared, unequal)
    kept = [dataset.drop_vars(left_out, errors="ignore") for dataset in shared]
    known = _finished(shared[0]) & _finished(shared[1])
    alone = [int(_finished(dataset).sum() - known.sum()) for dataset in both]
    return Comparison(
        declaration=differences(*(dict(_flat(json.loads(d.attrs["declaration"]))) for d in both)),
        origin=differences(*(_origin(dataset) for dataset in both)),
        points={d: _alone(one[d].values, other[d].values, places[d]) for d in unequal},
        cells=(int(known.sum()), alone[0], alone[1]),
        statuses=_statuses(shared, known),
        numbers=_numbers(kept),
        left_out=left_out,
    )


# ---- cells that both have -----------------------------------------------------------------------


def _with_axes(dataset: xr.Dataset, other: xr.Dataset) -> xr.Dataset:
    """A dataset with all axes of another: one that it lacks has its fixed value for only point."""
    cells = set(dataset["status"].dims)
    for dimension in other["status"].dims:
        if dimension in cells:
            continue
        if dimension not in dataset.coords or dataset[dimension].ndim:
            rule = "is an axis of one of the two, and the other does not say where on it it is"
            raise InvalidValue("axis", str(dimension), rule)
        measured = [n for n, values in dataset.data_vars.items() if cells <= set(values.dims)]
        wider = dataset[measured].expand_dims(dimension)
        dataset = dataset.drop_vars([dimension, *measured]).merge(wider)
    return dataset


def _in_both(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of the points that two axes share, in the order of the first."""
    if "O" in (first.dtype.kind, second.dtype.kind) or first.dtype.kind in "UT":
        at = {str(label): place for place, label in enumerate(second.tolist())}
        pairs = [(i, at[str(p)]) for i, p in enumerate(first.tolist()) if str(p) in at]
    else:
        order = np.argsort(second)
        after = np.clip(np.searchsorted(second[order], first), 0, len(second) - 1)
        near = np.stack([order[after], order[np.maximum(after - 1, 0)]])
        gaps = np.abs(second[near] - first)
        nearest = near[np.argmin(gaps, axis=0), np.arange(len(first))]
        same = gaps.min(axis=0) <= _ROUNDING * np.abs(first)
        pairs = [(i, int(nearest[i])) for i in np.flatnonzero(same).tolist()]
    table = np.array(pairs, dtype=int).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _alone(
    first: np.ndarray, second: np.ndarray, both: tuple[np.ndarray, np.ndarray]
) -> tuple[list[Any], list[Any]]:
    """The points that only one of two axes has."""
    mine, theirs = (np.delete(p, at).tolist() for p, at in zip((first, second), both, strict=True))
    return mine, theirs


def _finished(dataset: xr.Dataset) -> np.ndarray:
    return np.asarray(dataset["status"].values != int(Status.PENDING))


def _left_out(shared: Sequence[xr.Dataset], unequal: Sequence[str]) -> dict[str, str]:
    """Variables that cannot be compared, or would compare other things than numbers of cells."""
    first, second = shared
    why = {str(n): "only the first has them" for n in first.data_vars if n not in second}
    why |= {str(n): "only the second has them" for n in second.data_vars if n not in first}
    for name in map(str, first.data_vars):
        if name in why:
            continue
        if set(first[name].dims) != set(second[name].dims):
            why[name] = "they lie along other axes"
        elif not set(unequal) <= set(first[name].dims):
            why[name] = "they draw on cells that only one has"
    return why


# ---- what differs -------------------------------------------------------------------------------


def _numbers(shared: Sequence[xr.Dataset]) -> pd.DataFrame:
    """How the numbers agree; a headline without an error estimate is held to be exact."""
    frame = compared(*shared)
    about = headline(shared[0])
    exact = (frame["variable"] == about) & frame["beyond_errors"].isna()
    frame.loc[exact, "beyond_errors"] = (frame["values"] - frame["identical"])[exact]
    return frame


def _statuses(shared: Sequence[xr.Dataset], known: np.ndarray) -> pd.DataFrame:
    """The cells that ended otherwise, by their places on the axes."""
    status = [one["status"] for one in shared]
    dims = [str(d) for d in status[0].dims]
    labels = {int(s): s.label for s in Status}
    rows = []
    for index in np.argwhere(known & (status[0].values != status[1].values)).tolist():
        at = zip(dims, index, strict=True)
        ends = (labels[int(values.values[tuple(index)])] for values in status)
        place = {d: shared[0][d].values[i] for d, i in at}
        rows.append(place | dict(zip(("first", "second"), ends, strict=True)))
    return pd.DataFrame(rows, columns=[*dims, "first", "second"])


def _flat(part: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The parts of a declaration by their paths; lists of plain values are parts as they are."""
    if isinstance(part, dict) and part:
        for name, value in part.items():
            yield from _flat(value, f"{path}.{name}" if path else name)
    elif isinstance(part, list) and any(isinstance(value, dict) for value in part):
        for number, value in enumerate(part):
            named = value.get("dimension") if isinstance(value, dict) else None
            yield from _flat(value, f"{path}[{named or number}]")
    else:
        yield path, part


def _origin(dataset: xr.Dataset) -> dict[str, Any]:
    """What made a dataset: versions, code and machine."""
    about: Mapping[str, Any] = provenance(dataset)
    decided = {n: v for n, v in about["fingerprint"].items() if n not in _DECLARED}
    others = {n: v for n, v in about.items() if isinstance(v, str)}
    for name in ("time", "command", "declared_in"):
        others.pop(name, None)
    return {**about["versions"], **decided, **others}
