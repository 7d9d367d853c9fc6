"""Dask workers: batches of cells are sent to them, and a cell that kills its worker is found.

A worker that dies takes its whole batch with it, and may take others that waited there. The cells
of all these are then sent one at a time while nothing else runs, so that only the cell that dies
alone is blamed.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
import signal
import sys
import threading
import time
import warnings
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from multiprocessing import resource_tracker
from typing import Any

from rsfstudy.cells import Batch, Found, Mapper, Task, on_worker, packed, sendable
from rsfstudy.errors import RunError, brief
from rsfstudy.measures import Outcome
from rsfstudy.status import Status

_START_TIMEOUT = 60
#: Time in s without any worker after which a run ends.
PATIENCE = 60.0
_LOOK = 2.0
#: How often a cell may kill its worker before it is recorded as the culprit.
_TRIES = 2


def on_client(client: Any) -> Mapper:
    """On the workers of a Dask client; they need no shared file system."""

    def mapper(task: Task, batches: Iterable[Batch]) -> Generator[Found]:
        sent, waiting = sendable(task), _Waiting(batches)
        running: dict[Any, Batch] = {}
        suspects: list[Any] = []
        try:
            while True:
                if not suspects:
                    _fill(client, sent, waiting, running)
                if running:
                    for future in _finished(client, running):
                        batch = running.pop(future)
                        found = _result(future)
                        if found is None:
                            suspects += batch
                        else:
                            waiting.back(batch[len(found) :])
                            yield found
                elif suspects:
                    for cell in suspects:
                        yield _alone(client, task, [cell])
                    suspects = []
                else:
                    return
        finally:
            client.cancel(list(running))

    return mapper


class _Waiting(Iterator[Batch]):
    """Batches that are not sent yet; what a worker left of one is the next."""

    def __init__(self, batches: Iterable[Batch]) -> None:
        self._new = iter(batches)
        self._left: list[Batch] = []

    def __next__(self) -> Batch:
        return self._left.pop() if self._left else next(self._new)

    def back(self, rest: Batch) -> None:
        """Take what is left of a batch."""
        self._left += [rest] if rest else []


def _fill(client: Any, sent: bytes, waiting: _Waiting, running: dict[Any, Batch]) -> None:
    """Keep the workers busy, and little more: what waits fills the scheduler's memory."""
    enough = 4 + 2 * threads(client)
    for batch in itertools.islice(waiting, max(0, enough - len(running))):
        running[client.submit(on_worker, sent, packed(batch), pure=False)] = batch


def threads(client: Any) -> int:
    """How many cells the workers of a client compute at a time."""
    if client.status != "running":
        raise RunError(f"the Dask client is {client.status}: connect one to a cluster")
    try:
        return sum(client.nthreads().values())
    except (OSError, TimeoutError) as error:
        raise RunError("the Dask scheduler is lost") from error


def _finished(client: Any, running: Iterable[Any]) -> Iterable[Any]:
    """Futures that are finished, once there are any.

    Raises
    ------
    RunError
        If the scheduler is lost, or there has been no worker for a while.
    """
    from distributed import wait

    seen = time.monotonic()
    while True:
        try:
            done: Iterable[Any] = wait(
                list(running), timeout=_LOOK, return_when="FIRST_COMPLETED"
            ).done
            return done
        except TimeoutError:
            waiting = time.monotonic() - seen
            if threads(client):
                seen = time.monotonic()
            elif waiting < 2 * _LOOK:
                warnings.warn(
                    f"the Dask cluster has no worker: waiting {PATIENCE:g} s", stacklevel=2
                )
            elif time.monotonic() - seen > PATIENCE:
                raise RunError(
                    f"the Dask cluster has had no worker for {PATIENCE:g} s: start some"
                ) from None
        except CancelledError as error:
            raise RunError("the Dask scheduler is lost") from error


def _result(future: Any) -> Found | None:
    """What a batch gave, or None where its worker died; anything else is a failure of the
    cluster.
    """
    from distributed import KilledWorker

    try:
        found: Found = future.result()
    except KilledWorker:
        return None
    except RunError:
        raise
    except CancelledError as error:
        raise RunError("the Dask scheduler is lost") from error
    except Exception as error:
        raise RunError(
            f"the Dask cluster gave up ({type(error).__name__}: {error}). "
            "Its workers need the same rsfstudy"
        ) from error
    return found


def _alone(client: Any, task: Task, batch: Batch) -> Found:
    """A suspect by itself; the culprit where its worker dies again."""
    for _ in range(_TRIES):
        began = time.monotonic()
        future = client.submit(on_worker, sendable(task), packed(batch), pure=False)
        try:
            _finished(client, [future])
            found = _result(future)
        finally:
            client.cancel([future])
        if found is not None:
            return found
        seconds = time.monotonic() - began
        if seconds > task.time_limit:
            text = f"no answer within {task.time_limit:g} s; the worker's log shows where it was"
            return [(batch[0][0], (Outcome(Status.TIME_LIMIT_SPENT, message=text), seconds))]
    text = (
        f"its worker died {_TRIES} times while it computed nothing else: a crash, or more memory "
        "than a worker may use"
    )
    return [(batch[0][0], (Outcome(Status.WORKER_LOST, message=text), math.nan))]


def on_local_cluster(processes: int) -> Mapper:
    """On worker processes of this machine, started when there is something to compute."""

    def mapper(task: Task, batches: Iterable[Batch]) -> Generator[Found]:
        with local_cluster(processes) as client:
            yield from on_client(client)(task, batches)

    return mapper


@contextlib.contextmanager
def _script_not_imported() -> Iterator[None]:
    """Keep worker processes from importing the user's script again, which would start workers of
    its own.

    Multiprocessing finds the script by these two names; what a script defines reaches the workers
    by value all the same.
    """
    main = sys.modules["__main__"]
    hidden = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    for name in hidden:
        setattr(main, name, None)
    try:
        yield
    finally:
        for name, value in hidden.items():
            setattr(main, name, value)


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C waits until this is over, and never reaches a process that is started within: on
    Ctrl-C it is the driver that ends a run, and its workers. Pressed twice, it does not wait.
    """
    held: list[int] = []

    def hold(number: int, _frame: object) -> None:
        if held:
            raise KeyboardInterrupt
        held.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handler = signal.signal(signal.SIGINT, hold)
    resource_tracker.ensure_running()  # which would lift what is blocked
    # threads that are started now, and their processes, keep what is blocked now
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        signal.signal(signal.SIGINT, handler)
    if held:
        raise KeyboardInterrupt


@contextlib.contextmanager
def local_cluster(workers: int) -> Iterator[Any]:
    """A Dask client of worker processes on this machine, with one thread each."""
    import dask
    from distributed import Client, LocalCluster

    quiet = {
        "distributed.scheduler.allowed-failures": 0,
        # Dask closes for good a worker that died and happens to be starting again this long after
        "distributed.deploy.lost-worker-timeout": "1000 days",
        # what each process does beside its cells: 50 ticks and 100 looks at the stack a second
        "distributed.admin.tick.interval": "1s",
        "distributed.worker.profile.enabled": False,
        "distributed.comm.timeouts.connect": f"{_START_TIMEOUT}s",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(
            ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
        ),
    }
    with _script_not_imported(), dask.config.set(quiet), contextlib.ExitStack() as stack:
        started = stack.enter_context(contextlib.ExitStack())
        started.enter_context(_interrupts_held())
        cluster = stack.enter_context(
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
            )
        )
        started.close()
        yield stack.enter_context(Client(cluster))


async def _greeting(address: str) -> None:
    """What Dask says first; its client would wait for ever where something else listens."""
    from distributed.comm.core import connect

    comm = await connect(address)
    comm.abort()


@contextlib.contextmanager
def existing_cluster(address: str, *, timeout: float = 10.0) -> Iterator[Any]:
    """A client of a Dask scheduler that is already running.

    Raises
    ------
    RunError
        If none answers at the address.
    """
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    # what goes wrong with a cluster is told once, by the run; Dask's client has more to say until
    # it is closed
    with silence_logging_cmgr(logging.CRITICAL + 1):
        try:
            asyncio.run(asyncio.wait_for(_greeting(address), timeout))
            client = Client(address, timeout=timeout)
        except Exception as error:  # what Dask makes of an address that is none has no end
            raise RunError(
                f"no Dask scheduler answers at {brief(address)!r}: "
                f"{brief(error) or 'it took too long'}. "
                "Start one with `dask scheduler`, or leave --scheduler out."
            ) from error
        with client:
            yield client
