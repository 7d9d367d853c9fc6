"""Linker-Dieterich effect: a rise of normal stress lowers the state variable."""

from __future__ import annotations

import math


def state_shift(ratio: float, alpha: float, cot_phi: float) -> tuple[float, float]:
    """State variable lost to the present normal stress, and its derivative with respect to shear
    stress.

    ``dTheta = -alpha dsigma/sigma`` integrates to ``Theta = Psi - alpha ln(sigma/sigma_*)``, where
    Psi knows nothing of normal stress; the derivative of the shift is ``alpha cot(phi)/s``.

    Parameters
    ----------
    ratio : float
        Normal stress ratio s = sigma/sigma_*.
    alpha : float
        Strength of the effect.
    cot_phi : float
        ds/dg, the cotangent of the driving angle.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97, 4923-4940.
    """
    return alpha * math.log(ratio), alpha * cot_phi / ratio
