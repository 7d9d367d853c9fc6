"""Catalogues of events: what slipped, when, how fast and how far stress fell, in a motion and in a
record of a laboratory.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import KroghInterpolator
from scipy.ndimage import find_objects, label
from scipy.optimize import brentq
from scipy.stats import norm

from rsfstudy.doors import door
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.quantity import Quantity
from rsfstudy.slider.scene import Scene

_QUANTITIES = (
    Quantity("time", "", "1", "time at which the event begins", "D_c/V_*"),
    Quantity("duration", "", "1", "duration of the event", "D_c/V_*"),
    Quantity("interval", "", "1", "time since the event before began", "D_c/V_*"),
    Quantity("peak_log10_slip_rate", "", "1", "decimal logarithm of peak slip rate over V_star"),
    Quantity("peak_slip_rate", "", "1", "peak slip rate", "V_*"),
    Quantity("slip", "", "1", "slip during the event", "D_c"),
    Quantity("stress_before", "", "1", "highest shear stress before the event", "sigma_*"),
    Quantity("stress_after", "", "1", "lowest shear stress after the event", "sigma_*"),
    Quantity("static_stress_drop", "", "1", "highest less lowest shear stress", "sigma_*"),
    Quantity(
        "dynamic_stress_drop",
        "",
        "1",
        "highest shear stress less that at peak slip rate",
        "sigma_*",
    ),
)
#: What part of an event is missing, by its flag.
_CUT = ("whole", "begins_before", "lasts_beyond", "both")
#: Slip rate over that of the load point from which on a motion is an event. Steady sliding is 1,
#: and a step of the load point that a stable slider follows overshoots by less.
_OVER_LOADING = 10.0
#: Rows of a motion between which is read: by the polynomial through six, of which the one through
#: four tells the error. There are six rows in each step of a motion.
_ROWS, _FEWER = 6, 4
#: Rows that are so few floating-point numbers apart are two sides of a jump.
_JUMP = 16
#: Decades of slip rate between rows, beyond which nothing is read between them. In the steps
#: of motions that are accurate to 1e-4 rows are up to 0.37 apart, but where a rupture begins or
#: ends at once.
_COARSE = 0.5
#: Chance that a record of Gaussian noise holds any event: one record in 10,000.
_CHANCE = 1e-4
#: Shortest windows in samples, and how many samples a record has for each sample of the longest,
#: so that the spread of what windows differ by is known to a quarter.
_SHORTEST, _SAMPLES = 4, 100
#: Standard deviations by which a drop must exceed the threshold to be found but once in 1,000.
_FOUND = 3.1
#: Standard deviations down to which an event is followed from where it is found.
_FOLLOWED = 2.0
#: Standard deviation over the median of absolute deviations of Gaussian noise.
_NORMAL = 1.4826


# ---- motions ------------------------------------------------------------------------------------


def of_motion(
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
        slip_rate = _OVER_LOADING * max([1.0, *loads])
    if not 0.0 < slip_rate < math.inf:
        raise InvalidValue("slip_rate", slip_rate, "must be positive and finite, over V_*")
    rows = _Rows(times, np.column_stack(rest), math.log10(slip_rate))
    found = [rows.event(*ends) for ends in rows.spans()]
    about = {name: motion[name].attrs for name in names}
    return _catalogue(found, about).assign_attrs(slip_rate_threshold=slip_rate)


class _Rows:
    """Rows of a motion, and what lies between them."""

    def __init__(self, times: np.ndarray, values: np.ndarray, level: float) -> None:
        self._times, self._values, self._level = times, values, level

    def spans(self) -> list[tuple[int, int]]:
        """First and last row above the level, of each event."""
        above = label(self._values[:, 0] > self._level)[0]
        return [(part.start, part.stop - 1) for (part,) in find_objects(above)]

    def event(self, first: int, last: int) -> dict[str, float]:
        """The numbers of an event, each with its error."""
        end, stress = len(self._times) - 1, self._values[:, 2]
        peak = first + int(np.argmax(self._values[first : last + 1, 0]))
        highest, lowest = first, last
        while highest > 0 and stress[highest - 1] >= stress[highest]:
            highest -= 1
        while lowest < end and stress[lowest + 1] <= stress[lowest]:
            lowest += 1
        top = highest + int(np.argmax(stress[highest : peak + 1]))
        bottom = peak + int(np.argmin(stress[peak : lowest + 1]))
        (begin, slip), begun = self._crossing(first - 1) if first else self._end(0)
        (finish, slipped), finished = self._crossing(last) if last < end else self._end(end)
        (rate, _, at_peak), (rate_error, _, peak_error) = self._extreme(peak, 0, 1.0)
        (*_, before), (*_, before_error) = self._extreme(top, 2, 1.0)
        (*_, after), (*_, after_error) = self._extreme(bottom, 2, -1.0)
        return {
            "time": begin,
            "time_error": begun[0],
            "duration": finish - begin,
            "duration_error": begun[0] + finished[0],
            "peak_log10_slip_rate": rate,
            "peak_log10_slip_rate_error": rate_error,
            "slip": slipped - slip,
            "slip_error": begun[1] + finished[1],
            "stress_before": before,
            "stress_before_error": before_error,
            "stress_after": after,
            "stress_after_error": after_error,
            "static_stress_drop": before - after,
            "static_stress_drop_error": before_error + after_error,
            "dynamic_stress_drop": before - at_peak,
            "dynamic_stress_drop_error": before_error + peak_error,
            "cut": (first == 0 or highest == 0) + 2 * (last == end or lowest == end),
        }

    def _through(self, row: int, number: int) -> KroghInterpolator:
        """The polynomial through as many rows about that between a row and the next, in time since
        that row, but for those beyond a jump.
        """
        first = max(row + 1 - number // 2, 0)
        last = min(row + number // 2, len(self._times) - 1)
        apart = np.diff(self._times[first : last + 1]) > _JUMP * np.spacing(self._times[row])
        apart[row - first] = True
        smooth = label(apart)[0]
        kept = np.flatnonzero(smooth == smooth[row - first])
        rows = slice(first + kept[0], first + kept[-1] + 2)
        return KroghInterpolator(self._times[rows] - self._times[row], self._values[rows])

    def _is_coarse(self, rows: slice) -> bool:
        """True where slip rate changes too much between rows to be read between them, as in a
        motion that is told at given times only.
        """
        return bool(np.abs(np.diff(self._values[rows, 0])).max() > _COARSE)

    @staticmethod
    def _slope(through: KroghInterpolator, at: float, column: int) -> float:
        return float(through.derivative(at)[column])

    def _crossing(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Time and slip where slip rate passes the level between a row and the next, and their
        errors.
        """
        found = []
        for number in (_ROWS, _FEWER):
            through = self._through(row, number)
            span = self._times[row + 1] - self._times[row]
            late = brentq(lambda t, p=through: p(t)[0] - self._level, 0.0, span)
            found.append([self._times[row] + late, through(late)[1]])
        many, fewer = np.array(found)
        sides = slice(row, row + 2)
        left = [np.ptp(self._times[sides]), np.ptp(self._values[sides, 1])]
        error = np.abs(many - fewer) + 2.0 * np.spacing(np.abs(many))
        return many, error + self._is_coarse(sides) * np.array(left)

    def _end(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Time and slip at the first or the last row, without errors."""
        return np.array([self._times[row], self._values[row, 1]]), np.zeros(2)

    def _extreme(self, row: int, column: int, sign: float) -> tuple[np.ndarray, np.ndarray]:
        """The values where that of a column is largest about a row (smallest, where `sign` is
        negative), and their errors.
        """
        sides = slice(max(row - 1, 0), row + 2)
        times, found = self._times[sides], []
        for number in (_ROWS, _FEWER):
            best = self._values[row]
            for begin in range(sides.start, sides.start + len(times) - 1):
                span = self._times[begin + 1] - self._times[begin]
                if span <= _JUMP * np.spacing(times[-1]):
                    continue
                through = self._through(begin, number)
                if self._slope(through, 0.0, column) * self._slope(through, span, column) < 0.0:
                    at = brentq(lambda t, p=through: self._slope(p, t, column), 0.0, span)
                    best = max(best, through(at), key=lambda values: sign * values[column])
            found.append(best)
        many, fewer = found
        # the clock has few digits in a rupture; an extreme is flat, and its place errs by the root
        clock = 2.0 * np.spacing(times[-1]) / max(np.ptp(times), np.spacing(times[-1]))
        shares = np.full(len(many), math.sqrt(clock))
        shares[column] = clock
        spread = np.ptp(self._values[sides], axis=0)
        return many, np.abs(many - fewer) + (shares + self._is_coarse(sides)) * spread


# ---- records ------------------------------------------------------------------------------------


@door
def events(
    record: xr.Dataset | None = None,
    *,
    time: Any = None,
    displacement: Any = None,
    shear_stress: Any = None,
) -> xr.Dataset:
    """The events of a record: drops of shear stress that its noise does not explain.

    An event is where the mean stress of a number of samples falls below the mean of as many samples
    before by more than a threshold, and by more than it usually changes. Windows of 4, 8, 16 and
    more samples, up to a hundredth of the record, are looked at, at every sample. The threshold is
    a multiple of the standard deviation of that difference, which is taken from the record by the
    median of absolute deviations: noise may be correlated over times short against the longest
    window, and events may take up to a fifth of the record. The multiple is such that all looks
    together find something in one record of Gaussian noise of 10,000.

    A drop of ``smallest_drop`` that stands for as long as the longest window, before it and after
    it, is found but once in 1,000. Where noise is white, that is below three standard deviations of
    the noise from 3,200 samples on; correlated noise asks for more. Glitches of single samples are
    no Gaussian noise. Stress that relaxes by as much within a window, as in a hold, is a drop too.

    Parameters
    ----------
    record : xarray.Dataset, optional
        ``time``, ``shear_stress`` and, where it was measured, ``displacement``, with units.
    time, displacement, shear_stress : array_like
        The same as arrays; one with the attribute ``units`` keeps them.

    Returns
    -------
    xarray.Dataset
        Along ``event``, in the units of the record: ``time``, ``duration`` (at least one sample),
        ``interval``, ``stress_before`` and ``stress_after`` (means of windows),
        ``static_stress_drop``; with displacement ``slip``, ``peak_slip_rate`` between neighbouring
        samples and ``dynamic_stress_drop``. What is not above the noise is NaN. Beside each number
        that has one, its standard error by noise. ``noise``, its standard deviation, and
        ``smallest_drop``.

    Raises
    ------
    InvalidValue
        For records that differ in length, hold NaN, or are too short, and for times that do not
        increase.
    """
    given = {"time": time, "displacement": displacement, "shear_stress": shear_stress}
    if record is not None:
        given = {name: record.get(name) for name in given}
    times, stress = (_samples(name, given[name]) for name in ("time", "shear_stress"))
    moved = given["displacement"]
    moves = None if moved is None else _samples("displacement", moved)
    for name, samples in (("shear_stress", stress), ("displacement", moves)):
        if samples is not None and len(samples) != len(times):
            rule = f"must hold as many samples as time, which holds {len(times)}"
            raise InvalidValue(name, len(samples), rule)
    if not (np.diff(times) > 0.0).all():
        late = int(np.argmax(np.diff(times) <= 0.0)) + 1
        raise InvalidValue("time", times[late], f"must increase, and does not at sample {late}")
    about = {name: dict(getattr(values, "attrs", {})) for name, values in given.items()}
    found, noise, smallest = _drops(stress)
    rows = [_row(times, stress, moves, drop) for drop in found]
    catalogue = _catalogue(rows, about | {"slip": about["displacement"]})
    units = {"units": str(about["shear_stress"].get("units", "1"))}
    catalogue["noise"] = ((), noise, {"long_name": "standard deviation of the noise", **units})
    words = "drop of shear stress that is found but once in 1,000"
    catalogue["smallest_drop"] = ((), smallest, {"long_name": words, **units})
    return catalogue


def _samples(name: str, values: Any) -> np.ndarray:
    """Samples of a record, checked."""
    try:
        samples = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidValue(name, values, "must be numbers") from error
    least = _SHORTEST * _SAMPLES
    if samples.ndim != 1 or len(samples) < least:
        rule = f"must be a list of {least} samples at least, which tell the noise"
        raise InvalidValue(name, samples.shape, rule)
    if not np.isfinite(samples).all():
        late = int(np.argmin(np.isfinite(samples)))
        raise InvalidValue(name, samples[late], f"must be finite, and is not at sample {late}")
    return samples


def _spread(values: np.ndarray) -> float:
    """Standard deviation, by the median of absolute deviations."""
    return _NORMAL * float(np.median(np.abs(values - np.median(values))))


def _falls(values: np.ndarray, window: int) -> np.ndarray:
    """Mean of the samples before each place less that of as many behind it."""
    sums = np.concatenate([[0.0], np.cumsum(values - values.mean())])
    return (
        np.asarray(2.0 * sums[window:-window] - sums[: -2 * window] - sums[2 * window :]) / window
    )


def _drops(stress: np.ndarray) -> tuple[list[tuple[int, int, int, float]], float, float]:
    """The first place of each drop, the place behind it, the window that found it and the standard
    error; the noise; and the smallest drop that is found.
    """
    windows = [_SHORTEST]
    while 2 * windows[-1] * _SAMPLES <= len(stress):
        windows.append(2 * windows[-1])
    steps = np.abs(np.diff(stress))
    quantum = float(steps[steps > 0.0].min(initial=math.inf))
    looks = float(norm.isf(_CHANCE / (len(stress) * len(windows))))
    taken: list[tuple[int, int, int, float]] = []
    smallest = math.inf
    for window in windows:
        falls = _falls(stress, window)
        usual, spread = float(np.median(falls)), _spread(falls)
        # the spread itself is known from so many windows only
        surely = 1.0 + 2.33 / math.sqrt(len(stress) / (2.0 * window))
        threshold = max(looks * surely * spread, 2.0 * quantum)
        smallest = min(smallest, threshold + _FOUND * spread)
        net = falls - max(0.0, usual)
        for (part,) in find_objects(label(net > min(_FOLLOWED * spread, threshold))[0]):
            place = part.start + int(np.argmax(net[part]))
            near = any(part.start < e + window and b - window < part.stop for b, e, *_ in taken)
            if net[place] <= threshold or near:
                continue
            # a step is seen from all windows that it is in
            begin, end = min(part.start + window - 1, place), max(part.stop - window, place)
            taken.append((begin + window, end + window, window, spread + abs(usual)))
    apart = stress[windows[-1] :] - stress[: -windows[-1]]
    return sorted(taken), _spread(apart) / math.sqrt(2.0), smallest


def _row(
    times: np.ndarray,
    stress: np.ndarray,
    moves: np.ndarray | None,
    drop: tuple[int, int, int, float],
) -> dict[str, float]:
    """The numbers of one event of a record, each with its standard error by noise."""
    begin, end, window, error = drop
    before, after = stress[begin - window : begin].mean(), stress[end : end + window].mean()
    apart = times[end] - times[begin - 1]
    row = {
        "time": times[begin - 1],
        "time_error": apart,
        "duration": apart,
        "duration_error": apart,
        "stress_before": before,
        "stress_before_error": error,
        "stress_after": after,
        "stress_after_error": error,
        "static_stress_drop": before - after,
        "static_stress_drop_error": error,
        "cut": 0,
    }
    if moves is None:
        return row
    slips = -_falls(moves, window)
    rates = np.diff(moves) / np.diff(times)
    fastest = begin - 1 + int(np.argmax(rates[begin - 1 : end]))
    noise = _spread(rates)
    seen = rates[fastest] > noise * norm.isf(_CHANCE / len(rates))
    return row | {
        "slip": moves[end : end + window].mean() - moves[begin - window : begin].mean(),
        "slip_error": _spread(slips) + abs(float(np.median(slips))),
        "peak_slip_rate": rates[fastest] if seen else math.nan,
        "peak_slip_rate_error": noise if seen else math.nan,
        "dynamic_stress_drop": before - stress[fastest + 1] if seen else math.nan,
        "dynamic_stress_drop_error": error + _spread(np.diff(stress)) if seen else math.nan,
    }


# ---- both ---------------------------------------------------------------------------------------


def _catalogue(found: list[dict[str, float]], about: Mapping[str, Mapping[Any, Any]]) -> xr.Dataset:
    """Events as a dataset, in the units of what they were read from."""
    for row, earlier in zip(found, [{}, *found], strict=False):
        row["interval"] = row["time"] - earlier.get("time", math.nan)
        row["interval_error"] = row["time_error"] + earlier.get("time_error", math.nan)
    dataset = xr.Dataset(coords={"event": np.arange(len(found))})
    for quantity in _QUANTITIES:
        for name in (quantity.name, f"{quantity.name}_error"):
            if found and name not in found[0]:
                continue
            error = "error estimate of " if name != quantity.name else ""
            attrs = {"long_name": error + quantity.long_name, **_units(quantity, about)}
            dataset[name] = ("event", np.array([row[name] for row in found]), attrs)
    dataset["cut"] = (
        "event",
        np.array([row["cut"] for row in found], dtype=np.int8),
        {
            "long_name": "what of the event the record leaves out",
            "flag_values": np.arange(len(_CUT), dtype=np.int8),
            "flag_meanings": " ".join(_CUT),
        },
    )
    return dataset.assign_attrs(title="Catalogue of events", Conventions="CF-1.11")


#: What quantities are measured in: as these variables, by their scales.
_MEASURED_AS = {"D_c/V_*": "time", "D_c": "slip", "sigma_*": "shear_stress"}


def _units(quantity: Quantity, about: Mapping[str, Mapping[Any, Any]]) -> dict[str, str]:
    """Units and scale of a quantity, where times, slip and stresses have theirs."""
    if quantity.scale in _MEASURED_AS:
        source = about[_MEASURED_AS[quantity.scale]]
        return {key: str(source[key]) for key in ("units", "scale") if key in source}
    if quantity.scale:
        time, slip = (str(about[name].get("units", "1")) for name in ("time", "slip"))
        return {"units": f"{slip} {time}-1"}
    return {"units": quantity.units}
