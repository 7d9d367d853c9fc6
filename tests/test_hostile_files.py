"""Tests of hostile files.

Hostile files are rejected in bounded time, with an error that contains the rule, and leave
no locks.
"""

from __future__ import annotations

import contextlib
import difflib
import json
import sqlite3
import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from study_runs import call_main, run
from test_altered_files import TINY
from test_files import LAYOUT

import rsfstudy
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.referee import benchmark_problem_files
from rsfstudy.storage import dataset_files
from rsfstudy.storage.cell_journal import CellJournal, CellWallTimes

LONG = 130_000


# ---- headings ------------------------------------------------------------------------------------
@pytest.mark.parametrize("units", ["a" * LONG, " " * LONG, "m/" * LONG, "(" * LONG, "1 * " * LONG])
def test_a_heading_is_bounded_before_it_is_parsed(units: str, tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    file.write_text(f"time (s),friction,displacement ({units[:LONG]})\n0,0.6,0\n1,0.6,1\n")
    for read in (rsfstudy.read_record, rsfstudy.read_table, rsfstudy.history, rsfstudy.events):
        with pytest.raises(InvalidValue, match=r"line 1, column 3: .*at most 200 characters"):
            read(file)
    arrays = {"time (s)": [0, 1], "friction": [1, 1], f"displacement ({units})": [0, 1]}
    with pytest.raises(InvalidValue, match=r"column 3: .*at most 200 characters"):
        rsfstudy.read_record(arrays)
    with pytest.raises(InvalidValue, match="at most 200 characters"):
        rsfstudy.read_record({"t": [0, 1]}, columns={"time": units, "displacement": "t (um)"})
    stated = {"slip_distance": "10 um", "reference_velocity": "1 um/s"}
    with pytest.raises(
        InvalidValue, match="not a quantity, because it has more than 200 characters"
    ):
        rsfstudy.Rig(normal_stress=f"5 MPa {units}x", **stated)


@contextlib.contextmanager
def calls_of_builtins():
    """Count the calls of built-in functions by name."""
    counts: Counter[str] = Counter()

    def count(_frame, event, function):
        if event == "c_call":
            counts[function.__name__] += 1

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        yield counts
    finally:
        sys.setprofile(before)


def test_headings_are_counted_once(tmp_path: Path) -> None:
    many = 2000
    header = ",".join(f"c{number} (um)" for number in range(many))
    file = tmp_path / "many.csv"
    file.write_text(f"{header}\n{','.join(['1'] * many)}\n")
    with calls_of_builtins() as counts:
        assert len(rsfstudy.read_table(file)) == many
    assert counts["index"] + counts["count"] < 10


def test_few_choices_are_compared_with_a_value(monkeypatch) -> None:
    compared = []

    def count(_word, choices, **_options):
        compared.append(len(choices))
        return []

    monkeypatch.setattr(difflib, "get_close_matches", count)
    InvalidValue("column", "x", "is unknown", choices=map(str, range(100_000)))
    InvalidValue("column", "x", "is unknown", choices=["a" * LONG])
    assert max(compared) <= 1000
    assert min(compared) == 0


# ---- nesting -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "text",
    ["parameters = " + "[" * 5000 + "]" * 5000, "parameters = " + "{a=" * 5000 + "1" + "}" * 5000,
     "number = " + "9" * 5000],
    ids=["arrays", "tables", "digits"],
)  # fmt: skip
def test_toml_that_cannot_be_parsed_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "deep.toml").write_text(text)
    with pytest.raises(DataError, match="deep.toml: cannot be read as TOML"):
        benchmark_problem_files.read_problem(tmp_path / "deep.toml")


@pytest.mark.parametrize(
    "fingerprint", ["[" * 100_000, '{"budget": ' * 100_000, "5", "[[1, 2], [3]]", "{", "\0"]
)
def test_a_journal_with_a_hostile_fingerprint_is_refused_and_not_locked(
    fingerprint: str, tmp_path: Path
) -> None:
    path = tmp_path / "trial.cells.sqlite"
    with CellJournal(path, {"rtol": 1e-7}, LAYOUT):
        pass
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE fingerprint SET json = ?", (fingerprint,))
    with pytest.raises(DataError, match="its fingerprint is damaged") as refused:
        CellJournal(path, {"rtol": 1e-7}, LAYOUT)
    assert refused.value.__traceback__ is not None  # The traceback keeps its frames alive.
    assert CellWallTimes.read_from_journal(path) is None
    with CellJournal(path, {"rtol": 1e-7}, LAYOUT, fresh=True) as again:
        assert again.read_statuses(np.empty(0, dtype="V16")).size == 0


# ---- attributes ----------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def tiny() -> xr.Dataset:
    return run(TINY)


@pytest.mark.parametrize(
    ("name", "attributes", "rule"),
    [
        ("critical_stiffness", {"long_name": 5}, "critical_stiffness.long_name is 5, but must be"),
        ("critical_stiffness", {"units": 1}, "critical_stiffness.units is 1, but must be a string"),
        ("critical_stiffness", {"scale": [1, 2]}, "scale is .*but must be a string"),
        ("critical_stiffness", {"units": " (" * 50_000}, "units has 100,000 characters"),
        ("status", {"flag_meanings": 3}, "status.flag_meanings is 3, but must be a string"),
        ("status", {"flag_values": [0, 1]}, "status.flag_values must contain one number for each"),
        ("status", {"flag_values": "many"}, "status.flag_values must contain one number for each"),
    ],
)
def test_attributes_of_the_wrong_kind_are_refused(name, attributes, rule, tiny, tmp_path) -> None:
    dataset = tiny.copy()
    dataset[name].attrs.update(attributes)
    dataset_files.write_dataset(dataset, tmp_path / "tiny.nc")
    with pytest.raises(DataError, match=f"tiny.nc: .*{rule}"):
        rsfstudy.open(tmp_path / "tiny.nc")
    for command in ("show", "plot"):
        told = call_main(command, tmp_path / "tiny.nc")
        assert told.returncode == 1
        assert "Traceback" not in told.stderr


def test_attributes_of_a_motion_are_checked(tmp_path: Path) -> None:
    motion = rsfstudy.simulate(rsfstudy.Scene(load_velocity_ratio=2.0), duration=1.0, rtol=1e-3)
    motion["slip"].attrs["long_name"] = 5
    dataset_files.write_dataset(motion, tmp_path / "motion.nc")
    with pytest.raises(DataError, match="slip.long_name is 5, but must be a string"):
        dataset_files.read_dataset(tmp_path / "motion.nc")


def test_texts_along_a_motion_are_refused(tmp_path: Path) -> None:
    motion = rsfstudy.simulate(rsfstudy.Scene(load_velocity_ratio=2.0), duration=1.0, rtol=1e-3)
    size = motion["slip"].size
    motion["shear_stress"] = (motion["slip"].dims, np.array(["x"] * size, dtype=object))
    dataset_files.write_dataset(motion, tmp_path / "motion.nc")
    with pytest.raises(DataError, match="shear_stress is .*, but must be numeric"):
        dataset_files.read_dataset(tmp_path / "motion.nc")


@pytest.mark.parametrize("name", ["normal_stress_ratio", "frictional_stress", "time"])
def test_a_motion_without_a_variable_that_is_drawn_names_it(name: str) -> None:
    motion = rsfstudy.simulate(rsfstudy.Scene(load_velocity_ratio=2.0), duration=1.0, rtol=1e-3)
    with pytest.raises(DataError, match="(normal_stress|frictional_stress|time) is missing. The"):
        rsfstudy.plot_motion(motion.drop_vars(name))


def test_a_lattice_with_the_same_point_twice_is_refused(tiny, tmp_path: Path) -> None:
    dataset_files.write_dataset(tiny.isel(load_velocity_ratio=[0, 0, 2]), tmp_path / "tiny.nc")
    with pytest.raises(DataError, match="load_velocity_ratio has the same value more than once"):
        rsfstudy.open(tmp_path / "tiny.nc")


# ---- long names ----------------------------------------------------------------------------------
TOO_LONG = "a" * 300


@pytest.mark.parametrize("name", [TOO_LONG, f"{TOO_LONG}.nc", f"{TOO_LONG}.py", "a/" * 3000])
def test_a_name_that_no_file_can_have_is_refused_by_its_rule(name: str) -> None:
    for ask in (rsfstudy.open, rsfstudy.check):
        with pytest.raises(InvalidValue, match="must have at most (255|4,096) bytes"):
            ask(name)
    with pytest.raises(InvalidValue, match="must have at most (255|4,096) bytes"):
        rsfstudy.run(name, workers=0, progress=False)


def test_the_name_of_a_study_leaves_room_for_its_files() -> None:
    with pytest.raises(
        InvalidValue, match="must have at most 200 bytes .*, because it is used in file names"
    ):
        rsfstudy.Study(name="ä" * 101, title="", base=TINY.base, axes=TINY.axes,
                       measure=TINY.measure)  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert json.dumps(TINY.describe())
