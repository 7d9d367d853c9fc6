"""Detection of normal stress steps in a record.

A step is a change from one constant normal stress to another constant normal stress. The algorithm
compares the mean normal stress in a window of rows with the mean normal stress in the previous
window. A step is detected if the two means differ by at least 2 % and by far more than the typical
difference between successive windows. The typical difference between successive windows includes
the effects of correlated noise and of a drift of the whole record. A ramp between two constant
normal stresses is a step with a finite duration. A drift that continues to the beginning or the end
of the record is not a step.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import find_objects, label

from rsfstudy.fitting.velocity_steps import LoadingStep

#: Smallest change in normal stress that is detected as a step. The first value is relative to the
#: normal stress. The second value is relative to a robust standard deviation of the differences
#: between successive windows.
MIN_RELATIVE_NORMAL_STRESS_CHANGE, _MIN_NORMAL_STRESS_CHANGE_SIGMAS = 0.02, 6.0
#: Largest difference between the normal stress in a short window and the normal stress in a long
#: window next to a change in normal stress. The difference is relative to the change. If the
#: difference is larger, the change belongs to a longer ramp.
_MAX_STRESS_DRIFT_OVER_STRESS_CHANGE = 0.25
#: A difference between the normal stresses of successive windows belongs to a step if it exceeds
#: this fraction of the smallest detectable change.
_MIN_STEP_OVER_DETECTABLE_STRESS_CHANGE = 0.4
#: Settings of the step detection: the largest number of rows, the numbers of windows per record,
#: and the smallest number of rows per window. Longer records are first averaged over blocks of
#: rows.
_MAX_ROWS_FOR_STEP_DETECTION, _RECORD_PARTITION_COUNTS, _MIN_ROWS_PER_RECORD_PART = (
    20_000,
    (400, 100, 25),
    8,
)
#: A ramp is fitted to the rows in which the change in normal stress is between these two fractions
#: of the total change. The last value is the smallest number of rows for the fit.
_RAMP_FIT_CHANGE_FRACTIONS, _MIN_RAMP_ROWS = (0.1, 0.9), 3
#: Ratio of the standard deviation to the median absolute deviation for Gaussian noise.
_STANDARD_DEVIATION_PER_MAD = 1.4826


class NormalStressStep(NamedTuple):
    """Step of normal stress, during which the normal stress changes at a constant rate.

    Parameters
    ----------
    start_time, end_time : float
        Times in s at which the change begins and ends.
    normal_stress_before, normal_stress_after : float
        Normal stresses in Pa before and after the change.
    """

    start_time: float
    end_time: float
    normal_stress_before: float
    normal_stress_after: float


def find_normal_stress_steps(time: np.ndarray, normal_stress: np.ndarray) -> list[NormalStressStep]:
    """Detect the steps of normal stress in a record.

    Parameters
    ----------
    time, normal_stress : ndarray, shape (rows,)
        Times in s and normal stresses in Pa.

    Returns
    -------
    list of NormalStressStep
        Steps in order of time. Changes in normal stress of less than 2 % are ignored.
    """
    every = max(1, math.ceil(len(time) / _MAX_ROWS_FOR_STEP_DETECTION))
    count = len(time) // every * every
    t, s = (v[:count].reshape(-1, every).mean(axis=1) for v in (time, normal_stress))
    found: list[tuple[slice, NormalStressStep]] = []
    windows = sorted(
        {max(len(t) // parts, _MIN_ROWS_PER_RECORD_PART) for parts in _RECORD_PARTITION_COUNTS}
    )
    for window, longer in itertools.pairwise([*windows, 0]):
        for rows in _find_stress_level_changes(s, window):
            if any(rows.start < other.stop and other.start < rows.stop for other, _ in found):
                continue
            before, after = _compute_median_stress_beside_change(s, rows, window, window)
            lasting = (
                _compute_median_stress_beside_change(s, rows, window, longer)
                if longer
                else (before, after)
            )
            change = abs(after - before)
            goes_on = (
                max(abs(before - lasting[0]), abs(after - lasting[1]))
                > _MAX_STRESS_DRIFT_OVER_STRESS_CHANGE * change
            )
            if change > MIN_RELATIVE_NORMAL_STRESS_CHANGE * abs(before) and not goes_on:
                found.append((rows, _fit_linear_stress_ramp(t[rows], s[rows], before, after)))
    return sorted(step for _rows, step in found)


def _compute_median_stress_beside_change(
    stress: np.ndarray, change_rows: slice, window_rows: int, median_row_count: int
) -> tuple[float, float]:
    """Compute the median normal stress before and after a change.

    The argument ``median_row_count`` is the number of rows in each median.
    """
    first, last = change_rows.start + window_rows, change_rows.stop - window_rows
    before, after = (
        stress[max(first - median_row_count, 0) : first],
        stress[last : last + median_row_count],
    )
    return float(np.median(before)), float(np.median(after))


def _find_stress_level_changes(stress: np.ndarray, window_rows: int) -> list[slice]:
    """Find the changes in mean normal stress for one window length.

    Returns
    -------
    list of slice
        Row range of each change, including one window of nearly constant stress before and after
        the change.
    """
    if len(stress) < 4 * window_rows:
        return []
    sums = np.concatenate([[0.0], np.cumsum(stress - stress.mean())])
    change = (
        sums[2 * window_rows :] - 2.0 * sums[window_rows:-window_rows] + sums[: -2 * window_rows]
    )
    change = change / window_rows - np.median(change) / window_rows
    spread = _STANDARD_DEVIATION_PER_MAD * float(np.median(np.abs(change)))
    least = max(
        MIN_RELATIVE_NORMAL_STRESS_CHANGE * abs(float(np.mean(stress))),
        _MIN_NORMAL_STRESS_CHANGE_SIGMAS * spread,
    )
    found: list[slice] = []
    for signed in (change, -change):
        joined: list[slice] = []
        for (rows,) in find_objects(
            label(signed > _MIN_STEP_OVER_DETECTABLE_STRESS_CHANGE * least)[0]
        ):
            # Noise may interrupt a ramp.
            if joined and rows.start < joined[-1].stop + window_rows:
                joined[-1] = slice(joined[-1].start, rows.stop)
            elif signed[rows].max() > least:
                joined.append(rows)
        found += joined
    # A change at the beginning or the end of the record does not connect two constant normal
    # stresses.
    inside = [rows for rows in found if rows.start > 0 and rows.stop < len(change)]
    return [slice(rows.start, rows.stop - 1 + 2 * window_rows) for rows in inside]


def merge_normal_stress_and_velocity_steps(
    velocity_steps: Sequence[LoadingStep],
    stress_steps: Sequence[NormalStressStep],
    default_velocity: float,
) -> tuple[LoadingStep, ...]:
    """Merge steps of normal stress with steps of load point velocity.

    If the normal stress changes during a step of load point velocity, the result is a single step
    that includes both changes.

    Parameters
    ----------
    velocity_steps : sequence of LoadingStep
        Steps of load point velocity.
    stress_steps : sequence of NormalStressStep
        Steps of normal stress.
    default_velocity : float
        Load point velocity in um/s that is used if there are no steps of load point velocity.

    Returns
    -------
    tuple of LoadingStep
        Steps in order of time. The normal stresses of the steps are not yet set.
    """
    found = []
    for step in velocity_steps:
        during = [change for change in stress_steps if _step_overlaps_stress_change(step, change)]
        begins = min([step.start, *(change.start_time for change in during)])
        ends = max([step.end, *(change.end_time for change in during)])
        found.append(step._replace(start=begins, end=ends))
    for change in stress_steps:
        if not any(_step_overlaps_stress_change(step, change) for step in velocity_steps):
            earlier = [
                step.velocity_after for step in velocity_steps if step.end <= change.start_time
            ]
            speed = (
                earlier
                or [step.velocity_before for step in velocity_steps[:1]]
                or [default_velocity]
            )[-1]
            found.append(LoadingStep(change.start_time, change.end_time, speed, speed))
    return tuple(sorted(found, key=lambda step: step.start))


def set_normal_stresses_of_steps(
    steps: Sequence[LoadingStep],
    stress_steps: Sequence[NormalStressStep],
    time: np.ndarray,
    stress: np.ndarray,
) -> tuple[LoadingStep, ...]:
    """Set the normal stresses before and after each step from the record.

    The function does not change normal stresses that the user specified.

    Parameters
    ----------
    steps : sequence of LoadingStep
        Steps in order of time.
    stress_steps : sequence of NormalStressStep
        Detected steps of normal stress. If the normal stress does not change during a step, the
        normal stresses before and after the step are equal.
    time, stress : ndarray, shape (rows,)
        Times in s and normal stresses in Pa.

    Returns
    -------
    tuple of LoadingStep
        Steps with normal stresses. If the change in normal stress is immediate, it is replaced by a
        change that lasts one sampling interval.
    """
    ends = [-math.inf, *(step.end for step in steps)]
    begins = [*(step.start for step in steps[1:]), math.inf]
    found = []
    for step, earlier, later in zip(steps, ends, begins, strict=False):
        during = [change for change in stress_steps if _step_overlaps_stress_change(step, change)]
        if math.isnan(step.stress_before):
            rows = stress[(time >= earlier) & (time <= later)]
            level = float(np.median(rows)) if rows.size else math.nan
            before, after = (
                (during[0].normal_stress_before, during[-1].normal_stress_after)
                if during
                else (level, level)
            )
            step = step._replace(stress_before=before, stress_after=after)
        if step.start == step.end and step.normal_stress_ratio != 1.0:
            # A change in normal stress takes at least one sampling interval.
            row = int(np.clip(np.searchsorted(time, step.start, "right"), 1, len(time) - 1))
            step = step._replace(start=float(time[row - 1]), end=float(time[row]))
        found.append(step)
    return tuple(found)


def _step_overlaps_stress_change(step: LoadingStep, stress_step: NormalStressStep) -> bool:
    """Return True if the normal stress changes during or close to a step."""
    near = stress_step.end_time - stress_step.start_time
    return step.start - near <= stress_step.end_time and stress_step.start_time <= step.end + near


def _fit_linear_stress_ramp(
    time: np.ndarray, stress: np.ndarray, stress_before: float, stress_after: float
) -> NormalStressStep:
    """Fit a ramp between two levels of normal stress."""
    share = (stress - stress_before) / (stress_after - stress_before)
    # The row ``middle`` is the best boundary between rows below and above half of the change.
    middle = int(np.argmax(np.cumsum(0.5 - share)))
    first = int(np.flatnonzero(share[: middle + 1] <= _RAMP_FIT_CHANGE_FRACTIONS[0]).max(initial=0))
    reached = np.flatnonzero(share[middle:] >= _RAMP_FIT_CHANGE_FRACTIONS[1])
    last = middle + int(reached[0]) if len(reached) else len(share) - 1
    on_way = np.arange(first + 1, last)
    if len(on_way) < _MIN_RAMP_ROWS:
        return NormalStressStep(float(time[first]), float(time[last]), stress_before, stress_after)
    slope, offset = np.polyfit(time[on_way] - time[first], share[on_way], 1)
    begins, ends = (time[first] + (x - offset) / slope for x in (0.0, 1.0))
    return NormalStressStep(
        float(max(begins, time[0])), float(min(ends, time[-1])), stress_before, stress_after
    )
