"""Functions that find the events of a motion by interpolation between the rows."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from scipy.interpolate import KroghInterpolator
from scipy.ndimage import find_objects, label
from scipy.optimize import brentq

from rsfstudy.api.event_catalogue import build_event_catalogue
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.fitting import EventNumbers
from rsfstudy.rig import DatasetUnits
from rsfstudy.slider import Scene

#: Limit of the ratio of slip rate to load point velocity. An event begins when the ratio exceeds
#: the limit. In steady sliding, the ratio is 1. If a stable slider overshoots after a step of the
#: load point velocity, the ratio remains below the limit.
_MIN_EVENT_SLIP_RATE_OVER_LOAD_VELOCITY = 10.0
#: Number of rows that the interpolating polynomial uses, and number of rows that a second
#: polynomial uses to estimate the interpolation error. A motion has six rows per integration step.
_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT = 6, 4
#: Maximum time difference between the row before and the row after a discontinuity of the motion,
#: in spacings of floating-point numbers.
_MAX_DISCONTINUITY_DURATION_IN_ULPS = 16
#: Maximum change of log10 slip rate between rows that are interpolated. In motions with a tolerance
#: of 1e-4, log10 slip rate changes by up to 0.37 between neighbouring rows, except at the sudden
#: beginning or end of a rupture.
_MAX_LOG10_SLIP_RATE_CHANGE_PER_ROW = 0.5


def find_slip_events_of_motion(
    motion: xr.Dataset, slip_rate_threshold: float | None, build_scene: Callable[[], Scene]
) -> xr.Dataset:
    """Find the events of a motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Motion from ``rsfstudy.simulate``, in any units.
    slip_rate_threshold : float, optional
        Threshold of the slip rate in V_*. The default is 10 times the highest load point velocity
        of the scene, and at least 10.
    build_scene : callable
        Function without arguments that returns the scene of the motion. The function is called only
        if ``slip_rate_threshold`` is None.

    Returns
    -------
    xarray.Dataset
        Variables along the dimension ``event``, as returned by ``DatasetAccessor.events``.

    Raises
    ------
    DataError
        If the dataset is not a motion.
    InvalidValue
        If the slip rate is not positive and finite.
    """
    names = ("time", "log10_slip_rate", "slip", "shear_stress")
    for name in names:
        if name not in motion or motion[name].dims != ("time",):
            reason = "does not have the dimension time" if name in motion else "is missing"
            raise DataError(f"{name} {reason}. Pass a motion from rsfstudy.simulate.")
    times, *rest = (np.asarray(motion[name], dtype=float) for name in names)
    arrest = _find_log10_arrest_slip_rate(motion, build_scene)
    if slip_rate_threshold is None:
        loads = [segment.load_velocity for segment in build_scene().parts.loading.segments]
        slip_rate_threshold = _MIN_EVENT_SLIP_RATE_OVER_LOAD_VELOCITY * max([1.0, *loads])
    if not 0.0 < slip_rate_threshold < math.inf:
        raise InvalidValue(
            "slip_rate", slip_rate_threshold, "must be positive and finite (in units of V_*)"
        )
    rows = InterpolatorBetweenMotionRows(
        times, np.column_stack(rest), math.log10(slip_rate_threshold), arrest
    )
    found = [rows.measure_event(*ends) for ends in rows.find_event_row_spans()]
    about = {name: motion[name].attrs for name in names}
    catalogue = build_event_catalogue(found, about).assign_attrs(
        slip_rate_threshold=slip_rate_threshold
    )
    if "slip_rate" in motion and motion.sizes["time"]:  # The motion has units.
        rate = motion["slip_rate"]
        size = float(rate[0]) / 10.0 ** float(motion["log10_slip_rate"][0])
        catalogue = catalogue.assign(
            DatasetUnits(catalogue).compute_slip_rate_from_log(
                "peak_log10_slip_rate", size, rate.units
            )
        )
    return catalogue


def _find_log10_arrest_slip_rate(
    motion: xr.Dataset, build_scene: Callable[[], Scene]
) -> float | None:
    """Return the logarithm (base 10) of the slip rate at which events end.

    In a scene with noise, an event ends when the slip rate falls below the smallest nonzero load
    point velocity. In other scenes, the function returns None.
    """
    if json.loads(motion.attrs.get("scene", "{}")).get("noise", "none") == "none":
        return None
    loads = [abs(segment.load_velocity) for segment in build_scene().parts.loading.segments]
    return math.log10(min((load for load in loads if load), default=1.0))


class InterpolatorBetweenMotionRows:
    """Interpolator that computes event quantities between the rows of a motion.

    Parameters
    ----------
    times : numpy.ndarray of shape (n,)
        Times of the rows.
    values : numpy.ndarray of shape (n, 3)
        Values in each row: log10 slip rate, slip, and shear stress.
    event_slip_rate_level : float
        Logarithm (base 10) of the threshold of the slip rate.
    arrest_slip_rate_level : float, optional
        Logarithm (base 10) of the slip rate at which an event with noise ends. By default, an event
        ends at the threshold at which it begins.
    """

    def __init__(
        self,
        times: np.ndarray,
        values: np.ndarray,
        event_slip_rate_level: float,
        arrest_slip_rate_level: float | None = None,
    ) -> None:
        """Initialise the interpolation.

        Parameters
        ----------
        times, values, event_slip_rate_level, arrest_slip_rate_level
            See the class.
        """
        self._times, self._values = times, values
        self._event_slip_rate_level = event_slip_rate_level
        self._arrest_slip_rate_level = arrest_slip_rate_level

    def find_event_row_spans(self) -> list[tuple[int, int]]:
        """Return the numbers of the first row and the last row of each event.

        Returns
        -------
        list of (int, int)
            Pair of row numbers for each event.
        """
        rates = self._values[:, 0]
        above = label(rates > self._event_slip_rate_level)[0]
        spans = [(part.start, part.stop - 1) for (part,) in find_objects(above)]
        if self._arrest_slip_rate_level is None:
            return spans
        merged = spans[:1]
        for first, last in spans[1:]:
            if rates[merged[-1][1] : first].min() > self._arrest_slip_rate_level:
                first = merged.pop()[0]
            merged.append((first, last))
        return merged

    def measure_event(self, first_row: int, last_row: int) -> EventNumbers:
        """Measure the quantities of an event, and estimate the interpolation errors.

        Parameters
        ----------
        first_row, last_row : int
            First and last row of the event in which slip rate exceeds the threshold.

        Returns
        -------
        quantities : dict of str to (float, float)
            Value and error of each quantity.
        cut : int
            Code that describes which part of the event is missing: 0 if the event is complete, 1 if
            the motion begins within the event, 2 if the motion ends within the event, and 3 if both
            apply.
        """
        end, stress = len(self._times) - 1, self._values[:, 2]
        peak = first_row + int(np.argmax(self._values[first_row : last_row + 1, 0]))
        highest, lowest = self._find_stress_drop_rows(first_row, last_row)
        top = highest + int(np.argmax(stress[highest : peak + 1]))
        bottom = peak + int(np.argmin(stress[peak : lowest + 1]))
        (begin, slip), begun = (
            self._find_threshold_crossing_after_row(first_row - 1)
            if first_row
            else self._read_time_and_slip_at_end_row(0)
        )
        (finish, slipped), finished = (
            self._find_threshold_crossing_after_row(last_row)
            if last_row < end
            else self._read_time_and_slip_at_end_row(end)
        )
        (rate, _, at_peak), (rate_error, _, peak_error) = self.find_extremum_near_row(peak, 0, 1.0)
        (*_, before), (*_, before_error) = self.find_extremum_near_row(top, 2, 1.0)
        (*_, after), (*_, after_error) = self.find_extremum_near_row(bottom, 2, -1.0)
        cut = (first_row == 0 or highest == 0) + 2 * (last_row == end or lowest == end)
        return {
            "time": (begin, begun[0]),
            "duration": (finish - begin, begun[0] + finished[0]),
            "peak_log10_slip_rate": (rate, rate_error),
            "slip": (slipped - slip, begun[1] + finished[1]),
            "stress_before": (before, before_error),
            "stress_after": (after, after_error),
            "static_stress_drop": (before - after, before_error + after_error),
            "dynamic_stress_drop": (before - at_peak, before_error + peak_error),
        }, cut

    def _find_stress_drop_rows(self, first_row: int, last_row: int) -> tuple[int, int]:
        """Return the two rows between which the stress drop of an event is measured.

        If the scene has no noise, the two rows are the local maximum of shear stress before the
        event and the local minimum after the event. Otherwise, the two rows are the nearest rows
        before and after the event at which the slip rate does not exceed the arrest level.
        """
        end, stress, rates = len(self._times) - 1, self._values[:, 2], self._values[:, 0]
        level, highest, lowest = self._arrest_slip_rate_level, first_row, last_row
        if level is None:
            while highest > 0 and stress[highest - 1] >= stress[highest]:
                highest -= 1
            while lowest < end and stress[lowest + 1] <= stress[lowest]:
                lowest += 1
        else:
            while highest > 0 and rates[highest] > level:
                highest -= 1
            while lowest < end and rates[lowest] > level:
                lowest += 1
        return highest, lowest

    def _build_interpolant_after_row(self, row: int, row_count: int) -> KroghInterpolator:
        """Build a polynomial that interpolates the motion between a row and the next row.

        The interpolating polynomial is a function of the time since the first row of the interval.
        Half of the rows used for the interpolation precede the interval. If the motion has a
        discontinuity near the interval, rows beyond the discontinuity are not used.
        """
        first = max(row + 1 - row_count // 2, 0)
        last = min(row + row_count // 2, len(self._times) - 1)
        apart = np.diff(
            self._times[first : last + 1]
        ) > _MAX_DISCONTINUITY_DURATION_IN_ULPS * np.spacing(self._times[row])
        apart[row - first] = True
        smooth = label(apart)[0]
        kept = np.flatnonzero(smooth == smooth[row - first])
        rows = slice(first + kept[0], first + kept[-1] + 2)
        return KroghInterpolator(self._times[rows] - self._times[row], self._values[rows])

    def _is_too_coarse_to_interpolate(self, rows: slice) -> bool:
        """Return True if rows are too far apart for interpolation.

        Rows are too far apart if the slip rate changes by more than half a decade between two
        neighbouring rows. Large changes can occur if the motion was computed only at requested
        times.
        """
        return bool(
            np.abs(np.diff(self._values[rows, 0])).max() > _MAX_LOG10_SLIP_RATE_CHANGE_PER_ROW
        )

    @staticmethod
    def _compute_interpolant_slope(
        interpolant: KroghInterpolator, time: float, column: int
    ) -> float:
        """Return the time derivative of a column of the interpolating polynomial."""
        return float(interpolant.derivative(time)[column])

    def _find_threshold_crossing_after_row(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Find when slip rate crosses the threshold between a row and the next row.

        Returns
        -------
        values, errors : numpy.ndarray of shape (2,)
            Time and slip of the crossing, and their errors.
        """
        found = []
        for number in (_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT):
            through = self._build_interpolant_after_row(row, number)
            span = self._times[row + 1] - self._times[row]
            late = brentq(lambda t, p=through: p(t)[0] - self._event_slip_rate_level, 0.0, span)
            found.append([self._times[row] + late, through(late)[1]])
        many, fewer = np.array(found)
        sides = slice(row, row + 2)
        left = [np.ptp(self._times[sides]), np.ptp(self._values[sides, 1])]
        error = np.abs(many - fewer) + 2.0 * np.spacing(np.abs(many))
        return many, error + self._is_too_coarse_to_interpolate(sides) * np.array(left)

    def _read_time_and_slip_at_end_row(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the time and slip at the first or last row, where both errors are zero."""
        return np.array([self._times[row], self._values[row, 1]]), np.zeros(2)

    def find_extremum_near_row(
        self, row: int, column: int, extremum_sign: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Find a maximum or a minimum of a column near a row.

        Parameters
        ----------
        row : int
            Row next to the maximum or minimum.
        column : int
            Column of the values.
        extremum_sign : {1.0, -1.0}
            1 for a maximum and -1 for a minimum.

        Returns
        -------
        values, errors : numpy.ndarray of shape (3,)
            Values of all columns at the maximum or minimum, and their errors.
        """
        sides = slice(max(row - 1, 0), row + 2)
        times, found = self._times[sides], []
        for number in (_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT):
            best = self._values[row]
            for begin in range(sides.start, sides.start + len(times) - 1):
                span = self._times[begin + 1] - self._times[begin]
                if span <= _MAX_DISCONTINUITY_DURATION_IN_ULPS * np.spacing(times[-1]):
                    continue
                through = self._build_interpolant_after_row(begin, number)
                if (
                    self._compute_interpolant_slope(through, 0.0, column)
                    * self._compute_interpolant_slope(through, span, column)
                    < 0.0
                ):
                    at = brentq(
                        lambda t, p=through: self._compute_interpolant_slope(p, t, column),
                        0.0,
                        span,
                    )
                    best = max(best, through(at), key=lambda values: extremum_sign * values[column])
            found.append(best)
        many, fewer = found
        # Times have few significant digits in a rupture. Because the extreme is flat, rounding
        # shifts its time by the square root of the rounding error, and the other columns change by
        # the same relative amount.
        clock = 2.0 * np.spacing(times[-1]) / max(np.ptp(times), np.spacing(times[-1]))
        shares = np.full(len(many), math.sqrt(clock))
        shares[column] = clock
        spread = np.ptp(self._values[sides], axis=0)
        return many, np.abs(many - fewer) + (
            shares + self._is_too_coarse_to_interpolate(sides)
        ) * spread
