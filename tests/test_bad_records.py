"""Tests of records that do not constrain the parameters.

Each fit ends with a clear error or status, with little work and without absurd numbers.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import synthetic_records as synthetic
import xarray as xr

import rsfstudy
from rsfstudy.errors import InvalidValue
from rsfstudy.fitting.record import Record
from rsfstudy.status import Status

ROWS = 400
FOUR = ("a", "b", "slip_distance", "mu_star")


def columns(count: int = ROWS) -> dict[str, np.ndarray]:
    """Return a velocity step for the slip law, with correlated noise."""
    time = synthetic.sample_times(synthetic.STEP_UP, 50.0, count)
    friction = synthetic.friction_and_sensitivities("slip", time)[0] + synthetic.correlated_noise(
        count, 0.5, 1e-4, 3
    )
    return {
        "time": time,
        "displacement": synthetic.load_point_displacement(synthetic.STEP_UP, time),
        "friction": friction,
    }


GOOD = columns()


def fitted(record: dict[str, np.ndarray] | Record, **options: Any) -> xr.Dataset:
    """Return the fit of a record with the slip law."""
    read = record if isinstance(record, Record) else rsfstudy.read_record(record)
    options = {"stiffness": 3e-3, "laws": ["slip"], "engine": "compiled", **options}
    return rsfstudy.fit(read, **options)


def test_columns_that_are_mistaken_are_told() -> None:
    moved, friction = GOOD["displacement"], GOOD["friction"]
    with pytest.raises(InvalidValue, match="'displacement' must increase .* Reverse the sign"):
        fitted(GOOD | {"displacement": -moved})
    with pytest.raises(InvalidValue, match="'displacement' must increase .* select other columns"):
        fitted(GOOD | {"displacement": friction, "friction": moved})


def test_slip_that_is_given_as_load_point_displacement_is_told() -> None:
    """The same column is accepted if it is named slip."""
    slip = GOOD["displacement"] - (GOOD["friction"] - GOOD["friction"][0]) / 3e-3
    with pytest.raises(InvalidValue, match="but is fault slip at step 1.* 'slip=HEADING"):
        fitted(GOOD | {"displacement": slip})
    named = {"time": GOOD["time"], "slip": slip, "friction": GOOD["friction"]}
    record = rsfstudy.read_record(named, stiffness=3e-3)
    offset = GOOD["friction"][0] / 3e-3
    np.testing.assert_allclose(record.columns["displacement"], GOOD["displacement"] + offset)


def test_filters_of_a_record_are_filters_of_its_fit() -> None:
    record = rsfstudy.read_record(GOOD, filter="mean 1 s")
    with pytest.raises(
        InvalidValue,
        match="filter = 'mean 2.0' cannot be applied, because the "
        "record was read with filter=. Omit",
    ):
        fitted(record, averaging="2 s")
    other = rsfstudy.read_record(GOOD, name="other")
    with pytest.raises(
        InvalidValue, match="'filter' must be the same for all records .got ..mean 1.0"
    ):
        rsfstudy.fit([record, other], stiffness=3e-3, laws=["slip"])


SHORT = columns(15)
NOISE = 0.6 + 1e-4 * np.random.default_rng(1).standard_normal(ROWS)


@pytest.mark.parametrize(
    ("record", "options", "told"),
    [
        (GOOD | {"friction": NOISE}, {}, "a, b, slip_distance"),
        (  # The displacement is a thousand times too large.
            SHORT | {"friction": NOISE[:15], "displacement": 1e3 * SHORT["displacement"]},
            {"stiffness": 2e-4, "noise": "white"},
            "a, b, slip_distance",
        ),
        (
            GOOD | {"time": GOOD["displacement"], "displacement": GOOD["time"]},
            {},
            "time and displacement",
        ),
    ],
)
def test_what_a_record_does_not_tell(
    record: dict[str, np.ndarray], options: dict[str, Any], told: str
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fitted(record, free=FOUR, **options).isel(law=0)
    assert found.status.item() == Status.NOT_IDENTIFIED
    assert told in found.message.item()
    # A fit may use 5e7 evaluations, and a motion with a stiff spring may need 150,000
    # evaluations.
    assert found.rhs_evaluations.item() < 3e7
    # The limits of an unbounded parameter differ from its value by at least the standard error,
    # even if other parameters are at their bounds.
    ends = np.array([found.mu_star_ci_low.item(), found.mu_star_ci_high.item()])
    assert not (np.abs(ends - found.mu_star.item()) < found.mu_star_stderr.item()).any()
    assert (found.b_ci_low.item(), found.b_ci_high.item()) == (-1.0, 1.0)
    assert found.a_ci_high.item() == 1.0


def test_friction_that_is_zeroed_is_told() -> None:
    found = fitted(GOOD | {"friction": np.zeros(ROWS)})
    assert found.status.item() == Status.NOT_APPLICABLE
    assert "friction before the step is 0" in found.message.item()


def test_a_load_point_that_is_recorded_with_noise_takes_bounded_work() -> None:
    record = columns(800)
    record["displacement"] += 0.2 * np.random.default_rng(1).standard_normal(800)
    found = fitted(record, loading="recorded")
    assert found.status.item() == Status.OK
    assert found.rhs_evaluations.item() < 5e6
