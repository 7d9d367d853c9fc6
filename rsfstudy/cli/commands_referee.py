"""Implementation of the commands ``problems`` and ``verify``.

The commands check other codes with the benchmark problems of ``rsfstudy.referee``.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from rsfstudy.cli import assignment_parsing, printed_reports
from rsfstudy.cli.console import stdout_console
from rsfstudy.cli.options import CommandOptions
from rsfstudy.errors import InvalidValue
from rsfstudy.referee import (
    AnswerComparison,
    compare_file_with_known_answer,
    summarise_comparisons,
    write_problems,
)


def problems(options: CommandOptions) -> int:
    """Write all benchmark problems to a directory.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    count = write_problems(options.directory)
    stdout_console.print(f"wrote {count} problems into {options.directory}")
    return printed_reports.EXIT_STATUS_OK


def verify(options: CommandOptions) -> int:
    """Compare solution files with the reference solutions.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    InvalidValue
        If the number of digits is NaN or the assignment of columns is malformed.
    """
    if math.isnan(options.digits):  # click accepts NaN for any range
        raise InvalidValue("--digits", options.digits, "must be a number, from 1 to 12")
    columns = assignment_parsing.parse_column_assignments(options.columns)
    problem = options.problem or ""
    found = [
        compare_file_with_known_answer(file, problem, columns, options.digits)
        for file in options.files
    ]
    for file, one in zip(options.files, found, strict=True):
        _print_verdict(file, one)
    stdout_console.print(summarise_comparisons(found), style="bold")
    if options.figure is not None:
        _write_agreement_figure(found, options.figure)
    return (
        printed_reports.EXIT_STATUS_OK
        if all(one.has_required_digits for one in found)
        else printed_reports.EXIT_STATUS_FAILED
    )


def _print_verdict(answer_file: Path, comparison: AnswerComparison) -> None:
    """Print the agreement of each quantity, and a possible cause of differences."""
    problem = comparison.problem
    name = f"problem {problem.number}" if problem.number else f"known to {problem.digits} digits"
    outcome = "passed" if comparison.has_required_digits else "not passed"
    stdout_console.print(f"{answer_file}: {problem.title} ({name}): {outcome}", style="bold")
    for line in comparison.describe_agreements():
        stdout_console.print(line)
    if not comparison.has_required_digits:
        unexplained = "no usual difference of conventions explains it"
        stdout_console.print(f"  {comparison.explanation_of_disagreement or unexplained}")


def _write_agreement_figure(comparisons: list[AnswerComparison], figure_path: Path) -> None:
    """Draw the number of agreeing digits of each quantity.

    If a single file is compared and its problem has an index column, the abscissa is the index.
    Otherwise the abscissa is the number of the problem.
    """
    from rsfstudy.plots import draw_agreement, style_context

    digits: dict[str, list[tuple[float, float]]] = {}
    problem, label = comparisons[0].problem, "problem"
    if len(comparisons) == 1 and problem.index_column:
        label = f"{problem.index_column} ({problem.quantity_units[problem.index_column]})"
        for one in comparisons[0].quantity_agreements:
            along = -np.log10(np.maximum(one.relative_differences, 10.0**-problem.digits))
            digits[one.quantity_name] = list(zip(problem.index_values, along, strict=True))
    else:
        for number, verdict_of in enumerate(comparisons, start=1):
            at = verdict_of.problem.number or number
            for one in verdict_of.quantity_agreements:
                digits.setdefault(one.quantity_name, []).append((at, one.agreeing_digits))
    with style_context(None):
        drawn = draw_agreement(digits, label, comparisons[0].required_digits)
    printed_reports.write_figure(drawn, figure_path)
