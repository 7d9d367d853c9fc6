"""Loading histories of records.

The function ``build_loading_history`` converts the steps of a record, or the recorded rows, to the
loading of a model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import isotonic_regression

from rsfstudy.fitting.record import Record
from rsfstudy.fitting.velocity_steps import LoadingStep

#: Number of constant-velocity segments that approximate a ramp of the load point velocity. The load
#: point displacement is exact at the end of each segment.
_CONSTANT_VELOCITY_SEGMENTS_PER_RAMP = 16


def build_loading_history(
    record: Record, start_time: float, end_time: float, *, use_recorded_rows: bool
) -> np.ndarray:
    """Return the loading history of a record between two times.

    Before the first segment of the loading history, the slider slides steadily. The slip rate
    during this steady sliding is the load point velocity before the first step.

    Parameters
    ----------
    record : Record
        Record with the steps and the rows.
    start_time, end_time : float
        Times in s.
    use_recorded_rows : bool
        If True, each row of the record begins a segment. The recorded displacement is first
        replaced by the closest nondecreasing sequence of displacements. If False, the load point
        velocity and the normal stress are constant between the steps, and change at a constant rate
        during a step.

    Returns
    -------
    ndarray, shape (segments, 4)
        Segments with four columns: the start time in s, the load point velocity in um/s, the ratio
        of the normal stress to the initial normal stress, and the rate of change of the normal
        stress ratio in 1/s.

    Raises
    ------
    InvalidValue
        If ``use_recorded_rows`` is True and the record has no rows between the two times.
    """
    steps = find_loading_steps_between(record, start_time, end_time)
    if use_recorded_rows:
        part, first = record.window(start_time, end_time), steps[0] if steps else None
        if first is None:
            return _build_loading_history_from_rows(part, 0.0, math.nan)
        sliding = part.time < first.start
        stress = part.columns.get("normal_stress", np.array([]))[: int(sliding.sum())]
        return _build_loading_history_from_rows(
            part, first.velocity_before, float(stress.mean()) if stress.size else math.nan
        )
    return build_stepwise_loading_history(start_time, steps)


def find_loading_steps_between(
    record: Record, start_time: float, end_time: float
) -> list[LoadingStep]:
    """Return the steps of a record between two times.

    Parameters
    ----------
    record : Record
        Record with the steps.
    start_time, end_time : float
        Times in s.

    Returns
    -------
    list of LoadingStep
        Steps that begin after ``start_time`` and end before ``end_time``.
    """
    return [
        step for step in record.loading_steps if start_time < step.start and step.end < end_time
    ]


def build_stepwise_loading_history(
    start_time: float, loading_steps: Sequence[LoadingStep]
) -> np.ndarray:
    """Return a loading history with constant loading between steps.

    Parameters
    ----------
    start_time : float
        Start of the first segment in s.
    loading_steps : sequence of LoadingStep
        Steps in order of time.

    Returns
    -------
    ndarray, shape (segments, 4)
        Segments in the same format as the result of ``build_loading_history``.
    """
    pieces, level = (
        [(start_time, loading_steps[0].velocity_before if loading_steps else 0.0, 1.0, 0.0)],
        1.0,
    )
    for step in loading_steps:
        lasts, rises = step.end - step.start, level * (step.normal_stress_ratio - 1.0)
        for part, speed in _list_velocities_during_step(step):
            at = step.start + part * lasts
            pieces.append((float(at), float(speed), level + part * rises, rises / lasts))
        level += rises
        pieces.append((step.end, step.velocity_after, level, 0.0))
    return np.array(pieces)


def _list_velocities_during_step(step: LoadingStep) -> list[tuple[float, float]]:
    """Return the load point velocities during a step.

    Returns
    -------
    list of (float, float)
        Constant-velocity segments of the step. Each segment is a pair of two numbers. The first
        number is the start of the segment as a fraction of the step duration. The second number is
        the velocity in um/s. The list is empty if the step is immediate.
    """
    lasts = step.end - step.start
    if not lasts > 0.0:
        return []
    if step.velocity_profile:
        return [(begins / lasts, speed) for begins, speed in step.velocity_profile]
    count = _CONSTANT_VELOCITY_SEGMENTS_PER_RAMP if step.changes_velocity else 1
    parts = (np.arange(count) / count).tolist()
    return [
        (
            p,
            step.velocity_before
            + (p + 0.5 / _CONSTANT_VELOCITY_SEGMENTS_PER_RAMP)
            * (step.velocity_after - step.velocity_before),
        )
        for p in parts
    ]


def _build_loading_history_from_rows(
    record: Record, initial_velocity: float, initial_normal_stress: float
) -> np.ndarray:
    """Return a loading history with one segment per row of the record.

    Parameters
    ----------
    record : Record
        Record with the rows of the loading history.
    initial_velocity : float
        Load point velocity of the first segment in um/s.
    initial_normal_stress : float
        Normal stress in Pa by which the recorded normal stress is divided. If NaN, the normal
        stress of the first row is used.

    Returns
    -------
    ndarray, shape (rows, 4)
        Segments in the same format as the result of ``build_loading_history``.
    """
    lasts = np.diff(record.time)
    moved = isotonic_regression(record.columns["displacement"]).x
    table = np.zeros((len(record), 4))
    table[:, 0], table[:, 2] = record.time, 1.0
    table[:-1, 1] = np.diff(moved) / lasts
    table[-1, 1], table[0, 1] = table[-2, 1], initial_velocity
    if "normal_stress" in record.columns:
        stress = record.columns["normal_stress"]
        table[:, 2] = stress / (initial_normal_stress if initial_normal_stress > 0.0 else stress[0])
        table[0, 2] = 1.0  # The simulated motion starts from steady sliding.
        table[:-1, 3] = np.diff(table[:, 2]) / lasts
    return table
