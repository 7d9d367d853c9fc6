"""Docstrings: the examples run, and numpydoc accepts those of the public namespaces."""

import doctest
import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from numpydoc.validate import validate

import rsfstudy
from rsfstudy._deprecation import NEW_NAME_BY_OWNER_AND_FORMER_NAME

ROOT = Path(rsfstudy.__file__).parent
NAMESPACES = ("", ".fitting", ".measures", ".parts", ".plots", ".reductions")
MODULES_WITH_EXAMPLES = [
    ".".join(("rsfstudy", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")
    for path in sorted(ROOT.rglob("*.py"))
    if ">>> " in path.read_text()
]
#: Checks for sections that short docstrings do not need: See Also and the extended summary.
OPTIONAL_SECTIONS = {"SA01", "ES01"}
#: Functions whose signature lists all fields of a scene as keywords. Their docstrings document
#: ``**changes`` or ``**values``.
WITH_FIELD_SIGNATURE = {"rsfstudy.Rig.scene", "rsfstudy.Scene.with_", "rsfstudy.run"}
#: Classes whose constructor is inherited from the standard library.
WITH_INHERITED_CONSTRUCTOR = {"rsfstudy.measures.Status"}


def public_objects() -> Iterator[str]:
    """Yield the import paths of the exported functions and classes, and of the public methods."""
    for namespace in NAMESPACES:
        module = importlib.import_module(f"rsfstudy{namespace}")
        for name in module.__all__:
            exported = getattr(module, name)
            if not getattr(exported, "__module__", "").startswith("rsfstudy."):
                continue  # a constant, or the Figure class of matplotlib
            if inspect.isfunction(exported):
                yield f"{module.__name__}.{name}"
            elif inspect.isclass(exported):
                yield f"{module.__name__}.{name}"
                former = NEW_NAME_BY_OWNER_AND_FORMER_NAME.get(
                    f"{exported.__module__}:{exported.__qualname__}", {}
                )
                for member, value in vars(exported).items():
                    if member in former:
                        continue
                    is_method = inspect.isroutine(inspect.unwrap(getattr(value, "__func__", value)))
                    # matplotlib generates ``NotebookFigure.set``
                    is_ours = getattr(value, "__module__", "rsfstudy").startswith("rsfstudy")
                    if is_method and is_ours and not member.startswith("_"):
                        yield f"{module.__name__}.{name}.{member}"


@pytest.mark.parametrize("module", MODULES_WITH_EXAMPLES)
def test_examples_run(module):
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    result = doctest.testmod(importlib.import_module(module), optionflags=options)
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # numpydoc reads former members, too
@pytest.mark.parametrize("path", sorted(set(public_objects())))
def test_numpydoc_accepts_the_docstring(path):
    found = validate(path)
    optional = set(OPTIONAL_SECTIONS)
    if found["type"] != "function" or _is_method(path):
        optional.add("EX01")
    if path in WITH_FIELD_SIGNATURE | WITH_INHERITED_CONSTRUCTOR or _is_protocol(path):
        optional.add("PR01")
    assert [error for error in found["errors"] if error[0] not in optional] == []


def _find(path: str) -> Any:
    """Return the object at an import path."""
    module, *names = path.split(".")
    found: Any = importlib.import_module(module)
    for name in names:
        found = getattr(found, name)
    return found


def _is_method(path: str) -> bool:
    """Return True if an import path names a member of a class."""
    return inspect.isclass(_find(path.rpartition(".")[0]))


def _is_protocol(path: str) -> bool:
    """Return True if an import path names a protocol."""
    return getattr(_find(path), "_is_protocol", False)
