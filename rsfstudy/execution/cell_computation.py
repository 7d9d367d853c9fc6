"""Computes cells one after the other; a cell that fails becomes an outcome as well."""

from __future__ import annotations

import contextlib
import faulthandler
import functools
import importlib
import pickle
import signal
import threading
import time
import traceback
import uuid
import zlib
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import cloudpickle
import numpy as np

from rsfstudy.defaults import CELL_TIME_LIMIT
from rsfstudy.errors import InvalidValue, RunError, shorten_text
from rsfstudy.execution import provenance
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion import Accuracy, compilation_log, register_user_steppers
from rsfstudy.slider import Scene, UserPart, register_user_parts
from rsfstudy.status import Status
from rsfstudy.storage import OutputPacking, StoredCellRow
from rsfstudy.study import STUDIES_PACKAGE, Cell, CellChanges

if TYPE_CHECKING:
    from rsfstudy.execution.cell_plan import CellBatchIterator, CellPlan

#: Wall time that a cell may take, over its limit of CPU time: for cells that sleep or wait.
WALL_OVER_CPU_TIME_LIMIT = 10.0
#: Seconds after which finished cells are handed over; the disk may take 30 ms to keep them.
_FINISHED_CELLS_HANDOVER_INTERVAL = 0.5
#: Identifies this process.
_PROCESS_ID = uuid.uuid4().hex
#: CPU time that Dask itself may use on a worker, over that of the cells.
_DASK_CPU_TIME_OVER_CELL_TIME = 0.25
#: Characters of a message that are kept.
_MAX_MESSAGE_LENGTH = 2000

StoredCellRows = list[StoredCellRow]


@dataclass(frozen=True)
class CellTask:
    """Scene, measure, accuracy and conditions that every cell is computed with.

    Parameters
    ----------
    base_scene : Scene
        Each cell says what it changes of its fields.
    measure : Measure
        Each cell says what it changes of its fields.
    accuracy : Accuracy
    time_limit : float
        CPU time in s a cell may take on a worker. Nothing bounds it in the user's own process.
    user_parts, user_stepper_classes : tuple of type
        Parts of the slider, and a stepper, that are the user's own.
    code_fingerprint : mapping
        Versions, and digests of code, that decide a number: every worker must have the same.
    origin_process_id : str
        The process that made the task.
    """

    base_scene: Scene
    measure: Measure
    accuracy: Accuracy
    time_limit: float = CELL_TIME_LIMIT
    user_parts: tuple[UserPart, ...] = ()
    user_stepper_classes: tuple[type, ...] = ()
    code_fingerprint: Mapping[str, str] = field(default_factory=dict)
    origin_process_id: str = _PROCESS_ID

    @functools.cached_property
    def output_packing(self) -> OutputPacking:
        """Places of the numbers of a cell."""
        return OutputPacking(self.measure)


#: Takes a task and batches, and yields the finished cells, in any order.
CellBatchMapper = Callable[[CellTask, "CellBatchIterator"], Generator[StoredCellRows]]


def compute_serially(task: CellTask, batches: CellBatchIterator) -> Generator[StoredCellRows]:
    """Compute in this process, one cell after the other. Finished cells are handed over in groups,
    because recording each on its own may cost more than computing it: each group is as large as all
    before it, unless it takes too long.
    """
    finished: StoredCellRows = []
    handed_over, since = 0, time.monotonic()
    for key, changes in (cell for some in batches for cell in batches.plan.select_cells(some)):
        cell = changes.build_cell(task.base_scene)
        outcome, seconds = compute_cell(task, cell, propagated_exceptions=(KeyboardInterrupt,))
        finished.append(task.output_packing.pack_cell(key, outcome, seconds))
        if (
            len(finished) >= max(1, handed_over)
            or time.monotonic() - since > _FINISHED_CELLS_HANDOVER_INTERVAL
        ):
            yield finished
            handed_over += len(finished)
            finished, since = [], time.monotonic()
    yield finished


def serialize_task(task: CellTask) -> bytes:
    """A task as bytes, with all the code that workers cannot import, and that of named studies, to
    import which would load all that declares and reduces them.

    Raises
    ------
    InvalidValue
        Where the measure, a part of the slider or a stepper cannot be serialized.
    """
    cloudpickle.register_pickle_by_value(importlib.import_module(STUDIES_PACKAGE))
    each: list[tuple[str, str, object]] = [("part", part.name, part) for part in task.user_parts]
    each += [("engine", task.accuracy.engine, stepper) for stepper in task.user_stepper_classes]
    for what, name, value in (*each, ("measure", task.measure.name, task)):
        try:
            sent = cloudpickle.dumps(value)
        except Exception as error:
            rule = f"cannot be sent to a worker ({error})"
            remedy = "Compute in this process: --serial (workers=0)."
            raise InvalidValue(what, name, rule, remedy=remedy) from error
    return bytes(sent)


@functools.lru_cache(maxsize=4)
def _load_cell_task(serialized_task: bytes) -> CellTask:
    """The task, in a worker process, which must run the same code as the process that sent it.

    Raises
    ------
    RunError
        Where the worker runs other code.
    """
    try:
        task: CellTask = cloudpickle.loads(serialized_task)
    except Exception as error:
        raise RunError(
            f"a worker cannot load the measure, or a part ({type(error).__name__}: {error}). Give "
            "the workers the files it needs, or put them beside the study file"
        ) from error
    used = *task.measure.code_classes, *task.user_parts, *task.user_stepper_classes
    ours = provenance.code_fingerprint(task.accuracy.engine, used)
    for name, wanted in task.code_fingerprint.items():
        if ours.get(name) != wanted:
            raise RunError(
                f"a worker has {name} {ours.get(name)}, this run {wanted}: their numbers would "
                "mix. Give the workers the same versions and files, and start them again"
            )
    return task


def pack_cell_batch(plan: CellPlan, cell_numbers: np.ndarray) -> bytes:
    """Cells of a plan in as few bytes as possible, because Dask's scheduler keeps what it has
    passed on. Parts of the user's own are sent by their names; a worker has them from the task.
    """
    cells = [
        (key, {n: getattr(v, "name", v) for n, v in of_scene.items()}, of_measure)
        for key, (of_scene, of_measure) in plan.select_cells(cell_numbers)
    ]
    return zlib.compress(pickle.dumps(cells), level=1)


def compute_batch(serialized_task: bytes, packed_batch: bytes) -> bytes:
    """Compute a packed batch in a worker process; a cell over its time limit ends the process.

    Returns
    -------
    bytes
        Its first cells: those that were finished when it was time to hand them over. They are
        pickled here, because Dask would serialize each value of a list on its own.

    Raises
    ------
    RunError
        Where the worker cannot load the task, or runs other code than the sender.
    """
    task = _load_cell_task(serialized_task)
    finished: StoredCellRows = []
    began = time.monotonic()
    ours = (
        task.origin_process_id == _PROCESS_ID
    )  # a worker may be a thread of the user's own process
    if not ours:
        compilation_log.context_while_compiling = _cpu_time_limits.suspend_temporarily
    with (
        contextlib.nullcontext()
        if ours
        else _cpu_time_limits.enforce_in_this_thread(task.time_limit)
    ):
        register_user_parts(task.user_parts)
        register_user_steppers(task.user_stepper_classes)
        for key, *changes in pickle.loads(zlib.decompress(packed_batch)):
            cell = CellChanges(*changes).build_cell(task.base_scene)
            finished.append(task.output_packing.pack_cell(key, *compute_cell(task, cell)))
            if time.monotonic() - began > _FINISHED_CELLS_HANDOVER_INTERVAL:
                break
    return pickle.dumps(finished)


def compute_cell(
    task: CellTask, cell: Cell, propagated_exceptions: tuple[type[BaseException], ...] = ()
) -> tuple[Outcome, float]:
    """The outcome of one cell, and its wall time in s, without that of compiling; an exception is
    an outcome too.
    """
    begin = time.perf_counter() - compilation_log.total_compilation_seconds
    try:
        outcome = task.measure.with_(**cell.measure_changes)(cell.scene, task.accuracy)
    except propagated_exceptions:
        raise
    except BaseException as error:  # a cell may raise SystemExit or CancelledError too
        # not str(error), which may raise as well
        text = traceback.format_exception_only(error)[-1].strip()
        outcome = Outcome(Status.CELL_RAISED, message=text)
    if outcome.message:
        outcome = replace(outcome, message=_shorten_message_for_storage(outcome.message))
    return outcome, time.perf_counter() - compilation_log.total_compilation_seconds - begin


def _shorten_message_for_storage(message: str) -> str:
    """A message as a file can hold it."""
    text = shorten_text(message, _MAX_MESSAGE_LENGTH).encode(errors="backslashreplace").decode()
    return text.replace("\0", "\\0")


class _CpuTimeLimits:
    """Has the operating system end this process when a thread takes too long over a cell.

    CPU time is limited, because a slow or busy machine takes longer for the same computation. The
    system counts it for the whole process, so the limit is multiplied by the number of threads that
    compute. The system acts even while a cell holds the interpreter's lock. The limit is set once
    for each batch: all cells but the last take no longer than `_HAND_OVER_INTERVAL` together.
    """

    def __init__(self) -> None:
        self._active_threads, self._process_cpu_limit = 0, 0.0
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def enforce_in_this_thread(self, seconds: float) -> Iterator[None]:
        """Allow this thread so many seconds of CPU time for a cell of a batch."""
        self._update_threads_and_timers(1, seconds)
        try:
            yield
        finally:
            self._update_threads_and_timers(-1, seconds)

    def _update_threads_and_timers(self, thread_ids: int, seconds: float) -> None:
        with self._lock:
            self._active_threads += thread_ids
            self._process_cpu_limit = self._active_threads * seconds
            self._set_timers(self._process_cpu_limit)

    @contextlib.contextmanager
    def suspend_temporarily(self) -> Iterator[None]:
        """No limit for a while; it starts anew afterwards."""
        self._set_timers(0.0)
        try:
            yield
        finally:
            self._set_timers(self._process_cpu_limit)

    @staticmethod
    def _set_timers(seconds: float) -> None:
        """Set the limit, or none for 0 s. Beyond it, the worker's log shows each thread."""
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if seconds:
            faulthandler.dump_traceback_later(
                WALL_OVER_CPU_TIME_LIMIT * seconds + _FINISHED_CELLS_HANDOVER_INTERVAL, exit=True
            )
            faulthandler.register(signal.SIGPROF, chain=True)  # which then ends the process
            signal.setitimer(
                signal.ITIMER_PROF,
                (1.0 + _DASK_CPU_TIME_OVER_CELL_TIME) * seconds + _FINISHED_CELLS_HANDOVER_INTERVAL,
            )


_cpu_time_limits = _CpuTimeLimits()
