"""Steps of load point displacement."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator

from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.sought import RISE_OF_MASS, UNSEEN, Steps, falls_behind
from rsfstudy.analysis.swing import settles
from rsfstudy.motion.meter import Meter
from rsfstudy.slider import steady
from rsfstudy.slider.equations import log_slip_rate_at
from rsfstudy.slider.scene import Scene

#: Spring stress over sigma_* that no step goes beyond.
_LARGEST_STRESS = 1e6
_LARGEST_LOGARITHM = math.log(sys.float_info.max)


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
