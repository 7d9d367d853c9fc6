"""The course of a motion, told as events: through segments of loading and regimes, in one time."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from typing import NamedTuple

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.events import (
    Event,
    Kind,
    Moment,
    Told,
    Watch,
    Watcher,
    point_at,
    told_of,
    watchers,
)
from rsfstudy.motion.regimes import check_start, motion, starting
from rsfstudy.motion.stepping import Meter, Step, steps
from rsfstudy.motion.timeline import elapsed, moment_in, timed
from rsfstudy.slider.equations import RIGID, Equations
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene import Scene


def follow(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    watches: Sequence[Watch] = (),
    *,
    start: Point | None = None,
    clock: bool = False,
    samples: int = 0,
    until: float = math.inf,
) -> Iterator[Event]:
    """Follow a scene from the instant after its first step, for as long as the caller asks.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
        Charged with the work, by regime.
    watches : sequence of Watch
        What to be told of.
    start : Point, optional
        Where to start, in the last segment of loading; else all begins with steady sliding at V_*.
    clock : bool
        Carry time along: without it, times and slips are NaN, and work is saved.
    samples : int
        Samples within each step of the integration.
    until : float
        Time at which to end.

    Yields
    ------
    Event

    Raises
    ------
    Halt
        Where the motion cannot go on; see `regimes.motion`.
    """
    segments = scene.segments if start is None else scene.segments[-1:]
    clock = clock or until < math.inf or len(segments) > 1
    origin, before = _Origin(0.0, 0.0, 0.0), None
    for number, (acting, duration) in enumerate(segments):
        if start is None:
            start = starting(acting)
        elif number:
            start = start._replace(spring=start.spring + acting.spring_stress_step)
            check_start(acting, start)
        asked = watches if number == len(segments) - 1 else _without_settling(watches)
        origin = origin._replace(spring=start.spring)
        segment = _Segment(acting, watchers(asked), samples, meter, origin)
        end = min(origin.time + duration, until)
        moving = motion(acting, accuracy, meter, start, clock=clock)
        lasts = end - origin.time if clock else math.inf
        last = yield from segment.told(moving, lasts, before)
        if last is None:
            return
        if last.time >= until:
            yield last
            return
        start, before = last.point, Moment(last.point, acting.numbers)
        origin = _Origin(last.time, last.slip, 0.0)


def _without_settling(watches: Sequence[Watch]) -> list[Watch]:
    return [watch for watch in watches if watch.kind is not Kind.SETTLED]


def along(
    equations: Equations,
    state: Numbers,
    tolerance: float,
    meter: Meter,
    watches: Sequence[Watch] = (),
    *,
    backward: bool = False,
    samples: Sequence[float] = (),
) -> Iterator[Event]:
    """Follow one system of equations from a state; against its clock if `backward`.

    `samples` are the clocks at which to be told of it. A rigid slider has slip for its clock.
    """
    watching, sampling, started = watchers(watches), iter(samples), False
    sample = next(sampling, math.inf)
    for step in steps(equations, state, tolerance, meter, backward=backward):
        if not started:
            yield _of_path(step, Told(step.start, Kind.START, None), step.before)
            started = True
        happens = list(told_of(step, watching, 0))
        while sample <= step.end:
            happens.append(Told(sample, Kind.SAMPLE, None))
            sample = next(sampling, math.inf)
        for told in sorted(happens, key=lambda told: told.clock, reverse=backward):
            yield _of_path(step, told, point_at(step, told.clock))
            if told.watch is not None and told.watch.ends:
                return


def _of_path(step: Step, told: Told, point: Point) -> Event:
    regime = step.equations.regime
    slip = told.clock if regime == RIGID else math.nan
    return Event(told.kind, told.watch, math.nan, slip, point, regime, step.meter.spent)


class _Origin(NamedTuple):
    """Time, slip and spring stress where a segment of loading begins."""

    time: float
    slip: float
    spring: float


class _Segment:
    """One segment of loading."""

    def __init__(
        self,
        scene: Scene,
        watching: Sequence[Watcher],
        samples: int,
        meter: Meter,
        origin: _Origin,
    ) -> None:
        self._scene, self._watching, self._samples = scene, watching, samples
        self._meter, self._origin = meter, origin

    def told(
        self, moving: Iterator[Step], duration: float, before: Moment | None
    ) -> Generator[Event, None, Event | None]:
        """Events up to the end of the segment, which is returned; None where one ends the motion
        earlier.
        """
        equations: Equations | None = None
        for step, begin in timed(self._scene, moving):
            if step.equations is not equations:
                kind = Kind.REGIME if equations else Kind.SEGMENT if before else Kind.START
                equations = step.equations
                yield self._event(step, begin, Told(step.start, kind, None), step.before)
                for told, point in self._jumped(step, before):
                    yield self._event(step, begin, told, point)
                    if told.watch is not None and told.watch.ends:
                        return None
            over = begin + elapsed(self._scene, step, step.end) >= duration
            if over:
                step = step.until(moment_in(self._scene, step, duration - begin))
            for told in told_of(step, self._watching, self._samples):
                yield self._event(step, begin, told, point_at(step, told.clock))
                if told.watch is not None and told.watch.ends:
                    return None
            before = Moment(step.after, equations.p)
            if over:
                return self._event(step, begin, Told(step.end, Kind.END, None), step.after)
        raise AssertionError("a motion never ends by itself")

    def _jumped(self, step: Step, before: Moment | None) -> Iterator[tuple[Told, Point]]:
        """What happened on the way from another regime or segment to the first point of a step."""
        if before is None:
            return
        after = Moment(step.before, step.equations.p)
        for watcher in self._watching:
            point = watcher.between(before, after)
            if point is not None:
                yield Told(step.start, watcher.watch.kind, watcher.watch), point

    def _event(self, step: Step, begin: float, told: Told, point: Point) -> Event:
        scene, origin, clock = self._scene, self._origin, told.clock
        passed = begin + elapsed(scene, step, clock)
        # slip follows from the spring: f = f_0 + K (V_0 t - slip)
        slipped = scene.load_velocity * passed - (point.spring - origin.spring) / scene.stiffness
        regime, work = step.equations.regime, self._meter.spent
        time, slip = origin.time + passed, origin.slip + slipped
        return Event(told.kind, told.watch, time, slip, point, regime, work)
