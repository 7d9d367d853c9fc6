"""Comparison of a file of another code with the answer to its problem, and a summary of several."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from rsfstudy.errors import InvalidValue
from rsfstudy.referee.answer_comparison import AnswerComparison, compare_answers, known_answer
from rsfstudy.referee.external import read_answer
from rsfstudy.referee.problem_files import read_problem, shipped_problems


def compare_file(
    file: Path, stated_problem: str, columns: Mapping[str, str] | None, required_digits: float
) -> AnswerComparison:
    """Compare a file of another code with the answer to its problem.

    Parameters
    ----------
    file : Path
        Table with the columns that the problem asks for.
    stated_problem : str
        Number of a shipped problem, or path of a problem file. If empty, the file name begins with
        the number.
    columns : mapping of str to str, optional
        Columns of the file by name, as in ``read_table``.
    required_digits : float
        Digits that make a pass.

    Raises
    ------
    InvalidValue
        If there is no such problem, or if the file does not contain its columns.
    """
    number, there, path = stated_problem or file.name[:2], shipped_problems(), None
    if stated_problem and not number.isdecimal():
        posed = read_problem(Path(number))
    elif number.isdecimal() and int(number) in there:
        posed = read_problem(there[int(number)])
        path = there[int(number)].with_suffix(".csv")
    else:
        remedy = "Give --problem, or a file name that begins with it, as in 01_mine.csv."
        raise InvalidValue("problem", number, "is none", choices=map(str, there), remedy=remedy)
    told = read_answer(file, posed, columns)
    return compare_answers(*known_answer(posed, path), told, required_digits)


def summarise_comparisons(found: Sequence[AnswerComparison]) -> str:
    """One line to quote."""
    passed = {one.problem.title: math.floor(one.digits) for one in found if one.passes}
    own = all(one.problem.number == 0 for one in found)
    of = "one's own" if own else f"{len(shipped_problems())}"
    text = f"{len(passed)} problem{'s' * (len(passed) != 1)} of {of}"
    if not passed:
        return text
    low, high = min(passed.values()), max(passed.values())
    return f"{text}, {low} to {high} digits" if low < high else f"{text}, {low} digits"
