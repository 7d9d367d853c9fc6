"""The evolution law of Perrin, Rice and Zheng (1995).

The evolution is an odd function of the difference between the state variable and its steady value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, Law
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple

#: Upper limit of the difference between the state variable and its steady value, divided by b. A
#: larger difference occurs only in a trial step of the integrator, because a motion ends at
#: ln(V/V_*) = 276. The limit also prevents an overflow when the integrator squares the rate of the
#: state variable to estimate the first step.
STEADY_STATE_OFFSET_OVER_B_UPPER_LIMIT = 300.0


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]``.

    Notes
    -----
    The state variable :math:`\Theta` is zero in steady sliding at :math:`V_*`:

    .. math::

        \frac{d\theta}{dt} = 1 - \left(\frac{V \theta}{2 D_c}\right)^2, \quad
          \Theta = b \ln\frac{\theta V_*}{2 D_c}.

    The evolution per unit slip is

    .. math::

        D_c \frac{d\Theta}{d\delta} = -b \sinh\left(\frac{\Theta}{b} + \ln\frac{V}{V_*}\right).

    References
    ----------
    Perrin, Rice and Zheng (1995), J. Mech. Phys. Solids 43, 1461-1495.
    """
    b = p[LAW]
    return -b * math.sinh(
        max(
            -MAX_EXPONENT_IN_STATE_EVOLUTION,
            min(state / b + log_slip_rate, STEADY_STATE_OFFSET_OVER_B_UPPER_LIMIT),
        )
    )


def compute_scaled_state_relaxation(log_slip_rate: float, slip: float) -> float:
    r"""Compute the relaxation of stress at constant slip rate.

    See ``LawBase.state_relaxation_function`` for the arguments.

    Notes
    -----
    The relaxation is

    .. math::

        2 \operatorname{artanh}\left[\tanh\left(\frac{1}{2} \ln\frac{V}{V_*}\right)
          e^{-\delta/D_c}\right].

    The code uses an equivalent formula that remains accurate for very large velocity steps.
    """
    small, gone = math.exp(-abs(log_slip_rate)), -math.expm1(-slip)
    above, below = 2.0 - gone + small * gone, gone + small * (2.0 - gone)
    return math.copysign(math.log(above / below), log_slip_rate)


@dataclass(frozen=True, kw_only=True)
class PerrinRiceZhengLaw(Law):
    """Evolution law of Perrin, Rice and Zheng."""

    name = "perrin_rice_zheng"
    evolution = staticmethod(compute_state_evolution_per_slip)
    state_relaxation_function = staticmethod(compute_scaled_state_relaxation)
    lacks_characteristic_slip_rate = True
