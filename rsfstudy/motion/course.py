"""The course of a motion, told as events: through segments of loading and regimes, in one time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, compiled_engine
from rsfstudy.motion.events import (
    Event,
    Kind,
    Moment,
    Told,
    Watch,
    Watcher,
    clocks_within,
    point_at,
    told_of,
    watchers,
)
from rsfstudy.motion.recording import SAMPLES, Recording, row
from rsfstudy.motion.regimes import jumped, motion, starting
from rsfstudy.motion.stepping import Meter, Step, steps
from rsfstudy.motion.timeline import elapsed, ended, timed
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
    recording: Recording | None = None,
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
    recording : Recording, optional
        Takes in what the motion does, step by step.
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
    origin, before = Origin(0.0, 0.0, 0.0), None
    for number, (acting, duration) in enumerate(segments):
        if start is None:
            start = starting(acting)
        elif number:
            start = jumped(acting, start)
        goes_on = number == len(segments) - 1 and not acting.parts.loading.unknowns
        asked = watches if goes_on else _without_settling(watches)
        origin = origin._replace(spring=start.spring)
        end = min(origin.time + duration, until)
        lasts = end - origin.time if clock else math.inf
        segment = compiled_engine().segment if meter.engine == COMPILED else _segment
        for last in segment(
            acting,
            accuracy,
            meter,
            start,
            asked,
            origin=origin,
            lasts=lasts,
            clock=clock,
            recording=recording,
        ):
            if before is not None and last.kind is Kind.START:
                for event in _begun(last, before, acting, asked):
                    yield event
                    if event.watch is not None and event.watch.ends:
                        return
            elif last.kind is not Kind.END:
                yield last
                if last.watch is not None and last.watch.ends:
                    return
        if last.kind is Kind.END:
            # it was located to the spacing of numbers around the clock
            last = last._replace(time=end)
            if recording is not None:
                recording.ends_at(end)
        if end >= until:
            yield last
            return
        start, before = last.point, Moment(last.point, acting.numbers)
        origin = Origin(last.time, last.slip, 0.0)


def _begun(event: Event, before: Moment, acting: Scene, watches: Sequence[Watch]) -> list[Event]:
    """That a later segment has begun, and what happened where it did."""
    after = Moment(event.point, acting.numbers)
    return [event._replace(kind=Kind.SEGMENT)] + [
        # slip from the first point: the spring may have jumped with the load point
        event._replace(kind=watcher.watch.kind, watch=watcher.watch, point=point)
        for watcher in watchers(watches)
        if (point := watcher.between(before, after)) is not None
    ]


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
    if meter.engine == COMPILED:
        yield from compiled_engine().along(
            equations, state, tolerance, meter, watches, backward=backward, samples=samples
        )
        return
    watching, sampling, started = watchers(watches), iter(samples), False
    sample = next(sampling, math.inf)
    for step in steps(equations, state, tolerance, meter, backward=backward):
        if not started:
            yield _of_path(step, Told(step.start, Kind.START, None), step.before)
            started = True
        happens = told_of(step, watching)
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


class Origin(NamedTuple):
    """Time, slip and spring stress where a segment of loading begins."""

    time: float
    slip: float
    spring: float


def _segment(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    start: Point,
    watches: Sequence[Watch],
    *,
    origin: Origin,
    lasts: float,
    clock: bool,
    recording: Recording | None,
) -> Iterator[Event]:
    """Events of one segment of loading, by SciPy; the last is its end, unless one ends the motion
    earlier.
    """
    watching, equations = watchers(watches), None
    told = _Teller(scene, meter, origin, recording)
    before: Moment | None = None
    for step, begin in timed(scene, motion(scene, accuracy, meter, start, clock=clock)):
        if step.equations is not equations:
            equations = step.equations
            yield from told.beginning(step, begin, before, watching)
        over = begin + elapsed(scene, step, step.end) >= lasts
        if over:
            step = ended(scene, step, lasts - begin, accuracy.solver)
        told.record(step, begin, clocks_within(step, SAMPLES))
        for happening in told_of(step, watching):
            yield told.event(step, begin, happening, point_at(step, happening.clock))
        before = Moment(step.after, step.equations.p)
        if over:
            yield told.event(step, begin, Told(step.end, Kind.END, None), step.after)
            return


class _Teller:
    """Makes events of what happens in one segment."""

    def __init__(
        self, scene: Scene, meter: Meter, origin: Origin, recording: Recording | None
    ) -> None:
        self._scene, self._meter = scene, meter
        self._origin, self._recording = origin, recording

    def beginning(
        self, step: Step, begin: float, before: Moment | None, watching: Sequence[Watcher]
    ) -> Iterator[Event]:
        """That a regime has begun with a step, and what happened on the way from another one."""
        kind = Kind.REGIME if before else Kind.START
        self.record(step, begin, [step.start])
        yield self.event(step, begin, Told(step.start, kind, None), step.before)
        if before is None:
            return
        after = Moment(step.before, step.equations.p)
        for watcher in watching:
            point = watcher.between(before, after)
            if point is not None:
                told = Told(step.start, watcher.watch.kind, watcher.watch)
                yield self.event(step, begin, told, point)

    def record(self, step: Step, begin: float, clocks: Sequence[float]) -> None:
        """Record the slider at clocks of a step."""
        if self._recording is None:
            return
        points = [point_at(step, clock) for clock in clocks]
        passed = [begin + elapsed(self._scene, step, clock) for clock in clocks]
        regime = self._recording.number(step.equations.regime)
        places = map(self._place, passed, points)
        self._recording.add(
            [row(*place, point, regime) for place, point in zip(places, points, strict=True)]
        )

    def event(self, step: Step, begin: float, told: Told, point: Point) -> Event:
        """The event of what happens at a point."""
        time, slip = self._place(begin + elapsed(self._scene, step, told.clock), point)
        regime, work = step.equations.regime, self._meter.spent
        return Event(told.kind, told.watch, time, slip, point, regime, work)

    def _place(self, passed: float, point: Point) -> tuple[float, float]:
        """Time and slip since the start of the motion, so long after that of the segment."""
        scene, origin = self._scene, self._origin
        # slip follows from the spring: f = f_0 + K (V_0 t - slip)
        slipped = scene.load_velocity * passed - (point.spring - origin.spring) / scene.stiffness
        return origin.time + passed, origin.slip + slipped
