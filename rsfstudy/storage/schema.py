"""Schema of results files.

``check_results`` checks a file before any other function uses the file. Error messages contain the
path of the invalid entry, for example ``declaration.claims[3].id``.

The classes describe the layout of results files. A missing entry is never replaced by a default
value, because a default value could change the meaning of the study.

We convert and check plain data with msgspec for three reasons. First, msgspec is a single package
of 0.5 MB without dependencies, and its import takes 17 ms (pydantic: four packages, 10 MB, 50 ms;
cattrs: three packages, 41 ms). Second, msgspec is strict by default, whereas cattrs converts
strings to numbers. Third, msgspec supports the existing dataclasses, and its error messages contain
paths.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType
from typing import Annotated, Any, NotRequired, TypedDict, get_type_hints

import msgspec
import numpy as np
import xarray as xr

from rsfstudy.axes import Axis
from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.motion import Accuracy
from rsfstudy.slider import (
    BUILT_IN_PARTS,
    FIELDS_OMITTED_IF_NONE,
    SLOTS,
    Scene,
    UserLoading,
    UserPart,
    field_names,
    replace_names_by_user_parts,
    scene_field_types,
)
from rsfstudy.status import Status
from rsfstudy.study import Claim
from rsfstudy.vocabulary import QUANTITY_BY_NAME

#: Version of the file layout. Files without a version have layout 1, in which the digests of
#: variables were stored as attributes.
FILE_LAYOUT_VERSION = 2
#: Maximum number of claims of a study, and maximum number of points of an axis. Larger files would
#: take minutes to check, or would not fit in memory.
MAX_CLAIMS, MAX_AXIS_POINTS_OF_FILE = 10_000, 10_000_000


class RootAttributes(TypedDict):
    """Root attributes that rsfstudy reads from results files.

    Attributes
    ----------
    id : str
        Name of the study.
    title : str
        Title of the study.
    completeness : str
        "complete", or the number of finished cells.
    reduced_despite : str
        Number of failed cells that the reductions omit, or an empty string.
    """

    id: str
    title: str
    completeness: str
    reduced_despite: str


#: Fields of a scene. User-defined parts are stored by their names.
StoredScene = Mapping[str, float | str | bool | None]


class StoredAxis(TypedDict):
    """Axis of a lattice, as plain data.

    Attributes
    ----------
    dimension : str
        Name of the dimension.
    values : sequence or mapping
        List of values. For a zipped axis, mapping of point labels to field values. For a numbered
        axis, mapping of field names to lists of values.
    units : mapping of str to str, optional
        Units of the fields.
    drawn : mapping of str to object, optional
        Description of the random sampling.
    """

    dimension: str
    values: (
        Sequence[float | str | bool]
        | Mapping[str, Mapping[str, float | str | bool | None] | Sequence[float | str | bool]]
    )
    units: NotRequired[Mapping[str, str]]
    drawn: NotRequired[Mapping[str, Any]]


def build_axis_from_stored(stored_axis: StoredAxis) -> Axis:
    """Build an axis from plain data.

    Parameters
    ----------
    stored_axis : StoredAxis
        Description of the axis.

    Returns
    -------
    Axis
        Axis on which user-defined parts are represented by their names.

    Raises
    ------
    DataError
        If the description is invalid.
    """
    try:
        return Axis(
            stored_axis["dimension"],
            stored_axis["values"],
            stored_axis.get("units"),
            stored_axis.get("drawn"),
        )
    except InvalidValue as error:
        raise invalid_part_error(
            f"declaration.axes.{stored_axis['dimension']}", f"is refused ({error})"
        ) from error


class StoredMeasure(TypedDict):
    """Measure as plain data. Additional entries depend on the measure."""

    name: str


class StoredReduction(TypedDict):
    """Reduction as plain data. Additional entries depend on the kind."""

    kind: str
    name: str
    of: str


class StoredDeclaration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
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
        Fields of the scene that all cells share.
    axes : sequence of StoredAxis
        Axes of the lattice.
    measure : StoredMeasure
        Measure of each cell.
    accuracy : Accuracy
        Accuracy of each cell.
    reductions : sequence of StoredReduction
        Reductions of the lattice.
    claims : sequence of Claim
        Published values to compare with the results.
    plot : str
        Name of the figure.
    references : sequence of str
        Literature references of the study.
    overrides : mapping of str to object
        Values that the user has overridden.
    laboratory : mapping of str to float, optional
        Quantities of the rig, if the study has a rig.
    """

    name: str
    title: str
    summary: str
    version: int
    base: StoredScene
    axes: Sequence[StoredAxis]
    measure: StoredMeasure
    accuracy: Accuracy
    reductions: Sequence[StoredReduction]
    claims: Annotated[Sequence[Claim], msgspec.Meta(max_length=MAX_CLAIMS)]
    plot: str
    references: Sequence[str]
    overrides: Mapping[str, Any]
    laboratory: Mapping[str, float] | None = None


class StoredFingerprint(TypedDict):
    """Code digests and versions that affect the results.

    Other entries of a fingerprint are only compared with the entries of another fingerprint.
    Therefore, the other entries need no declared type.
    """

    own_code: str


class StoredProvenance(TypedDict):
    """Provenance of the results, as stored in the attribute ``provenance``.

    Attributes
    ----------
    time : str
        Time of the run in UTC.
    command : str
        Command line or Python call of the user.
    declared_in : str
        File that declares the study, or an empty string.
    versions : mapping of str to str
        Versions of Python and of the main packages.
    fingerprint : StoredFingerprint
        Versions, settings and code digests that affect the results.
    git : str
        Commit of rsfstudy.
    machine : str
        Operating system, architecture and number of cores.
    """

    time: str
    command: str
    declared_in: str
    versions: Mapping[str, str]
    fingerprint: StoredFingerprint
    git: str
    machine: str


#: NumPy dtype kinds that are allowed in variables, and their description.
_ALLOWED_DTYPE_KINDS = ("iufbOUT", "numbers or texts")
#: Default values of scene fields that are missing in older files. The older files were written
#: before pore fluids were supported.
_SCENE_DEFAULTS_FOR_OLDER_FILES: Mapping[str, Any] = {
    **{name: None for part in BUILT_IN_PARTS.values() for name in field_names(part)},
    "fluid": "drained",
    "temperature": "isothermal",
}
_REQUIRED_VARIABLES = {
    "status": ("i", "whole numbers"),
    "message": ("OUT", "texts"),
    "rhs_evaluations": ("iu", "whole numbers"),
    "wall_time": ("f", "numbers"),
}


def check_results(dataset: xr.Dataset) -> None:
    """Check all entries of a results file that rsfstudy uses.

    Parameters
    ----------
    dataset : xarray.Dataset
        Contents of the file.

    Raises
    ------
    DataError
        If an entry is missing or invalid. The message contains the path of the first invalid entry.
    """
    layout = dataset.attrs.get("layout", 1)
    if not isinstance(layout, int | np.integer) or not 1 <= layout <= FILE_LAYOUT_VERSION:
        raise DataError(
            f"layout is {shorten_text(layout)}, and this version of rsfstudy reads 1 to "
            f"{FILE_LAYOUT_VERSION}: open it with the version that its attribute source names."
        )
    attrs = convert_plain_data_to_type({"reduced_despite": "", **dataset.attrs}, RootAttributes, "")
    name = read_declaration(dataset).name
    if attrs["id"] != name or not name.isidentifier():
        raise invalid_part_error(
            "id", f"is {shorten_text(attrs['id'])!r}, and the declared study {shorten_text(name)!r}"
        )
    for variable in _REQUIRED_VARIABLES:
        if variable not in dataset.data_vars:
            raise invalid_part_error(variable, "is missing")
        if dataset[variable].dims != dataset["status"].dims:
            dims = dataset[variable].dims
            raise invalid_part_error(
                variable, f"lies along {dims}, and status along {dataset['status'].dims}"
            )
    for key, values in dataset.variables.items():
        if key in QUANTITY_BY_NAME or key in dataset.coords:  # Users may add other variables.
            _check_dtype_kind(str(key), values)
    for name in map(str, dataset["status"].dims):
        if name not in dataset.coords or dataset[name].dims != (name,):
            raise invalid_part_error(name, "is no coordinate along the dimension of its name")
        if not dataset.indexes[name].is_unique:
            raise invalid_part_error(name, "has the same value more than once")
    unknown = np.setdiff1d(dataset["status"].values, [int(status) for status in Status])
    if unknown.size:
        raise invalid_part_error("status", f"is {unknown[0]} in a cell, which is the code of none")


def is_of_single_scene(dataset: xr.Dataset) -> bool:
    """Return True if a dataset belongs to a single scene.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset written by rsfstudy.

    Returns
    -------
    bool
        True for a motion, a limit cycle or a critical step. False for the results of a study.
    """
    return "scene" in dataset.attrs and "declaration" not in dataset.attrs


def check_contains_study_results(dataset: xr.Dataset, file_description: str) -> None:
    """Check that a dataset contains the results of a study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset written by rsfstudy.
    file_description : str
        Name of the dataset or file in the error message.

    Raises
    ------
    DataError
        If the dataset is a motion, a limit cycle or a critical step of a single scene.
    """
    if is_of_single_scene(dataset):
        title = shorten_text(dataset.attrs.get("title", "untitled"))
        raise DataError(
            f"{file_description} is of one scene ({title}), not the results of a study. "
            "Open its file with "
            "xarray.open_dataset; rsfstudy.plot_motion(dataset), or dataset.rsf.plot(), "
            "draws a motion."
        )


def read_declaration(dataset: xr.Dataset) -> StoredDeclaration:
    """Read the declaration of the study that produced a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    StoredDeclaration
        Declaration of the study.

    Raises
    ------
    DataError
        If the declaration is missing or invalid.
    """
    declared = parse_declaration(read_json_attribute(dataset, "declaration"))
    if read_provenance(dataset)["fingerprint"]["own_code"] == "none":
        build_scene_from_stored(declared.base)
    return declared


def parse_declaration(plain_data: Any) -> StoredDeclaration:
    """Convert plain data to a declaration.

    Parameters
    ----------
    plain_data : dict
        Declaration as plain data.

    Returns
    -------
    StoredDeclaration
        Declaration of the study.

    Raises
    ------
    DataError
        If an entry is missing, unknown or invalid.
    """
    declared: StoredDeclaration = convert_plain_data_to_type(
        plain_data, StoredDeclaration, "declaration"
    )
    for number, claim in enumerate(plain_data["claims"]):
        _check_mapping_keys(claim, _field_names(Claim), f"declaration.claims[{number}]")
    _check_mapping_keys(plain_data["accuracy"], _field_names(Accuracy), "declaration.accuracy")
    # The conversion drops additional entries, so these values are taken from the plain data.
    whole = {name: plain_data[name] for name in ("axes", "measure", "reductions", "overrides")}
    return msgspec.structs.replace(declared, **whole)


def build_scene_from_stored(
    stored_scene: StoredScene,
    user_parts: Mapping[str, UserPart] = MappingProxyType({}),
    path_in_file: str = "declaration.base",
) -> Scene:
    """Build a scene from plain data.

    Parameters
    ----------
    stored_scene : mapping of str to object
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
        for part in replace_names_by_user_parts(stored_scene, user_parts).values()
        if isinstance(part, type | UserLoading)
    ]
    kinds = scene_field_types(parts)
    values = {
        **dict.fromkeys(FIELDS_OMITTED_IF_NONE),
        **_SCENE_DEFAULTS_FOR_OLDER_FILES,
        **stored_scene,
    }
    _check_mapping_keys(values, kinds, path_in_file)
    values = {
        name: convert_plain_data_to_type(values[name], kind, f"{path_in_file}.{name}")
        for name, kind in kinds.items()
    }
    try:
        return Scene(**replace_names_by_user_parts(values, user_parts))
    except InvalidValue as error:
        raise invalid_part_error(f"{path_in_file}.{error.name}", f"is refused ({error})") from error


def find_user_part_missing_from_file(
    declaration: StoredDeclaration, stored_loadings: Collection[str] = ()
) -> tuple[str, str] | None:
    """Find a user-defined part that the results file does not contain.

    Parameters
    ----------
    declaration : StoredDeclaration
        Declaration of the study.
    stored_loadings : collection of str, optional
        Names of the user-defined loadings that the file contains.

    Returns
    -------
    tuple of (str, str) or None
        Slot and name of the first missing part, or None if no part is missing.
    """
    rows: list[Mapping[str, Any]] = [declaration.base]
    for plain in declaration.axes:
        rows += build_axis_from_stored(plain).rows
    for slot in SLOTS:
        for name in {row.get(slot.name): None for row in rows}:
            if isinstance(name, str) and name not in (*slot.built_in_parts, *stored_loadings):
                return slot.name, name
    return None


def read_provenance(dataset: xr.Dataset) -> StoredProvenance:
    """Read the provenance of a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    StoredProvenance
        Provenance of the results.

    Raises
    ------
    DataError
        If the provenance is missing or invalid.
    """
    origin: StoredProvenance = read_json_attribute(dataset, "provenance")
    convert_plain_data_to_type(origin, StoredProvenance, "provenance")
    return origin


def read_scene_fields(dataset: xr.Dataset) -> dict[str, Any]:
    """Read the fields of the scene that the attributes of a dataset describe.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset of a single scene.

    Returns
    -------
    dict of str to object
        Fields of the scene.

    Raises
    ------
    DataError
        If the attribute ``scene`` is missing or invalid.
    """
    return dict(
        convert_plain_data_to_type(
            read_json_attribute(dataset, "scene"), Mapping[str, Any], "scene"
        )
    )


def read_json_attribute(dataset: xr.Dataset, attribute_name: str) -> Any:
    """Read a root attribute that contains JSON.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the attribute.
    attribute_name : str
        Name of the attribute.

    Returns
    -------
    object
        Decoded value of the attribute.

    Raises
    ------
    DataError
        If the attribute is missing or is not valid JSON.
    """
    if attribute_name not in dataset.attrs:
        raise invalid_part_error(attribute_name, "is missing")
    try:
        return json.loads(dataset.attrs[attribute_name])
    except (TypeError, ValueError, RecursionError) as error:
        raise invalid_part_error(attribute_name, f"is no JSON ({shorten_text(error)})") from error


def _check_dtype_kind(variable_name: str, values: xr.Variable) -> None:
    """Raise ``DataError`` if a variable has the wrong kind of dtype."""
    kinds, wanted = _REQUIRED_VARIABLES.get(variable_name, _ALLOWED_DTYPE_KINDS)
    kind = values.dtype.kind
    if kind not in kinds:
        raise invalid_part_error(variable_name, f"holds {values.dtype}, and must hold {wanted}")
    if kind == "O" and not all(isinstance(text, str) for text in values.values.flat):
        raise invalid_part_error(variable_name, f"holds objects, and must hold {wanted}")


# ---- plain data, checked against annotations -----------------------------------------------------


def invalid_part_error(path_in_file: str, reason: str) -> DataError:
    """Build the error for an invalid entry of a results file.

    Parameters
    ----------
    path_in_file : str
        Path of the entry.
    reason : str
        Reason, which follows the path in the message.

    Returns
    -------
    DataError
        Error to raise.
    """
    return DataError(
        f"{shorten_text(path_in_file).lstrip('.')} {reason}. It was not written by this "
        "version of rsfstudy, or "
        "was edited: run the study again."
    )


def convert_plain_data_to_type(plain_data: Any, annotated_type: Any, path_in_file: str) -> Any:
    """Convert plain data to an annotated type.

    Parameters
    ----------
    plain_data : object
        Decoded JSON.
    annotated_type : type
        Type or type annotation. If the type is a typed dictionary, unknown keys are dropped.
    path_in_file : str
        Path of the value in the file, for error messages.

    Returns
    -------
    object
        Value of the annotated type.

    Raises
    ------
    DataError
        If the value cannot be converted. The message contains the path of the value.
    """
    try:
        return msgspec.convert(plain_data, annotated_type)
    except (msgspec.ValidationError, OverflowError, RecursionError) as error:
        why, _, within = str(error).rpartition(" - at `$")
        place, why = (
            (f"{path_in_file}{within.rstrip('`')}", why) if why else (path_in_file, str(error))
        )
        if field := re.fullmatch("Object .* (required|unknown) field `(.*)`", why):
            rule = "is missing" if field[1] == "required" else "is unknown"
            raise invalid_part_error(f"{place}.{field[2]}", rule) from error
        raise invalid_part_error(place, f"is refused ({shorten_text(why)})") from error


def build_dataclass_from_plain_data(
    plain_data: Mapping[str, Any], dataclass_type: Any, path_in_file: str, **given_fields: Any
) -> Any:
    """Build an instance of a dataclass from plain data.

    Parameters
    ----------
    plain_data : mapping of str to object
        Values of the fields.
    dataclass_type : type
        Dataclass to instantiate.
    path_in_file : str
        Path of the data in the file, for error messages.
    **given_fields : object
        Values of fields that need no conversion.

    Returns
    -------
    object
        Instance of ``dataclass_type``.

    Raises
    ------
    DataError
        If a field is missing, unknown or invalid.
    """
    kinds = {
        name: hint for name, hint in get_type_hints(dataclass_type).items() if name in plain_data
    }
    _check_mapping_keys({**plain_data, **given_fields}, _field_names(dataclass_type), path_in_file)
    for name, part in plain_data.items():
        if kinds[name] is int and isinstance(part, int) and abs(part) > MAX_AXIS_POINTS_OF_FILE:
            raise invalid_part_error(
                f"{path_in_file}.{name}", f"is above {MAX_AXIS_POINTS_OF_FILE}"
            )
    fitted = {
        name: convert_plain_data_to_type(part, kinds[name], f"{path_in_file}.{name}")
        for name, part in plain_data.items()
    }
    try:
        return dataclass_type(**{**fitted, **given_fields})
    except InvalidValue as error:
        raise invalid_part_error(f"{path_in_file}.{error.name}", f"is refused ({error})") from error


def _field_names(dataclass_type: Any) -> list[str]:
    """Return the names of the fields of a dataclass."""
    return [field.name for field in fields(dataclass_type)]


def _check_mapping_keys(
    mapping: Mapping[str, Any], expected_keys: Collection[str], path_in_file: str
) -> None:
    """Raise ``DataError`` if a mapping has missing or unknown keys."""
    for name in expected_keys:
        if name not in mapping:
            raise invalid_part_error(f"{path_in_file}.{name}", "is missing")
    for name in mapping:
        if name not in expected_keys:
            raise invalid_part_error(f"{path_in_file}.{name}", "is unknown")
