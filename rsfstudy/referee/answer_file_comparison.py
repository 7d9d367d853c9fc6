"""Functions that compare the output files of other codes with known answers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from rsfstudy.errors import InvalidValue
from rsfstudy.formatting import format_count_with_noun
from rsfstudy.referee.answer_comparison import (
    AnswerComparison,
    compare_answers,
    read_or_compute_known_answer,
)
from rsfstudy.referee.benchmark_problem_files import find_shipped_problem_files, read_problem
from rsfstudy.referee.external_answers import read_external_answer


def compare_file_with_known_answer(
    file: Path,
    problem_number_or_path: str,
    column_by_quantity: Mapping[str, str] | None,
    required_digits: float,
) -> AnswerComparison:
    """Compare the output file of another code with a known answer.

    Parameters
    ----------
    file : Path
        Table with the columns that the problem requests.
    problem_number_or_path : str
        Number of a shipped problem, or path of a problem file. If the string is empty, the first
        two characters of the file name are the number of the problem.
    column_by_quantity : mapping of str to str, or None
        Heading and units of the columns in the file, as for ``rsfstudy.read_table``. If the
        argument is None, the first line of the file must contain the names of the columns.
    required_digits : float
        Number of correct digits that the answer needs to pass.

    Returns
    -------
    AnswerComparison
        Agreement of each quantity with the known answer.

    Raises
    ------
    InvalidValue
        If the problem does not exist, or if the file does not contain the requested columns.
    DataError
        If a file cannot be read.
    """
    number, there, path = (
        problem_number_or_path or file.name[:2],
        find_shipped_problem_files(),
        None,
    )
    if problem_number_or_path and not number.isdecimal():
        posed = read_problem(Path(number))
    elif number.isdecimal() and int(number) in there:
        posed = read_problem(there[int(number)])
        path = there[int(number)].with_suffix(".csv")
    else:
        remedy = (
            "Pass --problem, or use a file name that starts with the number, such as 01_mine.csv."
        )
        raise InvalidValue(
            "problem",
            number,
            "is unknown",
            choices=map(str, there),
            remedy=remedy,
        )
    told = read_external_answer(file, posed, column_by_quantity)
    return compare_answers(*read_or_compute_known_answer(posed, path), told, required_digits)


def summarise_answer_comparisons(answer_comparisons: Sequence[AnswerComparison]) -> str:
    """Summarise the comparisons of several files in one line.

    Parameters
    ----------
    answer_comparisons : sequence of AnswerComparison
        Comparison of each file.

    Returns
    -------
    str
        Summary such as "9 problems of 24, 9 to 10 digits". Only problems that passed are counted.
    """
    passed = {
        one.benchmark_problem.title: math.floor(one.agreeing_digits)
        for one in answer_comparisons
        if one.has_required_digits
    }
    own = all(one.benchmark_problem.number == 0 for one in answer_comparisons)
    kind = "user-defined problem" if own else "problem"
    text = format_count_with_noun(len(passed), kind) + (
        "" if own else f" of {len(find_shipped_problem_files())}"
    )
    if not passed:
        return text
    low, high = min(passed.values()), max(passed.values())
    return f"{text}, {low} to {high} digits" if low < high else f"{text}, {low} digits"
