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
from typing import Any, NamedTuple

from rsfstudy.motion import (
    COMPILED,
    SCIPY,
    Event,
    EventKind,
    EventSpecification,
    MotionDriver,
    MotionStopped,
    WorkMeter,
    build_root_finder,
    compiled_engine,
    fall,
    maximum,
    rise,
)
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS, A, B
from rsfstudy.slider import (
    FrictionFunctions,
    Function,
    Numbers,
    Point,
    Scene,
    equations_between_ruptures,
)
from rsfstudy.status import Status

#: Right-hand sides, at a tolerance of 1e-5, after which a path that has not come back to a start is
#: given up.
_PATH_BUDGET = 1_500
_MIN_LOG_SLIP_RATE = -230.0  # ln(V/V_*): 10^-100
#: How far above the norm in ln V a path is that touches it from there.
_NORM_OFFSET = 1e-6


class CriticalPath(NamedTuple):
    """Path that touches the instability norm, after the step of a scene with one state.

    Attributes
    ----------
    log_norm_rate : float
        ln(V/V_*) of the norm.
    min_frictional_stress, radiated_stress : float
        Frictional stress at which normal stress vanishes, and stress that waves carry away at the
        norm, over sigma_*.
    initial_state : tuple of float
        Spring stress and state just after the step.
    parameters : tuple of float
        Numbers of the scene.
    solve_tangency, evaluate_point : callable
        ``(x, weakest, p) -> (g, Psi)`` (see `_build_tangency_solver`); ``(state, p) -> Point``.
    driver : MotionDriver
    engine : str
        What follows it.
    is_planar : bool
        Whether there is one state, as there must be for a path that touches the norm.
    """

    log_norm_rate: float
    min_frictional_stress: float
    radiated_stress: float
    initial_state: Numbers
    parameters: Numbers
    solve_tangency: Function
    evaluate_point: Function
    driver: MotionDriver
    engine: str
    is_planar: bool

    @classmethod
    def of_scene(cls, scene: Scene, engine: str = SCIPY) -> CriticalPath:
        """The critical path of a scene, followed by an engine."""
        slow, x = equations_between_ruptures(scene, clock=False), scene.log_instability_rate
        weakest = scene.parts.normal_stress.min_frictional_stress(scene)
        begin = (scene.spring_stress_step, *(0.0,) * scene.state_count)
        tangency, planar = _build_tangency_solver(scene.functions.friction), scene.state_count == 1
        return cls(
            x,
            weakest,
            scene.dynamics.radiated_stress(x),
            begin,
            slow.parameters,
            scalar_function(tangency, engine, x, x, slow.parameters) if planar else tangency,
            build_point_function(slow.rate_function, slow.point_function),
            MotionDriver(slow, engine=engine),
            engine,
            planar,
        )

    def with_load_velocity(self, load_velocity: float) -> CriticalPath:
        """The critical path where the step is to another load point velocity, over V_*."""
        p = list(self.parameters)
        p[LOAD_VELOCITY] = load_velocity
        p[LOG_LOAD_VELOCITY] = math.log(abs(load_velocity)) if load_velocity else -math.inf
        return self._replace(parameters=tuple(p))

    @property
    def tangency_point(self) -> tuple[float, float] | None:
        """Spring stress over sigma_*, and state, (f, Psi), at which ln V rests at the norm; None
        where it never can, or where there are several states and the path is none in a plane.

        f is frictional stress there, and what waves carry away.
        """
        if not self.is_planar:
            return None
        g, psi = self.solve_tangency(
            self.log_norm_rate, (1.0 - 1e-6) * self.min_frictional_stress, self.parameters
        )
        return None if math.isnan(g) else (g + self.radiated_stress, psi)

    def find_start(
        self,
        tolerance: float,
        meter: WorkMeter,
        crossing: tuple[str, float],
        is_start: Callable[[Point], bool],
    ) -> Point | None:
        """Follow the path back to a start.

        Parameters
        ----------
        tolerance : float
            Local error per step.
        meter : WorkMeter
            Charged with the work.
        crossing : tuple of str and float
            Quantity and level that a start is at.
        is_start : callable
            Whether a point there is a start of the kind sought.

        Returns
        -------
        Point or None
            None where the path touches the norm from above or never comes by.
        """
        above = rise(
            "log_slip_rate", self.log_norm_rate + _NORM_OFFSET, terminal=True, may_defer=True
        )
        lost = fall("log_slip_rate", _MIN_LOG_SLIP_RATE, terminal=True, may_defer=True)
        specs = (above, lost, rise(*crossing), fall(*crossing))
        for event in self._iterate_events(tolerance, meter, specs, backward=True):
            if event.specification in specs[2:] and is_start(event.point):
                return event.point
        return None

    def _iterate_events(
        self,
        tolerance: float,
        meter: WorkMeter,
        specs: Sequence[EventSpecification],
        *,
        backward: bool,
    ) -> Iterator[Event]:
        """The path from where it touches the norm, as far as there is one; by a method of order
        eight, which gets no more than what is left.
        """
        start = self.tangency_point
        if start is None:
            return
        enough = round(_PATH_BUDGET * math.pow(1e-5 / tolerance, 0.125))
        try:
            yield from self.driver.run(
                start, meter, specs, tolerance, backward=backward, p=self.parameters, budget=enough
            )
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise

    def start_misfit(self, tolerance: float, meter: WorkMeter) -> float | None:
        """Psi/a on the path where it passes the slip rate of the start: zero after the critical
        step, because a step that starts from steady sliding at V_* leaves Psi = 0.

        None where the path never passes that slip rate as the motion of this scene would.
        """
        given = self.initial_state, self.parameters
        begin = scalar_function(self.evaluate_point, self.engine, *given)(*given)
        if begin.log_slip_rate_derivative == 0.0:
            return None
        start = self.find_start(
            tolerance,
            meter,
            ("log_slip_rate", begin.log_slip_rate),
            lambda point: point.log_slip_rate_derivative * begin.log_slip_rate_derivative > 0.0,
        )
        return None if start is None else start.psi / self.parameters[A]

    def cycle_misfit(self, tolerance: float, meter: WorkMeter) -> float | None:
        """Height in ln V, above the norm, of the peak of the motion one orbit after it has touched
        the norm; zero where a limit cycle touches it.

        None where the motion does not come back.
        """
        for event in self._iterate_return_events(tolerance, meter):
            if event.kind is EventKind.MAXIMUM:
                return event.point.log_slip_rate - self.log_norm_rate
        return None

    def exceeds_norm_on_return(self, tolerance: float, meter: WorkMeter) -> bool:
        """True if the motion that touches the norm goes beyond it when it comes back, so that
        others may reach it by their second peak.
        """
        beyond = rise("log_slip_rate", self.log_norm_rate + _NORM_OFFSET)
        for event in self._iterate_return_events(tolerance, meter, beyond):
            if event.kind in (EventKind.RISE, EventKind.MAXIMUM):
                # a step may pass the norm and come back
                return (
                    event.kind is EventKind.RISE or event.point.log_slip_rate > self.log_norm_rate
                )
        return False

    def _iterate_return_events(
        self, tolerance: float, meter: WorkMeter, *specs: EventSpecification
    ) -> Iterator[Event]:
        """Events, peaks among them, of the motion that has touched the norm and fallen below
        V_0.
        """
        fallen = False
        asked = (
            *specs,
            maximum("log_slip_rate"),
            fall("log_slip_rate", self.parameters[LOG_LOAD_VELOCITY], may_defer=True),
        )
        for event in self._iterate_events(tolerance, meter, asked, backward=False):
            if fallen:
                yield event
            fallen = fallen or event.kind is EventKind.FALL


@cache
def _build_tangency_solver(friction: FrictionFunctions) -> Function:
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
        pull = p[STIFFNESS] * math.expm1(p[LOG_LOAD_VELOCITY] - x)
        (change,) = evolutions(x, (value - shift - p[A] * x,), 0.0, 1.0, p)
        return float(slope * pull - change)

    root = build_root_finder(acceleration)

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


@cache
def build_point_function(rate: Function, point: Function) -> Function:
    """``(state, p) -> Point``."""

    def at(state: Numbers, p: Numbers) -> Point:
        now: Point = point(state, rate(state, p), p)
        return now

    return at


def scalar_function(function: Callable[..., Any], name: str, *arguments: float | Numbers) -> Any:
    """A function of floats and of tuples of floats as an engine calls it: compiled, for arguments
    of this form, where its loop is.
    """
    return (
        compiled_engine().compile_scalar_function(function, *arguments)
        if name == COMPILED
        else function
    )
