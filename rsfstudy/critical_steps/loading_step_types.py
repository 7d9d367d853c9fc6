"""Steps of load point velocity, load point displacement and normal stress."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.loading_step_families import (
    LOG_RATE_ADDED_TO_MAX_STEP_FOR_INERTIA,
    LOOSE_INTEGRATION_TOLERANCE,
    MAX_NEGLECTED_INERTIA_EFFECT_OVER_RTOL,
    MIN_STEP_SIZE,
    LoadingStepFamily,
    LoadingStepFamilySolvedByShooting,
    compute_slip_lag_due_to_inertia,
)
from rsfstudy.critical_steps.motion_after_step import motion_reaches_instability_norm
from rsfstudy.critical_steps.stability_after_step import (
    compute_stability_margin,
    has_closed_orbits_at_critical_stiffness,
    is_linearly_stable,
)
from rsfstudy.motion import Integrator, MotionStopped
from rsfstudy.slider import (
    Scene,
    compute_coulomb_effective_friction,
)
from rsfstudy.status import Status

#: Smallest load point velocity of the search, in units of V_*.
MIN_SEARCHED_LOAD_VELOCITY = 1e-20
#: Minimum value of b/a - 1 in the formula for the first guess of the critical step size. The
#: minimum of b/a - 1 is necessary because some laws weaken friction although b < a.
_MIN_B_OVER_A_MINUS_ONE_FOR_STEP_GUESS = 1e-6
#: Largest spring stress after a step, in units of sigma_*.
_MAX_SPRING_STRESS_AFTER_STEP = 1e6
_LOG_OF_MAX_FLOAT = math.log(sys.float_info.max)
#: Largest |ln(sigma/sigma_*)| after a step.
_MAX_LOG_NORMAL_STRESS_RATIO = math.log(1e3)
#: Relative accuracy to which the largest step size is computed.
_RTOL_FOR_FINDING_MAX_STEP_SIZE = 1e-6
#: Minimum effective friction in the formula for the first guess of the critical step size, as a
#: fraction of mu_*. The effect of normal stress on the state may cancel friction completely.
_MIN_EFFECTIVE_FRICTION_OVER_MU_STAR = 0.1


class LoadVelocityStepFamily(LoadingStepFamilySolvedByShooting):
    """Family of load point velocity steps, whose size is ``|ln(V_0/V_*)|``.

    Parameters
    ----------
    scene : Scene
        Scene on which the steps are imposed.
    sign : {1, -1}
        Direction of the steps, 1 for upward and -1 for downward.
    """

    stepped_field_name = "load_velocity_ratio"
    critical_output_name = "critical_velocity_ratio"
    sign_of_triggering_steps = 1

    def build_critical_path_factory(
        self, integrator: Integrator
    ) -> Callable[[float], CriticalPath]:
        """Return a function that computes the critical path after a step.

        The critical path depends on the step size only through the load point velocity. See
        ``LoadingStepFamilySolvedByShooting.build_critical_path_factory``.
        """
        path = CriticalPath.from_scene(self.scene, integrator)
        return lambda size: path.with_load_velocity(self.step_size_to_field_value(size))

    def step_size_to_field_value(self, step_size: float) -> float:
        """Return the velocity ratio V_0/V_* of a step of a given size.

        See ``LoadingStepFamily.step_size_to_field_value``.
        """
        return math.exp(self.sign * step_size)

    def _guess_critical_step_size(self) -> float:
        """Estimate the critical step size from the closed forms of Gu et al. (1984).

        The closed forms apply to the slip law.
        """
        weakening = max(self.scene.parts.law.b_over_a - 1.0, _MIN_B_OVER_A_MINUS_ONE_FOR_STEP_GUESS)
        return float(np.logaddexp(0.0, self.scene.stiffness_ratio - 1.0 - math.log(weakening)))

    def _find_misfit_sign_from_motion(self, scene: Scene, integrator: Integrator) -> float:
        """Return the sign of the misfit, computed by integration forwards in time.

        The result is NaN for downward steps.
        """
        if self.sign != self.sign_of_triggering_steps:
            return math.nan
        return -1.0 if _motion_reaches_norm_at_loose_tolerance(scene, integrator) else 1.0

    def _compute_max_step_size(self) -> float:
        """Return the largest step size of the search.

        After the largest upward step, the load point velocity corresponds to the instability norm.
        After the largest downward step, the load point has the smallest velocity at which sliding
        can be steady.
        """
        if self.sign > 0:
            return self.scene.log_slip_rate_at_instability
        scene, slowest = self.scene, self.scene.find_min_steady_log_slip_rate()
        return (
            min(-math.log(MIN_SEARCHED_LOAD_VELOCITY), -slowest)
            if scene.log_slip_rate_at_instability > 0.0
            else 0.0
        )


class DisplacementStepFamily(LoadingStepFamily):
    """Family of displacement steps, whose size is ``|d|`` in units of D_c.

    The load point is held after the step, unless the scene specifies a load point velocity.

    Parameters
    ----------
    scene : Scene
        Scene on which the steps are imposed.
    sign : {1, -1}
        Direction of the steps, 1 for upward and -1 for downward.
    """

    stepped_field_name = "displacement_step"
    critical_output_name = "critical_displacement"
    extra_output_names = ("slip_rate_after_step", "slip_rate_after_closed_form_step")

    def __init__(self, scene: Scene, sign: int) -> None:
        if scene.load_velocity_ratio is None:
            scene = scene.with_(load_velocity_ratio=0.0)
        super().__init__(scene, sign)

    def step_size_to_field_value(self, step_size: float) -> float:
        """Return the displacement of a step of a given size, in units of D_c.

        See ``LoadingStepFamily.step_size_to_field_value``.
        """
        return self.sign * step_size

    def compute_field_value_error(self, step_size: float, step_size_relative_error: float) -> float:
        """Return the error of the displacement, in units of D_c.

        See ``LoadingStepFamily.compute_field_value_error``.
        """
        return step_size * step_size_relative_error

    def inertia_shifts_critical_step_size(self, step_size: float, tolerance: float) -> bool:
        """Return True if inertia changes the critical step size significantly.

        If the scene has inertia, the slider follows the critical path with a delay, which changes
        the critical step size in two ways. First, the load point moves during the delay. Second,
        the state evolves less because the slip rate is lower. The resulting difference in the state
        is b/2 times the slip by which the slider lags behind. See
        ``LoadingStepFamily.inertia_shifts_critical_step_size``.
        """
        scene = self.scene
        if not scene.has_mass:
            return False
        behind, rate = compute_slip_lag_due_to_inertia(self.build_scene_with_step(step_size))
        missed = (
            0.5
            * scene.a
            * scene.parts.law.steady_state_change_per_log_rate_over_a
            / scene.stiffness
        )
        loaded = scene.load_velocity / rate if rate else 0.0
        return (
            behind * (loaded + missed)
            > MAX_NEGLECTED_INERTIA_EFFECT_OVER_RTOL * tolerance * step_size
        )

    def motions_after_smaller_steps_decay(self, step_size: float) -> bool:
        """Return True if steady sliding is stable after every smaller step.

        A displacement step does not change the stability of steady sliding. See
        ``LoadingStepFamily.motions_after_smaller_steps_decay``.
        """
        return is_linearly_stable(self.scene)

    def compute_extra_output_values(self, step_size: float) -> dict[str, float]:
        """Return the slip rates immediately after two steps, in units of V_*.

        The first step is the critical step. The second step has the displacement D_c a/(b - a),
        which is the closed form of the critical step (eq. 13 of doi:10.1007/s11589-014-0098-4). The
        slip rate is infinite if it exceeds the floating-point range. See
        ``LoadingStepFamily.compute_extra_output_values``.
        """

        def after(step: float) -> float:
            log_slip_rate = self.scene.compute_quasi_static_log_slip_rate(
                self.scene.stiffness * step, 0.0
            )
            return math.exp(log_slip_rate) if log_slip_rate < _LOG_OF_MAX_FLOAT else math.inf

        weakening = self.scene.parts.law.b_over_a - 1.0
        closed_form = after(self.sign / weakening) if weakening > 0.0 else math.nan
        critical = (
            math.nan if math.isnan(step_size) else after(self.step_size_to_field_value(step_size))
        )
        return dict(zip(self.extra_output_names, (critical, closed_form), strict=True))

    def iterate_step_sizes_by_critical_path(
        self, local_tolerances: Iterable[float], integrator: Integrator
    ) -> Iterator[float]:
        """Yield the size of the step at which the critical path starts.

        A displacement step changes only the spring stress, and the state Psi remains zero. The
        critical step therefore follows from the point of the critical path at which Psi is zero,
        and each tolerance needs only one integration. See
        ``LoadingStepFamily.iterate_step_sizes_by_critical_path``.
        """
        path, sign = CriticalPath.from_scene(self.scene, integrator), self.sign
        for tolerance in local_tolerances:
            start = path.find_path_start_by_backward_integration(
                tolerance, ("psi", 0.0), lambda point: sign * point.spring_stress > 0.0
            )
            if start is None:
                return
            yield abs(start.spring_stress / self.scene.stiffness)

    def _compute_max_step_size(self) -> float:
        """Return the largest step size of the search.

        The largest upward step raises the slip rate to the instability norm immediately. If the
        scene has inertia, the range of step sizes is extended, because the slip rate rises with a
        delay while stress relaxes. After the largest downward step, the shear stress or the normal
        stress is zero.
        """
        scene = self.scene
        if max(0.0, scene.log_load_velocity) >= scene.log_slip_rate_at_instability:
            return 0.0
        if self.sign < 0:
            weakest = scene.parts.normal_stress.compute_frictional_stress_lower_bound(scene)
            return min(scene.mu_star, -weakest) / scene.stiffness
        farther = LOG_RATE_ADDED_TO_MAX_STEP_FOR_INERTIA if scene.has_mass else 0.0
        friction = scene.frictional_stress_from_strength(
            scene.a * (scene.log_slip_rate_at_instability + farther)
        )
        if friction is None:
            return _MAX_SPRING_STRESS_AFTER_STEP / scene.stiffness
        self.largest_step_immediately_reaches_norm = True
        return (
            friction + scene.dynamics.radiated_stress(scene.log_slip_rate_at_instability)
        ) / scene.stiffness


class NormalStressStepFamily(LoadingStepFamilySolvedByShooting):
    """Family of normal stress steps, whose size is ``|ln(1 + step/sigma_*)|``.

    The load point is held after the step, unless the scene specifies a load point velocity. The
    critical path depends on the size, because the step changes the normal stress that acts on
    friction.

    Parameters
    ----------
    scene : Scene
        Scene on which the steps are imposed.
    sign : {1, -1}
        Direction of the steps, 1 for upward and -1 for downward.
    """

    stepped_field_name = "normal_stress_step"
    critical_output_name = "critical_normal_stress_step"
    sign_of_triggering_steps = -1
    extra_output_names = ("slip_rate_after_step",)

    def __init__(self, scene: Scene, sign: int) -> None:
        held = 0.0 if scene.load_velocity_ratio is None else scene.load_velocity_ratio
        scene = scene.with_(load_velocity_ratio=held, normal_stress_step=0.0)
        # If the normal stress of the slider is constant, this call raises InvalidValue.
        scene.with_(normal_stress_step=sign * MIN_STEP_SIZE)
        super().__init__(scene, sign)
        # The change in ln V is larger than the size by a factor of mu_*/a.
        self.min_size = min(self.min_size, MIN_STEP_SIZE * scene.a / scene.mu_star)

    def step_size_to_field_value(self, step_size: float) -> float:
        """Return the change in normal stress for a given step size, in units of sigma_*.

        See ``LoadingStepFamily.step_size_to_field_value``.
        """
        return math.expm1(self.sign * step_size)

    def inertia_shifts_critical_step_size(self, step_size: float, tolerance: float) -> bool:
        """Return True if inertia changes the critical step size significantly.

        If the scene has inertia, the slip rate rises with a delay after the step. The effect of
        inertia on the critical step size depends on the slip rate immediately after the step. See
        ``LoadingStepFamily.inertia_shifts_critical_step_size``.
        """
        scene = self.scene
        behind = (
            compute_slip_lag_due_to_inertia(self.build_scene_with_step(step_size))[0]
            if scene.has_mass
            else 0.0
        )
        missed = max(1.0, 0.5 * scene.parts.law.steady_state_change_per_log_rate_over_a) * behind
        return (
            missed
            > MAX_NEGLECTED_INERTIA_EFFECT_OVER_RTOL
            * tolerance
            * step_size
            * scene.mu_star
            / scene.a
        )

    def estimate_error_near_neutral_stability(self, step_size: float, tolerance: float) -> float:
        """Return the error of the step size close to neutral stability.

        The error follows from two facts: the critical stiffness is proportional to normal stress,
        and the step size is the logarithm of normal stress. See
        ``LoadingStepFamily.estimate_error_near_neutral_stability``.
        """
        scene = self.build_scene_with_step(step_size)
        near = (
            has_closed_orbits_at_critical_stiffness(scene)
            and abs(compute_stability_margin(scene)) < 10.0 * tolerance
        )
        return 2.0 * tolerance / step_size if near else 0.0

    def compute_extra_output_values(self, step_size: float) -> dict[str, float]:
        """Return the slip rate immediately after the critical step.

        The slip rate is in units of V_*. See ``LoadingStepFamily.compute_extra_output_values``.
        """
        rate = (
            math.nan
            if math.isnan(step_size)
            else math.exp(self._compute_log_slip_rate_after_step(step_size))
        )
        return dict(zip(self.extra_output_names, (rate,), strict=True))

    def _guess_critical_step_size(self) -> float:
        """Return a guess of the critical step size.

        For an increase in normal stress from stable sliding, the guess is the step after which
        steady sliding becomes unstable. Otherwise, the guess is the step whose change in Coulomb
        stress equals the instability threshold of the slip law.
        """
        scene, law = self.scene, self.scene.parts.law
        if self.sign > 0 and 1.0 < scene.stiffness_ratio < math.inf:
            return math.log(scene.stiffness_ratio)
        _follows, alpha = scene.parts.normal_stress.coupling or (0.0, 0.0)
        friction = compute_coulomb_effective_friction(scene.mu_star, max(law.b_over_a, 1.0), alpha)
        friction = max(abs(friction), _MIN_EFFECTIVE_FRICTION_OVER_MU_STAR * scene.mu_star)
        return scene.a * scene.stiffness_ratio / friction

    def _find_misfit_sign_from_motion(self, scene: Scene, integrator: Integrator) -> float:
        """Return the sign of the misfit, computed by integration forwards in time.

        The result is NaN for increases in normal stress, or if the motion cannot continue.
        """
        if self.sign != self.sign_of_triggering_steps:
            return math.nan
        try:
            return -1.0 if _motion_reaches_norm_at_loose_tolerance(scene, integrator) else 1.0
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            return math.nan

    def _compute_max_step_size(self) -> float:
        """Return the largest step size of the search.

        The largest step raises the slip rate to the instability norm immediately. With inertia, the
        range of step sizes is extended, because the slip rate rises with a delay while stress
        relaxes. An increase in normal stress strengthens friction directly and weakens friction by
        changing the state. The slip rate rises only if the weakening is the larger effect. If the
        load point moves, the search is limited to steps after which sliding can be steady.
        """
        scene = self.scene
        if max(0.0, scene.log_load_velocity) >= scene.log_slip_rate_at_instability:
            return 0.0
        level = scene.log_slip_rate_at_instability + (
            LOG_RATE_ADDED_TO_MAX_STEP_FOR_INERTIA if scene.has_mass else 0.0
        )

        def excess(size: float) -> float:
            return self._compute_log_slip_rate_after_step(size) - level

        if excess(0.0) >= 0.0:
            return 0.0
        largest = self._compute_max_log_normal_stress_ratio()
        if excess(largest) > 0.0:
            self.largest_step_immediately_reaches_norm = True
            largest = float(brentq(excess, 0.0, largest, xtol=1e-15, rtol=1e-14))
        if self._allows_steady_sliding(largest):
            return largest
        self.largest_step_immediately_reaches_norm, smaller = False, 0.0
        while largest - smaller > _RTOL_FOR_FINDING_MAX_STEP_SIZE * largest:
            middle = 0.5 * (smaller + largest)
            smaller, largest = (
                (middle, largest) if self._allows_steady_sliding(middle) else (smaller, middle)
            )
        return smaller

    def _compute_max_log_normal_stress_ratio(self) -> float:
        """Return the largest step size after which the normal stress is positive.

        If normal stress depends on shear stress, sigma_3 must remain positive after a decrease in
        normal stress. If sigma_3 were negative, friction would decrease faster than the spring
        stress as the slider slips, at any slip rate.
        """
        follows, _alpha = self.scene.parts.normal_stress.coupling or (0.0, 0.0)
        if self.sign > 0 or not follows:
            return _MAX_LOG_NORMAL_STRESS_RATIO
        return min(
            _MAX_LOG_NORMAL_STRESS_RATIO, (1.0 - 1e-6) * -math.log(self.scene.mu_star * follows)
        )

    def _allows_steady_sliding(self, step_size: float) -> bool:
        """Return True if sliding can be steady after the step.

        The result is also True if the load point is held, because steady sliding is not required in
        this case.
        """
        scene = self.build_scene_with_step(step_size)
        load = scene.log_load_velocity
        return load == -math.inf or scene.compute_steady_sliding(load) is not None

    def _compute_log_slip_rate_after_step(self, step_size: float) -> float:
        """Return ln(V/V_*) immediately after the step, for the slider without inertia."""
        scene = self.build_scene_with_step(step_size).without_mass()
        steady_states = scene.compute_steady_states(0.0, 0.0)
        return scene.compute_slow_manifold_point(
            scene.spring_stress_step, steady_states
        ).log_slip_rate


def _motion_reaches_norm_at_loose_tolerance(scene: Scene, integrator: Integrator) -> bool:
    """Return True if a motion with a loose tolerance reaches the norm."""
    loose = replace(integrator.accuracy, rtol=LOOSE_INTEGRATION_TOLERANCE, refinement=1.0)
    return motion_reaches_instability_norm(scene, integrator.with_accuracy(loose))
