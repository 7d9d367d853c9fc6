"""Tables with the answers of other codes.

The headings and units of a table may differ from the headings and units of the problem. The
function ``read_answer`` converts the columns to SI units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.referee import reference
from rsfstudy.referee.problem_files import BenchmarkProblem
from rsfstudy.rig import Column, convert_to_si, read_table

#: Quantities that a file may contain instead of a requested quantity, and their units.
_SUBSTITUTES = {"slip_rate": ("log10_slip_rate", "1"), "friction": ("shear_stress", "Pa")}
_SUBSTITUTE_UNITS = dict(_SUBSTITUTES.values())
#: Tolerance of times, relative to the last time. The times in files are rounded to some decimals.
_TIME_RTOL = 1e-9
#: Largest allowed value in SI units. Larger values would cause an overflow in ratios.
_MAX_VALUE = 1e100


class ReportedQuantity(NamedTuple):
    """Quantity that another code reports.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values in SI units.
    resolution : float
        One unit in the last decimal place of the values, in SI units. The resolution is 0 if all
        values are zero, or if the quantity was computed from another quantity.
    """

    values: np.ndarray
    resolution: float


def read_answer(
    path: Path, problem: BenchmarkProblem, columns: Mapping[str, str] | None = None
) -> dict[str, ReportedQuantity]:
    """Read the columns that a problem requests, in SI units.

    Parameters
    ----------
    path : Path
        Path of the table.
    problem : BenchmarkProblem
        Problem that the table answers.
    columns : mapping of str to str, optional
        Heading and units of the columns in the file, as for ``rsfstudy.read_table``. By default,
        the first line of the file must contain the names of the columns.

    Returns
    -------
    dict of str to ReportedQuantity
        Requested quantities by name.

    Raises
    ------
    InvalidValue
        If a column is missing, if units have the wrong dimension, if a value is missing, or if the
        number of rows or the times differ from the problem.
    DataError
        If the file cannot be read.
    """
    table = read_table(path, columns)
    # The number of rows is checked first, because the conversion of columns uses the times of the
    # problem.
    rows, count = (
        problem.index_values,
        max((len(column.values) for column in table.values()), default=0),
    )
    if count != len(rows):
        remedy = (
            f"Give a row for each {problem.index_column} of the problem. Rows are not interpolated."
        )
        rule = f"must be {len(rows)}"
        wrong = InvalidValue(
            "number of rows", count, rule, remedy=remedy if problem.index_column else ""
        )
        raise wrong.with_location(str(path))
    asked = {*problem.columns, *_SUBSTITUTE_UNITS}
    found = {
        key: _convert_column(key, column, problem) for key, column in table.items() if key in asked
    }
    for name, (other, _units) in _SUBSTITUTES.items():
        # With radiation damping, the slip rate is required to convert shear stress to friction.
        waits = name == "friction" and problem.radiation_damping and "slip_rate" not in found
        if name in problem.units and name not in found and other in found and not waits:
            found[name] = ReportedQuantity(_derive_quantity(name, problem, found), 0.0)
    for name in reversed(problem.columns):
        if name not in found:
            remedy = f"Head it {name} ({problem.units[name]}), or say --columns '{name}=...'."
            wrong = InvalidValue("column", name, "is missing", choices=table, remedy=remedy)
            raise wrong.with_location(str(path))
    if problem.index_column:
        _check_rows(table[problem.index_column], found[problem.index_column].values, rows, problem)
    return {name: found[name] for name in problem.columns}


def _derive_quantity(
    name: str, problem: BenchmarkProblem, found: Mapping[str, ReportedQuantity]
) -> np.ndarray:
    r"""Compute a requested quantity from its substitute.

    The slip rate is computed from its decimal logarithm. The friction coefficient is computed from
    the shear stress :math:`\tau` of the spring as :math:`\mu = (\tau - \eta V)/\sigma`.
    """
    if name == "slip_rate":
        return np.asarray(10.0 ** found["log10_slip_rate"].values)
    radiated = (
        problem.radiation_damping * found["slip_rate"].values if problem.radiation_damping else 0.0
    )
    return np.asarray(
        (found["shear_stress"].values - radiated) / reference.compute_normal_stress(problem)
    )


def _convert_column(key: str, column: Column, problem: BenchmarkProblem) -> ReportedQuantity:
    """Convert a column to SI units."""
    units = problem.units.get(key) or _SUBSTITUTE_UNITS[key]
    one = "1" if column.units in ("", "1") else f"1 {column.units}"
    if units != "1" and one == "1":
        remedy = f"Write them in the header, or --columns '{key}=... ({units})'."
        raise InvalidValue(key, column.units, "has no units", remedy=remedy).with_location(
            column.path
        )
    try:
        factor = convert_to_si(key, 1.0 if one == "1" else one, units)
    except InvalidValue as error:
        raise error.with_location(column.path) from error
    most = math.log10(_MAX_VALUE) if key == "log10_slip_rate" else _MAX_VALUE / factor
    column.check_values(
        key, ~(np.abs(column.values) <= most), f"must be a number, of {most:g} at most"
    )
    return ReportedQuantity(column.values * factor, factor * _find_resolution(column.values))


def _find_resolution(values: np.ndarray) -> float:
    """Return one unit in the last decimal place of the numbers.

    The resolution of whole numbers is 1. If all numbers are zero, the result is 0.
    """
    exponents = [Decimal(repr(x)).normalize().as_tuple().exponent for x in values.tolist() if x]
    return float(10.0 ** min(0, *map(int, exponents))) if exponents else 0.0


def _check_rows(
    column: Column, values: np.ndarray, expected: np.ndarray, problem: BenchmarkProblem
) -> None:
    """Check that the index column has the values of the problem.

    Raises
    ------
    InvalidValue
        If a value differs, for example because the file contains other times.
    """
    wrong = np.abs(values - expected) > _TIME_RTOL * np.abs(expected).max()
    wanted = f"{expected[np.argmax(wrong)]:g} {problem.units[problem.index_column]}"
    column._replace(values=values).check_values(
        problem.index_column, wrong, f"must be {wanted}: nothing is interpolated"
    )
