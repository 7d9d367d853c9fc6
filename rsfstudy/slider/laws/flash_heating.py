"""The slip law with flash heating of contact asperities (Rice 2006).

At slip rates above the weakening velocity, frictional heat weakens the contacts between the two
sides of the fault. The steady friction coefficient then decreases to a low value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.laws import MAX_EXPONENT_IN_STATE_EVOLUTION, Law
from rsfstudy.slider.parameter_layout import LAW, MU_STAR, A
from rsfstudy.slider.parts import NON_NEGATIVE, POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


def compute_steady_state_variable(log_slip_rate: float, p: FloatTuple) -> float:
    r"""Compute the state variable in steady sliding.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    p : tuple of float
        Parameters of the scene. The function reads :math:`b`, :math:`f_w`, :math:`\ln(V_w/V_*)`,
        :math:`n` and :math:`\ln[1 + (V_*/V_w)^n]` from ``p[LAW]`` and the following elements.

    Returns
    -------
    float
        State variable :math:`\Theta_{\mathrm{ss}}`, which is zero at :math:`V_*`.

    Notes
    -----
    The steady friction coefficient is

    .. math::

        \mu_{\mathrm{ss}} = f_w + (\mu_{LV} - f_w) D, \quad
          \mu_{LV} = \mu_* + (a - b) \ln\frac{V}{V_*}, \quad
          D = \left[\frac{1 + (V_*/V_w)^n}{1 + (V/V_w)^n}\right]^{1/n}.

    The numerator of :math:`D` makes the friction coefficient exactly :math:`\mu_*` at :math:`V_*`.
    The function evaluates :math:`\Theta_{\mathrm{ss}} = -b \ln(V/V_*) + (\mu_{LV} - f_w)(D - 1)`.
    This form avoids cancellation at slip rates far below :math:`V_w`.
    """
    b, exponent = p[LAW], p[LAW + 3]
    power = exponent * (log_slip_rate - p[LAW + 2])
    # For large arguments, ln(1 + exp(x)) equals x.
    faster = power if power > MAX_EXPONENT_IN_STATE_EVOLUTION else math.log1p(math.exp(power))
    excess = p[MU_STAR] - p[LAW + 1] + (p[A] - b) * log_slip_rate
    return -b * log_slip_rate + excess * math.expm1((p[LAW + 4] - faster) / exponent)


def compute_state_evolution_per_slip(log_slip_rate: float, state: float, p: FloatTuple) -> float:
    r"""Compute the state evolution per unit slip at constant normal stress.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    state : float
        State variable :math:`\Theta`.
    p : tuple of float
        Parameters of the scene (see `steady_state`).

    Returns
    -------
    float
        Rate :math:`D_c \, d\Theta/d\delta = -(\Theta - \Theta_{\mathrm{ss}})`.
    """
    return compute_steady_state_variable(log_slip_rate, p) - state


def compute_steady_states(
    log_slip_rate: float, stress_induced_state_shift: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the sum of the steady state variable and the stress-induced shift.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    stress_induced_state_shift : float
        Stress-induced decrease in the state variable.
    p : tuple of float
        Parameters of the scene.

    Returns
    -------
    tuple of float
        State :math:`\Psi`.
    """
    return (stress_induced_state_shift + compute_steady_state_variable(log_slip_rate, p),)


@dataclass(frozen=True, kw_only=True)
class FlashHeatingLaw(Law):
    r"""Slip law with flash heating at high slip rates.

    If a scene has neither inertia nor radiation damping, the slip rate of a rupture is unbounded.
    Use this law in scenes with inertia or radiation damping.

    Parameters
    ----------
    weakening_velocity_ratio : float, default: 1e5
        Ratio :math:`V_w/V_*` of the weakening velocity to the reference velocity. At slip rates far
        above :math:`V_w`, the steady friction coefficient exceeds ``weakened_friction`` by an
        amount proportional to :math:`V_w/V`.
    weakened_friction : float, default: 0.2
        Friction coefficient :math:`f_w` of weakened contacts, which is less than :math:`\mu_*`.
    weakening_exponent : float, default: 8.0
        Exponent :math:`n`. The transition at :math:`V_w` is sharper if the exponent is larger.

    Notes
    -----
    At constant normal stress and without inertia, the critical stiffness is

    .. math::

        k_{cr} = \frac{\sigma}{D_c} D \left[b - a + (\mu_{LV} - f_w) \frac{w}{1 + w}\right], \quad
          w = \left(\frac{V}{V_w}\right)^n,

    with :math:`D` and :math:`\mu_{LV}` from `steady_state`.

    References
    ----------
    Rice (2006), J. Geophys. Res. 111, B05311; Noda, Dunham and Rice (2009), J. Geophys. Res. 114,
    B07302.
    """

    weakening_velocity_ratio: float = number(
        1e5,
        "$V_w/V_*$",
        "1",
        "weakening velocity of flash heating",
        "V_*",
        rule=POSITIVE,
        omit_if_default=True,
    )
    weakened_friction: float = number(
        0.2,
        "$f_w$",
        "1",
        "friction coefficient of weakened contacts",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    weakening_exponent: float = number(
        8.0,
        "$n$",
        "1",
        "sharpness of the transition to flash heating",
        rule=POSITIVE,
        omit_if_default=True,
    )

    name = "flash_heating"
    evolution = staticmethod(compute_state_evolution_per_slip)
    steady_states = staticmethod(compute_steady_states)
    has_logarithmic_state = False

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return ("flash_heating", *super().effects)

    def check(self, scene: SceneView) -> None:
        """Check that the friction coefficient of weakened contacts is below mu_*.

        See ``Part.check``.
        """
        super().check(scene)
        if self.weakened_friction >= scene.mu_star:
            rule = (
                f"must be less than mu_star = {scene.mu_star:g}, because flash heating "
                "decreases friction"
            )
            raise self.build_field_error(
                "weakened_friction", rule, "Decrease weakened_friction, or increase mu_star."
            )

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        r"""Return b and the weakening parameters.

        See ``Part.parameter_values``. The weakening parameters are :math:`f_w`,
        :math:`\ln(V_w/V_*)`, :math:`n` and :math:`\ln[1 + (V_*/V_w)^n]`.
        """
        logarithm, exponent = math.log(self.weakening_velocity_ratio), self.weakening_exponent
        power = -exponent * logarithm
        at_reference = (
            power if power > MAX_EXPONENT_IN_STATE_EVOLUTION else math.log1p(math.exp(power))
        )
        own = self.weakened_friction, logarithm, exponent, at_reference
        return (*super().parameter_values(scene), *own)
