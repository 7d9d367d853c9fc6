"""Sends batches of cells to Dask workers, and finds a cell that kills its worker.

When a worker dies, its batch is lost, and perhaps others that were waiting there. All these cells
are then sent one at a time, while nothing else runs, so that only the cell that kills a worker on
its own is blamed.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import pickle
import time
import warnings
from collections.abc import Generator, Iterable
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.defaults import CELL_TIME_LIMIT
from rsfstudy.errors import InvalidValue, RunError
from rsfstudy.execution.cells import (
    WALL_TIME_FACTOR,
    CellMapper,
    CellRows,
    Task,
    compute_batch,
    compute_serially,
    pack_batch,
    serialize_task,
)
from rsfstudy.execution.clusters import check_main_guard, start_local_cluster
from rsfstudy.execution.plan import BatchIterator
from rsfstudy.measures import Outcome
from rsfstudy.status import Status

#: Longest time limit in s, three years; the system's timers take `WALL_TIME_FACTOR` times that, and
#: not much more.
_MAX_TIME_LIMIT = 1e8
#: Most worker processes for each core, and most on a machine with few cores.
_MAX_WORKERS_PER_CORE, _MAX_WORKERS_ON_SMALL_MACHINES = 4, 8
#: Time in s without any worker after which a run warns, and after which it ends.
WARN_AFTER, GIVE_UP_AFTER = 30.0, 600.0
_POLL_INTERVAL = 2.0
#: How often a cell may kill its worker before it is recorded as the culprit.
_MAX_WORKER_DEATHS = 2
_SCHEDULER_LOST = "the Dask scheduler is lost"


class Workers(contextlib.ExitStack):
    """A place where cells are computed, for one run after the other. Worker processes of this
    machine are started when the first cell is needed, which takes seconds, and end where the
    context does.

    Parameters
    ----------
    processes : int
        Worker processes started on this machine; with 0, cells are computed in this process.
    client : distributed.Client, optional
        A Dask cluster to use instead.
    time_limit : float
        CPU time in s that a cell may take on a worker.
    log : Path, optional
        Where processes of this machine write errors, whatever the run.

    Raises
    ------
    InvalidValue
        For what is none of these, and where worker processes would run the user's script again.
    """

    def __init__(
        self,
        processes: int = 2,
        client: Any = None,
        time_limit: float = CELL_TIME_LIMIT,
        log: Path | None = None,
    ) -> None:
        super().__init__()
        if not isinstance(processes, int) or isinstance(processes, bool) or processes < 0:
            raise InvalidValue("workers", processes, "must be a whole number, 0 or more")
        if client is None and processes > 0:
            most = max(
                _MAX_WORKERS_ON_SMALL_MACHINES, _MAX_WORKERS_PER_CORE * (os.cpu_count() or 1)
            )
            if processes > most:
                rule = (
                    f"must be at most {most} here: {_MAX_WORKERS_PER_CORE} for each core, "
                    f"or {_MAX_WORKERS_ON_SMALL_MACHINES}"
                )
                remedy = "A cluster has room for more: --scheduler ADDRESS (client=)."
                raise InvalidValue("workers", processes, rule, remedy=remedy)
            check_main_guard(processes)
        if client is not None and not hasattr(client, "submit"):
            raise InvalidValue("client", client, "must be a distributed.Client")
        limit: object = time_limit
        if not isinstance(limit, int | float) or not 0.0 < limit <= _MAX_TIME_LIMIT:
            rule = f"must be a number greater than 0, up to {_MAX_TIME_LIMIT:g} s"
            raise InvalidValue("time_limit", limit, rule)
        self.processes, self.client, self.time_limit, self._log_path = (
            processes,
            client,
            time_limit,
            log,
        )
        self._started_mapper: CellMapper | None = None

    def count_concurrent_cells(self) -> int:
        """Number of cells that are computed at the same time."""
        return max(1, self.processes if self.client is None else count_worker_threads(self.client))

    def cell_mapper(self, log: Path | None = None) -> CellMapper:
        """Mapper that computes batches of cells there; `log` is where processes of this machine
        write errors, unless all runs have one file.
        """
        if self.client is not None:
            return make_client_mapper(self.client)
        return (
            functools.partial(self._map_on_processes, self._log_path or log)
            if self.processes
            else compute_serially
        )

    def _map_on_processes(
        self, log: Path | None, task: Task, batches: BatchIterator
    ) -> Generator[CellRows]:
        from rsfstudy.execution import worker_log

        try:
            if self._started_mapper is None:
                file = self.enter_context(worker_log.open_worker_log(log))
                client = self.enter_context(start_local_cluster(self.processes, file))
                self._started_mapper = make_client_mapper(client, str(file))
            yield from self._started_mapper(task, batches)
        except RunError:
            self.close()
            self._started_mapper = None  # whoever comes next starts others
            raise


def make_client_mapper(client: Any, log: str = "the log of that worker") -> CellMapper:
    """Compute on the workers of a Dask client, which need no shared file system.

    Parameters
    ----------
    client : distributed.Client
    log : str
        Where workers write errors, for messages.
    """

    def map_cells(task: Task, batches: BatchIterator) -> Generator[CellRows]:
        sent, plan = serialize_task(task), batches.plan
        left: list[np.ndarray] = []  # of batches that a worker returned before their end
        running: dict[Any, np.ndarray] = {}
        suspects: list[np.ndarray] = []

        def submit(cells: np.ndarray) -> Any:
            future = client.submit(compute_batch, sent, pack_batch(plan, cells), pure=False)
            running[future] = cells
            return future

        def run_isolated(cell: np.ndarray) -> CellRows:
            """Compute a suspect alone; if its worker dies again, the cell is recorded as lost."""
            (key,) = plan.keys[cell].tolist()
            for _ in range(_MAX_WORKER_DEATHS):
                _wait_for_any(client, [client.submit(abs, 0, pure=False)])  # a worker is there
                began = time.monotonic()
                _wait_for_any(client, [future := submit(cell)])
                del running[future]
                if (finished := _batch_result(future)) is not None:
                    return finished
                if (seconds := time.monotonic() - began) > task.time_limit:
                    return [task.packing.pack_cell(key, _timeout_outcome(task), seconds)]
            return [task.packing.pack_cell(key, _worker_lost_outcome(), math.nan)]

        try:
            while True:
                # no more than keeps the workers busy: the rest would fill the scheduler's memory
                for _ in range(
                    0 if suspects else 4 + 2 * count_worker_threads(client) - len(running)
                ):
                    some = left.pop() if left else next(batches, None)
                    if some is None:
                        break
                    submit(some)
                if running:
                    for future in _wait_for_any(client, running):
                        cells = running.pop(future)
                        finished = _batch_result(future)
                        if finished is None:
                            suspects += np.split(cells, len(cells))
                        else:
                            if len(finished) < len(cells):
                                left.append(cells[len(finished) :])
                            yield finished
                elif suspects:
                    warnings.warn(
                        f"a worker ended: the cells it held ({len(suspects)}) are computed again, "
                        f"one at a time (see {log})",
                        stacklevel=2,
                    )
                    yield from map(run_isolated, suspects)
                    suspects = []
                else:
                    return
        finally:
            client.cancel(list(running))

    return map_cells


def _timeout_outcome(task: Task) -> Outcome:
    """The outcome of a cell that took too long."""
    text = (
        f"no answer within {task.time_limit:g} s of CPU time, or {WALL_TIME_FACTOR:g} times "
        "as long on the clock; the worker's log shows where it was, and --time-limit (time_limit=) "
        "allows more"
    )
    return Outcome(Status.TIME_LIMIT_SPENT, message=text)


def _worker_lost_outcome() -> Outcome:
    """The outcome of a cell that killed its worker."""
    text = (
        f"its worker died {_MAX_WORKER_DEATHS} times while it computed nothing else: a crash, "
        "or more memory than a worker may use"
    )
    return Outcome(Status.WORKER_LOST, message=text)


def count_worker_threads(client: Any) -> int:
    """Number of cells that the workers of a client compute at the same time."""
    if client.status == "connecting":  # again
        raise RunError(_SCHEDULER_LOST)
    if client.status != "running":
        raise RunError(f"the Dask client is {client.status}: connect one to a cluster")
    try:
        return sum(client.nthreads().values())
    except (OSError, TimeoutError) as error:
        raise RunError(_SCHEDULER_LOST) from error


def _wait_for_any(client: Any, running: Iterable[Any]) -> Iterable[Any]:
    """Wait for futures to finish, and give those that have.

    Raises
    ------
    RunError
        If the scheduler is lost, or there has been no worker for `GIVE_UP_AFTER` seconds.
    """
    from distributed import wait

    seen, warned = time.monotonic(), False
    while True:
        try:
            done: Iterable[Any] = wait(
                list(running), timeout=_POLL_INTERVAL, return_when="FIRST_COMPLETED"
            ).done
            return done
        except TimeoutError:
            waited = time.monotonic() - seen
            if count_worker_threads(client):
                seen, warned = time.monotonic(), False
            elif waited > WARN_AFTER and not warned:
                warned = True
                warnings.warn(
                    f"the Dask cluster has no worker: waiting {GIVE_UP_AFTER:g} s for one",
                    stacklevel=2,
                )
            elif waited > GIVE_UP_AFTER:
                raise RunError(
                    f"the Dask cluster has had no worker for {GIVE_UP_AFTER:g} s: start some"
                ) from None
        except CancelledError as error:
            raise RunError(_SCHEDULER_LOST) from error


def _batch_result(future: Any) -> CellRows | None:
    """The finished cells of a batch, or None where its worker died.

    Raises
    ------
    RunError
        If the cluster failed in any other way.
    """
    from distributed import KilledWorker

    try:
        finished: CellRows = pickle.loads(future.result())
    except KilledWorker:
        return None
    except RunError:
        raise
    except CancelledError as error:
        raise RunError(_SCHEDULER_LOST) from error
    except Exception as error:
        raise RunError(
            f"the Dask cluster gave up ({type(error).__name__}: {error}). "
            "Its workers need the same rsfstudy"
        ) from error
    return finished
