"""A step at the start: of load point velocity, load point displacement, normal stress, or several
of them.
"""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.caching import cached_attribute
from rsfstudy.slider.loading import LoadingAtVelocity, Segment, load_velocity_field
from rsfstudy.slider.parts import number


@dataclass(frozen=True, kw_only=True)
class StepLoading(LoadingAtVelocity):
    """Step of load point velocity, load point displacement or normal stress at t = 0.

    ``V_load(t) = V_0`` and ``sigma(t) = sigma_* + Delta_sigma`` for t > 0, and the load point moves
    by ``Delta_delta_0`` at t = 0, by which spring stress changes by k Delta_delta_0. Velocities are
    over V_*, displacements over D_c and stresses over sigma_*.
    """

    load_velocity_ratio: float | None = load_velocity_field()
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
        remedy="Normal stress stays positive: a fall is by less than all of it.",
    )

    name = "step"

    @property
    def load_velocity(self) -> float:
        """V_0/V_* after the step.

        A scene that does not say otherwise holds its load point after a step of displacement or of
        normal stress (V_0 = 0) and otherwise goes on at the reference rate (V_0 = V_*).
        """
        if self.load_velocity_ratio is None and (self.displacement_step or self.normal_stress_step):
            return 0.0
        return super().load_velocity

    @property
    def changes_normal_stress(self) -> bool:
        return self.normal_stress_step != 0.0

    @cached_attribute
    def segments(self) -> tuple[Segment, ...]:
        """The step, and what follows it."""
        moved, pressed = self.displacement_step, self.normal_stress_step
        return (Segment(self.load_velocity, moved, normal_stress=pressed),)
