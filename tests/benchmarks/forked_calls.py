"""Function calls in a forked process with time and memory limits."""

from __future__ import annotations

import contextlib
import os
import pickle
import resource
import select
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

#: Limits of a call: CPU time in s, wall time relative to CPU time, and memory in bytes.
CPU_TIME_LIMIT, WALL_TIME_FACTOR, MEMORY_LIMIT = 20, 15.0, 8 * 2**30


def call_in_child(function: Callable[[], Any], place: Path) -> tuple[Any, str]:
    """Call a function in a forked process with ``place`` as its directory.

    Parameters
    ----------
    function : callable
        Function without arguments. Its return value must be picklable.
    place : Path
        Existing directory.

    Returns
    -------
    value : object
        Return value of the function, or None if the process did not return a value.
    how : str
        ``"hangs"`` or ``"dies of signal N"`` if the process did not return a value, otherwise an
        empty string.
    """
    reads, writes = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reads)
        _run(function, place, writes)
    os.close(writes)
    content = _receive(reads)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    os.close(reads)
    _, status = os.waitpid(child, 0)
    try:
        return pickle.loads(content), ""
    except (EOFError, pickle.UnpicklingError):
        number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
        hangs = number in (0, signal.SIGXCPU, signal.SIGKILL)
        return None, "hangs" if hangs else f"dies of signal {number}"


def _run(function: Callable[[], Any], place: Path, writes: int) -> None:
    """Call the function, write its result to a pipe, and end the process."""
    try:
        os.chdir(place)
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_TIME_LIMIT, CPU_TIME_LIMIT))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
        content = pickle.dumps(function())
        with os.fdopen(writes, "wb") as pipe:
            pipe.write(content)
    finally:
        os._exit(0)


def _receive(reads: int) -> bytes:
    """Read from a pipe until it is closed or the time limit is reached."""
    content, end = b"", time.monotonic() + WALL_TIME_FACTOR * CPU_TIME_LIMIT
    while select.select([reads], [], [], max(0.0, end - time.monotonic()))[0]:
        part = os.read(reads, 2**16)
        if not part:
            break
        content += part
    return content
