"""The law of Perrin, Rice and Zheng (1995), symmetric about steady sliding."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import LARGEST_EXPONENT, Law
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers

#: Distance above steady sliding that only trial steps exceed: a motion ends at ln(V/V_*) = 276, and
#: the square of what is larger overflows in an estimate of the first step.
LARGEST_STEADY_STATE_OFFSET = 300.0


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``dtheta/dt = 1 - [V theta/(2 D_c)]**2`` with ``Theta = b ln[theta V_*/(2 D_c)]``, which is 0 in
    steady sliding at V_*, reads, per unit slip, ``D_c dTheta/d(delta) = -b sinh(Theta/b +
    ln(V/V_*))``.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    state : float
        State variable Theta.
    p : tuple of float
        Evolution effect parameter b, at LAW.

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Perrin, Rice and Zheng (1995), J. Mech. Phys. Solids 43, 1461-1495.
    """
    b = p[LAW]
    return -b * math.sinh(
        max(-LARGEST_EXPONENT, min(state / b + log_slip_rate, LARGEST_STEADY_STATE_OFFSET))
    )


def relaxation(rate: float, slip: float) -> float:
    """``2 artanh[tanh(ln(V/V_*)/2) exp(-slip/D_c)]``, written so that it holds digits however far
    the step.
    """
    small, gone = math.exp(-abs(rate)), -math.expm1(-slip)
    above, below = 2.0 - gone + small * gone, gone + small * (2.0 - gone)
    return math.copysign(math.log(above / below), rate)


@dataclass(frozen=True, kw_only=True)
class PerrinRiceZhengLaw(Law):
    """The law of Perrin, Rice and Zheng."""

    name = "perrin_rice_zheng"
    evolution = staticmethod(evolution)
    relaxation = staticmethod(relaxation)
    scale_free = True
