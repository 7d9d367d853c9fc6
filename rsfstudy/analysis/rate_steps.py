"""Steps of load point velocity."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rsfstudy.analysis.critical_path import CriticalPath
from rsfstudy.analysis.shooting import LOOSE, ShotSteps
from rsfstudy.analysis.swing import swing
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Meter
from rsfstudy.slider import steady
from rsfstudy.slider.scene import Scene

#: Slowest load point velocity over V_* that the search goes down to.
SLOWEST_LOAD = 1e-20
#: b/a - 1 that is guessed from at least: some laws weaken without it.
_LEAST_WEAKENING = 1e-6


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

    def error(self, size: float, relative_error: float) -> float:
        return math.exp(self.sign * size) * size * relative_error

    def _guess(self) -> float:
        """Of the size of the closed forms for the slip law (Gu et al. 1984)."""
        weakening = max(self.scene.parts.law.b_over_a - 1.0, _LEAST_WEAKENING)
        return float(np.logaddexp(0.0, self.scene.stiffness_ratio - 1.0 - math.log(weakening)))

    def _verdict(self, scene: Scene, meter: Meter) -> float:
        """Far from the boundary an upward step still has a verdict."""
        if self.sign != self.triggers:
            return math.nan
        return -1.0 if swing(scene, Accuracy(LOOSE), meter).reached else 1.0

    def _largest(self) -> float:
        """Up: V_0 at the norm itself. Down: the slowest V_0 that has a steady state."""
        if self.sign > 0:
            return self.scene.log_norm_rate
        scene, slowest = self.scene, steady.slowest_steady(self.scene)
        return min(-math.log(SLOWEST_LOAD), -slowest) if scene.log_norm_rate > 0.0 else 0.0
