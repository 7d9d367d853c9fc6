"""What the commands `problems` and `verify` do, which check other codes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from rsfstudy.cli import assignments, terminal
from rsfstudy.cli.console import console
from rsfstudy.cli.options import Given
from rsfstudy.errors import InvalidValue
from rsfstudy.referee import theirs
from rsfstudy.referee.problem import Problem, read, shipped, write
from rsfstudy.referee.verdict import Verdict, known, shown_digits, verdict


def problems(given: Given) -> int:
    """Write all problems."""
    write(given.directory)
    console.print(f"wrote {len(shipped())} problems into {given.directory}")
    return terminal.OK


def verify(given: Given) -> int:
    """Hold files against answers; FAILED where one does not pass."""
    if math.isnan(given.digits):  # which click finds in every range
        raise InvalidValue("--digits", given.digits, "must be a number, from 1 to 12")
    found = [_verdict(file, given) for file in given.files]
    for file, one in zip(given.files, found, strict=True):
        _tell(file, one)
    console.print(_to_quote(found), style="bold")
    if given.figure is not None:
        _draw(found, given.figure)
    return terminal.OK if all(one.passes for one in found) else terminal.FAILED


def _verdict(file: Path, given: Given) -> Verdict:
    number, there, path = given.problem or file.name[:2], shipped(), None
    if given.problem and not number.isdecimal():
        posed = read(Path(number))
    elif number.isdecimal() and int(number) in there:
        posed = read(there[int(number)])
        path = there[int(number)].with_suffix(".csv")
    else:
        remedy = "Give --problem, or a file name that begins with it, as in 01_mine.csv."
        raise InvalidValue("problem", number, "is none", choices=map(str, there), remedy=remedy)
    columns = assignments.columns(given.columns)
    told = theirs.read(file, posed, columns)
    return verdict(*known(posed, path), told, given.digits)


def _tell(file: Path, one: Verdict) -> None:
    """Print how far each quantity agrees, and what would explain it."""
    problem = one.problem
    name = f"problem {problem.number}" if problem.number else f"known to {problem.digits} digits"
    outcome = "passed" if one.passes else "not passed"
    console.print(f"{file}: {problem.title} ({name}): {outcome}", style="bold")
    for agreement in one.agreements:
        text = f"  {agreement.quantity:20s} {shown_digits(agreement.digits):4.1f} digits"
        if agreement.to_the_last_place:
            text += ", to the last place that is written"
        elif agreement.digits == problem.digits:
            text += ", all that are known"
        elif problem.key:
            text += f", fewest at {_place(problem, agreement.row)}"
        if agreement.parts is not None and problem.key:
            text += f"; they part at {_place(problem, agreement.parts)}"
        console.print(text)
    if not one.passes:
        console.print(f"  {one.explanation or 'no usual difference of conventions explains it'}")


def _place(problem: Problem, row: int) -> str:
    units = {"time": " s"}.get(problem.key, "")
    return f"{problem.key} = {problem.rows[row]:g}{units}"


def _to_quote(found: list[Verdict]) -> str:
    """One line to quote."""
    passed = {one.problem.title: math.floor(one.digits) for one in found if one.passes}
    own = all(one.problem.number == 0 for one in found)
    of = "one's own" if own else f"{len(shipped())}"
    text = f"{len(passed)} problem{'s' * (len(passed) != 1)} of {of}"
    if not passed:
        return text
    low, high = min(passed.values()), max(passed.values())
    return f"{text}, {low} to {high} digits" if low < high else f"{text}, {low} digits"


def _draw(found: list[Verdict], path: Path) -> None:
    """Digits along the rows of one problem, or by problem."""
    from rsfstudy.plots import styled
    from rsfstudy.plots._agreement import agreement

    digits: dict[str, list[tuple[float, float]]] = {}
    problem, label = found[0].problem, "problem"
    if len(found) == 1 and problem.key:
        label = f"{problem.key} ({problem.units[problem.key]})"
        for one in found[0].agreements:
            along = -np.log10(np.maximum(one.off, 10.0**-problem.digits))
            digits[one.quantity] = list(zip(problem.rows, along, strict=True))
    else:
        for number, verdict_of in enumerate(found, start=1):
            at = verdict_of.problem.number or number
            for one in verdict_of.agreements:
                digits.setdefault(one.quantity, []).append((at, one.digits))
    with styled(None):
        drawn = agreement(digits, label, found[0].enough)
    terminal.write_figure(drawn, path)
