"""Laboratory records from text files, binary xlook files and arrays.

`read_record` is the main function.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rsfstudy.error_boundary import check_regular_file, error_boundary
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.fitting import RECORD_COLUMNS, Record
from rsfstudy.rig.rig_quantities import is_stiffness_over_normal_stress
from rsfstudy.rig.table_files import (
    HEADING_PATTERN,
    Column,
    ColumnSpec,
    check_heading_lengths,
    parse_column_spec,
    read_table,
    select_columns_of_arrays,
)
from rsfstudy.rig.units import compute_conversion_factor, convert_to_si

#: SI units of the columns of a record, and factors from SI units to the units of `Record`.
_UNITS_AND_FACTORS_OF_RECORD_COLUMNS = {
    "time": ("s", 1.0),
    "displacement": ("m", 1e6),
    "slip": ("m", 1e6),
    "friction": ("1", 1.0),
    "shear_stress": ("Pa", 1.0),
    "normal_stress": ("Pa", 1.0),
}
#: Units of columns in the examples of error messages. Columns that are not listed are in MPa.
_USUAL_UNITS_OF_RECORD_COLUMNS = {"time": "s", "displacement": "um", "slip": "um"}
#: For each column, the pattern that matches the start of common headings.
_PATTERNS_OF_USUAL_HEADINGS = {
    "time": r"t(ime)?\b|time",
    "displacement": r"(load.*)?disp|lp(\b|_?disp)|l\.?p\.? disp|load.?point",
    "slip": r"(fault.*)?slip",
    "friction": r"fric|mu\b|coeff",
    "shear_stress": r"shear|tau",
    "normal_stress": r"(eff\w*[ _])?norm|sigma",
}
#: Layout of xlook files. The constants are the size of the file header in bytes, the size of each
#: column header in bytes, and the number of column headers. The data of an xlook file follow the
#: headers.
_XLOOK_HEADER_BYTES, _XLOOK_COLUMN_HEADER_BYTES, _XLOOK_MAX_COLUMNS = 36, 84, 32
_XLOOK_DATA_START_BYTE = _XLOOK_HEADER_BYTES + _XLOOK_COLUMN_HEADER_BYTES * _XLOOK_MAX_COLUMNS


@error_boundary
def read_record(
    source: Any,
    columns: Mapping[str, Any] | None = None,
    *,
    normal_stress: Any = None,
    stiffness: Any = None,
    name: str = "",
) -> Record:
    """Read a record of an experiment.

    Pass the result to `rsfstudy.fit`.

    Parameters
    ----------
    source : str, Path, mapping or pandas.DataFrame
        Path of a text file, a CSV file or a binary xlook file, or a mapping of names to arrays. The
        names are ``time``, ``displacement`` (of the load point), ``friction`` or ``shear_stress``,
        and optionally ``normal_stress``. By default, arrays are in s, um and MPa, and times may
        have the type `numpy.datetime64` or `numpy.timedelta64`. If the names contain units, for
        example ``LP disp (um)``, the names are interpreted as the headings of a file.
    columns : mapping of str to str or tuple, optional
        Heading and units of each column, for example ``{"time": "t (s)", "friction": "mu"}`` or
        ``{"time": ("t", "s")}``. By default, common headings are recognised by their first letters,
        and must contain units, as in ``Displ (um)``. Columns of xlook files are selected by their
        headings or numbers. For raw data, add a scale and an offset, as in ``"LP (um) * 0.1 + 5"``
        or ``("LP", "um", 0.1, 5)``.
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

    Returns
    -------
    Record
        Record with columns in s, um, 1 and Pa.

    Raises
    ------
    DataError
        If the file does not exist.
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
    for key in columns or ():
        _check_column_name(key)
    if isinstance(source, str | Path):
        check_regular_file("record", source)
        if not Path(source).exists():
            raise DataError(f"there is no file {source}")
        binary = _is_binary(Path(source))
        found = (
            _read_xlook_columns(Path(source), columns)
            if binary
            else _read_text_columns(Path(source), columns)
        )
    elif isinstance(source, Mapping | pd.DataFrame):
        found = _read_array_columns(source, columns)
    else:
        remedy = "Give the path of a file, a mapping of arrays, or a DataFrame."
        raise InvalidValue("record", source, "is no record", remedy=remedy)
    values = {}
    for key, column in found.items():
        _check_column_name(key)
        column.check_values(key, ~np.isfinite(column.values), "must be a finite number")
        values[key] = column.values * _find_factor_to_record_units(key, column.units)
    return _build_record(values, normal_stress, stiffness, name or _record_name_from_source(source))


def _check_column_name(column_name: str) -> None:
    if column_name not in _UNITS_AND_FACTORS_OF_RECORD_COLUMNS:
        raise InvalidValue(
            "column", column_name, "is unknown", choices=_UNITS_AND_FACTORS_OF_RECORD_COLUMNS
        )


def _record_name_from_source(source: Any) -> str:
    """Convert the name of a file to a valid Python identifier."""
    stem = Path(source).stem if isinstance(source, str | Path) else "record"
    text = re.sub(r"\W", "_", stem, flags=re.ASCII)
    return text if text.isidentifier() else f"record_{text}"


def _find_factor_to_record_units(column_name: str, units: str) -> float:
    """Compute the factor that converts a column to the units of `Record`.

    Columns without units are in s, um and MPa.
    """
    si, ours = _UNITS_AND_FACTORS_OF_RECORD_COLUMNS[column_name]
    if not units:
        return {"Pa": 1e6}.get(si, 1.0)
    if si == "1" and units in ("1", "-"):
        return 1.0
    return float(compute_conversion_factor(column_name, units, si)) * ours


def _compute_load_point_displacement(
    record_values: dict[str, np.ndarray], stiffness: Any
) -> np.ndarray:
    """Compute load point displacement in um from slip, friction and stiffness.

    The load point displacement is the slip plus the shear stress divided by the stiffness. For a
    stiffness in units of friction divided by displacement, the shear stress is replaced by the
    friction.
    """
    if stiffness is None:
        remedy = "Give the stiffness that the correction used: read_record(..., stiffness="
        remedy += "'0.05 MPa/um'), or --stiffness."
        rule = "needs a stiffness: the load point moves by slip plus shear stress over stiffness"
        raise InvalidValue("slip", "given without displacement", rule, remedy=remedy)
    friction, stress = record_values["friction"], record_values.get("normal_stress")
    is_number = isinstance(stiffness, int | float)
    over_stress = is_number or is_stiffness_over_normal_stress(stiffness)
    if is_number:
        per_um = float(stiffness)
    else:
        per_um = convert_to_si("stiffness", stiffness, "1/m" if over_stress else "Pa/m") * 1e-6
    if not per_um > 0.0:
        raise InvalidValue("stiffness", stiffness, "must be positive")
    if over_stress:
        return np.asarray(record_values["slip"] + friction / per_um)
    if stress is None:
        remedy = "Give --normal-stress (normal_stress=), or stiffness in 1/um."
        raise InvalidValue("stiffness", stiffness, "needs a normal stress", remedy=remedy)
    return np.asarray(record_values["slip"] + friction * stress / per_um)


def _build_record(
    record_values: dict[str, np.ndarray], normal_stress: Any, stiffness: Any, name: str
) -> Record:
    if normal_stress is not None and "normal_stress" not in record_values:
        stated = convert_to_si("normal_stress", normal_stress, "Pa")
        record_values["normal_stress"] = np.full(len(record_values["time"]), stated)
    if "friction" not in record_values:
        if "shear_stress" not in record_values:
            rule = "tells no friction: it needs friction, or shear_stress"
            raise InvalidValue("record", [*record_values], rule)
        stress = record_values.get("normal_stress")
        if stress is None:
            remedy = "Give --normal-stress (normal_stress=), as in '20 MPa'."
            raise InvalidValue("record", [*record_values], "tells no normal stress", remedy=remedy)
        if not (stress > 0.0).all():
            row = int(np.argmax(~(stress > 0.0)))
            rule = f"must be positive, and is not in row {row + 1}"
            raise InvalidValue("normal_stress", float(stress[row]), rule)
        record_values["friction"] = record_values["shear_stress"] / stress
    if "displacement" not in record_values and "slip" in record_values:
        record_values["displacement"] = _compute_load_point_displacement(record_values, stiffness)
    return Record(
        {q.name: record_values[q.name] for q in RECORD_COLUMNS if q.name in record_values}, name
    )


def _read_text_columns(path: Path, columns: Mapping[str, Any] | None) -> Mapping[str, Column]:
    """Read the selected columns of a text file, or columns with common headings."""

    def select(headings: list[str], place: str) -> dict[str, ColumnSpec]:
        told = _add_required_columns_by_usual_headings(columns or {}, headings, place)
        return {key: _parse_column_selection(key, of, headings) for key, of in told.items()}

    return read_table(path, select)


def _read_array_columns(source: Any, columns: Mapping[str, Any] | None) -> Mapping[str, Column]:
    """Select arrays by their names, or by headings with units."""
    headings = [*map(str, source)]
    check_heading_lengths(headings, "record")
    if columns is None and not any("(" in key or "[" in key for key in headings):
        return select_columns_of_arrays(source, {key: (key,) for key in headings})
    told = _add_required_columns_by_usual_headings(columns or {}, headings, "record")
    return select_columns_of_arrays(
        source, {key: _parse_column_selection(key, of, headings) for key, of in told.items()}
    )


def _add_required_columns_by_usual_headings(
    selected_columns: Mapping[str, Any], headings: list[str], file_description: str
) -> dict[str, Any]:
    """Add required columns that have common headings to the selected columns."""
    lacking = {"time", "displacement", "slip"} - set(selected_columns)
    if not {"friction", "shear_stress"} & set(selected_columns):
        lacking |= {"friction", "shear_stress", "normal_stress"} - set(selected_columns)
    wanted = dict(selected_columns)
    for key in _PATTERNS_OF_USUAL_HEADINGS:
        if key in lacking and not (key == "shear_stress" and "friction" in wanted):
            wanted |= _find_column_with_usual_heading(key, headings, file_description)
    if "displacement" in wanted and "slip" not in selected_columns:
        wanted.pop("slip", None)
    if "time" not in wanted or not {"displacement", "slip"} & set(wanted):
        remedy = (
            "Say which is which: --columns 'time=t (s),displacement=lp (um),friction=mu', or "
            "columns={'time': 't (s)', 'displacement': 'lp (um)', 'friction': 'mu'}."
        )
        rule = "does not name time and displacement (or slip)"
        raise InvalidValue("header", ", ".join(headings)[:200], rule, remedy=remedy).with_location(
            file_description
        )
    return wanted


def _find_column_with_usual_heading(
    column_name: str, headings: list[str], file_description: str
) -> dict[str, str]:
    """Find the column with a common heading for a quantity.

    If several headings match, headings with compatible units take precedence. Among headings with
    compatible units, a heading that is equal to the name of the quantity takes precedence. The
    function raises an error if several columns are still possible.
    """
    parts = {text: match for text in headings if (match := HEADING_PATTERN.fullmatch(text))}
    meant = [
        text
        for text, m in parts.items()
        if re.match(_PATTERNS_OF_USUAL_HEADINGS[column_name], m[1], re.IGNORECASE)
    ]
    meant = [
        text for text in meant if _has_compatible_units(column_name, parts[text][2] or "")
    ] or meant
    meant = [text for text in meant if parts[text][1] == column_name] or meant
    if len(meant) > 1:
        remedy = (
            f"Say which, as in --columns '{column_name}={meant[-1]}' "
            f"(columns={{'{column_name}': ...}})."
        )
        rule = "may be any of several columns"
        raise InvalidValue("column", column_name, rule, choices=meant, remedy=remedy).with_location(
            file_description
        )
    return {column_name: meant[0]} if meant else {}


def _has_compatible_units(column_name: str, units: str) -> bool:
    """Return True if the units are compatible with the quantity of a column."""
    try:
        return _find_factor_to_record_units(column_name, units) > 0.0
    except InvalidValue:
        return False


def _parse_column_selection(
    column_name: str, column_specification: Any, headings: Sequence[str]
) -> ColumnSpec:
    """Parse the selection of a column, and check that it contains units.

    The units of friction may be omitted, but the units of other columns are required.
    """
    found = parse_column_spec(column_specification, headings)
    if not found.units and column_name != "friction" and isinstance(column_specification, str):
        whole = f"{found.heading} ({_USUAL_UNITS_OF_RECORD_COLUMNS.get(column_name, 'MPa')})"
        remedy = (
            f"Write them in the file, as in {whole}, or here: --columns "
            f"'{column_name}={whole},...' "
        )
        remedy += f"(columns={{'{column_name}': '{whole}', ...}})."
        raise InvalidValue("heading", column_specification, "states no units", remedy=remedy)
    return found


def _is_binary(path: Path) -> bool:
    """Return True if the beginning of a file contains a null byte."""
    try:
        with path.open("rb") as file:
            return b"\0" in file.read(_XLOOK_DATA_START_BYTE)
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from error


def _read_xlook_columns(path: Path, columns: Mapping[str, Any] | None) -> Mapping[str, Column]:
    """Read the columns of a binary xlook file.

    The file is big-endian. The file contains a file header, column headers of 84 bytes each, and
    one float32 array per column. The column ``time`` of xlook files contains sampling intervals,
    which the function sums.
    """
    data = path.read_bytes()
    if len(data) < _XLOOK_DATA_START_BYTE:
        raise DataError(f"{path}: ends within the headers of an xlook file")
    used = int.from_bytes(data[24:28], "big")
    if not 0 < used <= _XLOOK_MAX_COLUMNS:
        raise DataError(f"{path}: states {used} columns, which no xlook file has")
    headings, begin, found = [], _XLOOK_DATA_START_BYTE, {}
    for number in range(used):
        header = data[
            _XLOOK_HEADER_BYTES + _XLOOK_COLUMN_HEADER_BYTES * number : _XLOOK_HEADER_BYTES
            + _XLOOK_COLUMN_HEADER_BYTES * (number + 1)
        ]
        heading, units = (
            part.split(b"\0")[0].decode("ascii", "replace").strip()
            for part in (header[:13], header[13:26])
        )
        count = int.from_bytes(header[80:84], "big")
        if begin + 4 * count > len(data):
            raise DataError(f"{path}: ends within column {number + 1}, {heading!r}")
        values = np.frombuffer(data, ">f4", count, begin).astype(float)
        headings.append((heading, units, values))
        begin += 4 * count
    if columns is None:
        names = ", ".join(f"{n}: {h} ({u})" for n, (h, u, _v) in enumerate(headings, start=1))
        remedy = f"Name them by --columns (columns=). It holds {names}."
        raise InvalidValue("columns", None, "are needed for a file of xlook", remedy=remedy)
    known = [heading for heading, _units, _values in headings]
    for key, told in columns.items():
        heading, units, scale, offset = _parse_column_selection(key, told, known)
        places = [n for n, h in enumerate(known, 1) if heading in (str(n), h)]
        if len(places) != 1:
            raise InvalidValue("column", heading, f"heads {len(places)} columns", choices=known)
        values = headings[places[0] - 1][2] * scale + offset
        found[key] = Column(np.cumsum(values) if key == "time" else values, units, places[0])
    shortest = min(len(column.values) for column in found.values())
    if any(len(column.values) - shortest > 1 for column in found.values()):
        rule = "have lengths that differ by more than one"
        raise InvalidValue("columns", [*found], rule).with_location(str(path))
    return {key: column._replace(values=column.values[:shortest]) for key, column in found.items()}
