"""Lazy exports of packages.

A package imports a module when one of the exported names of the module is first used.
"""

from __future__ import annotations

import importlib
import operator
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rsfstudy._deprecation import NEW_NAME_BY_OWNER_AND_FORMER_NAME, warn_renamed


def build_lazy_export_functions(
    package_name: str, names_by_module: Mapping[str, Iterable[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Create the ``__getattr__`` and ``__dir__`` functions of a package.

    Parameters
    ----------
    package_name : str
        Full name of the package. The functions also look up the former names of the package in
        ``NEW_NAME_BY_OWNER_AND_FORMER_NAME``.
    names_by_module : mapping of str to iterable of str
        Exported names by module. Each module is specified by its path relative to ``rsfstudy``. The
        entry ``"name as other"`` exports ``name`` under the name ``other``.

    Returns
    -------
    __getattr__, __dir__ : callable
        Functions to assign in the ``__init__`` module of the package.
    """
    sources: dict[str, tuple[str, str]] = {}
    for module, names in names_by_module.items():
        for name, _, other in (entry.partition(" as ") for entry in names):
            sources[other or name] = f"rsfstudy.{module}", name
    renamed = NEW_NAME_BY_OWNER_AND_FORMER_NAME.get(package_name, {})

    def get(name: str) -> Any:
        if name in renamed:
            warn_renamed(name, renamed[name], package_name)
            return operator.attrgetter(renamed[name])(sys.modules[package_name])
        if name not in sources:
            raise AttributeError(f"module {package_name!r} has no attribute {name!r}")
        module, original = sources[name]
        value = getattr(importlib.import_module(module), original)
        setattr(sys.modules[package_name], name, value)
        return value

    return get, lambda: sorted(sources)
