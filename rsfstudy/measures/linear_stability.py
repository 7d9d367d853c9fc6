"""Linear stability of steady sliding: the critical stiffness from algebra, and from growth of the
assembled equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from scipy.optimize import brentq

from rsfstudy import steady_state
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.core.stepping import Meter
from rsfstudy.equations import quasi_static, strength_of
from rsfstudy.measures import Measure, Outcome
from rsfstudy.scene import Scene
from rsfstudy.status import Status

#: Step of the central differences in units of the scale of an unknown: rounding and truncation
#: balance there.
_DIFFERENCE = 1e-4


@dataclass(frozen=True)
class LinearStability(Measure):
    """Critical stiffness of steady sliding at the load point velocity of the scene, over
    sigma_*/D_c.

    Twice: by the closed form, and as the stiffness at which small perturbations of the assembled
    equations neither grow nor decay, so that algebra and code vouch for each other. Mass is left
    out: it changes the threshold by about T V_*/(2 pi D_c) squared.
    """

    name: ClassVar[str] = "linear_stability"

    @property
    def headline(self) -> str:
        return "critical_stiffness"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        names = (
            "critical_stiffness",
            "critical_stiffness_error",
            "critical_stiffness_from_growth",
            "steady_friction",
            "steady_normal_stress",
        )
        return dict.fromkeys(names, ())

    @property
    def sought(self) -> tuple[str, ...]:
        return ("stiffness_ratio",)

    @property
    def typical_work(self) -> int:
        return 100

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Closed form, and the root of the growth in stiffness; their difference is the error of
        the algebra.
        """
        load, cot_phi = scene.log_load_rate, scene.cot_phi
        mu_ss = steady_state.steady_friction(load, scene.mu_star, scene.a, scene.b)
        if load <= steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, cot_phi):
            return Outcome(
                Status.NO_STEADY_STATE,
                {"steady_friction": mu_ss},
                "phi < atan(mu_ss): the slider locks while stress rises, and runs while it falls",
            )
        closed = steady_state.critical_stiffness(
            load, scene.mu_star, scene.a, scene.b, cot_phi, scene.alpha or 0.0
        )
        spring = steady_state.steady_shear_stress(mu_ss, scene.mu_star, cot_phi)
        psi = strength_of(scene)(spring)[0] - scene.a * load
        around = closed / scene.critical_stiffness

        def growth_at(ratio: float) -> float:
            meter.charge("quasi_static", 4)
            return growth(scene.with_(stiffness_ratio=ratio), spring, psi)

        found = float(brentq(growth_at, 0.5 * around, 2.0 * around, xtol=1e-15, rtol=1e-14))
        found *= scene.critical_stiffness
        return Outcome(
            Status.OK,
            {
                "critical_stiffness": closed,
                "critical_stiffness_error": abs(found - closed) + 1e-15 * closed,
                "critical_stiffness_from_growth": found,
                "steady_friction": mu_ss,
                "steady_normal_stress": steady_state.steady_normal_stress(
                    mu_ss, scene.mu_star, cot_phi
                ),
            },
        )


def growth(scene: Scene, spring: float, psi: float) -> float:
    """Twice the growth rate of small oscillations about a steady state: the trace of the Jacobian.

    Its determinant is positive for every stiffness, so the trace alone decides.
    """
    rate = quasi_static(scene, clock=False).rate
    step = _DIFFERENCE * scene.a
    along_spring = rate(0.0, (spring + step, psi))[0] - rate(0.0, (spring - step, psi))[0]
    along_psi = rate(0.0, (spring, psi + step))[1] - rate(0.0, (spring, psi - step))[1]
    return math.fsum((along_spring, along_psi)) / (2.0 * step)
