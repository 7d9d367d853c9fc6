"""Tests of reductions and claims on synthetic datasets with known results."""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies.bounded_slip import PathSeparation
from rsfstudy.named_studies.stability_map import CycleRegionEdge
from scipy.stats import linregress
from study_runs import example_claim

from rsfstudy.errors import InvalidValue
from rsfstudy.reductions import (
    Boundary,
    ClosedFormRatio,
    Difference,
    Inverse,
    LinearFit,
    PowerLaw,
    ProportionalFit,
    Range,
    Reduction,
    RelativeDifference,
    SemilogFit,
    apply_reductions,
)
from rsfstudy.status import Status
from rsfstudy.study.claims import Claim, build_verdict_table

X = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
FIT = ProportionalFit(
    name="zeta",
    of="critical_velocity_ratio",
    on="a_over_b_minus_a",
    intercept=1.0,
    within=(0.25, 1.0),
)


def lattice(values, status=None) -> xr.Dataset:
    values = np.asarray(values, dtype=float)
    codes = np.zeros(values.shape, dtype=np.int8) if status is None else np.asarray(status, np.int8)
    dims = ("case", "b_over_a")[-values.ndim :]
    return xr.Dataset(
        {"critical_velocity_ratio": (dims, values), "status": (dims, codes)},
        coords={
            "b_over_a": 1.0 + 1.0 / X,
            "a_over_b_minus_a": ("b_over_a", X),
            **({"case": ["reference", "other"]} if values.ndim == 2 else {}),
        },
    )


@settings(max_examples=30)
@given(st.lists(st.floats(-0.1, 0.1), min_size=5, max_size=5))
def test_fit_agrees_with_numpy(noise):
    """Slope and standard error agree with the least squares of NumPy."""
    values = 1.0 + 0.7 * X + np.array(noise)
    result = apply_reductions(lattice(values), (FIT,))
    x, y = X[:3], values[:3] - 1.0
    (slope,), (residual,), _rank, _s = np.linalg.lstsq(x[:, None], y, rcond=None)
    assert float(result.zeta) == pytest.approx(slope, rel=1e-12)
    assert float(result.zeta_stderr) == pytest.approx(
        np.sqrt(residual / 2 / (x @ x)), rel=1e-9, abs=1e-15
    )
    assert float(result.zeta_misfit) == pytest.approx(np.abs(y - slope * x).max(), abs=1e-14)


def test_a_slope_per_decade_is_that_over_the_logarithm():
    """The slope per decade equals a linear fit against log10(x).

    A point at x = 0 is omitted.
    """
    noise = np.array([0.02, -0.03, 0.01, 0.04, -0.02])
    values = 2.0 + 0.3 * np.log10(X) + noise
    fit = SemilogFit(name="rate", of="critical_velocity_ratio", on="a_over_b_minus_a")
    result, expected = apply_reductions(lattice(values), (fit,)), linregress(np.log10(X), values)
    assert float(result.rate) == pytest.approx(expected.slope, rel=1e-12)
    assert float(result.rate_stderr) == pytest.approx(expected.stderr, rel=1e-12)
    assert result.rate.attrs["comment"].endswith("per decade of a_over_b_minus_a")
    moved = lattice(values).assign_coords(a_over_b_minus_a=("b_over_a", [0.0, *X[1:]]))
    result, expected = apply_reductions(moved, (fit,)), linregress(np.log10(X[1:]), values[1:])
    assert float(result.rate) == pytest.approx(expected.slope, rel=1e-12)
    assert int(result.rate_points) == 4


def test_the_exponent_of_a_power_law_is_the_slope_of_its_logarithms():
    """The exponent equals a linear fit of the logarithms.

    Exact power laws have exact exponents, and values that are not positive are omitted.
    """
    noise = np.array([1.02, 0.97, 1.01, 1.04, 0.98])
    fit = PowerLaw(name="n", of="critical_velocity_ratio", on="a_over_b_minus_a")
    exact = apply_reductions(lattice(3.0 * X**-1.25), (fit,))
    assert float(exact.n) == pytest.approx(-1.25, rel=1e-14)
    result, logs = apply_reductions(lattice(X**-1.25 * noise), (fit,)), np.log(X)
    expected = linregress(logs, -1.25 * logs + np.log(noise))
    assert float(result.n) == pytest.approx(expected.slope, rel=1e-12)
    assert float(result.n_stderr) == pytest.approx(expected.stderr, rel=1e-9)
    lost = apply_reductions(lattice([-1.0, *X[1:] ** -1.25]), (fit,))
    assert (float(lost.n), int(lost.n_points)) == (pytest.approx(-1.25, rel=1e-14), 4)


CHAIN = (
    Difference(name="gain", of="critical_velocity_ratio", along="case", reference="reference"),
    RelativeDifference(
        name="lowering", of="critical_velocity_ratio", along="case", reference="reference"
    ),
    LinearFit(name="slope", of="gain", on="a_over_b_minus_a"),
    Range(name="apart", of="gain", over="a_over_b_minus_a"),
    Boundary(name="edge", of="gain", on="a_over_b_minus_a", level=2.5),
)


@pytest.mark.parametrize(
    "place", [("reference", 1), ("other", 1)], ids=["of the reference", "of the cell"]
)
@pytest.mark.parametrize("failure", [Status.UNVERIFIED, Status.INTEGRATION_FAILED])
def test_numbers_that_failures_leave_behind_reach_no_result(failure, place):
    """Values of failed cells do not affect any reduction.

    Results that do not depend on the failed cells are unchanged.
    """
    values = np.array([1.0 + X, 1.0 + 2.0 * X])
    row = ["reference", "other"].index(place[0])
    clean = apply_reductions(lattice(values), CHAIN)
    assert float(clean.slope.sel(case="other")) == pytest.approx(1.0)
    codes = np.zeros(values.shape)
    values[row, place[1]], codes[row, place[1]] = 1e6, failure
    result = apply_reductions(lattice(values, codes), CHAIN)
    for name in ("gain", "lowering"):
        assert np.isnan(result[name].sel(case="other")[1])
        assert "failed" in result[name].attrs["refused"]
        others = [0, 2, 3, 4]
        np.testing.assert_array_equal(result[name][:, others], clean[name][:, others])
    for name in ("slope", "apart", "edge"):
        assert np.isnan(result[name].sel(case="other"))
        assert "failed" in result[name].attrs["refused"]
    left_out = apply_reductions(lattice(values, codes), CHAIN, despite_failures=True)
    assert float(left_out.slope.sel(case="other")) == pytest.approx(1.0)
    assert int(left_out.slope_points.sel(case="other")) == 4


@pytest.mark.parametrize("name", ["critical_velocity_ratio", "status", "b_over_a"])
def test_a_reduction_replaces_nothing(name):
    with pytest.raises(InvalidValue, match=f"would replace the variable '{name}'"):
        apply_reductions(lattice(1.0 + X), (Range(name, "critical_velocity_ratio", "b_over_a"),))


def test_failed_cells_outside_of_the_support_do_not_matter():
    codes = np.zeros(5)
    codes[4] = Status.INTEGRATION_FAILED
    result = apply_reductions(lattice(1.0 + 0.5 * X, codes), (FIT,))
    assert float(result.zeta) == pytest.approx(0.5)
    assert "refused" not in result.zeta.attrs


def test_relative_difference():
    compare = RelativeDifference(
        name="lowering", of="critical_velocity_ratio", along="case", reference="reference"
    )
    result = apply_reductions(lattice([2.0 * X, 1.5 * X]), (compare,))
    np.testing.assert_allclose(result.lowering.sel(case="other"), 0.25, rtol=1e-15)
    without = apply_reductions(lattice([2.0 * X, 1.5 * X]).isel(case=[1]), (compare,))
    assert "lowering" not in without


def test_a_range_without_points_gives_nothing():
    outside = lattice(1.0 + 0.5 * X).isel(b_over_a=[3, 4])
    assert "zeta" not in apply_reductions(outside, (FIT,))


@settings(max_examples=30)
@given(st.floats(-2.0, 2.0), st.lists(st.floats(-0.1, 0.1), min_size=5, max_size=5))
def test_linear_fit_agrees_with_scipy(slope, noise):
    values = 0.3 + slope * X + np.array(noise)
    assume(np.ptp(values) > 1e-6)  # The correlation of a constant is undefined.
    fit = LinearFit(name="slope", of="critical_velocity_ratio", on="a_over_b_minus_a")
    result, theirs = apply_reductions(lattice(values), (fit,)), linregress(X, values)
    assert float(result.slope) == pytest.approx(theirs.slope, rel=1e-9, abs=1e-14)
    # SciPy computes the standard error from 1 - r**2, which loses half of the digits.
    assert float(result.slope_stderr) == pytest.approx(theirs.stderr, rel=1e-6, abs=3e-8)


def claim(**fields) -> Claim:
    usual = {"variable": "critical_velocity_ratio", "where": {"a_over_b_minus_a": 1.0}}
    return example_claim(**usual | {"published": 2.0} | fields)


@pytest.mark.parametrize(
    ("relation", "value", "verdict"),
    [
        ("equals", 2.09, "reproduced"),
        ("equals", 2.11, "differs"),
        ("equals", 1.89, "differs"),
        ("below", 2.09, "reproduced"),
        ("below", 2.11, "differs"),
        ("above", 1.91, "reproduced"),
        ("above", 1.89, "differs"),
        ("equals", np.nan, "undecided"),
    ],
)
def test_verdicts(relation, value, verdict):
    table = build_verdict_table(lattice(np.full(5, value)), [claim(relation=relation)], {})
    assert table.verdict[0] == verdict
    assert table.verdict_changed[0] == (verdict != "reproduced")


def test_an_expected_difference_does_not_move():
    off = [claim(published=3.0, expected="differs", difference_reason="a misprint")]
    assert not build_verdict_table(lattice(np.full(5, 2.0)), off, {}).verdict_changed[0]
    assert build_verdict_table(lattice(np.full(5, 3.0)), off, {}).verdict_changed[0]


PENDING = lattice(np.full(5, 2.0), np.full(5, Status.PENDING))


@pytest.mark.parametrize(
    ("dataset", "of", "overrides", "verdict"),
    [
        (lattice(np.full((2, 5), 2.0)), {}, {}, "not applicable"),
        (lattice(np.full(5, 9.0)), {"where": {"a_over_b_minus_a": 0.7}}, {}, "not applicable"),
        (lattice(np.full(5, 9.0)), {}, {"stiffness_ratio": 1.1}, "not applicable"),
        (lattice(np.full(5, 9.0)), {}, {"b_over_a": [2.0]}, "differs"),
        (PENDING, {"variable": "status", "where": {"b_over_a": 2.0}}, {}, "undecided"),
        (apply_reductions(lattice(1.0 + X), (FIT,)),
         {"variable": "zeta", "where": {}, "published": 1.0}, {}, "reproduced"),
        # The fit used another axis.
        (apply_reductions(lattice(1.0 + X), (FIT,)),
         {"variable": "zeta", "where": {}, "published": 1.0},
         {"b_over_a": [2.0]}, "not applicable"),
    ],
    ids=["dimensions", "not a point", "scene", "axis", "not known yet", "reduced", "changed axis"],
)  # fmt: skip
def test_where_claims_apply(dataset, of, overrides, verdict):
    table = build_verdict_table(dataset, [claim(**of)], overrides)
    assert table.verdict[0] == verdict
    assert table.verdict_changed[0] == (verdict in ("differs", "undecided"))


# ---- boundaries, levels, closed forms, paths ----------------------------------------------------

V0 = np.array([1.0, 1.5, 2.0, 2.5, 3.0])
BOUNDARY = Boundary(name="edge", of="unstable", on="load_velocity_ratio")


def answers(values, status=None) -> xr.Dataset:
    values = np.atleast_2d(np.asarray(values, dtype=float))
    codes = np.zeros(values.shape) if status is None else np.atleast_2d(status)
    dims = ("row", "load_velocity_ratio")
    return xr.Dataset(
        {"unstable": (dims, values), "status": (dims, codes.astype(np.int8))},
        coords={"load_velocity_ratio": V0, "row": np.arange(len(values))},
    )


@settings(max_examples=30)
@given(st.floats(1.0, 3.0), st.permutations(range(5)))
def test_the_bracket_holds_the_boundary_in_any_order_of_the_axis(edge, order):
    assume(edge not in V0)
    lattice = answers(edge < V0).isel(load_velocity_ratio=list(order))
    result = apply_reductions(lattice, (BOUNDARY,)).isel(row=0)
    assert float(result.edge_stable) < edge < float(result.edge_unstable)
    assert abs(float(result.edge) - edge) <= float(result.edge_error)
    assert float(result.edge_error) == pytest.approx(0.25)
    assert int(result.edge_crossings) == 1


def test_a_boundary_downward_has_its_unstable_side_below():
    result = apply_reductions(answers([1, 1, 0, 0, 0]), (BOUNDARY,)).isel(row=0)
    assert (float(result.edge_unstable), float(result.edge_stable)) == (1.5, 2.0)
    assert float(result.edge) == 1.75


def test_rows_without_a_single_boundary_give_no_number_but_say_what_they_saw():
    lattice = answers([[0, 0, 0, 0, 0], [1, 1, 1, 1, 1], [0, 1, 0, 1, 1]])
    result = apply_reductions(lattice, (BOUNDARY,))
    assert result.edge.isnull().all()
    assert result.edge_crossings.values.tolist() == [0, 0, 3]
    assert float(result.edge_stable[0]) == 3.0
    assert np.isnan(result.edge_unstable[0])
    assert float(result.edge_unstable[1]) == 1.0


def test_cells_without_an_answer_widen_the_bracket_and_failed_ones_refuse_it():
    left_out = answers([0, 0, np.nan, 1, 1], [0, 0, Status.NORM_BELOW_LOADING_RATE, 0, 0])
    result = apply_reductions(left_out, (BOUNDARY,)).isel(row=0)
    assert (float(result.edge_stable), float(result.edge_unstable)) == (1.5, 2.5)
    failed = answers([0, 0, np.nan, 1, 1], [0, 0, Status.WORK_BUDGET_SPENT, 0, 0])
    result = apply_reductions(failed, (BOUNDARY,)).isel(row=0)
    assert np.isnan(result.edge)
    assert "failed" in result.edge.attrs["refused"]


@settings(max_examples=30)
@given(st.floats(0.2, 3.0), st.floats(1.2, 8.0))
def test_a_level_of_a_power_law_is_inverted(power, level):
    """A power law is inverted exactly, because it is linear in logarithms."""
    x = np.geomspace(1.0, 100.0, 9)
    dataset = xr.Dataset(
        {"y": ("x", x**power), "status": ("x", np.zeros(9, np.int8))}, coords={"x": x}
    )
    level = min(level, 0.9 * 100.0**power)
    found = apply_reductions(
        dataset, (Inverse(name="at", of="y", on="x", levels=level, uncertainty=0.01),)
    )
    assert float(found["at"]) == pytest.approx(level ** (1.0 / power), rel=1e-9)
    assert float(found["at_error"]) == pytest.approx(float(found["at"]) * 0.01 / power, rel=0.02)


#: Smooth monotonic functions that are curved in logarithms, and their inverses.
CURVED = {
    "expm1": (np.expm1, np.log1p),
    "sinh": (np.sinh, np.arcsinh),
    "falling": (lambda x: np.exp(-x), lambda y: -np.log(y)),
    "saturating": (lambda x: x / (1.0 + x), lambda y: y / (1.0 - y)),
}


def inverted(x, y, level, errors=0.0):
    found = apply_reductions(
        xr.Dataset(
            {
                "y": ("x", y),
                "y_error": ("x", np.zeros(len(x)) + errors),
                "status": ("x", np.zeros(len(x), np.int8)),
            },
            coords={"x": x},
        ),
        (Inverse(name="at", of="y", on="x", levels=level),),
    )
    return float(found["at"]), float(found["at_error"])


@settings(max_examples=100)
@given(
    st.sampled_from(sorted(CURVED)),
    st.lists(st.floats(1.3, 2.5), min_size=4, max_size=7),
    st.floats(0.02, 0.98),
)
def test_the_error_of_an_inverse_covers(name, ratios, share):
    function, inverse = CURVED[name]
    x = 0.1 * np.cumprod(ratios)
    truth = x[0] * (x[-1] / x[0]) ** share
    at, error = inverted(x, function(x), float(function(truth)))
    # The additional tolerance covers rounding only.
    assert abs(at - float(inverse(function(truth)))) <= error + 1e-12 * truth


def test_an_inverse_whose_bracket_stays_is_not_taken_for_exact():
    x = np.array([0.1, 0.2, 0.4, 0.8, 1.2, 2.4])
    at, error = inverted(x, np.expm1(x), 5.0)
    assert abs(at - np.log(6.0)) <= error < 0.3  # The limit is a quarter of the bracket.


@pytest.mark.parametrize("name", sorted(CURVED))
def test_a_level_that_a_cell_has_is_reached_at_that_cell(name):
    """The inverse at the value of a cell is the position of the cell.

    The level is also changed by a rounding error, where two pieces of the interpolant meet.
    If the slope is 0 there, the position changes by the square root of the rounding error.
    """
    x = np.array([0.3, 0.5, 1.1, 1.3, 2.9, 4.0])
    values = CURVED[name][0](x)
    for place, value in zip(x, values, strict=True):
        assert inverted(x, values, value)[0] == pytest.approx(place, rel=4e-16)
        for level in np.nextafter(value, [values[0], values[-1]]):
            assert inverted(x, values, level)[0] == pytest.approx(place, rel=1e-7)


def test_levels_by_label_and_levels_out_of_reach():
    x = np.geomspace(1.0, 100.0, 9)
    dataset = xr.Dataset(
        {"y": (("c", "x"), np.stack([x, x, x])), "status": (("c", "x"), np.zeros((3, 9), np.int8))},
        coords={"x": x, "c": ["a", "b", "c"]},
    )
    levels = {"a": 10.0, "b": 1e3}
    found = apply_reductions(
        dataset, (Inverse(name="at", of="y", on="x", levels=levels, along="c"),)
    )
    assert float(found["at"].sel(c="a")) == pytest.approx(10.0)
    assert found["at"].sel(c=["b", "c"]).isnull().all()


def test_over_a_closed_form():
    dataset = lattice(2.0 * (1.0 + X))
    form = ClosedFormRatio(
        name="over",
        of="critical_velocity_ratio",
        form="velocity_step_at_critical_stiffness",
    )
    result = apply_reductions(dataset, (form,))
    np.testing.assert_allclose(result.over, 2.0, rtol=1e-14)
    np.testing.assert_allclose(result.over_closed_form, 1.0 + X, rtol=1e-14)
    assert "Gu et al. (1984)" in result.over.attrs["comment"]
    assert "over" not in form(dataset.drop_vars("b_over_a"))
    with pytest.raises(InvalidValue, match="is not a closed-form solution"):
        ClosedFormRatio(name="over", of="critical_velocity_ratio", form="net_weakenin")


def test_differences_and_spreads():
    dataset = lattice([X, 3.0 * X])
    apart = Difference(
        name="apart", of="critical_velocity_ratio", along="case", reference="reference"
    )
    np.testing.assert_allclose(apply_reductions(dataset, (apart,)).apart.sel(case="other"), 2.0 * X)
    spread = Range(
        name="spread", of="critical_velocity_ratio", over="a_over_b_minus_a", within=(0.25, 1.0)
    )
    assert apply_reductions(dataset, (spread,)).spread.values.tolist() == [0.75, 2.25]
    codes = np.zeros((2, 5))
    codes[1, 1] = Status.PENDING
    refused = apply_reductions(lattice([X, X], codes), (spread,))
    assert np.isnan(refused.spread[1])
    assert float(refused.spread[0]) == 0.75


def loops(tilt: float) -> xr.Dataset:
    """Return two paths up to 10^6 and 10^5 V_* and back.

    The second path leaves the first path at 10^4 V_*, and returns to it at 10^3 V_* with an
    offset of ``tilt``.
    """
    up = np.linspace(0.0, 6.0, 300)
    first = np.concatenate([up, up[::-1][1:]]), np.concatenate([2.0 - 0.1 * up, 0.2 + 0 * up[1:]])
    to = np.linspace(0.0, 5.0, 300)
    rise = 2.0 - 0.1 * to - np.clip(to - 4.0, 0.0, None)
    fall = 0.2 + tilt + 0.05 * np.clip(to[::-1][1:] - 3.0, 0.0, None)
    second = np.concatenate([to, to[::-1][1:]]), np.concatenate([rise, fall])
    dims = ("inertia", "phase")
    return xr.Dataset(
        {
            "log10_slip_rate": (dims, np.stack([first[0], second[0]])),
            "frictional_stress": (dims, np.stack([first[1], second[1]])),
            "status": ("inertia", np.zeros(2, np.int8)),
        },
        coords={"inertia": [0, 1]},
    )


def test_where_paths_part_and_merge():
    parting = PathSeparation(name="paths", of="frictional_stress", along="inertia", tolerance=2e-3)
    result = apply_reductions(loops(0.0), (parting,))
    assert float(result.paths_parting) == pytest.approx(4.0, abs=0.02)
    assert float(result.paths_merging) == pytest.approx(3.07, abs=0.03)
    assert float(result.paths_offset) == pytest.approx(0.0, abs=1e-3)
    apart = apply_reductions(loops(0.1), (parting,))
    assert np.isnan(apart.paths_merging)
    assert float(apart.paths_offset) == pytest.approx(0.1, abs=1e-2)
    same = loops(0.0).isel(inertia=[0, 0]).assign_coords(inertia=[0, 1])
    assert np.isnan(apply_reductions(same, (parting,)).paths_parting)


def test_reductions_of_reductions_keep_to_their_dimensions():
    dataset = lattice([X, 3.0 * X]).expand_dims(law=["slip", "slowness"]).copy()
    slope = ProportionalFit(name="slope", of="critical_velocity_ratio", on="a_over_b_minus_a")
    spread = Difference(name="apart", of="slope", along="case", reference="reference")
    result = apply_reductions(dataset.assign_coords(number=("law", [1.0, 2.0])), (slope, spread))
    assert result.apart.dims == ("law", "case")
    again = apply_reductions(result, (Range(name="s", of="slope", over="number"),))
    assert again.s.dims == ("case",)


# ---- where limit cycles end ---------------------------------------------------------------------

STIFFNESS = np.array([0.6, 0.8, 0.9, 0.97, 1.1])


def cycling(answers) -> xr.Dataset:
    """Return cells along stiffness for V_0 = 1.01, 10 and 1000 V_*.

    At variable normal stress, k_cr(V_0) is 0.99976, 0.946 and 0.851 times k_cr(V_*).
    """
    cycles = np.asarray(answers, dtype=bool)
    codes = np.where(cycles, int(Status.OK), int(Status.NO_LIMIT_CYCLE))
    dims = ("load_velocity_ratio", "stiffness_ratio")
    return xr.Dataset(
        {"recurrence_interval": (dims, np.where(cycles, 1.0, np.nan)), "status": (dims, codes)},
        coords={
            "load_velocity_ratio": [1.01, 10.0, 1000.0],
            "stiffness_ratio": STIFFNESS,
            "law": "slip",
            "normal_stress": "variable",
            "inertia": np.int8(1),
            "b_over_a": 2.0,
        },
    )


EDGE = CycleRegionEdge(name="edge", of="recurrence_interval")
AS_THE_EIGENVALUES_SAY = [[1, 1, 1, 1, 0], [1, 1, 1, 0, 0], [1, 1, 0, 0, 0]]


def test_the_edge_of_cycling_is_bracketed_beside_the_linear_boundary():
    result = apply_reductions(cycling(AS_THE_EIGENVALUES_SAY), (EDGE,))
    assert result.edge.values == pytest.approx([1.035, 0.935, 0.85])
    assert result.edge_error.values == pytest.approx([0.065, 0.035, 0.05])
    assert result.edge_unstable.values == pytest.approx([0.97, 0.9, 0.8])
    assert result.edge_linear.values == pytest.approx([0.99976, 0.94617, 0.85095], abs=1e-5)
    assert float(result.edge_farthest) == pytest.approx((1.035 - 0.99976) / 0.13, abs=1e-4)
    assert int(result.edge_misplaced) == 0
    assert "eigenvalues" in result.edge_linear.attrs["long_name"]


@pytest.mark.parametrize(
    ("row", "crossings"), [([1, 1, 1, 1, 0], 1), ([1, 0, 0, 0, 0], 1), ([1, 1, 0, 1, 0], 3)]
)
def test_cells_on_the_wrong_side_of_the_linear_boundary_are_counted(row, crossings):
    """Cells that contradict the linear boundary are counted.

    If the result changes more than once along the axis, there is no edge.
    """
    result = apply_reductions(cycling([row] * 3), (EDGE,))
    below = [critical > STIFFNESS for critical in (0.9998, 0.946, 0.851)]
    expected = int((np.array(below) != np.array(row, dtype=bool)).sum())
    assert int(result.edge_misplaced) == expected > 0
    assert (result.edge_crossings == crossings).all()
    assert result.edge.isnull().all() == (crossings > 1)


@dataclass(frozen=True)
class Bare(Reduction):
    """A user-defined reduction whose result lacks all attributes."""

    def __call__(self, dataset):
        return xr.Dataset({self.name: (2.0 * dataset[self.of]).drop_attrs()})


def test_a_reduction_keeps_the_attributes_of_coordinates():
    dataset = lattice([1.0, 2.0, 3.0, 4.0, 5.0])
    dataset["b_over_a"].attrs = {"long_name": "ratio of a user", "units": "1"}
    found = apply_reductions(dataset, (Bare("doubled", of="critical_velocity_ratio"),))
    assert found["b_over_a"].attrs == {"long_name": "ratio of a user", "units": "1"}
    assert found["doubled"].dims == ("b_over_a",)


def test_the_ratio_to_a_closed_form_is_described_by_its_variable():
    ratio = ClosedFormRatio("over_closed_form", of="step", form="velocity_step_of_the_family")
    names = {about.name: about.long_name for about in ratio.quantities}
    assert names["over_closed_form"] == "ratio of step to its closed-form value"
    assert names["over_closed_form_closed_form"] == "closed-form value of step"
