"""Status codes of a cell.

A status indicates a valid answer, a failure, or a cell that has not been computed yet.
"""

from __future__ import annotations

from enum import IntEnum, unique


@unique
class Status(IntEnum):
    """Outcome of one cell.

    Results files store the integer value of the status as a flag variable. Statuses with an integer
    value of at least ``WORK_BUDGET_SPENT`` are not answers.

    Attributes
    ----------
    meaning : str
        Explanation of the status for users.

    Examples
    --------
    >>> from rsfstudy.measures import Status
    >>> Status(3).label, Status(3).is_answer
    ('no_limit_cycle', True)
    >>> Status.WORK_BUDGET_SPENT.is_answer
    False
    """

    meaning: str

    def __new__(cls, code: int, meaning: str) -> Status:
        """Create a member from its integer code and its meaning."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.meaning = meaning
        return member

    OK = 0, "the value stands, within its error estimate"
    STABLE_FOR_ALL_STEPS = 1, "no step up to the limit of the search reaches the instability norm"
    UNSTABLE_AT_ANY_STEP = 2, "the smallest step of the search already ends in instability"
    NO_LIMIT_CYCLE = 3, "the motion settles to steady sliding: there is no stick-slip"
    NO_STEADY_STATE = 4, "no steady state exists at this load point velocity"
    LOCKED = 5, "normal stress grows faster than strength: the slider locks up"
    NORMAL_STRESS_LOST = 6, "normal stress vanishes: the fault opens"
    SHEAR_STRESS_REVERSED = 7, "shear stress reverses: friction of forward slip no longer applies"
    NORM_BELOW_LOADING_RATE = 8, "the loading alone already reaches the instability norm: raise it"
    NORM_UNREACHABLE = 9, "inertia keeps every slip rate below the instability norm"
    SLIP_RATE_UNBOUNDED = 10, "without mass the slip rate grows beyond 10^120 V_*"
    UNSTABLE_AT_ANY_STIFFNESS = 11, "steady sliding is unstable however stiff the spring"
    STABLE_AT_ANY_STIFFNESS = 12, "every perturbation decays however soft the spring"
    NO_STEP = 13, "the scene has no step to respond to"
    NOT_APPLICABLE = 14, "what is asked has no meaning in this scene"
    ACCURACY_OUT_OF_REACH = 15, "the integrator did not reach the accuracy within the work allowed"
    SLIP_STOPPED = 16, "nothing loads the slider, and its slip rate falls below 10^-290 V_*"
    NOT_PERIODIC = (
        17,
        "the motion repeats itself after none of up to 16 events, or 4 periods of forcing",
    )

    NOT_IDENTIFIED = 18, "the record does not constrain a parameter, whose value is not meaningful"
    ERRORS_NOT_VALID = 19, "the values stand, but their standard errors are not valid"

    # The statuses below are failures.
    WORK_BUDGET_SPENT = 20, "the work budget was spent before an answer was reached"
    INTEGRATION_FAILED = 21, "the integrator gave up or returned non-finite numbers"
    UNVERIFIED = 22, "two formulations disagree, or errors stay far above what was asked for"
    CELL_RAISED = 23, "the measure raised an exception"
    WORKER_LOST = 24, "the worker process died each time it computed this cell alone"
    PENDING = 25, "not computed yet"
    NOT_FINITE = 26, "the measure answered ok without a finite number"
    TIME_LIMIT_SPENT = 27, "no answer came within the time limit of a cell"

    @property
    def label(self) -> str:
        """Name of the status in the NetCDF flag meanings."""
        return self.name.lower()

    @staticmethod
    def labels_by_code() -> dict[int, str]:
        """Return the labels of all statuses by their integer codes in results files.

        Returns
        -------
        dict of int to str
            Label of each status.
        """
        return {int(status): status.label for status in Status}

    @property
    def has_values(self) -> bool:
        """True if the cell has usable values.

        The values may be usable even if their standard errors are invalid.
        """
        return self in (Status.OK, Status.ERRORS_NOT_VALID)

    @property
    def is_answer(self) -> bool:
        """True if the status answers the question of the study.

        An answer may be a statement without a number, for example that a slider is always stable.
        """
        return self < Status.WORK_BUDGET_SPENT
