"""Fuzzer of the functions and commands that read files.

Usage: ``python tests/benchmarks/fuzz_files.py --seed N --count N``. The script writes results,
Zarr stores, motions, journals, records, protocols, problems, tables of cases, answers and styles.
It then damages each file, and a function or a command reads the file in a forked process.

The script reports exceptions other than errors of rsfstudy, messages that only name a Python
exception, hangs and control characters. It also reports damaged files that are read without an
error although a number or the declaration differs. ``--case N`` runs one case and prints the
answer. ``--only REGEX`` runs the cases whose kind, change and reader match. The exit status is 1
if the script reported a problem.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import functools
import gzip
import io
import json
import random
import re
import shutil
import sqlite3
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from file_mutations import damage_bytes, hostile_dataset, hostile_text
from forked_calls import call_in_child
from scipy.io import savemat

import rsfstudy
from rsfstudy.errors import RsfStudyError
from rsfstudy.reductions import LinearFit
from rsfstudy.referee import benchmark_problem_files, external_answers
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.storage import dataset_files

STUDY = rsfstudy.Study(
    name="small",
    title="A small lattice",
    base=rsfstudy.Scene(),
    axes=[
        rsfstudy.Axis("case", {"constant": {"normal_stress": "constant"}, "other": {"alpha": 0.3}}),
        rsfstudy.Axis("load_velocity_ratio", [1.0, 2.0, 4.0]),
    ],
    measure=LinearStability(),
    reductions=[LinearFit("slope", "critical_stiffness", "log_load_velocity_ratio")],
    claims=[
        rsfstudy.Claim(
            id=f"C{number}", statement="a statement " * 20, source="a source",
            variable="critical_stiffness", where={"case": "constant", "load_velocity_ratio": 1.0},
            published=0.0145, tolerance=1e-3, reason="a reason " * 10,
        )
        for number in range(12)
    ],
)  # fmt: skip
RIG = rsfstudy.Rig(
    normal_stress="5 MPa", slip_distance="10 um", reference_velocity="1 um/s", stiffness="1 kPa/um"
)


class Kind(NamedTuple):
    """Kind of file, with its name, readers and changes."""

    name: str
    readers: tuple[Callable[[Path], Any], ...]
    changes: tuple[Callable[[Path, random.Random], bool], ...]


# ---- readers -------------------------------------------------------------------------------------
def command_reader(*words: str) -> Callable[[Path], Any]:
    """Return a reader that runs a command.

    In ``words``, ``{0}`` is replaced by the path of the file, and ``{1}`` by its directory.
    """

    def read(path: Path) -> str:
        from rsfstudy.cli import command_line

        sys.argv = ["rsfstudy", *(word.format(path, path.parent) for word in words)]
        try:
            command_line.main()
        except SystemExit as ended:
            return f"exit status {ended.code}"
        return "exit status 0"

    read.__name__ = words[0]
    return read


def open_results(path: Path) -> xr.Dataset:
    """Read a results file or a store with ``rsfstudy.open``."""
    return rsfstudy.open(path).load()


def open_dataset(path: Path) -> xr.Dataset:
    """Read the file of any dataset."""
    return dataset_files.read_dataset(path).load()


def show_html(path: Path) -> str:
    """Return the HTML representation of a dataset."""
    return str(dataset_files.read_dataset(path).rsf._repr_html_())


def draw_plot(path: Path) -> Any:
    """Plot a dataset."""
    return dataset_files.read_dataset(path).rsf.plot()


def resume_run(path: Path) -> xr.Dataset:
    """Resume the run of a journal."""
    return rsfstudy.run(STUDY, output=path.parent, workers=0, progress=False)


def answer_record(path: Path) -> Any:
    """Read an answer to a problem of the referee."""
    return external_answers.read_external_answer(
        path,
        benchmark_problem_files.read_problem(
            benchmark_problem_files.find_shipped_problem_files()[1]
        ),
    )


def read_cases(path: Path) -> Any:
    """Read a table of cases."""
    return rsfstudy.Axis.cases(rsfstudy.read_table(path))


def apply_style(path: Path) -> Any:
    """Plot results with a style sheet."""
    return rsfstudy.plot(path.parent / "whole.nc", style=path)


def _reading(function: Callable[..., Any], **options: Any) -> Callable[[Path], Any]:
    return functools.wraps(function)(lambda path: function(path, **options))


# ---- changes -------------------------------------------------------------------------------------
def damage(path: Path, chance: random.Random) -> bool:
    """Damage a file, or one file of a Zarr store, and return True.

    Half of the NetCDF files lose the digest at their end before the damage.
    """
    if path.is_dir():
        path = chance.choice(sorted(file for file in path.rglob("*") if file.is_file()))
    content = path.read_bytes()
    if path.suffix == ".nc" and chance.random() < 0.5:
        content = content[: content.rindex(b"\nrsfstudy sha256 ")]
    path.write_bytes(damage_bytes(content, chance))
    return True


def rewrite(path: Path, chance: random.Random) -> bool:
    """Replace a results file by a hostile dataset, and return False."""
    # xarray may reject the dataset.
    with warnings.catch_warnings(), contextlib.suppress(Exception):
        warnings.simplefilter("ignore")
        dataset = hostile_dataset(xr.load_dataset(path), chance)
        if chance.random() < 0.7:
            dataset_files.write_dataset(dataset, path)
        else:
            dataset.to_netcdf(path)
    return False


def retype(path: Path, chance: random.Random) -> bool:
    """Rewrite a text file with hostile contents, and return False."""
    content = path.read_bytes()
    for _ in range(chance.choice((1, 1, 2, 3))):
        content = hostile_text(content, chance)
    path.write_bytes(content)
    return False


def tamper(path: Path, chance: random.Random) -> bool:
    """Change the contents of a journal with SQL, and return True."""
    value = chance.choice((None, 5, -1.5, "x", b"\0\xff", "[" * 100_000, "\x1b[31m", "9" * 400))
    column = chance.choice(("status", "message", "work", "seconds", "numbers", "checksum", "json"))
    table = "fingerprint" if column == "json" else "cells"
    extra = ("DELETE FROM fingerprint", "DROP TABLE cells", "CREATE VIEW v AS SELECT 1",
             "INSERT INTO fingerprint VALUES ('{}')", "ALTER TABLE cells ADD COLUMN x")  # fmt: skip
    sql = (f"UPDATE {table} SET {column} = ?", (value,))
    refused = contextlib.suppress(sqlite3.Error)
    with refused, contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute(*(sql if chance.random() < 0.7 else (chance.choice(extra),)))
    return True


def rename(path: Path, chance: random.Random) -> bool:
    """Replace the file by the name of an invalid study file.

    The return value is False.
    """
    names = ("a" * 300, "\x1b[31m", "nul\0", "", " ", "..", "a/b", "*", "\udcff", "é" * 200, "-x")
    path.write_text(chance.choice(names) + chance.choice((".py", "", ".PY", ".py.py")), "utf-8",
                    "surrogateescape")  # fmt: skip
    return False


def read_study_file(path: Path) -> Any:
    """Run a study file whose name is in the file."""
    name = path.read_text("utf-8", "surrogateescape")
    return rsfstudy.run(name, workers=0, progress=False, output=None)


_TEXT_CHANGES = (retype, retype, damage)
_COMMAND_READERS = tuple(
    command_reader(*words)
    for words in (("show", "{0}"), ("check", "{0}"), ("plot", "{0}", "--output", "{1}/drawn"),
                  ("export", "{0}", "--csv", "--output", "{1}/out.csv"), ("report", "{1}"),
                  ("compare", "{0}", "{1}/whole.nc"))
)  # fmt: skip
_READ_MATLAB = _reading(
    rsfstudy.read_record, columns={"time": "t (s)", "displacement": "x (um)", "friction": "mu"}
)
KINDS = {
    "small.nc": Kind(
        "results",
        (open_results, open_results, show_html, draw_plot, *_COMMAND_READERS),
        (damage, rewrite),
    ),
    "small.zarr": Kind(
        "store", (open_results, open_results, show_html, *_COMMAND_READERS[:2]), (damage,)
    ),
    "motion.nc": Kind(
        "motion", (open_dataset, show_html, draw_plot, *_COMMAND_READERS), (damage, rewrite)
    ),
    "small.cells.sqlite": Kind("journal", (resume_run,), (damage, tamper)),
    "record.csv": Kind(
        "record",
        (
            _reading(rsfstudy.read_record, normal_stress="5 MPa"),
            rsfstudy.events,
            rsfstudy.history,
            rsfstudy.read_table,
            command_reader(
                "fit", "{0}", "--stiffness", "1e-3 /um", "--law", "slip", "--output", "{1}/fit.png"
            ),
        ),
        _TEXT_CHANGES,
    ),
    "record.dat": Kind(
        "xlook",
        (
            rsfstudy.read_record,
            _reading(
                rsfstudy.read_record,
                columns={"time": ("1", "s"), "displacement": ("2", "um"), "friction": "3"},
            ),
        ),
        (damage, retype),
    ),
    "record.mat": Kind("matlab", (_READ_MATLAB, rsfstudy.events, rsfstudy.history), (damage,)),
    "record.csv.gz": Kind(
        "gzip", (_reading(rsfstudy.read_record, normal_stress="5 MPa"), rsfstudy.events), (damage,)
    ),
    "protocol.csv": Kind(
        "protocol",
        (
            rsfstudy.read_protocol,
            _reading(rsfstudy.read_protocol, rig=RIG),
            _reading(rsfstudy.history, rig=RIG),
            rsfstudy.read_table,
            command_reader("simulate", "--set", "loading={0}", "--output", "{1}/it.png"),
        ),
        _TEXT_CHANGES,
    ),
    "problem.toml": Kind(
        "problem",
        (
            benchmark_problem_files.read_problem,
            command_reader("verify", "{1}/01_answer.csv", "--problem", "{0}"),
        ),
        _TEXT_CHANGES,
    ),
    "01_answer.csv": Kind(
        "answer", (answer_record, command_reader("verify", "{0}")), _TEXT_CHANGES
    ),
    "cases.csv": Kind("cases", (read_cases,), _TEXT_CHANGES),
    "mine.mplstyle": Kind("style", (apply_style,), _TEXT_CHANGES),
    "study.txt": Kind("name", (read_study_file,), (rename,)),
}


def write_valid_files(place: Path) -> dict[str, Any]:
    """Write a valid file of each kind, and return the datasets by kind."""
    results = rsfstudy.run(STUDY, output=place, workers=0, progress=False)
    rsfstudy.run(STUDY, output=place / "zarr", workers=0, progress=False, format="zarr")
    (place / "zarr" / "small.zarr").rename(place / "small.zarr")
    shutil.copy(place / "small.nc", place / "whole.nc")
    motion = rsfstudy.simulate(rsfstudy.Scene(load_velocity_ratio=2.0), duration=0.5, rtol=1e-4)
    dataset_files.write_dataset(motion, place / "motion.nc")
    time = np.arange(600) * 0.2
    moved = np.where(time < 60.0, time, 10.0 * time - 540.0)
    stress = 0.6 + 1e-4 * np.random.default_rng(1).standard_normal(600)
    rows = [f"{t:.1f},{x:.3f},{s:.6f}" for t, x, s in zip(time, moved, stress, strict=True)]
    header = "time (s),displacement (um),shear_stress (MPa)"
    (place / "record.csv").write_text("\n".join([header, *rows]))
    (place / "record.csv.gz").write_bytes(gzip.compress((place / "record.csv").read_bytes()))
    savemat(place / "record.mat", {"t": time, "exp": {"x": moved, "mu": stress}}, appendmat=False)
    (place / "record.dat").write_bytes(_xlook(np.full(600, 0.2), moved, stress))
    (place / "protocol.csv").write_text("velocity (um/s),duration (s)\n1,10\n10,20\n0,5\n")
    shutil.copy(benchmark_problem_files.find_shipped_problem_files()[1], place / "problem.toml")
    shutil.copy(
        benchmark_problem_files.find_shipped_problem_files()[1].with_suffix(".csv"),
        place / "01_answer.csv",
    )
    (place / "cases.csv").write_text("a (1),b_over_a (1)\n0.01,1.5\n0.012,1.6\n0.01,2\n")
    (place / "mine.mplstyle").write_text("font.size: 9\naxes.grid: True\nlines.linewidth: 1.5\n")
    (place / "study.txt").write_text("study.py")
    return {"results": results, "store": results, "motion": motion, "journal": results}


def _xlook(*columns: np.ndarray) -> bytes:
    head = bytearray(36 + 84 * 32)
    head[24:28] = len(columns).to_bytes(4, "big")
    for number, values in enumerate(columns):
        at = 36 + 84 * number
        head[at : at + 5] = b"name%d" % number
        head[at + 80 : at + 84] = len(values).to_bytes(4, "big")
    return bytes(head) + b"".join(values.astype(">f4").tobytes() for values in columns)


# ---- one case ------------------------------------------------------------------------------------
class Answer(NamedTuple):
    """Answer of a reader: kind, text, printed output and first difference."""

    kind: str
    text: str
    printed: str
    differs: str


def read(reader: Callable[[Path], Any], path: Path, truth: xr.Dataset | None) -> Answer:
    """Call a reader, and compare a returned dataset with the truth."""
    out, differs = io.StringIO(), ""
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(out),
        warnings.catch_warnings(record=True) as caught,
    ):
        warnings.simplefilter("always")
        try:
            found = reader(path)
            how, text = "value", found if isinstance(found, str) else ""
            if truth is not None and isinstance(found, xr.Dataset):
                differs = difference(found, truth)
        except RsfStudyError as error:
            how, text = "refused", str(error)
        except Exception as error:
            how, text = f"raised {type(error).__name__}", f"{type(error).__name__}: {error}"
    said = " ".join(str(one.message) for one in caught if one.category is UserWarning)
    return Answer(how, text, f"{out.getvalue()} {said}", differs)


def difference(found: xr.Dataset, truth: xr.Dataset) -> str:
    """Return the name of the first difference from the truth.

    The differences are attributes or variables.
    """
    for name in ("declaration", "scene"):
        if found.attrs.get(name) != truth.attrs.get(name):
            return f"attribute {name}"
    for name, values in truth.variables.items():
        # These values differ if cells are computed again.
        if name in ("wall_time", "rhs_evaluations"):
            continue
        if name not in found.variables or not values.equals(found[name].variable):
            return str(name)
    return ""


class Case(NamedTuple):
    """File, with the change to apply and the reader to call."""

    chance: random.Random
    file: str
    change: Callable[[Path, random.Random], bool]
    reader: Callable[[Path], Any]

    @classmethod
    def draw(cls, seed: int, index: int) -> Case:
        """Draw the case of a seed and an index."""
        chance = random.Random(f"{seed}:{index}")
        file = chance.choice(list(KINDS))
        return cls(chance, file, chance.choice(KINDS[file].changes),
                   chance.choice(KINDS[file].readers))  # fmt: skip

    def __str__(self) -> str:
        return f"{KINDS[self.file].name} {self.change.__name__} {self.reader.__name__}"


def run_case(case: Case, whole: Path, truths: dict[str, Any]) -> Answer:
    """Change a copy of a file, and read it in a forked process."""
    chance, file, change, reader = case
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place)
        for each in (file, "whole.nc", "01_answer.csv", *(["small.nc"] if "cells" in file else [])):
            copied = shutil.copytree if (whole / each).is_dir() else shutil.copy
            copied(whole / each, copy / each)
        checked = change(copy / file, chance)
        truth = truths.get(KINDS[file].name) if checked else None
        answer, how = call_in_child(functools.partial(read, reader, copy / file, truth), copy)
        return Answer(how, "", "", "") if answer is None else answer


# ---- faults --------------------------------------------------------------------------------------
_CATCH_ALL_MESSAGES = re.compile(
    "cannot be answered|cannot be had of this dataset|as rsfstudy made it|"
    "A file may be damaged or not writable"
)
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_RICH_ESCAPES = re.compile(r"\x1b\[(?:[0-9;]*m|\?25[lh]|2K|1A)")


def faults(answer: Answer) -> Iterator[str]:
    """Yield the problems in an answer."""
    everything = f"{answer.text} {answer.printed}"
    if answer.kind.startswith(("raised", "hangs", "dies")):
        yield answer.kind
    if "Traceback (most" in everything:
        yield "traceback"
    if _CATCH_ALL_MESSAGES.search(everything):
        yield "catch-all answer"
    if _CONTROLS.search(_RICH_ESCAPES.sub("", everything)):
        yield "control character"
    if answer.differs:
        yield f"damage that passes: {answer.differs}"


def main() -> int:
    """Run the selected cases, and return the exit status."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--count", type=int, default=2000)
    options.add_argument("--case", type=int)
    options.add_argument("--only", default="")
    asked = options.parse_args()
    found: collections.Counter[str] = collections.Counter()
    ended: collections.Counter[str] = collections.Counter()
    with tempfile.TemporaryDirectory() as place, tempfile.TemporaryDirectory() as warm:
        truths = write_valid_files(Path(place))
        shutil.copytree(place, warm, dirs_exist_ok=True)
        for file, kind in KINDS.items():  # Import and compile the code that all cases need.
            for reader in kind.readers:
                read(reader, Path(warm, file), None)
        for index in range(asked.count) if asked.case is None else [asked.case]:
            case = Case.draw(asked.seed, index)
            if not re.search(asked.only, str(case)):
                continue
            answer = run_case(case, Path(place), truths)
            ended[answer.kind] += 1
            wrong = list(faults(answer))
            found.update(wrong)
            if wrong or asked.case is not None:
                text = f"{answer.text} | {answer.printed}"
                print(
                    f"{index} {case}: {', '.join(wrong)}\n    {json.dumps(text[:600])}", flush=True
                )
    print(f"seed {asked.seed}: {dict(ended)}; faults: {dict(found) or 'none'}")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
