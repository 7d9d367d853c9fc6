"""Tests of the command line: printed output, files and exit statuses."""

import json
import re
import subprocess
import sys
from dataclasses import replace

import pytest
from faulty_study import faulty_study
from study_runs import SMALL_STUDY as LATTICE
from study_runs import call_main, example_claim, named_results

import rsfstudy
from rsfstudy.cli import assignment_parsing
from rsfstudy.motion import engine_factory
from rsfstudy.storage import dataset_files
from rsfstudy.study import named_study_index, study_loader

NAME = "rate_step_boundary"
SMALL = ["--serial", "--set", "b_over_a=2,3,5"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Run the command in a new process, as a user would do."""
    output = tmp_path_factory.mktemp("outputs")
    command = [sys.executable, "-m", "rsfstudy.cli.command_line", "run", NAME, *SMALL]
    command += ["--output", output]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    return output, ran.stdout


def test_run_writes_the_dataset_and_the_figure_and_prints_what_it_found(results):
    output, said = results
    assert {file.name for file in output.iterdir()} == {
        f"{NAME}.nc",
        f"{NAME}.png",
        f"{NAME}.cells.sqlite",
    }
    assert (output / f"{NAME}.png").read_bytes().startswith(b"\x89PNG")
    for words in (
        "zeta",
        "0.9999",
        "C6",
        "C7",
        "reproduced",
        "9 ok",
        "right-hand-side evaluations",
    ):
        assert words in said


def test_check_a_name_and_a_file(results):
    output, _said = results
    assert call_main("check", NAME, "--output", output).returncode == 0
    assert call_main("check", output / f"{NAME}.nc").returncode == 0


def test_check_all_checks_what_is_there_and_names_what_is_not(results):
    output, _said = results
    checked = call_main("check", "--all", "--output", output)
    others = [name for name in rsfstudy.studies() if name != NAME]
    assert checked.returncode == (1 if others else 0)
    assert "C7" in checked.stdout
    for name in others:
        assert f"{name}: not run yet" in checked.stdout


def test_check_fails_when_a_verdict_moves(tmp_path, tmp_path_factory):
    moved, _path = named_results(NAME, tmp_path_factory)
    moved["zeta"] = moved["zeta"] + 0.5
    dataset_files.write_dataset(moved, tmp_path / "moved.nc")
    checked = call_main("check", tmp_path / "moved.nc")
    assert checked.returncode == 1
    assert "differs, expected reproduced" in checked.stdout


@pytest.mark.parametrize(
    "settings",
    [
        ["--set", "b_over_a=1.5:3:3", "--set", "phi=55,60"],
        ["--set", "b_over_a=1.5"],
        ["--set", "b_over_a=2,3", "--set", "case=alpha = 0.56"],
        ["--set", "b_over_a=2,3", "--set", "alpha=0.3"],
    ],
)
def test_other_lattices_run_check_and_plot_and_say_what_they_are(settings, tmp_path):
    """Both commands print the number of checked claims.

    If no claim applies, ``check`` fails.
    """
    ran = call_main("run", NAME, "--serial", *settings, "--output", tmp_path)
    assert ran.returncode == 0, ran.stderr
    checked = call_main("check", NAME, "--output", tmp_path)
    counted = next(line for line in checked.stdout.splitlines() if " of 6 claims checked" in line)
    assert counted in ran.stdout
    nothing = counted.endswith(": no published values for overrides or other units")
    assert checked.returncode == int(nothing), checked.stderr
    drawn = call_main("plot", NAME, "--output", tmp_path)
    assert drawn.returncode == 0, drawn.stderr
    assert "overrides: " in ran.stdout
    assert settings[1].split("=")[0] in ran.stdout
    # A fit of a slope needs more than one point.
    few = "no zeta: too few suitable cells, with 0.25 <= a_over_b_minus"
    assert (few in " ".join(ran.stdout.split())) == (settings[1] == "b_over_a=1.5")


def test_a_claim_that_is_named_must_apply(tmp_path):
    """Claim C6 consists of a slope and a value.

    The slope is not applicable because cells of its range are missing, but the value at b/a
    = 2 is checked.
    """
    dataset = rsfstudy.run(NAME, workers=0, output=None, progress=False, b_over_a=[2, 3])
    dataset_files.write_dataset(dataset, tmp_path / "few.nc")
    everything = call_main("check", tmp_path / "few.nc")
    assert everything.returncode == 0
    assert "2 of 6 claims checked: 2 reproduced, 4 not applicable" in everything.stdout
    named = call_main("check", tmp_path / "few.nc", "--claim", "C6")
    assert named.returncode == 1
    assert "1 of 2 claims checked" in named.stdout
    unknown = call_main("check", tmp_path / "few.nc", "--claim", "C99")
    assert unknown.returncode == 2
    assert "C6, C7" in " ".join(unknown.stderr.split())


def test_list_and_show():
    listed = call_main("list")
    assert listed.returncode == 0
    said = " ".join(listed.stdout.split())
    for name, study in rsfstudy.studies().items():
        assert f"{name} {study.title}" in said
    shown = call_main("show", NAME, "--set", "b_over_a=2,3")
    assert shown.returncode == 0
    assert ["number", "of", "cells", "6"] in [line.split() for line in shown.stdout.splitlines()]
    assert "right-hand-side evaluations" in shown.stdout


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("b_over_a=2", 2.0),
        ("b_over_a=2,3.5", [2.0, 3.5]),
        ("b_over_a=1:2:3", [1.0, 1.5, 2.0]),
        ("b_over_a=1:100:3:log", [1.0, 10.0, 100.0]),
        ("law=slip,slowness", ["slip", "slowness"]),
        ("inertia=true,false", [True, False]),
    ],
)
def test_settings(text, values):
    assert assignment_parsing.parse_axis_assignment(text, ())[1] == values


def test_a_label_may_hold_commas_and_colons(tmp_path):
    label = "rigid, V = 1e12 V_*"
    ran = call_main(
        "run", "hard_cases", "--set", f"hard_case={label}", "--output", tmp_path, "--serial"
    )
    assert ran.returncode == 0, ran.stderr
    assert rsfstudy.open("hard_cases", tmp_path).hard_case.values.tolist() == [label]
    several = assignment_parsing.parse_axis_assignment(
        f"hard_case={label},other , {label}", (label, "rigid")
    )
    assert several == ("hard_case", [label, "other", label])


# ---- several studies, one after the other -------------------------------------------------------
def replace_everywhere(monkeypatch, function, other):
    """Replace a function in all modules of rsfstudy that have imported it."""
    for module in [m for n, m in sys.modules.items() if n.startswith("rsfstudy.")]:
        for name in [
            n for n, value in getattr(module, "__dict__", {}).items() if value is function
        ]:
            monkeypatch.setattr(module, name, other)


@pytest.fixture
def catalogued(monkeypatch):
    """Return a function that replaces the named studies."""

    def named(*studies):
        by_name, load = {study.name: study for study in studies}, study_loader.load_study
        replace_everywhere(monkeypatch, named_study_index.list_study_names, lambda: tuple(by_name))
        replace_everywhere(monkeypatch, load, lambda name: by_name.get(name) or load(name))

    return named


def rows(said: str) -> dict[str, list[str]]:
    """Return the rows of the last table by their first column."""
    lines = said.rpartition("───\n")[2].splitlines()
    cells = [re.split(r"\s{2,}", line.strip()) for line in lines if line.strip()]
    return {first: others for first, *others in cells}


def test_run_all_goes_on_whatever_becomes_of_a_study(catalogued, tmp_path, monkeypatch):
    """``run --all`` continues after a failure and prints a summary table.

    The failures are a failed cell, a changed verdict, an impossible figure, and a run that
    cannot start.
    """
    monkeypatch.setenv("COLUMNS", "150")
    claim = example_claim(variable="total", where={"b_over_a": 2.0}, published=3.0)
    catalogued(
        replace(faulty_study("raises", at=(2.5,)), name="failing"),
        replace(faulty_study(), name="moving", claims=[claim]),
        replace(faulty_study(), name="undrawn", plot="no_such_figure"),
        replace(faulty_study(), name="taken"),
        replace(faulty_study(), name="fine"),
    )
    (tmp_path / "taken.cells.sqlite").write_text("something else")
    ran = call_main("run", "--all", "--serial", "--output", tmp_path)
    assert ran.returncode == 1
    assert "taken.cells.sqlite" in ran.stderr.replace("\n", "")
    ended = rows(ran.stdout)
    assert {name: row[-1] for name, row in ended.items()} == {
        "failing": "1 cell_raised",
        "moving": "verdict of C1 changed",
        "undrawn": "no figure",
        "taken": "not finished",
        "fine": "ok",
    }
    assert ended["moving"][1] == "1 differs"
    assert (tmp_path / "fine.nc").exists()
    again = call_main("run", "--all", "--serial", "--output", tmp_path, "--json")
    found = {one["study"]: one for one in json.loads(again.stdout)["studies"]}
    assert again.returncode == 1
    assert {name: one["outcome"] for name, one in found.items()} == {
        "failing": "failed",
        "moving": "failed",
        "undrawn": "failed",
        "taken": "not_finished",
        "fine": "ok",
    }
    assert found["moving"]["problems"] == ["verdict of C1 changed"]
    assert "taken.cells.sqlite" in found["taken"]["message"]
    assert found["taken"]["results"] is None


@pytest.fixture
def without_numba(monkeypatch):
    """Simulate an environment without Numba."""
    monkeypatch.setitem(sys.modules, "rsfstudy.motion.compiled.numba_backend", None)
    engine_factory.import_compiled_engine.cache_clear()
    yield
    engine_factory.import_compiled_engine.cache_clear()


def compiled(**fields):
    study = faulty_study()
    return replace(study, accuracy=replace(study.accuracy, engine="compiled"), **fields)


def test_run_all_names_the_studies_it_leaves_out(catalogued, tmp_path, monkeypatch, without_numba):
    """Without Numba, a study that needs it is skipped without a failure."""
    monkeypatch.setenv("COLUMNS", "150")
    catalogued(compiled(name="dear"), replace(faulty_study(), name="plain"))
    ran = call_main("run", "--all", "--serial", "--output", tmp_path)
    assert ran.returncode == 0, ran.stderr
    said, short = (
        "skipped: requires Numba (pip install 'rsfstudy[fast]')",
        "skipped: requires Numba",
    )
    assert f"dear: {said}" in ran.stdout
    ended = {name: row[-1] for name, row in rows(ran.stdout).items()}
    assert ended == {"plain": "ok", "dear": short}
    assert not list(tmp_path.glob("dear*"))
    again = call_main("run", "--all", "--serial", "--output", tmp_path, "--json")
    plain, dear = json.loads(again.stdout)["studies"]
    assert (plain["outcome"], dear["outcome"], dear["seconds"]) == ("ok", "skipped", None)
    checked = call_main("check", "--all", "--output", tmp_path)
    assert f"dear: {said}" in checked.stdout
    assert "not run yet" not in checked.stdout


def test_what_is_asked_for_is_not_left_out(catalogued, tmp_path, without_numba):
    """An explicit request raises an error with a remedy before any work.

    The request is a single study, or the compiled engine.
    """
    catalogued(compiled(name="dear"), replace(faulty_study(), name="plain"))
    for words in (["dear"], ["--all", "--engine", "compiled"]):
        ran = call_main("run", *words, "--serial", "--output", tmp_path / "o")
        assert ran.returncode == 2
        assert "pip install 'rsfstudy[fast]'" in " ".join(ran.stderr.split())
        assert not (tmp_path / "o").exists()


def test_ctrl_c_ends_all_studies(catalogued, tmp_path):
    interrupted = replace(faulty_study("interrupts", at=(2.5,)), name="interrupted")
    catalogued(
        replace(faulty_study(), name="before"), interrupted, replace(faulty_study(), name="after")
    )
    ran = call_main("run", "--all", "--serial", "--output", tmp_path)
    assert ran.returncode == 1
    assert "cells are finished and stored" in ran.stderr
    assert list(rows(ran.stdout)) == ["before"]
    assert not (tmp_path / "after.cells.sqlite").exists()


def test_wrong_usage_of_a_later_study_is_told_before_any_work(catalogued, tmp_path):
    catalogued(LATTICE, faulty_study())
    ran = call_main(
        "run", "--all", "--serial", "--set", "case=constant", "--output", tmp_path / "o"
    )
    assert ran.returncode == 2
    assert "case" in ran.stderr
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize(
    ("duration", "budget", "status", "said"),
    [
        ("100", 5000, 0, ""),
        ("116", 5000, 3, "warning: the slip rate exceeds the instability norm after 114.5"),
        ("100", 200, 1, ""),
    ],
)
def test_exit_statuses_of_a_motion(duration, budget, status, said, tmp_path):
    """The exit status depends on the reason for the end of the motion.

    The three motions end with the hold, after the pulse that follows, and when the work
    budget is exhausted. Each message appears in one stream only.
    """
    words = {"law": "slowness", "normal_stress": "constant", "b_over_a": 1.5, "hold_time": 100}
    settings = [word for name, value in words.items() for word in ("--set", f"{name}={value}")]
    least = ("--duration", duration, "--budget", budget, "--engine", "compiled")
    least += ("--quiet",) * (status == 1)
    ran = call_main("simulate", *settings, *least, "--output", tmp_path / "motion.png")
    assert ran.returncode == status
    assert ("peak friction" in ran.stdout) is (status != 1)
    assert said in ran.stderr
    assert ("budget" in ran.stdout) is (status == 1)
    assert len(ran.stderr.splitlines()) == (status == 3)
    assert ("no physical meaning after 114.5" in " ".join(ran.stdout.split())) is (status == 3)


def test_a_motion_that_cannot_begin_is_told(tmp_path):
    output = tmp_path / "motion.png"
    ended = call_main("simulate", "--set", "displacement_step=-200", "--output", output)
    assert (ended.returncode, ended.stderr) == (1, "")
    assert "normal_stress_lost" in ended.stdout
    assert "the motion has no points" in ended.stdout
    assert not output.exists()
