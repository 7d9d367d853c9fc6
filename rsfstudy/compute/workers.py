"""Sends batches of cells to Dask workers, and finds a cell that kills its worker.

When a worker dies, its batch is lost, and perhaps others that were waiting there. All these cells
are then sent one at a time, while nothing else runs, so that only the cell that kills a worker on
its own is blamed.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import time
import warnings
from collections.abc import Generator, Iterable
from concurrent.futures import CancelledError
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rsfstudy.compute.cells import (
    WAITING,
    FinishedCells,
    Mapper,
    Task,
    on_worker,
    packed,
    sendable,
    serial,
)
from rsfstudy.compute.clusters import local_cluster
from rsfstudy.compute.plan import Batch
from rsfstudy.defaults import TIME_LIMIT
from rsfstudy.errors import InvalidValue, RunError
from rsfstudy.measures import Outcome
from rsfstudy.status import Status

#: Longest time limit in s, three years; the system's timers take `WAITING` times that, and not
#: much more.
_LONGEST = 1e8
#: Most worker processes for each core, and most on a machine with few cores.
_A_CORE, _ANYWHERE = 4, 8
#: Time in s without any worker after which a run warns, and after which it ends.
TELL, PATIENCE = 30.0, 600.0
_LOOK = 2.0
#: How often a cell may kill its worker before it is recorded as the culprit.
_TRIES = 2


@dataclass(frozen=True)
class Workers:
    """A place where cells are computed.

    Parameters
    ----------
    processes : int
        Worker processes started on this machine; with 0, cells are computed in this process.
    client : distributed.Client, optional
        A Dask cluster to use instead.
    time_limit : float
        CPU time in s that a cell may take on a worker.
    shared : SharedProcesses, optional
        Worker processes that other runs use too.
    """

    processes: int = 2
    client: Any = None
    time_limit: float = TIME_LIMIT
    shared: SharedProcesses | None = None

    def __post_init__(self) -> None:
        whole = isinstance(self.processes, int) and not isinstance(self.processes, bool)
        if not whole or self.processes < 0:
            raise InvalidValue("workers", self.processes, "must be a whole number, 0 or more")
        most = max(_ANYWHERE, _A_CORE * (os.cpu_count() or 1))
        if self.client is None and self.processes > most:
            rule = f"must be at most {most} here: {_A_CORE} for each core, or {_ANYWHERE}"
            remedy = "A cluster has room for more: --scheduler ADDRESS (client=)."
            raise InvalidValue("workers", self.processes, rule, remedy=remedy)
        if self.client is not None and not hasattr(self.client, "submit"):
            raise InvalidValue("client", self.client, "must be a distributed.Client")
        limit: object = self.time_limit
        if not isinstance(limit, int | float) or not 0.0 < limit <= _LONGEST:
            rule = f"must be a number greater than 0, up to {_LONGEST:g} s"
            raise InvalidValue("time_limit", limit, rule)

    def threads(self) -> int:
        """Number of cells that are computed at the same time."""
        at_a_time = self.processes if self.client is None else threads(self.client)
        return max(1, at_a_time)

    def mapper(self, log: Path | None = None) -> Mapper:
        """Mapper that computes batches of cells there; `log` is where processes of this machine
        write errors.
        """
        if self.client is not None:
            return on_client(self.client)
        if self.shared is not None:
            return self.shared.mapper
        return on_local_cluster(self.processes, log) if self.processes > 0 else serial


def on_client(client: Any, log: str = "the log of that worker") -> Mapper:
    """Compute on the workers of a Dask client, which need no shared file system.

    Parameters
    ----------
    client : distributed.Client
    log : str
        Where workers write errors, for messages.
    """

    def mapper(task: Task, batches: Iterable[Batch]) -> Generator[FinishedCells]:
        sent, new = sendable(task), iter(batches)
        left: list[Batch] = []  # of batches that a worker returned before their end
        running: dict[Any, Batch] = {}
        suspects: list[Batch] = []
        try:
            while True:
                # no more than keeps the workers busy: the rest would fill the scheduler's memory
                for _ in range(0 if suspects else 4 + 2 * threads(client) - len(running)):
                    some = left.pop() if left else next(new, None)
                    if some is None:
                        break
                    running[client.submit(on_worker, sent, packed(some), pure=False)] = some
                if running:
                    for future in _finished(client, running):
                        batch = running.pop(future)
                        finished = _result(future)
                        if finished is None:
                            suspects += batch.singly()
                        else:
                            if len(finished) < len(batch):
                                left.append(batch.after(len(finished)))
                            yield finished
                elif suspects:
                    warnings.warn(
                        f"a worker ended: the cells it held ({len(suspects)}) are computed again, "
                        f"one at a time (see {log})",
                        stacklevel=2,
                    )
                    for cell in suspects:
                        yield _alone(client, task, cell)
                    suspects = []
                else:
                    return
        finally:
            client.cancel(list(running))

    return mapper


def threads(client: Any) -> int:
    """Number of cells that the workers of a client compute at the same time."""
    if client.status == "connecting":  # again
        raise RunError("the Dask scheduler is lost")
    if client.status != "running":
        raise RunError(f"the Dask client is {client.status}: connect one to a cluster")
    try:
        return sum(client.nthreads().values())
    except (OSError, TimeoutError) as error:
        raise RunError("the Dask scheduler is lost") from error


def _finished(client: Any, running: Iterable[Any]) -> Iterable[Any]:
    """Wait for futures to finish, and give those that have.

    Raises
    ------
    RunError
        If the scheduler is lost, or there has been no worker for `PATIENCE` seconds.
    """
    from distributed import wait

    seen, warned = time.monotonic(), False
    while True:
        try:
            done: Iterable[Any] = wait(
                list(running), timeout=_LOOK, return_when="FIRST_COMPLETED"
            ).done
            return done
        except TimeoutError:
            waited = time.monotonic() - seen
            if threads(client):
                seen, warned = time.monotonic(), False
            elif waited > TELL and not warned:
                warned = True
                warnings.warn(
                    f"the Dask cluster has no worker: waiting {PATIENCE:g} s for one", stacklevel=2
                )
            elif waited > PATIENCE:
                raise RunError(
                    f"the Dask cluster has had no worker for {PATIENCE:g} s: start some"
                ) from None
        except CancelledError as error:
            raise RunError("the Dask scheduler is lost") from error


def _result(future: Any) -> FinishedCells | None:
    """The finished cells of a batch, or None where its worker died.

    Raises
    ------
    RunError
        If the cluster failed in any other way.
    """
    from distributed import KilledWorker

    try:
        finished: FinishedCells = pickle.loads(future.result())
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
    return finished


def _alone(client: Any, task: Task, batch: Batch) -> FinishedCells:
    """Compute a suspect cell alone; if its worker dies again, the cell is recorded as lost."""
    (key,) = batch.keys
    for _ in range(_TRIES):
        _finished(client, [client.submit(abs, 0, pure=False)])  # a worker is there
        began = time.monotonic()
        future = client.submit(on_worker, sendable(task), packed(batch), pure=False)
        try:
            _finished(client, [future])
            finished = _result(future)
        finally:
            client.cancel([future])
        if finished is not None:
            return finished
        seconds = time.monotonic() - began
        if seconds > task.time_limit:
            text = (
                f"no answer within {task.time_limit:g} s of CPU time, or {WAITING:g} times as long "
                "on the clock; the worker's log shows where it was, and --time-limit (time_limit=) "
                "allows more"
            )
            outcome = Outcome(Status.TIME_LIMIT_SPENT, message=text)
            return [task.layout.finished(key, outcome, seconds)]
    text = (
        f"its worker died {_TRIES} times while it computed nothing else: a crash, or more memory "
        "than a worker may use"
    )
    return [task.layout.finished(key, Outcome(Status.WORKER_LOST, message=text), math.nan)]


def on_local_cluster(processes: int, log: Path | None) -> Mapper:
    """Compute on worker processes of this machine, started when the first cell is needed."""

    def mapper(task: Task, batches: Iterable[Batch]) -> Generator[FinishedCells]:
        with SharedProcesses(processes, log) as started:
            yield from started.mapper(task, batches)

    return mapper


class SharedProcesses(contextlib.ExitStack):
    """Worker processes of this machine for one run after the other: to start them takes seconds.
    They are started when the first cell is needed, and end where the context does.

    Parameters
    ----------
    processes : int
        How many.
    log : Path or None
        Where they write errors; a temporary file where no name is given.
    """

    def __init__(self, processes: int, log: Path | None) -> None:
        super().__init__()
        self._processes, self._log = processes, log
        self._started: Mapper | None = None

    def mapper(self, task: Task, batches: Iterable[Batch]) -> Generator[FinishedCells]:
        """Compute batches of cells there; see `cells.Mapper`."""
        if self._started is None:
            self._started = self._start()
        try:
            yield from self._started(task, batches)
        except RunError:
            self.close()
            self._started = None  # whoever comes next starts others
            raise

    def _start(self) -> Mapper:
        from rsfstudy.compute import worker_log

        file = self.enter_context(worker_log.kept(self._log))
        client = self.enter_context(local_cluster(self._processes, file))
        return on_client(client, str(file))
