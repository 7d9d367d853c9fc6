"""Steps of imposed normal stress."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from rsfstudy.analysis.shooting import LOOSE, ShotSteps
from rsfstudy.analysis.sought import RISE_OF_MASS, SMALLEST_STEP, UNSEEN, falls_behind
from rsfstudy.analysis.swing import orbits_may_close, stability_margin, swing
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.regimes import on_slow_manifold
from rsfstudy.slider import steady
from rsfstudy.slider.closed_forms import effective_friction
from rsfstudy.slider.equations import steady_states_of
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: |ln(sigma/sigma_*)| that no step goes beyond.
_LARGEST_CHANGE = math.log(1e3)
#: Part of the largest step to which it is found.
_CLOSE_ENOUGH = 1e-6
#: Effective friction over mu_* that is guessed from at least: the state may take all of it.
_LEAST_FRICTION = 0.1


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

    def error(self, size: float, relative_error: float) -> float:
        return math.exp(self.sign * size) * size * relative_error

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
            return -1.0 if swing(scene, Accuracy(LOOSE), meter).reached else 1.0
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
