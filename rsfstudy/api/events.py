"""Catalogues of events as datasets; and the events of a record of a laboratory: drops of shear
stress that its noise does not explain.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.ndimage import find_objects, label
from scipy.stats import norm

from rsfstudy.compute import provenance
from rsfstudy.error_boundary import error_boundary, user_stacklevel
from rsfstudy.errors import InvalidValue, NoAnswer
from rsfstudy.netcdf import with_cf_encoding
from rsfstudy.rig.table import read_table
from rsfstudy.rig.units import factor, in_si

#: The numbers of an event, each with its error, and which part of it is missing, by its flag.
Found = tuple[dict[str, tuple[float, float]], int]
#: Of each quantity of an event what it is measured in, its heading in tables, and what it is.
QUANTITIES = {
    "time": ("D_c/V_*", "time", "time at which the event begins"),
    "duration": ("D_c/V_*", "duration", "duration of the event"),
    "interval": ("D_c/V_*", "interval", "time since the event before began"),
    "peak_log10_slip_rate": ("", "lg V_max/V_*", "decimal logarithm of peak slip rate over V_star"),
    "peak_slip_rate": ("V_*", "peak rate", "peak slip rate"),
    "slip": ("D_c", "slip", "slip during the event"),
    "stress_before": ("sigma_*", "", "highest shear stress before the event"),
    "stress_after": ("sigma_*", "", "lowest shear stress after the event"),
    "static_stress_drop": ("sigma_*", "static drop", "highest less lowest shear stress"),
    "dynamic_stress_drop": (
        "sigma_*",
        "dynamic drop",
        "highest shear stress less that at peak slip rate",
    ),
}
#: What quantities are measured in: as these variables, by their scales.
_MEASURED_AS = {"D_c/V_*": "time", "D_c": "slip", "sigma_*": "shear_stress"}
#: What is read of displacement.
_OF_SLIP = ("slip", "peak_slip_rate", "dynamic_stress_drop")
#: What part of an event is missing, by its flag.
_CUT = ("whole", "begins_before", "lasts_beyond", "both")

#: Chance that a record of Gaussian noise holds any event: one record in 10,000.
_CHANCE = 1e-4
#: Shortest windows in samples, and how many samples a record has for each sample of the longest,
#: so that the spread of what windows differ by is known to a quarter.
_SHORTEST, _SAMPLES = 4, 100
#: Standard deviations by which a drop must exceed the threshold to be found but once in 1,000.
_FOUND = 3.1
#: Standard deviations down to which an event is followed from where it is found.
_FOLLOWED = 2.0
#: Standard deviations by which slip exceeds what moves on anyway, and its least excess over that.
_FASTER, _LEAST_EXCESS = 3.0, 0.1
#: Standard deviation over the median of absolute deviations of Gaussian noise.
_NORMAL = 1.4826


def catalogue(found: Sequence[Found], about: Mapping[str, Mapping[Any, Any]]) -> xr.Dataset:
    """Events as a dataset, in the units of what they were read from."""
    rows = [numbers for numbers, _cut in found]
    for row, earlier in zip(rows, [{}, *rows], strict=False):
        (time, error), (before, unsure) = row["time"], earlier.get("time", (math.nan, math.nan))
        row["interval"] = time - before, error + unsure
    number = {"long_name": "number of the event", "units": "1"}
    dataset = xr.Dataset(coords={"event": ("event", np.arange(len(rows)), number)})
    for name, (scale, _heading, words) in QUANTITIES.items():
        if rows and name not in rows[0]:
            continue
        values, errors = np.array([row[name] for row in rows]).reshape(-1, 2).T
        units = _units(scale, about)
        dataset[name] = "event", values, {"long_name": words, **units}
        of_error = {"long_name": f"error estimate of {words}", **units}
        dataset[f"{name}_error"] = "event", errors, of_error
    flags = {
        "long_name": "what of the event the record leaves out",
        "flag_values": np.arange(len(_CUT), dtype=np.int8),
        "flag_meanings": " ".join(_CUT),
    }
    dataset["cut"] = "event", np.array([cut for _numbers, cut in found], dtype=np.int8), flags
    return with_cf_encoding(
        dataset.assign_attrs(
            title="Catalogue of events",
            Conventions="CF-1.11",
            **provenance.attributes("rsfstudy.events"),
        )
    )


def _units(scale: str, about: Mapping[str, Mapping[Any, Any]]) -> dict[str, str]:
    """Units and scale of a quantity, where times, slip and stresses have theirs."""
    if scale in _MEASURED_AS:
        source = about[_MEASURED_AS[scale]]
        return {key: str(source[key]) for key in ("units", "scale") if key in source}
    if not scale or "scale" in about["slip"]:
        return {"units": "1", **({"scale": scale} if scale else {})}
    time, slip = (about[name].get("units") for name in ("time", "slip"))
    return {"units": f"{slip} {time}-1"} if time and slip else {}


# ---- of a record --------------------------------------------------------------------------------


@error_boundary
def events(
    record: xr.Dataset | str | Path | None = None,
    *,
    time: Any = None,
    displacement: Any = None,
    shear_stress: Any = None,
    stiffness: Any = None,
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

    Slip is that of the fault: displacement less shear stress over `stiffness`, that of what lies
    between the fault and where displacement is measured. Without it displacement is taken for that
    of the fault, if it moves faster during the drops than before and after, by three standard
    deviations of its noise and by a tenth. That of a load point does not. It is read some samples
    away from each drop, whose place noise of stress may have moved.

    Parameters
    ----------
    record : xarray.Dataset, str or Path, optional
        ``time``, ``shear_stress`` and, where it was measured, ``displacement``, with units; or a
        CSV file of these, whose first line names columns and units (`read_table`).
    time, displacement, shear_stress : array_like
        The same as arrays; one with the attribute ``units`` keeps them, and numbers that are read
        of others have no attribute ``units``.
    stiffness : quantity, optional
        Shear stress over displacement, "0.05 MPa/um", or a number in units of the record: that of
        the rig where displacement is that of the load point; ``inf`` where it is surely that of the
        fault.

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
        For records that differ in length, hold NaN, or are too short, for times that do not
        increase, and for a stiffness that is not positive.

    Warns
    -----
    NoAnswer
        Where displacement does not move faster during the drops; ``slip``, ``peak_slip_rate`` and
        ``dynamic_stress_drop`` are NaN, and the attribute ``comment`` of slip says why.
    """
    given = {"time": time, "displacement": displacement, "shear_stress": shear_stress}
    if isinstance(record, str | Path):
        table = {n: of for n, of in read_table(record).items() if n in given}
        record = xr.Dataset({n: (n, of.values, {"units": of.units}) for n, of in table.items()})
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
    if stiffness is not None:
        if moves is None:
            raise InvalidValue("stiffness", stiffness, "needs the displacement of the load point")
        moves = moves - stress / _stiffness(stiffness, about)
    found, noise, smallest = _drops(stress)
    ends = [0, *(drop[1] for drop in found[:-1])]
    begins = [*(drop[0] for drop in found[1:]), len(stress)]
    rooms = [*zip(ends, begins, strict=True)] if found else []
    rows = [_row(times, stress, moves, *of) for of in zip(found, rooms, strict=True)]
    runs_on = moves is not None and stiffness is None and not _slips(times, moves, found)
    for row in rows if runs_on else ():
        row[0].update(dict.fromkeys(_OF_SLIP, (math.nan, math.nan)))
    dataset = catalogue(rows, about | {"slip": about["displacement"]})
    if rows and runs_on:
        why = "displacement moves no faster during the drops of stress than before and after"
        dataset["slip"].attrs["comment"] = why
        remedy = "Give stiffness='0.05 MPa/um', that of the rig, or math.inf if it is the fault's"
        warnings.warn(
            f"slip has no number: {why}. {remedy}", NoAnswer, stacklevel=user_stacklevel()
        )
    units = {key: value for key, value in about["shear_stress"].items() if key == "units"}
    dataset["noise"] = ((), noise, {"long_name": "standard deviation of the noise", **units})
    words = "drop of shear stress that is found but once in 1,000"
    dataset["smallest_drop"] = ((), smallest, {"long_name": words, **units})
    return dataset


def _stiffness(stated: Any, about: Mapping[str, Mapping[Any, Any]]) -> float:
    """Shear stress over displacement, in the units of the record."""
    if isinstance(stated, str):
        stress, length = (about[n].get("units") for n in ("shear_stress", "displacement"))
        if not (stress and length):
            remedy = "Give it as a number in the units of the record."
            raise InvalidValue("stiffness", stated, "the record states no units", remedy=remedy)
        ours = factor("shear_stress", stress, "Pa") / factor("displacement", length, "m")
        return _stiffness(in_si("stiffness", stated, "Pa/m") / float(ours), about)
    if not stated > 0.0:
        raise InvalidValue("stiffness", stated, "must be positive")
    return float(stated)


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


def _quantum(values: np.ndarray) -> float:
    """The smallest difference of neighbours."""
    steps = np.abs(np.diff(values))
    return float(steps[steps > 0.0].min(initial=math.inf))


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
    quantum = _quantum(stress)
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


def _slips(
    times: np.ndarray, moves: np.ndarray, found: Sequence[tuple[int, int, int, float]]
) -> bool:
    """True where displacement moves faster during the drops than for as long before and after."""
    excess = usual = variance = 0.0
    quantum = _quantum(moves)
    noises = {n: max(_spread(_falls(moves, n)), quantum) for n in {drop[2] for drop in found}}
    for begin, end, window, _error in found:
        far = end + window - begin
        places = (begin - window - far, begin - window, end, end + far)
        starts = np.clip(places, 0, len(moves) - window)
        lasts, slips = (
            np.diff([of[at : at + window].mean() for at in starts]) for of in (times, moves)
        )
        # nothing is before the very begin of the record, nor after its end
        ratios = (lasts[1] / np.where(lasts > 0.0, lasts, math.inf))[::2]
        moved, ratio = float((ratios * slips[::2]).max()), float(ratios.max())
        excess, usual = excess + float(slips[1]) - moved, usual + abs(moved)
        variance += 0.5 * noises[window] ** 2 * (1.0 + (1.0 + ratio) ** 2 + ratio**2)
    return bool(excess > max(_FASTER * math.sqrt(variance), _LEAST_EXCESS * usual))


def _row(
    times: np.ndarray,
    stress: np.ndarray,
    moves: np.ndarray | None,
    drop: tuple[int, int, int, float],
    room: tuple[int, int],
) -> Found:
    """The numbers of one event of a record, each with its standard error by noise; between the end
    of the event before and the beginning of the next.
    """
    begin, end, window, error = drop
    before, after = stress[begin - window : begin].mean(), stress[end : end + window].mean()
    apart = times[end] - times[begin - 1]
    row = {
        "time": (times[begin - 1], apart),
        "duration": (apart, apart),
        "stress_before": (before, error),
        "stress_after": (after, error),
        "static_stress_drop": (before - after, error),
    }
    if moves is None:
        return row, 0
    # moved by m samples, the mean of stress falls less by m drop/window, with noise of a deviation
    # of sqrt(3 m/window) of the error: so far may noise have moved the place, but once in 1,000
    off = math.ceil(3.0 * window * (_FOUND * error / (before - after)) ** 2)
    off = max(0, min(off, window, begin - window - room[0], room[1] - end - window))
    begin, end = begin - off, end + off
    slips = -_falls(moves, window)
    rates = np.diff(moves) / np.diff(times)
    fastest = begin - 1 + int(np.argmax(rates[begin - 1 : end]))
    noise = _spread(rates)
    slip = moves[end : end + window].mean() - moves[begin - window : begin].mean()
    crept = abs(float(np.median(slips))) * (1.0 + 2.0 * off / window)
    row["slip"] = slip, _spread(slips) + crept
    row["peak_slip_rate"] = row["dynamic_stress_drop"] = math.nan, math.nan
    if rates[fastest] > noise * norm.isf(_CHANCE / len(rates)):
        row["peak_slip_rate"] = rates[fastest], noise
        # stress then lies between that of the two samples
        ends = stress[fastest : fastest + 2]
        reading = 0.5 * float(np.ptp(ends)) + _spread(np.diff(stress))
        row["dynamic_stress_drop"] = before - ends.mean(), error + reading
    return row, 0
