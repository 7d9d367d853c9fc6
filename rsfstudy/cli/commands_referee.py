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
    BenchmarkProblem,
    compare_answers,
    known_answer,
    read_answer,
    read_problem,
    round_digits_down,
    shipped_problems,
    write_problems,
)


def problems(given: CommandOptions) -> int:
    """Write all problems."""
    write_problems(given.directory)
    console.print(f"wrote {len(shipped_problems())} problems into {given.directory}")
    return printing.OK


def verify(given: CommandOptions) -> int:
    """Hold files against answers; FAILED where one does not pass."""
    if math.isnan(given.digits):  # which click finds in every range
        raise InvalidValue("--digits", given.digits, "must be a number, from 1 to 12")
    found = [_judge_file(file, given) for file in given.files]
    for file, one in zip(given.files, found, strict=True):
        _print_verdict(file, one)
    console.print(_quotable_summary(found), style="bold")
    if given.figure is not None:
        _draw_agreement(found, given.figure)
    return printing.OK if all(one.passes for one in found) else printing.FAILED


def _judge_file(file: Path, given: CommandOptions) -> AnswerComparison:
    number, there, path = given.problem or file.name[:2], shipped_problems(), None
    if given.problem and not number.isdecimal():
        posed = read_problem(Path(number))
    elif number.isdecimal() and int(number) in there:
        posed = read_problem(there[int(number)])
        path = there[int(number)].with_suffix(".csv")
    else:
        remedy = "Give --problem, or a file name that begins with it, as in 01_mine.csv."
        raise InvalidValue("problem", number, "is none", choices=map(str, there), remedy=remedy)
    columns = assignments.parse_columns(given.columns)
    told = read_answer(file, posed, columns)
    return compare_answers(*known_answer(posed, path), told, given.digits)


def _print_verdict(file: Path, one: AnswerComparison) -> None:
    """Print how far each quantity agrees, and what would explain it."""
    problem = one.problem
    name = f"problem {problem.number}" if problem.number else f"known to {problem.digits} digits"
    outcome = "passed" if one.passes else "not passed"
    console.print(f"{file}: {problem.title} ({name}): {outcome}", style="bold")
    for agreement in one.agreements:
        text = f"  {agreement.quantity:20s} {round_digits_down(agreement.digits):4.1f} digits"
        if agreement.agrees_as_written:
            text += ", to the last place that is written"
        elif agreement.digits == problem.digits:
            text += ", all that are known"
        elif problem.index_column:
            text += f", fewest at {_format_row(problem, agreement.worst_row)}"
        if agreement.first_failing_row is not None and problem.index_column:
            text += f"; they part at {_format_row(problem, agreement.first_failing_row)}"
        console.print(text)
    if not one.passes:
        console.print(f"  {one.explanation or 'no usual difference of conventions explains it'}")


def _format_row(problem: BenchmarkProblem, row: int) -> str:
    units = {"time": " s"}.get(problem.index_column, "")
    return f"{problem.index_column} = {problem.index_values[row]:g}{units}"


def _quotable_summary(found: list[AnswerComparison]) -> str:
    """One line to quote."""
    passed = {one.problem.title: math.floor(one.digits) for one in found if one.passes}
    own = all(one.problem.number == 0 for one in found)
    of = "one's own" if own else f"{len(shipped_problems())}"
    text = f"{len(passed)} problem{'s' * (len(passed) != 1)} of {of}"
    if not passed:
        return text
    low, high = min(passed.values()), max(passed.values())
    return f"{text}, {low} to {high} digits" if low < high else f"{text}, {low} digits"


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
