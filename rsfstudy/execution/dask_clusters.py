"""Connections to Dask clusters: local worker processes or a running scheduler."""

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

#: Timeout in s for connections between processes on this machine.
_CLUSTER_CONNECT_TIMEOUT = 600
#: Signals that end a run in an orderly way if a handler for the signals is installed.
_SIGNALS_THAT_END_RUN = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def check_script_has_main_guard(worker_count: int) -> None:
    """Check that importing the main script does not start the computation again.

    Worker processes import the main script. In the main script, the line that starts the
    computation must therefore be inside a condition, such as ``if __name__ == "__main__":``.
    Notebooks and commands are not checked, because worker processes do not import them.

    Parameters
    ----------
    worker_count : int
        Number of worker processes, for the error message.

    Raises
    ------
    InvalidValue
        If the line of the main script that starts the computation is not inside a condition.
    """
    main = sys.modules["__main__"]
    frame: FrameType | None = sys._getframe()
    while frame and not (frame.f_globals is vars(main) and frame.f_code.co_name == "<module>"):
        frame = frame.f_back
    file = getattr(main, "__file__", None)
    if frame is None or file is None or Path(file).name == "__main__.py":
        return  # Workers do not import a notebook, ``python -c`` or a ``__main__`` module.
    line, tree = frame.f_lineno, ast.parse("".join(linecache.getlines(frame.f_code.co_filename)))
    conditions = (n for n in ast.walk(tree) if isinstance(n, ast.If | ast.IfExp | ast.BoolOp))
    if not tree.body or any(n.lineno <= line <= (n.end_lineno or line) for n in conditions):
        return
    rule = (
        f"cannot be used at line {line} of {Path(file).name}, because each worker process imports "
        "this file and would run the line again"
    )
    remedy = (
        'Move the code that runs the study below `if __name__ == "__main__":`, or run the study '
        "in this process: workers=0."
    )
    raise InvalidValue("workers", worker_count, rule, remedy=remedy)


@contextlib.contextmanager
def _delay_interrupts() -> Iterator[None]:
    """Delay Ctrl-C and other signals until the end of the ``with`` block.

    A second Ctrl-C is not delayed. Processes that start inside the ``with`` block ignore Ctrl-C.
    These processes also ignore the signal that a terminal sends when it closes. The main process
    can therefore end the run before it ends its workers.
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
    # Threads and processes inherit the signals that are blocked when they start. SIGTERM is not
    # blocked, because it ends processes that do not respond.
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if held:  # This runs even if the signal prevented a process from starting.
            handlers[held[0]](held[0], None)


def _wrap_resource_tracker_unregister(unregister: Callable[..., None]) -> Any:
    """Wrap ``resource_tracker.unregister`` to avoid tracebacks.

    If the tracker process is killed, Python starts a new tracker process. The existing semaphores
    are not registered with the new tracker process, so it prints a traceback whenever one of these
    semaphores is released. The wrapper therefore registers each name again before the name is
    removed. Registering a name twice is harmless.
    """

    @functools.wraps(unregister)
    def unregister_known(name: str, kind: str) -> None:
        resource_tracker.register(name, kind)
        unregister(name, kind)

    return unregister_known


def _tolerate_lost_resource_tracker() -> None:
    """Replace ``resource_tracker.unregister`` by its wrapper for the lifetime of the process.

    The wrapper must stay installed, because a semaphore is released when it is garbage-collected,
    which can happen at any time.
    """
    if not hasattr(resource_tracker.unregister, "__wrapped__"):
        resource_tracker.unregister = _wrap_resource_tracker_unregister(resource_tracker.unregister)


def _close_client(dask_client: Any) -> None:
    """Close a Dask client, even if its event loop has already ended.

    If the event loop has ended, Dask cannot close the client, and the resulting error would hide
    the results of the run. The client is then only marked as closed. If the client belongs to a
    local cluster, the cluster is marked as closed, too.
    """
    from distributed.core import Status

    if not dask_client.loop.asyncio_loop.is_closed():
        dask_client.close()
        return
    dask_client.status = "closed"
    if dask_client.cluster is not None:
        dask_client.cluster.status = Status.closed


@contextlib.contextmanager
def start_local_cluster(worker_count: int, log_path: Path) -> Iterator[Any]:
    """Start worker processes on this machine, with one thread each.

    Parameters
    ----------
    worker_count : int
        Number of worker processes.
    log_path : Path
        File to which the workers write errors.

    Yields
    ------
    distributed.Client
        Client that is connected to the workers.

    Raises
    ------
    RunError
        If a worker process cannot be started.
    """
    import dask
    from distributed import Client, LocalCluster

    from rsfstudy.execution import worker_log

    quiet = {
        "distributed.scheduler.allowed-failures": 0,
        # Dask must not end a slow or busy worker. Only the time limit of a cell ends such a worker.
        "distributed.scheduler.worker-ttl": None,
        # Dask would permanently close a worker that has died and not restarted within this time.
        "distributed.deploy.lost-worker-timeout": "1000 days",
        # By default, each process ticks 50 times and samples its stack 100 times per second.
        "distributed.admin.tick.interval": "1s",
        "distributed.worker.profile.enabled": False,
        "distributed.comm.timeouts.connect": f"{_CLUSTER_CONNECT_TIMEOUT}s",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(
            ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
        ),
    }
    with dask.config.set(quiet), contextlib.ExitStack() as stack:
        _tolerate_lost_resource_tracker()
        # Starting the tracker unblocks signals, so it is started first.
        resource_tracker.ensure_running()
        with _delay_interrupts():
            try:
                cluster = LocalCluster(
                    n_workers=worker_count,
                    threads_per_worker=1,
                    processes=True,
                    # The HTTP server runs even without dashboard pages.
                    dashboard_address="127.0.0.1:0",
                    scheduler_kwargs={"dashboard": False},
                    silence_logs=logging.ERROR,
                    plugins=(worker_log.RedirectStderrPlugin(log_path.resolve()),),
                )
            except Exception as error:
                raise RunError(
                    f"a worker process could not be started ({str(error).rstrip('.')}). Worker "
                    "processes import the script that starts the run. Move the code that runs "
                    'the study below `if __name__ == "__main__":`, or run the study in this '
                    "process: --serial (workers=0)"
                ) from error
            stack.enter_context(cluster)
        client = Client(cluster)
        stack.callback(_close_client, client)
        yield client
        said = log_path.stat().st_size
        stack.close()
        # The truncation removes heartbeat errors that were logged after the scheduler had closed.
        os.truncate(log_path, said)


async def _check_scheduler_answers(scheduler_address: str) -> None:
    """Check that a Dask scheduler answers at an address.

    Without this check, the Dask client would wait forever if a different program listens at the
    address.
    """
    from distributed import Security
    from distributed.comm.core import connect

    comm = await connect(scheduler_address, **Security().get_connection_args("client"))
    comm.abort()


@contextlib.contextmanager
def connect_to_cluster(scheduler_address: str, *, timeout: float = 30.0) -> Iterator[Any]:
    """Connect to a running Dask scheduler.

    The TLS certificates are taken from the configuration of Dask.

    Parameters
    ----------
    scheduler_address : str
        Address of the scheduler.
    timeout : float, default: 30.0
        Time in s to wait for an answer of the scheduler.

    Yields
    ------
    distributed.Client
        Client that is connected to the scheduler.

    Raises
    ------
    RunError
        If no scheduler answers at the address.
    """
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    # The run reports a failure of the cluster once. The Dask client would log further messages
    # until the client is closed.
    with silence_logging_cmgr(logging.CRITICAL + 1):
        try:
            asyncio.run(asyncio.wait_for(_check_scheduler_answers(scheduler_address), timeout))
            client = Client(scheduler_address, timeout=timeout)
        except Exception as error:  # Dask raises errors of many types for a wrong address.
            raise RunError(
                f"no Dask scheduler responds at {shorten_text(scheduler_address)!r}: "
                f"{shorten_text(error) or 'the connection timed out'}. Start a scheduler with "
                "`dask scheduler`, or omit --scheduler. The certificates for tls:// addresses "
                "are read from the Dask configuration."
            ) from error
        try:
            yield client
        finally:
            _close_client(client)
