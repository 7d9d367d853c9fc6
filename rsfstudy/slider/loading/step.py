"""Step of velocity, displacement or normal stress at time zero."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import (
    LoadingWithFinalVelocityBase,
    Segment,
    declare_load_velocity_field,
)
from rsfstudy.slider.parts import number
from rsfstudy.slider.scene_caching import cached_attribute


@dataclass(frozen=True, kw_only=True)
class StepLoading(LoadingWithFinalVelocityBase):
    r"""Step of load velocity, load displacement or normal stress at time zero.

    A displacement step changes the spring stress by :math:`k \Delta\delta_0`. You can combine steps
    of velocity, displacement and normal stress.

    Parameters
    ----------
    load_velocity_ratio : float, optional
        Load point velocity :math:`V_0/V_*` after the step. The default is 0 (no motion) after a
        step of displacement or normal stress, and 1 otherwise.
    displacement_step : float, default: 0.0
        Displacement :math:`\Delta\delta_0` of the load point at time zero, in :math:`D_c`.
    normal_stress_step : float, default: 0.0
        Change :math:`\Delta\sigma` of imposed normal stress at time zero, in :math:`\sigma_*`.

    Notes
    -----
    For :math:`t > 0`, the load point velocity and the imposed normal stress are

    .. math::

        V_{\mathrm{load}}(t) = V_0, \quad \sigma(t) = \sigma_* + \Delta\sigma.
    """

    load_velocity_ratio: float | None = declare_load_velocity_field()
    displacement_step: float = number(
        0.0, r"$\Delta\delta_0/D_c$", "1", "load point displacement step", "D_c"
    )
    normal_stress_step: float = number(
        0.0,
        r"$\Delta\sigma/\sigma_*$",
        "1",
        "sudden change of imposed normal stress",
        "sigma_*",
        rule="must be greater than -1",
        remedy="The normal stress must stay positive.",
    )

    name = "step"

    @property
    def load_velocity(self) -> float:
        """Load point velocity after the step, in units of V_*.

        By default, the load point stops after a step of displacement or normal stress. If there is
        no such step, the load point continues at the reference velocity.
        """
        if self.load_velocity_ratio is None and (self.displacement_step or self.normal_stress_step):
            return 0.0
        return super().load_velocity

    @property
    def changes_normal_stress(self) -> bool:
        """True if the step changes normal stress."""
        return self.normal_stress_step != 0.0

    @cached_attribute
    def segments(self) -> tuple[Segment, ...]:
        """Single segment that starts with the step."""
        moved, pressed = self.displacement_step, self.normal_stress_step
        return (Segment(self.load_velocity, moved, normal_stress=pressed),)
