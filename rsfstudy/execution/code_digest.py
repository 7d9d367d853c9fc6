"""Digests of user-defined classes and of the measures in named studies.

The digests are computed from the objects in memory, because the source files may have changed since
the import. The digest of a measure in a named study covers only the measure and the code that it
uses, because the other code in the module of the study does not affect the results. The digests
exclude the code of Python, installed packages and rsfstudy itself. The module
``module_import_graph`` computes the digests of rsfstudy.
"""

from __future__ import annotations

import functools
import site
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path

from rsfstudy.object_digest import ObjectDigest
from rsfstudy.study import NAMED_STUDIES_PACKAGE as STUDIES

_PACKAGE_NAME = Path(__file__).parent.parent.name
_PYTHON_INSTALLATION_DIRECTORIES = tuple(
    Path(path).resolve()
    for path in {
        *(sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")),
        *site.getsitepackages(),
        site.getusersitepackages(),
    }
)


def digest_measures_of_named_studies(measure_classes: Iterable[type]) -> dict[str, str]:
    """Compute the digest of the measures that named studies define.

    Parameters
    ----------
    measure_classes : iterable of type
        Class of the measure, and classes of nested measures.

    Returns
    -------
    dict of str to str
        Dictionary with one entry: the key contains the names of the modules, and the value is the
        digest of the measures. The dictionary is empty if no class is defined in the module of a
        named study.
    """
    theirs = tuple(kind for kind in measure_classes if _is_module_of_named_study(kind.__module__))
    names = ", ".join(dict.fromkeys(kind.__module__.removeprefix("rsfstudy.") for kind in theirs))
    return {names: _compute_digest_of_objects(theirs)} if theirs else {}


def digest_user_classes(*classes_or_data: object) -> str:
    """Compute the digest of user-defined classes and of the code they use.

    Parameters
    ----------
    *classes_or_data : object
        Classes, and data such as protocols. The function ignores classes of rsfstudy and of
        installed packages.

    Returns
    -------
    str
        Digest of 16 hexadecimal digits, or "none" if there are no user-defined classes or data.
    """
    own = tuple(
        one if isinstance(one, type) else repr(one)
        for one in classes_or_data
        if not isinstance(one, type) or _is_user_module(one.__module__)
    )
    return _compute_digest_of_objects(own) if own else "none"


def _compute_digest_of_objects(objects: tuple[object, ...]) -> str:
    """Compute the digest of objects and of the code that the objects use."""
    return (
        ObjectDigest(lambda m: _is_module_of_named_study(m) or _is_user_module(m))
        .add_object(objects)
        .hexdigest()
    )


def is_defined_in_rsfstudy(defined_class: type) -> bool:
    """Return True if a class is defined in rsfstudy but not in a named study.

    Parameters
    ----------
    defined_class : type
        Class of a measure or of a part.

    Returns
    -------
    bool
        False for user-defined classes and for classes in the modules of named studies.
    """
    module = defined_class.__module__
    return module.partition(".")[0] == _PACKAGE_NAME and not _is_module_of_named_study(module)


def _is_module_of_named_study(module_name: str | None) -> bool:
    """Return True if a module belongs to the named studies."""
    return (module_name or "").startswith(f"{STUDIES}.")


def _is_user_module(module_name: str | None) -> bool:
    """Return True if a module is user-defined.

    Modules that belong to Python, an installed package or rsfstudy are not user-defined.
    """
    top = (module_name or "").partition(".")[0]
    if not top or top == _PACKAGE_NAME or (top in sys.stdlib_module_names and top != "__main__"):
        return False
    return not _is_installed_file(getattr(sys.modules.get(top), "__file__", None))


@functools.cache
def _is_installed_file(file_path: str | None) -> bool:
    """Return True if a file belongs to Python or to an installed package."""
    return file_path is not None and any(
        Path(file_path).resolve().is_relative_to(p) for p in _PYTHON_INSTALLATION_DIRECTORIES
    )
