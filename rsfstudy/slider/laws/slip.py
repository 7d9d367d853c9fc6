"""The slip law (Ruina 1983): the state variable evolves with slip only."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import Law
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``D_c dTheta/d(delta) = -(Theta + b ln(V/V_*))``

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
    Ruina (1983), J. Geophys. Res. 88; Linker and Dieterich (1992), J. Geophys. Res. 97 (first term
    of their evolution law).
    """
    return -(state + p[LAW] * log_slip_rate)


def relaxation(rate: float, slip: float) -> float:
    """``ln(V/V_*) exp(-slip/D_c)`` (eq. 17b of the paper, less its steady value)."""
    return rate * math.exp(-slip)


@dataclass(frozen=True, kw_only=True)
class SlipLaw(Law):
    """The slip law."""

    name = "slip"
    evolution = staticmethod(evolution)
    relaxation = staticmethod(relaxation)
    scale_free = True
    has_closed_orbits = True  # Gu et al. (1984)
