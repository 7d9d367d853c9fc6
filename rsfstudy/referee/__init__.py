"""Benchmark problems with known answers, and checks of other codes.

The package reads problem files and tables of answers, computes reference answers at two tolerances,
and counts the correct digits of the answers of another code. It never imports that code.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.referee.answer_comparison import (
        AnswerComparison,
        compare_answers,
        known_answer,
        round_digits_down,
    )
    from rsfstudy.referee.external import read_answer
    from rsfstudy.referee.problem_files import (
        BenchmarkProblem,
        read_problem,
        shipped_problems,
        write_problems,
    )
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "referee.answer_comparison": (
                "AnswerComparison",
                "compare_answers",
                "known_answer",
                "round_digits_down",
            ),
            "referee.external": ("read_answer",),
            "referee.problem_files": (
                "BenchmarkProblem",
                "read_problem",
                "shipped_problems",
                "write_problems",
            ),
        },
    )

__all__ = [
    "AnswerComparison",
    "BenchmarkProblem",
    "compare_answers",
    "known_answer",
    "read_answer",
    "read_problem",
    "round_digits_down",
    "shipped_problems",
    "write_problems",
]
