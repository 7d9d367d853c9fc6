"""From the accuracy a user asks for to the tolerances that deliver it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from numbers import Real

from rsfstudy._deprecation import renamed_members
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.engines import SCIPY, engine_name

DEFAULT_RTOL = 1e-7
MIN_RTOL, MAX_RTOL = 1e-11, 1e-2
DEFAULT_EVALUATION_BUDGET = 500_000
#: More than any computer evaluates; files hold it.
MAX_EVALUATION_BUDGET = 10**15
#: The loosest accuracy that decides where to leave the slow manifold: its series in mass turns back
#: at a change of ln V of 0.08, which a motion that is to leave it beyond would never reach.
_MAX_REGIME_SWITCHING_RTOL = 2e-5
#: How far above what was asked for an error estimate may stay: numbers are then still good to
#: something near it, and two runs that agree less than that tell nothing of their errors.
MAX_ERROR_OVER_RTOL = 100.0
#: Relative error that rounding alone explains.
RELATIVE_ROUNDING_ERROR = 1e-13


@renamed_members
@guard_methods
@dataclass(frozen=True)
class Accuracy:
    """The accuracy a result must meet, and the work it may cost.

    Parameters
    ----------
    rtol : float
        Relative error allowed in headline numbers (of ln V for slip rates, of V_0/V_* - 1 for rate
        steps).
    budget : int
        Right-hand sides one measurement may evaluate before it ends as `work_budget_spent`.
    methods : tuple of (str, str)
        Regimes and the SciPy integrators that serve them, where not the default one.
    engine : {"scipy", "python", "compiled"}, or type
        What integrates motions; or a stepper of the user's own, given by its class, for which its
        name stands from then on.
    refinement : float
        Part of the usual tolerances that the integration is given; see `refined`.

    Raises
    ------
    InvalidValue
        For an rtol outside 1e-11 to 1e-2, a budget below 1, what is no engine, or integrators for
        an engine that has its own.
    """

    rtol: float = DEFAULT_RTOL
    budget: int = DEFAULT_EVALUATION_BUDGET
    methods: tuple[tuple[str, str], ...] = ()
    engine: str = SCIPY
    refinement: float = 1.0

    def __post_init__(self) -> None:
        for name in ("rtol", "budget"):
            if isinstance(getattr(self, name), bool) or not isinstance(getattr(self, name), Real):
                raise InvalidValue(name, getattr(self, name), "must be a number")
        if not MIN_RTOL <= self.rtol <= MAX_RTOL:
            raise InvalidValue(
                "rtol",
                self.rtol,
                f"must lie between {MIN_RTOL:g} and {MAX_RTOL:g}",
                remedy="Below that, rounding decides; above it, nothing is resolved.",
            )
        if not 1 <= self.budget <= MAX_EVALUATION_BUDGET or self.budget % 1:
            rule = f"must be a whole number from 1 to {MAX_EVALUATION_BUDGET:,}"
            raise InvalidValue("budget", self.budget, rule)
        object.__setattr__(self, "budget", int(self.budget))
        object.__setattr__(self, "engine", engine_name(self.engine))
        if self.methods and self.engine != SCIPY:
            rule = f"are SciPy's, and the engine is {self.engine}"
            raise InvalidValue("methods", self.methods, rule, remedy="Leave them out.")

    def refined(self) -> Accuracy:
        """The accuracy of a second run, which tells the error of the first: every tolerance is a
        tenth.

        At order eight it costs a third more than the first. The errors of the two are far apart,
        and nothing is shared that could be wrong in both.
        """
        return _cached_copy_with_tolerances(self, self.rtol, 0.1 * self.refinement)

    def with_rtol(self, rtol: float) -> Accuracy:
        """The same with another `rtol`."""
        return _cached_copy_with_tolerances(self, rtol, self.refinement)

    @property
    def local_tolerance(self) -> float:
        """Local tolerance for the integrator: local errors add up over a motion, so a part of
        `rtol`.
        """
        return 0.07 * self.rtol * self.refinement

    @property
    def max_inertia_weight(self) -> float:
        """Weight (K/a) w**2 of mass up to which the slow manifold stands in for the full equations.

        The manifold is of second order in it. Where slip peaks at a weight, ln V is off by 1.6
        times its third power, and over random scenes a stress drop by up to 0.4 times (the tests
        measure the first).
        """
        return math.cbrt(0.75 * min(self.rtol, _MAX_REGIME_SWITCHING_RTOL) * self.refinement)

    @property
    def max_inertia_correction(self) -> float:
        """Change d of ln V by inertia up to which the slow manifold may be used: this bound comes
        first where slip weakens strongly.

        Leaving it at d costs a cycle up to 0.07 d**3 over random scenes, and 0.0014 d**3 of the
        paper's slider (the tests measure it).
        """
        return math.cbrt(15.0 * min(self.rtol, _MAX_REGIME_SWITCHING_RTOL) * self.refinement)

    @property
    def max_remaining_slip(self) -> float:
        """Slip in D_c that may remain when the inertial equations hand back to the slow
        manifold.
        """
        return 0.3 * self.rtol * self.refinement


@lru_cache(maxsize=256)
def _cached_copy_with_tolerances(accuracy: Accuracy, rtol: float, refinement: float) -> Accuracy:
    """A copy, the same for all cells of a study."""
    return replace(accuracy, rtol=rtol, refinement=refinement)


def estimate_error(
    value: float,
    refined_value: float,
    relative_error_floor: float,
    error_scale: float | None = None,
) -> float:
    """Error estimate of a number, from what `Accuracy.refined` makes of it.

    Three times the difference, which misses only where the second error is more than two thirds of
    the first; and where both are small by chance, what it hides.

    Parameters
    ----------
    value, refined_value : float
        Results of the first run, and of the refined one.
    relative_error_floor : float
        Relative error that chance may hide: a small part of the accuracy asked for, measured by the
        study coverage.
    error_scale : float, optional
        What that error is relative to, where the number itself may come near zero.
    """
    value = float(value)
    hidden = (relative_error_floor + RELATIVE_ROUNDING_ERROR) * abs(
        value if error_scale is None else error_scale
    )
    return 3.0 * abs(value - float(refined_value)) + hidden
