"""Status codes of a cell.

A status indicates a valid answer, a failure, or a cell that has not been computed yet.
"""

from __future__ import annotations

from enum import IntEnum, unique
from typing import Any


@unique
class Status(IntEnum):
    """Outcome of one cell.

    Results files store the integer value of the status as a flag variable. If the integer value is
    ``WORK_BUDGET_SPENT`` or larger, the cell has no valid answer.

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

    OK = 0, "the result is valid within its error estimate"
    STABLE_FOR_ALL_STEPS = (
        1,
        ("no step up to the largest step of the search reaches the instability norm"),
    )
    UNSTABLE_AT_ANY_STEP = 2, "even the smallest step of the search causes instability"
    NO_LIMIT_CYCLE = 3, "the motion settles to steady sliding, so there is no limit cycle"
    NO_STEADY_STATE = 4, "no steady state exists at this load point velocity"
    LOCKED = 5, "the slider locks, because frictional strength increases faster than shear stress"
    NORMAL_STRESS_LOST = 6, "normal stress vanishes, so the fault opens"
    SHEAR_STRESS_REVERSED = (
        7,
        ("shear stress reverses, but friction is defined for forward slip only"),
    )
    NORM_BELOW_LOADING_RATE = (
        8,
        ("the load point velocity already exceeds the instability norm, which must be larger"),
    )
    NORM_UNREACHABLE = 9, "inertia keeps every slip rate below the instability norm"
    SLIP_RATE_UNBOUNDED = 10, "without inertia, the slip rate exceeds 10^120 V_*"
    UNSTABLE_AT_ANY_STIFFNESS = 11, "steady sliding is unstable at every stiffness"
    STABLE_AT_ANY_STIFFNESS = 12, "every perturbation decays at every stiffness"
    NO_STEP = 13, "the scene has no step"
    NOT_APPLICABLE = 14, "the result is not defined for this scene"
    ACCURACY_OUT_OF_REACH = (
        15,
        (
            "the integrator cannot reach the requested accuracy even with a larger budget, or the "
            "search of a fit did not converge"
        ),
    )
    SLIP_STOPPED = 16, "the slider is not loaded, and its slip rate falls below 10^-290 V_*"
    NOT_PERIODIC = (
        17,
        "the motion has no period of up to 16 events or up to 4 periods of the forcing",
    )

    NOT_IDENTIFIED = 18, "the record does not constrain a parameter, so its value is not meaningful"
    ERRORS_NOT_VALID = 19, "the values are valid, but their standard errors are not valid"

    # The statuses below are failures.
    WORK_BUDGET_SPENT = (
        20,
        (
            "the evaluation budget or a limit of the measure was exceeded before a result was "
            "found, and a larger budget or limit may help"
        ),
    )
    INTEGRATION_FAILED = 21, "the integration failed, or a value is not finite"
    UNVERIFIED = (
        22,
        (
            "two independent computations disagree, or the error is far larger than the "
            "requested accuracy"
        ),
    )
    CELL_RAISED = 23, "the measure raised an exception"
    WORKER_LOST = 24, "the worker process ended each time it computed only this cell"
    PENDING = 25, "not computed yet"
    NOT_FINITE = 26, "the status of the measure is ok, but its result is not finite"
    TIME_LIMIT_SPENT = 27, "the cell exceeded the time limit"

    @property
    def label(self) -> str:
        """Name of the status in the NetCDF flag meanings."""
        return self.name.lower()

    @staticmethod
    def labels_by_code() -> dict[int, str]:
        """Return a mapping from integer status codes to labels.

        Returns
        -------
        dict of int to str
            Label of each status.
        """
        return {int(status): status.label for status in Status}

    @staticmethod
    def find_failures(status_codes: Any) -> Any:
        """Find the failed cells among cells with the given status codes.

        Cells that have not been computed are not counted as failures.

        Parameters
        ----------
        status_codes : ndarray or xarray.DataArray of int
            Status codes.

        Returns
        -------
        ndarray or xarray.DataArray of bool
            True for each failed cell.
        """
        return (status_codes >= int(Status.WORK_BUDGET_SPENT)) & (
            status_codes != int(Status.PENDING)
        )

    @property
    def has_values(self) -> bool:
        """True if the cell has usable values.

        The values may be usable even if their standard errors are invalid.
        """
        return self in (Status.OK, Status.ERRORS_NOT_VALID)

    @property
    def is_answer(self) -> bool:
        """True if the status indicates a valid answer.

        An answer may be a statement without a number, for example that a slider is always stable.
        """
        return self < Status.WORK_BUDGET_SPENT
