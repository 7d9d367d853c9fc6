r"""Functions that measure frictional healing and relaxation in the holds of a record.

A hold is an interval in which the load point is at rest between sliding and reloading. Let
:math:`\mu_0` be the friction before the hold, :math:`\mu_h` the friction at the end of the hold,
and :math:`\mu_p` the peak friction after reloading. As in the measure ``Healing``, relaxation is
:math:`\mu_h - \mu_0`, and healing is :math:`\mu_p - \mu_0`.

The three friction values are estimated jointly by generalised least squares with correlated noise.
:math:`\mu_0` is the mean friction of the linear portion before the hold. To estimate :math:`\mu_h`,
a polynomial in the logarithm of the hold time is fitted to friction and evaluated at the end of the
hold. :math:`\mu_p` is the maximum of a polynomial in time. The common linear trend of friction with
load point displacement is subtracted.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial import polynomial
from scipy.linalg import block_diag
from scipy.ndimage import median_filter

from rsfstudy.fitting.friction_trend import (
    MIN_ROWS,
    fit_friction_trend,
    select_steady_rows_before_step,
)
from rsfstudy.fitting.hold_table import build_hold_table
from rsfstudy.fitting.local_regression import (
    GeneralisedLeastSquaresFit,
    choose_longest_polynomial_window,
    find_polynomial_maximum_position,
    fit_linear_model,
    rescale_to_minus_one_to_one,
)
from rsfstudy.fitting.velocity_steps import LoadingStep, noise_variance

#: The load point is at rest if its velocity is at most this fraction of the velocities before and
#: after the hold.
MAX_HOLD_OVER_SLIDING_VELOCITY = 0.01
#: The first value is the number of standard deviations of the noise by which friction must fall
#: below its running maximum after a peak. The second value is the number of rows in the running
#: median that removes spikes.
_MIN_FALL_AFTER_PEAK_SIGMAS, _RUNNING_MEDIAN_ROWS = 6.0, 5
#: Half widths in rows of the windows around a peak, and numbers of rows of the windows at the end
#: of a hold.
_PEAK_WINDOW_HALF_WIDTHS_IN_ROWS = tuple(
    np.unique(np.rint(3.0 * 1.25 ** np.arange(50)).astype(int)).tolist()
)
_HOLD_END_WINDOW_LENGTHS_IN_ROWS = tuple(
    np.unique(np.rint(6.0 * 1.4 ** np.arange(40)).astype(int)).tolist()
)
#: Degrees of polynomials, for the peak and for the end of a hold. In each pair, the first degree is
#: used to select the window, and the second degree is used to estimate friction.
_PEAK_DEGREES, _HOLD_END_DEGREES = (2, 4), (1, 2)
#: Number of iterations in which the window around a peak is centred on the estimated peak.
_MAX_PEAK_CENTRING_ITERATIONS = 4
#: The noise is estimated from rows before the hold whose sampling interval differs from the
#: sampling interval after the hold by at most this factor. If there are too few such rows, the
#: noise is estimated from the second half of the rows after the hold.
_MAX_SAMPLING_INTERVAL_RATIO_FOR_NOISE = 2.0


class Hold(NamedTuple):
    """Hold of the load point, described by the adjacent rows and steps.

    Parameters
    ----------
    steady_rows_before_hold : ndarray of int
        Rows of steady sliding before the hold.
    loading_step_at_start : LoadingStep
        Step at which the load point stops.
    loading_step_at_end : LoadingStep
        Step at which the load point starts again.
    next_step_or_record_end_time : float
        Time in s of the next step, or of the end of the record.
    """

    steady_rows_before_hold: np.ndarray
    loading_step_at_start: LoadingStep
    loading_step_at_end: LoadingStep
    next_step_or_record_end_time: float

    @property
    def quantities_without_uncertainty(self) -> tuple[float, float, float, float]:
        """Start time and duration of the hold in s, and adjacent velocities in um/s."""
        duration = self.loading_step_at_end.middle_time - self.loading_step_at_start.middle_time
        return (
            self.loading_step_at_start.middle_time,
            duration,
            self.loading_step_at_start.velocity_before,
            self.loading_step_at_end.velocity_after,
        )


class HoldQuantityEstimate(NamedTuple):
    """Estimate of a quantity from the coefficients of a linear model.

    Parameters
    ----------
    value : float
        Value of the quantity.
    derivatives_by_coefficient : ndarray, shape (parameters,)
        Derivatives of the quantity with respect to the coefficients.
    additional_variance : float, default: 0.0
        Additional variance of the quantity, which does not depend on the coefficients.
    derivative_by_friction_trend : float, default: 0.0
        Derivative of the quantity with respect to the trend.
    """

    value: float
    derivatives_by_coefficient: np.ndarray
    additional_variance: float = 0.0
    derivative_by_friction_trend: float = 0.0

    def subtract(self, other_estimate: HoldQuantityEstimate) -> HoldQuantityEstimate:
        """Return the difference between two estimates."""
        return HoldQuantityEstimate(
            self.value - other_estimate.value,
            self.derivatives_by_coefficient - other_estimate.derivatives_by_coefficient,
            self.additional_variance + other_estimate.additional_variance,
            self.derivative_by_friction_trend - other_estimate.derivative_by_friction_trend,
        )


def find_holds(time: np.ndarray, friction: np.ndarray, steps: Sequence[LoadingStep]) -> list[Hold]:
    """Find the holds in the steps of a record.

    Parameters
    ----------
    time, friction : ndarray, shape (rows,)
        Times in s and friction.
    steps : sequence of LoadingStep
        Steps of the record in order of time.

    Returns
    -------
    list of Hold
        Holds in order of time.
    """
    found = []
    for number, (stop, reload) in enumerate(itertools.pairwise(steps)):
        sliding = min(stop.velocity_before, reload.velocity_after)
        if not abs(stop.velocity_after) <= MAX_HOLD_OVER_SLIDING_VELOCITY * sliding:
            continue
        first = steps[number - 1].end if number else time[0]
        rows = select_steady_rows_before_step(time, friction, float(first), stop.start)
        ends = steps[number + 2].start if number + 2 < len(steps) else time[-1]
        found.append(Hold(rows, stop, reload, float(ends)))
    return found


def measure_holds(
    time: np.ndarray,
    displacement: np.ndarray,
    friction: np.ndarray,
    steps: Sequence[LoadingStep],
) -> xr.Dataset:
    """Measure healing and relaxation in all holds of a record.

    Parameters
    ----------
    time, displacement, friction : ndarray, shape (rows,)
        Times in s, load point displacements in um, and friction.
    steps : sequence of LoadingStep
        Steps of the record in order of time.

    Returns
    -------
    xarray.Dataset
        Table of holds (see ``Record.holds``).
    """
    moves = [step for step in steps if step.changes_velocity]
    holds = find_holds(time, friction, moves)
    trend, trend_stderr = fit_friction_trend(time, friction, moves)
    guard = noise_variance(time, displacement) if holds and len(time) > 2 else 0.0
    results = [
        HoldFit(time, friction, hold, trend, guard).estimate_hold_quantities() for hold in holds
    ]
    # The rows are holds, and the columns are the quantities that have errors.
    values, errors, slopes = (np.array([of[n] for of in results]).reshape(-1, 5) for n in range(3))
    by_trend = trend_stderr * slopes
    of_healing = np.diag(errors[:, 2] ** 2) + np.outer(by_trend[:, 2], by_trend[:, 2])
    exact = np.array([hold.quantities_without_uncertainty for hold in holds]).reshape(-1, 4)
    table = build_hold_table(exact, values, np.hypot(errors, by_trend), of_healing)
    words = "subtracted trend of friction"
    table["trend"] = (), trend, {"long_name": words, "units": "um-1"}
    words = f"standard error of the {words}"
    table["trend_stderr"] = (), trend_stderr, {"long_name": words, "units": "um-1"}
    return table


class HoldFit:
    """Fit of friction before, during and after a hold.

    Parameters
    ----------
    time, friction : ndarray, shape (rows,)
        Times in s and friction of the record.
    hold : Hold
        Hold to measure.
    trend : float
        Trend of friction with load point displacement in 1/um.
    displacement_variance : float
        Noise variance of the load point displacement in um^2.
    """

    def __init__(
        self,
        time: np.ndarray,
        friction: np.ndarray,
        hold: Hold,
        trend: float,
        displacement_variance: float,
    ) -> None:
        self.time, self.hold, self.displacement_variance = time, hold, displacement_variance
        late = np.maximum(time - hold.loading_step_at_end.middle_time, 0.0)
        early = np.minimum(time - hold.loading_step_at_start.middle_time, 0.0)
        #: Load point displacement minus the displacement during the hold.
        self.moved = (
            hold.loading_step_at_start.velocity_before * early
            + hold.loading_step_at_end.velocity_after * late
        )
        self.level = friction - trend * self.moved
        self.rows_after = np.flatnonzero(
            (time > hold.loading_step_at_end.middle_time)
            & (time < hold.next_step_or_record_end_time)
        )

    def estimate_hold_quantities(self) -> tuple[list[float], list[float], list[float]]:
        """Estimate the quantities of the hold, with their standard errors.

        Returns
        -------
        values : list of float
            Friction before the hold, peak friction, healing, relaxation, and peak displacement in
            um. Values that cannot be determined are NaN.
        stderrs : list of float
            Standard errors of the values, without the error of the trend.
        trend_derivatives : list of float
            Derivatives of the values with respect to the trend.
        """
        before, time = self.hold.steady_rows_before_hold, self.time
        if not len(before):
            return [math.nan] * 5, [math.nan] * 5, [0.0] * 5
        held, (peak, is_adequate) = self._choose_rows_of_hold_end(), self._choose_rows_of_peak()
        parts = [(before, np.ones((len(before), 1)))]
        if len(held):
            parts.append(
                (held, polynomial.polyvander(self._compute_normalised_log_hold_time(held), 2))
            )
        if len(peak):
            parts.append(
                (
                    peak,
                    polynomial.polyvander(
                        rescale_to_minus_one_to_one(time[peak]), _PEAK_DEGREES[1]
                    ),
                )
            )
        rows = np.concatenate([of for of, _columns in parts])
        clock = np.concatenate([time[of] - time[of[0]] for of, _columns in parts])
        columns = block_diag(*(columns for _of, columns in parts))
        found = fit_linear_model(clock, self.level[rows], columns)
        unknown = HoldQuantityEstimate(math.nan, np.zeros(columns.shape[1]), math.nan)
        weights = np.eye(columns.shape[1])
        first = HoldQuantityEstimate(
            float(found.coefficients[0]), weights[0], 0.0, -float(self.moved[before].mean())
        )
        end = unknown
        if len(held):  # The coordinate of the end of the hold is 1.
            weights_of_end = weights[1 : 2 + _HOLD_END_DEGREES[1]].sum(axis=0)
            end = HoldQuantityEstimate(float(weights_of_end @ found.coefficients), weights_of_end)
        top, distance = unknown, unknown
        if len(peak):
            top, distance = self._estimate_peak_friction_and_displacement(
                found, peak, is_adequate
            ) or (unknown, unknown)
        estimates = first, top, top.subtract(first), end.subtract(first), distance
        variances = (
            e.derivatives_by_coefficient
            @ found.coefficient_covariance
            @ e.derivatives_by_coefficient
            + e.additional_variance
            for e in estimates
        )
        return (
            [estimate.value for estimate in estimates],
            [math.sqrt(variance) for variance in variances],
            [estimate.derivative_by_friction_trend for estimate in estimates],
        )

    @cached_property
    def _noise_reference_fit(self) -> GeneralisedLeastSquaresFit:
        """Fit to rows that do not contain a friction peak.

        The noise estimated by this fit is used to select windows.
        """
        rows, after = self.hold.steady_rows_before_hold, self.rows_after
        if len(after) > 1:
            gaps = np.gradient(self.time)
            ratio = gaps[rows] / float(np.median(gaps[after]))
            alike = np.abs(np.log(ratio)) < math.log(_MAX_SAMPLING_INTERVAL_RATIO_FOR_NOISE)
            if alike.sum() >= MIN_ROWS:
                rows = rows[alike]
            elif len(after) >= 2 * MIN_ROWS:
                rows = after[len(after) // 2 :]
        u = rescale_to_minus_one_to_one(self.time[rows])
        return fit_linear_model(
            self.time[rows], self.level[rows], np.vander(u, 3), estimate_noise_by_moments=True
        )

    def _compute_normalised_log_hold_time(self, rows: np.ndarray) -> np.ndarray:
        """Return the logarithm of hold time, scaled to 1 at the end of the hold."""
        times = np.append(self.time[rows], self.hold.loading_step_at_end.middle_time)
        logs = np.log(times - self.hold.loading_step_at_start.middle_time)
        return rescale_to_minus_one_to_one(logs)[:-1]

    def _choose_rows_of_hold_end(self) -> np.ndarray:
        """Return the rows of the window at the end of the hold.

        Rows close to the start or the end of the hold are excluded, because the step times are
        uncertain.
        """
        time, begins, ends = (
            self.time,
            self.hold.loading_step_at_start.end,
            self.hold.loading_step_at_end.start,
        )
        rows = np.flatnonzero((time > begins) & (time < ends))
        if len(rows) < 2:
            return rows[:0]
        gap = float(np.median(np.diff(time[rows])))
        speed = self.hold.loading_step_at_end.velocity_after
        guard = 0.5 * gap + math.cbrt(self.displacement_variance * gap / speed**2)
        rows = rows[(time[rows] > begins + guard) & (time[rows] < ends - guard)]
        windows = (
            rows[-count:] for count in _HOLD_END_WINDOW_LENGTHS_IN_ROWS if count <= len(rows)
        )
        logs = np.log(np.maximum(time - self.hold.loading_step_at_start.middle_time, 1e-300))
        degree = _HOLD_END_DEGREES[0]
        return choose_longest_polynomial_window(
            windows, logs, self.level, degree, self._noise_reference_fit
        )[0]

    def _choose_rows_of_peak(self) -> tuple[np.ndarray, bool]:
        """Return the rows of the window around the peak of friction.

        The function returns two values. The first value is the array of rows, which is empty if
        friction has no peak. The second value is True if a parabola describes friction in the
        window.
        """
        after, level = self.rows_after, self.level
        chosen, is_adequate = after[:0], False
        if len(after) < 2 * _PEAK_WINDOW_HALF_WIDTHS_IN_ROWS[0] + 1:
            return chosen, is_adequate
        smooth = median_filter(level[after], _RUNNING_MEDIAN_ROWS, mode="nearest")
        sd = max(
            float(np.std(level[self.hold.steady_rows_before_hold])),
            self._noise_reference_fit.noise_sd,
        )
        fallen = np.maximum.accumulate(smooth) - smooth > _MIN_FALL_AFTER_PEAK_SIGMAS * sd
        if not fallen.any():
            return chosen, is_adequate
        centre = int(np.argmax(smooth[: int(np.argmax(fallen))]))
        for _ in range(_MAX_PEAK_CENTRING_ITERATIONS):
            windows = _iterate_peak_windows(after, centre)
            chosen, is_adequate = choose_longest_polynomial_window(
                windows, self.time, level, _PEAK_DEGREES[0], self._noise_reference_fit
            )
            if not len(chosen):
                break
            u = rescale_to_minus_one_to_one(self.time[chosen])
            at = find_polynomial_maximum_position(
                polynomial.polyfit(u, level[chosen], _PEAK_DEGREES[0])
            )
            if not math.isfinite(at):
                break
            before, centre = centre, int(np.argmin(np.abs(u - at)) + chosen[0] - after[0])
            if centre == before:
                break
        return chosen, is_adequate

    def _estimate_peak_friction_and_displacement(
        self, linear_fit: GeneralisedLeastSquaresFit, rows: np.ndarray, parabola_is_adequate: bool
    ) -> tuple[HoldQuantityEstimate, HoldQuantityEstimate] | None:
        """Estimate the peak friction and the peak displacement.

        The result is None if the polynomial has no maximum.
        """
        first = len(linear_fit.coefficients) - _PEAK_DEGREES[1] - 1
        coefficients, covariance = (
            linear_fit.coefficients[first:],
            linear_fit.coefficient_covariance[first:, first:],
        )
        at = find_polynomial_maximum_position(coefficients)
        if not math.isfinite(at):
            return None
        powers = np.arange(_PEAK_DEGREES[1] + 1)
        of_value = at**powers
        of_slope = powers * np.append(0.0, of_value[:-1])
        curvature = -float(polynomial.polyval(at, polynomial.polyder(coefficients, 2)))
        value = float(of_value @ coefficients)
        # Because of the error of its position, the maximum is too high by this difference.
        excess = 0.5 * float(of_slope @ covariance @ of_slope) / curvature
        misfit = 0.0
        if not parabola_is_adequate:
            u = rescale_to_minus_one_to_one(self.time[rows])
            fewer = polynomial.polyfit(u, self.level[rows], _PEAK_DEGREES[0])
            low = find_polynomial_maximum_position(fewer)
            misfit = float(polynomial.polyval(low if math.isfinite(low) else at, fewer)) - value
        half = 0.5 * float(self.time[rows[-1]] - self.time[rows[0]])
        speed, when = (
            self.hold.loading_step_at_end.velocity_after,
            self.time[rows[0]] + (at + 1.0) * half,
        )
        distance = speed * float(when - self.hold.loading_step_at_end.middle_time)
        padding = np.zeros(first)
        by_slope = speed * half * of_slope / curvature
        return (
            HoldQuantityEstimate(
                value - excess, np.append(padding, of_value), excess**2 + misfit**2, -distance
            ),
            HoldQuantityEstimate(distance, np.append(padding, by_slope)),
        )


def _iterate_peak_windows(rows: np.ndarray, centre_index: int) -> Iterator[np.ndarray]:
    """Iterate over windows around a centre row, from the shortest to the longest."""
    for half in _PEAK_WINDOW_HALF_WIDTHS_IN_ROWS:
        if centre_index < half or centre_index + half >= len(rows):
            return
        yield rows[centre_index - half : centre_index + half + 1]
