"""Periodic orbits, computed as fixed points of a return map.

A cycle (an event of ``measures.limit_cycle``) extends from one rise of V through V_0 to the next. V
is known at such a rise, so spring stress and the states determine the motion. With inertia, the
spring stress also includes the stress that accelerates the slider. The motion is therefore a map of
spring stress and states from one section to the next, and an orbit of n cycles is a fixed point of
the n-th power of this map. The eigenvalues of its derivative are the Floquet multipliers, the
factors by which small perturbations grow during one orbit. The orbit repels if the absolute value
of a multiplier exceeds 1. At a multiplier of -1, an orbit with twice the number of cycles branches
off.

If the effect of inertia is small, perturbations have one direction fewer than the section has
unknowns. The motion forgets a perturbation along itself. This direction is a change of the states
at constant spring stress, because spring stress is highest at a section.

Sections are arrays (f, Psi_1, ...) of shape (1 + states,), which contain spring stress over sigma_*
and the states. If P is the map of n cycles, an orbit solves P(s) - s = 0. The equation is solved by
Newton's method. The Jacobian dP - 1 is computed by finite differences of order four, and updated
after each step by Broyden's method.

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

from rsfstudy.analysis.cycles import NUMBERS, SMALLEST_SWING, Cycle, cycles
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
    """Closed orbit of one or several cycles.

    Attributes
    ----------
    cycles : tuple of Cycle
        Successive cycles.
    slopes : tuple of ndarray
        For each cycle, the derivatives of the section at its end and of its headline numbers with
        respect to the section at its beginning, of shape (1 + states + numbers, 1 + states).
    ahead : ndarray
        Vector from the section at which the cycles begin to the section of the closed orbit.
    accuracy : Accuracy
        Accuracy with which the cycles were computed.
    work : int
        Number of right-hand-side evaluations.
    recording : Recording or None
        Recording along the cycles, which may extend beyond their end.
    """

    cycles: tuple[Cycle, ...]
    slopes: tuple[np.ndarray, ...]
    ahead: np.ndarray
    accuracy: Accuracy
    work: int
    recording: Recording | None = None

    @property
    def period(self) -> int:
        """Number of cycles in the orbit."""
        return len(self.cycles)

    @property
    def begin(self) -> np.ndarray:
        """Section at which the orbit begins."""
        return np.asarray(section(self.cycles[0].begin) + self.ahead)

    @cached_property
    def implied(self) -> np.ndarray:
        """Corrections of the numbers of the first cycle for the closure error."""
        return np.asarray(self.slopes[0][len(self.ahead) :] @ self.ahead)

    @cached_property
    def numbers(self) -> np.ndarray:
        """Headline numbers of the first cycle, corrected for the closure error."""
        return np.asarray(np.array(self.cycles[0].numbers()) + self.implied)

    @property
    def multipliers(self) -> np.ndarray:
        """Complex Floquet multipliers in order of decreasing absolute value."""
        found = np.linalg.eigvals(product(self.slopes)).astype(complex)
        return np.asarray(found[np.argsort(-np.abs(found), kind="stable")])

    @property
    def attracts(self) -> bool:
        """True if the orbit attracts nearby motions."""
        return bool(abs(self.multipliers[0]) < 1.0)

    @property
    def from_largest(self) -> Orbit:
        """The same orbit, starting with the cycle that has the highest slip rate."""
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
    """Return the section at a point: spring stress and states."""
    return np.array((point.spring_stress, *point.psis))


def image_of(cycle: Cycle) -> np.ndarray:
    """Return the section at the end of a cycle, followed by its headline numbers."""
    return np.array((cycle.end.spring_stress, *cycle.end.psis, *cycle.numbers()))


def product(slopes: Sequence[np.ndarray]) -> np.ndarray:
    """Return the derivative of the section over several successive cycles.

    Returns
    -------
    ndarray, shape (1 + states, 1 + states)
        Product of the derivatives of the cycles.
    """
    size = slopes[0].shape[1]
    together = slopes[0][:size]
    for each in slopes[1:]:
        together = each[:size] @ together
    return together


_unit = lru_cache(np.eye)


class ReturnMap:
    """Map of spring stress and states from one rise of V through V_0 to the next.

    Parameters
    ----------
    scene : Scene
        A scene with a moving load point.
    accuracy : Accuracy
    meter : Meter
        Counter of the work of the motions.
    recorded : bool
        If True, record the motions along an orbit. Otherwise only the ends of the cycles are kept.
    counted : sequence of int, optional
        Indices of the states that count for the distance between two sections. By default, all
        states count except those that a part lists in ``excluded_from_distance``.
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
        """Return the point of the slider at a section.

        The point lies on the slow manifold, or at V_0 if inertia is important there.

        Raises
        ------
        Halt
            If the spring stress is incompatible with friction of forward slip.
        """
        spring_stress, *psis = at.tolist()
        scene, states = self.scene, tuple(psis)
        x, friction, _shift = scene.functions.balance(spring_stress, states, scene.numbers)
        point = beginning(scene, spring_stress, states, x, friction)
        check_start(self.scene, point)
        return at_rate(self.scene, point, self.scene.log_load_rate) if self._acts(point) else point

    def _acts(self, point: Point) -> bool:
        """Return True if the effect of inertia exceeds that on the slow manifold."""
        if not self.scene.has_mass:
            return False
        inertial_stress = point.spring_stress - point.friction
        given = limits(self.scene, self.accuracy)
        return weight_of_mass(point.log_slip_rate, inertial_stress, given) >= 1.0

    def cycles(
        self, start: np.ndarray, count: int, recording: Recording | None = None
    ) -> list[Cycle]:
        """Follow a number of cycles from a section.

        Returns
        -------
        list of Cycle
            The list is shorter than ``count`` if the motion settles, stays close to unstable
            steady sliding, which is a fixed point of the map but not a cycle, or cannot continue.
        """
        seen = list[Cycle]()
        try:
            moving = cycles(self.scene, self.accuracy, self._meter, self.point(start), recording)
            for cycle in moving:
                if cycle is None or cycle.swing < SMALLEST_SWING:
                    break
                seen.append(cycle)
                if len(seen) == count:
                    break
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise
        return seen

    def image(self, start: np.ndarray) -> np.ndarray | None:
        """Return the section one cycle later, and the numbers of the cycle.

        Returns
        -------
        ndarray, shape (1 + states + numbers,), or None
            None if the motion does not complete a cycle.
        """
        seen = self.cycles(start, 1)
        return image_of(seen[0]) if seen else None

    def slopes(self, start: np.ndarray, count: int, scale: float) -> tuple[np.ndarray, ...]:
        """Compute the derivatives of successive cycles by finite differences.

        Parameters
        ----------
        start : ndarray
            Section at which the first cycle begins.
        count : int
            Number of cycles.
        scale : float
            Magnitude of the states, which determines the step of the differences.

        Returns
        -------
        tuple of ndarray
            The tuple is shorter than ``count`` if the motion does not complete all cycles.
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
        """Return the direction of the motion at a section, and its effect.

        A displacement of the start along the motion changes only the time of the cycle, if the
        effect of inertia is small.

        Returns
        -------
        way : tuple of float
            Rates of change of the section.
        passed : tuple of float
            Corresponding change of the section and of the numbers of the cycle.
        """
        scene, states = self.scene, len(point.psis)
        spring_stress = point.friction + scene.dynamics.radiated(scene.log_load_rate)
        rates = without_mass(scene, clock=True).rates((spring_stress, *point.psis, 0.0))
        rest = (0.0,) * (NUMBERS - 1)
        return (0.0, *rates[1:-1]), (*(0.0,) * (1 + states), -rates[-1], *rest)

    def _slopes(self, start: np.ndarray, step: float) -> np.ndarray | None:
        """Compute the derivatives of one cycle by differences of order four.

        The derivative along the motion follows from the rates of the motion.
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
        """Find a periodic orbit close to a section.

        Parameters
        ----------
        start : ndarray
            Section at which the search starts.
        count : int
            Number of cycles of the orbit. The orbit that is found may repeat after a divisor of
            this number.
        swing : float
            Range of ln V.
        reach : float
            Largest distance of the orbit from ``start``, relative to ``a`` times the range of ln V.

        Returns
        -------
        Orbit or None
            None if no orbit is found.
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
        """Compute a known orbit at the accuracy of this map.

        Returns
        -------
        Orbit or None
            None if the orbit does not close.
        """
        if known.accuracy == self.accuracy:
            return known
        return self._solve(known.begin, known.slopes, self.scene.a * known.cycles[0].swing, _NEAR)

    def _solve(
        self, start: np.ndarray, slopes: Sequence[np.ndarray], scale: float, reach: float
    ) -> Orbit | None:
        """Solve for an orbit with as many cycles as there are derivatives.

        The equation ``J move = -(P(s) - s)`` is solved by Newton's method with Broyden's updates.
        If ``off`` is the value of P(s) - s after a move, J changes by ``off move^T/(move . move)``.

        Returns
        -------
        Orbit or None
            None if there is no orbit within ``reach`` of the section.
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
        """Return the largest component of a change of a section.

        The unknowns of a fluid may have large values. If such a value exceeds the scale of the
        states, the change is divided by the ratio of the value to the scale.
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
