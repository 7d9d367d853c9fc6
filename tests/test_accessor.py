"""Tests of the dataset accessor ``.rsf``."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from study_runs import example_claim

import rsfstudy
import rsfstudy.api.accessor  # Register the accessor.
from rsfstudy import Axis, Scene, Study
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import DataError, InvalidValue, NoResultWarning
from rsfstudy.reporting import build_failed_cells_table
from rsfstudy.status import Status

STUDY = Study(
    name="soft_and_stiff",
    title="Critical velocity step of a soft and a stiff spring",
    base=Scene(normal_stress="constant"),
    axes=[Axis("law", ["slip", "slowness"]), Axis("stiffness_ratio", [0.8, 1.2])],
    measure=CriticalStep(),
    claims=[
        example_claim(
            variable="critical_velocity_ratio",
            where={"law": "slip", "stiffness_ratio": 1.2},
            tolerance=0.0,
            relation="above",
        )
    ],
)
SI = {"normal_stress": 1e8, "slip_distance": 1e-5}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    output = tmp_path_factory.mktemp("outputs")
    rsfstudy.run(STUDY, rtol=1e-4, workers=0, output=output, progress=False)
    return output / "soft_and_stiff.nc"


@pytest.fixture(scope="module")
def results(file):
    return xr.load_dataset(file)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(law="slowness", load_velocity_ratio=1.5, phi=65.0),
        Scene(
            stiffness=0.1,
            loading=rsfstudy.protocol(
                [{"velocity": 3.0, "duration": 0.3}, {"velocity": 1.0, "duration": 0.1}], "there"
            ),
        ),
    ],
)
def test_a_motion_knows_its_scene(scene, tmp_path):
    motion = rsfstudy.simulate(scene, duration=0.5, rtol=1e-3)
    assert motion.rsf.scene == scene
    motion.to_netcdf(tmp_path / "motion.nc")
    with xr.open_dataset(tmp_path / "motion.nc") as again:
        assert again.rsf.scene == scene
        assert again.rsf.failures().empty
    in_si = motion.rsf.to_si(**SI)
    xr.testing.assert_identical(in_si, rsfstudy.to_si(motion, **SI))
    assert in_si.rsf.scene == scene


def test_an_answer_knows_its_scene_and_why_it_has_no_number():
    scene = Scene(stiffness_ratio=0.8)
    with pytest.warns(NoResultWarning):
        step = rsfstudy.critical_step(scene, rtol=1e-3)
    assert step.rsf.scene == scene
    assert step.rsf.failures().empty
    (row,) = step.rsf.failures(include_answers=True).to_dict("records")
    assert row["status"] == "unstable_at_any_step"
    for ask in (lambda: step.rsf.study, step.rsf.check):
        with pytest.raises(DataError, match="belongs to a single scene"):
            ask()
    with pytest.raises(DataError, match="neither a motion from simulate"):
        step.rsf.plot()


def test_results_know_their_study_and_each_cell_its_scene(results):
    assert results.rsf.study.describe()["axes"] == STUDY.describe()["axes"]
    for number, (law, stiffness) in enumerate(
        [("slip", 0.8), ("slip", 1.2), ("slowness", 0.8), ("slowness", 1.2)]
    ):
        cell = results.sel(law=law, stiffness_ratio=stiffness)
        assert cell.rsf.scene == STUDY.scene(number)
        assert cell.rsf.study.size == 4
    with pytest.raises(
        InvalidValue, match=r"stiffness_ratio must have a single value \(got \[0.8, 1.2\]\)"
    ):
        _ = results.sel(law="slip").rsf.scene
    with pytest.raises(InvalidValue, match=r"'law' must have a single value \(got \[\]\)"):
        _ = results.isel(law=0, stiffness_ratio=0, drop=True).rsf.scene
    elsewhere = results.isel(law=0, stiffness_ratio=0).assign_coords(stiffness_ratio=7.0)
    with pytest.raises(
        InvalidValue, match=r"stiffness_ratio = .*7.0.* is not a point of this axis"
    ):
        _ = elsewhere.rsf.scene


def test_failures_are_the_cells_that_the_warning_counts(results):
    failures = results.rsf.failures(include_answers=True)
    assert list(failures.columns) == ["law", "stiffness_ratio", "status", "message"]
    assert failures.law.tolist() == ["slip", "slowness"]
    assert failures.stiffness_ratio.tolist() == [0.8, 0.8]
    assert set(failures.status) == {"unstable_at_any_step"}
    one = results.isel(law=0, stiffness_ratio=0)
    assert len(one.rsf.failures(include_answers=True)) == 1
    assert results.isel(law=0, stiffness_ratio=1).rsf.failures(include_answers=True).empty
    assert results.rsf.failures().empty
    mixed = results.copy(deep=True)
    mixed["status"][:, 1] = [int(Status.WORK_BUDGET_SPENT), int(Status.PENDING)]
    (row,) = mixed.rsf.failures().to_dict("records")
    assert (row["law"], row["status"]) == ("slip", "work_budget_spent")
    assert len(mixed.rsf.failures(include_answers=True)) == 4
    (listed,) = build_failed_cells_table(mixed, "it.nc").unformatted_rows
    assert listed["coordinates"] == {"law": "slip", "stiffness_ratio": 1.2}


def test_only_whole_results_are_drawn_and_checked_in_their_own_units(results):
    for ask in ("check", "plot"):
        with pytest.raises(DataError, match="but law has been selected"):
            getattr(results.sel(law="slip").rsf, ask)()
    converted = results.rsf.to_si(**SI)
    assert converted.rsf.check().verdict.tolist() == ["not applicable"]
    # The figure uses the units of the converted dataset, not the units of the study.
    assert "(m s$^{-1}$)" in converted.rsf.plot().axes[0].get_ylabel()


def test_results_are_checked_drawn_and_converted(results):
    assert results.rsf.check().verdict.tolist() == ["reproduced"]
    assert isinstance(results.rsf.plot("critical_velocity_ratio"), Figure)
    velocity = results.rsf.to_si(**SI).critical_velocity
    np.testing.assert_allclose(velocity, results.critical_velocity_ratio * 1e-5 * 1.17e-8)


def test_a_foreign_dataset_is_refused():
    rsf = xr.Dataset({"temperature": ("x", [1.0])}).rsf
    asks = rsf.check, rsf.plot, rsf.failures, lambda: rsf.to_si(**SI)
    for ask in (*asks, lambda: rsf.scene, lambda: rsf.study):
        with pytest.raises(DataError, match="was not created by rsfstudy.*rsfstudy.simulate"):
            ask()


def test_a_file_that_xarray_opens_has_it_and_the_import_alone_loads_nothing(file):
    asked = (
        "import sys, rsfstudy\n"
        "assert 'xarray' not in sys.modules\n"
        "import xarray\n"
        f"print(len(xarray.open_dataset({str(file)!r}).rsf.failures(include_answers=True)))\n"
        "assert not {'distributed', 'matplotlib'} & set(sys.modules)"
    )
    ran = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=False)
    assert (ran.stdout.strip(), ran.stderr) == ("2", "")


def test_xarray_opens_results_with_our_checks(file, results, tmp_path):
    ours = xr.open_dataset(file, engine="rsfstudy", drop_variables=["wall_time"])
    xr.testing.assert_equal(ours, results.drop_vars("wall_time"))
    results.drop_vars("status").to_netcdf(tmp_path / "edited.nc")
    with pytest.raises(DataError, match="edited.nc: status is missing"):
        xr.open_dataset(tmp_path / "edited.nc", engine="rsfstudy")
