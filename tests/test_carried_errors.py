"""Tests of the propagation of numerical errors through reductions."""

import numpy as np
import pytest
import xarray as xr

from rsfstudy.reductions import (
    Boundary,
    ClosedFormRatio,
    Difference,
    Inverse,
    LinearFit,
    Logarithm,
    Mean,
    PowerLaw,
    ProportionalFit,
    Quantile,
    Range,
    RelativeDifference,
    SemilogFit,
    StandardDeviation,
    apply_reductions,
)
from rsfstudy.status import Status
from rsfstudy.study.reductions.base import PROPAGATED_ERROR_COMMENT

X = np.array([0.25, 0.5, 1.0, 2.0, 4.0])
OF, ON = "critical_velocity_ratio", "a_over_b_minus_a"
RANDOM = np.random.default_rng(40)
VALUES = np.sort(1.0 + RANDOM.uniform(0.5, 3.0, (2, 5)))
ERRORS = RANDOM.uniform(1e-7, 1e-6, (2, 5))


def lattice(values=VALUES, errors=ERRORS, status=0) -> xr.Dataset:
    dims = ("case", "b_over_a")
    values = np.asarray(values, dtype=float)
    return xr.Dataset(
        {
            OF: (dims, values),
            f"{OF}_error": (dims, errors + np.zeros(values.shape)),
            "status": (dims, np.full(values.shape, status, dtype=np.int8)),
        },
        coords={
            "b_over_a": 1.0 + 1.0 / X,
            ON: ("b_over_a", X),
            "case": ["reference", "other"],
        },
    )


AGAINST = {"along": "case", "reference": "reference"}
KINDS = [
    ProportionalFit("r", OF, ON, intercept=1.0),
    ProportionalFit("r", OF, ON, within=(0.5, 2.0)),
    LinearFit("r", OF, ON),
    SemilogFit("r", OF, ON),
    PowerLaw("r", OF, ON, within=(0.5, 4.0)),
    Difference("r", OF, **AGAINST),
    RelativeDifference("r", OF, **AGAINST),
    ClosedFormRatio("r", OF, form="velocity_step_at_critical_stiffness"),
    Range("r", OF, ON),
    Range("r", OF, ON, within=(0.5, 2.0)),
    Mean("r", OF, over="b_over_a"),
    StandardDeviation("r", OF, over="b_over_a"),
    Logarithm("r", OF),
]


def moved_one_by_one(reduction, dataset) -> xr.DataArray:
    """Return the sum of the changes of a result by the error of each cell."""
    still, sums = apply_reductions(dataset, (reduction,)).r, 0.0
    for place in np.ndindex(dataset[OF].shape):
        other = dataset.copy(deep=True)
        other[OF][place] += dataset[f"{OF}_error"][place]
        sums = sums + abs(apply_reductions(other, (reduction,)).r - still)
    return sums


@pytest.mark.parametrize("reduction", KINDS, ids=lambda r: f"{r.kind} {getattr(r, 'within', '')}")
def test_the_error_is_what_cells_moved_by_theirs_change_in_all(reduction):
    dataset = lattice()
    error = apply_reductions(dataset, (reduction,)).r_error
    # The relative tolerance allows for second-order terms of about 1e-6, and the absolute
    # tolerance for rounding.
    expected = moved_one_by_one(reduction, dataset).transpose(*error.dims)
    np.testing.assert_allclose(error, expected, rtol=1e-5, atol=2e-15)
    assert error.attrs["comment"] == PROPAGATED_ERROR_COMMENT
    assert error.attrs["long_name"].startswith("numerical error estimate of")


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_an_inverse_has_them_beside_its_own(noise):
    """The error is the sum of the cell errors and the interpolation error.

    The interpolation error is the error of the result for exact cells.
    """
    values = 1.3 * X**0.8 * (1.0 + noise * RANDOM.uniform(-1.0, 1.0, (2, 5)))
    inverse = Inverse("r", OF, ON, levels=2.0)
    exact = apply_reductions(lattice(values, errors=0.0), (inverse,)).r_error
    dataset = lattice(values)
    expected = exact + moved_one_by_one(inverse, dataset)
    np.testing.assert_allclose(
        apply_reductions(dataset, (inverse,)).r_error, expected, rtol=1e-4, atol=1e-14
    )
    assert (expected > exact + 1e-8).all()


def test_an_exact_relation_has_no_standard_error_but_that_of_its_cells():
    """The numerical error covers a common relative error of all cells.

    The standard error does not, because it measures the misfit only.
    """
    truth, part = 1.0 + 4.0 / 3.0 * X, 3e-8
    dataset = lattice([truth * (1.0 + part)] * 2, errors=part * truth)
    fit = LinearFit("slope", OF, ON)
    result = apply_reductions(dataset, (fit,)).isel(case=0)
    off = abs(float(result.slope) - 4.0 / 3.0)
    assert float(result.slope_stderr) < 1e-3 * off
    assert off <= float(result.slope_error) < 5.0 * off


def test_a_reference_is_like_itself_whatever_its_error():
    for kind in (Difference, RelativeDifference):
        result = apply_reductions(lattice(), (kind("r", OF, **AGAINST),))
        assert (result.r_error.sel(case="reference") == 0.0).all()


def test_a_cell_of_no_known_error_leaves_it_unknown():
    """The error is NaN unless the result is independent of the cell."""
    errors = ERRORS.copy()
    errors[1, 4] = np.nan
    fits = (LinearFit("all", OF, ON), LinearFit("some", OF, ON, within=(0.25, 2.0)))
    result = apply_reductions(lattice(errors=errors), (*fits, Range("r", OF, ON)))
    for name in ("all", "r"):
        assert result[f"{name}_error"].isnull().values.tolist() == [False, True]
        assert result[name].notnull().all()
    assert result.some_error.notnull().all()


@pytest.mark.parametrize("status", [Status.STABLE_FOR_ALL_STEPS, Status.WORK_BUDGET_SPENT])
def test_a_cell_without_a_number_has_no_say(status):
    values, errors = VALUES.copy(), ERRORS.copy()
    values[1, 4] = errors[1, 4] = np.nan
    dataset = lattice(values, errors)
    dataset["status"][1, 4] = int(status)
    result = apply_reductions(dataset, (LinearFit("r", OF, ON),), despite_failures=True)
    assert int(result.r_points[1]) == 4
    only = dataset.isel(b_over_a=slice(4))
    expected = apply_reductions(only, (LinearFit("r", OF, ON),)).r_error
    np.testing.assert_allclose(result.r_error[1], expected[1], rtol=1e-12)


def test_a_result_that_is_refused_has_no_error():
    dataset = lattice()
    dataset["status"][1, 2] = int(Status.WORK_BUDGET_SPENT)
    result = apply_reductions(dataset, (LinearFit("r", OF, ON),))
    assert result.r_error.isnull().values.tolist() == [False, True]
    assert "failed or are missing" in result.r_error.attrs["refused"]


def test_cells_without_errors_give_none():
    result = apply_reductions(lattice().drop_vars(f"{OF}_error"), (LinearFit("r", OF, ON),))
    assert "r_error" not in result
    assert "r_error" not in result.r.attrs["ancillary_variables"]


def test_a_spread_knows_the_cells_that_may_be_farthest():
    """The error allows for a change of the largest cell.

    The error of the second largest value exceeds its distance to the largest value.
    """
    values = np.tile([1.0, 1.5, 2.0, 2.999, 3.0], (2, 1))
    errors = np.tile([1e-6, 1e-6, 1e-6, 1e-2, 1e-6], (2, 1))
    result = apply_reductions(lattice(values, errors), (Range("r", OF, ON),))
    np.testing.assert_allclose(result.r_error, 1e-2 + 1e-6, rtol=1e-9)


def test_the_error_of_a_quantile_bounds_whatever_cells_change_places():
    """The error bounds the quantile for any errors of the cells.

    Some errors are larger than the distance to the next value, so cells may change their
    order.
    """
    quantile, random = Quantile("r", OF, over="b_over_a", level=0.3), np.random.default_rng(7)
    values = np.tile([1.0, 2.0, 2.01, 3.0, 4.0], (2, 1))
    errors = np.array([[1e-6, 1e-6, 0.5, 1e-6, 1e-6], [1e-6, 0.4, 1e-6, np.nan, 1e-6]])
    found = apply_reductions(lattice(values, errors), (quantile,))
    # The quantile is 2.002, and decreases to 1.608 if 2.01 decreases to 1.51.
    assert float(found.r_error[0]) == pytest.approx(0.394, abs=2e-6)
    for _ in range(50):
        off = random.uniform(-1.0, 1.0, (2, 5)) * np.nan_to_num(errors, nan=2.0)
        moved = np.quantile(values + off, 0.3, axis=1)
        assert (abs(moved - found.r) <= found.r_error + 1e-12).all()


def test_errors_go_through_several_reductions():
    chain = (LinearFit("slope", OF, ON), Difference("steeper", "slope", **AGAINST))
    result = apply_reductions(lattice(), chain)
    expected = float(result.slope_error.sum())
    assert float(result.steeper_error.sel(case="other")) == pytest.approx(expected, rel=1e-8)


def test_a_boundary_leaves_out_what_is_nearer_to_the_level_than_its_error():
    values = np.tile([0.0, 0.2, 0.52, 0.9, 1.0], (2, 1))
    boundary = Boundary("r", OF, ON)
    sharp = apply_reductions(lattice(values, errors=0.01), (boundary,))
    blurred = apply_reductions(lattice(values, errors=0.05), (boundary,))
    assert [float(v[0]) for v in (sharp.r_stable, sharp.r_unstable)] == [0.5, 1.0]
    assert [float(v[0]) for v in (blurred.r_stable, blurred.r_unstable)] == [0.5, 2.0]
    assert float(blurred.r_error[0]) == 0.75
