"""Critical step: the smallest load step that triggers an instability.

The step may be a change in load point velocity, load point displacement or normal stress. A step is
critical if the peak slip rate after the step just reaches the instability norm.

If the effect of inertia is small up to the instability norm, the end of the critical path is known.
At the end of the critical path, ln V equals the instability norm, and the time derivative of ln V
is zero. The critical path is integrated backwards in time to the step at which it starts (see
``critical_path``). If inertia is important below the instability norm, the peak slip rate is
computed by integration forwards in time (see ``motion_after_step``). A critical step is accepted
only if the motions after a slightly smaller and a slightly larger step confirm the result.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

from scipy.optimize import toms748

from rsfstudy.critical_steps import motion_after_step, stability_after_step
from rsfstudy.critical_steps.critical_path_solution import (
    CriticalStepSizeEstimate,
    find_critical_step_size_by_critical_path,
    find_critical_step_size_by_limit_cycle,
)
from rsfstudy.critical_steps.loading_checks import (
    SLOW_INSTABILITY_NORM_WARNING_PREFIX,
    build_norm_below_load_velocity_outcome,
    build_slow_instability_norm_warning,
    check_loading_is_single_step,
)
from rsfstudy.critical_steps.loading_step_families import LoadingStepFamily
from rsfstudy.critical_steps.loading_step_types import (
    DisplacementStepFamily,
    LoadVelocityStepFamily,
    NormalStressStepFamily,
)
from rsfstudy.critical_steps.slow_manifold_accuracy import is_slow_manifold_inaccurate
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import Accuracy, Integrator, MotionStopped
from rsfstudy.quantities import Output
from rsfstudy.slider import Scene
from rsfstudy.status import Status

STEP_FAMILY_BY_SCENE_FIELD: Mapping[str, type[LoadingStepFamily]] = {
    "load_velocity_ratio": LoadVelocityStepFamily,
    "displacement_step": DisplacementStepFamily,
    "normal_stress_step": NormalStressStepFamily,
}
STEP_DIRECTIONS = ("up", "down")
#: Aliases of scene fields. The names of the scene fields are the keys of
#: ``STEP_FAMILY_BY_SCENE_FIELD``.
SCENE_FIELD_ALIASES: Mapping[str, str] = {"velocity_step": "load_velocity_ratio"}

#: Largest relative tolerance for the step size at which a limit cycle touches the instability norm.
_MAX_RTOL_FOR_SEARCH_BY_LIMIT_CYCLE = 1e-8

#: Maximum width of a bracket that confirms a critical step, relative to the step size.
_MAX_BRACKET_WIDTH_OVER_STEP_SIZE = 0.02

#: Excess over the instability norm above which the first peak of a motion exceeds the norm before
#: the motion can approach a limit cycle.
_MIN_HEIGHT_OF_FIRST_PEAK_ABOVE_NORM = 0.1

#: Instability norm (limit of the dimensionless slip rate) at which the effect of inertia is
#: negligible.
_SLIP_RATE_NORM_OF_NEGLIGIBLE_INERTIA = 1e-3

#: The measure ``LinearStability`` has an output of the same name, which includes inertia and
#: radiation damping.
_QUASI_STATIC_CRITICAL_STIFFNESS = Output(
    "critical_stiffness",
    r"$k_{cr}D_c/\sigma_*$",
    "1",
    "critical stiffness of quasi-static steady sliding at V_star, without inertia or radiation "
    "damping",
    "sigma_*/D_c",
)


@cache
def _build_outputs_for_stepped_field(stepped_field_name: str) -> tuple[Output, ...]:
    """Return the outputs that are computed for a given type of critical step."""
    critical = STEP_FAMILY_BY_SCENE_FIELD[stepped_field_name].critical_output_name
    confirmed = (f"{critical}_stable", f"{critical}_unstable")
    beside = (*confirmed, *STEP_FAMILY_BY_SCENE_FIELD[stepped_field_name].extra_output_names)
    return Output(critical, error=True), *map(Output, beside), _QUASI_STATIC_CRITICAL_STIFFNESS


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class CriticalStep(Measure):
    r"""Smallest step after which the slip rate reaches the instability norm.

    The critical step is a velocity ratio, a displacement (in units of D_c), or a change in normal
    stress (in units of sigma_*). The parameter ``of`` selects the type of the step. The outputs
    include the sizes of two steps that confirm the critical step. The slider settles after the
    smaller step, and becomes unstable after the larger step.

    Parameters
    ----------
    of : str, default: "load_velocity_ratio"
        Type of the step: "load_velocity_ratio", "displacement_step" or "normal_stress_step". The
        scene field of this name is ignored. "velocity_step" is an alias of "load_velocity_ratio".
        After a step of displacement or of normal stress, the load point is held (V_0 = 0) unless
        the scene specifies ``load_velocity_ratio``. Steps of normal stress require a scene whose
        normal stress is not constant. If a decrease in normal stress triggers the instability, the
        direction is "down" and the critical step is negative.
    direction : {"up", "down"}, default: "up"
        Direction of the steps: "up" increases the load, and "down" decreases the load.

    Raises
    ------
    InvalidValue
        If ``of`` or ``direction`` is not one of the choices.

    Notes
    -----
    The instability norm is a threshold of the dimensionless slip rate :math:`V T/(2 \pi D_c)`,
    where :math:`T` is the period of the scene. Under the slip law at constant normal stress and
    critical stiffness, and with an infinite instability norm, the critical step [1]_ is

    .. math:: \frac{V_0}{V_*} = 1 + \frac{a}{b - a},

    or a displacement of :math:`D_c\,a/(b - a)`. The measure computes the boundaries of eqs. 10, 11
    and 14 of [2]_.

    Under the slowness law at constant normal stress and :math:`k \ge k_{cr}`, every quasi-static
    motion stays bounded [3]_. The result is then the smallest step after which the slip rate
    reaches the instability norm. This step grows without limit as the norm increases.

    References
    ----------
    .. [1] Gu, J.-C., Rice, J. R., Ruina, A. L., & Tse, S. T. (1984). Slip motion and stability of a
       single degree of freedom elastic system with rate and state dependent friction. J. Mech.
       Phys. Solids, 32, 167-196.
    .. [2] Effect of varying normal stress on stability and dynamic motion of a spring-slider system
       with rate- and state-dependent friction. Earthquake Science (2014).
       doi:10.1007/s11589-014-0098-4
    .. [3] Ranjith, K., & Rice, J. R. (1999). Stability of quasi-static slip in a single degree of
       freedom elastic system with rate and state dependent friction. J. Mech. Phys. Solids, 47,
       1207-1218.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Scene
    >>> from rsfstudy.measures import CriticalStep
    >>> scene = Scene(normal_stress="constant", a=0.0145, b_over_a=2.0)
    >>> outcome = CriticalStep(of="displacement_step")(scene, Accuracy(rtol=1e-5))
    >>> round(outcome.values["critical_displacement"], 4)
    1.0
    """

    of: str = "load_velocity_ratio"
    direction: str = "up"
    name: ClassVar[str] = "critical_step"
    #: Beginning of the warning that the instability norm is a slow slip rate.
    SLOW_NORM_WARNING_PREFIX: ClassVar = SLOW_INSTABILITY_NORM_WARNING_PREFIX
    typical_rhs_evaluations = 4_000
    needs_time: ClassVar[tuple[bool, ...]] = (False,)

    def __post_init__(self) -> None:
        """Check the fields of the measure, and replace aliases."""
        if isinstance(self.of, str):
            object.__setattr__(self, "of", SCENE_FIELD_ALIASES.get(self.of, self.of))
        if not isinstance(self.of, str) or self.of not in STEP_FAMILY_BY_SCENE_FIELD:
            raise InvalidValue(
                "of",
                self.of,
                "must be the name of a step that the measure can compute",
                choices=STEP_FAMILY_BY_SCENE_FIELD,
            )
        if self.direction not in STEP_DIRECTIONS:
            raise InvalidValue("direction", self.direction, "is unknown", choices=STEP_DIRECTIONS)

    @property
    def primary_output(self) -> str:
        """Name of the main result, which is the critical step size."""
        return STEP_FAMILY_BY_SCENE_FIELD[self.of].critical_output_name

    @property
    def outputs(self) -> Sequence[Output]:
        """Critical step, two steps that confirm the critical step, and other results."""
        return _build_outputs_for_stepped_field(self.of)

    @property
    def solved_fields(self) -> tuple[str, ...]:
        """Scene field that contains the step. The measure ignores its value."""
        return (self.of,)

    @property
    def relative_cost_by_digits(self) -> Mapping[float, float]:
        """Relative cost of the computation for each requested number of digits.

        The relative costs were measured for velocity steps in the study ``accuracy_cost``.
        """
        return {3.0: 0.59, 5.0: 0.74, 7.0: 1.0, 8.0: 1.21, 9.0: 1.58, 10.0: 1.89}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """Return the scale relative to which the error of the critical step is measured.

        The scale is the magnitude of the change in velocity, displacement or normal stress.

        Parameters
        ----------
        scene : Scene
            Scene of the computation.
        values : mapping of str to float or ndarray
            Results by name.

        Returns
        -------
        mapping of str to float
            Scales by name of the result.
        """
        still = 1.0 if self.of == "load_velocity_ratio" else 0.0
        return {self.primary_output: abs(values[self.primary_output] - still)}

    def compute(self, scene: Scene, integrator: Integrator) -> Outcome:
        """Compute the critical step, and confirm it with two motions.

        If the effect of inertia is small below the instability norm, the critical step follows from
        the critical path. If there is no critical path, or if inertia is important, the critical
        step is computed from motions that are integrated forwards in time.

        Parameters
        ----------
        scene : Scene
            Scene to evaluate.
        integrator : Integrator
            Integrator with the requested accuracy.

        Returns
        -------
        Outcome
            Status, results and message.
        """
        check_loading_is_single_step(scene)
        if scene.starts_unsteady:
            rule = "is not a steady state, but critical steps start from steady sliding"
            remedy = (
                "To determine whether the step of this scene triggers an instability, use the "
                "'triggered' measure."
            )
            raise InvalidValue("initial_state", scene.initial_state, rule, remedy=remedy)
        sign = 1 if self.direction == "up" else -1
        steps = STEP_FAMILY_BY_SCENE_FIELD[self.of](scene, sign)
        if steps.max_size <= steps.min_size:
            rate = 0.0 if self.of == "load_velocity_ratio" else steps.scene.load_velocity
            return build_norm_below_load_velocity_outcome(scene, rate)
        below = (
            not stability_after_step.has_closed_orbits_at_critical_stiffness(scene)
            or stability_after_step.compute_stiffness_ratio_after_step(scene) < 1.0
        )
        tolerance = integrator.result_tolerance(10.0)
        if (
            below
            and stability_after_step.has_frictional_damping_only(scene)
            and stability_after_step.is_neutrally_stable(
                steps.build_scene_with_step(steps.max_size), tolerance
            )
        ):
            return _make_outcome_of_neutral_stability(tolerance)
        if not scene.critical_stiffness:
            # Perturbations do not grow, so only the step itself can reach the norm.
            return self._search_with_increasing_step_size(steps, integrator)
        if not is_slow_manifold_inaccurate(scene, integrator):
            # A limit cycle attracts nearby paths weakly, so its boundary needs a smaller tolerance.
            tight = integrator.tightened_to(_MAX_RTOL_FOR_SEARCH_BY_LIMIT_CYCLE)
            for find, own in (
                (find_critical_step_size_by_critical_path, integrator),
                (find_critical_step_size_by_limit_cycle, tight),
            ):
                boundary = find(steps, own)
                if boundary is not None and not steps.inertia_shifts_critical_step_size(
                    boundary.step_size, own.result_tolerance()
                ):
                    outcome = self._confirm_critical_step_by_simulation(steps, boundary, own)
                    if outcome.status is Status.OK:
                        return outcome
            return self._search_with_increasing_step_size(steps, integrator)
        near = _compute_massless_critical_step_size(steps, integrator)
        if near is not None and steps.motions_after_smaller_steps_decay(near):
            bracket = _bracket_log_of_critical_step_size(steps, near, integrator)
            if bracket is not None:
                return self._refine_step_size_bracket(steps, bracket, integrator)
        return self._search_with_increasing_step_size(steps, integrator)

    def _confirm_critical_step_by_simulation(
        self,
        step_family: LoadingStepFamily,
        step_size_estimate: CriticalStepSizeEstimate,
        integrator: Integrator,
    ) -> Outcome:
        """Confirm a critical step by simulating motions after a smaller and a larger step.

        The initial difference between the two step sizes and the critical step size is based on the
        estimated error of the critical step size. If the motions after the two steps do not confirm
        the critical step, the relative difference is increased tenfold, up to 2 %. The reported
        error is then the smallest difference at which the motions confirm the critical step.
        However, if the critical step was computed from a critical path, the difference is not
        increased, and an unconfirmed critical step is rejected. In this case, a smaller step may be
        critical, because oscillations below the instability norm may grow.
        """
        first = (
            step_size_estimate.relative_error
            if step_size_estimate.uses_forward_integration
            else 3.0 * step_size_estimate.relative_error
        )
        first = width = max(first, integrator.result_tolerance())
        while width < _MAX_BRACKET_WIDTH_OVER_STEP_SIZE:
            inner, outer = (
                step_size_estimate.step_size * (1.0 - width),
                step_size_estimate.step_size * (1.0 + width),
            )
            below, above = (
                _compute_log_rate_above_norm_after_step(step_family, size, integrator)
                for size in (inner, outer)
            )
            if below is not None and above is not None and above >= 0.0 > below:
                at_once = width == first and not step_size_estimate.uses_forward_integration
                relative = step_size_estimate.relative_error if at_once else width
                error = step_family.compute_field_value_error(
                    step_size_estimate.step_size, relative
                )
                values = self._build_output_values(
                    step_family,
                    step_size_estimate.step_size,
                    error,
                    step_family.step_size_to_field_value(inner),
                    step_family.step_size_to_field_value(outer),
                )
                load = step_family.build_scene_with_step(step_size_estimate.step_size).load_velocity
                return Outcome(
                    Status.OK, values, build_slow_instability_norm_warning(step_family.scene, load)
                )
            if not (
                step_size_estimate.uses_forward_integration
                or step_size_estimate.limit_cycle_touches_instability_norm
            ):
                break
            if (
                step_size_estimate.limit_cycle_touches_instability_norm
                and below is not None
                and below > _MIN_HEIGHT_OF_FIRST_PEAK_ABOVE_NORM
            ):
                break
            width *= 10.0
        return Outcome(
            Status.UNVERIFIED,
            self._build_output_values(step_family),
            "a stable and an unstable step within 2 % could not be found for "
            f"{self.primary_output} = "
            f"{step_family.step_size_to_field_value(step_size_estimate.step_size):.9g}",
        )

    def _build_output_values(
        self,
        step_family: LoadingStepFamily,
        step_size: float = math.nan,
        field_value_error: float = math.nan,
        stable_field_value: float = math.nan,
        unstable_field_value: float = math.nan,
    ) -> dict[str, float]:
        """Return the results by name. The values of missing results are NaN."""
        of = self.primary_output
        return {
            of: step_family.step_size_to_field_value(step_size),
            f"{of}_error": field_value_error,
            f"{of}_stable": stable_field_value,
            f"{of}_unstable": unstable_field_value,
            "critical_stiffness": step_family.scene.critical_stiffness,
            **step_family.compute_extra_output_values(step_size),
        }

    def _search_with_increasing_step_size(
        self, step_family: LoadingStepFamily, integrator: Integrator
    ) -> Outcome:
        """Find the critical step from motions after steps of increasing size.

        The step size increases until the motion after the step reaches the instability norm. The
        interval that contains the critical step size is then refined.
        """
        smallest, largest = math.log(step_family.min_size), math.log(step_family.max_size)
        spacing = (largest - smallest) / max(1, math.ceil((largest - smallest) / math.log(2.0)))
        stable: float | None = None
        unstable = smallest
        while unstable <= largest + 1e-9:
            try:
                if motion_after_step.motion_reaches_instability_norm(
                    step_family.build_scene_with_step(math.exp(unstable)), integrator
                ):
                    break
            except MotionStopped as halt:
                if halt.status is Status.WORK_BUDGET_SPENT or stable is None:
                    raise
                return self._build_outcome_without_critical_step(
                    step_family, math.exp(stable), integrator, f", because {halt}"
                )
            stable, unstable = unstable, unstable + spacing
        else:
            return self._build_outcome_without_critical_step(
                step_family, step_family.max_size, integrator
            )
        if stable is None:
            return Outcome(
                Status.UNSTABLE_AT_ANY_STEP,
                self._build_output_values(
                    step_family,
                    unstable_field_value=step_family.step_size_to_field_value(step_family.min_size),
                ),
                f"even a step to {step_family.step_size_to_field_value(step_family.min_size):.6g} "
                "is unstable",
            )
        return self._refine_step_size_bracket(step_family, (stable, unstable), integrator)

    def _refine_step_size_bracket(
        self,
        step_family: LoadingStepFamily,
        log_step_size_bracket: tuple[float, float],
        integrator: Integrator,
    ) -> Outcome:
        """Find the critical step size between a stable and an unstable step size.

        The excess of ln V over the instability norm changes sign at the critical step size. If a
        motion cannot continue, the result is the centre of the remaining interval of ln(step size).
        """
        stable, unstable = log_step_size_bracket
        tolerance = max(
            step_family.compute_step_size_tolerance(
                math.exp(unstable), integrator.result_tolerance()
            ),
            Accuracy.MIN_RTOL,
        )
        integrator = integrator.with_rtol(tolerance)

        def excess(log_size: float) -> float:
            nonlocal stable, unstable
            found = motion_after_step.compute_log_rate_above_instability_norm(
                step_family.build_scene_with_step(math.exp(log_size)), integrator
            )
            if found >= 0.0:
                unstable = min(unstable, log_size)
            else:
                stable = max(stable, log_size)
            return found

        try:
            log_size = toms748(excess, *log_step_size_bracket, xtol=0.5 * tolerance, rtol=1e-15)
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            if unstable - stable > _MAX_BRACKET_WIDTH_OVER_STEP_SIZE:
                return self._build_outcome_without_critical_step(
                    step_family, math.exp(log_step_size_bracket[0]), integrator, f", because {halt}"
                )
            log_size = 0.5 * (stable + unstable)
        # Motions with the same tolerances would repeat the same errors, so the verification uses
        # smaller tolerances.
        size = math.exp(log_size)
        error = max(
            tolerance + step_family.estimate_error_near_neutral_stability(size, tolerance),
            unstable - stable,
        )
        boundary = CriticalStepSizeEstimate(size, error, uses_forward_integration=True)
        return self._confirm_critical_step_by_simulation(
            step_family, boundary, integrator.refined()
        )

    def _build_outcome_without_critical_step(
        self,
        step_family: LoadingStepFamily,
        largest_step_size: float,
        integrator: Integrator,
        reason: str = "",
    ) -> Outcome:
        """Return the outcome if no step up to the largest size is critical.

        If inertia keeps the slip rate below the instability norm, the status is
        ``norm_unreachable``. If the largest step itself raises the slip rate to the norm, the
        status is ``ok``. Otherwise, the status is ``stable_for_all_steps``.
        """
        if (
            step_family.scene.has_mass
            and _compute_massless_critical_step_size(step_family, integrator) is not None
        ):
            return Outcome(
                Status.NORM_UNREACHABLE,
                self._build_output_values(
                    step_family,
                    stable_field_value=step_family.step_size_to_field_value(largest_step_size),
                ),
                "inertia keeps the slip rate below the instability norm "
                f"{step_family.scene.instability_norm:g}",
            )
        if (
            step_family.largest_step_immediately_reaches_norm
            and not step_family.scene.has_mass
            and not reason
        ):
            value = step_family.step_size_to_field_value(largest_step_size)
            values = self._build_output_values(
                step_family,
                largest_step_size,
                largest_step_size * Accuracy.RELATIVE_ROUNDING_ERROR,
                value,
                value,
            )
            return Outcome(
                Status.OK, values, "the jump of slip rate at the step itself is critical"
            )
        return Outcome(
            Status.STABLE_FOR_ALL_STEPS,
            self._build_output_values(
                step_family,
                stable_field_value=step_family.step_size_to_field_value(largest_step_size),
            ),
            f"stable for every step {'up' if self.direction == 'up' else 'down'} to "
            f"{step_family.step_size_to_field_value(largest_step_size):.6g}{reason}",
        )


def _compute_log_rate_above_norm_after_step(
    step_family: LoadingStepFamily, step_size: float, integrator: Integrator
) -> float | None:
    """Compute the excess of ln V over the norm after a step of a given size.

    The result is None if the motion cannot continue.
    """
    try:
        return motion_after_step.compute_log_rate_above_instability_norm(
            step_family.build_scene_with_step(step_size), integrator
        )
    except MotionStopped as halt:
        if halt.status is Status.WORK_BUDGET_SPENT:
            raise
        return None


def _make_outcome_of_neutral_stability(tolerance: float) -> Outcome:
    """Build the outcome of a scene in which small perturbations neither grow nor decay."""
    message = (
        f"the stiffness differs from the critical stiffness by less than {tolerance:.1g}, so the "
        "growth of perturbations is not known. Use another stiffness, for example "
        "stiffness_ratio=1.001. If the difference is not 0, you can also use a smaller rtol"
    )
    return Outcome(Status.UNVERIFIED, message=message)


def _compute_massless_critical_step_size(
    step_family: LoadingStepFamily, integrator: Integrator
) -> float | None:
    """Compute the critical step size of the same slider without inertia.

    The instability norm is limited to a value at which inertia has little effect. The computation
    requires few evaluations. The result is None if there is no critical path.
    """
    norm = min(step_family.scene.instability_norm, _SLIP_RATE_NORM_OF_NEGLIGIBLE_INERTIA)
    massless = type(step_family)(
        step_family.scene.without_mass().with_(instability_norm=norm), step_family.sign
    )
    if massless.max_size <= massless.min_size or not massless.scene.critical_stiffness:
        return None
    return next(massless.iterate_step_sizes_by_critical_path((1e-6,), integrator), None)


def _bracket_log_of_critical_step_size(
    step_family: LoadingStepFamily, step_size_guess: float, integrator: Integrator
) -> tuple[float, float] | None:
    """Find a stable and an unstable step size around a guess.

    If the guess is unstable, the search tests sizes down to 0.73 times the guess. If the guess is
    stable, the search tests sizes up to 1.37 times the guess. The result is None if the search
    finds no bracket.
    """
    middle = math.log(step_size_guess)
    reached = motion_after_step.motion_reaches_instability_norm(
        step_family.build_scene_with_step(step_size_guess), integrator
    )
    inner, reach = middle, 1e-4
    while reach < 1.5:
        outer = middle - reach if reached else min(middle + reach, math.log(step_family.max_size))
        if (
            motion_after_step.motion_reaches_instability_norm(
                step_family.build_scene_with_step(math.exp(outer)), integrator
            )
            != reached
        ):
            return (outer, inner) if reached else (inner, outer)
        inner, reach = outer, 5.0 * reach
    return None
