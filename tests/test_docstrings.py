"""Docstrings: the examples run, and numpydoc accepts those of the public namespaces."""

import doctest
import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path

import pytest
from numpydoc.validate import validate

import rsfstudy

ROOT = Path(rsfstudy.__file__).parent
NAMESPACES = ("", ".fitting", ".measures", ".parts", ".plots", ".reductions")
MODULES_WITH_EXAMPLES = [
    ".".join(("rsfstudy", *path.relative_to(ROOT).with_suffix("").parts))
    for path in sorted(ROOT.rglob("*.py"))
    if ">>> " in path.read_text()
]
#: Checks for sections that short docstrings do not need: See Also and the extended summary.
OPTIONAL_SECTIONS = {"SA01", "ES01"}


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
                for member, value in vars(exported).items():
                    is_method = inspect.isroutine(inspect.unwrap(getattr(value, "__func__", value)))
                    if is_method and not member.startswith("_"):
                        yield f"{module.__name__}.{name}.{member}"


@pytest.mark.parametrize("module", MODULES_WITH_EXAMPLES)
def test_examples_run(module):
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    result = doctest.testmod(importlib.import_module(module), optionflags=options)
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.parametrize("path", sorted(set(public_objects())))
def test_numpydoc_accepts_the_docstring(path):
    found = validate(path)
    optional = OPTIONAL_SECTIONS | ({"EX01"} if found["type"] != "function" else set())
    if path.count(".") > 1 and found["type"] == "function" and inspect.isclass(_parent(path)):
        optional.add("EX01")
    assert [error for error in found["errors"] if error[0] not in optional] == []


def _parent(path: str) -> object:
    module, name = path.rsplit(".", 1)
    try:
        return importlib.import_module(module)
    except ImportError:
        return getattr(importlib.import_module(module.rsplit(".", 1)[0]), module.rsplit(".", 1)[1])
