"""Tests of the public names of packages: exports, imports and cycles."""

import ast
import importlib
import subprocess
import sys
import tomllib
import warnings
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import rsfstudy
from rsfstudy._former_modules import REPLACEMENT_MODULES_BY_FORMER_MODULE

ROOT = Path(rsfstudy.__file__).parent
#: Packages that only export names of other packages.
FACADES = {"measures", "parts", "reductions"}


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts).removesuffix(".__init__")


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}
PACKAGES = sorted(path.parent.name for path in ROOT.glob("*/__init__.py"))


def package_of(module: str) -> str:
    """Return the top-level package of a module.

    The result is an empty string for modules of ``rsfstudy`` itself.
    """
    first = module.removeprefix("rsfstudy").lstrip(".").partition(".")[0]
    return first if first in PACKAGES else ""


def imported_names(path: Path) -> Iterator[tuple[str, str]]:
    """Yield module and name of each ``from rsfstudy... import name``.

    Imports in functions and in ``TYPE_CHECKING`` blocks are included.
    """
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: relative import"
            if node.module and node.module.partition(".")[0] == "rsfstudy":
                yield from ((node.module, alias.name) for alias in node.names)


def exported_names(package: str) -> list[str]:
    return list(getattr(importlib.import_module(f"rsfstudy.{package}"), "__all__", ()))


def test_a_wheel_contains_every_package():
    declared = tomllib.loads((ROOT.parent / "pyproject.toml").read_text())
    folders = {module_name(path) for path in ROOT.rglob("__init__.py")}
    assert {*declared["tool"]["setuptools"]["packages"]} == folders | {"rsfstudy.named_studies"}


def test_imports_of_other_packages_use_their_surfaces():
    surfaces = {package: set(exported_names(package)) for package in PACKAGES}
    for module, path in MODULES.items():
        for source, name in imported_names(path):
            target = package_of(f"{source}.{name}" if f"{source}.{name}" in MODULES else source)
            if not target or target == package_of(module) or package_of(module) in ("", *FACADES):
                continue
            if source == "rsfstudy" and name in FACADES:
                continue
            from_surface = source == f"rsfstudy.{target}" and name in surfaces[target]
            assert from_surface, f"{module}: from {source} import {name}"


def test_modules_never_import_in_a_cycle():
    """There are no import cycles.

    Imports for type annotations and imports by name are included.
    """
    imports: dict[str, set[str]] = {}
    for module, path in MODULES.items():
        full = {(source, f"{source}.{name}") for source, name in imported_names(path)}
        found = {both[1] if both[1] in MODULES else both[0] for both in full}
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.Call) and "import_module" in ast.unparse(node.func):
                found |= {n.value for n in node.args if isinstance(n, ast.Constant)}
        imports[module] = found & MODULES.keys() - {module}
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(f"import one another: {error.args[1]}")


@pytest.mark.parametrize("package", PACKAGES)
def test_a_surface_exports_what_it_lists(package):
    module = importlib.import_module(f"rsfstudy.{package}")
    names = exported_names(package)
    assert len(set(names)) == len(names)
    for name in names:
        assert f"rsfstudy.{package}.{name}" not in MODULES, f"{name} is also a module"
        assert getattr(module, name) is not None
    assert set(names) <= set(dir(module))
    with pytest.raises(AttributeError, match="no attribute 'missing'"):
        module.missing  # noqa: B018


@pytest.mark.parametrize("package", PACKAGES)
def test_a_surface_says_what_the_package_never_does(package):
    text = importlib.import_module(f"rsfstudy.{package}").__doc__ or ""
    assert len(text.split("\n")[0]) <= 79
    assert "never" in text.split() or "only exports" in " ".join(text.split())


def test_surfaces_load_no_module():
    """Importing all packages loads neither NumPy nor other large libraries."""
    source = (
        f"import importlib, sys\nfor name in {[p for p in PACKAGES if p != 'api']}:\n"
        "    importlib.import_module(f'rsfstudy.{name}')\n"
        "print(*{'numpy', 'scipy', 'xarray', 'matplotlib', 'dask', 'click'} & set(sys.modules))"
    )
    ran = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == ""


@pytest.mark.parametrize(
    "name", [n for n, (present, _) in REPLACEMENT_MODULES_BY_FORMER_MODULE.items() if present]
)
def test_former_modules_stay_importable(name):
    present, public = REPLACEMENT_MODULES_BY_FORMER_MODULE[name]
    new = importlib.import_module(f"rsfstudy.{present}")
    sys.modules.pop(f"rsfstudy.{name}", None)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        old = importlib.import_module(f"rsfstudy.{name}")
    texts = [str(w.message) for w in caught if w.category is DeprecationWarning]
    assert [f"Import from rsfstudy.{public}." in text for text in texts] == [True] * bool(public)
    for shared in (n for n in vars(new) if not n.startswith("_")):
        assert getattr(old, shared) is getattr(new, shared)
    with pytest.raises(ImportError):
        importlib.import_module(f"rsfstudy.{name}.missing")
