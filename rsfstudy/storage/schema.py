"""The parts of a results file, and what each must be. A file is checked here before anything else
uses it; an error names the part that is wrong by its path, as in ``declaration.claims[3].id``.

The classes describe the layout. A missing part is never replaced by a default: the results would
then be those of another study. Plain data are held against them by msgspec: one wheel of half a
megabyte without dependencies, imported in 17 ms (pydantic: four packages, ten megabytes, 50 ms;
cattrs: three packages, 41 ms), strict unless told otherwise (cattrs makes a number of a text), with
paths in its errors, and for the dataclasses that are there already.
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

#: The layout of files as they are written. Those without a number are of layout 1, which had
#: digests of variables among its attributes.
FILE_LAYOUT_VERSION = 2
#: More would take minutes to look through, or not fit in memory.
MAX_CLAIMS, MAX_AXIS_POINTS_OF_FILE = 10_000, 10_000_000


class RootAttributes(TypedDict):
    """Attributes of the whole file that rsfstudy uses."""

    id: str
    title: str
    completeness: str
    reduced_despite: str


#: The fields of a scene, a part of the user's own by its name.
StoredScene = Mapping[str, float | str | bool | None]


class StoredAxis(TypedDict):
    """A dimension of the lattice: a list of values; or labels and the fields set at each; or the
    values of each field, at points that are numbered.
    """

    dimension: str
    values: (
        Sequence[float | str | bool]
        | Mapping[str, Mapping[str, float | str | bool | None] | Sequence[float | str | bool]]
    )
    units: NotRequired[Mapping[str, str]]
    drawn: NotRequired[Mapping[str, Any]]


def build_axis_from_stored(stored_axis: StoredAxis) -> Axis:
    """An axis, on which parts of the user's own are named; raises DataError for what is none."""
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
    """A measure; what else it holds depends on its name."""

    name: str


class StoredReduction(TypedDict):
    """A reduction; what else it holds depends on its kind."""

    kind: str
    name: str
    of: str


class StoredDeclaration(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The attribute ``declaration``: the study that made the file."""

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
    """Code and versions that decided the numbers; what is not named here is only compared."""

    own_code: str


class StoredProvenance(TypedDict):
    """The attribute ``provenance``: where the file comes from."""

    time: str
    command: str
    declared_in: str
    versions: Mapping[str, str]
    fingerprint: StoredFingerprint
    git: str
    machine: str


#: NumPy's kinds of numbers and texts that variables may hold, and those that must be there.
_ALLOWED_DTYPE_KINDS = ("iufbOUT", "numbers or texts")
#: What the scenes of files are that were written before there was a choice of pore fluid.
_SCENE_DEFAULTS_OF_OLDER_FILES: Mapping[str, Any] = {
    **{name: None for part in BUILT_IN_PARTS.values() for name in field_names(part)},
    "fluid": "drained",
}
_REQUIRED_VARIABLES = {
    "status": ("i", "whole numbers"),
    "message": ("OUT", "texts"),
    "rhs_evaluations": ("iu", "whole numbers"),
    "wall_time": ("f", "numbers"),
}


def check_results(dataset: xr.Dataset) -> None:
    """Check every part of a results file that rsfstudy uses.

    Raises
    ------
    DataError
        Names the first part that is missing or wrong.
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
        if key in QUANTITY_BY_NAME or key in dataset.coords:  # a notebook may have added others
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
    """True of a motion, a limit cycle or a critical step of one scene."""
    return "scene" in dataset.attrs and "declaration" not in dataset.attrs


def check_is_of_study(dataset: xr.Dataset, file_description: str) -> None:
    """Refuse what was asked of one scene, with what to do with it.

    Raises
    ------
    DataError
        If the dataset is a motion, a limit cycle or a critical step.
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
    """The declaration of the study that made a dataset.

    Raises
    ------
    DataError
        If the dataset carries none, or not as rsfstudy writes it.
    """
    declared = parse_declaration(read_json_attribute(dataset, "declaration"))
    if read_provenance(dataset)["fingerprint"]["own_code"] == "none":
        build_scene_from_stored(declared.base)
    return declared


def parse_declaration(plain_data: Any) -> StoredDeclaration:
    """A declaration from plain data; raises DataError where they are none."""
    declared: StoredDeclaration = convert_plain_data_to_type(
        plain_data, StoredDeclaration, "declaration"
    )
    for number, claim in enumerate(plain_data["claims"]):
        _check_mapping_keys(claim, _field_names(Claim), f"declaration.claims[{number}]")
    _check_mapping_keys(plain_data["accuracy"], _field_names(Accuracy), "declaration.accuracy")
    # with what else they hold
    whole = {name: plain_data[name] for name in ("axes", "measure", "reductions", "overrides")}
    return msgspec.structs.replace(declared, **whole)


def build_scene_from_stored(
    stored_scene: StoredScene,
    user_parts: Mapping[str, UserPart] = MappingProxyType({}),
    path_in_file: str = "declaration.base",
) -> Scene:
    """A scene; by default the one that all cells share.

    Parameters
    ----------
    stored_scene : mapping
        Its fields.
    user_parts : mapping of str to type
        Its parts that are a user's own, by name.
    path_in_file : str
        Where it stands in its file.

    Raises
    ------
    DataError
        Where the fields make no scene, naming the first that does not.
    """
    parts = [
        part
        for part in replace_names_by_user_parts(stored_scene, user_parts).values()
        if isinstance(part, type | UserLoading)
    ]
    kinds = scene_field_types(parts)
    values = {
        **dict.fromkeys(FIELDS_OMITTED_IF_NONE),
        **_SCENE_DEFAULTS_OF_OLDER_FILES,
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


def find_user_part_not_stored(
    declaration: StoredDeclaration, stored_loadings: Collection[str] = ()
) -> tuple[str, str] | None:
    """Slot and name of a part that the user wrote, if any cell has one; not one that is held."""
    rows: list[Mapping[str, Any]] = [declaration.base]
    for plain in declaration.axes:
        rows += build_axis_from_stored(plain).rows
    for slot in SLOTS:
        for name in {row.get(slot.name): None for row in rows}:
            if isinstance(name, str) and name not in (*slot.built_in_parts, *stored_loadings):
                return slot.name, name
    return None


def read_provenance(dataset: xr.Dataset) -> StoredProvenance:
    """Provenance of a dataset.

    Raises
    ------
    DataError
        If the dataset does not say, or not as rsfstudy writes it.
    """
    origin: StoredProvenance = read_json_attribute(dataset, "provenance")
    convert_plain_data_to_type(origin, StoredProvenance, "provenance")
    return origin


def read_scene_fields(dataset: xr.Dataset) -> dict[str, Any]:
    """The fields of the scene that the attributes of a dataset describe."""
    return dict(
        convert_plain_data_to_type(
            read_json_attribute(dataset, "scene"), Mapping[str, Any], "scene"
        )
    )


def read_json_attribute(dataset: xr.Dataset, attribute_name: str) -> Any:
    """Value that an attribute of a dataset holds as JSON; raises DataError where it does not."""
    if attribute_name not in dataset.attrs:
        raise invalid_part_error(attribute_name, "is missing")
    try:
        return json.loads(dataset.attrs[attribute_name])
    except (TypeError, ValueError, RecursionError) as error:
        raise invalid_part_error(attribute_name, f"is no JSON ({shorten_text(error)})") from error


def _check_dtype_kind(variable_name: str, values: xr.Variable) -> None:
    """Refuse a variable that does not hold the kind of numbers or texts it must hold."""
    kinds, wanted = _REQUIRED_VARIABLES.get(variable_name, _ALLOWED_DTYPE_KINDS)
    kind = values.dtype.kind
    if kind not in kinds:
        raise invalid_part_error(variable_name, f"holds {values.dtype}, and must hold {wanted}")
    if kind == "O" and not all(isinstance(text, str) for text in values.values.flat):
        raise invalid_part_error(variable_name, f"holds objects, and must hold {wanted}")


# ---- plain data, checked against annotations -----------------------------------------------------


def invalid_part_error(path_in_file: str, reason: str) -> DataError:
    """The error for a part that is not as rsfstudy writes it."""
    return DataError(
        f"{shorten_text(path_in_file).lstrip('.')} {reason}. It was not written by this "
        "version of rsfstudy, or "
        "was edited: run the study again."
    )


def convert_plain_data_to_type(plain_data: Any, annotated_type: Any, path_in_file: str) -> Any:
    """Plain data as the type that an annotation names.

    Parameters
    ----------
    plain_data : object
        What JSON gives.
    annotated_type : type
        A type, or another annotation of a field. Of a typed dictionary what it does not name is
        left out.
    path_in_file : str
        Where the value stands in its file.

    Raises
    ------
    DataError
        Where it cannot be converted; the text names the path.
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
    """An object of a dataclass from all its fields and no others; some may be `given`."""
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
    return [field.name for field in fields(dataclass_type)]


def _check_mapping_keys(
    mapping: Mapping[str, Any], expected_keys: Collection[str], path_in_file: str
) -> None:
    """Refuse plain data that lack one of these, or have others."""
    for name in expected_keys:
        if name not in mapping:
            raise invalid_part_error(f"{path_in_file}.{name}", "is missing")
    for name in mapping:
        if name not in expected_keys:
            raise invalid_part_error(f"{path_in_file}.{name}", "is unknown")
