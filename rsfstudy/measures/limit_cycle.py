"""The stick-slip limit cycle: recurrence interval, stress drops and range of slip rate, once cycles
repeat.

A cycle runs from one maximum of spring stress, where V rises through V_0, to the next. It is
accepted when it repeats the one before to the tolerance; the event that the step itself sets off is
never taken for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsfstudy.core.accuracy import LOOSEST_RTOL, Accuracy
from rsfstudy.core.motion import motion
from rsfstudy.core.stepping import Halt, Meter, Step
from rsfstudy.core.timeline import OBSERVED, along_path, elapsed, sampled, timed
from rsfstudy.equations import Point
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.swing import settles
from rsfstudy.scene import Scene
from rsfstudy.status import Status

LN10 = math.log(10.0)

#: Swings of ln V below this are steady sliding; those that shrink this often may be on their way to
#: it.
_STEADY, _SHRINKING = 1e-3, 30
#: Displacement in D_c that sets off a motion where the scene has no step.
_NUDGE = 0.1

_HEADLINES = (
    "recurrence_interval",
    "static_stress_drop",
    "dynamic_stress_drop",
    "min_log10_slip_rate",
    "max_log10_slip_rate",
)


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
        Deviation of frictional stress at peak slip rate.
    slowest, fastest : float
        Extremes of ln(V/V_*).
    landed, rested : Point
        Where friction balances the spring again below V_0 after the rupture, and at the slowest
        slip rate.
    end : tuple of float
        Spring stress and state (f, Psi) at the maximum that ends the cycle.
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
    end: tuple[float, float]

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


@dataclass(frozen=True)
class LimitCycle(Measure):
    """Limit cycle of stick-slip under a steady load point velocity.

    Parameters
    ----------
    phases : int
        Points of the orbit that are kept along `phase`, spread over its slow part and its
        rupture.
    events : int
        Most events to wait for a cycle that repeats.
    """

    phases: int = 400
    events: int = 300
    name: ClassVar[str] = "limit_cycle"

    def __post_init__(self) -> None:
        if self.phases < 2:
            raise InvalidValue("phases", self.phases, "must be at least 2")

    @property
    def headline(self) -> str:
        return "recurrence_interval"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        scalars = [name for h in _HEADLINES for name in (h, f"{h}_error")]
        scalars += ["slip_per_event", "healing_exponent", "residual_friction", "drop_asymmetry"]
        scalars += ["events_until_repeat", "work_per_cycle"]
        return dict.fromkeys(scalars, ()) | dict.fromkeys(OBSERVED, ("phase",))

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"phase": np.linspace(0.0, 1.0, self.phases)}

    @property
    def typical_work(self) -> int:
        return 15_000

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Follow events until one repeats; go round once more to record it and once loosely for its
        error.
        """
        if scene.log_load_rate == -math.inf:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if scene.load_velocity == 1.0 and scene.displacement_step == 0.0:
            # steady sliding left alone never leaves its steady state, stable or not
            scene = scene.with_(load_velocity_ratio=1.0, displacement_step=_NUDGE)
        count, last, spent = 0, None, meter.spent
        change: np.ndarray | None = None
        for cycle in cycles(scene, accuracy, meter, None):
            if cycle is None or count >= self.events:
                break
            count += 1
            if last is not None:
                before, change = change, np.abs(cycle.numbers() - last.numbers())
                if (change <= accuracy.rtol * np.abs(cycle.numbers())).all():
                    work, left = meter.spent - spent, _still_to_come(change, before)
                    return self._recorded(scene, cycle, left, count, work, accuracy, meter)
            last, spent = cycle, meter.spent
        if count >= self.events:
            return Outcome(
                Status.WORK_BUDGET_SPENT, message=f"no cycle repeats within {self.events} events"
            )
        return Outcome(Status.NO_LIMIT_CYCLE, message="the motion settles to steady sliding")

    def _recorded(
        self,
        scene: Scene,
        cycle: Cycle,
        left: np.ndarray,
        count: int,
        work: int,
        accuracy: Accuracy,
        meter: Meter,
    ) -> Outcome:
        coarse = replace(accuracy, rtol=min(10.0 * accuracy.rtol, LOOSEST_RTOL))
        again = next(iter(cycles(scene, coarse, meter, cycle.end)))
        assert again is not None
        numbers = cycle.numbers()
        errors = np.abs(again.numbers() - numbers) + left + 0.05 * accuracy.rtol * np.abs(numbers)
        values: dict[str, float | np.ndarray] = {}
        for name, number, error in zip(_HEADLINES, numbers, errors, strict=True):
            values[name], values[f"{name}_error"] = float(number), float(error)
        healed = cycle.rested.imbalance - cycle.landed.imbalance
        slowed = cycle.rested.log_rate - cycle.landed.log_rate
        values["slip_per_event"] = scene.load_velocity * cycle.interval
        # d ln(theta)/d ln(V), with Theta = imbalance - b ln V = b ln(theta/theta_*)
        values["healing_exponent"] = (
            healed / (scene.b * slowed) - 1.0 if abs(slowed) > 1.0 else math.nan
        )
        stress = scene.mu_star + cycle.sliding
        values["residual_friction"] = stress / (1.0 + scene.cot_phi * cycle.sliding)
        values["drop_asymmetry"] = (cycle.highest - cycle.at_peak) / (cycle.at_peak - cycle.lowest)
        values["events_until_repeat"], values["work_per_cycle"] = float(count), float(work)
        orbit = along_path(list(_orbit(scene, cycle.end, accuracy, meter)), self.phases)
        return Outcome(Status.OK, values | orbit)


def _still_to_come(change: np.ndarray, before: np.ndarray | None) -> np.ndarray:
    """How far the numbers may still be from those of the limit, from their last two changes."""
    if before is None:
        return change
    contraction = min(float(change.max()) / max(float(before.max()), 1e-300), 0.999)
    return change * max(contraction / (1.0 - contraction), 0.1)


def cycles(
    scene: Scene, accuracy: Accuracy, meter: Meter, start: tuple[float, float] | None
) -> Iterator[Cycle | None]:
    """The cycles of a motion, one after the other; None once it has settled to steady sliding.

    Without a `start` the motion begins with the step of the scene, and what precedes the first
    maximum of spring stress is left out.
    """
    watch = _Watch(scene, started=start is not None)
    swings: list[float] = []
    for step, now in timed(scene, motion(scene, accuracy, meter, start=start, clock=True)):
        cycle = watch.see(step, now)
        if cycle is not None:
            swings.append(cycle.fastest - cycle.slowest)
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

    def __init__(self, scene: Scene, *, started: bool) -> None:
        self._scene = scene
        self._started = started
        self._fallen = not started
        self._begun = 0.0
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
        self._clear()
        self._extremes(step.after)
        return cycle

    def _extremes(self, point: Point) -> None:
        if self._arrested is None or point.spring < self._arrested.spring:
            self._arrested = point
        if self._rested is None or point.log_rate < self._rested.log_rate:
            self._rested = point
        balanced = abs(point.spring - point.friction) < 1e-3 * self._scene.a
        if self._landed is None and balanced and point.log_rate < self._scene.log_load_rate:
            self._landed = point
        if self._fastest is None or point.log_rate > self._fastest.log_rate:
            self._fastest = point

    def _complete(self, turning: Point, now: float) -> Cycle:
        assert self._arrested is not None
        assert self._rested is not None
        assert self._fastest is not None
        return Cycle(
            interval=now - self._begun,
            highest=turning.spring,
            lowest=self._arrested.spring,
            at_peak=self._fastest.spring,
            sliding=self._fastest.friction,
            slowest=self._rested.log_rate,
            fastest=self._fastest.log_rate,
            landed=self._landed or self._rested,
            rested=self._rested,
            end=(turning.spring, turning.psi),
        )

    def at_rest(self, step: Step) -> bool:
        """Whether the motion has come to steady sliding without another event."""
        load = self._scene.log_load_rate
        away = max(abs(step.after.log_rate - load), abs(step.after.imbalance) / self._scene.b)
        self._farthest = max(self._farthest, away)
        return away < 1e-6 * self._farthest


def _orbit(
    scene: Scene, start: tuple[float, float], accuracy: Accuracy, meter: Meter
) -> Iterator[tuple[float, ...]]:
    """What is observed along one cycle, from the maximum of spring stress on."""
    load, risen = scene.log_load_rate, False
    moving = motion(scene, accuracy, meter, start=start, clock=True)
    for step, begin in timed(scene, moving):
        ends = risen and step.before.log_rate < load <= step.after.log_rate
        if ends:
            step = step.until(step.locate(lambda point: point.log_rate - load))
        yield from sampled(scene, step, begin, start[0])
        risen = risen or step.after.log_rate < load
        if ends:
            return
    raise Halt(Status.INTEGRATION_FAILED, "a motion ended by itself")
