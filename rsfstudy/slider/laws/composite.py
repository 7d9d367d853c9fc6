"""The composite law (Kato and Tullis 2001): contact heals at rest, as by the slowness law, and
slips as by the slip law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import LARGEST_EXPONENT, Law, cutoff_velocity_field
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene_view import SceneView

#: Steps of third order that take Lambert's W to rounding from the guess below.
HALLEY_STEPS = 4


def evolution(log_slip_rate: float, state: float, p: Numbers) -> float:
    """Evolution of the state variable per unit slip at constant normal stress.

    ``dtheta/dt = exp(-V/V_c) - (theta V/D_c) ln(theta V/D_c)`` reads, with u = ln(theta V/D_c),
    ``D_c dTheta/d(delta) = b [exp(-V/V_c) exp(-u) - u]``. Theta is measured from its value in
    steady sliding at V_*: ``u = Theta/b + ln(V/V_*) + u_*``.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    state : float
        State variable Theta.
    p : tuple of float
        Evolution effect parameter b at LAW, then ln(V_c/V_*) and u_*.

    Returns
    -------
    float
        dTheta over slip in D_c.

    References
    ----------
    Kato and Tullis (2001), Geophys. Res. Lett. 28, 1103-1106.
    """
    b = p[LAW]
    ahead = state / b + log_slip_rate + p[LAW + 2]
    return b * (
        healing_factor(log_slip_rate, p[LAW + 1]) * math.exp(clamp_exponent(-ahead)) - ahead
    )


def steady_states(log_slip_rate: float, shift: float, p: Numbers) -> Numbers:
    """Steady sliding, where ``u exp(u) = exp(-V/V_c)``."""
    ahead = lambert_w(healing_factor(log_slip_rate, p[LAW + 1]))
    return (shift + p[LAW] * (ahead - p[LAW + 2] - log_slip_rate),)


def healing_factor(log_slip_rate: float, log_cutoff: float) -> float:
    """``exp(-V/V_c)``."""
    return math.exp(-math.exp(clamp_exponent(log_slip_rate - log_cutoff)))


def clamp_exponent(exponent: float) -> float:
    """An exponent that a motion meets, or the largest."""
    return min(exponent, LARGEST_EXPONENT)


def lambert_w(value: float) -> float:
    """The solution w of ``w exp(w) = value`` between 0 and 1, by Halley's method."""
    w = value / (1.0 + value)
    for _ in range(HALLEY_STEPS):
        grown = math.exp(w)
        off = w * grown - value
        w -= off / (grown * (w + 1.0) - 0.5 * (w + 2.0) * off / (w + 1.0))
    return w


@dataclass(frozen=True, kw_only=True)
class CompositeLaw(Law):
    """The composite law."""

    cutoff_velocity_ratio: float = cutoff_velocity_field()

    name = "composite"
    evolution = staticmethod(evolution)
    steady_states = staticmethod(steady_states)

    @property
    def min_weakening_b_over_a(self) -> float:
        """Steady friction falls as ``b - a + b u_*/(1 + u_*) V_*/V_c`` with ln V, at V_*."""
        ahead = self._reference_steady_offset()
        return 1.0 / (1.0 + ahead / ((1.0 + ahead) * self.cutoff_velocity_ratio))

    def numbers(self, scene: SceneView) -> Numbers:
        """b, ln(V_c/V_*), and u_* of steady sliding at V_*."""
        logarithm = math.log(self.cutoff_velocity_ratio)
        return (*super().numbers(scene), logarithm, self._reference_steady_offset())

    def _reference_steady_offset(self) -> float:
        return lambert_w(healing_factor(0.0, math.log(self.cutoff_velocity_ratio)))
