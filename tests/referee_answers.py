"""``python tests/referee_answers.py [NUMBER ...]`` writes the answers of the referee, with the
digits that two ways agree on (a quarter of an hour for all).
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import mpmath
from referee_numbers import first_way, second_way
from referee_ways import PROBLEMS, AsStated, InLogarithms, agrees, by, stated

UNITS = {
    "time": "s", "event": "1", "friction": "1", "slip_rate": "m/s", "slip": "m", "theta": "s",
    "theta_1": "s", "theta_2": "s", "normal_stress": "Pa", "pore_pressure": "Pa",
    "critical_stiffness": "Pa/m", "growth_rate": "1/s", "angular_frequency": "1/s",
    "critical_velocity": "m/s", "critical_displacement": "m", "recurrence_interval": "s",
    "peak_slip_rate": "m/s", "slowest_slip_rate": "m/s",
}  # fmt: skip


def both_ways(problem: dict[str, Any]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    return by_first(problem), by_second(problem)


def by_first(problem: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of an answer, with 30 digits."""
    return [first_way(problem)] if problem["report"] == "numbers" else by(AsStated, problem)


def by_second(problem: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of an answer, in double precision."""
    return [second_way(problem)] if problem["report"] == "numbers" else by(InLogarithms, problem)


def columns(problem: dict[str, Any]) -> list[str]:
    key = {"series": ["time"], "peaks": ["event"], "numbers": []}[problem["report"]]
    return [*key, *problem["quantities"]]


def text(name: str, value: Any, problem: dict[str, Any]) -> str:
    """A number with as many digits as the problem has; what says which row it is, as it is."""
    if name == columns(problem)[0] and problem["report"] != "numbers":
        return f"{float(value):.12g}"
    if value == 0:
        return "0"
    digits = problem["digits"]
    return mpmath.nstr(mpmath.mpf(value), digits, strip_zeros=False, min_fixed=0, max_fixed=0)


def write(path: Path) -> None:
    problem = stated(path)
    names = columns(problem)
    first, second = both_ways(problem)
    rows = [[text(name, row[name], problem) for name in names] for row in first]
    for row, other in zip(rows, second, strict=True):
        for name, told in zip(names, row, strict=True):
            if not agrees(told, other[name]) and name not in ("event",):
                print("  differ:", path.stem, name, told, other[name])
    with path.with_suffix(".csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([f"{name} ({UNITS[name]})" for name in names])
        table.writerows(rows)
    print(path.stem, flush=True)


if __name__ == "__main__":
    mpmath.mp.dps = 30
    for each in sorted(PROBLEMS.glob("*.toml")):
        if len(sys.argv) == 1 or each.name[:2] in sys.argv[1:]:
            write(each)
