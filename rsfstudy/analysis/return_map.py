"""Periodic orbits, as fixed points of the map from one stick-slip cycle of a motion to the next.

A cycle (an event of `measures.limit_cycle`) runs from where V rises through V_0 to the next such
instant. Spring stress and states say all there is to say there, because V is known: with mass, the
spring carries what accelerates the slider besides what friction does. So a motion is a map of
spring stress and states from one such section to the next, and an orbit of n cycles is a fixed
point of its n-th power. The eigenvalues of the derivative there are its Floquet multipliers: what
becomes of a small departure once around. Beyond 1 in size, the orbit repels; at -1, one of twice as
many cycles comes off it.

There is one unknown more than a departure can have directions, as long as mass hardly acts: the
motion forgets one along itself, which is a change of states at the same spring stress, because
spring stress is highest there.

Sections are arrays (f, Psi_1, ...) of shape (1 + states,): spring stress over sigma_*, and states.
With P the map of n cycles, an orbit solves P(s) - s = 0 by Newton's method, whose Jacobian dP - 1
comes from differences of order four, and is corrected by what each step finds (Broyden).

References
----------
Broyden (1965), Math. Comp. 19, 577-593.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg.lapack import dgesv

from rsfstudy.analysis.cycles import NUMBERS, Cycle, cycles
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.handover import limits, weight_of_mass
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.recording import Recording
from rsfstudy.motion.starting import at_rate, beginning, check_start
from rsfstudy.slider.equations import without_mass
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Step of the differences that give the derivative of the map, over how far ln V swings: its slopes
#: bend over a hundredth of a swing.
STEP = 1e-4
_WEIGHTS = ((1, 2.0 / 3.0), (2, -1.0 / 12.0))
#: How far off an orbit is looked for, over how far ln V swings, and most steps to it.
_NEAR, _TRIES = 0.1, 12
#: How nearly its cycles must close an orbit, in the accuracy asked for: what they do not is
#: corrected to first order.
CLOSED = 0.3


@dataclass(frozen=True)
class Orbit:
    """A motion that closes after some cycles.

    Attributes
    ----------
    cycles : tuple of Cycle
        One after the other.
    slopes : tuple of ndarray
        Of each cycle, the derivatives of the section at its end, and of its numbers below that, by
        the section at its beginning: of shape (1 + states + numbers, 1 + states).
    ahead : ndarray
        From the section where the cycles begin to that of the orbit which they imply.
    accuracy : Accuracy
        With which the cycles were followed.
    work : int
        Right-hand sides that took.
    recording : Recording or None
        What was recorded along the cycles, and beyond.
    """

    cycles: tuple[Cycle, ...]
    slopes: tuple[np.ndarray, ...]
    ahead: np.ndarray
    accuracy: Accuracy
    work: int
    recording: Recording | None = None

    @property
    def period(self) -> int:
        """Number of its cycles."""
        return len(self.cycles)

    @property
    def begin(self) -> np.ndarray:
        """The section where the orbit begins."""
        return np.asarray(section(self.cycles[0].begin) + self.ahead)

    @cached_property
    def implied(self) -> np.ndarray:
        """Corrections of the numbers of its first cycle, because its cycles do not close."""
        return np.asarray(self.slopes[0][len(self.ahead) :] @ self.ahead)

    @cached_property
    def numbers(self) -> np.ndarray:
        """The headline numbers of its first cycle, had its cycles closed."""
        return np.asarray(np.array(self.cycles[0].numbers()) + self.implied)

    @property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex, the largest in size first."""
        found = np.linalg.eigvals(product(self.slopes)).astype(complex)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])

    @property
    def attracts(self) -> bool:
        """True if motions close to it come closer."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def from_largest(self) -> Orbit:
        """This orbit, beginning with the cycle that has the fastest peak."""
        at = max(range(self.period), key=lambda place: self.cycles[place].fastest)
        if not at:
            return self
        return replace(
            self,
            cycles=self.cycles[at:] + self.cycles[:at],
            slopes=self.slopes[at:] + self.slopes[:at],
            ahead=product(self.slopes[:at]) @ self.ahead,
        )


def section(point: Point) -> np.ndarray:
    """Spring stress and states: all there is to say where V rises through V_0."""
    return np.array((point.spring_stress, *point.psis))


def image_of(cycle: Cycle) -> np.ndarray:
    """The section at the end of a cycle, and its numbers below that."""
    return np.array((cycle.end.spring_stress, *cycle.end.psis, *cycle.numbers()))


def product(slopes: Sequence[np.ndarray]) -> np.ndarray:
    """The derivative of the section over several cycles, one after the other: the product of
    theirs, of shape (1 + states, 1 + states).
    """
    size = slopes[0].shape[1]
    together = slopes[0][:size]
    for each in slopes[1:]:
        together = each[:size] @ together
    return together


_unit = lru_cache(np.eye)


class ReturnMap:
    """The map of spring stress and states from one rise of V through V_0 to the next.

    Parameters
    ----------
    scene : Scene
        Whose load point moves.
    accuracy : Accuracy
    meter : Meter
        Charged with the motions.
    recorded : bool
        Whether to keep what the motions along an orbit do, besides its ends.
    counted : sequence of int, optional
        Places of the states that count for the distance between two sections. By default, all
        states that a part does not list in `excluded_from_distance`.
    """

    def __init__(
        self,
        scene: Scene,
        accuracy: Accuracy,
        meter: Meter,
        *,
        recorded: bool = False,
        counted: Sequence[int] | None = None,
    ) -> None:
        self.scene, self.accuracy, self._meter = scene, accuracy, meter
        self._recorded = recorded
        places = scene.functions.friction.counted if counted is None else counted
        #: Places in a section of the unknowns that count for the distance.
        self._counted = [0, *(1 + place for place in places)]

    def point(self, at: np.ndarray) -> Point:
        """The slider at a section: on the slow manifold, or at V_0 where mass acts there.

        Raises
        ------
        Halt
            Where spring stress leaves no friction of forward slip.
        """
        spring_stress, *psis = at.tolist()
        scene, states = self.scene, tuple(psis)
        x, friction, _shift = scene.functions.balance(spring_stress, states, scene.numbers)
        point = beginning(scene, spring_stress, states, x, friction)
        check_start(self.scene, point)
        return at_rate(self.scene, point, self.scene.log_load_rate) if self._acts(point) else point

    def _acts(self, point: Point) -> bool:
        """True if mass acts beyond what the slow manifold holds of it."""
        if not self.scene.has_mass:
            return False
        inertial_stress = point.spring_stress - point.friction
        given = limits(self.scene, self.accuracy)
        return weight_of_mass(point.log_slip_rate, inertial_stress, given) >= 1.0

    def cycles(
        self, start: np.ndarray, count: int, recording: Recording | None = None
    ) -> list[Cycle]:
        """So many cycles from a section on; fewer where the motion settles or cannot go on."""
        seen = list[Cycle]()
        try:
            moving = cycles(self.scene, self.accuracy, self._meter, self.point(start), recording)
            for cycle in moving:
                if cycle is None:
                    break
                seen.append(cycle)
                if len(seen) == count:
                    break
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
        return seen

    def image(self, start: np.ndarray) -> np.ndarray | None:
        """The section one cycle later, and the numbers of the cycle below it, of shape (1 + states
        + numbers,); None where the motion does not come that far.
        """
        seen = self.cycles(start, 1)
        return image_of(seen[0]) if seen else None

    def slopes(self, start: np.ndarray, count: int, scale: float) -> tuple[np.ndarray, ...]:
        """Derivatives of so many cycles, one after the other, none of which takes a small step far;
        fewer where the motion does not come that far. States are of the size of the scale.
        """
        found, step = list[np.ndarray](), STEP * math.sqrt(self.accuracy.refinement) * scale
        current: np.ndarray | None = start
        for number in range(count):
            slopes = None if current is None else self._slopes(current, step)
            if current is None or slopes is None:
                break
            found.append(slopes)
            after = self.image(current) if number < count - 1 else None
            current = None if after is None else after[: len(current)]
        return tuple(found)

    def along(self, point: Point) -> tuple[Numbers, Numbers]:
        """The direction in which the motion passes a section, and what going that way changes of
        the section and the numbers of a cycle, as long as mass hardly acts: the time it takes.
        """
        scene, states = self.scene, len(point.psis)
        spring_stress = point.friction + scene.dynamics.radiated(scene.log_load_rate)
        rates = without_mass(scene, clock=True).rates((spring_stress, *point.psis, 0.0))
        rest = (0.0,) * (NUMBERS - 1)
        return (0.0, *rates[1:-1]), (*(0.0,) * (1 + states), -rates[-1], *rest)

    def _slopes(self, start: np.ndarray, step: float) -> np.ndarray | None:
        """Of the section after one cycle and of its numbers, by differences of order four; along
        the motion, as it passes on.
        """
        point = self.point(start)
        way, passed = self.along(point)
        directions = np.linalg.qr(np.column_stack([way, np.eye(len(start))]))[0]
        columns = list[np.ndarray]()
        for unit in directions.T:
            if not columns and not self._acts(point):
                columns.append(np.array(passed) / (unit @ way))
                continue
            slope = np.zeros(len(start) + NUMBERS)
            for number, weight in _WEIGHTS:
                ahead = self.image(start + number * step * unit)
                behind = self.image(start - number * step * unit)
                if ahead is None or behind is None:
                    return None
                slope += weight * (ahead - behind) / step
            columns.append(slope)
        return np.asarray(np.column_stack(columns) @ directions.T)

    def orbit(
        self, start: np.ndarray, count: int, swing: float, reach: float = _NEAR
    ) -> Orbit | None:
        """Find the orbit of a number of cycles, or of a divisor of it, close to a section.

        Parameters
        ----------
        start : ndarray
            The section.
        count : int
            The number of cycles.
        swing : float
            Range of ln V.
        reach : float
            Largest distance of the orbit from the section, relative to `a` times the range of ln V.

        Returns
        -------
        Orbit or None
            None if there is no orbit.
        """
        scale = self.scene.a * swing
        slopes = self.slopes(start, count, scale)
        found = self._solve(start, slopes, scale, reach) if len(slopes) == count else None
        if found is None:
            return None
        count = self._cycles_until_repeat(found.cycles, scale)
        if np.abs(found.begin - start).max() > 10.0 * self.accuracy.rtol * scale:
            slopes = self.slopes(found.begin, count, scale)
        if len(slopes) < count:
            return None
        return replace(found, cycles=found.cycles[:count], slopes=slopes[:count])

    def again(self, known: Orbit) -> Orbit | None:
        """An orbit that is known at another accuracy; None where it does not close."""
        if known.accuracy == self.accuracy:
            return known
        return self._solve(known.begin, known.slopes, self.scene.a * known.cycles[0].swing, _NEAR)

    def _solve(
        self, start: np.ndarray, slopes: Sequence[np.ndarray], scale: float, reach: float
    ) -> Orbit | None:
        """The orbit of as many cycles as derivatives are known of, within reach of a section; None
        where there is none.

        By Newton's method, ``J move = -(P(s) - s)``, with Broyden's corrections: where P(s) - s is
        still `off` after a move, J changes by ``off move^T/(move . move)``.
        """
        at, enough, last = start, CLOSED * self.accuracy.rtol * scale, math.inf
        jacobian, move = product(slopes) - _unit(len(start)), None
        for _ in range(_TRIES):
            spent, recording = self._meter.spent, Recording() if self._recorded else None
            seen = self.cycles(at, len(slopes), recording)
            if len(seen) < len(slopes):
                return None
            off = section(seen[-1].end) - at
            if move is not None:
                jacobian += off[:, None] * move / (move @ move)
            move = -dgesv(jacobian, off)[2]
            size = self._size(move, at, scale)
            # as close as asked for, or as errors of the motion let it come
            if size <= enough or 0.5 * last <= size <= 100.0 * enough:
                work = self._meter.spent - spent
                return Orbit(tuple(seen), tuple(slopes), move, self.accuracy, work, recording)
            at, last = at + move, size
            if not np.abs((at - start)[self._counted]).max() <= reach * scale:
                return None
        return None

    def _size(self, move: np.ndarray, at: np.ndarray, scale: float) -> float:
        """Return the largest change of a section.

        The unknowns of a fluid may be huge. If they are larger than the scale of the states, their
        changes are relative to their values, in units of that scale.
        """
        changes, first = np.abs(move), 1 + self.scene.parts.law.states
        changes[first:] /= np.maximum(1.0, np.abs(at[first:]) / scale)
        return float(changes.max())

    def _cycles_until_repeat(self, cycles: Sequence[Cycle], scale: float) -> int:
        """Return the number of cycles after which an orbit repeats itself."""
        begin = section(cycles[0].begin)
        for count in range(1, len(cycles)):
            apart = self._size(section(cycles[count - 1].end) - begin, begin, scale)
            if len(cycles) % count == 0 and apart < 1e-4 * scale:
                return count
        return len(cycles)
