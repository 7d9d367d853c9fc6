"""Tests of failing cells.

A failing cell is detected, isolated and recorded, and its neighbours are not affected.
Reductions ignore the failure only on request.
"""

import contextlib
import re
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from faulty_study import faulty_study
from study_runs import (
    FAULTY_STUDY_FILE,
    HANG_TIMEOUT,
    QUIET_CLUSTER_OPTIONS,
    call_main,
    run,
    run_with_failures,
)

import rsfstudy
from rsfstudy import Axis, Scene, Study
from rsfstudy.cli import assignment_parsing
from rsfstudy.cli.study_results import StudyResults, print_failed_cells
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import IncompleteWarning, InvalidValue, RunError
from rsfstudy.execution import dask_clusters, study_run, worker_log, worker_pool
from rsfstudy.execution.cell_plan import CellBatchIterator
from rsfstudy.reductions import LinearFit, Range, apply_reductions
from rsfstudy.reporting import cell_tables
from rsfstudy.status import Status

LABELS = {s.label: s for s in Status}


def only_one_failed(dataset, status):
    """Assert that only the second cell failed, with the given status.

    The cells are b/a = 2, 2.5, 3 and 3.5.
    """
    assert dataset.status.values.tolist() == [0, LABELS[status], 0, 0]
    np.testing.assert_array_equal(dataset.total, [2.0, np.nan, 3.0, 3.5])


#: Faults with the status and the message of the failed cell.
WRONG = {
    fault: (status, message)
    for fault, status, message in [
        ("raises", "cell_raised", "ZeroDivisionError: in the cell"),
        ("runs out of memory", "cell_raised", "MemoryError"),
        ("recurses", "cell_raised", "RecursionError"),
        ("spends", "work_budget_spent", "--budget 2000000 (in Python, budget=2000000)"),
        ("nan", "not_finite", "total = nan"),
        ("no outcome", "cell_raised", "must be an Outcome with a Status"),
        ("undeclared", "cell_raised", "'totla' is not declared. Did you mean 'total'?"),
        ("too many", "cell_raised", "has the shape (3,), but must have the shape ()"),
        ("text", "cell_raised", "must be a real number"),
        ("masked", "cell_raised", "must be a real number"),
        ("number for message", "cell_raised", "must be a string"),
        (
            "pending",
            "cell_raised",
            "has the status pending, but must have the status of a computed cell",
        ),
        ("surrogate", "cell_raised", r"OSError: no \udc80 file"),
        ("nul", "cell_raised", r"ValueError: bad\0byte [/red]"),
        ("generator", "cell_raised", "GeneratorExit"),
    ]
}


@pytest.fixture(scope="module")
def gone_wrong(tmp_path_factory, cluster):
    """Run studies with all faults in this process and on workers.

    The fixture returns the datasets and the reopened files.
    """
    each = faulty_study(at=(2.5,))
    study = replace(each, axes=[Axis("fault", list(WRONG)), *each.axes])
    found = []
    for where in ({"workers": 0}, {"client": cluster}):
        output = tmp_path_factory.mktemp("wrong")
        found += [run_with_failures(study, **where, output=output), rsfstudy.open("faulty", output)]
    return found


@pytest.mark.parametrize("fault", WRONG)
def test_a_cell_that_goes_wrong(fault, gone_wrong, capsys):
    """Local and remote failures have the same status and message."""
    status, message = WRONG[fault]
    for dataset in gone_wrong:
        cells = dataset.sel(fault=fault)
        only_one_failed(cells, status)
        assert message in cells.message.values[1]
        assert not StudyResults(cells, "").is_complete_without_failures
        print_failed_cells(StudyResults(cells, ""), with_rerun_commands=False)
        assert status in capsys.readouterr().out


@pytest.fixture(scope="module")
def sturdy(tmp_path_factory):
    """Start a cluster whose worker restarts after a crash."""
    log = tmp_path_factory.mktemp("sturdy") / "workers.log"
    with dask_clusters.start_local_cluster(1, log) as client:
        yield client, log


def lost(*words, **options):
    """Run a study and check the warnings about a lost worker."""
    with (
        pytest.warns(UserWarning, match="a worker process ended unexpectedly. Its"),
        pytest.warns(UserWarning, match="cell b_over_a = .* failed, .*The run continues"),
    ):
        return run_with_failures(*words, **options)


def test_a_cell_that_kills_its_worker(sturdy, monkeypatch):
    """Only the crashing cell of a batch is recorded as failed."""
    monkeypatch.setattr(CellBatchIterator, "compute_next_batch_size", lambda _self: 4)
    dataset = lost(faulty_study("segfaults", at=(2.5,)), client=sturdy[0])
    only_one_failed(dataset, "worker_lost")
    assert "needed too much memory" in dataset.message.values[1]


def test_a_cell_that_raises_keyboard_interrupt_on_a_worker(cluster):
    """KeyboardInterrupt on a worker is recorded as an error of the cell."""
    dataset = run_with_failures(faulty_study("interrupts", at=(2.5,)), client=cluster)
    only_one_failed(dataset, "cell_raised")
    assert "KeyboardInterrupt" in dataset.message.values[1]


def test_a_time_limit_does_not_end_the_process_of_the_user(monkeypatch):
    """Workers that are threads of the user's process are not killed."""
    from distributed import Client

    monkeypatch.setenv("FAULT_TAKES", "0.3")
    with Client(processes=False, n_workers=1, **QUIET_CLUSTER_OPTIONS) as client:
        dataset = run(faulty_study(cells=2), client=client, time_limit=0.1)
    assert dataset.status.values.tolist() == [0, 0]


def test_a_cell_that_computes_for_ever(sturdy, monkeypatch):
    """A worker is killed at the time limit, even in C code.

    The cell is repeated in isolation before it is marked as failed.
    """
    client, log = sturdy
    # Only one worker death is allowed, because a worker takes seconds to start.
    monkeypatch.setattr(worker_pool, "_MAX_WORKER_DEATHS_PER_CELL", 1)
    dataset = lost(faulty_study("spins in C", at=(2.5,)), client=client, time_limit=0.5)
    only_one_failed(dataset, "time_limit_spent")
    assert "the cell exceeded 0.5 s of CPU time" in dataset.message.values[1]
    assert "--time-limit" in dataset.message.values[1]
    assert "faulty_study.py" in log.read_text()  # The log contains the location in the code.


def test_a_cell_that_waits_for_ever(sturdy):
    """A cell without CPU time is stopped after ten times the time limit."""
    dataset = lost(faulty_study("hangs in C", cells=1), client=sturdy[0], time_limit=0.1)
    assert dataset.status.values.tolist() == [Status.TIME_LIMIT_SPENT]


def test_a_time_limit_is_one_of_cpu_time():
    """The limit applies to CPU time, not to wall time."""
    script = """
import collections, itertools, time
from rsfstudy.execution import cell_computation as cells
cells.WALL_TIME_LIMIT_OVER_CPU_TIME_LIMIT = 1e6
with cells._cpu_time_limits.enforce_in_this_thread(0.1):
    time.sleep(1.5)
print("slept")
with cells._cpu_time_limits.enforce_in_this_thread(0.1):
    collections.deque(itertools.repeat(1), maxlen=0)
"""
    words = [sys.executable, "-u", "-c", script]
    ran = subprocess.run(words, capture_output=True, text=True, check=False, timeout=HANG_TIMEOUT)
    assert (ran.returncode, ran.stdout) == (-signal.SIGPROF, "slept\n")
    assert 'File "<string>"' in ran.stderr  # The output contains the location in the code.


def test_a_cell_that_is_slow_on_the_clock_alone_is_not_ended(sturdy):
    """A cell that needs wall time but no CPU time is not stopped."""
    dataset = run(faulty_study("sleeps", at=(2.5,)), client=sturdy[0], time_limit=2.0)
    assert dataset.status.values.tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize("fault", ["raises", "nan"])
def test_if_everything_fails_at_the_start_the_run_stops_and_says_why(fault, tmp_path):
    with pytest.raises(RunError, match=r"all of the first \d+ cells failed. .*keep_going=True"):
        run(faulty_study(fault, cells=100), output=tmp_path)
    partial = rsfstudy.open(tmp_path / "faulty.partial.nc")
    tried = partial.status != int(Status.PENDING)
    assert study_run._MAX_FAILURES_WITHOUT_SUCCESS <= int(tried.sum()) < 100
    assert not (tmp_path / "faulty.nc").exists()


def test_a_corner_of_the_lattice_that_fails_does_not_stop_a_run():
    """A failing corner of the lattice does not stop a run.

    The first cells are a sample of the whole lattice.
    """
    corner = tuple(2.0 + 0.5 * i for i in range(100))
    study = faulty_study("raises", at=corner, cells=400)
    status = run_with_failures(study).status.values
    assert (status[:100] == Status.CELL_RAISED).all()
    assert (status[100:] == Status.OK).all()


def test_a_run_says_which_cells_failed(tmp_path, capsys):
    """Python warns about failed cells, and the command prints a table."""
    study = faulty_study("nan", at=(2.5, 3.0))
    with pytest.warns(
        IncompleteWarning, match=r"^2 of 4 cells failed: not_finite 2; use dataset\.rsf\."
    ):
        dataset = run(study)
    assert len(dataset.rsf.failures()) == 2
    assert "failed" not in "".join(capsys.readouterr())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FAULT", "nan")
        patch.setenv("FAULT_AT", "2.5 3.0")
        told = call_main("run", FAULTY_STUDY_FILE, "--serial", "--quiet", "--output", tmp_path)
    assert "2 cells failed" in told.stdout
    assert told.stderr == ""


@pytest.mark.parametrize(
    ("failing", "note"),
    [
        ((2.5,), "spread: 1 of 4 values are missing (b_over_a = 2.5): some of the required cells"),
        ((2.0, 2.5, 3.0, 3.5), "no spread: some of the required cells failed or are missing"),
    ],
)
def test_missing_values_of_a_reduction_are_listed(failing, note, tmp_path):
    """The note lists the missing values, unless all values of the reduction are missing."""
    study = replace(
        faulty_study("nan", at=failing),
        axes=[*faulty_study().axes, Axis("phi", [45.0, 60.0])],
        reductions=[Range(name="spread", of="total", over="phi")],
    )
    with pytest.warns(IncompleteWarning, match=re.escape(note)):
        run(study, output=tmp_path)
    shown = " ".join(call_main("show", tmp_path / "faulty.nc").stdout.split())
    assert note.partition(": ")[2] in shown


def test_it_goes_on_when_told_to():
    dataset = run_with_failures(faulty_study("raises", cells=100), keep_going=True)
    assert (dataset.status == int(Status.CELL_RAISED)).all()


def test_failed_cells_are_listed_with_how_to_reproduce_each_alone(tmp_path, monkeypatch):
    for name, value in {"FAULT": "raises", "FAULT_AT": "2.5 3.5", "COLUMNS": "500"}.items():
        monkeypatch.setenv(name, value)
    assert call_main("run", FAULTY_STUDY_FILE, "--serial", "--output", tmp_path).returncode == 1
    shown = call_main("show", tmp_path / "faulty.nc")
    out = shown.stdout
    assert shown.returncode == 1
    assert "2 cells failed" in out
    assert out.count("ZeroDivisionError: in the cell") == 2
    commands = [line.strip() for line in out.splitlines() if "rsfstudy rerun" in line]
    assert len(commands) == 2
    words = shlex.split(commands[0])
    assert words[-2:] == ["--cell", "b_over_a=2.5"]
    # The repeated cell fails with the same error and prints the traceback.
    alone = call_main(*words[1:])
    assert alone.returncode == 1
    assert "in compute" in alone.stderr
    assert "ZeroDivisionError: in the cell" in alone.stderr


AWKWARD = ["1:2:3", "p,q", "true", "3", "1e3", " lead", "a='b\"", "[red]", "Größe", "x = 1, y = 2"]


def test_cells_with_awkward_labels_alone(tmp_path):
    """The printed command recomputes the cell for any label."""
    rows = {label: {"b_over_a": 2.0 + i} for i, label in enumerate(AWKWARD)}
    study = Study(
        name="awkward",
        title="Awkward [labels]",
        base=Scene(normal_stress="constant"),
        axes=[Axis("study", rows), Axis("inertia", [False, True])],
        measure=CriticalStep(of="displacement_step"),
    )
    dataset = run(study, output=tmp_path)
    dataset["status"][:, 1] = int(Status.UNVERIFIED)
    for number, label in enumerate(AWKWARD):
        place = {"study": label, "inertia": dataset.inertia.values[1]}
        words = shlex.split(
            cell_tables.format_recompute_command(dataset, str(tmp_path / "awkward.nc"), place)
        )
        cells = dict(
            assignment_parsing.parse_cell_coordinate(text) for text in words if "=" in text
        )
        scene, _outcome = rsfstudy.recompute_cell(tmp_path / "awkward.nc", cells)
        assert (scene.b_over_a, scene.inertia) == (2.0 + number, True)


def test_a_cell_is_that_of_the_file_and_not_of_the_study_as_it_is_now(tmp_path):
    """The cell uses the values of the file, and the measure of the study.

    The study file contains other values.
    """
    run(FAULTY_STUDY_FILE, output=tmp_path, b_over_a=[7.0, 8.0])
    scene, outcome = rsfstudy.recompute_cell(
        tmp_path / "faulty.nc", {"b_over_a": "8"}, study=FAULTY_STUDY_FILE
    )
    assert scene.b_over_a == outcome.values["total"] == 8.0
    (tmp_path / "other.py").write_text(
        FAULTY_STUDY_FILE.read_text().replace('name="faulty"', 'name="other"')
    )
    with pytest.raises(InvalidValue, match="'other', but the results belong to the study 'faulty'"):
        rsfstudy.recompute_cell(
            tmp_path / "faulty.nc", {"b_over_a": 8}, study=tmp_path / "other.py"
        )


def lattice(failing=(3.0,)) -> xr.Dataset:
    study = faulty_study("raises", at=failing, cells=6)
    return (run_with_failures if failing == (3.0,) else run)(study)


FIT = (LinearFit(name="slope", of="total", on="b_over_a"),)


def test_reductions_draw_on_what_there_is_when_told_to_and_say_so():
    found = apply_reductions(lattice(), FIT, despite_failures=True)
    assert float(found.slope) == pytest.approx(1.0, rel=1e-14)
    assert int(found.slope_points) == 5
    assert found.slope.despite == "1 failed cells are omitted"
    assert found.attrs["reduced_despite"] == "1 failed cells are omitted"
    # The lattice is unchanged.
    assert found.status.values[2] == Status.CELL_RAISED
    whole = apply_reductions(lattice(failing=(99.0,)), FIT, despite_failures=True)
    assert "reduced_despite" not in whole.attrs


def test_the_run_passes_it_on(tmp_path):
    """A fit is rejected if a cell fails, unless failures are permitted."""
    study = replace(faulty_study("raises", at=(3.0,), cells=6), reductions=FIT)
    assert np.isnan(run_with_failures(study, output=tmp_path).slope)
    told = run_with_failures(study, output=tmp_path, despite_failures=True)
    assert float(told.slope) == pytest.approx(1.0, rel=1e-14)
    assert rsfstudy.open("faulty", tmp_path).attrs["reduced_despite"]


def test_workers_that_never_come(monkeypatch):
    """A run on a scheduler without workers warns and ends with an error."""
    from distributed import Client, LocalCluster

    for name, seconds in {
        "_SECONDS_BETWEEN_FUTURE_POLLS": 0.1,
        "WARN_AFTER_SECONDS_WITHOUT_WORKER": 0.2,
        "GIVE_UP_AFTER_SECONDS_WITHOUT_WORKER": 0.4,
    }.items():
        monkeypatch.setattr(worker_pool, name, seconds)
    with (
        LocalCluster(n_workers=0, **QUIET_CLUSTER_OPTIONS) as cluster,
        Client(cluster) as client,
        pytest.warns(
            UserWarning,
            match=r"has no worker. The run will end if no worker connects within 0\.4 s",
        ),
        pytest.raises(RunError, match=r"no worker for 0\.4 s. Start workers"),
    ):
        run(faulty_study(), client=client)


@pytest.mark.parametrize("is_local", [True, False])
def test_an_event_loop_of_dask_that_ends(is_local, tmp_path):
    """The run keeps its cells and ends with an error, and the cluster is closed without another."""

    def end() -> None:
        raise SystemExit

    def end_the_loop(done, _total, _seconds_left):
        if done:
            used.loop.add_callback(end)
            while not used.loop.asyncio_loop.is_closed():
                time.sleep(0.01)

    log = tmp_path / "workers.log"
    with (
        worker_log.open_worker_log(log) as log,
        dask_clusters.start_local_cluster(1, log) as local,
        contextlib.ExitStack() as stack,
    ):
        connected = dask_clusters.connect_to_cluster(local.scheduler.address)
        used = local if is_local else stack.enter_context(connected)
        lost = r"connection to the Dask scheduler is lost.* are finished and stored"
        with pytest.raises(RunError, match=lost):
            run(faulty_study(), client=used, output=tmp_path, progress=end_the_loop)
