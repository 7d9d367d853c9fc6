"""The way of a motion to its limit cycle.

Of one state, one number decides what follows a rise of V through V_0, the spring stress there: the
state goes with it, and what a departure along the motion changes is forgotten. So two cycles in a
row tell the derivative of the map from one rise to the next, and where cycles come closer slowly,
the motion leaps to the fixed point which that implies.

The section of a motion where V rises through V_0 is s = (f, Psi), and P(s) is its image: the
section a cycle later, and behind it the headline numbers of that cycle. The derivative P' has a
column b by f, and a column c by Psi. Spring stress is highest at a section, so that the motion
passes it along (0, dPsi/dt): to begin a time dt later makes the cycle shorter by dt, and changes
nothing else. So c is -1/(dPsi/dt) in the recurrence interval, and 0 in all other rows. Where the
sections of two cycles differ by (df, dPsi), and their images by dP,

    b = (dP - c dPsi)/df.

The first two rows of P', the derivative A of the next section, have c = 0: A has rank one, and its
trace is the eigenvalue that is not 0. So A**2 = (tr A) A, and from s to the fixed point it is

    (1 - A)^-1 (P(s) - s) = P(s) - s + A (P(s) - s)/(1 - tr A).

With several states a motion is followed cycle by cycle: after how many it repeats itself, if ever.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import sub

import numpy as np

from rsfstudy.analysis.cycles import LN10, NUMBERS, Cycle, cycles, more_events
from rsfstudy.analysis.return_map import CLOSED, Orbit, ReturnMap, section
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.stability import critical_stiffness
from rsfstudy.status import Status

#: Part of their distance to the limit that cycles keep each time: above the first they are leapt
#: ahead of, above the second they approach none.
_SLOW_APPROACH, _DIVERGES = 0.03, 0.98
#: Longest leap, as a part of the swing of ln V.
_NEAR = 0.1
#: Most cycles of a period that is looked for.
LONGEST = 16
#: Accuracy at which cycles are closed, where no better one is asked for: differences lose digits.
_FINE = 1e-7
#: Cycles after which a motion is first looked at.
_FIRST_LOOK = 8
#: Size of a multiplier from which an orbit repels beyond doubt, and how far off its like a cycle is
#: that repeats none, over how far ln V swings.
_REPELS, _OFF = 1.01, 0.02
#: Part by which stiffness differs from the critical one where swings take for ever to grow or to
#: die out.
_CRITICAL = 1e-5


class Approach:
    """The way to the limit cycle of a scene with one state.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    meter : Meter
        Charged with the motion.

    Attributes
    ----------
    seen : list of Cycle
        The cycles so far; the last is the limit cycle once `follow` has returned true.
    """

    def __init__(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> None:
        self._scene, self._accuracy, self._meter = scene, accuracy, meter
        self._by = ReturnMap(scene, accuracy, meter)
        self._noise = accuracy.solver * scene.a
        self._work = 0
        self.seen: list[Cycle] = []
        #: The columns b and c of P', derivatives of the image by spring stress and by state; and
        #: whether they are known.
        self._slopes, self._known = 2 * ([0.0] * (2 + NUMBERS),), False
        #: The section s where the last cycle begins, its image P(s), and dP, by how much that
        #: differs from the image before.
        self._begin, self._image = (0.0, 0.0), [0.0] * (2 + NUMBERS)
        self._changes = self._image
        #: What is left from s to the fixed point, and P' times that: what it changes of the image.
        self._ahead, self._implied = self._begin, self._image
        #: What was left to go along the map where the motion leapt last.
        self._left_at_leap = np.inf

    def follow(self, events: int) -> bool:
        """Follow cycles until one is the limit cycle; false where the motion settles to steady
        sliding.

        Raises
        ------
        Halt
            With `work_budget_spent` where none is within so many events.
        """
        start = None
        while True:
            spent = self._meter.spent
            for cycle in cycles(self._scene, self._accuracy, self._meter, start):
                if cycle is None:
                    return False
                self._work, spent = self._meter.spent - spent, self._meter.spent
                self.seen.append(cycle)
                self._learn()
                if self._repeats():
                    return True
                if len(self.seen) >= events:
                    remedy = self._hopeless or more_events(events)
                    text = f"no cycle repeats within {events} events; {remedy}"
                    raise Halt(Status.WORK_BUDGET_SPENT, text)
                if self._may_leap():
                    self._left_at_leap = abs(cycle.end.spring_stress - cycle.begin.spring_stress)
                    start = self._by.point(section(cycle.begin) + np.array(self._ahead))
                    break

    @property
    def _hopeless(self) -> str:
        """Why no number of events would do, where stiffness is the critical one; else empty."""
        critical = critical_stiffness(self._scene, self._scene.log_load_rate)
        off = abs(self._scene.stiffness / critical - 1.0) if critical else math.inf
        if off > _CRITICAL:
            return ""
        return f"stiffness is critical to {off:.0e}: swings take for ever to grow or to die out"

    @property
    def orbit(self) -> Orbit:
        """The last cycle, and what it implies of the limit cycle."""
        last, slopes = self.seen[-1:], np.array(self._slopes).T
        return Orbit(tuple(last), (slopes,), np.array(self._ahead), self._accuracy, self._work)

    @property
    def _return(self) -> float:
        """Part of its distance to the limit cycle that a cycle keeps: the trace of the derivative
        A of the map, whose other eigenvalue is zero, because the motion forgets one direction.
        """
        return self._slopes[0][0] + self._slopes[1][1]

    def _learn(self) -> None:
        """Take the derivatives from the last two cycles, as long as numerical errors allow, and
        what is ahead from the last (the formulas are those of the module).
        """
        last = self.seen[-1]
        begin, end = last.begin, last.end
        start = begin.spring_stress, begin.psi
        image = [end.spring_stress, end.psi, *last.numbers()]
        changes = list(map(sub, image, self._image))
        if len(self.seen) > 1:
            by_stress, by_state = map(sub, start, self._begin)
            if abs(by_stress) > (1000.0 if self._known else 1.0) * self._noise:
                self._known = True
                # the motion passes a section without a change of spring stress
                (_none, way), passed = self._by.along(begin)
                along = [change / way for change in passed]
                pairs = zip(changes, along, strict=True)
                self._slopes = [(x - by_state * y) / by_stress for x, y in pairs], along
        self._begin, self._image, self._changes = start, image, changes
        off, kept = list(map(sub, image, start)), 1.0 - min(self._return, _DIVERGES)
        returned = self._by_slopes(off)
        self._ahead = off[0] + returned[0] / kept, off[1] + returned[1] / kept
        self._implied = self._by_slopes(self._ahead)

    def _by_slopes(self, move: Sequence[float]) -> list[float]:
        """What a move of the section where a cycle begins changes of the image."""
        by_stress, by_state = move
        return [x * by_stress + y * by_state for x, y in zip(*self._slopes, strict=True)]

    def _repeats(self) -> bool:
        """True if the next cycles would all be the same: as the derivatives say, or because the
        last two are.
        """
        allowed = [0.3 * self._accuracy.rtol * abs(number) for number in self._image[2:]]
        if self._known and self._return < _DIVERGES and _within(self._implied[2:], allowed):
            return True
        if len(self.seen) < 2 or self.seen[-2].end != self.seen[-1].begin:
            return False
        if self._wavers():
            return True
        left = min(max(self._return, 0.0), _DIVERGES)
        left = max(1.0, left / (1.0 - left))
        return _within([change * left for change in self._changes[2:]], allowed)

    def _wavers(self) -> bool:
        """True if the last two cycles go to and fro, as near the limit cycle as it is ever closed:
        by numerical errors, because on a plane no motion passes another, so that cycles approach
        their limit from one side.
        """
        before, last = (
            cycle.end.spring_stress - cycle.begin.spring_stress for cycle in self.seen[-2:]
        )
        near = CLOSED * self._accuracy.rtol * self._scene.a * self.seen[-1].swing
        return before * last <= 0.0 and abs(last) <= near

    def _may_leap(self) -> bool:
        """True if to leap to the fixed point: not where the next cycle comes as close, nor where
        that is far, because the swings may be headed for steady sliding; and not again where the
        last leap came no closer, because leaps may go round in a circle.
        """
        cycle = self.seen[-1]
        left = abs(cycle.end.spring_stress - cycle.begin.spring_stress)
        if not 10.0 * self._noise <= left < 0.5 * self._left_at_leap:
            return False
        if not _SLOW_APPROACH < self._return < _DIVERGES:
            return False
        slowest, fastest = self._implied[-2:]
        return LN10 * abs(fastest - slowest) < _NEAR * cycle.swing


def _within(changes: Sequence[float], allowed: Sequence[float]) -> bool:
    """True if none of some changes is larger than is allowed."""
    return all(abs(change) <= most for change, most in zip(changes, allowed, strict=True))


@dataclass(frozen=True)
class Course:
    """State of a motion in its course.

    Attributes
    ----------
    seen : list of Cycle
        Its cycles (the events of `measures.limit_cycle`).
    orbit : Orbit or None
        The periodic orbit it ends in; none, where it has not found one.
    open : bool
        Whether it may still find one, as far as its cycles tell.
    """

    seen: list[Cycle]
    orbit: Orbit | None
    open: bool


def course(
    scene: Scene, accuracy: Accuracy, meter: Meter, events: int, *, to_its_end: bool = False
) -> Course | None:
    """Follow a motion until it comes to an orbit that attracts, for so many cycles at most; or `to
    its end` in any case. None where it settles to steady sliding.
    """
    seen, orbit, repels = list[Cycle](), None, False
    fine = accuracy.at(min(accuracy.rtol, _FINE))
    look = min(_FIRST_LOOK, events)
    for cycle in cycles(scene, accuracy, meter, None):
        if cycle is None:
            return None
        seen.append(cycle)
        if len(seen) == look and not orbit:
            look = min(2 * look, events)
            found, off = None, math.inf
            for counted in _counted(scene):
                period, off = recurrence(scene, seen, counted)
                if off < _OFF:
                    by = ReturnMap(scene, fine, meter, counted=counted)
                    found = by.orbit(section(cycle.end), period, cycle.swing)
                    break
            repels = off >= _OFF or (found is not None and abs(found.multipliers[0]) > _REPELS)
            orbit = found if found is not None and found.attracts else None
        if len(seen) == events or (orbit and not to_its_end):
            break
    return Course(seen, orbit, open=not repels or _on_its_way(seen))


def _on_its_way(seen: Sequence[Cycle]) -> bool:
    """Return True if the cycles are too few to judge, or still change in one direction.

    The range of ln V, or a slow unknown, then grows or falls from each cycle to the next.
    """
    if len(seen) < _FIRST_LOOK:
        return True
    latest = [(cycle.swing, *cycle.end.psis) for cycle in seen[len(seen) // 2 :]]
    changes = np.diff(latest, axis=0)
    return bool(((changes > 0.0).all(axis=0) | (changes < 0.0).all(axis=0)).any())


def _counted(scene: Scene) -> tuple[tuple[int, ...], ...]:
    """Return the states by which a cycle repeats: those that count, or only those of the law.

    An unknown that follows the motion slowly approaches its cycle long after the law has.
    """
    of_law = tuple(range(scene.parts.law.states))
    return tuple(dict.fromkeys((scene.functions.friction.counted, of_law)))


def recurrence(
    scene: Scene, seen: Sequence[Cycle], counted: Sequence[int] | None = None
) -> tuple[int, float]:
    """Find the number of cycles after which a motion comes closest to repeating itself.

    After n cycles the motion is off by the largest ``|Psi(i + n) - Psi(i)|`` of any state at the
    ends of the later half of its cycles, relative to a times the range of ln V.

    Parameters
    ----------
    scene : Scene
    seen : sequence of Cycle
    counted : sequence of int, optional
        Places of the states that are compared. By default, all states that a part does not list in
        `excluded_from_distance`.

    Returns
    -------
    period : int
        The smallest n that is within twice the smallest difference.
    off : float
        The difference after n cycles, infinite if there are too few cycles.
    """
    if len(seen) < 4:
        return 1, math.inf
    places = list(scene.functions.friction.counted if counted is None else counted)
    states = np.array([cycle.end.psis for cycle in seen])[:, places]
    latest, scale = states[len(states) // 2 :], scene.a * seen[-1].swing
    longest = min(LONGEST, len(latest) // 2)
    off = np.array(
        [np.abs(latest[count:] - latest[:-count]).max() for count in range(1, longest + 1)]
    )
    period = int(np.argmax(off <= 2.0 * off.min())) + 1
    return period, float(off[period - 1]) / scale
