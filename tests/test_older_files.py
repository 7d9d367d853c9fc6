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
from rsfstudy.former_data_names import rename_former_variables
from rsfstudy.reporting.fit_tables import FitTable
from rsfstudy.status import Status
from rsfstudy.storage import schema
from rsfstudy.storage.stored_declarations import parse_study_declaration
from rsfstudy.study import study_loader
from rsfstudy.study.claim_verdict_table import ClaimVerdictTable

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
    assert not rsfstudy.check(dataset).verdict_changed.any()
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
    assert schema.read_study_declaration(narrowed).overrides == {
        "b_over_a": [2.0, 3.0],
        "alpha": 0.4,
    }
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
            {**json.loads(text), **provenance.collect_run_fingerprint(study, [study.base])},
            sort_keys=True,
        )
        db.execute("UPDATE fingerprint SET json = ?", (now,))
    monkeypatch.setattr("rsfstudy.execution.cell_computation.compute_cell", None)
    resumed = run(study, output=tmp_path)
    assert np.array_equal(
        resumed.critical_stiffness, rsfstudy.open(older / "tiny.nc").critical_stiffness
    )


# ---- former names of layouts 1 and 2 -----------------------------------------------------------
def test_variables_of_older_fits_are_renamed():
    described = {
        "criterion": "Akaike's criterion, in which the noise counts; less is better",
        "whiteness": "chance of as much correlation of near rows, freed of it",
        "effective_samples": "number of independent samples that tell as much",
        "innovation": "residual freed of correlation, over its standard deviation",
        "noise_size": "standard deviation of the noise",
        "a_low": "lower end of the 95 % interval of the direct effect",
        "sobol_total_high": "high end of the 95 % interval of the total Sobol index of drop",
    }
    older = xr.Dataset(
        {name: ((), n, {"long_name": d}) for n, (name, d) in enumerate(described.items())}
    )
    older["a"] = (), 0.01, {"ancillary_variables": "a_low status"}
    older["criterion_of_mine"] = older["criterion"]
    current = rename_former_variables(older)
    names = [
        "aic",
        "p_value",
        "n_eff",
        "whitened_residual",
        "noise_sd",
        "a_ci_low",
        "sobol_total_ci_high",
    ]
    assert [*current] == [*names, "a", "criterion_of_mine"]
    assert [current[name].item() for name in names] == [*range(7)]
    assert current["a"].attrs["ancillary_variables"] == "a_ci_low status"
    assert older["a"].attrs["ancillary_variables"] == "a_low status"
    assert rename_former_variables(current) is current


def test_variables_of_users_keep_their_names():
    own = xr.Dataset({name: ((), 1.0, {"long_name": "mine"}) for name in ("criterion", "x_low")})
    assert rename_former_variables(own) is own


def test_declarations_of_older_files_are_understood():
    study = study_loader.load_study("rate_step_boundary")
    claim = rsfstudy.Claim(
        id="C1",
        statement="",
        source="",
        variable="zeta",
        where={"case": "alpha = 0.25"},
        baseline={"case": "alpha = 0.56"},
        baseline_variable="zeta",
        published=0.2,
        tolerance=0.1,
        reason="read from the figure",
        expected="differs",
        difference_reason="a misprint",
    )
    declared = {**study.describe(), "claims": [claim.describe()]}
    older = json.loads(json.dumps(declared))
    fit = next(one for one in older["reductions"] if one["kind"] == "proportional_fit")
    fit["minus"] = fit.pop("intercept")
    for former, new in {"minus": "baseline", "minus_variable": "baseline_variable",
                        "because": "difference_reason"}.items():  # fmt: skip
        older["claims"][0][former] = older["claims"][0].pop(new)
    assert parse_study_declaration(older) == parse_study_declaration(
        json.loads(json.dumps(declared))
    )
    assert older["claims"][0]["because"] == "a misprint"


def test_claims_on_intervals_of_sobol_indices_are_understood():
    declared = study_loader.load_study("what_matters").describe()
    current = json.loads(json.dumps(declared))
    older = json.loads(json.dumps(declared))
    renamed = [one for one in older["claims"] if "_ci_" in one["variable"]]
    for claim in renamed:
        claim["variable"] = claim["variable"].replace("_ci_", "_")
    assert renamed
    assert parse_study_declaration(older) == parse_study_declaration(current)


def test_former_columns_of_tables_are_selected_with_a_warning():
    verdicts = ClaimVerdictTable({"id": ["C1"], "computed": [2.0], "verdict_changed": [True]})
    with pytest.warns(DeprecationWarning, match="'ours' of the table is now called 'computed'"):
        assert verdicts["ours"].tolist() == [2.0]
    with pytest.warns(DeprecationWarning, match="'moved'.*'verdict_changed'"):
        assert verdicts.moved.tolist() == [True]
    with pytest.warns(DeprecationWarning, match="'ours'.*'computed'"):
        assert verdicts[["id", "ours"]].to_dict("list") == {"id": ["C1"], "ours": [2.0]}
    fits = FitTable({"a": [0.01], "a_stderr": [1e-3], "aic": [5.0]})
    with pytest.warns(DeprecationWarning, match="'a_std'.*'a_stderr'"):
        assert fits[["a", "a_std"]].to_dict("list") == {"a": [0.01], "a_std": [1e-3]}
    with pytest.warns(DeprecationWarning, match="'criterion'.*'aic'"):
        assert fits.criterion.tolist() == [5.0]
    with pytest.raises(KeyError, match="b_std"):
        fits["b_std"]
    with pytest.raises(AttributeError, match="because"):
        verdicts.because  # noqa: B018
