"""A file for the last words of worker processes and of the libraries below them: stacks of threads,
tracebacks of Dask.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from distributed import WorkerPlugin

from rsfstudy.errors import DataError

_STDERR_FILE_NUMBER = 2
#: Loggers in this process of Dask and of the libraries below it.
_NAMES_OF_DASK_LOGGERS = ("distributed", "tornado", "asyncio")


@contextlib.contextmanager
def open_worker_log(log_path: Path | None) -> Iterator[Path]:
    """The file, ready for writing; a temporary one where no name is given. It is removed if
    it stays empty.

    Raises
    ------
    DataError
        If it cannot be written.
    """
    try:
        if log_path is None:
            number, name = tempfile.mkstemp(prefix="rsfstudy.", suffix=".workers.log")
            os.close(number)
            log_path = Path(name)
        log_path.touch()
    except OSError as error:
        raise DataError(f"cannot write {log_path or 'a temporary file'}: {error}.") from error
    try:
        with _redirect_loggers(log_path):
            yield log_path
    finally:
        with contextlib.suppress(OSError):
            if not log_path.stat().st_size:
                log_path.unlink()


@contextlib.contextmanager
def _redirect_loggers(log_file: Path) -> Iterator[None]:
    """Write errors that are logged in this process to the file, and nowhere else."""
    handler = logging.FileHandler(log_file, delay=True)
    handler.setLevel(logging.ERROR)
    handler.setFormatter(logging.Formatter("%(asctime)s - %(name)s - %(message)s"))
    loggers = [logging.getLogger(name) for name in _NAMES_OF_DASK_LOGGERS]
    before = [(logger.handlers, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.handlers, logger.propagate = [handler], False
    try:
        yield
    finally:
        for logger, (handlers, propagate) in zip(loggers, before, strict=True):
            logger.handlers, logger.propagate = handlers, propagate
        handler.close()


@dataclass(frozen=True)
class RedirectStderrPlugin(WorkerPlugin):
    """A Dask worker whose process writes errors to a file.

    Parameters
    ----------
    log_path : Path
    """

    log_path: Path

    def setup(self, worker: Any) -> None:
        """Called by Dask when the worker starts."""
        if sys.__stderr__ is None:  # the number of a closed one may belong to another file by now
            return
        with contextlib.suppress(OSError):
            file = os.open(self.log_path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            os.dup2(file, _STDERR_FILE_NUMBER)
            os.close(file)
