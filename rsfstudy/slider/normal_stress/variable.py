"""Variable normal stress: a driving stress inclined to the fault couples normal to shear stress,
and a rise of normal stress lowers the state variable. What the loading imposes adds to sigma_3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.normal_stress._state_effect import NormalStressWithStateEffect
from rsfstudy.slider.parameter_layout import (
    IMPOSED_NORMAL_STRESS,
    LARGEST_NORMAL_STRESS_EXCESS,
    NORMAL_STRESS,
    SMALLEST_NORMAL_STRESS_EXCESS,
)
from rsfstudy.slider.parts import POSITIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


def normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Normal stress over its reference value less 1, and its derivative with respect to shear
    stress.

    ``sigma/sigma_* = 1 + e + cot(phi) (tau - tau_*)/sigma_*``, from sigma = sigma_3 + tau cot(phi),
    where the loading has changed sigma_3 by e sigma_*; shear stress knows nothing of that.

    Parameters
    ----------
    friction : float
        Deviation of shear stress, (tau - tau_*)/sigma_*.
    p : tuple of float
        Cotangent of the angle between the driving stress and the fault normal, at NORMAL_STRESS
        + 1.
    """
    cot_phi = p[NORMAL_STRESS + 1]
    excess = cot_phi * friction + p[IMPOSED_NORMAL_STRESS]
    if not SMALLEST_NORMAL_STRESS_EXCESS <= excess <= LARGEST_NORMAL_STRESS_EXCESS:
        excess = min(max(excess, SMALLEST_NORMAL_STRESS_EXCESS), LARGEST_NORMAL_STRESS_EXCESS)
    return excess, cot_phi


@dataclass(frozen=True, kw_only=True)
class VariableNormalStress(NormalStressWithStateEffect):
    """A driving stress inclined at `phi`, with an effect `alpha` of normal stress on the state.

    ``sigma = sigma_3 + tau cot(phi)``, and ``dTheta = -alpha dsigma/sigma`` beside the evolution
    law.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940; eq. 5 of
    doi:10.1007/s11589-014-0098-4.
    """

    phi: float = number(
        60.0,
        r"$\phi$",
        "degree",
        "angle between the driving stress and the fault normal",
        rule=POSITIVE,
    )

    name = "variable"
    normal_stress = staticmethod(normal_stress)

    @property
    def cot_phi(self) -> float:
        """d sigma/d tau."""
        return 1.0 / math.tan(math.radians(self.phi))

    @property
    def coupling(self) -> tuple[float, float]:
        return self.cot_phi, self.alpha

    @property
    def effects(self) -> tuple[str, ...]:
        return ("inclined_driving", *super().effects)

    def numbers(self, scene: SceneView) -> Numbers:
        """alpha and cot(phi)."""
        return self.alpha, self.cot_phi

    def min_frictional_stress(self, scene: SceneView) -> float:
        return -(1.0 + scene.imposed_normal_stress) / self.cot_phi

    def check(self, scene: SceneView) -> None:
        """An angle at which normal stress varies, and sigma_3 is positive."""
        if self.phi >= 90.0:
            remedy = "At 90 degrees it no longer varies: set normal_stress='constant'."
            raise self.field_error("phi", "must lie between 0 and 90 degrees", remedy)
        lowest = math.degrees(math.atan(scene.mu_star))
        if self.phi <= lowest:
            rule = f"must exceed atan(mu_star) = {lowest:.6g} degrees: sigma_3 is negative below"
            raise self.field_error("phi", rule, "Raise phi or lower mu_star.")
