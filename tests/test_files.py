"""Files: what is written is what is read, old files survive, damage is named, finished cells are
kept.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from rsfstudy import Scene, store
from rsfstudy.errors import DataError
from rsfstudy.journal import Journal, cell_key
from rsfstudy.measures import Outcome
from rsfstudy.status import Status


def dataset(value=1.0) -> xr.Dataset:
    return xr.Dataset(
        {"v": ("x", np.full(3, value)), "flag": ("x", np.array([0, 1, 2], dtype=np.int8))},
        coords={"x": [1.0, 2.0, np.nan], "label": ("x", np.array(["a", "b", "c"], dtype=object))},
        attrs={"declaration": '{"name": "trial", "claims": [], "plot": "lines"}'},
    )


def test_attributes_netcdf_would_change_are_made_plain(tmp_path):
    """None vanishes, flags become words, dicts JSON, lists of one their element; nothing raises."""
    odd = dataset().assign_attrs(
        none=None, flag=True, table={"a": 1}, one=[3.0], several=(1, 2), empty=[]
    )
    store.write(odd, tmp_path / "odd.nc")
    attrs = xr.load_dataset(tmp_path / "odd.nc").attrs
    assert "none" not in attrs
    assert (attrs["flag"], attrs["table"], attrs["one"]) == ("true", '{"a": 1}', 3.0)
    assert attrs["several"].tolist() == [1, 2]


def test_coordinates_and_flags_carry_no_fill_value(tmp_path):
    store.write(dataset(), tmp_path / "plain.nc")
    with xr.open_dataset(tmp_path / "plain.nc") as back:
        assert back.flag.dtype == np.int8
        assert "_FillValue" not in back.x.encoding
        assert "_FillValue" not in back.flag.encoding


def test_a_reader_with_the_old_file_open_keeps_its_data(tmp_path):
    path = tmp_path / "trial.nc"
    store.write(dataset(1.0), path)
    reader = (
        "import sys, xarray; d = xarray.open_dataset(sys.argv[1]); print('open', flush=True); "
        "sys.stdin.readline(); print(float(d.v.sum()))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", reader, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "open\n"
        store.write(dataset(2.0), path)
        assert process.communicate("go\n")[0] == "3.0\n"
    assert float(xr.load_dataset(path).v.sum()) == 6.0


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "trial.nc"
    store.write(dataset(1.0), path)

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", full)
    with pytest.raises(DataError, match="No space left.*Nothing was replaced"):
        store.write(dataset(2.0), path)
    monkeypatch.undo()
    assert os.listdir(tmp_path) == ["trial.nc"]
    assert float(xr.load_dataset(path).v.sum()) == 3.0


def test_what_reads_back_differently_is_not_put_in_place(tmp_path, monkeypatch):
    path = tmp_path / "trial.nc"
    monkeypatch.setattr(store, "_encoding", lambda _d: {"v": {"dtype": "float32"}})
    with pytest.raises(DataError, match="what was read back differs"):
        store.write(dataset(0.1), path)
    assert os.listdir(tmp_path) == []


def test_missing_and_damaged_files_are_named(tmp_path):
    with pytest.raises(DataError, match="nothing.nc does not exist"):
        store.read(tmp_path / "nothing.nc")
    (tmp_path / "text.nc").write_text("not NetCDF")
    with pytest.raises(DataError, match="text.nc cannot be read as NetCDF"):
        store.read(tmp_path / "text.nc")
    xr.Dataset({"v": 1.0}).to_netcdf(tmp_path / "foreign.nc")
    with pytest.raises(DataError, match="carries no study declaration"):
        store.read(tmp_path / "foreign.nc")


def test_an_output_that_is_a_file_is_named(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(DataError, match="cannot write.*Choose another --output"):
        store.write(dataset(), tmp_path / "taken" / "trial.nc")


DONE = (Outcome(Status.OK, {"v": 1.5, "profile": np.array([1.0, np.nan])}, "", 42), 0.1)


def test_the_journal_returns_what_it_was_given(tmp_path):
    path, key = tmp_path / "trial.cells.sqlite", cell_key(Scene())
    with Journal(path, {"rtol": 1e-7}) as journal:
        journal.add([(key, DONE)])
    with Journal(path, {"rtol": 1e-7}) as journal:
        found = journal.finished([key, "unknown"])
    assert list(found) == [key]
    outcome, seconds = found[key]
    assert (outcome.status, outcome.values["v"], outcome.rhs_evaluations) == (Status.OK, 1.5, 42)
    np.testing.assert_array_equal(outcome.values["profile"], [1.0, np.nan])
    assert seconds == 0.1


def test_failed_cells_are_tried_again(tmp_path):
    failed = (Outcome(Status.CELL_RAISED, message="ValueError: x"), 0.1)
    with Journal(tmp_path / "trial.cells.sqlite", {}) as journal:
        journal.add([("key", failed)])
        assert journal.finished(["key"]) == {}


def test_a_journal_of_other_numbers_is_refused_with_the_difference(tmp_path):
    path = tmp_path / "trial.cells.sqlite"
    with Journal(path, {"rtol": 1e-7, "physics": "abc"}) as journal:
        journal.add([("key", DONE)])
    with pytest.raises(DataError, match="rtol: 1e-07 there, 1e-09 now.*--fresh"):
        Journal(path, {"rtol": 1e-9, "physics": "abc"})
    with Journal(path, {"rtol": 1e-9, "physics": "abc"}, fresh=True) as journal:
        assert journal.finished(["key"]) == {}


def test_a_damaged_journal_is_named(tmp_path):
    path = tmp_path / "trial.cells.sqlite"
    path.write_text("not a database, however long this text may be")
    with pytest.raises(DataError, match="cannot use .*--fresh"):
        Journal(path, {})


def test_cells_differ_by_the_last_bit():
    assert cell_key(Scene(b_over_a=2.0)) != cell_key(Scene(b_over_a=np.nextafter(2.0, 3.0)))
    assert cell_key(Scene(b_over_a=2.0)) == cell_key(Scene(b_over_a=2))
