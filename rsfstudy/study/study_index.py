"""Names and titles of the named studies, none of which is run."""

from __future__ import annotations

import ast
import importlib
import pkgutil
from pathlib import Path

#: Where the files of `studies/` are installed.
STUDIES_PACKAGE = "rsfstudy.named_studies"


def study_names() -> tuple[str, ...]:
    """Names of the studies, in alphabetical order; files that start with _ are shared by them."""
    package = importlib.import_module(STUDIES_PACKAGE)
    modules = (module.name for module in pkgutil.iter_modules(package.__path__))
    return tuple(sorted(name for name in modules if not name.startswith("_")))


def study_titles() -> dict[str, str]:
    """Titles of the studies, by name, as they stand in their files: none is run, because that would
    load all that studies are made of.
    """
    (place,) = importlib.import_module(STUDIES_PACKAGE).__path__
    files = {name: Path(place, f"{name}.py") for name in study_names()}
    return {name: _read_title_from_source(file.read_bytes()) for name, file in files.items()}


def _read_title_from_source(source_code: bytes) -> str:
    """The text given as ``title`` to the call whose value is named `study`."""
    # what stands before it need not be parsed, which would take as long again
    declared = ast.parse(source_code[source_code.index(b"\nstudy = ") :]).body[0]
    assert isinstance(declared, ast.Assign)
    assert isinstance(declared.value, ast.Call)
    given = {keyword.arg: keyword.value for keyword in declared.value.keywords}
    return str(ast.literal_eval(given["title"]))
