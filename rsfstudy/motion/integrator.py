"""Integrator that computes the motions required by the measures.

An ``Integrator`` stores the requested accuracy and counts right-hand side evaluations. The method
``Integrator.follow`` integrates a scene through its loading segments and yields events. A chain is
a sequence of loading segments in which the stress does not jump from one segment to the next. The
event loop integrates each chain. Between two chains, ``Integrator.follow`` applies the jump in
stress.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.motion import initial_points
from rsfstudy.motion.accuracy import Accuracy, estimate_error
from rsfstudy.motion.continuous_loading_segments import (
    find_remaining_loading_segments,
    iterate_segment_start_events,
    prepare_noisy_loading_segment,
    remove_settling_events_if_unstable,
    select_event_specs_that_can_occur,
    split_segments_at_stress_jumps,
    truncate_loading_segments_at_time,
)
from rsfstudy.motion.initial_points import compute_initial_point, compute_point_after_loading_jump
from rsfstudy.motion.integration_events import Event, EventKind, EventSpecification
from rsfstudy.motion.motion_driver import MotionDriver, get_motion_driver
from rsfstudy.motion.recording import MotionRecorder
from rsfstudy.motion.regime_switching import (
    compute_regime_switch_thresholds,
    is_inertia_significant_at,
)
from rsfstudy.motion.work_meter import MIN_LOCAL_ERROR_TOLERANCE, WorkMeter
from rsfstudy.parts import (
    LOADING,
    LOG_LOAD_VELOCITY,
    SEGMENT_END,
    SEGMENT_LOG_VELOCITY,
)
from rsfstudy.slider import EquationsOfMotion, FloatTuple, MotionPoint, Scene


@make_methods_raise_rsfstudy_errors
class Integrator:
    """Integrator of motions with a requested accuracy and a work counter.

    A measure receives an integrator together with the scene to evaluate. The attribute
    ``work_meter`` counts the right-hand side evaluations of all motions that the integrator and its
    copies integrate. The integrator and its copies share one work budget.

    Parameters
    ----------
    accuracy : Accuracy
        Requested accuracy, work budget and engine.

    Examples
    --------
    >>> from rsfstudy import Accuracy, Integrator, Scene
    >>> integrator = Integrator(Accuracy(rtol=1e-5))
    >>> scene = Scene(normal_stress="constant", stiffness_ratio=2.0, load_velocity_ratio=2.0)
    >>> *_, last = integrator.follow(scene, until=1.0)
    >>> last.time
    1.0
    >>> integrator.evaluations > 0
    True
    """

    __slots__ = ("accuracy", "work_meter")

    #: Smallest possible value of ``local_tolerance``.
    MIN_LOCAL_ERROR_TOLERANCE = MIN_LOCAL_ERROR_TOLERANCE

    compute_initial_point = staticmethod(initial_points.compute_initial_point)
    compute_point_before_start = staticmethod(initial_points.compute_point_before_start)
    compute_restart_point = staticmethod(initial_points.compute_restart_point)
    compute_point_with_slip_rate = staticmethod(initial_points.compute_point_with_slip_rate)

    def __init__(self, accuracy: Accuracy) -> None:
        """Create an integrator whose evaluation count is zero."""
        self.accuracy, self.work_meter = accuracy, WorkMeter(accuracy.budget)

    @property
    def rtol(self) -> float:
        """Requested relative error of the main results."""
        return self.accuracy.rtol

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return self.accuracy.engine

    @property
    def local_tolerance(self) -> float:
        """Local error tolerance of an integration step."""
        return self.accuracy.local_tolerance

    @property
    def evaluations(self) -> int:
        """Total number of right-hand side evaluations counted so far."""
        return self.work_meter.evaluations

    @property
    def is_budget_exceeded(self) -> bool:
        """True if the number of evaluations exceeds the work budget."""
        return self.work_meter.evaluations > self.work_meter.budget

    def with_work_meter(self, work_meter: WorkMeter) -> Integrator:
        """Return a copy that adds its evaluations to a different counter.

        Parameters
        ----------
        work_meter : WorkMeter
            Work counter of the copy, which also defines the work budget.

        Returns
        -------
        Integrator
            Copy with the same accuracy.
        """
        copied = object.__new__(Integrator)  # The checks of the constructor are not necessary.
        copied.accuracy, copied.work_meter = self.accuracy, work_meter
        return copied

    def with_accuracy(self, accuracy: Accuracy) -> Integrator:
        """Return a copy with a different accuracy and the same work counter.

        Parameters
        ----------
        accuracy : Accuracy
            Accuracy of the copy. The work budget of the counter does not change.

        Returns
        -------
        Integrator
            Copy that uses the same work counter.
        """
        copied = object.__new__(Integrator)
        copied.accuracy, copied.work_meter = accuracy, self.work_meter
        return copied

    def with_rtol(self, rtol: float) -> Integrator:
        """Return a copy with a different relative tolerance and the same counter.

        Parameters
        ----------
        rtol : float
            New relative error tolerance of the main results.

        Returns
        -------
        Integrator
            Copy that uses the same work counter.
        """
        return self.with_accuracy(self.accuracy.with_rtol(rtol))

    def refined(self) -> Integrator:
        """Return a copy with ten times smaller tolerances and the same counter.

        The difference between the results of the two integrators is an estimate of the error. See
        ``estimate_error`` and ``Accuracy.refined``.

        Returns
        -------
        Integrator
            Copy that uses the same work counter.
        """
        return self.with_accuracy(self.accuracy.refined())

    def tightened_to(self, rtol: float) -> Integrator:
        """Return an integrator whose relative error tolerance is at most ``rtol``.

        Parameters
        ----------
        rtol : float
            Largest relative error tolerance.

        Returns
        -------
        Integrator
            This integrator, or a copy that uses the same work counter.
        """
        return self if self.rtol <= rtol else self.with_rtol(rtol)

    def loosened_to(self, rtol: float) -> Integrator:
        """Return an integrator whose relative error tolerance is at least ``rtol``.

        Parameters
        ----------
        rtol : float
            Smallest relative error tolerance.

        Returns
        -------
        Integrator
            This integrator, or a copy that uses the same work counter.
        """
        return self if self.rtol >= rtol else self.with_rtol(rtol)

    def result_tolerance(self, factor: float = 1.0) -> float:
        """Return the relative tolerance of the main results, multiplied by a factor.

        Parameters
        ----------
        factor : float, default: 1.0
            Factor by which the requested relative error is multiplied.

        Returns
        -------
        float
            Relative tolerance of a result.
        """
        return factor * self.accuracy.rtol

    def estimate_error(
        self,
        value: float,
        refined_value: float,
        floor_over_tolerance: float,
        error_scale: float | None = None,
    ) -> float:
        """Estimate the error of a result by comparison with a refined result.

        Parameters
        ----------
        value : float
            Result that was computed with this integrator.
        refined_value : float
            Result that was computed with the refined integrator.
        floor_over_tolerance : float
            Minimum relative error, as a fraction of the requested relative error. The minimum is
            always added to the estimate, because the two results may agree by chance.
        error_scale : float, optional
            Reference value that converts relative errors to absolute errors. The default is
            ``value``.

        Returns
        -------
        float
            Absolute error estimate.
        """
        floor = floor_over_tolerance * self.accuracy.rtol
        return estimate_error(value, refined_value, floor, error_scale)

    def inertia_matters_at(self, scene: Scene, point: MotionPoint) -> bool:
        """Return True if the slow manifold is not accurate enough at a point.

        Parameters
        ----------
        scene : Scene
            Scene with or without inertia.
        point : MotionPoint
            Point of a motion.

        Returns
        -------
        bool
            True if the scene has inertia and the effect of inertia is too large for the slow
            manifold.
        """
        return is_inertia_significant_at(scene, self.accuracy, point)

    def follow_equations(
        self,
        equations: EquationsOfMotion,
        initial_unknowns: FloatTuple,
        event_specs: Sequence[EventSpecification] = (),
        *,
        local_tolerance: float | None = None,
        backward: bool = False,
        recording: MotionRecorder | None = None,
    ) -> Iterator[Event]:
        """Integrate a single system of equations, and yield the events.

        Parameters
        ----------
        equations : EquationsOfMotion
            System of equations.
        initial_unknowns : tuple of float
            Initial values of the unknowns.
        event_specs : sequence of EventSpecification, default: ()
            Requested events.
        local_tolerance : float, optional
            Local error tolerance of an integration step. The default is computed from the accuracy
            of the integrator.
        backward : bool, default: False
            If True, the independent variable decreases.
        recording : MotionRecorder, optional
            Object that records the motion. For a rigid slider, the independent variable is slip, so
            the ``sample_times`` of the recording are values of slip.

        Returns
        -------
        iterator of Event
            Events in the order of their occurrence.
        """
        driver = MotionDriver(equations, engine=self.engine, methods=self.accuracy.methods)
        return driver.iterate_events(
            initial_unknowns,
            self.work_meter,
            event_specs,
            self.local_tolerance if local_tolerance is None else local_tolerance,
            backward=backward,
            recording=recording,
        )

    def follow(
        self,
        scene: Scene,
        event_specs: Sequence[EventSpecification] = (),
        *,
        start: MotionPoint | None = None,
        with_time: bool = False,
        recording: MotionRecorder | None = None,
        until: float = math.inf,
        resume_from: Event | None = None,
    ) -> Iterator[Event]:
        """Integrate a scene, starting immediately after its first loading step.

        Parameters
        ----------
        scene : Scene
            Scene to integrate.
        event_specs : sequence of EventSpecification, default: ()
            Requested events.
        start : MotionPoint, optional
            Initial point of a motion that starts within the last loading segment. By default, the
            motion starts in the first loading segment. The default initial point is steady sliding
            at V_*, or the initial stress and state of the scene.
        with_time : bool, default: False
            If True, time is one of the unknowns. If False, the times and slips of events may be
            NaN, and the integration needs fewer right-hand side evaluations.
        recording : MotionRecorder, optional
            Object that records the motion.
        until : float, default: inf
            Time at which the motion ends, in D_c/V_*.
        resume_from : Event, optional
            Last event of an earlier motion of the same scene. The new motion continues from this
            event.

        Yields
        ------
        Event
            Events in the order of their occurrence.

        Raises
        ------
        MotionStopped
            If the motion cannot continue. The status is ``normal_stress_lost``,
            ``shear_stress_reversed``, ``locked``, ``slip_stopped`` or ``slip_rate_unbounded`` if
            the slider reaches a point beyond which the equations are not valid. The status is
            ``work_budget_spent`` if the budget is exhausted. The status is ``integration_failed``
            if the stepper fails or a value is not finite.
        """
        chains = split_segments_at_stress_jumps(scene, only_last_segment=start is not None)
        with_time = with_time or until < math.inf or len(chains) > 1 or len(chains[0][1]) > 1
        with_time = with_time or scene.parts.loading_noise.is_active
        time, slip, before, told = 0.0, 0.0, None, scene.parts.loading.reported_segment_start_count
        if resume_from is not None:
            chains, start = find_remaining_loading_segments(scene, resume_from)
            time, slip = resume_from.time, resume_from.slip
        for number, (acting, table) in enumerate(chains):
            if start is None:
                start = compute_initial_point(acting)
            elif number:
                start = compute_point_after_loading_jump(acting, start)
            is_last = number == len(chains) - 1
            asked = select_event_specs_that_can_occur(
                scene, acting, event_specs, includes_last_segment=is_last
            )
            table = truncate_loading_segments_at_time(table, until)
            end, further, parameters = float(table[-1, SEGMENT_END]), None, None
            if scene.parts.loading_noise.is_active:
                start, parameters, table, further = prepare_noisy_loading_segment(
                    acting, start, table
                )
                told = 0  # Every loading segment starts a chain, which reports its start.
            motion = get_motion_driver(
                acting, self.engine, self.accuracy.methods, include_time_equation=with_time
            ).iterate_events(
                start,
                self.work_meter,
                asked,
                self.local_tolerance,
                duration_start_time_and_slip=(
                    float(table[0, SEGMENT_END]) - time if with_time else math.inf,
                    time,
                    slip,
                ),
                switch_thresholds=compute_regime_switch_thresholds(acting, self.accuracy),
                recording=recording,
                later_segments_and_reported_count=(table[1:], told),
                initial_imposed_stress=acting.parameter_values[LOADING + 2]
                if acting.parts.loading.adds_load_point_displacement_unknown
                else None,
                parameters=parameters,
                noise_segment_tables=further,
            )
            motion = remove_settling_events_if_unstable(scene, motion)
            if before is None and end == math.inf:  # The motion consists of a single chain.
                yield from motion
                return
            for last in motion:
                if before is not None and last.kind is EventKind.START:
                    for event in iterate_segment_start_events(last, before, acting, asked):
                        yield event
                        if event.specification is not None and event.specification.terminal:
                            return
                elif last.kind is not EventKind.END:
                    yield last
                    if last.specification is not None and last.specification.terminal:
                        return
            if last.kind is EventKind.END:
                # The located end time has a rounding error.
                last = last._replace(time=end)
                if recording is not None:
                    recording.cap_recorded_times_at(end)
            if end >= until:
                yield last
                return
            # The parameters of the scene belong to the first segment of the chain.
            numbers = list(acting.parameter_values)
            numbers[LOG_LOAD_VELOCITY] = float(table[-1, SEGMENT_LOG_VELOCITY])
            start, before = last.point, (last.point, tuple(numbers))
            time, slip = last.time, last.slip
