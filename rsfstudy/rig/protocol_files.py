"""Functions that create loading histories and segments from data in any units.

`history` creates a sampled loading history from arrays, datasets or CSV files. `read_protocol`
reads a list of loading segments from a CSV file.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.rig.column_reading import RecordReadingOptions, read_columns
from rsfstudy.rig.record_column_detection import AcceptedRecordColumns
from rsfstudy.rig.rig import SCALE_SYMBOL_BY_LOADING_SEGMENT_FIELD, Rig
from rsfstudy.rig.table_columns import Column
from rsfstudy.rig.table_files import read_table
from rsfstudy.slider import (
    MIN_SEGMENT_DURATION,
    SEGMENT_MAPPING_KEYS,
    Protocol,
    SampledHistory,
    protocol,
)

#: Column names of a sampled history, and the units of the columns if the user passes no rig.
_DIMENSIONLESS_UNIT_BY_HISTORY_COLUMN = {
    "time": "D_c/V_*", "displacement": "D_c", "velocity": "V_*", "normal_stress": "sigma_*",
    "pore_pressure": "sigma_*",
}  # fmt: skip


@accept_former_keyword_names
@raise_only_rsfstudy_errors
def history(
    record: Any,
    rig: Rig | None = None,
    *,
    columns: Mapping[str, Any] | None = None,
    name: str = "history",
    **reading: Any,
) -> SampledHistory:
    """Create a loading history from sampled data.

    Pass the result to a scene, as in ``Scene(loading=history(record))``.

    Parameters
    ----------
    record : mapping, pandas.DataFrame, xarray.Dataset, Record, str or Path
        Arrays by name, a dataset, a record, or the path of a file in any format that `read_record`
        reads. The column ``time`` is required. The column ``displacement`` or ``velocity``
        describes the load point. If both columns are missing, the load point moves at :math:`V_*`.
        The optional column ``normal_stress`` contains the normal stress. The optional column
        ``pore_pressure`` contains the pore pressure relative to the pore pressure before the start
        of the record. Other columns are ignored.
    rig : Rig, optional
        Rig for the conversion of units. By default, all data are dimensionless: times in
        ``D_c/V_*``, displacements in ``D_c``, velocities in ``V_*`` and stresses in ``sigma_*``.
    columns : mapping of str to (str, str) or str, optional
        Heading and units of each column, for example ``{"time": ("t", "s")}`` or ``{"time": "t
        (s)"}``. By default, columns are recognised by common headings, as in `read_record`. Arrays
        are in SI units if you pass a rig, and dimensionless otherwise. The units of dataset
        variables are read from their attribute ``units``.
    name : str, default: "history"
        Name of the history in results.
    **reading : object
        Options ``decimal``, ``sheet``, ``area``, ``rows``, ``begin``, ``end`` and ``thin`` of
        `read_record`.

    Returns
    -------
    SampledHistory
        Loading history.

    Raises
    ------
    InvalidValue
        If units are missing, if a value is missing or not finite, if time does not increase, or if
        the normal stress is not positive. The error message contains the line and column of the
        file, or the number of the sample. If the load point moves backwards, the function does not
        raise an error, but the history can only be used in scenes with ``regularised=True``.

    Notes
    -----
    The history starts with the first sample. Before the first sample, the slider slides steadily at
    :math:`V_*`. After the last sample, the load point continues at the last velocity, and the
    stress is constant.

    The history is linear between samples. If the displacement is sampled, the load point moves at a
    constant velocity from each sample to the next sample. If the velocity is sampled, the load
    point moves at the mean velocity of the two samples. The normal stress and the pore pressure
    change at constant rates.

    If the scene has a fluid with dilatancy, the column ``pore_pressure`` is the pressure around the
    fault, and fluid flows between the fault and its surroundings.

    Examples
    --------
    >>> import rsfstudy
    >>> loading = rsfstudy.history({"time": [0.0, 10.0, 20.0], "displacement": [0.0, 10.0, 30.0]})
    >>> rsfstudy.Scene(loading=loading).load_velocity
    2.0

    A history with physical units requires a rig:

    >>> rig = rsfstudy.Rig(
    ...     normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s"
    ... )
    >>> record = {"t (s)": [0.0, 100.0, 200.0], "lp (um)": [0.0, 100.0, 300.0]}
    >>> columns = {"time": "t (s)", "displacement": "lp (um)"}
    >>> loading = rsfstudy.history(record, rig, columns=columns)
    >>> round(rsfstudy.Scene(loading=loading).load_velocity, 9)
    2.0
    """
    found = _read_history_columns(
        record, columns, rig, RecordReadingOptions.from_keywords("history", reading)
    )
    if "time" not in found or len(found) == 1:
        remedy = 'Pass, for example, {"time": ..., "displacement": ...}.'
        raise InvalidValue(
            "record",
            [*found],
            "must contain the column 'time' and at least one other column",
            remedy=remedy,
        )
    if "displacement" in found and "velocity" in found:
        rule = "must contain either the displacement or the velocity of the load point, not both"
        raise InvalidValue("record", [*found], rule)
    sizes = {len(column.values) for column in found.values()}
    if len(sizes) > 1 or min(sizes) < 2:
        rule = (
            "must have the same number of samples, and at least 2 samples (got "
            f"{' and '.join(map(str, sorted(sizes)))} {'sample' if sizes == {1} else 'samples'} "
            f"in the columns {', '.join(found)})"
        )
        raise InvalidValue("all columns of the record", ..., rule)
    values = {
        key: _convert_column_to_dimensionless(key, column, rig) for key, column in found.items()
    }
    time = values["time"]
    late = np.append(False, np.diff(time) < MIN_SEGMENT_DURATION)
    rule = (
        "must be later than the time of the previous sample by at least "
        f"{MIN_SEGMENT_DURATION:g} D_c/V_*"
    )
    found["time"].raise_for_invalid_values("time", late, rule)
    velocity, back = _compute_load_point_velocity(values, found)
    fall = None
    if "normal_stress" in found or "pore_pressure" in found:
        ones, none = np.ones(len(time)), np.zeros(len(time))
        fall = values.get("pore_pressure", none) - (values.get("normal_stress", ones) - 1.0)
        key = "normal_stress" if "normal_stress" in found else "pore_pressure"
        rule = (
            f"is too {'low' if key == 'normal_stress' else 'high'}, because the effective normal "
            "stress (normal stress minus pore pressure) must be positive"
        )
        found[key].raise_for_invalid_values(key, fall >= 1.0, rule)
    of_pressure = "pore_pressure" in found and "normal_stress" not in found
    return SampledHistory.from_samples(
        time, velocity, fall, name, of_pressure=of_pressure, first_load_point_reversal=back
    )


def _read_history_columns(
    record: Any,
    selected_columns: Mapping[str, Any] | None,
    rig: Rig | None,
    reading_options: RecordReadingOptions,
) -> dict[str, Column]:
    """Read the columns of a source that describe a loading history."""
    if reading_options.filter:
        remedy = "Filter the columns before you pass them as arrays."
        raise InvalidValue(
            "filter",
            reading_options.filter,
            "cannot be applied to a loading history",
            remedy=remedy,
        )
    usable = AcceptedRecordColumns((*_DIMENSIONLESS_UNIT_BY_HISTORY_COLUMN,))
    found = read_columns(record, selected_columns, usable, reading_options).columns_by_name
    for name, column in found.items():
        if rig is not None and hasattr(record, "data_vars") and not column.units:
            raise InvalidValue(
                name, name, "has no units", remedy="Set the attribute units of the variable."
            )
    thinned = slice(None, None, reading_options.thin)
    return {
        name: of._replace(values=of.values[thinned], line_numbers=of.line_numbers[thinned])
        for name, of in found.items()
    }


def _convert_column_to_dimensionless(
    quantity_name: str, column: Column, rig: Rig | None
) -> np.ndarray:
    """Convert a column to dimensionless units."""
    scale, units = _DIMENSIONLESS_UNIT_BY_HISTORY_COLUMN[quantity_name], column.units
    if units == scale or (rig is None and units in ("", "1")):
        return column.values
    if rig is None:
        rule = f"require a rig to convert {quantity_name}"
        raise InvalidValue(
            "units", units, rule, remedy=f"Pass rig=, or use the dimensionless unit {scale}."
        )
    one = rig.dimensionless(f"1 {units}" if units else 1.0, scale, quantity_name)
    return np.asarray(column.values * one)


def _compute_load_point_velocity(
    values_by_column: Mapping[str, np.ndarray], columns_by_name: Mapping[str, Column]
) -> tuple[np.ndarray, tuple[str, float, str] | None]:
    """Compute the velocity of the load point after each sample.

    The function also returns the column name, value and position of the first sample at which the
    load point moves backwards, or None if the load point never moves backwards.
    """
    time, key = (
        values_by_column["time"],
        "velocity" if "velocity" in columns_by_name else "displacement",
    )
    if key not in columns_by_name:
        return np.ones(len(time)), None
    if key == "velocity":
        speeds = values_by_column[key]
        back = speeds < 0.0
        mean = np.append(0.5 * (speeds[:-1] + speeds[1:]), speeds[-1])
    else:
        steps = np.diff(values_by_column[key])
        back = np.append(False, steps < 0.0)
        speeds = steps / np.diff(time)
        mean = np.append(speeds, speeds[-1])
    if not back.any():
        return mean, None
    first = int(np.argmax(back))
    return mean, (
        key,
        float(columns_by_name[key].values[first]),
        columns_by_name[key].format_location_of_row(first),
    )


@accept_former_keyword_names
@raise_only_rsfstudy_errors
def read_protocol(
    path: str | Path, rig: Rig | None = None, name: str = "protocol", *, decimal: str = "."
) -> Protocol:
    r"""Read a loading protocol from a CSV file.

    Parameters
    ----------
    path : str or Path
        Path of the file. The first line contains the names and units of the columns, for example
        ``velocity (um/s), duration (s)``. Each of the other lines describes a loading segment by
        its velocity and either its ``duration`` or its ``distance``. The optional column ``step``
        contains a sudden displacement at the start of the segment. The column ``normal_stress`` is
        also optional. Fields of the table may be empty.
    rig : Rig, optional
        Rig for the conversion of units. A rig is not needed if all columns have the dimensionless
        units ``V_*``, ``D_c``, ``D_c/V_*`` and ``sigma_*``.
    name : str, default: "protocol"
        Name of the protocol in results.
    decimal : {".", ","}, default: "."
        Decimal separator of the file.

    Returns
    -------
    Protocol
        Loading history for ``Scene(loading=...)``.

    Raises
    ------
    DataError
        If the file does not exist or is not a text file.
    InvalidValue
        If the header contains no units, or if a field is not a number. The error message contains
        the line and the column.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import rsfstudy
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "steps.csv"
    >>> _ = path.write_text("velocity (V_*), distance (D_c)\n1, 10\n10, 20\n")
    >>> test = rsfstudy.read_protocol(path)
    >>> test.duration
    12.0
    """
    columns = read_table(path, decimal=decimal)
    for key in columns:
        if key not in SEGMENT_MAPPING_KEYS:
            raise InvalidValue("column", key, "is unknown", choices=SEGMENT_MAPPING_KEYS)
    units = {key: column.units for key, column in columns.items()}
    of_slider = all(SCALE_SYMBOL_BY_LOADING_SEGMENT_FIELD[key] == of for key, of in units.items())
    if not of_slider and rig is None:
        remedy = "Pass rig=, or use the dimensionless units V_*, D_c and D_c/V_*."
        rule = "require a rig"
        raise InvalidValue("units", ", ".join(units.values()), rule, remedy=remedy)
    rows = zip(*(column.values.tolist() for column in columns.values()), strict=True)
    stated = [{k: x for k, x in zip(columns, row, strict=True) if not np.isnan(x)} for row in rows]
    if of_slider or rig is None:
        return protocol(stated, name)
    return rig.protocol(
        [{k: f"{x:.17g} {units[k]}" for k, x in segment.items()} for segment in stated], name
    )
