"""Tests of the estimated time of a run, and of the progress of fits."""

import io
import math

import numpy as np
import pytest
from study_runs import run

from rsfstudy import Axis, Scene, Study
from rsfstudy.api import progress
from rsfstudy.execution.cell_plan import order_cells_by_golden_section
from rsfstudy.execution.remaining_time_estimate import RemainingTimeEstimator
from rsfstudy.measures import LinearStability

Y, X = np.meshgrid(np.linspace(0.0, 1.0, 200), np.linspace(0.0, 1.0, 200), indexing="ij")
#: Times of the cells of maps: constant, rising over two decades, slow close to a boundary, and slow
#: in a corner.
MAPS = {
    "constant": np.full(X.shape, 0.01),
    "rising": 1e-3 * 100.0**X,
    "boundary": 1e-3 / (0.01 + np.abs(Y - 0.3 - 0.4 * X)),
    "corner": np.where((X > 0.8) & (Y > 0.7), 0.2, 0.002),
}


@pytest.mark.parametrize("name", MAPS)
@pytest.mark.parametrize("workers", [1, 2])
def test_the_estimate_is_correct_to_a_factor_of_two(name, workers):
    times = MAPS[name].ravel()[order_cells_by_golden_section(np.arange(MAPS[name].size))]
    estimate = RemainingTimeEstimator(workers)
    for done, seconds in enumerate(times.tolist(), start=1):
        estimate.record_cell_time(seconds)
        remaining = estimate.estimate_remaining_seconds(times.size - done)
        if remaining is not None:
            break
    assert done < 0.02 * times.size
    assert 0.5 < remaining / (times[done:].sum() / workers) < 2.0


def test_there_is_no_estimate_from_few_or_different_times():
    estimate = RemainingTimeEstimator(1)
    for seconds in (math.nan, *[1.0] * 11):
        assert estimate.estimate_remaining_seconds(100) is None
        estimate.record_cell_time(seconds)
    assert estimate.estimate_remaining_seconds(100) is None
    estimate.record_cell_time(1.0)
    assert estimate.estimate_remaining_seconds(100) == pytest.approx(100.0)
    estimate.record_cell_time(1000.0)
    assert estimate.estimate_remaining_seconds(100) is None


def lines(updates, monkeypatch, **options):
    """Return the progress lines for a list of times, counts and remaining times."""
    stream, clock = io.StringIO(), iter([0.0, *[time for time, *_update in updates]])
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with progress.show_progress("map", True, **options) as update:
        for _time, done, remaining in updates:
            update(done, 1000, remaining)
    return stream.getvalue().splitlines()


def test_the_estimate_is_printed_once(monkeypatch):
    updates = [(0.0, 0, None), (1.0, 10, None), (2.0, 20, 98.0), (3.0, 30, 97.0), (30.0, 300, 70.0)]
    assert lines([*updates, (100.0, 1000, 0.0)], monkeypatch) == [
        "map: 20 of 1,000 cells are finished, about 1 min 38 s left",
        "map: 300 of 1,000 cells after 30 s, about 1 min 10 s left",
        "map: 1,000 of 1,000 cells after 100 s",
    ]


def test_short_fits_show_no_progress(monkeypatch):
    short, long = ([(0.0, 0, None), (time, 1000, 0.0)] for time in (19.0, 21.0))
    assert lines(short, monkeypatch, item_name="fits", delay_seconds=20.0) == []
    assert lines(long, monkeypatch, item_name="fits", delay_seconds=20.0) == [
        "map: 1,000 of 1,000 fits after 21 s"
    ]


def test_a_run_reports_its_remaining_time(monkeypatch):
    """The run passes the measured time to the progress report."""
    seen = []

    def record(_name, _is_shown, **_appearance):
        import contextlib

        return contextlib.nullcontext(lambda *update: seen.append(update))

    monkeypatch.setattr("rsfstudy.api.study_runs.show_progress", record)
    axis = Axis("b_over_a", np.linspace(1.5, 3.0, 400))
    measure = LinearStability()
    run(Study(name="mine", title="Stiffness", base=Scene(), axes=[axis], measure=measure))
    assert seen[0] == (0, 400, None)
    assert seen[-1][:2] == (400, 400)
    assert seen[-1][2] in (None, 0.0)
    assert all(left is None or left > 0.0 for done, _total, left in seen if done < 400)
