"""Interrupted anywhere, a run goes on from there and ends with the same bytes; nothing computed is
lost, nothing of another kind is mixed in.
"""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import threading
import time

import psutil
import pytest
from faulty import declared
from running import FAULTY, SMALL, cells_in, command, ended, run, same_numbers, until

import rsfstudy
from rsfstudy import cells, workers
from rsfstudy.errors import DataError, RunError
from rsfstudy.status import Status

CELLS = 60
SLOW = {"FAULT_CELLS": str(CELLS), "FAULT_TAKES": "0.05"}


def uninterrupted():
    return run(declared(cells=CELLS))


@pytest.fixture
def slow(tmp_path):
    """A run of three seconds that has kept some of its cells, and its directory."""
    process = command("run", FAULTY, "--output", tmp_path, **SLOW)
    until(lambda: cells_in(tmp_path / "faulty.cells.sqlite") > 0, process)
    yield process, tmp_path
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    if not process.stdout.closed:
        process.communicate()


def goes_on(output, already):
    """The same command again: only what is missing is computed, and the numbers are the same."""
    asked = []
    original = cells.computed

    def counted(task, cell, **options):
        asked.append(cell)
        return original(task, cell, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cells, "computed", counted)
        resumed = run(declared(cells=CELLS), output=output)
    assert len(asked) == CELLS - already
    same_numbers(resumed, uninterrupted())
    same_numbers(rsfstudy.open("faulty", output), uninterrupted())
    assert {"faulty.cells.sqlite", "faulty.nc"} == set(os.listdir(output)) - {"faulty.png"}


def test_the_driver_is_killed(slow):
    """kill -9: what was kept is kept, and the workers it leaves behind end by themselves."""
    process, output = slow
    workers = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.wait()
    already = cells_in(output / "faulty.cells.sqlite")
    assert 0 < already < CELLS
    assert not (output / "faulty.nc").exists()
    _gone, alive = psutil.wait_procs(workers, timeout=30)
    assert not alive
    goes_on(output, already)


def test_a_worker_is_killed(slow):
    """kill -9 of a worker: the run itself goes on, and no cell is blamed."""
    process, output = slow
    workers = [
        child
        for child in psutil.Process(process.pid).children(recursive=True)
        if "spawn_main" in " ".join(child.cmdline())
    ]
    workers[0].kill()
    code, out, _said = ended(process)
    assert code == 0, out
    same_numbers(rsfstudy.open("faulty", output), uninterrupted())


@pytest.mark.parametrize("options", [["--serial"], []])
def test_ctrl_c(options, tmp_path):
    """A real SIGINT to the command and, as a terminal sends it, to its workers."""
    process = command("run", FAULTY, "--output", tmp_path, *options, **SLOW)
    until(lambda: cells_in(tmp_path / "faulty.cells.sqlite") > 0, process)
    os.killpg(process.pid, signal.SIGINT)
    code, _out, said = ended(process)
    assert code == 1
    assert "Process Dask" not in said
    assert f"of {CELLS} cells are finished and kept in" in said
    partial = rsfstudy.open(tmp_path / "faulty.partial.nc")
    done = int((partial.status == 0).sum())
    assert partial.attrs["completeness"] == f"partial: {done} of {CELLS} cells"
    assert (partial.status == int(Status.PENDING)).sum() == CELLS - done
    assert 0 < done < CELLS
    goes_on(tmp_path, done)


def commands_under(process):
    """Command lines of the processes that one has started."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return [" ".join(c.cmdline()) for c in psutil.Process(process.pid).children()]
    return []


def test_ctrl_c_while_the_workers_start(tmp_path):
    """They never see it, and the run ends in order once they are there."""
    process = command("run", FAULTY, "--output", tmp_path, **SLOW)
    until(lambda: any("spawn_main" in said for said in commands_under(process)), process)
    os.killpg(process.pid, signal.SIGINT)
    code, _out, said = ended(process)
    assert code == 1
    assert f"0 of {CELLS} cells are finished and kept in" in said
    assert len(said.strip().splitlines()) == 1, said


def test_ctrl_c_waits_until_the_workers_are_there():
    """Also where another thread gets the signal; pressed twice, it does not wait."""
    before, done = signal.signal(signal.SIGINT, signal.default_int_handler), threading.Event()
    other = threading.Thread(target=done.wait, args=(30,))
    other.start()
    reached = []

    @workers._interrupts_held()
    def pressed(times):
        for press in range(times):
            signal.pthread_kill(other.ident, signal.SIGINT)
            time.sleep(0.05)
            reached.append(press)

    for times in (1, 2):
        reached.clear()
        with pytest.raises(KeyboardInterrupt):
            pressed(times)
        assert reached == [0]
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    done.set()
    other.join()
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_in_the_middle_of_writing(tmp_path, monkeypatch):
    """The old file stays, nothing is left beside it, and no cell is computed again."""
    study = declared(cells=CELLS)
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


def killed(script, *words):
    """A script that kills itself in the middle of something."""
    process = subprocess.run([sys.executable, "-c", script, *map(str, words)], check=False)
    assert process.returncode == -signal.SIGKILL


def test_killed_in_the_middle_of_writing(tmp_path):
    """What a killed write leaves beside is not taken for a result, and goes with the next."""
    run(FAULTY, output=tmp_path, b_over_a=uninterrupted().b_over_a.values)
    script = """
import os, signal, sys, rsfstudy
os.replace = lambda *_paths: os.kill(os.getpid(), signal.SIGKILL)
rsfstudy.run(sys.argv[1], output=sys.argv[2], workers=0, progress=False, b_over_a=[2.0])
"""
    killed(script, FAULTY, tmp_path)
    assert (tmp_path / ".faulty.nc.new").exists()
    same_numbers(rsfstudy.open("faulty", tmp_path), uninterrupted())
    goes_on(tmp_path, CELLS)


def test_killed_in_the_middle_of_keeping_cells(tmp_path):
    """A transaction cut short leaves SQLite's own journal beside: the next run rolls it back."""
    study = declared(cells=CELLS)
    run(study.with_(b_over_a=[2.0, 2.5]), output=tmp_path)
    script = """
import os, signal, sqlite3, sys
database = sqlite3.connect(sys.argv[1])
database.execute("PRAGMA cache_size=1")
database.execute("BEGIN")
for i in range(20):
    row = (bytes([i]), "OK", "", 0, 0.0, bytes(100_000), 0)
    database.execute("INSERT INTO cells VALUES (?,?,?,?,?,?,?)", row)
os.kill(os.getpid(), signal.SIGKILL)
"""
    killed(script, tmp_path / "faulty.cells.sqlite")
    assert (tmp_path / "faulty.cells.sqlite-journal").exists()
    goes_on(tmp_path, 2)
    assert cells_in(tmp_path / "faulty.cells.sqlite") == CELLS


def test_fresh_leaves_no_half_transaction_behind(tmp_path):
    """SQLite would roll the old file's journal back into the new file."""
    (tmp_path / "faulty.cells.sqlite").write_bytes(b"")
    (tmp_path / "faulty.cells.sqlite-journal").write_bytes(b"what a killed run left")
    same_numbers(run(declared(cells=CELLS), output=tmp_path, fresh=True), uninterrupted())


def limited(size, *words, **environment):
    """The command where no file may grow beyond a size: writing fails as on a full disk."""
    inherited = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, inherited[1]))
    try:
        process = command(*words, **environment)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, inherited)
    return ended(process)


def test_a_full_disk_while_cells_are_computed(tmp_path):
    """The journal takes no more: the run ends with the reason, and goes on once there is room."""
    many = {"FAULT_CELLS": "6000"}
    words = ("run", FAULTY, "--serial", "--output", tmp_path)
    code, _out, said = limited(300_000, *words, **many)
    assert code == 1
    assert "cannot add to" in said
    assert "the same command goes on from there" in said
    kept = cells_in(tmp_path / "faulty.cells.sqlite")
    assert 100 < kept < 6000
    code, _out, said = ended(command(*words, **many))
    assert code == 0, said
    same_numbers(rsfstudy.open("faulty", tmp_path), run(declared(cells=6000)))


def test_a_full_disk_while_the_result_is_written(tmp_path):
    """The old result stays whole, and every cell is kept."""
    run(declared(cells=4), output=tmp_path)
    old = (tmp_path / "faulty.nc").read_bytes()
    study = declared(cells=CELLS)
    run(study, output=tmp_path)
    (tmp_path / "faulty.nc").write_bytes(old)
    words = ("run", FAULTY, "--serial", "--output", tmp_path)
    code, _out, said = limited(len(old) // 2, *words, FAULT_CELLS=str(CELLS))
    assert code == 1
    assert "Nothing was replaced" in said
    assert f"{CELLS} of {CELLS} cells are finished and kept" in said
    assert (tmp_path / "faulty.nc").read_bytes() == old
    goes_on(tmp_path, CELLS)


def test_a_longer_and_denser_axis_computes_only_new_cells(tmp_path, monkeypatch):
    first = run(output=tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["small.cells.sqlite", "small.nc"]
    asked, original = [], cells.computed

    def counted(task, cell, **options):
        asked.append(cell.scene.b_over_a)
        return original(task, cell, **options)

    monkeypatch.setattr(cells, "computed", counted)
    longer = SMALL.with_(b_over_a=[2.0, 2.25, 2.5, 3.0, 3.5])
    extended = run(longer, output=tmp_path)
    assert sorted(asked) == [2.25, 2.25, 3.5, 3.5]
    same_numbers(extended.sel(b_over_a=[2.0, 2.5, 3.0]), first)
    same_numbers(extended, run(longer))


def test_what_a_worker_has_finished_is_kept_before_its_batch_is_done(tmp_path):
    """However little its cells were expected to cost: here a batch would last 15 s."""
    process = command("run", FAULTY, "--output", tmp_path, FAULT_TAKES="0.25", FAULT_CELLS="480")
    until(lambda: cells_in(tmp_path / "faulty.cells.sqlite") > 0, process)
    began = time.monotonic()
    until(lambda: time.monotonic() - began > 3.0, process)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    kept = cells_in(tmp_path / "faulty.cells.sqlite")
    assert 8 <= kept < 60


def test_two_runs_at_a_time_are_refused(tmp_path):
    """The second is told, and the first is not disturbed."""
    process = command("run", FAULTY, "--output", tmp_path, **{**SLOW, "FAULT_TAKES": "0.2"})
    until(lambda: cells_in(tmp_path / "faulty.cells.sqlite") > 0, process)
    for fresh in (False, True):
        with pytest.raises(DataError, match=r"another run uses .*faulty\.cells\.sqlite"):
            run(declared(cells=CELLS), output=tmp_path, fresh=fresh)
    code, out, _said = ended(process)
    assert code == 0, out
    same_numbers(rsfstudy.open("faulty", tmp_path), uninterrupted())


def test_other_tolerances_are_not_mixed(tmp_path):
    run(output=tmp_path)
    with pytest.raises(DataError, match="rtol: 1e-07 there, 1e-06 now.*--fresh"):
        run(output=tmp_path, rtol=1e-6)
    fresh = run(output=tmp_path, rtol=1e-6, fresh=True)
    same_numbers(fresh, run(rtol=1e-6))


@pytest.mark.parametrize("name", ["physics", "numpy", "scipy"])
def test_other_physics_or_versions_are_not_mixed(name, tmp_path, monkeypatch):
    from rsfstudy import provenance

    run(output=tmp_path)
    other = {**provenance.code(), name: "other"}
    monkeypatch.setattr(provenance, "code", lambda: other)
    with pytest.raises(DataError, match=f"{name}: .* there, other now"):
        run(output=tmp_path)


def test_failures_are_tried_again(tmp_path, monkeypatch):
    """A cell that failed has no answer: the next run computes it, and only it."""
    failing = declared("raises", at=(2.5,))
    assert run(failing, output=tmp_path).status.values.tolist() == [0, Status.CELL_RAISED, 0, 0]
    assert cells_in(tmp_path / "faulty.cells.sqlite") == 4
    asked = []
    original = cells.computed

    def counted(task, cell, **options):
        asked.append(cell.scene.b_over_a)
        return original(task, cell, **options)

    monkeypatch.setattr(cells, "computed", counted)
    run(failing, output=tmp_path)
    assert asked == [2.5]
