"""One labelled dimension of a lattice: a plain list of values, or labelled points of several
fields.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rsfstudy.declare.wording import short
from rsfstudy.errors import InvalidValue
from rsfstudy.quantity import is_name
from rsfstudy.slider.registry import name_of

Row = Mapping[str, Any]


@dataclass(frozen=True, init=False)
class Axis:
    """One labelled dimension of a lattice.

    Parameters
    ----------
    dimension : str
        Name of the dimension; for a plain axis the field it varies, of the scene or of the measure
        (of the scene where both have one of that name).
    values : sequence, or mapping of str to mapping
        The values of that field, where a class stands for a part of the user's own; or, for a
        zipped axis, a label for each point and the fields set there, as in
        ``{"constant": {"normal_stress": "constant"}, ...}``, or the rig there.
    units : mapping of str to str, optional
        Units of the fields that are in units, in a study of a rig: see `Laboratory.axis`.

    Raises
    ------
    InvalidValue
        For an axis that is empty, repeats a value or holds a non-finite one.
    """

    dimension: str
    rows: tuple[Row, ...]
    labels: tuple[str, ...] | None
    units: Mapping[str, str]

    def __init__(
        self,
        dimension: str,
        values: Sequence[Any] | np.ndarray | Mapping[str, Any],
        units: Mapping[str, str] | None = None,
    ) -> None:
        if not is_name(dimension):
            rule = "must be named by a Python identifier, its accents composed (NFC)"
            raise InvalidValue("axis", dimension, rule)
        labels: tuple[str, ...] | None = None
        if isinstance(values, Mapping):
            labels, rows = tuple(values), _rows(dimension, values)
        else:
            listed = [values] if isinstance(values, str) else values
            if not is_list(listed):
                raise InvalidValue(dimension, values, "must be a list of values")
            rows = tuple({dimension: plain(dimension, value)} for value in listed)
            if any(row[dimension] is None for row in rows):
                raise InvalidValue(dimension, None, "must be a value on an axis")
        object.__setattr__(self, "dimension", dimension)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "labels", labels)
        object.__setattr__(self, "units", {} if units is None else units)
        self._check()

    def _check(self) -> None:
        if not self.rows:
            raise InvalidValue("axis", self.dimension, "has no values")
        if not isinstance(self.units, Mapping) or not set(self.units) <= set(self.fields):
            rule = "must map fields of the axis to their units"
            raise InvalidValue("units", self.units, rule, choices=self.fields)
        for name, text in self.units.items():
            check_text(name, text)
        for row in self.rows:
            for name, value in row.items():
                if not isinstance(value, float | str | bool | None):
                    raise InvalidValue(name, value, "must be a number, a flag or a text")
                if isinstance(value, str):
                    check_text(name, value)
                if isinstance(value, float) and not math.isfinite(value):
                    raise InvalidValue(self.dimension, value, "must be finite")
        seen: set[frozenset[tuple[str, Any]]] = set()
        for row in self.rows:
            point = frozenset(row.items())
            if point in seen:
                value = row.get(self.dimension, dict(row))
                raise InvalidValue(self.dimension, value, "stands twice on its axis")
            seen.add(point)

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields of the scene or of the measure that vary along the axis."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))

    def __len__(self) -> int:
        return len(self.rows)

    def describe(self) -> dict[str, Any]:
        """The axis as plain data."""
        values: Any = [row.get(self.dimension) for row in self.rows]
        if self.labels is not None:
            values = {label: dict(row) for label, row in zip(self.labels, self.rows, strict=True)}
        units = {"units": dict(self.units)} if self.units else {}
        return {"dimension": self.dimension, "values": values, **units}

    @property
    def points(self) -> list[str]:
        """What its points are called: labels, or values with their units."""
        units = self.units.get(self.dimension, "")
        values = (f"{short(row.get(self.dimension))} {units}".strip() for row in self.rows)
        return list(self.labels or values)


def kinds(rows: Sequence[Row]) -> np.ndarray:
    """The kind of each row of an axis, counted from 0 in the order of the first of each. Rows are
    of one kind if they set the same fields, to the same texts and flags, and of numbers to 0 or to
    any others: then scenes with them are made of the same parts.
    """
    known: dict[tuple[Any, ...], int] = {}
    return np.array([known.setdefault(_kind(row), len(known)) for row in rows])


def alike(axes: Sequence[Axis]) -> Iterator[tuple[np.ndarray, ...]]:
    """Rows on each axis that are of one kind, for each combination of kinds."""
    every = [kinds(axis.rows) for axis in axes]
    for kind in np.ndindex(*(int(of.max()) + 1 for of in every)):
        yield tuple(np.flatnonzero(of == n) for of, n in zip(every, kind, strict=True))


def _kind(row: Row) -> tuple[Any, ...]:
    return tuple(
        (name, type(value), bool(value) if isinstance(value, float) else value)
        for name, value in row.items()
    )


def _rows(dimension: str, points: Mapping[str, Any]) -> tuple[Row, ...]:
    """The rows of a zipped axis: for each label the fields set there."""
    rows = {label: getattr(row, "on_axis", row) for label, row in points.items()}
    for label, row in rows.items():
        check_text(dimension, label)
        if not label:
            raise InvalidValue(dimension, label, "must be a text that labels a point")
        if not isinstance(row, Mapping) or not row:
            raise InvalidValue(dimension, row, f"must be the fields set at {label!r}")
    return tuple({n: plain(n, v) for n, v in row.items()} for row in rows.values())


def select(axis: Axis, labels: Sequence[str]) -> Axis:
    """The points of a zipped axis that bear these labels."""
    assert axis.labels is not None
    rows = dict(zip(axis.labels, axis.rows, strict=True))
    for label in labels:
        if label not in rows:
            raise InvalidValue(axis.dimension, label, "is no point of the axis", choices=rows)
    return Axis(axis.dimension, {label: rows[label] for label in labels}, axis.units)


def spread(axis: Axis, name: str, values: Sequence[Any]) -> Axis:
    """A zipped axis whose points that use a field take new values of it; the others stay."""
    assert axis.labels is not None
    spread: dict[str, Row] = {}
    for label, row in zip(axis.labels, axis.rows, strict=True):
        if name not in row:
            spread[label] = row
            continue
        for value in values:
            changed = {**row, name: plain(name, value)}
            if changed in spread.values():
                continue
            new = f"{name} = {value}"
            if changed == row:
                new = label
            elif new in spread or new in axis.labels:
                new = f"{label}, {new}"
            spread[new] = changed
    return Axis(axis.dimension, spread, axis.units)


def check_text(name: str, text: object) -> None:
    """A text that a file can hold."""
    if not isinstance(text, str) or "\0" in text:
        raise InvalidValue(name, text, "must be a text")
    try:
        text.encode()
    except UnicodeError as error:
        raise InvalidValue(name, text, "must be a text that UTF-8 can hold") from error


def is_list(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim == 1
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def plain_values(field: str, value: Any) -> Any:
    """A value of a field, or a list of them, as `plain` gives it."""
    return [plain(field, each) for each in value] if is_list(value) else plain(field, value)


def plain(field: str, value: Any) -> Any:
    """A value of a field as Python's own number, flag or text: whole numbers as float, a part of
    the user's own by its name.
    """
    value = name_of(field, value)
    if isinstance(value, np.ndarray) and value.ndim:
        raise InvalidValue(field, value.tolist(), "must be one number, flag or text")
    value = value.item() if isinstance(value, np.generic | np.ndarray) else value
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    return float(value) if abs(value) < 2**1023 else math.inf
