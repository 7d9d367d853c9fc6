"""Tests of the command ``rsfstudy events`` and of the options of reading."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import record_events
import xarray as xr
from study_runs import call_main

import rsfstudy

PAGES = Path(__file__).parent.parent / "studies" / "pages"


@pytest.fixture
def record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a record of friction with decimal commas, and change to its directory."""
    made = record_events.sudden_drops(np.random.default_rng(12))
    table = pd.DataFrame({"Time (s)": made.time, "Friction": made.stress / 8.0})
    table.to_csv(tmp_path / "run.csv", sep=";", decimal=",", index=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "run.csv"


def test_the_command_prints_what_the_function_finds(record: Path) -> None:
    words = ["--decimal", ",", "--normal-stress", "8 MPa", "--rows", "1,4000", "--end", "30 s"]
    found = rsfstudy.events(
        "run.csv", decimal=",", normal_stress="8 MPa", rows=(1, 4000), end="30 s"
    )
    assert found.sizes["event"] > 1
    ran = call_main("events", "run.csv", *words, "--json")
    assert ran.returncode == 0, ran.stderr
    told = json.loads(ran.stdout)
    (one,) = told["records"]
    assert (told["command"], one["file"]) == ("events", "run.csv")
    assert [event["event"] for event in one["events"]] == [*range(1, found.sizes["event"] + 1)]
    for name in ("time", "static_stress_drop", "static_stress_drop_error"):
        np.testing.assert_array_equal([event[name] for event in one["events"]], found[name])
    assert one["units"]["static_stress_drop"] == "MPa"
    assert one["processing"] == found.attrs["processing"]
    assert one["smallest_drop"] == float(found.smallest_drop)
    ran = call_main("events", "run.csv", *words)
    assert ran.returncode == 0, ran.stderr
    lines = ran.stdout.splitlines()
    assert "static stress drop (MPa)" in lines[0]
    assert len(lines) >= found.sizes["event"] + 3
    assert f"{found.sizes['event']} drops of shear stress" in ran.stdout
    assert found.attrs["processing"] in ran.stdout


def test_the_table_marks_lower_bounds_of_slip_rates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sudden drop has an unresolved peak slip rate, and other errors are in the same column."""
    monkeypatch.chdir(tmp_path)
    made = record_events.sudden_drops(np.random.default_rng(13))
    columns = {
        "Time (s)": made.time,
        "LP displacement (um)": made.time,
        "Shear stress (MPa)": made.stress,
    }
    pd.DataFrame(columns).to_csv("run.csv", index=False)
    ran = call_main("events", "run.csv", "--stiffness", "0.05 MPa/um")
    assert ran.returncode == 0, ran.stderr
    assert ">= marks a lower bound" in ran.stdout
    found = rsfstudy.events("run.csv", stiffness="0.05 MPa/um")
    for row in range(found.sizes["event"]):
        event = found.isel(event=row)
        for name in ("slip", "dynamic_stress_drop"):
            value, error = float(event[name]), float(event[f"{name}_error"])
            assert f"{value:.4g} +- {error:.2g}" in ran.stdout
        assert f">= {float(event.peak_slip_rate):.4g}" in ran.stdout


def test_wrong_options_of_reading_are_refused(record: Path) -> None:
    ran = call_main("events", "run.csv")
    assert ran.returncode == 2
    assert "has a decimal comma. Pass decimal" in " ".join(ran.stderr.split())
    ran = call_main("events", "run.csv", "--decimal", ",", "--rows", "1-200")
    assert ran.returncode == 2
    assert "--rows must be the numbers of the first and the last row" in ran.stderr
    assert call_main("events", "absent.csv").returncode == 1


def test_fit_reads_with_the_same_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(PAGES / "step.csv", "step.csv")
    ran = call_main(
        "fit", "step.csv", "--normal-stress", "20 MPa", "--stiffness", "0.04 MPa/um", "--step", 1,
        "--law", "slowness", "--begin", "40 s", "--end", "139 s", "--thin", 2, "--json",
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    (record,) = json.loads(ran.stdout)["records"]
    assert record["processing"][1:] == ["one of every 2 rows"]
    assert record["processing"][0].endswith(" of 600")
    assert len(record["steps"]) == 1


def test_a_loading_is_read_from_a_file_with_other_columns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The load point of a record with usual headings is a loading."""
    monkeypatch.chdir(tmp_path)
    lines = [
        "# run 7",
        "Time (s),LP displacement (um),Friction",
        "0,0,0.6",
        "10,10,0.6",
        "20,30,0.6",
    ]
    Path("run.csv").write_text("\n".join(lines))
    rig = ["--slip-distance", "10 um", "--reference-velocity", "1 um/s", "--normal-stress", "5 MPa"]
    scene = ["--set", "stiffness_ratio=3", "--duration", "20 s", "--rtol", 1e-3]
    ran = call_main("simulate", "--protocol", "run.csv", *rig, *scene)
    assert ran.returncode == 0, ran.stderr
    columns = {"time": [0.0, 1.0, 2.0], "displacement": [0.0, 1.0, 3.0]}
    loading = xr.load_dataset("motion.nc").rsf.scene.parts.loading
    known = rsfstudy.history(columns, name="run").sample_table
    np.testing.assert_allclose(loading.sample_table, known, atol=1e-12)
