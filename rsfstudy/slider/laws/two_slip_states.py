"""The slip law with two states (Ruina 1983; Gu et al. 1984)."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.laws._two_states import (
    FIRST_B,
    FIRST_SHARE,
    LENGTH_QUOTIENT,
    SECOND_B,
    SECOND_SHARE,
    TwoStateLaw,
)
from rsfstudy.slider.parts import Numbers


def evolutions(
    log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
) -> Numbers:
    """Evolution of the two states per unit slip at constant normal stress, times a fraction.

    ``L_i dTheta_i/d(delta) = -(Theta_i + b_i ln(V/V_*))``

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    psis : tuple of float
        States freed of stress.
    shift : float
        What stress has taken from both together.
    fraction : float
        Slip over what the clock counts.
    p : tuple of float
        Numbers of the law, from `LAW` on.

    Returns
    -------
    tuple of float
        dTheta_1 and dTheta_2 over slip in D_c = L_1, times the fraction.
    """
    first = psis[0] - p[FIRST_SHARE] * shift + p[FIRST_B] * log_slip_rate
    second = psis[1] - p[SECOND_SHARE] * shift + p[SECOND_B] * log_slip_rate
    return -fraction * first, -fraction * p[LENGTH_QUOTIENT] * second


@dataclass(frozen=True, kw_only=True)
class TwoStateSlipLaw(TwoStateLaw):
    """The slip law with two states."""

    name = "two_slip_states"
    evolutions = staticmethod(evolutions)
