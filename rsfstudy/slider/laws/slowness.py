"""The slowness (ageing) law (Dieterich): the state variable also evolves in stationary contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import LARGEST_EXPONENT, Law, fast_expm1
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``dtheta/dt = 1 - theta V/D_c`` with ``Theta = b ln(theta V_*/D_c)`` reads, per unit slip,
    ``D_c dTheta/d(delta) = b [D_c/(theta V) - 1] = b expm1(-(Theta/b + ln(V/V_*)))``;
    `expm1` keeps all digits close to the steady state theta = D_c/V.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    state : float
        State variable Theta = b ln(theta/theta_*).
    p : tuple of float
        Evolution effect parameter b, at LAW.

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97 (first term of their slowness law).
    """
    b = p[LAW]
    exponent = -(state / b + log_slip_rate)
    return b * fast_expm1(LARGEST_EXPONENT if exponent > LARGEST_EXPONENT else exponent)


def relaxation(rate: float, slip: float) -> float:
    """``ln[1 + (V/V_* - 1) exp(-slip/D_c)]`` (eq. 17a of the paper, less its steady value)."""
    return math.log(-math.expm1(-slip) + math.exp(rate - slip))


@dataclass(frozen=True, kw_only=True)
class SlownessLaw(Law):
    """The slowness law."""

    name = "slowness"
    evolution = staticmethod(evolution)
    relaxation = staticmethod(relaxation)
    scale_free = True
    has_closed_orbits = True  # Ranjith and Rice (1999)
