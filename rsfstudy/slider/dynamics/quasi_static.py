"""Quasi-static motion, in which only friction balances the spring force."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.parameter_layout import A
from rsfstudy.slider.parts import FloatTuple, NumericFunction


def build_quasi_static_slip_rate_functions(
    friction_functions: FrictionFunctions,
) -> tuple[NumericFunction, NumericFunction]:
    r"""Return the functions that compute the quasi-static slip rate.

    See ``Dynamics`` for the argument and for the returned functions.

    Notes
    -----
    With the deviation :math:`f` of the spring stress and the function ``strength``, written as
    :math:`S`, the slip rate and its derivative follow from

    .. math::

        a \ln\frac{V}{V_*} = S(f) - \Psi, \quad a \, d\ln V = S'(f) \, df - d\Psi.
    """
    strength, state_sum = friction_functions.strength, friction_functions.state_sum
    contribution = friction_functions.state_contribution_to_friction

    def balance(
        spring_stress: float, psis: FloatTuple, p: FloatTuple
    ) -> tuple[float, float, float]:
        value, _slope, shift, _shift_slope = strength(spring_stress, psis, p)
        return (value - state_sum(psis)) / p[A], spring_stress, shift

    def growth(state: FloatTuple, rates: FloatTuple, x: float, g: float, p: FloatTuple) -> float:
        psis = state[1:]
        slope = strength(g, psis, p)[1]
        return (slope * rates[0] - contribution(rates[1:], g, psis, p)) / p[A]

    return balance, growth


@dataclass(frozen=True, kw_only=True)
class QuasiStatic(Dynamics):
    """Quasi-static dynamics, without inertia or radiation damping."""

    name = "quasi_static"
    regime_name = "quasi_static"
    allows_reversed_slip = True
    build_slip_rate_functions = staticmethod(build_quasi_static_slip_rate_functions)
