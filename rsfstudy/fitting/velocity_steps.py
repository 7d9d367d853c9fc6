"""Detection of load point velocity steps in a record.

The displacement of the load point is approximated by straight segments, and a step is the boundary
between two segments. The module ``line_segmentation`` finds the segments.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.fitting.line_segmentation import (
    MIN_SEGMENT_ROWS,
    CumulativeSumsForLineFits,
    InterceptAndSlope,
    SegmentBoundaryRefinement,
    split_rows_into_segments,
)

#: Largest number of rows that are segmented. Longer records are first averaged over blocks of rows.
_MAX_ROWS_FOR_STEP_DETECTION = 20_000
#: Number of blocks on either side of a step from which the time of the step is computed again, with
#: all rows of these blocks.
_MAX_REFINEMENT_BLOCKS = 40
#: Criteria for separate segments of constant velocity. The first value is the smallest change in
#: velocity between two segments, relative to the faster velocity. The second value is the smallest
#: displacement due to the change in velocity, relative to the standard deviation of the residuals.
#: The second criterion is necessary because a servo-controlled load point fluctuates around its set
#: point.
_MIN_RELATIVE_VELOCITY_CHANGE, _MIN_DISPLACEMENT_CHANGE_SIGMAS = 0.2, 10.0
#: The load point is considered to be held if its velocity is less than this fraction of its highest
#: velocity.
_MAX_HOLD_VELOCITY_OVER_HIGHEST_VELOCITY = 0.01
#: Limits for combining several velocity changes into a single step. The first value is the longest
#: duration of the step, relative to the duration of the preceding segment and to the duration of
#: the rest of the record. A segment is too short for a fit if its number of rows is less than the
#: second value.
_MAX_RAMP_SEGMENT_OVER_NEIGHBOURS, _MAX_RAMP_SEGMENT_ROWS = 0.05, 15
#: Number of rows from which the local noise is estimated. The local noise is used if the ratio of
#: the local noise to the typical noise exceeds the second value.
_LOCAL_NOISE_ROWS, _MIN_LOCAL_OVER_GLOBAL_NOISE = 31, 2.0
#: Smallest standard deviation of the noise, relative to the range of the values.
_LEAST_NOISE_OVER_RANGE = 1e-9
#: Ratio of the standard deviation to the median absolute deviation for Gaussian noise.
_STANDARD_DEVIATION_PER_MAD = 1.4826


@make_methods_raise_rsfstudy_errors
class LoadingStep(NamedTuple):
    """Step of load point velocity, of normal stress, or of both.

    Parameters
    ----------
    start, end : float
        Times in s at which the change begins and ends. ``start`` and ``end`` are equal if the
        change is immediate.
    velocity_before, velocity_after : float
        Load point velocities in um/s. A velocity of 0 means that the load point is held.
    stress_before, stress_after : float, default: NaN
        Normal stresses in Pa, or NaN if the normal stress was not recorded.
    velocity_profile : tuple of (float, float), optional
        Velocities during a step in which the velocity overshoots. Each pair contains a time in s
        since the start of the step, and the velocity in um/s from this time on. By default, the
        velocity changes at a constant rate.

    Examples
    --------
    >>> from rsfstudy.fitting import LoadingStep
    >>> step = LoadingStep(50.0, 51.0, 1.0, 10.0, stress_before=10e6, stress_after=12e6)
    >>> step.changes_velocity
    True
    >>> step.normal_stress_ratio
    1.2
    """

    start: float
    end: float
    velocity_before: float
    velocity_after: float
    stress_before: float = math.nan
    stress_after: float = math.nan
    velocity_profile: tuple[tuple[float, float], ...] = ()

    @property
    def middle_time(self) -> float:
        """Time in s at which an immediate step would result in the same final displacement.

        If a record has few rows before a step, the detected step may last longer than the actual
        step. The middle of the detected step is then more accurate than its ends.
        """
        return 0.5 * (self.start + self.end)

    @property
    def changes_velocity(self) -> bool:
        """True if the load point velocity changes."""
        return self.velocity_before != self.velocity_after

    @property
    def normal_stress_ratio(self) -> float:
        """Ratio of the normal stresses after and before the step.

        The property is 1 if the normal stress was not recorded.
        """
        ratio = self.stress_after / self.stress_before
        return ratio if math.isfinite(ratio) else 1.0


def detect_velocity_steps(time: np.ndarray, displacement: np.ndarray) -> tuple[LoadingStep, ...]:
    """Detect the load point velocity steps in a record.

    Two neighbouring segments are treated as separate segments if two conditions are met. First,
    their velocities must differ by at least 20 %. Second, fitting two lines instead of a single
    line must reduce the sum of squares by far more than expected by chance. A ramp between two
    velocities is detected as a single step with a finite duration.

    Parameters
    ----------
    time, displacement : ndarray, shape (rows,)
        Times in s and load point displacements in um.

    Returns
    -------
    tuple of LoadingStep
        Steps in order of time.
    """
    t0, x0 = time[0], displacement[0]
    lines, meets, row_counts = _find_segments(time - t0, displacement - x0)
    if not lines:
        return ()
    fastest = max(abs(line[1]) for line in lines)
    speeds = [
        line[1] if abs(line[1]) > _MAX_HOLD_VELOCITY_OVER_HIGHEST_VELOCITY * fastest else 0.0
        for line in lines
    ]
    found = []
    for first, last in _group_velocity_changes_into_steps(
        meets, speeds, row_counts, (0.0, time[-1] - t0)
    ):
        begins, ends = meets[first], meets[last]
        if _has_velocity_overshoot(speeds[first : last + 2]):
            through = [(meets[n] - begins, speeds[n + 1]) for n in range(first, last)]
            step = LoadingStep(t0 + begins, t0 + ends, speeds[first], speeds[last + 1])
            found.append(step._replace(velocity_profile=tuple(through)))
            continue
        if last > first:
            # The middle of the ramp is the intersection of the lines before and after the ramp,
            # so that the displacement after the ramp is correct.
            (x, v), (y, w) = lines[first], lines[last + 1]
            late = min(max((x - y) / (w - v), begins), ends) - 0.5 * (begins + ends)
            begins, ends = begins + late, ends + late
        found.append(LoadingStep(t0 + begins, t0 + ends, speeds[first], speeds[last + 1]))
    return tuple(_move_to_nearest_rows(step, time) for step in found)


def _move_to_nearest_rows(step: LoadingStep, time: np.ndarray) -> LoadingStep:
    """Move the start and end of a step to row times that are equal within rounding errors.

    Rounding errors then do not affect which window contains a row at the time of a step.
    """

    def move(at: float) -> float:
        row = float(time[np.argmin(np.abs(time - at))])
        return row if abs(row - at) <= _LEAST_NOISE_OVER_RANGE * float(np.ptp(time)) else at

    return step._replace(start=move(step.start), end=move(step.end))


def _compute_deviations_from_neighbours(time: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Compute the deviation of each sample from the line through its neighbours.

    The deviations are multiplied by a constant factor, which is chosen so that deviations of white
    noise have the same standard deviation as the noise.
    """
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    off = displacement[1:-1] - (1.0 - share) * displacement[:-2] - share * displacement[2:]
    off /= np.sqrt(1.0 + (1.0 - share) ** 2 + share**2)
    return np.asarray(off)


def _compute_local_over_typical_noise(time: np.ndarray, displacement: np.ndarray) -> np.ndarray:
    """Estimate the local noise of the displacement, relative to the typical noise.

    Returns
    -------
    ndarray, shape (rows,)
        Ratio of the local noise to the typical noise, or 1 if the ratio is less than 2.
    """
    off = np.abs(_compute_deviations_from_neighbours(time, displacement))
    typical = float(np.median(off))
    if len(off) < 4 * _LOCAL_NOISE_ROWS or typical <= _compute_least_noise(displacement):
        return np.ones(len(time))
    local = maximum_filter1d(
        median_filter(off, _LOCAL_NOISE_ROWS, mode="nearest"), _LOCAL_NOISE_ROWS
    )
    local = np.pad(local / typical, 1, mode="edge")
    return np.asarray(np.where(local > _MIN_LOCAL_OVER_GLOBAL_NOISE, local, 1.0))


def _has_velocity_overshoot(velocities: Sequence[float]) -> bool:
    """Return True if the velocity increases and decreases during a step."""
    changes = np.diff(velocities)
    return bool((changes > 0.0).any() and (changes < 0.0).any())


def noise_variance(t: np.ndarray, x: np.ndarray) -> float:
    """Estimate the noise variance of samples.

    The estimate is based on the deviation of each sample from the line through its two neighbours.
    Because the function uses the median of the deviations, steps have little effect on the
    estimate.

    Parameters
    ----------
    t : ndarray, shape (samples,)
        Times or other increasing coordinates of the samples.
    x : ndarray, shape (samples,)
        Values of the samples.

    Returns
    -------
    float
        Noise variance, in squared units of ``x``. The result is positive even if the samples have
        no noise.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import noise_variance
    >>> t = np.arange(1000.0)
    >>> x = 2.0 * t + np.random.default_rng(0).normal(scale=0.1, size=1000)
    >>> round(noise_variance(t, x), 2)
    0.01
    """
    spread = _STANDARD_DEVIATION_PER_MAD * float(
        np.median(np.abs(_compute_deviations_from_neighbours(t, x)))
    )
    return max(spread, _compute_least_noise(x)) ** 2


def _compute_least_noise(values: np.ndarray) -> float:
    """Return the lower limit of the standard deviation of the noise.

    A synthetic record may have no noise except for the rounding errors of floating-point numbers.
    """
    return _LEAST_NOISE_OVER_RANGE * float(np.ptp(values))


def _find_segments(
    time: np.ndarray, displacement: np.ndarray
) -> tuple[list[InterceptAndSlope], list[float], list[float]]:
    """Find the segments of constant velocity in a record.

    Returns
    -------
    lines : list of (float, float)
        Displacement at time 0 and velocity of each segment.
    intersections : list of float
        Times in s at which the lines of neighbouring segments intersect.
    row_counts : list of float
        Number of rows of each segment, or number of blocks of rows in a long record.
    """
    every = max(1, math.ceil(len(time) / _MAX_ROWS_FOR_STEP_DETECTION))
    count = len(time) // every * every
    t, x = (v[:count].reshape(-1, every).mean(axis=1) for v in (time, displacement))
    if len(t) < 2 * MIN_SEGMENT_ROWS:
        return [], [], []
    variance, louder = noise_variance(t, x), _compute_local_over_typical_noise(t, x)
    weights = 1.0 / louder**2
    sums = CumulativeSumsForLineFits(t, x, weights)
    knots = sorted(
        split_rows_into_segments(sums.compute_line_residual_squares, 0, len(t), variance)
    )
    knots = _merge_similar_segments(sums, knots, t, variance, louder)
    refinement = SegmentBoundaryRefinement(t, x, weights, variance, len(t))
    knots = refinement.refine(knots)
    if every > 1:
        variance = noise_variance(time, displacement)
        weights = np.pad(np.repeat(weights, every), (0, len(time) - count), mode="edge")
        refinement = SegmentBoundaryRefinement(
            time, displacement, weights, variance, _MAX_REFINEMENT_BLOCKS * every
        )
        knots = refinement.refine([*(every * k for k in knots[:-1]), len(time)])
    lines = [refinement.fit_line(i, j) for i, j in itertools.pairwise(knots)]
    intersections = [
        _compute_line_intersection_time(
            *refinement.fit_adjacent_lines(*knots[n : n + 3]), (time[k - 1], time[k]), variance
        )
        for n, k in enumerate(knots[1:-1])
    ]
    return lines, intersections, (np.diff(knots) / every).tolist()


def _merge_similar_segments(
    line_fit_sums: CumulativeSumsForLineFits,
    segment_boundaries: list[int],
    time: np.ndarray,
    variance_of_noise: float,
    relative_noise: np.ndarray,
) -> list[int]:
    """Remove boundaries between segments with similar velocities.

    The boundary with the smallest change in velocity is removed first.
    """
    while len(segment_boundaries) > 2:
        pieces = [*itertools.pairwise(segment_boundaries)]
        speeds = np.array([line_fit_sums.fit_line(i, j)[1] for i, j in pieces])
        squares = (
            sum(float(line_fit_sums.compute_line_residual_squares(i, j)) for i, j in pieces)
            / segment_boundaries[-1]
        )
        left = math.sqrt(max(squares, variance_of_noise)) * _compute_noise_at_segment_boundaries(
            pieces, relative_noise
        )
        change, lasts = np.abs(np.diff(speeds)), np.diff(time[[*segment_boundaries[:-1], -1]])
        faster = np.maximum(np.abs(speeds[1:]), np.abs(speeds[:-1]))
        differs = _compute_change_across_ramps(speeds, np.diff(segment_boundaries)) / (
            _MIN_RELATIVE_VELOCITY_CHANGE
            * np.maximum(faster, _MAX_HOLD_VELOCITY_OVER_HIGHEST_VELOCITY * np.abs(speeds).max())
        )
        moves = (
            change * np.minimum(lasts[1:], lasts[:-1]) / (_MIN_DISPLACEMENT_CHANGE_SIGMAS * left)
        )
        tells = np.minimum(differs, moves)
        least = int(np.argmin(tells))
        if tells[least] > 1.0:
            break
        del segment_boundaries[least + 1]
    return segment_boundaries


def _compute_change_across_ramps(velocities: np.ndarray, row_counts: np.ndarray) -> np.ndarray:
    """Return the change in velocity at each boundary between segments.

    A segment with few rows and an intermediate velocity is part of a ramp. Both of its boundaries
    are assigned the change in velocity across the ramp.
    """
    changes = np.diff(velocities)
    across = np.abs(changes)
    ramps = (row_counts[1:-1] < _MAX_RAMP_SEGMENT_ROWS) & (changes[1:] * changes[:-1] > 0.0)
    total = np.where(ramps, np.abs(changes[1:] + changes[:-1]), 0.0)
    across[:-1] = np.maximum(across[:-1], total)
    across[1:] = np.maximum(across[1:], total)
    return across


def _compute_line_intersection_time(
    first_line: InterceptAndSlope,
    second_line: InterceptAndSlope,
    boundary_times: tuple[float, float],
    variance_of_noise: float,
) -> float:
    r"""Compute the time at which two lines intersect.

    The time of intersection is limited to a neighbourhood of the boundary between the rows of the
    two lines. Because of noise, the boundary has an uncertainty of about :math:`(s^2 h/\Delta
    V^2)^{1/3}`, where :math:`s^2` is the noise variance, :math:`h` is the sampling interval, and
    :math:`\Delta V` is the change in velocity.
    """
    (last, first), change = boundary_times, second_line[1] - first_line[1]
    middle, gap = 0.5 * (last + first), first - last
    reach = max(3.0 * gap, 5.0 * math.cbrt(variance_of_noise * gap / change**2))
    meet = (first_line[0] - second_line[0]) / change
    return float(min(max(meet, middle - reach), middle + reach))


def _group_velocity_changes_into_steps(
    times: list[float],
    velocities: list[float],
    segment_row_counts: list[float],
    end_times: tuple[float, float],
) -> Iterator[tuple[int, int]]:
    """Group successive velocity changes into steps.

    A step may contain several changes in velocity if the segments between the changes are short or
    have few rows. For example, a ramp between two velocities is a single step, and a velocity that
    overshoots and returns is also a single step.

    Yields
    ------
    first, last : int
        Indices of the first and the last velocity change of a step.
    """
    changes, n = np.sign(np.diff(velocities)), 0

    def is_short(first: int, last: int) -> bool:
        before = times[first] - (times[first - 1] if first else end_times[0])
        lasts = times[last] - times[first]
        return segment_row_counts[
            last
        ] < _MAX_RAMP_SEGMENT_ROWS or lasts < _MAX_RAMP_SEGMENT_OVER_NEIGHBOURS * min(
            before, end_times[1] - times[last]
        )

    while n < len(times):
        last = n
        while last + 1 < len(times) and changes[last + 1] == changes[n] and is_short(n, last + 1):
            last += 1
        # An overshoot and the return from the overshoot belong to one step.
        back = last + 1
        while (
            back < len(times)
            and changes[back] != changes[n]
            and _velocity_returns_after_overshoot(velocities, n, last, back)
        ):
            if not is_short(n, back):
                break
            last, back = back, back + 1
        yield n, last
        n = last + 1


def _velocity_returns_after_overshoot(
    velocities: list[float],
    first_change_index: int,
    last_change_index: int,
    return_change_index: int,
) -> bool:
    """Return True if the velocity overshoots and then partly recovers."""
    before, peak, after = (
        velocities[first_change_index],
        velocities[last_change_index + 1],
        velocities[return_change_index + 1],
    )
    change = abs(after - before)
    returns = min(before, peak) < after < max(before, peak)
    return (
        returns
        and peak != 0.0
        and change > _MIN_RELATIVE_VELOCITY_CHANGE * max(abs(before), abs(after))
    )


def _compute_noise_at_segment_boundaries(
    row_segments: list[tuple[int, int]], relative_noise: np.ndarray
) -> np.ndarray:
    """Compute the relative noise at each boundary between segments.

    The function averages the relative noise in each of the two adjacent segments, and returns the
    larger average.
    """
    local = np.array([relative_noise[i:j].mean() for i, j in row_segments])
    return np.asarray(np.maximum(local[1:], local[:-1]))
