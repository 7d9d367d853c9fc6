"""Functions that read the answers of other codes from tables.

The headings and units of a table may differ from the headings and units that the problem specifies.
The function ``read_external_answer`` converts the columns to SI units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.referee import reference_answers
from rsfstudy.referee.benchmark_problem_files import BenchmarkProblem
from rsfstudy.rig import Column, convert_to_si, read_table

#: Names and units of substitute quantities, keyed by requested quantities. A file may contain the
#: substitute quantity instead of the requested quantity.
_EQUIVALENT_AND_UNITS_BY_QUANTITY = {
    "slip_rate": ("log10_slip_rate", "1"),
    "friction": ("shear_stress", "Pa"),
}
_UNITS_BY_EQUIVALENT_QUANTITY = dict(_EQUIVALENT_AND_UNITS_BY_QUANTITY.values())
#: Tolerance for comparing times, relative to the last time. The tolerance is necessary because
#: times in files are rounded.
_RTOL_FOR_MATCHING_ANSWER_TIMES = 1e-9
#: Largest allowed value of an answer in SI units. The ratio of larger values could overflow.
_MAX_ACCEPTED_ANSWER_VALUE_IN_SI = 1e100


class ReportedQuantity(NamedTuple):
    """Quantity that another code reports.

    Parameters
    ----------
    si_values : ndarray, shape (n,)
        Values in SI units.
    si_value_of_last_decimal_place : float
        One unit in the last decimal place of the values, in SI units. The attribute is 0 if all
        values are zero, or if the quantity was computed from another quantity.
    """

    si_values: np.ndarray
    si_value_of_last_decimal_place: float


def read_external_answer(
    path: Path, problem: BenchmarkProblem, column_by_quantity: Mapping[str, str] | None = None
) -> dict[str, ReportedQuantity]:
    """Read the columns that a problem requests, in SI units.

    Parameters
    ----------
    path : Path
        Path of the table.
    problem : BenchmarkProblem
        Problem that the table answers.
    column_by_quantity : mapping of str to str, optional
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
        number of rows or the times differ from those of the problem.
    DataError
        If the file cannot be read.
    """
    table = read_table(path, column_by_quantity)
    # The number of rows is checked first, because the conversion of columns uses the times of the
    # problem.
    rows, count = (
        problem.answer_index_values,
        max((len(column.values) for column in table.values()), default=0),
    )
    if count != len(rows):
        remedy = (
            f"Write one row for each {problem.answer_index_column_name} of the problem. "
            "Rows are not "
            "interpolated."
        )
        rule = f"must be {len(rows)}"
        wrong = InvalidValue(
            "number of rows", count, rule, remedy=remedy if problem.answer_index_column_name else ""
        )
        raise wrong.with_location(str(path))
    asked = {*problem.answer_column_names, *_UNITS_BY_EQUIVALENT_QUANTITY}
    found = {
        key: _convert_column_to_si(key, column, problem)
        for key, column in table.items()
        if key in asked
    }
    for name, (other, _units) in _EQUIVALENT_AND_UNITS_BY_QUANTITY.items():
        # With radiation damping, the slip rate is required to convert shear stress to friction.
        waits = name == "friction" and problem.radiation_damping and "slip_rate" not in found
        if (
            name in problem.si_units_by_quantity
            and name not in found
            and other in found
            and not waits
        ):
            found[name] = ReportedQuantity(
                _derive_from_reported_equivalent(name, problem, found), 0.0
            )
    for name in reversed(problem.answer_column_names):
        if name not in found:
            remedy = (
                f"Use the heading {name} ({problem.si_units_by_quantity[name]}), or pass --columns "
                f"'{name}=...'."
            )
            wrong = InvalidValue("column", name, "is missing", choices=table, remedy=remedy)
            raise wrong.with_location(str(path))
    if problem.answer_index_column_name:
        _check_times_or_peak_numbers(
            table[problem.answer_index_column_name],
            found[problem.answer_index_column_name].si_values,
            rows,
            problem,
        )
    return {name: found[name] for name in problem.answer_column_names}


def _derive_from_reported_equivalent(
    quantity_name: str,
    problem: BenchmarkProblem,
    reported_quantities: Mapping[str, ReportedQuantity],
) -> np.ndarray:
    r"""Compute a requested quantity from an equivalent reported quantity.

    The slip rate is computed from its decimal logarithm. The friction coefficient is computed from
    the shear stress :math:`\tau` of the spring as :math:`\mu = (\tau - \eta V)/\sigma`.
    """
    if quantity_name == "slip_rate":
        return np.asarray(10.0 ** reported_quantities["log10_slip_rate"].si_values)
    radiated = (
        problem.radiation_damping * reported_quantities["slip_rate"].si_values
        if problem.radiation_damping
        else 0.0
    )
    return np.asarray(
        (reported_quantities["shear_stress"].si_values - radiated)
        / reference_answers.compute_effective_normal_stress_series(problem)
    )


def _convert_column_to_si(
    quantity_name: str, column: Column, problem: BenchmarkProblem
) -> ReportedQuantity:
    """Convert a column to SI units."""
    units = (
        problem.si_units_by_quantity.get(quantity_name)
        or _UNITS_BY_EQUIVALENT_QUANTITY[quantity_name]
    )
    one = "1" if column.units in ("", "1") else f"1 {column.units}"
    if units != "1" and one == "1":
        remedy = (
            "Add the units in parentheses to the heading, or pass --columns "
            f"'{quantity_name}=... ({units})'."
        )
        raise InvalidValue(
            quantity_name, column.units, "has no units", remedy=remedy
        ).with_location(column.file_path)
    try:
        factor = convert_to_si(quantity_name, 1.0 if one == "1" else one, units)
    except InvalidValue as error:
        raise error.with_location(column.file_path) from error
    most = (
        math.log10(_MAX_ACCEPTED_ANSWER_VALUE_IN_SI)
        if quantity_name == "log10_slip_rate"
        else _MAX_ACCEPTED_ANSWER_VALUE_IN_SI / factor
    )
    column.raise_for_invalid_values(
        quantity_name, ~(np.abs(column.values) <= most), f"must be a number of at most {most:g}"
    )
    return ReportedQuantity(column.values * factor, factor * _find_last_place_unit(column.values))


def _find_last_place_unit(values: np.ndarray) -> float:
    """Return the size of one unit in the last decimal place of the given numbers.

    The result is 1 if all numbers are integers, and 0 if all numbers are zero.
    """
    exponents = [Decimal(repr(x)).normalize().as_tuple().exponent for x in values.tolist() if x]
    return float(10.0 ** min(0, *map(int, exponents))) if exponents else 0.0


def _check_times_or_peak_numbers(
    column: Column, values: np.ndarray, expected_values: np.ndarray, problem: BenchmarkProblem
) -> None:
    """Check that the index column has the values that the problem specifies.

    Raises
    ------
    InvalidValue
        If a value differs, for example because the file contains values at other times.
    """
    wrong = (
        np.abs(values - expected_values)
        > _RTOL_FOR_MATCHING_ANSWER_TIMES * np.abs(expected_values).max()
    )
    wanted = (
        f"{expected_values[np.argmax(wrong)]:g} "
        f"{problem.si_units_by_quantity[problem.answer_index_column_name]}"
    )
    column._replace(values=values).raise_for_invalid_values(
        problem.answer_index_column_name,
        wrong,
        f"must be {wanted}, because rows are not interpolated",
    )
