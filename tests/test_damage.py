"""Tests of damaged results files, with and without the digest at the end."""

from __future__ import annotations

import shutil
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_runs import run
from test_altered_files import TINY

import rsfstudy
from rsfstudy.errors import DataError
from rsfstudy.storage import content_digest, dataset_files, schema

#: The declaration with many claims is so long that HDF5 stores no checksum of it.
STUDY = replace(
    TINY, claims=[replace(TINY.claims[0], id=f"C{number}", reason="x" * 50) for number in range(30)]
)


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> Path:
    output = tmp_path_factory.mktemp("damage")
    run(STUDY, output=output)
    return output / "tiny.nc"


def cut(file: Path) -> bytes:
    """Return the bytes of a file without the digest at its end."""
    content = file.read_bytes()
    return content[: content.rindex(b"\nrsfstudy sha256 ")]


def test_a_file_without_its_end_opens_with_a_warning(written, tmp_path):
    (tmp_path / "tiny.nc").write_bytes(cut(written))
    with pytest.warns(UserWarning, match="has no digest, because another program saved"):
        opened = rsfstudy.open(tmp_path / "tiny.nc")
    xr.testing.assert_identical(opened, rsfstudy.open(written))
    assert content_digest.CONTENT_DIGEST_ATTRIBUTE not in opened.attrs


@pytest.mark.parametrize("damaged", ["declaration", "number", "text", "content_digest"])
def test_damage_is_refused_without_the_end(damaged, written, tmp_path):
    """A single damaged byte is detected even if HDF5 does not detect it."""
    content, dataset = bytearray(cut(written)), rsfstudy.open(written)
    digest = xr.load_dataset(written).attrs["content_digest"].encode()
    original = {
        "declaration": b'"published": 0.0145',
        "number": dataset["critical_stiffness"].values[1].tobytes(),
        "text": b"variable",
        "content_digest": digest[100:],
    }[damaged]
    places = [n for n in range(len(content)) if content.startswith(original, n)]
    assert places
    for place in places:
        content[place + len(original) - 1] ^= 1
    (tmp_path / "tiny.nc").write_bytes(content)
    with pytest.raises(DataError, match=r"tiny.nc (is damaged or was edited|cannot be read)"):
        rsfstudy.open(tmp_path / "tiny.nc")


def test_random_damage_is_refused_or_changes_nothing(written, tmp_path):
    content, whole = cut(written), rsfstudy.open(written)
    random, file = np.random.default_rng(11), tmp_path / "tiny.nc"
    refused = 0
    for _ in range(60):
        damaged = bytearray(content)
        damaged[int(random.integers(len(damaged)))] ^= 1 << int(random.integers(8))
        file.write_bytes(damaged)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                opened = rsfstudy.open(file)
            except DataError:
                refused += 1
                continue
        for name, values in whole.variables.items():
            np.testing.assert_array_equal(opened[name].values, values.values)
        assert opened.attrs["declaration"] == whole.attrs["declaration"]
    assert refused > 0


@pytest.mark.parametrize(
    "change",
    [
        lambda dataset: dataset.assign(log=np.log(dataset["critical_stiffness"])),
        lambda dataset: dataset.isel(load_velocity_ratio=[0, 2]),
        lambda dataset: dataset.drop_vars("slope_stderr"),
        lambda dataset: dataset.assign_attrs(title="Mine"),
        lambda dataset: dataset.rsf.to_si(normal_stress=5e6, slip_distance=1e-5),
        lambda dataset: dataset.copy(),
    ],
    ids=["added", "selected", "dropped", "titled", "converted", "unchanged"],
)
def test_a_file_that_another_program_saved_opens_with_a_warning(change, written, tmp_path):
    change(xr.load_dataset(written)).to_netcdf(tmp_path / "mine.nc")
    with pytest.warns(UserWarning, match=r"mine.nc has no digest, because another program saved"):
        rsfstudy.open(tmp_path / "mine.nc")


def test_a_number_that_another_program_changed_is_refused_with_the_remedy(written, tmp_path):
    dataset = xr.load_dataset(written)
    dataset["critical_stiffness"][0, 0] += 1e-9
    dataset.to_netcdf(tmp_path / "mine.nc")
    with pytest.raises(
        DataError, match="critical_stiffness does not match its digest.*delete the attribute"
    ):
        rsfstudy.open(tmp_path / "mine.nc")
    del dataset.attrs["content_digest"]
    dataset.to_netcdf(tmp_path / "mine.nc")
    changed = rsfstudy.open(tmp_path / "mine.nc")
    assert changed["critical_stiffness"].equals(dataset["critical_stiffness"])


def test_a_dataset_of_rsfstudy_that_xarray_saved_opens_without_a_warning(written, tmp_path):
    """Datasets in memory have no digest, so their files do not have one either."""
    for number, dataset in enumerate((rsfstudy.open(written), run(STUDY, output=None))):
        dataset.to_netcdf(path := tmp_path / f"mine{number}.nc")
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            opened = rsfstudy.open(path)
        assert opened["critical_stiffness"].equals(dataset["critical_stiffness"])


def test_a_dataset_that_is_written_again_gets_a_digest_of_its_own(written, tmp_path):
    dataset = xr.load_dataset(written)
    dataset["critical_stiffness"][0, 0] += 1e-9
    dataset_files.write_dataset(dataset, tmp_path / "again.nc")
    (tmp_path / "tiny.nc").write_bytes(cut(tmp_path / "again.nc"))
    with pytest.warns(UserWarning, match="has no digest"):
        rsfstudy.open(tmp_path / "tiny.nc")


def test_a_damaged_motion_is_refused(tmp_path):
    motion = rsfstudy.simulate(rsfstudy.Scene(load_velocity_ratio=2.0), duration=1.0, rtol=1e-3)
    dataset_files.write_dataset(motion, tmp_path / "whole.nc")
    content = bytearray(cut(tmp_path / "whole.nc"))
    place = content.index(motion["slip"].values[-3:].tobytes())
    content[place + 3] ^= 1
    (tmp_path / "motion.nc").write_bytes(content)
    with pytest.raises(DataError, match=r"slip does not match its digest"):
        dataset_files.read_dataset(tmp_path / "motion.nc")
    shutil.copy(tmp_path / "whole.nc", tmp_path / "motion.nc")
    again = dataset_files.read_dataset(tmp_path / "motion.nc")
    xr.testing.assert_identical(again, motion.assign_attrs(layout=schema.FILE_LAYOUT_VERSION))
