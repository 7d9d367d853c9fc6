"""Tests of files with older layouts.

The tests cover reading, checking, plotting and resuming.
"""

import contextlib
import json
import sqlite3
import tarfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_runs import call_main, have_same_numbers, run

import rsfstudy
from rsfstudy.execution import provenance
from rsfstudy.status import Status
from rsfstudy.storage import schema
from rsfstudy.study import study_loader

#: Files written by rsfstudy 0.1.0, before files contained a layout number: a study with its
#: journal and as a Zarr store, a named study narrowed with --set, a study with failed cells, and
#: a motion.
LAYOUT_1 = Path(__file__).with_name("layout_1.tar.xz")
RESULTS = ["tiny.nc", "tiny.zarr", "rate_step_boundary.nc", "displacement_boundary.nc"]


@pytest.fixture(scope="module")
def older(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("layout_1")
    with tarfile.open(LAYOUT_1) as files:
        files.extractall(place, filter="data")
    return place


@pytest.mark.parametrize("name", RESULTS)
def test_results_open_check_and_plot(name, older, tmp_path):
    dataset = rsfstudy.open(older / name)
    assert "layout" not in dataset.attrs
    assert dataset.rsf.study.name == dataset.attrs["id"]
    assert not rsfstudy.check(dataset).moved.any()
    drawn = call_main("plot", older / name, "--output", tmp_path)
    assert (drawn.returncode, drawn.stderr) == (0, "")
    assert call_main("show", older / name).returncode == (name == "displacement_boundary.nc")
    assert rsfstudy.compare(dataset, dataset).agrees


def test_a_range_was_a_spread():
    narrow = {"law": "slip", "normal_stress": "constant", "load_velocity_ratio": [0.5, 2.0]}
    dataset = run(study_loader.load_study("rigid_response").with_(**narrow), rtol=1e-3)
    ranged = dataset.rsf.study.reductions
    described = json.loads(dataset.attrs["declaration"])
    spread = described["reductions"][1]
    spread |= {"kind": "spread", "on": spread.pop("over")}
    again = dataset.assign_attrs(declaration=json.dumps(described))
    assert again.rsf.study.reductions == ranged


def test_they_hold_what_they_held(older):
    narrowed = rsfstudy.open(older / "rate_step_boundary.nc")
    assert schema.read_declaration(narrowed).overrides == {"b_over_a": [2.0, 3.0], "alpha": 0.4}
    assert set(rsfstudy.check(narrowed).verdict) == {"not applicable", "reproduced"}
    failed = rsfstudy.open(older / "displacement_boundary.nc")
    assert (failed.status == int(Status.WORK_BUDGET_SPENT)).any()
    have_same_numbers(rsfstudy.open(older / "tiny.nc"), rsfstudy.open(older / "tiny.zarr").load())


def test_they_are_computed_again_from_themselves(older):
    table = rsfstudy.rerun(older / "tiny.nc", workers=0, progress=False)
    assert (table.beyond_errors.fillna(0) == 0).all()
    # Old fingerprints did not contain the Python version.
    assert "python" in table.attrs["differs"]


def test_files_name_their_layout(tmp_path):
    rsfstudy.run("linear_stability", output=tmp_path, workers=0, progress=False, b_over_a=[2.0])
    words = ["simulate", "--set", "load_velocity_ratio=2", "--duration", "0.1", "--output"]
    call_main(*words, tmp_path / "m.png")
    for name in ("linear_stability.nc", "m.nc"):
        assert xr.load_dataset(tmp_path / name).attrs["layout"] == schema.FILE_LAYOUT_VERSION


def test_a_motion_opens_and_is_drawn(older):
    motion = xr.load_dataset(older / "motion.nc")
    assert motion.rsf.scene.load_velocity_ratio == 3.0
    assert len(motion.rsf.plot().axes) >= 3


def test_a_run_goes_on(older, tmp_path, monkeypatch):
    """A run resumes from an old journal with a current fingerprint."""
    study = rsfstudy.open(older / "tiny.nc").rsf.study
    journal = tmp_path / "tiny.cells.sqlite"
    journal.write_bytes((older / "tiny.cells.sqlite").read_bytes())
    with contextlib.closing(sqlite3.connect(journal)) as db, db:
        (text,) = db.execute("SELECT json FROM fingerprint").fetchone()
        now = json.dumps(
            {**json.loads(text), **provenance.run_fingerprint(study, [study.base])}, sort_keys=True
        )
        db.execute("UPDATE fingerprint SET json = ?", (now,))
    monkeypatch.setattr("rsfstudy.execution.cell_computation.compute_cell", None)
    resumed = run(study, output=tmp_path)
    assert np.array_equal(
        resumed.critical_stiffness, rsfstudy.open(older / "tiny.nc").critical_stiffness
    )
