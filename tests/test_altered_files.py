"""Tests of altered results files, and of paths that are not results.

Each command ends with an answer, or with an error that names the problem, but never with a
traceback.
"""

import contextlib
import json
import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_runs import FAULTY_STUDY_FILE, example_claim, run, run_command

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.cli.console_output import stdout_console
from rsfstudy.errors import DataError, InvalidValue, RunError
from rsfstudy.reductions import LinearFit
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.status import Status
from rsfstudy.storage import dataset_files

#: A cheap study with every kind of content that a file can have.
TINY = Study(
    name="tiny",
    title="A tiny lattice",
    base=Scene(),
    axes=[
        Axis("case", {"constant": {"normal_stress": "constant"}, "variable": {"alpha": 0.3}}),
        Axis("load_velocity_ratio", [1.0, 2.0, 4.0]),
    ],
    measure=LinearStability(),
    reductions=[
        LinearFit(name="slope", of="critical_stiffness", on="log_load_velocity_ratio"),
    ],
    claims=[
        example_claim(
            variable="critical_stiffness",
            where={"case": "constant", "load_velocity_ratio": 1.0},
            published=0.0145,
            tolerance=1e-6,
        ),
    ],
    references=["a paper"],
)
PLACE = {"case": "variable", "load_velocity_ratio": "2"}


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> xr.Dataset:
    output = tmp_path_factory.mktemp("tiny")
    dataset = run(TINY.with_(load_velocity_ratio=[1.0, 2.0, 4.0]), output=output)
    # One cell is unverified, so that the commands list a cell.
    dataset["status"][0, 0] = int(Status.UNVERIFIED)
    return dataset


# ---- altered files ------------------------------------------------------------------------------
KINDS = {
    "whole numbers": lambda shape: np.full(shape, -77),
    "dates": lambda shape: np.full(shape, np.datetime64("2020-01-01", "ns")),
    "spans of time": lambda shape: np.full(shape, np.timedelta64(10**9, "ns")),
}
_JSON = ("declaration", "provenance")


def attributes(dataset):
    """Return all attributes by variable name.

    The attributes of the file have an empty name.
    """
    attrs = {str(name): dict(values.attrs) for name, values in dataset.variables.items()}
    attrs[""] = dataset.attrs | {name: json.loads(dataset.attrs[name]) for name in _JSON}
    return attrs


def with_other_attributes(dataset, at, change):
    """Return the dataset with one attribute changed.

    The path may also lead to an element of an attribute in JSON format.
    """
    inside = whole = attributes(dataset)
    for key in at[:-1]:
        inside = inside[key]
    change(inside, at[-1])
    whole[""] |= {name: json.dumps(whole[""][name]) for name in _JSON if name in whole[""]}
    other = dataset.assign_attrs()
    other.attrs = whole[""]
    for name in other.variables:
        other[name].attrs = whole[name]
    return other


def removed(inside, key):
    del inside[key]


def replaced(by):
    def change(inside, key):
        inside[key] = by

    return change


def with_another_variable(dataset, name, how):
    """Return the dataset without a variable, or with a replacement of it."""
    dims, shape, rest = dataset[name].dims, dataset[name].shape, dataset.drop_vars(name)
    if how == "removed":
        return rest
    if how == "along nothing":
        return rest.assign({name: 1.0})
    return rest.assign({name: (dims, KINDS[how](shape))})


def sealed(dataset, path: Path) -> str:
    """Write a dataset with a valid digest, and return its path."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # xarray warns of the contents that it writes.
        dataset_files.write_dataset(dataset, path)
    return str(path)


def refused(file, complaint) -> None:
    """Assert that Python functions and commands reject a file."""
    with pytest.raises(DataError, match=complaint):
        rsfstudy.open(file)
    for command_ in ("show", "check", "plot", "rerun"):
        code, said = run_command([command_, file])
        assert code in (1, 2)
        assert said.startswith("error: ")


def way_to(at: str) -> tuple[str | int, ...]:
    return tuple(int(key) if key.isdigit() else key for key in at.split("."))


@pytest.mark.parametrize(
    ("at", "change", "complaint"),
    [
        ("id", removed, "id is missing"),
        ("id", replaced("../other"), "id is '../other', but the declared study is 'tiny'"),
        ("declaration.claims.0.id", removed, r"declaration.claims\[0\].id is missing"),
        ("declaration.claims.0.tolerance", replaced(10**400),
         "declaration.*(Number out of range|must be a number|int too large)"),
        ("declaration.base.phi", replaced(95.0), "base.phi is invalid .*less than 90"),
        ("declaration.novel", replaced(1), "declaration.novel is unknown"),
        ("provenance.versions.numpy", replaced(2),
         r"provenance.versions\[...\] is invalid .Expected `str`"),
    ],
)  # fmt: skip
def test_what_is_refused_is_named_by_its_path(at, change, complaint, tiny, tmp_path):
    file = sealed(with_other_attributes(tiny, ("", *way_to(at)), change), tmp_path / "tiny.nc")
    refused(file, f"tiny.nc: .*{complaint}.*another version|{complaint}")


@pytest.mark.parametrize(
    ("name", "how", "complaint"),
    [
        ("status", "removed", "status is missing"),
        ("status", "whole numbers", "status is -77 in a cell"),
        ("wall_time", "along nothing", r"wall_time has the dimensions \(\), but status has"),
        ("message", "whole numbers", "message contains int64, but must contain strings"),
        ("case", "removed", "case is not a dimension coordinate"),
    ],
)
def test_a_variable_that_is_refused_is_named(name, how, complaint, tiny, tmp_path):
    other = with_another_variable(tiny, name, how)
    refused(sealed(other, tmp_path / "tiny.nc"), f"tiny.nc: {complaint}")


@pytest.mark.parametrize(
    ("at", "change", "complaint"),
    [
        ("measure.novel", replaced(1), "declaration.measure.novel is unknown"),
        ("reductions.0.within", replaced([1]), r"reductions\[0\].within is invalid .*of length 2"),
        (
            "axes.1.values",
            replaced([1.0, 2.0]),
            "has 2 points in the declaration, but 3 points in the",
        ),
        (
            "axes.1.values",
            replaced([1.0, 2.0, 3.0]),
            "load_velocity_ratio differs from the axis in the",
        ),
        ("plot", replaced("a\0b"), "declaration is not a valid study .*must be a string"),
    ],
)
def test_a_rerun_refuses_what_makes_no_study_by_its_path(at, change, complaint, tiny, tmp_path):
    other = with_other_attributes(tiny, ("", "declaration", *way_to(at)), change)
    file = sealed(other, tmp_path / "tiny.nc")
    rsfstudy.open(file)
    for again in (
        lambda: rsfstudy.rerun(file, workers=0, progress=False),
        lambda: rsfstudy.recompute_cell(file, PLACE),
    ):
        with pytest.raises(DataError, match=complaint):
            again()


# ---- paths that are no results ------------------------------------------------------------------
@pytest.fixture
def nowhere(tmp_path, monkeypatch):
    """Create a directory of files and links that are not results."""
    monkeypatch.chdir(tmp_path)
    for name in ("dir", "dir.nc", "dir.zarr", "odd.zarr"):
        (tmp_path / name).mkdir()
    for name in ("file.txt", "text.nc"):
        (tmp_path / name).write_text("text")
    (tmp_path / "empty.nc").touch()
    xr.Dataset({"v": 1.0}).to_netcdf(tmp_path / "foreign.nc")
    (tmp_path / "odd.zarr" / "zarr.json").write_text("[]")
    (tmp_path / "dangling.nc").symlink_to("/nowhere")
    (tmp_path / "circle.nc").symlink_to("circle.nc")
    (tmp_path / "circle.py").symlink_to("circle.py")
    (tmp_path / "root.zarr").symlink_to("/")
    for name in ("zero.nc", "zero.py"):
        (tmp_path / name).symlink_to("/dev/zero")
    return tmp_path


@pytest.mark.parametrize("command_", ["show", "check", "plot", "rerun"])
@pytest.mark.parametrize(
    "path",
    ["/", "//", ".", "..", "", "/dev/null", "/etc/passwd", "dir", "dir.nc", "dir.zarr", "odd.zarr",
     "file.txt", "file.txt/x.nc", "text.nc", "empty.nc", "foreign.nc", "missing.nc", "dangling.nc",
     "circle.nc", "circle.py", "root.zarr", "zero.nc", "zero.py", "*", "**/x", "small[1].nc",
     "a" * 9999, f"{'a' * 9999}.nc", f"{'a' * 9999}.py", "a/" * 5000 + "x.nc", "a b " * 2500],
    ids=lambda path: path[:20],
)  # fmt: skip
def test_a_path_that_is_no_results_file(command_, path, nowhere):
    """The error message is short and contains the path."""
    code, said = run_command([command_, path])
    assert code in (1, 2)
    assert said.startswith("error: ")
    assert path[:30].strip() in said
    assert len(said) < 1000


def test_a_pipe_is_not_waited_for(tmp_path, monkeypatch):
    """Commands do not block if a pipe has the name of a file.

    The pipes replace input files, and files that a run writes.
    """
    monkeypatch.chdir(tmp_path)
    for name in ("pipe.nc", "pipe.zarr", "pipe.py", ".faulty.nc.new", "faulty.cells.sqlite"):
        os.mkfifo(name)
    for words in (["show", "pipe.nc"], ["check", "pipe.zarr"], ["run", "pipe.py"]):
        code, said = run_command(words)
        assert code in (1, 2)
        assert "not a regular file" in said
    words = ["run", str(FAULTY_STUDY_FILE), "--serial", "--quiet", "--fresh", "--output", "."]
    code, said = run_command(words)
    assert (code, "wrote" in said) == (0, True)


# ---- options ------------------------------------------------------------------------------------
@pytest.mark.parametrize(("cores", "most"), [(2, 8), (3, 12), (None, 8)])
def test_more_workers_than_a_machine_can_bear_are_refused(cores, most, monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    for workers in (most + 1, 10**100):
        with pytest.raises(InvalidValue, match=f"must be at most {most} on this machine"):
            run(workers=workers)


def test_an_error_keeps_both_ends_of_what_is_long():
    error = InvalidValue("name", "begin" + "x" * 10_000 + "end", "must be short")
    assert len(str(error)) < 200
    assert str(error).startswith("'name' must be short (got 'begin")
    assert str(error).endswith("end').")
    many = InvalidValue("name", "25", "is unknown", choices=map(str, range(300)), remedy="Choose.")
    assert "Did you mean '25'" in str(many)
    assert len(str(many)) < 1000


def test_a_command_may_hold_bytes_that_are_no_text(tmp_path, monkeypatch):
    """Undecodable bytes in the command or the creator name are escaped."""
    monkeypatch.setenv("RSFSTUDY_CREATOR_NAME", "G\udcf6del")
    for format_ in ("netcdf", "zarr"):
        run(TINY, output=tmp_path / format_, format=format_, command="rsfstudy run \udcff")
        found = rsfstudy.open("tiny", tmp_path / format_)
        assert found.attrs["history"].endswith(r"rsfstudy run \udcff")
        assert found.attrs["creator_name"] == r"G\udcf6del"


def test_a_full_disk_where_the_output_goes_is_told(monkeypatch):
    # Closing the file raises an error too.
    with contextlib.suppress(OSError), open("/dev/full", "w") as full:
        monkeypatch.setattr(sys, "stdout", full)
        with pytest.raises(RunError, match="cannot print: No space left on device"):
            stdout_console.print("anything")
