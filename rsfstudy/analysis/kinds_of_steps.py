"""Kinds of steps: of load point velocity, of load point displacement, and of normal stress."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator

import numpy as np
from scipy.optimize import brentq

from rsfstudy.analysis.after_step import (
    orbits_may_close,
    reaches_norm,
    settles,
    stability_margin,
)
from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.search_of_steps import (
    LOOSE,
    RISE_OF_MASS,
    SMALLEST_STEP,
    UNSEEN,
    ShotSteps,
    Steps,
    falls_behind,
)
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.starting import on_slow_manifold
from rsfstudy.slider import steady
from rsfstudy.slider.closed_forms import effective_friction
from rsfstudy.slider.equations import log_slip_rate_at, steady_states_of
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Slowest load point velocity over V_* that the search goes down to.
SLOWEST_LOAD = 1e-20
#: b/a - 1 that is guessed from at least: some laws weaken without it.
_LEAST_WEAKENING = 1e-6
#: Spring stress over sigma_* that no step goes beyond.
_LARGEST_STRESS = 1e6
_LARGEST_LOGARITHM = math.log(sys.float_info.max)
#: |ln(sigma/sigma_*)| that no step goes beyond.
_LARGEST_CHANGE = math.log(1e3)
#: Part of the largest step to which it is found.
_CLOSE_ENOUGH = 1e-6
#: Effective friction over mu_* that is guessed from at least: the state may take all of it.
_LEAST_FRICTION = 0.1


class RateSteps(ShotSteps):
    """Steps of load point velocity; the size is |ln(V_0/V_*)|."""

    quantity = "critical_velocity_ratio"
    triggers = 1

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(load_velocity_ratio=self.value(size))

    def paths(self, engine: str) -> Callable[[float], CriticalPath]:
        path = CriticalPath.of(self.scene, engine)
        return lambda size: path.under(self.value(size))

    def value(self, size: float) -> float:
        return math.exp(self.sign * size)

    def _guess(self) -> float:
        """Of the size of the closed forms for the slip law (Gu et al. 1984)."""
        weakening = max(self.scene.parts.law.b_over_a - 1.0, _LEAST_WEAKENING)
        return float(np.logaddexp(0.0, self.scene.stiffness_ratio - 1.0 - math.log(weakening)))

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Far from the boundary an upward step still has a verdict."""
        if self.sign != self.triggers:
            return math.nan
        return -1.0 if reaches_norm(scene, Accuracy(LOOSE), meter) else 1.0

    def _largest(self) -> float:
        """Up: V_0 at the norm itself. Down: the slowest V_0 that has a steady state."""
        if self.sign > 0:
            return self.scene.log_norm_rate
        scene, slowest = self.scene, steady.slowest_steady(self.scene)
        return min(-math.log(SLOWEST_LOAD), -slowest) if scene.log_norm_rate > 0.0 else 0.0


class DisplacementSteps(Steps):
    """Steps of load point displacement; the size is |d| in D_c. The load point is then held, unless
    the scene moves it.
    """

    quantity = "critical_displacement"
    beside = ("slip_rate_after_step", "slip_rate_after_closed_form_step")

    def __init__(self, scene: Scene, sign: int) -> None:
        if scene.load_velocity_ratio is None:
            scene = scene.with_(load_velocity_ratio=0.0)
        super().__init__(scene, sign)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(displacement_step=self.value(size))

    def value(self, size: float) -> float:
        return self.sign * size

    def error(self, size: float, relative_error: float) -> float:
        return size * relative_error

    def mass_delays(self, size: float, rtol: float) -> bool:
        """The slider falls behind on the same path, but for what the load point moves meanwhile,
        and for half of b times that slip, which the state misses because slip rate is lower.
        """
        scene = self.scene
        if not scene.has_mass:
            return False
        behind, rate = falls_behind(self.scene_at(size))
        missed = 0.5 * scene.a * scene.parts.law.size_over_a / scene.stiffness
        loaded = scene.load_velocity / rate if rate else 0.0
        return behind * (loaded + missed) > UNSEEN * rtol * size

    def smaller_ones_decay(self, size: float) -> bool:
        """They move nothing that steady sliding depends on."""
        return settles(self.scene)

    def values_beside(self, size: float) -> dict[str, float]:
        """Slip rates just after the critical step, and after one of D_c a/(b-a) (eq. 13), which
        by a stiff spring is beyond the largest number: infinite.
        """

        def after(step: float) -> float:
            log_slip_rate = log_slip_rate_at(self.scene, self.scene.stiffness * step, 0.0)
            return math.exp(log_slip_rate) if log_slip_rate < _LARGEST_LOGARITHM else math.inf

        weakening = self.scene.parts.law.b_over_a - 1.0
        closed_form = after(self.sign / weakening) if weakening > 0.0 else math.nan
        critical = math.nan if math.isnan(size) else after(self.value(size))
        return dict(zip(self.beside, (critical, closed_form), strict=True))

    def sizes_on_path(self, tolerances: Iterable[float], meter: Meter) -> Iterator[float]:
        """One integration each: a displacement step leaves Psi = 0 and moves the spring stress
        alone, so that it starts wherever the critical path has Psi = 0.
        """
        path, sign = CriticalPath.of(self.scene, meter.engine), self.sign
        for tolerance in tolerances:
            start = path.start(
                tolerance, meter, ("psi", 0.0), lambda point: sign * point.spring_stress > 0.0
            )
            if start is None:
                return
            yield abs(start.spring_stress / self.scene.stiffness)

    def _largest(self) -> float:
        """Up: the step that itself takes the slip rate to the norm, and somewhat farther with mass,
        because slip rate rises to that while stress relaxes. Down: the step that ends shear stress.
        """
        scene = self.scene
        if max(0.0, scene.log_load_rate) >= scene.log_norm_rate:
            return 0.0
        if self.sign < 0:
            weakest = scene.parts.normal_stress.weakest(scene)
            return min(scene.mu_star, -weakest) / scene.stiffness
        farther = RISE_OF_MASS if scene.has_mass else 0.0
        friction = steady.stress_after_jump(scene, scene.a * (scene.log_norm_rate + farther))
        if friction is None:
            return _LARGEST_STRESS / scene.stiffness
        self.jumps_to_norm = True
        return (friction + scene.dynamics.radiated(scene.log_norm_rate)) / scene.stiffness


class NormalStressSteps(ShotSteps):
    """Steps of imposed normal stress; the size is |ln(1 + step/sigma_*)|. The load point is then
    held, unless the scene moves it.

    Friction after the step is that of other normal stress, and so is the critical path.
    """

    quantity = "critical_normal_stress_step"
    triggers = -1
    beside = ("slip_rate_after_step",)

    def __init__(self, scene: Scene, sign: int) -> None:
        held = 0.0 if scene.load_velocity_ratio is None else scene.load_velocity_ratio
        scene = scene.with_(load_velocity_ratio=held, normal_stress_step=0.0)
        # a slider whose normal stress nothing can change says so here
        scene.with_(normal_stress_step=sign * SMALLEST_STEP)
        super().__init__(scene, sign)
        # what such a step does to ln V is larger by mu_*/a
        self.smallest = min(self.smallest, SMALLEST_STEP * scene.a / scene.mu_star)

    def scene_at(self, size: float) -> Scene:
        return self.scene.with_(normal_stress_step=self.value(size))

    def value(self, size: float) -> float:
        return math.expm1(self.sign * size)

    def mass_delays(self, size: float, rtol: float) -> bool:
        """The slider falls behind while slip rate rises; by how much of the size is a matter of
        what slip rate the step leads to.
        """
        scene = self.scene
        behind = falls_behind(self.scene_at(size))[0] if scene.has_mass else 0.0
        missed = max(1.0, 0.5 * scene.parts.law.size_over_a) * behind
        return missed > UNSEEN * rtol * size * scene.mu_star / scene.a

    def blur(self, size: float, rtol: float) -> float:
        """Critical stiffness goes with normal stress, and its logarithm with the size."""
        scene = self.scene_at(size)
        near = orbits_may_close(scene) and abs(stability_margin(scene)) < 10.0 * rtol
        return 2.0 * rtol / size if near else 0.0

    def values_beside(self, size: float) -> dict[str, float]:
        """Slip rate just after the critical step."""
        rate = math.nan if math.isnan(size) else math.exp(self._log_slip_rate_after(size))
        return dict(zip(self.beside, (rate,), strict=True))

    def _guess(self) -> float:
        """A Coulomb stress change that takes the slip law to its threshold; a rise to where sliding
        comes to be unstable.
        """
        scene, law = self.scene, self.scene.parts.law
        if self.sign > 0 and 1.0 < scene.stiffness_ratio < math.inf:
            return math.log(scene.stiffness_ratio)
        _follows, alpha = scene.parts.normal_stress.coupling or (0.0, 0.0)
        friction = effective_friction(scene.mu_star, max(law.b_over_a, 1.0), alpha)
        friction = max(abs(friction), _LEAST_FRICTION * scene.mu_star)
        return scene.a * scene.stiffness_ratio / friction

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Far from the boundary a fall still has a verdict, unless its motion cannot go on."""
        if self.sign != self.triggers:
            return math.nan
        try:
            return -1.0 if reaches_norm(scene, Accuracy(LOOSE), meter) else 1.0
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
            return math.nan

    def _largest(self) -> float:
        """The step that itself takes the slip rate to the norm, and somewhat farther with mass; a
        rise does so only where it takes more from the state than it gives to friction. Under a load
        point that moves, the last after which there is steady sliding.
        """
        scene = self.scene
        if max(0.0, scene.log_load_rate) >= scene.log_norm_rate:
            return 0.0
        level = scene.log_norm_rate + (RISE_OF_MASS if scene.has_mass else 0.0)

        def excess(size: float) -> float:
            return self._log_slip_rate_after(size) - level

        if excess(0.0) >= 0.0:
            return 0.0
        largest = self._limit()
        if excess(largest) > 0.0:
            self.jumps_to_norm = True
            largest = float(brentq(excess, 0.0, largest, xtol=1e-15, rtol=1e-14))
        if self._may_slide(largest):
            return largest
        self.jumps_to_norm, smaller = False, 0.0
        while largest - smaller > _CLOSE_ENOUGH * largest:
            middle = 0.5 * (smaller + largest)
            smaller, largest = (middle, largest) if self._may_slide(middle) else (smaller, middle)
        return smaller

    def _limit(self) -> float:
        """A fall leaves sigma_3 positive where normal stress follows shear stress: beyond, friction
        falls faster with slip than stress does, however slow that is.
        """
        follows, _alpha = self.scene.parts.normal_stress.coupling or (0.0, 0.0)
        if self.sign > 0 or not follows:
            return _LARGEST_CHANGE
        return min(_LARGEST_CHANGE, (1.0 - 1e-6) * -math.log(self.scene.mu_star * follows))

    def _may_slide(self, size: float) -> bool:
        """True if sliding can be steady after a step, or needs not because the load point rests."""
        scene = self.scene_at(size)
        load = scene.log_load_rate
        return load == -math.inf or steady.steady_sliding(scene, load) is not None

    def _log_slip_rate_after(self, size: float) -> float:
        """ln(V/V_*) just after a step, without mass."""
        scene = self.scene_at(size).without_mass()
        steady_states = steady_states_of(scene, 0.0, 0.0)
        return on_slow_manifold(scene, scene.spring_stress_step, steady_states).log_slip_rate
