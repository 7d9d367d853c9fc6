"""Shear heating of a fault that loses heat to its surroundings.

The friction may depend on the temperature of the fault (Chester 1994).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.laws import lacks_critical_stiffness
from rsfstudy.slider.parameter_layout import LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import NON_NEGATIVE, POSITIVE, FloatTuple, number
from rsfstudy.slider.quantities_required_by_parts import (
    EFFECTIVE_NORMAL_STRESS,
    FRICTION_COEFFICIENT,
)
from rsfstudy.slider.scene_view import SceneView
from rsfstudy.slider.temperature import Temperature


def compute_temperature_rate(
    log_slip_rate: float,
    temperature_rise: float,
    friction_coefficient: float,
    normal_stress: float,
    slip_per_independent_variable: float,
    heating_parameters: FloatTuple,
) -> float:
    r"""Compute the rate of change of the temperature rise.

    Parameters
    ----------
    log_slip_rate : float
        Natural logarithm of the slip rate, :math:`\ln(V/V_*)`.
    temperature_rise : float
        Temperature rise :math:`\vartheta`.
    friction_coefficient : float
        Friction coefficient :math:`\mu`.
    normal_stress : float
        Effective normal stress :math:`s` in :math:`\sigma_*`.
    slip_per_independent_variable : float
        Slip per unit of the independent variable, by which the result is multiplied.
    heating_parameters : tuple of float
        Heating :math:`H`, cooling :math:`C`, and the product :math:`H \mu_*`.

    Returns
    -------
    float
        Change in the temperature rise per unit slip in :math:`D_c`, multiplied by
        ``slip_per_independent_variable``.

    Notes
    -----
    In units of :math:`D_c/V_*` for time and :math:`V_*` for the slip rate,

    .. math::

        \frac{d\vartheta}{dt} = H (\mu s V - \mu_*) - C \vartheta.
    """
    heating, cooling, steady_heating = heating_parameters
    time = slip_per_independent_variable * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    return slip_per_independent_variable * heating * friction_coefficient * normal_stress - time * (
        steady_heating + cooling * temperature_rise
    )


@dataclass(frozen=True, kw_only=True)
class ShearHeating(Temperature):
    r"""Temperature of a fault with shear heating and a constant cooling rate.

    Parameters
    ----------
    heating : float, default: 1e-3
        Temperature rise per unit slip at unit shear stress,
        :math:`H = \sigma_* D_c/(\rho c w T_*)`, without cooling. Here :math:`\rho c` is the
        volumetric heat capacity and :math:`w` is the width of the shear zone.
    cooling : float, default: 1.0
        Cooling rate :math:`C = c_{th} D_c/V_*`, for example with
        :math:`c_{th} = \alpha_{th}/w_h^2`, where :math:`\alpha_{th}` is the thermal diffusivity and
        :math:`w_h` is the effective width of the heat loss.
    direct_activation : float, default: 0.0
        Activation term :math:`q_a = Q_a/(R T_*)` of the direct effect.
    evolution_activation : float, default: 0.0
        Activation term :math:`q_b = Q_b/(R T_*)` of the evolution effect.

    Notes
    -----
    In steady sliding, :math:`\vartheta = (H/C) (\mu s V/V_* - \mu_*)`. If :math:`Q_a = Q_b = Q`, an
    increase in temperature has the same effect as a decrease in slip rate. Friction is then rate
    weakening at low slip rates, and rate strengthening at slip rates at which heating exceeds about
    :math:`R T^2/Q`.

    References
    ----------
    Chester (1994), J. Geophys. Res. 99, 7247-7261; Blanpied, Tullis and Weeks (1998), J. Geophys.
    Res. 103, 489-511; Kato (2001), Earth Planet. Sci. Lett. 186, 417-426.
    """

    heating: float = number(
        1e-3,
        r"$\sigma_* D_c/(\rho c w T_*)$",
        "1",
        "temperature rise due to slip of D_c at unit shear stress, divided by T_star",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    cooling: float = number(
        1.0,
        "$c_{th}D_c/V_*$",
        "1",
        "cooling rate of the fault",
        "V_*/D_c",
        rule=POSITIVE,
        remedy="Without cooling, no steady state exists. For nearly adiabatic conditions, use "
        "a small value.",
        omit_if_default=True,
    )
    direct_activation: float = number(
        0.0,
        "$Q_a/(RT_*)$",
        "1",
        "activation term of the direct effect",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )
    evolution_activation: float = number(
        0.0,
        "$Q_b/(RT_*)$",
        "1",
        "activation term of the evolution effect",
        rule=NON_NEGATIVE,
        omit_if_default=True,
    )

    name = "shear_heating"
    unknowns = (
        Quantity(
            "temperature_rise",
            r"$(T-T_*)/T_*$",
            "1",
            "temperature minus the temperature in steady sliding at V_star",
            "T_*",
        ),
    )
    needs = frozenset({FRICTION_COEFFICIENT, EFFECTIVE_NORMAL_STRESS})
    temperature_rate = staticmethod(compute_temperature_rate)

    @property
    def dimensionless_activation_energies(self) -> tuple[float, float]:
        """Activation terms of the direct effect and of the evolution effect."""
        return self.direct_activation, self.evolution_activation

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the active physical effects of the part."""
        return (
            "shear_heating",
            *("thermal_activation",) * any(self.dimensionless_activation_energies),
        )

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        r"""Return the parameters of ``compute_temperature_rate``.

        See ``Part.parameter_values``.
        """
        return self.heating, self.cooling, self.heating * scene.mu_star

    def compute_temperature_rise_bounds(
        self, scene: SceneView, temperature_rise: float, max_frictional_power: float
    ) -> tuple[float, float]:
        """Compute bounds on the future temperature rise.

        See ``Temperature.compute_temperature_rise_bounds``. At any time, the temperature evolves
        towards the steady temperature for the current heating power. The steady temperature lies
        between the steady temperature without slip and the steady temperature at the largest power.
        """
        over_cooling = self.heating / self.cooling
        lowest = -over_cooling * scene.mu_star
        return min(temperature_rise, lowest), max(
            temperature_rise, over_cooling * max_frictional_power + lowest
        )

    def check(self, scene: SceneView) -> None:
        """Check the activation terms and the temperature of the surroundings.

        See ``Part.check``. The activation terms require a law with one state. If the friction
        depends on temperature, the temperature of the surroundings must be positive.
        """
        if any(self.dimensionless_activation_energies):
            law = scene.parts.law
            if law.state_count > 1:
                name = "direct_activation" if self.direct_activation else "evolution_activation"
                rule = "requires a law with one state variable, but "
                rule += f"law={law.name!r} has {law.state_count} state variables"
                raise self.build_field_error(name, rule, f"Omit {name}, or choose another law.")
            hottest = self.cooling / scene.mu_star
            if self.heating >= hottest:
                rule = f"must be less than cooling/mu_star = {hottest:g}, because otherwise the "
                rule += "surroundings would be colder than absolute zero"
                raise self.build_field_error(
                    "heating", rule, "Decrease heating, or increase cooling."
                )
        if lacks_critical_stiffness(scene):
            rule = (
                "cannot be used with stiffness_ratio, because no critical stiffness exists for "
                "this value at V_*"
            )
            raise self.build_field_error(
                "heating", rule, "Pass stiffness instead of stiffness_ratio, or increase cooling."
            )
