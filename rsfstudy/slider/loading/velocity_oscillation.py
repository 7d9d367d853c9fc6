"""Oscillating load point velocity, for some cycles: what waves that shake the load point do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rsfstudy.errors import InvalidValue
from rsfstudy.slider.loading import Segment, _train, last_velocity
from rsfstudy.slider.parts import number

if TYPE_CHECKING:
    from rsfstudy.slider.scene import Scene

#: Each is a segment of its own.
_MOST_STAIRS, _STAIRS = 100_000, 64


@dataclass(frozen=True, kw_only=True)
class VelocityOscillation(_train.Train):
    """Load point velocity ``V_0 [1 + A sin(2 pi (t - t_b)/T_o + phase)]``, and into how many stairs
    each cycle is divided.

    In each stair the load point moves at the mean velocity there, so that it is where it should be
    at the end of each. What that leaves falls with the square of their number n: of a small
    response, (pi/n)**2/3.
    """

    velocity_oscillation: float | None = number(
        None,
        "$A_V$",
        "1",
        "amplitude of an oscillation of load point velocity, over its mean",
        rule="must be 0 or greater",
        remedy="0 is no oscillation.",
        if_stated=True,
    )
    velocity_oscillation_stairs: float | None = number(
        None,
        "",
        "1",
        "number of stairs that stand for a cycle of load point velocity",
        rule="must be greater than 0",
        if_stated=True,
    )
    oscillation_period: float = _train.period()
    load_velocity_ratio: float | None = last_velocity()
    oscillation_begin: float | None = _train.begin()
    oscillation_phase: float | None = _train.phase()
    oscillation_cycles: float | None = _train.cycles()

    name = "velocity_oscillation"
    called_by = "velocity_oscillation"

    def check(self, scene: Scene) -> None:
        """A load point that never moves back, an end, and a whole number of stairs."""
        amplitude, cycles, stairs = self.amplitude, self.oscillation_cycles, self.stairs
        if amplitude > 1.0:
            rule = "must be 1 or less: friction is that of forward slip"
            raise InvalidValue("velocity_oscillation", amplitude, rule)
        if cycles is None:
            rule = "must be stated where load point velocity oscillates"
            raise InvalidValue("oscillation_cycles", cycles, rule)
        if stairs % 1.0 or stairs < 4.0 or stairs * cycles > _MOST_STAIRS:
            rule = f"must be a whole number, 4 at least, and {_MOST_STAIRS:,} at most in all cycles"
            raise InvalidValue("velocity_oscillation_stairs", stairs, rule)
        super().check(scene)

    @property
    def amplitude(self) -> float:
        """A."""
        return self.velocity_oscillation or 0.0

    @property
    def stairs(self) -> float:
        """Stairs of a cycle."""
        given = self.velocity_oscillation_stairs
        return _STAIRS if given is None else given

    @property
    def waves(self) -> Iterator[Segment]:
        """The stairs; the last of them may be cut short."""
        left = (self.oscillation_cycles or 0.0) * self.stairs
        turn, lasts = 2.0 * math.pi / self.stairs, self.oscillation_period / self.stairs
        for stair in range(math.ceil(left)):
            part = min(1.0, left - stair)
            middle = self.angle + turn * (stair + 0.5 * part)
            half = 0.5 * turn * part
            mean = self.amplitude * math.sin(middle) * math.sin(half) / half
            yield Segment(self.mean_velocity * max(1.0 + mean, 0.0), duration=lasts * part)

    @property
    def told(self) -> int:
        """Its end alone: each stair would be an event."""
        return 1
