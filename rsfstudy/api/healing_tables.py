"""Functions that build tables of frictional healing from records and motions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.api.slip_events_of_motion import InterpolatorBetweenMotionRows
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.execution import build_provenance_attributes
from rsfstudy.fitting import MAX_HOLD_OVER_SLIDING_VELOCITY, Record, build_hold_table
from rsfstudy.rig import read_record

#: Variables of a motion from which healing is measured.
_MOTION_VARIABLES_FOR_HEALING = (
    "log10_slip_rate",
    "load_point_displacement",
    "friction_coefficient",
)
#: Friction has a peak if friction falls after its maximum by more than this multiple of the
#: relative tolerance of the motion.
_MIN_POST_PEAK_FRICTION_FALL_OVER_RTOL = 10.0
#: Largest relative difference between load point velocities that are treated as equal, because the
#: difference is due to rounding.
_RTOL_OF_EQUAL_VELOCITIES = 1e-6


@raise_only_rsfstudy_errors
def healing(record: Record | xr.Dataset | str | Path, **reading: Any) -> xr.Dataset:
    """Measure frictional healing in a slide-hold-slide test.

    Parameters
    ----------
    record : Record, xarray.Dataset, str or Path
        Record of an experiment, path of the file of a record, or motion from ``rsfstudy.simulate``.
    **reading : object
        Keyword arguments of ``rsfstudy.read_record`` if ``record`` is a path.

    Returns
    -------
    xarray.Dataset
        Table of the holds, with the healing rate per decade and its standard error (see
        ``Record.holds`` of ``rsfstudy.fitting.Record``). The table of a motion contains
        interpolation errors instead of standard errors.

    Raises
    ------
    InvalidValue
        If the record contains no hold of the load point, or if the record cannot be read.

    See Also
    --------
    rsfstudy.plot_healing : Plot the table.
    rsfstudy.measures.Healing : Measure of studies for the healing of a scene.

    Examples
    --------
    >>> import numpy as np
    >>> from rsfstudy import healing, read_record
    >>> time = np.arange(0.0, 100.0, 0.1)
    >>> displacement = np.interp(time, [0.0, 30.0, 60.0, 100.0], [0.0, 300.0, 300.0, 700.0])
    >>> friction = np.interp(time, [0, 30, 60, 63, 66, 100], [0.6, 0.6, 0.58, 0.64, 0.6, 0.6])
    >>> friction += np.random.default_rng(0).normal(scale=1e-4, size=1000)
    >>> record = read_record({"time": time, "displacement": displacement, "friction": friction})
    >>> healing(record)["healing"].values.round(2)
    array([0.04])
    """
    if isinstance(record, str | Path):
        record = read_record(record, **reading)
    if isinstance(record, Record):
        table, name = record.holds(), record.name
    elif hasattr(record, "data_vars"):
        table, name = measure_holds_of_motion(record), "motion"
    else:
        remedy = "Pass a record from rsfstudy.read_record, the path of its file, or a motion."
        raise InvalidValue("record", record, "must be a record or a motion", remedy=remedy)
    if not table.sizes["hold"]:
        remedy = "If the steps are not detected, specify them: record.with_steps([...])."
        rule = "has no hold of the load point between sliding and reloading"
        raise InvalidValue("record", name, rule, remedy=remedy)
    return table.assign_attrs(build_provenance_attributes("rsfstudy.healing"))


def measure_holds_of_motion(motion: xr.Dataset) -> xr.Dataset:
    """Measure frictional healing and relaxation during the holds of a motion.

    Parameters
    ----------
    motion : xarray.Dataset
        Motion from ``rsfstudy.simulate``, in any units.

    Returns
    -------
    xarray.Dataset
        Table of holds, in the units of the motion (see ``DatasetAccessor.holds``).

    Raises
    ------
    DataError
        If the dataset is not a motion.
    """
    for name in ("time", *_MOTION_VARIABLES_FOR_HEALING):
        if name not in motion or motion[name].dims != ("time",):
            reason = "does not have the dimension time" if name in motion else "is missing"
            raise DataError(f"{name} {reason}. Pass a motion from rsfstudy.simulate.")
    time, values = (
        motion["time"].values,
        np.column_stack([motion[n] for n in _MOTION_VARIABLES_FOR_HEALING]),
    )
    rows = InterpolatorBetweenMotionRows(time, values, 0.0)
    least = _MIN_POST_PEAK_FRICTION_FALL_OVER_RTOL * float(motion.attrs.get("rtol", 0.0))
    initial = float(motion.get("slip_rate", 10.0 ** motion["log10_slip_rate"])[0])
    segments = _find_constant_velocity_segments(time, values[:, 1], initial)
    found = [
        (
            (time[first], time[last] - time[first], before, after),
            *_measure_hold_of_motion(rows, values, (first, last, end), least),
        )
        for (_, _, before), (first, last, load), (_, end, after) in zip(
            segments, segments[1:], segments[2:], strict=False
        )
        if abs(load) <= MAX_HOLD_OVER_SLIDING_VELOCITY * min(before, after)
    ]
    exact = np.array([of[0] for of in found]).reshape(-1, 4)
    numbers, errors = (np.array([of[n] for of in found]).reshape(-1, 5) for n in (1, 2))
    table = build_hold_table(exact, numbers, errors, np.diag(errors[:, 2] ** 2), "error")
    return _add_units_of_motion(table, motion).assign_attrs(
        title="Holds of a motion", Conventions="CF-1.11"
    )


def _measure_hold_of_motion(
    interpolated_rows: InterpolatorBetweenMotionRows,
    motion_values: np.ndarray,
    hold_row_numbers: tuple[int, int, int],
    min_friction_fall: float,
) -> tuple[list[float], list[float]]:
    """Measure a hold of a motion.

    The row numbers refer to the first row of the hold, the last row of the hold, and the last row
    of the reloading. Friction has a peak if friction falls by more than ``min_friction_fall`` after
    its maximum.

    Returns
    -------
    numbers, errors : list of float
        Friction before the hold, peak friction, healing, relaxation and peak displacement, with
        their interpolation errors.
    """
    first, last, end = hold_row_numbers
    moved, friction = motion_values[:, 1], motion_values[:, 2]
    level = float(friction[first])
    relaxed = float(friction[last]) - level
    falls = np.flatnonzero(np.diff(friction[last : end + 1]) < 0.0)
    if len(falls):
        top = last + int(falls[0])
        peak, error = interpolated_rows.find_extremum_near_row(top, 2, 1.0)
        if peak[2] - friction[top : end + 1].min() > min_friction_fall:
            numbers = [level, peak[2], peak[2] - level, relaxed, peak[1] - moved[last]]
            return numbers, [0.0, error[2], error[2], 0.0, error[1]]
    return [level, np.nan, np.nan, relaxed, np.nan], [0.0, np.nan, np.nan, 0.0, np.nan]


def _find_constant_velocity_segments(
    time: np.ndarray, displacement: np.ndarray, initial_velocity: float
) -> list[tuple[int, int, float]]:
    """Find the segments of a motion in which the load point velocity is constant.

    Returns
    -------
    list of (int, int, float)
        First row, last row and load point velocity of each segment. The first item represents the
        steady sliding before the motion.
    """
    lasts = np.diff(time)
    moves = lasts > 16.0 * np.spacing(np.abs(time[1:]))
    velocity = np.full(len(lasts), np.nan)
    velocity[moves] = np.diff(displacement)[moves] / lasts[moves]
    fastest = np.nanmax(np.abs(velocity), initial=0.0)
    rounding = 4.0 * np.spacing(np.abs(displacement).max()) / np.where(moves, lasts, 1.0)
    found = [(0, 0, initial_velocity)]
    for row in np.flatnonzero(moves).tolist():
        same = (
            abs(velocity[row] - found[-1][2]) <= _RTOL_OF_EQUAL_VELOCITIES * fastest + rounding[row]
        )
        if same and len(found) > 1:
            found[-1] = found[-1][0], row + 1, found[-1][2]
        else:
            found.append((row, row + 1, float(velocity[row])))
    return found


def _add_units_of_motion(hold_table: xr.Dataset, motion: xr.Dataset) -> xr.Dataset:
    """Return a table of holds in the units of a motion."""
    time, moved = (motion[name].attrs for name in ("time", "load_point_displacement"))
    rate = motion["slip_rate"].attrs if "slip_rate" in motion else {"units": "1", "scale": "V_*"}
    sources = {"begins": time, "duration": time, "velocity_before": rate, "velocity_after": rate}
    sources |= {"peak_displacement": moved, "peak_displacement_error": moved}
    for name, about in sources.items():
        hold_table[name].attrs |= {key: about[key] for key in ("units", "scale") if key in about}
    return hold_table
