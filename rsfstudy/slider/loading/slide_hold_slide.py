"""Slide-hold-slide test, in which the load point stops for a given time."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import (
    LoadingWithFinalVelocityBase,
    Segment,
    declare_load_velocity_field,
)
from rsfstudy.slider.parts import NON_NEGATIVE, number


@dataclass(frozen=True, kw_only=True)
class SlideHoldSlide(LoadingWithFinalVelocityBase):
    r"""Loading in which the load point stops for a given time and then moves again.

    Parameters
    ----------
    hold_time : float, default: 0.0
        Duration :math:`t_h` of the hold in :math:`D_c/V_*`.
    load_velocity_ratio : float, optional
        Load point velocity :math:`V_0/V_*` after the hold. The default is 1.

    Notes
    -----
    The load point velocity is

    .. math::

        V_{\mathrm{load}}(t) = 0 \text{ for } 0 < t < t_h, \quad
          V_{\mathrm{load}}(t) = V_0 \text{ for } t > t_h.

    References
    ----------
    Dieterich (1972), J. Geophys. Res. 77, 3690-3697.
    """

    hold_time: float = number(
        0.0,
        "$t_h V_*/D_c$",
        "1",
        "duration of the hold of the load point",
        "D_c/V_*",
        rule=NON_NEGATIVE,
    )
    load_velocity_ratio: float | None = declare_load_velocity_field()

    name = "slide_hold_slide"
    field_name_that_selects_part = "hold_time"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Two segments: the hold, and the reloading."""
        return Segment(0.0, duration=self.hold_time), Segment(self.load_velocity)
