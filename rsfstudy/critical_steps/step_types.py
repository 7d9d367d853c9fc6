"""Kinds of steps: of load point velocity, of load point displacement, and of normal stress."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator

import numpy as np
from scipy.optimize import brentq

from rsfstudy.critical_steps.critical_path import CriticalPath
from rsfstudy.critical_steps.forward_motion import (
    is_linearly_stable,
    may_have_closed_orbits,
    reaches_norm,
    stability_margin,
)
from rsfstudy.critical_steps.shooting import (
    INERTIA_TOLERANCE_FRACTION,
    INERTIAL_LOG_RATE_MARGIN,
    LOOSE_TOLERANCE,
    MIN_STEP_SIZE,
    ShootingSteps,
    StepFamily,
    inertial_slip_lag,
)
from rsfstudy.motion import Accuracy, MotionStopped, WorkMeter, manifold_point
from rsfstudy.slider import (
    Scene,
    compute_steady_states,
    effective_friction,
    log_slip_rate_at,
    min_steady_log_slip_rate,
    steady_sliding,
    stress_after_jump,
)
from rsfstudy.status import Status

#: Slowest load point velocity over V_* that the search goes down to.
MIN_LOAD_VELOCITY = 1e-20
#: b/a - 1 that is guessed from at least: some laws weaken without it.
_MIN_GUESSED_WEAKENING = 1e-6
#: Spring stress over sigma_* that no step goes beyond.
_MAX_SPRING_STRESS = 1e6
_MAX_FLOAT_LOGARITHM = math.log(sys.float_info.max)
#: |ln(sigma/sigma_*)| that no step goes beyond.
_MAX_LOG_STRESS_CHANGE = math.log(1e3)
#: Part of the largest step to which it is found.
_MAX_SIZE_RTOL = 1e-6
#: Effective friction over mu_* that is guessed from at least: the state may take all of it.
_MIN_RELATIVE_FRICTION = 0.1


class RateSteps(ShootingSteps):
    """Steps of load point velocity; the size is |ln(V_0/V_*)|."""

    quantity = "critical_velocity_ratio"
    trigger_sign = 1

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(load_velocity_ratio=self.step_value(size))

    def path_factory(self, engine: str) -> Callable[[float], CriticalPath]:
        path = CriticalPath.of_scene(self.scene, engine)
        return lambda size: path.with_load_velocity(self.step_value(size))

    def step_value(self, size: float) -> float:
        return math.exp(self.sign * size)

    def _guess_size(self) -> float:
        """Of the size of the closed forms for the slip law (Gu et al. 1984)."""
        weakening = max(self.scene.parts.law.b_over_a - 1.0, _MIN_GUESSED_WEAKENING)
        return float(np.logaddexp(0.0, self.scene.stiffness_ratio - 1.0 - math.log(weakening)))

    def _misfit_without_path(self, scene: Scene, meter: WorkMeter) -> float:
        """Far from the boundary an upward step still has a verdict."""
        if self.sign != self.trigger_sign:
            return math.nan
        return -1.0 if reaches_norm(scene, Accuracy(LOOSE_TOLERANCE), meter) else 1.0

    def _compute_max_size(self) -> float:
        """Up: V_0 at the norm itself. Down: the slowest V_0 that has a steady state."""
        if self.sign > 0:
            return self.scene.log_instability_rate
        scene, slowest = self.scene, min_steady_log_slip_rate(self.scene)
        return (
            min(-math.log(MIN_LOAD_VELOCITY), -slowest) if scene.log_instability_rate > 0.0 else 0.0
        )


class DisplacementSteps(StepFamily):
    """Steps of load point displacement; the size is |d| in D_c. The load point is then held, unless
    the scene moves it.
    """

    quantity = "critical_displacement"
    extra_outputs = ("slip_rate_after_step", "slip_rate_after_closed_form_step")

    def __init__(self, scene: Scene, sign: int) -> None:
        if scene.load_velocity_ratio is None:
            scene = scene.with_(load_velocity_ratio=0.0)
        super().__init__(scene, sign)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(displacement_step=self.step_value(size))

    def step_value(self, size: float) -> float:
        return self.sign * size

    def value_error(self, size: float, relative_error: float) -> float:
        return size * relative_error

    def inertia_shifts_size(self, size: float, rtol: float) -> bool:
        """The slider falls behind on the same path, but for what the load point moves meanwhile,
        and for half of b times that slip, which the state misses because slip rate is lower.
        """
        scene = self.scene
        if not scene.has_mass:
            return False
        behind, rate = inertial_slip_lag(self.scene_at(size))
        missed = 0.5 * scene.a * scene.parts.law.state_change_over_a / scene.stiffness
        loaded = scene.load_velocity / rate if rate else 0.0
        return behind * (loaded + missed) > INERTIA_TOLERANCE_FRACTION * rtol * size

    def smaller_steps_decay(self, size: float) -> bool:
        """They move nothing that steady sliding depends on."""
        return is_linearly_stable(self.scene)

    def extra_values(self, size: float) -> dict[str, float]:
        """Slip rates just after the critical step, and after one of D_c a/(b-a) (eq. 13), which
        by a stiff spring is beyond the largest number: infinite.
        """

        def after(step: float) -> float:
            log_slip_rate = log_slip_rate_at(self.scene, self.scene.stiffness * step, 0.0)
            return math.exp(log_slip_rate) if log_slip_rate < _MAX_FLOAT_LOGARITHM else math.inf

        weakening = self.scene.parts.law.b_over_a - 1.0
        closed_form = after(self.sign / weakening) if weakening > 0.0 else math.nan
        critical = math.nan if math.isnan(size) else after(self.step_value(size))
        return dict(zip(self.extra_outputs, (critical, closed_form), strict=True))

    def find_path_sizes(self, tolerances: Iterable[float], meter: WorkMeter) -> Iterator[float]:
        """One integration each: a displacement step leaves Psi = 0 and moves the spring stress
        alone, so that it starts wherever the critical path has Psi = 0.
        """
        path, sign = CriticalPath.of_scene(self.scene, meter.engine), self.sign
        for tolerance in tolerances:
            start = path.find_start(
                tolerance, meter, ("psi", 0.0), lambda point: sign * point.spring_stress > 0.0
            )
            if start is None:
                return
            yield abs(start.spring_stress / self.scene.stiffness)

    def _compute_max_size(self) -> float:
        """Up: the step that itself takes the slip rate to the norm, and somewhat farther with mass,
        because slip rate rises to that while stress relaxes. Down: the step that ends shear stress.
        """
        scene = self.scene
        if max(0.0, scene.log_load_velocity) >= scene.log_instability_rate:
            return 0.0
        if self.sign < 0:
            weakest = scene.parts.normal_stress.min_frictional_stress(scene)
            return min(scene.mu_star, -weakest) / scene.stiffness
        farther = INERTIAL_LOG_RATE_MARGIN if scene.has_mass else 0.0
        friction = stress_after_jump(scene, scene.a * (scene.log_instability_rate + farther))
        if friction is None:
            return _MAX_SPRING_STRESS / scene.stiffness
        self.largest_step_reaches_norm = True
        return (
            friction + scene.dynamics.radiated_stress(scene.log_instability_rate)
        ) / scene.stiffness


class NormalStressSteps(ShootingSteps):
    """Steps of imposed normal stress; the size is |ln(1 + step/sigma_*)|. The load point is then
    held, unless the scene moves it.

    Friction after the step is that of other normal stress, and so is the critical path.
    """

    quantity = "critical_normal_stress_step"
    trigger_sign = -1
    extra_outputs = ("slip_rate_after_step",)

    def __init__(self, scene: Scene, sign: int) -> None:
        held = 0.0 if scene.load_velocity_ratio is None else scene.load_velocity_ratio
        scene = scene.with_(load_velocity_ratio=held, normal_stress_step=0.0)
        # a slider whose normal stress nothing can change says so here
        scene.with_(normal_stress_step=sign * MIN_STEP_SIZE)
        super().__init__(scene, sign)
        # what such a step does to ln V is larger by mu_*/a
        self.min_size = min(self.min_size, MIN_STEP_SIZE * scene.a / scene.mu_star)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(normal_stress_step=self.step_value(size))

    def step_value(self, size: float) -> float:
        return math.expm1(self.sign * size)

    def inertia_shifts_size(self, size: float, rtol: float) -> bool:
        """The slider falls behind while slip rate rises; by how much of the size is a matter of
        what slip rate the step leads to.
        """
        scene = self.scene
        behind = inertial_slip_lag(self.scene_at(size))[0] if scene.has_mass else 0.0
        missed = max(1.0, 0.5 * scene.parts.law.state_change_over_a) * behind
        return missed > INERTIA_TOLERANCE_FRACTION * rtol * size * scene.mu_star / scene.a

    def neutral_size_error(self, size: float, rtol: float) -> float:
        """Critical stiffness goes with normal stress, and its logarithm with the size."""
        scene = self.scene_at(size)
        near = may_have_closed_orbits(scene) and abs(stability_margin(scene)) < 10.0 * rtol
        return 2.0 * rtol / size if near else 0.0

    def extra_values(self, size: float) -> dict[str, float]:
        """Slip rate just after the critical step."""
        rate = math.nan if math.isnan(size) else math.exp(self._log_slip_rate_after(size))
        return dict(zip(self.extra_outputs, (rate,), strict=True))

    def _guess_size(self) -> float:
        """A Coulomb stress change that takes the slip law to its threshold; a rise to where sliding
        comes to be unstable.
        """
        scene, law = self.scene, self.scene.parts.law
        if self.sign > 0 and 1.0 < scene.stiffness_ratio < math.inf:
            return math.log(scene.stiffness_ratio)
        _follows, alpha = scene.parts.normal_stress.coupling or (0.0, 0.0)
        friction = effective_friction(scene.mu_star, max(law.b_over_a, 1.0), alpha)
        friction = max(abs(friction), _MIN_RELATIVE_FRICTION * scene.mu_star)
        return scene.a * scene.stiffness_ratio / friction

    def _misfit_without_path(self, scene: Scene, meter: WorkMeter) -> float:
        """Far from the boundary a fall still has a verdict, unless its motion cannot go on."""
        if self.sign != self.trigger_sign:
            return math.nan
        try:
            return -1.0 if reaches_norm(scene, Accuracy(LOOSE_TOLERANCE), meter) else 1.0
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            return math.nan

    def _compute_max_size(self) -> float:
        """The step that itself takes the slip rate to the norm, and somewhat farther with mass; a
        rise does so only where it takes more from the state than it gives to friction. Under a load
        point that moves, the last after which there is steady sliding.
        """
        scene = self.scene
        if max(0.0, scene.log_load_velocity) >= scene.log_instability_rate:
            return 0.0
        level = scene.log_instability_rate + (INERTIAL_LOG_RATE_MARGIN if scene.has_mass else 0.0)

        def excess(size: float) -> float:
            return self._log_slip_rate_after(size) - level

        if excess(0.0) >= 0.0:
            return 0.0
        largest = self._max_log_stress_ratio()
        if excess(largest) > 0.0:
            self.largest_step_reaches_norm = True
            largest = float(brentq(excess, 0.0, largest, xtol=1e-15, rtol=1e-14))
        if self._allows_steady_sliding(largest):
            return largest
        self.largest_step_reaches_norm, smaller = False, 0.0
        while largest - smaller > _MAX_SIZE_RTOL * largest:
            middle = 0.5 * (smaller + largest)
            smaller, largest = (
                (middle, largest) if self._allows_steady_sliding(middle) else (smaller, middle)
            )
        return smaller

    def _max_log_stress_ratio(self) -> float:
        """A fall leaves sigma_3 positive where normal stress follows shear stress: beyond, friction
        falls faster with slip than stress does, however slow that is.
        """
        follows, _alpha = self.scene.parts.normal_stress.coupling or (0.0, 0.0)
        if self.sign > 0 or not follows:
            return _MAX_LOG_STRESS_CHANGE
        return min(_MAX_LOG_STRESS_CHANGE, (1.0 - 1e-6) * -math.log(self.scene.mu_star * follows))

    def _allows_steady_sliding(self, size: float) -> bool:
        """True if sliding can be steady after a step, or needs not because the load point rests."""
        scene = self.scene_at(size)
        load = scene.log_load_velocity
        return load == -math.inf or steady_sliding(scene, load) is not None

    def _log_slip_rate_after(self, size: float) -> float:
        """ln(V/V_*) just after a step, without mass."""
        scene = self.scene_at(size).without_mass()
        steady_states = compute_steady_states(scene, 0.0, 0.0)
        return manifold_point(scene, scene.spring_stress_step, steady_states).log_slip_rate
