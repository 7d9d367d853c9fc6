"""Functions that read laboratory records from files and arrays.

`read_record` is the main function.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import raise_only_rsfstudy_errors
from rsfstudy.fitting import RECORD_COLUMNS, Record
from rsfstudy.rig.column_reading import ColumnsReadFromSource, RecordReadingOptions, read_columns
from rsfstudy.rig.record_column_detection import (
    AcceptedRecordColumns,
    build_missing_columns_error,
    compute_factor_to_record_units,
)
from rsfstudy.rig.rig_quantities import is_stiffness_in_friction_per_length
from rsfstudy.rig.row_selection import parse_smoothing_filter
from rsfstudy.rig.units import convert_to_si

#: Columns of a file from which a ``Record`` is built.
_ACCEPTED_RECORD_COLUMNS = AcceptedRecordColumns(
    ("time", "displacement", "slip", "friction", "shear_stress", "normal_stress")
)


@raise_only_rsfstudy_errors
def read_record(
    source: Any,
    columns: Mapping[str, Any] | None = None,
    *,
    normal_stress: Any = None,
    stiffness: Any = None,
    name: str = "",
    decimal: str = ".",
    sheet: str = "",
    area: Any = None,
    rows: Sequence[int] | None = None,
    begin: Any = None,
    end: Any = None,
    thin: int = 1,
    filter: str = "",
) -> Record:
    """Read a record of an experiment.

    Pass the result to `rsfstudy.fit`.

    Parameters
    ----------
    source : str, Path, mapping, pandas.DataFrame, xarray.Dataset or Record
        Path of a file, or an object in memory. The format of a file is recognised by its first
        bytes: text (UTF-8, UTF-16 or Windows-1252), Excel, MATLAB, TDMS, NetCDF or xlook. Text
        files may be compressed by gzip, bzip2 or xz. The arrays must be named ``time``,
        ``displacement`` (of the load point), ``friction`` or ``shear_stress``, and optionally
        ``normal_stress``. By default, arrays are in s, um and MPa, and times may have the type
        `numpy.datetime64` or `numpy.timedelta64`. If the names contain units, for example ``LP disp
        (um)``, the names are interpreted as the headings of a file.
    columns : mapping of str to str or tuple, optional
        Heading and units of each column, for example ``{"time": "t (s)", "friction": "mu"}`` or
        ``{"time": ("t", "s")}``. By default, common headings are recognised by their first letters,
        and must contain units, as in ``Displ (um)``. Columns can also be selected by their numbers,
        counted from 1, as in ``{"time": "1 (s)"}``. For raw data, add a scale and an offset, as in
        ``"LP (um) * 0.1 + 5"`` or ``("LP", "um", 0.1, 5)``.
    normal_stress : quantity, optional
        Normal stress, for example ``"20 MPa"``, if the record has no column ``normal_stress``. The
        friction is the shear stress divided by the normal stress.
    stiffness : quantity, optional
        Stiffness of the machine, for example ``"0.05 MPa/um"``, or stiffness divided by normal
        stress, for example ``"2e-3 1/um"``. A plain number is in 1/um. The stiffness is required if
        the record has a column ``slip`` instead of ``displacement``. Slip is the displacement of
        the load point minus the elastic shortening of the machine. The displacement is computed as
        slip plus shear stress divided by stiffness. Pass the same stiffness to `rsfstudy.fit`.
    name : str, optional
        Name of the record in results. By default, the name is the name of the file, or "record".
    decimal : {".", ","}, default: "."
        Decimal separator of a text file.
    sheet : str, default: ""
        Sheet of a workbook, or group of a TDMS file. By default, the first sheet or group is read.
    area : quantity, optional
        Area of the fault, for example ``"25 cm2"``. If a column contains a force instead of a
        stress, the force is divided by the area.
    rows : (int, int), optional
        Numbers of the first and the last row to read, counted from 1. By default, all rows are
        read.
    begin, end : quantity, optional
        Time or load point displacement at which the selected rows begin and end, for example
        ``"100 s"`` or ``"2 mm"``. A number is a time in s.
    thin : int, default: 1
        Thinning factor. After the filter, every ``thin``-th row is kept.
    filter : str, default: ""
        Filter that is applied to friction, for example ``"mean 1 s"`` (running mean centred at each
        row), ``"trailing_mean 1 s"``, ``"first_order 2 Hz"``, ``"butterworth_2 2 Hz"`` or
        ``"butterworth_4 2 Hz"``. `rsfstudy.fit` applies the same filter to the model. Rows whose
        averaging interval extends beyond the record are removed.

    Returns
    -------
    Record
        Record with columns in s, um, 1 and Pa. The attribute ``processing`` lists the selection of
        rows, the filter and the thinning.

    Raises
    ------
    DataError
        If the file does not exist, if its format is unknown, or if a library that reads the format
        is not installed.
    InvalidValue
        If columns or units are missing, if a field is not a number, if time does not increase, or
        if the normal stress is not positive. The error message contains the line and the column.

    Examples
    --------
    >>> import rsfstudy
    >>> data = {
    ...     "time (s)": [0.0, 1.0, 2.0],
    ...     "LP disp (mm)": [0.0, 0.001, 0.002],
    ...     "shear stress (MPa)": [3.0, 3.1, 3.2],
    ... }
    >>> record = rsfstudy.read_record(data, normal_stress="5 MPa")
    >>> record.columns["displacement"].round(6)
    array([0., 1., 2.])
    >>> record.columns["friction"].round(6)
    array([0.6 , 0.62, 0.64])
    """
    options = RecordReadingOptions(rows, begin, end, thin, filter, decimal, sheet, area)
    earlier = source if isinstance(source, Record) else None
    if earlier is not None and earlier.filter and filter:
        rule = "cannot be applied, because the record is already filtered"
        raise InvalidValue("filter", filter, rule, remedy="Apply one filter only.")
    found = read_columns(source, columns, _ACCEPTED_RECORD_COLUMNS, options)
    values = {key: _convert_to_record_units(key, found) for key in found.columns_by_name}
    _check_required_columns(found)
    _add_derived_columns(values, normal_stress, stiffness)
    values = {q.name: values[q.name] for q in RECORD_COLUMNS if q.name in values}
    values, smoothing = options.filter_and_thin_columns(values, ("friction",))
    processing = tuple(found.row_selection_descriptions + smoothing)
    if (chosen := parse_smoothing_filter(filter)) is not None:
        filter = f"{chosen.kind} {chosen.averaging_time_or_frequency!r}"
    if earlier is not None:
        processing = earlier.processing + processing
        earlier = replace(earlier, name=name or earlier.name, filter=filter or earlier.filter)
        return replace(earlier, columns=values, processing=processing)
    name = name or _derive_record_name_from_source(source)
    return Record(values, name, processing=processing, filter=filter)


def _convert_to_record_units(
    column_name: str, columns_of_source: ColumnsReadFromSource
) -> np.ndarray:
    """Return the values of a column in the units of a ``Record``."""
    column = columns_of_source.columns_by_name[column_name]
    try:
        return column.values * compute_factor_to_record_units(column_name, column.units)
    except InvalidValue as error:
        if not column.one_based_column_number:
            raise
        place = (
            f"{columns_of_source.source_table.heading_location}, column "
            f"{column.one_based_column_number}"
        )
        raise error.with_location(place) from error


def _check_required_columns(columns_of_source: ColumnsReadFromSource) -> None:
    """Raise ``InvalidValue`` if a required column of a record is missing."""
    names, table = columns_of_source.columns_by_name, columns_of_source.source_table
    moved = {"displacement", "slip"} & {*names}
    rubbed = {"friction", "shear_stress"} & {*names}
    if not ("time" in names and moved):
        rule = "has no recognised headings for time and displacement (or slip)"
        if rubbed and ("time" in names or moved):
            rule += (
                ", which every record must contain. If the time or the displacement was not "
                "recorded, use rsfstudy.events"
            )
        raise build_missing_columns_error(table, rule)
    if not rubbed:
        raise build_missing_columns_error(
            table, "has no recognised heading for friction or shear stress"
        )


def _add_derived_columns(
    values_by_column: dict[str, np.ndarray], normal_stress: Any, stiffness: Any
) -> None:
    """Add the columns normal stress, friction and load point displacement."""
    if normal_stress is not None and "normal_stress" not in values_by_column:
        stated = convert_to_si("normal_stress", normal_stress, "Pa")
        values_by_column["normal_stress"] = np.full(len(values_by_column["time"]), stated)
    if "friction" not in values_by_column:
        stress = values_by_column.get("normal_stress")
        if stress is None:
            rule = f"has no column for normal stress (columns: {', '.join(values_by_column)})"
            remedy = (
                "Pass the normal stress, for example --normal-stress '20 MPa' (in Python, "
                "normal_stress='20 MPa')."
            )
            raise InvalidValue("the record", ..., rule, remedy=remedy)
        check_normal_stress_is_positive(stress)
        values_by_column["friction"] = values_by_column["shear_stress"] / stress
    if "displacement" not in values_by_column:
        values_by_column["displacement"] = _compute_load_point_displacement(
            values_by_column, stiffness
        )


def check_normal_stress_is_positive(normal_stress: np.ndarray) -> None:
    """Raise an error if the normal stress of a record is not positive.

    Parameters
    ----------
    normal_stress : ndarray, shape (rows,)
        Normal stress in Pa.

    Raises
    ------
    InvalidValue
        If the normal stress of a row is not positive. If all rows are negative, the error message
        explains how to reverse the sign.
    """
    if (normal_stress > 0.0).all():
        return
    row = int(np.argmax(~(normal_stress > 0.0)))
    rule = f"must be positive, but is not positive in row {row + 1}"
    remedy = ""
    if (normal_stress < 0.0).all():
        rule = "must be positive, but is negative in all rows"
        remedy = (
            "Compression is positive in rsfstudy. To reverse the sign, multiply the column by -1: "
            "--columns 'normal_stress=HEADING * -1' (in Python, "
            "columns={'normal_stress': 'HEADING * -1'})."
        )
    raise InvalidValue("normal_stress", float(normal_stress[row]), rule, remedy=remedy)


def _derive_record_name_from_source(source: Any) -> str:
    """Convert the name of a file to a valid Python identifier."""
    stem = Path(source).stem if isinstance(source, str | Path) else "record"
    text = re.sub(r"\W", "_", stem, flags=re.ASCII)
    return text if text.isidentifier() else f"record_{text}"


def _compute_load_point_displacement(
    values_by_column: dict[str, np.ndarray], stiffness: Any
) -> np.ndarray:
    """Compute load point displacement in um from slip, friction and stiffness.

    The load point displacement is the slip plus the shear stress divided by the stiffness. For a
    stiffness in units of friction divided by displacement, the shear stress is replaced by the
    friction.
    """
    if stiffness is None:
        remedy = (
            "Pass the stiffness that was used for the elastic correction: read_record(..., "
            "stiffness="
        )
        remedy += "'0.05 MPa/um'), or --stiffness."
        rule = (
            "requires a stiffness, because the load point displacement is the sum of the slip and "
            "of the ratio of shear stress to stiffness"
        )
        raise InvalidValue("slip", ..., rule, remedy=remedy)
    friction, stress = values_by_column["friction"], values_by_column.get("normal_stress")
    is_number = isinstance(stiffness, int | float)
    over_stress = is_number or is_stiffness_in_friction_per_length(stiffness)
    if is_number:
        per_um = float(stiffness)
    else:
        per_um = convert_to_si("stiffness", stiffness, "1/m" if over_stress else "Pa/m") * 1e-6
    if not per_um > 0.0:
        raise InvalidValue("stiffness", stiffness, "must be positive")
    if over_stress:
        return np.asarray(values_by_column["slip"] + friction / per_um)
    if stress is None:
        remedy = (
            "Pass the normal stress with --normal-stress (in Python, normal_stress=), or pass the "
            "stiffness in 1/um."
        )
        raise InvalidValue("stiffness", stiffness, "requires a normal stress", remedy=remedy)
    return np.asarray(values_by_column["slip"] + friction * stress / per_um)
