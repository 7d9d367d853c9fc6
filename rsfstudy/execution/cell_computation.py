"""Functions that compute cells, in this process or in a worker process.

``compute_cell`` computes a single cell. If the computation of a cell raises an exception, the
exception is recorded as the outcome of the cell. ``compute_cell_batches_serially`` computes all
cells in this process, and ``compute_packed_cell_batch`` computes a batch of cells in a worker
process.
"""

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

from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue, RunError, shorten_text
from rsfstudy.execution import provenance
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion import Accuracy, Engine
from rsfstudy.slider import Scene, SceneFields, UserPart
from rsfstudy.status import Status
from rsfstudy.storage import CellJournalRow, CellOutputPacker
from rsfstudy.study import NAMED_STUDIES_PACKAGE, Cell, CellFieldChanges

if TYPE_CHECKING:
    from rsfstudy.execution.cell_plan import CellBatchIterator, CellPlan

#: Ratio of the wall time limit of a cell to its CPU time limit. The wall time limit is needed
#: because a cell that sleeps or waits uses no CPU time.
WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT = 10.0
#: Time in s between two transfers of finished cells to the journal. The cells are not transferred
#: one by one, because each write to the disk may take 30 ms.
_SECONDS_BETWEEN_JOURNAL_TRANSFERS = 0.5
#: Unique identifier of this process.
_UNIQUE_PROCESS_ID = uuid.uuid4().hex
#: CPU time that Dask itself may use on a worker, as a fraction of the CPU time limit of a cell.
_DASK_CPU_TIME_OVER_CELL_TIME_LIMIT = 0.25
#: Maximum length of a message in the journal, in characters.
_MAX_STORED_MESSAGE_LENGTH = 2000

CellJournalRows = list[CellJournalRow]


@dataclass(frozen=True)
class SharedCellSettings:
    """Settings that all cells of a run have in common.

    Parameters
    ----------
    base_scene : Scene
        Scene of the study. Each cell changes some fields of the base scene.
    measure : Measure
        Measure of the study. Each cell may change some fields of the measure.
    accuracy : Accuracy
        Accuracy of each cell.
    cell_cpu_time_limit : float, optional
        CPU time in s that a cell may use on a worker. The default is ``CELL_CPU_TIME_LIMIT``. If
        cells are computed in the process of the user, their CPU time is not limited.
    user_parts : tuple of UserPart, default: ()
        User-defined parts of the slider.
    user_stepper_classes : tuple of type, default: ()
        Class of the user-defined stepper. If the run uses a built-in stepper, the tuple is empty.
    code_fingerprint : mapping of str to str, optional
        Versions and code digests that affect the results. The versions and code digests of each
        worker must be equal to these values.
    origin_process_id : str, optional
        Identifier of the process that created the settings.
    """

    base_scene: Scene
    measure: Measure
    accuracy: Accuracy
    cell_cpu_time_limit: float = Defaults.CELL_CPU_TIME_LIMIT
    user_parts: tuple[UserPart, ...] = ()
    user_stepper_classes: tuple[type, ...] = ()
    code_fingerprint: Mapping[str, str] = field(default_factory=dict)
    origin_process_id: str = _UNIQUE_PROCESS_ID

    @functools.cached_property
    def output_packer(self) -> CellOutputPacker:
        """Object that converts the outputs of a cell to a row of the journal."""
        return CellOutputPacker(self.measure)


#: Type of the functions that compute cells. Such a function takes the settings of the cells
#: and an iterator of batches, and yields lists of finished cells in any order.
CellBatchMapper = Callable[[SharedCellSettings, "CellBatchIterator"], Generator[CellJournalRows]]


def compute_cell_batches_serially(
    cell_settings: SharedCellSettings, batches: CellBatchIterator
) -> Generator[CellJournalRows]:
    """Compute cells one after the other in this process.

    Finished cells are yielded in groups, because writing a single cell to the journal may take
    longer than computing the cell. The groups contain 1, 1, 2, 4, 8, ... cells. If the computation
    of a group takes longer than 0.5 s, the group ends early.

    Parameters
    ----------
    cell_settings : SharedCellSettings
        Scene, measure and accuracy of the cells.
    batches : CellBatchIterator
        Batches of cells to compute.

    Yields
    ------
    list of CellJournalRow
        Finished cells.
    """
    finished: CellJournalRows = []
    handed_over, since = 0, time.monotonic()
    for key, changes in (
        cell for some in batches for cell in batches.plan.iterate_keys_and_field_changes(some)
    ):
        cell = changes.build_cell(cell_settings.base_scene)
        outcome, seconds = compute_cell(
            cell_settings, cell, propagated_exceptions=(KeyboardInterrupt,)
        )
        finished.append(cell_settings.output_packer.pack_journal_row(key, outcome, seconds))
        if (
            len(finished) >= max(1, handed_over)
            or time.monotonic() - since > _SECONDS_BETWEEN_JOURNAL_TRANSFERS
        ):
            yield finished
            handed_over += len(finished)
            finished, since = [], time.monotonic()
    yield finished


def serialize_cell_settings(cell_settings: SharedCellSettings) -> bytes:
    """Serialise the settings of the cells for the workers.

    The result includes the code that workers cannot import. The result also includes the code of
    the modules of named studies. If workers imported these modules instead, all modules that are
    needed to declare and reduce studies would also be loaded.

    Parameters
    ----------
    cell_settings : SharedCellSettings
        Settings to serialise.

    Returns
    -------
    bytes
        Serialised settings.

    Raises
    ------
    InvalidValue
        If the measure, a part of the slider or a stepper cannot be serialised.
    """
    cloudpickle.register_pickle_by_value(importlib.import_module(NAMED_STUDIES_PACKAGE))
    each: list[tuple[str, str, object]] = [
        ("part", part.name, part) for part in cell_settings.user_parts
    ]
    each += [
        ("engine", cell_settings.accuracy.engine, stepper)
        for stepper in cell_settings.user_stepper_classes
    ]
    for what, name, value in (*each, ("measure", cell_settings.measure.name, cell_settings)):
        try:
            sent = cloudpickle.dumps(value)
        except Exception as error:
            rule = f"cannot be sent to a worker ({error})"
            remedy = "Run the study in this process: --serial (workers=0)."
            raise InvalidValue(what, name, rule, remedy=remedy) from error
    return bytes(sent)


@functools.lru_cache(maxsize=4)
def _load_cell_settings(serialized_settings: bytes) -> SharedCellSettings:
    """Load the settings of the cells in a worker process.

    Raises
    ------
    RunError
        If the settings cannot be loaded, or if the worker has different versions or different code.
    """
    try:
        cell_settings: SharedCellSettings = cloudpickle.loads(serialized_settings)
    except Exception as error:
        raise RunError(
            f"a worker process cannot load the measure or a scene part ({type(error).__name__}: "
            f"{error}). Copy the required files to the workers, or put them in the directory of "
            "the study file"
        ) from error
    used = (
        *cell_settings.measure.result_determining_classes,
        *cell_settings.user_parts,
        *cell_settings.user_stepper_classes,
    )
    ours = provenance.collect_code_fingerprint(cell_settings.accuracy.engine, used)
    for name, wanted in cell_settings.code_fingerprint.items():
        if ours.get(name) != wanted:
            raise RunError(
                f"a worker has {name} {ours.get(name)}, but this run has {wanted}, so results of "
                "different code would be mixed. Install the same versions and files on the "
                "workers, and restart them"
            )
    return cell_settings


def pack_cell_batch(cell_plan: CellPlan, cell_numbers: np.ndarray) -> bytes:
    """Pack a batch of cells into as few bytes as possible.

    The batches are compressed because the Dask scheduler keeps all batches in memory. A batch
    contains only the names of user-defined parts, because the serialised settings contain the
    code of these parts.

    Parameters
    ----------
    cell_plan : CellPlan
        Plan that contains the cells.
    cell_numbers : ndarray of int
        Numbers of the cells in the batch.

    Returns
    -------
    bytes
        Packed batch.
    """
    cells = [
        (key, {n: getattr(v, "name", v) for n, v in of_scene.items()}, of_measure)
        for key, (of_scene, of_measure) in cell_plan.iterate_keys_and_field_changes(cell_numbers)
    ]
    return zlib.compress(pickle.dumps(cells), level=1)


def compute_packed_cell_batch(serialized_settings: bytes, packed_batch: bytes) -> bytes:
    """Compute a packed batch of cells in a worker process.

    If the computation of a cell exceeds the time limit, the operating system terminates the worker
    process.

    Parameters
    ----------
    serialized_settings : bytes
        Result of ``serialize_cell_settings``.
    packed_batch : bytes
        Result of ``pack_cell_batch``.

    Returns
    -------
    bytes
        Pickled list of the finished cells. If the computation takes longer than 0.5 s, the function
        stops early, and the list contains only the first cells of the batch. The list is pickled in
        this function because Dask would serialise each value of a list separately.

    Raises
    ------
    RunError
        If the worker cannot load the settings, or if the worker has different versions or
        different code.
    """
    cell_settings = _load_cell_settings(serialized_settings)
    finished: CellJournalRows = []
    output_packer = cell_settings.output_packer
    began = time.monotonic()
    # A worker may be a thread of the process of the user.
    ours = cell_settings.origin_process_id == _UNIQUE_PROCESS_ID
    if not ours:
        Engine.compilation_log.compilation_context_factory = _cpu_time_limits.suspend_temporarily
    with (
        contextlib.nullcontext()
        if ours
        else _cpu_time_limits.enforce_in_this_thread(cell_settings.cell_cpu_time_limit)
    ):
        SceneFields.register_user_parts(cell_settings.user_parts)
        Engine.register_user_steppers(cell_settings.user_stepper_classes)
        for key, *changes in pickle.loads(zlib.decompress(packed_batch)):
            cell = CellFieldChanges(*changes).build_cell(cell_settings.base_scene)
            finished.append(output_packer.pack_journal_row(key, *compute_cell(cell_settings, cell)))
            if time.monotonic() - began > _SECONDS_BETWEEN_JOURNAL_TRANSFERS:
                break
    return pickle.dumps(finished)


def compute_cell(
    cell_settings: SharedCellSettings,
    cell: Cell,
    propagated_exceptions: tuple[type[BaseException], ...] = (),
) -> tuple[Outcome, float]:
    """Compute a single cell.

    If the computation raises an exception, the outcome has the status ``CELL_RAISED`` and the
    message of the exception.

    Parameters
    ----------
    cell_settings : SharedCellSettings
        Scene, measure and accuracy of the cells.
    cell : Cell
        Cell to compute.
    propagated_exceptions : tuple of type, default: ()
        Types of exceptions that ``compute_cell`` does not catch. All other exceptions are recorded
        in the outcome.

    Returns
    -------
    outcome : Outcome
        Status, outputs and message of the cell.
    wall_time : float
        Wall time of the computation in s. The time for compiling code is not included.
    """
    begin = time.perf_counter() - Engine.compilation_log.total_compilation_seconds
    try:
        outcome = cell_settings.measure.with_(**cell.measure_field_changes)(
            cell.scene, cell_settings.accuracy
        )
    except propagated_exceptions:
        raise
    except BaseException as error:  # A cell may raise SystemExit or CancelledError.
        # The function str(error) is not used because it may raise an exception.
        text = traceback.format_exception_only(error)[-1].strip()
        outcome = Outcome(Status.CELL_RAISED, message=text)
    if outcome.message:
        outcome = replace(outcome, message=_shorten_message_for_storage(outcome.message))
    return outcome, time.perf_counter() - Engine.compilation_log.total_compilation_seconds - begin


def _shorten_message_for_storage(message: str) -> str:
    """Shorten a message, and escape characters that files cannot store."""
    text = (
        shorten_text(message, _MAX_STORED_MESSAGE_LENGTH).encode(errors="backslashreplace").decode()
    )
    return text.replace("\0", "\\0")


class _CpuTimeLimits:
    """CPU time limits for the threads that compute cells in this process.

    If a thread exceeds its limit, the operating system ends the process. The limit also applies if
    the thread holds the global interpreter lock. CPU time is limited instead of wall time, because
    a busy machine needs more wall time for the same computation.

    The operating system measures the CPU time of the whole process. The limit is therefore
    multiplied by the number of computing threads. The limit is set once per batch instead of once
    per cell. Setting the limit once is sufficient, because no further cell of the batch is started
    after ``_SECONDS_BETWEEN_JOURNAL_TRANSFERS`` seconds. Only the last cell of a batch can
    therefore run for a long time.
    """

    def __init__(self) -> None:
        self._active_threads, self._process_cpu_limit = 0, 0.0
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def enforce_in_this_thread(self, cpu_time_limit: float) -> Iterator[None]:
        """Limit the CPU time that the current thread can use for a cell."""
        self._update_thread_count_and_cpu_timers(1, cpu_time_limit)
        try:
            yield
        finally:
            self._update_thread_count_and_cpu_timers(-1, cpu_time_limit)

    def _update_thread_count_and_cpu_timers(
        self, thread_count_change: int, cpu_time_limit: float
    ) -> None:
        """Change the number of computing threads, and restart the CPU timers."""
        with self._lock:
            self._active_threads += thread_count_change
            self._process_cpu_limit = self._active_threads * cpu_time_limit
            self._set_cpu_timers(self._process_cpu_limit)

    @contextlib.contextmanager
    def suspend_temporarily(self) -> Iterator[None]:
        """Suspend the CPU time limits during a ``with`` block."""
        self._set_cpu_timers(0.0)
        try:
            yield
        finally:
            self._set_cpu_timers(self._process_cpu_limit)

    @staticmethod
    def _set_cpu_timers(cpu_time_limit: float) -> None:
        """Set the CPU timers, or cancel the timers if the limit is 0 s.

        If a process exceeds the CPU time limit, the stack traces of all threads are written to the
        worker log before the process ends.
        """
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if cpu_time_limit:
            faulthandler.dump_traceback_later(
                WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT * cpu_time_limit
                + _SECONDS_BETWEEN_JOURNAL_TRANSFERS,
                exit=True,
            )
            faulthandler.register(signal.SIGPROF, chain=True)  # The signal ends the process.
            signal.setitimer(
                signal.ITIMER_PROF,
                (1.0 + _DASK_CPU_TIME_OVER_CELL_TIME_LIMIT) * cpu_time_limit
                + _SECONDS_BETWEEN_JOURNAL_TRANSFERS,
            )


_cpu_time_limits = _CpuTimeLimits()
