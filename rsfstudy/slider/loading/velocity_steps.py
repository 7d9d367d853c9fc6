"""Velocity steps: the load point velocity steps from V_* to another and back, again and again."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import NON_NEGATIVE_INTEGER, POSITIVE, number


@dataclass(frozen=True, kw_only=True)
class VelocitySteps(Loading):
    """Steps of load point velocity from V_* to r V_* and back in turn.

    ``V_load(t) = r V_*`` after the first step and each second one from there, ``V_load(t) = V_*``
    after the others. The load point moves by ``Delta_delta_0`` (over D_c) from one step to the
    next; the velocity that the last leads to goes on for ever.
    """

    velocity_steps: float = number(
        0.0,
        "",
        "1",
        "number of steps of load point velocity, there and back in turn",
        rule=NON_NEGATIVE_INTEGER,
    )
    velocity_ratio: float = number(
        10.0,
        "$r$",
        "1",
        "load point velocity after the first step over V_star",
        rule=POSITIVE,
        remedy="Below 1 the first step is down; hold_time holds the load point.",
    )
    displacement_between_steps: float = number(
        20.0,
        r"$\Delta\delta_0/D_c$",
        "1",
        "load point displacement from one step to the next",
        "D_c",
        rule=POSITIVE,
    )

    name = "velocity_steps"
    selected_by = "velocity_steps"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """One after each step."""
        count, moves = int(self.velocity_steps), self.displacement_between_steps
        velocities = [1.0 if number_ % 2 else self.velocity_ratio for number_ in range(count)]
        lasts = [*(moves / velocity for velocity in velocities[:-1]), math.inf]
        return tuple(Segment(v, duration=t) for v, t in zip(velocities, lasts, strict=False))
