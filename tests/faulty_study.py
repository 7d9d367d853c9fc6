"""A study whose cells fail on demand, used as a module and as a study file.

The measure returns b/a. Environment variables set the CPU time per cell, the fault and the
values of b/a at which it occurs, and an optional gate that blocks the cells until a file
exists.
"""

from __future__ import annotations

import collections
import ctypes
import itertools
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status


def _raise(error: BaseException):
    raise error


def _hang():
    while True:
        time.sleep(0.01)


def _busy_wait(seconds: float):
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def _wait_for_file(gate: Path):
    """Block all cells except the first of each process until the gate opens.

    The first cell takes long enough to be submitted in a batch of its own.
    """
    mine = gate / str(os.getpid())
    if not mine.exists():
        mine.touch()
        time.sleep(0.6)
        return
    while not (gate / "open").exists():
        time.sleep(0.01)


FAULTS: dict[str, Callable] = {
    "raises": lambda _meter: _raise(ZeroDivisionError("in the cell")),
    "runs out of memory": lambda _meter: np.ones(10**15),
    "recurses": lambda meter: FAULTS["recurses"](meter),
    "spends": lambda meter: meter.charge("any", 10**9),
    "nan": lambda _meter: Outcome(Status.OK, {"total": np.nan}),
    "no outcome": lambda _meter: 3.0,
    "undeclared": lambda _meter: Outcome(Status.OK, {"totla": 1.0}),
    "too many": lambda _meter: Outcome(Status.OK, {"total": np.ones(3)}),
    "text": lambda _meter: Outcome(Status.OK, {"total": "one"}),
    "pending": lambda _meter: Outcome(Status.PENDING, {"total": 1.0}),
    "surrogate": lambda _meter: _raise(OSError("no \udc80 file")),
    "nul": lambda _meter: _raise(ValueError("bad\0byte [/red]")),
    "generator": lambda _meter: _raise(GeneratorExit()),
    "interrupts": lambda _meter: _raise(KeyboardInterrupt()),
    "masked": lambda _meter: Outcome(Status.OK, {"total": np.ma.masked}),
    "number for message": lambda _meter: Outcome(Status.OK, {"total": 1.0}, np.array([1, 2])),
    "dies": lambda _meter: os._exit(1),
    "segfaults": lambda _meter: ctypes.string_at(0),
    "sleeps": lambda _meter: (time.sleep(3.0), Outcome(Status.OK, {"total": 1.0}))[1],
    "hangs": lambda _meter: _hang(),
    "hangs in C": lambda _meter: ctypes.PyDLL(None).sleep(10**6),
    # This fault also holds the global interpreter lock, as the fault above.
    "spins in C": lambda _meter: collections.deque(itertools.repeat(1), maxlen=0),
}


@dataclass(frozen=True)
class Faulty(Measure):
    """Measure that returns b/a, except in the cells that fail."""

    fault: str = ""
    at: tuple[float, ...] = ()
    name: ClassVar[str] = "faulty"
    primary_output: ClassVar[str] = "total"
    variables: ClassVar = {"total": ()}
    typical_rhs_evaluations: ClassVar[int] = 1

    def compute(self, scene, integrator):
        _busy_wait(float(os.environ.get("FAULT_TAKES", "0")))
        if "FAULT_GATE" in os.environ:
            _wait_for_file(Path(os.environ["FAULT_GATE"]))
        if scene.b_over_a in self.at or (self.fault and not self.at):
            return FAULTS[self.fault](integrator.work_meter)
        integrator.work_meter.charge("any", 7)
        return Outcome(Status.OK, {"total": scene.b_over_a})


def faulty_study(fault: str = "", at: tuple[float, ...] = (), cells: int = 4) -> Study:
    """Return a study over b/a = 2, 2.5, 3, ..., some of whose cells fail."""
    return Study(
        name="faulty",
        title="Cells that go wrong",
        base=Scene(),
        axes=[Axis("b_over_a", [2.0 + 0.5 * i for i in range(cells)])],
        measure=Faulty(fault, at),
    )


study = faulty_study(
    os.environ.get("FAULT", ""),
    tuple(float(at) for at in os.environ.get("FAULT_AT", "").split()),
    int(os.environ.get("FAULT_CELLS", "4")),
)
