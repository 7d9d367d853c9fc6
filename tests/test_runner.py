"""Tests of runs in this process and on workers, with any grouping of cells."""

import contextlib
import os
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from faulty_study import faulty_study
from study_runs import HANG_TIMEOUT, SMALL_STUDY, USER_MEASURE_SOURCE, have_same_numbers, run

from rsfstudy import Scene, Study
from rsfstudy.api import study_runs
from rsfstudy.errors import InvalidValue, RunError
from rsfstudy.execution import cell_plan, study_run, worker_pool
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.status import Status


def test_serial_workers_and_any_grouping_give_identical_bits(cluster, monkeypatch):
    serial = run()
    have_same_numbers(run(client=cluster), serial)
    for size in (1, 4, 100):
        monkeypatch.setattr(
            cell_plan.CellBatchIterator, "compute_next_batch_size", lambda _self, size=size: size
        )
        have_same_numbers(run(client=cluster), serial)
        have_same_numbers(run(), serial)


def test_equal_scenes_are_computed_once():
    """Cells with equal scenes are computed once.

    The angle phi is not applicable at constant normal stress.
    """
    doubled = SMALL_STUDY.with_(phi=[55.0, 60.0], b_over_a=[2.0])
    dataset = run(doubled)
    assert dataset.sizes == {"phi": 2, "case": 2, "b_over_a": 1}
    constant = dataset.sel(case="constant")
    assert constant.wall_time[0].item() == constant.wall_time[1].item()
    assert dataset.sel(case="variable").critical_velocity_ratio.diff("phi").item() != 0.0


@dataclass(frozen=True)
class Profile(Measure):
    """Measure with an inner dimension."""

    name = "profile"
    primary_output = "total"
    typical_rhs_evaluations = 1

    @property
    def variables(self):
        return {"total": (), "curve": ("phase",)}

    @property
    def output_coordinates(self):
        return {"phase": np.linspace(0.0, 1.0, 4)}

    def compute(self, scene, integrator):
        return Outcome(Status.OK, {"total": scene.b_over_a, "curve": scene.b_over_a * np.arange(4)})


def test_numbers_along_an_inner_dimension():
    dataset = run(
        Study(name="s", title="t", base=Scene(), axes=SMALL_STUDY.axes, measure=Profile())
    )
    assert dataset.curve.dims == ("case", "b_over_a", "phase")
    np.testing.assert_array_equal(dataset.curve.isel(case=0, b_over_a=2), 3.0 * np.arange(4))


def test_bad_cells_are_refused_before_any_work(tmp_path):
    bad = SMALL_STUDY.with_(phi=[30.0, 60.0])
    with pytest.raises(InvalidValue, match="phi=30.0"):
        run(bad, output=tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_measure_of_a_script_reaches_the_workers(tmp_path):
    script = tmp_path / "script.py"
    runs = "rsfstudy.run(study, workers=1, output=None, progress=False, power=1)"
    guarded = f"if __name__ == '__main__':\n    print({runs}.total.values)"
    script.write_text(f"import rsfstudy\n{USER_MEASURE_SOURCE}\n{guarded}")
    ran = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        check=False,
        timeout=HANG_TIMEOUT,
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout == "[[2. 3.]]\n"


UNGUARDED = f"""
import rsfstudy
{USER_MEASURE_SOURCE}
def main():
    print(rsfstudy.run(study, workers=1, output=None, progress=False).total.values)

"""


@pytest.mark.parametrize("call", ["main()", "for _ in range(1):\n    main()"])
def test_a_script_that_workers_would_run_again_is_told_what_to_write(call, tmp_path):
    """A script without a main guard raises an error before workers start."""
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED + call)
    words = [sys.executable, str(script)]
    ran = subprocess.run(words, capture_output=True, text=True, check=False, timeout=HANG_TIMEOUT)
    line = len(script.read_text().splitlines())
    assert ran.returncode == 1
    assert f"cannot be used at line {line} of script.py, because each worker process" in ran.stderr
    assert 'below `if __name__ == "__main__":`' in ran.stderr
    assert ran.stderr.count("Traceback") == 1


def test_code_that_workers_do_not_import_needs_no_guard():
    words = [sys.executable, "-c", UNGUARDED + "main()"]
    ran = subprocess.run(words, capture_output=True, text=True, check=False, timeout=HANG_TIMEOUT)
    assert (ran.returncode, ran.stdout.splitlines()[-1:]) == (0, [" [4. 9.]]"]), ran.stderr


LOSES_TRACKER = """
import pathlib, sys
import psutil
from rsfstudy.execution import dask_clusters

if __name__ == "__main__":
    with dask_clusters.start_local_cluster(1, pathlib.Path(sys.argv[1])) as client:
        for child in psutil.Process().children():
            if "resource_tracker" in " ".join(child.cmdline()):
                child.kill()
                print("killed")
        print(client.submit(abs, -1).result())
"""


def test_a_lost_resource_tracker_causes_no_traceback(tmp_path):
    """A lost resource tracker causes no traceback.

    Python starts a new resource tracker, which does not know the semaphores of the lost
    tracker.
    """
    script = tmp_path / "script.py"
    script.write_text(LOSES_TRACKER)
    words = [sys.executable, str(script), str(tmp_path / "workers.log")]
    ran = subprocess.run(words, capture_output=True, text=True, check=False, timeout=HANG_TIMEOUT)
    assert (ran.returncode, ran.stdout) == (0, "killed\n1\n"), ran.stderr
    assert "Traceback" not in ran.stderr


def test_accuracy_reaches_the_cells():
    loose, tight = run(rtol=1e-4), run(rtol=1e-9)
    assert (loose.rhs_evaluations < tight.rhs_evaluations).all()
    assert Accuracy().rtol == 1e-7


def test_runs_share_processes_that_are_started_once(monkeypatch, tmp_path):
    """Several runs share worker processes.

    The processes start with the first cell, and a worker that dies is restarted.
    """
    started, start = [], worker_pool.start_local_cluster
    monkeypatch.setattr(
        worker_pool,
        "start_local_cluster",
        lambda n, file: (started.append(file), start(n, file))[1],
    )
    with worker_pool.WorkerPool(1, log_path=tmp_path / "workers.log") as where:

        def ran(name, fault=""):
            study = replace(faulty_study(fault, (3.0,) if fault else ()), name=name)
            results = study_runs.make_run_function_with_progress(
                study, study_run.OutputOptions(output=tmp_path), where, False
            )()
            return [Status(code).name for code in results["status"].values]

        assert not started
        assert ran("one") == 4 * ["OK"]
        assert ran("one") == 4 * ["OK"]  # The cells are read from the journal.
        ended, failed = (
            pytest.warns(match=text)
            for text in ("a worker process ended unexpectedly", "cell .* failed")
        )
        with ended, failed:
            assert ran("two", "dies") == ["OK", "OK", "WORKER_LOST", "OK"]
        assert ran("three") == 4 * ["OK"]
        assert len(started) == 1


def test_processes_that_are_lost_are_started_anew(monkeypatch, tmp_path):
    """Lost worker processes are started again for the next run.

    In this test, the cells are computed in the same process.
    """
    started, lost = [], [True]

    def mapper(cell_settings, batches):
        if lost:
            raise RunError("the connection to the Dask scheduler is lost")
        yield from worker_pool.compute_cell_batches_serially(cell_settings, batches)

    def start(_processes, file):
        started.append(file)
        return contextlib.nullcontext()

    monkeypatch.setattr(worker_pool, "start_local_cluster", start)
    monkeypatch.setattr(worker_pool, "make_dask_batch_mapper", lambda *_where: mapper)
    with worker_pool.WorkerPool(1, log_path=tmp_path / "workers.log") as where:
        begin = study_runs.make_run_function_with_progress(
            faulty_study(), study_run.OutputOptions(output=tmp_path), where, False
        )
        with pytest.raises(RunError, match="is lost"):
            begin()
        lost.clear()
        assert (begin()["status"] == int(Status.OK)).all()
        assert len(started) == 2
