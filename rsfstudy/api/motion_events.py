"""The events of a motion, read between its rows."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from scipy.interpolate import KroghInterpolator
from scipy.ndimage import find_objects, label
from scipy.optimize import brentq

from rsfstudy.api.event_catalogue import build_catalogue
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.fitting import EventNumbers
from rsfstudy.rig import slip_rate_from_log
from rsfstudy.slider import Scene

#: Slip rate over that of the load point from which on a motion is an event. Steady sliding is 1,
#: and a step of the load point that a stable slider follows overshoots by less.
_EVENT_SLIP_RATE_OVER_LOAD_VELOCITY = 10.0
#: Rows of a motion between which is read: by the polynomial through six, of which the one through
#: four tells the error. There are six rows in each step of a motion.
_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT = 6, 4
#: Rows that are so few floating-point numbers apart are two sides of a jump.
_MAX_FLOAT_SPACINGS_OF_JUMP = 16
#: Decades of slip rate between rows, beyond which nothing is read between them. In the steps
#: of motions that are accurate to 1e-4 rows are up to 0.37 apart, but where a rupture begins or
#: ends at once.
_MAX_LOG10_SLIP_RATE_STEP = 0.5


def find_motion_events(
    motion: xr.Dataset, slip_rate: float | None, scene: Callable[[], Scene]
) -> xr.Dataset:
    """The events of a motion, as `Accessor.events` says.

    Parameters
    ----------
    motion : xarray.Dataset
        As `rsfstudy.simulate` gives it, in any units.
    slip_rate : float, optional
        Over V_*, above which there is an event.
    scene : function
        What gives the scene, where the slip rate follows from it.
    """
    names = ("time", "log10_slip_rate", "slip", "shear_stress")
    for name in names:
        if name not in motion or motion[name].dims != ("time",):
            raise DataError(
                f"{name} is not there, along time: it is no motion as simulate gives it"
            )
    times, *rest = (np.asarray(motion[name], dtype=float) for name in names)
    if slip_rate is None:
        loads = [segment.load_velocity for segment in scene().parts.loading.segments]
        slip_rate = _EVENT_SLIP_RATE_OVER_LOAD_VELOCITY * max([1.0, *loads])
    if not 0.0 < slip_rate < math.inf:
        raise InvalidValue("slip_rate", slip_rate, "must be positive and finite, over V_*")
    rows = _InterpolatedMotionRows(times, np.column_stack(rest), math.log10(slip_rate))
    found = [rows.measure_event(*ends) for ends in rows.iterate_event_row_spans()]
    about = {name: motion[name].attrs for name in names}
    told = build_catalogue(found, about).assign_attrs(slip_rate_threshold=slip_rate)
    if "slip_rate" in motion and motion.sizes["time"]:  # in units
        rate = motion["slip_rate"]
        size = float(rate[0]) / 10.0 ** float(motion["log10_slip_rate"][0])
        told = told.assign(slip_rate_from_log(told, "peak_log10_slip_rate", size, rate.units))
    return told


class _InterpolatedMotionRows:
    """Rows of a motion, and what lies between them."""

    def __init__(self, times: np.ndarray, values: np.ndarray, event_slip_rate_level: float) -> None:
        self._times, self._values, self._event_slip_rate_level = (
            times,
            values,
            event_slip_rate_level,
        )

    def iterate_event_row_spans(self) -> list[tuple[int, int]]:
        """First and last row above the level, of each event."""
        above = label(self._values[:, 0] > self._event_slip_rate_level)[0]
        return [(part.start, part.stop - 1) for (part,) in find_objects(above)]

    def measure_event(self, first_row: int, last_row: int) -> EventNumbers:
        """The numbers of an event, each with its error, and which part of it is missing."""
        end, stress = len(self._times) - 1, self._values[:, 2]
        peak = first_row + int(np.argmax(self._values[first_row : last_row + 1, 0]))
        highest, lowest = first_row, last_row
        while highest > 0 and stress[highest - 1] >= stress[highest]:
            highest -= 1
        while lowest < end and stress[lowest + 1] <= stress[lowest]:
            lowest += 1
        top = highest + int(np.argmax(stress[highest : peak + 1]))
        bottom = peak + int(np.argmin(stress[peak : lowest + 1]))
        (begin, slip), begun = (
            self._level_crossing(first_row - 1) if first_row else self._values_at_end_row(0)
        )
        (finish, slipped), finished = (
            self._level_crossing(last_row) if last_row < end else self._values_at_end_row(end)
        )
        (rate, _, at_peak), (rate_error, _, peak_error) = self._find_extreme(peak, 0, 1.0)
        (*_, before), (*_, before_error) = self._find_extreme(top, 2, 1.0)
        (*_, after), (*_, after_error) = self._find_extreme(bottom, 2, -1.0)
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

    def _interpolate_after_row(self, row: int, row_count: int) -> KroghInterpolator:
        """The polynomial through as many rows about that between a row and the next, in time since
        that row, but for those beyond a jump.
        """
        first = max(row + 1 - row_count // 2, 0)
        last = min(row + row_count // 2, len(self._times) - 1)
        apart = np.diff(self._times[first : last + 1]) > _MAX_FLOAT_SPACINGS_OF_JUMP * np.spacing(
            self._times[row]
        )
        apart[row - first] = True
        smooth = label(apart)[0]
        kept = np.flatnonzero(smooth == smooth[row - first])
        rows = slice(first + kept[0], first + kept[-1] + 2)
        return KroghInterpolator(self._times[rows] - self._times[row], self._values[rows])

    def _is_too_coarse_to_interpolate(self, rows: slice) -> bool:
        """True where slip rate changes too much between rows to be read between them, as in a
        motion that is told at given times only.
        """
        return bool(np.abs(np.diff(self._values[rows, 0])).max() > _MAX_LOG10_SLIP_RATE_STEP)

    @staticmethod
    def _interpolant_slope(interpolant: KroghInterpolator, time: float, column: int) -> float:
        return float(interpolant.derivative(time)[column])

    def _level_crossing(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Time and slip where slip rate passes the level between a row and the next, and their
        errors.
        """
        found = []
        for number in (_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT):
            through = self._interpolate_after_row(row, number)
            span = self._times[row + 1] - self._times[row]
            late = brentq(lambda t, p=through: p(t)[0] - self._event_slip_rate_level, 0.0, span)
            found.append([self._times[row] + late, through(late)[1]])
        many, fewer = np.array(found)
        sides = slice(row, row + 2)
        left = [np.ptp(self._times[sides]), np.ptp(self._values[sides, 1])]
        error = np.abs(many - fewer) + 2.0 * np.spacing(np.abs(many))
        return many, error + self._is_too_coarse_to_interpolate(sides) * np.array(left)

    def _values_at_end_row(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Time and slip at the first or the last row, without errors."""
        return np.array([self._times[row], self._values[row, 1]]), np.zeros(2)

    def _find_extreme(self, row: int, column: int, sign: float) -> tuple[np.ndarray, np.ndarray]:
        """The values where that of a column is largest about a row (smallest, where `sign` is
        negative), and their errors.
        """
        sides = slice(max(row - 1, 0), row + 2)
        times, found = self._times[sides], []
        for number in (_ROWS_PER_INTERPOLANT, _ROWS_PER_ERROR_CHECK_INTERPOLANT):
            best = self._values[row]
            for begin in range(sides.start, sides.start + len(times) - 1):
                span = self._times[begin + 1] - self._times[begin]
                if span <= _MAX_FLOAT_SPACINGS_OF_JUMP * np.spacing(times[-1]):
                    continue
                through = self._interpolate_after_row(begin, number)
                if (
                    self._interpolant_slope(through, 0.0, column)
                    * self._interpolant_slope(through, span, column)
                    < 0.0
                ):
                    at = brentq(
                        lambda t, p=through: self._interpolant_slope(p, t, column), 0.0, span
                    )
                    best = max(best, through(at), key=lambda values: sign * values[column])
            found.append(best)
        many, fewer = found
        # the clock has few digits in a rupture; an extreme is flat, and its place errs by the root
        clock = 2.0 * np.spacing(times[-1]) / max(np.ptp(times), np.spacing(times[-1]))
        shares = np.full(len(many), math.sqrt(clock))
        shares[column] = clock
        spread = np.ptp(self._values[sides], axis=0)
        return many, np.abs(many - fewer) + (
            shares + self._is_too_coarse_to_interpolate(sides)
        ) * spread
