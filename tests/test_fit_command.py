"""Tests of the command ``fit``: output, figures, files and column names."""

import math
import re
import shlex
import shutil

import numpy as np
import pytest
import synthetic_records as synthetic
import xarray as xr
from site_pages import PAGES, find_page
from study_runs import call_main

import rsfstudy
from rsfstudy.reporting import fit_tables
from rsfstudy.reporting.fit_summaries import format_parameter_with_stderr
from rsfstudy.status import Status

#: True parameters of the records below, for the slowness law and 1 -> 10 -> 1 um/s.
TRUE = {"a": 0.010, "b": 0.013, "slip_distance": 12.0, "mu_star": 0.6, "trend1": -5e-6}
STIFFNESS = 2e-3
COLUMNS = "time=t (s),displacement=lp (um),friction=mu"
FIT = ("--columns", COLUMNS, "--stiffness", f"{STIFFNESS} /um", "--law", "slowness")


def rows() -> np.ndarray:
    """Return the columns of a record of two velocity steps.

    The columns are time, load point displacement and friction. The noise has a correlation
    of 0.8.
    """
    loading = ((0.0, 1.0), (100.0, 10.0), (140.0, 1.0))
    times = [np.arange(0.0, 100.0, 0.5), 100.0 + 0.1 * np.arange(400), np.arange(140.0, 440.0, 0.5)]
    time = np.concatenate(times)
    place = synthetic.load_point_displacement(loading, time)
    friction = synthetic.friction_and_sensitivities(
        "slowness", time, loading, TRUE | {"stiffness": STIFFNESS}
    )[0]
    noise = synthetic.correlated_noise(len(time), 0.8, 3e-4, 0)
    return np.column_stack([time, place, friction + TRUE["trend1"] * place + noise])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Create a directory with a record, its fits, and the command output."""
    here = tmp_path_factory.mktemp("fits")
    with (here / "record.csv").open("w") as file:
        file.write("t (s),lp (um),mu\n")
        file.writelines("{:.2f},{:.3f},{:.6f}\n".format(*row) for row in rows())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "80")
        patch.chdir(here)
        ran = call_main("fit", "record.csv", *FIT)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return here, ran.stdout


def test_it_prints_the_steps_and_a_table_that_is_never_broken(written):
    _here, said = written
    assert re.search(r"record: 1,200 rows, 2 steps", said)
    steps = re.findall(r"^ +[12] +(\d+) +0 ", said, re.MULTILINE)
    assert steps == ["100", "140"]
    for name in ("a", "b", "a_minus_b", r"Dc \(um\)", "mu_0", r"trend \(1/um\)"):
        row = rf"^{name} +\S.* \+- \S.*$"
        assert len(re.findall(row, said, re.MULTILINE)) == 2, name
    short = said.split("All fits:")[1]
    assert (
        len(re.findall(r"^ +[12] +slowness( +[\d.]+ \+- [\d.]+){3} +ok", short, re.MULTILINE)) == 2
    )
    assert "whitened residuals show no autocorrelation up to lag" in said
    assert max(len(line.rstrip()) for line in said.splitlines()) <= 80


def test_what_it_finds_is_what_the_record_was_made_of(written):
    """Parameters agree with the true values within 4 standard errors.

    A larger deviation in any of 8 parameters occurs once in 2,000 records.
    """
    here, _said = written
    found = rsfstudy.open(here / "fit.nc")
    for name in ("a", "b", "slip_distance", "trend1"):
        for one in fit_tables.split_into_single_fits(found):
            off = (one[name].item() - TRUE[name]) / one[f"{name}_stderr"].item()
            assert abs(off) < 4.0, (name, off)


def test_its_file_is_shown_drawn_and_exported(written):
    here, said = written
    file = str(here / "fit.nc")
    shown = call_main("show", file)
    assert shown.returncode == 0
    fixed = re.search(
        r"^fixed fields .*?^fields equal", shown.stdout, re.MULTILINE | re.DOTALL
    ).group()
    assert "normal_stress = constant" in fixed
    # The fit has determined the other fields, or replaced them by the values of the record.
    for name in ("a", "b_over_a", "mu_star", "stiffness", "reference_rate"):
        assert not re.search(rf"\b{name} =", fixed), name
    table = [line for line in said.splitlines() if "+-" in line]
    assert table
    assert all(line.rstrip() in map(str.rstrip, shown.stdout.splitlines()) for line in table)
    assert "command rsfstudy fit record.csv" in " ".join(shown.stdout.split())
    assert (here / "fit.png").read_bytes().startswith(b"\x89PNG")
    drawn = call_main("plot", file, "--output", str(here / "again.pdf"))
    assert drawn.returncode == 0, drawn.stderr
    assert "drawn as lines" not in drawn.stderr
    assert call_main("export", file, "--csv").returncode == 0
    assert "slip_distance_stderr" in (here / "fit.csv").read_text().splitlines()[0]
    assert call_main("check", file).returncode == 0
    units = rsfstudy.open(file).rsf.fit_table().attrs["units"]
    told = {"a_stderr": "1", "Dc": "um", "Dc_stderr": "um", "trend": "um-1", "k": "um-1"}
    assert told.items() <= units.items()
    assert units["V0"] == "um s-1"
    assert "law" not in units


def test_steps_fitted_together_have_one_law_and_a_curve_each(written, tmp_path, monkeypatch):
    here, _said = written
    monkeypatch.chdir(tmp_path)
    ran = call_main("fit", str(here / "record.csv"), *FIT, "--together")
    assert ran.returncode == 0, ran.stderr
    assert "step 1 of record, step 2 of record" in " ".join(ran.stdout.split())
    for name in ("a", r"Dc \(um\)", "mu_0_1", "mu_0_2", r"trend_2 \(1/um\)"):
        assert len(re.findall(rf"^{name} +\S", ran.stdout, re.MULTILINE)) == 1, name
    found = rsfstudy.open(tmp_path / "fit.nc").squeeze()
    assert found.rsf.scene.mu_star == float(found.mu_star_1)  # The scene belongs to the first step.
    figure = rsfstudy.open(tmp_path / "fit.nc").rsf.plot()
    curves = [line for line in figure.axes[0].lines if line.get_label() == "slowness law"]
    symbols = [text.get_text() for text in figure.axes[-1].get_xticklabels()]
    assert len(curves) == 1  # Consecutive windows are drawn as a single curve.
    assert symbols[3:] == [
        rf"${name}^{{({n})}}$" for n in "12" for name in (r"\mu_0", r"\mathrm{trend}")
    ]


def test_a_rerun_says_what_it_lacks(written):
    here, _said = written
    for words in ((), ("--cell", "step=1")):
        ran = call_main("rerun", str(here / "fit.nc"), "--serial", *words)
        assert ran.returncode == 2
        assert "Fit the records again" in " ".join(ran.stderr.split())


def test_a_file_that_is_not_there_is_told():
    ran = call_main("fit", "nowhere.csv", *FIT)
    assert (ran.returncode, ran.stderr.strip()) == (1, "error: the file nowhere.csv does not exist")


def test_files_of_others_are_not_replaced(written, tmp_path):
    here, _said = written
    (tmp_path / "fit.nc").write_text("mine")
    ran = call_main("fit", str(here / "record.csv"), *FIT, "--output", str(tmp_path / "fit.png"))
    assert ran.returncode == 2
    assert "does not contain a fit" in " ".join(ran.stderr.split())
    assert (tmp_path / "fit.nc").read_text() == "mine"


def test_a_stiffness_of_stress_is_taken_over_normal_stress(written):
    here, _said = written
    record = rsfstudy.read_record(
        here / "record.csv",
        {"time": ("t (s)", "s"), "displacement": "lp (um)", "friction": "mu"},
        normal_stress="20 MPa",
    )
    assert record.name == "record"
    options = {"laws": ["slowness"], "steps": [1], "free": ["mu_star"], "noise": "white"}
    fits = [
        rsfstudy.fit(
            record, stiffness=stated, a=0.01, b_over_a=1.3, slip_distance="12 um", **options
        )
        for stated in (STIFFNESS, "2e-3 /um", "0.04 MPa/um", "2 1/mm")
    ]
    found = [float(one.mu_star[0]) for one in fits]
    assert found == pytest.approx([found[0]] * 4, rel=1e-12)


def test_a_number_has_the_digits_that_its_error_gives_it():
    def told(value, error, status=0):
        return format_parameter_with_stderr(
            xr.Dataset({"x": value, "x_stderr": error, "status": status}), "x"
        )

    assert told(0.0100312, 0.00011) == "0.01003 +- 0.00011"
    assert told(12.345, 0.14) == "12.35 +- 0.14"
    assert told(12.345, 0.14, Status.ERRORS_NOT_VALID) == "12.35 +- 0.14*"
    assert told(math.nan, math.nan, Status.ERRORS_NOT_VALID) == "-"
    assert told(1234.5, 120.0) == "1234 +- 120"
    assert told(-5.29e-6, 3.7e-7) == "(-5.29 +- 0.37)e-06"
    assert told(1e-9, 4e-7) == "(0.0 +- 4.0)e-07"
    assert told(3.0, math.inf) == "unconstrained"
    assert told(3.0, 0.0) == "3 +- 0"
    assert told(math.nan, math.nan) == "-"
    assert told(1e-4, 1e7) == "unconstrained"


#: A number and its error as printed, with an optional power of ten.
NUMBER = re.compile(r"\(?(-?[\d.]+) \+- ([\d.]+)\)?(?:e[+-]\d+)?")


def test_the_page_prints_what_the_command_does(tmp_path, monkeypatch):
    """The output agrees with the page.

    Numbers are compared to a tenth of their errors, and texts without column widths. Other
    machines may round the last digit differently, and other versions of rich choose other
    widths.
    """
    block = find_page("<!-- fit command -->").split("<!-- fit command -->")[1]
    command, told = re.findall(r"```(?:sh|text)\n(.*?)```", block, re.DOTALL)[:2]
    shutil.copy(PAGES / "step.csv", tmp_path)
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(command)[1:])
    assert ran.returncode == 0, ran.stderr
    ours, theirs = (
        [line.rstrip() for line in text.strip("\n").splitlines()] for text in (ran.stdout, told)
    )
    assert len(ours) == len(theirs)
    for one, other in zip(ours, theirs, strict=True):
        assert re.sub(r"[\d.]+|─", "", one).split() == re.sub(r"[\d.]+|─", "", other).split()
        for (value, error), (said, beside) in zip(
            NUMBER.findall(one), NUMBER.findall(other), strict=True
        ):
            assert float(value) == pytest.approx(float(said), abs=0.1 * float(beside))
            assert float(error) == pytest.approx(float(beside), rel=0.1)


def test_the_page_shows_the_healing_of_its_record(tmp_path, monkeypatch):
    block = find_page("<!-- healing command -->").split("<!-- healing command -->")[1]
    command, told = re.findall(r"```(?:sh|text)\n(.*?)```", block, re.DOTALL)[:2]
    shutil.copy(PAGES / "holds.csv", tmp_path)
    monkeypatch.chdir(tmp_path)
    ran = call_main(*shlex.split(command)[1:])
    assert ran.returncode == 0, ran.stderr
    assert re.sub(r"[\d.]+|─|\s", "", ran.stdout) == re.sub(r"[\d.]+|─|\s", "", told)
    pairs = zip(NUMBER.findall(ran.stdout), NUMBER.findall(told), strict=True)
    for (value, error), (said, beside) in pairs:
        assert float(value) == pytest.approx(float(said), abs=0.1 * float(beside))
        assert float(error) == pytest.approx(float(beside), rel=0.1)
    assert (tmp_path / "healing.png").read_bytes().startswith(b"\x89PNG")


def test_healing_of_a_record_without_holds(tmp_path, monkeypatch):
    shutil.copy(PAGES / "step.csv", tmp_path)
    monkeypatch.chdir(tmp_path)
    ran = call_main("healing", "step.csv", "--normal-stress", "20 MPa")
    assert ran.returncode == 2
    assert "has no hold of the load point" in ran.stderr


def test_the_page_says_how_good_its_fit_is(tmp_path, monkeypatch):
    monkeypatch.chdir(PAGES)
    record = rsfstudy.read_record("step.csv", normal_stress="20 MPa")
    found = rsfstudy.fit(record, stiffness="0.04 MPa/um", steps=[1], after="200 um")
    right, wrong = found.sel(law="slowness"), found.sel(law="slip")
    at_step = TRUE["mu_star"] + 100.0 * TRUE["trend1"]
    for name, true in (TRUE | {"mu_star": at_step}).items():
        assert abs(float(right[name]) - true) < 2.0 * float(right[f"{name}_stderr"]), name
    off = float(wrong.slip_distance) - TRUE["slip_distance"]
    assert 7.0 < off / float(wrong.slip_distance_stderr) < 9.0
    assert float(wrong.aic - right.aic) == pytest.approx(48.6, abs=0.5)
