"""Variable normal stress: a driving stress inclined to the fault couples normal to shear stress,
and a rise of normal stress lowers the state variable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.parts import Function, Numbers, number, reads
from rsfstudy.slider.slots import LARGEST_RATIO, SMALLEST_RATIO

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

OWN = 0


def normal_stress(friction: float, p: Numbers) -> tuple[float, float]:
    """Normal stress over its reference value less 1, and its derivative with respect to shear
    stress.

    ``sigma/sigma_* = 1 + cot(phi) (tau - tau_*)/sigma_*``, from sigma = sigma_3 + tau cot(phi)
    with sigma_3 constant.

    Parameters
    ----------
    friction : float
        Deviation of shear stress, (tau - tau_*)/sigma_*.
    p : tuple of float
        Cotangent of the angle between the driving stress and the fault normal, at OWN.
    """
    cot_phi = p[OWN]
    return min(max(cot_phi * friction, SMALLEST_RATIO - 1.0), LARGEST_RATIO), cot_phi


def linker_dieterich(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """State variable lost to the present normal stress, and its derivative with respect to shear
    stress.

    ``dTheta = -alpha dsigma/sigma`` integrates to ``Theta = Psi - alpha ln(sigma/sigma_*)``, where
    Psi knows nothing of normal stress; the derivative of the shift is ``alpha cot(phi)/s`` with s
    the normal stress ratio.

    Parameters
    ----------
    friction : float
        Deviation of shear stress, over sigma_*.
    ratio, change : float
        Normal stress ratio s, and its derivative with respect to shear stress.
    p : tuple of float
        Strength of the effect alpha, at OWN + 1.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """
    alpha = p[OWN + 1]
    return alpha * math.log(ratio), alpha * change / ratio


@dataclass(frozen=True, kw_only=True)
class Variable(NormalStress):
    """A driving stress inclined at `phi`, with an effect `alpha` of normal stress on the state."""

    alpha: float = number(
        0.56,
        r"$\alpha$",
        "1",
        "normal stress effect on the state variable",
        rule="must be 0 or greater",
    )
    phi: float = number(
        60.0,
        r"$\phi$",
        "degree",
        "angle between the driving stress and the fault normal",
        rule="must be greater than 0",
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
    def state_effect(self) -> Function | None:
        return linker_dieterich if self.alpha else None

    @property
    def effects(self) -> tuple[str, ...]:
        return ("inclined_driving", "linker_dieterich")[: 2 if self.alpha else 1]

    def numbers(self, scene: Scene) -> Numbers:
        """cot(phi) and alpha."""
        return self.cot_phi, self.alpha

    def weakest(self, scene: Scene) -> float:
        return -1.0 / self.cot_phi

    @reads("phi", "mu_star")
    def check(self, scene: Scene) -> None:
        """An angle at which normal stress varies, and sigma_3 is positive."""
        if self.phi >= 90.0:
            raise InvalidValue(
                "phi",
                self.phi,
                "must lie between 0 and 90 degrees",
                remedy="At 90 degrees it no longer varies: set normal_stress='constant'.",
            )
        lowest = math.degrees(math.atan(scene.mu_star))
        if self.phi <= lowest:
            raise InvalidValue(
                "phi",
                self.phi,
                f"must exceed atan(mu_star) = {lowest:.6g} degrees: sigma_3 is negative below",
                remedy="Raise phi or lower mu_star.",
            )
