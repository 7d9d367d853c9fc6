"""Settings for the requested accuracy of results and the tolerances of the integration."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real
from typing import ClassVar

from rsfstudy._deprecation import add_former_member_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.motion.engines import SCIPY, resolve_engine_name

#: Default value and limits of the relative tolerance ``Accuracy.rtol``.
DEFAULT_RTOL = 1e-7
MIN_RTOL, MAX_RTOL = 1e-11, 1e-2
#: Default value of ``Accuracy.budget``.
DEFAULT_EVALUATION_BUDGET = 500_000
#: Upper limit of ``Accuracy.budget``. Files can store this integer exactly.
MAX_EVALUATION_BUDGET = 10**15
#: Upper limit of ``rtol`` in the formulas for the slow-manifold thresholds. The slow-manifold
#: approximation, a series in the inertia weight, changes ln V by at most 0.08. A motion would never
#: reach a larger threshold of this change.
_MAX_RTOL_FOR_SWITCH_THRESHOLDS = 2e-5
#: Maximum ratio of an error estimate to ``rtol``. If this ratio is exceeded, the difference between
#: two runs is not a reliable error estimate.
MAX_RELIABLE_ERROR_OVER_RTOL = 100.0
#: Relative rounding error that each error estimate includes.
RELATIVE_ROUNDING_ERROR = 1e-13


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class Accuracy:
    """Settings for the requested accuracy of results and the limits of the computation.

    Parameters
    ----------
    rtol : float, default: 1e-7
        Relative error tolerance of the main results. If the result is a slip rate V, the tolerance
        applies to ln V. If the result is the velocity ratio V_0/V_* of a step, the tolerance
        applies to V_0/V_* - 1.
    budget : int, default: 500_000
        Maximum number of right-hand side evaluations when a measure is evaluated at one scene. If
        the budget is exceeded, the status of the outcome is ``work_budget_spent``.
    methods : tuple of (str, str), default: ()
        Pairs of a regime name and the name of the SciPy solver for this regime. The default solver
        is DOP853.
    engine : {"scipy", "python", "compiled"} or type, default: "scipy"
        Engine that integrates motions, or a subclass of ``Stepper``. After a subclass of
        ``Stepper`` has been passed once, its ``name`` is also a valid engine name.
    refinement : float, default: 1.0
        Factor by which all integration tolerances are multiplied. See ``refined``.

    Raises
    ------
    InvalidValue
        If ``rtol`` is not between 1e-11 and 1e-2, if ``budget`` is not a positive integer, if the
        engine is unknown, or if ``methods`` are given for an engine other than SciPy.

    Examples
    --------
    >>> from rsfstudy import Accuracy
    >>> accuracy = Accuracy(rtol=1e-6, engine="python")
    >>> accuracy.budget
    500000
    >>> f"{accuracy.local_tolerance:.1e}"
    '7.0e-08'
    >>> accuracy.refined().refinement
    0.1
    """

    #: Default value and limits of ``rtol``.
    DEFAULT_RTOL: ClassVar = DEFAULT_RTOL
    MIN_RTOL: ClassVar = MIN_RTOL
    MAX_RTOL: ClassVar = MAX_RTOL
    #: Default value of ``budget``.
    DEFAULT_BUDGET: ClassVar = DEFAULT_EVALUATION_BUDGET
    #: Maximum ratio of a reliable error estimate to ``rtol``.
    MAX_RELIABLE_ERROR_OVER_RTOL: ClassVar = MAX_RELIABLE_ERROR_OVER_RTOL
    #: Relative rounding error that each error estimate includes.
    RELATIVE_ROUNDING_ERROR: ClassVar = RELATIVE_ROUNDING_ERROR

    rtol: float = DEFAULT_RTOL
    budget: int = DEFAULT_EVALUATION_BUDGET
    methods: tuple[tuple[str, str], ...] = ()
    engine: str = SCIPY
    refinement: float = 1.0

    def __post_init__(self) -> None:
        """Check the values of the fields."""
        for name in ("rtol", "budget"):
            if isinstance(getattr(self, name), bool) or not isinstance(getattr(self, name), Real):
                raise InvalidValue(name, getattr(self, name), "must be a number")
        if not MIN_RTOL <= self.rtol <= MAX_RTOL:
            raise InvalidValue(
                "rtol",
                self.rtol,
                f"must lie between {MIN_RTOL:g} and {MAX_RTOL:g}",
                remedy="Smaller values are below the rounding error, and larger values do not "
                "resolve the motion.",
            )
        if not 1 <= self.budget <= MAX_EVALUATION_BUDGET or self.budget % 1:
            rule = f"must be a whole number from 1 to {MAX_EVALUATION_BUDGET:,}"
            raise InvalidValue("budget", self.budget, rule)
        object.__setattr__(self, "budget", int(self.budget))
        object.__setattr__(self, "engine", resolve_engine_name(self.engine))
        if self.methods and self.engine != SCIPY:
            rule = f"must be empty if the engine is {self.engine!r}"
            raise InvalidValue(
                "methods", self.methods, rule, remedy="Omit 'methods', or use engine='scipy'."
            )

    def refined(self) -> Accuracy:
        """Return the accuracy settings of a second run for an error estimate.

        All tolerances of the second run are ten times smaller. With a method of order eight, the
        second run costs about a third more than the first run.

        Returns
        -------
        Accuracy
            Copy of the accuracy settings with a smaller ``refinement``.

        Notes
        -----
        The errors of the two runs differ by about a factor of ten, so the difference between the
        results estimates the error of the first run. The runs share no intermediate results.
        """
        return _copy_accuracy_with_tolerances(self, self.rtol, 0.1 * self.refinement)

    def with_rtol(self, rtol: float) -> Accuracy:
        """Return a copy of the settings with a different relative error tolerance.

        Parameters
        ----------
        rtol : float
            New relative error tolerance.

        Returns
        -------
        Accuracy
            Accuracy settings with the new tolerance. All other settings are unchanged.
        """
        return _copy_accuracy_with_tolerances(self, rtol, self.refinement)

    @property
    def digits(self) -> float:
        """Number of significant digits that corresponds to ``rtol``."""
        return -math.log10(self.rtol)

    @property
    def local_tolerance(self) -> float:
        """Local error tolerance of an integration step.

        The local tolerance is smaller than ``rtol`` because local errors accumulate during a
        motion.
        """
        return 0.07 * self.rtol * self.refinement

    @property
    def max_inertia_weight_on_slow_manifold(self) -> float:
        """Maximum inertia weight :math:`(K/a) w^2` on the slow manifold.

        The slow-manifold approximation is of second order in the inertia weight :math:`W`. If the
        inertia weight is :math:`W` at the maximum slip rate, the error of ln V is :math:`1.6 W^3`.
        In random scenes, the error of the stress drop is up to :math:`0.4 W^3`. The test suite
        measures the factor 1.6.
        """
        return math.cbrt(0.75 * min(self.rtol, _MAX_RTOL_FOR_SWITCH_THRESHOLDS) * self.refinement)

    @property
    def max_log_slip_rate_change_by_inertia(self) -> float:
        """Maximum change in ln V due to inertia on the slow manifold.

        If friction weakens strongly with slip, a motion exceeds this limit before it exceeds the
        limit ``max_inertia_weight_on_slow_manifold``. If the maximum change in ln V is :math:`d`,
        the error of a limit cycle is up to :math:`0.07 d^3` in random scenes, and :math:`0.0014
        d^3` for the slider of the published study. The test suite measures both coefficients.
        """
        return math.cbrt(15.0 * min(self.rtol, _MAX_RTOL_FOR_SWITCH_THRESHOLDS) * self.refinement)

    @property
    def max_slip_in_return_to_slow_manifold(self) -> float:
        """Maximum slip, in units of D_c, during a transition to the slow manifold."""
        return 0.3 * self.rtol * self.refinement


@lru_cache(maxsize=256)
def _copy_accuracy_with_tolerances(accuracy: Accuracy, rtol: float, refinement: float) -> Accuracy:
    """Return a copy of the accuracy settings with different tolerances.

    The copy is cached, so all computations of a study share the same object.
    """
    return replace(accuracy, rtol=rtol, refinement=refinement)


def estimate_error(
    value: float,
    refined_value: float,
    relative_error_floor: float,
    error_scale: float | None = None,
) -> float:
    """Estimate the error of a result from the result of a refined run.

    Parameters
    ----------
    value : float
        Result of the first run.
    refined_value : float
        Result of the refined run. See ``Accuracy.refined``.
    relative_error_floor : float
        Minimum relative error. This error is always added to the estimate, because the two runs may
        agree by chance. The minimum relative error is a small fraction of the requested accuracy.
        Its value was determined in the study ``coverage``.
    error_scale : float, optional
        Reference value by which relative errors are multiplied. The default is ``value``. Pass a
        scale if ``value`` may be close to zero.

    Returns
    -------
    float
        Absolute error estimate.

    Notes
    -----
    The estimate is three times the difference between the two results, plus the error floor and the
    rounding error. Three times the difference is an upper bound on the error of the first run if
    the error of the refined run is at most two thirds of the error of the first run.
    """
    value = float(value)
    hidden = (relative_error_floor + RELATIVE_ROUNDING_ERROR) * abs(
        value if error_scale is None else error_scale
    )
    return 3.0 * abs(value - float(refined_value)) + hidden
