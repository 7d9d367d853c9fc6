"""Answers of other codes: tables of any names and units, read as a problem asks for it."""

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

#: What a code may tell instead of a quantity, and in which units.
_SUBSTITUTES = {"slip_rate": ("log10_slip_rate", "1"), "friction": ("shear_stress", "Pa")}
_SUBSTITUTE_UNITS = dict(_SUBSTITUTES.values())
#: Times may differ by so much, over the last: they are written in decimals.
_TIME_RTOL = 1e-9
#: In SI units; beyond it are overflows, whose ratios overflow too.
_MAX_VALUE = 1e100


class ReportedQuantity(NamedTuple):
    """A quantity of another code in SI units, and one in the last place that is written."""

    values: np.ndarray
    resolution: float


def read_answer(
    path: Path, problem: BenchmarkProblem, columns: Mapping[str, str] | None = None
) -> dict[str, ReportedQuantity]:
    """The columns that a problem asks for, in SI units.

    Raises
    ------
    InvalidValue
        For a column that is missing, units of another kind, a gap, other times or another length.
    """
    table = read_table(path, columns)
    # first, because columns are converted at the times of the problem
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
        # what waves carry away takes a slip rate
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
    """A quantity by what is told instead: friction by the shear stress of the spring, over normal
    stress at the times of the problem.
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
    """A column in SI units."""
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
    """One in the last place of the numbers; 0 where none has one, and 1 of whole numbers."""
    exponents = [Decimal(repr(x)).normalize().as_tuple().exponent for x in values.tolist() if x]
    return float(10.0 ** min(0, *map(int, exponents))) if exponents else 0.0


def _check_rows(
    column: Column, values: np.ndarray, expected: np.ndarray, problem: BenchmarkProblem
) -> None:
    wrong = np.abs(values - expected) > _TIME_RTOL * np.abs(expected).max()
    wanted = f"{expected[np.argmax(wrong)]:g} {problem.units[problem.index_column]}"
    column._replace(values=values).check_values(
        problem.index_column, wrong, f"must be {wanted}: nothing is interpolated"
    )
