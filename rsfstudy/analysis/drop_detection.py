"""Detection of drops of shear stress in a noisy record.

The mean stress in a window before each sample is compared with the mean stress in a window after
the sample. The windows are 4, 8, 16 and more sampling intervals long. The difference is divided by
its standard deviation under noise. The standard deviation is estimated from the most frequent
differences, which occur during loading. This estimate is valid if drops occupy no more than a third
of the record. Peaks of the scaled difference that exceed a threshold are drops [1]_.

References
----------
.. [1] ``scipy.signal.find_peaks``, with a minimum height and a minimum prominence.
.. [2] Rousseeuw and Leroy (1988), Statistica Neerlandica 42, 103-116, for the shortest half.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks
from scipy.stats import norm

#: Probability of a false detection in a record of Gaussian noise.
CHANCE = 1e-4
#: Shortest windows in samples, and samples of a record for each sample of the longest window.
SHORTEST, SAMPLES = 4, 100
#: Standard deviations by which a drop must exceed the threshold to be missed once in 1,000.
FOUND = 3.1
#: Scaled difference down to which a drop extends from its peak, in standard deviations.
_FOLLOWED = 2.0
#: Fraction of the values in the shortest interval, from which the noise is estimated.
_SHARE = 0.4
#: Ratio of standard deviation to median absolute deviation of Gaussian noise.
_NORMAL = 1.4826
#: A record is resampled if its sampling intervals differ by more than this factor.
_UNEVEN = 3.0
#: A window covers only a part of a drop if the score of a window 2 or 4 times as long is larger by
#: this factor. The score is the scaled difference divided by the square root of the window length.
_PARTIAL = 1.4
#: Index of the shortest window from which the correlation of the noise is estimated: 16 samples.
_LEAST_SCALE = 2
#: Peaks are separate if the minimum between them is lower by this fraction of the lower peak.
_SEPARATE = 0.5


class Candidate(NamedTuple):
    """A drop of stress that exceeds the noise.

    Attributes
    ----------
    begins, ends : float
        Times between which stress falls, at the resolution of the window.
    window : float
        Length of the window, in units of time.
    error : float
        Standard error of the difference between two window means.
    correlation : float
        Factor by which the correlation of the noise increases the standard error of a mean.
    """

    begins: float
    ends: float
    window: float
    error: float
    correlation: float


class Detection(NamedTuple):
    """Drops that were detected in a record.

    Attributes
    ----------
    candidates : list of Candidate
        Drops in order of time.
    noise : float
        Standard deviation of the noise.
    smallest : float
        Size of a drop that is missed once in 1,000 records.
    variation : float
        Largest decrease of the moving average of stress.
    """

    candidates: list[Candidate]
    noise: float
    smallest: float
    variation: float


def spread(values: np.ndarray) -> float:
    """Estimate the standard deviation from the median absolute deviation."""
    return _NORMAL * float(np.median(np.abs(values - np.median(values))))


def quantum_of(values: np.ndarray) -> float:
    """Return the smallest nonzero difference between successive samples.

    Returns
    -------
    float
        Infinity if all samples are equal.
    """
    steps = np.abs(np.diff(values))
    return float(steps[steps > 0.0].min(initial=math.inf))


def most_frequent(values: np.ndarray) -> tuple[float, float]:
    """Estimate the mean and standard deviation of the most frequent values.

    The function finds the shortest interval that contains 40 % of the values. The interval is then
    matched to the central 40 % of a Gaussian distribution. Other values of the mixture have little
    effect on the estimate.

    Returns
    -------
    mean, standard_deviation : float
    """
    ordered = np.sort(values)
    count = max(int(_SHARE * len(ordered)), 1)
    widths = ordered[count:] - ordered[:-count]
    first = int(np.argmin(widths))
    middle = 0.5 * float(ordered[first] + ordered[first + count])
    return middle, float(widths[first]) / (2.0 * float(norm.ppf(0.5 + 0.5 * _SHARE)))


def falls(values: np.ndarray, window: int) -> np.ndarray:
    """Compute the difference of window means before and after each sample.

    Parameters
    ----------
    values : ndarray, shape (samples,)
    window : int
        Length of each window in samples.

    Returns
    -------
    ndarray, shape (samples - 2 * window + 1,)
        Mean of the window before the sample minus mean of the window after the sample.
    """
    sums = np.concatenate([[0.0], np.cumsum(values - values.mean())])
    fallen = 2.0 * sums[window:-window] - sums[: -2 * window] - sums[2 * window :]
    return np.asarray(fallen / window)


def detect_drops(time: np.ndarray, stress: np.ndarray) -> Detection:
    """Detect drops of stress in a record.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)

    Returns
    -------
    Detection
    """
    t, s = _even(time, stress)
    apart = float(t[-1] - t[0]) / (len(t) - 1)
    windows = [SHORTEST]
    while 2 * windows[-1] * SAMPLES <= len(s):
        windows.append(2 * windows[-1])
    quantum = min(quantum_of(stress), float(np.ptp(stress)))
    looks = float(norm.isf(CHANCE / (len(s) * len(windows))))
    scales = [_Scale(s, window, looks, quantum) for window in windows]
    found: list[Candidate] = []
    for number, scale in enumerate(scales):
        for first, last in scale.peaks(scales[number + 1 : number + 3]):
            begins, ends = float(t[max(first - 1, 0)]), float(t[min(last, len(t) - 1)])
            length = scale.window * apart
            reach = length if found else 0.0
            if any(begins < one.ends + reach and one.begins - reach < ends for one in found):
                continue
            wider = min(max(number + 1, _LEAST_SCALE), len(scales) - 1)
            correlation = scales[wider].correlation
            found.append(Candidate(begins, ends, length, scale.spread, correlation))
    best = min(scales, key=lambda scale: scale.smallest)
    means = np.convolve(s, np.full(best.window, 1.0 / best.window), "valid")
    variation = float((np.maximum.accumulate(means) - means).max())
    return Detection(sorted(found), scales[-1].noise, best.smallest, variation)


def _even(time: np.ndarray, stress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Resample a record to even intervals if its sampling intervals vary.

    The new sampling interval is chosen such that half of the record duration was sampled at this
    interval or at shorter intervals. Samples within a new interval are averaged. Values for empty
    intervals are interpolated.
    """
    gaps = np.diff(time)
    if gaps.max() < _UNEVEN * gaps.min():
        return time, stress
    ordered = np.sort(gaps)
    sums = np.cumsum(ordered)
    apart = float(ordered[np.searchsorted(sums, 0.5 * sums[-1])])
    bins = np.floor((time - time[0]) / apart + 1e-9).astype(int)
    count = int(bins[-1]) + 1
    if not SHORTEST * SAMPLES <= count <= 4 * len(time):
        return time, stress
    samples = np.bincount(bins, minlength=count)
    has = samples > 0
    sums_of = (np.bincount(bins, weights=of, minlength=count)[has] for of in (time, stress))
    t, s = (of / samples[has] for of in sums_of)
    even = time[0] + apart * (np.arange(count) + 0.5)
    even[has] = t
    return even, np.interp(even, t, s)


class _Scale:
    """Differences of window means for one window length.

    Parameters
    ----------
    stress : ndarray, shape (samples,)
    window : int
        Window length in samples.
    looks : float
        Detection threshold in standard deviations. The threshold accounts for the number of windows
        and samples that are tested.
    quantum : float
        Resolution of stress.
    """

    def __init__(self, stress: np.ndarray, window: int, looks: float, quantum: float) -> None:
        change = falls(stress, window)
        self.window, self.samples = window, len(stress)
        self.usual, spread = most_frequent(change)
        # if there is no noise, the resolution determines the spread
        self.spread = max(spread, quantum / math.sqrt(6.0 * window))
        # allow for the error of the spread, which is estimated from few independent windows
        surely = 1.0 + 2.33 / math.sqrt(len(stress) / (2.0 * window))
        self.threshold = max(looks * surely * self.spread, 2.0 * quantum)
        self.smallest = self.threshold + FOUND * self.spread
        self.net = change - max(0.0, self.usual)
        lag = most_frequent(stress[window:] - stress[:-window])[1]
        self.noise = max(lag / math.sqrt(2.0), quantum / math.sqrt(12.0))
        # between white noise and noise that is constant within a window
        ratio = self.spread / (self.noise or 1.0) / math.sqrt(2.0 / window)
        self.correlation = min(max(ratio, 1.0), math.sqrt(window))

    def score(self, places: np.ndarray) -> np.ndarray:
        """Compute the scaled difference divided by the square root of the window.

        Parameters
        ----------
        places : ndarray of int
            Indices of samples.

        Returns
        -------
        ndarray
            The values are 0 for samples too close to the ends of the record.
        """
        at = places - self.window
        inside = (at >= 0) & (at < len(self.net))
        net = np.where(inside, self.net[np.clip(at, 0, len(self.net) - 1)], 0.0)
        return np.asarray(net / (self.spread or 1.0) / math.sqrt(self.window))

    def peaks(self, longer: list[_Scale]) -> list[tuple[int, int]]:
        """Find the drops that are detected best with this window.

        Parameters
        ----------
        longer : list of _Scale
            Scales with longer windows. Drops that stand out more with a longer window are skipped.

        Returns
        -------
        list of (int, int)
            For each drop, the index of the first sample after its beginning, and the index of the
            first sample after its end.
        """
        padded = np.concatenate([[0.0], self.net, [0.0]])  # so that peaks may be at the ends
        peaks, about = find_peaks(padded, height=self.threshold, prominence=0.0)
        peaks = peaks[about["prominences"] > _SEPARATE * padded[peaks]]
        places = peaks - 1 + self.window
        better = [scale.score(places) > _PARTIAL * self.score(places) for scale in longer]
        complete = ~np.any(better, axis=0) if better else np.ones(len(peaks), dtype=bool)
        least = min(_FOLLOWED * self.spread, self.threshold)
        below = np.flatnonzero(padded <= least)
        found = []
        for peak in peaks[complete].tolist():
            place = int(np.searchsorted(below, peak))
            start, stop = int(below[place - 1]), int(below[place])  # in terms of `padded`
            # a sudden drop affects all windows that contain it
            begin = min(start + self.window - 1, peak - 1)
            end = max(stop - 1 - self.window, peak - 1)
            found.append((begin + self.window, end + self.window))
        return found
