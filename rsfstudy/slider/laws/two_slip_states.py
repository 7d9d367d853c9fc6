"""The slip law with two state variables (Ruina 1983; Gu et al. 1984)."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.laws._two_states import (
    FIRST_B,
    FIRST_SHARE,
    LENGTH_QUOTIENT,
    SECOND_B,
    SECOND_SHARE,
    TwoStateLaw,
)
from rsfstudy.slider.parts import FloatTuple


def compute_state_evolutions(
    log_slip_rate: float,
    states: FloatTuple,
    stress_induced_state_shift: float,
    slip_per_independent_variable: float,
    p: FloatTuple,
) -> FloatTuple:
    r"""Compute the evolution of both states at constant normal stress.

    See ``LawBase`` for the arguments.

    Notes
    -----
    With :math:`L_1 = D_c`, the evolution is

    .. math::

        L_i \frac{d\Theta_i}{d\delta} = -\left(\Theta_i + b_i \ln\frac{V}{V_*}\right).
    """
    first = states[0] - p[FIRST_SHARE] * stress_induced_state_shift + p[FIRST_B] * log_slip_rate
    second = states[1] - p[SECOND_SHARE] * stress_induced_state_shift + p[SECOND_B] * log_slip_rate
    return -slip_per_independent_variable * first, -slip_per_independent_variable * p[
        LENGTH_QUOTIENT
    ] * second


@dataclass(frozen=True, kw_only=True)
class TwoStateSlipLaw(TwoStateLaw):
    """Slip law with two state variables.

    The fields are described in the base class ``TwoStateLaw``.
    """

    name = "two_slip_states"
    evolutions = staticmethod(compute_state_evolutions)
