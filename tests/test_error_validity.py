"""Tests of fits whose standard errors are not valid.

The tests cover statuses, tables and reductions.
"""

from __future__ import annotations

import functools

import numpy as np
import pytest
import synthetic_records as synthetic
import xarray as xr
from synthetic_records import EXACT_PARAMETERS, FIT_OPTIONS, STEP_UP

import rsfstudy
from rsfstudy.reductions import Range, apply_reductions
from rsfstudy.reporting import dataset_summaries, fit_summaries, fit_tables
from rsfstudy.status import Status


def record_with(noise: np.ndarray, jitter: np.ndarray | float = 0.0, trend: float = 0.0):
    """Return a record of a velocity step with noise.

    The noise is added to friction, and the jitter is added to the displacement.
    """
    time = synthetic.sample_times(STEP_UP, synthetic.loading_end_time(STEP_UP), len(noise))
    moved = synthetic.load_point_displacement(STEP_UP, time)
    friction = synthetic.friction_and_sensitivities("slowness", time)[0] + trend * (moved - 40.0)
    columns = {"time": time, "displacement": moved + jitter, "friction": friction + noise}
    return rsfstudy.read_record(columns)


@functools.cache
def naive() -> xr.Dataset:
    """Return a fit that assumes white noise for correlated noise."""
    record = record_with(synthetic.correlated_noise(400, 0.9, 3e-4, 0)).with_steps(
        [(40, 40, 1, 10)]
    )
    return rsfstudy.fit(record, **FIT_OPTIONS | {"noise": "white", "laws": ["slowness"]})


def test_autocorrelated_whitened_residuals_change_the_status() -> None:
    assert int(Status.ERRORS_NOT_VALID) == 19
    assert Status.ERRORS_NOT_VALID.is_answer
    row = naive().rsf.fit_table().iloc[0]
    assert row["status"] == "errors_not_valid"
    assert row["p_value"] < 1e-6
    assert "still autocorrelated" in naive().message.item()
    # The estimates are still correct.
    assert row["a"] == pytest.approx(EXACT_PARAMETERS["a"], rel=0.2)


def test_tables_mark_standard_errors_that_are_not_valid() -> None:
    assert not fit_tables.are_all_fits_valid(naive())  # The exit status is 1.
    assert fit_summaries.format_parameter_with_stderr(naive().squeeze(), "a").endswith("*")
    texts = [
        piece
        for piece in dataset_summaries.build_summary_tables_and_sentences(naive())
        if isinstance(piece, str)
    ]
    assert any("standard errors marked by * are not valid" in text for text in texts)


def test_reductions_do_not_use_standard_errors_that_are_not_valid() -> None:
    both = xr.concat([naive()[["a", "a_stderr", "status"]]] * 2, "record")
    made = apply_reductions(
        both.isel(law=0),
        (Range("spread", "a", over="record"), Range("spread_of_errors", "a_stderr", over="record")),
    )
    assert made["spread"].item() == 0.0
    assert np.isnan(made["spread_of_errors"].item())
    valid = both.isel(law=0).assign(status=xr.zeros_like(both["status"].isel(law=0)))
    found = apply_reductions(valid, (Range("spread_of_errors", "a_stderr", over="record"),))
    assert found["spread_of_errors"].item() == 0.0


def test_a_fit_that_explains_nothing_has_no_valid_errors() -> None:
    """A fit with a free friction level only has no valid errors.

    The friction decreases at the step.
    """
    record = record_with(synthetic.correlated_noise(300, 0.0, 3e-4, 1))
    record.columns["friction"] = 1.2 - record.columns["friction"]
    fixed = {"a": 0.01, "b_over_a": 1.3, "slip_distance": 10.0, "laws": ["slowness"]}
    found = rsfstudy.fit(record, **FIT_OPTIONS | fixed, free=["mu_star"]).squeeze()
    assert float(found.r_squared) < 0.0
    assert found.status.item() == Status.ERRORS_NOT_VALID
    assert "R2 is not positive" in found.message.item()


@pytest.mark.parametrize("seed", [1, 2])
def test_the_regressor_of_the_trend_has_no_noise(seed: int) -> None:
    """Jitter of the load point does not bias the fit.

    The friction has strongly correlated noise and a trend.
    """
    noise = synthetic.correlated_noise(600, 0.97, 3e-4, seed)
    jitter = synthetic.correlated_noise(600, 0.0, 0.3, 10 + seed)
    record = record_with(noise, jitter, trend=-6e-5)
    options = FIT_OPTIONS | {"noise": "ar", "laws": ["slowness"]}
    found = rsfstudy.fit(record, **options).squeeze()
    assert found.status.item() == Status.OK
    for name, true in {**EXACT_PARAMETERS, "trend1": -6e-5}.items():
        # A deviation of 3.5 standard errors in any of 10 parameters occurs once in 200 records.
        if f"{name}_stderr" in found:
            assert abs(synthetic.deviation_in_stderrs(found, name, true)) < 3.5, name
    assert float(found.slip_distance_stderr) < 2.0


def test_outliers_are_left_out_and_named() -> None:
    noise = synthetic.correlated_noise(400, 0.0, 3e-4, 3)
    noise[[100, 222, 390]] += [0.02, -0.02, 0.02]
    options = FIT_OPTIONS | {"noise": "ar", "laws": ["slowness"]}
    found = rsfstudy.fit(record_with(noise), **options).squeeze()
    assert found.status.item() == Status.OK
    assert int(found.outliers) == 3
    assert np.isnan(found.whitened_residual.values[[100, 222, 390]]).all()
    assert "3 outliers were omitted: rows 101, 223, 391" in found.message.item()
    clean = rsfstudy.fit(
        record_with(synthetic.correlated_noise(400, 0.0, 3e-4, 3)), **options
    ).squeeze()
    assert float(found.a_stderr) == pytest.approx(float(clean.a_stderr), rel=0.1)
    for name in ("a", "b", "slip_distance"):
        assert abs(synthetic.deviation_in_stderrs(found, name, EXACT_PARAMETERS[name])) < 3.5, name


@pytest.mark.parametrize(("quantum", "valid"), [(2e-4, True), (4e-4, False)])
def test_rounded_friction_has_valid_errors_if_the_noise_covers_it(
    quantum: float, valid: bool
) -> None:
    """Rounding is harmless if the quantum is at most twice the noise."""
    record = record_with(synthetic.correlated_noise(400, 0.0, 1e-4, 4))
    rounded = quantum * np.rint(record.columns["friction"] / quantum)
    columns = record.columns | {"friction": rounded}
    options = FIT_OPTIONS | {"noise": "ar", "laws": ["slowness"]}
    found = rsfstudy.fit(rsfstudy.read_record(columns), **options).squeeze()
    assert float(found.friction_quantum) == pytest.approx(quantum)
    assert (found.status.item() == Status.OK) == valid
    assert ("friction is rounded to" in found.message.item()) != valid


@pytest.mark.parametrize("seed", range(3))
def test_errors_include_the_rounding_of_displacement(seed: int) -> None:
    """The standard errors cover the resolution of an encoder.

    The displacement is rounded to 0.5 um, and the step occurs between two rows.
    """
    shift = np.random.default_rng(seed).uniform(0.0, 0.5, 2)
    loading = ((0.0, 1.0), (40.0 + shift[0], 10.0))
    time = np.arange(0.0, 52.0, 0.1)
    moved = 0.5 * np.rint(synthetic.load_point_displacement(loading, time) / 0.5 + shift[1])
    friction = synthetic.friction_and_sensitivities("slowness", time, loading)[0]
    friction += synthetic.correlated_noise(len(time), 0.0, 1e-4, seed)
    record = rsfstudy.read_record({"time": time, "displacement": moved, "friction": friction})
    options = FIT_OPTIONS | {"noise": "ar", "laws": ["slowness"]}
    found = rsfstudy.fit(record, **options).squeeze()
    for name in ("a", "b", "slip_distance"):
        assert abs(synthetic.deviation_in_stderrs(found, name, EXACT_PARAMETERS[name])) < 3.0, name
    begins = loading[1][0]
    exact = record.with_steps([(begins, begins, 1.0, 10.0)])
    stated = rsfstudy.fit(exact, **options).squeeze()
    assert float(found.a_stderr) > 1.5 * float(stated.a_stderr)


@pytest.mark.parametrize(("rows", "status"), [(2.4, Status.OK), (1.0, Status.NOT_IDENTIFIED)])
def test_coarse_sampling_is_fitted_as_far_as_intervals_cover(rows: float, status: Status) -> None:
    """Coarse sampling is fitted down to 1.5 rows per D_c.

    The load point moves at 10 um/s after the step, and D_c is 10 um.
    """
    time = np.concatenate([np.arange(0.5, 40.0, 1.0), np.arange(40.1, 80.0, 1.0 / rows)])
    friction = synthetic.friction_and_sensitivities("slowness", time)[0]
    friction += synthetic.correlated_noise(len(time), 0.0, 3e-4, 2)
    moved = synthetic.load_point_displacement(STEP_UP, time)
    record = rsfstudy.read_record({"time": time, "displacement": moved, "friction": friction})
    options = FIT_OPTIONS | {"noise": "ar", "laws": ["slowness"]}
    found = rsfstudy.fit(record.with_steps([(40.0, 40.0, 1.0, 10.0)]), **options).squeeze()
    assert found.status.item() == status, found.message.item()
    for name in ("a", "b", "slip_distance"):
        assert abs(synthetic.deviation_in_stderrs(found, name, EXACT_PARAMETERS[name])) < 3.5, name
    if status is Status.NOT_IDENTIFIED:
        assert "1.5 are required. Sample faster" in found.message.item()


def test_a_stiffness_that_is_bounded_from_below_only_is_reported() -> None:
    """Friction of a very stiff machine reaches its peak between two rows."""
    found = rsfstudy.fit(
        synthetic.synthetic_record(truth=EXACT_PARAMETERS | {"stiffness": 0.5}, seed=6, size=1e-4),
        laws=["slowness"],
        stiffness=0.3,
        free=["a", "b", "slip_distance", "mu_star", "trend1", "stiffness"],
    ).squeeze()
    assert found.status.item() == Status.ERRORS_NOT_VALID
    assert "interval of stiffness is asymmetric" in found.message.item()
    assert found.stiffness_ci_low < 0.5 < found.stiffness_ci_high
