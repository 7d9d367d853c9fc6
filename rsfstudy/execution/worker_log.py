"""Functions and a Dask plugin that redirect the errors of workers to a log file.

The log file contains stack traces of threads. The log file also contains the tracebacks that Dask
and its libraries print.
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

_STDERR_FILE_DESCRIPTOR = 2
#: Names of the loggers of Dask and of the libraries that Dask uses.
_NAMES_OF_DASK_LOGGERS = ("distributed", "tornado", "asyncio")


@contextlib.contextmanager
def open_worker_log(log_path: Path | None) -> Iterator[Path]:
    """Open a log file, and redirect the loggers of Dask to this file.

    If the log file is empty at the end of the ``with`` block, the file is deleted.

    Parameters
    ----------
    log_path : Path or None
        Path of the file. If None, a temporary file is created.

    Yields
    ------
    Path
        Path of the file.

    Raises
    ------
    DataError
        If the file cannot be written.
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
        with _redirect_dask_loggers(log_path):
            yield log_path
    finally:
        with contextlib.suppress(OSError):
            if not log_path.stat().st_size:
                log_path.unlink()


@contextlib.contextmanager
def _redirect_dask_loggers(log_file: Path) -> Iterator[None]:
    """Redirect the errors that Dask logs in this process to a file."""
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
    """Dask plugin that redirects the standard error of a worker to a file.

    Parameters
    ----------
    log_path : Path
        Path of the file.
    """

    log_path: Path

    def setup(self, worker: Any) -> None:
        """Redirect the standard error when the worker starts.

        Parameters
        ----------
        worker : distributed.Worker
            Worker that starts.
        """
        if sys.__stderr__ is None:  # Another file may use the number of a closed stream.
            return
        with contextlib.suppress(OSError):
            file = os.open(self.log_path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            os.dup2(file, _STDERR_FILE_DESCRIPTOR)
            os.close(file)
