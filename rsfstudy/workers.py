"""Where cells are computed: in this process, or on the workers of a Dask cluster."""

from __future__ import annotations

import contextlib
import logging
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import RunError
from rsfstudy.journal import Finished
from rsfstudy.measures import Measure, Outcome
from rsfstudy.scene import Scene
from rsfstudy.status import Status

_START_TIMEOUT = 60
#: Run by each worker process at its start: on Ctrl-C it is the driver that ends a run, and its
#: workers.
_IGNORE_INTERRUPTS = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"

Batch = Sequence[Scene]
#: Takes batches of scenes and yields, in any order, the number of a batch and its finished cells.
Mapper = Callable[[Measure, Accuracy, Sequence[Batch]], Iterator[tuple[int, list[Finished]]]]


def compute(measure: Measure, accuracy: Accuracy, scenes: Batch) -> list[Finished]:
    """Measure scenes one after the other; an exception becomes the outcome of its cell."""
    finished = []
    for scene in scenes:
        begin = time.perf_counter()
        try:
            outcome = measure(scene, accuracy)
        except Exception as error:
            outcome = Outcome(Status.CELL_RAISED, message=f"{type(error).__name__}: {error}")
        finished.append((outcome, time.perf_counter() - begin))
    return finished


def serial(
    measure: Measure, accuracy: Accuracy, batches: Sequence[Batch]
) -> Iterator[tuple[int, list[Finished]]]:
    """In this process, one cell after the other."""
    for number, batch in enumerate(batches):
        yield number, compute(measure, accuracy, batch)


def on_client(client: Any) -> Mapper:
    """On the workers of a Dask client.

    A worker that dies takes its whole batch with it. The cells of such a batch are sent again one
    by one, so that only the cell that kills its worker is blamed.
    """
    from distributed import as_completed

    def mapper(
        measure: Measure, accuracy: Accuracy, batches: Sequence[Batch]
    ) -> Iterator[tuple[int, list[Finished]]]:
        futures = {
            client.submit(compute, measure, accuracy, batch, pure=False): number
            for number, batch in enumerate(batches)
        }
        try:
            for future in as_completed(list(futures)):
                number = futures.pop(future)
                if future.status == "finished":
                    yield number, future.result()
                else:
                    _raise_unless_lost(future)
                    yield number, _one_by_one(client, measure, accuracy, batches[number])
        finally:
            client.cancel(list(futures))

    return mapper


def _one_by_one(client: Any, measure: Measure, accuracy: Accuracy, batch: Batch) -> list[Finished]:
    finished = []
    for scene in batch:
        future = client.submit(compute, measure, accuracy, [scene], pure=False)
        error = future.exception()
        if error is None:
            finished += future.result()
        else:
            _raise_unless_lost(future)
            lost = Outcome(Status.WORKER_LOST, message=f"{type(error).__name__}: {error}")
            finished.append((lost, math.nan))
    return finished


def _raise_unless_lost(future: Any) -> None:
    """A worker's death is a cell's failure; anything else is a failure of the cluster."""
    from distributed.scheduler import KilledWorker

    error = future.exception() if future.status == "error" else None
    if not isinstance(error, KilledWorker):
        raise RunError(f"the Dask cluster gave up: {error or future.status}")


def on_local_cluster(processes: int) -> Mapper:
    """On worker processes of this machine, started when there is something to compute."""

    def mapper(
        measure: Measure, accuracy: Accuracy, batches: Sequence[Batch]
    ) -> Iterator[tuple[int, list[Finished]]]:
        with local_cluster(processes) as client:
            yield from on_client(client)(measure, accuracy, batches)

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
def local_cluster(workers: int) -> Iterator[Any]:
    """A Dask client of worker processes on this machine, with one thread each."""
    import dask
    from distributed import Client, LocalCluster

    quiet = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.comm.timeouts.connect": f"{_START_TIMEOUT}s",
        "distributed.nanny.pre-spawn-environ": dict.fromkeys(
            ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
        ),
    }
    with _script_not_imported(), dask.config.set(quiet), contextlib.ExitStack() as stack:
        cluster = stack.enter_context(
            LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=":0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
                preload=[_IGNORE_INTERRUPTS],
            )
        )
        yield stack.enter_context(Client(cluster))


@contextlib.contextmanager
def existing_cluster(address: str, *, timeout: float = 10.0) -> Iterator[Any]:
    """A client of a Dask scheduler that is already running.

    Raises
    ------
    RunError
        If none answers at the address.
    """
    from distributed import Client

    try:
        client = Client(address, timeout=timeout)
    except (OSError, ValueError) as error:
        raise RunError(
            f"no Dask scheduler answers at {address}: {error}. "
            "Start one with `dask scheduler`, or leave --scheduler out."
        ) from error
    with client:
        yield client
