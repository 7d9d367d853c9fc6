"""Work that a motion spends, the tolerances that bound its steps, and why it may end early."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rsfstudy.motion.engines import SCIPY
from rsfstudy.status import Status

#: Local tolerance at which the longest steps of equations hold as they are; at others they change
#: as steps of order eight do.
TOLERANCE_OF_STRIDES = 1e-7
#: Local tolerance below which rounding decides, and SciPy warns.
TIGHTEST = 5e-14


def more_work(budget: int) -> str:
    """Remedy of allowing more than a budget, to be added to a message."""
    return f"; --budget {4 * budget} (budget=) allows more"


class Halt(Exception):
    """A motion that cannot go on, with the status that says why."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


@dataclass
class Meter:
    """Work that one measurement spends, by regime, with which integrators; ends it when its budget
    is spent.

    Attributes
    ----------
    budget : int
        Right-hand sides it may evaluate.
    methods : mapping of str to str
        Name of the SciPy integrator of a regime; DOP853 where none is named.
    engine : str
        What integrates.
    by_regime : dict
        Right-hand sides evaluated so far.
    spent, steps, jacobians : int
        Right-hand sides in all (those of numerical Jacobians too), steps, and Jacobians.
    """

    budget: int
    methods: Mapping[str, str] = field(default_factory=dict)
    engine: str = SCIPY
    by_regime: dict[str, int] = field(default_factory=dict)
    spent: int = 0
    steps: int = 0
    jacobians: int = 0

    def charge(self, regime: str, evaluations: int) -> None:
        """Add evaluations; raises `Halt` once more than the budget is spent."""
        self.add(regime, evaluations)
        self.check()

    def add(self, regime: str, evaluations: int) -> None:
        """Add evaluations."""
        self.by_regime[regime] = self.by_regime.get(regime, 0) + evaluations
        self.spent += evaluations

    def check(self) -> None:
        """Raise `Halt` where more than the budget is spent."""
        if self.spent > self.budget:
            raise Halt(
                Status.WORK_BUDGET_SPENT,
                f"more than {self.budget} right-hand sides without an answer",
            )


class Account:
    """Work of a motion in its regimes that a meter has been told of."""

    def __init__(self, meter: Meter, regimes: Sequence[str]) -> None:
        self._meter, self._regimes = meter, regimes
        self._slow = self._fast = self._steps = self._jacobians = 0

    def settle(self, slow: int, fast: int, steps: int, jacobians: int) -> int:
        """Add what it has spent since the last time to the meter; returns what else is on that."""
        meter = self._meter
        before = meter.spent - self._slow - self._fast
        if slow > self._slow:
            meter.add(self._regimes[0], slow - self._slow)
        if fast > self._fast:
            meter.add(self._regimes[1], fast - self._fast)
        meter.steps += steps - self._steps
        meter.jacobians += jacobians - self._jacobians
        self._slow, self._fast, self._steps, self._jacobians = slow, fast, steps, jacobians
        return before
