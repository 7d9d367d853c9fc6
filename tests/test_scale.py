"""Tests of large lattices: memory, messages and chunked Zarr stores."""

import functools
import json
import os

import numpy as np
import pytest
import xarray as xr
from faulty_study import faulty_study
from scale import measure_in_subprocess
from study_runs import SMALL_STUDY, have_same_numbers, run

import rsfstudy
from rsfstudy import plots
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.execution import cell_plan
from rsfstudy.storage import zarr_store


@functools.cache
def in_memory() -> xr.Dataset:
    """Return the reference results of the small lattice, cached."""
    return run(SMALL_STUDY)


@pytest.mark.parametrize("format", ["netcdf", "zarr"])
def test_the_driver_needs_less_than_a_kilobyte_a_cell(format):
    """The memory per cell is below 1 kB.

    The memory is the additional peak memory of a process that runs 15,000 cells after a run
    of 100 cells.
    """
    assert measure_in_subprocess(15_000, 0, format)["bytes"] < 1000


def test_few_batches_wait_on_the_scheduler(cluster, monkeypatch):
    """The number of waiting batches is bounded for any number of cells.

    Waiting batches use memory of the scheduler.
    """
    monkeypatch.setattr(cell_plan.CellBatchIterator, "compute_next_batch_size", lambda _self: 1)
    waiting, most = set(), []
    submit = cluster.submit

    def counted(*words, **options):
        future = submit(*words, **options)
        waiting.add(future)
        most.append(sum(f.status == "pending" for f in waiting))
        return future

    monkeypatch.setattr(cluster, "submit", counted)
    run(faulty_study(cells=60), client=cluster)
    assert len(most) == 60
    assert max(most) <= 4 + 2 * 2


@pytest.mark.parametrize(
    ("seconds", "size"),
    [(0.1, 3), (60.0, 1), (1e-6, cell_plan.MAX_BATCH_SIZE), (np.nan, 1), (0.0, 1)],
)
def test_batches_are_sized_by_what_finished_cells_took(seconds, size):
    """A batch takes a fraction of a second, so little work can be lost."""
    batches = cell_plan.CellBatchIterator(None, np.arange(100_000), worker_count=2)
    assert batches.compute_next_batch_size() == 1
    batches.record_cell_time(seconds)
    assert batches.compute_next_batch_size() == size


@pytest.mark.parametrize("count", [0, 1, 2, 10, 999, 1000])
def test_the_first_cells_are_a_sample_of_all(count):
    """Each cell occurs once, and neighbours are not computed in succession."""
    order = cell_plan.order_cells_by_golden_section(np.arange(count))
    assert sorted(order) == list(range(count))
    if count >= 10:
        assert (np.abs(np.diff(order)) > 1).all()


# ---- Zarr ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("numbers", [3, 10**6])
def test_a_zarr_store_holds_the_same_as_the_file(numbers, tmp_path, monkeypatch):
    """A store equals the file for any chunk size.

    No temporary files remain.
    """
    monkeypatch.setattr(zarr_store, "_MAX_VALUES_PER_SLAB", numbers)
    in_pieces = run(SMALL_STUDY, output=tmp_path, format="zarr")
    have_same_numbers(in_pieces.load().map(plain), in_memory())
    assert sorted(os.listdir(tmp_path)) == ["small.cells.sqlite", "small.zarr"]
    alone = xr.open_dataset(tmp_path / "small.zarr", engine="zarr", consolidated=False)
    assert alone.attrs["completeness"] == "complete"
    assert alone.critical_velocity_ratio.attrs == in_memory().critical_velocity_ratio.attrs
    assert rsfstudy.check(tmp_path / "small.zarr").empty
    assert plots.draw_figure(rsfstudy.open(tmp_path / "small.zarr")).axes


def plain(values: xr.DataArray) -> xr.DataArray:
    """Convert strings to the type that NetCDF uses."""
    return values.astype(object) if values.dtype.kind == "T" else values


def test_reductions_and_claims_of_a_zarr_store(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_store, "_MAX_VALUES_PER_SLAB", 100)
    options = {"workers": 0, "progress": False, "output": tmp_path, "b_over_a": [2.0, 3.0, 5.0]}
    store = rsfstudy.run("rate_step_boundary", format="zarr", **options)
    file = rsfstudy.run("rate_step_boundary", **options)
    xr.testing.assert_equal(store.zeta.load().drop_vars("case"), file.zeta.drop_vars("case"))
    verdicts = [rsfstudy.check(found).verdict.tolist() for found in (store, file)]
    assert verdicts[0] == verdicts[1]
    assert "reproduced" in verdicts[0]


def test_a_store_that_is_there_is_not_replaced(tmp_path):
    run(SMALL_STUDY, output=tmp_path, format="zarr")
    with pytest.raises(DataError, match=r"small\.zarr already exists"):
        run(SMALL_STUDY, output=tmp_path, format="zarr")


def test_a_store_cut_short_is_not_taken_for_one(tmp_path, monkeypatch):
    """An interrupted write leaves the journal only, and the run resumes."""
    monkeypatch.setattr(zarr_store, "_MAX_VALUES_PER_SLAB", 3)
    original, written = zarr_store.build_lattice_variables, []

    def interrupted(*words):
        written.append(1)
        if len(written) == 3:
            raise KeyboardInterrupt
        return original(*words)

    with monkeypatch.context() as patch:
        patch.setattr(zarr_store, "build_lattice_variables", interrupted)
        with pytest.raises(rsfstudy.errors.RunError, match="6 of 6 cells are finished"):
            run(SMALL_STUDY, output=tmp_path, format="zarr")
    assert os.listdir(tmp_path) == ["small.cells.sqlite"]
    have_same_numbers(
        run(SMALL_STUDY, output=tmp_path, format="zarr").load().map(plain), in_memory()
    )


@pytest.mark.parametrize("codec", ["numcodecs.pickle", "gzip"])
def test_a_store_is_not_decoded_by_what_ours_are_not(codec, tmp_path):
    """A store with an unknown codec is rejected, because it may run code."""
    run(SMALL_STUDY, output=tmp_path, format="zarr")
    file = tmp_path / "small.zarr" / "message" / "zarr.json"
    about = json.loads(file.read_text())
    about["codecs"].append({"name": codec, "configuration": {}})
    file.write_text(json.dumps(about))
    with pytest.raises(
        DataError, match=f"message uses the codec '{codec}', which could run arbitrary code"
    ):
        rsfstudy.open(tmp_path / "small.zarr")


def test_a_file_and_a_store_of_one_name_are_told_apart(tmp_path):
    run(SMALL_STUDY, output=tmp_path, format="zarr")
    assert rsfstudy.open("small", tmp_path).encoding["source"].endswith("small.zarr")
    run(SMALL_STUDY, output=tmp_path)
    with pytest.raises(DataError, match=r"small\.nc and .*small\.zarr exist"):
        rsfstudy.open("small", tmp_path)
    have_same_numbers(rsfstudy.open(tmp_path / "small.nc"), in_memory())


def test_a_chunk_that_is_damaged_or_lost_is_noticed(tmp_path):
    run(SMALL_STUDY, output=tmp_path, format="zarr")
    chunk = tmp_path / "small.zarr" / "critical_velocity_ratio" / "c" / "0" / "0"
    whole = chunk.read_bytes()
    chunk.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(DataError, match=r"small\.zarr is damaged"):
        rsfstudy.open(tmp_path / "small.zarr")
    chunk.unlink()
    (tmp_path / "small.zarr" / "status" / "c" / "0" / "0").unlink(missing_ok=True)
    with pytest.raises(DataError, match=r"small\.zarr is damaged"):
        rsfstudy.open(tmp_path / "small.zarr")
    # Without rsfstudy, the missing values have the status "pending", not "ok".
    bare = xr.open_dataset(tmp_path / "small.zarr", engine="zarr", consolidated=False)
    assert int(bare.status[0, 0]) == rsfstudy.status.Status.PENDING
    assert np.isnan(bare.critical_velocity_ratio[0, 0])


def test_without_the_extra_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(zarr_store.importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(InvalidValue, match=r"pip install 'rsfstudy\[zarr\]'"):
        run(SMALL_STUDY, output=tmp_path, format="zarr")
