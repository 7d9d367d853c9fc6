"""Tests of friction that was averaged or filtered before the recording."""

from __future__ import annotations

import math

import numpy as np
import pytest
import synthetic_records as synthetic
from synthetic_records import EXACT_PARAMETERS, FIT_OPTIONS

import rsfstudy
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.filters import FILTER_KINDS, LOW_PASS_ORDERS, Filter
from rsfstudy.fitting.noise_correlation_from_averaging import (
    NoiseCorrelationFromAveraging,
    apply_running_mean,
)
from rsfstudy.status import Status

LOADING = ((0.0, 1.0), (40.07, 10.0))
LAW = {"noise": "ar", "laws": ["slowness"]}


def filtered(text: str, size: float, seed: int) -> rsfstudy.Record:
    """Return a record at 12.5 Hz with filtered friction and noise."""
    fine = np.arange(0.0, 60.0, 0.016)
    friction = synthetic.friction_and_sensitivities("slowness", fine, LOADING)[0]
    friction += size * np.random.default_rng(seed).standard_normal(len(fine))
    passed = Filter.parse(text)
    if passed is not None:
        friction = passed.apply(
            fine, np.interp(passed.compute_required_sample_times(fine), fine, friction)
        )
    rows = slice(100, -100, 5)
    columns = {"time": fine[rows], "friction": friction[rows]}
    moved = synthetic.load_point_displacement(LOADING, fine[rows])
    record = rsfstudy.read_record(columns | {"displacement": moved})
    return record.with_steps([(40.07, 40.07, 1.0, 10.0)])


@pytest.mark.parametrize("kind", FILTER_KINDS)
def test_filters_of_an_exponential_are_exact(kind: str) -> None:
    """Filters agree with closed forms for an exponential decay.

    The friction is constant up to 10 s and then decays at a rate of 1/s.
    """
    time, size = np.arange(5.0, 20.0, 0.05), 0.8
    one = Filter(kind, size)
    at = one.compute_required_sample_times(time)
    found = one.apply(time, np.where(at > 10.0, np.exp(10.0 - np.maximum(at, 10.0)), 1.0))
    if kind not in LOW_PASS_ORDERS:
        late = time + (0.5 * size if kind == "mean" else 0.0)
        whole = late - size > 10.0
        exact = (np.exp(10.0 - late + size) - np.exp(10.0 - late)) / size
        # The error of the midpoint rule with 16 parts of 0.05 s is (0.05)^2/24.
        np.testing.assert_allclose(found[whole], exact[whole], rtol=2e-4)
    if kind == "first_order":
        rate = 2.0 * math.pi * size
        lag = np.maximum(time - 10.0, 0.0)
        exact = (rate * np.exp(-lag) - np.exp(-rate * lag)) / (rate - 1.0)
        # There are 60 points per period of the corner frequency.
        np.testing.assert_allclose(found, exact, atol=3e-3)
    np.testing.assert_allclose(found[time < 9.0], 1.0, rtol=1e-12)


def test_the_correlation_of_averages_is_removed() -> None:
    """Whitening removes the correlation of running means over 5 rows.

    The reference is the matrix of overlaps.
    """
    time = 0.2 * np.arange(60.0)
    lags = np.abs(time[:, None] - time)
    exact = np.maximum(1.0 - lags, 0.0) + 0.002 * np.eye(60)
    overlap = NoiseCorrelationFromAveraging(time, 1.0)
    root = np.linalg.inv(np.linalg.cholesky(exact))
    np.testing.assert_allclose(overlap.whiten_columns(np.eye(60)), root, atol=1e-9)
    assert overlap.correlation_log_determinant == pytest.approx(np.linalg.slogdet(exact)[1])
    # The ratio is smaller at the ends.
    assert overlap.row_count_per_independent_sample == pytest.approx(5.0, rel=0.1)
    line = apply_running_mean(time, time[:, None] ** 2, 1.0)[:, 0]
    # The mean of t^2 over 1 s is t^2 + 1/12, and linear interpolation between rows adds less
    # than 0.2^2/2.
    np.testing.assert_allclose(line[3:-3], time[3:-3] ** 2 + 1.0 / 12.0, atol=0.02)


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("mean 0.8", {"averaging": "800 ms"}),
        ("trailing_mean 0.8", {"averaging": "trailing 0.8 s"}),
        ("butterworth_2 0.6", {"low_pass": "butterworth_2 0.6 Hz"}),
    ],
)
def test_a_stated_filter_gives_the_truth_back(text: str, options: dict[str, str]) -> None:
    found = rsfstudy.fit(filtered(text, 3e-4, 1), **FIT_OPTIONS | LAW | options).squeeze()
    assert found.status.item() == Status.OK, found.message.item()
    for name in ("a", "b", "slip_distance"):
        assert abs(synthetic.deviation_in_stderrs(found, name, EXACT_PARAMETERS[name])) < 3.5, name


@pytest.mark.parametrize("text", ["mean 0.8 s", "butterworth_2 2 Hz"])
def test_a_filter_of_reading_is_applied_to_the_model(text: str) -> None:
    record = rsfstudy.read_record(filtered("", 3e-4, 1), filter=text, begin="2 s", thin=2)
    found = rsfstudy.fit(record, **FIT_OPTIONS | LAW).squeeze()
    assert found.status.item() == Status.OK, found.message.item()
    for name in ("a", "b", "slip_distance"):
        assert abs(synthetic.deviation_in_stderrs(found, name, EXACT_PARAMETERS[name])) < 3.5, name
    assert f"friction filtered by {text}; record: one of every 2 rows" in found.attrs["processing"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mean 0.8", "averaged over about 0.8 s"),
        ("first_order 1.5", "low-pass filtered at about"),
        ("butterworth_2 2.0", "low-pass filtered at about"),
    ],
)
def test_an_unstated_filter_is_detected(text: str, message: str) -> None:
    found = rsfstudy.fit(filtered(text, 3e-4, 1), **FIT_OPTIONS | LAW).squeeze()
    assert found.status.item() == Status.ERRORS_NOT_VALID
    assert message in found.message.item()
    assert abs(synthetic.deviation_in_stderrs(found, "a", EXACT_PARAMETERS["a"])) > 3.0


def test_no_filter_is_detected_in_unfiltered_friction() -> None:
    plain = rsfstudy.fit(filtered("", 3e-4, 1), **FIT_OPTIONS | LAW).squeeze()
    assert plain.status.item() == Status.OK


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"averaging": "1 s", "low_pass": "first_order 1 Hz"}, "cannot be combined with averaging"),
        ({"low_pass": "bessel 1 Hz"}, "first_order, butterworth_2"),
        ({"low_pass": "first_order 1 s"}, "incompatible"),
        ({"averaging": "-1 s"}, "must be a positive averaging time"),
        ({"averaging": "1 um"}, "averaging"),
    ],
)
def test_filters_that_cannot_be_are_refused(options: dict[str, str], text: str) -> None:
    with pytest.raises(InvalidValue, match=text):
        rsfstudy.fit(synthetic.synthetic_record(), stiffness=3e-3, **options)
