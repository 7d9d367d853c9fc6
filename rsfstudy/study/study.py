"""Declaration of a parameter study.

A ``Study`` combines a base scene, the axes of a lattice, a measure, reductions, claims and a
figure. The constructor checks the declaration. The methods build the scene of each cell and apply
overrides.
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

from rsfstudy._deprecation import accept_former_keyword_names, add_former_member_names
from rsfstudy.axes import Axis, AxisPointFieldValues
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import (
    make_methods_raise_rsfstudy_errors,
    raise_only_rsfstudy_errors,
)
from rsfstudy.formatting import is_sequence_of_axis_values
from rsfstudy.measures import Measure
from rsfstudy.motion import Accuracy, Engine
from rsfstudy.quantities import Quantity
from rsfstudy.rig import Rig, RigAxes, RigAxesToScenesConverter
from rsfstudy.slider import Scene, SceneFields, UserPart
from rsfstudy.study import declaration_checks
from rsfstudy.study.axis_overrides import (
    convert_field_values_to_plain_data,
    replace_field_values,
    select_axis_points,
)
from rsfstudy.study.claims import Claim
from rsfstudy.study.figure_declarations import check_is_figure, get_figure_name_for_declaration
from rsfstudy.study.lattice_cell import Cell, CellFieldChanges
from rsfstudy.study.reductions.reduction_application import Reduction
from rsfstudy.study.study_html import format_study_as_html
from rsfstudy.study.user_defined_parts import (
    find_user_parts_in_axis_rows,
    list_user_field_quantities,
)

#: Maximum length of the name of a study in bytes. Most file systems allow file names of at most 255
#: bytes, and the names of files have suffixes.
_MAX_STUDY_NAME_BYTES = 200
#: Scene fields that select the type of a part of the slider, for example the friction law.
_PART_SELECTING_FIELDS = frozenset(
    {*SceneFields.PART_SLOT_NAMES, *SceneFields.PART_SELECTING_FIELD_NAMES}
)
#: Pairs of equivalent fields. A slip rate can be given as a velocity or as a ratio to the reference
#: velocity. The spring can be given as a stiffness or as a ratio to the critical stiffness.
_EQUIVALENT_FIELD_BY_FIELD_NAME = {
    **RigAxes.RATIO_FIELD_BY_DIMENSIONAL_NAME,
    **{ratio: name for name, ratio in RigAxes.RATIO_FIELD_BY_DIMENSIONAL_NAME.items()},
    **dict(
        zip(
            SceneFields.ALTERNATIVE_NAMES_FOR_STIFFNESS,
            SceneFields.ALTERNATIVE_NAMES_FOR_STIFFNESS[::-1],
            strict=True,
        )
    ),
}


@accept_former_keyword_names
@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Study:
    """Declaration of a parameter study.

    Parameters
    ----------
    name : str
        Name of the study and of its files. The name must be a Python identifier.
    title : str
        Title on one line.
    base : Scene
        Scene with the fields that all cells share.
    axes : sequence of Axis
        Axes of the lattice. The first axis is the outermost dimension.
    measure : Measure
        Measure that is evaluated in each cell.
    summary : str, optional
        Caption of the study.
    reductions : sequence of Reduction, optional
        Reductions that are applied to the results, in order.
    claims : sequence of Claim, optional
        Published values that are compared with the results.
    plot : Figure, callable, module or str, default: "lines"
        Figure of the study. The figure can be a `Figure` of panels, a function ``draw(dataset,
        axes)``, a module with a function ``draw``, or the name of a figure. The name of a named
        study selects the figure of this study. The default draws lines, or maps if two axes are
        numeric.
    references : sequence of str, optional
        Literature references.
    accuracy : Accuracy, optional
        Accuracy of each cell.
    rig : Rig, optional
        Rig of the base scene. In a study with a rig, axes may have units and may vary quantities of
        the rig. If the study has a rig, numbers without units are interpreted in SI units.
    version : int, default: 1
        Version of the study. Increase the version number if the meaning of the results changes.
    overrides : mapping of str to object, optional
        Overrides that `with_` has applied to the declaration.
    source_file : str, optional
        File of the study. Empty for a named study.

    Raises
    ------
    InvalidValue
        If an argument has a wrong type. The error is also raised if two axes have the same
        dimension or vary the same field, if an axis varies an unknown field, or if different cells
        would have different result variables.

    Examples
    --------
    >>> from rsfstudy import Axis, Scene, Study
    >>> from rsfstudy.measures import CriticalStep
    >>> study = Study(
    ...     name="angle",
    ...     title="Critical displacement step against the driving angle",
    ...     base=Scene(law="slip"),
    ...     axes=[Axis("phi", [45, 60]), Axis("b_over_a", [2, 3, 5])],
    ...     measure=CriticalStep(of="displacement_step"),
    ... )
    >>> study.dimensions, study.shape, study.size
    (('phi', 'b_over_a'), (2, 3), 6)
    >>> study.describe_cell(4)
    'phi = 60, b_over_a = 3'
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
    source_file: str = ""

    def __post_init__(self) -> None:
        """Check the declaration."""
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise InvalidValue(
                "name", self.name, "must be a Python identifier, because it is used in file names"
            )
        if len(self.name.encode()) > _MAX_STUDY_NAME_BYTES:
            rule = (
                f"must have at most {_MAX_STUDY_NAME_BYTES} bytes, because it is used in file names"
            )
            raise InvalidValue("name", self.name, rule)
        for name in ("title", "summary", "source_file"):
            Axis.check_storable_text(name, getattr(self, name))
        check_is_figure(self.plot)
        whole = isinstance(self.version, int) and not isinstance(self.version, bool)
        if not whole or self.version < 1:
            raise InvalidValue("version", self.version, "must be a whole number, 1 or more")
        if not isinstance(self.overrides, Mapping):
            raise InvalidValue("overrides", self.overrides, "must map names to values")
        declaration_checks.check_study_field_types(vars(self))
        if self.rig is not None:
            object.__setattr__(
                self,
                "axes",
                [RigAxes.convert_axis_values_to_axis_units(axis) for axis in self.axes],
            )
        declaration_checks.check_name_clashes(self.measure, self.reductions, self.axes)
        declaration_checks.check_user_field_names_are_unused(
            self.measure, self.reductions, self.all_scene_field_names
        )
        declaration_checks.check_axis_fields_and_units(
            self.measure, self.axes, self.all_scene_field_names, self.axis_unit_converter
        )
        varied = [
            axis.rows
            for axis in self.axes
            if not set(axis.fields) <= self.scene_and_rig_field_names
        ]
        changes = (
            self.split_scene_and_measure_fields(rows)[1] for rows in itertools.product(*varied)
        )
        declaration_checks.check_outputs_are_same_in_all_cells(self.measure, changes)
        declaration_checks.check_axes_are_distinct(self.axes)
        for name, value in self.describe().items():
            try:
                json.dumps(value)
            except (TypeError, ValueError) as error:
                raise InvalidValue(
                    name,
                    value,
                    f"must contain only plain data, because the study is stored as JSON ({error})",
                    remedy="Use Python numbers, strings, and tuples of numbers or strings.",
                ) from error

    @staticmethod
    @raise_only_rsfstudy_errors
    def caption(docstring: str | None) -> str:
        r"""Extract the summary of a study from the docstring of its module.

        The summary is the second paragraph of the docstring.

        Parameters
        ----------
        docstring : str or None
            Docstring of the module that declares the study.

        Returns
        -------
        str
            Second paragraph on one line. Empty if there is only one paragraph.

        Examples
        --------
        >>> from rsfstudy import Study
        >>> Study.caption("Title.\n\nFirst line\nof the summary.\n\nDetails.")
        'First line of the summary.'
        """
        paragraphs = (docstring or "").split("\n\n", 2)
        return " ".join(" ".join(paragraphs[1:2]).split())

    # ---- user-defined parts ---------------------------------------------------------------------

    @cached_property
    def user_parts(self) -> Mapping[str, UserPart]:
        """User-defined parts of the slider, by name.

        The constructor stores the parts, so a part that is redefined later does not change the
        study.
        """
        parts: dict[str, UserPart] = {}
        for axis in self.axes:
            parts |= find_user_parts_in_axis_rows(axis.fields, axis.rows)
        parts |= {part.name: part for part in self.base.user_parts}
        return dict(sorted(parts.items()))

    @cached_property
    def user_defined_classes(self) -> tuple[type | UserPart, ...]:
        """User-defined parts, and the classes of the measure and of the user-defined stepper.

        The provenance of the results contains a digest of the code of all classes in this tuple.
        """
        return (
            *self.measure.result_determining_classes,
            *self.user_parts.values(),
            *Engine.find_user_stepper(self.accuracy.engine),
        )

    @cached_property
    def all_scene_field_names(self) -> tuple[str, ...]:
        """Names of all scene fields, including fields of user-defined parts."""
        return tuple(SceneFields.map_field_names_to_quantities(self.user_parts.values()))

    @cached_property
    def scene_and_rig_field_names(self) -> frozenset[str]:
        """Names of all fields that determine the scene of a cell.

        If the study has a rig, the set also contains the axis fields that have units.
        """
        return frozenset({*self.all_scene_field_names, *self.axis_field_units})

    @cached_property
    def axis_unit_converter(self) -> RigAxesToScenesConverter | None:
        """Object that converts axis values with units to scene fields.

        The property is None if the study has no rig.
        """
        return RigAxesToScenesConverter(self.rig, self.base, self.axes) if self.rig else None

    @cached_property
    def axis_field_units(self) -> dict[str, str]:
        """Units of the axis fields. Fields without units are omitted."""
        return {name: units for axis in self.axes for name, units in axis.units.items()}

    def convert_row_to_scene_fields(self, axis_row: AxisPointFieldValues) -> AxisPointFieldValues:
        """Convert the axis values of a cell to scene fields.

        Parameters
        ----------
        axis_row : mapping of str to object
            Axis values by field, without fields of the measure.

        Returns
        -------
        mapping of str to object
            Scene fields that differ from the base scene.
        """
        return (
            self.axis_unit_converter.compute_scene_fields(axis_row)
            if self.axis_unit_converter
            else axis_row
        )

    @property
    def quantities_not_in_vocabulary(self) -> dict[str, Quantity]:
        """Quantities of the measure and of user-defined parts, by name.

        The dictionary contains only quantities that are not in the common vocabulary.
        """
        stated = *list_user_field_quantities(self.user_parts.values()), *self.measure.quantities
        return {about.name: about for about in stated}

    # ---- the lattice ------------------------------------------------------------------------

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Names of the dimensions, outermost first."""
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
        """Iterate over all cells in row-major order.

        Yields
        ------
        Cell
            Cell with its scene and with the changed values of measure fields.

        Raises
        ------
        InvalidValue
            If the fields of a cell do not form a valid scene, or if a field of an axis has no
            effect in any cell. The message contains the position of the cell on the axes.
        """
        unused = {n for axis in self.axes for n in axis.fields if n in self.all_scene_field_names}
        for rows in itertools.product(*(axis.rows for axis in self.axes)):
            cell = self._build_cell(rows)
            unused = {name for name in unused if cell.scene.as_dict().get(name) is None}
            yield cell
        for axis in self.axes:
            for name in axis.fields:
                if name in unused:
                    remedy = "Remove the axis, or add points at which the field has an effect."
                    raise InvalidValue(
                        "field", name, "has no effect in any cell of the study", remedy=remedy
                    )

    def cell(self, number: int) -> Cell:
        """Build one cell.

        Parameters
        ----------
        number : int
            Index of the cell in row-major order.

        Returns
        -------
        Cell
            Cell with its scene and with the changed values of measure fields.
        """
        return self._build_cell(self._find_axis_rows_of_cell(number))

    def compute_cell_field_changes(self, number: int) -> CellFieldChanges:
        """Compute the field values that the axes change in one cell.

        This method does not build a scene and is therefore faster than the method `cell`.

        Parameters
        ----------
        number : int
            Index of the cell in row-major order.

        Returns
        -------
        CellFieldChanges
            Changed fields of the base scene and of the measure.
        """
        return self._compute_field_changes_from_rows(self._find_axis_rows_of_cell(number))

    def _find_axis_rows_of_cell(self, cell_number: int) -> list[AxisPointFieldValues]:
        """Return the field values that each axis sets in a cell."""
        places = np.unravel_index(cell_number, self.shape)
        return [axis.rows[i] for axis, i in zip(self.axes, places, strict=True)]

    def scenes(self) -> Iterator[Scene]:
        """Iterate over the scenes of all cells in row-major order.

        Returns
        -------
        iterator of Scene
            Scenes. The iterator raises the same errors as `cells`.
        """
        return (cell.scene for cell in self.cells())

    def scene(self, number: int) -> Scene:
        """Build the scene of one cell.

        Parameters
        ----------
        number : int
            Index of the cell in row-major order.

        Returns
        -------
        Scene
            Scene of the cell.
        """
        return self.cell(number).scene

    def describe_cell(self, cell_number: int) -> str:
        """Describe the position of a cell on the axes.

        Parameters
        ----------
        cell_number : int
            Index of the cell in row-major order.

        Returns
        -------
        str
            Description, such as ``"phi = 60, b_over_a = 3"``.
        """
        at = zip(self.axes, np.unravel_index(cell_number, self.shape), strict=True)
        return ", ".join(f"{axis.dimension} = {axis.point_names[i]}" for axis, i in at)

    def split_scene_and_measure_fields(
        self, axis_rows: Sequence[AxisPointFieldValues]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Separate the fields of the scene from the fields of the measure.

        Parameters
        ----------
        axis_rows : sequence of mapping of str to object
            Field values at one point of each axis.

        Returns
        -------
        scene_fields : dict of str to object
            Values of the scene fields.
        measure_fields : dict of str to object
            Values of the measure fields.
        """
        split: tuple[dict[str, Any], dict[str, Any]] = {}, {}
        for row in axis_rows:
            for name, value in row.items():
                split[name not in self.scene_and_rig_field_names][name] = value
        return split

    @cached_property
    def _base_scene_fields(self) -> dict[str, Any]:
        """Fields of the base scene."""
        return self.base.as_dict()

    @cached_property
    def _inapplicable_base_scene_fields(self) -> frozenset[str]:
        """Fields that do not apply to the parts of the base scene.

        The set is valid only for cells that have the same parts as the base scene.
        """
        parts = self.user_parts
        return SceneFields.find_inapplicable_fields(
            SceneFields.replace_names_by_user_parts(self._base_scene_fields, parts), parts.values()
        )

    def _compute_field_changes_from_rows(
        self, axis_rows: Sequence[AxisPointFieldValues]
    ) -> CellFieldChanges:
        """Compute the field values that the given axis points change."""
        given, of_measure = self.split_scene_and_measure_fields(axis_rows)
        of_scene = self.convert_row_to_scene_fields(given)
        if _PART_SELECTING_FIELDS.isdisjoint(of_scene) and _PART_SELECTING_FIELDS.isdisjoint(given):
            kept = {
                n: value
                for n, value in of_scene.items()
                if n not in self._inapplicable_base_scene_fields
            }
            return CellFieldChanges(kept, of_measure)
        # If a row selects a part and also sets a field without a meaning for this part, the field
        # is kept, so that the scene rejects the field.
        stated = {
            name for row in axis_rows if not _PART_SELECTING_FIELDS.isdisjoint(row) for name in row
        }
        parts = self.user_parts
        values = SceneFields.replace_names_by_user_parts(
            {**self._base_scene_fields, **of_scene}, parts
        )
        meaningless = SceneFields.find_inapplicable_fields(values, parts.values()) - stated
        return CellFieldChanges(
            {n: values[n] for n in of_scene if n not in meaningless}, of_measure
        )

    def _build_cell(self, axis_rows: Sequence[AxisPointFieldValues]) -> Cell:
        """Build the cell at the given axis points."""
        try:
            return self._compute_field_changes_from_rows(axis_rows).build_cell(self.base)
        except InvalidValue as error:
            place = ", ".join(
                f"{name}={value!r}" for row in axis_rows for name, value in row.items()
            )
            raise error.with_location(f"cell {place}") from error

    # ---- overrides -----------------------------------------------------------------------------

    def with_(self, /, **overrides: Any) -> Study:
        """Create a copy of the study with other axis values or fixed values.

        Parameters
        ----------
        **overrides : object
            New values by field or dimension. A list of values for a fixed field creates a new axis.
            A list of values for an existing axis replaces the values of the axis. For the dimension
            of a zipped or numbered axis, the values are labels or numbers, which select points of
            the axis. For a field of a zipped axis, a new point is created for each value, and
            points that do not set the field remain unchanged. Points are selected before fields are
            changed.

        Returns
        -------
        Study
            Copy with the overrides.

        Raises
        ------
        InvalidValue
            If a name is neither an axis nor a field of the scene or of the measure, or if the
            values do not form an axis. The error is also raised if only some points of a zipped
            axis set a field, and the override would not change this field in the other points.

        Examples
        --------
        >>> from rsfstudy import Axis, Scene, Study
        >>> from rsfstudy.measures import CriticalStep
        >>> study = Study(
        ...     name="angle",
        ...     title="Critical displacement step against the driving angle",
        ...     base=Scene(law="slip"),
        ...     axes=[Axis("phi", [45, 60])],
        ...     measure=CriticalStep(of="displacement_step"),
        ... )
        >>> study.with_(phi=[30, 45, 60], alpha=[0.0, 0.5]).shape
        (2, 3)
        """
        study, given = (
            self,
            {name: convert_field_values_to_plain_data(name, v) for name, v in overrides.items()},
        )
        # User-defined parts are replaced first, because they may define the fields of other
        # overrides.
        own = [
            name
            for name in given
            if find_user_parts_in_axis_rows([name], _build_axis_rows_of_override(name, given[name]))
        ]
        selections = [axis.dimension for axis in self.axes if not axis.varies_single_field]
        for name in dict.fromkeys([*own, *filter(given.__contains__, selections), *given]):
            study = study._override_field(name, given[name])
        return replace(study, overrides={**self.overrides, **given})

    def _override_field(self, field_name: str, value: Any) -> Study:
        """Apply the override of one field or dimension."""
        values = list(value) if is_sequence_of_axis_values(value) else [value]
        of_rig = self.rig is not None and bool(values)
        field_name, units = (
            RigAxes.find_axis_name_and_si_units(field_name, values[0])
            if of_rig
            else (field_name, None)
        )
        for index, axis in enumerate(self.axes):
            if changed := self._override_values_of_axis(axis, field_name, values):
                return replace(self, axes=(*self.axes[:index], changed, *self.axes[index + 1 :]))
        of_rig = units is not None
        known = dict.fromkeys(
            (*self.dimensions, *self.all_scene_field_names, *self.measure.scalar_field_values)
        )
        if (
            field_name not in known
            and not of_rig
            and not find_user_parts_in_axis_rows(
                [field_name], _build_axis_rows_of_override(field_name, values)
            )
        ):
            rule = "is unknown. It must be the name of an axis, a scene field or a measure field"
            raise declaration_checks.build_unknown_name_error("override", field_name, rule, known)
        declaration_checks.check_fields_not_solved_by_measure(self.measure, [field_name])
        if is_sequence_of_axis_values(value):
            return replace(
                self, axes=(self._make_single_field_axis(field_name, values), *self.axes)
            )
        if self.rig is not None and of_rig:
            rig, base = RigAxes.replace_rig_quantity(self.rig, self.base, field_name, value)
            return replace(self, rig=rig, base=base)
        if field_name in self.scene_and_rig_field_names | SceneFields.PART_SLOT_NAMES:
            changes = SceneFields.replace_names_by_user_parts({field_name: value}, self.user_parts)
            return replace(self, base=self.base.with_(**changes))
        return replace(self, measure=self.measure.with_(**{field_name: value}))

    def _override_values_of_axis(
        self, axis: Axis, field_name: str, values: Sequence[Any]
    ) -> Axis | None:
        """Apply an override to one axis.

        The result is None if the axis varies neither the overridden field nor an equivalent field.
        """
        units = axis.units.get(field_name, "")
        if field_name == axis.dimension:
            return (
                self._make_single_field_axis(field_name, values, units)
                if axis.varies_single_field
                else select_axis_points(axis, values)
            )
        if field_name in axis.fields:
            declaration_checks.check_field_is_set_at_all_axis_points(
                self.base, self.user_parts, axis, field_name, values
            )
            return replace_field_values(
                axis,
                field_name,
                RigAxes.convert_values_to_units(field_name, values, units) if units else values,
            )
        if _EQUIVALENT_FIELD_BY_FIELD_NAME.get(field_name) not in axis.fields:
            return None
        if axis.labels is not None:
            rule = (
                f"is equivalent to {_EQUIVALENT_FIELD_BY_FIELD_NAME[field_name]}, which varies "
                f"along {axis.dimension}"
            )
            raise InvalidValue(
                field_name,
                values,
                rule,
                remedy=f"Override {_EQUIVALENT_FIELD_BY_FIELD_NAME[field_name]} instead.",
            )
        return self._make_single_field_axis(field_name, values)

    def _make_single_field_axis(
        self, field_name: str, values: Sequence[Any], units: str = ""
    ) -> Axis:
        """Create an axis that varies one field.

        For a study with a rig, numbers are assumed to be in the units that the ``units`` argument
        specifies.
        """
        if self.rig is None:
            return Axis(field_name, values)
        return RigAxes.create_axis(field_name, values, "" if isinstance(values[0], str) else units)

    def describe(self) -> dict[str, Any]:
        """Convert the declaration to a dictionary of plain values.

        Returns
        -------
        dict of str to object
            All parts of the declaration, in a form that can be written to a JSON file.
        """
        return {
            "name": self.name,
            "title": self.title,
            "summary": self.summary,
            "version": self.version,
            "base": self.base.stored_fields(),
            "axes": [axis.describe() for axis in self.axes],
            "measure": self.measure.describe(),
            "accuracy": asdict(self.accuracy),
            "reductions": [reduction.describe() for reduction in self.reductions],
            "claims": [claim.describe() for claim in self.claims],
            "plot": self.figure_name_in_declaration,
            "references": list(self.references),
            "overrides": dict(self.overrides),
            **({"laboratory": self.rig.as_dict()} if self.rig else {}),
        }

    @property
    def figure_name_in_declaration(self) -> str:
        """Name of the figure in the declaration of the study."""
        return get_figure_name_for_declaration(self.plot, self.name)

    def _repr_html_(self) -> str:
        heading = f"{self.name}: {self.title} ({self.size:,} cells)"
        return format_study_as_html(
            heading, self.axes, self.base, self.measure, self.quantities_not_in_vocabulary
        )


def _build_axis_rows_of_override(field_name: str, value: Any) -> list[AxisPointFieldValues]:
    """Return a list with one axis row per value of an overridden field."""
    return [{field_name: v} for v in (value if is_sequence_of_axis_values(value) else [value])]
