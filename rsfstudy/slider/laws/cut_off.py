"""The slowness law, modified so that the evolution effect vanishes at high slip rates.

At slip rates far above the cut-off velocity, the friction coefficient no longer depends on the
state variable.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import (
    MAX_EXPONENT_IN_STATE_EVOLUTION,
    Law,
    declare_cutoff_velocity_field,
    fast_expm1,
)
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.slider.parts import FloatTuple
from rsfstudy.slider.scene_view import SceneView


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    See ``LawBase`` for the arguments. The function reads :math:`b` from ``p[LAW]``, followed by the
    fractions :math:`V_c/(V_c + V_*)` and :math:`V_*/(V_c + V_*)`.

    Notes
    -----
    The friction coefficient is :math:`\mu_* + a \ln(V/V_*) + \Theta`. The state variable and its
    evolution are

    .. math::

        \Theta = b \ln\frac{1 + \theta V_c/D_c}{1 + V_c/V_*}, \quad
          \frac{d\theta}{dt} = 1 - \frac{\theta V}{D_c}.

    With the steady state :math:`\Theta_{\mathrm{ss}}` at the slip rate :math:`V`, the evolution per
    unit slip is

    .. math::

        D_c \frac{d\Theta}{d\delta} = b \left[e^{(\Theta_{\mathrm{ss}} - \Theta)/b} - 1\right].

    References
    ----------
    Okubo (1989), J. Geophys. Res. 94, 12321-12335.
    """
    b = p[LAW]
    behind = compute_steady_state_over_b(log_slip_rate, p[LAW + 1], p[LAW + 2]) - state / b
    return b * fast_expm1(min(behind, MAX_EXPONENT_IN_STATE_EVOLUTION))


def compute_steady_states(
    log_slip_rate: float, stress_induced_state_shift: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the state variable in steady sliding.

    See ``LawBase`` for the arguments.

    Notes
    -----
    The steady state is

    .. math::

        \Theta_{\mathrm{ss}} = b \ln\frac{1 + V_c/V}{1 + V_c/V_*}.
    """
    return (
        stress_induced_state_shift
        + p[LAW] * compute_steady_state_over_b(log_slip_rate, p[LAW + 1], p[LAW + 2]),
    )


def compute_steady_state_over_b(
    log_slip_rate: float, cutoff_velocity_fraction: float, reference_velocity_fraction: float
) -> float:
    r"""Compute the state variable in steady sliding, divided by b.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    cutoff_velocity_fraction : float
        Fraction :math:`V_c/(V_c + V_*)`.
    reference_velocity_fraction : float
        Fraction :math:`V_*/(V_c + V_*)`.

    Returns
    -------
    float
        Ratio :math:`\Theta_{\mathrm{ss}}/b`, which is zero at :math:`V_*`.

    Notes
    -----
    The function uses two equivalent formulas, one for slip rates below :math:`V_*` and one for
    higher slip rates. Each formula avoids the cancellation of digits in its range of slip rates.
    Exponents are limited to ``MAX_EXPONENT_IN_STATE_EVOLUTION`` to avoid overflow.
    """
    if log_slip_rate < 0.0:
        exponent = min(-log_slip_rate, MAX_EXPONENT_IN_STATE_EVOLUTION)
        return (
            math.log1p(cutoff_velocity_fraction * math.expm1(exponent)) - log_slip_rate - exponent
        )
    exponent = min(log_slip_rate, MAX_EXPONENT_IN_STATE_EVOLUTION)
    return math.log1p(reference_velocity_fraction * math.expm1(exponent)) - exponent


@dataclass(frozen=True, kw_only=True)
class CutOffLaw(Law):
    """Slowness law with a cut-off velocity for the evolution effect.

    Parameters
    ----------
    cutoff_velocity_ratio : float, default: 100.0
        Ratio :math:`V_c/V_*` of the cut-off velocity to the reference velocity. At slip rates above
        :math:`V_c`, the evolution effect vanishes.
    """

    cutoff_velocity_ratio: float = declare_cutoff_velocity_field()

    name = "cut_off"
    evolution = staticmethod(compute_state_evolution_per_slip)
    steady_states = staticmethod(compute_steady_states)
    has_logarithmic_state = False  # The state is a logarithm of 1 + theta V_c/D_c.

    @property
    def min_b_over_a_for_weakening(self) -> float:
        r"""Smallest b/a for which steady friction decreases with slip rate.

        At :math:`V_*`, the steady friction coefficient decreases with :math:`\ln V` at the rate
        :math:`b/(1 + V_*/V_c) - a`.
        """
        return 1.0 + 1.0 / self.cutoff_velocity_ratio

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return b and the two velocity fractions.

        See ``Part.parameter_values``. The velocity fractions are :math:`V_c/(V_c + V_*)` and
        :math:`V_*/(V_c + V_*)`.
        """
        return (*super().parameter_values(scene), *self._compute_cutoff_and_reference_fractions())

    def state_relaxation_function(self, log_slip_rate: float, slip: float) -> float:
        r"""Compute the relaxation of stress at constant slip rate.

        Parameters
        ----------
        log_slip_rate : float
            Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
        slip : float
            Slip since the velocity step from :math:`V_*`, in :math:`D_c`.

        Returns
        -------
        float
            Difference between the friction coefficient and its steady value, divided by b.

        Notes
        -----
        The relaxation is

        .. math::

            \ln\left[1 + \left(\frac{1 + V_c/V_*}{1 + V_c/V} - 1\right) e^{-\delta/D_c}\right].
        """
        ahead = -compute_steady_state_over_b(
            log_slip_rate, *self._compute_cutoff_and_reference_fractions()
        )
        return math.log(-math.expm1(-slip) + math.exp(ahead - slip))

    def _compute_cutoff_and_reference_fractions(self) -> FloatTuple:
        return 1.0 / (1.0 + 1.0 / self.cutoff_velocity_ratio), 1.0 / (
            1.0 + self.cutoff_velocity_ratio
        )
