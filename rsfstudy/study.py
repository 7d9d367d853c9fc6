"""The declaration of a study: labelled axes laid over a scene, a measure, and what is made of
it.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from rsfstudy.claims import Claim
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.reduce import Reduction
from rsfstudy.scene import FIELDS, Scene, unknown_field
from rsfstudy.vocabulary import DERIVED

#: Fields that only scenes with variable normal stress have.
_OF_VARIABLE_NORMAL_STRESS = ("alpha", "phi")

Row = Mapping[str, Any]


@dataclass(frozen=True, init=False)
class Axis:
    """One labelled dimension of a lattice.

    Parameters
    ----------
    dimension : str
        Name of the dimension; for a plain axis the field of the scene it varies.
    values : sequence, or mapping of str to mapping
        The values of that field; or, for a zipped axis, a label for each point and the fields set
        there, as in ``{"constant": {"normal_stress": "constant"}, ...}``.

    Raises
    ------
    InvalidValue
        For an axis that is empty, repeats a value, holds a non-finite one or names no field.
    """

    dimension: str
    rows: tuple[Row, ...]
    labels: tuple[str, ...] | None

    def __init__(
        self, dimension: str, values: Sequence[Any] | np.ndarray | Mapping[str, Row]
    ) -> None:
        if not isinstance(dimension, str) or not dimension.isidentifier():
            raise InvalidValue("axis", dimension, "must be named by a Python identifier")
        labels: tuple[str, ...] | None = None
        if isinstance(values, Mapping):
            labels, rows = tuple(values), _rows(dimension, values)
        else:
            if dimension not in FIELDS:
                raise unknown_field(dimension)
            listed = [values] if isinstance(values, str) else values
            if not _is_list(listed):
                raise InvalidValue(dimension, values, "must be a list of values")
            rows = tuple({dimension: _plain(value)} for value in listed)
            if any(row[dimension] is None for row in rows):
                raise InvalidValue(dimension, None, "must be a value on an axis")
        object.__setattr__(self, "dimension", dimension)
        object.__setattr__(self, "rows", rows)
        object.__setattr__(self, "labels", labels)
        self._check()

    def _check(self) -> None:
        if not self.rows:
            raise InvalidValue("axis", self.dimension, "has no values")
        for row in self.rows:
            for name, value in row.items():
                if name not in FIELDS:
                    raise unknown_field(name)
                if not isinstance(value, float | str | bool | None):
                    raise InvalidValue(name, value, "must be a number, a flag or a text")
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
        """Fields of the scene that vary along the axis."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row))

    def __len__(self) -> int:
        return len(self.rows)

    def describe(self) -> dict[str, Any]:
        """The axis as plain data."""
        if self.labels is None:
            return {
                "dimension": self.dimension,
                "values": [row[self.dimension] for row in self.rows],
            }
        rows = {label: dict(row) for label, row in zip(self.labels, self.rows, strict=True)}
        return {"dimension": self.dimension, "values": rows}


@dataclass(frozen=True, kw_only=True)
class Study:
    """A parameter study, declared.

    Parameters
    ----------
    name : str
        Name of the study and of its files.
    title, summary : str
        One line, and a caption.
    base : Scene
        What all cells share.
    axes : sequence of Axis
        The dimensions of the lattice, outermost first.
    measure : Measure
        What is measured in each cell.
    reductions : sequence of Reduction
        What the lattice is reduced to.
    claims : sequence of Claim
        Published values the results are held against.
    plot : str
        Module of `rsfstudy.plots` that draws the study.
    references : sequence of str
        Sources of the study.
    accuracy : Accuracy
        Accuracy of each cell.
    version : int
        Raised when the meaning of the results changes.

    Raises
    ------
    InvalidValue
        For axes that repeat a dimension or vary the same field, and for any cell that makes no
        meaningful scene.
    """

    name: str
    title: str
    base: Scene
    axes: Sequence[Axis]
    measure: Measure
    summary: str = ""
    reductions: Sequence[Reduction] = ()
    claims: Sequence[Claim] = ()
    plot: str = "lines"
    references: Sequence[str] = ()
    accuracy: Accuracy = field(default_factory=Accuracy)
    version: int = 1
    overrides: Mapping[str, Any] = field(default_factory=dict)
    #: The file of a study that is no named one.
    declared_in: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InvalidValue("name", self.name, "must be a Python identifier: it names files")
        for name in ("title", "summary", "plot", "declared_in"):
            _check_text(name, getattr(self, name))
        whole = isinstance(self.version, int) and not isinstance(self.version, bool)
        if not whole or self.version < 1:
            raise InvalidValue("version", self.version, "must be a whole number, 1 or more")
        try:
            json.dumps(dict(self.overrides))
        except (TypeError, ValueError) as error:
            raise InvalidValue("overrides", self.overrides, "must be plain data") from error
        self._check_parts()
        taken: dict[str, str] = {}
        for axis in self.axes:
            for name in {axis.dimension, *axis.fields}:
                if name in taken:
                    raise InvalidValue(
                        "axis", axis.dimension, f"varies {name!r}, as {taken[name]!r} does already"
                    )
                taken[name] = axis.dimension

    def _check_parts(self) -> None:
        parts: list[tuple[str, Sequence[Any], type]] = [
            ("base", [self.base], Scene),
            ("measure", [self.measure], Measure),
            ("axes", self.axes, Axis),
            ("reductions", self.reductions, Reduction),
            ("claims", self.claims, Claim),
            ("references", self.references, str),
            ("accuracy", [self.accuracy], Accuracy),
        ]
        for name, values, kind in parts:
            if not isinstance(values, list | tuple):
                raise InvalidValue(name, values, f"must be a list of {kind.__name__} objects")
            for value in values:
                if not isinstance(value, kind):
                    raise InvalidValue(name, value, f"must be made of {kind.__name__} objects")
        if not self.axes:
            raise InvalidValue("axes", self.axes, "must hold at least one axis")
        known = list(self.measure.variables)
        for reduction in self.reductions:
            if reduction.of not in known:
                raise InvalidValue("reduction of", reduction.of, "is not measured", choices=known)
            known.append(reduction.name)
        kept = ("status", "message", "rhs_evaluations", "wall_time")
        taken = {*known, *kept, *self.measure.inner_coordinates, *DERIVED}
        for axis in self.axes:
            self._check_sought(axis.fields)
            if axis.dimension in taken:
                raise InvalidValue("axis", axis.dimension, "is the name of something measured")

    def _check_sought(self, fields: Sequence[str]) -> None:
        for name in fields:
            if name in self.measure.sought:
                raise InvalidValue(name, "...", "is what the measure looks for, and has no effect")

    # ---- the lattice ------------------------------------------------------------------------

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Dimensions, outermost first."""
        return tuple(axis.dimension for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of the dimensions."""
        return tuple(len(axis) for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    def scenes(self) -> Iterator[Scene]:
        """The scene of each cell, in row-major order.

        Raises
        ------
        InvalidValue
            For a cell that makes no meaningful scene, naming its place on the axes.
        """
        used: set[str] = set()
        for rows in itertools.product(*(axis.rows for axis in self.axes)):
            scene = self._scene(rows)
            used |= {name for name in FIELDS if getattr(scene, name) is not None}
            yield scene
        for axis in self.axes:
            for name in axis.fields:
                if name not in used:
                    raise InvalidValue(axis.dimension, name, "has no effect in any cell")

    def scene(self, cell: int) -> Scene:
        """The scene of one cell, by its number in row-major order."""
        places = np.unravel_index(cell, self.shape)
        return self._scene([axis.rows[i] for axis, i in zip(self.axes, places, strict=True)])

    def _scene(self, rows: Sequence[Row]) -> Scene:
        fields = self.base.as_dict()
        for row in rows:
            fields.update(row)
        if fields["normal_stress"] == "constant":
            # one row that states both is contradictory, and Scene says so
            stated = next((row for row in rows if "normal_stress" in row), {})
            for name in _OF_VARIABLE_NORMAL_STRESS:
                if stated.get(name) is None:
                    fields[name] = None
        try:
            return Scene(**fields)
        except InvalidValue as error:
            place = ", ".join(f"{name}={value!r}" for row in rows for name, value in row.items())
            raise error.at(f"cell {place}") from error

    # ---- other axes ---------------------------------------------------------------------------

    def with_(self, /, **overrides: Any) -> Study:
        """The study with other axis values or other fixed values.

        A list for a field that is fixed makes it an axis; a field along a zipped axis changes only
        in the points that use it, where each new value makes a point of its own; labels select
        points of a zipped axis.

        Raises
        ------
        InvalidValue
            For a name that is neither an axis nor a field, and for values that make no axis.
        """
        study = self
        for name, value in overrides.items():
            study = study._override(name, value)
        return replace(study, overrides={**self.overrides, **_plain_data(overrides)})

    def _override(self, name: str, value: Any) -> Study:
        values = list(value) if _is_list(value) else [value]
        for index, axis in enumerate(self.axes):
            if name == axis.dimension:
                changed = _select(axis, values) if axis.labels is not None else Axis(name, values)
            elif name in axis.fields:
                changed = _spread(axis, name, values)
            else:
                continue
            return replace(self, axes=(*self.axes[:index], changed, *self.axes[index + 1 :]))
        if name not in FIELDS:
            raise InvalidValue(
                "override",
                name,
                "is neither an axis nor a field of the scene",
                choices=dict.fromkeys((*self.dimensions, *FIELDS)),
            )
        self._check_sought([name])
        if _is_list(value):
            return replace(self, axes=(Axis(name, values), *self.axes))
        return replace(self, base=self.base.with_(**{name: _plain(value)}))

    def describe(self) -> dict[str, Any]:
        """The whole declaration as plain data."""
        return {
            "name": self.name,
            "title": self.title,
            "summary": self.summary,
            "version": self.version,
            "base": self.base.as_dict(),
            "axes": [axis.describe() for axis in self.axes],
            "measure": self.measure.describe(),
            "accuracy": asdict(self.accuracy),
            "reductions": [reduction.describe() for reduction in self.reductions],
            "claims": [claim.describe() for claim in self.claims],
            "plot": self.plot,
            "references": list(self.references),
            "overrides": dict(self.overrides),
        }


def _check_text(name: str, text: object) -> None:
    """A text that a file can hold."""
    if not isinstance(text, str) or "\0" in text:
        raise InvalidValue(name, text, "must be a text")
    try:
        text.encode()
    except UnicodeError as error:
        raise InvalidValue(name, text, "must be a text that UTF-8 can hold") from error


def _rows(dimension: str, points: Mapping[str, Row]) -> tuple[Row, ...]:
    """The rows of a zipped axis: for each label the fields set there."""
    if dimension in FIELDS:
        raise InvalidValue("axis", dimension, "is a field: a zipped axis needs a name of its own")
    for label, row in points.items():
        _check_text(dimension, label)
        if not label:
            raise InvalidValue(dimension, label, "must be a text that labels a point")
        if not isinstance(row, Mapping) or not row:
            raise InvalidValue(dimension, row, f"must be the fields set at {label!r}")
    return tuple({n: _plain(v) for n, v in row.items()} for row in points.values())


def _select(axis: Axis, labels: Sequence[str]) -> Axis:
    """The points of a zipped axis that bear these labels."""
    assert axis.labels is not None
    rows = dict(zip(axis.labels, axis.rows, strict=True))
    for label in labels:
        if label not in rows:
            raise InvalidValue(axis.dimension, label, "is no point of the axis", choices=rows)
    return Axis(axis.dimension, {label: rows[label] for label in labels})


def _spread(axis: Axis, name: str, values: Sequence[Any]) -> Axis:
    """A zipped axis whose points that use a field take new values of it; the others stay."""
    assert axis.labels is not None
    spread: dict[str, Row] = {}
    for label, row in zip(axis.labels, axis.rows, strict=True):
        if name not in row:
            spread[label] = row
            continue
        for value in values:
            changed = {**row, name: _plain(value)}
            if changed in spread.values():
                continue
            new = f"{name} = {value}"
            if changed == row:
                new = label
            elif new in spread:
                new = f"{label}, {new}"
            spread[new] = changed
    return Axis(axis.dimension, spread)


def _is_list(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim == 1
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _plain(value: Any) -> Any:
    """A value as Python's own number, flag or text; whole numbers as float."""
    value = value.item() if isinstance(value, np.generic) else value
    if not isinstance(value, int) or isinstance(value, bool):
        return value
    return float(value) if abs(value) < 2**1023 else math.inf


def _plain_data(overrides: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: [_plain(v) for v in value] if _is_list(value) else _plain(value)
        for name, value in overrides.items()
    }
