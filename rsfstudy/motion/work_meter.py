"""Work that a motion spends, the tolerances that bound its steps, and why it may end early."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rsfstudy._deprecation import renamed_members, renamed_names
from rsfstudy.errors import RsfStudyError
from rsfstudy.motion.engines import SCIPY
from rsfstudy.status import Status

#: Local tolerance at which the longest steps of equations hold as they are; at others they change
#: as steps of order eight do.
REFERENCE_TOLERANCE_OF_STEP_LIMIT = 1e-7
#: Local tolerance below which rounding decides, and SciPy warns.
MIN_LOCAL_TOLERANCE = 5e-14


def larger_budget_remedy(budget: int) -> str:
    """Remedy of allowing more than a budget, to be added to a message."""
    return f"; --budget {4 * budget} (budget=) allows more"


class MotionStopped(RsfStudyError):
    """A motion that cannot go on, with the status that says why."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


@renamed_members
@dataclass
class WorkMeter:
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
    evaluations_by_regime : dict
        Right-hand sides evaluated so far.
    evaluations, steps, jacobians : int
        Right-hand sides in all (those of numerical Jacobians too), steps, and Jacobians.
    """

    budget: int
    methods: Mapping[str, str] = field(default_factory=dict)
    engine: str = SCIPY
    evaluations_by_regime: dict[str, int] = field(default_factory=dict)
    evaluations: int = 0
    steps: int = 0
    jacobians: int = 0

    def charge(self, regime_name: str, evaluations: int) -> None:
        """Add evaluations; raises `MotionStopped` once more than the budget is spent."""
        self.add_evaluations(regime_name, evaluations)
        self.check_budget()

    def add_evaluations(self, regime_name: str, evaluations: int) -> None:
        """Add evaluations."""
        self.evaluations_by_regime[regime_name] = (
            self.evaluations_by_regime.get(regime_name, 0) + evaluations
        )
        self.evaluations += evaluations

    def check_budget(self) -> None:
        """Raise `MotionStopped` where more than the budget is spent."""
        if self.evaluations > self.budget:
            raise MotionStopped(
                Status.WORK_BUDGET_SPENT,
                f"more than {self.budget} right-hand sides without an answer",
            )

    def charge_new_work(
        self, regime_names: Sequence[str], work_before: Sequence[int], work_now: Sequence[int]
    ) -> int:
        """Add what a motion has spent since what is known of it; returns what else is on the meter.

        Parameters
        ----------
        regime_names : sequence of str
            Those of the motion: one, or that between ruptures and that in them.
        work_before, work_now : sequence of int
            Right-hand sides in one and in the other, steps, and Jacobians: before, and now.
        """
        others = self.evaluations - work_before[0] - work_before[1]
        if work_now[0] > work_before[0]:
            self.add_evaluations(regime_names[0], work_now[0] - work_before[0])
        if work_now[1] > work_before[1]:
            self.add_evaluations(regime_names[1], work_now[1] - work_before[1])
        self.steps += work_now[2] - work_before[2]
        self.jacobians += work_now[3] - work_before[3]
        return others


if not TYPE_CHECKING:
    __getattr__ = renamed_names(__name__)
