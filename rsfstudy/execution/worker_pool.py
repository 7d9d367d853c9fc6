"""Pool of Dask workers that compute cells.

``WorkerPool`` starts worker processes on this machine, or uses a Dask cluster. If a worker dies,
its current batch is lost. Batches that were waiting for the same worker may also be lost. The pool
computes the lost cells again, one at a time, while no other cell is running. A cell is therefore
recorded as lost only if its own computation kills a worker.
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

from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue, RunError
from rsfstudy.execution.cell_computation import (
    WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT,
    CellBatchMapper,
    CellJournalRows,
    SharedCellSettings,
    compute_cell_batches_serially,
    compute_packed_cell_batch,
    pack_cell_batch,
    serialize_cell_settings,
)
from rsfstudy.execution.cell_plan import CellBatchIterator
from rsfstudy.execution.dask_clusters import check_script_has_main_guard, start_local_cluster
from rsfstudy.measures import Outcome
from rsfstudy.status import Status

#: Largest allowed time limit of a cell in s, about three years. The wall time limit is
#: ``WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT`` times this value, which is just below the largest value
#: that the timers of the operating system accept.
_MAX_CELL_TIME_LIMIT = 1e8
#: Maximum number of worker processes per core, and maximum number of worker processes on a machine
#: with one or two cores.
_MAX_WORKERS_PER_CORE, _MAX_WORKERS_ON_SMALL_MACHINES = 4, 8
#: Times in s that a run waits for a worker. After the first time without a worker, the run issues a
#: warning. After the second time, the run ends.
WARN_AFTER_SECONDS_WITHOUT_WORKER, GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER = 30.0, 600.0
_SECONDS_BETWEEN_FUTURE_POLLS = 2.0
#: Number of workers that a cell may kill. After this number of workers, the cell is recorded as
#: lost.
_MAX_WORKER_DEATHS_PER_CELL = 2
_SCHEDULER_LOST_MESSAGE = "the connection to the Dask scheduler is lost"


class WorkerPool(contextlib.ExitStack):
    """Pool of workers that compute the cells of one or more runs.

    Use the pool as a context manager. Local worker processes are started when the first cell is
    computed. Starting the processes takes a few seconds. The processes end at the end of the
    ``with`` block.

    Parameters
    ----------
    process_count : int, default: 2
        Number of worker processes on this machine. If 0, cells are computed in this process.
    dask_client : distributed.Client, optional
        Client of a Dask cluster. If a client is passed, the cells are computed on the cluster, and
        no local worker processes are started.
    cell_time_limit : float, optional
        CPU time in s that a cell may use on a worker. The default is ``CELL_CPU_TIME_LIMIT``.
    log_path : Path, optional
        File to which the local worker processes write errors. If this argument is passed, all runs
        use this log file. By default, each run has its own log file.

    Raises
    ------
    InvalidValue
        If an argument is invalid, or if worker processes would run the script of the user again.
    """

    def __init__(
        self,
        process_count: int = 2,
        dask_client: Any = None,
        cell_time_limit: float = Defaults.CELL_CPU_TIME_LIMIT,
        log_path: Path | None = None,
    ) -> None:
        super().__init__()
        if (
            not isinstance(process_count, int)
            or isinstance(process_count, bool)
            or process_count < 0
        ):
            raise InvalidValue("workers", process_count, "must be a whole number, 0 or more")
        if dask_client is None and process_count > 0:
            most = max(
                _MAX_WORKERS_ON_SMALL_MACHINES, _MAX_WORKERS_PER_CORE * (os.cpu_count() or 1)
            )
            if process_count > most:
                rule = (
                    f"must be at most {most} on this machine ({_MAX_WORKERS_PER_CORE} per core, "
                    f"but at least {_MAX_WORKERS_ON_SMALL_MACHINES})"
                )
                remedy = "To use more workers, use a cluster: --scheduler ADDRESS (client=)."
                raise InvalidValue("workers", process_count, rule, remedy=remedy)
            check_script_has_main_guard(process_count)
        if dask_client is not None and not hasattr(dask_client, "submit"):
            raise InvalidValue("client", dask_client, "must be a distributed.Client")
        limit: object = cell_time_limit
        if not isinstance(limit, int | float) or not 0.0 < limit <= _MAX_CELL_TIME_LIMIT:
            rule = f"must be a number greater than 0 and at most {_MAX_CELL_TIME_LIMIT:g} s"
            raise InvalidValue("time_limit", limit, rule)
        self.process_count, self.client, self.cell_time_limit, self._log_path = (
            process_count,
            dask_client,
            cell_time_limit,
            log_path,
        )
        self._mapper_of_started_processes: CellBatchMapper | None = None

    def count_concurrent_cells(self) -> int:
        """Return the number of cells that are computed at the same time.

        Returns
        -------
        int
            Number of cells.

        Raises
        ------
        RunError
            If the Dask cluster is not available.
        """
        return max(
            1, self.process_count if self.client is None else count_worker_threads(self.client)
        )

    def make_cell_batch_mapper(self, log_path: Path | None = None) -> CellBatchMapper:
        """Create a function that computes batches of cells on the workers.

        Parameters
        ----------
        log_path : Path, optional
            File to which the local worker processes write errors. The argument is ignored if the
            pool was created with its own log file.

        Returns
        -------
        callable
            Function that takes a ``SharedCellSettings`` and a ``CellBatchIterator``, and yields
            finished cells.
        """
        if self.client is not None:
            return make_dask_batch_mapper(self.client)
        return (
            functools.partial(self._compute_batches_on_processes, self._log_path or log_path)
            if self.process_count
            else compute_cell_batches_serially
        )

    def _compute_batches_on_processes(
        self, log_path: Path | None, cell_settings: SharedCellSettings, batches: CellBatchIterator
    ) -> Generator[CellJournalRows]:
        """Compute batches on local worker processes, and start the processes if necessary."""
        from rsfstudy.execution import worker_log

        try:
            if self._mapper_of_started_processes is None:
                file = self.enter_context(worker_log.open_worker_log(log_path))
                client = self.enter_context(start_local_cluster(self.process_count, file))
                self._mapper_of_started_processes = make_dask_batch_mapper(client, str(file))
            yield from self._mapper_of_started_processes(cell_settings, batches)
        except RunError:
            self.close()
            self._mapper_of_started_processes = None  # The next run starts new processes.
            raise


def make_dask_batch_mapper(
    dask_client: Any, log_path: str = "the log of that worker"
) -> CellBatchMapper:
    """Create a function that computes batches of cells on a Dask cluster.

    The workers do not need a shared file system.

    Parameters
    ----------
    dask_client : distributed.Client
        Client of the cluster.
    log_path : str, optional
        File to which the workers write errors. Messages about lost workers contain the path of this
        file.

    Returns
    -------
    callable
        Function that takes a ``SharedCellSettings`` and a ``CellBatchIterator``, and yields
        finished cells.
    """

    def map_cells(
        cell_settings: SharedCellSettings, batches: CellBatchIterator
    ) -> Generator[CellJournalRows]:
        sent, plan = serialize_cell_settings(cell_settings), batches.plan
        # These cells are the remainders of batches that a worker returned early.
        left: list[np.ndarray] = []
        running: dict[Any, np.ndarray] = {}
        suspects: list[np.ndarray] = []

        def submit(cells: np.ndarray) -> Any:
            future = dask_client.submit(
                compute_packed_cell_batch, sent, pack_cell_batch(plan, cells), pure=False
            )
            running[future] = cells
            return future

        def run_isolated(cell: np.ndarray) -> CellJournalRows:
            """Compute a cell that may have killed its worker, without other cells in parallel.

            If the cell kills its worker repeatedly, the cell is recorded as lost.
            """
            (key,) = plan.keys[cell].tolist()
            for _ in range(_MAX_WORKER_DEATHS_PER_CELL):
                _wait_for_finished_futures(
                    dask_client, [dask_client.submit(abs, 0, pure=False)]
                )  # The call blocks until a worker is available.
                began = time.monotonic()
                _wait_for_finished_futures(dask_client, [future := submit(cell)])
                del running[future]
                if (finished := _load_finished_cells_of_batch(future)) is not None:
                    return finished
                if (seconds := time.monotonic() - began) > cell_settings.cell_cpu_time_limit:
                    return [
                        cell_settings.output_packer.pack_journal_row(
                            key, _make_outcome_of_exceeded_time_limit(cell_settings), seconds
                        )
                    ]
            return [
                cell_settings.output_packer.pack_journal_row(
                    key, _make_outcome_of_lost_worker(), math.nan
                )
            ]

        try:
            while True:
                # More batches than the workers need would fill the memory of the scheduler.
                for _ in range(
                    0 if suspects else 4 + 2 * count_worker_threads(dask_client) - len(running)
                ):
                    some = left.pop() if left else next(batches, None)
                    if some is None:
                        break
                    submit(some)
                if running:
                    for future in _wait_for_finished_futures(dask_client, running):
                        cells = running.pop(future)
                        finished = _load_finished_cells_of_batch(future)
                        if finished is None:
                            suspects += np.split(cells, len(cells))
                        else:
                            if len(finished) < len(cells):
                                left.append(cells[len(finished) :])
                            yield finished
                elif suspects:
                    warnings.warn(
                        f"a worker process ended unexpectedly. Its {len(suspects)} cells are "
                        f"recomputed one at a time. See the log {log_path}.",
                        stacklevel=2,
                    )
                    yield from map(run_isolated, suspects)
                    suspects = []
                else:
                    return
        finally:
            with contextlib.suppress(RuntimeError):  # Without an event loop, no batch is running.
                dask_client.cancel(list(running))

    return map_cells


def _make_outcome_of_exceeded_time_limit(cell_settings: SharedCellSettings) -> Outcome:
    """Build the outcome of a cell that exceeded its time limit."""
    text = (
        f"the cell exceeded {cell_settings.cell_cpu_time_limit:g} s of CPU time, or "
        f"{WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT:g} times as much wall time. The worker log "
        "contains a stack trace. Increase the limit with --time-limit (time_limit=)"
    )
    return Outcome(Status.TIME_LIMIT_SPENT, message=text)


def _make_outcome_of_lost_worker() -> Outcome:
    """Build the outcome of a cell whose worker died."""
    text = (
        f"the worker process ended {_MAX_WORKER_DEATHS_PER_CELL} times while computing only "
        "this cell, because the process crashed or needed too much memory"
    )
    return Outcome(Status.WORKER_LOST, message=text)


def count_worker_threads(dask_client: Any) -> int:
    """Count the threads of the workers of a Dask client.

    Each thread computes one cell at a time.

    Parameters
    ----------
    dask_client : distributed.Client
        Client of the cluster.

    Returns
    -------
    int
        Number of threads.

    Raises
    ------
    RunError
        If the client has lost its scheduler, or is not running.
    """
    if dask_client.status == "connecting":  # The client has lost the connection to the scheduler.
        raise RunError(_SCHEDULER_LOST_MESSAGE)
    if dask_client.status != "running":
        raise RunError(f"the Dask client is {dask_client.status}. Connect a client to a cluster")
    try:
        return sum(dask_client.nthreads().values())
    except (OSError, TimeoutError, RuntimeError) as error:  # The event loop may have ended.
        raise RunError(_SCHEDULER_LOST_MESSAGE) from error


def _wait_for_finished_futures(dask_client: Any, running_futures: Iterable[Any]) -> Iterable[Any]:
    """Wait until at least one future is finished, and return all finished futures.

    Raises
    ------
    RunError
        If the scheduler is lost, or if there is no worker for
        ``GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER`` seconds.
    """
    from distributed import wait

    seen, warned = time.monotonic(), False
    while True:
        try:
            done: Iterable[Any] = wait(
                list(running_futures),
                timeout=_SECONDS_BETWEEN_FUTURE_POLLS,
                return_when="FIRST_COMPLETED",
            ).done
            return done
        except TimeoutError:
            waited = time.monotonic() - seen
            if count_worker_threads(dask_client):
                seen, warned = time.monotonic(), False
            elif waited > WARN_AFTER_SECONDS_WITHOUT_WORKER and not warned:
                warned = True
                warnings.warn(
                    "the Dask cluster has no worker. The run will end if no worker connects "
                    f"within {GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER:g} s.",
                    stacklevel=2,
                )
            elif waited > GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER:
                raise RunError(
                    "the Dask cluster has had no worker for "
                    f"{GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER:g} s. Start workers"
                ) from None
        except (CancelledError, RuntimeError) as error:  # The event loop may have ended.
            raise RunError(_SCHEDULER_LOST_MESSAGE) from error


def _load_finished_cells_of_batch(future: Any) -> CellJournalRows | None:
    """Return the finished cells of a batch, or None if its worker died.

    Raises
    ------
    RunError
        If the batch failed for a reason other than the death of its worker.
    """
    from distributed import KilledWorker

    try:
        finished: CellJournalRows = pickle.loads(future.result())
    except KilledWorker:
        return None
    except RunError:
        raise
    except CancelledError as error:
        raise RunError(_SCHEDULER_LOST_MESSAGE) from error
    except Exception as error:
        raise RunError(
            f"the Dask cluster failed ({type(error).__name__}: {error}). Install the same version "
            "of rsfstudy on its workers"
        ) from error
    return finished
