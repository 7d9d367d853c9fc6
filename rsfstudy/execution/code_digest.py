"""Digests of source code and of user-defined classes.

``digest_sources`` computes the digest of the physics code from the source files.
``digest_user_classes`` computes the digest of user-defined measures, parts and steppers from the
objects in memory, because their files may have changed since the import. Measures in the modules of
named studies are treated like user-defined measures, because the other code of these modules does
not affect the results (see ``digest_physics_and_measures``).

All digests are computed from compiled code, so that comments, docstrings and line numbers do not
affect a digest. The digest of a user-defined class includes every object whose name a function of
the class uses. Any change of a function, a constant or a helper therefore changes the digest. The
same code has the same digest in a study file, a script, a notebook and a worker. Modules that are
imported inside functions are not included. The code of Python, of installed packages and of
rsfstudy is not included, because these packages have version numbers.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import inspect
import io
import pickle
import site
import sys
import sysconfig
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from pathlib import Path
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from rsfstudy.study import STUDIES_PACKAGE as STUDIES

_PACKAGE_NAME = Path(__file__).parent.parent.name
_INSTALLATION_DIRECTORIES = tuple(
    Path(path).resolve()
    for path in {
        *(sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")),
        *site.getsitepackages(),
        site.getusersitepackages(),
    }
)
_TYPES_DIGESTED_BY_REPR = (int, float, complex, str, bytes, bool, type(None), type(Ellipsis))
#: Functions by type of object. Each function returns the contents of a container or the function
#: inside a wrapper.
_GETTERS_OF_CONTAINER_PARTS: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
    (property, lambda value: (value.fget, value.fset)),
    (functools.cached_property, lambda value: value.func),
    (functools.partial, lambda value: (value.func, value.args, value.keywords)),
    (classmethod | staticmethod, lambda value: value.__wrapped__),
    (Mapping, lambda value: tuple(value.items())),
    (list, tuple),
)


def digest_sources(sources_by_file_name: Mapping[str, bytes]) -> str:
    """Compute the digest of the code in source files.

    Parameters
    ----------
    sources_by_file_name : mapping of str to bytes
        Contents of the files by name.

    Returns
    -------
    str
        Digest of 16 hexadecimal digits.
    """
    # Compiling takes a third of the time of ast.parse, and optimize=2 removes docstrings.
    compiled = (
        compile(text, name, "exec", optimize=2) for name, text in sources_by_file_name.items()
    )
    return _hash_texts(_DigestTextCollector().collect_texts((*sources_by_file_name, *compiled), ()))


def digest_physics_and_measures(physics_digest: str, measure_classes: Iterable[type]) -> str:
    """Compute the digest of the physics code and of measures in named studies.

    Parameters
    ----------
    physics_digest : str
        Digest of the physics code.
    measure_classes : iterable of type
        Classes of the measure.

    Returns
    -------
    str
        Digest of 16 hexadecimal digits. If no class is defined in the module of a named study, the
        function returns ``physics_digest``.
    """
    theirs = tuple(measure for measure in measure_classes if _is_study_module(measure.__module__))
    return (
        _hash_texts((physics_digest, *_DigestTextCollector().collect_texts(theirs, ())))
        if theirs
        else physics_digest
    )


def digest_user_classes(*classes_or_data: object) -> str:
    """Compute the digest of user-defined classes and of the code they use.

    Parameters
    ----------
    *classes_or_data : object
        Classes, and data such as protocols. Classes of rsfstudy and of installed packages are
        ignored.

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
    return _hash_texts(_DigestTextCollector().collect_texts(own, ())) if own else "none"


def _hash_texts(texts: Iterable[str]) -> str:
    """Compute the first 16 digits of the SHA-256 digest of strings."""
    sha256 = hashlib.sha256()
    for part in texts:
        sha256.update(part.encode(errors="surrogatepass") + b"\0")
    return sha256.hexdigest()[:16]


class _DigestTextCollector:
    """Collector of the strings from which the digest of code is computed.

    Each object is visited only once.
    """

    def __init__(self) -> None:
        self._visited: dict[Hashable, Any] = {}

    def collect_texts(self, value: Any, used_names: Iterable[str]) -> Iterator[str]:
        """Yield the strings that represent a value in the digest.

        The argument ``used_names`` contains the names that the surrounding code uses.
        """
        if isinstance(value, _TYPES_DIGESTED_BY_REPR):
            yield repr(value)
        elif isinstance(value, ModuleType):
            yield from self._iterate_texts_of_module(value, used_names)
        elif isinstance(value, CodeType):
            yield from self._iterate_texts_of_code_object(value)
        elif isinstance(value, tuple):  # Equal tuples may or may not be the same object.
            for part in value:
                yield from self.collect_texts(part, used_names)
        elif id(value) not in self._visited:
            self._visited[id(value)] = value
            yield from self._iterate_texts_of_unvisited_object(value, used_names)

    def _iterate_texts_of_unvisited_object(
        self, value: Any, used_names: Iterable[str]
    ) -> Iterator[str]:
        if isinstance(value, FunctionType):
            yield from self._iterate_texts_of_function(value)
        elif isinstance(value, type):
            yield from self._iterate_texts_of_class(value)
        elif isinstance(value, set | frozenset):
            yield from sorted(map(repr, value))
        elif type(value) is np.ndarray and value.dtype.kind != "O":
            yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
        elif kept := next(
            (parts for kind, parts in _GETTERS_OF_CONTAINER_PARTS if isinstance(value, kind)), None
        ):
            yield from self.collect_texts(kept(value), used_names)
        elif hasattr(value, "__wrapped__"):  # The value is a cached function.
            yield from self.collect_texts(value.__wrapped__, used_names)
        else:
            yield from self._iterate_texts_of_class(type(value))
            yield from self._iterate_texts_of_instance_state(value, used_names)

    def _iterate_texts_of_module(
        self, module: ModuleType, used_names: Iterable[str]
    ) -> Iterator[str]:
        """Yield the strings that represent the used members of a module."""
        if not _are_only_used_members_digested(module.__name__):
            yield module.__name__
            return
        asked = (id(module), *used_names)
        if asked not in self._visited:
            self._visited[asked] = module
            used = [name for name in used_names if name in vars(module)]
            yield from self.collect_texts(tuple(vars(module)[name] for name in used), used_names)

    def _iterate_texts_of_function(self, function: FunctionType) -> Iterator[str]:
        yield function.__qualname__
        if not _are_only_used_members_digested(function.__module__):
            return
        yield from self._iterate_texts_of_code_object(function.__code__)
        cells = [cell.cell_contents for cell in function.__closure__ or () if cell != CellType()]
        names = tuple(_names_used_by_code(function.__code__))
        yield from self.collect_texts(
            (function.__defaults__, function.__kwdefaults__, *cells), names
        )
        for name in names:
            if name in function.__globals__:
                yield name
                yield from self.collect_texts(function.__globals__[name], names)

    def _iterate_texts_of_code_object(self, code: CodeType) -> Iterator[str]:
        yield from (code.co_name, code.co_code.hex(), *code.co_names, *code.co_varnames)
        yield from self.collect_texts(code.co_consts[_has_docstring_slot(code) :], ())

    def _iterate_texts_of_class(self, digested_class: type) -> Iterator[str]:
        yield digested_class.__qualname__
        if not _are_only_used_members_digested(digested_class.__module__):
            return
        yield from self.collect_texts(digested_class.__bases__, ())
        for name, value in sorted(vars(digested_class).items()):
            if not _is_generated_class_member(name, value):
                yield name
                yield from self.collect_texts(value, ())

    def _iterate_texts_of_instance_state(
        self, value: Any, used_names: Iterable[str]
    ) -> Iterator[str]:
        if _are_only_used_members_digested(type(value).__module__):
            yield from self.collect_texts(_state_without_caches(value), used_names)
            return
        content = io.BytesIO()
        try:
            _PicklerWithoutCachedProperties(content, protocol=4).dump(value)
        except Exception:  # Objects such as locks and files do not affect the results.
            yield type(value).__qualname__
        else:
            yield content.getvalue().hex()


class _PicklerWithoutCachedProperties(pickle.Pickler):
    """Pickler that omits the cached properties of all objects.

    The cached properties do not affect the results, and may be present in one process but not in
    another.
    """

    def reducer_override(self, value: Any) -> Any:
        """Pickle a copy of the object without its cached properties."""
        state = _state_without_caches(value)
        if isinstance(value, type) or len(state) == len(getattr(value, "__dict__", ())):
            return NotImplemented
        bare = copy.copy(value)
        vars(bare).clear()
        vars(bare).update(state)
        return bare.__reduce_ex__(4)


def _state_without_caches(value: Any) -> dict[str, Any]:
    """Return the attributes of an object without its cached properties."""
    return {
        name: part
        for name, part in getattr(value, "__dict__", {}).items()
        if not any(
            isinstance(vars(kind).get(name), functools.cached_property)
            for kind in type(value).__mro__
        )
    }


def _has_docstring_slot(code: CodeType) -> bool:
    """Return True if the first constant of a code object can be a docstring."""
    if sys.version_info >= (3, 13):
        return bool(code.co_flags & inspect.CO_HAS_DOCSTRING)
    return bool(code.co_flags & inspect.CO_NEWLOCALS) and not code.co_name.startswith("<")


def _is_generated_class_member(member_name: str, value: Any) -> bool:
    """Return True for members that Python, dataclasses or msgspec generate.

    Generated members do not affect the results.
    """
    if member_name == "_abc_impl" or member_name.startswith("__annot"):
        return True
    made = getattr(getattr(value, "__code__", None), "co_qualname", "").startswith("__create_fn__")
    return made or (member_name.startswith("__") and not callable(value))


def _names_used_by_code(code: CodeType) -> Iterator[str]:
    """Yield the names that a function and its nested functions use."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names_used_by_code(constant)


def _are_only_used_members_digested(module_name: str | None) -> bool:
    """Return True if only the used members of a module are digested."""
    return _is_study_module(module_name) or _is_user_module(module_name)


def _is_study_module(module_name: str | None) -> bool:
    """Return True if a module belongs to the named studies."""
    return (module_name or "").startswith(f"{STUDIES}.")


def _is_user_module(module_name: str | None) -> bool:
    """Return True if a module is user-defined.

    Modules of Python, of installed packages and of rsfstudy are not user-defined.
    """
    top = (module_name or "").partition(".")[0]
    if not top or top == _PACKAGE_NAME or (top in sys.stdlib_module_names and top != "__main__"):
        return False
    return not _is_installed_file(getattr(sys.modules.get(top), "__file__", None))


@functools.cache
def _is_installed_file(file_path: str | None) -> bool:
    """Return True if a file belongs to Python or to an installed package."""
    return file_path is not None and any(
        Path(file_path).resolve().is_relative_to(p) for p in _INSTALLATION_DIRECTORIES
    )
