"""Schema of the study declarations in results files.

The structs define the format of a declaration in a results file. The functions build studies,
scenes, measures and reductions from the structs. A missing entry is never replaced by a default
value, because a default value could change the meaning of the study. A results file does not
contain code. The functions therefore look up the classes of measures and reductions by name in
rsfstudy.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType, ModuleType
from typing import Annotated, Any

import msgspec

from rsfstudy import measures, reductions
from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue
from rsfstudy.former_data_names import rename_former_declaration_fields
from rsfstudy.measures import Measure
from rsfstudy.motion import Accuracy
from rsfstudy.reductions import Reduction
from rsfstudy.rig import Rig
from rsfstudy.slider import BUILT_IN_FLUID_CLASS_BY_NAME, Scene, SceneFields, UserLoading, UserPart
from rsfstudy.storage.plain_data_conversion import (
    build_dataclass_from_plain_data,
    build_invalid_entry_error,
    construct_from_field_values,
    convert_plain_data,
    convert_plain_field_values,
)
from rsfstudy.study import Claim, list_study_names, load_study

MISSING_STUDY_FILE_REMEDY = "Pass the file that defines it: --study FILE (study=)."
#: Maximum number of claims of a study. Checking a larger number of claims would take minutes.
_MAX_CLAIMS = 10_000
#: Type of the integer fields of measures and reductions. The range is limited because a larger
#: number of points would not fit in memory.
_BoundedInteger = Annotated[int, msgspec.Meta(ge=-10_000_000, le=10_000_000)]
#: Type of the stored fields of a scene. A user-defined part is stored as the name of the part.
StoredSceneFields = Mapping[str, float | str | bool | None]
#: Default values of scene fields that are missing in older files. Only the fields that select a
#: part have a default value. Any other missing field must remain None, because the parts of the
#: scene may not have this field.
_DEFAULTS_OF_MISSING_SCENE_FIELDS: Mapping[str, Any] = {
    **{
        n: v if isinstance(v, str) else None
        for n, v in SceneFields.DEFAULTS_OMITTED_FROM_STORED_SCENES.items()
    },
    **{
        name: None
        for part in BUILT_IN_FLUID_CLASS_BY_NAME.values()
        for name in SceneFields.list_part_field_names(part)
    },
    "fluid": "drained",
}


class StoredAxis(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Axis of a lattice, as plain data.

    Parameters
    ----------
    dimension : str
        Name of the dimension.
    values : sequence or mapping
        List of the values of an ordinary axis. The values of a zipped axis are a mapping of point
        labels to field values. The values of a numbered axis are a mapping of field names to lists
        of values.
    units : mapping of str to str, optional
        Units of the fields.
    sampling_info : mapping of str to object, optional
        Description of the random sampling.
    """

    dimension: str
    values: (
        Sequence[float | str | bool]
        | Mapping[str, Mapping[str, float | str | bool | None] | Sequence[float | str | bool]]
    )
    units: Mapping[str, str] | None = None
    sampling_info: Mapping[str, Any] | None = msgspec.field(default=None, name="drawn")

    def build_axis(self, user_parts: Mapping[str, UserPart] = MappingProxyType({})) -> Axis:
        """Build the axis.

        Parameters
        ----------
        user_parts : mapping of str to UserPart, optional
            User-defined parts by name. The axis contains only the name of any other user-defined
            part.

        Returns
        -------
        Axis
            Axis of a lattice.

        Raises
        ------
        DataError
            If the description is invalid.
        """
        try:
            named = Axis(self.dimension, self.values, self.units, self.sampling_info)
        except InvalidValue as error:
            path = f"declaration.axes.{self.dimension}"
            raise build_invalid_entry_error(path, f"is invalid ({error})") from error
        if not user_parts:
            return named
        rows = [SceneFields.replace_names_by_user_parts(row, user_parts) for row in named.rows]
        return named.with_rows(rows, named.units, named.sampling_info)


class _StoredMeasureDeclaration(msgspec.Struct):
    """Entries required in every measure declaration."""

    name: str


class _StoredReductionDeclaration(msgspec.Struct):
    """Entries required in every reduction declaration."""

    type_name_in_files: str = msgspec.field(name="kind")
    name: str
    reduced_variable_name: str = msgspec.field(name="of")


class StoredStudyDeclaration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Declaration of the study, as stored in the attribute ``declaration``.

    Parameters
    ----------
    name : str
        Name of the study.
    title : str
        Title of the study.
    summary : str
        Summary of the study.
    version : int
        Version of the study.
    base : mapping of str to object
        Fields of the base scene. The axes change some of these fields.
    axes : sequence of StoredAxis
        Axes of the lattice.
    measure : mapping of str to object
        Name and fields of the measure.
    accuracy : Accuracy
        Accuracy of each cell.
    reductions : sequence of mapping
        Kind and fields of each reduction of the lattice.
    claims : sequence of Claim
        Published values to compare with the results.
    plot : str
        Name of the figure.
    references : sequence of str
        Literature references of the study.
    overrides : mapping of str to object
        Values that the user changed, for example with ``--set``.
    rig_quantities : mapping of str to float, optional
        Quantities of the rig, if the study has a rig.
    """

    name: str
    title: str
    summary: str
    version: int
    base: StoredSceneFields
    axes: Sequence[StoredAxis]
    measure: Mapping[str, Any]
    accuracy: Any
    reductions: Sequence[Mapping[str, Any]]
    claims: Annotated[Sequence[Any], msgspec.Meta(max_length=_MAX_CLAIMS)]
    plot: str
    references: Sequence[str]
    overrides: Mapping[str, Any]
    rig_quantities: Mapping[str, float] | None = msgspec.field(default=None, name="laboratory")


def parse_study_declaration(plain_data: Any) -> StoredStudyDeclaration:
    """Convert plain data to a declaration.

    Parameters
    ----------
    plain_data : dict
        Declaration as plain data.

    Returns
    -------
    StoredStudyDeclaration
        Declaration of the study.

    Raises
    ------
    DataError
        If an entry is missing, unknown or invalid.
    """
    current = rename_former_declaration_fields(plain_data)
    declared = convert_plain_data(current, StoredStudyDeclaration, "declaration")
    # Other fields of measures and reductions are checked when a study is built.
    convert_plain_data(declared.measure, _StoredMeasureDeclaration, "declaration.measure")
    convert_plain_data(
        declared.reductions, list[_StoredReductionDeclaration], "declaration.reductions"
    )
    made: StoredStudyDeclaration = msgspec.structs.replace(
        declared,
        accuracy=build_dataclass_from_plain_data(
            declared.accuracy, Accuracy, "declaration.accuracy"
        ),
        claims=[
            build_dataclass_from_plain_data(claim, Claim, f"declaration.claims[{number}]")
            for number, claim in enumerate(declared.claims)
        ],
    )
    return made


def build_scene_from_stored_fields(
    stored_fields: StoredSceneFields,
    user_parts: Mapping[str, UserPart] = MappingProxyType({}),
    path_in_file: str = "declaration.base",
) -> Scene:
    """Build a scene from plain data.

    Parameters
    ----------
    stored_fields : mapping of str to object
        Fields of the scene.
    user_parts : mapping of str to UserPart, optional
        User-defined parts by name.
    path_in_file : str, default: "declaration.base"
        Path of the scene in the file, for error messages.

    Returns
    -------
    Scene
        Scene with the stored fields.

    Raises
    ------
    DataError
        If a field is missing, unknown or invalid. The message contains the path of the field.
    """
    parts = [
        part
        for part in SceneFields.replace_names_by_user_parts(stored_fields, user_parts).values()
        if isinstance(part, type | UserLoading)
    ]
    values = convert_plain_field_values(
        {**_DEFAULTS_OF_MISSING_SCENE_FIELDS, **stored_fields},
        tuple(SceneFields.map_field_names_to_value_types(parts).items()),
        path_in_file,
    )
    scene: Scene = construct_from_field_values(
        Scene, SceneFields.replace_names_by_user_parts(values, user_parts), path_in_file
    )
    return scene


def find_user_part_missing_from_file(
    declaration: StoredStudyDeclaration, stored_loadings: Collection[str] = ()
) -> tuple[str, str] | None:
    """Find a user-defined part that is missing in the results file.

    Parameters
    ----------
    declaration : StoredStudyDeclaration
        Declaration of the study.
    stored_loadings : collection of str, optional
        Names of the user-defined loadings that the file contains.

    Returns
    -------
    tuple of (str, str) or None
        Field and name of the first missing part, or None if no part is missing.
    """
    rows: list[Mapping[str, Any]] = [declaration.base]
    for axis in declaration.axes:
        rows += axis.build_axis().rows
    for slot in SceneFields.PART_SLOTS:
        for name in {row.get(slot.name): None for row in rows}:
            if isinstance(name, str) and name not in (*slot.built_in_parts, *stored_loadings):
                return slot.name, name
    return None


def build_rig(rig_quantities: Mapping[str, float]) -> Rig:
    """Build a rig from its quantities.

    Parameters
    ----------
    rig_quantities : mapping of str to float
        Quantities that have a value, in SI units.

    Returns
    -------
    Rig
        Rig of the study.

    Raises
    ------
    DataError
        If a quantity is unknown.
    """
    types = tuple((name, float) for name in Rig.__dataclass_fields__ if name in rig_quantities)
    return Rig(**convert_plain_field_values(rig_quantities, types, "declaration.laboratory"))


def build_measure(measure_declaration: Mapping[str, Any], path_in_file: str) -> Measure:
    """Build a measure from its description.

    Parameters
    ----------
    measure_declaration : mapping of str to object
        Description of the measure. The description of a nested measure has the key ``measure``.
    path_in_file : str
        Path of the description in the file, for error messages.

    Returns
    -------
    Measure
        Measure that the description defines.

    Raises
    ------
    InvalidValue
        If rsfstudy has no measure with this name.
    DataError
        If a field is missing, unknown or invalid.
    """
    values: dict[str, Any] = dict(measure_declaration)
    kind = _find_declared_class("measure", Measure, measures, values.pop("name"))
    given = dict(kind.fields_from_description(values, path_in_file))
    if isinstance(values.get("measure"), Mapping):
        path = f"{path_in_file}.measure"
        convert_plain_data(values["measure"], _StoredMeasureDeclaration, path)
        given["measure"] = build_measure(values.pop("measure"), path)
    made: Measure = build_dataclass_from_plain_data(
        values, kind, path_in_file, given, _BoundedInteger
    )
    return made


def build_reduction(reduction_declaration: Mapping[str, Any], path_in_file: str) -> Reduction:
    """Build a reduction from its description.

    Parameters
    ----------
    reduction_declaration : mapping of str to object
        Description of the reduction.
    path_in_file : str
        Path of the description in the file, for error messages.

    Returns
    -------
    Reduction
        Reduction that the description defines.

    Raises
    ------
    InvalidValue
        If rsfstudy has no reduction of this kind.
    DataError
        If a field is missing, unknown or invalid.
    """
    values: dict[str, Any] = dict(reduction_declaration)
    kind = _find_declared_class("reduction", Reduction, reductions, values.pop("kind"))
    made: Reduction = build_dataclass_from_plain_data(
        values, kind, path_in_file, integer_type=_BoundedInteger
    )
    return made


def _find_declared_class(
    declaration_key: str, base_class: Any, exporting_package: ModuleType, declared_name: str
) -> Any:
    """Return the rsfstudy class that has the given name in study declarations.

    The function first searches the package that exports the measures or the reductions. If the
    package has no class with this name, the function also searches the modules of the named
    studies.
    """
    for exported in exporting_package.__all__:
        getattr(exporting_package, exported)  # The attribute access loads the module of the class.
    if declared_name not in _find_subclasses_by_declared_name(base_class):
        for study in list_study_names():
            load_study(study)
    kinds = _find_subclasses_by_declared_name(base_class)
    if declared_name not in kinds:
        rule = "is not part of rsfstudy"
        raise InvalidValue(
            declaration_key, declared_name, rule, choices=kinds, remedy=MISSING_STUDY_FILE_REMEDY
        )
    return kinds[declared_name]


def _find_subclasses_by_declared_name(base_class: Any) -> dict[str, Any]:
    """Return the concrete subclasses in rsfstudy, keyed by their names in files."""
    found: dict[str, Any] = {}
    for kind in base_class.__subclasses__():
        found |= _find_subclasses_by_declared_name(kind)
        name = vars(kind).get("name") or vars(kind).get("kind")
        if name and kind.__module__.partition(".")[0] == __name__.partition(".")[0]:
            found[name] = kind
    return found
