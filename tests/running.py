"""Shared by the tests of running: a small lattice, and the command as a process of its own."""

from __future__ import annotations

import contextlib
import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import xarray as xr
from click.testing import CliRunner

import rsfstudy
from rsfstudy import Axis, Scene, Study, cli
from rsfstudy.errors import DataError
from rsfstudy.measures.critical_step import CriticalStep

SMALL = Study(
    name="small",
    title="A small lattice",
    base=Scene(),
    axes=[
        Axis("case", {"constant": {"normal_stress": "constant"}, "variable": {"alpha": 0.56}}),
        Axis("b_over_a", [2.0, 2.5, 3.0]),
    ],
    measure=CriticalStep(),
)
FAULTY = Path(__file__).with_name("faulty.py")


def run(study=SMALL, **options) -> xr.Dataset:
    """In this process and in memory, unless told otherwise."""
    return rsfstudy.run(study, **{"workers": 0, "output": None, "progress": False, **options})


def named_results(study: str | Study, tmp_path_factory) -> tuple[xr.Dataset, Path]:
    """Results of a named study, and their file, computed once for all processes of the tests."""
    place = tmp_path_factory.getbasetemp()
    output = (place.parent if "PYTEST_XDIST_WORKER" in os.environ else place) / "named"
    for _ in range(600):
        try:
            dataset = rsfstudy.run(study, output=output, progress=False)
        except DataError as error:
            if "another run uses" not in str(error):
                raise
            time.sleep(0.5)
            continue
        return dataset, output / f"{dataset.attrs['id']}.nc"
    raise AssertionError("another process never finished it")


def same_numbers(ours: xr.Dataset, theirs: xr.Dataset) -> None:
    """The same bits, but for the time they took."""
    xr.testing.assert_identical(
        ours.drop_vars("wall_time").drop_attrs(), theirs.drop_vars("wall_time").drop_attrs()
    )


#: Ctrl-C ends it even where the tests run in the background, where shells have it ignored.
_COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from rsfstudy.cli import main
main()
"""


def command(*words, **environment) -> subprocess.Popen:
    """The command in a process, and a session, of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", _COMMAND, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "COLUMNS": "500", **environment},
    )


def ended(process: subprocess.Popen, seconds: float = 120) -> tuple[int, str, str]:
    """Exit status, output and errors, once it has ended."""
    out, said = process.communicate(timeout=seconds)
    assert "Traceback" not in said, said
    return process.returncode, out, said


def called(words: Sequence[str]) -> tuple[int, str]:
    """Exit status and what is said by the command in this process, from its real entry point; what
    would be a traceback is raised.
    """
    with pytest.MonkeyPatch.context() as patch, CliRunner().isolation() as (out, err, _both):
        patch.setattr(sys, "argv", ["rsfstudy", *words])
        code = 0
        try:
            cli.main()
        except SystemExit as ended_with:
            code = int(ended_with.code or 0)
        said = out.getvalue().decode(errors="replace") + err.getvalue().decode(errors="replace")
    return code, " ".join(said.split())


def cells_in(journal: Path) -> int:
    """Number of cells another process has kept so far, which lets nobody else read while it runs:
    then what is on disk is looked at without asking. Where nobody runs, what a killed one left
    unfinished is rolled back, as by the next run.
    """
    for way in ("mode=rw", "immutable=1"):
        try:
            with contextlib.closing(
                sqlite3.connect(f"file:{journal}?{way}", uri=True, timeout=0)
            ) as db:
                return int(db.execute("SELECT count(*) FROM cells").fetchone()[0])
        except sqlite3.Error as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
                return 0
    return 0


def until(true: Callable[[], bool], process: subprocess.Popen | None = None) -> None:
    """Wait until something is so, or a process has ended."""
    for _ in range(1200):
        if true() or (process is not None and process.poll() is not None):
            return
        time.sleep(0.05)
    raise AssertionError("it never came to be")
