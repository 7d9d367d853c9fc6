"""Dilatancy with drainage: pores that open with slip rate lower pore pressure until fluid flows in
(Segall and Rice 1995).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.fluid import Fluid
from rsfstudy.slider.laws import lacks_critical_stiffness
from rsfstudy.slider.parameter_layout import FLUID, LARGEST_LOG_SLOWNESS
from rsfstudy.slider.parts import NON_NEGATIVE, POSITIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


def auxiliary_rates(log_slip_rate: float, states: Numbers, fraction: float, p: Numbers) -> Numbers:
    """Changes of porosity and of pore pressure per unit slip in D_c, times a fraction.

    ``D_c dphi/d(delta) = -(phi - phi_0 - eps ln(V/V_*))`` and ``dp/dt = c* (p_inf - p) -
    (dphi/dt)/beta``, with dt = d(delta)/V; porosity is in units of beta sigma_*.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    states : tuple of float
        Porosity (phi - phi_0)/(beta sigma_*), and pore pressure P.
    fraction : float
        What the changes are multiplied by: zero times infinity, where slip stops, has a limit.
    p : tuple of float
        Dilatancy eps/(beta sigma_*) at FLUID, and drainage c* D_c/V_* behind it.

    References
    ----------
    Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171.
    """
    porosity, pressure = states
    opening = fraction * (p[FLUID] * log_slip_rate - porosity)
    time = fraction * math.exp(min(-log_slip_rate, LARGEST_LOG_SLOWNESS))
    return opening, -p[FLUID + 1] * time * pressure - opening


def auxiliary_steady_states(log_slip_rate: float, p: Numbers) -> Numbers:
    """Porosity of steady sliding, and no pore pressure: phi = phi_0 + eps ln(V/V_*)."""
    return p[FLUID] * log_slip_rate, 0.0


@dataclass(frozen=True, kw_only=True)
class DilatantFluid(Fluid):
    """Pores that open with slip rate, in a fault that exchanges fluid with what surrounds it.

    Pore pressure begins at that of the surroundings, as in steady sliding, where porosity is
    ``phi = phi_0 + eps ln(V/V_*)``.

    References
    ----------
    Segall and Rice (1995), J. Geophys. Res. 100, 22155-22171.
    """

    dilatancy: float = number(
        0.01,
        r"$\epsilon/(\beta\sigma_*)$",
        "1",
        "pore pressure that undrained dilatancy takes for each unit of ln V",
        "sigma_*",
        rule=NON_NEGATIVE,
    )
    drainage: float = number(
        1.0,
        "$c^*D_c/V_*$",
        "1",
        "rate at which pore pressure drains",
        "V_*/D_c",
        rule=POSITIVE,
        remedy="Nearly undrained is a small number, and without drainage there is no steady state.",
    )

    name = "dilatant"
    unknowns = (
        Quantity(
            "porosity",
            r"$(\varphi-\varphi_0)/(\beta\sigma_*)$",
            "1",
            "porosity above that of steady sliding at V_star",
            "beta sigma_*",
        ),
        Quantity(
            "pore_pressure",
            r"$(p-p_\infty)/\sigma_*$",
            "1",
            "pore pressure above that of the surroundings",
            "sigma_*",
        ),
    )
    auxiliary_rates = staticmethod(auxiliary_rates)
    auxiliary_steady_states = staticmethod(auxiliary_steady_states)

    def check(self, scene: SceneView) -> None:
        """Some critical stiffness, where the spring is given by its ratio to that."""
        if lacks_critical_stiffness(scene):
            rule = f"leaves no critical stiffness with dilatancy = {self.dilatancy:g}"
            raise self.field_error("drainage", rule, "Give stiffness itself, or raise drainage.")

    def highest_pressure(self, log_slip_rate: float, states: Numbers) -> float:
        """Pores close by ``V (phi - phi_0 - eps ln(V/V_*))`` at most, which drainage holds at a
        pressure of that over c*.
        """
        closing = max(states[0] - self.dilatancy * log_slip_rate, self.dilatancy)
        return max(states[1], math.exp(log_slip_rate) * closing / self.drainage)

    @property
    def effects(self) -> tuple[str, ...]:
        return ("dilatancy",)

    def numbers(self, scene: SceneView) -> Numbers:
        """Dilatancy and drainage."""
        return self.dilatancy, self.drainage
