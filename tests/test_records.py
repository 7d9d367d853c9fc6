"""Tests of reading records from text files, arrays and binary xlook files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import rsfstudy
from rsfstudy.errors import DataError, InvalidValue

TIME = np.array([0.0, 0.5, 1.0, 2.0])
MOVED = np.array([0.0, 1.5, 3.0, 36.0])
SHEAR = np.array([12.0, 12.5, 13.0, 12.25])
NORMAL = np.array([20.0, 20.0, 20.5, 19.5])
FRICTION = SHEAR / NORMAL


def written(path: Path, headings: list[str], columns: list[np.ndarray], between: str) -> Path:
    """Write a text file with columns, and return its path."""
    lines = [between.join(headings)]
    lines += [between.join(f"{v:.12g}" for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_units_of_headings(between: str, tmp_path: Path) -> None:
    """Each column is converted from the unit in its heading.

    All units differ, so a wrong conversion cannot go unnoticed.
    """
    headings = ["Time (min)", "LP [mm]", "tau [kPa]", "Normal stress [MPa]"]
    columns = [TIME / 60.0, MOVED * 1e-3, SHEAR * 1e3, NORMAL]
    record = rsfstudy.read_record(written(tmp_path / "a run-2.csv", headings, columns, between))
    told = record.columns
    assert record.name == "a_run_2"
    np.testing.assert_allclose(told["time"], TIME, rtol=1e-11)
    np.testing.assert_allclose(told["displacement"], MOVED, rtol=1e-11)
    np.testing.assert_allclose(told["friction"], FRICTION, rtol=1e-11)
    np.testing.assert_allclose(told["normal_stress"], 1e6 * NORMAL, rtol=1e-11)


def test_units_beside_headings_and_a_stated_normal_stress(tmp_path: Path) -> None:
    path = written(tmp_path / "run.txt", ["t", "lp", "tau"], [TIME, MOVED * 1e-3, SHEAR], "\t")
    columns = {"time": "t (s)", "displacement": ("lp", "mm"), "shear_stress": "tau (MPa)"}
    record = rsfstudy.read_record(path, columns, normal_stress="0.02 GPa", name="mine")
    assert record.name == "mine"
    np.testing.assert_allclose(record.columns["displacement"], MOVED, rtol=1e-11)
    np.testing.assert_allclose(record.columns["friction"], SHEAR / 20.0, rtol=1e-11)
    # A recorded normal stress takes precedence over the argument.
    arrays = {"time": TIME, "displacement": MOVED, "shear_stress": SHEAR, "normal_stress": NORMAL}
    both = rsfstudy.read_record(arrays, normal_stress="10 MPa")
    np.testing.assert_allclose(both.columns["friction"], FRICTION, rtol=1e-15)


def test_one_column_is_named_and_the_others_are_known() -> None:
    """Columns that are not named are identified by their headings.

    Only the required columns are read.
    """
    arrays = {"Time (s)": TIME, "ram (um)": MOVED, "Disp (um)": 2.0 * MOVED, "mu": FRICTION}
    arrays["Normal stress (MPa)"] = NORMAL
    told = rsfstudy.read_record(arrays, {"displacement": "ram (um)"}).columns
    np.testing.assert_allclose(told["displacement"], MOVED, rtol=1e-15)
    np.testing.assert_allclose(told["friction"], FRICTION, rtol=1e-15)
    told = rsfstudy.read_record(arrays, {"displacement": "ram (um)", "friction": "mu"}).columns
    assert "normal_stress" not in told


@pytest.mark.parametrize(
    ("key", "other", "one"),
    [
        ("displacement", "Displacement on board (um)", "LP displacement (um)"),
        ("normal_stress", "Sigma_3 (MPa)", "Sigma_n (MPa)"),
        ("normal_stress", "Normal stress (MPa)", "Effective normal stress (MPa)"),
    ],
)
def test_headings_that_may_mean_the_same_are_refused(key: str, other: str, one: str) -> None:
    """Ambiguous headings are rejected.

    Two similar headings are accepted if their units differ, if one heading is the exact
    name, or if the call selects a column.
    """
    arrays = {"Time (s)": TIME, "Disp (um)": MOVED, "tau (MPa)": SHEAR, "sigma (MPa)": NORMAL}
    del arrays["Disp (um)" if key == "displacement" else "sigma (MPa)"]
    right = MOVED if key == "displacement" else NORMAL
    scale = {"normal_stress": 1e6}.get(key, 1.0)
    arrays |= {other: 2.0 * right, one: right}
    with pytest.raises(InvalidValue, match="matches several headings") as refused:
        rsfstudy.read_record(arrays)
    assert other in str(refused.value)
    assert f"--columns '{key}={one}'" in str(refused.value)
    told = rsfstudy.read_record(arrays, {key: one}).columns
    np.testing.assert_allclose(told[key], scale * right, rtol=1e-15)
    units = one.partition(" (")[2]
    exact = {f"{key} ({units}" if name == one else name: v for name, v in arrays.items()}
    np.testing.assert_array_equal(rsfstudy.read_record(exact).columns[key], told[key])
    apart = {
        name.replace(units, "mm/s)") if name == other else name: v for name, v in arrays.items()
    }
    np.testing.assert_array_equal(rsfstudy.read_record(apart).columns[key], told[key])


def test_types_of_arrays_tell_what_they_are() -> None:
    """Dates and time intervals are times, and masked values are missing."""
    plain = {"Time (min)": TIME / 60.0, "LP (um)": MOVED, "mu": FRICTION}
    # The clocks change from 2 to 3 at this time.
    first = pd.Timestamp("2026-03-29 01:59:59", tz="Europe/Berlin")
    intervals = pd.to_timedelta(TIME, unit="s")
    for times in (intervals, intervals.to_numpy(), first + intervals):
        record = rsfstudy.read_record(pd.DataFrame({**plain, "Time (min)": times}))
        np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    masked = np.ma.masked_where(np.arange(len(MOVED)) == 3, MOVED)
    with pytest.raises(InvalidValue, match="sample 4: 'displacement' must be a finite number"):
        rsfstudy.read_record({**plain, "LP (um)": masked})
    with pytest.raises(
        InvalidValue, match="displacement = '1 s' has units that are incompatible with"
    ):
        rsfstudy.read_record({**plain, "LP (um)": intervals})
    with pytest.raises(InvalidValue, match="'friction' must be real numbers"):
        rsfstudy.read_record({**plain, "mu": FRICTION + 0j})


def test_a_table_in_memory_is_read_as_its_file(tmp_path: Path) -> None:
    headings = ["Time (min)", "LP disp (mm)", "mu"]
    path = written(tmp_path / "run.csv", headings, [TIME / 60.0, MOVED * 1e-3, FRICTION], ",")
    columns = {"time": "Time (min)", "displacement": "LP disp (mm)", "friction": "mu"}
    for told in (None, columns):
        record = rsfstudy.read_record(pd.read_csv(path), told)
        for name, values in rsfstudy.read_record(path, told).columns.items():
            np.testing.assert_array_equal(record.columns[name], values)
    with pytest.raises(InvalidValue, match=r"^column 'mu' is unknown. Choices: time, .*friction"):
        rsfstudy.read_record(path, {"mu": "mu"})
    with pytest.raises(InvalidValue, match="column 't' is not a heading of the table"):
        rsfstudy.read_record(pd.read_csv(path), {"time": "t (s)"})


def test_raw_numbers_have_a_scale_and_an_offset(tmp_path: Path) -> None:
    path = written(tmp_path / "raw.csv", ["t", "lp * 2", "mu"], [TIME, MOVED, FRICTION], ",")
    named = {"time": "t (min)", "displacement": "lp * 2 (um)", "friction": "mu*-2.0+1.5"}
    told = rsfstudy.read_record(path, named).columns
    # This heading contains the asterisk.
    np.testing.assert_allclose(told["displacement"], MOVED, rtol=1e-11)
    np.testing.assert_allclose(told["friction"], 1.5 - 2.0 * FRICTION, rtol=1e-11)
    with pytest.raises(InvalidValue, match="mu"):
        rsfstudy.read_record(path, {**named, "friction": "mu * 1e-e"})


def xlook(path: Path, columns: list[tuple[str, str, np.ndarray]]) -> Path:
    """Write a binary xlook file, with random bytes after each NUL."""

    def text(told: str, size: int) -> bytes:
        return (told.encode() + b"\0").ljust(size, b"\x7f")

    data = text("p4567", 20) + struct.pack(">ii", max(len(v) for *_, v in columns), len(columns))
    data += bytes(8)
    for number in range(32):
        heading, units, values = columns[number] if number < len(columns) else ("no_val", "", [])
        data += text(heading, 13) + text(units, 13) + bytes(4) + text("remark", 50)
        data += struct.pack(">i", len(values))
    assert len(data) == 2724
    for _heading, _units, values in columns:
        data += np.asarray(values, dtype=">f4").tobytes()
    path.write_bytes(data)
    return path


def test_a_binary_file_of_xlook(tmp_path: Path) -> None:
    """The columns of a binary xlook file are read and converted.

    The file contains time differences in ms, raw bits, and a column with an additional
    sample.
    """
    bits = np.array([100.0, 250.0, 400.0, 3700.0])
    columns = [
        ("Time", "ms", np.array([250.0, 500.0, 500.0, 1000.0])),
        ("LP_Disp", "bit", bits),
        ("mu", ".", np.array([*FRICTION, 0.75])),
        ("rest", "bit", np.array([7.0])),
    ]
    path = xlook(tmp_path / "p4567.dat", columns)
    chosen = {
        "time": (1, "ms"),
        "displacement": ("LP_Disp", "mm", 1e-5, -1e-3),
        "friction": ("3", "1"),
    }
    told = rsfstudy.read_record(path, chosen).columns
    # Numbers of 32 bits have 7 digits.
    np.testing.assert_allclose(told["time"], TIME + 0.25, rtol=1e-6)
    np.testing.assert_allclose(told["displacement"], 0.01 * bits - 1.0, rtol=1e-6)
    np.testing.assert_allclose(told["friction"], FRICTION, rtol=1e-6)
    by_text = {"time": "Time (ms)", "displacement": "LP_Disp (um)", "friction": "mu"}
    plain = rsfstudy.read_record(path, by_text)
    np.testing.assert_allclose(plain.columns["displacement"], bits, rtol=1e-6)
    with pytest.raises(
        InvalidValue, match="'friction' must have as many samples as 'time' .got an array of .*1,"
    ):
        rsfstudy.read_record(path, {**chosen, "friction": ("rest", "1")})
    with pytest.raises(
        InvalidValue, match="column 'tau' is not a heading of the table.* Columns can also be"
    ):
        rsfstudy.read_record(path, {**chosen, "friction": ("tau", "1")})
    with pytest.raises(InvalidValue, match=r"column 2: displacement = '1 bit' has units"):
        rsfstudy.read_record(path)


@pytest.mark.parametrize(("length", "told"), [(2000, "headers"), (2740, "column 2")])
def test_a_binary_file_that_is_cut(length: int, told: str, tmp_path: Path) -> None:
    path = xlook(tmp_path / "cut", [("Time", "s", TIME), ("mu", "", FRICTION)])
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(DataError, match=told):
        rsfstudy.read_record(path, {"time": (1, "s")})


@pytest.mark.parametrize("stiffness", [2e-3, "2e-3 1/um", "0.04 MPa/um"])
def test_slip_is_turned_into_displacement_of_the_load_point(
    tmp_path: Path, stiffness: float | str
) -> None:
    friction = 0.6 + 0.01 * np.sin(TIME)
    slip = MOVED - friction / 2e-3
    arrays = {"time": TIME, "slip": slip, "friction": friction}
    record = rsfstudy.read_record(arrays, normal_stress="20 MPa", stiffness=stiffness)
    np.testing.assert_allclose(record.columns["displacement"], MOVED, atol=1e-9)
    path = tmp_path / "slip.csv"
    rows = np.column_stack([TIME, slip, friction]).tolist()
    lines = ["Time (s),Fault slip (um),Friction", *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines))
    read = rsfstudy.read_record(path, normal_stress="20 MPa", stiffness=stiffness)
    np.testing.assert_allclose(read.columns["displacement"], MOVED, atol=1e-9)


def test_slip_without_stiffness_is_refused() -> None:
    arrays = {"time": TIME, "slip": MOVED, "friction": 0.6 + 0.0 * TIME}
    with pytest.raises(InvalidValue, match=r"'slip' requires a stiffness.*read_record"):
        rsfstudy.read_record(arrays)
    with pytest.raises(InvalidValue, match=r"stiffness = '0.04 MPa/um' requires a normal stress"):
        rsfstudy.read_record(arrays, stiffness="0.04 MPa/um")
    for wrong in (-1.0, 0.0, "0 1/um"):
        with pytest.raises(InvalidValue, match=r"'stiffness' must be positive"):
            rsfstudy.read_record(arrays, stiffness=wrong)
