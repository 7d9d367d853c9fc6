"""What is in a file is told with its numbers: some cells of its headline, errors and failures."""

import math

import numpy as np
import pytest
from running import call, run, study_of

from rsfstudy import Axis
from rsfstudy.files import numbers, store
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.status import Status


@pytest.fixture(scope="module")
def map_of_stiffness():
    study = study_of(
        "stiffness",
        LinearStability(),
        Axis("law", ["slip", "slowness"]),
        Axis("b_over_a", np.linspace(1.5, 6.0, 101)),
    )
    return run(study)


def shown(dataset, tmp_path, monkeypatch) -> str:
    monkeypatch.setenv("COLUMNS", "120")
    store.write(dataset, tmp_path / "it.nc")
    return call("show", tmp_path / "it.nc").stdout


def test_a_large_lattice_is_thinned(map_of_stiffness, tmp_path, monkeypatch):
    said = shown(map_of_stiffness, tmp_path, monkeypatch)
    assert "critical stiffness of steady sliding, in sigma_*/D_c (24 of 202 cells)" in said
    lines = [line.split() for line in said.splitlines()]
    laws = ("slip", "slowness")
    rows = [line for line in lines if len(line) > 2 and line[0] in laws and line[1][0].isdigit()]
    assert len(rows) == 24
    assert [rows[0][1], rows[11][1]] == ["1.5", "6"]  # both ends
    for law, ratio, value, *_error in rows:
        near = map_of_stiffness.sel(law=law).sel(b_over_a=float(ratio), method="nearest")
        assert float(value) == pytest.approx(float(near.critical_stiffness), rel=1e-7)


def test_a_small_one_is_whole_and_names_how_cells_ended(map_of_stiffness, tmp_path, monkeypatch):
    few = map_of_stiffness.isel(b_over_a=[0, 50]).copy(deep=True)
    assert "cells)" not in shown(few, tmp_path, monkeypatch)
    few["status"][0, 1], few["critical_stiffness"][0, 1] = int(Status.NO_STEADY_STATE), np.nan
    rows = [line.split() for line in shown(few, tmp_path, monkeypatch).splitlines()]
    (row,) = [row for row in rows if row[:2] == ["slip", "3.75"]]
    assert (row[2], row[-1]) == ("-", "no_steady_state")


@pytest.mark.parametrize("sizes", [{"x": 5}, {"x": 3, "y": 28}, {"x": 9, "y": 9, "z": 2, "u": 7}])
def test_a_sample_has_both_ends_and_so_many_cells_at_most(sizes):
    at = numbers.sample(sizes, 24)
    assert math.prod(map(len, at.values())) <= 24
    for name, size in sizes.items():
        assert at[name][0] == 0
        assert len(at[name]) == 1 or at[name][-1] == size - 1
    assert len(numbers.sample({"x": 5}, 24)["x"]) == 5
