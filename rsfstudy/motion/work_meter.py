"""Classes that limit the work of a measure and report stopped motions, and tolerance limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names
from rsfstudy.errors import RsfStudyError
from rsfstudy.status import Status

#: Reference local tolerance for the maximum step size, which is proportional to the eighth root of
#: the local tolerance.
REFERENCE_TOLERANCE_FOR_MAX_STEP_LENGTH = 1e-7
#: Minimum local tolerance. Below this tolerance, rounding errors dominate, and SciPy issues a
#: warning.
MIN_LOCAL_ERROR_TOLERANCE = 5e-14


class MotionStopped(RsfStudyError):
    """Exception raised if a motion cannot continue.

    Parameters
    ----------
    status : Status
        Reason for the termination.
    message : str
        Error message.
    """

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status


@add_former_member_names
@dataclass
class WorkMeter:
    """Counter that limits the right-hand side evaluations of a measure to a budget.

    Parameters
    ----------
    budget : int
        Maximum number of right-hand side evaluations.
    evaluations_by_regime : dict of str to int, optional
        Number of right-hand side evaluations in each regime.
    evaluations : int, default: 0
        Number of right-hand side evaluations, including evaluations for numerical Jacobians.
    step_count : int, default: 0
        Number of integration steps.
    jacobian_evaluations : int, default: 0
        Number of Jacobian evaluations.
    """

    budget: int
    evaluations_by_regime: dict[str, int] = field(default_factory=dict)
    evaluations: int = 0
    step_count: int = 0
    jacobian_evaluations: int = 0

    def charge(self, regime_name: str, evaluations: int) -> None:
        """Add right-hand side evaluations, and check the budget.

        Parameters
        ----------
        regime_name : str
            Name of the regime.
        evaluations : int
            Number of evaluations.

        Raises
        ------
        MotionStopped
            If the total exceeds the budget.
        """
        self.add_evaluations(regime_name, evaluations)
        self.check_budget()

    def add_evaluations(self, regime_name: str, evaluations: int) -> None:
        """Add to the count of evaluations without checking the budget.

        Parameters
        ----------
        regime_name : str
            Name of the regime.
        evaluations : int
            Number of evaluations.
        """
        self.evaluations_by_regime[regime_name] = (
            self.evaluations_by_regime.get(regime_name, 0) + evaluations
        )
        self.evaluations += evaluations

    @property
    def larger_budget_advice(self) -> str:
        """Final sentence of an error message, which suggests a four times larger budget."""
        return (
            f". To continue, increase the budget to {4 * self.budget}: --budget "
            f"{4 * self.budget} (in Python, budget={4 * self.budget})"
        )

    def check_budget(self) -> None:
        """Raise MotionStopped if the evaluations exceed the budget.

        Raises
        ------
        MotionStopped
            If the total exceeds the budget.
        """
        if self.evaluations > self.budget:
            raise MotionStopped(
                Status.WORK_BUDGET_SPENT,
                f"the budget of {self.budget} right-hand side evaluations was exceeded before a "
                "result was found",
            )

    def charge_work_since_last_call(
        self, regime_names: Sequence[str], work_before: Sequence[int], work_now: Sequence[int]
    ) -> int:
        """Count the evaluations and steps that a motion has needed since the previous call.

        Parameters
        ----------
        regime_names : sequence of str
            Name of the slow regime, followed by the name of the fast regime if there are two
            regimes.
        work_before, work_now : sequence of int
            Cumulative counts of the motion at the previous call and at the current call. The four
            counts are evaluations in the slow regime, evaluations in the fast regime, steps, and
            Jacobians.

        Returns
        -------
        int
            Number of right-hand side evaluations that the work meter has counted for other motions.
        """
        others = self.evaluations - work_before[0] - work_before[1]
        if work_now[0] > work_before[0]:
            self.add_evaluations(regime_names[0], work_now[0] - work_before[0])
        if work_now[1] > work_before[1]:
            self.add_evaluations(regime_names[1], work_now[1] - work_before[1])
        self.step_count += work_now[2] - work_before[2]
        self.jacobian_evaluations += work_now[3] - work_before[3]
        return others


if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)
