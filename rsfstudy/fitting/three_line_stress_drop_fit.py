"""Functions that estimate the sizes and times of stress drops, with confidence intervals.

The function ``fit_stress_drop`` models the stress before, during and after a drop by three
connected straight lines. The lines meet at the times at which the drop begins and ends. For each
pair of start time and end time, the lines are fitted by least squares. The fit with the smallest
sum of squares determines the start and the end of the drop. If the stress does not drop suddenly,
the stresses at the start and at the end depend on the sampling interval. Therefore, the module
``concave_stress_fit`` replaces these stresses by the highest and the lowest stress.

The confidence intervals of the start time and the end time are computed from the sums of squares.
The intervals contain all pairs of times whose sum of squares exceeds the minimum by less than a
fixed multiple of the noise variance [1]_.

References
----------
.. [1] Yao (1987), The Annals of Statistics 15, 1321-1328.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rsfstudy.fitting.stress_drop_detection import StressDropCandidate

#: Settings for the number of samples to fit on each side of a drop. The samples extend over the
#: window length times the first value, or over the duration of the drop times the second value,
#: whichever is longer. The last two values are the smallest and the largest number of samples.
_SIDE_LENGTH_IN_WINDOWS, _SIDE_LENGTH_IN_DROP_DURATIONS, _MIN_SIDE_SAMPLES, _MAX_SIDE_SAMPLES = (
    3.0,
    1.0,
    16,
    400,
)
#: Largest number of samples in a fit. If there are more samples, blocks of samples are averaged.
_MAX_SAMPLES_IN_FIT = 300
#: Longest time between a detected drop and the fitted start or end of the drop, in durations of the
#: averaging window.
_SEARCH_MARGIN_OVER_WINDOW_DURATION = 2.0
#: Number of start times (and of end times) in each search grid, and number of refinements of the
#: search grid.
_SEARCH_GRID_SIZE, _SEARCH_GRID_REFINEMENTS = 16, 3
#: Largest rate of stress decrease before and after a drop, relative to the rate during the drop.
_MAX_SLOPE_BESIDE_DROP_OVER_DROP_SLOPE = 0.3
#: Limit for the stress decrease on one side of a drop, relative to the size of the drop. The limit
#: applies to the difference between this stress decrease and the decrease expected from the slope
#: on the other side of the drop.
_MAX_STRESS_FALL_OUTSIDE_OVER_DROP_SIZE = 0.5
#: Difference between the sum of squares at the ends of a 95 % confidence interval and the minimum
#: sum of squares, in noise variances. The first value applies to the confidence interval of the
#: time of a sudden change, and is equal to -2 ln 0.0253. The second value applies to the confidence
#: intervals of all other parameters.
_TIME_INTERVAL_EXCESS_SQUARES, _SIZE_INTERVAL_EXCESS_SQUARES = 7.4, 3.84
#: Half width of a 95 % confidence interval in standard errors.
HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS = 1.96
#: Error of a time that lies between two samples, relative to the sampling interval.
_TIME_ERROR_OVER_SAMPLING_INTERVAL = 0.55
#: Smallest number of samples that are required for estimating the stress before a drop, or the
#: stress after a drop.
MIN_SAMPLES_BESIDE_DROP = 3


class FittedStressDrop(NamedTuple):
    """Fitted stress drop.

    Errors are half widths of 95 % confidence intervals.

    Parameters
    ----------
    start_time, end_time : float
        Times at which the drop starts and ends.
    stress_before, stress_after : float
        Stress at the start and at the end of the drop, or highest stress before the drop and lowest
        stress after the drop (see ``measure_stress_extrema``).
    start_time_error, end_time_error : float
        Errors of ``start_time`` and ``end_time``.
    stress_before_error, stress_after_error : float
        Errors of ``stress_before`` and ``stress_after``.
    stress_drop_error : float
        Error of the stress drop ``stress_before - stress_after``.
    residual_sd : float
        Standard deviation of the residuals.
    starts_before_record, ends_after_record : bool
        ``starts_before_record`` is True if the record has too few samples before the drop.
        ``ends_after_record`` is True if the record has too few samples after the drop.
    """

    start_time: float
    end_time: float
    stress_before: float
    stress_after: float
    start_time_error: float
    end_time_error: float
    stress_before_error: float
    stress_after_error: float
    stress_drop_error: float
    residual_sd: float
    starts_before_record: bool
    ends_after_record: bool


class _ThreeLineFits(NamedTuple):
    """Least-squares fits of three connected lines to stress.

    Parameters
    ----------
    corner_time_pairs : ndarray, shape (pairs, 2)
        Pairs of times at which the lines meet.
    line_coefficients : ndarray, shape (pairs, 4)
        Coefficients of the lines (see ``_fit_three_connected_lines``).
    inverse_normal_equations_matrix : ndarray, shape (pairs, 4, 4)
        Inverse of the normal matrix.
    residual_sums_of_squares : ndarray, shape (pairs,)
        Sum of squared residuals.
    """

    corner_time_pairs: np.ndarray
    line_coefficients: np.ndarray
    inverse_normal_equations_matrix: np.ndarray
    residual_sums_of_squares: np.ndarray

    @property
    def best_corner_time_pair_index(self) -> int:
        """Index of the pair of start and end times with the smallest sum of squares.

        If several pairs have the same sum of squares within rounding errors, the result is the
        index of the first of these pairs.
        """
        return int(
            np.argmax(
                self.residual_sums_of_squares <= self.residual_sums_of_squares.min() * (1.0 + 1e-9)
            )
        )


def fit_stress_drop(
    time: np.ndarray,
    stress: np.ndarray,
    candidate: StressDropCandidate,
    adjacent_drop_times: tuple[float, float],
    noise_sd: float,
) -> FittedStressDrop:
    """Fit three connected lines to the stress around a drop.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples, in any units.
    candidate : StressDropCandidate
        Detected drop.
    adjacent_drop_times : (float, float)
        End of the previous drop, and start of the next drop.
    noise_sd : float
        Standard deviation of the noise.

    Returns
    -------
    FittedStressDrop
        Start, end and stresses of the drop, with their errors.
    """
    rows = _select_rows_around_drop(time, candidate, adjacent_drop_times)
    every = -(-len(rows) // _MAX_SAMPLES_IN_FIT)
    whole = rows[: len(rows) // every * every]
    t, y = (of[whole].reshape(-1, every).mean(axis=1) for of in (time, stress))
    origin, scale = float(t[0]), float(t[-1] - t[0])
    t = (t - origin) / scale
    begins, ends = ((at - origin) / scale for at in candidate[:2])
    lines = _search_drop_start_and_end_times(
        t, y, begins, ends, candidate.averaging_window_duration / scale
    )
    best = lines.best_corner_time_pair_index
    left = float(lines.residual_sums_of_squares[best]) / max(len(t) - 6, 1)
    variance = (
        max(left, 0.25 * noise_sd**2 / every) * candidate.stderr_factor_of_correlated_noise**2
    )
    excess = lines.residual_sums_of_squares - lines.residual_sums_of_squares[best]
    late = np.abs(
        lines.corner_time_pairs[excess <= _TIME_INTERVAL_EXCESS_SQUARES * variance]
        - lines.corner_time_pairs[best]
    ).max(axis=0)
    sizes = lines.line_coefficients[:, 0] - lines.line_coefficients[:, 1]
    spread = float(
        np.abs(sizes[excess <= _SIZE_INTERVAL_EXCESS_SQUARES * variance] - sizes[best]).max()
    )
    inverse = lines.inverse_normal_equations_matrix[best]
    variances = np.array([inverse[0, 0], inverse[1, 1], inverse[:2, :2].trace()])
    variances[2] -= 2.0 * inverse[0, 1]
    of_before, of_after, of_drop = HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * np.sqrt(
        np.maximum(variance * variances, 0.0)
    )
    begins, t1 = t0, _ = lines.corner_time_pairs[best].tolist()
    (early, later), gaps = np.searchsorted(t, (t0, t1), "right"), np.diff(t)
    last = len(gaps) - 1
    gap0, gap1 = (float(gaps[min(max(at - 1, 0), last)]) for at in (early, later))
    if not ((t > t0) & (t < t1)).any():  # The drop occurs between two samples.
        begins = float(t[max(early - 1, 0)]) + 0.5 * gap0
    return FittedStressDrop(
        start_time=origin + scale * begins,
        end_time=origin + scale * t1,
        stress_before=float(lines.line_coefficients[best, 0]),
        stress_after=float(lines.line_coefficients[best, 1]),
        start_time_error=scale * (float(late[0]) + _TIME_ERROR_OVER_SAMPLING_INTERVAL * gap0),
        end_time_error=scale * (float(late[1]) + gap1),
        stress_before_error=float(of_before + spread),
        stress_after_error=float(of_after + spread),
        stress_drop_error=float(of_drop + spread),
        residual_sd=float(np.sqrt(left * every)),
        starts_before_record=bool(rows[0] == 0 and (t <= t0).sum() < MIN_SAMPLES_BESIDE_DROP),
        ends_after_record=bool(
            rows[-1] == len(time) - 1 and (t >= t1).sum() <= MIN_SAMPLES_BESIDE_DROP
        ),
    )


def _select_rows_around_drop(
    time: np.ndarray, candidate: StressDropCandidate, adjacent_drop_times: tuple[float, float]
) -> np.ndarray:
    """Return the indices of the samples around a drop.

    Samples of neighbouring drops are excluded.
    """
    begins, ends, window = candidate[:3]
    reach = max(_SIDE_LENGTH_IN_WINDOWS * window, _SIDE_LENGTH_IN_DROP_DURATIONS * (ends - begins))
    first = int(np.searchsorted(time, begins, "left"))
    last = int(np.searchsorted(time, ends, "right"))
    start = min(int(np.searchsorted(time, begins - reach)), first - _MIN_SIDE_SAMPLES)
    stop = max(int(np.searchsorted(time, ends + reach)), last + _MIN_SIDE_SAMPLES)
    start = max(
        start, first - _MAX_SIDE_SAMPLES, int(np.searchsorted(time, adjacent_drop_times[0])), 0
    )
    stop = min(
        stop,
        last + _MAX_SIDE_SAMPLES,
        int(np.searchsorted(time, adjacent_drop_times[1], "right")),
        len(time),
    )
    start, stop = min(start, max(first - 2, 0)), max(stop, min(last + 2, len(time)))
    return np.arange(start, stop)


def _search_drop_start_and_end_times(
    time: np.ndarray,
    stress: np.ndarray,
    start_time_guess: float,
    end_time_guess: float,
    window_duration: float,
) -> _ThreeLineFits:
    """Search for the times at which the drop begins and ends.

    The search evaluates pairs of times on a grid, and refines the grid several times around the
    best pair.
    """
    reach = max(
        _SEARCH_MARGIN_OVER_WINDOW_DURATION * window_duration, end_time_guess - start_time_guess
    )
    halves = np.sort(np.concatenate([time, 0.5 * (time[1:] + time[:-1])]))
    starts = halves[(halves >= start_time_guess - reach) & (halves < end_time_guess)]
    stops = halves[(halves > start_time_guess) & (halves <= end_time_guess + reach)]
    parts: list[_ThreeLineFits] = []
    for level in range(_SEARCH_GRID_REFINEMENTS + 1):
        pairs = np.array(
            [
                (u, v)
                for u in _select_evenly_spaced_times(starts)
                for v in _select_evenly_spaced_times(stops)
                if u < v
            ]
        )
        if len(pairs):
            parts.append(_fit_three_connected_lines(time, stress, pairs))
        found = parts[int(np.argmin([part.residual_sums_of_squares.min() for part in parts]))]
        best = found.corner_time_pairs[found.best_corner_time_pair_index]
        near = [
            _select_times_near_centre(
                halves, at, end_time_guess - start_time_guess + 2.0 * reach, level
            )
            for at in best
        ]
        starts, stops = near
    return _ThreeLineFits(*map(np.concatenate, zip(*parts, strict=True)))


def _select_evenly_spaced_times(times: np.ndarray) -> list[float]:
    """Select an evenly spaced subset of the given times."""
    places = np.unique(np.linspace(0, len(times) - 1, _SEARCH_GRID_SIZE).round().astype(int))
    return [float(times[place]) for place in places] if len(times) else []


def _select_times_near_centre(
    times: np.ndarray, centre: float, search_extent: float, refinement_level: int
) -> np.ndarray:
    """Select the times near the best time for the next refinement of the search.

    In the last refinements of the search, the nearest neighbours of the best time are selected.
    """
    reach = search_extent / _SEARCH_GRID_SIZE * (4.0 / _SEARCH_GRID_SIZE) ** refinement_level
    place = int(np.searchsorted(times, centre))
    around = times[max(place - _SEARCH_GRID_SIZE // 3, 0) : place + _SEARCH_GRID_SIZE // 3 + 1]
    within = times[np.abs(times - centre) <= 2.0 * reach]
    return (
        within
        if refinement_level < _SEARCH_GRID_REFINEMENTS - 1 and len(within) > len(around)
        else around
    )


def _fit_three_connected_lines(
    time: np.ndarray, stress: np.ndarray, corner_time_pairs: np.ndarray
) -> _ThreeLineFits:
    """Fit three connected lines for each pair of start and end times of a drop.

    The coefficients of a fit are the stresses at the start and the end of the drop, and the slopes
    before and after the drop. A pair of start and end times is rejected if it covers only a
    fraction of a longer drop. This is the case if stress decreases outside the drop more than 0.3
    times as fast as during the drop. A pair is also rejected if stress decreases much more on one
    side of the drop than predicted by the slope on the other side. The limit for this difference is
    half of the drop size.
    """
    t0, t1 = corner_time_pairs[:, :1], corner_time_pairs[:, 1:]
    share = np.clip((time - t0) / (t1 - t0), 0.0, 1.0)
    columns = np.stack(
        [1.0 - share, share, np.minimum(time - t0, 0.0), np.maximum(time - t1, 0.0)], -1
    )
    turned = columns.transpose(0, 2, 1)
    normal = turned @ columns
    # The small ridge term is necessary because one side may have no samples.
    normal += 1e-9 * np.eye(4) * len(time)
    inverse = np.linalg.inv(normal)
    centre = stress.mean()
    values = (inverse @ (turned @ (stress - centre))[:, :, None])[:, :, 0]
    left = stress - centre - (columns @ values[:, :, None])[:, :, 0]
    squares = np.square(left).sum(axis=1)
    drop, lasts = values[:, 0] - values[:, 1], (t1 - t0)[:, 0]
    goes_on = (
        values[:, 2:].min(axis=1) < -_MAX_SLOPE_BESIDE_DROP_OVER_DROP_SLOPE * drop / lasts
    ) | (drop <= 0.0)
    for own, other, beside in (
        (2, 3, corner_time_pairs[:, 0] - time[0]),
        (3, 2, time[-1] - corner_time_pairs[:, 1]),
    ):
        fall = np.minimum(values[:, other], 0.0) - values[:, own]
        goes_on |= fall * np.maximum(beside, 0.0) > _MAX_STRESS_FALL_OUTSIDE_OVER_DROP_SIZE * drop
    values[:, :2] += centre
    squares[goes_on] += 1e3 * (float(np.square(stress - centre).sum()) + 1e-300)
    return _ThreeLineFits(corner_time_pairs, values, inverse, squares)
