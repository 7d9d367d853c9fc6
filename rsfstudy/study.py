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

from rsfstudy.axis import Axis, Row, check_text, is_list, plain, select, spread
from rsfstudy.claims import Claim
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import TAKEN, Measure, is_name
from rsfstudy.reduce import Reduction
from rsfstudy.scene import FIELDS, Scene

#: Fields that only scenes with variable normal stress have.
_OF_VARIABLE_NORMAL_STRESS = ("alpha", "phi")
#: Most values of a list that are shown.
_MOST_SHOWN = 8


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
            check_text(name, getattr(self, name))
        whole = isinstance(self.version, int) and not isinstance(self.version, bool)
        if not whole or self.version < 1:
            raise InvalidValue("version", self.version, "must be a whole number, 1 or more")
        if not isinstance(self.overrides, Mapping):
            raise InvalidValue("overrides", self.overrides, "must map names to values")
        self._check_parts()
        for name, value in self.describe().items():
            try:
                json.dumps(value)
            except (TypeError, ValueError) as error:
                raise InvalidValue(name, value, f"must be plain data ({error})") from error
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
        self.measure.check()
        known = list(self.measure.variables)
        for reduction in self.reductions:
            if not is_name(reduction.name) or reduction.name in TAKEN:
                raise InvalidValue("reduction", reduction.name, "names something else, or nothing")
            if reduction.of not in known:
                raise InvalidValue("reduction of", reduction.of, "is not measured", choices=known)
            known.append(reduction.name)
        taken = {*known, *self.measure.inner_coordinates, *(TAKEN - set(FIELDS))}
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
        values = list(value) if is_list(value) else [value]
        for index, axis in enumerate(self.axes):
            if name == axis.dimension:
                changed = select(axis, values) if axis.labels is not None else Axis(name, values)
            elif name in axis.fields:
                changed = spread(axis, name, values)
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
        if is_list(value):
            return replace(self, axes=(Axis(name, values), *self.axes))
        return replace(self, base=self.base.with_(**{name: plain(value)}))

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


def _plain_data(overrides: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: [plain(v) for v in value] if is_list(value) else plain(value)
        for name, value in overrides.items()
    }


def settings(overrides: Mapping[str, Any]) -> str:
    """Overrides as one types them, long lists cut short."""
    texts = {
        name: value if isinstance(value, list) else [value] for name, value in overrides.items()
    }
    return ", ".join(f"{name}={_listed(values)}" for name, values in texts.items())


def _listed(values: Sequence[Any]) -> str:
    shown = [short(value) for value in values]
    return ",".join(shown if len(shown) <= _MOST_SHOWN else [*shown[:3], "...", shown[-1]])


def short(value: Any) -> str:
    """A value with the digits a reader wants."""
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
