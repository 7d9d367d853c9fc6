"""Tests of noise models against dense linear algebra and random samples.

The tests cover whitening, determinants, and REML estimates.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import block_diag, toeplitz
from scipy.signal import lfilter
from scipy.stats import chi2

from rsfstudy.fitting import noise_models as noises
from rsfstudy.fitting.noise_models import NoiseModel
from rsfstudy.fitting.outliers import find_non_outlier_mask, find_rounding_quantum
from rsfstudy.fitting.uniform_sampling_runs import (
    UniformSamplingRun,
    find_noise_level_changes,
    find_uniform_sampling_runs,
)

#: Coefficients of a third-order autoregressive process with a pair of complex roots.
AR3 = -np.real(np.poly([0.8, 0.5 + 0.4j, 0.5 - 0.4j]))[1:]


def correlations(coefficients: np.ndarray, lags: int) -> np.ndarray:
    """Return the autocorrelation of a process from its impulse response."""
    impulse = np.zeros(2_000)
    impulse[0] = 1.0
    response = lfilter([1.0], [1.0, *(-coefficients)], impulse)
    seen = np.array([response[lag:] @ response[: len(response) - lag] for lag in range(lags)])
    return np.asarray(seen / seen[0])


def partial(coefficients: np.ndarray) -> np.ndarray:
    """Return the partial autocorrelations of a process.

    The partial autocorrelations are the last coefficients of the predictors of every order.
    """
    seen = correlations(coefficients, len(coefficients) + 1)
    orders = range(1, len(coefficients) + 1)
    return np.array([np.linalg.solve(toeplitz(seen[:n]), seen[1 : n + 1])[-1] for n in orders])


#: Runs of two processes. The length of one run is less than the order.
RUNS = (
    UniformSamplingRun(0, 40, 0, 0, 0),
    UniformSamplingRun(40, 42, 1, 0, 1),
    UniformSamplingRun(42, 90, 0, 0, 0),
    UniformSamplingRun(90, 130, 1, 0, 1),
)
SIZES = [1.0, 0.3]
BOTH = NoiseModel(RUNS, np.array([partial(AR3), [0.9, 0.0, 0.0]]), np.array(SIZES))
#: Runs of a single process with a variable noise level. The level first changes after fewer rows
#: than the order.
JOINED = (
    UniformSamplingRun(0, 2, 0, 0, 0),
    UniformSamplingRun(2, 42, 1, 2, 1),
    UniformSamplingRun(42, 90, 0, 42, 0),
    UniformSamplingRun(90, 130, 1, 90, 1),
)
CHANGING = NoiseModel(JOINED, np.array([partial(AR3)] * 2), np.array(SIZES))


def dense(noise: NoiseModel) -> np.ndarray:
    """Return the covariance matrix of a noise model.

    The matrix has blocks of an AR(3) and an AR(1) process, or belongs to a single AR(3)
    process.
    """
    seen = [correlations(AR3, 300), correlations(np.array([0.9]), 300)]
    sizes = np.concatenate(
        [
            [noise.relative_noise_levels[r.noise_process_index]] * (r.stop_row - r.start_row)
            for r in noise.uniform_sampling_runs
        ]
    )
    if noise is CHANGING:
        return np.asarray(toeplitz(seen[0][:130]) * np.outer(sizes, sizes))
    if not noise.partial_autocorrelations.any():
        return np.diag(sizes**2)
    blocks = [
        toeplitz(seen[r.noise_process_index][: r.stop_row - r.start_row])
        for r in noise.uniform_sampling_runs
    ]
    return np.asarray(block_diag(*blocks) * np.outer(sizes, sizes))


@pytest.mark.parametrize("noise", [BOTH, CHANGING], ids=["apart", "one whose size changes"])
def test_whitening_is_that_of_the_triangle_of_the_correlation_matrix(noise: NoiseModel) -> None:
    matrix = dense(noise)
    triangle = np.linalg.cholesky(matrix)
    found = noise.whiten_columns(np.eye(len(matrix)))
    # The rounding error is multiplied by the condition number of 1e3.
    np.testing.assert_allclose(found, np.linalg.inv(triangle), atol=1e-11)
    exact = 2.0 * np.log(np.diag(triangle)).sum()
    assert noise.correlation_log_determinant == pytest.approx(exact, abs=1e-10)


@pytest.mark.parametrize("noise", [BOTH, CHANGING], ids=["apart", "one whose size changes"])
def test_what_is_minimised_is_the_restricted_likelihood_of_dense_matrices(
    noise: NoiseModel,
) -> None:
    rng = np.random.default_rng(1)
    jacobian = np.column_stack([np.ones(130), np.linspace(0.0, 50.0, 130), rng.normal(size=130)])
    residuals = 1e-3 * rng.normal(size=130)
    products = noises._LaggedProductSums(
        noise.uniform_sampling_runs, np.column_stack([jacobian, residuals]), 3
    )

    def exact(matrix: np.ndarray) -> float:
        told = jacobian.T @ np.linalg.solve(matrix, jacobian)
        moved = np.linalg.solve(told, jacobian.T @ np.linalg.solve(matrix, residuals))
        left = residuals - jacobian @ moved
        squares = float(left @ np.linalg.solve(matrix, left))
        logs = np.linalg.slogdet(matrix)[1] + np.linalg.slogdet(told)[1]
        return float((130 - 3) * math.log(squares) + logs)

    plain = NoiseModel(noise.uniform_sampling_runs, np.zeros((2, 3)), np.array([1.0, 2.0]))
    apart = exact(dense(noise)) - exact(dense(plain))
    assert products.compute_restricted_likelihood_objective(
        noise
    ) - products.compute_restricted_likelihood_objective(plain) == pytest.approx(apart, abs=1e-8)


def test_independent_samples_of_first_order() -> None:
    one = NoiseModel((UniformSamplingRun(0, 500, 0, 0, 0),), np.array([[0.9]]), np.ones(1))
    assert one.effective_sample_size == pytest.approx(500 * 0.1 / 1.9)


def test_degrees_of_freedom_count_the_coefficients_that_are_found() -> None:
    """The degrees of freedom include the uncertainty of the coefficients.

    The first-order case has a closed form. For higher orders, the reference is the scatter
    of the estimated power at zero frequency.
    """
    one = NoiseModel((UniformSamplingRun(0, 500, 0, 0, 0),), np.array([[0.9]]), np.ones(1))
    assert one.low_frequency_noise_degrees_of_freedom == pytest.approx(500 / (1 + 2 * 1.9 / 0.1))
    assert (
        noises.build_white_noise_model(np.arange(500.0)).low_frequency_noise_degrees_of_freedom
        == 500
    )
    rng, logs = np.random.default_rng(7), []
    for _ in range(400):
        drawn = lfilter([1.0], [1.0, *(-AR3)], rng.normal(size=3_200))[200:]
        found = NoiseModel(
            (UniformSamplingRun(0, 3_000, 0, 0, 0),),
            np.array([noises._estimate_burg_coefficients([drawn], 3)]),
            np.ones(1),
        )
        logs.append(math.log(np.var(drawn) / found.effective_sample_size))
    exact = NoiseModel(
        (UniformSamplingRun(0, 3_000, 0, 0, 0),), np.array([partial(AR3)]), np.ones(1)
    ).low_frequency_noise_degrees_of_freedom
    # The variance of 400 samples has a relative standard error of 1/14.
    assert 2.0 / np.var(logs) == pytest.approx(exact, rel=0.25)


def test_coefficients_are_recovered() -> None:
    """Burg's recursion and REML recover the coefficients.

    REML corrects for the degrees of freedom of the fit.
    """
    rng = np.random.default_rng(3)
    long = lfilter([1.0], [1.0, *(-AR3)], rng.normal(size=50_000))
    # The standard errors are below 1/sqrt(n).
    assert np.abs(
        noises._estimate_burg_coefficients([long], 3) - partial(AR3)
    ).max() < 5.0 / math.sqrt(50_000)
    time = np.arange(400.0)
    jacobian = np.column_stack([np.ones(400), time, time**2, np.exp(-time / 60.0)])
    base = np.linalg.qr(jacobian)[0]
    plain, reml = [], []
    for _ in range(60):
        noise = lfilter([1.0], [1.0, -0.9], rng.normal(size=700))[300:]
        left = noise - base @ (base.T @ noise)
        plain.append(noises._estimate_burg_coefficients([left], 1)[0])
        reml.append(
            noises.fit_noise_model("ar1", time, left, jacobian).partial_autocorrelations[0, 0]
        )
    # The mean of 60 samples has a standard error of sqrt((1 - 0.81)/400/60) = 0.0028.
    assert abs(np.mean(reml) - 0.9) < 0.009
    assert np.mean(plain) < 0.885  # The fit has absorbed a part of the noise.


@pytest.mark.parametrize(("order", "coefficients"), [(0, np.zeros(0)), (3, AR3)])
def test_the_order_is_chosen(order: int, coefficients: np.ndarray) -> None:
    rng = np.random.default_rng(4)
    chosen = []
    for _ in range(20):
        left = lfilter([1.0], [1.0, *(-coefficients)], rng.normal(size=800))
        chosen.append(noises._select_autoregressive_order([[left]]))
    assert min(chosen) >= order
    # The criterion overestimates the order sometimes and underestimates it rarely.
    assert np.median(chosen) == order


def test_noise_of_other_sampling_intervals_is_another() -> None:
    rng = np.random.default_rng(5)
    time = np.concatenate([np.arange(600) * 0.1, 59.9 + np.arange(1, 901) * 0.01])
    slow = lfilter([1.0], [1.0, -0.5], rng.normal(size=600)) * math.sqrt(0.75)
    fast = lfilter([1.0], [1.0, -0.95], rng.normal(size=1_500))[600:] * math.sqrt(1 - 0.95**2)
    left = np.concatenate([slow, 3.0 * fast])
    found = noises.fit_noise_model("ar1", time, left, np.ones((1_500, 1)))
    assert [
        (*run[:2], run.row_count_since_time_restart) for run in found.uniform_sampling_runs
    ] == [
        (0, 600, 0),
        (600, 1_500, 600),
    ]
    coefficients = dict(
        zip(
            [run.noise_process_index for run in found.uniform_sampling_runs],
            (0.5, 0.95),
            strict=True,
        )
    )
    for number, exact in coefficients.items():
        assert found.partial_autocorrelations[number, 0] == pytest.approx(exact, abs=0.12)
    for noise in (found, noises.fit_noise_model("white", time, left, np.ones((1_500, 1)))):
        # 900 samples with a correlation of 0.95 contain 23 independent samples, which determine
        # the level to 15 %.
        sizes = noise.relative_noise_levels[
            [run.noise_level_index for run in noise.uniform_sampling_runs]
        ]
        assert sizes[1] / sizes[0] == pytest.approx(3.0, rel=0.5)


@pytest.mark.parametrize("quantum", [0.0, 0.01])
def test_a_clock_that_is_uneven_is_one_process(quantum: float) -> None:
    """Sampling intervals that vary slightly belong to a single process.

    The intervals are irregular, or rounded to one or two ticks of a logger.
    """
    rng = np.random.default_rng(6)
    time = np.cumsum(np.where(rng.random(2_000) < 0.5, 1.0, 2.0 if quantum else 1.2)) * 0.01
    assert find_uniform_sampling_runs(time) == (UniformSamplingRun(0, 2_000, 0, 0, 0),)


@pytest.mark.parametrize("order", [0, 3])
def test_whiteness_is_that_of_ljung_and_box(order: int) -> None:
    """The p-value agrees with the statistic of Ljung and Box.

    The statistic ``n (n + 2) sum of r_k**2/(n - k)`` over 20 lags more than the order has a
    chi-squared distribution with 20 degrees of freedom for any mean.
    """
    left = np.random.default_rng(8).normal(size=300) + np.sin(np.arange(300.0))
    lags = range(1, 20 + order + 1)
    seen = np.array([np.corrcoef(np.roll(left, k)[k:], left[k:])[0, 1] for k in lags])
    size = 300 * 302 * sum(r**2 / (300 - k) for r, k in zip(seen, lags, strict=True))
    told = noises.compute_ljung_box_p_value(left + 5.0, order)
    assert told == pytest.approx(noises.compute_ljung_box_p_value(left, order), rel=1e-9)
    # The means and variances of parts differ from the whole series by the effect of a few lags
    # in 300.
    assert chi2.isf(told, 20) == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_the_noise_level_may_change(rho: float) -> None:
    rng = np.random.default_rng(11)
    left = lfilter([1.0], [1.0, -rho], rng.normal(size=900))
    left[300:] *= 4.0
    found = noises.fit_noise_model("ar", np.arange(900.0), left, np.ones((900, 1)))
    assert len(found.relative_noise_levels) == 2
    assert abs(found.uniform_sampling_runs[1].start_row - 300) < 30
    assert found.relative_noise_levels[1] == pytest.approx(4.0, rel=0.3)
    # The local noise level determines the weights of the quiet rows.
    weights = found.whiten_columns(np.ones((900, 1)))[:, 0] ** 2
    assert weights[:250].sum() > 4.0 * weights[350:600].sum()


def test_a_steady_level_does_not_change() -> None:
    rng = np.random.default_rng(12)
    changes = [find_noise_level_changes(rng.normal(size=600)) for _ in range(100)]
    assert sum(map(bool, changes)) <= 3


@pytest.mark.parametrize("ratio", [0.2, 5.0])
def test_changes_of_the_noise_level_are_located(ratio: float) -> None:
    rng = np.random.default_rng(15)
    scale = np.where(np.arange(700) < 500, 1.0, ratio)
    rows = [find_noise_level_changes(scale * rng.normal(size=700)) for _ in range(50)]
    assert all(len(found) == 1 for found in rows)
    # Rows are misplaced only if the louder noise is as small as the quieter noise.
    assert max(abs(found[0] - 500) for found in rows) <= 5


def test_a_clock_with_jitter_keeps_its_two_sampling_rates() -> None:
    rng = np.random.default_rng(13)
    gaps = np.repeat([0.2, 0.02], [200, 1_000])
    time = np.cumsum(gaps) + 0.3 * gaps * rng.uniform(-1.0, 1.0, 1_200)
    runs = find_uniform_sampling_runs(time)
    assert [run.noise_process_index for run in runs] == [1, 0] or [
        run.noise_process_index for run in runs
    ] == [0, 1]
    assert abs(runs[0].stop_row - 200) < 10


def test_outliers_are_found_and_peaks_of_the_model_are_not() -> None:
    rng = np.random.default_rng(14)
    left, curve = 1e-3 * rng.normal(size=500), np.zeros(500)
    spikes = [7, 120, 121, 333]
    left[spikes] += 0.02
    curve[250:] = 0.05 * np.exp(-np.arange(250) / 2.0)
    left[250] += 0.02  # A misfit at the step.
    kept = find_non_outlier_mask(left, curve, 0.0)
    assert kept is not None
    assert np.flatnonzero(~kept).tolist() == spikes
    assert find_non_outlier_mask(1e-3 * rng.normal(size=500), curve, 0.0) is None


@pytest.mark.parametrize("change", [130, 160])
def test_rows_after_a_change_of_the_noise_level_are_no_outliers(change: int) -> None:
    left = 1e-4 * np.random.default_rng(16).normal(size=500)
    left[change:] *= 10.0
    assert find_non_outlier_mask(left, np.zeros(500), 0.0) is None


def test_the_quantum_of_values_is_found() -> None:
    rng = np.random.default_rng(15)
    values = 0.6 + 2e-3 * rng.normal(size=400)
    assert find_rounding_quantum(np.round(values, 3)) == pytest.approx(1e-3)
    assert find_rounding_quantum(values) == 0.0
    assert find_rounding_quantum(np.full(10, 0.6)) == 0.0
    shear = 0.0025 * np.rint(20.0 * values / 0.0025)
    assert find_rounding_quantum(shear / 20.0) == pytest.approx(0.0025 / 20.0)
