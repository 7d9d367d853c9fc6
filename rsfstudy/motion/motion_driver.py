"""Runs the loop of motions, and makes events of the tables that it fills."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from rsfstudy._deprecation import renamed_members
from rsfstudy.motion import array_layout, workspace
from rsfstudy.motion.engine_factory import create_stepper, import_compiled_engine
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.events import Event, EventKind, EventSpecification
from rsfstudy.motion.in_place_functions import build_in_place_functions
from rsfstudy.motion.motion_loop import advance_motion
from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    SAMPLES_PER_STEP,
    SHEAR_STRESS_COLUMNS,
    Recording,
)
from rsfstudy.motion.regime_switching import (
    NO_SWITCH_THRESHOLDS,
    SwitchThresholds,
    termination_error,
)
from rsfstudy.motion.step_events import BEFORE_JUMP, NO_EVENT, find_jump_side
from rsfstudy.motion.work_meter import (
    MIN_LOCAL_TOLERANCE,
    REFERENCE_TOLERANCE_OF_STEP_LIMIT,
    MotionStopped,
    WorkMeter,
)
from rsfstudy.parts import SEGMENT_STRESS_FALL
from rsfstudy.slider import (
    Equations,
    MotionPoint,
    Numbers,
    Scene,
    cached_per_scene,
    equations_between_ruptures,
    equations_in_rupture,
)
from rsfstudy.status import Status

#: Rows of the tables of events and of recordings that one call may fill.
_MIN_EVENT_ROWS, _RECORDING_ROWS = 64, 4096
_EVENT_KIND_CODES = {
    kind: array_layout.__dict__[kind.name]
    for kind in EventKind
    if kind.name in array_layout.__dict__
}
#: Columns of a point, by the names of its numbers; what is asked of none reads the first.
_POINT_COLUMN_BY_QUANTITY = {
    name: column for column, name in enumerate(MotionPoint._fields[:-1])
} | {"": 0}
#: What is told beside what was asked for: the codes of these count from the end.
_UNREQUESTED_EVENTS = [
    (k, None)
    for k in (
        EventKind.SEGMENT,
        EventKind.SAMPLED,
        EventKind.END,
        EventKind.REGIME,
        EventKind.START,
    )
]
#: Makes a named tuple of a tuple, in half the time that its name takes.
_make_named_tuple_quickly = tuple.__new__
_STEP_TOO_SHORT_TEXT = "a step would be shorter than the spacing of numbers around the clock"
_NO_RECORDING_TABLES = array_layout.RECORD_NEVER, np.empty(0), np.empty((0, FIRST_STATE_COLUMN))
_NO_KINKS = np.empty((0, SEGMENT_STRESS_FALL + 1)), 0


class PythonBackend:
    """The loop as it stands, and its arguments; `compiled.machine.NumbaBackend` is the other
    machine that runs it.
    """

    def initial_state_values(self, field_values: tuple[tuple[str, float], ...]) -> dict[str, float]:
        """Initial state of motions that have these numbers in their state, and others 0."""
        return {
            **dict.fromkeys(array_layout.MOTION_STATE_DTYPE.names or (), 0),
            **dict(field_values),
        }

    def create_motion_state(
        self, initial_state: dict[str, float], call_arguments: tuple[float, ...]
    ) -> PythonMotionState:
        """The state of a motion: its `memory`, and its `counters`."""
        called = zip(array_layout.CALL_ARGUMENT_FIELDS, call_arguments, strict=True)
        return PythonMotionState(**{**initial_state, **dict(called)})

    def build_function_table(self, equations_by_regime: tuple[Equations, ...]) -> np.ndarray:
        """The table of functions of the regimes."""
        rows = np.zeros((2, array_layout.FUNCTIONS_PER_REGIME), dtype=object)
        for row, system in zip(rows, equations_by_regime, strict=False):
            row[:] = build_in_place_functions(system)
        rows[array_layout.FAST_REGIME, -1] = rows[array_layout.SLOW_REGIME, -1]
        return rows

    def as_loop_arguments(self, *arrays: np.ndarray) -> Sequence[memoryview]:
        """Arrays as the loop takes them."""
        return [memoryview(array) for array in arrays]  # type: ignore[arg-type]

    def as_loop_parameters(self, parameters: Sequence[float]) -> Any:
        """The numbers of a scene as the loop takes them."""
        return list(parameters)

    def get_loop_function(self) -> Any:
        """The loop."""
        return advance_motion


@partial(renamed_members, writable=True)
class PythonMotionState(SimpleNamespace):
    """The state of a motion in plain Python."""

    @property
    def memory(self) -> list[PythonMotionState]:
        """The state as the loop takes it."""
        return [self]

    def work_and_row_counters(self) -> tuple[int, ...]:
        """Right-hand sides by regime, steps, events, rows, and Jacobians."""
        return (
            *(self.evaluations_slow, self.evaluations_fast, self.steps),
            *(self.event_rows, self.recorded_rows, self.jacobians),
        )

    def get_state_field(self, field_name: str) -> float:
        """One of its fields."""
        return float(getattr(self, field_name))


class MotionDriver:
    """Runs motions by the same equations, which may differ in their numbers and beginnings.

    Parameters
    ----------
    slow : Equations
        The equations, or those between ruptures.
    fast : Equations, optional
        Those in ruptures.
    engine : str
    fields : float
        Fields of the state of a motion (`layout.MOTION`) in which such motions differ from others.
    """

    def __init__(
        self,
        slow_equations: Equations,
        fast_equations: Equations | None = None,
        *,
        engine: str,
        **fields: float,
    ) -> None:
        self._equations: tuple[Equations, ...] = (
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
            *self._backend.as_loop_arguments(scales),
            self._backend.build_function_table(self._equations),
        )
        self._p = self._backend.as_loop_parameters(slow_equations.parameters)
        self._regimes = [system.regime for system in self._equations]
        fields |= {
            "pending_start": array_layout.START_CODE,
            "clock_is_path_length": not slow_equations.is_rigid,
            "slip_is_clock": slow_equations.is_rigid,
            "unknowns": unknowns[0],
            "states": slow_equations.state_count,
            "unknowns_fast": sum(unknowns[1:]),
            "has_mass": fast_equations is not None,
        }
        self._initial_values = self._backend.initial_state_values(tuple(fields.items()))

    def iterate_events(
        self,
        start_point_or_unknowns: MotionPoint | Numbers,
        work_meter: WorkMeter,
        event_specs: Sequence[EventSpecification],
        tolerance: float,
        *,
        duration_start_time_and_slip: tuple[float, float, float] = (math.inf, 0.0, 0.0),
        backward: bool = False,
        parameters: Numbers | None = None,
        switch_thresholds: SwitchThresholds = NO_SWITCH_THRESHOLDS,
        evaluation_budget: float = math.inf,
        recording: Recording | None = None,
        kinks_and_reported_count: tuple[np.ndarray, int] = _NO_KINKS,
        initial_imposed_stress: float | None = None,
    ) -> Iterator[Event]:
        """Events of a motion, a table of them by each call of the loop.

        Parameters
        ----------
        start_point_or_unknowns : Point or tuple of float
            Where it begins: a point, whose regime is found, or the unknowns.
        work_meter : WorkMeter
            Charged with the work.
        event_specs : sequence of EventSpecification
        tolerance : float
            Local error per step.
        duration_start_time_and_slip : tuple of float
            How long it lasts, and time and slip where it begins.
        backward : bool
            Run against the clock of the equations.
        parameters : tuple of float, optional
            Other numbers than those of the equations.
        switch_thresholds : SwitchThresholds
            When to change between the regimes.
        evaluation_budget : float
            Right-hand sides it may spend, if fewer than the meter leaves.
        recording : Recording, optional
        kinks_and_reported_count : tuple of ndarray and int
            Those of the loading, and how many of the last ones are reported.
        initial_imposed_stress : float, optional
            Where the load point moves to and fro, shear stress that this adds when the last unknown
            is zero: while steps are taken, stresses are without what it adds, told with it.

        Raises
        ------
        MotionStopped
            Where it cannot go on.
        """
        machine, states, systems, numbers = self._backend, self._states, self._equations, self._p
        before, turns = numbers, len(kinks_and_reported_count[0])
        if isinstance(start_point_or_unknowns, MotionPoint):
            start_point_or_unknowns = (
                start_point_or_unknowns
                if initial_imposed_stress is None
                else _add_to_stresses(
                    start_point_or_unknowns,
                    initial_imposed_stress - start_point_or_unknowns.psis[-1],
                )
            )
            y, last, stress = (
                np.empty(2 * self._unknowns),
                _pack_point(start_point_or_unknowns),
                start_point_or_unknowns.spring_stress,
            )
        else:  # behind the unknowns is room for as many
            y, last, stress = (
                np.array((*start_point_or_unknowns, *start_point_or_unknowns)),
                np.empty(array_layout.FIRST_STATE + states),
                0.0,
            )
        if parameters is not None or turns:  # numbers that are those of this motion alone
            before = numbers = machine.as_loop_parameters(
                systems[0].parameters if parameters is None else parameters
            )
            if turns:
                before = machine.as_loop_parameters(numbers)
            systems = tuple(system._replace(parameters=numbers) for system in systems)
        tolerance = max(tolerance, MIN_LOCAL_TOLERANCE)
        records, samples, rows = _prepare_recording_tables(recording, systems[0], states)
        state = machine.create_motion_state(
            self._initial_values,
            (
                *(*duration_start_time_and_slip, stress, tolerance),
                # what limits a step must differ between two tolerances whose results tell errors
                (tolerance / REFERENCE_TOLERANCE_OF_STEP_LIMIT) ** 0.125,
                -1.0 if backward else 1.0,
                int(min(evaluation_budget, work_meter.budget - work_meter.evaluations)),
                *(records, turns, kinks_and_reported_count[1]),
            ),
        )
        asked, meanings = _pack_event_specifications(tuple(event_specs))
        stepper = create_stepper(work_meter.engine, systems, work_meter.methods)
        columns = array_layout.EVENT_POINT + array_layout.FIRST_STATE + states
        events = np.empty((max(_MIN_EVENT_ROWS, 2 * len(event_specs) + 4), columns))
        block = np.empty(workspace.workspace_size(self._unknowns, states, len(event_specs)))
        arguments = (
            *machine.as_loop_arguments(y, last, block),
            (*self._scales_and_functions, tuple(switch_thresholds), numbers, before),
            *machine.as_loop_arguments(
                asked.copy(), kinks_and_reported_count[0], samples, events, rows
            ),
            stepper,
        )
        regimes, psis = self._regimes, array_layout.EVENT_POINT + array_layout.FIRST_STATE
        run, end, known = machine.get_loop_function(), array_layout.PAUSED, (0, 0, 0, 0)
        while end == array_layout.PAUSED:
            end = run(state.memory, *arguments)
            slow, fast, steps, happened, recorded, jacobians = state.work_and_row_counters()
            known, settled = (slow, fast, steps, jacobians), known
            others = work_meter.charge_new_work(regimes, settled, known)
            if recording is not None and recorded:
                kept = rows[:recorded].copy(order="F")  # columns are what is asked for
                if initial_imposed_stress is not None:
                    kept[:, SHEAR_STRESS_COLUMNS] += kept[:, -1:] - initial_imposed_stress
                recording.append_rows(kept, regimes)
            for line in events[:happened].tolist():
                code, regime, clock, time, slip, spent = line[: array_layout.EVENT_POINT]
                point = _make_named_tuple_quickly(
                    MotionPoint, (*line[array_layout.EVENT_POINT : psis], tuple(line[psis:]))
                )
                if initial_imposed_stress is not None:
                    point = _add_to_stresses(point, point.psis[-1] - initial_imposed_stress)
                kind, spec = meanings[int(code)]
                name, work = regimes[int(regime)], others + int(spent)
                yield _make_named_tuple_quickly(
                    Event, (kind, spec, time, slip, point, name, work, clock)
                )
            work_meter.check_budget()
        if end != array_layout.MOTION_ENDED:
            raise _motion_stopped_error(end, state, regimes, stepper)


def _add_to_stresses(point: MotionPoint, stress_change: float) -> MotionPoint:
    return point._replace(
        spring_stress=point.spring_stress + stress_change,
        frictional_stress=point.frictional_stress + stress_change,
    )


def iterate_events_of_equations(
    equations: Equations,
    initial_unknowns: Numbers,
    tolerance: float,
    work_meter: WorkMeter,
    event_specs: Sequence[EventSpecification] = (),
    *,
    backward: bool = False,
    recording: Recording | None = None,
) -> Iterator[Event]:
    """Events along one system of equations from a state; against its clock if `backward`.

    A rigid slider has slip for its clock: a recording that asks for values has them at slips.
    """
    runner = MotionDriver(equations, engine=work_meter.engine)
    return runner.iterate_events(
        initial_unknowns, work_meter, event_specs, tolerance, backward=backward, recording=recording
    )


@cached_per_scene
def get_motion_driver(scene: Scene, engine: str, *, with_time: bool) -> MotionDriver:
    """What runs the motions of a scene."""
    return MotionDriver(
        equations_between_ruptures(scene, with_time=with_time),
        equations_in_rupture(scene, with_time=with_time) if scene.has_mass else None,
        engine=engine,
        unknowns_behind_fluid=len(scene.parts.fluid.unknowns)
        if scene.parts.loading.unknowns
        else 0,
        may_reverse=scene.parts.law.regularised,
        starts_at_point=1,
        may_terminate=1,
        has_clock=with_time,
    )


def _prepare_recording_tables(
    recording: Recording | None, equations: Equations, state_count: int
) -> tuple[int, np.ndarray, np.ndarray]:
    """Whether a chain of segments records, and when; the times or clocks at which to; and the table
    that the loop fills.
    """
    if recording is None:
        return _NO_RECORDING_TABLES
    if recording.sample_times is None:
        return (
            array_layout.RECORD_WITHIN_STEPS,
            np.empty(0),
            np.empty((_RECORDING_ROWS, FIRST_STATE_COLUMN + state_count)),
        )
    samples = recording.remaining_sample_times()
    rows = np.empty((len(samples) + 2 * SAMPLES_PER_STEP, FIRST_STATE_COLUMN + state_count))
    return (
        array_layout.RECORD_AT_CLOCKS if equations.is_rigid else array_layout.RECORD_AT_TIMES,
        samples,
        rows,
    )


def find_events_at_jump(
    point_before: MotionPoint,
    parameters_before: Numbers,
    point_after: MotionPoint,
    parameters_after: Numbers,
    event_specs: Sequence[EventSpecification],
) -> Iterator[tuple[EventSpecification, MotionPoint]]:
    """Events that are watched for and happen where a motion jumps from a point to another, with the
    numbers of the scene at both; and at which of them.
    """
    last, first = _pack_point(point_before).tolist(), _pack_point(point_after).tolist()
    table = (
        _pack_event_specifications(tuple(event_specs))[0]
        .reshape(-1, len(array_layout.SPECIFICATION_COLUMNS))
        .tolist()
    )
    for spec, row in zip(event_specs, table, strict=True):
        where = find_jump_side(row, last, parameters_before, first, parameters_after)
        if where != NO_EVENT:
            yield spec, point_before if where == BEFORE_JUMP else point_after


@lru_cache(maxsize=256)
def _pack_event_specifications(
    event_specs: tuple[EventSpecification, ...],
) -> tuple[np.ndarray, list[tuple[EventKind, EventSpecification | None]]]:
    """The table of event specifications, and what codes of events mean."""
    meanings = [*((spec.kind, spec) for spec in event_specs), *_UNREQUESTED_EVENTS]
    asked = np.zeros((len(event_specs), len(array_layout.SPECIFICATION_COLUMNS)))
    for row, spec in zip(asked, event_specs, strict=True):
        row[array_layout.SPEC_KIND], row[array_layout.SPEC_QUANTITY] = (
            _EVENT_KIND_CODES[spec.kind],
            _POINT_COLUMN_BY_QUANTITY[spec.quantity],
        )
        row[array_layout.SPEC_LEVEL], row[array_layout.SPEC_TERMINAL] = spec.level, spec.terminal
        row[array_layout.SPEC_MAY_DEFER] = spec.may_defer
    return asked.ravel(), meanings


def _pack_point(point: MotionPoint) -> np.ndarray:
    """A point as the loop has it."""
    return np.array((*point[:-1], *point.psis))


def _motion_stopped_error(
    return_code: int, motion_state: Any, regime_names: Sequence[str], stepper: Any
) -> MotionStopped:
    """Why a motion cannot go on."""
    if return_code == array_layout.TERMINATED:
        return termination_error(
            int(motion_state.get_state_field("termination")),
            motion_state.get_state_field("final_normal_stress"),
        )
    why = "step without length, or a state that is not finite"
    if return_code == array_layout.NO_STEP_POSSIBLE:
        why = stepper.failure if stepper else _STEP_TOO_SHORT_TEXT
    return MotionStopped(
        Status.INTEGRATION_FAILED,
        f"{regime_names[int(motion_state.get_state_field('regime'))]}: {why}",
    )
