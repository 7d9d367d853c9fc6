"""A step at the start: of load point velocity, of load point displacement, or of both."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment, last_velocity
from rsfstudy.slider.parts import number


@dataclass(frozen=True, kw_only=True)
class Step(Loading):
    """Load point velocity after the step, and displacement in the step."""

    load_velocity_ratio: float | None = last_velocity()
    displacement_step: float = number(
        0.0, r"$\Delta\delta_0/D_c$", "1", "load point displacement step", scale="D_c"
    )

    name = "step"

    @property
    def load_velocity(self) -> float:
        """V_0/V_* after the step.

        A scene that does not say otherwise holds its load point after a displacement step (V_0 = 0)
        and otherwise goes on at the reference rate (V_0 = V_*).
        """
        if self.load_velocity_ratio is None:
            return 1.0 if self.displacement_step == 0.0 else 0.0
        return self.load_velocity_ratio

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The step, and what follows it."""
        return (Segment(self.load_velocity, self.displacement_step),)
