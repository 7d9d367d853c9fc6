"""Functions that rebuild a study from the declaration in its results file.

``rebuild_study`` is the main function. A declaration contains only plain data, so no code from the
results file is executed. If a study contains user-defined code, the code is imported from the
Python file that declares the study.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import xarray as xr

from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.slider import SceneFields, UserPart
from rsfstudy.storage import schema, stored_loadings
from rsfstudy.storage.lattice_coordinates import build_dimension_coordinates
from rsfstudy.storage.plain_data_conversion import build_invalid_entry_error
from rsfstudy.storage.stored_declarations import (
    MISSING_STUDY_FILE_REMEDY,
    StoredStudyDeclaration,
    build_measure,
    build_reduction,
    build_rig,
    build_scene_from_stored_fields,
    find_user_part_missing_from_file,
)
from rsfstudy.study import Study, list_study_names, load_study
from rsfstudy.vocabulary import find_coverage_content_type


def rebuild_study(results: xr.Dataset, study_file: str | Path | None = None) -> Study:
    """Rebuild the study that produced a results dataset.

    If a named study contains user-defined parts, the function imports the parts from the module of
    the named study.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study.
    study_file : str or Path, optional
        Python file that declares the study. The file is required if the study contains user-defined
        code.

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
    declared = schema.read_study_declaration(results)
    if (
        study_file is None
        and declared.name in list_study_names()
        and find_user_part_missing_from_file(declared)
    ):
        study_file = declared.name
    for axis in declared.axes:
        points = results.sizes.get(axis.dimension)
        declared_points = len(axis.build_axis())
        if declared_points != points:
            rule = (
                f"has {declared_points} points in the declaration, but {points} points in the file"
            )
            raise build_invalid_entry_error(axis.dimension, rule)
    held = stored_loadings.read_user_loadings(results)
    if study_file is None and depends_on_user_code(results):
        rule = "is user-defined, and code is never loaded from a results file"
        remedy, named_in = (
            MISSING_STUDY_FILE_REMEDY,
            schema.read_provenance(results)["declared_in"],
        )
        if named_in:
            remedy += f" The study was declared in {shorten_text(named_in)}."
        name, value = find_user_part_missing_from_file(declared, held) or (
            "measure",
            declared.measure["name"],
        )
        raise InvalidValue(name, value, rule, remedy=remedy)
    named = None if study_file is None else load_study(str(study_file))
    if named and named.name != declared.name:
        rule = (
            f"declares the study {named.name!r}, but the results belong to the study "
            f"{declared.name!r}"
        )
        raise InvalidValue("study", str(study_file), rule)
    study = build_study_from_declaration(declared, held, named)
    _check_axes_match_results(study, results)
    return study


def rebuild_study_without_user_code(results: xr.Dataset) -> Study:
    """Rebuild the study that produced a dataset, with all of its cells.

    The rebuilt study contains all cells, even if the dataset is a selection of cells.

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
    declared, about = schema.read_study_declaration(results), schema.read_provenance(results)
    if depends_on_user_code(results):
        rule = "contains user-defined code, and code is never loaded from a dataset"
        remedy = f"Import the study from the file that declares the study. {about['declared_in']}"
        raise InvalidValue("study", declared.name, rule, remedy=remedy.strip())
    return build_study_from_declaration(declared, stored_loadings.read_user_loadings(results))


def depends_on_user_code(results: xr.Dataset) -> bool:
    """Return True if user-defined code affected the results.

    User-defined loadings do not count as code, because the results contain their samples or
    segments. If the results contain user-defined loadings, the function searches the axes and the
    base scene for other user-defined parts.

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
    held = stored_loadings.read_user_loadings(results)
    return (
        not held
        or find_user_part_missing_from_file(schema.read_study_declaration(results), held)
        is not None
    )


def _check_axes_match_results(study: Study, results: xr.Dataset) -> None:
    """Check that the axes of the results match the declaration."""
    dims = results["status"].dims
    if dims != study.dimensions:
        raise build_invalid_entry_error(
            "status", f"has the dimensions {dims}, which differ from the axes of the declaration"
        )
    for name, values in build_dimension_coordinates(study).items():
        if values.tolist() != results[name].values.tolist():
            raise build_invalid_entry_error(name, "differs from the axis in the declaration")


def build_study_from_declaration(
    declaration: StoredStudyDeclaration,
    stored_loadings: Mapping[str, UserPart],
    study_with_user_code: Study | None = None,
) -> Study:
    """Build a study from its declaration.

    Parameters
    ----------
    declaration : StoredStudyDeclaration
        Declaration from a results file.
    stored_loadings : mapping of str to UserPart
        User-defined loadings from the results file, by name.
    study_with_user_code : Study, optional
        Study that contains the user-defined code. The rebuilt study has the measure, the reductions
        and the user-defined parts of this study. The values of the measure fields are read from the
        declaration.

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
    parts["base"] = build_scene_from_stored_fields(declaration.base, own)
    if study_with_user_code is None:
        parts["measure"] = build_measure(declaration.measure, "declaration.measure")
        parts["reductions"] = [
            build_reduction(described, f"declaration.reductions[{number}]")
            for number, described in enumerate(declaration.reductions)
        ]
    else:
        for name in ("reductions", "source_file"):
            parts[name] = getattr(study_with_user_code, name)
        kind = study_with_user_code.measure
        stated = {
            name: v for name, v in declaration.measure.items() if name in kind.scalar_field_values
        }
        parts["measure"] = kind.with_(**stated)
    try:
        parts["axes"] = [axis.build_axis(own) for axis in declaration.axes]
        del parts["rig_quantities"]
        if declaration.rig_quantities is not None:
            parts["rig"] = build_rig(declaration.rig_quantities)
        return Study(**parts)
    except InvalidValue as error:
        raise build_invalid_entry_error("declaration", f"is not a valid study ({error})") from error


def _collect_known_user_parts(study: Study | None) -> Mapping[str, UserPart]:
    """Return the user-defined parts that are registered or belong to a study, keyed by name.

    If the study is None, the mapping is empty.
    """
    others = {
        name: part for slot in SceneFields.PART_SLOTS for name, part in slot.user_parts.items()
    }
    return {} if study is None else {**others, **study.user_parts}


def find_primary_output_name(dataset: xr.Dataset) -> str | None:
    """Find the name of the primary output of a dataset.

    The primary output is the output that the measure declares as its main result. If rsfstudy has
    no measure with the declared name, or if the declared output is not numeric, the function
    returns the first numeric output with one value per cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    str or None
        Name of the primary output. The function returns None if no numeric output has one value per
        cell.
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
        described = schema.read_study_declaration(dataset).measure
        stated = build_measure(described, "declaration.measure").primary_output
    except (DataError, InvalidValue):
        stated = ""
    return stated if stated in plain else next(iter(plain), None)
