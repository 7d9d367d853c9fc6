"""Driver that calls the event loop and converts its output tables to events.

``get_motion_driver`` returns the driver of a scene. ``MotionDriver.iterate_events`` allocates the
arrays of a motion, calls ``motion_loop.advance_motion`` until the motion ends, and yields the
events. A backend prepares the arguments of the loop for plain Python (``PythonBackend``) or for the
compiled loop (``compiled.numba_backend.NumbaBackend``).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np

from rsfstudy.motion import array_layout, workspace
from rsfstudy.motion.engine_factory import create_stepper, import_compiled_engine
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.event_spec_table import (
    pack_event_specifications_into_table,
    pack_point_into_array,
)
from rsfstudy.motion.integration_events import Event, EventSpecification
from rsfstudy.motion.overflow_reports import call_and_describe_overflow
from rsfstudy.motion.python_backend import PythonBackend
from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    SAMPLES_PER_INTEGRATION_STEP,
    SPRING_AND_FRICTIONAL_STRESS_COLUMNS,
    MotionRecorder,
)
from rsfstudy.motion.regime_switching import (
    SWITCH_THRESHOLDS_WITHOUT_INERTIA,
    RegimeSwitchThresholds,
    build_termination_error,
)
from rsfstudy.motion.work_meter import (
    MIN_LOCAL_ERROR_TOLERANCE,
    REFERENCE_TOLERANCE_FOR_MAX_STEP_LENGTH,
    MotionStopped,
    WorkMeter,
)
from rsfstudy.parts import SEGMENT_STRESS_FALL
from rsfstudy.slider import EquationsOfMotion, FloatTuple, MotionPoint, Scene, cached_per_scene
from rsfstudy.status import Status

#: Minimum number of rows of the event table, and number of rows of the recording table.
_MIN_EVENT_ROWS, _RECORDING_ROWS = 64, 4096
#: Constructor of named tuples, which is twice as fast as a normal constructor call.
_make_named_tuple_without_checks = tuple.__new__
_STEP_TOO_SHORT_MESSAGE = (
    "the required step size is smaller than the spacing of floating-point numbers"
)
_MODE_AND_TABLES_WITHOUT_RECORDING = (
    array_layout.RECORD_NEVER,
    np.empty(0),
    np.empty((0, FIRST_STATE_COLUMN)),
)
#: Index of the segment table in the arguments of the loop that follow the motion state.
_ARGUMENT_INDEX_OF_LATER_SEGMENTS = 5
_DEFAULT_LATER_SEGMENTS_AND_COUNT = np.empty((0, SEGMENT_STRESS_FALL + 1)), 0


class MotionDriver:
    """Driver that integrates all motions that have the same equations.

    The motions may differ in their initial points and parameters.

    Parameters
    ----------
    slow_equations : EquationsOfMotion
        Equations of the slow manifold, which describe the motion between ruptures.
    fast_equations : EquationsOfMotion, optional
        Inertial equations of motion in ruptures. Omit these equations if the scene has no inertia.
    engine : str
        Name of the engine.
    methods : sequence of (str, str), default: ()
        Pairs of a regime name and the name of the SciPy solver for this regime. The default solver
        is DOP853.
    **fields : float
        Initial values of motion state fields. See ``array_layout.MOTION_STATE_DTYPE``.
    """

    def __init__(
        self,
        slow_equations: EquationsOfMotion,
        fast_equations: EquationsOfMotion | None = None,
        *,
        engine: str,
        methods: Sequence[tuple[str, str]] = (),
        **fields: float,
    ) -> None:
        self._engine, self._methods = engine, dict(methods)
        self._equations: tuple[EquationsOfMotion, ...] = (
            (slow_equations,) if fast_equations is None else (slow_equations, fast_equations)
        )
        self._backend = (
            import_compiled_engine().NumbaBackend() if engine == COMPILED else PythonBackend()
        )
        self._states, unknowns = (
            slow_equations.state_count,
            [len(system.unknown_names) for system in self._equations],
        )
        self._unknowns = max(unknowns)
        scales = np.array([scale for system in self._equations for scale in system.unknown_scales])
        self._scales_and_functions = (
            *self._backend.convert_arrays_for_motion_loop(scales),
            self._backend.build_function_table(self._equations),
        )
        self._p = self._backend.convert_parameters_for_motion_loop(slow_equations.parameters)
        self._regimes = [system.regime_name for system in self._equations]
        fields |= {
            "pending_start": array_layout.START_CODE,
            "clock_is_path_length": not slow_equations.is_rigid,
            "slip_is_clock": slow_equations.is_rigid,
            "unknowns": unknowns[0],
            "states": slow_equations.state_count,
            "unknowns_fast": sum(unknowns[1:]),
            "has_mass": fast_equations is not None,
        }
        self._initial_values = self._backend.pack_initial_motion_state(tuple(fields.items()))

    def iterate_events(
        self,
        start_point_or_unknowns: MotionPoint | FloatTuple,
        work_meter: WorkMeter,
        event_specs: Sequence[EventSpecification],
        tolerance: float,
        *,
        duration_start_time_and_slip: tuple[float, float, float] = (math.inf, 0.0, 0.0),
        backward: bool = False,
        parameters: FloatTuple | None = None,
        switch_thresholds: RegimeSwitchThresholds = SWITCH_THRESHOLDS_WITHOUT_INERTIA,
        evaluation_budget: float = math.inf,
        recording: MotionRecorder | None = None,
        later_segments_and_reported_count: tuple[
            np.ndarray, int
        ] = _DEFAULT_LATER_SEGMENTS_AND_COUNT,
        initial_imposed_stress: float | None = None,
        noise_segment_tables: Iterator[np.ndarray] | None = None,
    ) -> Iterator[Event]:
        """Yield the events of a motion in the order of their occurrence.

        Parameters
        ----------
        start_point_or_unknowns : MotionPoint or tuple of float
            Initial point, or initial unknowns of the slow regime. If a point is passed, the loop
            chooses the initial regime.
        work_meter : WorkMeter
            Counter of right-hand side evaluations.
        event_specs : sequence of EventSpecification
            Requested events.
        tolerance : float
            Local error tolerance of a step.
        duration_start_time_and_slip : tuple of float, default: (inf, 0.0, 0.0)
            Duration of the first loading segment, initial time and initial slip.
        backward : bool, default: False
            If True, the independent variable decreases.
        parameters : tuple of float, optional
            Parameters that replace the parameters of the equations.
        switch_thresholds : RegimeSwitchThresholds, optional
            Thresholds for changes between the regimes. Motions without inertia do not require
            thresholds.
        evaluation_budget : float, default: inf
            Maximum number of right-hand side evaluations. The remaining budget of the work meter is
            an additional limit.
        recording : MotionRecorder, optional
            Object that receives the recorded rows.
        later_segments_and_reported_count : tuple of (ndarray, int), optional
            Segment table rows of all loading segments after the first, and a number ``n``. The
            starts of the last ``n`` segments are reported as events.
        initial_imposed_stress : float, optional
            Initial value of the last unknown, if the load point oscillates. The imposed shear
            stress is the last unknown minus its initial value. The unknown ``spring_stress`` does
            not include the imposed shear stress. The spring stress in events and recordings
            includes the imposed shear stress.
        noise_segment_tables : iterator of ndarray, optional
            Further rows of the segment table in a scene with noise. The driver requests them when
            the motion reaches the last row.

        Yields
        ------
        Event
            Start of the motion, requested events, and events that are reported without a request,
            such as changes of regime.

        Raises
        ------
        MotionStopped
            If the motion cannot continue or exceeds the budget.
        """
        machine, states, numbers = self._backend, self._states, self._p
        systems: Iterable[EquationsOfMotion] = self._equations
        before, turns = numbers, len(later_segments_and_reported_count[0])
        if isinstance(start_point_or_unknowns, MotionPoint):
            start_point_or_unknowns = (
                start_point_or_unknowns
                if initial_imposed_stress is None
                else _shift_stresses_of_point(
                    start_point_or_unknowns,
                    initial_imposed_stress - start_point_or_unknowns.psis[-1],
                )
            )
            y, last, stress = (
                np.empty(2 * self._unknowns),
                pack_point_into_array(start_point_or_unknowns),
                start_point_or_unknowns.spring_stress,
            )
        else:  # The second half of the array holds the derivatives.
            y, last, stress = (
                np.array((*start_point_or_unknowns, *start_point_or_unknowns)),
                np.empty(array_layout.FIRST_STATE + states),
                0.0,
            )
        if parameters is not None or turns:  # The loop changes the parameters at kinks.
            before = numbers = machine.convert_parameters_for_motion_loop(
                self._equations[0].parameters if parameters is None else parameters
            )
            if turns:
                before = machine.convert_parameters_for_motion_loop(numbers)
            systems = (system._replace(parameters=numbers) for system in self._equations)
        tolerance = max(tolerance, MIN_LOCAL_ERROR_TOLERANCE)
        records, samples, rows = _prepare_recording_tables(recording, self._equations[0], states)
        state = machine.create_motion_state(
            self._initial_values,
            (
                *(*duration_start_time_and_slip, stress, tolerance),
                # The step limit depends on the tolerance. Otherwise, two runs with different
                # tolerances could share an error, and their difference would not reveal the error.
                (tolerance / REFERENCE_TOLERANCE_FOR_MAX_STEP_LENGTH) ** 0.125,
                -1.0 if backward else 1.0,
                int(min(evaluation_budget, work_meter.budget - work_meter.evaluations)),
                *(records, turns, later_segments_and_reported_count[1]),
            ),
        )
        asked, meanings = pack_event_specifications_into_table(tuple(event_specs))
        stepper = create_stepper(self._engine, systems, self._methods)
        columns = array_layout.EVENT_POINT + array_layout.FIRST_STATE + states
        events = np.empty((max(_MIN_EVENT_ROWS, 2 * len(event_specs) + 4), columns))
        block = np.empty(workspace.compute_workspace_size(self._unknowns, states, len(event_specs)))
        arguments = [
            *machine.convert_arrays_for_motion_loop(y, last, block),
            (*self._scales_and_functions, tuple(switch_thresholds), numbers, before),
            *machine.convert_arrays_for_motion_loop(
                asked.copy(), later_segments_and_reported_count[0], samples, events, rows
            ),
            stepper,
        ]
        regimes, psis = self._regimes, array_layout.EVENT_POINT + array_layout.FIRST_STATE
        run, end, known = machine.get_motion_loop_function(), array_layout.PAUSED, (0, 0, 0, 0)
        while end == array_layout.PAUSED:
            end = run(state.motion_state_array, *arguments)
            slow, fast, steps, happened, recorded, jacobians = (
                state.get_evaluation_and_table_row_counts()
            )
            known, settled = (slow, fast, steps, jacobians), known
            others = work_meter.charge_work_since_last_call(regimes, settled, known)
            if recording is not None and recorded:
                kept = rows[:recorded].copy(order="F")  # Recordings are read by column.
                if initial_imposed_stress is not None:
                    kept[:, SPRING_AND_FRICTIONAL_STRESS_COLUMNS] += (
                        kept[:, -1:] - initial_imposed_stress
                    )
                recording.append_rows(kept, regimes)
            for line in events[:happened].tolist():
                code, regime, clock, time, slip, spent = line[: array_layout.EVENT_POINT]
                point = _make_named_tuple_without_checks(
                    MotionPoint, (*line[array_layout.EVENT_POINT : psis], tuple(line[psis:]))
                )
                if initial_imposed_stress is not None:
                    point = _shift_stresses_of_point(point, point.psis[-1] - initial_imposed_stress)
                kind, spec = meanings[int(code)]
                name, work = regimes[int(regime)], others + int(spent)
                yield _make_named_tuple_without_checks(
                    Event, (kind, spec, time, slip, point, name, work, clock)
                )
            work_meter.check_budget()
            if (
                noise_segment_tables is not None
                and state.get_motion_state_field("kinks_ahead") == 0.0
            ):
                for table in islice(noise_segment_tables, 1):
                    arguments[_ARGUMENT_INDEX_OF_LATER_SEGMENTS] = (
                        machine.convert_arrays_for_motion_loop(table)[0]
                    )
                    state.set_remaining_loading_kink_count(len(table))
        if end != array_layout.MOTION_ENDED:
            overflow = ""
            if end in (array_layout.NO_STEP_POSSIBLE, array_layout.INVALID_STEP):
                system = self._equations[int(state.get_motion_state_field("regime"))]
                unknowns = tuple(y[: len(system.unknown_names)].tolist())
                overflow = call_and_describe_overflow(
                    system.rate_function, unknowns, tuple(numbers)
                )
            raise _build_motion_stopped_error(end, state, regimes, stepper, overflow)


def _shift_stresses_of_point(point: MotionPoint, stress_change: float) -> MotionPoint:
    """Add a stress change to the spring stress and frictional stress of a point."""
    return point._replace(
        spring_stress=point.spring_stress + stress_change,
        frictional_stress=point.frictional_stress + stress_change,
    )


@cached_per_scene
def get_motion_driver(
    scene: Scene, engine: str, methods: tuple[tuple[str, str], ...], *, include_time_equation: bool
) -> MotionDriver:
    """Return the driver that integrates the motions of a scene.

    Parameters
    ----------
    scene : Scene
        Scene with the parameters of its first loading segment.
    engine : str
        Name of the engine.
    methods : tuple of (str, str)
        Pairs of a regime name and the name of the SciPy solver for this regime.
    include_time_equation : bool
        If True, time is one of the unknowns.

    Returns
    -------
    MotionDriver
        Driver of the scene. The driver is cached in the scene.
    """
    return MotionDriver(
        scene.equations_between_ruptures(with_time=include_time_equation),
        scene.equations_in_rupture(with_time=include_time_equation) if scene.has_mass else None,
        engine=engine,
        methods=methods,
        unknowns_behind_fluid=len(scene.parts.fluid.unknowns)
        if scene.parts.loading.unknowns
        else 0,
        may_reverse=scene.parts.law.regularised,
        noise_rate_index=len(scene.parameter_values) - 1
        if scene.parts.loading_noise.is_active
        else 0,
        starts_at_point=1,
        may_terminate=1,
        has_clock=include_time_equation,
    )


def _prepare_recording_tables(
    recording: MotionRecorder | None, equations: EquationsOfMotion, state_count: int
) -> tuple[int, np.ndarray, np.ndarray]:
    """Return the recording mode, requested samples and output table."""
    if recording is None:
        return _MODE_AND_TABLES_WITHOUT_RECORDING
    if recording.sample_times is None:
        return (
            array_layout.RECORD_WITHIN_STEPS,
            np.empty(0),
            np.empty((_RECORDING_ROWS, FIRST_STATE_COLUMN + state_count)),
        )
    samples = recording.list_unrecorded_sample_times()
    rows = np.empty(
        (len(samples) + 2 * SAMPLES_PER_INTEGRATION_STEP, FIRST_STATE_COLUMN + state_count)
    )
    return (
        array_layout.RECORD_AT_CLOCKS if equations.is_rigid else array_layout.RECORD_AT_TIMES,
        samples,
        rows,
    )


def _build_motion_stopped_error(
    return_code: int,
    motion_state: Any,
    regime_names: Sequence[str],
    stepper: Any,
    overflow: str,
) -> MotionStopped:
    """Create the exception for a motion that cannot continue."""
    if return_code == array_layout.TERMINATED:
        return build_termination_error(
            int(motion_state.get_motion_state_field("termination")),
            motion_state.get_motion_state_field("final_normal_stress"),
        )
    why = "the step size is zero, or a value is not finite"
    if return_code == array_layout.NO_STEP_POSSIBLE:
        why = stepper.failure if stepper else _STEP_TOO_SHORT_MESSAGE
    why = overflow or why
    return MotionStopped(
        Status.INTEGRATION_FAILED,
        f"{regime_names[int(motion_state.get_motion_state_field('regime'))]}: {why}",
    )
