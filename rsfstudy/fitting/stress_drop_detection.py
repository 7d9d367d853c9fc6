"""Detection of shear stress drops in a noisy record.

The function ``detect_stress_drops`` compares the mean stress in a window before each sample with
the mean stress in a window after the sample. The windows have lengths of 4, 8, 16, ... sampling
intervals. The scaled difference is the difference between the two mean stresses, divided by the
standard deviation of the differences during loading. Each peak of the scaled difference that
exceeds a threshold is reported as a stress drop (see ``scipy.signal.find_peaks``).

The standard deviation of the differences between mean stresses is estimated from the most frequent
differences [1]_, which occur during loading. The estimate is valid if stress drops occupy at most a
third of the record.

References
----------
.. [1] Rousseeuw and Leroy (1988), Statistica Neerlandica 42, 103-116.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks
from scipy.stats import norm

#: Probability that at least one drop is detected in a record of Gaussian noise.
FALSE_DETECTION_PROBABILITY = 1e-4
#: Length of the shortest averaging window in samples, and smallest ratio of the record length to
#: the length of the longest averaging window.
MIN_WINDOW_SAMPLES, MIN_RECORD_OVER_WINDOW_LENGTH = 4, 100
#: Smallest number of samples that a record must have for the detection of stress drops.
MIN_SAMPLES = MIN_WINDOW_SAMPLES * MIN_RECORD_OVER_WINDOW_LENGTH
#: A stress drop that exceeds the detection threshold by this number of standard deviations is
#: missed with a probability of 0.001.
DETECTION_MARGIN_IN_STANDARD_DEVIATIONS = 3.1
#: A stress drop starts and ends where the difference between the mean stresses before and after a
#: sample is equal to this number of standard deviations.
_DROP_START_AND_END_THRESHOLD_SIGMAS = 2.0
#: The noise is estimated from the shortest interval that contains this fraction of the values.
_VALUE_FRACTION_FOR_NOISE_ESTIMATE = 0.4
#: Ratio of the standard deviation to the median absolute deviation for Gaussian noise.
_STANDARD_DEVIATION_PER_MAD = 1.4826
#: A record is resampled if the ratio of its longest to its shortest sampling interval exceeds this
#: value.
_MAX_INTERVAL_RATIO_OF_EVEN_SAMPLING = 3.0
#: An averaging window is too short for a stress drop if the detection score of a longer window
#: exceeds the detection score of this window by more than this factor. The longer windows are twice
#: and four times as long.
_MIN_SCORE_RATIO_TO_PREFER_LONGER_WINDOW = 1.4
#: Index of the shortest averaging window from which the noise correlation is estimated. This window
#: is 16 samples long.
_SHORTEST_NOISE_CORRELATION_WINDOW_INDEX = 2
#: Smallest prominence of a peak that counts as a separate stress drop, relative to the height of
#: the peak.
_MIN_PROMINENCE_OVER_PEAK_HEIGHT = 0.5


class StressDropCandidate(NamedTuple):
    """Detected stress drop.

    Parameters
    ----------
    start_time, end_time : float
        Times at which the stress decrease begins and ends. Both times have a resolution of one
        averaging window.
    averaging_window_duration : float
        Duration of the averaging window, in the unit of ``start_time``.
    window_mean_difference_stderr : float
        Standard error of the difference between the mean stresses of two averaging windows.
    stderr_factor_of_correlated_noise : float
        Factor by which the correlation of the noise increases the standard error of a mean.
    """

    start_time: float
    end_time: float
    averaging_window_duration: float
    window_mean_difference_stderr: float
    stderr_factor_of_correlated_noise: float


class Detection(NamedTuple):
    """Result of the detection of stress drops in a record.

    Parameters
    ----------
    candidates : list of StressDropCandidate
        Detected drops in order of time.
    noise_sd : float
        Standard deviation of the noise.
    min_detectable_drop : float
        Smallest detectable drop. A drop of this size is missed with a probability of 0.001.
    max_moving_average_decrease : float
        Largest decrease in the moving average of stress.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import read_drops
    >>> time = np.arange(2000.0)
    >>> noise = np.random.default_rng(0).normal(scale=0.01, size=2000)
    >>> stress = 5.0 + 0.002 * (time % 500.0) + noise  # stress drops by 1 at 500, 1000 and 1500
    >>> detection = read_drops(time, stress, None, check_slip=False).detection
    >>> len(detection.candidates)
    3
    >>> round(detection.noise_sd, 2)
    0.01
    """

    candidates: list[StressDropCandidate]
    noise_sd: float
    min_detectable_drop: float
    max_moving_average_decrease: float


def estimate_robust_sd(samples: np.ndarray) -> float:
    """Estimate the standard deviation from the median absolute deviation.

    Parameters
    ----------
    samples : ndarray
        Samples of approximately Gaussian noise.

    Returns
    -------
    float
        Estimated standard deviation.
    """
    return _STANDARD_DEVIATION_PER_MAD * float(np.median(np.abs(samples - np.median(samples))))


def find_smallest_nonzero_difference(samples: np.ndarray) -> float:
    """Return the smallest nonzero difference between successive samples.

    Parameters
    ----------
    samples : ndarray, shape (samples,)
        Samples.

    Returns
    -------
    float
        Smallest difference, or infinity if all samples are equal.
    """
    steps = np.abs(np.diff(samples))
    return float(steps[steps > 0.0].min(initial=math.inf))


def fit_gaussian_to_most_frequent_values(values: np.ndarray) -> tuple[float, float]:
    """Estimate the mean and standard deviation of the most frequent values.

    The function finds the shortest interval that contains 40 % of the values. The results are the
    mean and the standard deviation of the Gaussian distribution whose central 40 % covers exactly
    this interval. Values outside the shortest interval have little effect on the estimates.

    Parameters
    ----------
    values : ndarray
        Samples of a mixture of distributions.

    Returns
    -------
    mean : float
        Mean of the Gaussian distribution.
    compute_standard_deviation : float
        Standard deviation of the Gaussian distribution.
    """
    ordered = np.sort(values)
    count = max(int(_VALUE_FRACTION_FOR_NOISE_ESTIMATE * len(ordered)), 1)
    widths = ordered[count:] - ordered[:-count]
    first = int(np.argmin(widths))
    middle = 0.5 * float(ordered[first] + ordered[first + count])
    return middle, float(widths[first]) / (
        2.0 * float(norm.ppf(0.5 + 0.5 * _VALUE_FRACTION_FOR_NOISE_ESTIMATE))
    )


def compute_window_mean_decreases(samples: np.ndarray, window_sample_count: int) -> np.ndarray:
    """Compute the difference between window means before and after each sample.

    Parameters
    ----------
    samples : ndarray, shape (samples,)
        Samples.
    window_sample_count : int
        Length of each window in samples.

    Returns
    -------
    ndarray, shape (samples - 2 * window + 1,)
        For each sample, the mean of the window that ends before the sample, minus the mean of the
        window that begins at the sample.
    """
    sums = np.concatenate([[0.0], np.cumsum(samples - samples.mean())])
    fallen = (
        2.0 * sums[window_sample_count:-window_sample_count]
        - sums[: -2 * window_sample_count]
        - sums[2 * window_sample_count :]
    )
    return np.asarray(fallen / window_sample_count)


def detect_stress_drops(time: np.ndarray, stress: np.ndarray) -> Detection:
    """Detect stress drops in a record.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples, in any units.

    Returns
    -------
    Detection
        Detected drops and noise properties.
    """
    t, s = _resample_evenly(time, stress)
    apart = float(t[-1] - t[0]) / (len(t) - 1)
    windows = [MIN_WINDOW_SAMPLES]
    while 2 * windows[-1] * MIN_RECORD_OVER_WINDOW_LENGTH <= len(s):
        windows.append(2 * windows[-1])
    quantum = min(find_smallest_nonzero_difference(stress), float(np.ptp(stress)))
    looks = float(norm.isf(FALSE_DETECTION_PROBABILITY / (len(s) * len(windows))))
    scales = [_WindowMeanDifferences(s, window, looks, quantum) for window in windows]
    found: list[StressDropCandidate] = []
    for number, scale in enumerate(scales):
        for first, last in scale.find_drops_not_clearer_in_longer_windows(
            scales[number + 1 : number + 3]
        ):
            begins, ends = float(t[max(first - 1, 0)]), float(t[min(last, len(t) - 1)])
            length = scale.window_samples * apart
            reach = length if found else 0.0
            if any(
                begins < one.end_time + reach and one.start_time - reach < ends for one in found
            ):
                continue
            wider = min(max(number + 1, _SHORTEST_NOISE_CORRELATION_WINDOW_INDEX), len(scales) - 1)
            correlation = scales[wider].stderr_factor_of_correlated_noise
            found.append(
                StressDropCandidate(
                    begins, ends, length, scale.decrease_standard_deviation, correlation
                )
            )
    best = min(scales, key=lambda scale: scale.detectable_drop)
    means = np.convolve(s, np.full(best.window_samples, 1.0 / best.window_samples), "valid")
    variation = float((np.maximum.accumulate(means) - means).max())
    return Detection(sorted(found), scales[-1].noise_sd, best.detectable_drop, variation)


def _resample_evenly(time: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Resample a record evenly if its sampling intervals vary strongly.

    The new sampling interval is the median sampling interval, weighted by duration. The function
    averages the samples within each new interval, and interpolates the values of intervals without
    samples.
    """
    gaps = np.diff(time)
    if gaps.max() < _MAX_INTERVAL_RATIO_OF_EVEN_SAMPLING * gaps.min():
        return time, stress
    ordered = np.sort(gaps)
    sums = np.cumsum(ordered)
    apart = float(ordered[np.searchsorted(sums, 0.5 * sums[-1])])
    bins = np.floor((time - time[0]) / apart + 1e-9).astype(int)
    count = int(bins[-1]) + 1
    if not MIN_WINDOW_SAMPLES * MIN_RECORD_OVER_WINDOW_LENGTH <= count <= 4 * len(time):
        return time, stress
    samples = np.bincount(bins, minlength=count)
    has = samples > 0
    sums_of = (np.bincount(bins, weights=of, minlength=count)[has] for of in (time, stress))
    t, s = (of / samples[has] for of in sums_of)
    even = time[0] + apart * (np.arange(count) + 0.5)
    even[has] = t
    return even, np.interp(even, t, s)


class _WindowMeanDifferences:
    """Differences between the mean stresses of successive windows.

    Parameters
    ----------
    stress : ndarray, shape (samples,)
        Shear stresses of the samples.
    window_samples : int
        Window length in samples.
    threshold_sigmas : float
        Detection threshold in standard deviations. The threshold accounts for the number of tested
        windows and samples.
    rounding_quantum : float
        Resolution of the recorded stress.
    """

    def __init__(
        self,
        stress: np.ndarray,
        window_samples: int,
        threshold_sigmas: float,
        rounding_quantum: float,
    ) -> None:
        change = compute_window_mean_decreases(stress, window_samples)
        self.window_samples, self.sample_count = window_samples, len(stress)
        self.typical_decrease, decrease_sd = fit_gaussian_to_most_frequent_values(change)
        # If there is no noise, the resolution of stress determines the spread.
        self.decrease_standard_deviation = max(
            decrease_sd, rounding_quantum / math.sqrt(6.0 * window_samples)
        )
        # The spread has an error, because it is estimated from few independent windows.
        surely = 1.0 + 2.33 / math.sqrt(len(stress) / (2.0 * window_samples))
        self.detection_threshold = max(
            threshold_sigmas * surely * self.decrease_standard_deviation, 2.0 * rounding_quantum
        )
        self.detectable_drop = (
            self.detection_threshold
            + DETECTION_MARGIN_IN_STANDARD_DEVIATIONS * self.decrease_standard_deviation
        )
        self.excess_decrease = change - max(0.0, self.typical_decrease)
        lag = fit_gaussian_to_most_frequent_values(
            stress[window_samples:] - stress[:-window_samples]
        )[1]
        self.noise_sd = max(lag / math.sqrt(2.0), rounding_quantum / math.sqrt(12.0))
        # The lower limit is correct for white noise, and the upper limit for noise that is constant
        # within a window.
        ratio = (
            self.decrease_standard_deviation
            / (self.noise_sd or 1.0)
            / math.sqrt(2.0 / window_samples)
        )
        self.stderr_factor_of_correlated_noise = min(max(ratio, 1.0), math.sqrt(window_samples))

    def compute_detection_scores(self, sample_indices: np.ndarray) -> np.ndarray:
        """Compute the detection scores of samples.

        The detection score of a sample is the difference between the mean stresses before and after
        the sample, divided by the standard deviation of the differences and by the square root of
        the window length.

        Parameters
        ----------
        sample_indices : ndarray of int
            Indices of samples.

        Returns
        -------
        ndarray
            Score of each sample, or 0 for samples that are too close to the ends of the record.
        """
        at = sample_indices - self.window_samples
        inside = (at >= 0) & (at < len(self.excess_decrease))
        net = np.where(
            inside, self.excess_decrease[np.clip(at, 0, len(self.excess_decrease) - 1)], 0.0
        )
        return np.asarray(
            net / (self.decrease_standard_deviation or 1.0) / math.sqrt(self.window_samples)
        )

    def find_drops_not_clearer_in_longer_windows(
        self, longer_windows: list[_WindowMeanDifferences]
    ) -> list[tuple[int, int]]:
        """Find the drops that longer windows do not detect with clearly higher scores.

        Parameters
        ----------
        longer_windows : list of _WindowMeanDifferences
            Window mean differences for all longer windows. A stress drop is skipped if its
            detection score is clearly higher for a longer window.

        Returns
        -------
        list of (int, int)
            For each drop, the index of the first sample after its start, and the index of the first
            sample after its end.
        """
        # The values are padded because a peak may be at an end of the record.
        padded = np.concatenate([[0.0], self.excess_decrease, [0.0]])
        peaks, about = find_peaks(padded, height=self.detection_threshold, prominence=0.0)
        peaks = peaks[about["prominences"] > _MIN_PROMINENCE_OVER_PEAK_HEIGHT * padded[peaks]]
        places = peaks - 1 + self.window_samples
        better = [
            scale.compute_detection_scores(places)
            > _MIN_SCORE_RATIO_TO_PREFER_LONGER_WINDOW * self.compute_detection_scores(places)
            for scale in longer_windows
        ]
        complete = ~np.any(better, axis=0) if better else np.ones(len(peaks), dtype=bool)
        least = min(
            _DROP_START_AND_END_THRESHOLD_SIGMAS * self.decrease_standard_deviation,
            self.detection_threshold,
        )
        below = np.flatnonzero(padded <= least)
        found = []
        for peak in peaks[complete].tolist():
            place = int(np.searchsorted(below, peak))
            start, stop = int(below[place - 1]), int(below[place])
            # A sudden drop affects all windows that contain the drop.
            begin = min(start + self.window_samples - 1, peak - 1)
            end = max(stop - 1 - self.window_samples, peak - 1)
            found.append((begin + self.window_samples, end + self.window_samples))
        return found
