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
from pathlib import Path
from typing import Any

from rsfstudy.compute.cells import WAITING, Batch, Found, Mapper, Task, on_worker, packed, sendable
from rsfstudy.errors import RunError, brief
from rsfstudy.measures import Outcome
from rsfstudy.status import Status

#: Time in s after which a process of this machine that does not answer never will.
_HANGS = 600
#: Time in s without any worker after which a run says so, and after which it ends.
TELL, PATIENCE = 30.0, 600.0
_LOOK = 2.0
#: How often a cell may kill its worker before it is recorded as the culprit.
_TRIES = 2


def on_client(client: Any, log: str = "the log of that worker") -> Mapper:
    """On the workers of a Dask client; they need no shared file system.

    Parameters
    ----------
    client : distributed.Client
    log : str
        Where a worker that ends says why, for messages.
    """

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
                    warnings.warn(
                        f"a worker ended: the cells it held ({len(suspects)}) are computed again, "
                        f"one at a time (see {log})",
                        stacklevel=2,
                    )
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
    if client.status == "connecting":  # again
        raise RunError("the Dask scheduler is lost")
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

    seen, told = time.monotonic(), False
    while True:
        try:
            done: Iterable[Any] = wait(
                list(running), timeout=_LOOK, return_when="FIRST_COMPLETED"
            ).done
            return done
        except TimeoutError:
            waited = time.monotonic() - seen
            if threads(client):
                seen, told = time.monotonic(), False
            elif waited > TELL and not told:
                told = True
                warnings.warn(
                    f"the Dask cluster has no worker: waiting {PATIENCE:g} s for one", stacklevel=2
                )
            elif waited > PATIENCE:
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
        _finished(client, [client.submit(abs, 0, pure=False)])  # a worker is there
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
            text = (
                f"no answer within {task.time_limit:g} s of CPU time, or {WAITING:g} times as long "
                "on the clock; the worker's log shows where it was"
            )
            return [(batch[0][0], (Outcome(Status.TIME_LIMIT_SPENT, message=text), seconds))]
    text = (
        f"its worker died {_TRIES} times while it computed nothing else: a crash, or more memory "
        "than a worker may use"
    )
    return [(batch[0][0], (Outcome(Status.WORKER_LOST, message=text), math.nan))]


def on_local_cluster(processes: int, log: Path | None) -> Mapper:
    """On worker processes of this machine, started when there is something to compute."""

    def mapper(task: Task, batches: Iterable[Batch]) -> Generator[Found]:
        from rsfstudy.compute import worker_log

        with worker_log.kept(log) as file, local_cluster(processes, file) as client:
            yield from on_client(client, str(file))(task, batches)

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
def local_cluster(workers: int, log: Path) -> Iterator[Any]:
    """A Dask client of worker processes on this machine, with one thread each.

    Parameters
    ----------
    workers : int
        How many.
    log : Path
        Where they write errors.

    Raises
    ------
    RunError
        If they cannot be started.
    """
    import dask
    from distributed import Client, LocalCluster

    from rsfstudy.compute import worker_log

    quiet = {
        "distributed.scheduler.allowed-failures": 0,
        # nothing but a time limit ends a worker that is slow, or held up by its cell
        "distributed.scheduler.worker-ttl": None,
        # Dask closes for good a worker that died and happens to be starting again this long after
        "distributed.deploy.lost-worker-timeout": "1000 days",
        # what each process does beside its cells: 50 ticks and 100 looks at the stack a second
        "distributed.admin.tick.interval": "1s",
        "distributed.worker.profile.enabled": False,
        "distributed.comm.timeouts.connect": f"{_HANGS}s",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(
            ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
        ),
    }
    with _script_not_imported(), dask.config.set(quiet), contextlib.ExitStack() as stack:
        worker_log.start_tracker(log)  # first: it unblocks signals that `_interrupts_held` blocks
        started = stack.enter_context(contextlib.ExitStack())
        started.enter_context(_interrupts_held())
        try:
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.ERROR,
                plugins=(worker_log.WritesTo(log.resolve()),),
            )
        except Exception as error:
            why = str(error).rstrip(".")
            raise RunError(f"a worker process could not be started ({why})") from error
        stack.enter_context(cluster)
        started.close()
        client = stack.enter_context(Client(cluster))
        stack.callback(worker_log.start_tracker, log)  # if it was killed
        yield client


async def _greeting(address: str) -> None:
    """What Dask says first; its client would wait for ever where something else listens."""
    from distributed.comm.core import connect

    comm = await connect(address)
    comm.abort()


@contextlib.contextmanager
def existing_cluster(address: str, *, timeout: float = 30.0) -> Iterator[Any]:
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
