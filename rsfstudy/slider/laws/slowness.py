"""The slowness (ageing) law of Dieterich.

The state variable also evolves in stationary contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, Law, fast_expm1
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]``.

    Notes
    -----
    The slowness law and its state variable are

    .. math::

        \frac{d\theta}{dt} = 1 - \frac{\theta V}{D_c}, \quad \Theta = b \ln\frac{\theta V_*}{D_c}.

    The evolution per unit slip is

    .. math::

        D_c \frac{d\Theta}{d\delta} = b \left(\frac{D_c}{\theta V} - 1\right)
          = b \left\{\exp\left[-\left(\frac{\Theta}{b} + \ln\frac{V}{V_*}\right)\right] - 1\right\}.

    Close to the steady state :math:`\theta = D_c/V`, the function ``expm1`` avoids the cancellation
    of digits.

    References
    ----------
    Linker and Dieterich (1992), J. Geophys. Res. 97 (first term of their slowness law).
    """
    b = p[LAW]
    exponent = -(state / b + log_slip_rate)
    return b * fast_expm1(
        MAX_EXPONENT_IN_STATE_EVOLUTION if exponent > MAX_EXPONENT_IN_STATE_EVOLUTION else exponent
    )


def compute_scaled_state_relaxation(log_slip_rate: float, slip: float) -> float:
    r"""Compute the relaxation of stress at constant slip rate.

    See ``LawBase.state_relaxation_function`` for the arguments.

    Notes
    -----
    The relaxation is

    .. math::

        \ln\left[1 + \left(\frac{V}{V_*} - 1\right) e^{-\delta/D_c}\right].

    References
    ----------
    Eq. 17a of doi:10.1007/s11589-014-0098-4, minus its steady value.
    """
    return math.log(-math.expm1(-slip) + math.exp(log_slip_rate - slip))


@dataclass(frozen=True, kw_only=True)
class SlownessLaw(Law):
    """Slowness (ageing) law, in which contacts also heal at rest."""

    name = "slowness"
    evolution = staticmethod(compute_state_evolution_per_slip)
    state_relaxation_function = staticmethod(compute_scaled_state_relaxation)
    lacks_characteristic_slip_rate = True
    has_closed_orbits_at_critical_stiffness = True  # See Ranjith and Rice (1999).
