"""Functions that split the loading at stress jumps and find the events at each jump."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from rsfstudy.motion.event_spec_table import find_events_at_stress_jump
from rsfstudy.motion.initial_points import compute_point_after_loading_jump
from rsfstudy.motion.integration_events import Event, EventKind, EventSpecification
from rsfstudy.parts import (
    LOADING,
    SEGMENT_END,
    SEGMENT_NOISE_RATE,
    SEGMENT_START,
    SEGMENT_STRESS_FALL,
    SEGMENT_STRESS_RATE,
)
from rsfstudy.slider import SINGLE_ENDLESS_SEGMENT_TABLE, FloatTuple, MotionPoint, Scene


def split_segments_at_stress_jumps(
    scene: Scene, *, only_last_segment: bool
) -> Sequence[tuple[Scene, np.ndarray]]:
    """Split the loading segments of a scene at jumps in stress.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    only_last_segment : bool
        If True, the motion starts in the last loading segment. The last loading segment has no end
        time.

    Returns
    -------
    sequence of (Scene, ndarray)
        Scene and segment table of each chain.
    """
    if only_last_segment:
        return ((scene.segment_scene(-1), SINGLE_ENDLESS_SEGMENT_TABLE),)
    return scene.segment_sequences_without_jumps


def find_remaining_loading_segments(
    scene: Scene, last_event: Event
) -> tuple[Sequence[tuple[Scene, np.ndarray]], MotionPoint]:
    """Return the chains of loading segments that remain when a motion is resumed.

    If the motion ended at a jump in stress, the resumed motion starts after this jump.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    last_event : Event
        Last event of the motion.

    Returns
    -------
    chains : list of (Scene, ndarray)
        Scene and segment table of each remaining chain.
    point : MotionPoint
        Point at which the motion continues.
    """
    first, point, left = 0, last_event.point, []
    for acting, table in scene.segment_sequences_without_jumps:
        number = int(np.searchsorted(table[:, SEGMENT_START], last_event.time, side="right")) - 1
        if number > 0:
            acting = scene.segment_scene(first + number)
        if first and number == 0 and table[0, SEGMENT_START] == last_event.time:
            point = compute_point_after_loading_jump(acting, point)
        rest = table[max(number, 0) :].copy()
        rest[0, SEGMENT_START] = max(rest[0, SEGMENT_START], last_event.time)
        if rest[-1, SEGMENT_END] > last_event.time:
            left.append((acting, rest))
        first += len(table)
    return left, point


def truncate_loading_segments_at_time(segment_table: np.ndarray, end_time: float) -> np.ndarray:
    """Truncate a table of loading segments at an end time.

    Parameters
    ----------
    segment_table : ndarray
        Table with one row per loading segment.
    end_time : float
        End time in D_c/V_*.

    Returns
    -------
    ndarray
        Rows of the segments that start before the end time.
    """
    if end_time == math.inf or segment_table[-1, SEGMENT_END] <= end_time:
        return segment_table
    count = max(int(np.searchsorted(segment_table[:, SEGMENT_START], end_time)), 1)
    cut = segment_table[:count].copy()
    cut[-1, SEGMENT_END] = min(end_time, cut[-1, SEGMENT_END])
    return cut


def prepare_noisy_loading_segment(
    scene: Scene, start_point: MotionPoint, segment_table: np.ndarray
) -> tuple[MotionPoint, FloatTuple, np.ndarray, Iterator[np.ndarray]]:
    """Compute the initial values and the segment tables of a loading segment with noise.

    Parameters
    ----------
    scene : Scene
        Scene with noise during the loading segment.
    start_point : MotionPoint
        First point of the loading segment.
    segment_table : ndarray
        Table with a single row, which describes the loading segment without noise.

    Returns
    -------
    start_point : MotionPoint
        First point. Its normal stress includes the noise.
    parameters : tuple of float
        Parameters that apply during the first row of ``table``.
    table : ndarray
        First block of the segment table with noise.
    further_tables : iterator of ndarray
        Further blocks of the segment table.
    """
    begin, end = (float(segment_table[0, column]) for column in (SEGMENT_START, SEGMENT_END))
    tables = scene.parts.loading_noise.iterate_noisy_loading_segment_blocks(
        begin, end, scene.load_velocity
    )
    table = next(tables)
    parameters = list(scene.parameter_values)
    parameters[-1] = float(table[0, SEGMENT_NOISE_RATE])
    if scene.parts.loading_noise.unknowns:
        parameters[LOADING] = float(table[0, SEGMENT_STRESS_RATE])
        start_point = start_point._replace(
            psis=(*start_point.psis[:-1], float(table[0, SEGMENT_STRESS_FALL]))
        )
    return start_point, tuple(parameters), table, tables


def iterate_segment_start_events(
    segment_entry_event: Event,
    point_and_parameters_before: tuple[MotionPoint, FloatTuple],
    segment_scene: Scene,
    event_specs: Sequence[EventSpecification],
) -> Iterator[Event]:
    """Yield the events at the stress jump before a chain of loading segments.

    The first chain of a motion does not start with a jump in stress, so the function is not called
    for the first chain. The first event is the start of the loading segment. The other events are
    the requested events that occur at the jump in stress.

    Parameters
    ----------
    segment_entry_event : Event
        Event at which the motion enters the chain.
    point_and_parameters_before : tuple of (MotionPoint, tuple of float)
        Last point and last parameters of the previous chain.
    segment_scene : Scene
        Scene of the first segment of the chain.
    event_specs : sequence of EventSpecification
        Requested events.

    Yields
    ------
    Event
        Events at the start of the chain.
    """
    yield segment_entry_event._replace(kind=EventKind.SEGMENT_START)
    for spec, point in find_events_at_stress_jump(
        *point_and_parameters_before,
        segment_entry_event.point,
        segment_scene.parameter_values,
        event_specs,
    ):
        # The slip of the start event is valid for both points, because slip never jumps.
        yield segment_entry_event._replace(kind=spec.kind, specification=spec, point=point)


def select_event_specs_that_can_occur(
    scene: Scene,
    first_segment_scene: Scene,
    event_specs: Sequence[EventSpecification],
    *,
    includes_last_segment: bool,
) -> Sequence[EventSpecification]:
    """Select the requested events that can occur in a chain of loading segments.

    The motion can settle only in the last chain. Settling events are omitted if the load point
    oscillates or if the loading has noise. If steady sliding is unstable and a settling event is
    terminal, all settling events are also omitted, because the terminal event would end the motion.
    If no settling event is terminal, ``remove_settling_events_if_unstable`` removes the events when
    they occur.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    first_segment_scene : Scene
        Scene of the first segment of the chain.
    event_specs : sequence of EventSpecification
        Requested events.
    includes_last_segment : bool
        True if no other chain follows.

    Returns
    -------
    sequence of EventSpecification
        Events to detect.
    """
    settling = [spec for spec in event_specs if spec.kind is EventKind.SETTLED]
    may_settle = includes_last_segment and not first_segment_scene.parts.loading.unknowns
    may_settle = may_settle and not first_segment_scene.parts.loading_noise.is_active
    if may_settle and any(spec.terminal for spec in settling):
        may_settle = not _is_steady_sliding_unstable(scene)
    if may_settle or not settling:
        return event_specs
    return [spec for spec in event_specs if spec not in settling]


def remove_settling_events_if_unstable(
    scene: Scene, motion_events: Iterator[Event]
) -> Iterator[Event]:
    """Yield the events of a motion, but omit settling events if steady sliding is unstable.

    The stability is computed only if the motion has a settling event. Most motions do not have
    settling events.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    motion_events : iterator of Event
        Events of the motion.

    Yields
    ------
    Event
        Events of the motion. Settling events are omitted if steady sliding is unstable.
    """
    for event in motion_events:
        if event.kind is not EventKind.SETTLED or not _is_steady_sliding_unstable(scene):
            yield event


def _is_steady_sliding_unstable(scene: Scene) -> bool:
    """Return True if steady sliding is unstable in the last loading segment."""
    if scene.log_load_velocity == -math.inf:
        return False
    growth = scene.segment_scene(-1).compute_largest_linear_growth_rate(scene.log_load_velocity)
    return growth is not None and growth.is_positive
