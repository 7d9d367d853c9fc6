"""Schema of results files, and functions that check whether files follow the schema.

``check_results_dataset`` checks a file before any other function uses the file. Error messages
contain the path of the invalid entry, for example ``declaration.claims[3].id``. The module
``stored_declarations`` contains the schema of the declaration.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypedDict

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, shorten_text
from rsfstudy.status import Status
from rsfstudy.storage.plain_data_conversion import build_invalid_entry_error, convert_plain_data
from rsfstudy.storage.stored_declarations import (
    StoredStudyDeclaration,
    build_scene_from_stored_fields,
    parse_study_declaration,
)
from rsfstudy.vocabulary import QUANTITY_BY_NAME

#: Version of the file layout. A file without a version number has layout 1. In layout 1, the digest
#: of each variable was stored as an attribute of the variable. In layouts 1 and 2, some variables
#: of fits and some fields of claims and reductions had other names (module ``former_data_names``).
FILE_LAYOUT_VERSION = 3


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
        Number of failed cells that the reductions omit. The string is empty if the reductions omit
        no cells.
    """

    id: str
    title: str
    completeness: str
    reduced_despite: str


class StoredRunFingerprint(TypedDict):
    """Code digests and versions that affect the results.

    The struct does not declare types for the other entries of a fingerprint, because these entries
    are only compared with the entries of another fingerprint.
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
        File that declares the study. The string is empty if the study was not declared in a file.
    versions : mapping of str to str
        Versions of Python and of the main packages.
    fingerprint : StoredRunFingerprint
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
    fingerprint: StoredRunFingerprint
    git: str
    machine: str


#: Dimensions of the tables that rsfstudy computes from records and motions, and the contents of
#: these tables.
_TABLE_CONTENTS_BY_DIMENSION = {
    "hold": "a table of holds",
    "event": "a catalogue of events",
    "step": "a table of steps",
    "portion": "the machine stiffness",
    "time": "a laboratory record",
}
#: NumPy dtype kinds that variables may have, and a description of these kinds for error messages.
_ALLOWED_DTYPE_KINDS = ("iufbOUT", "numbers or strings")
_DTYPE_KINDS_OF_REQUIRED_VARIABLES = {
    "status": ("i", "whole numbers"),
    "message": ("OUT", "strings"),
    "rhs_evaluations": ("iu", "whole numbers"),
    "wall_time": ("f", "numbers"),
}


def check_results_dataset(dataset: xr.Dataset) -> None:
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
            f"layout is {shorten_text(layout)}, but this version of rsfstudy reads the layouts 1 "
            f"to {FILE_LAYOUT_VERSION}. Open the file with the version of rsfstudy in its "
            "attribute source."
        )
    attrs = convert_plain_data({"reduced_despite": "", **dataset.attrs}, RootAttributes, "")
    name = read_study_declaration(dataset).name
    if attrs["id"] != name or not name.isidentifier():
        raise build_invalid_entry_error(
            "id",
            f"is {shorten_text(attrs['id'])!r}, but the declared study is {shorten_text(name)!r}",
        )
    for variable in _DTYPE_KINDS_OF_REQUIRED_VARIABLES:
        if variable not in dataset.data_vars:
            raise build_invalid_entry_error(variable, "is missing")
        if dataset[variable].dims != dataset["status"].dims:
            dims = dataset[variable].dims
            raise build_invalid_entry_error(
                variable,
                f"has the dimensions {dims}, but status has the dimensions "
                f"{dataset['status'].dims}",
            )
    for key, values in dataset.variables.items():
        if key in QUANTITY_BY_NAME or key in dataset.coords:  # Users may add other variables.
            _check_dtype_kind(str(key), values)
    for name in map(str, dataset["status"].dims):
        if name not in dataset.coords or dataset[name].dims != (name,):
            raise build_invalid_entry_error(name, "is not a dimension coordinate")
        if not dataset.indexes[name].is_unique:
            raise build_invalid_entry_error(name, "has the same value more than once")
    unknown = np.setdiff1d(dataset["status"].values, [int(status) for status in Status])
    if unknown.size:
        raise build_invalid_entry_error(
            "status", f"is {unknown[0]} in a cell, which is not the code of a status"
        )


def is_of_single_scene(dataset: xr.Dataset) -> bool:
    """Return True if a dataset belongs to a single scene.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset written by rsfstudy.

    Returns
    -------
    bool
        True for a motion, a limit cycle or a critical step, and False for the results of a study.
    """
    return "scene" in dataset.attrs and "declaration" not in dataset.attrs


def describe_table_contents(dataset: xr.Dataset) -> str:
    """Describe a table that rsfstudy has computed from a record or a motion.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset written by rsfstudy.

    Returns
    -------
    str
        Description of the contents, for example "a table of holds". The string is empty if the
        dataset is not a table, but the results of a study or the dataset of a single scene.
    """
    dimensions = [*map(str, dataset.dims)]
    if len(dimensions) != 1 or not {"scene", "declaration"}.isdisjoint(dataset.attrs):
        return ""
    is_from_study = "status" in dataset.variables or "Conventions" not in dataset.attrs
    return "" if is_from_study else _TABLE_CONTENTS_BY_DIMENSION.get(dimensions[0], "")


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
            f"{file_description} contains a single scene ({title}), not the results of a study. "
            "Open the file with xarray.open_dataset. To draw a motion, use "
            "rsfstudy.plot_motion(dataset) or dataset.rsf.plot()."
        )


def read_study_declaration(dataset: xr.Dataset) -> StoredStudyDeclaration:
    """Read the declaration of the study that produced a dataset.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    StoredStudyDeclaration
        Declaration of the study.

    Raises
    ------
    DataError
        If the declaration is missing or invalid.
    """
    declared = parse_study_declaration(read_json_attribute(dataset, "declaration"))
    if read_provenance(dataset)["fingerprint"]["own_code"] == "none":
        build_scene_from_stored_fields(declared.base)
    return declared


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
    convert_plain_data(origin, StoredProvenance, "provenance")
    return origin


def read_scene_fields(dataset: xr.Dataset) -> dict[str, Any]:
    """Read the scene fields from the attributes of a dataset.

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
        convert_plain_data(read_json_attribute(dataset, "scene"), Mapping[str, Any], "scene")
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
        raise build_invalid_entry_error(attribute_name, "is missing")
    try:
        return json.loads(dataset.attrs[attribute_name])
    except (TypeError, ValueError, RecursionError) as error:
        raise build_invalid_entry_error(
            attribute_name, f"is not valid JSON ({shorten_text(error)})"
        ) from error


def _check_dtype_kind(variable_name: str, values: xr.Variable) -> None:
    """Raise ``DataError`` if a variable has the wrong kind of dtype."""
    kinds, wanted = _DTYPE_KINDS_OF_REQUIRED_VARIABLES.get(variable_name, _ALLOWED_DTYPE_KINDS)
    kind = values.dtype.kind
    if kind not in kinds:
        raise build_invalid_entry_error(
            variable_name, f"contains {values.dtype}, but must contain {wanted}"
        )
    if kind == "O" and not all(isinstance(text, str) for text in values.values.flat):
        raise build_invalid_entry_error(
            variable_name, f"contains objects, but must contain {wanted}"
        )
