"""Tests of the files of motions, and of the commands that read them."""

import re
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import loadmat
from study_runs import call_main, study_of

import rsfstudy
from rsfstudy import Scene
from rsfstudy.cli import export_files
from rsfstudy.errors import DataError
from rsfstudy.execution import provenance
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.storage import dataset_files

SCENE = Scene(stiffness_ratio=0.5, load_velocity_ratio=10.0, inertia=True)
RIG = ("--normal-stress", "5 MPa", "--slip-distance", "10 um", "--reference-velocity", "1 um/s")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Create files of motions, in slider units and in rig units."""
    place = tmp_path_factory.mktemp("motions")
    fields = ("--set", "stiffness_ratio=0.5", "--set", "load_velocity_ratio=10")
    common = ("simulate", *fields, "--set", "inertia=yes", "--engine", "compiled")
    for name, rest in (("plain", ("--duration", "8")), ("rig", ("--duration", "80 s", *RIG))):
        ran = call_main(*common, *rest, "--output", place / f"{name}.png")
        assert ran.returncode == 0, ran.stderr
        assert "stiffness is 0.5 times the critical" in ran.stdout
        assert "Events faster than 100 V_*" in ran.stdout
    asked = rsfstudy.simulate(SCENE, times=[1.0, 2.0], engine="compiled")
    dataset_files.write_dataset(asked, place / "asked.nc")
    dataset_files.write_dataset(
        rsfstudy.limit_cycle(SCENE, rtol=1e-3, engine="compiled"), place / "cycle.nc"
    )
    return place


def test_a_motion_names_version_commit_date_and_command(place):
    with xr.open_dataset(place / "rig.nc") as motion:
        source, history = motion.attrs["source"], motion.attrs["history"]
    assert re.match(rf"rsfstudy {re.escape(provenance.version('rsfstudy'))}, commit \w+", source)
    assert re.match(r"\d{4}-\d\d-\d\dT\S+ .*simulate .*load_velocity_ratio=10", history)
    with xr.open_dataset(place / "cycle.nc") as cycle:
        assert cycle.attrs["history"].endswith(" rsfstudy.limit_cycle")


@pytest.mark.parametrize("name", ["plain", "rig"])
def test_commands_take_files_of_motions(place, tmp_path, name):
    shown = call_main("show", place / f"{name}.nc")
    assert shown.returncode == 0, shown.stderr
    for text in ("stiffness_ratio = 0.5", "command 20", "peak friction", "Events faster than"):
        assert text in " ".join(shown.stdout.split())
    figures = [tmp_path / f"{against}.svg" for against in ("time", "displacement")]
    for figure in figures:
        drawn = call_main(
            "plot", place / f"{name}.nc", "--against", figure.stem, "--output", figure
        )
        assert drawn.returncode == 0, drawn.stderr
    first, second = (figure.read_text() for figure in figures)
    assert first != second
    again = call_main("rerun", place / f"{name}.nc")
    assert again.returncode == 0, again.stdout + again.stderr
    assert "all numbers are identical" in again.stdout


def test_a_motion_that_differs_is_told(place, tmp_path):
    motion = xr.load_dataset(place / "plain.nc")
    motion["slip"] = motion["slip"] * (1.0 + 1e-9)
    dataset_files.write_dataset(motion, tmp_path / "other.nc")
    table = rsfstudy.rerun(tmp_path / "other.nc").set_index("variable")
    assert table.loc["slip", "identical"] < table.loc["slip", "values"]
    assert table.loc["shear_stress", "identical"] == table.loc["shear_stress", "values"]


@pytest.mark.parametrize(
    ("name", "why", "call"),
    [
        ("asked", "output at requested times", "simulate(dataset.rsf.scene, times=..., "),
        ("cycle", "Limit cycle of a spring-slider, slip law", "limit_cycle(dataset.rsf.scene, "),
    ],
)
def test_what_cannot_be_computed_again_says_what_is_and_how(place, name, why, call):
    with pytest.raises(DataError, match="motions that rsfstudy.simulate") as refused:
        rsfstudy.rerun(place / f"{name}.nc")
    assert f"{why})" in str(refused.value)
    assert f"rsfstudy.{call}rtol=" in str(refused.value)


def test_other_programs_read_what_is_exported(place, tmp_path):
    motion = xr.load_dataset(place / "rig.nc")
    for form in ("csv", "mat"):
        file = tmp_path / f"motion.{form}"
        ran = call_main("export", place / "rig.nc", f"--{form}", "--output", file)
        assert ran.returncode == 0, ran.stderr
        assert call_main("export", place / "rig.nc", f"--{form}", "--output", file).returncode == 2
    table = pd.read_csv(tmp_path / "motion.csv")
    np.testing.assert_allclose(table["shear_stress (MPa)"], motion["shear_stress"], rtol=1e-15)
    # The reference rate is constant and therefore not a column.
    assert not any(name.startswith("reference_rate") for name in table)
    read = rsfstudy.read_table(tmp_path / "motion.csv")
    units = {"time": "s", "slip": "um", "slip_rate": "um s-1", "log10_slip_rate": "1"}
    assert {name: read[name].units for name in units} == units
    mat = loadmat(tmp_path / "motion.mat", squeeze_me=True)
    np.testing.assert_array_equal(mat["slip"], motion["slip"])
    assert mat["reference_rate"] == pytest.approx(0.1, rel=1e-15)  # V_*/D_c, to rounding error.
    assert str(mat["units"]["shear_stress"]) == "MPa"
    assert "simulate" in str(mat["attributes"]["history"])
    assert call_main("export", place / "rig.nc").returncode == 2  # The file format is missing.
    shutil.copy(place / "rig.nc", tmp_path / "both.nc")
    both = call_main("export", tmp_path / "both.nc", "--csv", "--mat")
    assert both.returncode == 0, both.stderr
    assert (tmp_path / "both.csv").read_bytes() == (tmp_path / "motion.csv").read_bytes()
    assert loadmat(tmp_path / "both.mat").keys() == mat.keys()
    one = call_main("export", place / "rig.nc", "--csv", "--mat", "--output", tmp_path / "one.csv")
    assert one.returncode == 0, one.stderr
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "motion.csv").read_bytes()
    assert (tmp_path / "one.mat").exists()


def test_codes_are_words_in_a_table(tmp_path):
    values = xr.DataArray([20, 0], dims="time", attrs={"flag_values": [0, 20]})
    values.attrs["flag_meanings"] = "ok work_budget_spent"
    dataset = xr.Dataset({"status": values}, {"time": [0.0, 1.0]}, {"scene": "{}"})
    export_files.to_csv(dataset, tmp_path / "it.csv")
    assert pd.read_csv(tmp_path / "it.csv")["status"].tolist() == ["work_budget_spent", "ok"]


def test_a_table_has_no_columns_that_never_change():
    motion = rsfstudy.simulate(SCENE, duration=1.0, engine="compiled")
    table = motion.rsf.to_dataframe()
    assert len(table) == motion.sizes["time"]
    assert "reference_rate" not in table
    assert table.attrs["constant"]["reference_rate"] == SCENE.reference_rate
    (row,) = rsfstudy.limit_cycle(SCENE, rtol=1e-3, engine="compiled").rsf.to_dataframe().to_dict(
        "records"
    )  # fmt: skip
    assert row["recurrence_interval"] > 0.0


def test_a_table_of_a_study_has_a_row_a_cell():
    axis = rsfstudy.Axis("stiffness_ratio", [0.5, 0.6, 0.7])
    measure = LimitCycle(phases=5)
    study = study_of("three", measure, axis, base=SCENE)
    results = rsfstudy.run(
        study, workers=0, output=None, progress=False, engine="compiled", rtol=1e-3
    )
    table = results.rsf.to_dataframe()
    assert table["stiffness_ratio"].tolist() == [0.5, 0.6, 0.7]
    assert "load_velocity_ratio" not in table
    assert table["status"].tolist() == [0, 0, 0]
    np.testing.assert_array_equal(table["static_stress_drop"], results["static_stress_drop"])


def test_the_columns_of_a_table_do_not_depend_on_the_results():
    """A study without any limit cycle has the same columns as a study with limit cycles."""
    tables = []
    for ratios in ([0.5, 0.6], [2.0, 3.0]):
        study = study_of(
            "two",
            LimitCycle(phases=2),
            rsfstudy.Axis("stiffness_ratio", ratios),
            base=SCENE,
        )
        results = rsfstudy.run(
            study, workers=0, output=None, progress=False, engine="compiled", rtol=1e-3
        )
        tables.append(results.rsf.to_dataframe(decoded=True))
    cycles, steady = tables
    assert list(cycles) == list(steady)
    assert steady["status"].tolist() == ["no_limit_cycle"] * 2
    assert steady["recurrence_interval"].isna().all()
    assert {"normal_stress", "reference_rate"} <= set(steady.attrs["constant"])
    assert steady.attrs["units"]["reference_rate"] == "s-1"


def test_a_decoded_table_equals_the_table_that_is_exported(tmp_path):
    """The columns of both tables are equal, with labels in place of codes."""
    axis = rsfstudy.Axis("stiffness_ratio", [0.5, 2.0])
    study = study_of("two", LimitCycle(phases=2), axis, base=SCENE)
    results = rsfstudy.run(
        study, workers=0, output=None, progress=False, engine="compiled", rtol=1e-3
    )
    table = results.rsf.to_dataframe(decoded=True)
    assert table["slip_mode"].tolist() == ["stick_slip", "damped_oscillation"]
    assert table["status"].tolist() == ["ok", "no_limit_cycle"]
    units = table.attrs["units"]
    assert units["recurrence_interval"] == "D_c/V_*"
    assert not {"status", "slip_mode"} & set(units)
    assert units["instability_norm"] == "1"
    assert results.rsf.to_dataframe()["status"].tolist() == [0, 3]
    export_files.to_csv(results, tmp_path / "it.csv")
    exported = pd.read_csv(tmp_path / "it.csv")
    assert list(exported) == [f"{n} ({units[n]})" if n in units else n for n in table]
    for name, values in zip(table, exported.to_numpy().T, strict=True):
        if name in units:
            np.testing.assert_array_equal(table[name], values.astype(float))
        else:
            assert table[name].tolist() == ["" if pd.isna(v) else v for v in values]
