"""The stick-slip cycles of a motion, one after the other, put together from its events.

A cycle runs from one maximum of spring stress, where V rises through V_0, to the next.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from rsfstudy.analysis.settling import is_attracted
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.events import (
    Event,
    EventSpecification,
    Kind,
    fall,
    maximum,
    minimum,
    rise,
    settling,
)
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.recording import Recording, in_units_of, row, up_to
from rsfstudy.slider.equations import IN_RUPTURE
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene

LN10 = math.log(10.0)
#: How many headline numbers a cycle has.
NUMBERS = 5
#: Kinds of events, of which names take as long to look up as all else that an event asks for.
_START, _RISE, _FALL = Kind.START, Kind.RISE, Kind.FALL
_SEGMENT, _SETTLED = Kind.SEGMENT, Kind.SETTLED
_LOG_RATE, _SPRING = attrgetter("log_slip_rate"), attrgetter("spring_stress")

#: Swings of ln V below this are steady sliding; those that shrink this often may be on their way to
#: it.
_STEADY, _SHRINKING = 1e-3, 30
#: Part of the farthest distance from steady sliding at which a motion has settled to it.
_AT_REST = 1e-6


class Cycle(NamedTuple):
    """One cycle: time in D_c/V_*, stress in sigma_*, slip rate in V_*.

    Attributes
    ----------
    interval : float
        Time from one maximum of spring stress to the next.
    highest, lowest, at_peak : float
        Deviation of spring stress at its maximum, its minimum, and at peak slip rate.
    sliding : float
        Friction coefficient at peak slip rate.
    slowest, fastest : float
        Extremes of ln(V/V_*).
    landed, rested : Point
        Where friction balances the spring again below V_0 after the rupture, and at the slowest
        slip rate.
    begin, end : Point
        The maxima of spring stress that begin and end the cycle.
    """

    interval: float
    highest: float
    lowest: float
    at_peak: float
    sliding: float
    slowest: float
    fastest: float
    landed: Point
    rested: Point
    begin: Point
    end: Point

    @property
    def swing(self) -> float:
        """Range of ln V."""
        return self.fastest - self.slowest

    def numbers(self) -> tuple[float, ...]:
        """The headline numbers, in the order of their names: recurrence interval (D_c/V_*), static
        and dynamic stress drop (sigma_*), and the decimal logarithms of the extremes of V/V_*.

        Stress drops, down to the lowest spring stress and to that at peak slip rate, are from where
        the event begins, because the next may begin elsewhere.
        """
        highest = self.begin.spring_stress
        drops = highest - self.lowest, highest - self.at_peak
        return self.interval, *drops, self.slowest / LN10, self.fastest / LN10


def cycles(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    start: Point | None,
    recording: Recording | None = None,
) -> Iterator[Cycle | None]:
    """Yield the cycles of a motion, and None once it has settled to steady sliding.

    Without a `start` the motion begins with the step of the scene, and what precedes the first
    maximum of spring stress is left out.
    """
    begin, begun, fallen, seen = None, 0.0, start is None, list[Event]()
    ahead = 0 if start else scene.parts.loading.told
    swings, asked = list[float](), _asked(scene.log_load_rate)
    motion = follow(scene, accuracy, meter, asked, start=start, clock=True, recording=recording)
    for event in motion:
        kind = event.kind
        if kind is _SEGMENT:
            begin, fallen, seen, ahead = None, True, [], ahead - 1
        if ahead:
            continue
        if kind is _SETTLED and is_attracted(scene):
            yield None
            return
        if kind is _START and start is not None:
            begin = event.point
        fallen = fallen or kind is _FALL
        seen.append(event)
        if kind is not _RISE or not fallen:
            continue
        if begin is not None:
            cycle = _cycle(begin, begun, seen)
            swings.append(cycle.swing)
            if (swings[-1] < _STEADY or _dies_down(swings)) and is_attracted(scene):
                yield None
                return
            yield cycle
        begin, begun, fallen, seen = event.point, event.time, False, []


def more_events(events: int, name: str = "events") -> str:
    """Remedy of waiting for more events, to be added to a message."""
    return f"--set {name}={2 * events} ({name}=) waits for more"


def path_of(scene: Scene, seen: Sequence[Cycle], recording: Recording | None) -> np.ndarray:
    """Record of cycles that follow each other, a row for each sample (see `Recording.seen`); their
    ends, where nothing was recorded.

    Slip over a cycle is what the load point moves, less what the spring is longer by:
    ``V_0 T - (f_end - f_begin)/K``.
    """
    begin, end = seen[0].begin, seen[-1].end
    passed = math.fsum(cycle.interval for cycle in seen)
    slip = (
        scene.load_velocity * passed - (end.spring_stress - begin.spring_stress) / scene.stiffness
    )
    last = in_units_of(scene, np.array(row(passed, slip, end, 0)))
    if recording is None:
        return np.stack([in_units_of(scene, np.array(row(0.0, 0.0, begin, 0))), last])
    # the last step goes beyond the end
    return up_to(recording.seen(scene), last)


@lru_cache(maxsize=256)
def _asked(load: float) -> tuple[EventSpecification, ...]:
    """Event specifications by which cycles of a motion are seen, at ln(V_0/V_*)."""
    return (
        maximum("log_slip_rate", waits=True),
        minimum("log_slip_rate", waits=True),
        rise("log_slip_rate", load),
        fall("log_slip_rate", load, waits=True),
        settling(_AT_REST),
    )


def _dies_down(swings: list[float]) -> bool:
    """True if swings that shrink, time after time, are headed for nothing rather than for a cycle.

    Geometrically extrapolated from the last three, whose differences are d_1 and d_2, they have
    d_2**2/(d_1 - d_2) to go; near the onset of stick-slip cycles shrink slowly to a finite limit.
    """
    if len(swings) <= _SHRINKING or not all(y < x for x, y in pairwise(swings[-_SHRINKING:])):
        return False
    previous, latest = swings[-3] - swings[-2], swings[-2] - swings[-1]
    still_to_come = latest * latest / (previous - latest) if previous > latest else math.inf
    return swings[-1] - still_to_come < 0.1 * swings[-1]


def _cycle(begin: Point, begun: float, seen: Sequence[Event]) -> Cycle:
    """The cycle that has begun at a point and a time, and ends with the last of some events."""
    points, end = [event.point for event in seen], seen[-1]
    fastest, rested = max(points, key=_LOG_RATE), min(points, key=_LOG_RATE)
    return Cycle(
        interval=end.time - begun,
        highest=end.point.spring_stress,
        lowest=min(map(_SPRING, points)),
        at_peak=fastest.spring_stress,
        sliding=fastest.coefficient,
        slowest=rested.log_slip_rate,
        fastest=fastest.log_slip_rate,
        landed=_landed(seen) or rested,
        rested=rested,
        begin=begin,
        end=end.point,
    )


def _landed(seen: Sequence[Event]) -> Point | None:
    """Point where slip is below V_0 after the rupture, and friction balances the spring."""
    fallen = False
    for event in seen:
        fallen = fallen or event.kind is _FALL
        if fallen and event.regime != IN_RUPTURE:
            return event.point
    return None
