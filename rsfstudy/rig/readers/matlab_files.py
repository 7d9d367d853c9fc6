"""Reader of MATLAB files."""

from __future__ import annotations

import importlib
import io
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.rig.readers.matlab_data_elements import read_numeric_arrays
from rsfstudy.rig.readers.missing_libraries import build_missing_library_error
from rsfstudy.rig.readers.tables_from_files_or_objects import (
    LazyTable,
    TableSource,
    build_table_of_arrays,
)

_SIGNATURE_5, _SIGNATURE_7_3 = b"MATLAB 5.0", b"MATLAB 7.3"
#: Maximum depth of nested structures, and maximum number of columns of a matrix.
_MAX_DEPTH, _MAX_COLUMNS = 4, 200


def is_matlab_file(source: TableSource) -> bool:
    """Return True if the file is a MATLAB file of version 5 to 7.3.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the file is a MATLAB file.
    """
    return source.first_bytes_of_file.startswith((_SIGNATURE_5, _SIGNATURE_7_3))


def read_matlab_file(source: TableSource) -> LazyTable:
    """Read the numeric arrays of a MATLAB file.

    Each vector and each column of a matrix becomes a column of the table. The headings are the
    names of variables and structure fields. The columns of a matrix are numbered, as in ``data_1``.
    If several fields have the same name, the headings include the names of the structures, as in
    ``data.time``.

    Parameters
    ----------
    source : TableSource
        MATLAB file.

    Returns
    -------
    LazyTable
        Columns of equal length. If the arrays differ in length, the table contains only the arrays
        with the most common length. If several lengths are equally common, the longest of these
        lengths is used.

    Raises
    ------
    DataError
        If the file is damaged, or if the file requires h5py and h5py is not installed.
    InvalidValue
        If the file contains no numeric arrays.
    """
    data = source.read_all_bytes()
    is_hdf5 = source.first_bytes_of_file.startswith(_SIGNATURE_7_3)
    try:
        variables = _read_matlab_7_3_arrays(data) if is_hdf5 else read_numeric_arrays(data)
    except ImportError as error:
        raise build_missing_library_error(
            source, "a MATLAB file of v7.3", "hdf5", "h5py"
        ) from error
    except Exception as error:  # Damaged files cause errors of many types.
        raise DataError(
            f"{source.path_or_object}: cannot be read as a MATLAB file ({error})"
        ) from error
    columns = dict(_iterate_vectors_of_structures(variables))
    sizes = [len(array) for array in columns.values()]
    size = max(sizes, key=lambda n: (sizes.count(n), n), default=0)
    names = [name for name, array in columns.items() if len(array) == size]
    if not names:
        rule = "contains no vectors of numbers"
        raise InvalidValue(
            "record", str(source.path_or_object), rule, remedy="Save one vector per column."
        )
    names_of_fields = [name.rpartition(".")[2] for name in names]
    unique = [
        field if names_of_fields.count(field) == 1 else name
        for field, name in zip(names_of_fields, names, strict=True)
    ]
    return build_table_of_arrays(
        unique, [columns[name] for name in names], str(source.path_or_object)
    )


def _read_matlab_7_3_arrays(file_bytes: bytes) -> dict[str, Any]:
    h5py = importlib.import_module("h5py")

    def convert(group: Any, depth: int) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, item in group.items():
            if name.startswith("#"):  # MATLAB stores referenced objects in this group.
                continue
            if isinstance(item, h5py.Group):
                if depth < _MAX_DEPTH:
                    found[name] = convert(item, depth + 1)
            elif item.dtype.kind in "fiu" and item.attrs.get("MATLAB_class", b"") != b"char":
                # HDF5 stores the dimensions in reverse order.
                found[name] = np.asarray(item).T
        return found

    with h5py.File(io.BytesIO(file_bytes), "r") as file:
        return convert(file, 0)


def _iterate_vectors_of_structures(
    variables: Mapping[str, Any], name_prefix: str = ""
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the numeric vectors of nested structures with their names."""
    for name, value in variables.items():
        if isinstance(value, Mapping):
            if name_prefix.count(".") < _MAX_DEPTH:
                yield from _iterate_vectors_of_structures(value, f"{name_prefix}{name}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or array.size < 2:
            continue
        array = array.squeeze()
        if array.ndim == 1:
            yield f"{name_prefix}{name}", array
        elif array.ndim == 2 and array.shape[1] <= _MAX_COLUMNS:
            for number, column in enumerate(array.T, start=1):
                yield f"{name_prefix}{name}_{number}", column
