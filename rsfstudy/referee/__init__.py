"""Benchmark problems with known answers for checking other codes.

The package ``rsfstudy.referee`` reads problem files and the answers of other codes, and counts the
correct digits of an answer. For a user-defined problem, rsfstudy computes the known answer twice,
with two different integration tolerances. The package never imports another code.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.referee.answer_comparison import AnswerComparison
    from rsfstudy.referee.answer_file_comparison import (
        compare_file_with_known_answer,
        summarise_answer_comparisons,
    )
    from rsfstudy.referee.benchmark_problem_files import write_shipped_problems
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "referee.answer_comparison": ("AnswerComparison",),
            "referee.benchmark_problem_files": ("write_shipped_problems",),
            "referee.answer_file_comparison": (
                "compare_file_with_known_answer",
                "summarise_answer_comparisons",
            ),
        },
    )

__all__ = [
    "AnswerComparison",
    "compare_file_with_known_answer",
    "summarise_answer_comparisons",
    "write_shipped_problems",
]
