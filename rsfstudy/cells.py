"""One cell after the other: what is computed in each, and what becomes of one that goes wrong."""

from __future__ import annotations

import faulthandler
import functools
import itertools
import math
import os
import pickle
import threading
import time
import traceback
import uuid
import zlib
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import cloudpickle

from rsfstudy import own_code, provenance
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import InvalidValue, RunError, brief
from rsfstudy.journal import Finished
from rsfstudy.measures import Measure, Outcome
from rsfstudy.overheard import Overhearing
from rsfstudy.scene import Scene
from rsfstudy.status import Status

#: Time in s a cell may take on a worker, far beyond what the usual work budget allows.
DEFAULT_TIME_LIMIT = 600.0
#: How often finished cells are handed over, in s: in one process, and by a worker.
_TELL, _TELL_DRIVER = 0.2, 0.5
#: Tells this process from others.
_HERE = uuid.uuid4().hex
#: How often a worker looks for a cell that is over its limit, in s.
_LOOK = 0.5
#: How often Python's own watchdog is set anew, and how much later it acts, in s.
_ARM, _GRACE = 1.0, 3.0
#: Characters of a message that are kept.
_LONGEST_MESSAGE = 2000

#: Cells by their names.
Batch = Sequence[tuple[bytes, Scene]]
Found = list[tuple[bytes, Finished]]


@dataclass(frozen=True)
class Task:
    """What is computed in every cell, and under which conditions.

    Parameters
    ----------
    measure : Measure
    accuracy : Accuracy
    time_limit : float
        Time in s a cell may take on a worker. Nothing bounds it in the user's own process.
    code : mapping
        Versions of all that decides a number, which every worker must have.
    own_code : str
        Digest of the code of the measure, where it is a user's own: the same.
    home : str
        The process that made the task.
    """

    measure: Measure
    accuracy: Accuracy
    time_limit: float = DEFAULT_TIME_LIMIT
    code: Mapping[str, str] = field(default_factory=lambda: provenance.code())
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
    for key, scene in itertools.chain.from_iterable(batches):
        found.append((key, computed(task, scene, let_through=(KeyboardInterrupt,))))
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
        Where the measure holds what cannot be sent.
    """
    try:
        return bytes(cloudpickle.dumps(task))
    except Exception as error:
        rule = f"cannot be sent to a worker ({error})"
        remedy = "Compute in this process: --serial (workers=0)."
        raise InvalidValue("measure", task.measure.name, rule, remedy=remedy) from error


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
            f"a worker cannot load the measure ({type(error).__name__}: {error}). Give the workers "
            "the files it needs, or put them beside the study file"
        ) from error
    ours = provenance.code()
    for name, wanted in task.code.items():
        if ours.get(name) != wanted:
            raise RunError(
                f"a worker has {name} {ours.get(name)}, this run {wanted}: their numbers would "
                "mix. Give the workers the same versions"
            )
    if own_code.digest(type(task.measure)) != task.own_code:
        raise RunError(
            f"a worker has another {type(task.measure).__name__}, or other code it draws on, than "
            "this run: their numbers would mix. Give the workers the same files, and start them "
            "again"
        )
    return task


def packed(batch: Batch) -> bytes:
    """A batch as little as can be: Dask's scheduler holds on to what it has passed on."""
    return zlib.compress(pickle.dumps(batch), level=1)


def on_worker(sent: bytes, batch: bytes) -> Found:
    """A packed batch in a worker process, which ends itself at a cell that is over its time limit.

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
    try:
        for key, scene in pickle.loads(zlib.decompress(batch)):
            if task.home != _HERE:  # a worker may be a thread of the user's own process
                _deadlines.set(task.time_limit)
            found.append((key, computed(task, scene)))
            if time.monotonic() - began > _TELL_DRIVER:
                break
    finally:
        _deadlines.clear()
    return found


def computed(
    task: Task, scene: Scene, let_through: tuple[type[BaseException], ...] = ()
) -> Finished:
    """The outcome of one cell, and its wall time in s; an exception is an outcome too."""
    begin = time.perf_counter()
    with Overhearing() as heard:
        try:
            found = task.measure(scene, task.accuracy)
        except let_through:
            raise
        except BaseException as error:  # a cell may raise SystemExit or CancelledError too
            # not str(error), which may raise as well
            text = traceback.format_exception_only(error)[-1].strip()
            found = Outcome(Status.CELL_RAISED, message=text)
    message = brief("; ".join(filter(None, [found.message, *heard])), _LONGEST_MESSAGE)
    message = message.encode(errors="backslashreplace").decode()
    return replace(found, message=message.replace("\0", "\\0")), time.perf_counter() - begin


class _Deadlines:
    """Ends this process once a thread has not finished its cell in time.

    A thread of its own looks after all others. Where a cell holds the interpreter's lock it cannot:
    then Python's own watchdog, which is not precise about which thread is late, ends the process a
    little later.
    """

    def __init__(self) -> None:
        self._until: dict[int, float] = {}
        self._watch: threading.Thread | None = None
        self._armed = -math.inf

    def set(self, seconds: float) -> None:
        """This thread starts a cell."""
        now = time.monotonic()
        self._until[threading.get_ident()] = now + seconds
        if self._watch is None:
            self._watch = threading.Thread(target=self._look, daemon=True)
            self._watch.start()
        if now - self._armed > _ARM:
            faulthandler.dump_traceback_later(seconds + _GRACE, exit=True)
            self._armed = now

    def clear(self) -> None:
        """This thread has no cell."""
        self._until.pop(threading.get_ident(), None)
        if not self._until:
            faulthandler.cancel_dump_traceback_later()
            self._armed = -math.inf

    def _look(self) -> None:
        while True:
            time.sleep(_LOOK)
            if any(time.monotonic() > end for end in list(self._until.values())):
                faulthandler.dump_traceback()  # the worker's log says where it hangs
                os._exit(1)


_deadlines = _Deadlines()
