"""A ramp of load point velocity: it changes from V_* at a steady rate, and then stays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import number

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

#: Each is a segment of its own.
_MOST_STAIRS = 100_000


@dataclass(frozen=True, kw_only=True)
class VelocityRamp(Loading):
    """Change of load point velocity, how long it takes, and into how many stairs it is divided.

    In each stair the load point moves at the mean velocity of the ramp there, so that it is where
    it should be at the end of each. What that leaves falls with the square of their number.
    """

    velocity_ramp: float = number(
        0.0,
        r"$\Delta V_0/V_*$",
        "1",
        "change of load point velocity at a steady rate",
        rule="must be -1 or greater",
        remedy="-1 ends with a load point at rest.",
        scale="V_*",
    )
    velocity_ramp_duration: float = number(
        10.0,
        r"$t_r V_*/D_c$",
        "1",
        "time for which load point velocity changes",
        rule="must be greater than 0",
        scale="D_c/V_*",
    )
    velocity_ramp_stairs: float = number(
        64.0,
        "",
        "1",
        "number of stairs that stand for a ramp of load point velocity",
        rule="must be greater than 0",
    )

    name = "velocity_ramp"
    called_by = "velocity_ramp"

    def check(self, scene: Scene) -> None:
        """A whole number of stairs."""
        if self.velocity_ramp_stairs % 1.0 or self.velocity_ramp_stairs > _MOST_STAIRS:
            rule = f"must be a whole number, {_MOST_STAIRS:,} at most"
            raise InvalidValue("velocity_ramp_stairs", self.velocity_ramp_stairs, rule)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The stairs, and what follows them."""
        return tuple(self._segments())

    def _segments(self) -> Iterator[Segment]:
        stairs = int(self.velocity_ramp_stairs)
        for stair in range(stairs):
            velocity = 1.0 + self.velocity_ramp * (stair + 0.5) / stairs
            yield Segment(velocity, duration=self.velocity_ramp_duration / stairs)
        yield Segment(1.0 + self.velocity_ramp)
