"""The named studies: found by file name, loaded one at a time."""

from __future__ import annotations

import importlib
import pkgutil

from rsfstudy.errors import InvalidValue
from rsfstudy.study import Study

#: Where the files of `studies/` are installed.
_PACKAGE = "rsfstudy.named_studies"


def names() -> tuple[str, ...]:
    """Names of the studies, in alphabetical order; files that start with _ are shared by them."""
    package = importlib.import_module(_PACKAGE)
    found = (module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(sorted(name for name in found if not name.startswith("_")))


def load(name: str) -> Study:
    """The declaration of a named study.

    Raises
    ------
    InvalidValue
        For a name there is no study of, with close matches.
    """
    if name not in names():
        raise InvalidValue("study", name, "is unknown", choices=names())
    study: Study = importlib.import_module(f"{_PACKAGE}.{name}").study
    return study
