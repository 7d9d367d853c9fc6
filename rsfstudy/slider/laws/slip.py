"""The slip law (Ruina 1983).

The state variable evolves only with slip.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import Law
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]``.

    Notes
    -----
    The evolution is

    .. math::

        D_c \frac{d\Theta}{d\delta} = -\left(\Theta + b \ln\frac{V}{V_*}\right).

    References
    ----------
    Ruina (1983), J. Geophys. Res. 88; Linker and Dieterich (1992), J. Geophys. Res. 97 (first term
    of their evolution law).
    """
    return -(state + p[LAW] * log_slip_rate)


def compute_scaled_state_relaxation(log_slip_rate: float, slip: float) -> float:
    r"""Compute the relaxation of stress at constant slip rate.

    See ``LawBase.state_relaxation_function`` for the arguments.

    Notes
    -----
    The relaxation is

    .. math::

        \ln\frac{V}{V_*} \, e^{-\delta/D_c}.

    References
    ----------
    Eq. 17b of doi:10.1007/s11589-014-0098-4, minus its steady value.
    """
    return log_slip_rate * math.exp(-slip)


@dataclass(frozen=True, kw_only=True)
class SlipLaw(Law):
    """Slip law, in which the state variable evolves only with slip."""

    name = "slip"
    evolution = staticmethod(compute_state_evolution_per_slip)
    state_relaxation_function = staticmethod(compute_scaled_state_relaxation)
    lacks_characteristic_slip_rate = True
    has_closed_orbits_at_critical_stiffness = True  # See Gu et al. (1984).
