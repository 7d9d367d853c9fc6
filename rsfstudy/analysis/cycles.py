"""Stick-slip cycles of a motion, assembled from its events.

A cycle extends from one maximum of spring stress, at which V rises through V_0, to the next.
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
SMALLEST_SWING, _SHRINKING = 1e-3, 30
#: Part of the farthest distance from steady sliding at which a motion has settled to it.
_AT_REST = 1e-6


class Cycle(NamedTuple):
    """One stick-slip cycle.

    Times are in D_c/V_*, stresses in sigma_*, and slip rates in V_*.

    Attributes
    ----------
    interval : float
        Time from one maximum of spring stress to the next.
    highest, lowest, at_peak : float
        Deviation of spring stress at its maximum, at its minimum, and at the peak slip rate.
    sliding : float
        Friction coefficient at the peak slip rate.
    slowest, fastest : float
        Extremes of ln(V/V_*).
    landed, rested : Point
        Point below V_0 at which friction balances the spring again after the rupture, and point
        with the lowest slip rate.
    begin, end : Point
        Maxima of spring stress at which the cycle begins and ends.
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
        """Return the headline numbers in the order of their names.

        Stress drops are measured from the spring stress at the beginning of the event, because the
        next event may begin at a different stress.

        Returns
        -------
        tuple of float
            Recurrence interval (D_c/V_*), static and dynamic stress drops (sigma_*), and the
            decimal logarithms of the extremes of V/V_*. The static drop extends to the lowest
            spring stress, and the dynamic drop to the spring stress at the peak slip rate.
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
    """Iterate over the cycles of a motion.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
    start : Point or None
        Point at which the motion starts. If None, the motion starts with the step of the scene, and
        everything before the first maximum of spring stress is skipped.
    recording : Recording, optional

    Yields
    ------
    Cycle or None
        The next cycle. None is the last item, and means that the motion has settled to steady
        sliding.
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
            if (swings[-1] < SMALLEST_SWING or _dies_down(swings)) and is_attracted(scene):
                yield None
                return
            yield cycle
        begin, begun, fallen, seen = event.point, event.time, False, []


def more_events(events: int, name: str = "events") -> str:
    """Return the advice to wait for more events, for use in a message."""
    return f"--set {name}={2 * events} ({name}=) waits for more"


def path_of(scene: Scene, seen: Sequence[Cycle], recording: Recording | None) -> np.ndarray:
    """Return the record of successive cycles, one row per sample.

    If nothing was recorded, the record holds the ends of the cycles. The slip of the cycles is the
    displacement of the load point minus the extension of the spring: ``V_0 T - (f_end -
    f_begin)/K`` (see ``Recording.seen`` for the columns).
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
    """Return the event specifications that delimit the cycles at ln(V_0/V_*)."""
    return (
        maximum("log_slip_rate", waits=True),
        minimum("log_slip_rate", waits=True),
        rise("log_slip_rate", load),
        fall("log_slip_rate", load, waits=True),
        settling(_AT_REST),
    )


def _dies_down(swings: list[float]) -> bool:
    """Return True if shrinking swings of ln V approach zero.

    The last three swings, with differences d_1 and d_2, are extrapolated geometrically. Their
    remaining decrease is d_2**2/(d_1 - d_2). Near the onset of stick-slip, the swings shrink slowly
    towards a finite limit instead.
    """
    if len(swings) <= _SHRINKING or not all(y < x for x, y in pairwise(swings[-_SHRINKING:])):
        return False
    previous, latest = swings[-3] - swings[-2], swings[-2] - swings[-1]
    still_to_come = latest * latest / (previous - latest) if previous > latest else math.inf
    return swings[-1] - still_to_come < 0.1 * swings[-1]


def _cycle(begin: Point, begun: float, seen: Sequence[Event]) -> Cycle:
    """Assemble the cycle that ends with the last event."""
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
    """Return the first point after the rupture at which friction balances the spring."""
    fallen = False
    for event in seen:
        fallen = fallen or event.kind is _FALL
        if fallen and event.regime != IN_RUPTURE:
            return event.point
    return None
