"""The slowness (ageing) law with two states."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.laws import LARGEST_EXPONENT, exp_less_one
from rsfstudy.slider.laws._two_states import FIRST, OF_FIRST, OF_SECOND, OVER, SECOND, TwoStates
from rsfstudy.slider.parts import Numbers, Scene


def evolutions(
    log_slip_rate: float, psis: Numbers, shift: float, fraction: float, p: Numbers
) -> Numbers:
    """Evolution of the two states per unit slip at constant normal stress, times a fraction.

    ``dtheta_i/dt = 1 - theta_i V/L_i`` with ``Theta_i = b_i ln(theta_i V_*/L_i)`` reads, per unit
    slip, ``L_i dTheta_i/d(delta) = b_i expm1(-(Theta_i/b_i + ln(V/V_*)))``.

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
    first = (psis[0] - p[OF_FIRST] * shift) / p[FIRST] + log_slip_rate
    second = (psis[1] - p[OF_SECOND] * shift) / p[SECOND] + log_slip_rate
    return (
        fraction * p[FIRST] * exp_less_one(min(-first, LARGEST_EXPONENT)),
        fraction * p[OVER] * p[SECOND] * exp_less_one(min(-second, LARGEST_EXPONENT)),
    )


@dataclass(frozen=True, kw_only=True)
class TwoSlownessStates(TwoStates):
    """The slowness law with two states."""

    name = "two_slowness_states"
    evolutions = staticmethod(evolutions)

    def check(self, scene: Scene) -> None:
        """And no state without effect, which theta would be unknown of."""
        for name in ("b1_over_a", "b2_over_a"):
            if not getattr(self, name):
                remedy = "One state is law='slowness'."
                raise InvalidValue(name, 0.0, "must not be 0", remedy=remedy)
        super().check(scene)
