"""The slowness law with a cut-off: slip faster than V_c leaves the evolution effect behind."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import LARGEST_EXPONENT, Law, cutoff_velocity_field, fast_expm1
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene_view import SceneView


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    Friction is ``mu_* + a ln(V/V_*) + b ln(1 + theta V_c/D_c)``, less its last term in steady
    sliding at V_*, and ``dtheta/dt = 1 - theta V/D_c``. With ``Theta = b ln[(1 + theta V_c/D_c)/(1
    + V_c/V_*)]`` this reads, per unit slip, ``D_c dTheta/d(delta) = b expm1[(Theta_ss -
    Theta)/b]``, Theta_ss being that of steady sliding at V.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    state : float
        State variable Theta.
    p : tuple of float
        Evolution effect parameter b at LAW, then the parts V_c/(V_c + V_*) and V_*/(V_c + V_*).

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Okubo (1989), J. Geophys. Res. 94, 12321-12335.
    """
    b = p[LAW]
    behind = steady_state_over_b(log_slip_rate, p[LAW + 1], p[LAW + 2]) - state / b
    return b * fast_expm1(min(behind, LARGEST_EXPONENT))


def steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
    """Steady sliding, ``Theta_ss = b ln[(1 + V_c/V)/(1 + V_c/V_*)]``."""
    return (shift + p[LAW] * steady_state_over_b(log_slip_rate, p[LAW + 1], p[LAW + 2]),)


def steady_state_over_b(
    log_slip_rate: float, cutoff_fraction: float, reference_fraction: float
) -> float:
    """``ln(healing V_*/V + reference_fraction)``, which adds up to 0 at V_*: in each direction the
    form of which no digits are lost, and exponents that overflow are left out of it.
    """
    if log_slip_rate < 0.0:
        exponent = min(-log_slip_rate, LARGEST_EXPONENT)
        return math.log1p(cutoff_fraction * math.expm1(exponent)) - log_slip_rate - exponent
    exponent = min(log_slip_rate, LARGEST_EXPONENT)
    return math.log1p(reference_fraction * math.expm1(exponent)) - exponent


@dataclass(frozen=True, kw_only=True)
class CutOffLaw(Law):
    """The slowness law with a cut-off."""

    cutoff_velocity_ratio: float = cutoff_velocity_field()

    name = "cut_off"
    evolution = staticmethod(evolution)
    steady_states = staticmethod(steady_states)
    has_logarithmic_state = False  # in 1 + theta V_c/D_c

    @property
    def min_weakening_b_over_a(self) -> float:
        """Steady friction falls as ``b/(1 + V_*/V_c) - a`` with ln V, at V_*."""
        return 1.0 + 1.0 / self.cutoff_velocity_ratio

    def numbers(self, scene: SceneView) -> Numbers:
        """b, V_c/(V_c + V_*) and V_*/(V_c + V_*)."""
        return (*super().numbers(scene), *self._velocity_fractions())

    def relaxation(self, rate: float, slip: float) -> float:
        """``ln{1 + [(1 + V_c/V_*)/(1 + V_c/V) - 1] exp(-slip/D_c)}``."""
        ahead = -steady_state_over_b(rate, *self._velocity_fractions())
        return math.log(-math.expm1(-slip) + math.exp(ahead - slip))

    def _velocity_fractions(self) -> Numbers:
        return 1.0 / (1.0 + 1.0 / self.cutoff_velocity_ratio), 1.0 / (
            1.0 + self.cutoff_velocity_ratio
        )
