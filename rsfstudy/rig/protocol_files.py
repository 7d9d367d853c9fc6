"""Loading histories, in whatever units: sampled ones from arrays, datasets and CSV files, and
protocols from CSV files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy._deprecation import renamed_keywords
from rsfstudy.error_boundary import error_boundary
from rsfstudy.errors import InvalidValue
from rsfstudy.rig.rig import SLIDER_UNITS_OF_SEGMENT_FIELDS, Rig
from rsfstudy.rig.table_files import Column, read_table, select_columns_of_arrays
from rsfstudy.slider import (
    MIN_SEGMENT_DURATION,
    SEGMENT_KEYS,
    Protocol,
    SampledHistory,
    build_sampled_history,
    protocol,
)

#: What a record may hold, and the units of the slider.
_SLIDER_UNITS_OF_RECORD_COLUMNS = {
    "time": "D_c/V_*", "displacement": "D_c", "velocity": "V_*", "normal_stress": "sigma_*",
    "pore_pressure": "sigma_*",
}  # fmt: skip


@renamed_keywords
@error_boundary
def history(
    record: Any,
    rig: Rig | None = None,
    *,
    columns: Mapping[str, Any] | None = None,
    name: str = "history",
) -> SampledHistory:
    """A loading history that was sampled: ``Scene(loading=history(record))``.

    Linear between samples: a load point whose displacement was sampled moves at a steady velocity
    from each sample to the next; one whose velocity was, by the mean of both; normal stress and
    pore pressure change at steady rates. It begins with the first sample, before which the slider
    slides steadily at V_*. After the last one the load point goes on at the last velocity, and
    stress stays.

    Parameters
    ----------
    record : mapping, xarray.Dataset, str or Path
        Arrays by name, or variables, or a CSV file whose first line names columns and units
        (`read_table`): ``time``; ``displacement`` or ``velocity`` of the load point, which moves at
        V_* without either; ``normal_stress``; and ``pore_pressure`` above that before the record.
        Beside a fluid that dilates it is the pressure around the fault, into which fluid drains.
    rig : Rig, optional
        The rig whose units are used. Without it all are those of the slider: ``D_c/V_*``, ``D_c``,
        ``V_*``, ``sigma_*``.
    columns : mapping of str to (str, str) or str, optional
        What the columns are called in the record, and their units, as in ``{"time": ("t", "s")}``
        or ``{"time": "t (s)"}``.
        Without it arrays are in units of the slider, or in SI units where a rig is given;
        variables have an attribute ``units``.
    name : str
        What the history is called in results.

    Raises
    ------
    InvalidValue
        For missing units, a gap or NaN, a clock that stands still or runs back, and normal stress
        that is not positive: with line and column, or the number of the sample; and so when a Scene
        is made of a load point that moves back, unless it is `regularised`.
    """
    found = _read_columns(record, columns, rig)
    for key in found:
        if key not in _SLIDER_UNITS_OF_RECORD_COLUMNS:
            raise InvalidValue("column", key, "is unknown", choices=_SLIDER_UNITS_OF_RECORD_COLUMNS)
    if "time" not in found or len(found) == 1:
        remedy = 'State "time" and what was sampled, as in {"time": ..., "displacement": ...}.'
        raise InvalidValue("record", [*found], "tells no history", remedy=remedy)
    if "displacement" in found and "velocity" in found:
        rule = "has displacement and velocity of the load point: give one of them"
        raise InvalidValue("record", [*found], rule)
    sizes = {len(column.values) for column in found.values()}
    if len(sizes) > 1 or min(sizes) < 2:
        rule = f"has columns of {sorted(sizes)} samples: all must have as many, 2 at least"
        raise InvalidValue("record", [*found], rule)
    for key, column in found.items():
        column.check_values(key, ~np.isfinite(column.values), "must be a finite number")
    values = {
        key: _convert_column_to_slider_units(key, column, rig) for key, column in found.items()
    }
    time = values["time"]
    late = np.append(False, np.diff(time) < MIN_SEGMENT_DURATION)
    found["time"].check_values("time", late, "must be later than the sample before")
    velocity, back = _load_point_velocity(values, found)
    fall = None
    if "normal_stress" in found or "pore_pressure" in found:
        ones, none = np.ones(len(time)), np.zeros(len(time))
        fall = values.get("pore_pressure", none) - (values.get("normal_stress", ones) - 1.0)
        key = "normal_stress" if "normal_stress" in found else "pore_pressure"
        rule = "leaves no normal stress: it must stay positive, less pore pressure"
        found[key].check_values(key, fall >= 1.0, rule)
    of_pressure = "pore_pressure" in found and "normal_stress" not in found
    return build_sampled_history(
        time, velocity, fall, name, of_pressure=of_pressure, first_reversal=back
    )


def _read_columns(
    record: Any, columns: Mapping[str, Any] | None, rig: Rig | None
) -> dict[str, Column]:
    """Columns of a record, of whatever kind."""
    if isinstance(record, str | Path):
        return read_table(record, columns)
    is_dataset = hasattr(record, "data_vars")
    if not is_dataset and not isinstance(record, Mapping):
        remedy = 'Give {"time": ..., "displacement": ...}, a Dataset, or the path of a CSV file.'
        raise InvalidValue("record", record, "is no record", remedy=remedy)
    if columns is None:  # a dataset may hold more
        names = (
            [n for n in record.variables if n in _SLIDER_UNITS_OF_RECORD_COLUMNS]
            if is_dataset
            else [*record]
        )
        columns = {str(name): str(name) for name in names}
    found = select_columns_of_arrays(record, columns)
    for key, column in found.items():
        if is_dataset and rig is not None and not column.units:
            remedy = "Set its attribute units."
            raise InvalidValue(key, columns[key], "has no units", remedy=remedy)
    return found


def _convert_column_to_slider_units(
    quantity_name: str, column: Column, rig: Rig | None
) -> np.ndarray:
    """Numbers of a column in units of the slider."""
    scale, units = _SLIDER_UNITS_OF_RECORD_COLUMNS[quantity_name], column.units
    if units == scale or (rig is None and units in ("", "1")):
        return column.values
    if rig is None:
        rule = f"need the scales of a rig for {quantity_name}"
        raise InvalidValue("units", units, rule, remedy=f"Give a rig, or {scale}.")
    one = rig.dimensionless(f"1 {units}" if units else 1.0, scale, quantity_name)
    return np.asarray(column.values * one)


def _load_point_velocity(
    record_values: Mapping[str, np.ndarray], record_columns: Mapping[str, Column]
) -> tuple[np.ndarray, tuple[str, float, str] | None]:
    """Velocity of the load point from each sample on; and the sample by which it first moves back,
    with its name and place.
    """
    time, key = (
        record_values["time"],
        "velocity" if "velocity" in record_columns else "displacement",
    )
    if key not in record_columns:
        return np.ones(len(time)), None
    if key == "velocity":
        speeds = record_values[key]
        back = speeds < 0.0
        mean = np.append(0.5 * (speeds[:-1] + speeds[1:]), speeds[-1])
    else:
        steps = np.diff(record_values[key])
        back = np.append(False, steps < 0.0)
        speeds = steps / np.diff(time)
        mean = np.append(speeds, speeds[-1])
    if not back.any():
        return mean, None
    first = int(np.argmax(back))
    return mean, (
        key,
        float(record_columns[key].values[first]),
        record_columns[key].location(first),
    )


@renamed_keywords
@error_boundary
def read_protocol(path: str | Path, rig: Rig | None = None, name: str = "protocol") -> Protocol:
    """A loading history from a CSV file.

    Its first line names the columns and their units, as in ``velocity (um/s), duration (s)``: a
    velocity, and the duration or the distance of each segment (a field may be empty), and perhaps a
    sudden ``step`` at its beginning, or the ``normal_stress`` during it. Units of the slider
    (``V_*``, ``D_c``, ``D_c/V_*``, ``sigma_*``) need no rig.

    Parameters
    ----------
    path : str or Path
    rig : Rig, optional
        The rig whose units are used.
    name : str
        What the protocol is called in results.

    Raises
    ------
    DataError
        Where there is no such file of text.
    InvalidValue
        For a header without units, or a field that is no number, with its line and column.
    """
    columns = read_table(path)
    for key in columns:
        if key not in SEGMENT_KEYS:
            raise InvalidValue("column", key, "is unknown", choices=SEGMENT_KEYS)
    units = {key: column.units for key, column in columns.items()}
    of_slider = all(SLIDER_UNITS_OF_SEGMENT_FIELDS[key] == of for key, of in units.items())
    if not of_slider and rig is None:
        remedy = "Give a rig, or the units of the slider: V_*, D_c, D_c/V_*."
        rule = "need the scales of a rig"
        raise InvalidValue("units", ", ".join(units.values()), rule, remedy=remedy)
    rows = zip(*(column.values.tolist() for column in columns.values()), strict=True)
    stated = [{k: x for k, x in zip(columns, row, strict=True) if not np.isnan(x)} for row in rows]
    if of_slider or rig is None:
        return protocol(stated, name)
    return rig.protocol(
        [{k: f"{x:.17g} {units[k]}" for k, x in segment.items()} for segment in stated], name
    )
