"""Functions and classes that compute a digest of Python objects and the code that they use.

A digest identifies functions, classes and data by their content. The digest of a function is
computed from its compiled code, so comments, docstrings and line numbers do not affect the digest.
The digest of a function also includes every object that the function refers to by name. The digest
of a function is the same whether the function is defined in a study file, a script, a notebook or a
worker process. The digest does not include modules that a function imports inside its body.
"""

from __future__ import annotations

import copy
import dis
import functools
import hashlib
import inspect
import io
import pickle
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from types import CellType, CodeType, FunctionType, ModuleType
from typing import Any, Self

import numpy as np

_TYPES_DIGESTED_BY_REPR = (int, float, complex, str, bytes, bool, type(None), type(Ellipsis))
_OPCODES_READING_GLOBALS = ("LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS")
#: Types of objects, each with a function. The function returns the contents of a container, or the
#: function inside a wrapper.
_CONTENTS_GETTERS_BY_TYPE: tuple[tuple[Any, Callable[[Any], Any]], ...] = (
    (property, lambda value: (value.fget, value.fset)),
    (functools.cached_property, lambda value: value.func),
    (functools.partial, lambda value: (value.func, value.args, value.keywords)),
    (classmethod | staticmethod, lambda value: value.__wrapped__),
    (Mapping, lambda value: tuple(value.items())),
    (list, tuple),
)


class ObjectDigest:
    """SHA-256 digest that covers Python objects and the code that the objects use.

    Parameters
    ----------
    reads_module : callable
        Function that takes the name of a module and returns True if the digest includes the code of
        this module. Classes and functions of any other module are identified by their names only.
    replace : callable, optional
        Function that takes the value of a global name or of a closure variable and returns a
        replacement. The digest includes the replacement instead of the value.
    """

    def __init__(
        self,
        reads_module: Callable[[str | None], bool],
        replace: Callable[[Any], Any] = lambda value: value,
    ) -> None:
        self._reads_module, self._replace = reads_module, replace
        self._sha256 = hashlib.sha256()
        # The dictionary keeps the visited objects alive, so that no other object has the same id.
        self._visited: dict[Hashable, tuple[int, Any]] = {}

    def hexdigest(self, length: int = 16) -> str:
        """Return the first hexadecimal digits of the digest.

        Parameters
        ----------
        length : int, default: 16
            Number of hexadecimal digits.

        Returns
        -------
        str
            Digest.
        """
        return self._sha256.hexdigest()[:length]

    def add_object(self, value: Any, used_names: Iterable[str] = ()) -> Self:
        """Update the digest with an object and all objects that this object uses.

        Parameters
        ----------
        value : object
            Object to add.
        used_names : iterable of str, optional
            Names that the code containing ``value`` uses. If ``value`` is a module, only the
            members with these names are added.

        Returns
        -------
        ObjectDigest
            The same ``ObjectDigest``, so that calls can be chained.
        """
        if isinstance(value, _TYPES_DIGESTED_BY_REPR):
            self._add_texts(repr(value))
        elif isinstance(value, ModuleType):
            self._add_module(value, used_names)
        elif isinstance(value, CodeType):
            self._add_code(value)
        elif isinstance(value, tuple):  # Equal tuples may or may not be the same object.
            self._add_texts(f"{len(value)} together")
            for part in value:
                self.add_object(part, used_names)
        elif self._register_if_first_visit(id(value), value):
            self._add_unvisited_object(value, used_names)
        return self

    def _add_texts(self, *texts: str) -> None:
        for text in texts:
            self._sha256.update(text.encode(errors="surrogatepass") + b"\0")

    def _register_if_first_visit(self, key: Hashable, value: Any) -> bool:
        """Return True for a new object. If the object is known, add its number to the digest."""
        if key in self._visited:
            self._add_texts(f"object {self._visited[key][0]}")
            return False
        self._visited[key] = len(self._visited), value
        return True

    def _add_unvisited_object(self, value: Any, used_names: Iterable[str]) -> None:
        if isinstance(value, FunctionType):
            self._add_function(value)
        elif isinstance(value, type):
            self._add_class(value)
        elif isinstance(value, set | frozenset):
            self._add_texts(*sorted(map(repr, value)))
        elif type(value) is np.ndarray and value.dtype.kind != "O":
            self._add_texts(f"{value.dtype} {value.shape} {value.tobytes().hex()}")
        elif getter := next(
            (get for kind, get in _CONTENTS_GETTERS_BY_TYPE if isinstance(value, kind)), None
        ):
            self.add_object(getter(value), used_names)
        elif hasattr(value, "__wrapped__"):  # The value is a cached function.
            self.add_object(value.__wrapped__, used_names)
        else:
            self._add_class(type(value))
            self._add_state_of_instance(value, used_names)

    def _add_module(self, module: ModuleType, used_names: Iterable[str]) -> None:
        """Add to the digest all module members that the code uses."""
        if not self._reads_module(module.__name__):
            self._add_texts(module.__name__)
        elif self._register_if_first_visit((id(module), *used_names), module):
            used = [name for name in used_names if name in vars(module)]
            self.add_object(tuple(self._replace(vars(module)[name]) for name in used), used_names)

    def _add_function(self, function: FunctionType) -> None:
        self._add_texts(function.__qualname__)
        if not self._reads_module(function.__module__):
            return
        self._add_code(function.__code__)
        cells = [
            self._replace(cell.cell_contents)
            for cell in function.__closure__ or ()
            if cell != CellType()
        ]
        names = tuple(_iterate_names_used_by_code(function.__code__))
        self.add_object((function.__defaults__, function.__kwdefaults__, *cells), names)
        for name in list_global_names_read_by_code(function.__code__):
            if name in function.__globals__:
                self._add_texts(name)
                self.add_object(self._replace(function.__globals__[name]), names)

    def _add_code(self, code: CodeType) -> None:
        self._add_texts(code.co_name, code.co_code.hex(), *code.co_names, *code.co_varnames)
        self.add_object(code.co_consts[_has_docstring_slot(code) :])

    def _add_class(self, added_class: type) -> None:
        self._add_texts(added_class.__qualname__)
        if not self._reads_module(added_class.__module__):
            return
        self.add_object(added_class.__bases__)
        for name, value in sorted(vars(added_class).items()):
            if not _is_generated_class_member(name, value):
                self._add_texts(name)
                self.add_object(value)

    def _add_state_of_instance(self, value: Any, used_names: Iterable[str]) -> None:
        if self._reads_module(type(value).__module__):
            self.add_object(_collect_uncached_attributes(value), used_names)
            return
        content = io.BytesIO()
        try:
            _PicklerWithoutCachedProperties(content, protocol=4).dump(value)
        except Exception:  # Objects such as locks and files do not affect the results.
            self._add_texts(type(value).__qualname__)
        else:
            self._add_texts(content.getvalue().hex())


class _PicklerWithoutCachedProperties(pickle.Pickler):
    """Pickler that omits the cached properties of all objects.

    Cached properties do not affect the results. Cached properties may be present in one process and
    absent in another.
    """

    def reducer_override(self, value: Any) -> Any:
        """Pickle a copy of the object without its cached properties."""
        state = _collect_uncached_attributes(value)
        if isinstance(value, type) or len(state) == len(getattr(value, "__dict__", ())):
            return NotImplemented
        bare = copy.copy(value)
        vars(bare).clear()
        vars(bare).update(state)
        return bare.__reduce_ex__(4)


def _collect_uncached_attributes(value: Any) -> dict[str, Any]:
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
    """Return True if Python, dataclasses or msgspec generated a class member.

    The digest omits generated members, because they do not affect the results.
    """
    if member_name == "_abc_impl" or member_name.startswith("__annot"):
        return True
    made = getattr(getattr(value, "__code__", None), "co_qualname", "").startswith("__create_fn__")
    return made or (member_name.startswith("__") and not callable(value))


def _iterate_names_used_by_code(code: CodeType) -> Iterator[str]:
    """Yield the global names and attribute names that a function uses.

    The names include the names that nested functions use.
    """
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _iterate_names_used_by_code(constant)


@functools.cache
def list_global_names_read_by_code(code: CodeType) -> tuple[str, ...]:
    """Return the names of the globals that a function and its nested functions read.

    Parameters
    ----------
    code : code
        Code of the function.

    Returns
    -------
    tuple of str
        Names of the globals without duplicates. Names of attributes are not included.
    """
    reads = [i.argval for i in dis.get_instructions(code) if i.opname in _OPCODES_READING_GLOBALS]
    nested = (list_global_names_read_by_code(c) for c in code.co_consts if isinstance(c, CodeType))
    return tuple(dict.fromkeys((*reads, *(name for names in nested for name in names))))
