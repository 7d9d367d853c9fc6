"""Functions that compile Python functions with Numba and cache the compiled code on disk.

``compile_or_load_function`` and ``compile_cfuncs_and_get_addresses`` are the main functions. These
two functions copy a Python function together with all functions that it calls, replace the
functions listed in ``COMPILED_REPLACEMENT_BY_PYTHON_FUNCTION``, and compile the copy.

Each compiled function is stored in a folder whose name contains a digest of the source functions,
the compiler and the processor. The folder is first written under a temporary name and is renamed
when it is complete. The folder is never modified after it has been renamed. The cache contains
machine code that this process executes. Folders that other users can write to are therefore neither
read nor written.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import shutil
import stat
import sys
import tempfile
import time
import types
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numpy as np
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature

from rsfstudy.motion.compiled.array_operations import COMPILED_REPLACEMENT_BY_PYTHON_FUNCTION
from rsfstudy.motion.engines import compilation_log
from rsfstudy.object_digest import ObjectDigest, list_global_names_read_by_code

_PLACEHOLDER_SOURCE_FILE_NAME = "motion.py"
#: Modules whose code is not part of a digest. Instead of the code, the digest contains the version
#: of the module or the version of Python.
_PACKAGES_DIGESTED_BY_VERSION_ONLY = {*sys.stdlib_module_names, "numpy", "numba"}
#: The fast-math flags permit reciprocals instead of divisions, and fused multiply-add operations.
#: With these flags, the compiler can compute reciprocals of the parameters once per step.
_COMPILER_OPTIONS: Mapping[str, Any] = {
    "error_model": "numpy",
    "nogil": True,
    "fastmath": {"arcp", "contract", "nsz"},
}
_CFUNC_SIGNATURE = numba.types.void(*[numba.types.CPointer(numba.types.float64)] * 4)
#: Version of the cache format. Increment the version if the folder layout or the file names of the
#: cache change.
_CACHE_FORMAT_VERSION = 4
#: Compiled functions that must not be deleted because their addresses are in use.
_CFUNCS_KEPT_ALIVE: list[Any] = []
_logger = logging.getLogger(__name__)


def get_compile_cache_folder() -> Path:
    """Return the folder in which compiled functions are stored.

    Returns
    -------
    Path
        Folder within ``XDG_CACHE_HOME``, or within ``~/.cache`` by default.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "rsfstudy" / "compiled"


def compute_code_digest(numba_signature: Any, *functions: Callable[..., Any]) -> str:
    """Compute a digest of functions and their compilation options.

    Parameters
    ----------
    numba_signature : object
        Numba signature of the functions.
    *functions : callable
        Functions from whose code the digest is computed. Functions called by these functions are
        included.

    Returns
    -------
    str
        Hexadecimal digest. The digest also depends on the compiler version and on the processor.
    """
    processor = llvmlite.binding.get_host_cpu_name(), str(llvmlite.binding.get_host_cpu_features())
    options = [
        (name, sorted(x) if isinstance(x, set) else x) for name, x in _COMPILER_OPTIONS.items()
    ]
    versions = _CACHE_FORMAT_VERSION, numba.__version__, np.__version__
    settings = repr(
        (numba_signature, versions, str(config.CPU_NAME), str(config.OPT), processor, options)
    )
    return _digest_functions_and_callees(*functions).add_object(settings).hexdigest(32)


def _digest_functions_and_callees(*functions: Callable[..., Any]) -> ObjectDigest:
    """Compute a digest of the given functions and all functions that they call."""
    return ObjectDigest(_is_module_code_digested, _get_compiled_replacement_or_itself).add_object(
        functions
    )


def _is_module_code_digested(module_name: str | None) -> bool:
    """Return True if digests include the source code of a module."""
    return (module_name or "").partition(".")[0] not in _PACKAGES_DIGESTED_BY_VERSION_ONLY


def compile_or_load_function(function: Callable[..., Any], numba_signature: Any) -> Any:
    """Compile a function, or load it from the cache.

    Parameters
    ----------
    function : callable
        Function to compile.
    numba_signature : object
        Numba signature of the function.

    Returns
    -------
    Dispatcher
        Compiled function that can be called from Python.
    """

    def compile_for(entry: str) -> Any:
        copy = _copy_function_with_compiled_callees(function, entry)
        dispatcher = numba.njit(copy, **_COMPILER_OPTIONS)
        if entry:
            dispatcher._cache = _ContentKeyedCache(copy)
        dispatcher.compile(numba_signature)
        return dispatcher

    return _load_or_compile_cache_entry(compute_code_digest(numba_signature, function), compile_for)


def compile_cfuncs_and_get_addresses(functions: Sequence[Callable[..., Any]]) -> tuple[int, ...]:
    """Compile functions with pointer arguments, or load them from the cache.

    Parameters
    ----------
    functions : sequence of callable
        Functions with the arguments ``(y, rates, p, result)``.

    Returns
    -------
    tuple of int
        Addresses of the compiled functions. The addresses are valid until the process ends.
    """

    def compile_for(entry: str) -> list[Any]:
        return [
            _compile_cfunc(
                _copy_function_with_compiled_callees(function, entry), use_cache=bool(entry)
            )
            for function in functions
        ]

    pointers = _load_or_compile_cache_entry(
        compute_code_digest(_CFUNC_SIGNATURE, *functions), compile_for
    )
    _CFUNCS_KEPT_ALIVE.append(pointers)
    return tuple(pointer.address for pointer in pointers)


class _ContentKeyedCache(FunctionCache):  # type: ignore[misc]
    """Numba cache whose keys do not depend on the closure values of a function.

    By default, Numba includes the closure values of a function in the cache key. Closure values
    include compiled functions, which differ between processes. With the default cache key, Numba
    would therefore never find a cached function again.
    """

    def _index_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        """Return a cache key that does not depend on the values of closure variables."""
        return signature, codegen.magic_tuple()


def _compile_cfunc(function: Any, *, use_cache: bool) -> Any:
    """Compile a function with pointer arguments, and optionally use the cache."""
    compiled = CFunc(
        function, normalize_signature(_CFUNC_SIGNATURE), locals={}, options=dict(_COMPILER_OPTIONS)
    )
    if use_cache:
        compiled._cache = _ContentKeyedCache(function)  # type: ignore[attr-defined]
    compiled.compile()
    return compiled


def _load_or_compile_cache_entry(
    entry_name: str, compile_with_cache_path: Callable[[str], Any]
) -> Any:
    """Load functions from their cache folder, or compile them.

    A damaged cache folder is replaced.
    """
    folder = _prepare_private_cache_entry_folder(entry_name)
    if folder is not None:
        if folder.exists():
            with contextlib.suppress(Exception):  # A damaged cache can raise any exception.
                return compile_with_cache_path(str(folder / _PLACEHOLDER_SOURCE_FILE_NAME))
        shutil.rmtree(folder, ignore_errors=True)
    began = time.perf_counter()
    with compilation_log.compilation_context_factory():
        try:
            return (
                compile_with_cache_path("")
                if folder is None
                else _compile_in_temporary_folder(folder, compile_with_cache_path)
            )
        except OSError:  # The cache folder cannot be written.
            return compile_with_cache_path("")
        finally:
            compilation_log.compiled_program_count += 1
            compilation_log.total_compilation_seconds += time.perf_counter() - began


def _prepare_private_cache_entry_folder(entry_name: str) -> Path | None:
    """Return the cache folder of an entry, or None if other users can write to it.

    The function also returns None if the folder cannot be created.
    """
    try:
        cache = get_compile_cache_folder()
        cache.parent.parent.mkdir(parents=True, exist_ok=True)
        for folder in (cache.parent, cache):
            folder.mkdir(mode=0o700, exist_ok=True)
        for folder in (cache.parent, cache, cache / entry_name):
            if folder.exists() and not _is_private_folder(folder):
                _warn_that_folder_is_not_private(folder)
                return None
    except (OSError, RuntimeError):  # The folder cannot be created, or the user has no home folder.
        return None
    return cache / entry_name


@functools.cache
def _warn_that_folder_is_not_private(folder: Path) -> None:
    """Warn that other users can write to a folder. Each folder causes only one warning."""
    _logger.warning(
        "%s is not private to the current user, so rsfstudy does not use it as a cache of "
        "compiled functions. Remove the directory, or set XDG_CACHE_HOME to another directory.",
        folder,
    )


def _is_private_folder(folder: Path) -> bool:
    """Return True if the current user owns a folder and no other user can write to it."""
    if not hasattr(os, "geteuid"):  # Windows has no numeric owners and modes.
        return True
    found = folder.stat()
    owners = {found.st_uid, folder.lstat().st_uid}
    return owners == {os.geteuid()} and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _compile_in_temporary_folder(
    final_folder: Path, compile_with_cache_path: Callable[[str], Any]
) -> Any:
    """Compile functions in a temporary folder, and rename the folder at the end."""
    aside = Path(tempfile.mkdtemp(prefix=f"{final_folder.name}.", dir=final_folder.parent))
    try:
        entry = aside / _PLACEHOLDER_SOURCE_FILE_NAME
        entry.write_text("# Placeholder for a function that rsfstudy has compiled.\n")
        os.utime(entry, (0, 0))  # The cache of Numba depends on the modification time.
        ready = compile_with_cache_path(str(entry))
        with contextlib.suppress(OSError):  # Another process may have renamed its folder earlier.
            os.rename(aside, final_folder)
        return ready
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _copy_function_with_compiled_callees(function: Any, cache_entry_path: str = "") -> Any:
    """Copy a function, and replace the functions that it calls with compiled functions.

    The qualified name of the copy contains a digest of its content. The digest is necessary because
    a linker treats functions with equal names as the same function. The numbers that Numba adds to
    function names are not sufficient, because they differ between processes. If
    ``cache_entry_path`` is given, it becomes the source file of the copy.
    """
    named = {
        name: function.__globals__.get(name)
        for name in list_global_names_read_by_code(function.__code__)
    }
    reached = {
        name: _jit_compile_callee(value)
        for name, value in named.items()
        if _is_python_function(value)
    }
    cells = tuple(
        types.CellType(_jit_compile_callee(value) if _is_python_function(value) else value)
        for value in (cell.cell_contents for cell in function.__closure__ or ())
    )
    code = (
        function.__code__.replace(co_filename=cache_entry_path)
        if cache_entry_path
        else function.__code__
    )
    copy = types.FunctionType(
        code, {**function.__globals__, **reached}, function.__name__, None, cells or None
    )
    copy.__qualname__ = (
        f"{function.__name__}_{_digest_functions_and_callees(function).hexdigest(32)}"
    )
    return copy


def _is_python_function(value: Any) -> bool:
    """Return True if a value is a Python function."""
    return isinstance(value, types.FunctionType)


def _get_compiled_replacement_or_itself(value: Any) -> Any:
    """Replace a function by its compiled version. Return other values unchanged."""
    return (
        COMPILED_REPLACEMENT_BY_PYTHON_FUNCTION.get(value, value)
        if _is_python_function(value)
        else value
    )


def _jit_compile_callee(function: Any) -> Any:
    """Compile a function that is called only by compiled functions.

    A function that is called by several systems of equations is compiled only once.
    """
    return _jit_compile_callee_cached(_get_compiled_replacement_or_itself(function))


@functools.cache
def _jit_compile_callee_cached(function: Any) -> Any:
    """Compile a function without the wrappers for calls from Python or C."""
    inner = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(_copy_function_with_compiled_callees(function), **_COMPILER_OPTIONS, **inner)
