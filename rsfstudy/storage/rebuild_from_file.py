"""Rebuilds a study from the declaration in its results. A declaration is plain data: no code from
the results file is run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec
import xarray as xr

from rsfstudy import measures, reductions
from rsfstudy.axes import Axis
from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.measures import Measure

# to be found by its name
from rsfstudy.reductions import Reduction
from rsfstudy.rig import Rig
from rsfstudy.slider import SLOTS, UserPart, replace_names_by_user_parts
from rsfstudy.storage import schema, stored_loadings
from rsfstudy.storage.lattice_datasets import build_lattice_coordinates
from rsfstudy.storage.schema import (
    StoredAxis,
    StoredDeclaration,
    StoredMeasure,
    StoredReduction,
    build_dataclass_from_plain_data,
    invalid_part_error,
)
from rsfstudy.study import Study, load_study, study_names
from rsfstudy.vocabulary import coverage_content_type

_NAME_STUDY_FILE_REMEDY = "Name the file that declares it: --study FILE (study=)."


def rebuild_study(results: xr.Dataset, study_file: str | Path | None = None) -> Study:
    """The study that made a dataset, from the declaration in it; where it uses code of the user,
    from the file that declares the study. Parts of a named study's own are those of rsfstudy.
    """
    declared = schema.read_declaration(results)
    if (
        study_file is None
        and declared.name in study_names()
        and schema.find_user_part_not_stored(declared)
    ):
        study_file = declared.name
    for axis in declared.axes:
        points = results.sizes.get(axis["dimension"])
        declared_points = len(schema.build_axis_from_stored(axis))
        if declared_points != points:
            rule = f"has {declared_points} points in the declaration, and {points} in the file"
            raise invalid_part_error(axis["dimension"], rule)
    held = stored_loadings.read_loadings(results)
    if study_file is None and has_user_code(results):
        rule = "is a user's own, and code is never taken from a results file"
        remedy, named_in = _NAME_STUDY_FILE_REMEDY, schema.read_provenance(results)["declared_in"]
        if named_in:
            remedy += f" It was {shorten_text(named_in)}."
        name, value = schema.find_user_part_not_stored(declared, held) or (
            "measure",
            declared.measure["name"],
        )
        raise InvalidValue(name, value, rule, remedy=remedy)
    named = None if study_file is None else load_study(str(study_file))
    if named and named.name != declared.name:
        rule = f"declares the study {named.name!r}, and the results are of {declared.name!r}"
        raise InvalidValue("study", str(study_file), rule)
    study = study_from_declaration(declared, held, named)
    _check_axes(study, results)
    return study


def study_of_dataset(results: xr.Dataset) -> Study:
    """The study that made a dataset, all of it, whatever is selected.

    Raises
    ------
    InvalidValue
        Where the study has code of a user's own.
    """
    declared, about = schema.read_declaration(results), schema.read_provenance(results)
    if has_user_code(results):
        rule = "has code of a user's own, and code is never taken from a dataset"
        remedy = f"Import the study from the file that declares it. {about['declared_in']}"
        raise InvalidValue("study", declared.name, rule, remedy=remedy.strip())
    return study_from_declaration(declared, stored_loadings.read_loadings(results))


def has_user_code(results: xr.Dataset) -> bool:
    """True where code of the user decided a dataset; loadings, which it holds, are data."""
    if schema.read_provenance(results)["fingerprint"]["own_code"] == "none":
        return False
    held = stored_loadings.read_loadings(results)
    return (
        not held
        or schema.find_user_part_not_stored(schema.read_declaration(results), held) is not None
    )


def _check_axes(study: Study, results: xr.Dataset) -> None:
    """Refuse results whose axes differ from those in their declaration."""
    ours, dims = xr.Dataset(coords=build_lattice_coordinates(study)), results["status"].dims
    if dims != study.dimensions:
        raise invalid_part_error("status", f"lies along {dims}, not the axes of the declaration")
    for name in study.dimensions:
        if ours[name].values.tolist() != results[name].values.tolist():
            raise invalid_part_error(name, "is not that axis of the declaration")


def study_from_declaration(
    declaration: StoredDeclaration,
    stored_loadings: Mapping[str, UserPart],
    study_with_user_code: Study | None = None,
) -> Study:
    """The study with this declaration.

    Parameters
    ----------
    declaration : Declaration
    stored_loadings : mapping of str to UserPart
        Loadings of the user's own, by name.
    study_with_user_code : Study, optional
        Where to take the measure, the reductions and parts of the slider from, if they are
        not part of rsfstudy; the measure with the plain fields that the declaration states.

    Raises
    ------
    InvalidValue
        Where its measure or a reduction is not part of rsfstudy.
    DataError
        Where the declaration makes no study, naming the part.
    """
    parts = msgspec.structs.asdict(declaration)
    own = {**_collect_known_user_parts(study_with_user_code), **stored_loadings}
    parts["base"] = schema.build_scene_from_stored(declaration.base, own)
    if study_with_user_code is None:
        parts["measure"] = rebuild_measure(declaration.measure, "declaration.measure")
        parts["reductions"] = [
            _rebuild_reduction(described, f"declaration.reductions[{number}]")
            for number, described in enumerate(declaration.reductions)
        ]
    else:
        for name in ("reductions", "source_file"):
            parts[name] = getattr(study_with_user_code, name)
        kind = study_with_user_code.measure
        stated = {name: v for name, v in declaration.measure.items() if name in kind.plain_fields}
        parts["measure"] = kind.with_(**stated)
    try:
        parts["axes"] = [_rebuild_axis(axis, own) for axis in declaration.axes]
        del parts["laboratory"]
        if declaration.laboratory is not None:
            parts["rig"] = _rebuild_rig(declaration.laboratory)
        return Study(**parts)
    except InvalidValue as error:
        raise invalid_part_error("declaration", f"makes no study ({error})") from error


def _collect_known_user_parts(study: Study | None) -> Mapping[str, UserPart]:
    """Parts that a user wrote, by name: those of the study, and all others defined in the files
    that were loaded with it.
    """
    others = {name: part for slot in SLOTS for name, part in slot.user_parts.items()}
    return {} if study is None else {**others, **study.user_parts}


def _rebuild_axis(plain_axis: StoredAxis, user_parts: Mapping[str, UserPart]) -> Axis:
    named = schema.build_axis_from_stored(plain_axis)
    rows = [replace_names_by_user_parts(row, user_parts) for row in named.rows]
    return named.with_rows(rows, named.units, named.sampling_info)


def _rebuild_rig(stated_quantities: Mapping[str, float]) -> Rig:
    unknown = sorted(set(stated_quantities) - {field.name for field in fields(Rig)})
    if unknown:
        raise invalid_part_error(f"declaration.laboratory.{unknown[0]}", "is unknown")
    return Rig(**stated_quantities)


def rebuild_measure(plain_measure: StoredMeasure, path_in_file: str) -> Measure:
    """The measure with this description, which stands at `path` in a file."""
    values: dict[str, Any] = dict(plain_measure)
    kind = _find_declared_class("measure", Measure, measures, values.pop("name"))
    given = dict(kind.fields_from_description(values, path_in_file))
    if isinstance(values.get("measure"), Mapping):
        given["measure"] = rebuild_measure(values.pop("measure"), f"{path_in_file}.measure")
    made: Measure = build_dataclass_from_plain_data(values, kind, path_in_file, **given)
    return made


def _rebuild_reduction(plain_reduction: StoredReduction, path_in_file: str) -> Reduction:
    values: dict[str, Any] = dict(plain_reduction)
    if values["kind"] == "spread":  # what a range of a part of a coordinate was called
        values |= {"kind": "range", "over": values.pop("on", "")}
    kind = _find_declared_class("reduction", Reduction, reductions, values.pop("kind"))
    made: Reduction = build_dataclass_from_plain_data(values, kind, path_in_file)
    return made


def _find_declared_class(
    declaration_key: str, base_class: Any, exporting_package: ModuleType, declared_name: str
) -> Any:
    """The class of rsfstudy that is derived from `base` and has a name in declarations; those in
    the files of named studies are looked for where their package has none.
    """
    for exported in exporting_package.__all__:
        getattr(exporting_package, exported)  # loads the module that defines it
    if declared_name not in _named_subclasses(base_class):
        for study in study_names():
            load_study(study)
    kinds = _named_subclasses(base_class)
    if declared_name not in kinds:
        rule = "is not part of rsfstudy"
        raise InvalidValue(
            declaration_key, declared_name, rule, choices=kinds, remedy=_NAME_STUDY_FILE_REMEDY
        )
    return kinds[declared_name]


def _named_subclasses(base_class: Any) -> dict[str, Any]:
    """The concrete classes of rsfstudy that are derived from `base`, by their names in
    declarations.
    """
    found: dict[str, Any] = {}
    for kind in base_class.__subclasses__():
        found |= _named_subclasses(kind)
        name = vars(kind).get("name") or vars(kind).get("kind")
        if name and kind.__module__.partition(".")[0] == __name__.partition(".")[0]:
            found[name] = kind
    return found


def find_primary_output(dataset: xr.Dataset) -> str | None:
    """The number a dataset is about: what its measure says, or the first that was measured in each
    cell, where the measure is a user's own; None where no cell has a plain number.
    """
    cells = set(dataset["status"].dims)
    plain = [
        str(name)
        for name, values in dataset.data_vars.items()
        if set(values.dims) == cells
        and values.dtype.kind == "f"
        and coverage_content_type(str(name)) == "modelResult"
    ]
    try:
        described = schema.read_declaration(dataset).measure
        stated = rebuild_measure(described, "declaration.measure").primary_output
    except (DataError, InvalidValue):
        stated = ""
    return stated if stated in plain else next(iter(plain), None)
