"""Running: the same numbers everywhere, faults stay in their cells, nothing finished is lost."""

import contextlib
import os
import signal
import sqlite3
import subprocess
import sys
import textwrap
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import rsfstudy
from rsfstudy import Axis, Scene, Study, runner, workers
from rsfstudy.core.accuracy import Accuracy
from rsfstudy.errors import DataError, InvalidValue, RunError
from rsfstudy.measures import Measure, Outcome
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.status import Status

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
#: What may differ between two runs of the same lattice.
PASSING = ["wall_time"]


def run(study=SMALL, **options) -> xr.Dataset:
    return rsfstudy.run(study, **{"workers": 0, "output": None, "progress": False, **options})


@pytest.fixture(scope="module")
def cluster():
    with workers.local_cluster(2) as client:
        yield client


def same_numbers(ours: xr.Dataset, theirs: xr.Dataset) -> None:
    xr.testing.assert_identical(
        ours.drop_vars(PASSING).drop_attrs(), theirs.drop_vars(PASSING).drop_attrs()
    )


def test_serial_workers_and_any_grouping_give_identical_bits(cluster, monkeypatch):
    serial = run()
    same_numbers(run(client=cluster), serial)
    for size in (1, 4, 100):
        monkeypatch.setattr(runner, "_batch_size", lambda *_args, size=size: size)
        same_numbers(run(client=cluster), serial)
        same_numbers(run(), serial)


def test_equal_scenes_are_computed_once():
    """phi means nothing at constant normal stress: the cells along it are one scene."""
    doubled = SMALL.with_(phi=[55.0, 60.0], b_over_a=[2.0])
    dataset = run(doubled)
    assert dataset.sizes == {"phi": 2, "case": 2, "b_over_a": 1}
    constant = dataset.sel(case="constant")
    assert constant.wall_time[0].item() == constant.wall_time[1].item()
    assert dataset.sel(case="variable").critical_velocity_ratio.diff("phi").item() != 0.0


def test_a_plain_axis_bears_its_values_even_where_some_cells_have_no_use_for_them():
    dataset = run(SMALL.with_(phi=[55.0, 60.0], b_over_a=[2.0]))
    assert dataset.phi.values.tolist() == [55.0, 60.0]


def test_values_that_do_not_apply_are_nan_coordinates():
    assert np.isnan(run().alpha.sel(case="constant"))
    assert run().alpha.sel(case="variable").item() == 0.56


@dataclass(frozen=True)
class Profile(Measure):
    """A measure with an inner dimension."""

    name = "profile"
    headline = "total"
    typical_work = 1

    @property
    def variables(self):
        return {"total": (), "curve": ("phase",)}

    @property
    def inner_coordinates(self):
        return {"phase": np.linspace(0.0, 1.0, 4)}

    def find(self, scene, accuracy, meter):
        return Outcome(Status.OK, {"total": scene.b_over_a, "curve": scene.b_over_a * np.arange(4)})


def test_numbers_along_an_inner_dimension():
    dataset = run(Study(name="s", title="t", base=Scene(), axes=SMALL.axes, measure=Profile()))
    assert dataset.curve.dims == ("case", "b_over_a", "phase")
    np.testing.assert_array_equal(dataset.curve.isel(case=0, b_over_a=2), 3.0 * np.arange(4))


def faulty(fault, at=2.5):
    """A study whose measure fails, in its own way, in the cells of one b/a."""

    @dataclass(frozen=True)
    class Faulty(Measure):
        name = "faulty"
        headline = "total"
        variables = {"total": ()}  # noqa: RUF012
        typical_work = 1

        def find(self, scene, accuracy, meter):
            if scene.b_over_a == at:
                return fault(meter)
            return Outcome(Status.OK, {"total": scene.b_over_a})

    axes = [Axis("b_over_a", [2.0, 2.5, 3.0, 3.5])]
    return Study(name="faulty", title="t", base=Scene(), axes=axes, measure=Faulty())


def raises(_meter):
    raise ZeroDivisionError("in the cell")


def spends(meter):
    meter.charge("any", 10**9)


def dies(_meter):
    os._exit(1)


def test_an_exception_stays_in_its_cell():
    dataset = run(faulty(raises))
    assert dataset.status.values.tolist() == [0, Status.CELL_RAISED, 0, 0]
    assert dataset.message.values[1] == "ZeroDivisionError: in the cell"
    assert np.isnan(dataset.total[1])


def test_a_spent_budget_stays_in_its_cell():
    dataset = run(faulty(spends))
    assert dataset.status.values.tolist() == [0, Status.WORK_BUDGET_SPENT, 0, 0]


def test_a_dead_worker_is_blamed_on_its_own_cell(monkeypatch):
    """One batch holds the killer and its neighbours: only the killer is recorded."""
    monkeypatch.setattr(runner, "_batch_size", lambda *_args: 4)
    dataset = run(faulty(dies), workers=2)
    assert dataset.status.values.tolist() == [0, Status.WORKER_LOST, 0, 0]
    assert "KilledWorker" in dataset.message.values[1]
    np.testing.assert_array_equal(dataset.total.values, [2.0, np.nan, 3.0, 3.5])


def test_bad_cells_are_refused_before_any_work(tmp_path):
    def mapper(*_args):
        raise AssertionError("work has started")

    bad = SMALL.with_(phi=[30.0, 60.0])
    with pytest.raises(InvalidValue, match="phi=30.0"):
        runner.run(bad, mapper, output=tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_run_is_kept_and_only_new_cells_are_computed(tmp_path):
    first = run(output=tmp_path)
    assert sorted(os.listdir(tmp_path)) == ["small.cells.sqlite", "small.nc"]
    asked = []

    def mapper(measure, accuracy, batches):
        asked.extend(scene.b_over_a for batch in batches for scene in batch)
        return workers.serial(measure, accuracy, batches)

    longer = SMALL.with_(b_over_a=[2.0, 2.25, 2.5, 3.0])
    extended = runner.run(longer, mapper, output=tmp_path)
    assert asked == [2.25, 2.25]
    same_numbers(extended.sel(b_over_a=[2.0, 2.5, 3.0]), first)
    same_numbers(extended, run(longer))


def test_other_tolerances_are_not_mixed(tmp_path):
    run(output=tmp_path)
    with pytest.raises(DataError, match="rtol: 1e-07 there, 1e-06 now"):
        run(output=tmp_path, rtol=1e-6)
    fresh = run(output=tmp_path, rtol=1e-6, fresh=True)
    same_numbers(fresh, run(rtol=1e-6))


def test_an_interrupted_run_is_kept_and_goes_on(tmp_path):
    def interrupted(measure, accuracy, batches):
        yield from list(workers.serial(measure, accuracy, batches))[:2]
        raise KeyboardInterrupt

    with pytest.raises(RunError, match=r"2 of 6 cells are finished and kept in .*small.partial.nc"):
        runner.run(SMALL, interrupted, output=tmp_path, workers=6)
    partial = rsfstudy.open(tmp_path / "small.partial.nc")
    assert partial.attrs["completeness"] == "partial: 2 of 6 cells"
    assert (partial.status == int(Status.PENDING)).sum() == 4
    assert not (tmp_path / "small.nc").exists()
    same_numbers(run(output=tmp_path), run())
    assert sorted(os.listdir(tmp_path)) == ["small.cells.sqlite", "small.nc"]


LONG = ["rate_step_boundary", "--set", "b_over_a=1.3:6:120"]


def cells_in(journal: Path) -> int:
    """Number of cells another process has kept so far."""
    try:
        with contextlib.closing(sqlite3.connect(f"file:{journal}?mode=ro", uri=True)) as db:
            return int(db.execute("SELECT count(*) FROM cells").fetchone()[0])
    except sqlite3.Error:
        return 0


@pytest.mark.parametrize("options", [[*LONG, "--serial"], LONG])
def test_ctrl_c_ends_in_a_message_and_the_same_command_goes_on(options, tmp_path):
    """A real SIGINT to the real command and, as a terminal sends it, to its workers."""
    command = [sys.executable, "-m", "rsfstudy.cli", "run", *options, "--output", str(tmp_path)]
    journal = tmp_path / "rate_step_boundary.cells.sqlite"
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while process.poll() is None and not cells_in(journal):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _out, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "Traceback" not in said
    assert "Process Dask" not in said
    assert "of 360 cells are finished and kept" in " ".join(said.split())
    partial = rsfstudy.open(tmp_path / "rate_step_boundary.partial.nc")
    done = int((partial.status == 0).sum())
    assert 0 < done < 360
    assert np.isnan(partial.zeta).any()
    again = subprocess.run(command, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    resumed = rsfstudy.open("rate_step_boundary", tmp_path)
    fresh = rsfstudy.run(
        "rate_step_boundary",
        workers=2,
        output=None,
        progress=False,
        b_over_a=np.linspace(1.3, 6, 120),
    )
    same_numbers(resumed, fresh)


def test_a_script_needs_no_guard(tmp_path):
    """Workers do not import the script that starts them, and a measure defined in it reaches them
    all the same.
    """
    script = tmp_path / "script.py"
    script.write_text(
        textwrap.dedent("""
            print("imported")
            from dataclasses import dataclass
            import rsfstudy
            from rsfstudy.measures import Measure, Outcome
            from rsfstudy.status import Status

            @dataclass(frozen=True)
            class Own(Measure):
                name = "own"
                headline = "total"
                variables = {"total": ()}
                typical_work = 1

                def find(self, scene, accuracy, meter):
                    return Outcome(Status.OK, {"total": scene.b_over_a})

            study = rsfstudy.Study(
                name="own", title="Own", base=rsfstudy.Scene(), measure=Own(),
                axes=[rsfstudy.Axis("b_over_a", [2, 3])],
            )
            print(rsfstudy.run(study, output=None, progress=False).total.values)
        """)
    )
    ran = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=120
    )
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.split("\n")[:2] == ["imported", "[2. 3.]"]


def test_a_scheduler_that_does_not_answer_is_named():
    with (
        pytest.raises(RunError, match="no Dask scheduler answers at tcp://127.0.0.1:1"),
        workers.existing_cluster("tcp://127.0.0.1:1", timeout=1),
    ):
        pass


def test_an_existing_scheduler_is_used(tmp_path):
    """Scheduler and workers started as processes of their own."""
    file = tmp_path / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    base = [sys.executable, "-m", "dask"]
    scheduler = subprocess.Popen(
        [*base, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)],
        **quiet,
    )
    worker = subprocess.Popen(
        [*base, "worker", "--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard"],
        **quiet,
        cwd=tmp_path,
    )
    try:
        for _ in range(200):
            if file.exists() and file.stat().st_size:
                break
            time.sleep(0.1)
        import json

        address = json.loads(file.read_text())["address"]
        with workers.existing_cluster(address) as client:
            same_numbers(run(client=client), run())
    finally:
        worker.terminate()
        scheduler.terminate()
        worker.wait(30)
        scheduler.wait(30)


def test_results_say_where_they_come_from():
    attrs = run().attrs
    for name in ("title", "source", "history", "references", "Conventions", "provenance"):
        assert attrs[name]
    assert attrs["completeness"] == "complete"
    assert '"scipy"' in attrs["provenance"]
    assert Path(rsfstudy.__file__).exists()


def test_accuracy_reaches_the_cells():
    loose, tight = run(rtol=1e-4), run(rtol=1e-9)
    assert (loose.rhs_evaluations < tight.rhs_evaluations).all()
    assert Accuracy().rtol == 1e-7
