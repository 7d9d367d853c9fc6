"""Filters that a data logger applied to friction before recording.

If the recorded friction was filtered, a fit applies the same filter to the friction of the model. A
filter smooths the friction peak after a velocity step. If the model did not include the filter, the
fitted direct effect would be too small, and the fitted slip distance would be too long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.noise_correlation_from_averaging import apply_running_mean

#: Names of a running mean centred at each row, and of a running mean that ends at each row.
MEAN, TRAILING_MEAN = "mean", "trailing_mean"
#: Names of the low-pass filters, with their orders. All low-pass filters are Butterworth filters.
LOW_PASS_ORDERS = {"first_order": 1, "butterworth_2": 2, "butterworth_4": 4}
#: Names of all filters.
FILTER_KINDS = (MEAN, TRAILING_MEAN, *LOW_PASS_ORDERS)
#: Settings for evaluating filters. The first value is the smallest number of points in a running
#: mean. The other values apply to low-pass filters. They are the number of points per period of the
#: corner frequency, the number of periods after which the filter has settled, and the largest
#: number of points in the time grid.
(
    _MIN_POINTS_OF_RUNNING_MEAN,
    _GRID_POINTS_PER_CORNER_PERIOD,
    _FILTER_SETTLING_PERIODS,
    _MAX_FILTER_GRID_POINTS,
) = 8, 60, 3.0, 400_000
#: Settings for applying a low-pass filter to recorded rows. The first value is the smallest number
#: of interpolation points per period of the corner frequency. The second value is the largest
#: number of interpolation points.
_ROW_POINTS_PER_CORNER_PERIOD, _MAX_ROW_POINTS = 20, 20_000_000


@dataclass(frozen=True)
class Filter:
    """Running mean or low-pass filter of friction.

    Parameters
    ----------
    kind : {"mean", "trailing_mean", "first_order", "butterworth_2", "butterworth_4"}
        Kind of filter. The filter is a running mean centred at each row, a running mean that ends
        at each row, or a low-pass filter.
    averaging_time_or_frequency : float
        Averaging time in s for a running mean, or corner frequency in Hz for a low-pass filter.

    Raises
    ------
    InvalidValue
        If the kind of filter is unknown, or if the size is not positive and finite.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy.fitting import Filter
    >>> running_mean = Filter.parse("mean 1.0")
    >>> time = np.arange(0.0, 5.0, 0.25)
    >>> samples = running_mean.compute_required_sample_times(time)
    >>> filtered = running_mean.apply(time, samples)  # the mean of a straight line is the line
    >>> bool(np.allclose(filtered, time))
    True
    """

    kind: str
    averaging_time_or_frequency: float

    def __post_init__(self) -> None:
        """Validate the kind and the size of the filter."""
        if self.kind not in FILTER_KINDS:
            raise InvalidValue("filter", self.kind, "is unknown", choices=FILTER_KINDS)
        if not 0.0 < self.averaging_time_or_frequency < math.inf:
            rule = "must be a positive averaging time in s or a positive corner frequency in Hz"
            raise InvalidValue("filter", self.averaging_time_or_frequency, rule)

    @classmethod
    def parse(cls, text: str) -> Filter | None:
        """Create a filter from a string such as "mean 1.0".

        Parameters
        ----------
        text : str
            Kind of filter, followed by a space and the averaging time or corner frequency.

        Returns
        -------
        Filter or None
            Filter, or None if the string is empty.

        Raises
        ------
        InvalidValue
            If the string is not a kind of filter followed by a number.
        """
        if not text:
            return None
        kind, _, size = text.partition(" ")
        try:
            number = float(size)
        except ValueError:
            rule = (
                "must be a filter type followed by an averaging time in s or a corner "
                "frequency in Hz, such as 'mean 1.0'"
            )
            raise InvalidValue("filter", text, rule, choices=FILTER_KINDS) from None
        return cls(kind, number)

    def compute_required_sample_times(self, time: np.ndarray) -> np.ndarray:
        """Return the times at which the filter uses values of the unfiltered friction.

        Parameters
        ----------
        time : ndarray, shape (rows,)
            Times of the rows in s.

        Returns
        -------
        ndarray, shape (samples,)
            Times in s, in increasing order.
        """
        if self.kind in LOW_PASS_ORDERS:
            return self._build_low_pass_time_grid(time)
        return np.unique(time[:, None] + self._compute_running_mean_time_offsets(time))

    def apply(self, time: np.ndarray, unfiltered_samples: np.ndarray) -> np.ndarray:
        """Apply the filter to unfiltered friction.

        Parameters
        ----------
        time : ndarray, shape (rows,)
            Times of the rows in s.
        unfiltered_samples : ndarray, shape (samples,)
            Unfiltered friction at ``compute_required_sample_times(time)``.

        Returns
        -------
        ndarray, shape (rows,)
            Filtered friction of each row.
        """
        at = self.compute_required_sample_times(time)
        if self.kind not in LOW_PASS_ORDERS:
            places = np.searchsorted(
                at, time[:, None] + self._compute_running_mean_time_offsets(time)
            )
            return np.asarray(unfiltered_samples[places].mean(axis=1))
        rate = 1.0 / float(at[1] - at[0])
        sections = butter(
            LOW_PASS_ORDERS[self.kind], self.averaging_time_or_frequency, fs=rate, output="sos"
        )
        # Friction is assumed to be constant before the first row.
        begin = sosfilt_zi(sections) * unfiltered_samples[0]
        return np.asarray(np.interp(time, at, sosfilt(sections, unfiltered_samples, zi=begin)[0]))

    def find_fully_averaged_rows(self, time: np.ndarray) -> slice:
        """Return the rows whose averaging interval lies within the record.

        Parameters
        ----------
        time : ndarray, shape (rows,)
            Times of the rows in s.

        Returns
        -------
        slice
            Rows whose running mean is complete. If the filter is a low-pass filter, the slice
            contains all rows.

        Raises
        ------
        InvalidValue
            If the averaging interval of every row extends beyond the record.
        """
        if self.kind in LOW_PASS_ORDERS:
            return slice(0, len(time))
        before, after = self._compute_averaging_time_on_each_side()
        first = int(np.searchsorted(time, time[0] + before))
        last = int(np.searchsorted(time, time[-1] - after, side="right"))
        if first >= last:
            rule = (
                "must have an averaging time that is shorter than the duration of the record, "
                f"which is {time[-1] - time[0]:g} s"
            )
            raise InvalidValue(
                "filter", f"{self.kind} {self.averaging_time_or_frequency:g} s", rule
            )
        return slice(first, last)

    def filter_recorded_values(self, time: np.ndarray, recorded_values: np.ndarray) -> np.ndarray:
        """Apply the filter to recorded rows.

        Parameters
        ----------
        time : ndarray, shape (rows,)
            Times of the rows in s, in increasing order.
        recorded_values : ndarray, shape (rows,)
            Recorded values. The function interpolates linearly between the rows.

        Returns
        -------
        ndarray, shape (rows,)
            Filtered values. Running means are correct only in the rows that
            `find_fully_averaged_rows` returns.

        Raises
        ------
        InvalidValue
            If the corner frequency of a low-pass filter is too high for the sampling interval, or
            if the filter needs too many interpolation points.
        """
        if self.kind not in LOW_PASS_ORDERS:
            centre = 0.0 if self.kind == MEAN else -0.5 * self.averaging_time_or_frequency
            # The deviations from the mean have smaller rounding errors.
            level = recorded_values.mean()
            deviations = (recorded_values - level)[:, None]
            return np.asarray(
                level
                + apply_running_mean(time, deviations, self.averaging_time_or_frequency, centre)[
                    :, 0
                ]
            )
        interval = float(np.median(np.diff(time)))
        about = f"{self.kind} {self.averaging_time_or_frequency:g} Hz"
        if not self.averaging_time_or_frequency * interval < 0.5:
            rule = (
                "has no effect, because the record only contains frequencies below "
                f"{0.5 / interval:g} Hz"
            )
            raise InvalidValue("filter", about, rule, remedy="Lower the corner frequency.")
        step = interval / max(
            math.ceil(_ROW_POINTS_PER_CORNER_PERIOD * self.averaging_time_or_frequency * interval),
            1,
        )
        if not (time[-1] - time[0]) / step < _MAX_ROW_POINTS:
            rule = (
                f"requires more than {_MAX_ROW_POINTS:,} points, because the sampling "
                "intervals differ"
            )
            raise InvalidValue("filter", about, rule, remedy="Use a running mean: 'mean 1 s'.")
        at = np.arange(time[0], time[-1] + step, step)
        samples = np.interp(at, time, recorded_values)
        sections = butter(
            LOW_PASS_ORDERS[self.kind],
            self.averaging_time_or_frequency,
            fs=1.0 / step,
            output="sos",
        )
        # The values are assumed to be constant before the first row.
        begin = sosfilt_zi(sections) * samples[0]
        return np.asarray(np.interp(time, at, sosfilt(sections, samples, zi=begin)[0]))

    def _compute_averaging_time_on_each_side(self) -> tuple[float, float]:
        """Return how many seconds the averaging interval extends before and after a row."""
        return (
            (0.5 * self.averaging_time_or_frequency, 0.5 * self.averaging_time_or_frequency)
            if self.kind == MEAN
            else (self.averaging_time_or_frequency, 0.0)
        )

    def _compute_running_mean_time_offsets(self, time: np.ndarray) -> np.ndarray:
        """Return the time offsets of the points that a running mean averages.

        Each offset is given in s, relative to the time of the row. If the averaging time is at
        least four sampling intervals, the points are one sampling interval apart.
        """
        count = max(round(self.averaging_time_or_frequency / float(np.median(np.diff(time)))), 1)
        count *= (
            max(math.ceil(_MIN_POINTS_OF_RUNNING_MEAN / count), 1)
            if count < _MIN_POINTS_OF_RUNNING_MEAN // 2
            else 1
        )
        middle = 0.5 if self.kind == MEAN else 1.0
        return np.asarray(
            self.averaging_time_or_frequency * ((np.arange(count) + 0.5) / count - middle)
        )

    def _build_low_pass_time_grid(self, time: np.ndarray) -> np.ndarray:
        """Return the evenly spaced times for evaluating a low-pass filter."""
        first = float(time[0]) - _FILTER_SETTLING_PERIODS / self.averaging_time_or_frequency
        finest = max(
            1.0 / (_GRID_POINTS_PER_CORNER_PERIOD * self.averaging_time_or_frequency),
            (time[-1] - first) / _MAX_FILTER_GRID_POINTS,
        )
        return np.arange(first, float(time[-1]) + 2.0 * finest, finest)
