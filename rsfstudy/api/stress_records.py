"""Functions that read the shear stress of laboratory records for event detection."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.rig import (
    AcceptedRecordColumns,
    Column,
    RecordReadingOptions,
    compute_conversion_factor,
    convert_to_si,
    read_columns,
)

#: Columns that are used for event detection.
_COLUMNS_FOR_EVENT_DETECTION = AcceptedRecordColumns(
    ("time", "slip", "displacement", "shear_stress", "friction", "normal_stress"),
    skips_normal_stress_if_shear_stress=True,
)


class StressRecord(NamedTuple):
    """Time, displacement and shear stress of a record.

    Parameters
    ----------
    variables_by_name : mapping of str to array_like or None
        Arrays ``time``, ``displacement`` and ``shear_stress``. The attribute ``units`` of an array
        contains its units.
    has_time : bool, default: True
        False if the record contains displacement in place of time.
    displacement_is_slip : bool, default: False
        True if the displacement is the slip of the fault.
    processing_steps : tuple of str, default: ()
        Descriptions of the selection of rows and of filters.
    """

    variables_by_name: Mapping[str, Any]
    has_time: bool = True
    displacement_is_slip: bool = False
    processing_steps: tuple[str, ...] = ()


def read_stress_record(
    record: Any,
    columns: Mapping[str, Any] | None,
    normal_stress: Any,
    reading_options: RecordReadingOptions,
) -> StressRecord:
    """Read time, displacement and shear stress of a record in any format.

    Parameters
    ----------
    record : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record
        Path of a file, or object that contains the columns.
    columns : mapping of str to str or tuple, or None
        Heading and units of columns by name.
    normal_stress : quantity
        Normal stress by which friction is multiplied. None if the normal stress is unknown.
    reading_options : RecordReadingOptions
        Reading options.

    Returns
    -------
    StressRecord
        Arrays in the units of the record. The product of friction and normal stress is in MPa.

    Raises
    ------
    InvalidValue
        If the record has neither shear stress nor friction, or neither time nor displacement.
    """
    whole = reading_options == RecordReadingOptions() and columns is None
    if whole and isinstance(record, xr.Dataset) and {"time", "shear_stress"} <= {*record.variables}:
        # Simulated motions have unit scales instead of units.
        names = ("time", "displacement", "shear_stress")
        return StressRecord({name: record.get(name) for name in names})
    found, table, processing = read_columns(
        record, columns, _COLUMNS_FOR_EVENT_DETECTION, reading_options
    )
    lacking = "shear stress or friction" if not {"shear_stress", "friction"} & {*found} else ""
    lacking = lacking or ("" if {"time", "displacement"} & {*found} else "time or displacement")
    if lacking:
        remedy = (
            "Select the columns, for example --columns 'time=t (s),shear_stress=tau (MPa)' "
            "(columns=)."
        )
        header = ", ".join(table.headings)[:200]
        raise InvalidValue(
            "header", header, f"has no recognised heading for {lacking}", remedy=remedy
        ).with_location(table.heading_location)
    moved = found.get("slip", found.get("displacement"))
    series = {"time": found.get("time"), "displacement": moved,
              "shear_stress": _find_or_compute_shear_stress(found, normal_stress)}  # fmt: skip
    present = {name: column for name, column in series.items() if column is not None}
    values, smoothing = _filter_and_thin_columns(present, reading_options)
    variables = {
        name: xr.DataArray(
            values[name], dims="sample", attrs={"units": of.units} if of.units else {}
        )
        for name, of in present.items()
    }
    earlier = getattr(record, "processing", ())
    return StressRecord(
        {name: variables.get(name) for name in series},
        "time" in variables,
        "slip" in found,
        (*earlier, *processing, *smoothing),
    )


def _find_or_compute_shear_stress(columns: Mapping[str, Column], normal_stress: Any) -> Column:
    """Return the shear stress, or compute it in MPa as friction times normal stress.

    If the normal stress is unknown, the function returns friction.
    """
    if "shear_stress" in columns:
        return columns["shear_stress"]
    friction = columns["friction"]
    if "normal_stress" in columns:
        stress = columns["normal_stress"]
        factor = compute_conversion_factor("normal_stress", stress.units or "MPa", "Pa")
        pascals = stress.values * float(factor)
    elif normal_stress is not None:
        pascals = np.asarray(convert_to_si("normal_stress", normal_stress, "Pa"))
    else:
        return friction._replace(units="1")
    return friction._replace(values=1e-6 * friction.values * pascals, units="MPa")


def _filter_and_thin_columns(
    columns: Mapping[str, Column], reading_options: RecordReadingOptions
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Filter and thin the columns. The filter needs the time in s."""
    values = {name: column.values for name, column in columns.items()}
    factor = 1.0
    if reading_options.filter and "time" in columns and columns["time"].units:
        factor = float(compute_conversion_factor("time", columns["time"].units, "s"))
        values["time"] = values["time"] * factor
    found, processing = reading_options.filter_and_thin_columns(values, ("shear_stress",))
    if factor != 1.0:
        found["time"] = found["time"] / factor
    return found, processing
