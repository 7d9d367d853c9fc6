"""Tests of public functions and commands with invalid arguments.

Each call returns a result or raises an error of rsfstudy with a message of one line. The
tests pass junk to each parameter of each function and to each option of each command, and
use altered datasets. Parameters and options are taken from signatures with a seed, so new
parameters are included.
"""

import contextlib
import inspect
import io
import itertools
import json
import os
import random
import shutil
import sqlite3
import warnings
from pathlib import Path

import click
import numpy as np
import pytest
import xarray as xr
from study_runs import SMALL_STUDY, call_main, run, study_of

import rsfstudy
from rsfstudy import Axis, Rig, Scene, Study, read_record
from rsfstudy.cli import command_line
from rsfstudy.errors import DataError, InvalidValue, RsfStudyError
from rsfstudy.fitting.record import Record
from rsfstudy.referee.benchmark_problem_files import find_shipped_problem_files
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider.part_registry import SCENE_FIELD_NAMES
from rsfstudy.storage import cell_journal
from rsfstudy.study.claims import Claim

JUNK = [
    None, True, -1, 0, 3, 1.5, float("nan"), float("inf"), 10**400, 1j, "", "other", "\0", "\udcff",
    "\x1b[31m", "a" * 300, "../..", b"bytes", [], {}, [[]], {"a": None}, {1: 2}, set(), ("a", 2),
    object(), int, np.ones(2), np.array("x", dtype=object), np.datetime64("2020"), xr.Dataset(),
    lambda: 1, ValueError("x"), Path("."), Path("a" * 5000), io.StringIO("a"),
]  # fmt: skip
LATTICE = study_of(
    "lattice",
    LinearStability(),
    Axis("law", ["slip", "slowness"]),
    Axis("b_over_a", [1.5, 2.0, 3.0]),
)


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("public")
    run(LATTICE, output=place)
    (place / "circle").symlink_to("circle")
    (place / "protocol.csv").write_text("velocity (V_*), duration (D_c/V_*)\n2, 1\n")
    rows = zip(*record().columns.values(), strict=True)
    lines = ["time (s), displacement (um), friction", *(f"{t}, {x}, {mu}" for t, x, mu in rows)]
    (place / "record.csv").write_text("\n".join(lines))
    os.mkfifo(place / "pipe")
    scene = Scene(load_velocity_ratio=2.0, normal_stress="constant")
    motion = rsfstudy.simulate(scene, duration=0.1, rtol=1e-2, engine="compiled")
    motion.to_netcdf(place / "motion.nc")
    holding = Scene(stiffness_ratio=10.0, hold_time=10.0, normal_stress="constant")
    held = rsfstudy.simulate(holding, duration=30.0, rtol=1e-2, engine="compiled")
    held.to_netcdf(place / "held.nc")
    rsfstudy.healing(held).to_netcdf(place / "holds.nc")
    return place


def answered(ask) -> None:
    """Assert that a call succeeds or raises an error with a short message.

    The message must be printable text on one line.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            ask()
        except RsfStudyError as error:
            text = str(error)
        else:
            return
    assert text.isprintable()
    assert 0 < len(text) < 6000


PAGES = Path(__file__).parent.parent / "studies" / "pages"
FIT = (("laws", ["slip"]), ("free", ["a", "mu_star"]), ("noise", "white"), ("slip_distance", 10.0))


def record() -> Record:
    """Return a record of a velocity step with 40 rows."""
    time = np.arange(40.0)
    moved = np.where(time < 20.0, time, 20.0 + 10.0 * (time - 20.0))
    friction = 0.6 + np.where(time < 20.0, 0.0, 0.01 * np.exp(-(time - 20.0)))
    return read_record({"time": time, "displacement": moved, "friction": friction})


# ---- calls --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def calls(place: Path) -> dict[str, dict]:
    """Return the arguments of a cheap call of each function."""
    quick = {"duration": 0.1, "rtol": 1e-2, "engine": "compiled"}
    scene = Scene(stiffness_ratio=1.5, load_velocity_ratio=2.0, normal_stress="constant")
    cycling = Scene(stiffness_ratio=0.8, normal_stress="constant")
    dataset, no_workers = rsfstudy.open(place / "lattice.nc"), {"workers": 0, "progress": False}
    return {
        "recompute_cell": {"file": place / "lattice.nc", "place": {"law": "slip", "b_over_a": 2.0}},
        "check": {"dataset": dataset},
        "compare": {"first": dataset, "second": dataset},
        "critical_step": {"scene": scene, "rtol": 1e-2, "engine": "compiled"},
        "events": {"time": np.arange(400.0), "shear_stress": np.zeros(400)},
        "explore": {"source": scene},
        "limit_cycle": {"scene": cycling, "rtol": 1e-2, "engine": "compiled"},
        "fit": {"record": record(), "stiffness": 3e-3, **dict(FIT)},
        "read_record": {"source": place / "record.csv"},
        "open": {"name": place / "lattice.nc"},
        "plot": {"dataset": dataset},
        "history": {"record": {"time": [0.0, 1.0], "displacement": [0.0, 1.0]}},
        "read_table": {"path": place / "protocol.csv"},
        "read_protocol": {"path": place / "protocol.csv"},
        "report": {"directory": place},
        "rerun": {"file": place / "lattice.nc", **no_workers},
        "run": {"study": LATTICE, "output": None, **no_workers},
        "simulate": {"scene": scene, **quick},
        "healing": {"record": xr.load_dataset(place / "held.nc")},
        "plot_healing": {"table": xr.load_dataset(place / "holds.nc")},
        "plot_motion": {"motion": xr.load_dataset(place / "motion.nc")},
        "plot_record": {"record": record()},
        "to_si": {"dataset": dataset, "normal_stress": 5e6, "slip_distance": 1e-5},
    }


def functions() -> list[tuple[str, str]]:
    """Return the public functions and their parameters."""
    named = {name: getattr(rsfstudy, name) for name in rsfstudy.__all__}
    return [
        (name, parameter)
        for name, function in named.items()
        if inspect.isfunction(function) and name not in ("protocol", "studies")
        for parameter, kind in inspect.signature(function).parameters.items()
        # A user-defined client or figure may be any object.
        if parameter not in ("client", "own", "workers", "progress")
        # The constructors are tested with fields of scenes.
        and not (name == "run" and parameter in SCENE_FIELD_NAMES)
        and kind.kind not in (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    ]


@pytest.mark.parametrize(("name", "parameter"), functions())
def test_junk_in_calls(name, parameter, calls, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for junk in random.Random(f"{name} {parameter}").sample(JUNK, 8):
        given = {**calls[name], parameter: junk}
        answered(lambda given=given: getattr(rsfstudy, name)(**given))


RIG = {"normal_stress": "5 MPa", "slip_distance": "10 um", "reference_velocity": "1 um/s"}
CLAIM = {"id": "C", "statement": "", "source": "", "variable": "v", "where": {}, "published": 1.0}
MADE = {
    Scene: {},
    Axis: {"dimension": "b_over_a", "values": [1.0]},
    Study: {name: getattr(LATTICE, name) for name in ("name", "title", "base", "axes", "measure")},
    Rig: RIG,
    Claim: {**CLAIM, "tolerance": 1.0, "reason": ""},
}


@pytest.mark.parametrize("kind", MADE)
def test_junk_in_what_is_made(kind):
    for parameter in inspect.signature(kind).parameters:
        for junk in JUNK:
            answered(lambda given={**MADE[kind], parameter: junk}: kind(**given))


def test_a_call_that_does_not_fit_is_a_type_error_of_python():
    with pytest.raises(TypeError, match="missing a required argument: 'dataset'"):
        rsfstudy.check()
    with pytest.raises(
        TypeError, match=r"simulate\(\) has no parameter 't_end'.* Parameters: scene, .*, duration"
    ):
        rsfstudy.simulate(Scene(), t_end=50.0)


# ---- datasets -----------------------------------------------------------------------------------


def declared_in(dataset: xr.Dataset) -> dict[str, object]:
    """Return the declaration of a dataset as a dictionary."""
    return json.loads(dataset.attrs.get("declaration", "{}"))


def undeclared(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """Return the dataset without one element of its declaration."""
    rest = {n: part for n, part in declared_in(dataset).items() if n != name}
    return dataset.assign_attrs(declaration=json.dumps(rest))


def alterations(dataset: xr.Dataset) -> dict[str, xr.Dataset]:
    """Return altered copies of a dataset, as a notebook may create them."""
    dims = list(map(str, dataset.dims))
    numbers = [str(n) for n, v in dataset.data_vars.items() if v.dtype.kind == "f"]
    made = {
        **{f"isel {d}": dataset.isel({d: 0}) for d in dims},
        **{f"dropped {d}": dataset.isel({d: 0}, drop=True) for d in dims},
        **{f"none along {d}": dataset.isel({d: slice(0)}) for d in dims},
        **{f"reversed {d}": dataset.isel({d: slice(None, None, -1)}) for d in dims},
        **{f"no index {d}": dataset.drop_indexes(d) for d in dims},
        **{f"mean {d}": dataset[numbers].mean(d, keep_attrs=True) for d in dims},
        **{f"without {n}": dataset.drop_vars(n) for n in map(str, dataset.variables)},
        **{f"without declared {n}": undeclared(dataset, n) for n in declared_in(dataset)},
        **{
            f"{n} is {junk!r:.20}": dataset.assign_attrs({n: junk})
            for n, junk in itertools.product(("declaration", "provenance", "id", "scene"), JUNK)
        },
        "where": dataset.where(dataset[dims[0]] == dataset[dims[0]][0]) if dims else dataset,
        "bare": dataset.drop_attrs() if hasattr(dataset, "drop_attrs") else dataset,
        "complex": dataset.assign({n: dataset[n] + 0j for n in numbers}),
        "texts": dataset.astype(str),
        "stacked": dataset.stack(cell=dims),
        "transposed": dataset.transpose(*dims[::-1]),
        "renamed": dataset.rename({d: f"{d}_" for d in dims}),
        "nothing": dataset.drop_vars(list(dataset.variables)),
        "nested": dataset.assign_attrs(declaration='{"a":' * 900 + "1" + "}" * 900),
        "endless": dataset.assign_attrs(declaration="[" * 10**6),
    }
    with contextlib.suppress(Exception):
        made["by a table"] = xr.Dataset.from_dataframe(dataset.to_dataframe()).assign_attrs(
            dataset.attrs
        )
    return made


@pytest.mark.parametrize("of", ["a study", "a motion"])
def test_altered_datasets(of, place):
    whole = xr.load_dataset(place / ("lattice.nc" if of == "a study" else "motion.nc"))
    drawn = {"where", "transposed", "by a table", "nothing", "without status", "complex"}
    made = alterations(whole)
    chosen = {*drawn & made.keys(), *random.Random(of).sample(sorted(made), 25)}
    for name in sorted(chosen):
        dataset = made[name]
        for ask in (
            lambda d=dataset: d.rsf.scene,
            lambda d=dataset: d.rsf.study,
            lambda d=dataset: d.rsf.check(),
            lambda d=dataset: d.rsf.failures(),
            lambda d=dataset: d.rsf.to_si(normal_stress=5e6, slip_distance=1e-5),
            lambda d=dataset: rsfstudy.compare(d, whole),
            lambda d=dataset: rsfstudy.compare(whole, d),
        ):
            answered(ask)
        if name in drawn:  # Figures are slow.
            answered(dataset.rsf.plot)


def test_an_error_of_pythons_is_told_with_its_cause(place):
    dataset = rsfstudy.open(place / "lattice.nc").drop_vars("status")
    with pytest.raises(DataError, match="failures: the dataset has no 'status'") as told:
        dataset.rsf.failures()
    assert isinstance(told.value.__cause__, KeyError)


@pytest.mark.parametrize(
    "crafted",
    [
        lambda d: d["claims"].extend(d["claims"][:1] * 100_000),
        lambda d: d["axes"][1].update(values=list(map(float, range(10**6)))),
        lambda d: d["measure"].update(phases=10**9),
        lambda d: d.update(title="x" * 10**7),
    ],
)
def test_a_declaration_without_end_is_refused_at_once(crafted, tmp_path):
    study = "limit_cycles"
    dataset = xr.Dataset(attrs={"declaration": json.dumps(rsfstudy.studies()[study].describe())})
    declared = json.loads(dataset.attrs["declaration"])
    crafted(declared)
    dataset.attrs |= {"declaration": json.dumps(declared), "provenance": "{}"}
    answered(lambda: dataset.rsf.study)


# ---- commands -----------------------------------------------------------------------------------


def commands(place: Path) -> dict[str, list[str]]:
    """Return the arguments of a cheap call of each command."""
    file = str(place / "lattice.nc")
    return {
        "list": [],
        "show": [file],
        "run": ["linear_stability", "--serial", "--quiet", "--set", "b_over_a=2"],
        "check": [file],
        "plot": [file],
        "compare": [file, file],
        "report": [str(place)],
        "rerun": [file, "--serial", "--quiet", "--cell", "law=slip", "--cell", "b_over_a=2"],
        "export": [file, "--csv", "--output", f"{file}.csv"],
        "simulate": ["--duration", "0.1", "--engine", "compiled", "--rtol", "0.01"],
        "fit": [
            str(place / "record.csv"),
            *("--stiffness", "3e-3 /um", "--law", "slip", "--free", "a,mu_star"),
            *("--noise", "white", "--slip-distance", "10 um"),
        ],
        "events": [str(place / "record.csv")],
        "healing": [str(PAGES / "holds.csv")],
        "problems": ["referee"],
        "verify": [str(find_shipped_problem_files()[19].with_suffix(".csv"))],
    }


WORDS = ["", "-", "a=b", "=", "nan", "-1", "1e400", "\x1b[31m", "ä\udcff", "a" * 300, "a/" * 3000]
OPTIONS = [
    (name, parameter)
    for name, command in command_line.cli.commands.items()
    for parameter in command.params
    if not getattr(parameter, "is_flag", False)
    and parameter.name not in ("scheduler", "workers")
    # The server runs until it is interrupted; tests/explorer contains its tests.
    and name != "explore"
]


@pytest.mark.parametrize(("name", "parameter"), OPTIONS)
def test_junk_in_commands(name, parameter, place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    draw = random.Random(f"{name} {parameter.name}")
    paths = [place / part for part in ("pipe", "circle", ".", "protocol.csv")]
    for word in [draw.choice(WORDS), str(draw.choice(paths))]:
        rest = commands(place)[name]
        words = [word] if isinstance(parameter, click.Argument) else [parameter.opts[0], word]
        if isinstance(parameter, click.Argument):
            rest = rest[1:]
        done = call_main(name, *words, *rest)
        assert done.returncode in (None, 0, 1, 2, 3), words
        assert done.stdout or done.stderr, words
        assert len(done.stderr) < 20_000, words
        for line in done.stderr.splitlines():
            assert line.isprintable(), words


@pytest.mark.parametrize(
    ("encoding", "columns", "words"),
    [("ascii", "20", ["show"]), ("latin-1", "80", ["compare", "lattice.nc"])],
)
def test_output_that_cannot_hold_a_character(encoding, columns, words, tmp_path, monkeypatch):
    run(LATTICE.with_(b_over_a=[2.0, 3.0]), output=tmp_path, command="rsfstudy run Größe ζ ✓")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", columns)
    ran = call_main(*words, "lattice.nc", encoding=encoding)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout


# ---- journals and stores ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        "CREATE TRIGGER t AFTER INSERT ON cells BEGIN DELETE FROM cells; END",
        "CREATE VIEW v AS SELECT * FROM cells",
        "DROP TABLE cells; CREATE VIEW cells AS SELECT 1 AS key, 2 AS status",
        "DROP TABLE fingerprint; CREATE TABLE fingerprint (json BLOB); "
        "INSERT INTO fingerprint VALUES (x'ff')",
        *(
            f"UPDATE cells SET {column} = {value}"
            for column in ("status", "message", "work", "seconds", "numbers", "checksum")
            for value in ("NULL", "'text'", "1.5", "x'ff'", "9223372036854775807")
        ),
    ],
)
def test_a_journal_of_other_things_is_refused(change, place, tmp_path):
    kept = Path(shutil.copy(place / "lattice.cells.sqlite", tmp_path))
    with contextlib.closing(sqlite3.connect(kept)) as db, db:
        db.executescript(change)
    answered(lambda: run(LATTICE, output=tmp_path))
    answered(lambda: cell_journal.CellWallTimes.read_from_journal(kept))


def test_a_store_with_a_link_is_refused(tmp_path):
    run(SMALL_STUDY, output=tmp_path, format="zarr")
    array = tmp_path / "small.zarr" / "critical_velocity_ratio"
    array.rename(tmp_path / "elsewhere")
    array.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(DataError, match="critical_velocity_ratio is a pipe, a device or a link"):
        rsfstudy.open(tmp_path / "small.zarr")


def test_an_error_is_one_line_whatever_it_shows():
    error = InvalidValue("name\n\x1b[31m", "value\r\0" * 10**6, "must be\nshort")
    assert str(error).isprintable()
    assert len(str(error)) < 6000
