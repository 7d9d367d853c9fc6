"""Tests of the referee: its answers, and its judgement of other codes."""

from __future__ import annotations

import csv
import functools
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from referee_numbers import UNITS, columns, second_way_rows
from referee_page import PAGE, PROBLEMS_MARKER, all_sections
from second_referee_way import read_stated_problem, rounds_to
from study_runs import call_main

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.referee import external_answers, reference_answers
from rsfstudy.referee.answer_comparison import (
    DEFAULT_REQUIRED_DIGITS,
    AnswerComparison,
    compare_answers,
    read_or_compute_known_answer,
)
from rsfstudy.referee.benchmark_problem_files import (
    BenchmarkProblem,
    find_shipped_problem_files,
    read_problem,
)

NUMBERS = sorted(find_shipped_problem_files())
RSFMODEL = Path(__file__).with_name("rsfmodel")


def of(number: int) -> BenchmarkProblem:
    return read_problem(find_shipped_problem_files()[number])


def answer_of(number: int) -> list[dict[str, str]]:
    with find_shipped_problem_files()[number].with_suffix(".csv").open() as file:
        return [{k.split()[0]: v for k, v in row.items()} for row in csv.DictReader(file)]


@functools.cache
def second_way(number: int) -> list[dict]:
    return second_way_rows(read_stated_problem(find_shipped_problem_files()[number]))


# ---- answers -------------------------------------------------------------------------------------
@pytest.mark.parametrize("number", NUMBERS)
def test_answers_are_those_of_a_second_way(number):
    """The answers agree with an independent method to the last digit.

    If any digit of a column changes by two, the agreement is lost.
    """
    problem, rows, others = of(number), answer_of(number), second_way(number)
    assert (
        [*rows[0]]
        == columns(read_stated_problem(find_shipped_problem_files()[number]))
        == [*problem.answer_column_names]
    )
    for name in problem.quantities:
        both = [(row[name], other[name]) for row, other in zip(rows, others, strict=True)]
        assert all(rounds_to(text, value) for text, value in both)
        text, value = next(pair for pair in reversed(both) if pair[0] != "0")
        places = [i for i, x in enumerate(text.partition("e")[0]) if x.isdigit()]
        assert len(places) == problem.digits
        for place in places:
            # The change is two because the last digit may have an error of one half.
            changed = text[:place] + str((int(text[place]) + 2) % 10) + text[place + 1 :]
            assert not rounds_to(changed, value)


@pytest.mark.parametrize("number", NUMBERS)
def test_files_of_problems_hold_all_that_they_are_asked_for(number):
    problem = of(number)
    assert problem.digits == (11 if number == 24 else 12)
    text = find_shipped_problem_files()[number].read_text()
    assert problem.equations
    assert problem.conventions
    assert [
        f"{name} ({UNITS[name]})" for name in problem.answer_column_names
    ] == problem.answer_column_headings
    # The example requires SI units.
    units = re.findall(r'"[-+.e\d]+ ([^"]+)"', text)
    assert {*units} <= {"Pa", "m/s", "m", "s", "Pa/m", "Pa s/m", "1/s"}


# ---- ours ----------------------------------------------------------------------------------------
def told_of(
    table: reference_answers.AnswerValuesByQuantity,
) -> dict[str, external_answers.ReportedQuantity]:
    return {name: external_answers.ReportedQuantity(values, 0.0) for name, values in table.items()}


def digits_of_ours(number: int, rtol: float, engine: str) -> AnswerComparison:
    problem, answer = read_or_compute_known_answer(
        of(number), find_shipped_problem_files()[number].with_suffix(".csv")
    )
    table = reference_answers.compute_answer(problem, Accuracy(rtol, 5_000_000, engine=engine))
    return compare_answers(problem, answer, told_of(table), 1.0)


@pytest.mark.parametrize("number", NUMBERS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-7, 1e-9, 1e-11])
def test_ours_has_the_digits_it_promises(number, rtol):
    """The digits of rsfstudy agree with rtol.

    The tolerance ``rtol`` is the accuracy of ln V, which these problems amplify by up to 2.5.
    """
    assert digits_of_ours(number, rtol, COMPILED).agreeing_digits >= -math.log10(4.0 * rtol)


@pytest.mark.parametrize("engine", sorted({*ENGINE_NAMES} - {COMPILED}))
@pytest.mark.parametrize("number", [4, 12, 14, 17, 20])
def test_every_engine_does(engine, number):
    for rtol in (1e-5, 1e-8):
        assert digits_of_ours(number, rtol, engine).agreeing_digits >= -math.log10(4.0 * rtol)


# ---- other codes ---------------------------------------------------------------------------------
def write(path: Path, header: list[str], columns: list) -> Path:
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(header)
        table.writerows(zip(*columns, strict=True))
    return path


def told_by_second_way(number: int) -> dict[str, np.ndarray]:
    rows = second_way(number)
    return {
        name: np.array([float(row[name]) for row in rows])
        for name in of(number).answer_column_names
    }


def filed(path: Path, number: int, **changes: np.ndarray) -> Path:
    """Write the results of the second method, with changes, to a file."""
    told = told_by_second_way(number) | changes
    return write(
        path,
        of(number).answer_column_headings,
        [told[name] for name in of(number).answer_column_names],
    )


#: Published curves by problem number, with their column descriptions.
_USUAL = "time=time (s), friction=friction, slip_rate=slider_velocity (um/s), "
PUBLISHED = {
    1: ("TestDeiterichOneStateVar.csv", _USUAL + "theta=state (s)"),
    2: ("TestRuinaOneStateVar.csv", _USUAL + "theta=state (s)"),
    3: ("TestPerrinOneStateVar.csv", _USUAL + "theta=state (s)"),
    4: ("TestDeiterichTwoStateVar.csv", _USUAL + "theta_1=state1 (s), theta_2=state2 (s)"),
}


@pytest.mark.parametrize("number", PUBLISHED)
def test_published_curves_pass_to_the_last_place_that_is_written(number):
    """Published curves agree to all eight printed decimals."""
    name, columns = PUBLISHED[number]
    ran = call_main("verify", RSFMODEL / name, "--problem", number, "--columns", columns)
    assert (ran.returncode, ran.stderr) == (0, "")
    count = len(of(number).quantities)
    assert ran.stdout.count("all written decimal places") == count
    assert f"1 problem of 24, {7 if number == 4 else 8} digits" in ran.stdout


@pytest.mark.parametrize(
    ("number", "wrong", "explanation"),
    [
        (1, lambda told, _p: {"friction": told["friction"] - 0.01 * math.log(2)}, "b ln 2"),
        (
            2,
            lambda told, _p: {"slip_rate": told["slip_rate"] * 1e6},
            "slip_rate is 1e+06 times the reference value. With this convention corrected, 1",
        ),
        (
            12,
            lambda told, p: {
                "friction": told["friction"]
                + p.radiation_damping * told["slip_rate"] / p.rig.normal_stress
            },
            "friction is computed from the spring stress",
        ),
    ],
)
def test_conventions_of_what_is_told_explain_a_difference(number, wrong, explanation, tmp_path):
    told = told_by_second_way(number)
    file = filed(tmp_path / f"{number:02d}.csv", number, **wrong(told, of(number)))
    ran = call_main("verify", file)
    assert ran.returncode == 1
    assert explanation in " ".join(ran.stdout.split())


@pytest.mark.parametrize(
    ("number", "changes", "explanation"),
    [
        (12, {"radiation_damping": "9e6 Pa s/m"}, "damping is twice as large"),
        (13, {"radiation_damping": "9e6 Pa s/m"}, "damping is twice as large"),
        (12, {"theta": "100 s"}, "theta_0 is D_c/V_* instead of the given value"),
        (12, {"theta": "1e5 s"}, "theta_0 is D_c/V(0)"),
        (11, {"regularised": False}, "a logarithm instead of arcsinh"),
        (15, {"alpha": 0.0}, "alpha is omitted"),
        (5, {"law": "slip"}, "the law is the slip law"),
    ],
)
def test_conventions_of_the_problem_explain_a_difference(number, changes, explanation):
    problem = of(number)
    if "theta" in changes:
        other = replace(problem, initial={**problem.initial, **changes})
    elif "law" in changes:
        other = replace(problem, **changes)
    else:
        other = replace(problem, parameters={**problem.parameters, **changes})
    table = reference_answers.compute_answer(other, Accuracy(1e-8, engine=COMPILED))
    found = compare_answers(
        *read_or_compute_known_answer(
            problem, find_shipped_problem_files()[number].with_suffix(".csv")
        ),
        told_of(table),
        DEFAULT_REQUIRED_DIGITS,
    )
    assert not found.has_required_digits
    assert explanation in found.explanation_of_disagreement


@pytest.mark.parametrize(
    ("wrong", "explanation"),
    [
        (
            lambda rate: -rate,
            "growth_rate has the opposite sign. With this convention corrected, 12.0 digits",
        ),
        (lambda rate: rate / (2.0 * math.pi), "growth_rate is 1/(2 pi) times the reference value"),
        # A factor combined with an offset would explain any value.
        (lambda rate: 1.7 * rate, "no common difference in conventions explains the disagreement"),
        (lambda rate: -1.3 * rate, "no common difference in conventions explains the disagreement"),
    ],
)
def test_a_single_value_is_explained_by_usual_factors_only(wrong, explanation, tmp_path):
    rate = told_by_second_way(20)["growth_rate"]
    ran = call_main("verify", filed(tmp_path / "20.csv", 20, growth_rate=wrong(rate)))
    assert ran.returncode == 1
    assert explanation in " ".join(ran.stdout.split())


@pytest.mark.parametrize("off", [3e-7, -3e-7])
def test_a_factor_near_one_is_worded_by_its_difference_from_one(off, tmp_path):
    rate = told_by_second_way(2)["slip_rate"]
    ran = call_main(
        "verify", filed(tmp_path / "02.csv", 2, slip_rate=rate * (1.0 + off)), "--digits", 7
    )
    sign = "-" if off < 0.0 else "+"
    said = " ".join(ran.stdout.split())
    assert f"slip_rate is (1 {sign} 3e-07) times the reference value" in said


def test_digits_that_do_not_pass_are_not_rounded_up(tmp_path):
    """A relative difference of 1.05e-6 is reported as 5.9 digits."""
    told = told_by_second_way(2)
    ran = call_main(
        "verify", filed(tmp_path / "02.csv", 2, slip_rate=told["slip_rate"] * (1 + 1.05e-6))
    )
    assert ran.returncode == 1
    assert re.search(r"slip_rate +5\.9 digits", ran.stdout)


def test_the_number_of_rows_is_checked_before_columns_are_converted(tmp_path):
    """The number of rows is checked before shear stress is converted.

    The conversion needs the normal stress at the times of the problem.
    """
    told = told_by_second_way(15)
    header = [h.replace("friction (1)", "shear_stress (Pa)") for h in of(15).answer_column_headings]
    columns = [told[name][:-1] for name in of(15).answer_column_names]
    ran = call_main("verify", write(tmp_path / "15.csv", header, columns))
    count = len(told["time"])
    said = " ".join(ran.stderr.split())
    assert (ran.returncode, f"number of rows must be {count} (got {count - 1})." in said) == (
        2,
        True,
    )


def test_where_they_part_is_told(tmp_path):
    rate = told_by_second_way(1)["slip_rate"]
    rate[25:] *= 1.001
    ran = call_main("verify", filed(tmp_path / "01.csv", 1, slip_rate=rate))
    said = " ".join(ran.stdout.split())
    pattern = r"slip_rate 3\.0 digits, lowest agreement at time = [234]\d s; "
    assert re.search(pattern + "fewer digits than required from time = 25 s", said)
    assert "no common difference in conventions explains the disagreement" in said
    assert "0 problems of 24" in said
    assert ran.returncode == 1


def test_other_units_and_other_quantities_are_converted(tmp_path):
    told = told_by_second_way(12)
    p = of(12)
    tau = p.rig.normal_stress * told["friction"] + p.radiation_damping * told["slip_rate"]
    header = ["t (min)", "tau", "logV", "theta", "u (um)"]
    columns = [told["time"] / 60.0, tau / 1e6, np.log10(told["slip_rate"]), told["theta"] / 3600.0]
    file = write(tmp_path / "mine.csv", header, [*columns, told["slip"] * 1e6])
    mapped = (
        "time=t (min), shear_stress=tau (MPa), log10_slip_rate=logV, theta=theta (h), slip=u (um)"
    )
    ran = call_main("verify", file, "--problem", "12", "--columns", mapped)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert "1 problem of 24, 1" in ran.stdout


@pytest.mark.parametrize("number", [15, 16, 17, 18])
def test_shear_stress_tells_friction_where_normal_stress_changes(number, tmp_path):
    """Shear stress is divided by the normal stress of the problem.

    The result has 11 digits, because normal stress and friction are rounded to 12 digits.
    """
    problem, told = of(number), told_by_second_way(number)
    time, sigma = told["time"], problem.rig.normal_stress
    sigma = {
        15: np.where(time < 10.0, 1.0, 1.05) * sigma,
        16: sigma + 1e5 * np.sin(2.0 * np.pi * time / 25.0),
        17: told.get("normal_stress"),
        18: sigma - told.get("pore_pressure", 0.0),
    }[number]
    header = [
        h.replace("friction (1)", "shear_stress (Pa)") for h in problem.answer_column_headings
    ]
    columns = [told[n] * (sigma if n == "friction" else 1.0) for n in problem.answer_column_names]
    found = external_answers.read_external_answer(
        write(tmp_path / "mine.csv", header, columns), problem
    )
    answer = read_or_compute_known_answer(
        problem, find_shipped_problem_files()[number].with_suffix(".csv")
    )
    assert compare_answers(*answer, found, DEFAULT_REQUIRED_DIGITS).agreeing_digits > 11.0


def test_shear_stress_beside_what_is_asked_for_is_left_alone(tmp_path):
    """An unnecessary column of shear stress is ignored."""
    told = told_by_second_way(13)
    header = [*of(13).answer_column_headings, "shear_stress (Pa)"]
    columns = [*(told[name] for name in of(13).answer_column_names), told["slip_rate"]]
    found = external_answers.read_external_answer(
        write(tmp_path / "13.csv", header, columns), of(13)
    )
    assert [*found] == [*of(13).answer_column_names]


def test_zeros_agree_in_nothing_and_overflows_are_refused(tmp_path):
    zeros = np.zeros(len(of(1).times))
    ran = call_main("verify", filed(tmp_path / "01.csv", 1, friction=zeros))
    assert re.search(r"friction +0\.0 digits, lowest agreement at", ran.stdout)
    assert ran.returncode == 1
    huge = filed(tmp_path / "01.csv", 1, slip_rate=zeros + 400.0)
    huge.write_text(huge.read_text().replace("slip_rate (m/s)", "log10_slip_rate (1)"))
    ran = call_main("verify", huge)
    said = "line 2, column 3: log10_slip_rate must be a number of at most 100"
    assert (ran.returncode, said in " ".join(ran.stderr.split())) == (2, True)
    ran = call_main("verify", huge, "--digits", "nan")
    assert (ran.returncode, "--digits must be a number, from 1 to 12 (got nan)" in ran.stderr) == (
        2,
        True,
    )


@pytest.mark.parametrize(
    ("spoil", "error"),
    [
        (lambda h, c: (["time (s)", "mu (1)", *h[2:]], c), "column 'friction' is missing"),
        (lambda h, c: ([h[0], h[1], "slip_rate (MPa)", *h[3:]], c), "slip_rate"),
        (lambda h, c: ([h[0], h[1], "slip_rate (1)", *h[3:]], c), "has no units"),
        (lambda h, c: (h, [x[:-1] for x in c]), "number of rows must be 41 (got 40)"),
        (lambda h, c: (h, [c[0] + 0.5, *c[1:]]), "'time' must be 0 s"),
        (
            lambda h, c: (h, [c[0], ["", *c[1][1:]], *c[2:]]),
            "line 2, column 2: 'friction' must be a number of at most 1e+100 (got nan)",
        ),
    ],
)
def test_what_is_no_answer_is_refused(spoil, error, tmp_path):
    told = told_by_second_way(1)
    header, columns = spoil(
        of(1).answer_column_headings, [told[name] for name in of(1).answer_column_names]
    )
    file = write(tmp_path / "01.csv", header, columns)
    with pytest.raises(InvalidValue, match=re.escape(error)):
        external_answers.read_external_answer(file, of(1))


def test_files_and_problems_that_are_not_there_are_said_so():
    """Missing files and unknown problems have different exit statuses."""
    ran = call_main("verify", "nowhere.csv", "--problem", "1", "--columns", "time=t (s)")
    assert (ran.returncode, "the file nowhere.csv does not exist" in ran.stderr) == (1, True)
    ran = call_main("verify", "nowhere.csv")
    assert (ran.returncode, "problem 'no' is unknown" in ran.stderr) == (
        2,
        True,
    )


# ---- user-defined problems ----------------------------------------------------------------------
#: A scene of another code, with all values in SI units.
STEP = """
title = "Velocity step of another code"
law = "slowness"
quantities = ["friction", "slip_rate", "theta"]
times = [1, 2, 5, 10, 20, 50]
[parameters]
a = 0.01
b = 0.014
D_c = "20 um"
normal_stress = "5 MPa"
stiffness = "0.003 MPa/um"
radiation_damping = "4.41e6 Pa s/m"
V_star = "1 um/s"
mu_star = 0.6
[initial]
slip_rate = "3 um/s"
theta = "4 s"
[[loading]]
velocity = "10 um/s"
"""
TWO_STATES = (
    STEP.replace('"slowness"', '"two_slowness_states"')
    .replace('D_c = "20 um"', 'D_c = "20 um"\nb_2 = 0.002\nD_c_2 = "60 um"')
    .replace('"4 s"', '["4 s", "50 s"]')
    .replace('"theta"]', '"theta_1", "theta_2"]')
)


#: Two states that share the effect of stress.
_UNDAMPED = TWO_STATES.replace('radiation_damping = "4.41e6 Pa s/m"\n', "")
NAGATA = _UNDAMPED.replace("mu_star", "stress_dependence = 0.5\nmu_star")
STRESSED = _UNDAMPED.replace("mu_star", "alpha = 0.2\nmu_star") + 'normal_stress = "5.2 MPa"'


@pytest.mark.parametrize(
    "text", [STEP, TWO_STATES, NAGATA, STRESSED, find_shipped_problem_files()[14].read_text()]
)
def test_a_problem_of_ones_own(text, tmp_path):
    """A user-defined problem agrees with an independent method in SI units."""
    path = tmp_path / "mine.toml"
    path.write_text(text)
    plain = text.replace('"20 um"', '"2e-5 m"').replace('"60 um"', '"6e-5 m"')
    plain = plain.replace(" MPa", "e6 Pa").replace("0.003e6 Pa/um", "3e9 Pa/m")
    plain = re.sub(r'"(\d+) um/s"', r'"\1e-6 m/s"', plain)
    (tmp_path / "plain.toml").write_text(plain)
    rows = second_way_rows(
        {"times": [], "report": "series", **read_stated_problem(tmp_path / "plain.toml")}
    )
    problem = read_problem(path)
    told = [[row[name] for row in rows] for name in problem.answer_column_names]
    file = write(tmp_path / "mine.csv", problem.answer_column_headings, told)
    ran = call_main("verify", file, "--problem", path)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert re.search(r"1 user-defined problem, (8|9|10|11|12) digits", ran.stdout)
    given = {"slip_rate": rows[0]["slip_rate"] * 1.01}
    spoilt = [[{**row, **given}[name] for row in rows] for name in problem.answer_column_names]
    assert (
        call_main(
            "verify", write(file, problem.answer_column_headings, spoilt), "--problem", path
        ).returncode
        == 1
    )


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("a = 0.01\n", "", "must contain a"),
        ('theta = "4 s"', "", "must contain slip_rate and theta"),
        ('"4 s"', '["4 s", "5 s"]', "must contain 1 values, one for each b"),
        ("times = [1, 2, 5, 10, 20, 50]", "", "must list the times"),
        ('"slowness"', '"sloth"', "is unknown"),
        ("[1, 2, 5,", "[2, 1, 5,", "must increase"),
        ("[1, 2, 5,", '["one", 2, 5,', "times[0] must be a number, not a string"),
        ('"slowness"', "5", "'law' must be a string, not a whole number (got 5)"),
        ('["friction", "slip_rate", "theta"]', "[]", "must list at least one quantity"),
        ("a = 0.01", "a = 0", "'a' must be positive"),
        ("times =", "digits = 99\ntimes =", "'digits' must lie between 1 and 15"),
        ("times =", "number = 1\ntimes =", "key 'number' is unknown"),
        ("[[loading]]", "[loading]", "'loading' must be a list, not a table"),
        ('"slowness"', '"two_slip_states"', "must contain b_2"),
        ("mu_star", "phi = 60.0\nmu_star", "cannot be combined with phi"),
    ],
)
def test_what_is_no_problem_is_refused(old, new, error, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(STEP.replace(old, new, 1))
    with pytest.raises(InvalidValue, match=re.escape(error)):
        read_problem(path)


def test_a_file_nested_without_end_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("title = " + "[" * 10_000)
    with pytest.raises(DataError, match="nested too deeply"):
        read_problem(path)


def test_the_number_of_peaks_is_bounded(tmp_path):
    path = tmp_path / "mine.toml"
    text = (
        STEP.replace('"friction", ', "").replace(', "theta"]', "]").replace("times = [1, 2, 5,", "")
    )
    path.write_text(re.sub(r"( 10, 20, 50\])", 'report = "peaks"\ncount = 1000000000000', text))
    with pytest.raises(InvalidValue, match="'count' must lie between 1 and 10,000"):
        read_problem(path)


# ---- what is written -----------------------------------------------------------------------------
def test_the_example_passes_a_third_with_plain_scipy(tmp_path):
    """The example solves at least a third of the problems with SciPy only.

    The example runs in a new process, and all its answers pass with a figure.
    """
    place = tmp_path / "referee"
    assert call_main("problems", place).returncode == 0
    text = (place / "example.py").read_text()
    assert "rsfstudy" not in text
    lines = [line for line in text.splitlines() if line and "import" not in line]
    assert len(lines) - 1 <= 30  # The additional line is the docstring.
    ran = subprocess.run([sys.executable, "example.py"], cwd=place, capture_output=True, text=True)
    assert (ran.returncode, ran.stderr) == (0, "")
    mine = sorted(place.glob("*.csv"))
    assert 3 * len(mine) >= len(NUMBERS)
    ran = call_main("verify", *mine, "--figure", tmp_path / "figure.png")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert re.search(rf"{len(mine)} problems of 24, (7|8|9) to 1[012] digits", ran.stdout)
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    ran = call_main("verify", *sorted((place / "answers").iterdir()))
    assert "24 problems of 24, 11 to 12 digits" in ran.stdout
    templates = sorted((place / "templates").iterdir())
    assert [t.name for t in templates] == [a.name for a in sorted((place / "answers").iterdir())]
    assert call_main("verify", templates[0]).returncode == 2
    again = call_main("problems", place)
    assert (again.returncode, " ".join(again.stderr.split())[-42:]) == (
        2,
        "there already. Choose a new directory, because existing files are not replaced."[-42:],
    )


def test_the_page_tells_of_every_problem_what_its_file_does():
    assert PAGE.read_text().partition(PROBLEMS_MARKER)[2] == "\n" + all_sections()
    for number in NUMBERS:
        assert f"### {number}. {of(number).title}" in PAGE.read_text()
