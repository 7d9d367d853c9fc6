"""Functions that measure the times, stresses and slip of the stress drops in a record.

The function ``read_drops`` finds the stress drops in a record, and computes the properties of each
drop and the errors of these properties.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from rsfstudy.fitting.stress_drop_detection import (
    DETECTION_MARGIN_IN_STANDARD_DEVIATIONS,
    FALSE_DETECTION_PROBABILITY,
    Detection,
    compute_window_mean_decreases,
    estimate_robust_sd,
    find_smallest_nonzero_difference,
)
from rsfstudy.fitting.stress_drop_search import (
    DetectedAndFittedStressDrop,
    EventNumbers,
    find_stress_drops,
)
from rsfstudy.fitting.three_line_stress_drop_fit import HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS

#: Smallest difference between the displacement during the drops and the displacement in equally
#: long intervals before and after the drops. The first value is in standard deviations of the
#: difference. The second value is relative to the displacement before and after the drops.
_MIN_EXCESS_SLIP_SIGMAS, _MIN_EXCESS_SLIP_FRACTION = 3.0, 0.1
#: The sampling resolves the peak slip rate if at least this number of successive sampling intervals
#: have mean slip rates of more than half the largest mean slip rate.
_MIN_INTERVALS_AT_PEAK_SLIP_RATE = 4


class DropSampleIndices(NamedTuple):
    """Indices of the samples that belong to a stress drop.

    Parameters
    ----------
    start_index : int
        Index of the first sample in the drop.
    end_index : int
        Index of the first sample after the drop.
    averaging_sample_count : int
        Number of samples to average before and after the drop.
    """

    start_index: int
    end_index: int
    averaging_sample_count: int


class DropMeasurements(NamedTuple):
    """Stress drops in a record.

    Parameters
    ----------
    quantities_of_each_drop : list of EventNumbers
        Properties of each drop.
    detection : Detection
        Result of the detection.
    displacement_shows_slip : bool
        True if the displacement rate is higher during the drops than before and after the drops, or
        if the rate was not checked. Otherwise, the value is False.
    """

    quantities_of_each_drop: list[EventNumbers]
    detection: Detection
    displacement_shows_slip: bool


def read_drops(
    times: np.ndarray, stress: np.ndarray, displacement: np.ndarray | None, *, check_slip: bool
) -> DropMeasurements:
    """Find stress drops in a record and compute their properties.

    Parameters
    ----------
    times, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples.
    displacement : ndarray, shape (samples,), or None
        Displacements of the samples. If the value is None, slip and slip rate are not computed.
    check_slip : bool
        If True, check that the displacement is fault slip, and not load point displacement.

    Returns
    -------
    DropMeasurements
        Properties of the drops, in the units of the arguments. Errors are half widths of 95 %
        confidence intervals.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import read_drops
    >>> time = np.arange(2000.0)
    >>> noise = np.random.default_rng(0).normal(scale=0.01, size=2000)
    >>> stress = 5.0 + 0.002 * (time % 500.0) + noise  # stress drops by 1 at 500, 1000 and 1500
    >>> readings = read_drops(time, stress, None, check_slip=False)
    >>> quantities = readings.quantities_of_each_drop
    >>> [round(values["static_stress_drop"][0], 1) for values, _ in quantities]
    [1.0, 1.0, 1.0]
    """
    found, detection = find_stress_drops(times, stress)
    ends = [-math.inf, *(of.fitted_drop.end_time for of in found)]
    begins = [*(of.fitted_drop.start_time for of in found[1:]), math.inf]
    rooms = [*zip(ends, begins, strict=False)][: len(found)]
    places = [find_sample_indices_of_drop(times, *of) for of in zip(found, rooms, strict=True)]
    each = zip(found, places, rooms, strict=True)
    rows = [compute_drop_quantities(times, stress, displacement, *of) for of in each]
    is_slip = (
        displacement is None
        or not check_slip
        or is_displacement_faster_during_drops(times, displacement, places)
    )
    return DropMeasurements(rows, detection, is_slip)


def is_displacement_faster_during_drops(
    times: np.ndarray, displacement: np.ndarray, drop_sample_indices: Sequence[DropSampleIndices]
) -> bool:
    """Return True if the displacement accelerates during stress drops.

    The displacement during each drop is compared with the displacements in intervals of the same
    duration before and after the drop.

    Parameters
    ----------
    times, displacement : ndarray, shape (samples,)
        Times and displacements of the samples.
    drop_sample_indices : sequence of DropSampleIndices
        Indices of the samples in each drop.

    Returns
    -------
    bool
        True if the displacement during the drops is significantly larger than before and after the
        drops.
    """
    excess = usual = variance = 0.0
    quantum = find_smallest_nonzero_difference(displacement)
    noises = {
        n: max(estimate_robust_sd(compute_window_mean_decreases(displacement, n)), quantum)
        for n in {place.averaging_sample_count for place in drop_sample_indices}
    }
    for begin, end, window in drop_sample_indices:
        far = end + window - begin
        places = (begin - window - far, begin - window, end, end + far)
        starts = np.clip(places, 0, len(displacement) - window)
        lasts, slips = (
            np.diff([of[at : at + window].mean() for at in starts]) for of in (times, displacement)
        )
        # The record may be too short before or after a drop.
        ratios = (lasts[1] / np.where(lasts > 0.0, lasts, math.inf))[::2]
        moved, ratio = float((ratios * slips[::2]).max()), float(ratios.max())
        excess, usual = excess + float(slips[1]) - moved, usual + abs(moved)
        variance += 0.5 * noises[window] ** 2 * (1.0 + (1.0 + ratio) ** 2 + ratio**2)
    return bool(
        excess
        > max(_MIN_EXCESS_SLIP_SIGMAS * math.sqrt(variance), _MIN_EXCESS_SLIP_FRACTION * usual)
    )


def find_sample_indices_of_drop(
    times: np.ndarray,
    detected_and_fitted_drop: DetectedAndFittedStressDrop,
    adjacent_drop_times: tuple[float, float],
) -> DropSampleIndices:
    """Find the samples that belong to a stress drop.

    The averaging window is shortened if it would overlap a neighbouring drop or extend beyond the
    record.

    Parameters
    ----------
    times : ndarray, shape (samples,)
        Times of the samples.
    detected_and_fitted_drop : DetectedAndFittedStressDrop
        Fitted drop.
    adjacent_drop_times : (float, float)
        End of the previous drop, and start of the next drop.

    Returns
    -------
    DropSampleIndices
        Indices of the samples in the drop, and number of samples to average.
    """
    drop, candidate = detected_and_fitted_drop
    begin = int(np.searchsorted(times, drop.start_time, "right"))
    end = max(int(np.searchsorted(times, drop.end_time, "left")), begin)
    before = int(np.searchsorted(times, drop.start_time - candidate.averaging_window_duration))
    first, last = (int(np.searchsorted(times, at)) for at in adjacent_drop_times)
    window = min(begin - before, begin - first, last - end, len(times) - end)
    window = max(min(window, len(times) // 4), 1)
    return DropSampleIndices(max(begin, window), min(end, len(times) - window), window)


def compute_drop_quantities(
    times: np.ndarray,
    stress: np.ndarray,
    displacement: np.ndarray | None,
    detected_and_fitted_drop: DetectedAndFittedStressDrop,
    sample_indices: DropSampleIndices,
    adjacent_drop_times: tuple[float, float],
) -> EventNumbers:
    """Compute the properties of a drop and their errors.

    Parameters
    ----------
    times, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples.
    displacement : ndarray, shape (samples,), or None
        Displacements of the samples. If the value is None, slip and slip rate are not computed.
    detected_and_fitted_drop : DetectedAndFittedStressDrop
        Fitted drop.
    sample_indices : DropSampleIndices
        Indices of the samples in the drop.
    adjacent_drop_times : (float, float)
        End of the previous drop, and start of the next drop.

    Returns
    -------
    row : dict of {str: (float, float)}
        Properties by name, as pairs of a value and its error. The error is the half width of a 95 %
        confidence interval.
    cut : int
        0 if the record contains the stress before and after the drop. The value is 1 if the record
        begins during the drop, 2 if the record ends during the drop, and 3 if both are true.
    """
    drop = detected_and_fitted_drop.fitted_drop
    row = {
        "time": (drop.start_time, drop.start_time_error),
        "duration": (
            max(drop.end_time - drop.start_time, 0.0) or drop.end_time_error,
            math.hypot(drop.start_time_error, drop.end_time_error),
        ),
        "stress_before": (drop.stress_before, drop.stress_before_error),
        "stress_after": (drop.stress_after, drop.stress_after_error),
        "static_stress_drop": (drop.stress_before - drop.stress_after, drop.stress_drop_error),
    }
    cut = int(drop.starts_before_record) + 2 * int(drop.ends_after_record)
    if displacement is not None:
        row |= _measure_slip_of_drop(
            times,
            stress,
            displacement,
            detected_and_fitted_drop,
            sample_indices,
            adjacent_drop_times,
        )
    return row, cut


def _measure_slip_of_drop(
    times: np.ndarray,
    stress: np.ndarray,
    displacement: np.ndarray,
    detected_and_fitted_drop: DetectedAndFittedStressDrop,
    sample_indices: DropSampleIndices,
    adjacent_drop_times: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """Compute the slip, peak slip rate and dynamic stress drop of a drop.

    Returns
    -------
    dict of {str: (float, float)}
        Pairs of a value and its error. The peak slip rate and the dynamic stress drop are NaN if
        the slip rate does not exceed its noise. The error of the peak slip rate is NaN if the value
        is only a lower bound, because the sampling interval is too long.
    """
    (drop, candidate), (begin, end, window) = detected_and_fitted_drop, sample_indices
    size = drop.stress_before - drop.stress_after
    first, last = (int(np.searchsorted(times, at)) for at in adjacent_drop_times)
    # If the window is shifted by m samples, the difference of means decreases by m drop/window.
    # The standard deviation of this change is sqrt(3 m/window) times the standard error. The
    # probability that noise shifts the drop further than this limit is 0.001.
    off = math.ceil(
        3.0
        * window
        * (DETECTION_MARGIN_IN_STANDARD_DEVIATIONS * candidate.window_mean_difference_stderr / size)
        ** 2
    )
    off = max(0, min(off, window, begin - window - first, last - end - window))
    begin, end = begin - off, end + off
    slips, rates = (
        -compute_window_mean_decreases(displacement, window),
        np.diff(displacement) / np.diff(times),
    )
    fastest = begin - 1 + int(np.argmax(rates[begin - 1 : max(end, begin)]))
    noise = estimate_robust_sd(rates)
    slip = displacement[end : end + window].mean() - displacement[begin - window : begin].mean()
    crept = abs(float(np.median(slips))) * (1.0 + 2.0 * off / window)
    row = {
        "slip": (slip, HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * estimate_robust_sd(slips) + crept)
    }
    row["peak_slip_rate"] = row["dynamic_stress_drop"] = math.nan, math.nan
    if rates[fastest] > noise * norm.isf(FALSE_DETECTION_PROBABILITY / len(rates)):
        error = HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * noise
        row["peak_slip_rate"] = rates[fastest], error + _bound_sampling_error(rates, fastest)
        # The slip rate may have its peak in any interval that is as fast within the noise. The
        # stress at the peak is between the stresses of the samples at the ends of these intervals.
        first, stop = _find_successive_rates_above(
            rates, fastest, float(rates[fastest]) - math.sqrt(2.0) * error
        )
        at_peak = float(stress[fastest : fastest + 2].mean())
        reading = float(np.abs(stress[first : stop + 1] - at_peak).max())
        reading += HALF_WIDTH_OF_95_PERCENT_CI_IN_STDERRS * estimate_robust_sd(np.diff(stress))
        row["dynamic_stress_drop"] = (
            drop.stress_before - at_peak,
            drop.stress_before_error + reading,
        )
    return row


def _bound_sampling_error(rates: np.ndarray, fastest: int) -> float:
    """Compute an upper limit of the amount by which sampling underestimates the peak slip rate.

    The mean slip rate over a sampling interval is smaller than the peak slip rate. The upper limit
    of the difference is the largest mean slip rate minus the mean of the two neighbouring slip
    rates. If the slip rate is a parabola near its peak, the difference is at most a third of this
    limit.

    Parameters
    ----------
    rates : ndarray, shape (samples - 1,)
        Mean slip rates between the samples.
    fastest : int
        Index of the largest mean slip rate of the event.

    Returns
    -------
    float
        Upper limit, or NaN if the sampling does not resolve the peak.
    """
    first, stop = _find_successive_rates_above(rates, fastest, 0.5 * float(rates[fastest]))
    if stop - first < _MIN_INTERVALS_AT_PEAK_SLIP_RATE:
        return math.nan
    beside = rates[[max(fastest - 1, 0), min(fastest + 1, len(rates) - 1)]]
    return max(float(rates[fastest] - beside.mean()), 0.0)


def _find_successive_rates_above(
    rates: np.ndarray, fastest: int, threshold: float
) -> tuple[int, int]:
    """Return the range of indices around the peak in which slip rates exceed a threshold."""
    slow = np.flatnonzero(rates <= threshold)
    after = int(np.searchsorted(slow, fastest))
    first = int(slow[after - 1]) + 1 if after else 0
    return first, int(slow[after]) if after < len(slow) else len(rates)
