"""Helper functions that run small studies and the command-line interface.

The command runs in this process or in a new process.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sqlite3
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

# The console reads its width from the environment at import time, so the console is imported
# before any test changes the environment.
from rsfstudy.named_studies._gualandi import NORMAL_STRESSES

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.cli import command_line, commands  # noqa: F401
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import DataError, IncompleteWarning
from rsfstudy.execution import cell_computation, cell_plan
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.integrator import Integrator
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.study import study_loader
from rsfstudy.study.claims import Claim
from rsfstudy.study.lattice_cell import Cell

SMALL_STUDY = Study(
    name="small",
    title="A small lattice",
    base=Scene(),
    axes=[
        Axis("case", {"constant": {"normal_stress": "constant"}, "variable": {"alpha": 0.56}}),
        Axis("b_over_a", [2.0, 2.5, 3.0]),
    ],
    measure=CriticalStep(),
)
#: Source of a study file with a user-defined measure.
USER_MEASURE_SOURCE = """
from dataclasses import dataclass
from typing import ClassVar

from rsfstudy import Axis, Scene, Study
from rsfstudy.measures import Measure, Outcome
from rsfstudy.status import Status


@dataclass(frozen=True)
class Power(Measure):
    power: int = 1
    offset: float = 0.0
    name: ClassVar[str] = "power"
    primary_output = "total"
    variables = {"total": ()}
    typical_rhs_evaluations = 1

    def compute(self, scene, integrator):
        if self.power == 4:
            raise ZeroDivisionError
        return Outcome(Status.OK, {"total": scene.b_over_a**self.power + self.offset})


study = Study(
    name="own", title="Powers", base=Scene(),
    axes=[Axis("power", [1, 2]), Axis("b_over_a", [2, 3])], measure=Power(),
)
"""
FAULTY_STUDY_FILE = Path(__file__).with_name("faulty_study.py")
#: Timeout in s after which a test fails, chosen for the slowest machines.
HANG_TIMEOUT = 1200.0


def run(study=SMALL_STUDY, **options) -> xr.Dataset:
    """Run a study in this process and in memory by default."""
    return rsfstudy.run(study, **{"workers": 0, "output": None, "progress": False, **options})


def study_of(name, measure, *axes, base=None, **fields) -> Study:
    """Return a study of default scenes, unless ``base`` is given."""
    return Study(name=name, title=name, base=base or Scene(), axes=axes, measure=measure, **fields)


def example_claim(**fields) -> Claim:
    """Return a claim that a published value is 1, with a tolerance of 0.1."""
    usual = {"id": "C1", "statement": "", "source": "", "where": {}, "published": 1.0}
    return Claim(**usual | {"tolerance": 0.1, "reason": ""} | fields)


def cell_key(scene, measure) -> bytes:
    """Return the key of a cell that is planned separately."""
    return cell_plan.compute_cell_key(scene, measure)


def run_with_failures(*words, **options) -> xr.Dataset:
    """Run a study and check the warning that some of its cells failed."""
    with pytest.warns(
        IncompleteWarning, match=r"^\d+ of \d+ cells failed: .*failures\(\) for a list$"
    ):
        return run(*words, **options)


@contextlib.contextmanager
def record_computed_cells() -> Iterator[list[Cell]]:
    """Record the cells that this process computes in the ``with`` block."""
    asked, computed = list[Cell](), cell_computation.compute_cell

    def counted(task, cell, **options):
        asked.append(cell)
        return computed(task, cell, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cell_computation, "compute_cell", counted)
        yield asked


#: Options of Dask clusters without a dashboard.
QUIET_CLUSTER_OPTIONS = {
    "dashboard_address": "127.0.0.1:0",
    "scheduler_kwargs": {"dashboard": False},
}


#: Reduced axes of expensive studies, sufficient for their claims and figures. Dense axes keep
#: the points of the claims and some points between them, and studies of cost keep the problems
#: and integrators of the claims.
REDUCED_AXES = {
    "accuracy_cost": {
        "problem": [
            "critical step",
            "cycle, slip law: static drop",
            "cycle, slowness law: recurrence",
        ],
        "integrator": ["DOP853", "RK45", "DOP853 + Radau"],
        "requested_digits": [4, 6, 9],
        "repeats": 1,
    },
    "bounded_slip": {"stiffness_ratio": [1.0, 1.1], "load_velocity_ratio": [2.0, 200.0]},
    # A single motion of the omitted samples takes as long as all other motions.
    "coverage": {"sample": [0, 1]},
    "design_of_steps": {"seed": [0, 1]},
    "dilatant_cycles": {"drainage": [1.0], "dilatancy": [0.0, 0.004, 0.008]},
    "dilatant_steps": {"drainage": [0.1, 1.0, 10.0]},
    "displacement_boundary": {"b_over_a": 1.0 + 1.0 / np.array([0.25, 0.5, 0.75, 1.0, 2.0])},
    "flash_heating_cycles": {"weakened_friction": [0.1, 0.2, 0.5]},
    "fit_coverage": {
        "process": ["white", "ar1", "encoder", "coarsely_rounded"],
        "seed": list(range(12)),
    },
    "fit_coverage_joint": {"process": ["white"]},
    "injection": {"record": ["1000", "2000"]},
    "instability_norm": {
        "boundary": ["slowness at k_cr", "slowness at 1.5 k_cr", "slip at a/(b-a) = 4"],
        "instability_norm": np.geomspace(5e-6, 5e-2, 33)[::4],
    },
    "laboratory_recurrence": {
        "experiment": [
            *(f"{stress:g} MPa" for stress in NORMAL_STRESSES),
            "15.001 MPa, noise",
            "24.976 MPa, noise",
        ],
    },
    "law_choice": {"seed": [0, 1]},
    "law_identification": {"seed": list(range(6))},
    "laws": {"stiffness_ratio": [0.5, 1.0, 2.0]},
    "laws_cycles": {"load_velocity_ratio": [2.0, 250.0]},
    "laws_velocity_steps": {"stiffness_ratio": [1.25, 1.75]},
    "noisy_recurrence": {"sample": [0, 1]},
    "rate_step_lattice": {"stiffness_ratio": [1.0, 1.5, 2.0]},
    "rate_step_stiffness": {"stiffness_ratio": np.linspace(1.0, 2.0, 21)[[0, 2, 5, 10, 15, 20]]},
    "slide_hold_slide": {"hold_time": [1.0, 1e4, 1e5, 1e6, 1e7, 1e8]},
    "stability_map": {
        "stiffness_ratio": [0.2, 0.6, 0.8, 0.87, 0.96, 1.04, 3.0, 8.0],
        "load_velocity_ratio": np.geomspace(1.01, 1000.0, 5),
    },
    "stress_drop": {
        "stiffness_ratio": [0.4, 0.8],
        "load_velocity_ratio": 10.0 ** np.linspace(0.0, 3.0, 4),
    },
    "thermal_pressurisation": {"drainage": [0.001, 0.01, 0.05, 1.0, 10.0, 100.0]},
    "thermal_pressurisation_cycles": {"heating": [1e-4, 1e-3, 1e-2]},
    "triggering": {
        "case": ["imposed, alpha = 0", "imposed, alpha = 0.56", "inclined, alpha = 0.56"],
        "stiffness_ratio": [0.05, 0.25, 0.5, 1.0, 1.25, 2.0],
    },
    # The first samples of a sequence are a valid sample.
    "uncertain_recurrence": {"sample": list(range(64))},
    "velocity_steps": {"stiffness_ratio": [1.2, 3.0, 10.0, 300.0]},
    "wave_triggering": {"cycle_phase": [0.5, 0.8, 0.9]},
    "what_matters": {"sample": list(range(5 * 64))},
    "two_states": {
        "stiffness_ratio": [0.84, 0.8531, 0.8567, 0.8655, 0.8659, 0.8663, 0.8667, 0.9, 0.95, 1.02]
    },
}


#: Fields of the measures of expensive studies, with smaller values.
REDUCED_MEASURES = {"noisy_recurrence": {"cycles": 600}}


#: Studies whose motions use the compiled engine, which ``test_compiled`` compares with SciPy.
COMPILED_ONLY_STUDIES = (
    "bounded_slip", "coverage", "dilatant_cycles", "dilatant_steps", "displacement_boundary",
    "flash_heating_cycles", "injection", "normal_stress_steps", "rate_step_lattice", "resonance",
    "rig_recurrence", "slide_hold_slide", "stress_drop", "thermal_pressurisation_cycles",
    "triggering", "two_states", "uncertain_recurrence", "velocity_steps", "wave_triggering",
    "what_matters",
)  # fmt: skip


def reduced_study(name: str) -> Study:
    """Return a named study with fewer points.

    Only the claims about the remaining points are kept.
    """
    study, points = study_loader.load_study(name), REDUCED_AXES.get(name, {})
    if name in COMPILED_ONLY_STUDIES:
        study = replace(study, accuracy=replace(study.accuracy, engine=COMPILED))
    study = replace(study, measure=study.measure.with_(**REDUCED_MEASURES.get(name, {})))
    if kinds := points.get("process"):
        claims = [claim for claim in study.claims if claim.where["process"] in kinds]
        study = replace(study, claims=claims)
    return replace(study.with_(**points), overrides=study.overrides)


def named_results(name: str, tmp_path_factory) -> tuple[xr.Dataset, Path]:
    """Return the results of a reduced named study, and the file path.

    All test processes share the results. The first process that needs a study computes it.
    """
    place = tmp_path_factory.getbasetemp()
    output = (place.parent if "PYTEST_XDIST_WORKER" in os.environ else place) / "named"
    file, end = output / f"{name}.nc", time.monotonic() + HANG_TIMEOUT
    while not file.exists():
        try:
            return run(reduced_study(name), output=output), file
        except DataError as error:
            if "another run uses" not in str(error) or time.monotonic() > end:
                raise
            time.sleep(0.1)
    return rsfstudy.open(file), file


def have_same_numbers(ours: xr.Dataset, theirs: xr.Dataset) -> None:
    """Assert that two datasets are bitwise identical.

    Wall times and attributes are ignored.
    """
    xr.testing.assert_identical(
        ours.drop_vars("wall_time").drop_attrs(), theirs.drop_vars("wall_time").drop_attrs()
    )


def call_main(*words, encoding: str = "utf-8") -> SimpleNamespace:
    """Run the command in this process through its entry point.

    Exceptions, including encoding errors of the output, propagate instead of being printed.
    """
    out = io.TextIOWrapper(io.BytesIO(), encoding, write_through=True)
    said = io.TextIOWrapper(io.BytesIO(), "utf-8", "backslashreplace", write_through=True)
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(sys, "argv", ["rsfstudy", *map(str, words)])
        patch.setattr(sys, "stdout", out)
        patch.setattr(sys, "stderr", said)
        with pytest.raises(SystemExit) as ended:
            command_line.main()
    texts = [stream.buffer.getvalue().decode(stream.encoding) for stream in (out, said)]
    return SimpleNamespace(returncode=ended.value.code, stdout=texts[0], stderr=texts[1])


#: Signal handlers are restored because shells ignore signals in processes that run in the
#: background or without a terminal.
_COMMAND_SOURCE = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from rsfstudy.cli.command_line import main
main()
"""


def start_command(*words, **environment) -> subprocess.Popen:
    """Start the command in a new process and a new session."""
    return subprocess.Popen(
        [sys.executable, "-c", _COMMAND_SOURCE, *map(str, words)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "COLUMNS": "500", **environment},
    )


def wait_for_command(process: subprocess.Popen) -> tuple[int, str, str]:
    """Return exit status, output and errors of a finished command.

    Progress lines are removed from the errors.
    """
    out, said = process.communicate(timeout=HANG_TIMEOUT)
    assert "Traceback" not in said, said
    return (
        process.returncode,
        out,
        re.sub(r"^\w+: \d+ of \d+ cells after .*\n", "", said, flags=re.M),
    )


def run_command(words: Sequence[str]) -> tuple[int, str]:
    """Return exit status and output of a command run in this process.

    The output is joined into one line.
    """
    done = call_main(*words)
    return int(done.returncode or 0), " ".join(f"{done.stdout}{done.stderr}".split())


def start_point(scene: Scene) -> MotionPoint:
    """Return the initial point of the motion of a scene."""
    return next(Integrator(Accuracy(budget=1_000_000)).follow(scene)).point


def count_journal_cells(journal: Path) -> int:
    """Return the number of cells in the journal of a run that has ended.

    Opening the journal rolls back unfinished transactions, as the next run would do.
    """
    with contextlib.closing(sqlite3.connect(f"file:{journal}?mode=rw", uri=True)) as db:
        return int(db.execute("SELECT count(*) FROM cells").fetchone()[0])


def wait_for_journal_cells(journal: Path, process: subprocess.Popen) -> None:
    """Wait until a run has stored cells in its journal.

    The run locks its journal, so the function reads the file without locks.
    """
    unfinished = journal.with_name(f"{journal.name}-journal")

    def kept() -> bool:
        # The journal may not exist yet, or a write may be in progress.
        with contextlib.suppress(sqlite3.Error):
            uri = f"file:{journal}?immutable=1"
            with contextlib.closing(sqlite3.connect(uri, uri=True)) as db:
                cells = db.execute("SELECT count(*) FROM cells").fetchone()[0]
            # The write is complete when the header of the rollback journal is cleared.
            return cells > 0 and not unfinished.read_bytes()[:8].strip(b"\0")
        return False

    wait_until(kept, process)


def wait_until(true: Callable[[], bool], process: subprocess.Popen) -> None:
    """Wait until a condition is true while a process is running."""
    end = time.monotonic() + HANG_TIMEOUT
    while not true():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end, "it never came to be"
        time.sleep(0.05)
