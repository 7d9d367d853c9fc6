"""The slowness (ageing) law with two states."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.laws import LARGEST_EXPONENT, fast_expm1
from rsfstudy.slider.laws._two_states import (
    FIRST_B,
    FIRST_SHARE,
    LENGTH_QUOTIENT,
    SECOND_B,
    SECOND_SHARE,
    TwoStateLaw,
)
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene_view import SceneView


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
    first = (psis[0] - p[FIRST_SHARE] * shift) / p[FIRST_B] + log_slip_rate
    second = (psis[1] - p[SECOND_SHARE] * shift) / p[SECOND_B] + log_slip_rate
    return (
        fraction * p[FIRST_B] * fast_expm1(min(-first, LARGEST_EXPONENT)),
        fraction * p[LENGTH_QUOTIENT] * p[SECOND_B] * fast_expm1(min(-second, LARGEST_EXPONENT)),
    )


@dataclass(frozen=True, kw_only=True)
class TwoStateSlownessLaw(TwoStateLaw):
    """The slowness law with two states."""

    name = "two_slowness_states"
    evolutions = staticmethod(evolutions)

    def check(self, scene: SceneView) -> None:
        """And no state without effect, which theta would be unknown of."""
        for name in ("b1_over_a", "b2_over_a"):
            if not getattr(self, name):
                remedy = "One state is law='slowness'."
                raise InvalidValue(name, 0.0, "must not be 0", remedy=remedy)
        super().check(scene)
