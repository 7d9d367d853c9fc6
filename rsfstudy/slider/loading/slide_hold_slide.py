"""Slide, hold, slide: the load point stops, and moves on after a while."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment, last_velocity
from rsfstudy.slider.parts import number


@dataclass(frozen=True, kw_only=True)
class SlideHoldSlide(Loading):
    """Hold time, and load point velocity on reloading (V_* unless stated)."""

    hold_time: float = number(
        0.0,
        "$t_h V_*/D_c$",
        "1",
        "time for which the load point is held",
        rule="must be 0 or greater",
        remedy="0 is no hold.",
        scale="D_c/V_*",
    )
    load_velocity_ratio: float | None = last_velocity()

    name = "slide_hold_slide"
    called_by = "hold_time"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The hold, and the reloading."""
        reload = 1.0 if self.load_velocity_ratio is None else self.load_velocity_ratio
        return Segment(0.0, duration=self.hold_time), Segment(reload)
