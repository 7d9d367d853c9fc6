"""Function that detects and fits the shear stress drops in a record.

The module ``stress_drop_detection`` detects the drops, and the module
``three_line_stress_drop_fit`` fits straight lines to each drop. The module ``concave_stress_fit``
measures the highest stress before each drop and the lowest stress after each drop. The function
``find_stress_drops`` uses these modules.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rsfstudy.fitting.concave_stress_fit import measure_stress_extrema
from rsfstudy.fitting.stress_drop_detection import (
    Detection,
    StressDropCandidate,
    detect_stress_drops,
    estimate_robust_sd,
)
from rsfstudy.fitting.three_line_stress_drop_fit import FittedStressDrop, fit_stress_drop

#: Scale, table heading and description of each property of an event.
EVENT_QUANTITIES = {
    "time": ("D_c/V_*", "time", "time at which the event begins"),
    "duration": ("D_c/V_*", "duration", "duration of the event"),
    "interval": ("D_c/V_*", "interval", "time since the beginning of the previous event"),
    "peak_log10_slip_rate": ("", "lg V_max/V_*", "decimal logarithm of peak slip rate over V_star"),
    "peak_slip_rate": ("V_*", "peak rate", "peak slip rate"),
    "slip": ("D_c", "slip", "slip during the event"),
    "stress_before": ("sigma_*", "", "highest shear stress before the event"),
    "stress_after": ("sigma_*", "", "lowest shear stress after the event"),
    "static_stress_drop": ("sigma_*", "static drop", "highest minus lowest shear stress"),
    "dynamic_stress_drop": (
        "sigma_*",
        "dynamic drop",
        "highest shear stress minus shear stress at peak slip rate",
    ),
}
#: Properties of an event, and a flag for incomplete events. The properties are a dictionary. For
#: each name, the dictionary contains a value and its error.
EventNumbers = tuple[dict[str, tuple[float, float]], int]
#: A stress drop is accepted if the ratio of its size to the half width of the 95 % confidence
#: interval of its size exceeds this value.
_MIN_DROP_SIZE_OVER_CI_HALF_WIDTH = 1.0


class DetectedAndFittedStressDrop(NamedTuple):
    """Fitted stress drop and the corresponding detected drop.

    Parameters
    ----------
    fitted_drop : FittedStressDrop
        Result of the fit.
    detected_drop : StressDropCandidate
        Detected drop.
    """

    fitted_drop: FittedStressDrop
    detected_drop: StressDropCandidate


def find_stress_drops(
    time: np.ndarray, stress: np.ndarray
) -> tuple[list[DetectedAndFittedStressDrop], Detection]:
    """Find and fit the stress drops in a record.

    If two fitted drops overlap, the two detected drops are merged and fitted again as a single
    drop.

    Parameters
    ----------
    time, stress : ndarray, shape (samples,)
        Times and shear stresses of the samples, in any units.

    Returns
    -------
    drops : list of DetectedAndFittedStressDrop
        Drops in order of time.
    detection : Detection
        Result of the detection.
    """
    detection = detect_stress_drops(time, stress)
    candidates = detection.candidates
    while True:
        found = _fit_drop_candidates(time, stress, candidates, detection)
        merged = _merge_overlapping_drop_candidates(found)
        if len(merged) == len(candidates):
            break
        candidates = merged
    sure = [
        of
        for of in found
        if _compute_drop_size(of.fitted_drop)
        > _MIN_DROP_SIZE_OVER_CI_HALF_WIDTH * of.fitted_drop.stress_drop_error
    ]
    if not sure:
        return sure, detection
    return _measure_drops(time, stress, sure, detection)


def _measure_drops(
    time: np.ndarray,
    stress: np.ndarray,
    drops: list[DetectedAndFittedStressDrop],
    detection: Detection,
) -> tuple[list[DetectedAndFittedStressDrop], Detection]:
    """Measure the highest and the lowest stress of each drop, and the noise between the drops.

    The detection overestimates the noise if drops are slow or if stress does not change linearly
    between the drops. The residuals of the concave and convex fits contain only the noise.
    """
    residual = float(np.median([of.fitted_drop.residual_sd for of in drops]))
    noise = min(detection.noise_sd, residual)
    ends = [-np.inf, *(of.fitted_drop.end_time for of in drops)]
    begins = [*(of.fitted_drop.start_time for of in drops[1:]), np.inf]
    measured, residuals = [], []
    for of, room in zip(drops, zip(ends, begins, strict=False), strict=False):
        drop, left = measure_stress_extrema(time, stress, *of, room, noise)
        measured.append(of._replace(fitted_drop=drop))
        residuals.append(left)
    pooled = np.concatenate(residuals)
    if len(pooled):
        noise = min(noise, estimate_robust_sd(pooled))
    return measured, detection._replace(noise_sd=noise)


def _compute_drop_size(drop: FittedStressDrop) -> float:
    """Return the decrease in stress during a drop."""
    return drop.stress_before - drop.stress_after


def _fit_drop_candidates(
    time: np.ndarray,
    stress: np.ndarray,
    candidates: list[StressDropCandidate],
    detection: Detection,
) -> list[DetectedAndFittedStressDrop]:
    """Fit each detected drop within the interval between its neighbours."""
    ends = [float(time[0]), *(one.end_time for one in candidates)]
    begins = [*(one.start_time for one in candidates[1:]), float(time[-1])]
    return [
        DetectedAndFittedStressDrop(
            fit_stress_drop(time, stress, one, room, detection.noise_sd), one
        )
        for one, room in zip(candidates, zip(ends, begins, strict=False), strict=False)
    ]


def _merge_overlapping_drop_candidates(
    detected_and_fitted_drops: list[DetectedAndFittedStressDrop],
) -> list[StressDropCandidate]:
    """Merge the detected drops whose fits overlap."""
    merged: list[StressDropCandidate] = []
    reached = -np.inf
    for drop, candidate in detected_and_fitted_drops:
        if merged and drop.start_time < reached:
            last = merged[-1]
            window = max(last.averaging_window_duration, candidate.averaging_window_duration)
            error = min(last.window_mean_difference_stderr, candidate.window_mean_difference_stderr)
            correlation = max(
                last.stderr_factor_of_correlated_noise, candidate.stderr_factor_of_correlated_noise
            )
            ends = max(last.end_time, candidate.end_time)
            merged[-1] = StressDropCandidate(last.start_time, ends, window, error, correlation)
        else:
            merged.append(candidate)
        reached = max(reached, drop.end_time)
    return merged
