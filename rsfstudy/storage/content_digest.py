"""Digest of the contents of a dataset.

The digest is computed from the numbers, the strings and the declaration of the dataset. The NetCDF
file stores this digest in an attribute, so the digest is preserved if another program saves the
file. A second digest, which is stored at the end of the file, is computed from all bytes of the
file. The digest at the end is lost if the file is truncated or if another program saves the file.
The digest of the contents is needed because HDF5 stores no checksums of the data or of attributes
larger than 4 kB, such as a long declaration. HDF5 stores checksums only for names, shapes and small
attributes.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, shorten_text
from rsfstudy.quantities import read_units_or_reference_scale

#: Name of the attribute that contains the digest of the contents.
CONTENT_DIGEST_ATTRIBUTE = "content_digest"
#: Names of the attributes that the digest includes. These attributes affect how rsfstudy interprets
#: the numbers.
_NAMES_OF_DIGESTED_ATTRIBUTES = ("declaration", "provenance", "scene", "end", "laboratory")


def compute_content_digest(dataset: xr.Dataset) -> str:
    """Compute the digests of all variables and attributes as a JSON string.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset to write.

    Returns
    -------
    str
        JSON object with the digest of each variable and the digest of each included attribute.
    """
    return json.dumps(_compute_variable_and_attribute_digests(dataset))


def check_content_digest(dataset: xr.Dataset, path: str) -> None:
    """Check the contents of a dataset against its digest.

    A dataset without a digest is not checked. The function checks only attributes and variables
    that are listed in the digest. If the dimensions, the shape or the units of a variable have
    changed, the variable is not checked. Other programs may therefore add, remove, select or
    convert variables.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset that was loaded from the file.
    path : str
        Path of the file, for the error message.

    Raises
    ------
    DataError
        If a number, a string or the declaration does not match the digest.
    """
    if CONTENT_DIGEST_ATTRIBUTE not in dataset.attrs:
        return
    listed, found = (
        _parse_digest(dataset.attrs[CONTENT_DIGEST_ATTRIBUTE]),
        _compute_variable_and_attribute_digests(dataset),
    )
    if not listed:
        raise _build_damaged_file_error(path, CONTENT_DIGEST_ATTRIBUTE)
    for name in [name for name in found if name in listed]:
        (form, _, digest), (form_now, _, digest_now) = (
            each[name].rpartition(" ") for each in (listed, found)
        )
        if form == form_now and digest != digest_now:
            raise _build_damaged_file_error(path, name)


def _build_damaged_file_error(path: str, part_name: str) -> DataError:
    """Build the error for a file that does not match its digest."""
    return DataError(
        f"{path} is damaged or was edited, because {shorten_text(part_name)} does not match its "
        "digest. Run the study again. If you changed the file on purpose, delete the attribute "
        f"{CONTENT_DIGEST_ATTRIBUTE} and save the file again."
    )


def _compute_variable_and_attribute_digests(dataset: xr.Dataset) -> dict[str, str]:
    """Compute one digest for each variable and each attribute.

    The entry of a variable contains the sizes, units and scale of the variable, followed by the
    digest of the values.
    """
    texts = {
        name: str(dataset.attrs[name])
        for name in _NAMES_OF_DIGESTED_ATTRIBUTES
        if name in dataset.attrs
    }
    found = {
        f"attribute {name}": f"text {_hash_bytes(text.encode())}" for name, text in texts.items()
    }
    for name, values in dataset.variables.items():
        form = f"{dict(values.sizes)} {read_units_or_reference_scale(values.attrs)}"
        found[str(name)] = f"{form} {_hash_bytes(_convert_array_to_portable_bytes(values.values))}"
    return found


def _hash_bytes(content: bytes) -> str:
    """Compute the BLAKE2b digest of bytes."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def _convert_array_to_portable_bytes(values: np.ndarray) -> bytes:
    """Convert an array to bytes that do not depend on the storage format."""
    if values.dtype.kind in "OUTS":
        return json.dumps([str(text) for text in values.flat]).encode()
    numbers = np.asarray(values, dtype="<f8")
    return np.where(np.isnan(numbers), np.nan, numbers).tobytes()


def _parse_digest(text: object) -> Mapping[str, str]:
    """Parse a digest string. If the string is invalid, return an empty mapping."""
    try:
        listed = json.loads(str(text))
    except (ValueError, RecursionError):
        return {}
    is_digest = isinstance(listed, dict) and all(isinstance(x, str) for x in listed.values())
    return listed if is_digest else {}
