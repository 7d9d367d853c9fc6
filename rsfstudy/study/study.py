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

from rsfstudy._deprecation import renamed_keywords, renamed_members
from rsfstudy.axes import Axis, AxisRow, check_storable_text
from rsfstudy.error_boundary import error_boundary, guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import is_sequence_of_axis_values
from rsfstudy.measures import Measure
from rsfstudy.motion import Accuracy, find_user_stepper
from rsfstudy.quantities import Quantity
from rsfstudy.rig import (
    RATIO_FIELD_BY_DIMENSIONAL_NAME,
    LatticeScenesOnRig,
    Rig,
    axis_name_and_units,
    convert_axis_to_stated_units,
    convert_values_to_units,
    replace_rig_quantity,
)
from rsfstudy.rig import make_axis_with_units as axis_in_units
from rsfstudy.slider import (
    PART_SELECTING_FIELDS,
    SLOT_NAMES,
    STIFFNESS_FIELDS,
    Scene,
    UserPart,
    find_inapplicable_fields,
    replace_names_by_user_parts,
    scene_field_quantities,
)
from rsfstudy.study import declaration_checks
from rsfstudy.study.axis_overrides import replace_field_values, select_axis_points, to_plain_values
from rsfstudy.study.claims import Claim
from rsfstudy.study.figure_declarations import check_figure, name_of_figure
from rsfstudy.study.lattice_cell import Cell, CellChanges
from rsfstudy.study.reductions.application import Reduction
from rsfstudy.study.study_html import study_html
from rsfstudy.study.user_parts import find_named_user_parts, user_field_quantities

#: Most bytes of the name of a study: a file name has at most 255, and endings follow.
_MAX_NAME_BYTES = 200
#: Fields that decide what fills a slot.
_FIELDS_THAT_SELECT_PARTS = frozenset({*SLOT_NAMES, *PART_SELECTING_FIELDS})
#: What states the same as another field does: of slip rates and of the spring.
_EQUIVALENT_FIELD = {
    **RATIO_FIELD_BY_DIMENSIONAL_NAME,
    **{ratio: name for name, ratio in RATIO_FIELD_BY_DIMENSIONAL_NAME.items()},
    **dict(zip(STIFFNESS_FIELDS, STIFFNESS_FIELDS[::-1], strict=True)),
}


@renamed_keywords
@renamed_members
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
    rig : Rig, optional
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
    rig: Rig | None = None
    version: int = 1
    overrides: Mapping[str, Any] = field(default_factory=dict)
    #: The file of a study that is no named one.
    source_file: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InvalidValue("name", self.name, "must be a Python identifier: it names files")
        if len(self.name.encode()) > _MAX_NAME_BYTES:
            rule = f"must have at most {_MAX_NAME_BYTES} bytes, because it names files"
            raise InvalidValue("name", self.name, rule)
        for name in ("title", "summary", "source_file"):
            check_storable_text(name, getattr(self, name))
        check_figure(self.plot)
        whole = isinstance(self.version, int) and not isinstance(self.version, bool)
        if not whole or self.version < 1:
            raise InvalidValue("version", self.version, "must be a whole number, 1 or more")
        if not isinstance(self.overrides, Mapping):
            raise InvalidValue("overrides", self.overrides, "must map names to values")
        declaration_checks.check_types(vars(self))
        if self.rig is not None:
            object.__setattr__(
                self, "axes", [convert_axis_to_stated_units(axis) for axis in self.axes]
            )
        declaration_checks.check_name_clashes(self.measure, self.reductions, self.axes)
        declaration_checks.check_user_fields(self.measure, self.reductions, self.scene_fields)
        declaration_checks.check_axis_fields(
            self.measure, self.axes, self.scene_fields, self.scene_builder
        )
        varied = [axis.rows for axis in self.axes if not set(axis.fields) <= self.scene_field_names]
        changes = (self.split_rows(rows)[1] for rows in itertools.product(*varied))
        declaration_checks.check_outputs_do_not_vary(self.measure, changes)
        declaration_checks.check_axes_are_distinct(self.axes)
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
    def user_parts(self) -> Mapping[str, UserPart]:
        """Parts of the slider that are the user's own, by name, as they were when the study was
        declared.
        """
        parts: dict[str, UserPart] = {}
        for axis in self.axes:
            parts |= find_named_user_parts(axis.fields, axis.rows)
        parts |= {part.name: part for part in self.base.user_parts}
        return dict(sorted(parts.items()))

    @cached_property
    def user_classes(self) -> tuple[type | UserPart, ...]:
        """The measure, and parts and stepper that are the user's own: what own code starts at."""
        return (
            *self.measure.code_classes,
            *self.user_parts.values(),
            *find_user_stepper(self.accuracy.engine),
        )

    @cached_property
    def scene_fields(self) -> tuple[str, ...]:
        """Fields that its scenes may have: those of every scene, and those of its own parts."""
        return tuple(scene_field_quantities(self.user_parts.values()))

    @cached_property
    def scene_field_names(self) -> frozenset[str]:
        """Fields of its axes, and others, that decide the scene of a cell."""
        return frozenset({*self.scene_fields, *self.units})

    @cached_property
    def scene_builder(self) -> LatticeScenesOnRig | None:
        """What makes scenes of axes in units, in a study of a rig."""
        return LatticeScenesOnRig(self.rig, self.base, self.axes) if self.rig else None

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of the fields of its axes that are in units."""
        return {name: units for axis in self.axes for name, units in axis.units.items()}

    def scene_fields_of_row(self, row: AxisRow) -> AxisRow:
        """The fields of a scene that differ from the base where axes have these values."""
        return self.scene_builder.compute_scene_fields(row) if self.scene_builder else row

    @property
    def quantities(self) -> dict[str, Quantity]:
        """Quantities that its own parts and its measure describe, by name; the vocabulary has
        none of them.
        """
        stated = *user_field_quantities(self.user_parts.values()), *self.measure.quantities
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
            cell = self._build_cell(rows)
            unused = {name for name in unused if cell.scene.as_dict().get(name) is None}
            yield cell
        for axis in self.axes:
            for name in axis.fields:
                if name in unused:
                    raise InvalidValue(axis.dimension, name, "has no effect in any cell")

    def cell(self, number: int) -> Cell:
        """One cell, by its number in row-major order."""
        return self._build_cell(self._axis_rows_of_cell(number))

    def cell_changes(self, number: int) -> CellChanges:
        """What the axes change in one cell, of which no scene is made here."""
        return self._compute_cell_changes(self._axis_rows_of_cell(number))

    def _axis_rows_of_cell(self, cell_number: int) -> list[AxisRow]:
        """The row of each axis that makes a cell."""
        places = np.unravel_index(cell_number, self.shape)
        return [axis.rows[i] for axis, i in zip(self.axes, places, strict=True)]

    def scenes(self) -> Iterator[Scene]:
        """The scene of each cell, in row-major order; raises as `cells` does."""
        return (cell.scene for cell in self.cells())

    def scene(self, number: int) -> Scene:
        """The scene of one cell, by its number in row-major order."""
        return self.cell(number).scene

    def describe_cell(self, cell: int) -> str:
        """Where a cell is on the axes, in words."""
        at = zip(self.axes, np.unravel_index(cell, self.shape), strict=True)
        return ", ".join(f"{axis.dimension} = {axis.point_names[i]}" for axis, i in at)

    def split_rows(self, rows: Sequence[AxisRow]) -> tuple[dict[str, Any], dict[str, Any]]:
        """The fields of the scene, and those of the measure, that rows set."""
        split: tuple[dict[str, Any], dict[str, Any]] = {}, {}
        for row in rows:
            for name, value in row.items():
                split[name not in self.scene_field_names][name] = value
        return split

    @cached_property
    def _base_fields(self) -> dict[str, Any]:
        return self.base.as_dict()

    @cached_property
    def _fields_without_meaning(self) -> frozenset[str]:
        """Fields without meaning where no axis decides what fills a slot."""
        parts = self.user_parts
        return find_inapplicable_fields(
            replace_names_by_user_parts(self._base_fields, parts), parts.values()
        )

    def _compute_cell_changes(self, axis_rows: Sequence[AxisRow]) -> CellChanges:
        given, of_measure = self.split_rows(axis_rows)
        of_scene = self.scene_fields_of_row(given)
        if _FIELDS_THAT_SELECT_PARTS.isdisjoint(of_scene) and _FIELDS_THAT_SELECT_PARTS.isdisjoint(
            given
        ):
            kept = {
                n: value for n, value in of_scene.items() if n not in self._fields_without_meaning
            }
            return CellChanges(kept, of_measure)
        # a row that states a choice together with a field it makes meaningless must be refused
        stated = {
            name
            for row in axis_rows
            if not _FIELDS_THAT_SELECT_PARTS.isdisjoint(row)
            for name in row
        }
        parts = self.user_parts
        values = replace_names_by_user_parts({**self._base_fields, **of_scene}, parts)
        meaningless = find_inapplicable_fields(values, parts.values()) - stated
        return CellChanges({n: values[n] for n in of_scene if n not in meaningless}, of_measure)

    def _build_cell(self, axis_rows: Sequence[AxisRow]) -> Cell:
        try:
            return self._compute_cell_changes(axis_rows).build_cell(self.base)
        except InvalidValue as error:
            place = ", ".join(
                f"{name}={value!r}" for row in axis_rows for name, value in row.items()
            )
            raise error.with_location(f"cell {place}") from error

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
        study, given = self, {name: to_plain_values(name, v) for name, v in overrides.items()}
        # parts of the user's own come first: they bring the fields that others may be
        own = [
            name
            for name in given
            if find_named_user_parts([name], _rows_of_overridden_field(name, given[name]))
        ]
        selections = [axis.dimension for axis in self.axes if not axis.is_single_field]
        for name in dict.fromkeys([*own, *filter(given.__contains__, selections), *given]):
            study = study._override_field(name, given[name])
        return replace(study, overrides={**self.overrides, **given})

    def _override_field(self, field_name: str, value: Any) -> Study:
        values = list(value) if is_sequence_of_axis_values(value) else [value]
        of_rig = self.rig is not None and bool(values)
        field_name, units = (
            axis_name_and_units(field_name, values[0]) if of_rig else (field_name, None)
        )
        for index, axis in enumerate(self.axes):
            if changed := self._override_axis(axis, field_name, values):
                return replace(self, axes=(*self.axes[:index], changed, *self.axes[index + 1 :]))
        of_rig = units is not None
        known = dict.fromkeys((*self.dimensions, *self.scene_fields, *self.measure.plain_fields))
        if (
            field_name not in known
            and not of_rig
            and not find_named_user_parts(
                [field_name], _rows_of_overridden_field(field_name, values)
            )
        ):
            rule = "is neither an axis nor a field of the scene or of the measure"
            raise declaration_checks.unknown_name_error("override", field_name, rule, known)
        declaration_checks.check_fields_not_solved_for(self.measure, [field_name])
        if is_sequence_of_axis_values(value):
            return replace(self, axes=(self._make_axis(field_name, values), *self.axes))
        if self.rig is not None and of_rig:
            rig, base = replace_rig_quantity(self.rig, self.base, field_name, value)
            return replace(self, rig=rig, base=base)
        if field_name in self.scene_field_names | SLOT_NAMES:
            changes = replace_names_by_user_parts({field_name: value}, self.user_parts)
            return replace(self, base=self.base.with_(**changes))
        return replace(self, measure=self.measure.with_(**{field_name: value}))

    def _override_axis(self, axis: Axis, field_name: str, values: Sequence[Any]) -> Axis | None:
        """An axis with other values, if it is of this field, or of one that states the same."""
        units = axis.units.get(field_name, "")
        if field_name == axis.dimension:
            return (
                self._make_axis(field_name, values, units)
                if axis.is_single_field
                else select_axis_points(axis, values)
            )
        if field_name in axis.fields:
            declaration_checks.check_override_of_partly_set_field(
                self.base, self.user_parts, axis, field_name, values
            )
            return replace_field_values(
                axis,
                field_name,
                convert_values_to_units(field_name, values, units) if units else values,
            )
        if _EQUIVALENT_FIELD.get(field_name) not in axis.fields:
            return None
        if axis.labels is not None:
            rule = f"states what {_EQUIVALENT_FIELD[field_name]} does along {axis.dimension}"
            raise InvalidValue(
                field_name, values, rule, remedy=f"Give {_EQUIVALENT_FIELD[field_name]}."
            )
        return self._make_axis(field_name, values)

    def _make_axis(self, field_name: str, values: Sequence[Any], units: str = "") -> Axis:
        """An axis of a field, whose plain numbers are in these units in a study of a rig."""
        if self.rig is None:
            return Axis(field_name, values)
        return axis_in_units(field_name, values, "" if isinstance(values[0], str) else units)

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
            "plot": name_of_figure(self.plot, self.name),
            "references": list(self.references),
            "overrides": dict(self.overrides),
            **({"laboratory": self.rig.as_dict()} if self.rig else {}),
        }

    def _repr_html_(self) -> str:
        heading = f"{self.name}: {self.title} ({self.size:,} cells)"
        return study_html(heading, self.axes, self.base, self.measure, self.quantities)


def _rows_of_overridden_field(field_name: str, value: Any) -> list[AxisRow]:
    """The rows of a field that is given one value or a list of them."""
    return [{field_name: v} for v in (value if is_sequence_of_axis_values(value) else [value])]
