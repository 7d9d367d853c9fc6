"""Functions that compare and merge the fingerprints of runs and journals.

A fingerprint contains the settings and the code digests that affect results. The ``physics`` entry
contains one code digest for each rsfstudy module that is imported, directly or indirectly, by the
measure or by the parts of the scenes. Two fingerprints may contain different modules. For example,
if a study uses additional laws, its fingerprint also contains the modules of these laws. Two
fingerprints have matching code if every module that occurs in both fingerprints has the same digest
in both. Older fingerprints contain a single digest that covers all modules.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from rsfstudy.formatting import format_abbreviated_list

#: Name of the entry that contains the code digests of modules.
_CODE_DIGESTS_KEY = "physics"


def find_fingerprint_differences(
    first: Mapping[str, Any], second: Mapping[str, Any]
) -> dict[str, tuple[Any, Any]]:
    """Find the entries that differ between two fingerprints.

    Both fingerprints are converted to JSON and back before the comparison, because a fingerprint
    that was read from a file contains lists instead of tuples.

    Parameters
    ----------
    first, second : mapping of str to object
        Fingerprints to compare.

    Returns
    -------
    dict of str to tuple of (object, object)
        Entries that differ, by name. Each value contains the entry of the first fingerprint and the
        entry of the second fingerprint. None replaces a missing entry. If the code of modules
        differs, the name of the entry lists these modules, for example ``"physics
        (slider.friction)"``.
    """
    both: list[dict[str, Any]] = [json.loads(json.dumps(each)) for each in (first, second)]
    codes = [each.get(_CODE_DIGESTS_KEY) for each in both]
    for fingerprint, code, other in zip(both, codes, reversed(codes), strict=True):
        if isinstance(code, dict) and isinstance(other, dict):
            del fingerprint[_CODE_DIGESTS_KEY]
            names = sorted(name for name in code.keys() & other if code[name] != other[name])
            if names:
                changed = {name: code[name] for name in names}
                fingerprint[f"{_CODE_DIGESTS_KEY} ({format_abbreviated_list(names, ', ')})"] = (
                    _combine_code_digests(changed)
                )
        elif isinstance(code, dict):  # An older fingerprint contains one digest of all modules.
            fingerprint[_CODE_DIGESTS_KEY] = _combine_code_digests(code)
    first, second = both
    return {
        name: (first.get(name), second.get(name))
        for name in sorted({*first, *second})
        if first.get(name) != second.get(name)
    }


def merge_fingerprints(
    stored_fingerprint: Mapping[str, Any], run_fingerprint: Mapping[str, Any]
) -> dict[str, Any]:
    """Add the modules of the journal fingerprint to the fingerprint of a run.

    Parameters
    ----------
    stored_fingerprint, run_fingerprint : mapping of str to object
        Fingerprints of the journal and of the run. The code of both fingerprints must agree.

    Returns
    -------
    dict of str to object
        Fingerprint of the run, with the code digests of all modules in both fingerprints.
    """
    code, current_code = (
        stored_fingerprint.get(_CODE_DIGESTS_KEY),
        run_fingerprint.get(_CODE_DIGESTS_KEY),
    )
    if not isinstance(code, dict) or not isinstance(current_code, dict):
        return dict(run_fingerprint)
    return {**run_fingerprint, _CODE_DIGESTS_KEY: {**code, **current_code}}


def _combine_code_digests(digests_by_module: Mapping[str, str]) -> str:
    """Combine the code digests of several modules into one digest."""
    text = json.dumps(digests_by_module, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
