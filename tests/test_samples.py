"""Tests of random samples and tables of cases as an axis over several fields.

The tests also cover statistics of the results.
"""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from rsfstudy.named_studies import uncertain_recurrence
from scipy.special import gammaln
from scipy.stats import lognorm, norm, truncnorm, uniform
from study_runs import run, study_of

import rsfstudy
from rsfstudy import Axis, Rig, Scene, Study, plots
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.errors import IncompleteWarning, InvalidValue
from rsfstudy.execution import cell_computation
from rsfstudy.reductions import (
    Logarithm,
    Mean,
    Quantile,
    SobolIndices,
    StandardDeviation,
    StatusShares,
    apply_reductions,
)
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.status import Status
from rsfstudy.storage import study_reconstruction
from rsfstudy.study.reductions.unit_conversion import InUnits

RECORDS = Path(uncertain_recurrence.__file__).parent / "records"
BASE = Scene(normal_stress="constant")
LOGS = {"ln_a": norm(np.log(0.01), 0.1), "ln_net": norm(np.log(0.02), 0.1)}
FIELDS = {
    "a": lambda d: np.exp(d["ln_a"]),
    "b_over_a": lambda d: 1.0 + np.exp(d["ln_net"] - d["ln_a"]),
}
RIG = Rig(
    normal_stress="5 MPa",
    slip_distance="10 um",
    reference_velocity="1 um/s",
    stiffness="0.001 MPa/um",
)


def study(*axes, base=BASE, **more):
    parts = {"measure": LinearStability(), "axes": axes, **more}
    return Study(name="sampled", title="Sampled", base=base, **parts)


# ---- what is drawn ------------------------------------------------------------------------------


def test_fields_are_functions_of_what_is_drawn():
    """Fields of the scenes are functions of the sampled variables.

    Each cell of the lattice has the fields of its sample, which are coordinates of the
    file. The declaration restores the axis.
    """
    samples = Axis.samples(LOGS, 8, 3, fields=FIELDS)
    found = run(study(Axis("law", ["slip", "slowness"]), samples))
    assert found.sizes == {"law": 2, "sample": 8}
    assert found["sample"].values.tolist() == list(range(8))
    assert found["a"].dims == found["b_over_a"].dims == ("sample",)
    critical = (found["a"] * (found["b_over_a"] - 1.0)).values
    # The closed form is (b - a) sigma/D_c, and the tolerance covers rounding and the width of a
    # root.
    for law in found["critical_stiffness"].values:
        np.testing.assert_allclose(law, critical, rtol=1e-7)
    how = json.loads(found["sample"].attrs["drawn"])
    assert (how["method"], how["n"], how["seed"]) == ("sobol", 8, 3)
    assert how["of"]["ln_a"].startswith("norm(")
    again = study_reconstruction.rebuild_study(found)
    assert again.axes[1].describe() == samples.describe()
    assert list(again.scenes()) == list(study(Axis("law", ["slip", "slowness"]), samples).scenes())


def test_the_first_samples_are_a_sample_still():
    whole = study(Axis.samples(LOGS, 16, 3, fields=FIELDS))
    half = whole.with_(sample=list(range(8)))
    assert half.axes[0].describe() == Axis.samples(LOGS, 8, 3, fields=FIELDS).describe()
    assert whole.with_(sample=[2, 5]).axes[0].describe()["values"]["a"] == [
        whole.axes[0].rows[n]["a"] for n in (2, 5)
    ]
    assert {row["a"] for row in whole.with_(a=0.012).axes[0].rows} == {0.012}
    assert not whole.with_(a=0.012).axes[0].sampling_info
    with pytest.raises(InvalidValue, match="point = 16.0 does not exist .* from 0 to 15"):
        whole.with_(sample=16)
    with pytest.raises(InvalidValue, match="'a' varies .*must be a single value for all points"):
        whole.with_(a=[0.01, 0.02])


@pytest.mark.parametrize("method", ["sobol", "latin_hypercube", "random"])
def test_estimates_with_their_covariance(method):
    """Normal samples have the requested means and covariances.

    The tolerance is five standard errors of independent samples, and other methods have
    smaller errors. The correlation differs from 0 by 45 standard errors.
    """
    covariance = np.array([[4e-6, -3.6e-6], [-3.6e-6, 9e-6]])
    axis = Axis.samples({"a": 0.1, "mu_star": 0.6}, 4096, 1, method=method, covariance=covariance)
    drawn = np.array([[row["a"], row["mu_star"]] for row in axis.rows]).T
    error = np.sqrt(np.diag(covariance) / 4096)
    assert (abs(drawn.mean(axis=1) - (0.1, 0.6)) < 5.0 * error).all()
    assert np.corrcoef(drawn)[0, 1] == pytest.approx(-0.6, abs=5.0 * (1.0 - 0.36) / 64.0)
    assert np.var(drawn, axis=1) == pytest.approx(np.diag(covariance), rel=5.0 * np.sqrt(2 / 4096))


def test_distributions_keep_their_own_quantiles_where_they_are_correlated():
    drawn = {"a": lognorm(0.3, scale=0.01), "alpha": truncnorm(-2.0, 2.0, 0.5, 0.1)}
    axis = Axis.samples(drawn, 1024, 2, covariance=[[1.0, 0.9], [0.9, 1.0]])
    for name, of in drawn.items():
        values = np.sort([row[name] for row in axis.rows])
        # Only one in 1e5 independent samples exceeds this Kolmogorov distance.
        assert abs(of.cdf(values) - (np.arange(1024) + 0.5) / 1024).max() < 2.5 / 32.0
    ranks = pd.DataFrame(axis.rows).corr("spearman").iloc[0, 1]
    # The rank correlation of normal scores with a correlation of 0.9 is 6/pi asin(0.45).
    assert ranks == pytest.approx(6.0 / np.pi * np.arcsin(0.45), abs=0.03)


def test_samples_for_sobol_indices_share_coordinates():
    """The samples are A, B, and A with one coordinate of B at a time."""
    axis = Axis.samples({"a": norm(0.01, 1e-3), "mu_star": norm(0.6, 0.1)}, 4, 1, method="saltelli")
    blocks = np.array([list(row.values()) for row in axis.rows]).reshape(4, 4, 2)
    a, b, first, second = blocks.transpose(1, 0, 2)
    assert (first == np.stack([b[:, 0], a[:, 1]], axis=1)).all()
    assert (second == np.stack([a[:, 0], b[:, 1]], axis=1)).all()
    assert (a != b).all()
    assert axis.sampling_info["n"] == 16


# ---- tables -------------------------------------------------------------------------------------

TABLE = {"a": [0.010, 0.012, 0.010], "b_over_a": [1.5, 1.4, 1.5]}


@pytest.mark.parametrize(
    "table", [TABLE, pd.DataFrame(TABLE), xr.Dataset({n: ("draw", v) for n, v in TABLE.items()})]
)
def test_the_rows_of_a_table_are_cases(table):
    found = run(study(Axis.cases(table)))
    assert found["case"].values.tolist() == [0, 1, 2]
    np.testing.assert_allclose(found["critical_stiffness"], [0.005, 0.0048, 0.005], rtol=1e-7)
    assert study_reconstruction.rebuild_study(found).axes[0].rows == Axis("case", TABLE).rows


def _with_units(tmp_path):
    """Return the same table from all supported sources of units."""
    (tmp_path / "cases.csv").write_text("a (1), slip_distance (um)\n.01, 5\n.012, 10\n")
    columns = {"a": [0.01, 0.012], "slip_distance": [5.0, 10.0]}
    dataset = xr.Dataset({n: ("draw", v) for n, v in columns.items()})
    dataset["slip_distance"].attrs["units"] = "um"
    return [
        RIG.axis("case", rsfstudy.read_table(tmp_path / "cases.csv")),
        Axis.cases(pd.read_csv(tmp_path / "cases.csv")),
        RIG.axis("case", dataset),
        Axis.cases(columns, units={"slip_distance": "um"}),
        Axis.cases(
            dataset.rename(slip_distance="length"), fields={"a": "a", "slip_distance": "length"}
        ),
        RIG.axis("case", {"a": columns["a"], "slip_distance": ["5 um", "0.01 mm"]}),
    ]


def test_a_table_in_units_of_a_rig(tmp_path):
    """The stiffness K = k D_c/sigma_* is the same for all sources of units."""
    base = RIG.scene(a=0.01, b_over_a=1.5, normal_stress="constant")
    for axis in _with_units(tmp_path):
        declared = study(axis, base=base, rig=RIG)
        scenes = list(declared.scenes())
        assert [scene.stiffness for scene in scenes] == pytest.approx([0.001, 0.002], rel=1e-12)
        assert [scene.a for scene in scenes] == [0.01, 0.012]
        found = run(declared)
        assert found["slip_distance"].attrs["units"] in ("um", "m")
        assert study_reconstruction.rebuild_study(found).describe() == declared.describe()


# ---- from a fit ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fitted():
    """Return the fit of the shipped record that uncertain_recurrence uses."""
    record = rsfstudy.read_record(RECORDS / "basalt.txt")
    return rsfstudy.fit(record, stiffness="0.0013 1/um", laws=["slowness"])


def test_the_estimates_that_uncertain_recurrence_states(fitted):
    """The four-digit constants of the study agree with the fit.

    The tolerance is half of the last digit. A tolerance of the fit that is ten times
    smaller changes no digit up to the sixth.
    """
    stated = uncertain_recurrence
    names = list(stated.ESTIMATES)
    assert fitted["parameter"].values.tolist()[: len(names)] == names
    found = [fitted[name].item() for name in names]
    assert list(stated.ESTIMATES.values()) == pytest.approx(found, rel=1.1e-4)
    covariance = fitted["covariance"].values.squeeze()[: len(names), : len(names)]
    np.testing.assert_allclose(stated.COVARIANCE, covariance, rtol=2.5e-4)


# ---- what is refused ----------------------------------------------------------------------------


def test_a_sample_beyond_what_is_meaningful_is_told_before_work_starts(monkeypatch):
    monkeypatch.setattr(cell_computation, "compute_cell", None)
    drawn = {"a": norm(0.01, 0.01), "mu_star": norm(0.6, 0.3)}
    sampled = study(Axis("law", ["slip", "slowness"]), Axis.samples(drawn, 64, 1))
    rows = sampled.axes[1].rows
    by_a = sum(row["a"] <= 0.0 for row in rows)
    lost = sum(row["a"] <= 0.0 or row["mu_star"] <= 0.0 for row in rows)
    told = rf"^{lost} of 64 points of the axis sample \(fraction {lost / 64:.2g}\) give invalid "
    told += rf"scenes because of a \({by_a}\)"
    with pytest.raises(InvalidValue, match=told):
        run(sampled)
    lengths = Axis.samples({"slip_distance": norm(1.0, 1.0)}, 8, 1, units={"slip_distance": "um"})
    with pytest.raises(
        InvalidValue, match=r"slip_distance must be positive, but \d of 8 values are not"
    ):
        study(lengths, base=RIG.scene(a=0.01, b_over_a=1.5), rig=RIG)


# ---- what comes of it ---------------------------------------------------------------------------

RANDOM = np.random.default_rng(37)


def measured(values, status=0, **attrs) -> xr.Dataset:
    """Return a dataset of samples whose errors are 1e-6."""
    values = np.asarray(values, dtype=float)
    dims = ("law", "sample")[2 - values.ndim :]
    return xr.Dataset(
        {
            "y": (dims, values, attrs),
            "y_error": (dims, np.full(values.shape, 1e-6)),
            "status": (dims, np.broadcast_to(np.int8(status), values.shape).copy()),
        },
        coords={"sample": np.arange(values.shape[-1])},
    )


STATISTICS = (Mean("mean", "y"), StandardDeviation("sd", "y"), Quantile("low", "y", level=0.2))


def test_statistics_with_the_errors_of_sampling():
    """Statistics agree with NumPy, and standard errors with the scatter.

    The scatter over 500 sets of samples has an accuracy of 3 %, and the tolerance is about
    four times this value.
    """
    values = RANDOM.normal(3.0, 0.5, (500, 200))
    found = apply_reductions(measured(values), STATISTICS)
    np.testing.assert_allclose(found["mean"], values.mean(axis=1), rtol=1e-13)
    np.testing.assert_allclose(found["sd"], values.std(axis=1, ddof=1), rtol=1e-12)
    np.testing.assert_allclose(found["low"], np.quantile(values, 0.2, axis=1), rtol=1e-12)
    for name in ("mean", "sd", "low"):
        assert float(found[f"{name}_stderr"].mean()) == pytest.approx(
            float(found[name].std()), rel=0.13
        )
        # The numerical error is reported separately. The error of a mean is a mean of the
        # errors, and the error of a quantile is at most the largest error.
        assert float(found[f"{name}_error"].max()) <= 1.0001e-6
        assert found[f"{name}_points"].values.tolist() == [200] * 500


@pytest.mark.parametrize("n", [3, 5, 12])
def test_the_error_of_a_standard_deviation_is_honest_of_few_samples(n):
    """The standard error is not too small for a few samples.

    For normal samples, the exact scatter is sigma (1 - c4^2)^1/2. The jackknife
    overestimates it by up to a sixth for three samples. The scatter over 20,000 sets has an
    accuracy of 2 %.
    """
    values = np.random.default_rng(5).normal(0.0, 1.0, (20_000, n))
    found = apply_reductions(measured(values), (StandardDeviation("sd", "y"),))
    c4 = np.sqrt(2.0 / (n - 1)) * np.exp(gammaln(n / 2) - gammaln((n - 1) / 2))
    assert 0.98 < float(found["sd_stderr"].mean()) / np.sqrt(1.0 - c4**2) < 1.2
    pair = apply_reductions(measured(values[:3, :2]), (StandardDeviation("sd", "y"),))
    assert np.isnan([pair["sd"], pair["sd_stderr"]]).all()
    assert pair["sd"].attrs["refused"] == "requires at least 3 samples with a value"


def test_failed_samples_are_refused_and_shares_tell_of_them():
    status = np.zeros(20, dtype=np.int8)
    status[3], status[5:8] = Status.CELL_RAISED, Status.NO_LIMIT_CYCLE
    kinds = (*STATISTICS, Logarithm("log", "y"), StatusShares("share", "log"))
    lattice = measured(np.arange(20.0), status)
    found = apply_reductions(lattice, kinds)
    for name in ("mean", "sd", "low"):
        assert np.isnan([found[name], found[f"{name}_error"]]).all()
        assert found[name].attrs["refused"] == "samples failed or are missing"
    for shares in (found, apply_reductions(lattice, kinds, despite_failures=True)):
        told = shares["share"].to_series()
        assert told[told > 0.0].to_dict() == {
            "ok": 0.8, "no_limit_cycle": 0.15, "cell_raised": 0.05,
        }  # fmt: skip
        assert "refused" not in shares["share"].attrs
    assert float(apply_reductions(lattice, kinds, despite_failures=True)["mean"]) > 0.0
    lattice["status"][0] = Status.PENDING
    assert np.isnan(apply_reductions(lattice, kinds)["share"]).all()


def test_a_run_warns_of_what_reductions_refuse():
    axis = Axis.samples({"b_over_a": norm(2.0, 0.1)}, 2, seed=1)
    means = (Mean("middle", "critical_displacement"),)
    study = study_of("few", CriticalStep("displacement_step"), axis, base=BASE, reductions=means)
    with pytest.warns(
        IncompleteWarning, match="2 of 2 cells failed: .*; no middle: samples failed or ar"
    ):
        rsfstudy.run(study, workers=0, output=None, progress=False, budget=60, keep_going=True)


def test_too_few_samples_for_a_quantile():
    found = apply_reductions(measured(np.arange(18.0)), (Quantile("q", "y", level=0.05),))
    assert np.isnan(found["q"])
    assert found["q"].attrs["refused"] == "requires at least 19 samples with a value"
    for level in (1.0, "half"):
        with pytest.raises(InvalidValue, match="'level' must be between 0 and 1"):
            Quantile("q", "y", level=level)
    with pytest.raises(InvalidValue, match="over = 'draw' is not a dimension of y"):
        apply_reductions(measured(np.arange(18.0)), (Mean("m", "y", over="draw"),))


def test_a_mean_over_other_scales_is_refused_and_told_in_units():
    """Times in D_c/V_* have no mean if D_c varies, but times in s do."""
    lattice = measured([2.0, 2.0, 2.0], long_name="time", scale="D_c/V_*").assign_coords(
        slip_distance=("sample", [5.0, 10.0, 30.0], {"units": "um"}),
        sigma_star=((), 5.0, {"units": "MPa"}),
        reference_velocity=((), 2e-6, {"units": "m s-1"}),
        reference_rate=("sample", 2.0 / np.array([5.0, 10.0, 30.0]), {"units": "s-1"}),
    )
    found = apply_reductions(
        lattice, (Mean("m", "y"), InUnits("t", "y", units="min"), Mean("mean_t", "t"))
    )
    assert np.isnan(found["m"])
    assert found["m"].attrs["refused"] == "y is in units of D_c, which varies between the samples"
    assert found["t"].values * 60.0 == pytest.approx([5.0, 10.0, 30.0], rel=1e-14)
    assert float(found["mean_t"]) == pytest.approx(0.25, rel=1e-14)
    assert {found[f"mean_t{end}"].attrs["units"] for end in ("", "_stderr", "_error")} == {"min"}


def saltelli(function, n, count=3, **more) -> xr.Dataset:
    """Return a function of independent uniform variables.

    The variables are between -pi and pi.
    """
    names = [f"x{i}" for i in range(count)]
    even = uniform(-np.pi, 2.0 * np.pi)
    axis = Axis.samples(dict.fromkeys(names, even), n, 5, method="saltelli", dimension="draw")
    drawn = {name: np.array([row[name] for row in axis.rows]) for name in names}
    found = measured(function(*drawn.values()), **more).rename(sample="draw")
    found["draw"].attrs["drawn"] = json.dumps(axis.sampling_info)
    return found


def test_sobol_indices_of_a_function_that_has_them_in_closed_form():
    """The confidence intervals contain the closed forms.

    The function is sin x1 + 7 sin(x2)^2 + 0.1 x3^4 sin x1 of Ishigami and Homma (1990).
    With this seed, all six 95 % intervals contain the exact values, and all intervals are
    narrow.
    """
    lattice = saltelli(
        lambda x, y, z: np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), 1024
    )
    found = apply_reductions(lattice, (SobolIndices("share", "y", over="draw"),))
    alone = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2
    second, crossed = 49.0 / 8.0, 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = alone + second + crossed
    exact = {
        "first_order": np.array([alone, second, 0.0]) / variance,
        "total": np.array([alone + crossed, second, crossed]) / variance,
    }
    for order, values in exact.items():
        low, high = (found[f"share_{order}_{end}"] for end in ("ci_low", "ci_high"))
        assert ((low <= values) & (values <= high)).all()
        assert float((high - low).max()) < 0.3
        np.testing.assert_allclose(found[f"share_{order}"], values, atol=0.05)
    assert found["input"].values.tolist() == ["x0", "x1", "x2"]
    assert "note" not in found["share_total"].attrs
    few = saltelli(lambda x, y, z: np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), 16)
    found = apply_reductions(few, (SobolIndices("share", "y", over="draw"),))
    for result in (found["share_first_order"], found["share_total"]):
        assert re.match(
            r"share: the Sobol indices are not accurate, because a 95 % confidence interval is "
            r"[\d.]+ wide",
            result.attrs["note"],
        )


def test_a_first_order_index_above_the_total_index_is_noted():
    """A first-order index never exceeds the total index of the same quantity."""
    indices = np.array([[[0.6, 0.5, 0.7], [0.3, 0.2, 0.4]], [[0.3, 0.2, 0.4], [0.3, 0.2, 0.4]]])
    note = SobolIndices("share", "y")._describe_inaccurate_indices(
        np.moveaxis(indices, 0, -1), ["a", "b"]
    )
    assert "the first-order index of a exceeds the total index" in note


def test_sobol_indices_are_refused():
    of = (SobolIndices("share", "y", over="draw"),)
    lost = saltelli(lambda x, y, z: np.where(x > 3.0, np.nan, x), 64)
    found = apply_reductions(lost, of)
    count = int(lost["y"].isnull().sum())
    assert np.isnan(found["share_total"]).all()
    why = f"{count} of 320 cells have no value, but the indices require all cells"
    assert found["share_total"].attrs["refused"].startswith(why)
    whole = saltelli(lambda x, y, z: x, 64)
    for part in (whole.isel(draw=slice(0, 310)), whole.isel(draw=slice(0, 15))):
        with pytest.raises(InvalidValue, match="over = 'draw' was not drawn for Sobol indices"):
            apply_reductions(part, of)
    apply_reductions(whole.isel(draw=slice(0, 160)), of)  # 32 points are a valid sample.
    with pytest.raises(InvalidValue, match="over = 'sample' is not a dimension of y"):
        apply_reductions(whole, (SobolIndices("share", "y"),))


# ---- figures ------------------------------------------------------------------------------------


def test_samples_are_drawn_as_histograms_and_scatters():
    """Samples are plotted as a matrix of histograms and scatter plots.

    The matrix contains the output and the fields, with few ticks for any number of samples.
    """
    laws = Axis("law", ["slip", "slowness"])
    found = run(study(laws, Axis.samples(LOGS, 256, 3, fields=FIELDS)), engine="compiled")
    drawn = plots.draw_figure(found)
    names = ("a", "b_over_a", "critical_stiffness")
    places = [(column, row) for row in range(3) for column in range(row + 1)]
    for (column, row), axes in zip(places, drawn.axes, strict=True):
        x, y = names[column], names[row]
        assert max(len(axes.get_xticks()), len(axes.get_yticks())) < 8
        if x == y:
            bars = sum(bar.get_height() for bar in axes.patches)
            assert bars == 256 * (2 if x == "critical_stiffness" else 1)
        else:
            line = axes.lines[-1]
            np.testing.assert_array_equal(line.get_xdata(), found[x].values.ravel()[-256:])
            np.testing.assert_array_equal(line.get_ydata(), found[y].values.ravel()[-256:])
    with pytest.raises(InvalidValue, match="variable 'nothing'.*critical_stiffness"):
        plots.draw_figure(found, variable="nothing")
