"""The effect of normal stress on the state variable, which a rise of normal stress lowers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.normal_stress import NormalStress
from rsfstudy.slider.parameter_layout import NORMAL_STRESS
from rsfstudy.slider.parts import NON_NEGATIVE, Function, Numbers, number


def linker_dieterich_effect(
    friction: float, ratio: float, change: float, p: Numbers
) -> tuple[float, float]:
    """State variable lost to the present normal stress, and its derivative with respect to shear
    stress.

    ``dTheta = -alpha dsigma/sigma`` integrates to ``Theta = Psi - alpha ln(sigma/sigma_*)``, where
    Psi knows nothing of normal stress, and does not change where that is changed suddenly; the
    derivative of the shift is ``alpha s'/s`` with s the normal stress ratio.

    Parameters
    ----------
    friction : float
        Deviation of shear stress, over sigma_*.
    ratio, change : float
        Normal stress ratio s, and its derivative with respect to shear stress.
    p : tuple of float
        Strength of the effect alpha, at NORMAL_STRESS.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """
    alpha = p[NORMAL_STRESS]
    return alpha * math.log(ratio), alpha * change / ratio


@dataclass(frozen=True, kw_only=True)
class NormalStressWithStateEffect(NormalStress):
    """Base of the cases in which normal stress changes: the strength `alpha` of the effect."""

    alpha: float = number(
        0.56, r"$\alpha$", "1", "normal stress effect on the state variable", rule=NON_NEGATIVE
    )

    @property
    def state_effect(self) -> Function | None:
        return linker_dieterich_effect if self.alpha else None

    @property
    def effects(self) -> tuple[str, ...]:
        return ("linker_dieterich",) if self.alpha else ()
