"""Functions that find the columns of a record by common headings.

The functions ``read_record``, ``events`` and ``history`` use different columns of the same files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.rig.readers import read_table_from_source
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable
from rsfstudy.rig.table_columns import (
    HEADING_PATTERN,
    Column,
    ColumnSelection,
    parse_column_selection,
)
from rsfstudy.rig.units import compute_conversion_factor

#: SI units of the columns of a record, and factors from SI units to the units of `Record`.
SI_UNITS_AND_FACTOR_FROM_SI_BY_COLUMN = {
    "time": ("s", 1.0),
    "displacement": ("m", 1e6),
    "slip": ("m", 1e6),
    "friction": ("1", 1.0),
    "shear_stress": ("Pa", 1.0),
    "normal_stress": ("Pa", 1.0),
    "velocity": ("m/s", 1e6),
    "pore_pressure": ("Pa", 1.0),
}
#: Units of columns in the examples of error messages. Columns that are not listed are in MPa.
_EXAMPLE_UNITS_BY_COLUMN = {"time": "s", "displacement": "um", "slip": "um", "velocity": "um/s"}
#: Spellings of the unit of dimensionless columns.
_SPELLINGS_OF_DIMENSIONLESS_UNIT = ("1", "-", ".", "none")
#: Columns that can replace a column, indexed by the name of the replaced column.
_SUBSTITUTE_COLUMN_BY_COLUMN_NAME = {
    "displacement": "slip",
    "slip": "displacement",
    "friction": "shear_stress",
    "shear_stress": "friction",
}
#: Patterns that match the start of common headings, indexed by column name.
_COMMON_HEADING_PATTERN_BY_COLUMN = {
    "time": r"t(ime)?\b|time|zeit|temps|tiempo|tempo",
    "displacement": r"(load.*)?disp|lp(\b|_?disp)|l\.?p\.? disp|load.?point",
    "slip": r"(fault.*)?slip",
    "friction": r"fric|mu\b|coeff|\u00b5$|\u03bc$",
    "shear_stress": r"shear|shr|tau|(shear.*)?force",
    "normal_stress": r"(eff\w*[ _])?nor|sigma",
    "velocity": r"(load.*)?vel",
    "pore_pressure": r"pore|p_?p\b",
}


class AcceptedRecordColumns(NamedTuple):
    """Columns accepted by a function that reads records.

    Parameters
    ----------
    column_names : tuple of str
        Names of the columns, in the order of the search. The function searches the headings for
        each column. The columns ``slip`` and ``displacement`` are alternatives, and so are
        ``shear_stress`` and ``friction``. If the function has found one column of a pair, it does
        not search for the other column.
    skips_normal_stress_if_shear_stress : bool, default: False
        If True, the function does not search for ``normal_stress`` after it has found
        ``shear_stress``.
    """

    column_names: tuple[str, ...]
    skips_normal_stress_if_shear_stress: bool = False


def compute_factor_to_record_units(column_name: str, units: str) -> float:
    """Compute the factor that converts a column to the units of `Record`.

    Parameters
    ----------
    column_name : str
        Name of the column.
    units : str
        Units of the column. Columns without units are in s, um, um/s and MPa.

    Returns
    -------
    float
        Conversion factor.

    Raises
    ------
    InvalidValue
        If the units are not compatible with the column.
    """
    si, ours = SI_UNITS_AND_FACTOR_FROM_SI_BY_COLUMN[column_name]
    if not units:
        return {"Pa": 1e6}.get(si, 1.0)
    if si == "1" and units in _SPELLINGS_OF_DIMENSIONLESS_UNIT:
        return 1.0
    return float(compute_conversion_factor(column_name, units, si)) * ours


def read_selected_and_detected_columns(
    table: LazyTable,
    selected_columns: Mapping[str, Any] | None,
    accepted_columns: AcceptedRecordColumns,
) -> dict[str, Column]:
    """Read the selected columns, and detect other columns by their headings.

    Parameters
    ----------
    table : LazyTable
        Table with all columns.
    selected_columns : mapping of str to str or tuple, or None
        Heading and units of columns by name. If the value is None and the arrays in memory have no
        units, all columns are read.
    accepted_columns : AcceptedRecordColumns
        Columns that the calling function can use.

    Returns
    -------
    dict of str to Column
        Columns by name, with their units.

    Raises
    ------
    InvalidValue
        If the name of a column is unknown, if a selected column does not exist, if the headings of
        several columns match the same usable column, or if a column has no units.
    """
    for name in selected_columns or ():
        _check_column_name_is_known(name, accepted_columns.column_names)
    if selected_columns is None and table.headings_are_column_names:
        for name in table.headings:
            _check_column_name_is_known(name, accepted_columns.column_names)
        return {name: table.read_column(name, ColumnSelection(name)) for name in table.headings}
    found = dict(selected_columns or {})
    # If the user selects a column of friction or shear stress, the column of normal stress is used
    # only if the user selects it too.
    has_stress = not {"friction", "shear_stress"}.isdisjoint(found)
    for name in accepted_columns.column_names if table.has_headings else ():
        if name == "normal_stress" and (
            has_stress
            or (accepted_columns.skips_normal_stress_if_shear_stress and "shear_stress" in found)
        ):
            continue
        if name not in found and _SUBSTITUTE_COLUMN_BY_COLUMN_NAME.get(name) not in found:
            found |= _find_column_with_common_heading(name, table)
    headings = dict.fromkeys(table.headings)
    return {
        name: _read_column_with_units(table, name, selection, headings)
        for name, selection in found.items()
    }


def _check_column_name_is_known(column_name: str, known_names: Sequence[str]) -> None:
    if column_name not in known_names:
        raise InvalidValue("column", column_name, "is unknown", choices=known_names)


def _read_column_with_units(
    table: LazyTable, column_name: str, column_selection: Any, headings: Mapping[str, Any]
) -> Column:
    """Read a column, and check that it has units.

    The units of friction may be omitted, but the units of other columns are required.
    """
    spec = parse_column_selection(column_selection, headings)
    index = table.find_column_index(spec.heading)
    stated = spec.units or table.parse_units_of_heading(index)
    if not (stated or table.columns_have_no_units or column_name == "friction") and isinstance(
        column_selection, str
    ):
        column = table.read_column(column_name, spec)
        if column.units:  # The type of the values implies the units.
            return column
        whole = f"{spec.heading} ({_EXAMPLE_UNITS_BY_COLUMN.get(column_name, 'MPa')})"
        remedy = (
            f"Add the units in parentheses to the heading in the file, for example {whole}, or "
            f"pass the units with --columns '{column_name}={whole},...' "
        )
        remedy += f"(in Python, columns={{'{column_name}': '{whole}', ...}})."
        raise InvalidValue("heading", column_selection, "has no units", remedy=remedy)
    return table.read_column(column_name, spec)


def has_time_column(source: Any) -> bool:
    """Return True if a table has a column with a common heading for time.

    Parameters
    ----------
    source : str, Path or object
        File or object that contains the table, as for ``read_record``.

    Returns
    -------
    bool
        True if the table is a record. A protocol contains durations or distances instead of times.
    """
    return bool(_find_column_with_common_heading("time", read_table_from_source(source)))


def _find_column_with_common_heading(column_name: str, table: LazyTable) -> dict[str, str]:
    """Find the column with a common heading for a quantity.

    If several headings match, headings with compatible units take precedence. Among headings with
    compatible units, a heading that is equal to the name of the quantity takes precedence. If
    several headings remain, the function raises an error.
    """
    parts = {text: match for text in table.headings if (match := HEADING_PATTERN.fullmatch(text))}
    meant = [
        text
        for text, m in parts.items()
        if re.match(_COMMON_HEADING_PATTERN_BY_COLUMN[column_name], m[1], re.IGNORECASE)
    ]
    meant = [
        text for text in meant if _has_compatible_units(column_name, parts[text][2] or "")
    ] or meant
    meant = [text for text in meant if parts[text][1] == column_name] or meant
    if len(meant) > 1:
        remedy = (
            f"Select one of them, for example --columns '{column_name}={meant[-1]}' "
            f"or, in Python, columns={{'{column_name}': '{meant[-1]}'}}."
        )
        rule = f"matches several headings: {', '.join(map(repr, meant))}"
        raise InvalidValue("column", column_name, rule, remedy=remedy).with_location(
            table.heading_location
        )
    return {column_name: meant[0]} if meant else {}


def _has_compatible_units(column_name: str, units: str) -> bool:
    """Return True if the units are compatible with the quantity of a column."""
    try:
        return compute_factor_to_record_units(column_name, units) > 0.0
    except InvalidValue:
        return False


def build_missing_columns_error(table: LazyTable, rule: str) -> InvalidValue:
    """Return the error for a table without the required columns.

    Parameters
    ----------
    table : LazyTable
        Table with all columns.
    rule : str
        Sentence that names the missing columns.

    Returns
    -------
    InvalidValue
        Error with the headings of the table, and an example of a selection.
    """
    if table.has_headings:
        shown = "t (s)", "lp (um)", "mu"
    else:
        shown = "1 (s)", "2 (um)", "3"
    remedy = (
        "If the columns have other headings, select them, for example --columns "
        f"'time={shown[0]},displacement={shown[1]},friction={shown[2]}' or, in Python, "
        f"columns={{'time': '{shown[0]}', 'displacement': '{shown[1]}', 'friction': '{shown[2]}'}}."
    )
    header = ", ".join(table.headings)[:200]
    if not table.has_headings:
        rule = f"has no headings, and {rule}"
        header = f"{len(table.headings)} columns without headings"
    return InvalidValue("header", header, rule, remedy=remedy).with_location(table.heading_location)


def check_column_values_are_finite(columns: Mapping[str, Column]) -> None:
    """Raise an error for the first value that is not finite.

    Parameters
    ----------
    columns : mapping of str to Column
        Columns by name.

    Raises
    ------
    InvalidValue
        If a value is not finite. The error message contains the location of the value.
    """
    for name, column in columns.items():
        column.raise_for_invalid_values(
            name, ~np.isfinite(column.values), "must be a finite number"
        )
