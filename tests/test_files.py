"""Tests of results files and journals.

Written files can be read again, failed writes keep old files, damage is reported, and
finished cells are kept.
"""

import contextlib
import json
import os
import shutil
import sqlite3
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from study_runs import call_main, cell_key, run

import rsfstudy
from rsfstudy import Scene, plots
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.execution.provenance import read_git_commit_and_state
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status
from rsfstudy.storage import dataset_files, schema, stored_declarations, study_reconstruction
from rsfstudy.storage.cell_journal import CellJournal
from rsfstudy.storage.cell_result_arrays import CellOutputPacker
from rsfstudy.study import named_study_index, study_loader


def dataset(value=1.0) -> xr.Dataset:
    return xr.Dataset(
        {"v": ("x", np.full(3, value)), "flag": ("x", np.array([0, 1, 2], dtype=np.int8))},
        coords={"x": [1.0, 2.0, np.nan], "label": ("x", np.array(["a", "b", "c"], dtype=object))},
        attrs={"declaration": '{"name": "trial", "claims": [], "plot": "lines"}'},
    )


def test_attributes_netcdf_would_change_are_made_plain(tmp_path):
    """Attributes are converted to types that NetCDF preserves.

    None is removed, flags become words, dicts become JSON, and lists with one element
    become that element.
    """
    odd = dataset().assign_attrs(
        none=None, flag=True, table={"a": 1}, one=[3.0], several=(1, 2), empty=[]
    )
    dataset_files.write_dataset(odd, tmp_path / "odd.nc")
    attrs = xr.load_dataset(tmp_path / "odd.nc").attrs
    assert "none" not in attrs
    assert (attrs["flag"], attrs["table"], attrs["one"]) == ("true", '{"a": 1}', 3.0)
    assert attrs["several"].tolist() == [1, 2]


def test_coordinates_and_flags_carry_no_fill_value(tmp_path):
    dataset_files.write_dataset(dataset(), tmp_path / "plain.nc")
    with xr.open_dataset(tmp_path / "plain.nc") as back:
        assert back.flag.dtype == np.int8
        assert "_FillValue" not in back.x.encoding
        assert "_FillValue" not in back.flag.encoding


def test_a_reader_with_the_old_file_open_keeps_its_data(tmp_path):
    path = tmp_path / "trial.nc"
    dataset_files.write_dataset(dataset(1.0), path)
    with xr.open_dataset(path) as reader:
        dataset_files.write_dataset(dataset(2.0), path)
        assert float(reader.v.sum()) == 3.0
    assert float(xr.load_dataset(path).v.sum()) == 6.0


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "trial.nc"
    dataset_files.write_dataset(dataset(1.0), path)

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", full)
    with pytest.raises(DataError, match="No space left.*No file was replaced"):
        dataset_files.write_dataset(dataset(2.0), path)
    monkeypatch.undo()
    assert os.listdir(tmp_path) == ["trial.nc"]
    assert float(xr.load_dataset(path).v.sum()) == 3.0


def test_what_reads_back_differently_is_not_put_in_place(tmp_path, monkeypatch):
    path = tmp_path / "trial.nc"
    monkeypatch.setattr(
        dataset_files, "build_encoding_without_fill_values", lambda _d: {"v": {"dtype": "float32"}}
    )
    with pytest.raises(DataError, match="stored data differ"):
        dataset_files.write_dataset(dataset(0.1), path)
    assert os.listdir(tmp_path) == []


def test_a_motion_is_no_results_of_a_study(tmp_path):
    path, said = tmp_path / "motion.nc", r"single scene \(Motion of .*rsfstudy.plot_motion"
    motion = rsfstudy.simulate(Scene(hold_time=1.0), duration=1.0, rtol=1e-2)
    motion.to_netcdf(path)
    for ask in (rsfstudy.open, rsfstudy.check, rsfstudy.plot):
        with pytest.raises(DataError, match=f"motion.nc contains a {said}"):
            ask(path)
    with pytest.raises(DataError, match=f"the dataset contains a {said}"):
        rsfstudy.plot(motion)
    with pytest.raises(DataError, match=f"the dataset contains a {said}"):
        rsfstudy.compare(motion, motion)


class Pair(Measure):
    """Measure with a scalar and a curve."""

    name = "pair"
    variables = {"v": (), "profile": ("phase",)}  # noqa: RUF012
    output_coordinates = {"phase": np.arange(2.0)}  # noqa: RUF012


LAYOUT = CellOutputPacker(Pair())
DONE = (Outcome(Status.OK, {"v": 1.5, "profile": np.array([1.0, np.nan])}, "", 42), 0.1)
KEYS = np.array([cell_key(Scene(b_over_a=b), Pair()) for b in (2.0, 3.0)], dtype="V16")


def journal(tmp_path, fingerprint=None, **options):
    return CellJournal(
        tmp_path / "trial.cells.sqlite", fingerprint or {"rtol": 1e-7}, LAYOUT, **options
    )


def test_the_journal_returns_what_it_was_given(tmp_path):
    with journal(tmp_path) as kept:
        kept.add_cells([LAYOUT.pack_journal_row(KEYS[0].tobytes(), *DONE)])
    with journal(tmp_path) as kept:
        assert kept.read_statuses(KEYS).tolist() == [Status.OK, Status.PENDING]
        found = kept.read_cells(KEYS)
    assert found.statuses.tolist() == [Status.OK, Status.PENDING]
    assert (found.rhs_evaluations[0], found.wall_times[0]) == (42, 0.1)
    np.testing.assert_array_equal(found.packed_outputs[0], [1.5, 1.0, np.nan])
    assert np.isnan(found.packed_outputs[1]).all()


def test_a_damaged_journal_is_named(tmp_path):
    path = tmp_path / "trial.cells.sqlite"
    path.write_text("not a database, however long this text may be")
    with pytest.raises(DataError, match="cannot use .*--fresh"):
        journal(tmp_path)


def test_a_number_changed_in_the_journal_is_noticed(tmp_path):
    with journal(tmp_path) as kept:
        kept.add_cells([LAYOUT.pack_journal_row(KEYS[0].tobytes(), *DONE)])
    path = tmp_path / "trial.cells.sqlite"
    right, wrong = np.array([1.5]).tobytes(), np.array([1.25]).tobytes()
    content = path.read_bytes()
    assert content.count(right) == 1
    path.write_bytes(content.replace(right, wrong))
    with journal(tmp_path) as kept, pytest.raises(DataError, match="is damaged.*--fresh"):
        kept.read_cells(KEYS)


def test_a_result_moved_to_another_cell_of_the_journal_is_noticed(tmp_path):
    """A valid result under the key of another cell is detected."""
    with journal(tmp_path) as kept:
        kept.add_cells([LAYOUT.pack_journal_row(KEYS[0].tobytes(), *DONE)])
    with contextlib.closing(sqlite3.connect(tmp_path / "trial.cells.sqlite")) as db, db:
        db.execute("UPDATE cells SET key = ?", (KEYS[1].tobytes(),))
    with journal(tmp_path) as kept, pytest.raises(DataError, match="is damaged.*--fresh"):
        kept.read_cells(KEYS)


def test_cells_differ_by_the_last_bit():
    two, beside = Scene(b_over_a=2.0), Scene(b_over_a=np.nextafter(2.0, 3.0))
    assert cell_key(two, Pair()) != cell_key(beside, Pair())
    assert cell_key(two, Pair()) == cell_key(Scene(b_over_a=2), Pair())


# ---- what a file says of itself -----------------------------------------------------------------
@pytest.fixture(scope="module")
def written(tmp_path_factory):
    output = tmp_path_factory.mktemp("small")
    run(output=output)
    return output / "small.nc"


@pytest.fixture
def small(written, tmp_path):
    """Return a copy of the file that the test may change."""
    return shutil.copy(written, tmp_path / "small.nc")


def test_what_another_program_saved_is_read_and_told(small, tmp_path):
    """Variables and attributes that a user adds are kept."""
    mine = xr.load_dataset(small)
    mine["log"] = np.log(mine.critical_velocity_ratio)
    mine.attrs["comment"] = "with logarithms"
    mine.to_netcdf(tmp_path / "mine.nc")
    with pytest.warns(UserWarning, match="mine.nc has no digest, because another program saved"):
        assert "log" in rsfstudy.open(tmp_path / "mine.nc")


def test_a_file_of_a_later_version_is_told_for_what_it_is(small, tmp_path):
    later = xr.load_dataset(small).assign_attrs(layout=schema.FILE_LAYOUT_VERSION + 1)
    dataset_files.write_dataset(later, tmp_path / "later.nc")
    readable = f"reads the layouts 1 to {schema.FILE_LAYOUT_VERSION}"
    with pytest.raises(DataError, match=f"layout is 4, but this version .* {readable}"):
        rsfstudy.open(tmp_path / "later.nc")


def test_opening_a_file_runs_no_code(small, tmp_path, monkeypatch):
    """Opening a file does not import modules named in its declaration."""
    (tmp_path / "evil.py").write_text("raise SystemExit('the code of a results file ran')")
    monkeypatch.syspath_prepend(tmp_path)
    dataset = xr.load_dataset(small)
    declared = json.loads(dataset.attrs["declaration"])
    declared["measure"]["name"] = declared["plot"] = "evil"
    dataset_files.write_dataset(
        dataset.assign_attrs(declaration=json.dumps(declared)), tmp_path / "trap.nc"
    )
    rsfstudy.open(tmp_path / "trap.nc")
    rsfstudy.check(tmp_path / "trap.nc")
    with pytest.raises(InvalidValue, match="measure = 'evil' is not part of rsfstudy"):
        rsfstudy.rerun(tmp_path / "trap.nc", workers=0, progress=False)
    with pytest.raises(InvalidValue, match="plot = 'evil' is unknown"):
        plots.draw_figure(rsfstudy.open(tmp_path / "trap.nc"))
    assert "evil" not in sys.modules


def test_a_file_says_what_decided_its_numbers(small):
    about = json.loads(rsfstudy.open(small).attrs["provenance"])
    assert {"numpy", "scipy", "xarray", "dask", "python", "rsfstudy"} <= set(about["versions"])
    assert {"physics", "rtol", "budget", "measure", "own_code"} <= set(about["fingerprint"])
    for name in ("time", "command", "git", "machine", "mathematical_library"):
        assert about[name]


def test_git_tells_the_commit_and_whether_it_was_clean(tmp_path):
    """Only changes of package and studies mark a checkout as modified."""

    def git(*words):
        who = "-c", "user.name=x", "-c", "user.email=x"
        command = ["git", "-C", str(tmp_path), *who, *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    assert read_git_commit_and_state(tmp_path) == "none"
    git("init", "-q")
    for place in ("rsfstudy", "studies", "outputs"):
        (tmp_path / place).mkdir()
        (tmp_path / place / "file.py").write_text("x = 1\n")
    git("add", ".")
    git("commit", "-q", "-m", "x")
    commit = git("rev-parse", "HEAD")
    (tmp_path / "outputs" / "file.py").write_text("x = 2\n")
    assert read_git_commit_and_state(tmp_path) == f"{commit} clean"
    assert read_git_commit_and_state(tmp_path / "rsfstudy") == "none"
    for place in ("rsfstudy", "studies"):
        (tmp_path / place / "file.py").write_text("x = 2\n")
        assert read_git_commit_and_state(tmp_path) == f"{commit} with uncommitted changes"
        git("checkout", "-q", place)


# ---- from the file alone ------------------------------------------------------------------------
@pytest.mark.parametrize("name", named_study_index.list_study_names())
def test_every_declaration_restores_its_study(name):
    study = study_loader.load_study(name)
    described = json.loads(json.dumps(study.describe()))
    restored = study_reconstruction.build_study_from_declaration(
        stored_declarations.parse_study_declaration(described), study.user_parts
    )
    assert json.loads(json.dumps(restored.describe())) == described
    assert restored.size == study.size
    # Large studies are sampled, and the sample contains all points of every axis.
    for number in range(0, study.size, 1 if study.size < 1000 else 23):
        assert restored.scene(number) == study.scene(number)


def test_measures_and_reductions_in_the_files_of_studies_are_found_by_their_names():
    """The modules are found by a process that has not loaded any study."""
    described = [study_loader.load_study(name).describe() for name in ("effects", "coverage")]
    asked = (
        "import json, sys; from rsfstudy.storage import stored_declarations as contents, "
        "study_reconstruction as restore\n"
        "for plain in json.load(sys.stdin):\n"
        "    declaration = contents.parse_study_declaration(plain)\n"
        "    study = restore.build_study_from_declaration(declaration, {})\n"
        "    print(*(type(p).__name__ for p in (study.measure, study.reductions[0])))"
    )
    ran = subprocess.run(
        [sys.executable, "-c", asked],
        capture_output=True,
        text=True,
        check=True,
        input=json.dumps(described),
    )
    assert ran.stdout == "EffectCost RelativeDifference\nCoverage CoverageStatistics\n"
    with pytest.raises(InvalidValue, match="Did you mean 'effect_cost'"):
        stored_declarations.build_measure({"name": "effect_costs"}, "")


def test_a_rerun_reproduces_every_number(small):
    table = rsfstudy.rerun(small, workers=0, progress=False)
    assert (table["values"] == table["identical"]).all()
    assert set(table.variable) >= {"critical_velocity_ratio", "status", "rhs_evaluations"}
    assert table.attrs["differs"] == {}


def test_a_rerun_of_a_study_as_it_was_overridden(tmp_path):
    options = {"b_over_a": [2.0, 2.5], "stiffness_ratio": 1.25, "workers": 0, "progress": False}
    rsfstudy.run("rate_step_boundary", output=tmp_path, rtol=1e-6, **options)
    table = rsfstudy.rerun(tmp_path / "rate_step_boundary.nc", workers=0, progress=False)
    assert (table["values"] == table["identical"]).all()


def test_a_rerun_shows_what_differs(small, tmp_path):
    """A changed value in a file with a valid digest is found."""
    other = xr.load_dataset(small)
    other["critical_velocity_ratio"][0, 0] += 1e-9
    about = json.loads(other.attrs["provenance"])
    about["fingerprint"]["scipy"] = "0.1"
    dataset_files.write_dataset(
        other.assign_attrs(provenance=json.dumps(about)), tmp_path / "other.nc"
    )
    table = rsfstudy.rerun(tmp_path / "other.nc", workers=0, progress=False).set_index("variable")
    changed = table.loc["critical_velocity_ratio"]
    assert changed["values"] - changed["identical"] == 1
    assert changed["largest_difference"] == pytest.approx(1e-9, rel=1e-6)
    assert table.attrs["differs"]["scipy"][0] == "0.1"


def test_a_rerun_does_not_take_the_place_of_what_it_is_held_against(small):
    with pytest.raises(InvalidValue, match="would be overwritten"):
        rsfstudy.rerun(small, workers=0, output=small.parent, progress=False)


def test_a_cell_computed_by_other_code_says_so(small, tmp_path):
    other = xr.load_dataset(small)
    about = json.loads(other.attrs["provenance"])
    about["fingerprint"]["physics"] = "older"
    dataset_files.write_dataset(
        other.assign_attrs(provenance=json.dumps(about)), tmp_path / "other.nc"
    )
    place = {"case": "constant", "b_over_a": "2.5"}
    with pytest.warns(UserWarning, match="physics: older in the file, .* now"):
        rsfstudy.recompute_cell(tmp_path / "other.nc", place)
    with pytest.raises(InvalidValue, match="inf.* is not a point of its axis"):
        rsfstudy.recompute_cell(small, {**place, "b_over_a": "inf"})
    words = [f"--cell={name}={value}" for name, value in place.items()]
    told = call_main("rerun", tmp_path / "other.nc", *words)
    assert (told.returncode, "physics: older in the file" in told.stdout) == (0, True)


def test_show_tells_what_is_in_a_file(small):
    told = call_main("show", small)
    assert told.returncode == 0
    for text in ("2 case x 3 b_over_a", "complete", "6 ok", "scipy", "critical_velocity_ratio"):
        assert text in told.stdout
