"""Answers of other codes: tables of any names and units, read as a problem asks for it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rsfstudy.errors import InvalidValue
from rsfstudy.referee import ours
from rsfstudy.referee.problem import Problem
from rsfstudy.rig.table import Column, read_table
from rsfstudy.rig.units import in_si

#: What a code may tell instead of a quantity, and in which units.
_INSTEAD = {"slip_rate": ("log10_slip_rate", "1"), "friction": ("shear_stress", "Pa")}
_UNITS = dict(_INSTEAD.values())
#: Times may differ by so much, over the last: they are written in decimals.
_LATE = 1e-9
#: In SI units; beyond it are overflows, whose ratios overflow too.
_LARGEST = 1e100


class Reported(NamedTuple):
    """A quantity of another code in SI units, and one in the last place that is written."""

    values: np.ndarray
    last_place: float


def read(
    path: Path, problem: Problem, columns: Mapping[str, str] | None = None
) -> dict[str, Reported]:
    """The columns that a problem asks for, in SI units.

    Raises
    ------
    InvalidValue
        For a column that is missing, units of another kind, a gap, other times or another length.
    """
    table = read_table(path, columns)
    # first, because columns are converted at the times of the problem
    rows, count = problem.rows, max((len(column.values) for column in table.values()), default=0)
    if count != len(rows):
        remedy = f"Give a row for each {problem.key} of the problem. Rows are not interpolated."
        rule = f"must be {len(rows)}"
        wrong = InvalidValue("number of rows", count, rule, remedy=remedy if problem.key else "")
        raise wrong.at(str(path))
    asked = {*problem.columns, *_UNITS}
    found = {key: _plain(key, column, problem) for key, column in table.items() if key in asked}
    for name, (other, _units) in _INSTEAD.items():
        # what waves carry away takes a slip rate
        waits = name == "friction" and problem.damping and "slip_rate" not in found
        if name in problem.units and name not in found and other in found and not waits:
            found[name] = Reported(_instead(name, problem, found), 0.0)
    for name in reversed(problem.columns):
        if name not in found:
            remedy = f"Head it {name} ({problem.units[name]}), or say --columns '{name}=...'."
            wrong = InvalidValue("column", name, "is missing", choices=table, remedy=remedy)
            raise wrong.at(str(path))
    if problem.key:
        _check_rows(table[problem.key], found[problem.key].values, rows, problem)
    return {name: found[name] for name in problem.columns}


def _instead(name: str, problem: Problem, found: Mapping[str, Reported]) -> np.ndarray:
    """A quantity by what is told instead: friction by the shear stress of the spring, over normal
    stress at the times of the problem.
    """
    if name == "slip_rate":
        return np.asarray(10.0 ** found["log10_slip_rate"].values)
    radiated = problem.damping * found["slip_rate"].values if problem.damping else 0.0
    return np.asarray((found["shear_stress"].values - radiated) / ours.normal_stress(problem))


def _plain(key: str, column: Column, problem: Problem) -> Reported:
    """A column in SI units."""
    units = problem.units.get(key) or _UNITS[key]
    one = "1" if column.units in ("", "1") else f"1 {column.units}"
    if units != "1" and one == "1":
        remedy = f"Write them in the header, or --columns '{key}=... ({units})'."
        raise InvalidValue(key, column.units, "has no units", remedy=remedy).at(column.path)
    try:
        factor = in_si(key, 1.0 if one == "1" else one, units)
    except InvalidValue as error:
        raise error.at(column.path) from error
    most = math.log10(_LARGEST) if key == "log10_slip_rate" else _LARGEST / factor
    column.check(key, ~(np.abs(column.values) <= most), f"must be a number, of {most:g} at most")
    return Reported(column.values * factor, factor * _last_place(column.values))


def _last_place(values: np.ndarray) -> float:
    """One in the last place of the numbers; 0 where none has one, and 1 of whole numbers."""
    exponents = [Decimal(repr(x)).normalize().as_tuple().exponent for x in values.tolist() if x]
    return float(10.0 ** min(0, *map(int, exponents))) if exponents else 0.0


def _check_rows(column: Column, told: np.ndarray, rows: np.ndarray, problem: Problem) -> None:
    wrong = np.abs(told - rows) > _LATE * np.abs(rows).max()
    wanted = f"{rows[np.argmax(wrong)]:g} {problem.units[problem.key]}"
    column._replace(values=told).check(
        problem.key, wrong, f"must be {wanted}: nothing is interpolated"
    )
