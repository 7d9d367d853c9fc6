"""Critical step: the smallest step of the load that triggers instability.

The step may be a change of load point velocity, load point displacement or normal stress. A step is
critical if the peak slip rate of the motion that follows just reaches the instability norm. If the
effect of inertia is small up to the norm, the end of this critical path is known: ln V equals the
norm, and its rate is zero. The path is followed backwards in time, in which direction it attracts
neighbouring paths, to the step at which it starts (see ``critical_path``). If inertia is important
below the norm, the peak is followed forwards in time (see ``after_step``). In both cases, the
result is accepted only if motions on both sides of the critical step confirm it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

from scipy.optimize import toms748

from rsfstudy.analysis import after_step
from rsfstudy.analysis.by_path import Boundary, from_critical_path, from_touching_cycle
from rsfstudy.analysis.kinds_of_steps import DisplacementSteps, NormalStressSteps, RateSteps
from rsfstudy.analysis.search_of_steps import Steps
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures._single_step import check_single_step, near_loading, reached_by_loading
from rsfstudy.motion.accuracy import ROUNDING, TIGHTEST_RTOL, Accuracy
from rsfstudy.motion.handover import mass_acts
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.quantity import Output
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

KINDS: Mapping[str, type[Steps]] = {
    "load_velocity_ratio": RateSteps,
    "displacement_step": DisplacementSteps,
    "normal_stress_step": NormalStressSteps,
}
DIRECTIONS = ("up", "down")
#: Aliases of the quantities in `KINDS`, which are names of scene fields.
SYNONYMS: Mapping[str, str] = {"velocity_step": "load_velocity_ratio"}

#: Accuracy of a boundary that is a limit cycle, whatever is asked for.
_CAREFUL = 1e-8

#: Widest bracket, over the size, that confirms a boundary.
_WIDEST = 0.02

#: Excess of a motion whose first peak is beyond a limit cycle that touches the norm.
_AT_ONCE = 0.1

#: A slip rate norm at which mass hardly acts.
_LIGHT_NORM = 1e-3


@cache
def _outputs(of: str) -> tuple[Output, ...]:
    critical = KINDS[of].quantity
    confirmed = (f"{critical}_stable", f"{critical}_unstable")
    beside = (*confirmed, *KINDS[of].beside, "critical_stiffness")
    return Output(critical, error=True), *map(Output, beside)


@guard_methods
@dataclass(frozen=True)
class CriticalStep(Measure):
    """Smallest step after which slip rate reaches the instability norm.

    The norm is V T/(2 pi D_c). The critical step is a velocity ratio V_0/V_*, a displacement in
    D_c, or a change of normal stress over sigma_*. The outputs include the sizes of two steps that
    confirm the critical step: the slider settles after one of them, and becomes unstable after the
    other. Under the slip law at constant normal stress, critical stiffness and an infinite norm,
    the critical step is ``V_0/V_* = 1 + a/(b - a)``, or a displacement of ``D_c a/(b - a)``.

    Parameters
    ----------
    of : {"load_velocity_ratio", "displacement_step", "normal_stress_step"}
        Type of the step. The value of this field in the scene is ignored. "velocity_step" is an
        alias of "load_velocity_ratio". After a step of displacement or of normal stress, the load
        point is held (V_0 = 0) unless the scene specifies ``load_velocity_ratio``. Steps of normal
        stress require a normal stress that is not constant. A decrease of normal stress can trigger
        an instability (direction "down", and a negative number).
    direction : {"up", "down"}
        Steps that increase or decrease the load.

    References
    ----------
    Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196; eqs. 10, 11 and 14 of
    doi:10.1007/s11589-014-0098-4.
    """

    of: str = "load_velocity_ratio"
    direction: str = "up"
    name: ClassVar[str] = "critical_step"
    typical_work = 4_000
    clocks: ClassVar[tuple[bool, ...]] = (False,)

    def __post_init__(self) -> None:
        if isinstance(self.of, str):
            object.__setattr__(self, "of", SYNONYMS.get(self.of, self.of))
        if not isinstance(self.of, str) or self.of not in KINDS:
            raise InvalidValue("of", self.of, "cannot be stepped", choices=KINDS)
        if self.direction not in DIRECTIONS:
            raise InvalidValue("direction", self.direction, "is unknown", choices=DIRECTIONS)

    @property
    def headline(self) -> str:
        return KINDS[self.of].quantity

    @property
    def outputs(self) -> Sequence[Output]:
        return _outputs(self.of)

    @property
    def sought(self) -> tuple[str, ...]:
        return (self.of,)

    @property
    def work_by_digits(self) -> Mapping[float, float]:
        """Relative work by number of digits, as measured for velocity steps.

        The study accuracy_cost measured these ratios.
        """
        return {3.0: 0.59, 5.0: 0.74, 7.0: 1.0, 8.0: 1.21, 9.0: 1.58, 10.0: 1.89}

    def scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale of the numerical error, which is the size of the change."""
        still = 1.0 if self.of == "load_velocity_ratio" else 0.0
        return {self.headline: abs(values[self.headline] - still)}

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Find the critical step, and confirm it with a motion on each side.

        If the effect of inertia is small below the norm, the critical step follows from
        ``critical_path``. If there is no such path, or if inertia is important, the critical step
        is found from motions that are followed forwards in time.
        """
        check_single_step(scene)
        if scene.begins_elsewhere:
            rule = "is no steady sliding, from which critical steps start"
            remedy = "Ask whether the step of a scene triggers by the measure triggered."
            raise InvalidValue("initial_state", scene.initial_state, rule, remedy=remedy)
        sign = 1 if self.direction == "up" else -1
        steps = KINDS[self.of](scene, sign)
        if steps.largest <= steps.smallest:
            rate = 0.0 if self.of == "load_velocity_ratio" else steps.scene.load_velocity
            return reached_by_loading(scene, rate)
        below = not after_step.orbits_may_close(scene) or after_step.ratio_after(scene) < 1.0
        if (
            below
            and after_step.friction_acts_alone(scene)
            and after_step.neutral(steps.scene_at(steps.largest), 10.0 * accuracy.rtol)
        ):
            return Outcome(
                Status.UNVERIFIED,
                message="stiffness is critical to within the accuracy: ask for a smaller rtol",
            )
        if not scene.critical_stiffness:
            # nothing grows: only the step itself can reach the norm
            return self._surveyed(steps, accuracy, meter)
        if not mass_acts(scene, accuracy):
            # a cycle attracts no path, and takes more care
            rtols = accuracy.rtol, min(accuracy.rtol, _CAREFUL)
            for find, rtol in zip((from_critical_path, from_touching_cycle), rtols, strict=True):
                asked = accuracy if rtol == accuracy.rtol else accuracy.at(rtol)
                boundary = find(steps, asked, meter)
                if boundary is not None and not steps.mass_delays(boundary.size, asked.rtol):
                    outcome = self._verified(steps, boundary, asked, meter)
                    if outcome.status is Status.OK:
                        return outcome
            return self._surveyed(steps, accuracy, meter)
        near = _at_light_norm(steps, meter)
        if near is not None and steps.smaller_ones_decay(near):
            bracket = _neighbours(steps, near, accuracy, meter)
            if bracket is not None:
                return self._closed_in(steps, bracket, accuracy, meter)
        return self._surveyed(steps, accuracy, meter)

    def _verified(
        self, steps: Steps, boundary: Boundary, accuracy: Accuracy, meter: Meter
    ) -> Outcome:
        """Confirm a boundary by a motion on each side, as close to it as the motions can tell.

        The width they confirm is the error of a boundary that motions found in the first place, and
        of one that they do not confirm at once. A path is then none: where orbits grow that have
        not reached the norm yet, a smaller step is critical.
        """
        first = boundary.relative_error if boundary.by_motions else 3.0 * boundary.relative_error
        first = width = max(first, accuracy.rtol)
        while width < _WIDEST:
            inner, outer = boundary.size * (1.0 - width), boundary.size * (1.0 + width)
            below, above = (_excess(steps, size, accuracy, meter) for size in (inner, outer))
            if below is not None and above is not None and above >= 0.0 > below:
                at_once = width == first and not boundary.by_motions
                relative = boundary.relative_error if at_once else width
                error = steps.error(boundary.size, relative)
                values = self._values(
                    steps, boundary.size, error, steps.value(inner), steps.value(outer)
                )
                load = steps.scene_at(boundary.size).load_velocity
                return Outcome(Status.OK, values, near_loading(steps.scene, load))
            if not (boundary.by_motions or boundary.of_cycle):
                break
            if boundary.of_cycle and below is not None and below > _AT_ONCE:
                break
            width *= 10.0
        return Outcome(
            Status.UNVERIFIED,
            self._values(steps),
            f"no bracket within 2 % confirms {self.headline} = {steps.value(boundary.size):.9g}",
        )

    def _values(
        self,
        steps: Steps,
        size: float = math.nan,
        error: float = math.nan,
        stable: float = math.nan,
        unstable: float = math.nan,
    ) -> dict[str, float]:
        of = self.headline
        return {
            of: steps.value(size),
            f"{of}_error": error,
            f"{of}_stable": stable,
            f"{of}_unstable": unstable,
            "critical_stiffness": steps.scene.critical_stiffness,
            **steps.values_beside(size),
        }

    def _surveyed(self, steps: Steps, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Find the critical step from motions after steps of increasing size.

        The search continues until a motion is unstable, and is then refined.
        """

        smallest, largest = math.log(steps.smallest), math.log(steps.largest)
        spacing = (largest - smallest) / max(1, math.ceil((largest - smallest) / math.log(2.0)))
        stable: float | None = None
        unstable = smallest
        while unstable <= largest + 1e-9:
            try:
                if after_step.reaches_norm(steps.scene_at(math.exp(unstable)), accuracy, meter):
                    break
            except Halt as halt:
                if halt.status is Status.WORK_BUDGET_SPENT or stable is None:
                    raise
                return self._never(steps, math.exp(stable), meter, f", where {halt}")
            stable, unstable = unstable, unstable + spacing
        else:
            return self._never(steps, steps.largest, meter)
        if stable is None:
            return Outcome(
                Status.UNSTABLE_AT_ANY_STEP,
                self._values(steps, unstable=steps.value(steps.smallest)),
                f"already a step to {steps.value(steps.smallest):.6g} is unstable",
            )
        return self._closed_in(steps, (stable, unstable), accuracy, meter)

    def _closed_in(
        self, steps: Steps, bracket: tuple[float, float], accuracy: Accuracy, meter: Meter
    ) -> Outcome:
        """Boundary between a stable and an unstable log size, where the excess of the motions
        changes sign; the middle of what is left where a motion in between cannot go on.
        """
        stable, unstable = bracket
        rtol = max(steps.allowed(math.exp(unstable), accuracy.rtol), TIGHTEST_RTOL)
        accuracy = accuracy.at(rtol)

        def excess(log_size: float) -> float:
            nonlocal stable, unstable
            found = after_step.excess_over_norm(steps.scene_at(math.exp(log_size)), accuracy, meter)
            if found >= 0.0:
                unstable = min(unstable, log_size)
            else:
                stable = max(stable, log_size)
            return found

        try:
            log_size = toms748(excess, *bracket, xtol=0.5 * accuracy.rtol, rtol=1e-15)
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            if unstable - stable > _WIDEST:
                return self._never(steps, math.exp(bracket[0]), meter, f", where {halt}")
            log_size = 0.5 * (stable + unstable)
        # the motions that found it would confirm their own errors: the verdicts come from others
        size = math.exp(log_size)
        error = max(accuracy.rtol + steps.blur(size, accuracy.rtol), unstable - stable)
        boundary = Boundary(size, error, by_motions=True)
        return self._verified(steps, boundary, accuracy.refined(), meter)

    def _never(self, steps: Steps, largest: float, meter: Meter, why: str = "") -> Outcome:
        """No step up to the largest reached the norm: because nothing is unstable, or because of
        mass.
        """
        if steps.scene.has_mass and _at_light_norm(steps, meter) is not None:
            return Outcome(
                Status.NORM_UNREACHABLE,
                self._values(steps, stable=steps.value(largest)),
                f"mass keeps every slip rate below the norm {steps.scene.instability_norm:g}",
            )
        if steps.jumps_to_norm and not steps.scene.has_mass and not why:
            value = steps.value(largest)
            values = self._values(steps, largest, largest * ROUNDING, value, value)
            return Outcome(
                Status.OK, values, "the jump of slip rate at the step itself is critical"
            )
        return Outcome(
            Status.STABLE_FOR_ALL_STEPS,
            self._values(steps, stable=steps.value(largest)),
            f"stable for every step up to {steps.value(largest):.6g}{why}",
        )


def _excess(steps: Steps, size: float, accuracy: Accuracy, meter: Meter) -> float | None:
    """Compute the excess of the motion after a step of a given size.

    The result is None if the motion cannot continue.
    """
    try:
        return after_step.excess_over_norm(steps.scene_at(size), accuracy, meter)
    except Halt as halt:
        if halt.status is Status.WORK_BUDGET_SPENT:
            raise
        return None


def _at_light_norm(steps: Steps, meter: Meter) -> float | None:
    """Compute the critical step for a norm at which inertia is negligible.

    The result is an inexpensive approximation of the critical step.
    """
    norm = min(steps.scene.instability_norm, _LIGHT_NORM)
    massless = type(steps)(steps.scene.without_mass().with_(instability_norm=norm), steps.sign)
    if massless.largest <= massless.smallest or not massless.scene.critical_stiffness:
        return None
    return next(massless.sizes_on_path((1e-6,), meter), None)


def _neighbours(
    steps: Steps, near: float, accuracy: Accuracy, meter: Meter
) -> tuple[float, float] | None:
    """Find a stable and an unstable logarithm of size around a guess.

    The result is None if there are no such sizes within a factor of four.
    """
    middle = math.log(near)
    reached = after_step.reaches_norm(steps.scene_at(near), accuracy, meter)
    inner, reach = middle, 1e-4
    while reach < 1.5:
        outer = middle - reach if reached else min(middle + reach, math.log(steps.largest))
        if after_step.reaches_norm(steps.scene_at(math.exp(outer)), accuracy, meter) != reached:
            return (outer, inner) if reached else (inner, outer)
        inner, reach = outer, 5.0 * reach
    return None
