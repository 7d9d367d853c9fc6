"""Tests of the detection of velocity steps in records."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import synthetic_records as synthetic
from scipy.signal import lfilter

import rsfstudy
from rsfstudy.fitting.recorded_loading import build_stepwise_loading_history
from rsfstudy.fitting.velocity_steps import detect_velocity_steps

UP = ((0.0, 1.0), (60.0, 10.0))
MANY = ((0.0, 1.0), (60.0, 10.0), (70.0, 1.0), (130.0, 0.0), (200.0, 1.0), (260.0, 3.0))


#: Times in s of the velocity steps of the record with holds in the documentation.
STEPS_OF_HOLDS = (60.0, 70.0, 130.0, 160.0, 220.0, 320.0, 380.0, 680.0, 740.0, 1740.0)


def two_intervals(
    interval: float, ratio: float, velocity_ratio: float, offset: float, ramp: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return row times, displacements and step times of a record with two sampling intervals.

    Both the velocity and the sampling interval change at each of four steps. The third step lasts
    ``ramp`` seconds. The rows are ``offset`` intervals late.
    """
    apart = np.array([1.0, ratio, 1.0, ratio, 1.0]) * interval
    rows = (300, 210, 400, 300, 300)
    ends = np.cumsum(apart * rows)
    time = np.concatenate(
        [end - gap * np.arange(n, 0, -1) for end, gap, n in zip(ends, apart, rows, strict=True)]
    )
    time, steps = time + offset * apart.min(), ends[:-1]
    moved = 1.0 * time
    for n, step in enumerate(steps):
        lasts = ramp if n == 2 and ramp else 1e-12
        since = np.clip(time - step + 0.5 * ramp * (n == 2), 0.0, None)
        eased = np.where(since < lasts, since**2 / (2.0 * lasts), since - 0.5 * lasts)
        moved += (velocity_ratio - 1.0) * (-1.0) ** n * eased
    return time, moved, steps


def standard_error_of_step(
    time: np.ndarray, start: float, step: float, end: float, sigma: float
) -> float:
    """Return the standard error of the intersection of two lines with a velocity change of 1."""
    variance = 0.0
    for part in (
        time[(time >= start) & (time <= step)],
        time[(time >= step) & (time <= end)],
    ):
        variance += 1.0 / len(part) + (step - part.mean()) ** 2 / np.sum((part - part.mean()) ** 2)
    return float(sigma * np.sqrt(variance))


def noisy(
    loading: Sequence[tuple[float, float]], ends: float, apart: float, rho: float, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return times in s and noisy displacements of a load point in um."""
    time = np.arange(0.0, ends, apart) + 0.3 * apart
    moved = synthetic.load_point_displacement(loading, time)
    return time, moved + synthetic.correlated_noise(len(time), rho, size, seed=7)


@pytest.mark.parametrize("loading", [UP, MANY, ((0.0, 10.0), (20.0, 1.0)), ((0, 3.0), (40, 0.0))])
@pytest.mark.parametrize(("rho", "size"), [(0.0, 0.0), (0.0, 0.02), (0.9, 0.05)])
def test_steps_are_found(loading: Sequence[tuple[float, float]], rho: float, size: float) -> None:
    ends = loading[-1][0] + 60.0
    found = detect_velocity_steps(*noisy(loading, ends, 0.05, rho, size))
    assert len(found) == len(loading) - 1
    for step, (one, other) in zip(found, itertools.pairwise(loading), strict=True):
        # With this noise, lines through hundreds of rows intersect within about two rows of the
        # step.
        assert step.start == pytest.approx(other[0], abs=1e-6 if not size else 0.15)
        assert step.end == step.start
        assert step.velocity_before == pytest.approx(one[1], rel=0.03)
        assert step.velocity_after == pytest.approx(other[1], rel=0.03)


@pytest.mark.parametrize("rho", [0.0, 0.9, 0.99])
def test_none_is_invented(rho: float) -> None:
    for seed in range(34):
        time = 0.1 * np.arange(2_000.0)
        moved = 3.0 * time + synthetic.correlated_noise(2_000, rho, 0.3, seed)
        assert detect_velocity_steps(time, moved) == ()


def test_a_ramp_over_samples_is_a_ramp() -> None:
    time = 0.01 * np.arange(12_000.0)
    speed = np.interp(time, [60.0, 60.24, 60.3], [1.0, 2.0, 10.0])
    moved = np.concatenate([[0.0], np.cumsum(0.01 * speed[:-1])])
    (step,) = detect_velocity_steps(
        time, moved + synthetic.correlated_noise(len(time), 0.0, 1e-3, 1)
    )
    assert (step.velocity_before, step.velocity_after) == pytest.approx((1.0, 10.0), rel=0.01)
    assert 59.9 < step.start < step.end < 60.5
    # The displacement after the ramp is correct, because the lines before and after it intersect
    # in its middle.
    meet = (moved[-1] - 10.0 * time[-1]) / (1.0 - 10.0)
    assert 0.5 * (step.start + step.end) == pytest.approx(meet, abs=1e-3)


def test_sparse_and_dense_parts_of_a_record() -> None:
    time = np.concatenate([np.arange(0.0, 59.0, 0.1), np.arange(59.0, 75.0, 0.01)])
    moved = synthetic.load_point_displacement(UP, time) + synthetic.correlated_noise(
        len(time), 0.5, 0.01, 2
    )
    (step,) = detect_velocity_steps(time, moved)
    assert step.start == pytest.approx(60.0, abs=0.02)
    assert (step.velocity_before, step.velocity_after) == pytest.approx((1.0, 10.0), rel=0.01)


def test_a_million_rows() -> None:
    time = 0.001 * np.arange(1_000_000.0)
    loading = ((0.0, 1.0), (400.0, 10.0), (500.0, 0.0), (700.0, 1.0))
    moved = synthetic.load_point_displacement(loading, time)
    moved += np.random.default_rng(8).normal(size=len(time)) * 0.02
    found = detect_velocity_steps(time, moved)
    assert [step.start for step in found] == pytest.approx([400.0, 500.0, 700.0], abs=0.01)
    assert [step.velocity_after for step in found] == pytest.approx([10.0, 0.0, 1.0], rel=1e-3)


@pytest.mark.parametrize("moved", [np.zeros(100), np.arange(100.0), -np.arange(100.0)])
def test_a_load_point_that_rests_or_keeps_moving(moved: np.ndarray) -> None:
    assert detect_velocity_steps(np.arange(100.0), moved) == ()


def test_an_overshoot_is_one_step_through_its_pieces() -> None:
    """An overshoot belongs to a single step with a velocity profile.

    The velocity changes from 2 to 12 um/s via 17 um/s within half a second.
    """
    time = 0.05 * np.arange(4_000)
    speeds = np.interp(time, [80.0, 80.15, 80.2, 80.45, 80.5], [2.0, 2.0, 17.0, 17.0, 12.0])
    moved = np.concatenate([[0.0], np.cumsum(0.05 * speeds[:-1])])
    (step,) = detect_velocity_steps(
        time, moved + synthetic.correlated_noise(len(time), 0.0, 0.01, 3)
    )
    assert (step.velocity_before, step.velocity_after) == pytest.approx((2.0, 12.0), rel=0.01)
    assert 79.8 < step.start < step.end < 80.7
    assert max(speed for _begins, speed in step.velocity_profile) > 14.0
    # The pieces of the loading reproduce the recorded displacement.
    pieces = build_stepwise_loading_history(0.0, [step])
    speeds_of = pieces[:, 1]
    by_pieces = np.sum(np.diff(np.append(pieces[:, 0], time[-1])) * speeds_of)
    assert by_pieces == pytest.approx(moved[-1], abs=0.2)


def test_a_hold_and_a_return_are_no_overshoot() -> None:
    loading = ((0.0, 1.0), (60.0, 10.0), (61.0, 1.0), (120.0, 0.0), (121.0, 2.0))
    time, moved = noisy(loading, 200.0, 0.05, 0.0, 0.001)
    assert [step.velocity_profile for step in detect_velocity_steps(time, moved)] == [()] * 4


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_noise_that_grows_is_no_step(rho: float) -> None:
    time, moved = noisy(((0.0, 2.0), (150.0, 20.0)), 300.0, 0.1, 0.0, 0.0)
    for seed in range(5):
        size = np.interp(time, [0.0, 290.0, 292.0, 300.0], [0.02, 0.02, 1.3, 8.5])
        (step,) = detect_velocity_steps(
            time, moved + size * synthetic.correlated_noise(len(time), rho, 1.0, seed)
        )
        assert step.start == pytest.approx(150.0, abs=0.1)
        assert (step.velocity_before, step.velocity_after) == pytest.approx((2.0, 20.0), rel=0.01)


@pytest.mark.parametrize("ratio", [0.01, 0.1, 1.0 / 3.0, 1.0, 3.0, 10.0, 100.0])
@pytest.mark.parametrize(
    ("sigma", "quantum"), [(0.0, 0.0), (0.0, 1e-3), (0.02, 0.0), (0.1, 0.0), (0.02, 0.01)]
)
def test_sudden_steps_where_the_sampling_interval_changes(
    ratio: float, sigma: float, quantum: float
) -> None:
    cases = 0
    for interval, velocity_ratio, offset in itertools.product(
        (1.0, 0.1), (0.1, 3.0, 10.0, 50.0), (0.0, 0.37)
    ):
        time, moved, steps = two_intervals(interval, ratio, velocity_ratio, offset)
        bounds, change = np.array([time[0], *steps, time[-1]]), abs(velocity_ratio - 1.0)
        error = max(sigma, quantum)
        if change * np.diff(bounds).min() < 100.0 * error:
            continue
        cases += 1
        moved = moved + np.random.default_rng(cases).normal(scale=sigma, size=len(time))
        if quantum:
            moved = np.round(moved / quantum) * quantum
        found = detect_velocity_steps(time, moved)
        assert [step.end - step.start for step in found] == [0.0] * 4
        for n, step in enumerate(found):
            expected = standard_error_of_step(time, *bounds[n : n + 3], error) / change
            assert step.start == pytest.approx(
                steps[n], abs=4.5 * expected + 1e-7 * time[-1] + quantum / change
            )
    assert cases > 3


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_sudden_steps_with_correlated_jitter(rho: float) -> None:
    for seed, ratio, velocity_ratio in itertools.product(range(3), (0.1, 10.0), (3.0, 10.0)):
        time, moved, steps = two_intervals(1.0, ratio, velocity_ratio, 0.0)
        noise = np.random.default_rng(seed).normal(size=len(time)) * np.sqrt(1.0 - rho**2)
        found = detect_velocity_steps(time, moved + 0.1 * lfilter([1.0], [1.0, -rho], noise))
        assert [step.end - step.start for step in found] == [0.0] * 4
        assert [step.start for step in found] == pytest.approx(steps, abs=0.5)


@pytest.mark.parametrize("ratio", [0.1, 1.0 / 3.0, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_a_ramp_where_the_sampling_interval_changes(ratio: float, sigma: float) -> None:
    for velocity_ratio, rows, shift in itertools.product((10.0, 3.0, 0.1), (10, 12), (-0.5, 0.5)):
        lasts = rows * min(ratio, 1.0)
        time, moved, steps = two_intervals(1.0, ratio, velocity_ratio, 0.0, lasts)
        # The ramp is in the middle of rows with different intervals if it is not shifted.
        inside = np.sum(np.abs(time - steps[2]) < 0.5 * lasts)
        noise = np.random.default_rng(rows).normal(scale=sigma, size=len(time))
        found = detect_velocity_steps(time + shift, moved + noise)
        assert len(found) == 4
        sudden = [n for n, step in enumerate(found) if step.end == step.start]
        assert sudden == [0, 1, 3]
        assert inside > 4
        assert 0.4 * lasts < found[2].end - found[2].start < 1.6 * lasts
        assert found[2].middle_time == pytest.approx(steps[2] + shift, abs=0.1 * lasts)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("sigma", [0.0, 0.02])
def test_sudden_steps_in_a_long_record(ratio: float, sigma: float) -> None:
    intervals = np.repeat([0.01, 0.01 * ratio, 0.01, 0.01 * ratio, 0.01], 9_000)
    time = np.concatenate([[0.0], np.cumsum(intervals[:-1])])
    loading = [(time[9_000 * n] + 0.004, speed) for n, speed in enumerate((1, 10, 1, 5, 0))]
    moved = synthetic.load_point_displacement([(0.0, 1.0), *loading[1:]], time)
    moved += np.random.default_rng(1).normal(scale=sigma, size=len(time))
    found = detect_velocity_steps(time, moved)
    assert [step.end - step.start for step in found] == [0.0] * 4
    assert [step.start for step in found] == pytest.approx(
        [start for start, _speed in loading[1:]], abs=0.005 if sigma else 1e-6
    )


def test_steps_of_the_record_with_holds() -> None:
    record = rsfstudy.read_record(Path(__file__).parent.parent / "studies/pages/holds.csv")
    found = record.loading_steps
    assert [step.end - step.start for step in found] == [0.0] * 10
    assert [step.start for step in found] == pytest.approx(STEPS_OF_HOLDS, abs=0.01)
    fit = rsfstudy.fit(record, laws=["slowness"], stiffness="from record", steps=[9])
    assert fit.status.item() == 0
    assert fit.a.item() == pytest.approx(0.010, abs=4.0 * fit.a_stderr.item())
    assert fit.b.item() == pytest.approx(0.012, abs=4.0 * fit.b_stderr.item())
    assert fit.slip_distance.item() == pytest.approx(
        15.0, abs=4.0 * fit.slip_distance_stderr.item()
    )
