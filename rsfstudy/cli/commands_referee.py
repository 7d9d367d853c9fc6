"""What the commands `problems` and `verify` do, which check other codes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from rsfstudy.cli import assignments, printing
from rsfstudy.cli.console import console
from rsfstudy.cli.options import CommandOptions
from rsfstudy.errors import InvalidValue
from rsfstudy.referee import (
    AnswerComparison,
    compare_file,
    summarise_comparisons,
    write_problems,
)


def problems(given: CommandOptions) -> int:
    """Write all problems."""
    count = write_problems(given.directory)
    console.print(f"wrote {count} problems into {given.directory}")
    return printing.OK


def verify(given: CommandOptions) -> int:
    """Hold files against answers; FAILED where one does not pass."""
    if math.isnan(given.digits):  # which click finds in every range
        raise InvalidValue("--digits", given.digits, "must be a number, from 1 to 12")
    columns = assignments.parse_columns(given.columns)
    problem = given.problem or ""
    found = [compare_file(file, problem, columns, given.digits) for file in given.files]
    for file, one in zip(given.files, found, strict=True):
        _print_verdict(file, one)
    console.print(summarise_comparisons(found), style="bold")
    if given.figure is not None:
        _draw_agreement(found, given.figure)
    return printing.OK if all(one.passes for one in found) else printing.FAILED


def _print_verdict(file: Path, one: AnswerComparison) -> None:
    """Print how far each quantity agrees, and what would explain it."""
    problem = one.problem
    name = f"problem {problem.number}" if problem.number else f"known to {problem.digits} digits"
    outcome = "passed" if one.passes else "not passed"
    console.print(f"{file}: {problem.title} ({name}): {outcome}", style="bold")
    for line in one.describe_agreements():
        console.print(line)
    if not one.passes:
        console.print(f"  {one.explanation or 'no usual difference of conventions explains it'}")


def _draw_agreement(found: list[AnswerComparison], path: Path) -> None:
    """Digits along the rows of one problem, or by problem."""
    from rsfstudy.plots import draw_agreement, style_context

    digits: dict[str, list[tuple[float, float]]] = {}
    problem, label = found[0].problem, "problem"
    if len(found) == 1 and problem.index_column:
        label = f"{problem.index_column} ({problem.units[problem.index_column]})"
        for one in found[0].agreements:
            along = -np.log10(np.maximum(one.relative_differences, 10.0**-problem.digits))
            digits[one.quantity] = list(zip(problem.index_values, along, strict=True))
    else:
        for number, verdict_of in enumerate(found, start=1):
            at = verdict_of.problem.number or number
            for one in verdict_of.agreements:
                digits.setdefault(one.quantity, []).append((at, one.digits))
    with style_context(None):
        drawn = draw_agreement(digits, label, found[0].required_digits)
    printing.write_figure(drawn, path)
