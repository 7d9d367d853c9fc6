"""The stick-slip limit cycle: recurrence interval, stress drops and range of slip rate, once cycles
repeat.

A cycle runs from one maximum of spring stress, where V rises through V_0, to the next. The stress
at one maximum decides that at the next: a return map of one variable, whose fixed point is the
limit cycle. Where cycles approach it slowly, the motion leaps to the fixed point that the last two
imply. A cycle is accepted when it repeats the one before to the tolerance; the event that the step
itself sets off is never taken for it.

With several states, those of a law or of the fluid, cycles need not repeat each other: a motion may
come back to itself after 2, 4 or any other number of events, or never. The numbers are then those
of one event, the one with the fastest peak, and no mean; the orbit is that of the whole period.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsfstudy.boundaries.cycles import LN10, Cycle, cycles, recorded
from rsfstudy.boundaries.periods import Course, ReturnMap, course
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures._single_step import check_leaves_alone
from rsfstudy.motion.accuracy import Accuracy, error_between
from rsfstudy.motion.recording import OBSERVED, Recording, along_path, row
from rsfstudy.motion.regimes import on_slow_manifold
from rsfstudy.motion.stepping import Halt, Meter
from rsfstudy.quantity import Quantity
from rsfstudy.slider.equations import relation_of
from rsfstudy.slider.forms import Point
from rsfstudy.slider.loading import Segment
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Part of the accuracy asked for to which the errors of two runs may agree by chance.
_BY_CHANCE = 0.06
#: Displacement in D_c that sets off a motion where the scene has no step.
NUDGE = 0.1
#: Part of their distance to the limit that cycles keep each time: above the first they are leapt
#: ahead of, above the second they approach none.
_SLOW_APPROACH, _DIVERGES = 0.03, 0.98
#: Longest leap, as a part of the swing of ln V.
_NEAR = 0.1
#: Points of an orbit that are no more than its ends, of which no recording has to be made.
_ENDS = 2
#: Relative accuracy with which a limit cycle is looked for, before it is followed as asked.
_LOW = 1e-4

_HEADLINES = (
    "recurrence_interval",
    "static_stress_drop",
    "dynamic_stress_drop",
    "min_log10_slip_rate",
    "max_log10_slip_rate",
)


@dataclass(frozen=True)
class LimitCycle(Measure):
    """Limit cycle of stick-slip under a steady load point velocity.

    Where a motion of several states repeats itself after `period_events` events only, the numbers
    are those of the event with the fastest peak, from one maximum of spring stress to the next;
    where it never does, it ends as `not_periodic`, and the message tells the range of its events.

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
        scalars += ["period_events", "events_until_repeat", "work_per_cycle"]
        return dict.fromkeys(scalars, ()) | dict.fromkeys(OBSERVED, ("phase",))

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"phase": np.linspace(0.0, 1.0, self.phases)}

    @property
    def quantities(self) -> Sequence[Quantity]:
        return _QUANTITIES

    @property
    def typical_work(self) -> int:
        return 9_000

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Follow events until one repeats, then go round once more with smaller tolerances: for the
        error, and to record the orbit.
        """
        check_leaves_alone(scene)
        if scene.log_load_rate == -math.inf:
            return Outcome(Status.NO_LIMIT_CYCLE, message="the load point is held")
        if not scene.is_disturbed:
            # steady sliding left alone never leaves its steady state, stable or not
            scene = scene.under(Segment(1.0, NUDGE))
        if scene.states > 1:
            return self._of_several_states(scene, accuracy, meter)
        approach = _approach(scene, accuracy, meter, self.events)
        if approach is None:
            return SETTLES
        cycle = approach.seen[-1]
        again, orbit = self._once_more(scene, cycle.end, accuracy.refined(), meter)
        if again is None:
            return Outcome(
                Status.UNVERIFIED,
                message="with smaller tolerances the motion settles: ask for a smaller rtol",
            )
        numbers, refined = map(approach.of_limit_cycle, (cycle, again))
        values = _headlines(accuracy, numbers, refined, np.abs(numbers - cycle.numbers()))
        values["slip_per_event"] = scene.load_velocity * values["recurrence_interval"]
        values |= _properties(scene, cycle)
        values["period_events"] = 1.0
        values["events_until_repeat"] = float(approach.events)
        values["work_per_cycle"] = float(approach.work)
        return Outcome(Status.OK, values | orbit)

    def _once_more(
        self, scene: Scene, start: Point, accuracy: Accuracy, meter: Meter
    ) -> tuple[Cycle | None, dict[str, np.ndarray]]:
        """One cycle from a point, and its orbit; none where the motion settles."""
        if self.phases > _ENDS:
            cycle, rows = recorded(scene, start, accuracy, meter)
            return cycle, along_path(rows, self.phases)
        cycle = next(cycles(scene, accuracy, meter, start))
        return cycle, {} if cycle is None else _ends(scene, cycle)

    def _of_several_states(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Follow events loosely up to a cycle of any period that attracts; close it as accurately
        as asked, from its largest event on, and once more with smaller tolerances.
        """
        came = course(scene, replace(accuracy, rtol=max(accuracy.rtol, _LOW)), meter, self.events)
        if came is None:
            return SETTLES
        if came.orbit is None:
            return without_period(scene, came, more_events(self.events))
        orbit = came.orbit.from_largest
        one = ReturnMap(scene, accuracy, meter).again(orbit)
        again = ReturnMap(scene, accuracy.refined(), meter).again(orbit)
        if one is None or again is None:
            why = "with other tolerances the cycle does not close: ask for a smaller rtol"
            return Outcome(Status.UNVERIFIED, message=why)
        cycle, begin, spent = one.events[0], again.events[0].begin, meter.spent
        _last, rows = recorded(scene, begin, accuracy.refined(), meter, orbit.period)
        numbers, refined = (o.events[0].numbers_of_event() for o in (one, again))
        values = _headlines(accuracy, numbers, refined, np.zeros_like(numbers))
        carried = (cycle.end.spring - cycle.begin.spring) / scene.stiffness
        values["slip_per_event"] = scene.load_velocity * values["recurrence_interval"] - carried
        values |= _properties(scene, cycle)
        values["period_events"] = float(orbit.period)
        values["events_until_repeat"] = float(len(came.seen))
        values["work_per_cycle"] = (meter.spent - spent) / orbit.period
        return Outcome(Status.OK, values | along_path(rows, self.phases))


#: How many events a motion takes to repeat itself.
PERIOD = Quantity("period_events", "", "1", "number of events after which a motion repeats itself")
#: What only a limit cycle has.
_QUANTITIES = (
    PERIOD,
    Quantity(
        "healing_exponent",
        "",
        "1",
        "exponent of theta in slip rate, from arrest to the slowest; only where there is one theta",
    ),
    Quantity(
        "drop_asymmetry",
        "",
        "1",
        "stress drop while slip accelerates over that while it decelerates",
    ),
    Quantity("events_until_repeat", "", "1", "number of the cycle that repeated the one before"),
)

SETTLES = Outcome(Status.NO_LIMIT_CYCLE, message="the motion settles to steady sliding")


def more_events(events: int, name: str = "events") -> str:
    """How to wait for more events, to be added to a message."""
    return f"--set {name}={2 * events} ({name}=) waits for more"


def without_period(scene: Scene, came: Course, remedy: str) -> Outcome:
    """The outcome of a motion that has not come to a cycle: because it never will, or because it
    takes its time, and what to do then.
    """
    latest = came.seen[len(came.seen) // 2 :]
    peaks = [cycle.fastest / LN10 for cycle in latest]
    intervals = [cycle.interval for cycle in latest]
    text = (
        f"the last {len(latest)} of {len(came.seen)} events peak at 10^{min(peaks):.4g} to "
        f"10^{max(peaks):.4g} V_* and come after {min(intervals):.5g} to {max(intervals):.5g} "
        "D_c/V_*"
    )
    if came.open:
        why = f"no cycle repeats yet: {text}; {remedy}"
        return Outcome(Status.WORK_BUDGET_SPENT, message=why)
    return Outcome(Status.NOT_PERIODIC, message=text)


def _ends(scene: Scene, cycle: Cycle) -> dict[str, np.ndarray]:
    """The ends of an orbit."""
    begin, end, passed = cycle.begin, cycle.end, cycle.interval
    slip = scene.load_velocity * passed - (end.spring - begin.spring) / scene.stiffness
    recording = Recording()
    recording.add([row(0.0, 0.0, begin, 0), row(passed, slip, end, 0)])
    return dict(zip(OBSERVED, recording.seen(scene).T, strict=False))


def _headlines(
    accuracy: Accuracy, numbers: np.ndarray, refined: np.ndarray, implied: np.ndarray
) -> dict[str, float | np.ndarray]:
    """The headline numbers with their errors, from two runs, and what of them is implied by
    derivatives that both share.

    Slip rates err as logarithms do, by a part of how far they swing: the logarithm of V_* is zero.
    """
    chance, scales = _BY_CHANCE * accuracy.rtol, np.abs(numbers)
    scales[-2:] = np.maximum(scales[-2:], 0.5 * (numbers[-1] - numbers[-2]))
    values: dict[str, float | np.ndarray] = {}
    for i, name in enumerate(_HEADLINES):
        error = error_between(numbers[i], refined[i], chance, float(scales[i]))
        values[name], values[f"{name}_error"] = float(numbers[i]), error + float(implied[i])
    return values


def _properties(scene: Scene, cycle: Cycle) -> dict[str, float]:
    """What else is told of a cycle."""
    return {
        "healing_exponent": _healing_exponent(scene, cycle),
        "residual_friction": cycle.sliding,
        "drop_asymmetry": (cycle.highest - cycle.at_peak) / (cycle.at_peak - cycle.lowest),
    }


def _healing_exponent(scene: Scene, cycle: Cycle) -> float:
    """d ln(theta)/d ln(V), where Theta = b ln(theta/theta_*); NaN where there is no such theta."""
    slowed = cycle.rested.log_rate - cycle.landed.log_rate
    law = scene.parts.law
    if law.states > 1 or not law.logarithmic or not abs(slowed) > 1.0:
        return math.nan
    return (cycle.rested.state - cycle.landed.state) / (scene.b * slowed)


class Approach:
    """The way to the limit cycle of a scene, along the map from one maximum of spring stress to the
    next.

    Attributes
    ----------
    seen : list of Cycle
        The cycles so far; the last is the limit cycle once `follow` has returned true.
    events, work : int
        How many cycles it took, and the right-hand sides of the last.
    """

    def __init__(self, scene: Scene, accuracy: Accuracy, after: Approach | None = None) -> None:
        self._scene, self._accuracy = scene, accuracy
        self.seen: list[Cycle] = []
        self._numbers: list[np.ndarray] = []
        self.events: int = after.events if after else 0
        self.work = 0
        self._start = after.fixed_point() if after else None
        #: Derivatives of the stress at the next maximum, and of the numbers of a cycle, with
        #: respect to the stress at its beginning.
        self._known: bool = after is not None and after._known
        self._return: float = after._return if after else 0.0
        self._slopes: np.ndarray = after._slopes if after else np.zeros(len(_HEADLINES))
        #: What was left to go along the map where the motion leapt last.
        self._left_at_leap = math.inf

    def follow(self, meter: Meter, events: int) -> bool:
        """Follow cycles until one is the limit cycle; false where the motion settles to steady
        sliding.

        Raises
        ------
        Halt
            With `work_budget_spent` where none is within so many events.
        """
        while True:
            spent = meter.spent
            for cycle in cycles(self._scene, self._accuracy, meter, self._start):
                if cycle is None:
                    return False
                self.work, spent = meter.spent - spent, meter.spent
                self.events += 1
                self.seen.append(cycle)
                self._numbers.append(cycle.numbers())
                self._learn()
                if self._repeats():
                    return True
                if self.events >= events:
                    text = f"no cycle repeats within {events} events; {more_events(events)}"
                    raise Halt(Status.WORK_BUDGET_SPENT, text)
                if self._may_leap():
                    self._left_at_leap = abs(cycle.end.spring - cycle.begin.spring)
                    self._start = self.fixed_point()
                    break

    def of_limit_cycle(self, cycle: Cycle) -> np.ndarray:
        """Numbers of the limit cycle that a cycle close to it implies."""
        return cycle.numbers() + self._slopes * self._ahead(cycle)

    def fixed_point(self) -> Point:
        """Where the limit cycle begins, as the last cycle implies: at the slip rate of the load
        point, from which time is counted.
        """
        scene, cycle = self._scene, self.seen[-1]
        spring, load = cycle.begin.spring + self._ahead(cycle), scene.log_load_rate
        strength = relation_of(scene)(spring - scene.dynamics.radiated(load))[0]
        return on_slow_manifold(scene, spring, (strength - scene.a * load,))

    def _ahead(self, cycle: Cycle) -> float:
        """Stress from the beginning of a cycle to that of the limit cycle."""
        return (cycle.end.spring - cycle.begin.spring) / (1.0 - min(self._return, _DIVERGES))

    def _learn(self) -> None:
        """Take the derivatives from the last two cycles, as long as numerical errors allow."""
        if len(self.seen) < 2:
            return
        before, now = self.seen[-2:]
        apart = now.begin.spring - before.begin.spring
        noise = self._accuracy.solver * self._scene.a
        if abs(apart) > (1000.0 if self._known else 1.0) * noise:
            self._known = True
            self._return = (now.end.spring - before.end.spring) / apart
            self._slopes = (self._numbers[-1] - self._numbers[-2]) / apart

    def _repeats(self) -> bool:
        """Whether the next cycles would all be the same: as the derivatives say, or because the
        last two are.
        """
        cycle = self.seen[-1]
        allowed = 0.3 * self._accuracy.rtol * np.abs(self._numbers[-1])
        if self._known and self._return < _DIVERGES:
            to_come = np.abs(self._slopes * self._ahead(cycle))
            if (to_come <= allowed).all():
                return True
        if len(self.seen) < 2 or self.seen[-2].end != cycle.begin:
            return False
        change = np.abs(self._numbers[-1] - self._numbers[-2])
        left = min(max(self._return, 0.0), _DIVERGES)
        return bool((change * max(1.0, left / (1.0 - left)) <= allowed).all())

    def _may_leap(self) -> bool:
        """Whether to leap to the fixed point: not where the next cycle comes as close, nor where
        that is far, because the swings may be headed for steady sliding; and not again where the
        last leap came no closer, because leaps may go round in a circle.
        """
        cycle = self.seen[-1]
        noise = self._accuracy.solver * self._scene.a
        left = abs(cycle.end.spring - cycle.begin.spring)
        if not 10.0 * noise <= left < 0.5 * self._left_at_leap:
            return False
        if not _SLOW_APPROACH < self._return < _DIVERGES:
            return False
        slowest, fastest = (self._slopes * self._ahead(cycle))[-2:] * LN10
        return bool(abs(fastest - slowest) < _NEAR * cycle.swing)


def _approach(scene: Scene, accuracy: Accuracy, meter: Meter, events: int) -> Approach | None:
    """The way to the limit cycle, most of it at a low accuracy; None where the motion settles."""
    if accuracy.rtol < _LOW:
        low = Approach(scene, replace(accuracy, rtol=_LOW))
        try:
            if low.follow(meter, events):
                approach = Approach(scene, accuracy, after=low)
                if approach.follow(meter, events):
                    return approach
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
    approach = Approach(scene, accuracy)
    return approach if approach.follow(meter, events) else None
