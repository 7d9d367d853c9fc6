"""Critical paths, which are motions that just reach the instability norm.

The main class is ``CriticalPath``. At the end of a critical path, ln V equals the instability norm
and the time derivative of ln V is zero. These two conditions determine the stress at the end of the
path, which is computed from a scalar equation. The path is integrated backwards in time from its
end, which is called the tangency point. When neighbouring paths are integrated backwards in time,
they converge. A few short integrations with a moderate tolerance therefore give results that are
accurate to many digits. An integration forwards in time would amplify every error. Gu et al. [1]_
derive the critical path under the slip law.

A critical path has two unknowns, the spring stress and one state. These two unknowns are sufficient
if the effect of inertia is small at the instability norm. Inertia has no effect at an instant at
which ln V is stationary.

Stresses are deviations from steady sliding at V_* and are divided by sigma_*, slip is divided by
D_c, and slip rate is divided by V_*.

References
----------
.. [1] Gu, J.-C., Rice, J. R., Ruina, A. L., & Tse, S. T. (1984). Slip motion and stability of a
   single degree of freedom elastic system with rate and state dependent friction. J. Mech. Phys.
   Solids, 32, 167-196.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

from rsfstudy.motion import (
    Engine,
    Event,
    EventKind,
    EventSpecification,
    Integrator,
    MotionDriver,
    MotionStopped,
    build_root_finder,
    fall,
    maximum,
    rise,
)
from rsfstudy.parts import LOAD_VELOCITY, LOG_LOAD_VELOCITY, STIFFNESS, A, B
from rsfstudy.slider import FloatTuple, FrictionFunctions, MotionPoint, NumericFunction, Scene
from rsfstudy.status import Status

#: Maximum number of right-hand-side evaluations in the search for the start of a critical path. The
#: maximum is valid for a tolerance of 1e-5.
_MAX_EVALUATIONS_OF_PATH_START_SEARCH = 1_500
#: Value of ln(V/V_*) below which the integration of a critical path is abandoned. The slip rate is
#: about 1e-100 V_*.
_MIN_LOG_SLIP_RATE_OF_CRITICAL_PATH = -230.0
#: Minimum excess of ln V over the instability norm. A path with a larger excess is considered to
#: touch the norm from above.
_MIN_LOG_RATE_EXCESS_OVER_NORM = 1e-6


class CriticalPath(NamedTuple):
    """Critical path, which just reaches the instability norm, of a scene with one state.

    Parameters
    ----------
    log_slip_rate_at_instability_norm : float
        Value of ln(V/V_*) at the instability norm.
    frictional_stress_lower_bound : float
        Frictional stress at which the normal stress vanishes, in units of sigma_*.
    radiated_stress_at_instability_norm : float
        Stress that seismic waves radiate at the instability norm, in units of sigma_*.
    spring_stress_and_states_after_step : tuple of float
        Spring stress and states immediately after the step.
    scene_parameter_values : tuple of float
        Parameters of the scene.
    tangency_point_solver : callable
        Function ``(x, weakest, p) -> (g, Psi)``. See ``_build_tangency_point_solver``.
    motion_point_evaluator : callable
        Function ``(state, p) -> MotionPoint``.
    motion_driver : MotionDriver
        Driver that integrates the path.
    integrator : Integrator
        Integrator of the path.
    has_single_state_variable : bool
        True if the scene has one state. Scenes with several states have no critical path.
    """

    log_slip_rate_at_instability_norm: float
    frictional_stress_lower_bound: float
    radiated_stress_at_instability_norm: float
    spring_stress_and_states_after_step: FloatTuple
    scene_parameter_values: FloatTuple
    tangency_point_solver: NumericFunction
    motion_point_evaluator: NumericFunction
    motion_driver: MotionDriver
    integrator: Integrator
    has_single_state_variable: bool

    @classmethod
    def from_scene(cls, scene: Scene, integrator: Integrator) -> CriticalPath:
        """Create the critical path of a scene.

        Parameters
        ----------
        scene : Scene
            Scene with the step.
        integrator : Integrator
            Integrator of the path.

        Returns
        -------
        CriticalPath
            Path with the load point velocity of the scene.
        """
        slow, x = (
            scene.equations_between_ruptures(with_time=False),
            scene.log_slip_rate_at_instability,
        )
        weakest = scene.parts.normal_stress.compute_frictional_stress_lower_bound(scene)
        begin = (scene.spring_stress_step, *(0.0,) * scene.state_count)
        tangency, planar = (
            _build_tangency_point_solver(scene.friction_law_functions),
            scene.state_count == 1,
        )
        return cls(
            x,
            weakest,
            scene.dynamics.radiated_stress(x),
            begin,
            slow.parameters,
            compile_if_engine_is_compiled(tangency, integrator.engine, x, x, slow.parameters)
            if planar
            else tangency,
            build_motion_point_evaluator(slow.rate_function, slow.motion_point_function),
            MotionDriver(slow, engine=integrator.engine, methods=integrator.accuracy.methods),
            integrator,
            planar,
        )

    def with_load_velocity(self, load_velocity: float) -> CriticalPath:
        """Return the critical path for another load point velocity.

        Parameters
        ----------
        load_velocity : float
            Load point velocity after the step, in units of V_*.

        Returns
        -------
        CriticalPath
            Critical path with the same instability norm and the same friction.
        """
        p = list(self.scene_parameter_values)
        p[LOAD_VELOCITY] = load_velocity
        p[LOG_LOAD_VELOCITY] = math.log(abs(load_velocity)) if load_velocity else -math.inf
        return self._replace(scene_parameter_values=tuple(p))

    @property
    def tangency_point_at_instability_norm(self) -> tuple[float, float] | None:
        """Spring stress f and state Psi at the tangency point.

        At the tangency point, ln V equals the instability norm, and the time derivative of ln V is
        zero. The spring stress is the sum of frictional stress and radiated stress. The result is
        None if the scene has no tangency point, or if the scene has several states.
        """
        if not self.has_single_state_variable:
            return None
        g, psi = self.tangency_point_solver(
            self.log_slip_rate_at_instability_norm,
            (1.0 - 1e-6) * self.frictional_stress_lower_bound,
            self.scene_parameter_values,
        )
        return None if math.isnan(g) else (g + self.radiated_stress_at_instability_norm, psi)

    def find_path_start_by_backward_integration(
        self,
        local_tolerance: float,
        crossing_quantity_and_level: tuple[str, float],
        is_start_of_step: Callable[[MotionPoint], bool],
    ) -> MotionPoint | None:
        """Integrate the path backwards to the start of a step.

        Parameters
        ----------
        local_tolerance : float
            Local error tolerance of the integration.
        crossing_quantity_and_level : tuple of str and float
            Name and level of a quantity. The path starts at a point at which the quantity crosses
            this level.
        is_start_of_step : callable
            Function that returns True if a point at the crossing is the start of the requested
            step.

        Returns
        -------
        MotionPoint or None
            Start of the path. The result is None if the path touches the instability norm from
            above, or if no start is found.
        """
        specs = (
            *_build_events_ending_path_start_search(self.log_slip_rate_at_instability_norm),
            rise(*crossing_quantity_and_level),
            fall(*crossing_quantity_and_level),
        )
        for event in self._iterate_events_along_path(local_tolerance, specs, backward=True):
            if event.specification in specs[2:] and is_start_of_step(event.point):
                return event.point
        return None

    def _iterate_events_along_path(
        self,
        local_tolerance: float,
        event_specs: Sequence[EventSpecification],
        *,
        backward: bool,
    ) -> Iterator[Event]:
        """Yield the events of the path, starting at the tangency point.

        The integration ends early if the path cannot continue, or if the path exceeds its budget of
        right-hand-side evaluations. For smaller tolerances, the budget increases in proportion to
        the number of steps that an eighth-order integrator requires.
        """
        start = self.tangency_point_at_instability_norm
        if start is None:
            return
        enough = round(
            _MAX_EVALUATIONS_OF_PATH_START_SEARCH * math.pow(1e-5 / local_tolerance, 0.125)
        )
        try:
            yield from self.motion_driver.iterate_events(
                start,
                self.integrator.work_meter,
                event_specs,
                local_tolerance,
                backward=backward,
                parameters=self.scene_parameter_values,
                evaluation_budget=enough,
            )
        except MotionStopped as halt:
            if halt.status is Status.WORK_BUDGET_SPENT:
                raise

    def compute_state_misfit_at_path_start(self, local_tolerance: float) -> float | None:
        """Compute the misfit of the state at the start of the path.

        The misfit is the value of Psi/a at the point at which the slip rate of the path equals the
        initial slip rate of the motion. The misfit is zero for the critical step, because Psi is
        zero immediately after a step from steady sliding at V_*.

        Parameters
        ----------
        local_tolerance : float
            Local error tolerance of the integration.

        Returns
        -------
        float or None
            Misfit, or None if the path does not pass the initial slip rate in the same direction as
            the motion.
        """
        given = self.spring_stress_and_states_after_step, self.scene_parameter_values
        begin = compile_if_engine_is_compiled(
            self.motion_point_evaluator, self.integrator.engine, *given
        )(*given)
        if begin.log_slip_rate_derivative == 0.0:
            return None
        start = self.find_path_start_by_backward_integration(
            local_tolerance,
            ("log_slip_rate", begin.log_slip_rate),
            lambda point: point.log_slip_rate_derivative * begin.log_slip_rate_derivative > 0.0,
        )
        return None if start is None else start.psi / self.scene_parameter_values[A]

    def compute_next_peak_height_above_norm(self, local_tolerance: float) -> float | None:
        """Compute by how much the next peak of ln V exceeds the instability norm.

        The motion starts at the tangency point and is integrated forwards for one orbit. The
        returned misfit is zero if the orbit is a limit cycle that touches the instability norm.

        Parameters
        ----------
        local_tolerance : float
            Local error tolerance of the integration.

        Returns
        -------
        float or None
            Misfit, or None if ln V has no further peak.
        """
        for event in self._iterate_events_after_fall_below_load_rate(local_tolerance):
            if event.kind is EventKind.MAXIMUM:
                return event.point.log_slip_rate - self.log_slip_rate_at_instability_norm
        return None

    def next_peak_exceeds_instability_norm(self, local_tolerance: float) -> bool:
        """Return True if the next peak of ln V exceeds the instability norm.

        In this case, motions after smaller steps may reach the instability norm at a second peak.

        Parameters
        ----------
        local_tolerance : float
            Local error tolerance of the integration.

        Returns
        -------
        bool
            True if ln V rises above the instability norm after the motion has passed the tangency
            point.
        """
        beyond = rise(
            "log_slip_rate",
            self.log_slip_rate_at_instability_norm + _MIN_LOG_RATE_EXCESS_OVER_NORM,
        )
        for event in self._iterate_events_after_fall_below_load_rate(local_tolerance, beyond):
            if event.kind in (EventKind.RISE, EventKind.MAXIMUM):
                # A time step may contain the rise above the norm and the following peak.
                return (
                    event.kind is EventKind.RISE
                    or event.point.log_slip_rate > self.log_slip_rate_at_instability_norm
                )
        return False

    def _iterate_events_after_fall_below_load_rate(
        self, local_tolerance: float, *event_specs: EventSpecification
    ) -> Iterator[Event]:
        """Yield the events of the forward motion after V has fallen below V_0.

        The motion starts at the tangency point, and the events include the peaks of ln V.
        """
        fallen = False
        asked = (
            *event_specs,
            maximum("log_slip_rate"),
            fall(
                "log_slip_rate",
                self.scene_parameter_values[LOG_LOAD_VELOCITY],
                may_report_later=True,
            ),
        )
        for event in self._iterate_events_along_path(local_tolerance, asked, backward=False):
            if fallen:
                yield event
            fallen = fallen or event.kind is EventKind.FALL


@lru_cache(maxsize=256)
def _build_events_ending_path_start_search(
    log_slip_rate_at_norm: float,
) -> tuple[EventSpecification, ...]:
    """Return the events at which the search for the start of a path fails."""
    above_norm = log_slip_rate_at_norm + _MIN_LOG_RATE_EXCESS_OVER_NORM
    return (
        rise("log_slip_rate", above_norm, terminal=True, may_report_later=True),
        fall(
            "log_slip_rate",
            _MIN_LOG_SLIP_RATE_OF_CRITICAL_PATH,
            terminal=True,
            may_report_later=True,
        ),
    )


@cache
def _build_tangency_point_solver(friction_functions: FrictionFunctions) -> NumericFunction:
    r"""Build the function that solves for the tangency point.

    The function ``(x, weakest, p) -> (g, Psi)`` returns the frictional stress g and the state Psi
    at which the time derivative of ln V is zero. The argument ``x`` is ln(V/V_*). The results are
    NaN if ln V is never stationary at this slip rate. The argument ``weakest`` is a lower bound on
    the frictional stress ``g``.

    Notes
    -----
    With :math:`x = \ln(V/V_*)` and the frictional stress :math:`g`, friction satisfies
    :math:`\mathrm{strength}(g) = a x + \Psi`. The derivative with respect to slip at constant
    :math:`x` is

    .. math:: \mathrm{strength}'(g)\,K\,(V_0/V - 1) = d\Psi/d\delta

    with :math:`K = k D_c/\sigma_*`. This equation for :math:`g` is solved by Brent's method.
    """
    strength, evolutions = friction_functions.strength, friction_functions.state_evolutions

    def acceleration(g: float, at: tuple[float, FloatTuple]) -> float:
        x, p = at
        value, slope, shift, _shift_slope = strength(g, (0.0,), p)
        pull = p[STIFFNESS] * math.expm1(p[LOG_LOAD_VELOCITY] - x)
        (change,) = evolutions(x, (value - shift - p[A] * x,), 0.0, 1.0, p)
        return float(slope * pull - change)

    root = build_root_finder(acceleration)

    def tangency(x: float, weakest: float, p: FloatTuple) -> tuple[float, float]:
        at = x, p
        highest = 2.0 * p[B] * abs(x) + p[STIFFNESS] * max(1.0, strength(0.0, (0.0,), p)[1])
        lowest = max(-highest, weakest)
        if acceleration(lowest, at) >= 0.0 and math.isfinite(weakest):
            # If normal stress changes almost as much as shear stress, the root is below the usual
            # bracket.
            lowest = weakest
        at_lowest, at_highest = acceleration(lowest, at), acceleration(highest, at)
        if not at_lowest < 0.0 < at_highest:
            return math.nan, math.nan
        g = root(lowest, highest, at_lowest, at_highest, 1e-18, 1e-14, at)
        return g, strength(g, (0.0,), p)[0] - p[A] * x

    return tangency


@cache
def build_motion_point_evaluator(
    rate_function: NumericFunction, motion_point_function: NumericFunction
) -> NumericFunction:
    """Build a function ``(state, p) -> MotionPoint`` that evaluates a point.

    Parameters
    ----------
    rate_function : callable
        Function ``(state, p) -> rates`` that evaluates the derivatives of the unknowns.
    motion_point_function : callable
        Function ``(state, rates, p) -> MotionPoint``.

    Returns
    -------
    callable
        Function ``(state, p) -> MotionPoint``.
    """

    def at(state: FloatTuple, p: FloatTuple) -> MotionPoint:
        now: MotionPoint = motion_point_function(state, rate_function(state, p), p)
        return now

    return at


def compile_if_engine_is_compiled(
    function: Callable[..., Any], engine: str, *arguments: float | FloatTuple
) -> Any:
    """Compile a function if the engine is the compiled engine.

    Parameters
    ----------
    function : callable
        Function whose arguments are floats or tuples of floats.
    engine : str
        Name of the engine.
    *arguments : float or tuple of float
        Example arguments, whose types are the argument types of the compiled function.

    Returns
    -------
    callable
        The compiled function, or ``function`` itself if the engine is not the compiled engine.
    """
    return (
        Engine.import_compiled_engine().compile_function_of_floats(function, *arguments)
        if engine == Engine.COMPILED
        else function
    )
