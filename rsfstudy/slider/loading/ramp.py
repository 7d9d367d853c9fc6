"""A ramp of normal stress: imposed normal stress changes at a steady rate, and then stays."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import LoadingAtVelocity, Segment, load_velocity_field
from rsfstudy.slider.parameter_layout import LARGEST_LOG_SLOWNESS, LOADING
from rsfstudy.slider.parts import POSITIVE, Numbers, number
from rsfstudy.slider.scene_view import SceneView


def auxiliary_rates(log_slip_rate: float, states: Numbers, fraction: float, p: Numbers) -> Numbers:
    """Change of P per unit slip in D_c, times a fraction: at a steady rate in time, by which it
    goes to 0 from all that normal stress is yet to change by, ``dP/dt = -Delta_sigma/t_r``.

    Parameters
    ----------
    log_slip_rate : float
        ln(V/V_*).
    states : tuple of float
        P.
    fraction : float
        What the change is multiplied by (see `fluid.dilatant.auxiliary_rates`).
    p : tuple of float
        Rate of imposed normal stress in sigma_* V_*/D_c, at LOADING.
    """
    return (-p[LOADING] * fraction * math.exp(min(-log_slip_rate, LARGEST_LOG_SLOWNESS)),)


def auxiliary_steady_states(log_slip_rate: float, p: Numbers) -> Numbers:
    """Nothing is left to change in steady sliding."""
    return (0.0,)


@dataclass(frozen=True, kw_only=True)
class NormalStressRamp(LoadingAtVelocity):
    """Ramp of imposed normal stress under a steady load point velocity V_0, V_* unless stated.

    ``sigma(t) = sigma_* + Delta_sigma min(t/t_r, 1)`` from steady sliding at t = 0 on, with the
    change Delta_sigma over sigma_* and the duration t_r in D_c/V_*. Of a driving stress inclined to
    the fault it is sigma_3 that changes so.
    """

    normal_stress_ramp: float = number(
        0.0,
        r"$\Delta\sigma/\sigma_*$",
        "1",
        "change of imposed normal stress at a steady rate",
        "sigma_*",
        rule="must be greater than -1",
        remedy="Normal stress stays positive: a fall is by less than all of it.",
    )
    ramp_duration: float = number(
        1.0,
        r"$t_r V_*/D_c$",
        "1",
        "time for which imposed normal stress changes",
        "D_c/V_*",
        rule=POSITIVE,
        remedy="A sudden change is normal_stress_step.",
    )
    load_velocity_ratio: float | None = load_velocity_field()

    name = "ramp"
    selected_by = "normal_stress_ramp"
    unknowns = (
        Quantity("ramp_left", "$P$", "1", "imposed normal stress that is yet to come", "sigma_*"),
    )
    of_pressure = False
    auxiliary_rates = staticmethod(auxiliary_rates)
    auxiliary_steady_states = staticmethod(auxiliary_steady_states)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The ramp, and what follows it."""
        last = Segment(self.load_velocity, normal_stress=self.normal_stress_ramp)
        return last._replace(duration=self.ramp_duration), last

    def initial_unknowns(self, scene: SceneView) -> Numbers:
        """All of the change is yet to come."""
        return (self.normal_stress_ramp,)

    def numbers(self, scene: SceneView) -> Numbers:
        """Its rate."""
        return (self.normal_stress_ramp / self.ramp_duration,)
