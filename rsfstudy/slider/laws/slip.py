"""The slip law (Ruina 1983): the state variable evolves with slip only."""

from __future__ import annotations


def evolution(log_rate: float, state: float, b: float) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``D_c dTheta/d(delta) = -(Theta + b ln(V/V_*))``

    Parameters
    ----------
    log_rate : float
        ln(V/V_*).
    state : float
        State variable Theta.
    b : float
        Evolution effect parameter.

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88; Linker and Dieterich (1992), J. Geophys. Res. 97 (first term
    of their evolution law).
    """
    return -(state + b * log_rate)
