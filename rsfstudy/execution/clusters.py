"""Dask clusters: worker processes started on this machine, or a scheduler that runs elsewhere."""

from __future__ import annotations

import ast
import asyncio
import contextlib
import functools
import linecache
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from multiprocessing import resource_tracker
from pathlib import Path
from types import FrameType
from typing import Any

from rsfstudy.errors import InvalidValue, RunError, shorten_text

#: Time in s to wait for a process of this machine that does not answer.
_CLUSTER_CONNECT_TIMEOUT = 600
#: What ends a run in order, where it is handled.
_SIGNALS_THAT_END_RUN = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def check_script_has_main_guard(worker_count: int) -> None:
    """Refuse a script that worker processes, which import it, would run as well: one whose line
    that leads here stands below no condition.

    Raises
    ------
    InvalidValue
        Where it is such a script.
    """
    main = sys.modules["__main__"]
    frame: FrameType | None = sys._getframe()
    while frame and not (frame.f_globals is vars(main) and frame.f_code.co_name == "<module>"):
        frame = frame.f_back
    file = getattr(main, "__file__", None)
    if frame is None or file is None or Path(file).name == "__main__.py":
        return  # a notebook, python -c and a package's __main__ are not imported
    line, tree = frame.f_lineno, ast.parse("".join(linecache.getlines(frame.f_code.co_filename)))
    conditions = (n for n in ast.walk(tree) if isinstance(n, ast.If | ast.IfExp | ast.BoolOp))
    if not tree.body or any(n.lineno <= line <= (n.end_lineno or line) for n in conditions):
        return
    rule = f"worker processes import {Path(file).name}, and line {line} would run in each again"
    remedy = (
        'Put what runs below `if __name__ == "__main__":`, or compute in this process: workers=0.'
    )
    raise InvalidValue("workers", worker_count, rule, remedy=remedy)


@contextlib.contextmanager
def _delay_interrupts() -> Iterator[None]:
    """Delay Ctrl-C, and signals that end the run as it does, until the end of this block. Ctrl-C
    and the end of a terminal are kept from processes that are started in it: the driver ends the
    run, and then its workers. A second Ctrl-C is not delayed.
    """
    held: list[int] = []
    found = {int(number): signal.getsignal(number) for number in _SIGNALS_THAT_END_RUN}
    handlers = {number: handler for number, handler in found.items() if callable(handler)}

    def hold(number: int, frame: FrameType | None) -> None:
        if held and number == signal.SIGINT:
            handlers[number](number, frame)
        held.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    for number in handlers:
        signal.signal(number, hold)
    # threads and processes inherit the signals that are blocked when they are started; SIGTERM is
    # what ends those that do not answer
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if held:  # also where a process that had the signal too could not be started
            handlers[held[0]](held[0], None)


def _ignore_unknown_names_in_unregister(unregister: Callable[..., None]) -> Any:
    """Wrap ``resource_tracker.unregister`` so that unknown names cause no traceback.

    If the tracker process is killed, Python starts another tracker process. The new process does
    not know the existing semaphores and prints a traceback whenever a semaphore is released. The
    wrapper registers each name again before releasing it. Registering a name twice is harmless.
    """

    @functools.wraps(unregister)
    def unregister_known(name: str, kind: str) -> None:
        resource_tracker.register(name, kind)
        unregister(name, kind)

    return unregister_known


def _tolerate_lost_resource_tracker() -> None:
    """Install ``_ignore_unknown_names_in_unregister`` for the lifetime of the process.

    The wrapper must stay installed, because semaphores are released whenever they are
    garbage-collected.
    """
    if not hasattr(resource_tracker.unregister, "__wrapped__"):
        resource_tracker.unregister = _ignore_unknown_names_in_unregister(
            resource_tracker.unregister
        )


@contextlib.contextmanager
def start_local_cluster(worker_count: int, log_path: Path) -> Iterator[Any]:
    """A Dask client of worker processes on this machine, with one thread each.

    Parameters
    ----------
    worker_count : int
        How many.
    log_path : Path
        Where they write errors.

    Raises
    ------
    RunError
        If they cannot be started.
    """
    import dask
    from distributed import Client, LocalCluster

    from rsfstudy.execution import worker_log

    quiet = {
        "distributed.scheduler.allowed-failures": 0,
        # a worker that is slow, or busy with its cell, is ended by the time limit only
        "distributed.scheduler.worker-ttl": None,
        # when a worker has died, Dask would close it for good if it were not back after this time
        "distributed.deploy.lost-worker-timeout": "1000 days",
        # by default each process ticks 50 times and samples its stack 100 times a second
        "distributed.admin.tick.interval": "1s",
        "distributed.worker.profile.enabled": False,
        "distributed.comm.timeouts.connect": f"{_CLUSTER_CONNECT_TIMEOUT}s",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(
            ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
        ),
    }
    with dask.config.set(quiet), contextlib.ExitStack() as stack:
        _tolerate_lost_resource_tracker()
        resource_tracker.ensure_running()  # before workers start, because it unblocks signals
        with _delay_interrupts():
            try:
                cluster = LocalCluster(
                    n_workers=worker_count,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",  # its pages listen, even where it has none
                    scheduler_kwargs={"dashboard": False},
                    silence_logs=logging.ERROR,
                    plugins=(worker_log.RedirectStderrPlugin(log_path.resolve()),),
                )
            except Exception as error:
                raise RunError(
                    f"a worker process could not be started ({str(error).rstrip('.')}). Worker "
                    "processes import the script that starts them: call what runs below "
                    '`if __name__ == "__main__":`, or compute in this process, --serial (workers=0)'
                ) from error
            stack.enter_context(cluster)
        yield stack.enter_context(Client(cluster))
        said = log_path.stat().st_size
        stack.close()
        os.truncate(log_path, said)  # that a heartbeat found the scheduler closed is no news


async def _check_scheduler_answers(scheduler_address: str) -> None:
    """Check that Dask answers; its client would wait for ever if another program listens there."""
    from distributed import Security
    from distributed.comm.core import connect

    comm = await connect(scheduler_address, **Security().get_connection_args("client"))
    comm.abort()


@contextlib.contextmanager
def connect_to_cluster(scheduler_address: str, *, timeout: float = 30.0) -> Iterator[Any]:
    """A client of a Dask scheduler that is already running, with the certificates of Dask's
    configuration.

    Raises
    ------
    RunError
        If none answers at the address.
    """
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    # the run reports a failure of the cluster once; Dask's client would log more until it is
    # closed
    with silence_logging_cmgr(logging.CRITICAL + 1):
        try:
            asyncio.run(asyncio.wait_for(_check_scheduler_answers(scheduler_address), timeout))
            client = Client(scheduler_address, timeout=timeout)
        except Exception as error:  # Dask raises errors of many kinds for a wrong address
            raise RunError(
                f"no Dask scheduler answers at {shorten_text(scheduler_address)!r}: "
                f"{shorten_text(error) or 'it took too long'}. "
                "Start one with `dask scheduler` (certificates for tls:// are those of Dask's "
                "configuration), or leave --scheduler out."
            ) from error
        with client:
            yield client
