"""The course of a motion, told as events: through segments of loading and regimes, in one time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.events import Event, EventSpecification, Kind
from rsfstudy.motion.handover import limits
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.recording import Recording
from rsfstudy.motion.running import along as along
from rsfstudy.motion.running import happening, runner_of
from rsfstudy.motion.starting import jumped, starting
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.places import BEGINS, ENDS_AT, LOADING, LOG_LOAD_RATE, LOG_VELOCITY
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import FOR_EVER, Scene
from rsfstudy.slider.stability import largest_growth_rate


def follow(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    specs: Sequence[EventSpecification] = (),
    *,
    start: Point | None = None,
    clock: bool = False,
    recording: Recording | None = None,
    until: float = math.inf,
    since: Event | None = None,
) -> Iterator[Event]:
    """Follow a scene from the instant after its first step, for as long as the caller asks.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
        Charged with the work, by regime.
    specs : sequence of EventSpecification
        What to be told of.
    start : Point, optional
        Where to start, in the last segment of loading; else all begins with steady sliding at V_*.
    clock : bool
        Carry time along: without it, times and slips are NaN, and work is saved.
    recording : Recording, optional
        Takes in what the motion does, step by step.
    until : float
        Time at which to end.
    since : Event, optional
        End of an earlier motion of the scene, from which to go on.

    Yields
    ------
    Event

    Raises
    ------
    Halt
        With `normal_stress_lost`, `shear_stress_reversed`, `locked` or `slip_rate_unbounded` where
        the equations end; `work_budget_spent`; or `integration_failed` where no step can be taken,
        a step has no length, or a number is not finite.
    """
    chains: Sequence[tuple[Scene, np.ndarray]]
    chains = scene.chains if start is None else ((scene.acting(-1), FOR_EVER),)
    clock = clock or until < math.inf or len(chains) > 1 or len(chains[0][1]) > 1
    time, slip, before, told = 0.0, 0.0, None, scene.parts.loading.told
    if since is not None:
        chains, start = _left(scene, since)
        time, slip = since.time, since.slip
    for number, (acting, table) in enumerate(chains):
        if start is None:
            start = starting(acting)
        elif number:
            start = jumped(acting, start)
        goes_on = number == len(chains) - 1 and not acting.parts.loading.unknowns
        asked = specs if goes_on and _may_settle(scene, specs) else _without_settling(specs)
        table = _up_to(table, until)
        end = float(table[-1, ENDS_AT])
        motion = runner_of(acting, meter.engine, clock=clock).run(
            start,
            meter,
            asked,
            accuracy.solver,
            times=(float(table[0, ENDS_AT]) - time if clock else math.inf, time, slip),
            between=limits(acting, accuracy),
            recording=recording,
            kinks=(table[1:], told),
            imposed=acting.numbers[LOADING + 2] if acting.parts.loading.displaces else None,
        )
        if before is None and end == math.inf:  # it has all there is to tell
            yield from motion
            return
        for last in motion:
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
        numbers = list(acting.numbers)  # of the first segment of the chain
        numbers[LOG_LOAD_RATE] = float(table[-1, LOG_VELOCITY])
        start, before = last.point, (last.point, tuple(numbers))
        time, slip = last.time, last.slip


def _left(scene: Scene, since: Event) -> tuple[Sequence[tuple[Scene, np.ndarray]], Point]:
    """The chains of segments that are left after the end of a motion, and the point to begin at:
    behind the jump, where it ended at one.
    """
    first, point, left = 0, since.point, []
    for acting, table in scene.chains:
        number = int(np.searchsorted(table[:, BEGINS], since.time, side="right")) - 1
        if number > 0:
            acting = scene.acting(first + number)
        if first and number == 0 and table[0, BEGINS] == since.time:
            point = jumped(acting, point)
        rest = table[max(number, 0) :].copy()
        rest[0, BEGINS] = max(rest[0, BEGINS], since.time)
        if rest[-1, ENDS_AT] > since.time:
            left.append((acting, rest))
        first += len(table)
    return left, point


def _up_to(table: np.ndarray, until: float) -> np.ndarray:
    """Those of the segments of a chain that begin before a time, the last of which ends then."""
    if until == math.inf or table[-1, ENDS_AT] <= until:
        return table
    count = max(int(np.searchsorted(table[:, BEGINS], until)), 1)
    cut = table[:count].copy()
    cut[-1, ENDS_AT] = min(until, cut[-1, ENDS_AT])
    return cut


def _begun(
    event: Event,
    before: tuple[Point, Numbers],
    acting: Scene,
    specs: Sequence[EventSpecification],
) -> Iterator[Event]:
    """Events where a later segment begins: that it does, and what happens there, after a point with
    the numbers of the segment before.
    """
    yield event._replace(kind=Kind.SEGMENT)
    for spec, point in happening(*before, event.point, acting.numbers, specs):
        # slip from the first point: the spring may have jumped with the load point
        yield event._replace(kind=spec.kind, watch=spec, point=point)


def _may_settle(scene: Scene, specs: Sequence[EventSpecification]) -> bool:
    """Return False if steady sliding is unstable under the last segment of loading.

    The growth rate of small perturbations is computed only if a specification asks for settling.
    """
    if scene.log_load_rate == -math.inf or all(spec.kind is not Kind.SETTLED for spec in specs):
        return True
    growth = largest_growth_rate(scene.acting(-1), scene.log_load_rate)
    return growth is None or not growth.is_positive


def _without_settling(specs: Sequence[EventSpecification]) -> list[EventSpecification]:
    return [spec for spec in specs if spec.kind is not Kind.SETTLED]
