"""Import graph and code digests of the rsfstudy modules.

The results of a cell depend on the modules that the measure and the parts of the scene import,
directly or indirectly. ``ModuleImportGraph`` finds these modules by reading the source files and
computes one digest per module. The modules are not imported. Docstrings, comments and imports for
type annotations do not affect the digests. If a package exports its names lazily, an import from
the package is treated as an import from the modules that define the imported names.
"""

from __future__ import annotations

import ast
import dis
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from types import CodeType

from rsfstudy.object_digest import ObjectDigest

_PACKAGE_NAME = __name__.partition(".")[0]
_LAZY_EXPORT_FUNCTION_NAME = "build_lazy_export_functions"
_TYPE_CHECKING_BRANCH_PATTERN = re.compile(rb"^(\s*if )TYPE_CHECKING:", re.MULTILINE)
_DIGEST_DIGITS_PER_MODULE = 12


class ModuleImportGraph:
    """Import graph of source files.

    Parameters
    ----------
    sources_by_path : mapping of str to bytes
        Contents of the source files, by path relative to the package, such as
        ``"slider/friction.py"``.
    """

    def __init__(self, sources_by_path: Mapping[str, bytes]) -> None:
        self._modules = {
            path.removesuffix(".py").removesuffix("/__init__").replace("/", "."): _ModuleSource(
                text
            )
            for path, text in sources_by_path.items()
        }

    @property
    def module_names(self) -> Iterable[str]:
        """Names of the modules, relative to the package."""
        return self._modules

    @cached_property
    def combined_digest(self) -> str:
        """Single digest of all modules."""
        return ObjectDigest(lambda _name: False).add_object(self.compute_digests()).hexdigest()

    def compute_digests(self, root_modules: Iterable[str] | None = None) -> dict[str, str]:
        """Compute the digests of the given modules and of all modules that they import.

        Parameters
        ----------
        root_modules : iterable of str, optional
            Full names of modules. The function computes the digests of these modules and of all
            modules that they import directly or indirectly. Modules without source files are
            ignored. By default, the function computes the digests of all modules.

        Returns
        -------
        dict of str to str
            Digest of each module, by name relative to the package, such as ``"slider.friction"``.
        """
        reached = (
            self._modules if root_modules is None else self._find_reachable_modules(root_modules)
        )
        return {module: self._modules[module].code_digest for module in sorted(reached)}

    def _find_reachable_modules(self, root_modules: Iterable[str]) -> set[str]:
        reached: set[str] = set()
        found = {
            module
            for root in root_modules
            for module in self._iterate_modules_loaded_by_import(root, ())
        }
        while found:
            reached |= found
            imports = [
                statement
                for module in found
                for statement in self._modules[module].imported_modules_and_names
            ]
            found = {
                m
                for statement in imports
                for m in self._iterate_modules_loaded_by_import(*statement)
            }
            found -= reached
        return reached

    def _iterate_modules_loaded_by_import(
        self, source_module: str, imported_names: Iterable[str]
    ) -> Iterator[str]:
        """Yield the modules that an import statement loads."""
        path = source_module.removeprefix(_PACKAGE_NAME).removeprefix(".")
        parts = path.split(".")
        for package in (".".join(parts[:length]) for length in range(1, len(parts) + 1)):
            if (
                package in self._modules
                and self._modules[package].module_by_lazily_exported_name is None
            ):
                yield package
        modules = [f"{path}.{name}".removeprefix(".") for name in imported_names]
        exports = (
            self._modules[path].module_by_lazily_exported_name if path in self._modules else None
        )
        if exports is not None:
            exported = {f"{path}.{name}": module for name, module in exports.items()}
            modules = [exported.get(module, module) for module in modules]
            # If a name is unknown, the import may refer to any name, so all exports of the package
            # are included.
            if not modules or not all(module in self._modules for module in modules):
                modules = [*exports.values()]
        for module in modules:
            if module in self._modules:
                yield from self._iterate_modules_loaded_by_import(f"{_PACKAGE_NAME}.{module}", ())


class _ModuleSource:
    """Source file of a module."""

    def __init__(self, source: bytes) -> None:
        self._source = _TYPE_CHECKING_BRANCH_PATTERN.sub(rb"\1False:", source)

    @cached_property
    def _code_without_docstrings(self) -> CodeType:
        """Code of the module without docstrings and without imports for type annotations."""
        return compile(self._source, "module", "exec", optimize=2, dont_inherit=True)

    @cached_property
    def code_digest(self) -> str:
        """Digest of the code."""
        return (
            ObjectDigest(lambda _name: True)
            .add_object(self._code_without_docstrings)
            .hexdigest(_DIGEST_DIGITS_PER_MODULE)
        )

    @cached_property
    def imported_modules_and_names(self) -> list[tuple[str, list[str]]]:
        """Package modules that this module imports, each with the imported names."""
        return _find_imports_from_package(self._code_without_docstrings)

    @cached_property
    def module_by_lazily_exported_name(self) -> Mapping[str, str] | None:
        """Mapping from lazily exported names to the names of the modules that define them.

        If the module does not export names lazily, the property is None.
        """
        if _LAZY_EXPORT_FUNCTION_NAME.encode() not in self._source:
            return None
        tables = (
            ast.literal_eval(node.args[1])
            for node in ast.walk(ast.parse(self._source))
            if isinstance(node, ast.Call) and ast.unparse(node.func) == _LAZY_EXPORT_FUNCTION_NAME
        )
        return {
            entry.split(" as ")[-1]: module
            for table in tables
            for module, names in table.items()
            for entry in names
        }


def _find_imports_from_package(code: CodeType) -> list[tuple[str, list[str]]]:
    """Find the package modules that the code imports, with the imported names.

    A string that is the name of a module is treated as an import, because the code may pass the
    string to ``importlib.import_module``.
    """
    prefix = f"{_PACKAGE_NAME}."
    found: list[tuple[str, list[str]]] = []
    if any(f"{name}.".startswith(prefix) for name in code.co_names):
        for instruction in dis.get_instructions(code):
            if instruction.opname == "IMPORT_NAME":
                found.append((instruction.argval, []))
            elif instruction.opname == "IMPORT_FROM":
                found[-1][1].append(instruction.argval)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            found += _find_imports_from_package(constant)
        elif isinstance(constant, str):
            found.append((constant, []))
    return [(source, names) for source, names in found if f"{source}.".startswith(prefix)]
