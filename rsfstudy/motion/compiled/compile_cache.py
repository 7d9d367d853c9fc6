"""Compiles the motion of a combination of parts, once, and finds it again in a cache on disk.

The functions are those of plain Python, but for a few (`calls.REPLACEMENTS`). They are copied, each
function that they name or close over standing for its compiled copy, and compiled as one. What is
compiled lies in a folder of its own, named by a digest of all that decides it, which is written
aside, renamed when complete, and never changed. What lies there is run: where others could write to
it, nothing is read or kept.
"""

from __future__ import annotations

import contextlib
import dis
import functools
import hashlib
import logging
import os
import shutil
import stat
import sys
import tempfile
import time
import types
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

from rsfstudy.motion.compiled.array_operations import COMPILED_REPLACEMENT_BY_FUNCTION
from rsfstudy.motion.engines import compilation_log

_CACHE_ENTRY_FILE_NAME = "motion.py"
#: Modules that are as their version, or that of Python, says.
_MODULES_IDENTIFIED_BY_VERSION = {*sys.stdlib_module_names, "numpy", "numba"}
#: Quotients by the numbers of a scene may be products with reciprocals, found once a step; and
#: products and sums may be rounded together.
_COMPILER_OPTIONS: Mapping[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    "fastmath": {"arcp", "contract", "nsz"},
}
_CFUNC_SIGNATURE = numba.types.void(*[numba.types.CPointer(numba.types.float64)] * 4)
#: Changes where what is kept is laid out or named in another way.
_CACHE_FORMAT_VERSION = 4
#: Compiled functions whose addresses are in use.
_CFUNCS_KEPT_ALIVE: list[Any] = []
_logger = logging.getLogger(__name__)


def compile_cache_folder() -> Path:
    """Folder where compiled motions are kept: the one that the system has for such things."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "rsfstudy" / "compiled"


def compute_code_digest(signature: Any, *functions: Callable[..., Any]) -> str:
    """Digest of functions of a signature and of all that they reach, of the compiler, what it is
    allowed, and the processor.
    """
    content = _ContentDigest()
    content.add_value((signature, functions))
    processor = llvmlite.binding.get_host_cpu_name(), str(llvmlite.binding.get_host_cpu_features())
    content.add_value(
        (
            _CACHE_FORMAT_VERSION,
            numba.__version__,
            np.__version__,
            str(config.CPU_NAME),
            str(config.OPT),
        )
    )
    content.add_value(processor)
    content.add_value(
        [(name, sorted(x) if isinstance(x, set) else x) for name, x in _COMPILER_OPTIONS.items()]
    )
    return content.sha256_hash.hexdigest()[:32]


class _ContentDigest:
    """Digests whatever a compiler can make a constant of."""

    def __init__(self) -> None:
        self.sha256_hash = hashlib.sha256()
        self._function_numbers: dict[int, int] = {}

    def add_value(self, value: Any) -> None:
        """Add a value, and what it refers to."""
        if isinstance(value, types.FunctionType):
            known = id(value) in self._function_numbers
            number = self._function_numbers.setdefault(id(value), len(self._function_numbers))
            self._add_text(f"function {number}")
            if not known:
                self._add_code(value.__code__, value.__globals__)
                for cell in value.__closure__ or ():
                    self.add_value(_compiled_replacement_of(cell.cell_contents))
        elif isinstance(value, tuple | list | frozenset):
            parts = sorted(value, key=repr) if isinstance(value, frozenset) else value
            self._add_text(f"{len(value)} together")
            for part in parts:
                self.add_value(part)
        elif isinstance(value, np.ndarray):
            self._add_text(f"array {value.dtype} {value.shape}")
            self.sha256_hash.update(value.tobytes())
        elif isinstance(value, type):
            members = list(value) if issubclass(value, Enum) else getattr(value, "_fields", ())
            self._add_text(f"class {value.__qualname__} {members}")
        else:
            self._add_text(repr(value))

    def _add_code(self, code: types.CodeType, global_values: Mapping[str, Any]) -> None:
        self.sha256_hash.update(code.co_code)
        self.add_value(code.co_varnames)
        for constant in code.co_consts:
            if isinstance(constant, types.CodeType):
                self._add_code(constant, global_values)
            else:
                self.add_value(constant)
        for name in _global_names_read_by(code):
            self._add_text(name)
            value = _compiled_replacement_of(global_values.get(name))
            if not isinstance(value, types.ModuleType):
                self.add_value(value)
            elif value.__name__.partition(".")[0] not in _MODULES_IDENTIFIED_BY_VERSION:
                # a compiler takes what is read from a module for a constant
                self.add_value([getattr(value, read, None) for read in code.co_names])

    def _add_text(self, text: str) -> None:
        self.sha256_hash.update(text.encode() + b"\0")


def compile_function(function: Callable[..., Any], signature: Any) -> Any:
    """A compiled function."""

    def compile_for(entry: str) -> Any:
        copy = _copy_with_compiled_globals(function, entry)
        dispatcher = numba.njit(copy, **_COMPILER_OPTIONS)
        if entry:
            dispatcher._cache = _ContentKeyedCache(copy)
        dispatcher.compile(signature)
        return dispatcher

    return _load_or_compile(compute_code_digest(signature, function), compile_for)


def compile_cfunc_addresses(functions: Sequence[Callable[..., Any]]) -> tuple[int, ...]:
    """Addresses of compiled functions of pointers to numbers."""

    def compile_for(entry: str) -> list[Any]:
        return [
            _compile_cfunc(_copy_with_compiled_globals(function, entry), use_cache=bool(entry))
            for function in functions
        ]

    pointers = _load_or_compile(compute_code_digest(_CFUNC_SIGNATURE, *functions), compile_for)
    _CFUNCS_KEPT_ALIVE.append(pointers)
    return tuple(pointer.address for pointer in pointers)


class _ContentKeyedCache(FunctionCache):  # type: ignore[misc]
    """Numba's cache of a function that is named by its content: by what a closure holds Numba would
    find none again, because compiled functions are others in each process.
    """

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        return signature, codegen.magic_tuple()


def _compile_cfunc(function: Any, *, use_cache: bool) -> Any:
    """A compiled function of pointers to numbers, kept in the cache or not."""
    compiled = CFunc(
        function, normalize_signature(_CFUNC_SIGNATURE), locals={}, options=dict(_COMPILER_OPTIONS)
    )
    if use_cache:
        compiled._cache = _ContentKeyedCache(function)  # type: ignore[attr-defined]
    compiled.compile()
    return compiled


def _load_or_compile(entry_name: str, compile_at_path: Callable[[str], Any]) -> Any:
    """Compiled functions, from the folder of that name where it is there and whole."""
    folder = _cache_entry_folder(entry_name)
    if folder is not None:
        if folder.exists():
            with contextlib.suppress(Exception):  # whatever a cache can be damaged by
                return compile_at_path(str(folder / _CACHE_ENTRY_FILE_NAME))
        shutil.rmtree(folder, ignore_errors=True)
    began = time.perf_counter()
    with compilation_log.context_while_compiling():
        try:
            return (
                compile_at_path("")
                if folder is None
                else _compile_in_temporary_folder(folder, compile_at_path)
            )
        except OSError:  # nothing can be kept
            return compile_at_path("")
        finally:
            compilation_log.compiled_program_count += 1
            compilation_log.total_compilation_seconds += time.perf_counter() - began


def _cache_entry_folder(entry_name: str) -> Path | None:
    """The folder of that name; None where there is no cache, or not for this user alone."""
    try:
        cache = compile_cache_folder()
        cache.parent.parent.mkdir(parents=True, exist_ok=True)
        for folder in (cache.parent, cache):
            folder.mkdir(mode=0o700, exist_ok=True)
        for folder in (cache.parent, cache, cache / entry_name):
            if folder.exists() and not _is_private_folder(folder):
                _warn_folder_not_private(folder)
                return None
    except (OSError, RuntimeError):  # it cannot be made, or the user has no home
        return None
    return cache / entry_name


@functools.cache
def _warn_folder_not_private(folder: Path) -> None:
    _logger.warning(
        "%s: others own it or may write to it, and nothing compiled is kept there or taken from "
        "it. Remove it, or choose another place (XDG_CACHE_HOME).",
        folder,
    )


def _is_private_folder(folder: Path) -> bool:
    """True if nobody else owns a folder, or a link to it, or may write to it."""
    if not hasattr(os, "geteuid"):  # Windows: no owners, no modes
        return True
    found = folder.stat()
    owners = {found.st_uid, folder.lstat().st_uid}
    return owners == {os.geteuid()} and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _compile_in_temporary_folder(folder: Path, compile_at_path: Callable[[str], Any]) -> Any:
    """Compile in a folder of its own, which is then renamed."""
    aside = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
    try:
        entry = aside / _CACHE_ENTRY_FILE_NAME
        entry.write_text("# Stands for a function that rsfstudy has compiled.\n")
        os.utime(entry, (0, 0))  # Numba looks at its age
        ready = compile_at_path(str(entry))
        with contextlib.suppress(OSError):  # somebody else was faster
            os.rename(aside, folder)
        return ready
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _copy_with_compiled_globals(function: Any, entry_path: str = "") -> Any:
    """A copy of a function whose names stand for compiled functions, as if it stood in a file.

    Its own name tells its content: a linker takes functions of one name for one function, wherever
    they come from, and Numba numbers its names anew in each process.
    """
    named = {
        name: function.__globals__.get(name) for name in _global_names_read_by(function.__code__)
    }
    reached = {
        name: _jit_compile_callee(value) for name, value in named.items() if _is_function(value)
    }
    cells = tuple(
        types.CellType(_jit_compile_callee(value) if _is_function(value) else value)
        for value in (cell.cell_contents for cell in function.__closure__ or ())
    )
    code = function.__code__.replace(co_filename=entry_path) if entry_path else function.__code__
    copy = types.FunctionType(
        code, {**function.__globals__, **reached}, function.__name__, None, cells or None
    )
    content = _ContentDigest()
    content.add_value(function)
    copy.__qualname__ = f"{function.__name__}_{content.sha256_hash.hexdigest()[:32]}"
    return copy


@functools.cache
def _global_names_read_by(code: types.CodeType) -> tuple[str, ...]:
    """Names of the globals that a function reads, without those of attributes."""
    reads = (i.argval for i in dis.get_instructions(code) if i.opname == "LOAD_GLOBAL")
    return tuple(dict.fromkeys(reads))


def _is_function(value: Any) -> bool:
    return isinstance(value, types.FunctionType)


def _compiled_replacement_of(value: Any) -> Any:
    """Value that the compiler is given for one that a function names."""
    return COMPILED_REPLACEMENT_BY_FUNCTION.get(value, value) if _is_function(value) else value


def _jit_compile_callee(function: Any) -> Any:
    """A compiled function that only others call; those of several equations share it."""
    return _jit_compile_callee_cached(_compiled_replacement_of(function))


@functools.cache
def _jit_compile_callee_cached(function: Any) -> Any:
    inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(_copy_with_compiled_globals(function), **_COMPILER_OPTIONS, **inner)
