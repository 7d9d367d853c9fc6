"""Agreement of two answers: to how many digits, from where on they part, what would explain it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rsfstudy.errors import RsfStudyError
from rsfstudy.motion import COMPILED, SCIPY, Accuracy, is_installed
from rsfstudy.referee import reference
from rsfstudy.referee.external import ReportedQuantity
from rsfstudy.referee.problem_files import BenchmarkProblem
from rsfstudy.referee.reference import AnswerTable
from rsfstudy.rig import read_table

#: Digits that make a problem passed, unless others are asked for.
DEFAULT_REQUIRED_DIGITS = 6
#: A candidate explains a difference if it leaves so many digits, and so many more than there were.
_MIN_EXPLAINED_DIGITS, _MIN_DIGITS_GAINED = 3.0, 1.5
#: Units in the last place by which what is written in decimals may differ: one of rounding in the
#: code, and half of rounding in the file, a little more for ours.
_MAX_LAST_PLACE_DIFFERENCE = 1.51
#: Of these, differences are told over the largest of the column: they begin at zero.
_QUANTITIES_FROM_ZERO = ("slip", "pore_pressure")
#: Conventions of radiation damping, and factors of eta.
_DAMPING_FACTORS = {
    "twice as much (G/c_s for G/(2 c_s))": 2.0,
    "half as much": 0.5,
    "left out": 0.0,
}
#: Factors between usual conventions: units, decades, angles, and kinds of logarithms.
_USUAL_FACTORS = {
    "2": 2.0, "0.5": 0.5, "pi": math.pi, "1/pi": 1.0 / math.pi, "2 pi": 2.0 * math.pi,
    "1/(2 pi)": 0.5 / math.pi, "ln 10": math.log(10.0), "1/ln 10": 1.0 / math.log(10.0),
    **{f"{unit:g}": unit for unit in (60.0, 3600.0, 86400.0)},
    **{f"1/{unit:g}": 1.0 / unit for unit in (60.0, 3600.0, 86400.0)},
    **{f"{10.0**power:g}": 10.0**power for power in range(-15, 16) if power},
}  # fmt: skip
#: Relative difference below which a factor is a usual one: of many values, and of a single value.
_FACTOR_RTOL, _SINGLE_VALUE_FACTOR_RTOL = 1e-6, 1e-3
#: Accuracies of ours where a problem has no answer yet; what candidates need.
_REFERENCE_RTOLS, _EXPLANATION_RTOL = (1e-9, 1e-11), 1e-8


@dataclass(frozen=True)
class Agreement:
    """Agreement of a quantity.

    Attributes
    ----------
    quantity : str
    digits : float
        To which all of it agrees, no more than are known.
    worst_row : int
        Where it agrees least.
    first_failing_row : int or None
        The first row that has fewer digits than make a pass.
    agrees_as_written : bool
        Whether it agrees as far as it is written.
    relative_differences : ndarray
        Relative differences.
    """

    quantity: str
    digits: float
    worst_row: int
    first_failing_row: int | None
    agrees_as_written: bool
    relative_differences: np.ndarray


@dataclass(frozen=True)
class AnswerComparison:
    """Agreement of an answer, and what would explain that it fails.

    Attributes
    ----------
    problem : BenchmarkProblem
    agreements : tuple of Agreement
    required_digits : float
        Digits that make a pass.
    explanation : str
        What would explain that it does not pass, or nothing.
    """

    problem: BenchmarkProblem
    agreements: tuple[Agreement, ...]
    required_digits: float
    explanation: str = ""

    @property
    def digits(self) -> float:
        """Digits to which all of it agrees."""
        return min(agreement.digits for agreement in self.agreements)

    @property
    def passes(self) -> bool:
        """True if every quantity has digits enough, or all that are known."""
        return self.digits >= min(self.required_digits, self.problem.digits)

    def describe_agreements(self) -> list[str]:
        """How far each quantity agrees, in one line for each."""
        problem, lines = self.problem, []
        for agreement in self.agreements:
            text = f"  {agreement.quantity:20s} {round_digits_down(agreement.digits):4.1f} digits"
            if agreement.agrees_as_written:
                text += ", to the last place that is written"
            elif agreement.digits == problem.digits:
                text += ", all that are known"
            elif problem.index_column:
                text += f", fewest at {_format_row(problem, agreement.worst_row)}"
            if agreement.first_failing_row is not None and problem.index_column:
                text += f"; they part at {_format_row(problem, agreement.first_failing_row)}"
            lines.append(text)
        return lines


def _format_row(problem: BenchmarkProblem, row: int) -> str:
    units = {"time": " s"}.get(problem.index_column, "")
    return f"{problem.index_column} = {problem.index_values[row]:g}{units}"


def known_answer(
    problem: BenchmarkProblem, path: Path | None
) -> tuple[BenchmarkProblem, AnswerTable]:
    """A problem and its answer: the one that is shipped; or ours, with the digits to which two
    motions of different accuracy agree.

    Raises
    ------
    RsfStudyError
        Where rsfstudy finds none.
    """
    if path is not None:
        table = read_table(path)
        return problem, {name: column.values for name, column in table.items()}
    engine = COMPILED if is_installed(COMPILED) else SCIPY
    rough, fine = (
        reference.compute_answer(problem, Accuracy(rtol, reference.WORK_BUDGET, engine=engine))
        for rtol in _REFERENCE_RTOLS
    )
    both = [a.digits for a in _compute_agreements(problem, rough, fine, 0.0)]
    return replace(problem, digits=max(1, math.floor(min(both)))), fine


def compare_answers(
    problem: BenchmarkProblem,
    answer: AnswerTable,
    reported: Mapping[str, ReportedQuantity],
    required_digits: float,
) -> AnswerComparison:
    """Agreement of what another code told with an answer, and what would explain a difference."""
    values = {name: column.values for name, column in reported.items()}
    places = {name: column.resolution for name, column in reported.items()}
    found = AnswerComparison(
        problem,
        _compute_agreements(problem, values, answer, required_digits, places),
        required_digits,
    )
    if found.passes:
        return found
    best, words = max(_iterate_explanations(problem, values, answer), default=(0.0, ""))
    better = best >= max(_MIN_EXPLAINED_DIGITS, found.digits + _MIN_DIGITS_GAINED)
    explanation = f"{words}. With that undone, {round_digits_down(best):.1f} digits agree"
    return replace(found, explanation=explanation if better else "")


def round_digits_down(digits: float) -> float:
    """Round a number of digits down to one decimal place.

    Rounding down ensures that a failed problem never displays enough digits to pass.
    """
    return math.floor(10.0 * digits) / 10.0


def _compute_agreements(
    problem: BenchmarkProblem,
    reported: AnswerTable,
    answer: AnswerTable,
    required_digits: float,
    resolutions: Mapping[str, float] | None = None,
) -> tuple[Agreement, ...]:
    found = []
    for name in problem.quantities:
        apart = _relative_differences(name, reported[name], answer[name], problem.digits)
        few = np.flatnonzero(apart > 10.0**-required_digits)
        place = (resolutions or {}).get(name, 0.0)
        found.append(
            Agreement(
                name,
                min(max(0.0, -math.log10(max(apart.max(), 1e-300))), float(problem.digits)),
                int(np.argmax(apart)),
                int(few[0]) if len(few) else None,
                bool(
                    (
                        np.abs(reported[name] - answer[name]) <= _MAX_LAST_PLACE_DIFFERENCE * place
                    ).all()
                ),
                apart,
            )
        )
    return tuple(found)


def _relative_differences(
    name: str, reported: np.ndarray, reference: np.ndarray, digits: int
) -> np.ndarray:
    """Differences of a quantity beyond what ours are rounded by, to so many digits, relative to
    each number.
    """
    size = np.abs(reference)
    rounded = 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(size, 1e-300))) + 1.0 - digits)
    scale = np.full(len(reference), size.max() or 1.0) if name in _QUANTITIES_FROM_ZERO else size
    return np.asarray(np.maximum(np.abs(reported - reference) - rounded, 0.0) / scale)


def _iterate_explanations(
    problem: BenchmarkProblem, reported: AnswerTable, answer: AnswerTable
) -> Iterator[tuple[float, str]]:
    """Digits to which what is told agrees with other conventions, and these."""
    for words, table in _reinterpret_answer(problem, reported, answer):
        yield min(a.digits for a in _compute_agreements(problem, table, answer, 0.0)), words
    for words, other in _reformulate_problem(problem):
        try:
            table = reference.compute_answer(
                other, Accuracy(_EXPLANATION_RTOL, reference.WORK_BUDGET)
            )
        except RsfStudyError:
            continue
        yield min(a.digits for a in _compute_agreements(problem, reported, table, 0.0)), words


def _reinterpret_answer(
    problem: BenchmarkProblem, reported: AnswerTable, answer: AnswerTable
) -> Iterator[tuple[str, AnswerTable]]:
    """Tables of what is told, read by other conventions, each with words for it."""
    shift, stress = sum(problem.b) * math.log(2.0), problem.rig.normal_stress
    if "friction" in reported:
        for sign, place in ((1.0, "left out of"), (-1.0, "left in")):
            moved = reported["friction"] + sign * shift
            words = f"friction is shifted by b ln 2, as where 2 D_c is {place} the logarithm"
            yield words, reported | {"friction": moved}
        if problem.radiation_damping and "slip_rate" in reported:
            at_fault = (
                reported["friction"] - problem.radiation_damping * reported["slip_rate"] / stress
            )
            words = "friction is that of the spring, which holds eta V/sigma too"
            yield words, reported | {"friction": at_fault}
    for name in problem.quantities:
        factor = float(np.median(reported[name] / np.where(answer[name], answer[name], np.nan)))
        # any factor and any shift would explain a quantity of one value
        several = len(answer[name]) > 1
        usual = _usual_factor(factor, _FACTOR_RTOL if several else _SINGLE_VALUE_FACTOR_RTOL)
        if usual is not None:
            yield f"{name} {usual[0]}", reported | {name: reported[name] / usual[1]}
        elif several and math.isfinite(factor) and factor:
            words = f"{name} is {_format_factor(factor)} times the known answer"
            yield words, reported | {name: reported[name] / factor}
        if several:
            apart = float(np.median(reported[name] - answer[name]))
            words = f"{name} is shifted by {apart:.6g} {problem.units[name]}".removesuffix(" 1")
            yield words, reported | {name: reported[name] - apart}


def _usual_factor(factor: float, tolerance: float) -> tuple[str, float] | None:
    """Return a common conversion factor that equals a factor within a tolerance.

    Returns
    -------
    tuple of (str, float) or None
        Description of the common factor, and its value. None if no common factor matches.
    """
    if math.isclose(factor, -1.0, rel_tol=tolerance):
        return "has the opposite sign", -1.0
    for words, usual in _USUAL_FACTORS.items():
        if math.isclose(abs(factor), usual, rel_tol=tolerance):
            sign = "-" if factor < 0.0 else ""
            return f"is {sign}{words} times the known answer", math.copysign(usual, factor)
    return None


def _format_factor(factor: float) -> str:
    """Format a factor so that the text differs from 1."""
    text, beyond = f"{factor:.6g}", factor - 1.0
    return text if text != "1" else f"(1 {'-' if beyond < 0.0 else '+'} {abs(beyond):.2g})"


def _reformulate_problem(problem: BenchmarkProblem) -> Iterator[tuple[str, BenchmarkProblem]]:
    """Problems with other conventions, each with words for it."""

    def changed(**parameters: object) -> BenchmarkProblem:
        return replace(problem, parameters={**problem.parameters, **parameters})

    if problem.radiation_damping:
        for words, factor in _DAMPING_FACTORS.items():
            eta = f"{factor * problem.radiation_damping!r} Pa s/m"
            yield f"damping is {words}", changed(radiation_damping=eta)
    if problem.initial:
        steady = [f"{theta!r} s" for theta in problem.theta_star]
        rate = problem.initial["slip_rate"]
        factor = math.exp(-problem.log_slip_rate)
        at_rate = [f"{factor * theta!r} s" for theta in problem.theta_star]
        for words, thetas in (("D_c/V_*", steady), (f"D_c/V(0) with V(0) = {rate}", at_rate)):
            other = {**problem.initial, "theta": thetas}
            yield f"theta_0 is {words}, and not as stated", replace(problem, initial=other)
    if problem.parameters.get("regularised"):
        yield "friction has a logarithm for arcsinh", changed(regularised=False)
    for name in ("alpha", "stress_dependence"):
        if problem.parameters.get(name):
            yield f"{name} is left out", changed(**{name: 0.0})
    law = {"slip": "slowness", "slowness": "slip"}.get(problem.law)
    if law:
        yield f"the law is the {law} law", replace(problem, law=law)
