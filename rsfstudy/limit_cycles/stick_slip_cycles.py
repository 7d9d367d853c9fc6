"""Stick-slip cycles, which are assembled from the events of a motion.

A cycle extends from one maximum of spring stress to the next maximum. At a maximum of spring
stress, the slip rate V rises through the load point velocity V_0. The main function is
``iterate_stick_slip_cycles``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from rsfstudy.measure_base import is_steady_sliding_linearly_stable
from rsfstudy.motion import (
    Event,
    EventKind,
    EventSpecification,
    Integrator,
    MotionRecorder,
    approach_to_steady_state,
    fall,
    maximum,
    minimum,
    rise,
)
from rsfstudy.slider import MotionPoint, Scene

LN10 = math.log(10.0)
#: Number of main results of a cycle.
PRIMARY_OUTPUT_COUNT_PER_CYCLE = 5
#: Kinds of events. They are module variables because attribute lookups would take as long as all
#: other operations on an event.
_START, _RISE, _FALL = EventKind.START, EventKind.RISE, EventKind.FALL
_SEGMENT, _SETTLED = EventKind.SEGMENT_START, EventKind.SETTLED
_get_log_slip_rate, _get_spring_stress = attrgetter("log_slip_rate"), attrgetter("spring_stress")

#: Two limits. A cycle is treated as steady sliding if its range of ln V is below the first limit. A
#: motion may be approaching steady sliding if the range of ln V has decreased over more successive
#: cycles than the second limit.
MIN_LOG_SLIP_RATE_RANGE, _MIN_SHRINKING_CYCLES = 1e-3, 30
#: A motion has settled if its distance from steady sliding is less than this fraction of the
#: largest distance from steady sliding during the motion.
_SETTLED_DISTANCE_OVER_MAX_DISTANCE = 1e-6


class StickSlipCycle(NamedTuple):
    """One stick-slip cycle.

    Times are in units of D_c/V_*, and stresses are in units of sigma_*.

    Parameters
    ----------
    recurrence_interval : float
        Time from the first to the second maximum of spring stress.
    max_spring_stress_minus_steady : float
        Deviation of spring stress from steady sliding at V_*, at the second maximum.
    min_spring_stress_minus_steady : float
        Deviation of spring stress at its minimum.
    peak_rate_spring_stress_minus_steady : float
        Deviation of spring stress at the peak slip rate.
    friction_coefficient_at_peak_rate : float
        Friction coefficient at the peak slip rate.
    min_log_slip_rate : float
        Smallest value of ln(V/V_*) during the cycle.
    max_log_slip_rate : float
        Largest value of ln(V/V_*) during the cycle.
    motion_point_at_slip_arrest : MotionPoint
        First point after the rupture at which V is below V_0 and friction balances the spring. If
        friction never balances the spring after the rupture, the attribute contains the point with
        the lowest slip rate.
    motion_point_at_slowest_slip : MotionPoint
        Point with the lowest slip rate.
    motion_point_at_start : MotionPoint
        Maximum of spring stress at which the cycle begins.
    motion_point_at_end : MotionPoint
        Maximum of spring stress at which the cycle ends.
    """

    recurrence_interval: float
    max_spring_stress_minus_steady: float
    min_spring_stress_minus_steady: float
    peak_rate_spring_stress_minus_steady: float
    friction_coefficient_at_peak_rate: float
    min_log_slip_rate: float
    max_log_slip_rate: float
    motion_point_at_slip_arrest: MotionPoint
    motion_point_at_slowest_slip: MotionPoint
    motion_point_at_start: MotionPoint
    motion_point_at_end: MotionPoint

    @property
    def log_slip_rate_range(self) -> float:
        """Range of ln V during the cycle."""
        return self.max_log_slip_rate - self.min_log_slip_rate

    def compute_primary_output_values(self) -> tuple[float, ...]:
        """Return the main results of the cycle.

        Stress drops are measured from the spring stress at the beginning of the cycle, because the
        next cycle may begin at a different stress. The static stress drop is the decrease to the
        lowest spring stress, and the dynamic stress drop is the decrease to the spring stress at
        the peak slip rate.

        Returns
        -------
        tuple of float
            Recurrence interval, static stress drop, dynamic stress drop, and decimal logarithms of
            the smallest and of the largest V/V_*.
        """
        highest = self.motion_point_at_start.spring_stress
        drops = (
            highest - self.min_spring_stress_minus_steady,
            highest - self.peak_rate_spring_stress_minus_steady,
        )
        return (
            self.recurrence_interval,
            *drops,
            self.min_log_slip_rate / LN10,
            self.max_log_slip_rate / LN10,
        )


def iterate_stick_slip_cycles(
    scene: Scene,
    integrator: Integrator,
    start_point: MotionPoint | None,
    recording: MotionRecorder | None = None,
) -> Iterator[StickSlipCycle | None]:
    """Iterate over the cycles of a motion.

    Parameters
    ----------
    scene : Scene
        Scene with a moving load point.
    integrator : Integrator
        Integrator with the requested accuracy.
    start_point : MotionPoint or None
        Point at which the motion starts. If None, the motion starts with the step of the scene, and
        the part of the motion before the first maximum of spring stress is skipped.
    recording : MotionRecorder, optional
        Recording to which the motion is added.

    Yields
    ------
    StickSlipCycle or None
        The next cycle. If the last item is None, the motion has settled to steady sliding.
    """
    begin, begun, fallen, seen = None, 0.0, start_point is None, list[Event]()
    ahead = 0 if start_point else scene.parts.loading.reported_segment_start_count
    swings, asked = list[float](), _build_cycle_event_specifications(scene.log_load_velocity)
    motion = integrator.follow(scene, asked, start=start_point, with_time=True, recording=recording)
    for event in motion:
        kind = event.kind
        if kind is _SEGMENT:
            begin, fallen, seen, ahead = None, True, [], ahead - 1
        if ahead:
            continue
        if kind is _SETTLED and is_steady_sliding_linearly_stable(scene):
            yield None
            return
        if kind is _START and start_point is not None:
            begin = event.point
        fallen = fallen or kind is _FALL
        seen.append(event)
        if kind is not _RISE or not fallen:
            continue
        if begin is not None:
            cycle = _build_cycle_from_events(begin, begun, seen)
            swings.append(cycle.log_slip_rate_range)
            if (
                swings[-1] < MIN_LOG_SLIP_RATE_RANGE
                or _are_log_rate_ranges_approaching_zero(swings)
            ) and is_steady_sliding_linearly_stable(scene):
                yield None
                return
            yield cycle
        begin, begun, fallen, seen = event.point, event.time, False, []


def suggest_raising_event_limit(event_limit: int, option_name: str = "events") -> str:
    """Return a sentence for error messages that advises the user to raise the event limit.

    Parameters
    ----------
    event_limit : int
        Present limit of the number of events.
    option_name : str, default: "events"
        Name of the field that holds the limit.

    Returns
    -------
    str
        Advice with the command-line option and the field.
    """
    return f"To compute more events, pass --set {option_name}={2 * event_limit} ({option_name}=)"


def extract_recorded_rows_of_cycles(
    scene: Scene, cycles: Sequence[StickSlipCycle], recording: MotionRecorder | None
) -> np.ndarray:
    """Return the recorded samples of successive cycles.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    cycles : sequence of StickSlipCycle
        Successive cycles.
    recording : MotionRecorder or None
        Recording of the cycles. If None, the record contains only the beginning and the end of the
        cycles.

    Returns
    -------
    ndarray, shape (n, columns)
        Recorded samples. The columns are documented in ``MotionRecorder.as_table``.

    Notes
    -----
    The slip during the cycles is the load point displacement minus the increase in spring
    elongation, :math:`V_0 T - (f_1 - f_0)/K`. Here :math:`T` is the duration of the cycles, and
    :math:`f_0` and :math:`f_1` are the spring stresses at the beginning and at the end.
    """
    begin, end = cycles[0].motion_point_at_start, cycles[-1].motion_point_at_end
    passed = math.fsum(cycle.recurrence_interval for cycle in cycles)
    slip = (
        scene.load_velocity * passed - (end.spring_stress - begin.spring_stress) / scene.stiffness
    )
    last = MotionRecorder.convert_point_to_row(scene, passed, slip, end, 0)
    if recording is None:
        return np.stack([MotionRecorder.convert_point_to_row(scene, 0.0, 0.0, begin, 0), last])
    # The last integration step extends beyond the end of the last cycle.
    return recording.as_table_up_to_row(scene, last)


@lru_cache(maxsize=256)
def _build_cycle_event_specifications(log_load_velocity: float) -> tuple[EventSpecification, ...]:
    """Return specifications of the events from which cycles are assembled."""
    return (
        maximum("log_slip_rate", may_report_later=True),
        minimum("log_slip_rate", may_report_later=True),
        rise("log_slip_rate", log_load_velocity),
        fall("log_slip_rate", log_load_velocity, may_report_later=True),
        approach_to_steady_state(_SETTLED_DISTANCE_OVER_MAX_DISTANCE),
    )


def _are_log_rate_ranges_approaching_zero(log_slip_rate_ranges: list[float]) -> bool:
    """Return True if the range of ln V decreases from cycle to cycle and approaches zero.

    The ranges of ln V in the last three cycles decrease by d_1 and then by d_2. These decreases are
    extrapolated as a geometric series, which gives a further decrease of d_2**2/(d_1 - d_2). Near
    the onset of stick-slip, the ranges of ln V decrease slowly towards a positive limit instead.
    """
    if len(log_slip_rate_ranges) <= _MIN_SHRINKING_CYCLES or not all(
        y < x for x, y in pairwise(log_slip_rate_ranges[-_MIN_SHRINKING_CYCLES:])
    ):
        return False
    previous, latest = (
        log_slip_rate_ranges[-3] - log_slip_rate_ranges[-2],
        log_slip_rate_ranges[-2] - log_slip_rate_ranges[-1],
    )
    still_to_come = latest * latest / (previous - latest) if previous > latest else math.inf
    return log_slip_rate_ranges[-1] - still_to_come < 0.1 * log_slip_rate_ranges[-1]


def _build_cycle_from_events(
    start_point: MotionPoint, start_time: float, events: Sequence[Event]
) -> StickSlipCycle:
    """Assemble the cycle that ends with the last event."""
    points, end = [event.point for event in events], events[-1]
    fastest, rested = max(points, key=_get_log_slip_rate), min(points, key=_get_log_slip_rate)
    return StickSlipCycle(
        recurrence_interval=end.time - start_time,
        max_spring_stress_minus_steady=end.point.spring_stress,
        min_spring_stress_minus_steady=min(map(_get_spring_stress, points)),
        peak_rate_spring_stress_minus_steady=fastest.spring_stress,
        friction_coefficient_at_peak_rate=fastest.friction_coefficient,
        min_log_slip_rate=rested.log_slip_rate,
        max_log_slip_rate=fastest.log_slip_rate,
        motion_point_at_slip_arrest=_find_slip_arrest_point(events) or rested,
        motion_point_at_slowest_slip=rested,
        motion_point_at_start=start_point,
        motion_point_at_end=end.point,
    )


def _find_slip_arrest_point(events: Sequence[Event]) -> MotionPoint | None:
    """Return the first point after the rupture at which friction balances the spring stress.

    The result is None if the cycle has no such point.
    """
    fallen = False
    for event in events:
        fallen = fallen or event.kind is _FALL
        if fallen and event.regime != Scene.RUPTURE_REGIME:
            return event.point
    return None
