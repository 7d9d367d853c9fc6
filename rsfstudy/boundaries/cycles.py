"""The stick-slip cycles of a motion, one after the other, put together from its steps.

A cycle runs from one maximum of spring stress, where V rises through V_0, to the next.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rsfstudy.boundaries.swing import settles
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.regimes import motion
from rsfstudy.motion.stepping import Halt, Meter, Step
from rsfstudy.motion.timeline import elapsed, sampled, timed
from rsfstudy.slider.forms import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

LN10 = math.log(10.0)

#: Swings of ln V below this are steady sliding; those that shrink this often may be on their way to
#: it.
_STEADY, _SHRINKING = 1e-3, 30


@dataclass(frozen=True)
class Cycle:
    """One cycle, in the units of the scene.

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
    begin, end : tuple of float
        Spring stress and state (f, Psi) at the maxima that begin and end the cycle.
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
    begin: tuple[float, float]
    end: tuple[float, float]

    @property
    def swing(self) -> float:
        """How far ln V swings."""
        return self.fastest - self.slowest

    def numbers(self) -> np.ndarray:
        """The headline numbers, in the order of their names."""
        return np.array(
            [
                self.interval,
                self.highest - self.lowest,
                self.highest - self.at_peak,
                self.slowest / LN10,
                self.fastest / LN10,
            ]
        )


def cycles(
    scene: Scene, accuracy: Accuracy, meter: Meter, start: tuple[float, float] | None
) -> Iterator[Cycle | None]:
    """The cycles of a motion, one after the other; None once it has settled to steady sliding.

    Without a `start` the motion begins with the step of the scene, and what precedes the first
    maximum of spring stress is left out.
    """
    watch = _Watch(scene, start)
    swings: list[float] = []
    for step, now in timed(scene, motion(scene, accuracy, meter, start=start, clock=True)):
        cycle = watch.see(step, now)
        if cycle is not None:
            swings.append(cycle.swing)
            if swings[-1] < _STEADY or (settles(scene) and _dies_down(swings)):
                yield None
                return
            yield cycle
        elif watch.at_rest(step):
            yield None
            return


def _dies_down(swings: list[float]) -> bool:
    """Whether swings that shrink, time after time, are headed for nothing rather than for a cycle.

    Geometrically extrapolated from the last three; near the onset of stick-slip cycles shrink
    slowly to a finite limit.
    """
    if len(swings) <= _SHRINKING or not (np.diff(swings[-_SHRINKING:]) < 0.0).all():
        return False
    before, now = swings[-3] - swings[-2], swings[-2] - swings[-1]
    still_to_come = now * now / (before - now) if before > now else math.inf
    return swings[-1] - still_to_come < 0.1 * swings[-1]


class _Watch:
    """Sees steps go by and puts cycles together."""

    def __init__(self, scene: Scene, start: tuple[float, float] | None) -> None:
        self._scene = scene
        started = start is not None
        self._started = started
        self._fallen = not started
        self._begun = 0.0
        self._begin = start
        self._clear()
        self._farthest = 0.0

    def _clear(self) -> None:
        self._arrested: Point | None = None
        self._landed: Point | None = None
        self._rested: Point | None = None
        self._fastest: Point | None = None

    def see(self, step: Step, begin: float) -> Cycle | None:
        """Take one step in; returns a cycle that ends within it."""
        for point in (step.before, step.after):
            self._extremes(point)
        if step.before.growth * step.after.growth < 0.0:
            self._extremes(step.point_at(step.locate(lambda point: point.growth)))
        load = self._scene.log_load_rate
        self._fallen = self._fallen or step.after.log_rate < load
        if (step.before.log_rate - load) * (step.after.log_rate - load) >= 0.0:
            return None
        clock = step.locate(lambda point: point.log_rate - load)
        turning = step.point_at(clock)
        if step.after.log_rate < load or not self._fallen:
            self._extremes(turning)
            return None
        now = begin + elapsed(self._scene, step, clock)
        cycle = self._complete(turning, now) if self._started else None
        self._started, self._begun, self._fallen = True, now, False
        self._begin = (turning.spring, turning.psi)
        self._clear()
        self._extremes(step.after)
        return cycle

    def _extremes(self, point: Point) -> None:
        if self._arrested is None or point.spring < self._arrested.spring:
            self._arrested = point
        if self._rested is None or point.log_rate < self._rested.log_rate:
            self._rested = point
        balanced = abs(point.spring - point.friction) < 1e-3 * self._scene.a
        # a cycle begins at V_0, give or take a last bit: what counts comes after the rupture
        slower = self._fallen and point.log_rate < self._scene.log_load_rate
        if self._landed is None and balanced and slower:
            self._landed = point
        if self._fastest is None or point.log_rate > self._fastest.log_rate:
            self._fastest = point

    def _complete(self, turning: Point, now: float) -> Cycle:
        assert self._arrested is not None
        assert self._rested is not None
        assert self._fastest is not None
        assert self._begin is not None
        return Cycle(
            interval=now - self._begun,
            highest=turning.spring,
            lowest=self._arrested.spring,
            at_peak=self._fastest.spring,
            sliding=self._fastest.coefficient,
            slowest=self._rested.log_rate,
            fastest=self._fastest.log_rate,
            landed=self._landed or self._rested,
            rested=self._rested,
            begin=self._begin,
            end=(turning.spring, turning.psi),
        )

    def at_rest(self, step: Step) -> bool:
        """Whether the motion has come to steady sliding without another event."""
        load = self._scene.log_load_rate
        away = max(abs(step.after.log_rate - load), abs(step.after.imbalance) / self._scene.b)
        self._farthest = max(self._farthest, away)
        return away < 1e-6 * self._farthest


def recorded(
    scene: Scene, start: tuple[float, float], accuracy: Accuracy, meter: Meter
) -> tuple[Cycle | None, list[tuple[float, ...]]]:
    """One cycle, and what is observed along it; no cycle where the motion settles instead."""
    watch, rows = _Watch(scene, start), list[tuple[float, ...]]()
    for step, begin in timed(scene, motion(scene, accuracy, meter, start=start, clock=True)):
        cycle = watch.see(step, begin)
        if cycle is not None:
            step = step.until(step.locate(lambda point: point.log_rate - scene.log_load_rate))
        rows += sampled(scene, step, begin, start[0])
        if cycle is not None or watch.at_rest(step):
            return cycle, rows
    raise Halt(Status.INTEGRATION_FAILED, "a motion ended by itself")
