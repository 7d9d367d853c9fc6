"""Motions of several states, event by event: after how many they repeat, and the cycles that close.

Where V rises through V_0 at a maximum of spring stress, the states say all there is to say: the
spring then carries what friction at V_0 does. So a motion is a map of the states from one such
maximum to the next, and a cycle of n events is a fixed point of its n-th power. The eigenvalues of
the derivative there are its Floquet multipliers: what becomes of a small departure once around.
Beyond 1 in size, the cycle repels; at -1, one of twice as many events comes off it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsfstudy.boundaries.cycles import Cycle, cycles
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.regimes import on_slow_manifold
from rsfstudy.motion.stepping import Halt, Meter
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene import Scene
from rsfstudy.slider.steady import stress_after_jump
from rsfstudy.status import Status

#: Most events of a period that is looked for.
LONGEST = 16
#: Step of the differences that give the derivative of the map, over how far ln V swings: its slopes
#: bend over a hundredth of a swing.
_STEP = 1e-4
_WEIGHTS = ((1, 2.0 / 3.0), (2, -1.0 / 12.0))
#: Events along which a departure turns to where it grows, before growth counts: other directions
#: lag behind by a factor of ten an event and more.
_TURNING = 16
#: How far off a cycle is looked for, over how far ln V swings, and most steps to it.
_NEAR, _TRIES = 0.1, 12
#: How many guesses there are at a cycle of one event, and how far off the first may be.
_GUESSES, _AWAY = 3, 0.3
#: Accuracy at which cycles are closed, where no better one is asked for: differences lose digits.
_FINE = 1e-7
#: Events after which a motion is first looked at.
_FIRST_LOOK = 8
#: Size of a multiplier from which a cycle repels beyond doubt, and how far off its like an event is
#: that repeats none, over how far ln V swings.
_REPELS, _OFF = 1.01, 0.02


@dataclass(frozen=True)
class Orbit:
    """A cycle that closes after some events.

    Attributes
    ----------
    events : tuple of Cycle
        One after the other.
    slopes : tuple of ndarray
        Of each event, the derivative of the states at its end by those at its beginning.
    """

    events: tuple[Cycle, ...]
    slopes: tuple[np.ndarray, ...]

    @property
    def period(self) -> int:
        """How many events it has."""
        return len(self.events)

    @property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex, the largest in size first."""
        found = np.linalg.eigvals(product(self.slopes)).astype(complex)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])

    @property
    def attracts(self) -> bool:
        """Whether motions close to it come closer."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def from_largest(self) -> Orbit:
        """The same, beginning with the event that has the fastest peak."""
        at = max(range(self.period), key=lambda place: self.events[place].fastest)
        return Orbit(self.events[at:] + self.events[:at], self.slopes[at:] + self.slopes[:at])


def product(slopes: Sequence[np.ndarray]) -> np.ndarray:
    """The derivative of several events, one after the other."""
    together = np.eye(len(slopes[0]))
    for each in slopes:
        together = each @ together
    return together


class ReturnMap:
    """The map of states from one maximum of spring stress to the next.

    Parameters
    ----------
    scene : Scene
        Whose load point moves.
    accuracy : Accuracy
    meter : Meter
        Charged with the motions.
    """

    def __init__(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> None:
        self.scene, self.accuracy, self._meter = scene, accuracy, meter

    def point(self, psis: Numbers) -> Point | None:
        """The maximum of spring stress with these states; None where no stress is that strong."""
        scene = self.scene
        strength = scene.a * scene.log_load_rate + scene.functions["total"](psis)
        friction = stress_after_jump(scene, strength, psis)
        if friction is None:
            return None
        spring = friction + scene.dynamics.radiated(scene.log_load_rate)
        return on_slow_manifold(scene, spring, psis)

    def events(self, psis: Numbers, count: int) -> list[Cycle]:
        """So many events from these states on; fewer where the motion settles or cannot go on."""
        start, seen = self.point(psis), list[Cycle]()
        if start is None:
            return seen
        try:
            for cycle in cycles(self.scene, self.accuracy, self._meter, start):
                if cycle is None:
                    break
                seen.append(cycle)
                if len(seen) == count:
                    break
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
        return seen

    def image(self, psis: np.ndarray, count: int) -> np.ndarray | None:
        """The states so many events later; None where the motion does not come that far."""
        seen = self.events(tuple(psis.tolist()), count)
        return np.array(seen[-1].end.psis) if len(seen) == count else None

    def slopes(self, psis: np.ndarray, count: int, scale: float) -> tuple[np.ndarray, ...]:
        """Derivatives of so many events, one after the other, none of which takes a small step far;
        fewer where the motion does not come that far. States are of the size of the scale.
        """
        found, step = list[np.ndarray](), _STEP * math.sqrt(self.accuracy.refinement) * scale
        now: np.ndarray | None = psis
        for number in range(count):
            slopes = None if now is None else self._slopes(now, step)
            if now is None or slopes is None:
                break
            found.append(slopes)
            now = self.image(now, 1) if number < count - 1 else None
        return tuple(found)

    def growth(self, seen: Sequence[Cycle], kept: int) -> tuple[float, float]:
        """By how much small departures grow along the last so many events, as a logarithm: mean and
        its standard error, over as many blocks of events as each has; NaN where they lead away from
        the motion.

        Which way a departure grows it learns along the events before, or the first half where there
        are few.
        """
        seen = seen[-(kept + _TURNING) :]
        step = _STEP * self.scene.a * max(cycle.swing for cycle in seen)
        departure, grown = np.ones(len(seen[0].begin.psis)), []
        for cycle in seen:
            psis, by = np.array(cycle.begin.psis), step * departure / np.linalg.norm(departure)
            ahead, behind = self.image(psis + by, 1), self.image(psis - by, 1)
            if ahead is None or behind is None:
                return math.nan, math.nan
            departure = (ahead - behind) / (2.0 * step)
            grown.append(math.log(np.linalg.norm(departure)))
        grown = grown[min(_TURNING, len(grown) // 2) :]
        blocks = np.array_split(grown, max(2, math.isqrt(len(grown))))
        means = [block.mean() for block in blocks]
        return float(np.mean(grown)), float(np.std(means, ddof=1) / math.sqrt(len(means)))

    def _slopes(self, psis: np.ndarray, step: float) -> np.ndarray | None:
        """Of the states after one event, by differences of order four."""
        columns = []
        for unit in np.eye(len(psis)):
            slope = np.zeros(len(psis))
            for number, weight in _WEIGHTS:
                ahead = self.image(psis + number * step * unit, 1)
                behind = self.image(psis - number * step * unit, 1)
                if ahead is None or behind is None:
                    return None
                slope += weight * (ahead - behind) / step
            columns.append(slope)
        return np.array(columns).T

    def of_one_event(self, seen: Sequence[Cycle]) -> Orbit | None:
        """The cycle of one event that a motion comes close to, whether it attracts or not."""
        for near in closest_returns(seen):
            # where periods have doubled, events go back and forth around it
            between = 0.5 * np.add(near.begin.psis, near.end.psis)
            orbit = self.orbit(between, 1, near.swing, reach=_AWAY)
            if orbit is not None:
                return orbit
        return None

    def orbit(
        self, psis: np.ndarray, count: int, swing: float, reach: float = _NEAR
    ) -> Orbit | None:
        """The cycle of so many events, or of a divisor of them, within reach of these states; None
        where there is none. By Newton's method with Broyden's corrections.
        """
        scale = self.scene.a * swing
        slopes = self.slopes(psis, count, scale)
        solved = self._solve(psis, slopes, scale, reach) if len(slopes) == count else None
        if solved is None:
            return None
        events = self._of_one_period(self.events(tuple(solved.tolist()), count), scale)
        if np.abs(solved - psis).max() > 10.0 * self.accuracy.rtol * scale:
            slopes = self.slopes(solved, len(events), scale)
        slopes = slopes[: len(events)]
        return Orbit(events, slopes) if 0 < len(events) == len(slopes) else None

    def again(self, known: Orbit) -> Orbit | None:
        """A cycle that is known at another accuracy; None where it does not close."""
        psis, scale = np.array(known.events[0].begin.psis), self.scene.a * known.events[0].swing
        solved = self._solve(psis, known.slopes, scale, _NEAR)
        events = [] if solved is None else self.events(tuple(solved.tolist()), known.period)
        return Orbit(tuple(events), known.slopes) if len(events) == known.period else None

    def _solve(
        self, psis: np.ndarray, known: Sequence[np.ndarray], scale: float, reach: float
    ) -> np.ndarray | None:
        """The states that come back after as many events as derivatives are known of."""
        count, start = len(known), psis
        slopes = product(known) - np.eye(len(psis))
        enough, image = self.accuracy.rtol * scale, self.image(psis, count)
        for _ in range(_TRIES):
            if image is None:
                return None
            move = -np.linalg.solve(slopes, image - psis)
            size = float(np.abs(move).max())
            psis = psis + move
            if size <= enough:
                return psis
            if not np.abs(psis - start).max() <= reach * scale:
                return None
            image = self.image(psis, count)
            if image is not None:
                slopes = slopes + np.outer(image - psis, move) / (move @ move)
        return psis if size <= 100.0 * enough else None

    @staticmethod
    def _of_one_period(events: Sequence[Cycle], scale: float) -> tuple[Cycle, ...]:
        """The events up to where they begin anew."""
        if not events:
            return ()
        begin = np.array(events[0].begin.psis)
        for count in range(1, len(events)):
            apart = np.abs(np.array(events[count - 1].end.psis) - begin).max()
            if len(events) % count == 0 and apart < 1e-4 * scale:
                return tuple(events[:count])
        return tuple(events)


@dataclass(frozen=True)
class Course:
    """Where a motion has come to.

    Attributes
    ----------
    seen : list of Cycle
        Its events.
    orbit : Orbit or None
        The cycle it ends in; none, where it has not found one.
    open : bool
        Whether it may still find one, as far as its events tell.
    """

    seen: list[Cycle]
    orbit: Orbit | None
    open: bool


def course(
    scene: Scene, accuracy: Accuracy, meter: Meter, events: int, *, to_its_end: bool = False
) -> Course | None:
    """Follow a motion until it comes to a cycle that attracts, for so many events at most; or `to
    its end` in any case. None where it settles to steady sliding.
    """
    seen, orbit, repels = list[Cycle](), None, False
    fine = replace(accuracy, rtol=min(accuracy.rtol, _FINE))
    by, look = ReturnMap(scene, fine, meter), min(_FIRST_LOOK, events)
    for cycle in cycles(scene, accuracy, meter, None):
        if cycle is None:
            return None
        seen.append(cycle)
        if len(seen) == look and not orbit:
            look = min(2 * look, events)
            period, off = recurrence(scene, seen)
            found = None
            if off < _OFF:
                found = by.orbit(np.array(cycle.end.psis), period, cycle.swing)
            repels = off >= _OFF or (found is not None and abs(found.multipliers[0]) > _REPELS)
            orbit = found if found is not None and found.attracts else None
        if len(seen) == events or (orbit and not to_its_end):
            break
    return Course(seen, orbit, open=not repels or _on_its_way(seen))


def _on_its_way(seen: Sequence[Cycle]) -> bool:
    """Whether events are too few to say anything of them, or still grow or shrink all the time."""
    growth = np.diff([cycle.swing for cycle in seen[len(seen) // 2 :]])
    return len(seen) < _FIRST_LOOK or bool((growth > 0.0).all() or (growth < 0.0).all())


def recurrence(scene: Scene, seen: Sequence[Cycle]) -> tuple[int, float]:
    """After how many events a motion comes closest to where it was, in all of the later half of its
    events; and how far it is off then, over a times how far ln V swings (infinitely, where there
    are too few events to say).
    """
    if len(seen) < 4:
        return 1, math.inf
    states = np.array([cycle.end.psis for cycle in seen])
    latest, scale = states[len(states) // 2 :], scene.a * seen[-1].swing
    longest = min(LONGEST, len(latest) // 2)
    off = np.array(
        [np.abs(latest[count:] - latest[:-count]).max() for count in range(1, longest + 1)]
    )
    period = int(np.argmax(off <= 2.0 * off.min())) + 1
    return period, float(off[period - 1]) / scale


def closest_returns(seen: Sequence[Cycle]) -> list[Cycle]:
    """The events of the later half that came closest to the one before, over how far ln V swings;
    the closest first.
    """

    def off(cycle: Cycle) -> float:
        apart = np.subtract(cycle.end.psis, cycle.begin.psis)
        return float(np.abs(apart).max()) / cycle.swing

    return sorted(seen[len(seen) // 2 :], key=off)[:_GUESSES]
