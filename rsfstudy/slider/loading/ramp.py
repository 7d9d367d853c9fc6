"""Ramp of imposed normal stress.

The imposed normal stress changes at a steady rate and then remains constant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.quantities import Quantity
from rsfstudy.slider.loading import (
    LoadingWithFinalVelocityBase,
    Segment,
    declare_load_velocity_field,
)
from rsfstudy.slider.parameter_layout import LOADING, LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.scene_view import SceneView


def compute_remaining_stress_change_rates(
    log_slip_rate: float, states: FloatTuple, slip_per_independent_variable: float, p: FloatTuple
) -> FloatTuple:
    r"""Compute the rate of the unknown that describes a ramp of normal stress.

    See ``Fluid`` for the arguments. The tuple ``states`` contains this unknown, :math:`P`, which is
    the change in normal stress that the ramp has not yet imposed. The function reads the rate of
    imposed normal stress, in units of :math:`\sigma_* V_*/D_c`, from ``p[LOADING]``.

    Notes
    -----
    The unknown decreases at a steady rate from the total change in normal stress to zero:

    .. math::

        \frac{dP}{dt} = -\frac{\Delta\sigma}{t_r}.
    """
    return (
        -p[LOADING]
        * slip_per_independent_variable
        * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT)),
    )


def return_zero_remaining_stress_change(log_slip_rate: float, p: FloatTuple) -> FloatTuple:
    r"""Return zero, the remaining change in normal stress in steady sliding.

    In steady sliding, normal stress is constant, so no change remains.
    """
    return (0.0,)


@dataclass(frozen=True, kw_only=True)
class NormalStressRamp(LoadingWithFinalVelocityBase):
    r"""Ramp of imposed normal stress while the load point velocity is constant.

    The slider slides steadily until the ramp starts. If the driving stress is inclined to the
    fault, the ramp changes the stress :math:`\sigma_3`.

    Parameters
    ----------
    normal_stress_ramp : float, default: 0.0
        Change :math:`\Delta\sigma` of imposed normal stress in :math:`\sigma_*`.
    ramp_duration : float, default: 1.0
        Duration :math:`t_r` of the ramp in :math:`D_c/V_*`.
    load_velocity_ratio : float, optional
        Load point velocity :math:`V_0/V_*`. The default is 1.

    Notes
    -----
    The imposed normal stress is

    .. math::

        \sigma(t) = \sigma_* + \Delta\sigma \min(t/t_r, 1).
    """

    normal_stress_ramp: float = number(
        0.0,
        r"$\Delta\sigma/\sigma_*$",
        "1",
        "change of imposed normal stress at a constant rate",
        "sigma_*",
        rule="must be greater than -1",
        remedy="The normal stress must stay positive.",
    )
    ramp_duration: float = number(
        1.0,
        r"$t_r V_*/D_c$",
        "1",
        "duration of the change of imposed normal stress",
        "D_c/V_*",
        rule=POSITIVE,
        remedy="For a sudden change, use normal_stress_step.",
    )
    load_velocity_ratio: float | None = declare_load_velocity_field()

    name = "ramp"
    field_name_that_selects_part = "normal_stress_ramp"
    unknowns = (
        Quantity("ramp_left", "$P$", "1", "remaining change of imposed normal stress", "sigma_*"),
    )
    of_pressure = False
    auxiliary_rates = staticmethod(compute_remaining_stress_change_rates)
    auxiliary_steady_states = staticmethod(return_zero_remaining_stress_change)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Two segments: the ramp, and the constant loading after the ramp."""
        last = Segment(self.load_velocity, normal_stress=self.normal_stress_ramp)
        return last._replace(duration=self.ramp_duration), last

    def initial_unknowns(self, scene: SceneView) -> FloatTuple:
        """Return the total change in normal stress.

        See ``Loading.initial_unknowns``.
        """
        return (self.normal_stress_ramp,)

    def parameter_values(self, scene: SceneView) -> FloatTuple:
        """Return the rate of imposed normal stress.

        See ``Part.parameter_values``.
        """
        return (self.normal_stress_ramp / self.ramp_duration,)
