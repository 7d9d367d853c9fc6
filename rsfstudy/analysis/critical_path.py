"""The critical path, followed back from where it touches the instability norm.

At the touching point ln V is at the norm and stationary, which leaves one scalar equation for the
stress. From there the path is integrated against time. Its neighbours converge on it in that
direction, so a few short integrations of moderate tolerance give many digits, where following
motions forward would amplify every error.

Two unknowns suffice as long as the norm is a slip rate at which mass hardly acts; it does not act
at all where ln V is stationary.

Stresses are in sigma_*, above those of steady sliding at V_*; slip is in D_c, slip rate in V_*.

References
----------
Gu, Rice, Ruina and Tse (1984), J. Mech. Phys. Solids 32, 167-196: the path by the slip law.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

from rsfstudy.motion.engines import SCIPY, of_floats
from rsfstudy.motion.events import Event, EventSpecification, Kind, fall, maximum, rise
from rsfstudy.motion.meter import Halt, Meter
from rsfstudy.motion.roots import root_of
from rsfstudy.motion.running import Runner
from rsfstudy.motion.starting import point_of
from rsfstudy.slider.equations import between_ruptures
from rsfstudy.slider.friction import Friction
from rsfstudy.slider.parts import Function, Numbers
from rsfstudy.slider.places import LOAD_VELOCITY, LOG_LOAD_RATE, STIFFNESS, A, B
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Right-hand sides, at a tolerance of 1e-5, after which a path that has not come back to a start is
#: given up.
_PATH_BUDGET = 1_500
_SLOWEST = -230.0  # ln(V/V_*): 10^-100
#: How far above the norm in ln V a path is that touches it from there.
_ABOVE = 1e-6


class CriticalPath(NamedTuple):
    """Path that touches the instability norm, after the step of a scene with one state.

    Attributes
    ----------
    log_norm_rate : float
        ln(V/V_*) of the norm.
    weakest, radiated : float
        Frictional stress at which normal stress vanishes, and stress that waves carry away at the
        norm, over sigma_*.
    begin : tuple of float
        Spring stress and state just after the step.
    p : tuple of float
        Numbers of the scene.
    tangency_of, point_of : callable
        ``(x, weakest, p) -> (g, Psi)`` (see `_tangency`); ``(state, p) -> Point``.
    runner : Runner
    engine : str
        What follows it.
    planar : bool
        Whether there is one state, as there must be for a path that touches the norm.
    """

    log_norm_rate: float
    weakest: float
    radiated: float
    begin: Numbers
    p: Numbers
    tangency_of: Function
    point_of: Function
    runner: Runner
    engine: str
    planar: bool

    @classmethod
    def of(cls, scene: Scene, engine: str = SCIPY) -> CriticalPath:
        """The critical path of a scene, followed by an engine."""
        slow, x = between_ruptures(scene, clock=False), scene.log_norm_rate
        weakest = scene.parts.normal_stress.weakest(scene)
        begin = (scene.spring_stress_step, *(0.0,) * scene.states)
        tangency, planar = _tangency(scene.functions.friction), scene.states == 1
        return cls(
            x,
            weakest,
            scene.dynamics.radiated(x),
            begin,
            slow.p,
            of_floats(tangency, engine, x, x, slow.p) if planar else tangency,
            point_of(slow.rate, slow.point),
            Runner(slow, engine=engine),
            engine,
            planar,
        )

    def under(self, load_velocity: float) -> CriticalPath:
        """The critical path where the step is to another load point velocity, over V_*."""
        p = list(self.p)
        p[LOAD_VELOCITY] = load_velocity
        p[LOG_LOAD_RATE] = math.log(abs(load_velocity)) if load_velocity else -math.inf
        return self._replace(p=tuple(p))

    @property
    def tangency(self) -> tuple[float, float] | None:
        """Spring stress over sigma_*, and state, (f, Psi), at which ln V rests at the norm; None
        where it never can, or where there are several states and the path is none in a plane.

        f is frictional stress there, and what waves carry away.
        """
        if not self.planar:
            return None
        g, psi = self.tangency_of(self.log_norm_rate, (1.0 - 1e-6) * self.weakest, self.p)
        return None if math.isnan(g) else (g + self.radiated, psi)

    def start(
        self,
        tolerance: float,
        meter: Meter,
        crossing: tuple[str, float],
        accepts: Callable[[Point], bool],
    ) -> Point | None:
        """Follow the path back to a start.

        Parameters
        ----------
        tolerance : float
            Local error per step.
        meter : Meter
            Charged with the work.
        crossing : tuple of str and float
            Quantity and level that a start is at.
        accepts : callable
            Whether a point there is a start of the kind sought.

        Returns
        -------
        Point or None
            None where the path touches the norm from above or never comes by.
        """
        above = rise("log_slip_rate", self.log_norm_rate + _ABOVE, ends=True, waits=True)
        lost = fall("log_slip_rate", _SLOWEST, ends=True, waits=True)
        specs = (above, lost, rise(*crossing), fall(*crossing))
        for event in self._events(tolerance, meter, specs, backward=True):
            if event.watch in specs[2:] and accepts(event.point):
                return event.point
        return None

    def _events(
        self,
        tolerance: float,
        meter: Meter,
        specs: Sequence[EventSpecification],
        *,
        backward: bool,
    ) -> Iterator[Event]:
        """The path from where it touches the norm, as far as there is one; by a method of order
        eight, which gets no more than what is left.
        """
        start = self.tangency
        if start is None:
            return
        enough = round(_PATH_BUDGET * math.pow(1e-5 / tolerance, 0.125))
        try:
            yield from self.runner.run(
                start, meter, specs, tolerance, backward=backward, p=self.p, budget=enough
            )
        except Halt as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise

    def misfit(self, tolerance: float, meter: Meter) -> float | None:
        """Psi/a on the path where it passes the slip rate of the start: zero after the critical
        step, because a step that starts from steady sliding at V_* leaves Psi = 0.

        None where the path never passes that slip rate as the motion of this scene would.
        """
        given = self.begin, self.p
        begin = of_floats(self.point_of, self.engine, *given)(*given)
        if begin.growth == 0.0:
            return None
        start = self.start(
            tolerance,
            meter,
            ("log_slip_rate", begin.log_slip_rate),
            lambda point: point.growth * begin.growth > 0.0,
        )
        return None if start is None else start.psi / self.p[A]

    def misfit_of_cycle(self, tolerance: float, meter: Meter) -> float | None:
        """Height in ln V, above the norm, of the peak of the motion one orbit after it has touched
        the norm; zero where a limit cycle touches it.

        None where the motion does not come back.
        """
        for event in self._coming_back(tolerance, meter):
            if event.kind is Kind.MAXIMUM:
                return event.point.log_slip_rate - self.log_norm_rate
        return None

    def goes_beyond(self, tolerance: float, meter: Meter) -> bool:
        """True if the motion that touches the norm goes beyond it when it comes back, so that
        others may reach it by their second peak.
        """
        beyond = rise("log_slip_rate", self.log_norm_rate + _ABOVE)
        for event in self._coming_back(tolerance, meter, beyond):
            if event.kind in (Kind.RISE, Kind.MAXIMUM):
                # a step may pass the norm and come back
                return event.kind is Kind.RISE or event.point.log_slip_rate > self.log_norm_rate
        return False

    def _coming_back(
        self, tolerance: float, meter: Meter, *specs: EventSpecification
    ) -> Iterator[Event]:
        """Events, peaks among them, of the motion that has touched the norm and fallen below
        V_0.
        """
        fallen = False
        asked = (
            *specs,
            maximum("log_slip_rate"),
            fall("log_slip_rate", self.p[LOG_LOAD_RATE], waits=True),
        )
        for event in self._events(tolerance, meter, asked, backward=False):
            if fallen:
                yield event
            fallen = fallen or event.kind is Kind.FALL


@cache
def _tangency(friction: Friction) -> Function:
    """``(x, weakest, p) -> (g, Psi)``: frictional stress above the weakest, and the state, where
    ln(V/V_*) = x is stationary; NaN where it never is.

    From strength(g) = a x + Psi, whose derivative with respect to slip is taken at constant x,

        strength'(g) K (V_0/V - 1) = dPsi/d(delta),

    K being k D_c/sigma_*: one equation for g, which is solved by Brent's method.
    """
    strength, evolutions = friction.strength, friction.evolutions

    def acceleration(g: float, at: tuple[float, Numbers]) -> float:
        x, p = at
        value, slope, shift, _shift_slope = strength(g, (0.0,), p)
        pull = p[STIFFNESS] * math.expm1(p[LOG_LOAD_RATE] - x)
        (change,) = evolutions(x, (value - shift - p[A] * x,), 0.0, 1.0, p)
        return float(slope * pull - change)

    root = root_of(acceleration)

    def tangency(x: float, weakest: float, p: Numbers) -> tuple[float, float]:
        at = x, p
        highest = 2.0 * p[B] * abs(x) + p[STIFFNESS] * max(1.0, strength(0.0, (0.0,), p)[1])
        lowest = max(-highest, weakest)
        if acceleration(lowest, at) >= 0.0 and math.isfinite(weakest):
            # where normal stress all but follows shear stress, the law asks for more than its own
            # fall
            lowest = weakest
        at_lowest, at_highest = acceleration(lowest, at), acceleration(highest, at)
        if not at_lowest < 0.0 < at_highest:
            return math.nan, math.nan
        g = root(lowest, highest, at_lowest, at_highest, 1e-18, 1e-14, at)
        return g, strength(g, (0.0,), p)[0] - p[A] * x

    return tangency
