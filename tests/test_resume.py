"""Tests of interrupted runs.

A run that was interrupted at any point resumes and produces bitwise identical results.
Finished cells are kept, and results of other code are not mixed in.
"""

import contextlib
import functools
import os
import resource
import signal

import psutil
import pytest
from faulty_study import faulty_study
from study_runs import (
    FAULTY_STUDY_FILE,
    HANG_TIMEOUT,
    SMALL_STUDY,
    call_main,
    count_journal_cells,
    have_same_numbers,
    record_computed_cells,
    run,
    run_with_failures,
    start_command,
    wait_for_command,
    wait_for_journal_cells,
    wait_until,
)

import rsfstudy
from rsfstudy.errors import DataError, RunError
from rsfstudy.execution import cell_computation
from rsfstudy.status import Status
from rsfstudy.storage import cell_journal

CELLS = 30


@functools.cache
def uninterrupted():
    return run(faulty_study(cells=CELLS))


class Held:
    """A run that has stored some cells, while other cells wait at a gate."""

    def __init__(self, output, gate, *options):
        self.output, self.gate, self.journal = output, gate, output / "faulty.cells.sqlite"
        gate.mkdir()
        words = ("run", FAULTY_STUDY_FILE, "--output", output, *options)
        self.process = start_command(*words, FAULT_CELLS=str(CELLS), FAULT_GATE=str(gate))
        wait_for_journal_cells(self.journal, self.process)

    def let_through(self):
        (self.gate / "open").touch()

    def workers(self):
        return [c for words, c in children(self.process).items() if "spawn_main" in words]


def children(process):
    """Return the child processes of a process by their command lines."""
    found = {}
    for child in psutil.Process(process.pid).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):
            found[" ".join(child.cmdline())] = child
    return found


@pytest.fixture
def held(tmp_path):
    """Return a function that starts such runs, and kill them afterwards."""
    started = []

    def start(*options):
        started.append(Held(tmp_path / "outputs", tmp_path / "gate", *options))
        return started[-1]

    yield start
    for process in [each.process for each in started]:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        if not process.stdout.closed:
            process.communicate()


def goes_on(output, already):
    """Resume a run, and assert that only missing cells are computed.

    The results must be bitwise identical to an uninterrupted run.
    """
    with record_computed_cells() as asked:
        resumed = run(faulty_study(cells=CELLS), output=output)
    assert len(asked) == CELLS - already
    have_same_numbers(resumed, uninterrupted())
    have_same_numbers(rsfstudy.open("faulty", output), uninterrupted())
    assert {"faulty.cells.sqlite", "faulty.nc"} == set(os.listdir(output)) - {"faulty.png"}


def test_the_driver_is_killed(held):
    """Finished cells survive SIGKILL of the driver, and its workers end.

    A finished cell is stored before its batch is complete.
    """
    # The first cell of each batch is stored while the other cells wait.
    run = held("--workers", "1")
    left = list(children(run.process).values())
    run.process.kill()
    wait_for_command(run.process)
    already = count_journal_cells(run.journal)
    assert already == 1
    assert not (run.output / "faulty.nc").exists()
    _gone, alive = psutil.wait_procs(left, timeout=HANG_TIMEOUT)
    assert not alive
    goes_on(run.output, already)


def test_a_worker_is_killed(held):
    """A run continues without failed cells after SIGKILL of a worker."""
    run = held("--workers", "1")
    run.workers()[0].kill()
    run.let_through()
    code, out, said = wait_for_command(run.process)
    assert code == 0, out
    assert "warning: a worker process ended unexpectedly. Its " in said
    assert len(said.splitlines()) == 1, said
    have_same_numbers(rsfstudy.open("faulty", run.output), uninterrupted())


@pytest.mark.parametrize(
    ("options", "number", "status", "why"),
    [
        (["--workers", "1"], signal.SIGINT, 1, "interrupted"),
        (["--workers", "1"], signal.SIGTERM, 128 + 15, "ended by SIGTERM"),
        (["--serial"], signal.SIGHUP, 128 + 1, "ended by SIGHUP"),
    ],
)
def test_a_signal_ends_a_run_in_order(options, number, status, why, held):
    """A signal to the process group ends a run in an orderly way.

    Terminals and batch systems send the signal to the command and its workers.
    """
    run = held(*options)
    left = list(children(run.process).values())
    os.killpg(run.process.pid, number)
    run.let_through()
    code, _out, said = wait_for_command(run.process)
    assert code == status
    assert f"error: faulty: {why}. " in said
    assert not psutil.wait_procs(left, timeout=HANG_TIMEOUT)[1]
    assert f"of {CELLS} cells are finished and stored in" in said
    assert len(said.splitlines()) == 1, said
    partial = rsfstudy.open(run.output / "faulty.partial.nc")
    done = int((partial.status == 0).sum())
    assert partial.attrs["completeness"] == f"partial: {done} of {CELLS} cells"
    assert (partial.status == int(Status.PENDING)).sum() == CELLS - done
    assert 0 < done < CELLS
    goes_on(run.output, done)


def test_a_signal_ends_a_motion_with_one_line(tmp_path):
    """A signal ends a simulation with a one-line message.

    The signal is sent after the warning about the rig, and sent twice, as ``timeout`` does.
    """
    rig = ("--normal-stress", "1 Pa", "--slip-distance", "10 um", "--reference-velocity", "1 um/s")
    cycles = ("--set", "stiffness_ratio=0.8", "--set", "inertia=true", "--set", "hold_time=1 s")
    for_ever = ("--duration", "1e15 s", "--budget", str(10**15))
    process = start_command(
        "simulate", *rig, *cycles, *for_ever, "--output", tmp_path / "motion.png"
    )
    assert "unusual for a rig" in process.stderr.readline()
    process.terminate()
    process.terminate()
    code, _out, said = wait_for_command(process)
    assert (code, said) == (128 + signal.SIGTERM, "error: ended by SIGTERM\n")
    assert not list(tmp_path.iterdir())


def test_ctrl_c_while_the_workers_start(tmp_path):
    """SIGINT during the start of workers ends the run in an orderly way.

    The workers do not receive the signal.
    """
    words = ("run", FAULTY_STUDY_FILE, "--workers", "1", "--output", tmp_path)
    process = start_command(*words, FAULT="hangs")
    wait_until(lambda: any("spawn_main" in words for words in children(process)), process)
    os.killpg(process.pid, signal.SIGINT)
    code, _out, said = wait_for_command(process)
    assert code == 1
    assert "0 of 4 cells are finished and stored in" in said
    assert len(said.splitlines()) == 1, said


def test_workers_that_cannot_start(tmp_path):
    """The run ends with an error if a worker process cannot start."""
    import dask

    with (
        dask.config.set({"distributed.worker.preload": ["no_such_module"]}),
        pytest.raises(RunError, match="faulty: a worker process could not be started"),
    ):
        run(faulty_study(), workers=1, output=tmp_path)
    assert "No module named 'no_such_module'" in (tmp_path / "faulty.workers.log").read_text()


def test_ctrl_c_in_the_middle_of_writing(tmp_path, monkeypatch):
    """SIGINT during writing leaves the old file and no temporary files.

    No cell is computed again.
    """
    study = faulty_study(cells=CELLS)
    run(study, output=tmp_path)
    old = (tmp_path / "faulty.nc").read_bytes()

    def interrupted(*_args):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", interrupted)
        with pytest.raises((RunError, KeyboardInterrupt)):
            run(study, output=tmp_path)
    assert (tmp_path / "faulty.nc").read_bytes() == old
    assert sorted(os.listdir(tmp_path)) == ["faulty.cells.sqlite", "faulty.nc"]
    goes_on(tmp_path, CELLS)


def test_what_a_killed_write_left_is_no_result(tmp_path):
    """A temporary file of a killed run is ignored and removed."""
    run(faulty_study(cells=CELLS), output=tmp_path)
    (tmp_path / ".faulty.nc.new").write_bytes(b"what a killed run left")
    have_same_numbers(rsfstudy.open("faulty", tmp_path), uninterrupted())
    goes_on(tmp_path, CELLS)


def test_fresh_leaves_no_half_transaction_behind(tmp_path):
    """The option ``fresh`` also removes the rollback journal of SQLite.

    Otherwise, SQLite would apply the rollback journal to the new file.
    """
    (tmp_path / "faulty.cells.sqlite").write_bytes(b"")
    (tmp_path / "faulty.cells.sqlite-journal").write_bytes(b"what a killed run left")
    have_same_numbers(run(faulty_study(cells=CELLS), output=tmp_path, fresh=True), uninterrupted())


@contextlib.contextmanager
def limited(size):
    """Limit the size of files, so that writing fails as on a full disk."""
    inherited = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, inherited[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, inherited)


def test_a_full_disk_while_cells_are_computed(tmp_path, monkeypatch):
    """A full disk ends the run with an error, and the run can be resumed."""
    monkeypatch.setenv("FAULT_CELLS", "2000")
    with limited(100_000):
        ran = call_main("run", FAULTY_STUDY_FILE, "--serial", "--output", tmp_path)
    said = " ".join(ran.stderr.split())
    assert ran.returncode == 1
    assert "cannot write to" in said
    assert "To resume the run, run the same command again" in said
    kept = count_journal_cells(tmp_path / "faulty.cells.sqlite")
    assert 0 < kept < 2000
    whole = run(faulty_study(cells=2000))
    have_same_numbers(run(faulty_study(cells=2000), output=tmp_path), whole)
    have_same_numbers(rsfstudy.open("faulty", tmp_path), whole)


def test_a_full_disk_while_the_result_is_written(tmp_path, monkeypatch):
    """A full disk leaves the old results, and all cells are kept."""
    run(faulty_study(cells=4), output=tmp_path)
    old = (tmp_path / "faulty.nc").read_bytes()
    study = faulty_study(cells=CELLS)
    run(study, output=tmp_path)
    (tmp_path / "faulty.nc").write_bytes(old)
    monkeypatch.setenv("FAULT_CELLS", str(CELLS))
    with limited(len(old) // 2):
        ran = call_main("run", FAULTY_STUDY_FILE, "--serial", "--output", tmp_path)
    said = " ".join(ran.stderr.split())
    assert ran.returncode == 1
    assert "No file was replaced" in said
    assert f"{CELLS} of {CELLS} cells are finished and stored" in said
    assert (tmp_path / "faulty.nc").read_bytes() == old
    goes_on(tmp_path, CELLS)


def test_a_longer_and_denser_axis_computes_only_new_cells(tmp_path):
    first = run(output=tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["small.cells.sqlite", "small.nc"]
    longer = SMALL_STUDY.with_(b_over_a=[2.0, 2.25, 2.5, 3.0, 3.5])
    with record_computed_cells() as asked:
        extended = run(longer, output=tmp_path)
    assert sorted(cell.scene.b_over_a for cell in asked) == [2.25, 2.25, 3.5, 3.5]
    have_same_numbers(extended.sel(b_over_a=[2.0, 2.5, 3.0]), first)
    have_same_numbers(extended, run(longer))


def test_two_runs_at_a_time_are_refused(tmp_path, monkeypatch):
    """A second run on the same journal raises an error.

    The first run is not affected.
    """
    monkeypatch.setattr(cell_journal, "_JOURNAL_LOCK_TIMEOUT_SECONDS", 0.1)
    study, computed, refused = (
        faulty_study(cells=CELLS),
        cell_computation.compute_cell,
        list[bool](),
    )

    def meanwhile(*words, **options):
        for fresh in (False, True) if not refused else ():
            refused.append(fresh)
            with pytest.raises(DataError, match=r"another run uses .*faulty\.cells\.sqlite"):
                run(study, output=tmp_path, fresh=fresh)
        return computed(*words, **options)

    monkeypatch.setattr(cell_computation, "compute_cell", meanwhile)
    have_same_numbers(run(study, output=tmp_path), uninterrupted())
    assert refused == [False, True]
    have_same_numbers(rsfstudy.open("faulty", tmp_path), uninterrupted())


@pytest.mark.parametrize("name", ["python", "numpy", "scipy"])
def test_other_versions_are_not_mixed(name, tmp_path, monkeypatch):
    from rsfstudy.execution import provenance

    run(output=tmp_path)
    other = {**provenance.collect_code_fingerprint(), name: "other"}
    monkeypatch.setattr(provenance, "collect_code_fingerprint", lambda *_used: other)
    with pytest.raises(DataError, match=f"{name}: .* in the journal, other in this run"):
        run(output=tmp_path)


def test_failures_are_tried_again(tmp_path):
    """The next run computes failed cells again, but no other cells."""
    failing = faulty_study("raises", at=(2.5,))
    status = run_with_failures(failing, output=tmp_path).status
    assert status.values.tolist() == [0, Status.CELL_RAISED, 0, 0]
    assert count_journal_cells(tmp_path / "faulty.cells.sqlite") == 4
    with record_computed_cells() as asked:
        run_with_failures(failing, output=tmp_path)
    assert [cell.scene.b_over_a for cell in asked] == [2.5]


# ---- more work ----------------------------------------------------------------------------------
def test_where_more_work_is_allowed_answers_are_kept_and_the_rest_is_tried_again(tmp_path):
    few = {"b_over_a": [2.0], "output": tmp_path}
    spent = run_with_failures(SMALL_STUDY, budget=300, **few)
    assert (spent.status == int(Status.WORK_BUDGET_SPENT)).all()
    assert "--budget 1200 (in Python, budget=1200)" in spent.message.values.flat[0]
    answered = run(SMALL_STUDY, budget=100_000, **few)
    assert (answered.status == int(Status.OK)).all()
    again = run(SMALL_STUDY, budget=200_000, **few)
    have_same_numbers(again, answered)
    assert (again.wall_time == answered.wall_time).all()  # The cells were not computed again.
    with pytest.raises(DataError, match="budget: 200000 in the journal, 300 in this run"):
        run(SMALL_STUDY, budget=300, **few)
    with pytest.raises(DataError, match="rtol: 1e-07 in the journal, 1e-06 in th"):
        run(SMALL_STUDY, budget=400_000, rtol=1e-6, **few)
