"""A family of laws between the slip law and the slowness law."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import LARGEST_EXPONENT, Law, fast_expm1
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers, number
from rsfstudy.slider.scene_view import SceneView


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``D_c dTheta/d(delta) = b expm1[-eps (Theta/b + ln(V/V_*))]/eps``: the slowness law at eps = 1
    and, as eps goes to 0, the slip law.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    state : float
        State variable Theta.
    p : tuple of float
        Evolution effect parameter b at LAW, and eps.

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Ciardo and Viesca (2024), arXiv 2407.16846.
    """
    b, exponent = p[LAW], p[LAW + 1]
    if exponent == 0.0:
        return -(state + b * log_slip_rate)
    return b * fast_expm1(min(-exponent * (state / b + log_slip_rate), LARGEST_EXPONENT)) / exponent


@dataclass(frozen=True, kw_only=True)
class LawFamily(Law):
    """The family between the slip law and the slowness law."""

    law_exponent: float = number(
        0.5,
        r"$\epsilon$",
        "1",
        "exponent of the law: 0 is the slip law, 1 the slowness law",
        rule="must lie between 0 and 1",
    )

    name = "family"
    evolution = staticmethod(evolution)
    scale_free = True
    has_closed_orbits = True  # dh/du = -(1 + eps h), as at both ends

    def relaxation(self, rate: float, slip: float) -> float:
        """``ln[1 + ((V/V_*)**eps - 1) exp(-slip/D_c)]/eps``."""
        power = self.law_exponent * rate
        if self.law_exponent == 0.0:
            return rate * math.exp(-slip)
        return math.log(-math.expm1(-slip) + math.exp(power - slip)) / self.law_exponent

    def numbers(self, scene: SceneView) -> Numbers:
        """b and eps."""
        return (*super().numbers(scene), self.law_exponent)
