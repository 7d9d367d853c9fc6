"""Functions that compare an answer of another code with the known answer to a problem.

The function ``compare_answers`` counts the correct digits. If an answer has too few correct digits,
the function also tests whether another convention, such as other units, explains the difference
from the known answer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rsfstudy.errors import RsfStudyError
from rsfstudy.motion import Accuracy, Engine
from rsfstudy.referee import reference_answers
from rsfstudy.referee.benchmark_problem_files import BenchmarkProblem
from rsfstudy.referee.external_answers import ReportedQuantity
from rsfstudy.referee.reference_answers import AnswerValuesByQuantity
from rsfstudy.rig import read_table

#: Default number of correct digits that an answer needs to pass.
DEFAULT_REQUIRED_DIGITS = 6
#: Criteria for accepting an explanation of the difference from the known answer. The first value is
#: the minimum number of correct digits after the correction. The second value is the minimum
#: increase of the number of correct digits.
_MIN_EXPLAINED_DIGITS, _MIN_DIGITS_GAINED = 3.0, 1.5
#: Maximum difference between rounded values and the known answer, in units of the last decimal
#: place. The limit allows an error of one unit in the other code, half a unit for rounding in the
#: file, and a small margin for rounding of the known answer.
_MAX_DIFFERENCE_IN_LAST_PLACE_UNITS = 1.51
#: Quantities that start at zero. The difference of such a quantity from the known answer is divided
#: by the largest known value of the quantity.
_QUANTITIES_STARTING_AT_ZERO = ("slip", "pore_pressure")
#: Conventions for radiation damping, and the factors by which eta is multiplied.
_DAMPING_MULTIPLIER_BY_CONVENTION = {
    "twice as large (G/c_s instead of G/(2 c_s))": 2.0,
    "half as large": 0.5,
    "left out": 0.0,
}
#: Common conversion factors. The factors convert units, powers of ten, angles or logarithms.
_COMMON_CONVERSION_FACTOR_BY_NAME = {
    "2": 2.0, "0.5": 0.5, "pi": math.pi, "1/pi": 1.0 / math.pi, "2 pi": 2.0 * math.pi,
    "1/(2 pi)": 0.5 / math.pi, "ln 10": math.log(10.0), "1/ln 10": 1.0 / math.log(10.0),
    **{f"{unit:g}": unit for unit in (60.0, 3600.0, 86400.0)},
    **{f"1/{unit:g}": 1.0 / unit for unit in (60.0, 3600.0, 86400.0)},
    **{f"{10.0**power:g}": 10.0**power for power in range(-15, 16) if power},
}  # fmt: skip
#: Relative tolerances for recognising a conversion factor. The first tolerance applies to a factor
#: from several values. The second tolerance applies to a factor from a single value.
_FACTOR_RTOL, _SINGLE_VALUE_FACTOR_RTOL = 1e-6, 1e-3
#: The first constant contains the relative integration tolerances of the two computed answers to a
#: user-defined problem. The second constant is the relative integration tolerance for answers with
#: other conventions.
_REFERENCE_RTOLS, _EXPLANATION_RTOL = (1e-9, 1e-11), 1e-8


@dataclass(frozen=True)
class QuantityAgreement:
    """Result of the comparison of one quantity with the known answer.

    Parameters
    ----------
    quantity_name : str
        Name of the quantity.
    agreeing_digits : float
        Smallest number of correct digits in any row. The number cannot exceed the number of digits
        of the known answer.
    least_agreeing_row_index : int
        Index of the row with the largest relative difference from the known answer.
    first_failing_row_index : int or None
        Index of the first row with fewer correct digits than required, or None if all rows have
        enough correct digits.
    agrees_within_rounding_error : bool
        True if all rows agree within the rounding error of the written values.
    relative_differences : ndarray, shape (n,)
        Relative difference between the answer and the known answer in each row.
    """

    quantity_name: str
    agreeing_digits: float
    least_agreeing_row_index: int
    first_failing_row_index: int | None
    agrees_within_rounding_error: bool
    relative_differences: np.ndarray


@dataclass(frozen=True)
class AnswerComparison:
    """Result of the comparison of all quantities in an answer with the known answer.

    Parameters
    ----------
    benchmark_problem : BenchmarkProblem
        Problem that both answers belong to.
    quantity_agreements : tuple of QuantityAgreement
        Agreement of each quantity.
    required_digits : float
        Number of correct digits that the answer needs to pass.
    explanation_of_disagreement : str, default: ""
        Convention that explains the difference from the known answer. The string is empty if the
        answer passes or if no explanation was found.
    """

    benchmark_problem: BenchmarkProblem
    quantity_agreements: tuple[QuantityAgreement, ...]
    required_digits: float
    explanation_of_disagreement: str = ""

    @property
    def agreeing_digits(self) -> float:
        """Smallest number of correct digits among all quantities."""
        return min(agreement.agreeing_digits for agreement in self.quantity_agreements)

    @property
    def has_required_digits(self) -> bool:
        """True if all quantities have the required number of correct digits.

        If the known answer has fewer digits than required, all known digits must be correct.
        """
        return self.agreeing_digits >= min(self.required_digits, self.benchmark_problem.digits)

    def describe_agreements(self) -> list[str]:
        """Describe the agreement of each quantity.

        Returns
        -------
        list of str
            One line per quantity. Each line contains the number of correct digits, the row with the
            largest difference, and the first row with fewer correct digits than required.
        """
        problem, lines = self.benchmark_problem, []
        for agreement in self.quantity_agreements:
            text = (
                f"  {agreement.quantity_name:20s} "
                f"{round_digit_count_down(agreement.agreeing_digits):4.1f} digits"
            )
            if agreement.agrees_within_rounding_error:
                text += ", all written decimal places"
            elif agreement.agreeing_digits == problem.digits:
                text += ", all known digits"
            elif problem.answer_index_column_name:
                row_index = agreement.least_agreeing_row_index
                text += ", lowest agreement at "
                text += _format_time_or_peak_number_of_row(problem, row_index)
            if agreement.first_failing_row_index is not None and problem.answer_index_column_name:
                row_index = agreement.first_failing_row_index
                text += "; fewer digits than required from "
                text += _format_time_or_peak_number_of_row(problem, row_index)
            lines.append(text)
        return lines


def _format_time_or_peak_number_of_row(problem: BenchmarkProblem, row: int) -> str:
    """Format the time (with units) or the peak number that identifies a row."""
    units = {"time": " s"}.get(problem.answer_index_column_name, "")
    return f"{problem.answer_index_column_name} = {problem.answer_index_values[row]:g}{units}"


def read_or_compute_known_answer(
    problem: BenchmarkProblem, answer_path: Path | None
) -> tuple[BenchmarkProblem, AnswerValuesByQuantity]:
    """Return a problem and its known answer.

    Parameters
    ----------
    problem : BenchmarkProblem
        Problem to solve.
    answer_path : Path or None
        File of the known answer. If the path is None, rsfstudy computes the answer twice, with two
        different integration tolerances.

    Returns
    -------
    problem : BenchmarkProblem
        Problem with the number of known digits in the field ``digits``. If rsfstudy computes the
        answer twice, the known digits are the digits to which the two computed answers agree.
    answer : dict of str to ndarray
        Columns of the answer in SI units.

    Raises
    ------
    RsfStudyError
        If rsfstudy cannot compute the answer.
    """
    if answer_path is not None:
        table = read_table(answer_path)
        return problem, {name: column.values for name, column in table.items()}
    engine = Engine.COMPILED if Engine.is_installed(Engine.COMPILED) else Engine.SCIPY
    rough, fine = (
        reference_answers.compute_answer(
            problem,
            Accuracy(tolerance, reference_answers.MAX_RHS_EVALUATIONS_PER_ANSWER, engine=engine),
        )
        for tolerance in _REFERENCE_RTOLS
    )
    both = [a.agreeing_digits for a in _compare_quantities(problem, rough, fine, 0.0)]
    return replace(problem, digits=max(1, math.floor(min(both)))), fine


def compare_answers(
    problem: BenchmarkProblem,
    known_answer: AnswerValuesByQuantity,
    reported_quantities: Mapping[str, ReportedQuantity],
    required_digits: float,
) -> AnswerComparison:
    r"""Compare the answer of another code with the known answer.

    If the answer has too few correct digits, the function searches for a convention that explains
    the difference from the known answer.

    Parameters
    ----------
    problem : BenchmarkProblem
        Problem that both answers belong to.
    known_answer : mapping of str to ndarray
        Columns of the known answer in SI units.
    reported_quantities : mapping of str to ReportedQuantity
        Quantities that the other code reports.
    required_digits : float
        Number of correct digits that the answer needs to pass.

    Returns
    -------
    AnswerComparison
        Agreement of each quantity, and an explanation of the difference if there is one.

    Notes
    -----
    The relative difference of a reported value :math:`x` from the known value :math:`y` is

    .. math::

        \Delta = \frac{\max(|x - y| - r, 0)}{s}.

    The rounding error :math:`r` is half a unit in the last digit of :math:`y`. The scale :math:`s`
    is :math:`|y|` for most quantities. For slip and pore pressure, which start at zero, the scale
    is the largest value of :math:`|y|` in the column. The number of correct digits is
    :math:`-\log_{10} \max \Delta`. The number of correct digits cannot exceed the number of digits
    of the known answer.
    """
    values = {name: column.si_values for name, column in reported_quantities.items()}
    places = {
        name: column.si_value_of_last_decimal_place for name, column in reported_quantities.items()
    }
    found = AnswerComparison(
        problem,
        _compare_quantities(problem, values, known_answer, required_digits, places),
        required_digits,
    )
    if found.has_required_digits:
        return found
    best, words = max(
        _iterate_explanations_of_disagreement(problem, values, known_answer), default=(0.0, "")
    )
    better = best >= max(_MIN_EXPLAINED_DIGITS, found.agreeing_digits + _MIN_DIGITS_GAINED)
    explanation = (
        f"{words}. With this convention corrected, {round_digit_count_down(best):.1f} digits agree"
    )
    return replace(found, explanation_of_disagreement=explanation if better else "")


def round_digit_count_down(digit_count: float) -> float:
    """Round a number of digits down to one decimal place.

    An answer fails if it has fewer correct digits than required. Rounding down ensures that the
    displayed number of digits of a failed answer is also below the required number.

    Parameters
    ----------
    digit_count : float
        Number of digits.

    Returns
    -------
    float
        Rounded number of digits.
    """
    return math.floor(10.0 * digit_count) / 10.0


def _compare_quantities(
    problem: BenchmarkProblem,
    reported_answer: AnswerValuesByQuantity,
    known_answer: AnswerValuesByQuantity,
    required_digits: float,
    last_place_unit_by_quantity: Mapping[str, float] | None = None,
) -> tuple[QuantityAgreement, ...]:
    """Compute the agreement of each quantity of a problem."""
    found = []
    for name in problem.quantities:
        apart = _compute_relative_differences(
            name, reported_answer[name], known_answer[name], problem.digits
        )
        few = np.flatnonzero(apart > 10.0**-required_digits)
        place = (last_place_unit_by_quantity or {}).get(name, 0.0)
        found.append(
            QuantityAgreement(
                name,
                min(max(0.0, -math.log10(max(apart.max(), 1e-300))), float(problem.digits)),
                int(np.argmax(apart)),
                int(few[0]) if len(few) else None,
                bool(
                    (
                        np.abs(reported_answer[name] - known_answer[name])
                        <= _MAX_DIFFERENCE_IN_LAST_PLACE_UNITS * place
                    ).all()
                ),
                apart,
            )
        )
    return tuple(found)


def _compute_relative_differences(
    quantity_name: str, reported_values: np.ndarray, known_values: np.ndarray, known_digits: int
) -> np.ndarray:
    """Compute the relative differences of a quantity from the known answer.

    The rounding error of the known answer, which is half a unit in the last digit, is subtracted
    from each absolute difference. The remaining difference is divided by the known value. For
    quantities that start at zero, the remaining difference is divided by the largest known value.
    """
    size = np.abs(known_values)
    rounded = 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(size, 1e-300))) + 1.0 - known_digits)
    scale = (
        np.full(len(known_values), size.max() or 1.0)
        if quantity_name in _QUANTITIES_STARTING_AT_ZERO
        else size
    )
    return np.asarray(np.maximum(np.abs(reported_values - known_values) - rounded, 0.0) / scale)


def _iterate_explanations_of_disagreement(
    problem: BenchmarkProblem,
    reported_answer: AnswerValuesByQuantity,
    known_answer: AnswerValuesByQuantity,
) -> Iterator[tuple[float, str]]:
    """Iterate over conventions that may explain an incorrect answer.

    Each item contains the number of correct digits under a convention, and a description of the
    convention.
    """
    for words, table in _iterate_answers_in_other_conventions(
        problem, reported_answer, known_answer
    ):
        yield (
            min(a.agreeing_digits for a in _compare_quantities(problem, table, known_answer, 0.0)),
            words,
        )
    for words, other in _iterate_problems_in_other_conventions(problem):
        try:
            table = reference_answers.compute_answer(
                other, Accuracy(_EXPLANATION_RTOL, reference_answers.MAX_RHS_EVALUATIONS_PER_ANSWER)
            )
        except RsfStudyError:
            continue
        yield (
            min(
                a.agreeing_digits for a in _compare_quantities(problem, reported_answer, table, 0.0)
            ),
            words,
        )


def _iterate_answers_in_other_conventions(
    problem: BenchmarkProblem,
    reported_answer: AnswerValuesByQuantity,
    known_answer: AnswerValuesByQuantity,
) -> Iterator[tuple[str, AnswerValuesByQuantity]]:
    """Iterate over copies of an answer, each converted from a different convention.

    Each item contains a description of a convention, and the columns of the converted answer.
    """
    shift, stress = sum(problem.b_values) * math.log(2.0), problem.rig.normal_stress
    if "friction" in reported_answer:
        for sign, place in ((1.0, "omitted from"), (-1.0, "included in")):
            moved = reported_answer["friction"] + sign * shift
            words = f"friction is shifted by b ln 2, as if 2 D_c were {place} the logarithm"
            yield words, reported_answer | {"friction": moved}
        if problem.radiation_damping and "slip_rate" in reported_answer:
            at_fault = (
                reported_answer["friction"]
                - problem.radiation_damping * reported_answer["slip_rate"] / stress
            )
            words = "friction is computed from the spring stress, which includes eta V/sigma"
            yield words, reported_answer | {"friction": at_fault}
    for name in problem.quantities:
        factor = float(
            np.median(
                reported_answer[name] / np.where(known_answer[name], known_answer[name], np.nan)
            )
        )
        # An arbitrary factor or an arbitrary offset would explain any single value.
        several = len(known_answer[name]) > 1
        usual = _find_common_conversion_factor(
            factor, _FACTOR_RTOL if several else _SINGLE_VALUE_FACTOR_RTOL
        )
        if usual is not None:
            yield f"{name} {usual[0]}", reported_answer | {name: reported_answer[name] / usual[1]}
        elif several and math.isfinite(factor) and factor:
            words = f"{name} is {_format_conversion_factor(factor)} times the reference value"
            yield words, reported_answer | {name: reported_answer[name] / factor}
        if several:
            apart = float(np.median(reported_answer[name] - known_answer[name]))
            units = problem.si_units_by_quantity[name].removesuffix("1")
            words = f"{name} is shifted by {apart:.6g} {units}".rstrip()
            yield words, reported_answer | {name: reported_answer[name] - apart}


def _find_common_conversion_factor(factor: float, rtol: float) -> tuple[str, float] | None:
    """Find the common conversion factor that matches a given factor.

    The relative difference between the given factor and the common conversion factor must not
    exceed the tolerance.

    Returns
    -------
    tuple of (str, float) or None
        Description and value of the common conversion factor, or None if no common conversion
        factor matches.
    """
    if math.isclose(factor, -1.0, rel_tol=rtol):
        return "has the opposite sign", -1.0
    for words, usual in _COMMON_CONVERSION_FACTOR_BY_NAME.items():
        if math.isclose(abs(factor), usual, rel_tol=rtol):
            sign = "-" if factor < 0.0 else ""
            return f"is {sign}{words} times the reference value", math.copysign(usual, factor)
    return None


def _format_conversion_factor(factor: float) -> str:
    """Format a factor so that a value close to 1 is not rounded to 1."""
    text, beyond = f"{factor:.6g}", factor - 1.0
    return text if text != "1" else f"(1 {'-' if beyond < 0.0 else '+'} {abs(beyond):.2g})"


def _iterate_problems_in_other_conventions(
    problem: BenchmarkProblem,
) -> Iterator[tuple[str, BenchmarkProblem]]:
    """Iterate over copies of a problem with other conventions.

    Each item contains a description of a convention, and the problem under that convention.
    """

    def changed(**parameters: object) -> BenchmarkProblem:
        """Return a copy of the problem with other parameter values."""
        return replace(problem, parameters={**problem.parameters, **parameters})

    if problem.radiation_damping:
        for words, factor in _DAMPING_MULTIPLIER_BY_CONVENTION.items():
            eta = f"{factor * problem.radiation_damping!r} Pa s/m"
            yield f"damping is {words}", changed(radiation_damping=eta)
    if problem.initial:
        steady = [f"{theta!r} s" for theta in problem.steady_thetas_at_reference_velocity]
        rate = problem.initial["slip_rate"]
        factor = math.exp(-problem.initial_log_slip_rate)
        at_rate = [f"{factor * theta!r} s" for theta in problem.steady_thetas_at_reference_velocity]
        for words, thetas in (("D_c/V_*", steady), (f"D_c/V(0) with V(0) = {rate}", at_rate)):
            other = {**problem.initial, "theta": thetas}
            yield f"theta_0 is {words} instead of the given value", replace(problem, initial=other)
    if problem.parameters.get("regularised"):
        yield "friction uses a logarithm instead of arcsinh", changed(regularised=False)
    for name in ("alpha", "stress_dependence"):
        if problem.parameters.get(name):
            yield f"{name} is omitted", changed(**{name: 0.0})
    law = {"slip": "slowness", "slowness": "slip"}.get(problem.law)
    if law:
        yield f"the law is the {law} law", replace(problem, law=law)
