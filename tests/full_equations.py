"""Cycles of a slider with mass by its full equations throughout, implicitly: no slow manifold, no
leap. Constant normal stress; slip and slowness law, of one and of two states, and a dilatant fault.

Unknowns are spring stress f, q = (f - g)/a with g the frictional stress, and the states: ln V
follows, and what accelerates the mass is no difference of large numbers. The clock is slip plus
load point displacement. Steps are collocation at Radau's points, of order 13; their size is such
that the highest term of the polynomial is below the tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.polynomial import legendre

from rsfstudy import Scene

_STAGES = 7
#: Most of the highest term of a step, relative to unknowns of the size of a.
_TOLERANCE = 1e-13
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


def _collocation(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Runge-Kutta matrix of Radau IIA, and what gives the last Legendre coefficient."""
    top = np.zeros(count + 1)
    top[-2:] = (-1.0, 1.0)
    nodes = np.sort(legendre.legroots(top).real)
    to_coefficients = np.linalg.inv(legendre.legvander(nodes, count - 1))
    integrals = [legendre.legint(unit, lbnd=-1) for unit in np.eye(count)]
    values = np.array([legendre.legval(nodes, each) for each in integrals]).T
    return 0.5 * values @ to_coefficients, to_coefficients[-1]


_MATRIX, _LAST = _collocation(_STAGES)


class FullEquations:
    """The motion of a scene.

    Parameters
    ----------
    scene : Scene
        With mass, under constant normal stress.
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.has_mass
        assert scene.normal_stress == "constant"
        self.scene, self.load = scene, scene.log_load_rate
        law = scene.parts.law
        two = law.name.startswith("two")
        self.b = scene.a * np.array([law.b1_over_a, law.b2_over_a] if two else [scene.b_over_a])
        self.lengths = np.array([1.0, law.length_ratio] if two else [1.0])
        self.slowness = "slowness" in law.name
        self.dilatant = scene.parts.fluid.name == "dilatant"

    def log_slip_rate(self, y: np.ndarray) -> np.ndarray:
        """ln(V/V_*)."""
        excess = y[..., 0] - self.scene.a * y[..., 1]
        if self.dilatant:
            excess = (self.scene.mu_star + excess) / (1.0 - y[..., -2]) - self.scene.mu_star
        return (excess - self._law(y).sum(-1)) / self.scene.a

    def _law(self, y: np.ndarray) -> np.ndarray:
        return y[..., 2 : 2 + len(self.b)]

    def rates(self, y: np.ndarray) -> np.ndarray:
        """Derivatives against slip plus load point displacement, of any number of points."""
        scene, x, states = self.scene, self.log_slip_rate(y), self._law(y)
        v, load = np.exp(x), scene.load_velocity
        time = 1.0 / (v + load)
        loading = scene.stiffness * (load - v) * time
        faster = scene.a * y[..., 1] / (scene.stiffness * scene.inertial_time**2 * v) * time
        off = states + self.b * x[..., None]
        if self.slowness:
            off = -self.b * np.expm1(-off / self.b)
        evolving = -off * (v * time)[..., None] / self.lengths
        stronger = scene.a * faster + evolving.sum(-1)
        changes = [loading, *np.moveaxis(evolving, -1, 0)]
        if self.dilatant:
            fluid = scene.parts.fluid
            porosity, pressure = y[..., -3], y[..., -2]
            opening = v * time * (fluid.dilatancy * x - porosity)
            draining = -fluid.drainage * time * pressure - opening
            friction = scene.mu_star + y[..., 0] - scene.a * y[..., 1]
            stronger = (1.0 - pressure) * stronger - draining * friction / (1.0 - pressure)
            changes += [opening, draining]
        changes.insert(1, (loading - stronger) / scene.a)
        return np.stack([*changes, time], axis=-1)

    def _jacobian(self, y: np.ndarray) -> np.ndarray:
        shifted = y + 1e-30j * np.eye(len(y))
        return self.rates(shifted).imag.T * 1e30

    def step(self, y: np.ndarray, size: float) -> tuple[np.ndarray, float]:
        """One step, and its highest term over the scales of the unknowns; infinitely much where
        the equations of the step are not solved.
        """
        count = len(y)
        matrix = np.eye(_STAGES * count) - size * np.kron(_MATRIX, self._jacobian(y))
        inverse, moved, last = np.linalg.inv(matrix), np.zeros((_STAGES, count)), math.inf
        scales = self._scales(y)
        with np.errstate(all="ignore"):
            for _ in range(30):
                rates = self.rates(y + moved)
                left = size * _MATRIX @ rates - moved
                change = (inverse @ left.ravel()).reshape(moved.shape)
                moved = moved + change
                off = float(np.abs(change / scales).max())
                if not off < 1e6:
                    return y, math.inf
                if off < 1e-12 or (off < 1e-10 and off > 0.3 * last):
                    break
                last = off
            else:
                return y, math.inf
            highest = np.abs(size * _LAST @ self.rates(y + moved) / scales)
        return y + moved[-1], float(highest.max())

    def _scales(self, y: np.ndarray) -> np.ndarray:
        scales = np.full(len(y), self.scene.a)
        scales[1], scales[-1] = 1.0, max(1.0 / self.scene.load_velocity, abs(y[-1]))
        return scales

    def section(self, spring_stress: float, psis: tuple[float, ...]) -> np.ndarray:
        """Where V is V_0: unknowns, with time zero behind them."""
        y = np.array([spring_stress, 0.0, *psis, 0.0])
        y[1] = (self.log_slip_rate(y) - self.load) * (1.0 - (psis[-1] if self.dilatant else 0.0))
        return y

    def event(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The next section with V rising, and the headline numbers of the event up to there."""
        y, size, fallen = start.copy(), 1e-3, False
        y[-1] = 0.0
        slowest = fastest = y
        lowest, last = start[0], (y, 0.0)

        def above(y: np.ndarray) -> float:
            return float(self.log_slip_rate(y)) - self.load

        while True:
            after, term = self.step(y, size)
            if term > _TOLERANCE:
                size *= max(0.2, 0.8 * (_TOLERANCE / term) ** (1.0 / _STAGES))
                continue
            if y[1] > 0.0 >= after[1]:
                peak = self._locate(y, size, lambda at: float(at[1]))
                fastest = max(fastest, peak, key=self.log_slip_rate)
            if self.log_slip_rate(y) <= min(self.log_slip_rate(last[0]), self.log_slip_rate(after)):
                troughs = self._trough(*last), self._trough(y, size)
                slowest = min(slowest, *troughs, key=self.log_slip_rate)
            if (above(y) > 0.0) is not (above(after) > 0.0) and not np.array_equal(y, start):
                crossing = self._locate(y, size, above)
                lowest = min(lowest, float(crossing[0]))
                if fallen and above(after) > 0.0:
                    numbers = [crossing[-1], start[0] - lowest, start[0] - fastest[0]]
                    rates = self.log_slip_rate(np.array([slowest, fastest])) / math.log(10.0)
                    return crossing, np.array([*numbers, *rates])
            fallen, last, y = fallen or above(after) < 0.0, (y, size), after
            size *= min(3.0, 0.8 * (_TOLERANCE / max(term, 1e-30)) ** (1.0 / _STAGES))

    def _trough(self, y: np.ndarray, size: float) -> np.ndarray:
        """Where within a step ln V is lowest, by golden section: q is too small there to tell."""
        low, high = 0.0, size
        for _ in range(45):
            places = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            first, second = (self.log_slip_rate(self.step(y, place)[0]) for place in places)
            low, high = (low, places[1]) if first < second else (places[0], high)
        return self.step(y, low)[0]

    def _locate(
        self, y: np.ndarray, size: float, what: Callable[[np.ndarray], float]
    ) -> np.ndarray:
        """Where within a step something vanishes, by false position on its size."""
        low, high, at_low = 0.0, size, what(y)
        at_high, side = what(self.step(y, size)[0]), 0
        for _ in range(100):
            middle = (low * at_high - high * at_low) / (at_high - at_low)
            found = self.step(y, middle)[0]
            value = what(found)
            if abs(value) < 1e-15 or high - low < 1e-14 * size:
                break
            if value * at_low > 0.0:
                low, at_low, at_high = middle, value, at_high / (2.0 if side == 1 else 1.0)
                side = 1
            else:
                high, at_high, at_low = middle, value, at_low / (2.0 if side == -1 else 1.0)
                side = -1
        return found

    def cycle(
        self, near: np.ndarray, slopes: np.ndarray, close: float = 1e-11
    ) -> tuple[np.ndarray, float]:
        """Headline numbers of the limit cycle near a section, and by how much it closes in each
        unknown, over a. By Newton's method with derivatives that need not be right.
        """
        at, jacobian, move = near, slopes - np.eye(len(near)), None
        for _ in range(25):
            after, numbers = self.event(self.section(at[0], tuple(at[1:])))
            off = np.delete(after[:-1], 1) - at
            if move is not None:
                jacobian = jacobian + np.outer(off, move) / (move @ move)
            if np.abs(off).max() < close * self.scene.a:
                break
            move = -np.linalg.solve(jacobian, off)
            at = at + move
        return numbers, float(np.abs(off).max() / self.scene.a)
