"""The composite law of Kato and Tullis (2001).

At rest, the state variable grows with time, as in the slowness law. During slip, the state variable
evolves as in the slip law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, Law, declare_cutoff_velocity_field
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView

#: Number of Halley iterations. Four Halley iterations of ``compute_lambert_w`` reach rounding
#: accuracy.
LAMBERT_W_HALLEY_ITERATION_COUNT = 4


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]``, followed by
    :math:`\ln(V_c/V_*)` and :math:`u_*`.

    Notes
    -----
    With :math:`u = \ln(\theta V/D_c)`, the composite law

    .. math::

        \frac{d\theta}{dt} = e^{-V/V_c} - \frac{\theta V}{D_c} \ln\frac{\theta V}{D_c}

    has the form

    .. math::

        D_c \frac{d\Theta}{d\delta} = b \left(e^{-V/V_c} e^{-u} - u\right).

    The state variable :math:`\Theta` is zero in steady sliding at :math:`V_*`, where :math:`u` has
    the value :math:`u_*`. Therefore

    .. math::

        u = \frac{\Theta}{b} + \ln\frac{V}{V_*} + u_*.

    References
    ----------
    Kato and Tullis (2001), Geophys. Res. Lett. 28, 1103-1106.
    """
    b = p[LAW]
    ahead = state / b + log_slip_rate + p[LAW + 2]
    return b * (
        compute_healing_reduction_factor(log_slip_rate, p[LAW + 1])
        * math.exp(limit_exponent_to_avoid_overflow(-ahead))
        - ahead
    )


def compute_steady_states(
    log_slip_rate: float, stress_induced_state_shift: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the state variable in steady sliding.

    See ``LawBase`` for the arguments.

    Notes
    -----
    In steady sliding, :math:`u` is the solution of

    .. math::

        u \, e^u = e^{-V/V_c}.
    """
    ahead = compute_lambert_w(compute_healing_reduction_factor(log_slip_rate, p[LAW + 1]))
    return (stress_induced_state_shift + p[LAW] * (ahead - p[LAW + 2] - log_slip_rate),)


def compute_healing_reduction_factor(log_slip_rate: float, log_cutoff_velocity: float) -> float:
    r"""Compute the factor that reduces healing at high slip rates.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    log_cutoff_velocity : float
        Natural logarithm of the cut-off velocity, :math:`\ln(V_c/V_*)`.

    Returns
    -------
    float
        Factor :math:`\exp(-V/V_c)`.
    """
    return math.exp(
        -math.exp(limit_exponent_to_avoid_overflow(log_slip_rate - log_cutoff_velocity))
    )


def limit_exponent_to_avoid_overflow(exponent: float) -> float:
    """Limit an exponent to ``MAX_EXPONENT_IN_STATE_EVOLUTION``.

    Larger exponents occur only in trial steps of the integrator.

    Parameters
    ----------
    exponent : float
        Exponent to limit.

    Returns
    -------
    float
        Smaller of the exponent and the limit.
    """
    return min(exponent, MAX_EXPONENT_IN_STATE_EVOLUTION)


def compute_lambert_w(argument: float) -> float:
    """Compute the Lambert W function of a number between 0 and 1.

    Parameters
    ----------
    argument : float
        Argument of the function.

    Returns
    -------
    float
        Solution w of ``w * exp(w) = argument``, computed by Halley's method.
    """
    w = argument / (1.0 + argument)
    for _ in range(LAMBERT_W_HALLEY_ITERATION_COUNT):
        grown = math.exp(w)
        off = w * grown - argument
        w -= off / (grown * (w + 1.0) - 0.5 * (w + 2.0) * off / (w + 1.0))
    return w


@dataclass(frozen=True, kw_only=True)
class CompositeLaw(Law):
    """Composite law with a cut-off velocity for healing.

    Parameters
    ----------
    cutoff_velocity_ratio : float, default: 100.0
        Ratio :math:`V_c/V_*` of the cut-off velocity to the reference velocity. At slip rates above
        :math:`V_c`, contacts no longer heal.
    """

    cutoff_velocity_ratio: float = declare_cutoff_velocity_field()

    name = "composite"
    evolution = staticmethod(compute_state_evolution_per_slip)
    steady_states = staticmethod(compute_steady_states)

    @property
    def min_b_over_a_for_weakening(self) -> float:
        r"""Smallest b/a for which steady friction decreases with slip rate.

        At :math:`V_*`, the steady friction coefficient decreases with :math:`\ln V` at the rate
        :math:`b - a + b \, u_* V_*/[(1 + u_*) V_c]`.
        """
        ahead = self._compute_lambert_w_at_reference_rate()
        return 1.0 / (1.0 + ahead / ((1.0 + ahead) * self.cutoff_velocity_ratio))

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return b, the logarithm of the cut-off velocity, and the steady offset.

        See ``Part.parameter_values``. The steady offset :math:`u_*` is the value of ln(theta V/D_c)
        in steady sliding at :math:`V_*`.
        """
        logarithm = math.log(self.cutoff_velocity_ratio)
        return (
            *super().parameter_values(scene),
            logarithm,
            self._compute_lambert_w_at_reference_rate(),
        )

    def _compute_lambert_w_at_reference_rate(self) -> float:
        return compute_lambert_w(
            compute_healing_reduction_factor(0.0, math.log(self.cutoff_velocity_ratio))
        )
