"""Integration of a scene through its loading segments, as a series of events.

``integrate_events`` is the main function. Consecutive loading segments without a jump in stress
form a chain. The driver of the event loop integrates each chain, and ``integrate_events`` handles
the jumps in stress between the chains.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.events import Event, EventKind, EventSpecification
from rsfstudy.motion.initial_points import initial_point, point_after_loading_jump
from rsfstudy.motion.motion_driver import find_events_at_jump, get_motion_driver
from rsfstudy.motion.motion_driver import iterate_events_of_equations as iterate_events_of_equations
from rsfstudy.motion.recording import Recording
from rsfstudy.motion.regime_switching import compute_switch_thresholds
from rsfstudy.motion.work_meter import WorkMeter
from rsfstudy.parts import (
    LOADING,
    LOG_LOAD_VELOCITY,
    SEGMENT_END,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_START,
)
from rsfstudy.slider import (
    SINGLE_ENDLESS_SEGMENT_TABLE,
    MotionPoint,
    Numbers,
    Scene,
    largest_linear_growth_rate,
)


def integrate_events(
    scene: Scene,
    accuracy: Accuracy,
    work_meter: WorkMeter,
    event_specs: Sequence[EventSpecification] = (),
    *,
    start: MotionPoint | None = None,
    with_time: bool = False,
    recording: Recording | None = None,
    until: float = math.inf,
    resume_from: Event | None = None,
) -> Iterator[Event]:
    """Integrate a scene, starting immediately after its first loading step.

    Parameters
    ----------
    scene : Scene
        Scene to integrate.
    accuracy : Accuracy
        Requested accuracy.
    work_meter : WorkMeter
        Counter of right-hand side evaluations in each regime.
    event_specs : sequence of EventSpecification, default: ()
        Requested events.
    start : MotionPoint, optional
        Initial point within the last loading segment. By default, the motion starts in the first
        segment, from steady sliding at V_* or from the initial stress and state of the scene.
    with_time : bool, default: False
        If True, time is one of the unknowns. If False, the times and slips of events may be NaN,
        and the integration needs fewer right-hand side evaluations.
    recording : Recording, optional
        Object that records the motion.
    until : float, default: inf
        Time at which the motion ends, in D_c/V_*.
    resume_from : Event, optional
        Last event of an earlier motion of the scene. The motion continues from this event.

    Yields
    ------
    Event
        Events in the order of their occurrence.

    Raises
    ------
    MotionStopped
        If the motion cannot continue. The status is ``normal_stress_lost``,
        ``shear_stress_reversed``, ``locked``, ``slip_stopped`` or ``slip_rate_unbounded`` if the
        slider reaches a point beyond which the equations are not valid. The status is
        ``work_budget_spent`` if the budget is exhausted. The status is ``integration_failed`` if
        the stepper fails or a value is not finite.
    """
    chains: Sequence[tuple[Scene, np.ndarray]]
    chains = (
        scene.continuous_segments
        if start is None
        else ((scene.segment_scene(-1), SINGLE_ENDLESS_SEGMENT_TABLE),)
    )
    with_time = with_time or until < math.inf or len(chains) > 1 or len(chains[0][1]) > 1
    settling_is_terminal = any(
        spec.terminal for spec in event_specs if spec.kind is EventKind.SETTLED
    )
    time, slip, before, told = 0.0, 0.0, None, scene.parts.loading.reported_segment_count
    if resume_from is not None:
        chains, start = _find_remaining_segment_chains(scene, resume_from)
        time, slip = resume_from.time, resume_from.slip
    for number, (acting, table) in enumerate(chains):
        if start is None:
            start = initial_point(acting)
        elif number:
            start = point_after_loading_jump(acting, start)
        can_settle = number == len(chains) - 1 and not acting.parts.loading.unknowns
        # A terminal settling event would end the motion, even near unstable steady sliding.
        if can_settle and settling_is_terminal:
            can_settle = not _is_steady_sliding_unstable(scene)
        asked = event_specs if can_settle else _without_settling_events(event_specs)
        table = _truncate_segments_at(table, until)
        end = float(table[-1, SEGMENT_END])
        motion = get_motion_driver(acting, work_meter.engine, with_time=with_time).iterate_events(
            start,
            work_meter,
            asked,
            accuracy.local_tolerance,
            duration_start_time_and_slip=(
                float(table[0, SEGMENT_END]) - time if with_time else math.inf,
                time,
                slip,
            ),
            switch_thresholds=compute_switch_thresholds(acting, accuracy),
            recording=recording,
            kinks_and_reported_count=(table[1:], told),
            initial_imposed_stress=acting.parameter_values[LOADING + 2]
            if acting.parts.loading.has_load_point_unknown
            else None,
        )
        if can_settle and not settling_is_terminal:
            motion = _drop_settling_if_unstable(scene, motion)
        if before is None and end == math.inf:  # The motion consists of a single chain.
            yield from motion
            return
        for last in motion:
            if before is not None and last.kind is EventKind.START:
                for event in _iterate_segment_start_events(last, before, acting, asked):
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
                recording.clip_recorded_times(end)
        if end >= until:
            yield last
            return
        # The parameters of the scene belong to the first segment of the chain.
        numbers = list(acting.parameter_values)
        numbers[LOG_LOAD_VELOCITY] = float(table[-1, SEGMENT_LOG_VELOCITY])
        start, before = last.point, (last.point, tuple(numbers))
        time, slip = last.time, last.slip


def _find_remaining_segment_chains(
    scene: Scene, resume_from: Event
) -> tuple[Sequence[tuple[Scene, np.ndarray]], MotionPoint]:
    """Return the segment chains after the end of a motion, and the initial point.

    If the motion ended at a jump in stress, the initial point is the point after this jump.
    """
    first, point, left = 0, resume_from.point, []
    for acting, table in scene.continuous_segments:
        number = int(np.searchsorted(table[:, SEGMENT_START], resume_from.time, side="right")) - 1
        if number > 0:
            acting = scene.segment_scene(first + number)
        if first and number == 0 and table[0, SEGMENT_START] == resume_from.time:
            point = point_after_loading_jump(acting, point)
        rest = table[max(number, 0) :].copy()
        rest[0, SEGMENT_START] = max(rest[0, SEGMENT_START], resume_from.time)
        if rest[-1, SEGMENT_END] > resume_from.time:
            left.append((acting, rest))
        first += len(table)
    return left, point


def _truncate_segments_at(segment_table: np.ndarray, end_time: float) -> np.ndarray:
    """Return the loading segments of a chain up to an end time."""
    if end_time == math.inf or segment_table[-1, SEGMENT_END] <= end_time:
        return segment_table
    count = max(int(np.searchsorted(segment_table[:, SEGMENT_START], end_time)), 1)
    cut = segment_table[:count].copy()
    cut[-1, SEGMENT_END] = min(end_time, cut[-1, SEGMENT_END])
    return cut


def _iterate_segment_start_events(
    event: Event,
    point_and_parameters_before: tuple[MotionPoint, Numbers],
    segment_scene: Scene,
    event_specs: Sequence[EventSpecification],
) -> Iterator[Event]:
    """Yield the events at the start of a segment chain, except the first chain.

    The first event is the start of the loading segment. The following events are requested events
    that occur at the jump in stress.
    """
    yield event._replace(kind=EventKind.SEGMENT)
    for spec, point in find_events_at_jump(
        *point_and_parameters_before, event.point, segment_scene.parameter_values, event_specs
    ):
        # The slip of the start event is valid for both points, because slip never jumps.
        yield event._replace(kind=spec.kind, specification=spec, point=point)


def _drop_settling_if_unstable(scene: Scene, motion: Iterator[Event]) -> Iterator[Event]:
    """Yield the events of a motion, without settling events at unstable steady sliding.

    The stability is computed at the first settling event, because most motions have none.
    """
    for event in motion:
        if event.kind is not EventKind.SETTLED or not _is_steady_sliding_unstable(scene):
            yield event


def _is_steady_sliding_unstable(scene: Scene) -> bool:
    """Return True if perturbations of steady sliding grow in the last loading segment."""
    if scene.log_load_velocity == -math.inf:
        return False
    growth = largest_linear_growth_rate(scene.segment_scene(-1), scene.log_load_velocity)
    return growth is not None and growth.is_positive


def _without_settling_events(event_specs: Sequence[EventSpecification]) -> list[EventSpecification]:
    """Remove the settling events from a sequence of event specifications."""
    return [spec for spec in event_specs if spec.kind is not EventKind.SETTLED]
