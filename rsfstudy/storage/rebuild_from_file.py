"""Reconstruction of a study from the declaration in its results file.

``rebuild_study`` is the main function. A declaration contains only plain data, and no code from the
results file is run. If a study contains user-defined code, the code is imported from the file that
declares the study.
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
from rsfstudy.vocabulary import find_coverage_content_type

_MISSING_STUDY_FILE_REMEDY = "Name the file that declares it: --study FILE (study=)."


def rebuild_study(results: xr.Dataset, study_file: str | Path | None = None) -> Study:
    """Rebuild the study that produced a results dataset.

    If a named study contains user-defined parts, the parts are imported from the module of that
    study.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.
    study_file : str or Path, optional
        File that declares the study. The file is required if the study contains user-defined code.

    Returns
    -------
    Study
        Study with the declaration from the results.

    Raises
    ------
    InvalidValue
        If the study contains user-defined code and ``study_file`` is missing, or if ``study_file``
        declares a different study.
    DataError
        If the declaration is invalid, or if the axes of the results do not match the declaration.
    """
    declared = schema.read_declaration(results)
    if (
        study_file is None
        and declared.name in study_names()
        and schema.find_user_part_missing_from_file(declared)
    ):
        study_file = declared.name
    for axis in declared.axes:
        points = results.sizes.get(axis["dimension"])
        declared_points = len(schema.build_axis_from_stored(axis))
        if declared_points != points:
            rule = f"has {declared_points} points in the declaration, and {points} in the file"
            raise invalid_part_error(axis["dimension"], rule)
    held = stored_loadings.read_loadings(results)
    if study_file is None and depends_on_user_code(results):
        rule = "is a user's own, and code is never taken from a results file"
        remedy, named_in = (
            _MISSING_STUDY_FILE_REMEDY,
            schema.read_provenance(results)["declared_in"],
        )
        if named_in:
            remedy += f" It was {shorten_text(named_in)}."
        name, value = schema.find_user_part_missing_from_file(declared, held) or (
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
    """Rebuild the complete study that produced a dataset.

    The study contains all cells, even if only some cells of the dataset are selected.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study, or a selection of cells.

    Returns
    -------
    Study
        Study with the declaration from the results.

    Raises
    ------
    InvalidValue
        If the study contains user-defined code.
    DataError
        If the declaration is invalid.
    """
    declared, about = schema.read_declaration(results), schema.read_provenance(results)
    if depends_on_user_code(results):
        rule = "has code of a user's own, and code is never taken from a dataset"
        remedy = f"Import the study from the file that declares it. {about['declared_in']}"
        raise InvalidValue("study", declared.name, rule, remedy=remedy.strip())
    return study_from_declaration(declared, stored_loadings.read_loadings(results))


def depends_on_user_code(results: xr.Dataset) -> bool:
    """Return True if user-defined code affected the results.

    User-defined loadings are data rather than code, because the results contain their samples or
    segments. If the results contain loadings, the function searches the axes and the base scene for
    other user-defined parts.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.

    Returns
    -------
    bool
        True if the study contains user-defined code.
    """
    if schema.read_provenance(results)["fingerprint"]["own_code"] == "none":
        return False
    held = stored_loadings.read_loadings(results)
    return (
        not held
        or schema.find_user_part_missing_from_file(schema.read_declaration(results), held)
        is not None
    )


def _check_axes(study: Study, results: xr.Dataset) -> None:
    """Check that the axes of the results match the declaration."""
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
    """Build a study from its declaration.

    Parameters
    ----------
    declaration : StoredDeclaration
        Declaration from a results file.
    stored_loadings : mapping of str to UserPart
        User-defined loadings from the results file, by name.
    study_with_user_code : Study, optional
        Study that contains the user-defined code. The measure, reductions and user-defined parts of
        this study are used. The plain fields of the measure are taken from the declaration.

    Returns
    -------
    Study
        Study that the declaration describes.

    Raises
    ------
    InvalidValue
        If the measure or a reduction is not part of rsfstudy, and ``study_with_user_code`` is None.
    DataError
        If the declaration is invalid. The message contains the path of the invalid entry.
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
    """Return the user-defined parts of a study and of its files."""
    others = {name: part for slot in SLOTS for name, part in slot.user_parts.items()}
    return {} if study is None else {**others, **study.user_parts}


def _rebuild_axis(plain_axis: StoredAxis, user_parts: Mapping[str, UserPart]) -> Axis:
    """Build an axis, and replace the names of user-defined parts by the parts."""
    named = schema.build_axis_from_stored(plain_axis)
    rows = [replace_names_by_user_parts(row, user_parts) for row in named.rows]
    return named.with_rows(rows, named.units, named.sampling_info)


def _rebuild_rig(stated_quantities: Mapping[str, float]) -> Rig:
    """Build a rig from its quantities."""
    unknown = sorted(set(stated_quantities) - {field.name for field in fields(Rig)})
    if unknown:
        raise invalid_part_error(f"declaration.laboratory.{unknown[0]}", "is unknown")
    return Rig(**stated_quantities)


def rebuild_measure(plain_measure: StoredMeasure, path_in_file: str) -> Measure:
    """Build a measure from its description.

    Parameters
    ----------
    plain_measure : StoredMeasure
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
    values: dict[str, Any] = dict(plain_measure)
    kind = _find_class_by_declared_name("measure", Measure, measures, values.pop("name"))
    given = dict(kind.fields_from_description(values, path_in_file))
    if isinstance(values.get("measure"), Mapping):
        given["measure"] = rebuild_measure(values.pop("measure"), f"{path_in_file}.measure")
    made: Measure = build_dataclass_from_plain_data(values, kind, path_in_file, **given)
    return made


def _rebuild_reduction(plain_reduction: StoredReduction, path_in_file: str) -> Reduction:
    """Build a reduction from its description."""
    values: dict[str, Any] = dict(plain_reduction)
    if values["kind"] == "spread":  # Older files use this name.
        values |= {"kind": "range", "over": values.pop("on", "")}
    kind = _find_class_by_declared_name("reduction", Reduction, reductions, values.pop("kind"))
    made: Reduction = build_dataclass_from_plain_data(values, kind, path_in_file)
    return made


def _find_class_by_declared_name(
    declaration_key: str, base_class: Any, exporting_package: ModuleType, declared_name: str
) -> Any:
    """Find a class of rsfstudy by its name in declarations.

    If the package that exports the classes has no class with this name, the function also searches
    the modules of the named studies.
    """
    for exported in exporting_package.__all__:
        getattr(exporting_package, exported)  # This loads the module of the class.
    if declared_name not in _named_subclasses(base_class):
        for study in study_names():
            load_study(study)
    kinds = _named_subclasses(base_class)
    if declared_name not in kinds:
        rule = "is not part of rsfstudy"
        raise InvalidValue(
            declaration_key, declared_name, rule, choices=kinds, remedy=_MISSING_STUDY_FILE_REMEDY
        )
    return kinds[declared_name]


def _named_subclasses(base_class: Any) -> dict[str, Any]:
    """Return the concrete subclasses in rsfstudy, by their names in files."""
    found: dict[str, Any] = {}
    for kind in base_class.__subclasses__():
        found |= _named_subclasses(kind)
        name = vars(kind).get("name") or vars(kind).get("kind")
        if name and kind.__module__.partition(".")[0] == __name__.partition(".")[0]:
            found[name] = kind
    return found


def find_primary_output(dataset: xr.Dataset) -> str | None:
    """Find the name of the main result of a dataset.

    If rsfstudy has no measure with the declared name, or if the main result is not numeric, the
    function returns the first numeric output with one value per cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str or None
        Name of the main result, or None if there is no numeric output with one value per cell.
    """
    cells = set(dataset["status"].dims)
    plain = [
        str(name)
        for name, values in dataset.data_vars.items()
        if set(values.dims) == cells
        and values.dtype.kind == "f"
        and find_coverage_content_type(str(name)) == "modelResult"
    ]
    try:
        described = schema.read_declaration(dataset).measure
        stated = rebuild_measure(described, "declaration.measure").primary_output
    except (DataError, InvalidValue):
        stated = ""
    return stated if stated in plain else next(iter(plain), None)
