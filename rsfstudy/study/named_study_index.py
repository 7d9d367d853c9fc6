"""Functions that list the names and read the titles of the named studies.

The functions do not import the studies, because an import would load all measures and parts.
"""

from __future__ import annotations

import ast
import importlib
import pkgutil
from pathlib import Path

#: Import path of the package with the named studies.
NAMED_STUDIES_PACKAGE = "rsfstudy.named_studies"


def list_study_names() -> tuple[str, ...]:
    """Return the names of all studies in the folder ``studies``.

    Returns
    -------
    tuple of str
        Names in alphabetical order. Modules whose names start with an underscore are omitted,
        because they contain code that studies share.
    """
    package = importlib.import_module(NAMED_STUDIES_PACKAGE)
    modules = (module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(sorted(name for name in modules if not name.startswith("_")))


def read_study_titles() -> dict[str, str]:
    """Read the titles of the named studies from their source files.

    Returns
    -------
    dict of str to str
        Titles by name.
    """
    (place,) = importlib.import_module(NAMED_STUDIES_PACKAGE).__path__
    files = {name: Path(place, f"{name}.py") for name in list_study_names()}
    return {name: _read_title_from_source(file.read_bytes()) for name, file in files.items()}


def _read_title_from_source(source_code: bytes) -> str:
    """Read the title of a study from its source code."""
    # The source code before the declaration is not parsed, because parsing it would double the run
    # time.
    declared = ast.parse(source_code[source_code.index(b"\nstudy = ") :]).body[0]
    assert isinstance(declared, ast.Assign)
    assert isinstance(declared.value, ast.Call)
    given = {keyword.arg: keyword.value for keyword in declared.value.keywords}
    return str(ast.literal_eval(given["title"]))
