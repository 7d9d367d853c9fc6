"""A ramp of load point velocity: it changes from V_* at a steady rate, and then stays."""

from __future__ import annotations

from dataclasses import dataclass

from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import POSITIVE, POSITIVE_INTEGER, number


@dataclass(frozen=True, kw_only=True)
class VelocityRamp(Loading):
    """Ramp of load point velocity from V_*, divided into stairs.

    ``V_load(t) = V_* + Delta_V_0 min(t/t_r, 1)``, with the change Delta_V_0 over V_* and the
    duration t_r in D_c/V_*. In each of n stairs the load point moves at the mean velocity of the
    ramp there, ``V_j = V_* + Delta_V_0 (j - 1/2)/n``, so that it is where it should be at the end
    of each. What that leaves falls with the square of their number.
    """

    velocity_ramp: float = number(
        0.0,
        r"$\Delta V_0/V_*$",
        "1",
        "change of load point velocity at a steady rate",
        "V_*",
        rule="must be -1 or greater",
        remedy="-1 ends with a load point at rest.",
    )
    velocity_ramp_duration: float = number(
        10.0,
        r"$t_r V_*/D_c$",
        "1",
        "time for which load point velocity changes",
        "D_c/V_*",
        rule=POSITIVE,
    )
    velocity_ramp_stairs: float = number(
        64.0,
        "",
        "1",
        "number of stairs that stand for a ramp of load point velocity",
        rule=POSITIVE_INTEGER,
    )

    name = "velocity_ramp"
    selected_by = "velocity_ramp"

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The stairs, and what follows them."""
        count, change = int(self.velocity_ramp_stairs), self.velocity_ramp
        velocities = [1.0 + change * (stair + 0.5) / count for stair in range(count)]
        lasts = self.velocity_ramp_duration / count
        return (*(Segment(v, duration=lasts) for v in velocities), Segment(1.0 + change))
