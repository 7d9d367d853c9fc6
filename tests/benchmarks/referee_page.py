"""Generator of the problem descriptions on the referee page.

Run ``python tests/benchmarks/referee_page.py`` to update the page.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from second_referee_way import PROBLEMS, read_stated_problem

PAGE = Path(__file__).parents[2] / "studies" / "pages" / "referee.md"
PROBLEMS_MARKER = "<!-- problems: written by tests/benchmarks/referee_page.py -->\n"


def problem_section(number: int, problem: dict[str, Any]) -> str:
    """Return the section of a problem."""
    initial = problem.get("initial")
    begins = [f"{n}(0) = {_plain(value)}" for n, value in (initial or {}).items()]
    lines = [
        f"### {number}. {problem['title']}",
        "",
        *(f"    {line}" for line in problem["equations"].splitlines()),
        "",
        " ".join(problem["conventions"].split()),
        "",
        *_table(problem["parameters"]),
        "",
        f"- Beginning: {', '.join(begins) or 'steady sliding at V_*'}.",
    ]
    if "loading" in problem:
        lines.append(f"- Load point: {'; then '.join(map(_segment, problem['loading']))}.")
    return "\n".join([*lines, f"- Report: {_report(problem)}.", ""])


def _table(parameters: dict[str, Any]) -> list[str]:
    """Return the lines of a table with one column per parameter."""
    cells = [[f"`{name}`" for name in parameters], ["---"] * len(parameters)]
    cells.append([_plain(value) for value in parameters.values()])
    return [f"| {' | '.join(row)} |" for row in cells]


def _plain(value: Any) -> str:
    return ", ".join(value) if isinstance(value, list) else str(value)


def _segment(segment: dict[str, str]) -> str:
    text = f"V_0 = {segment['velocity']}"
    if "normal_stress" in segment:
        text += f", normal stress {segment['normal_stress']}"
    return text + (f" for {segment['duration']}" if "duration" in segment else "")


def _report(problem: dict[str, Any]) -> str:
    names = ", ".join(problem["quantities"])
    if problem["report"] == "series":
        times = problem["times"]
        return f"{names} at {len(times)} times from {times[0]:g} to {times[-1]:g} s"
    if problem["report"] == "peaks":
        return f"{names} of the first {problem['count']} maxima of slip rate"
    return names


def all_sections() -> str:
    """Return the sections of all problems."""
    files = sorted(PROBLEMS.glob("*.toml"))
    return "\n".join(
        problem_section(int(file.name[:2]), read_stated_problem(file)) for file in files
    )


if __name__ == "__main__":
    before = PAGE.read_text().partition(PROBLEMS_MARKER)[0]
    PAGE.write_text(before + PROBLEMS_MARKER + "\n" + all_sections())
