"""One cell after the other: what is computed in each, and what becomes of one that goes wrong."""

from __future__ import annotations

import contextlib
import faulthandler
import functools
import itertools
import pickle
import signal
import threading
import time
import traceback
import uuid
import zlib
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import cloudpickle

from rsfstudy.compute import own_code, provenance
from rsfstudy.compute.overheard import Overhearing
from rsfstudy.declare.study import Cell
from rsfstudy.errors import InvalidValue, RunError, brief
from rsfstudy.files.journal import Finished
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.slider import fields
from rsfstudy.slider.parts import Part
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: CPU time in s a cell may take on a worker, far beyond what the usual work budget allows.
DEFAULT_TIME_LIMIT = 600.0
#: A cell that sleeps or waits has no more than this many times its limit, on the clock.
WAITING = 10.0
#: How often finished cells are handed over, in s: in one process, and by a worker.
_TELL, _TELL_DRIVER = 0.2, 0.5
#: Tells this process from others.
_HERE = uuid.uuid4().hex
#: What Dask may compute beside the cells of a worker, as a share of their CPU time.
_BESIDE = 0.25
#: Characters of a message that are kept.
_LONGEST_MESSAGE = 2000

#: Cells by their names.
Batch = Sequence[tuple[bytes, Cell]]
Found = list[tuple[bytes, Finished]]


@dataclass(frozen=True)
class Task:
    """What is computed in every cell, and under which conditions.

    Parameters
    ----------
    measure : Measure
        Each cell says what it changes of its fields.
    accuracy : Accuracy
    time_limit : float
        CPU time in s a cell may take on a worker. Nothing bounds it in the user's own process.
    code : mapping
        Versions of all that decides a number, which every worker must have.
    parts : tuple of type
        Parts of the slider that are the user's own.
    own_code : str
        Digest of the code of the measure and the parts, where they are a user's own: the same.
    home : str
        The process that made the task.
    """

    measure: Measure
    accuracy: Accuracy
    time_limit: float = DEFAULT_TIME_LIMIT
    code: Mapping[str, str] = field(default_factory=lambda: provenance.code())
    parts: tuple[type[Part], ...] = ()
    own_code: str = "none"
    home: str = _HERE


#: Takes a task and batches, and yields the finished cells, in any order.
Mapper = Callable[[Task, Iterable[Batch]], Generator[Found]]


def serial(task: Task, batches: Iterable[Batch]) -> Generator[Found]:
    """In this process, one cell after the other; they are handed over every now and then, because
    keeping each for itself may cost more than computing it.
    """
    found: Found = []
    began = told = time.monotonic()
    for key, cell in itertools.chain.from_iterable(batches):
        found.append((key, computed(task, cell, let_through=(KeyboardInterrupt,))))
        now = time.monotonic()
        if now - told > min(_TELL, 0.5 * (told - began)):
            yield found
            found, told = [], time.monotonic()
    yield found


def sendable(task: Task) -> bytes:
    """A task as workers are given it: with all that they cannot import.

    Raises
    ------
    InvalidValue
        Where the measure, or a part, holds what cannot be sent.
    """
    for part in task.parts:
        _dumped(part, "part", part.name)
    return _dumped(task, "measure", task.measure.name)


def _dumped(value: object, what: str, name: str) -> bytes:
    try:
        return bytes(cloudpickle.dumps(value))
    except Exception as error:
        rule = f"cannot be sent to a worker ({error})"
        remedy = "Compute in this process: --serial (workers=0)."
        raise InvalidValue(what, name, rule, remedy=remedy) from error


@functools.lru_cache(maxsize=4)
def _received(sent: bytes) -> Task:
    """A task in a worker process, which must have the code it was made with.

    Raises
    ------
    RunError
        Where the worker has not.
    """
    try:
        task: Task = cloudpickle.loads(sent)
    except Exception as error:
        raise RunError(
            f"a worker cannot load the measure, or a part ({type(error).__name__}: {error}). Give "
            "the workers the files it needs, or put them beside the study file"
        ) from error
    ours = provenance.code()
    for name, wanted in task.code.items():
        if ours.get(name) != wanted:
            raise RunError(
                f"a worker has {name} {ours.get(name)}, this run {wanted}: their numbers would "
                "mix. Give the workers the same versions"
            )
    classes = type(task.measure), *task.parts
    if own_code.digest(*classes) != task.own_code:
        names = " or ".join(kind.__name__ for kind in classes)
        raise RunError(
            f"a worker has another {names}, or other code it draws on, than "
            "this run: their numbers would mix. Give the workers the same files, and start them "
            "again"
        )
    return task


def packed(batch: Batch) -> bytes:
    """A batch as little as can be: Dask's scheduler holds on to what it has passed on. Scenes go
    as what they are made of: a worker has their parts from the task.
    """
    cells = [(key, scene.as_dict(), changes) for key, (scene, changes) in batch]
    return zlib.compress(pickle.dumps(cells), level=1)


def _unpacked(batch: bytes) -> Iterator[tuple[bytes, Cell]]:
    for key, values, changes in pickle.loads(zlib.decompress(batch)):
        yield key, Cell(Scene(**values), changes)


def on_worker(sent: bytes, batch: bytes) -> Found:
    """A packed batch in a worker process, which ends at a cell that is over its time limit.

    Returns
    -------
    list
        Its first cells: as many as were finished when it was time to hand them over.

    Raises
    ------
    RunError
        Where the worker cannot load the task, or runs other code than it was made with.
    """
    task = _received(sent)
    found: Found = []
    began = time.monotonic()
    ours = task.home == _HERE  # a worker may be a thread of the user's own process
    with contextlib.nullcontext() if ours else _limits.within(task.time_limit):
        fields.know(task.parts)
        for key, cell in _unpacked(batch):
            found.append((key, computed(task, cell)))
            if time.monotonic() - began > _TELL_DRIVER:
                break
    return found


def computed(task: Task, cell: Cell, let_through: tuple[type[BaseException], ...] = ()) -> Finished:
    """The outcome of one cell, and its wall time in s; an exception is an outcome too."""
    begin = time.perf_counter()
    with Overhearing() as heard:
        try:
            found = task.measure.with_(**cell.changes)(cell.scene, task.accuracy)
        except let_through:
            raise
        except BaseException as error:  # a cell may raise SystemExit or CancelledError too
            # not str(error), which may raise as well
            text = traceback.format_exception_only(error)[-1].strip()
            found = Outcome(Status.CELL_RAISED, message=text)
    message = brief("; ".join(filter(None, [found.message, *heard])), _LONGEST_MESSAGE)
    message = message.encode(errors="backslashreplace").decode()
    return replace(found, message=message.replace("\0", "\\0")), time.perf_counter() - begin


class _Limits:
    """Has the system end this process where a thread takes too long over a cell.

    CPU time is what counts: on a slow or busy machine a cell takes longer and computes no more. It
    is that of the whole process, so as many threads as compute have as many times the limit. The
    system acts even where a cell holds the interpreter's lock. The limit is set once a batch: all
    of its cells but the last take no longer than `_TELL_DRIVER`.
    """

    def __init__(self) -> None:
        self._computing = 0
        self._lock = threading.Lock()

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Allow this thread so many seconds of CPU time for a cell of a batch."""
        self._add(1, seconds)
        try:
            yield
        finally:
            self._add(-1, seconds)

    def _add(self, threads: int, seconds: float) -> None:
        with self._lock:
            self._computing += threads
            self._set(self._computing * seconds)

    @staticmethod
    def _set(seconds: float) -> None:
        """The worker's log says where each thread was; 0 s sets no limit."""
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if seconds:
            faulthandler.dump_traceback_later(WAITING * seconds + _TELL_DRIVER, exit=True)
            faulthandler.register(signal.SIGPROF, chain=True)  # which then ends the process
            signal.setitimer(signal.ITIMER_PROF, (1.0 + _BESIDE) * seconds + _TELL_DRIVER)


_limits = _Limits()
