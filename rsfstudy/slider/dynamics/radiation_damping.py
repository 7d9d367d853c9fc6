"""Quasi-dynamic motion, in which seismic waves carry energy away (radiation damping).

The radiated waves reduce the stress on the fault by an amount proportional to the slip rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.dynamics import Dynamics
from rsfstudy.slider.friction import FrictionFunctions
from rsfstudy.slider.parameter_layout import DYNAMICS, LOG_SLIP_RATE_UPPER_LIMIT, A
from rsfstudy.slider.parts import NON_NEGATIVE, FloatTuple, NumericFunction, number
from rsfstudy.slider.scene_view import SceneView

_MAX_NEWTON_ITERATIONS = 200
_NEWTON_STEP_RTOL = 1e-15
#: Relative tolerance of the strength for the convergence of Newton's method. A small Newton step
#: does not imply convergence, because the strength is very steep at the lower limit of normal
#: stress. Only trial steps of the integrator reach the lower limit of normal stress.
_STRESS_BALANCE_RTOL = 1e-6
#: Upper limit of ln V, at which the radiated stress is 10^300 eta. Only trial steps of the
#: integrator reach the upper limit of ln V.
_MAX_LOG_SLIP_RATE_OF_STRESS_BALANCE = 690.0


def compute_radiated_stress(log_slip_rate: float, damping_coefficient: float) -> float:
    r"""Compute the stress reduction due to the radiation of seismic waves.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    damping_coefficient : float
        Damping coefficient :math:`\eta V_*/\sigma_*`. For an elastic half-space with shear modulus
        :math:`G` and shear wave velocity :math:`c_s`, :math:`\eta = G/(2 c_s)`.

    Returns
    -------
    float
        Stress :math:`\eta (V - V_*)` in :math:`\sigma_*`, which is zero at :math:`V_*`.

    References
    ----------
    Rice (1993), J. Geophys. Res. 98, 9885-9907.
    """
    return damping_coefficient * math.expm1(log_slip_rate)


def build_damped_slip_rate_functions(
    friction_functions: FrictionFunctions,
) -> tuple[NumericFunction, NumericFunction]:
    r"""Return the functions that compute the slip rate with radiation damping.

    See ``Dynamics`` for the argument and for the returned functions.

    Notes
    -----
    With the function ``strength``, written as :math:`S`, and the slip rate in :math:`V_*`, the
    balance of stress and the derivative of :math:`\ln V` are

    .. math::

        S(f - \eta (V - 1)) = a \ln V + \Psi, \quad
          \left[a + S'(g) \eta V\right] d\ln V = S'(g) \, df - d\Psi.

    We solve the balance by Newton's method. The left side of the balance decreases with :math:`V`
    and the right side increases, so the balance has a unique root. If a Newton step leaves the
    interval that contains the root, or if the steps shrink too slowly, the solver bisects the
    interval.
    """
    strength, state_sum = friction_functions.strength, friction_functions.state_sum
    contribution = friction_functions.state_contribution_to_friction

    def balance(
        spring_stress: float, psis: FloatTuple, p: FloatTuple
    ) -> tuple[float, float, float]:
        a, damping, psi = p[A], p[DYNAMICS], state_sum(psis)
        # Slip is always forward, so the radiated stress is at least -eta. The lower bound of the
        # radiated stress limits ln V from above.
        low, high = (
            -math.inf,
            min(
                (strength(spring_stress + damping, psis, p)[0] - psi) / a,
                _MAX_LOG_SLIP_RATE_OF_STRESS_BALANCE,
            ),
        )
        # This initial value is accurate if radiation balances most of the spring stress.
        x = min(high, math.log(max(a * high / damping, 1.0))) if high > 0.0 else high
        before = math.inf
        for _ in range(_MAX_NEWTON_ITERATIONS):
            g = spring_stress - damping * math.expm1(x)
            value, slope, shift, _shift_slope = strength(g, psis, p)
            missing = value - psi - a * x
            if missing > 0.0:
                low = x
            else:
                high = x
            change = missing / (a + slope * damping * math.exp(x))
            balanced = abs(missing) <= _STRESS_BALANCE_RTOL * (1.0 + abs(psi) + a * abs(x))
            if balanced and abs(change) <= _NEWTON_STEP_RTOL * (1.0 + abs(x)):
                return x, g, shift
            # If normal stress is almost zero, slopes are very steep, and Newton steps shrink
            # slowly.
            slow = abs(change) > 0.5 * abs(before) or abs(change) <= _NEWTON_STEP_RTOL * (
                1.0 + abs(x)
            )
            before = change
            if slow or not low < x + change <= high:
                before = math.inf
                x = 0.5 * (max(low, high - 1e3) + high)
            else:
                x += change
        g = spring_stress - damping * math.expm1(x)
        return x, g, strength(g, psis, p)[2]

    def growth(state: FloatTuple, rates: FloatTuple, x: float, g: float, p: FloatTuple) -> float:
        psis = state[1:]
        slope = strength(g, psis, p)[1]
        resists = p[A] + slope * p[DYNAMICS] * math.exp(min(x, LOG_SLIP_RATE_UPPER_LIMIT))
        return (slope * rates[0] - contribution(rates[1:], g, psis, p)) / resists

    return balance, growth


@dataclass(frozen=True, kw_only=True)
class RadiationDamping(Dynamics):
    r"""Slider with radiation damping.

    Parameters
    ----------
    radiation_damping : float, default: 0.0
        Damping coefficient :math:`\eta V_*/\sigma_*`.

    Notes
    -----
    The spring stress :math:`f` balances the frictional stress :math:`g` and the radiated stress:

    .. math::

        f = g + \eta (V - V_*).
    """

    radiation_damping: float = number(
        0.0,
        r"$\eta V_*/\sigma_*$",
        "1",
        "stress radiated by waves at V_star",
        "sigma_*",
        rule=NON_NEGATIVE,
    )

    name = "radiation_damping"
    field_name_that_selects_part = "radiation_damping"
    regime_name = "quasi_dynamic"
    build_slip_rate_functions = staticmethod(build_damped_slip_rate_functions)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("radiation_damping",)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the damping coefficient.

        See ``Part.parameter_values``.
        """
        return (self.radiation_damping,)

    def radiated_stress(self, log_slip_rate: float) -> float:
        """Compute the stress reduction due to the radiation of seismic waves.

        See ``Dynamics.radiated_stress``.
        """
        return compute_radiated_stress(log_slip_rate, self.radiation_damping)

    def radiated_stress_slope(self, log_slip_rate: float) -> float:
        """Compute the derivative of the radiated stress with respect to ln V.

        See ``Dynamics.radiated_stress_slope``.
        """
        return self.radiation_damping * math.exp(log_slip_rate)
