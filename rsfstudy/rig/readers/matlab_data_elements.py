"""Functions that read numeric arrays from MATLAB files of versions 5 to 7.

The functions of this module check all lengths in the file. They replace ``scipy.io.loadmat``, which
can crash the Python interpreter if a file is damaged.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

#: Types of numbers, indexed by the type codes of data elements.
_NUMPY_TYPE_BY_MATLAB_TYPE_CODE = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8",
}  # fmt: skip
_MATRIX, _COMPRESSED = 14, 15
#: Class codes of structures and of numeric arrays.
_STRUCTURE, _NUMERIC_CLASSES = 2, range(6, 16)
_HEADER_BYTES, _TAG_BYTES = 128, 8
#: Maximum depth of nested structures, and maximum number of decompressed bytes.
_MAX_DEPTH, _MAX_DECOMPRESSED_BYTES = 4, 2**31


class _DataElement(NamedTuple):
    """Data element with its type code and its bytes."""

    type_code: int
    content_bytes: bytes


def read_numeric_arrays(file_bytes: bytes) -> dict[str, np.ndarray]:
    """Read the real numeric arrays of a MATLAB file.

    Parameters
    ----------
    file_bytes : bytes
        Bytes of a MATLAB file of version 5, 6 or 7.

    Returns
    -------
    dict of str to ndarray
        Arrays by variable name. Fields of structures have names such as ``file_bytes.time``.
        Variables that are not numeric are ignored.

    Raises
    ------
    ValueError
        If the file is damaged.
    """
    order = {b"IM": "<", b"MI": ">"}.get(file_bytes[_HEADER_BYTES - 2 : _HEADER_BYTES])
    if order is None:
        raise ValueError("the header does not state the byte order")
    found: dict[str, np.ndarray] = {}
    for element in _iterate_data_elements(file_bytes[_HEADER_BYTES:], order):
        if element.type_code == _COMPRESSED:
            for inner in _iterate_data_elements(_decompress_variable(element.content_bytes), order):
                found |= _read_numeric_matrix_or_structure(inner, order, "")
        else:
            found |= _read_numeric_matrix_or_structure(element, order, "")
    return found


def _decompress_variable(compressed_bytes: bytes) -> bytes:
    decompressor = zlib.decompressobj()
    try:
        found = decompressor.decompress(compressed_bytes, _MAX_DECOMPRESSED_BYTES)
    except zlib.error as error:
        raise ValueError(f"a variable cannot be decompressed: {error}") from error
    if decompressor.unconsumed_tail:
        raise ValueError("a variable is too large after decompression")
    return found


def _iterate_data_elements(element_bytes: bytes, byte_order: str) -> Iterator[_DataElement]:
    """Yield the data elements in a sequence of bytes.

    The padding of the last element may be missing.
    """
    start = 0
    while start + _TAG_BYTES <= len(element_bytes):
        first, size = (int(n) for n in np.frombuffer(element_bytes, f"{byte_order}u4", 2, start))
        if first >> 16:  # Small elements contain type, size and data in eight bytes.
            code, size = first & 0xFFFF, first >> 16
            content, end = element_bytes[start + 4 : start + 4 + size], start + _TAG_BYTES
        else:
            code, end = first, start + _TAG_BYTES + size
            content = element_bytes[start + _TAG_BYTES : end]
            if code != _COMPRESSED:
                end += -size % _TAG_BYTES
        if len(content) != size:
            raise ValueError("a variable ends beyond the end of the file")
        yield _DataElement(code, content)
        start = end


def _read_numeric_matrix_or_structure(
    element: _DataElement, byte_order: str, name_prefix: str
) -> dict[str, np.ndarray]:
    """Read a numeric array, or the numeric arrays in the fields of a structure."""
    if element.type_code != _MATRIX:
        return {}
    parts = [*_iterate_data_elements(element.content_bytes, byte_order)]
    if (
        len(parts) < 3
        or len(parts[0].content_bytes) < _TAG_BYTES
        or len(parts[1].content_bytes) % 4
    ):
        return {}
    kind = int(np.frombuffer(parts[0].content_bytes, f"{byte_order}u4", 1)[0]) & 0xFF
    shape = tuple(int(n) for n in np.frombuffer(parts[1].content_bytes, f"{byte_order}i4"))
    name = name_prefix + parts[2].content_bytes.decode("ascii", "replace")
    if (
        kind in _NUMERIC_CLASSES
        and len(parts) == 4
        and parts[3].type_code in _NUMPY_TYPE_BY_MATLAB_TYPE_CODE
    ):
        numbers = np.dtype(f"{byte_order}{_NUMPY_TYPE_BY_MATLAB_TYPE_CODE[parts[3].type_code]}")
        size = math.prod(shape) * numbers.itemsize
        if min(shape, default=-1) < 0 or len(parts[3].content_bytes) != size:
            raise ValueError(f"the variable {name!r} does not have the stated size")
        return {name: np.frombuffer(parts[3].content_bytes, numbers).reshape(shape, order="F")}
    if kind == _STRUCTURE and math.prod(shape) == 1 and name.count(".") < _MAX_DEPTH:
        return _read_structure_fields(parts, byte_order, name)
    return {}


def _read_structure_fields(
    structure_elements: list[_DataElement], byte_order: str, structure_name: str
) -> dict[str, np.ndarray]:
    """Read the numeric arrays in the fields of a structure.

    A structure consists of the following elements: flags, dimensions, name, length of the field
    names, field names, and fields.
    """
    if len(structure_elements) < 5 or len(structure_elements[3].content_bytes) < 4:
        raise ValueError(f"the structure {structure_name!r} has no fields")
    length = int(np.frombuffer(structure_elements[3].content_bytes, f"{byte_order}i4", 1)[0])
    texts = structure_elements[4].content_bytes
    if length < 1 or len(texts) // length != len(structure_elements) - 5:
        raise ValueError(f"the structure {structure_name!r} does not have the stated fields")
    found: dict[str, np.ndarray] = {}
    for number, field in enumerate(structure_elements[5:]):
        text = texts[number * length : (number + 1) * length].split(b"\0")[0]
        # The name of the matrix in a field is empty.
        found |= _read_numeric_matrix_or_structure(
            field, byte_order, f"{structure_name}.{text.decode('ascii', 'replace')}"
        )
    return found
