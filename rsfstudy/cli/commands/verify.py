"""Command ``rsfstudy verify``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import (
    EXIT_STATUS_FAILED,
    EXIT_STATUS_OK,
    CommandResult,
    print_result_as_text_or_json,
)
from rsfstudy.cli.printing import print_line
from rsfstudy.errors import InvalidValue

if TYPE_CHECKING:
    from rsfstudy.referee import AnswerComparison


@dataclass(frozen=True)
class VerifyCommandResult(CommandResult):
    """Comparison of solution files with the reference solutions."""

    benchmark_answer_files: Sequence[Path]
    benchmark_answer_comparisons: Sequence[AnswerComparison]

    @property
    def exit_status(self) -> int:
        """Exit status. The status is 1 if a file has too few correct digits."""
        passed = all(one.has_required_digits for one in self.benchmark_answer_comparisons)
        return EXIT_STATUS_OK if passed else EXIT_STATUS_FAILED

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        from rsfstudy.referee import summarise_answer_comparisons

        pairs = zip(self.benchmark_answer_files, self.benchmark_answer_comparisons, strict=True)
        return {
            "summary": summarise_answer_comparisons(self.benchmark_answer_comparisons),
            "files": [_convert_answer_comparison_to_json(file, one) for file, one in pairs],
        }


def _convert_answer_comparison_to_json(file: Path, comparison: AnswerComparison) -> dict[str, Any]:
    """Return the entry of the JSON output that describes one answer file."""
    problem = comparison.benchmark_problem
    index = problem.answer_index_values if problem.answer_index_column_name else None
    return {
        "file": file,
        "problem": problem.number or None,
        "title": problem.title,
        "passed": comparison.has_required_digits,
        "digits": comparison.agreeing_digits,
        "required_digits": comparison.required_digits,
        "reference_digits": problem.digits,
        "explanation": comparison.explanation_of_disagreement,
        "index_column": problem.answer_index_column_name or None,
        "quantities": [
            {
                "name": one.quantity_name,
                "digits": one.agreeing_digits,
                "agrees_to_written_digits": one.agrees_within_rounding_error,
                "least_agreeing_at": None if index is None else index[one.least_agreeing_row_index],
                "first_failing_at": None
                if index is None or one.first_failing_row_index is None
                else index[one.first_failing_row_index],
            }
            for one in comparison.quantity_agreements
        ],
    }


@click.command(cls=CommandWithOptionsObject)
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=options.PathParameterType()
)
@click.option(
    "--problem",
    metavar="N|TOML",
    help="Problem number, or a TOML file that defines a problem.  [default: number at the "
    "beginning of the file name]",
)
@click.option(
    "--columns",
    metavar="NAME=HEADING,...",
    help="Columns of the files, as a list of quantities and their column headings. Example: "
    "'time=t (s), friction=mu, slip_rate=v (um/s)'.  [default: headings in the files]",
)
@click.option(
    "--digits",
    type=click.FloatRange(1.0, 12.0),
    metavar="N",
    default=6.0,
    help="Minimum number of correct digits for a file to pass the check.",
)
@options.make_image_path_option(
    "--figure",
    None,
    "Draw a figure of the agreement between the solutions. The suffix of FILE must be "
    ".png, .pdf or .svg.",
)
@options.figure_style_options
@options.json_option
def verify(command_options: options.CommandOptions) -> int:
    """Compare the solutions of a different code with reference solutions.

    For each quantity, the command prints the number of correct digits. If the number of correct
    digits is too small in some rows, the command also prints the first of these rows and a possible
    explanation. The last line summarises all files. The exit status is 1 if a file does not pass.
    """
    from rsfstudy.cli import assignment_parsing
    from rsfstudy.referee import compare_file_with_known_answer

    if command_options.figure is None and (command_options.style, command_options.width) != (
        None,
        None,
    ):
        raise click.UsageError("--style and --width require a figure. Add --figure FILE.")
    if math.isnan(command_options.digits):  # Click accepts NaN for any range.
        raise InvalidValue("--digits", command_options.digits, "must be a number, from 1 to 12")
    columns = assignment_parsing.parse_column_assignments(command_options.columns)
    found = [
        compare_file_with_known_answer(
            file, command_options.problem or "", columns, command_options.digits
        )
        for file in command_options.files
    ]
    status = print_result_as_text_or_json(
        VerifyCommandResult(command_options.files, found),
        _print_verification,
        command_options.as_json,
    )
    if command_options.figure is not None:
        _write_agreement_figure(found, command_options)
    return status


def _print_verification(result: VerifyCommandResult) -> None:
    """Print the number of correct digits of each quantity, and reasons for disagreement."""
    from rsfstudy.referee import summarise_answer_comparisons

    for file, one in zip(
        result.benchmark_answer_files, result.benchmark_answer_comparisons, strict=True
    ):
        problem = one.benchmark_problem
        known = f"reference known to {problem.digits} digits"
        name = f"problem {problem.number}" if problem.number else known
        outcome = "passed" if one.has_required_digits else "not passed"
        print_line(f"{file}: {problem.title} ({name}): {outcome}", style="bold")
        for line in one.describe_agreements():
            print_line(line)
        if not one.has_required_digits:
            unexplained = "no common difference in conventions explains the disagreement"
            print_line(f"  {one.explanation_of_disagreement or unexplained}")
    print_line(summarise_answer_comparisons(result.benchmark_answer_comparisons), style="bold")


def _write_agreement_figure(
    answer_comparisons: Sequence[AnswerComparison], command_options: options.CommandOptions
) -> None:
    """Plot the number of correct digits of each quantity.

    For a single file whose problem has an index column, such as time, the digits are plotted
    against this column. Otherwise, the digits are plotted against the problem number.
    """
    import numpy as np

    from rsfstudy.cli.figure_files import write_figure
    from rsfstudy.plots import draw_agreement, style_context

    digits: dict[str, list[tuple[float, float]]] = {}
    problem, label = answer_comparisons[0].benchmark_problem, "problem"
    if len(answer_comparisons) == 1 and problem.answer_index_column_name:
        label = (
            f"{problem.answer_index_column_name} "
            f"({problem.si_units_by_quantity[problem.answer_index_column_name]})"
        )
        for one in answer_comparisons[0].quantity_agreements:
            along = -np.log10(np.maximum(one.relative_differences, 10.0**-problem.digits))
            digits[one.quantity_name] = list(zip(problem.answer_index_values, along, strict=True))
    else:
        for number, comparison in enumerate(answer_comparisons, start=1):
            at = comparison.benchmark_problem.number or number
            for one in comparison.quantity_agreements:
                digits.setdefault(one.quantity_name, []).append((at, one.agreeing_digits))
    with style_context(command_options.style, command_options.width):
        drawn = draw_agreement(digits, label, answer_comparisons[0].required_digits)
    write_figure(drawn, command_options.figure, command_options.style)
