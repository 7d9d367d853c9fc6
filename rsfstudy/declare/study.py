"""The declaration of a study: labelled axes laid over a scene, a measure, and what is made of
it.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from rsfstudy.axes.axis import Axis, Row, check_text, plain_values
from rsfstudy.axes.overrides import select, with_values
from rsfstudy.declare import checks, rigs
from rsfstudy.declare.cell import Cell, Changes
from rsfstudy.declare.claims import Claim
from rsfstudy.declare.figure import check_figure, figure_name
from rsfstudy.declare.shown import study_html
from rsfstudy.error_boundary import error_boundary, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import own_stepper
from rsfstudy.quantity import Quantity
from rsfstudy.reduce import Reduction
from rsfstudy.rig.axes import axis as axis_in_units
from rsfstudy.rig.axes import in_units, name_on_axis, numbers_in, si_units
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.lattice import Cells
from rsfstudy.rig.quantities import ALSO
from rsfstudy.slider.assembly import without_meaning
from rsfstudy.slider.registry import (
    CALLERS,
    SLOT_NAMES,
    Own,
    by_class,
    fields_with,
    own_named,
    quantities_with,
)
from rsfstudy.slider.scene import Scene
from rsfstudy.wording import is_list

#: Most bytes of the name of a study: a file name has at most 255, and endings follow.
_LONGEST_NAME = 200
#: Fields that decide what fills a slot.
_CHOOSING = frozenset({*SLOT_NAMES, *CALLERS})
#: Most bytes of the name of a study, which leaves room for the suffixes of its files.
_LONGEST_NAME = 200


@guard_methods
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
    plot : Figure, function, module or str
        What draws the study: panels, a function ``draw(dataset, axes)`` or a module of such
        functions, or the name of a named study, whose figure is used. The default, "lines", draws
        maps where two axes are of numbers.
    references : sequence of str
        Sources of the study.
    accuracy : Accuracy
        Accuracy of each cell.
    laboratory : Laboratory, optional
        The rig that the base is a scene of. Axes may be of its quantities, and are in units; plain
        numbers are in SI units then.
    version : int
        Raised when the meaning of the results changes.

    Raises
    ------
    InvalidValue
        For axes that repeat a dimension, vary the same field, one that nothing has, or one that
        decides which numbers are measured; and for any cell that makes no meaningful scene.
    """

    name: str
    title: str
    base: Scene
    axes: Sequence[Axis]
    measure: Measure
    summary: str = ""
    reductions: Sequence[Reduction] = ()
    claims: Sequence[Claim] = ()
    plot: Any = "lines"
    references: Sequence[str] = ()
    accuracy: Accuracy = field(default_factory=Accuracy)
    laboratory: Laboratory | None = None
    version: int = 1
    overrides: Mapping[str, Any] = field(default_factory=dict)
    #: The file of a study that is no named one.
    declared_in: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InvalidValue("name", self.name, "must be a Python identifier: it names files")
        if len(self.name.encode()) > _LONGEST_NAME:
            rule = f"must have at most {_LONGEST_NAME} bytes, because it names files"
            raise InvalidValue("name", self.name, rule)
        for name in ("title", "summary", "declared_in"):
            check_text(name, getattr(self, name))
        check_figure(self.plot)
        whole = isinstance(self.version, int) and not isinstance(self.version, bool)
        if not whole or self.version < 1:
            raise InvalidValue("version", self.version, "must be a whole number, 1 or more")
        if not isinstance(self.overrides, Mapping):
            raise InvalidValue("overrides", self.overrides, "must map names to values")
        checks.parts(self)
        if self.laboratory is not None:
            object.__setattr__(self, "axes", [in_units(axis) for axis in self.axes])
        checks.names(self)
        checks.own_fields(self)
        checks.fields(self)
        checks.apart(self.axes)
        for name, value in self.describe().items():
            try:
                json.dumps(value)
            except (TypeError, ValueError) as error:
                raise InvalidValue(name, value, f"must be plain data ({error})") from error

    @staticmethod
    @error_boundary
    def caption(docstring: str | None) -> str:
        """The second paragraph of a module's docstring: a summary at the top of the file."""
        paragraphs = (docstring or "").split("\n\n", 2)
        return " ".join(" ".join(paragraphs[1:2]).split())

    # ---- parts of the user's own ------------------------------------------------------------

    @cached_property
    def own_parts(self) -> Mapping[str, Own]:
        """Parts of the slider that are the user's own, by name, as they were when the study was
        declared.
        """
        parts: dict[str, Own] = {}
        for axis in self.axes:
            parts |= own_named(axis.fields, axis.rows)
        parts |= {part.name: part for part in self.base.own_parts}
        return dict(sorted(parts.items()))

    @cached_property
    def own_classes(self) -> tuple[type | Own, ...]:
        """The measure, and parts and stepper that are the user's own: what own code starts at."""
        return *self.measure.classes, *self.own_parts.values(), *own_stepper(self.accuracy.engine)

    @cached_property
    def scene_fields(self) -> tuple[str, ...]:
        """Fields that its scenes may have: those of every scene, and those of its own parts."""
        return tuple(fields_with(self.own_parts.values()))

    @cached_property
    def of_scene(self) -> frozenset[str]:
        """Fields of its axes, and others, that decide the scene of a cell."""
        return frozenset({*self.scene_fields, *self.units})

    @cached_property
    def rig(self) -> Cells | None:
        """What makes scenes of axes in units, in a study of a rig."""
        return Cells(self.laboratory, self.base, self.axes) if self.laboratory else None

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the fields of its axes that are in units."""
        return {name: units for axis in self.axes for name, units in axis.units.items()}

    def fields_of(self, row: Row) -> Row:
        """The fields of a scene that differ from the base where axes have these values."""
        return self.rig.fields(row) if self.rig else row

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Quantities that its own parts and its measure describe, by name; the vocabulary has
        none of them.
        """
        stated = *quantities_with(self.own_parts.values()), *self.measure.quantities
        return {about.name: about for about in stated}

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

    def cells(self) -> Iterator[Cell]:
        """Each cell, in row-major order.

        Raises
        ------
        InvalidValue
            For a cell that makes no meaningful scene, naming its place on the axes.
        """
        unused = {n for axis in self.axes for n in axis.fields if n in self.scene_fields}
        for rows in itertools.product(*(axis.rows for axis in self.axes)):
            cell = self._cell(rows)
            unused = {name for name in unused if cell.scene.as_dict().get(name) is None}
            yield cell
        for axis in self.axes:
            for name in axis.fields:
                if name in unused:
                    raise InvalidValue(axis.dimension, name, "has no effect in any cell")

    def cell(self, number: int) -> Cell:
        """One cell, by its number in row-major order."""
        return self._cell(self._at(number))

    def changes(self, number: int) -> Changes:
        """What the axes change in one cell, of which no scene is made here."""
        return self._changes(self._at(number))

    def _at(self, number: int) -> list[Row]:
        """The row of each axis that makes a cell."""
        places = np.unravel_index(number, self.shape)
        return [axis.rows[i] for axis, i in zip(self.axes, places, strict=True)]

    def scenes(self) -> Iterator[Scene]:
        """The scene of each cell, in row-major order; raises as `cells` does."""
        return (cell.scene for cell in self.cells())

    def scene(self, number: int) -> Scene:
        """The scene of one cell, by its number in row-major order."""
        return self.cell(number).scene

    def place(self, cell: int) -> str:
        """Where a cell is on the axes, in words."""
        at = zip(self.axes, np.unravel_index(cell, self.shape), strict=True)
        return ", ".join(f"{axis.dimension} = {axis.points[i]}" for axis, i in at)

    def split(self, rows: Sequence[Row]) -> tuple[dict[str, Any], dict[str, Any]]:
        """The fields of the scene, and those of the measure, that rows set."""
        split: tuple[dict[str, Any], dict[str, Any]] = {}, {}
        for row in rows:
            for name, value in row.items():
                split[name not in self.of_scene][name] = value
        return split

    @cached_property
    def _shared(self) -> dict[str, Any]:
        return self.base.as_dict()

    @cached_property
    def _meaningless(self) -> frozenset[str]:
        """Fields without meaning where no axis decides what fills a slot."""
        parts = self.own_parts
        return without_meaning(by_class(self._shared, parts), parts.values())

    def _changes(self, rows: Sequence[Row]) -> Changes:
        given, of_measure = self.split(rows)
        of_scene = self.fields_of(given)
        if _CHOOSING.isdisjoint(of_scene) and _CHOOSING.isdisjoint(given):
            kept = {n: value for n, value in of_scene.items() if n not in self._meaningless}
            return Changes(kept, of_measure)
        # a row that states a choice together with a field it makes meaningless must be refused
        stated = {name for row in rows if not _CHOOSING.isdisjoint(row) for name in row}
        parts = self.own_parts
        values = by_class({**self._shared, **of_scene}, parts)
        meaningless = without_meaning(values, parts.values()) - stated
        return Changes({n: values[n] for n in of_scene if n not in meaningless}, of_measure)

    def _cell(self, rows: Sequence[Row]) -> Cell:
        try:
            return self._changes(rows).of(self.base)
        except InvalidValue as error:
            place = ", ".join(f"{name}={value!r}" for row in rows for name, value in row.items())
            raise error.at(f"cell {place}") from error

    # ---- other axes ---------------------------------------------------------------------------

    def with_(self, /, **overrides: Any) -> Study:
        """The study with other axis values or other fixed values.

        A list for a field that is fixed makes it an axis; a field along a zipped axis changes only
        in the points that use it, where each new value makes a point of its own; labels select
        points of a zipped axis, before fields change.

        Raises
        ------
        InvalidValue
            For a name that is neither an axis nor a field of the scene or of the measure, for
            values that make no axis, and for a field that some points of a zipped axis state and
            the others take from the base.
        """
        study, given = self, {name: plain_values(name, v) for name, v in overrides.items()}
        # parts of the user's own come first: they bring the fields that others may be
        own = [name for name in given if own_named([name], _rows(name, given[name]))]
        selections = [axis.dimension for axis in self.axes if not axis.is_plain]
        for name in dict.fromkeys([*own, *filter(given.__contains__, selections), *given]):
            study = study._override(name, given[name])
        return replace(study, overrides={**self.overrides, **given})

    def _override(self, name: str, value: Any) -> Study:
        values = list(value) if is_list(value) else [value]
        of_rig = self.laboratory is not None and bool(values)
        name = name_on_axis(name, values[0]) if of_rig else name
        for index, axis in enumerate(self.axes):
            if changed := self._changed(axis, name, values):
                return replace(self, axes=(*self.axes[:index], changed, *self.axes[index + 1 :]))
        of_rig = of_rig and si_units(name, values[0]) is not None
        known = dict.fromkeys((*self.dimensions, *self.scene_fields, *self.measure.plain_fields))
        if name not in known and not of_rig and not own_named([name], _rows(name, values)):
            rule = "is neither an axis nor a field of the scene or of the measure"
            raise checks.unknown("override", name, rule, known)
        checks.sought(self, [name])
        if is_list(value):
            return replace(self, axes=(self._axis(name, values), *self.axes))
        if of_rig:
            return replace(self, **rigs.fixed(self, name, value))
        if name in self.of_scene | SLOT_NAMES:
            changes = by_class({name: value}, self.own_parts)
            return replace(self, base=self.base.with_(**changes))
        return replace(self, measure=self.measure.with_(**{name: value}))

    def _changed(self, axis: Axis, name: str, values: Sequence[Any]) -> Axis | None:
        """An axis with other values, if it is of this field, or of one that states the same."""
        units = axis.units.get(name, "")
        if name == axis.dimension:
            return self._axis(name, values, units) if axis.is_plain else select(axis, values)
        if name in axis.fields:
            checks.override(self, axis, name, values)
            return with_values(axis, name, numbers_in(name, values, units) if units else values)
        if ALSO.get(name) not in axis.fields:
            return None
        if axis.labels is not None:
            rule = f"states what {ALSO[name]} does along {axis.dimension}"
            raise InvalidValue(name, values, rule, remedy=f"Give {ALSO[name]}.")
        return self._axis(name, values)

    def _axis(self, name: str, values: Sequence[Any], units: str = "") -> Axis:
        """An axis of a field, whose plain numbers are in these units in a study of a rig."""
        if self.laboratory is None:
            return Axis(name, values)
        return axis_in_units(name, values, "" if isinstance(values[0], str) else units)

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
            "plot": figure_name(self.plot, self.name),
            "references": list(self.references),
            "overrides": dict(self.overrides),
            **({"laboratory": self.laboratory.as_dict()} if self.laboratory else {}),
        }

    def _repr_html_(self) -> str:
        return study_html(self)


def _rows(name: str, value: Any) -> list[Row]:
    """The rows of a field that is given one value or a list of them."""
    return [{name: v} for v in (value if is_list(value) else [value])]
