"""Slide, hold, slide: the load point stops, and moves on after a while."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import LoadingAtVelocity, Segment, load_velocity_field
from rsfstudy.slider.parts import NON_NEGATIVE, number


@dataclass(frozen=True, kw_only=True)
class SlideHoldSlide(LoadingAtVelocity):
    """Hold of the load point for a time, then reloading.

    ``V_load(t) = 0`` for t from 0 to t_h, and ``V_load(t) = V_0`` for t > t_h; t_h is in D_c/V_*,
    and V_0 is V_* unless stated.

    References
    ----------
    Dieterich (1972), J. Geophys. Res. 77, 3690-3697.
    """

    hold_time: float = number(
        0.0,
        "$t_h V_*/D_c$",
        "1",
        "time for which the load point is held",
        "D_c/V_*",
        rule=NON_NEGATIVE,
    )
    load_velocity_ratio: float | None = load_velocity_field()

    name = "slide_hold_slide"
    selected_by = "hold_time"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The hold, and the reloading."""
        return Segment(0.0, duration=self.hold_time), Segment(self.load_velocity)
