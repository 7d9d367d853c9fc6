"""What a motion tells: a table of events in order, each with its time, slip and point.

Who measures a motion asks to be told of

    maximum(of), minimum(of)    an extremum of a quantity
    rise(of, to), fall(of, to)  its crossing of a level, on the way up or down
    settling(part)              how far the slider is from steady sliding has become less than a
                                part of the farthest so far (told at the end of each step while so,
                                in the segment of loading that goes on for ever, and not
                                where that goes on changing normal stress)

and of nothing else. Each may end the motion. Quantities are the numbers of a `Point`, and the
friction coefficient that is read, ``reading`` (see `readings`); extrema are told of ``log_rate``,
``spring`` and ``reading``. Beside what was asked for, a motion tells its start, every
change of regime, every segment of its loading that begins, and its end in time. What happens from
one regime or segment to the next is told where that begins. A motion that cannot go on ends with
`Halt`, which says why.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from rsfstudy.motion.stepping import Step
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.slots import LOG_LOAD_RATE, SIZE


class Kind(StrEnum):
    """Kinds of events."""

    START = "start"
    MAXIMUM = "maximum"
    MINIMUM = "minimum"
    RISE = "rise"
    FALL = "fall"
    SETTLED = "settled"
    REGIME = "regime"
    SEGMENT = "segment"
    SAMPLE = "sample"
    END = "end"


class Watch(NamedTuple):
    """What to be told of; whether the motion ends there; and whether whoever asks can wait for it,
    and for the beginning, until something else has happened: an engine may then tell several events
    at once.
    """

    kind: Kind
    of: str = ""
    level: float = 0.0
    ends: bool = False
    waits: bool = False


def maximum(of: str, *, ends: bool = False, waits: bool = False) -> Watch:
    """A maximum of ``log_rate``, ``spring`` or ``reading``."""
    return Watch(Kind.MAXIMUM, of, ends=ends, waits=waits)


def minimum(of: str, *, ends: bool = False, waits: bool = False) -> Watch:
    """A minimum of ``log_rate``, ``spring`` or ``reading``."""
    return Watch(Kind.MINIMUM, of, ends=ends, waits=waits)


def rise(of: str, to: float, *, ends: bool = False, waits: bool = False) -> Watch:
    """A quantity on its way up, at a level."""
    return Watch(Kind.RISE, of, to, ends, waits)


def fall(of: str, to: float, *, ends: bool = False, waits: bool = False) -> Watch:
    """A quantity on its way down, at a level."""
    return Watch(Kind.FALL, of, to, ends, waits)


def settling(part: float, *, ends: bool = False) -> Watch:
    """Close to steady sliding: within a part of the largest distance so far, in ln V or in the
    state over b.
    """
    return Watch(Kind.SETTLED, level=part, ends=ends)


class Event(NamedTuple):
    """One row of the table.

    Attributes
    ----------
    kind : Kind
    watch : Watch or None
        What was asked for, if it was.
    time, slip : float
        Since the start, in D_c/V_* and D_c; NaN in a motion without clock.
    point : Point
        What the slider does then.
    regime : str
        The equations in use.
    work : int
        Right-hand sides spent so far.
    """

    kind: Kind
    watch: Watch | None
    time: float
    slip: float
    point: Point
    regime: str
    work: int


Quantity = Callable[[Point, Numbers], float]

#: What changes sign where a quantity is stationary: its slope, or what has the sign of it.
_SLOPES: dict[str, Quantity] = {
    "log_rate": lambda point, p: point.growth,
    "spring": lambda point, p: p[LOG_LOAD_RATE] - point.log_rate,
    "reading": lambda point, p: point.reading_growth,
}
#: Whether what changes sign does so upwards.
_UPWARDS = {Kind.RISE: True, Kind.FALL: False, Kind.MINIMUM: True, Kind.MAXIMUM: False}


class Moment(NamedTuple):
    """A point, and the numbers of the equations there."""

    point: Point
    p: Numbers


class Watcher:
    """Finds the events that were asked for by one `Watch`, in one motion."""

    def __init__(self, watch: Watch) -> None:
        self.watch = watch
        self._is_extremum = watch.kind in (Kind.MAXIMUM, Kind.MINIMUM)
        self._quantity = _SLOPES[watch.of] if self._is_extremum else _above(watch)
        self._upwards = _UPWARDS[watch.kind]
        self._latest: tuple[Point | None, float] = None, 0.0

    def within(self, step: Step) -> float | None:
        """Clock at which it happens within a step."""
        p = step.equations.p
        known, before = self._latest
        if known is not step.before:
            before = self._quantity(step.before, p)
        after = self._quantity(step.after, p)
        self._latest = step.after, after
        # against the clock, slopes change sign the other way round
        reverse = self._is_extremum and step.end < step.start
        if not self._happens(before, after, reverse=reverse):
            return None
        return step.locate(lambda point: self._quantity(point, p))

    def between(self, before: Moment, after: Moment) -> Point | None:
        """The point at which it happens where a motion jumps from one to the next: the more extreme
        one, or the first beyond the level.
        """
        if not self._happens(self._quantity(*before), self._quantity(*after), reverse=False):
            return None
        x, y = before.point.log_rate, after.point.log_rate
        kept = (self.watch.kind is Kind.MAXIMUM and x > y) or (
            self.watch.kind is Kind.MINIMUM and x < y
        )
        return before.point if kept and self.watch.of == "log_rate" else after.point

    def _happens(self, before: float, after: float, *, reverse: bool) -> bool:
        if self._upwards is not reverse:
            return before < 0.0 <= after
        return before > 0.0 >= after


class _Settling(Watcher):
    def __init__(self, watch: Watch) -> None:
        self.watch, self._farthest = watch, 0.0

    def within(self, step: Step) -> float | None:
        away = distance(step.after, step.equations.p)
        self._farthest = max(self._farthest, away)
        return step.end if away < self.watch.level * self._farthest else None

    def between(self, before: Moment, after: Moment) -> Point | None:
        return None


def watchers(watches: Sequence[Watch]) -> list[Watcher]:
    """What finds the events that are asked for; made anew for every motion."""
    return [_Settling(w) if w.kind is Kind.SETTLED else Watcher(w) for w in watches]


def _above(watch: Watch) -> Quantity:
    level = watch.level
    value = attrgetter(watch.of)
    return lambda point, p: value(point) - level


def distance(point: Point, p: Numbers) -> float:
    """How far a point is from steady sliding at the load point velocity, in ln V or in the state
    over b.
    """
    return max(abs(point.log_rate - p[LOG_LOAD_RATE]), point.unrest / p[SIZE])


class Told(NamedTuple):
    """What happens at one clock of a step."""

    clock: float
    kind: Kind
    watch: Watch | None


def told_of(step: Step, watching: Sequence[Watcher]) -> list[Told]:
    """What happens within a step, in its order."""
    happened = [
        Told(clock, watcher.watch.kind, watcher.watch)
        for watcher in watching
        if (clock := watcher.within(step)) is not None
    ]
    backward = step.end < step.start
    return sorted(happened, key=lambda told: told.clock, reverse=backward)


def clocks_within(step: Step, samples: int) -> list[float]:
    """Clocks evenly spaced along a step, of which the last is its end."""
    clocks: list[float] = np.linspace(step.start, step.end, samples + 1)[1:].tolist()
    return clocks


def point_at(step: Step, clock: float) -> Point:
    """The point at a clock of a step; those of its ends are known."""
    if clock == step.start:
        return step.before
    return step.after if clock == step.end else step.point_at(clock)
