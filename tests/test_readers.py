"""Tests of the readers of records: one test of each format and each option of reading.

Files of each kind contain the same columns, so all readers have to return the same numbers.
"""

from __future__ import annotations

import bz2
import gzip
import importlib
import lzma
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import record_events
import xarray as xr
from scipy.io import savemat

import rsfstudy
from rsfstudy.errors import CallError, DataError, InvalidValue
from rsfstudy.rig import readers
from rsfstudy.rig.readers import spreadsheets, text_layout
from rsfstudy.rig.readers.tables_from_files_or_objects import LazyTable, TableSource
from rsfstudy.rig.table_columns import Column

ROWS = 40
TIME = 0.25 * np.arange(ROWS)
MOVED = np.where(TIME < 5.0, TIME, 5.0 + 8.0 * (TIME - 5.0))
NORMAL = 20.0 + 0.5 * np.sin(TIME)
SHEAR = 12.0 + 0.1 * np.cos(TIME)
FRICTION = SHEAR / NORMAL
DATA = {"time": TIME, "displacement": MOVED, "shear_stress": SHEAR, "normal_stress": NORMAL}
HEADINGS = ["Time (s)", "LP disp (um)", "Shear stress (MPa)", "Normal stress (MPa)"]


def lines_of(between: str, *header: str, decimal: str = ".") -> str:
    """Return a text file with header lines and the four columns of `DATA`."""
    rows = zip(*DATA.values(), strict=True)
    body = [between.join(f"{v:.12g}".replace(".", decimal) for v in row) for row in rows]
    return "\n".join([*header, *body]) + "\n"


def check(source: Any, columns: Any = None, **options: Any) -> rsfstudy.fitting.Record:
    """Read a record, and compare all columns with `DATA`."""
    record = rsfstudy.read_record(source, columns, **options)
    expected = {"time": TIME, "displacement": MOVED, "friction": FRICTION,
                "normal_stress": 1e6 * NORMAL}  # fmt: skip
    assert {*record.columns} == {*expected}
    for name, values in expected.items():
        np.testing.assert_allclose(record.columns[name], values, rtol=2e-11, err_msg=name)
    return record


HEADER = ",".join(HEADINGS)
BY_NUMBER = {
    "time": "1 (s)", "displacement": "2 (um)", "shear_stress": "3 (MPa)",
    "normal_stress": ("4", "MPa"),
}  # fmt: skip
UNITS = ["s", "um", "MPa", "MPa"]
TEXTS: dict[str, tuple[str, dict[str, Any]]] = {
    "comma": (lines_of(",", HEADER), {}),
    "byte order mark": ("\ufeff" + lines_of(";", ";".join(HEADINGS)).replace("\n", "\r\n"), {}),
    "carriage returns": (lines_of(",", HEADER).replace("\n", "\r"), {}),
    "number sign": (lines_of(" ", "# " + " ".join(HEADINGS)), {}),
    "per cent": (lines_of(",", "% run 7, at 20 degC", "% " + HEADER), {}),
    "comments below": (lines_of("\t", "\t".join(HEADINGS)) + "# stopped by hand\n", {}),
    "separator": (lines_of(";", "sep=;", ";".join(HEADINGS)), {}),
    "preamble": (lines_of(",", *(f"Note {n}: by me" for n in range(30)), "Rate,10", HEADER), {}),
    "rule": (lines_of("  ", "  ".join(HEADINGS), "-" * 60), {}),
    "units below": (lines_of("  ", "Time  LP_Disp  Shr_stress  nor_stress", "sec um MPa MPa"), {}),
    "units in brackets below": (lines_of(",", "Time,LP_Disp,Shear,Normal", "(s),[um],(MPa),(MPa)"),
                                {}),
    "no header": (lines_of("\t"), {"columns": BY_NUMBER}),
    "numbers of columns": (lines_of(",", "a,b,c,d"), {"columns": BY_NUMBER}),
    "names without units": (
        lines_of(",", HEADER),
        {"columns": {"time": "Time", "displacement": "LP disp", "shear_stress": "Shear stress",
                     "normal_stress": "Normal stress"}},
    ),
    "decimal commas": (lines_of(";", ";".join(HEADINGS), decimal=","), {"decimal": ","}),
    "decimal commas and tabs": (lines_of("\t", "\t".join(HEADINGS), decimal=","), {"decimal": ","}),
    "decimal commas and a comment": (
        lines_of(" ", "# " + " ".join(HEADINGS), decimal=",") + "% end\n", {"decimal": ","}
    ),
    "blanks at both ends": (lines_of("   ", "   ".join(HEADINGS)).replace("\n", " \n  "), {}),
    "empty last field": (lines_of(",", HEADER).replace("\n", ",\n"), {}),
    "other capitals": (lines_of(",", HEADER.upper().replace("(S)", "(s)").replace("(UM)", "(um)")
                                .replace("MPA", "MPa")), {}),
    "blank lines": (lines_of(",", "", HEADER, "").replace("\n2,", "\n\n2,"), {}),
}  # fmt: skip


@pytest.mark.parametrize("kind", TEXTS)
def test_text_files(kind: str, tmp_path: Path) -> None:
    text, options = TEXTS[kind]
    (tmp_path / "run.txt").write_bytes(text.encode())
    check(tmp_path / "run.txt", options.pop("columns", None), **options)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "cp1252", "utf-8"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    header = HEADER.replace("um", "\u00b5m")
    (tmp_path / "run.csv").write_bytes(lines_of(",", header).encode(encoding))
    check(tmp_path / "run.csv")


@pytest.mark.parametrize("compress", [gzip.compress, bz2.compress, lzma.compress])
def test_compressed_files(compress: Callable[[bytes], bytes], tmp_path: Path) -> None:
    (tmp_path / "run.gz").write_bytes(compress(lines_of(",", HEADER).encode()))
    assert check(tmp_path / "run.gz").name == "run"
    (tmp_path / "cut.gz").write_bytes(compress(lines_of(",", HEADER).encode())[:-20])
    with pytest.raises(DataError, match="cut.gz: cannot be decompressed"):
        rsfstudy.read_record(tmp_path / "cut.gz")
    (tmp_path / "bomb.gz").write_bytes(compress(b" " * 2**24))
    with pytest.raises(DataError, match="bomb.gz: contains more than [0-9,]+ bytes after"):
        rsfstudy.read_record(tmp_path / "bomb.gz")
    (tmp_path / "twice.gz").write_bytes(compress(gzip.compress(b"time (s)")))
    with pytest.raises(DataError, match="twice.gz: is compressed twice"):
        rsfstudy.read_record(tmp_path / "twice.gz")


@pytest.mark.parametrize("text", [lines_of(";", HEADER.replace(",", ";"), decimal=","),
                                  lines_of("  ", "t  lp  tau  sigma", decimal=",")])  # fmt: skip
def test_decimal_commas_are_named(text: str, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(text)
    for read in (rsfstudy.read_record, rsfstudy.events, rsfstudy.history):
        with pytest.raises(
            InvalidValue, match=r"run.csv: number = '12,1' has a decimal comma. Pass decimal=','"
        ):
            read(tmp_path / "run.csv")
    with pytest.raises(InvalidValue, match="decimal = ';' is unknown"):
        rsfstudy.read_record(tmp_path / "run.csv", decimal=";")


@pytest.mark.parametrize("text", ["", "\n\n", "just words\n", "# a comment\n"])
def test_a_text_without_numbers_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "run.txt").write_text(text)
    with pytest.raises(InvalidValue, match="has no header|no recognised headings for time"):
        rsfstudy.read_record(tmp_path / "run.txt")


def test_a_file_without_header_asks_for_numbers(tmp_path: Path) -> None:
    (tmp_path / "run.txt").write_text(lines_of("\t"))
    with pytest.raises(InvalidValue, match=r"has no headings.* 'time=1 \(s\),displacement=2"):
        rsfstudy.read_record(tmp_path / "run.txt")
    with pytest.raises(InvalidValue, match="column '5' is not a heading of the table"):
        rsfstudy.read_record(tmp_path / "run.txt", {**BY_NUMBER, "time": "5 (s)"})


def test_units_that_contradict_the_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(lines_of(",", HEADER))
    with pytest.raises(
        InvalidValue, match="displacement = 'mm' contradicts the units in the file, um"
    ):
        rsfstudy.read_record(tmp_path / "run.csv", {"displacement": "LP disp (mm)"})
    columns = {"displacement": ("LP disp", "mm", 1e-3)}  # Raw data have other units.
    check(tmp_path / "run.csv", {**columns, "time": "Time"})


# ---- binary formats ------------------------------------------------------------------------------
@pytest.mark.parametrize("library", ["openpyxl", "python_calamine"])
def test_workbooks(library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        spreadsheets,
        "_PANDAS_ENGINE_BY_LIBRARY",
        {library: spreadsheets._PANDAS_ENGINE_BY_LIBRARY[library]},
    )
    path = tmp_path / "run.xlsx"
    frame = pd.DataFrame(dict(zip(HEADINGS, DATA.values(), strict=True)))
    with pd.ExcelWriter(path, engine="openpyxl") as book:
        frame.to_excel(book, sheet_name="notes", index=False, startrow=3, startcol=1)
        frame.iloc[:, :2].to_excel(book, sheet_name="other", index=False)
    check(path)
    with pytest.raises(
        InvalidValue, match="sheet 'other', line 1: header .* no recognised heading for fric"
    ):
        rsfstudy.read_record(path, sheet="other")
    with pytest.raises(
        InvalidValue, match="sheet 'x' is not a sheet of the workbook. Choices: notes"
    ):
        rsfstudy.read_record(path, sheet="x")
    frame = frame.astype(object)
    frame.loc[3, HEADINGS[1]] = "off"
    frame.to_excel(path, index=False)
    with pytest.raises(
        InvalidValue, match="line 5, column 2: displacement = 'off' is not a number"
    ):
        rsfstudy.read_record(path)


def test_matlab_files(tmp_path: Path) -> None:
    columns = {
        "time": "t (s)", "displacement": "x (um)", "shear_stress": "tau (MPa)",
        "normal_stress": "sn (MPa)",
    }  # fmt: skip
    data = dict(zip(("t", "x", "tau", "sn"), DATA.values(), strict=True))
    savemat(tmp_path / "run.mat", {**data, "rate": 10.0, "name": "run 7"})
    check(tmp_path / "run.mat", columns)
    savemat(tmp_path / "nested.mat", {"exp": {**data, "rate": 10.0}}, do_compression=True)
    check(tmp_path / "nested.mat", columns)
    savemat(tmp_path / "matrix.mat", {"data": np.column_stack([*DATA.values()])})
    check(tmp_path / "matrix.mat", BY_NUMBER)
    with pytest.raises(InvalidValue, match="no recognised headings for time"):
        rsfstudy.read_record(tmp_path / "matrix.mat")
    (tmp_path / "cut.mat").write_bytes((tmp_path / "run.mat").read_bytes()[:300])
    with pytest.raises(DataError, match="cut.mat: cannot be read as a MATLAB file"):
        rsfstudy.read_record(tmp_path / "cut.mat", columns)


def test_matlab_files_of_version_7_3(tmp_path: Path) -> None:
    h5py = importlib.import_module("h5py")
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in DATA.items():
            file[name] = values[np.newaxis, :]
    content = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b" ") + content[512:])
    units = {"time": "s", "displacement": "um", "shear_stress": "MPa", "normal_stress": "MPa"}
    check(path, {name: (name, units[name]) for name in DATA})


def test_tdms_files(tmp_path: Path) -> None:
    nptdms = importlib.import_module("nptdms")
    path = tmp_path / "run.tdms"
    names = [heading.partition(" (")[0] for heading in HEADINGS]
    waveform = {"wf_increment": 0.25}
    with nptdms.TdmsWriter(path) as file:
        for name, units, values in zip(names[1:], UNITS[1:], [*DATA.values()][1:], strict=True):
            about = {"unit_string": units, **waveform}
            file.write_segment([nptdms.ChannelObject("wave", name, values, properties=about)])
        for name, units, values in zip(names, UNITS, DATA.values(), strict=True):
            about = {"unit_string": units}
            file.write_segment([nptdms.ChannelObject("plain", name, values, properties=about)])
    check(path)
    check(path, sheet="plain")
    with pytest.raises(InvalidValue, match="sheet 'x' is not a group with channels. Choices: wave"):
        rsfstudy.read_record(path, sheet="x")


@pytest.mark.parametrize(
    ("signature", "modules", "told"),
    [
        (b"PK\x03\x04", ("openpyxl", "python_calamine"), "Excel.*pip install 'rsfstudy.excel.'"),
        (b"TDSm", ("nptdms",), "a TDMS file, .*pip install 'rsfstudy.tdms.'"),
        (
            b"MATLAB 7.3 MAT-file",
            ("h5py",),
            "a MATLAB file of v7.3, .*pip install 'rsfstudy.hdf5.'",
        ),
    ],
)
def test_a_missing_library_is_named(
    signature: bytes, modules: tuple[str, ...], told: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec",
                        lambda name: None if name in modules else find(name))  # fmt: skip
    for module in modules:
        monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / "run.xlsx").write_bytes(signature.ljust(5000, b"\0"))
    for read in (rsfstudy.read_record, rsfstudy.events, rsfstudy.history):
        with pytest.raises(DataError, match=told):
            read(tmp_path / "run.xlsx")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"\x93NUMPY\x01\0", "a file of NumPy. Read the file in Python, .*numpy.load"),
        (b"PK\x03\x04" + bytes(100), "a zip archive. Unpack"),
        (b"%PDF-1.4\n", "a PDF document. Export"),
        (b"PAR1\x15\0", "a Parquet file. .*read_parquet"),
        (bytes(3000), "unknown binary format. Formats that can be read: text, Excel, MATLAB"),
        (b"\x01\x02\x03\x04" * 100, "unknown format. Export"),
    ],
)
def test_other_formats_are_named_with_their_remedy(
    content: bytes, told: str, tmp_path: Path
) -> None:
    (tmp_path / "run.bin").write_bytes(content)
    for read in (rsfstudy.read_record, rsfstudy.events, rsfstudy.history):
        with pytest.raises(DataError, match=told):
            read(tmp_path / "run.bin")


def test_datasets_and_frames(tmp_path: Path) -> None:
    dataset = xr.Dataset(
        {
            name: ("row", values, {"units": units})
            for (name, values), units in zip(DATA.items(), UNITS, strict=True)
        }
    )
    check(dataset)
    check(dataset.rename(displacement="LP_disp", shear_stress="tau"))
    dataset.to_netcdf(tmp_path / "run.nc")
    check(tmp_path / "run.nc")
    check(pd.DataFrame(dict(zip(HEADINGS, DATA.values(), strict=True))))
    record = check(DATA)
    again = check(record)
    assert again == record
    (tmp_path / "cut.nc").write_bytes((tmp_path / "run.nc").read_bytes()[:2000])
    with pytest.raises(DataError, match="cut.nc: cannot be read as NetCDF"):
        rsfstudy.read_record(tmp_path / "cut.nc")


def test_a_new_format_is_one_pair_of_functions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_raw(source: TableSource) -> LazyTable:
        values = np.frombuffer(source.read_all_bytes()[4:]).reshape(4, -1)
        return LazyTable(
            HEADINGS, str(source.path_or_object), lambda n, _name: Column(values[n], "")
        )

    pair = (lambda source: source.first_bytes_of_file.startswith(b"raw\0"), read_raw)
    monkeypatch.setattr(
        readers, "FORMAT_TESTS_AND_READERS", [pair, *readers.FORMAT_TESTS_AND_READERS]
    )
    (tmp_path / "run.raw").write_bytes(b"raw\0" + np.array([*DATA.values()]).tobytes())
    check(tmp_path / "run.raw")


# ---- rows, filters and signs ---------------------------------------------------------------------
@pytest.mark.parametrize(
    ("options", "kept"),
    [
        ({"rows": (3, 12)}, slice(2, 12)),
        ({"rows": [3, 1000]}, slice(2, None)),
        ({"begin": 1.0, "end": "5 s"}, slice(4, 21)),
        ({"begin": "0.05 min"}, slice(12, None)),
        ({"begin": "2 um", "end": "0.005 mm"}, slice(8, 21)),
        ({"begin": "2 um", "rows": (1, 13), "thin": 2}, slice(8, 13, 2)),
    ],
)
def test_rows_are_selected(options: dict[str, Any], kept: slice, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(lines_of(",", HEADER))
    record = rsfstudy.read_record(tmp_path / "run.csv", **options)
    np.testing.assert_allclose(record.time, TIME[kept])
    np.testing.assert_allclose(record.columns["friction"], FRICTION[kept], rtol=1e-10)
    start, stop, _step = kept.indices(ROWS)
    assert record.processing[0] == f"rows {start + 1} to {stop} of {ROWS}"
    assert record.processing[0] in record.to_dataset().attrs["processing"]
    rig = rsfstudy.Rig(normal_stress="20 MPa", slip_distance="10 um", reference_velocity="1 um/s")
    loading = rsfstudy.history(tmp_path / "run.csv", rig, **options)
    assert len(loading.sample_table) == len(record)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"rows": (0, 5)}, "'rows' must be the numbers of the first and the last row"),
        ({"rows": (5, 3)}, "'rows' must be"),
        ({"rows": (500, 600)}, "must select at least one row of the record, which has 40 rows"),
        ({"begin": "2 MPa"}, "begin = '2 MPa' is neither a time nor a displacement"),
        ({"begin": "x"}, "begin = 'x' is neither a time nor a displacement"),
        ({"begin": "1 h"}, "begin = '1 h' is outside the record, which covers 0 to 9.75 s"),
        ({"thin": 0}, "'thin' must be a whole number, 1 or more"),
        ({"filter": "median 1 s"}, "filter = 'median 1 s' is unknown. .*mean, trailing_mean"),
        (
            {"filter": "mean 20 s"},
            "averaging time that is shorter than the duration of the record, which is 9.75 s",
        ),
        ({"filter": "first_order 3 Hz"}, "only contains frequencies below 2 Hz"),
        ({"filter": "first_order 3 s"}, "has units that are incompatible"),
    ],
)
def test_selections_that_cannot_be_made(options: dict[str, Any], told: str) -> None:
    with pytest.raises(InvalidValue, match=told):
        rsfstudy.read_record(DATA, **options)


def test_unknown_options_of_reading_are_refused() -> None:
    for read in (rsfstudy.events, rsfstudy.history):
        with pytest.raises(CallError, match=r"no parameter 'decimals'. Did you mean 'decimal'"):
            read(DATA, decimals=",")


@pytest.mark.parametrize("spread", [0.0, 0.3])
@pytest.mark.parametrize(
    ("kind", "gain"),
    [
        ("mean 2 s", np.sinc(2.0 * 0.1)),
        ("trailing_mean 2 s", np.sinc(2.0 * 0.1) * np.exp(-2j * np.pi * 0.1)),
        ("first_order 0.1 Hz", 1.0 / (1.0 + 1.0j)),
        ("butterworth_2 0.1 Hz", 1.0 / (np.sqrt(2.0) * 1.0j)),
    ],
)
def test_filters_have_their_response(kind: str, gain: complex, spread: float) -> None:
    """A filtered sine has the amplitude and the phase of the analytical response.

    The first 30 s contain the transient of the low-pass filters. Linear interpolation of the values
    and of their integral reduces the amplitude by (2 pi f dt)^2 / 12 each, which is 0.3 % here.
    """
    time = 0.3 * np.arange(400)
    time = time + 0.3 * spread * np.random.default_rng(1).uniform(-0.5, 0.5, len(time))
    wave = 0.1 * np.exp(2j * np.pi * 0.1 * time)
    data = {"time": time, "displacement": time, "friction": 0.6 + wave.imag}
    record = rsfstudy.read_record(data, filter=kind)
    late = record.time > 30.0
    expected = 0.6 + (gain * 0.1 * np.exp(2j * np.pi * 0.1 * record.time)).imag
    np.testing.assert_allclose(record.columns["friction"][late], expected[late], atol=1e-3)
    size = float(kind.split()[1])
    assert record.filter == f"{kind.split()[0]} {size!r}"
    assert record.processing == (f"friction filtered by {kind}",)
    lost = round(size / 0.3) if "mean" in kind else 0
    assert len(record) == pytest.approx(len(time) - lost, abs=2 if lost else 0)
    with pytest.raises(
        InvalidValue, match="cannot be applied, because the record is already filtered"
    ):
        rsfstudy.read_record(record, filter=kind)


def test_a_force_needs_the_area(tmp_path: Path) -> None:
    """A force in kN divided by 5 cm2 is the shear stress in units of 2 MPa."""
    header = HEADER.replace("Shear stress (MPa)", "Force (kN)")
    (tmp_path / "run.csv").write_text(lines_of(",", header))
    for read in (rsfstudy.read_record, rsfstudy.events):
        with pytest.raises(
            InvalidValue, match=r"must be a stress, not a force .got 'kN'.*area='25 cm2'"
        ):
            read(tmp_path / "run.csv")
    record = rsfstudy.read_record(tmp_path / "run.csv", area="5 cm2")
    np.testing.assert_allclose(record.columns["friction"], 2.0 * FRICTION, rtol=1e-11)
    with pytest.raises(InvalidValue, match="'area' must be positive"):
        rsfstudy.read_record(tmp_path / "run.csv", area="0 cm2")


def test_a_negative_normal_stress_is_named() -> None:
    data = {**DATA, "normal_stress": -NORMAL}
    with pytest.raises(
        InvalidValue, match=r"negative in all rows .got .*Compression is positive .* -1"
    ):
        rsfstudy.read_record(data)
    columns = {name: name for name in DATA} | {"normal_stress": "normal_stress * -1"}
    check(data, columns)


def test_what_a_record_lacks_is_named(tmp_path: Path) -> None:
    for names in (["time", "shear_stress"], ["displacement", "shear_stress"]):
        with pytest.raises(InvalidValue, match="use rsfstudy.events"):
            rsfstudy.read_record({name: DATA[name] for name in names})
    with pytest.raises(
        InvalidValue, match="has no recognised heading for friction or shear stress"
    ):
        rsfstudy.read_record({name: DATA[name] for name in ("time", "displacement")})


# ---- events --------------------------------------------------------------------------------------
MADE = record_events.sudden_drops(np.random.default_rng(11))
EVENTS = rsfstudy.events(time=MADE.time, shear_stress=MADE.stress)


def same_drops(found: xr.Dataset, factor: float = 1.0) -> None:
    """Compare stress drops with those of the arrays."""
    expected = factor * EVENTS.static_stress_drop
    np.testing.assert_allclose(found.static_stress_drop, expected, rtol=1e-6, atol=1e-9)


def test_events_of_files_with_usual_headings(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    columns = {"Time (min)": MADE.time / 60.0, "Shear stress (kPa)": 1e3 * MADE.stress}
    pd.DataFrame(columns).to_csv(path, index=False)
    found = rsfstudy.events(path)
    same_drops(found, 1e3)
    np.testing.assert_allclose(60.0 * found.time, EVENTS.time, rtol=1e-6)
    assert (found.time.units, found.static_stress_drop.units) == ("min", "kPa")
    same_drops(rsfstudy.events(columns), 1e3)
    same_drops(rsfstudy.events(pd.DataFrame(columns)), 1e3)
    named = {"time": "Time (min)", "shear_stress": "Shear stress (kPa) * -1"}
    assert rsfstudy.events(path, named).attrs["sign_of_shear_stress"] == -1
    half = rsfstudy.events(path, rows=(1, len(MADE.time) // 2))
    assert 0 < half.sizes["event"] < EVENTS.sizes["event"]
    assert half.attrs["processing"] == f"rows 1 to {len(MADE.time) // 2} of {len(MADE.time)}"
    with pytest.raises(
        InvalidValue, match="has no recognised heading for shear stress or friction"
    ):
        rsfstudy.events({"Time (s)": MADE.time})
    with pytest.raises(InvalidValue, match="no recognised heading for time or displacement"):
        rsfstudy.events({"Friction (1)": MADE.stress})


def test_events_of_friction_only() -> None:
    data = {"Time (s)": MADE.time, "Friction": MADE.stress / 8.0}
    found = rsfstudy.events(data)
    same_drops(found, 0.125)
    assert found.static_stress_drop.units == "1"
    same_drops(rsfstudy.events(data, normal_stress="8 MPa"))
    data["Normal stress (kPa)"] = np.full(len(MADE.time), 8e3)
    found = rsfstudy.events(data)
    same_drops(found)
    assert found.static_stress_drop.units == "MPa"


def test_events_of_stress_against_displacement() -> None:
    """A record without time has the displacements of its events."""
    data = {"Displacement (mm)": 1e-3 * MADE.time, "Shear stress (MPa)": MADE.stress}
    found = rsfstudy.events(data)
    same_drops(found)
    assert not {"time", "slip", "peak_slip_rate"} & {*found.variables}
    for name in ("displacement", "interval", "duration", "displacement_error"):
        expected = EVENTS[name.replace("displacement", "time")]
        np.testing.assert_allclose(1e3 * found[name], expected, rtol=1e-6, atol=1e-9)
        assert found[name].units == "mm"
        assert "time" not in found[name].long_name
    with pytest.raises(InvalidValue, match="'displacement' must increase.*without time requires"):
        rsfstudy.events({**data, "Displacement (mm)": -MADE.time})


def test_slip_of_the_fault_is_known_by_its_heading() -> None:
    """Slip needs no stiffness, even if it is not faster during the drops."""
    data = {"Time (s)": MADE.time, "Slip (um)": MADE.time, "Shear stress (MPa)": MADE.stress}
    found = rsfstudy.events(data)
    assert found.slip.notnull().all()
    assert found.slip.units == "um"


def test_a_filter_is_applied_to_stress(tmp_path: Path) -> None:
    minutes = {"Time (min)": MADE.time / 60.0, "Shear stress (MPa)": MADE.stress}
    interval = float(MADE.time[1] - MADE.time[0])
    found = rsfstudy.events(minutes, filter=f"mean {3.0 * interval} s")
    assert found.sizes == EVENTS.sizes
    assert float(found.noise) < 0.8 * float(EVENTS.noise)
    np.testing.assert_allclose(60.0 * found.time, EVENTS.time, atol=5.0 * interval)
    assert "shear_stress filtered by mean" in found.attrs["processing"]


# ---- hostile headers -----------------------------------------------------------------------------
def test_brackets_of_a_header_are_counted_once_per_word() -> None:
    words = ["("] * 20_000
    counted = 0

    class Word(str):
        def count(self, *args: Any) -> int:
            nonlocal counted
            counted += 1
            return str.count(self, *args)

    assert text_layout._append_bracketed_units_to_words([Word(word) for word in words]) == [
        " ".join(words)
    ]
    assert counted == 2 * len(words)
