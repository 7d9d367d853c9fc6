"""Tests of the commands ``show``, ``report``, ``plot`` and ``export`` for every kind of file."""

import json
from pathlib import Path

import pytest
from study_runs import call_main

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.errors import DataError
from rsfstudy.measures import LinearStability

PAGES = Path(__file__).parents[1] / "studies" / "pages"
SCENE = Scene(normal_stress="constant", hold_time=1000, stiffness_ratio=10)


def write_results(path):
    study = Study(
        name="example", title="Critical stiffness", base=Scene(normal_stress="constant", a=0.01),
        axes=[Axis("b_over_a", [1.5, 2.0])], measure=LinearStability(),
    )  # fmt: skip
    rsfstudy.run(study, workers=0, output=path.parent, progress=False)
    (path.parent / "example.nc").rename(path)


def write_fit(path):
    options = ["--normal-stress", "20 MPa", "--end", "130 s", "--stiffness", "0.04 MPa/um"]
    figure = path.with_suffix(".png")
    ran = call_main("fit", str(PAGES / "step.csv"), *options, "--law", "slowness",
                    "--output", str(figure))  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    figure.unlink()


def write_motion(path):
    rsfstudy.simulate(SCENE, duration=1100.0).to_netcdf(path)


def write_cycle(path):
    scene = Scene(normal_stress="constant", stiffness_ratio=0.8, radiation_damping=1e-4)
    rsfstudy.limit_cycle(scene).to_netcdf(path)


def write_events(path):
    rsfstudy.simulate(SCENE, duration=1100.0).rsf.events().to_netcdf(path)


def write_healing(path):
    figure = path.with_name("healing.png")
    ran = call_main("healing", str(PAGES / "holds.csv"), "--output", str(figure))
    assert ran.returncode == 0, ran.stderr
    figure.with_suffix(".nc").rename(path)
    figure.unlink()


def write_holds(path):
    rsfstudy.simulate(SCENE, duration=1100.0).rsf.holds().to_netcdf(path)


def write_record_table(name):
    def write(path):
        getattr(rsfstudy.read_record(PAGES / "holds.csv"), name)().to_netcdf(path)

    return write


#: For each kind of file: function that writes it, kind in the JSON output, text in the summary.
KINDS = {
    "results": (write_results, "results", "Critical stiffness"),
    "fit": (write_fit, "fit", "effective sample size"),
    "motion": (write_motion, "motion", "peak friction"),
    "cycle": (write_cycle, "scene", "period"),
    "events": (write_events, "table", "no event faster than"),
    "healing": (write_healing, "table", "per decade of hold duration"),
    "holds": (write_holds, "table", "healing rate: unknown"),
    "steps": (write_record_table("steps"), "table", "velocity_before (um s-1)"),
    "stiffness": (write_record_table("stiffness"), "table", "portion_stiffness (um-1)"),
    "record": (write_record_table("to_dataset"), "table", "displacement (um)"),
}


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    directory = tmp_path_factory.mktemp("files")
    for name, (write, _kind, _text) in KINDS.items():
        write(directory / f"{name}.nc")
    return directory


@pytest.mark.parametrize("name", KINDS)
def test_show_prints_every_file(directory, name):
    _write, kind, text = KINDS[name]
    ran = call_main("show", str(directory / f"{name}.nc"))
    assert ran.returncode == 0, ran.stderr
    assert text in ran.stdout
    ran = call_main("show", str(directory / f"{name}.nc"), "--json")
    assert json.loads(ran.stdout)["kind"] == kind


def test_a_report_contains_every_file(directory):
    ran = call_main("report", str(directory))
    assert ran.returncode == 0, ran.stderr
    page = (directory / "report.html").read_text()
    assert "cannot be read" not in page
    assert "no figure" not in page
    assert all(text in page for _write, _kind, text in KINDS.values())


@pytest.mark.parametrize("name", [name for name, of in KINDS.items() if of[1] == "table"])
def test_tables_are_exported_but_are_not_results(directory, name, tmp_path):
    file = directory / f"{name}.nc"
    ran = call_main("export", str(file), "--csv", "--mat", "--output", str(tmp_path / "t"))
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "t.csv").read_text().count("\n") > 0
    with pytest.raises(DataError, match=r"not the results of a study.*rsfstudy show"):
        rsfstudy.open(file)
    ran = call_main("plot", str(file), "--output", str(tmp_path / "t.png"))
    assert ran.returncode == (0 if name in ("healing", "holds") else 2)
    assert "rsfstudy show" in ran.stderr or (tmp_path / "t.png").is_file()
