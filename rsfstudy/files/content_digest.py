"""Digest of the numbers, texts and declaration of a dataset, kept in its NetCDF file.

The digest of all bytes at the end of a file is lost if the file is cut short or if another
program saves it. This digest is an attribute, so it is still there. HDF5 protects small
attributes, names and shapes by checksums of its own, but not the data and not attributes above
4 kB, which the declaration may exceed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, brief
from rsfstudy.quantity import units_and_scale

#: The attribute of the file that holds the digest.
ATTRIBUTE = "content_digest"
#: Attributes of the file that decide how rsfstudy interprets its numbers.
_ATTRIBUTES = ("declaration", "provenance", "scene", "end", "laboratory")


def compute_content_digest(dataset: xr.Dataset) -> str:
    """Compute the digests of all variables and of the declaration, as JSON."""
    return json.dumps(_digests(dataset))


def check_content(dataset: xr.Dataset, path: str) -> None:
    """Check a dataset against the digest that it carries, if there is one.

    Only attributes and variables that the digest lists are compared, and variables only if their
    dimensions, shape and units are still the listed ones. Another program may thus add, remove,
    select or convert variables.

    Parameters
    ----------
    dataset : xarray.Dataset
        The dataset as it was loaded.
    path : str
        The file, for the error.

    Raises
    ------
    DataError
        If a number, a text or the declaration differs from the digest.
    """
    if ATTRIBUTE not in dataset.attrs:
        return
    listed, found = _parse(dataset.attrs[ATTRIBUTE]), _digests(dataset)
    if not listed:
        raise _damaged(path, ATTRIBUTE)
    for name in [name for name in found if name in listed]:
        (form, _, digest), (form_now, _, digest_now) = (
            each[name].rpartition(" ") for each in (listed, found)
        )
        if form == form_now and digest != digest_now:
            raise _damaged(path, name)


def _damaged(path: str, name: str) -> DataError:
    return DataError(
        f"{path} is damaged, or was edited: {brief(name)} is not what was written. Run the study "
        f"again. If you changed it on purpose, delete the attribute {ATTRIBUTE} and save the file "
        "again."
    )


def _digests(dataset: xr.Dataset) -> dict[str, str]:
    """Compute one digest per variable and attribute, preceded by its form."""
    texts = {name: str(dataset.attrs[name]) for name in _ATTRIBUTES if name in dataset.attrs}
    found = {f"attribute {name}": f"text {_digest(text.encode())}" for name, text in texts.items()}
    for name, values in dataset.variables.items():
        form = f"{dict(values.sizes)} {units_and_scale(values.attrs)}"
        found[str(name)] = f"{form} {_digest(_to_bytes(values.values))}"
    return found


def _digest(content: bytes) -> str:
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def _to_bytes(values: np.ndarray) -> bytes:
    """Return the same bytes for the same numbers or texts, however a file stores them."""
    if values.dtype.kind in "OUTS":
        return json.dumps([str(text) for text in values.flat]).encode()
    numbers = np.asarray(values, dtype="<f8")
    return np.where(np.isnan(numbers), np.nan, numbers).tobytes()


def _parse(text: object) -> Mapping[str, str]:
    """Parse a digest; an empty mapping if it is not one."""
    try:
        listed = json.loads(str(text))
    except (ValueError, RecursionError):
        return {}
    is_digest = isinstance(listed, dict) and all(isinstance(x, str) for x in listed.values())
    return listed if is_digest else {}
