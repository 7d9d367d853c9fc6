"""Tests of joint fits of several windows.

The tests also cover laws with two states, a free exponent, posterior draws, tables and
holds.
"""

from __future__ import annotations

import math
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import synthetic_records as synthetic
from synthetic_records import (
    EXACT_PARAMETERS,
    FIT_OPTIONS,
    SLIDE_HOLD_SLIDE,
    STEP_UP,
    STEP_UP_AND_BACK,
    deviation_in_stderrs,
    synthetic_record,
)

import rsfstudy
from rsfstudy import Axis, Scene
from rsfstudy.errors import IncompleteWarning, InvalidValue
from rsfstudy.fitting import Fit, posterior
from rsfstudy.fitting.joint_window_model import JointWindowModel
from rsfstudy.fitting.window_model import WindowModel
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED
from rsfstudy.motion.integrator import Integrator
from rsfstudy.reporting import TextTable
from rsfstudy.reporting.fit_summaries import summarise_fits
from rsfstudy.storage.dataset_files import write_dataset

ENOUGH = 10**9
SHARED = ("a", "b", "slip_distance")


def test_two_steps_of_a_record_share_a_law() -> None:
    trend = 2e-5
    one = synthetic_record(STEP_UP_AND_BACK, trend=trend, seed=1)
    alone = rsfstudy.fit(one, laws=["slowness"], **FIT_OPTIONS)
    both = rsfstudy.fit(one, laws=["slowness"], together=True, **FIT_OPTIONS).squeeze()
    # At the second step, the load point has moved by 140 um, and the velocity has been ten times
    # higher.
    second = 0.6 + (EXACT_PARAMETERS["a"] - EXACT_PARAMETERS["b"]) * math.log(10.0) + 140.0 * trend
    true = {n: EXACT_PARAMETERS[n] for n in SHARED} | {"mu_star_1": 0.6, "mu_star_2": second}
    true |= {"trend1_1": trend, "trend1_2": trend}
    # A deviation above 4 standard errors in any of seven parameters occurs once in 2,000 records.
    for name, value in true.items():
        assert abs(deviation_in_stderrs(both, name, value)) < 4.0, name
    for name in SHARED:
        assert both[f"{name}_stderr"] < alone[f"{name}_stderr"].min(), name


def test_tables_of_a_joint_fit_with_a_law_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missing values are dashes in all tables, whichever of the laws failed."""

    def solve_unless_failed(self: Fit, scene: Scene, integrator: Integrator) -> object:
        if scene.law in failing:
            raise ValueError("failed")
        return solve(self, scene, integrator)

    solve = Fit.solve
    monkeypatch.setattr(Fit, "solve", solve_unless_failed)
    one = synthetic_record(STEP_UP_AND_BACK, seed=1, count=200)
    columns = {**one.columns, "normal_stress": np.full(len(one), 20.0)}
    stressed = rsfstudy.read_record(columns).with_steps(one.loading_steps)
    for failing in (("slip",), ("slowness",), ("slip", "slowness")):
        with pytest.warns(IncompleteWarning):
            fit = rsfstudy.fit(
                stressed, laws=["slip", "slowness"], together=True, posterior=0, **FIT_OPTIONS
            )
        table = next(part for part in summarise_fits(fit) if isinstance(part, TextTable))
        for row in table.rows[:-1]:
            for law in ("slip", "slowness"):
                expected = law in failing
                if row["parameter"] not in ("k (1/um)", "normal stress (MPa)") or expected:
                    assert (row[law] == "-") is expected, row
        assert [row["parameter"] for row in table.rows][-6:-5] == (
            ["normal stress (MPa)"] if len(failing) < 2 else ["k (1/um)"]
        )
        rows = fit.rsf.fit_table().set_index("law")
        assert rows.loc[[*failing], ["a", "k", "R2"]].isna().all(axis=None)


def test_one_step_together_is_that_step() -> None:
    one = synthetic_record(STEP_UP_AND_BACK, seed=1)
    alone, both = (
        rsfstudy.fit(one, laws=["slip"], steps=[1], together=together, **FIT_OPTIONS)
        for together in (False, True)
    )
    for name in (*SHARED, "mu_star", "aic"):
        assert float(both[name].item()) == float(alone[name].item()), name


def test_derivatives_of_windows_are_differences() -> None:
    scene = Scene(
        law="slip", a=0.01, b_over_a=1.3, normal_stress="constant", stiffness=0.03, mu_star=0.6
    )
    integrator = Integrator(Accuracy(1e-9, ENOUGH, engine=COMPILED))
    parts = []
    for loading in (STEP_UP, synthetic.STEP_DOWN):
        times = synthetic.sample_times(loading, synthetic.loading_end_time(loading), 60)
        pieces = np.array([(begins, speed, 1.0, 0.0) for begins, speed in loading])
        moved = synthetic.load_point_displacement(loading, times)
        parts.append(WindowModel(scene, times, moved, 0.0 * times, pieces, integrator))
    joint = JointWindowModel(tuple(parts))
    plainly = {n: EXACT_PARAMETERS[n] for n in ("a", "b", "slip_distance", "stiffness")}
    values = plainly | {"mu_star_1": 0.6, "mu_star_2": 0.5, "trend1_1": 1e-5, "trend1_2": -2e-5}
    free = ("a", "slip_distance", "mu_star_2", "trend1_1")
    found = joint.compute_jacobian(values, free)

    def friction(name: str, by: float) -> np.ndarray:
        moved = values[name] * math.exp(by) if name == "slip_distance" else values[name] + by
        changed = values | {name: moved}
        return joint.compute_model_friction(changed) + joint.compute_friction_trend(changed)

    for column, name in enumerate(free):
        step = 1e-3 if name == "slip_distance" else 1e-5
        exact = (friction(name, step) - friction(name, -step)) / (2.0 * step)
        # The error is of second order, so a relative step of 1e-3 leaves some 1e-5.
        assert np.abs(found[:, column] - exact).max() < 1e-4 * np.abs(exact).max(), name
    # The friction of a window is independent of the parameters of the other window.
    assert not found[:60, 2].any()
    assert not found[60:, 3].any()


@pytest.mark.parametrize(("law", "exponent"), [("family", 0.5), ("slip", 0.0), ("slowness", 1.0)])
def test_a_pair_of_steps_tells_the_exponent(law: str, exponent: float) -> None:
    free = ("a", "b", "slip_distance", "mu_star", "law_exponent")
    one = synthetic_record(STEP_UP_AND_BACK, law, seed=3)
    scene = {"law_exponent": 0.7}
    fit = rsfstudy.fit(one, laws=["family"], free=free, together=True, **FIT_OPTIONS, **scene)
    fit = fit.squeeze()
    low, high = (float(fit[f"law_exponent_{end}"]) for end in ("ci_low", "ci_high"))
    assert low <= float(fit.law_exponent) <= high
    assert low >= 0.0
    assert high <= 1.0
    assert abs(deviation_in_stderrs(fit, "law_exponent", exponent)) < 4.0
    # A single step constrains the exponent to about 0.1.
    assert float(fit.law_exponent_stderr) < 0.05
    ends = {0.0: low, 1.0: high}
    assert ends.get(exponent, exponent) == exponent  # The interval ends at the bound.


#: Parameters of a published synthetic test of trends, included with the code steadystate.
TWO_STATES = {"a": 0.0012, "b1": 0.010, "b2": 0.007, "slip_distance": 20.0}
TWO_STATES |= {"slip_distance_2": 500.0, "mu_star": 0.6}


def test_two_states_come_back_in_their_order() -> None:
    """The two states are returned in the order of their slip distances.

    The initial guess of both slip distances is closer to the longer slip distance.
    """
    loading, size = ((0.0, 1.0), (500.0, 10.0)), 2.5e-4
    times = np.concatenate([np.linspace(0.0, 499.0, 100), np.linspace(500.0, 650.0, 300)])
    friction = synthetic.two_state_friction(times, loading, TWO_STATES | {"stiffness": 0.01})
    arrays = {"time": times, "displacement": synthetic.load_point_displacement(loading, times)}
    arrays["friction"] = friction + synthetic.correlated_noise(400, 0.0, size, 1)
    one = rsfstudy.read_record(arrays).with_steps([(500.0, 500.0, 1.0, 10.0)])
    options = {"stiffness": 0.01, "slip_distance": 300.0, "noise": "white", "engine": COMPILED}
    free = (*TWO_STATES, "trend1")
    fit = rsfstudy.fit(one, laws=["two_slip_states"], free=free, **options).squeeze()
    for name in free:
        assert abs(deviation_in_stderrs(fit, name, TWO_STATES.get(name, 0.0))) < 4.0, name
    assert fit.slip_distance_ci_high < fit.slip_distance_2_ci_low


def test_laws_of_one_and_of_two_states_are_fitted_beside_each_other() -> None:
    """Laws with different parameters can be fitted in the same call.

    The results equal separate fits, and parameters of other laws are NaN.
    """
    one, options = synthetic_record(count=150), FIT_OPTIONS | {"noise": "white"}
    own = {"slip": {"b"}, "two_slip_states": {"b1", "b2", "slip_distance_2"}}
    fits = rsfstudy.fit(one, laws=list(own), **options)
    effects = set().union(*own.values())
    for law, names in own.items():
        fit, alone = fits.sel(law=law), rsfstudy.fit(one, laws=[law], **options).squeeze()
        assert {n for n in effects if np.isfinite(fit[n])} == names
        parameters = alone.parameter.values
        assert {*parameters} & effects == names
        among = fit.sel(parameter=parameters, other_parameter=parameters)
        np.testing.assert_array_equal(among.covariance, alone.covariance)
        assert np.isnan(fit.correlation).sum() == 8**2 - len(parameters) ** 2
        for name in (*parameters, "aic", "a_minus_b_stderr"):
            assert float(fit[name]) == float(alone[name]), name
        assert fit.rsf.scene == alone.rsf.scene
        assert {*fit.rsf.sample_parameters(2).data_vars} == {*parameters}


@pytest.mark.parametrize(
    ("free", "error"),
    [
        (("a", "b"), "contains no evolution effect of law='two_slip_states'"),
        (
            ("a", "law_exponent"),
            "must only contain parameters of law='slip' or law='two_slip_states'",
        ),
        (("slip_distance_2",), "contains no parameter of law='slip'"),
    ],
)
def test_parameters_fit_a_law_and_each_law_has_some(free: tuple[str, ...], error: str) -> None:
    with pytest.raises(InvalidValue, match=re.escape(error)):
        rsfstudy.fit(
            synthetic_record(count=50), laws=["slip", "two_slip_states"], free=free, **FIT_OPTIONS
        )


def test_windows_tell_the_error_of_a_trend_that_is_none_of_the_fit() -> None:
    curved, times = (
        1e-6,
        synthetic.sample_times(STEP_UP, synthetic.loading_end_time(STEP_UP) + 10.0, 200),
    )
    moved = synthetic.load_point_displacement(STEP_UP, times)
    friction = (
        synthetic.friction_and_sensitivities("slowness", times)[0] + curved * (moved - 40.0) ** 2
    )
    for seed in range(2):
        noise = synthetic.correlated_noise(200, 0.0, 2e-4, seed)
        arrays = {"time": times, "displacement": moved, "friction": friction + noise}
        one = rsfstudy.read_record(arrays).with_steps([(40.0, 40.0, 1.0, 10.0)])
        fits = rsfstudy.fit(one, laws=["slowness"], windows=3, **FIT_OPTIONS | {"noise": "white"})
        fit = fits.squeeze().isel(part=0)
        for name in SHARED:
            assert abs(deviation_in_stderrs(fit, name, EXACT_PARAMETERS[name])) > 5.0, name
            # For a trend with x^2, half of the window removes 3/4 of the error of the whole
            # window.
            told = math.hypot(fit[f"{name}_stderr"], fit[f"{name}_windows"])
            assert abs(float(fit[name]) - EXACT_PARAMETERS[name]) < 2.0 * told, name
            apart = float(fits[name].max() - fits[name].min())
            assert float(fit[f"{name}_windows"]) == pytest.approx(apart, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "free"),
    [
        ("slowness", ("a", "b", "slip_distance", "mu_star", "trend1")),
        ("family", ("a", "b", "slip_distance", "mu_star", "law_exponent")),
    ],
)
def test_noise_tells_nothing_but_friction(law: str, free: tuple[str, ...], tmp_path: Path) -> None:
    """Pure noise constrains the friction level only.

    A report does not mark such a fit as successful.
    """
    times = synthetic.sample_times(STEP_UP, synthetic.loading_end_time(STEP_UP), 200)
    arrays = {"time": times, "displacement": synthetic.load_point_displacement(STEP_UP, times)}
    arrays["friction"] = 0.6 + synthetic.correlated_noise(200, 0.5, 0.02, 0)
    one = rsfstudy.read_record(arrays).with_steps([(40.0, 40.0, 1.0, 10.0)])
    fits = rsfstudy.fit(one, laws=[law], free=free, **FIT_OPTIONS)
    fits.to_netcdf(tmp_path / "fit.nc")
    assert ' yellow">1 not identified<' in rsfstudy.report(tmp_path).read_text()
    fit = fits.squeeze()
    assert fit.rsf.fit_table().status.item() == "not_identified"
    message = str(fit.message.values).removeprefix("the record does not constrain ")
    untold = set(message.partition(";")[0].split(", "))
    assert untold == set(free) - {"mu_star", "trend1"}
    assert abs(deviation_in_stderrs(fit, "mu_star", 0.6)) < 4.0
    for name in untold - {"slip_distance"}:  # The intervals extend to the bounds of the search.
        bounds = {"a": (1e-4, 1.0), "b": (-1.0, 1.0), "law_exponent": (0.0, 1.0)}[name]
        assert (float(fit[f"{name}_ci_low"]), float(fit[f"{name}_ci_high"])) == bounds, name


def test_draws_have_the_mean_and_covariance_of_the_fit() -> None:
    fit = rsfstudy.fit(synthetic_record(seed=4), laws=["slip"], **FIT_OPTIONS).squeeze()
    drawn, names = fit.rsf.sample_parameters(20_000, seed=1), [str(n) for n in fit.parameter.values]
    degrees = float(fit.degrees_of_freedom)
    spread = np.array([drawn[n] - fit[n] for n in names]) / [
        [float(fit[f"{n}_stderr"])] for n in names
    ]
    # With 20,000 draws, the standard errors are 0.007 for means and at most 0.01 for
    # covariances. The curvature of the logarithm shifts D_c by half its relative standard error,
    # which is 0.01 here.
    assert np.abs(spread.mean(axis=1)).max() < 0.05
    exact = fit.correlation.values * degrees / (degrees - 2.0)
    assert np.abs(np.cov(spread) - exact).max() < 0.08
    assert (drawn.slip_distance > 0.0).all()
    assert np.array_equal(drawn.a, fit.rsf.sample_parameters(20_000, seed=1).a)


def test_the_table_has_the_columns_of_laboratories() -> None:
    fit = rsfstudy.fit(synthetic_record(seed=4), laws=["slip", "slowness"], **FIT_OPTIONS)
    table = fit.rsf.fit_table()
    short = ("a", "b", "a_minus_b", "Dc", "mu_0", "trend")
    columns = {*short, *(f"{n}_stderr" for n in short), "V0", "V1", "law", "window", "R2", "status"}
    assert columns <= set(table.columns)
    assert table.law.tolist() == ["slip", "slowness"]
    assert table.Dc.tolist() == fit.slip_distance.values.ravel().tolist()
    for column, name in (("a", "a"), ("Dc", "slip_distance")):
        for end in ("ci_low", "ci_high"):
            assert table[f"{column}_{end}"].tolist() == fit[f"{name}_{end}"].values.ravel().tolist()
    assert table.attrs["units"]["Dc_ci_low"] == "um"
    assert "a_minus_b_ci_low" not in table


@pytest.mark.parametrize(("freedom", "half_width"), [(3.0, "3.2"), (5.0, "2.6"), (8.0, "")])
def test_wide_intervals_are_printed_below_the_table(freedom: float, half_width: str) -> None:
    """The 97.5 % quantile of Student's t distribution is 3.18, 2.57 and 2.31."""
    fit = rsfstudy.fit(synthetic_record(seed=4, count=200), laws=["slowness"], **FIT_OPTIONS)
    fit["degrees_of_freedom"][:] = freedom
    assert fit.rsf.fit_table().status.item() == "ok"
    found = [part for part in summarise_fits(fit) if isinstance(part, str) and "half-width" in part]
    assert len(found) == bool(half_width)
    for sentence in found:
        low, high = fit.slip_distance_ci_low.item(), fit.slip_distance_ci_high.item()
        assert f"about {half_width} standard errors" in sentence
        assert f"Dc {low:.4g} to {high:.4g}" in sentence


def test_a_window_does_not_begin_within_a_hold() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IncompleteWarning)
        fit = rsfstudy.fit(
            synthetic_record(SLIDE_HOLD_SLIDE, seed=3), laws=["slowness"], **FIT_OPTIONS
        )
    hold, reloading = (fit.squeeze().sel(step=n) for n in (1, 2))
    assert (float(hold.velocity_before), float(hold.velocity_after)) == (1.0, 0.0)
    for name in SHARED:  # The reloading determines the parameters to a few per cent.
        assert abs(deviation_in_stderrs(hold, name, EXACT_PARAMETERS[name])) < 4.0, name
        assert float(hold[f"{name}_stderr"]) < 0.1 * EXACT_PARAMETERS[name], name
    assert "begins in a hold" in str(reloading.message.values)
    assert np.isnan(float(reloading.a))


@pytest.mark.parametrize("law", ["family", "slowness"])
def test_a_law_is_fitted_without_the_compiled_engine(law: str) -> None:
    free, scene = ("a", "b", "slip_distance"), {"law_exponent": 0.5} if law == "family" else {}
    options = {**FIT_OPTIONS, "engine": "scipy", "noise": "white"}
    one = synthetic_record(law=law, count=100, size=2e-4)
    fit = rsfstudy.fit(one, laws=[law], free=free, **options, **scene).squeeze()
    for name in free:
        assert abs(deviation_in_stderrs(fit, name, EXACT_PARAMETERS[name])) < 5.0, (
            name
        )  # The noise is correlated, but the fit assumes white noise.


def test_the_scene_of_a_fit_moves_as_fitted() -> None:
    """The scene of a fit reproduces the fitted friction.

    Its motion starts at the step, in units of D_c and the velocity before the step.
    """
    fit = rsfstudy.fit(synthetic_record(seed=4), laws=["slowness"], **FIT_OPTIONS).squeeze()
    rows = fit.record_time.values > 40.0
    times = (fit.record_time.values[rows] - 40.0) / float(fit.slip_distance)
    motion = rsfstudy.simulate(fit.rsf.scene, times=times, engine="compiled")
    seen, fitted = motion.friction_coefficient.values, fit.detrended_friction.values[rows]
    # The tolerance is ten times the default accuracy of 1e-7.
    assert np.abs(seen - fitted).max() < 1e-6
    # Parameters that are not free keep their values.
    held = {"b_over_a": 1.3, "a": 0.01, "slip_distance": "10 um"}
    some = rsfstudy.fit(
        synthetic_record(seed=4), laws=["slowness"], free=("a", "mu_star"), **FIT_OPTIONS | held
    )
    assert some.squeeze().rsf.scene.b == pytest.approx(0.013, rel=1e-12)
    with pytest.raises(
        InvalidValue, match="normal_stress is required, but the record has no normal stress"
    ):
        _ = fit.rsf.rig


def test_the_rig_of_a_fit_gives_the_record_back() -> None:
    """The rig of a fit reproduces the record in s and um.

    The record must contain the normal stress.
    """
    one = synthetic_record(seed=4)
    columns = {**one.columns, "normal_stress": np.full(len(one), 20.0)}
    stressed = rsfstudy.read_record(columns).with_steps(one.loading_steps)
    fit = rsfstudy.fit(stressed, laws=["slowness"], **FIT_OPTIONS).squeeze()
    rig, scene = fit.rsf.rig, fit.rsf.scene
    assert rig.normal_stress == pytest.approx(20e6)
    assert rig.slip_distance == pytest.approx(1e-6 * float(fit.slip_distance))
    assert rig.scene(stiffness=rig.stiffness).stiffness == pytest.approx(scene.stiffness)
    motion = rsfstudy.simulate(scene, duration=rig.dimensionless("5 s"), engine="compiled")
    seen = rig.in_units(motion, stress="MPa", length="um")
    rows = (fit.record_time.values > 40.0) & (fit.record_time.values < 45.0)
    at = np.interp(fit.record_time.values[rows] - 40.0, seen.time, seen.shear_stress)
    # The motion is interpolated linearly between its points.
    np.testing.assert_allclose(at / 20.0, fit.detrended_friction.values[rows], atol=1e-4)


#: Free parameters and numbers of posterior draws. The tolerance is 5 sampling errors.
POSTERIOR = [(("mu_star", "trend1"), 200), (("a", "b", "slip_distance"), 100)]


@pytest.mark.parametrize(("free", "draws"), POSTERIOR)
def test_the_posterior_is_that_of_the_errors(free: tuple[str, ...], draws: int) -> None:
    """The posterior agrees with the standard errors and correlations.

    If friction is linear in the free parameters, the agreement is exact. For a step with
    about 100 independent rows, the likelihood is nearly parabolic.
    """
    known = {"slip_distance": 10.0, "a": 0.01, "b_over_a": 1.3, "mu_star": 0.6}
    options = FIT_OPTIONS | {n: v for n, v in known.items() if n not in free}
    one = synthetic_record(seed=4, count=200)
    fit = rsfstudy.fit(one, laws=["slowness"], free=free, posterior=draws, **options).squeeze()
    drawn = fit.posterior
    spread = np.sqrt(np.diag(fit.covariance))
    off = (drawn.mean("draw") - np.array([float(fit[n]) for n in free])) / spread
    slack = 0.0 if free[0] == "mu_star" else 0.15
    assert np.abs(off).max() < 5.0 / math.sqrt(draws) + slack
    ratio = drawn.std("draw") / spread
    assert np.abs(ratio - 1.0).max() < 5.0 / math.sqrt(2.0 * draws) + slack
    correlation = np.corrcoef(drawn.values, rowvar=False)
    assert np.abs(correlation - fit.correlation).max() < 5.0 / math.sqrt(draws) + slack
    assert 1.0 < fit.autocorrelation_time < 20.0


def test_posterior_draws_are_cases_in_their_units(tmp_path: Path) -> None:
    """A slip distance of 10 um is never interpreted as 10 m.

    Tables that have lost the units of the draws are rejected.
    """
    options = FIT_OPTIONS | {"a": 0.01, "b_over_a": 1.3, "mu_star": 0.6}
    one = synthetic_record(seed=4, count=200)
    fits = rsfstudy.fit(
        one, laws=["slowness"], free=("a", "slip_distance"), posterior=50, **options
    )
    write_dataset(fits, tmp_path / "fit.nc")
    fit = rsfstudy.open(tmp_path / "fit.nc").squeeze()
    assert "units" not in fit.posterior.attrs
    assert fit.parameter_units.sel(parameter="slip_distance").item() == "um"
    drawn = fit.rsf.sample_parameters(50, posterior=True)
    for name in ("a", "slip_distance"):
        assert np.array_equal(drawn[name], fit.posterior.sel(parameter=name))
    some = fit.rsf.sample_parameters(20, seed=3, posterior=True).slip_distance.values
    assert len({*some} & {*drawn.slip_distance.values}) == 20
    selected = {name: fit.posterior.sel(parameter=name) for name in ("a", "slip_distance")}
    for table in (drawn, selected):
        assert Axis.cases(table, dimension="draw").units == {"slip_distance": "um"}
    without_units = fit.posterior.to_dataset("parameter")
    remedy = "sample_parameters(n, posterior=True)"
    for table in (
        without_units,
        without_units[["slip_distance"]],
        fit.posterior.reset_coords(drop=True).to_pandas(),
    ):
        with pytest.raises(InvalidValue, match=rf"has no units.* um\. .*{re.escape(remedy)}"):
            Axis.cases(table)
        Axis.cases(table, units={"slip_distance": "um"})
    with pytest.raises(InvalidValue, match=r"n = 51 is larger than.* 50.*posterior=51"):
        fit.rsf.sample_parameters(51, posterior=True)
    with pytest.raises(InvalidValue, match=r"requires a fit with posterior draws.*posterior=5"):
        fit.drop_vars("posterior").rsf.sample_parameters(5, posterior=True)


def test_a_chain_that_is_too_short_is_refused() -> None:
    one, options = synthetic_record(seed=4, count=200), {"laws": ["slowness"], **FIT_OPTIONS}
    enough = int(rsfstudy.fit(one, **options).rhs_evaluations.item()) + 20_000
    with pytest.warns(IncompleteWarning):
        fit = rsfstudy.fit(one, posterior=100, budget=enough, **options)
    assert fit.rsf.fit_table().status.item() == "work_budget_spent"
    assert np.isnan(fit.posterior).all()
    # The values of the fit were computed before the budget was exhausted.
    assert abs(deviation_in_stderrs(fit.squeeze(), "a", EXACT_PARAMETERS["a"])) < 4.0
    assert "no posterior draws, because" in fit.message.item()


def test_an_error_of_the_sampler_keeps_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_arguments: object) -> None:
        raise ValueError("walkers are linearly dependent")

    one, options = synthetic_record(seed=4, count=200), {"laws": ["slowness"], **FIT_OPTIONS}
    without = rsfstudy.fit(one, **options)
    monkeypatch.setattr(posterior, "sample_posterior_fit_coordinates", fail)
    fit = rsfstudy.fit(one, posterior=20, **options)
    assert fit.message.item().endswith(
        "no posterior draws, because emcee raised ValueError: walkers are linearly dependent"
    )
    assert np.isnan(fit.posterior).all()
    assert np.isnan(fit.autocorrelation_time).all()
    for name in ("status", "a", "a_ci_low", "residual"):
        assert fit[name].equals(without[name]), name
    with pytest.raises(InvalidValue, match="no posterior draws.*walkers are linearly dependent"):
        fit.rsf.sample_parameters(5, posterior=True)


def test_a_fit_without_constraint_is_kept_without_draws() -> None:
    """The walkers of emcee are linearly dependent because the slip distances are unconstrained."""
    one, options = synthetic_record(seed=4, count=200), {"laws": ["two_slip_states"], **FIT_OPTIONS}
    fit = rsfstudy.fit(one, posterior=20, **options)
    assert fit.rsf.fit_table().status.item() == "not_identified"
    assert abs(fit.a.item() - EXACT_PARAMETERS["a"]) < 1e-3
    assert np.isnan(fit.posterior).all()
    assert re.search(
        "no posterior draws, because b1.* and .* are not identified", str(fit.message.item())
    )


def test_a_posterior_without_emcee_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(
        InvalidValue, match=r"requires the package emcee.*pip install 'rsfstudy\[posterior\]'"
    ):
        rsfstudy.fit(synthetic_record(seed=4), posterior=1, **FIT_OPTIONS)
