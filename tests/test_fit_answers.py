"""Tests of the results of fits.

The tests compare intervals with closed forms and repeated fits, and cover skipped work,
ramps, noise of the load point, and the fit of basalt in the documentation.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import synthetic_records as synthetic
import xarray as xr
from scipy.stats import t as student
from synthetic_records import (
    EXACT_PARAMETERS,
    FIT_OPTIONS,
    LAW_FUNCTIONS,
    STEP_UP,
    synthetic_record,
)

import rsfstudy
from rsfstudy import Scene
from rsfstudy.fitting.load_point_noise import copy_steps_shifted_by_their_errors
from rsfstudy.fitting.recorded_loading import build_loading_history
from rsfstudy.fitting.window_model import LOADING_STEP_SHIFT_OVER_STANDARD_ERROR, WindowModel
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator
from rsfstudy.reporting import build_summary_tables_and_sentences
from rsfstudy.status import Status

WHITE = {**FIT_OPTIONS, "noise": "white", "laws": ["slowness"]}
#: True values of the parameters that are not free.
TRUE = {"a": 0.01, "b_over_a": 1.3, "slip_distance": EXACT_PARAMETERS["slip_distance"]}


def test_intervals_of_linear_parameters_are_those_of_students_t() -> None:
    """Intervals of linear parameters follow Student's t distribution.

    The free parameters are the initial friction and a trend, so the fit is a regression
    with n - 2 degrees of freedom.
    """
    fit = rsfstudy.fit(
        synthetic_record(count=60), free=("mu_star", "trend1"), **WHITE, **TRUE
    ).squeeze()
    bare, moved = fit.detrended_friction - fit.mu_star, fit.record_displacement.values
    moved = moved - 40.0  # The trend starts at the step.
    columns = np.column_stack([np.ones(60), moved])
    left = fit.record_friction.values - bare.values
    exact, (squares,), *_ = np.linalg.lstsq(columns, left)
    spread = np.sqrt(squares / 58.0 * np.diag(np.linalg.inv(columns.T @ columns)))
    reach = student.isf(0.025, 58) * spread
    for name, value, by in zip(("mu_star", "trend1"), exact, reach, strict=True):
        ends = [float(fit[f"{name}_{end}"]) for end in ("ci_low", "ci_high")]
        # Friction is reproducible to 1e-11, compared with an interval of 1e-4.
        assert ends == pytest.approx([value - by, value + by], abs=1e-6 * by), name


@pytest.mark.parametrize("law", LAW_FUNCTIONS)
def test_a_spring_softer_than_critical_is_not_followed(law: str) -> None:
    """Motions below the critical stiffness are not integrated.

    The critical stiffness is (b - a)/D_c for all laws with one state.
    """
    fields = {"normal_stress": "constant", "stiffness": 0.03, "mu_star": 0.6}
    scene = Scene(law=law, a=0.01, b_over_a=1.3, **fields)
    integrator = Integrator(Accuracy(budget=10**9, engine="compiled"))
    loading = np.array([(t, v, 1.0, 0.0) for t, v in STEP_UP])
    times = synthetic.sample_times(STEP_UP, 50.0, 50)
    model = WindowModel(scene, times, times, times, loading, integrator)
    critical = (EXACT_PARAMETERS["b"] - EXACT_PARAMETERS["a"]) / EXACT_PARAMETERS["slip_distance"]
    soft, stiff = (EXACT_PARAMETERS | {"stiffness": part * critical} for part in (0.999, 3.0))
    assert np.isnan(model.compute_model_friction(soft, require_stable=True)).all()
    assert integrator.evaluations == 0
    assert np.isfinite(model.compute_model_friction(stiff, require_stable=True)).all()
    assert integrator.evaluations > 0


#: A ramp of 0.4 s, during which the load point moves by 2.2 um. A constant velocity during the
#: ramp would have a displacement error of up to 0.45 um.
RAMP = ((0.0, 1.0), *((40.0 + 0.002 * n, 1.0225 + 0.045 * n) for n in range(200)), (40.4, 10.0))


def test_a_ramp_is_loaded_at_steady_acceleration() -> None:
    times = synthetic.sample_times(RAMP, synthetic.loading_end_time(RAMP), 400)
    columns = {"time": times, "displacement": synthetic.load_point_displacement(RAMP, times)}
    columns["friction"] = synthetic.friction_and_sensitivities("slowness", times, RAMP)[0]
    one = rsfstudy.read_record(columns).with_steps([(40.0, 40.4, 1.0, 10.0)])
    pieces = build_loading_history(one, 0.0, 50.0, use_recorded_rows=False)
    ends = np.append(pieces[1:, 0], 50.0)
    moved = np.cumsum(pieces[:, 1] * (ends - pieces[:, 0]))
    lasts = np.clip(ends - 40.0, 0.0, 0.4)
    exact = (ends + 11.25 * lasts**2 + 9.0 * np.maximum(ends - 40.4, 0.0))[:-1]
    np.testing.assert_allclose(moved[:-1], exact)
    fit = rsfstudy.fit(one, **WHITE).squeeze()
    for name in ("a", "b", "slip_distance"):
        # The pieces have a displacement error of 0.45 um/16^2, which is 5e-6 in friction if
        # multiplied by k.
        assert float(fit[name]) == pytest.approx(EXACT_PARAMETERS[name], rel=1e-3), name
    found = rsfstudy.fit(rsfstudy.read_record(columns), **WHITE).squeeze()
    # The rows before the ramp are 0.4 s apart, so the ramp appears to be twice as long.
    assert float(found.slip_distance) == pytest.approx(EXACT_PARAMETERS["slip_distance"], rel=0.03)


@pytest.mark.parametrize(("noise", "told"), [(0.02, False), (0.3, True)])
def test_noise_of_a_load_point_that_is_loaded_as_recorded(noise: float, told: bool) -> None:
    truth = EXACT_PARAMETERS | {"stiffness": 0.02}
    times = synthetic.sample_times(STEP_UP, synthetic.loading_end_time(STEP_UP), 600)
    moved = synthetic.load_point_displacement(STEP_UP, times)
    friction = synthetic.friction_and_sensitivities("slowness", times, STEP_UP, truth)[0]
    moved = moved + synthetic.correlated_noise(600, 0.0, noise, 1)
    columns = {"time": times, "displacement": moved, "friction": friction}
    one = rsfstudy.read_record(columns).with_steps([(40.0, 40.0, 1.0, 10.0)])
    fit = rsfstudy.fit(one, **{**WHITE, "stiffness": 0.02}, loading="recorded").squeeze()
    # The noise is estimated from a median of 600 samples.
    assert float(fit.load_point_noise) == pytest.approx(noise, rel=0.2)
    assert ("noise of the recorded load point" in str(fit.message.values)) == told
    assert (float(fit.slip_distance) > 1.1 * EXACT_PARAMETERS["slip_distance"]) == told
    steps = rsfstudy.fit(one, **{**WHITE, "stiffness": 0.02}).squeeze()
    assert float(steps.slip_distance) == pytest.approx(EXACT_PARAMETERS["slip_distance"], rel=2e-3)
    assert str(steps.message.values) == ""


def with_noise(size: float, seed: int, rho: float = 0.0) -> rsfstudy.Record:
    """Return a record of 400 rows with noise in the displacement.

    The steps are detected.
    """
    columns = {
        name: of.copy() for name, of in synthetic_record(size=5e-5, seed=seed).columns.items()
    }
    columns["displacement"] += synthetic.correlated_noise(400, rho, size, 1000 + seed)
    return rsfstudy.read_record(columns)


def test_errors_of_steps_are_those_of_two_straight_lines() -> None:
    """Errors of steps agree with the closed form for two straight lines.

    For n even rows over a time T, the variance of a velocity is 12 s^2/(n T^2), and the
    variance of either end is 4 s^2/n.
    """
    one = with_noise(0.1, 0)
    times = np.array(
        [
            [step[:4] for step in steps]
            for steps in copy_steps_shifted_by_their_errors(one, one.loading_steps)
        ]
    )
    variances = np.square(times - np.array([one.loading_steps[0][:4]])).sum(axis=(0, 1))
    variances = variances[[0, 2, 3]] / LOADING_STEP_SHIFT_OVER_STANDARD_ERROR**2
    (step,) = one.loading_steps
    counts = np.array([(one.time < step.start).sum(), (one.time >= step.start).sum()])
    lasts = np.array([step.start - one.time[0], one.time[-1] - step.start])
    of_time = np.sum(4 * 0.01 / counts) / (step.velocity_after - step.velocity_before) ** 2
    exact = [of_time, *(12 * 0.01 / (counts * lasts**2))]
    # 400 rows determine s^2 to 7 %, and a random noise order above 0 adds to this error.
    assert variances == pytest.approx(exact, rel=0.25)
    assert copy_steps_shifted_by_their_errors(one.with_steps([step[:4]]), [step]) == []
    assert copy_steps_shifted_by_their_errors(synthetic_record(), [step]) == []


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_errors_count_noise_of_the_load_point(rho: float) -> None:
    """Standard errors include the noise of the load point.

    The sum of squared deviations over six fits has a chi-squared distribution. Without the
    contribution of the load point, the sum for a would exceed 50.
    """
    names = ("a", "b", "slip_distance")
    squares = dict.fromkeys(names, 0.0)
    for seed in range(6):
        fit = rsfstudy.fit(with_noise(0.4, seed, rho), **{**FIT_OPTIONS, "laws": ["slowness"]})
        assert "is due to noise of the load point" in str(fit.message.values.item())
        for name in names:
            squares[name] += (
                synthetic.deviation_in_stderrs(fit.squeeze(), name, EXACT_PARAMETERS[name]) ** 2
            )
            low, high = (float(fit[f"{name}_{end}"].item()) for end in ("ci_low", "ci_high"))
            assert high - low > 3.9 * float(fit[f"{name}_stderr"].item())
    # The sum has a chi-squared distribution with 6 degrees of freedom.
    assert all(0.5 < found < 25.0 for found in squares.values()), squares


def test_basalt_is_what_the_page_tells() -> None:
    """The fit agrees with the published page.

    The slip law gives a D_c of 8.7 um, errors of 2.2 times the white-noise errors, and 643
    effective samples in 2,863 rows.
    """
    one = rsfstudy.read_record(Path(__file__).parent.parent / "studies/records/basalt.txt")
    free = ("a", "b", "slip_distance", "mu_star", "trend1", "stiffness", "step_time")
    options = {"laws": ["slip"], "free": free, "before": "60 um", "after": "250 um"}
    fit, usual = (
        rsfstudy.fit(one, noise=noise, engine="compiled", **options).squeeze()
        for noise in ("ar", "white")
    )
    rows = int(fit.rows_fitted), float(fit.n_eff)
    assert rows == (2863, pytest.approx(643.0, abs=1.0))
    for name in ("a", "b", "slip_distance"):
        assert float(fit[f"{name}_stderr"] / usual[f"{name}_stderr"]) == pytest.approx(2.2, abs=0.3)
    assert float(fit.slip_distance) == pytest.approx(8.7, abs=0.1)
    assert float(fit.a) == pytest.approx(0.0094, abs=1e-4)


def test_the_aic_is_not_decisive_if_the_standard_errors_are_not_valid() -> None:
    file = Path(__file__).parents[1] / "studies" / "pages" / "step.csv"
    record = rsfstudy.read_record(file, normal_stress="20 MPa")
    about = {"stiffness": "0.04 MPa/um", "steps": [1], "after": "200 um"}

    def last_sentence(fits: xr.Dataset) -> str:
        texts = list(build_summary_tables_and_sentences(fits))
        return next(text for text in texts if isinstance(text, str) and "AIC" in text)

    valid = rsfstudy.fit(record, **about)
    assert last_sentence(valid).startswith("slowness fits best: its AIC is lower by")
    white = rsfstudy.fit(record, noise="white", **about)
    assert (white["status"] == Status.ERRORS_NOT_VALID).any()
    text = last_sentence(white)
    assert "decisive" not in text
    assert "not conclusive, because the AIC requires valid standard errors" in text


def test_the_table_always_has_a_column_of_steps() -> None:
    file = Path(__file__).parents[1] / "studies" / "pages" / "step.csv"
    record = rsfstudy.read_record(file, normal_stress="20 MPa")
    about = {"stiffness": "0.04 MPa/um", "laws": ["slowness"]}
    single = rsfstudy.fit(record, steps=[2], **about).rsf.fit_table()
    assert single["step"].tolist() == [2]
    assert single[["V0", "V1"]].values.round().tolist() == [[10.0, 1.0]]
    both = rsfstudy.fit(record, **about).rsf.fit_table()
    assert both["step"].tolist() == [1, 2]
    joint = rsfstudy.fit(record, together=True, **about).rsf.fit_table()
    assert joint["step"].tolist() == ["1, 2"]
    assert not {"V0", "V1", "window"} & set(joint)
