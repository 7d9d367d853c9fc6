"""Tests of the reduction ``Inverse``.

The error bounds the deviation that the sampling permits, and a status explains missing
results.
"""

import numpy as np
import pytest
import xarray as xr

from rsfstudy.reductions import Inverse, apply_reductions
from rsfstudy.study.reductions._level_crossing import CrossingSearchStatus

OK, OUT_OF_REACH, NOT_UNIQUE, UNRESOLVED, TOO_FEW = (
    float(verdict) for verdict in CrossingSearchStatus
)


def inverted(x, y, level):
    """Invert samples of a curve of ln y against ln x.

    The function returns the position, its error and the status.
    """
    dataset = xr.Dataset(
        {"y": ("x", np.exp(y)), "status": ("x", np.zeros(len(x), np.int8))},
        coords={"x": np.exp(x)},
    )
    levels = float(np.exp(level))
    found = apply_reductions(dataset, (Inverse(name="at", of="y", on="x", levels=levels),))
    return float(found["at"]), float(found["at_error"]), float(found["at_status"])


def assert_covered(curve, x, place):
    at, error, status = inverted(x, curve(x), float(curve(place)))
    assert status == OK
    assert abs(at - np.exp(place)) <= error + 1e-12 * at


@pytest.mark.parametrize("cells", range(5, 15))
def test_error_covers_a_kink(cells):
    """The error covers a kink at any position, on a curved background."""
    x, draw = np.linspace(0.0, 4.0, cells), np.random.default_rng(cells)
    for _ in range(12):
        kink, place = draw.uniform(0.2, 3.8, 2)
        change, bend = draw.uniform(-0.9, 4.0), draw.uniform(0.0, 0.3)
        assert_covered(
            lambda at, kink=kink, change=change, bend=bend: (
                at + 0.5 * bend * at**2 + change * np.maximum(at - kink, 0.0)
            ),
            x,
            place,
        )


@pytest.mark.parametrize("phase", np.linspace(0.0, 6.0, 7))
@pytest.mark.parametrize("cycles", [1.0, 2.3, 3.6])
def test_error_covers_an_oscillation(cycles, phase):
    """The error covers an oscillation down to three cells per period.

    The curve increases monotonically over ten cells.
    """
    x, rate = np.linspace(0.0, 4.0, 11), 2.0 * np.pi * cycles / 4.0
    for place in (0.7, 1.1, 1.9, 2.6, 3.3):
        assert_covered(lambda at: at + 0.45 / rate * np.sin(rate * at + phase), x, place)


def test_oscillation_that_may_hide_other_crossings_is_unresolved():
    """A crossing smaller than the scatter of the samples is unresolved."""
    x = np.linspace(0.0, 4.0, 11)
    y = 0.01 * x + 0.3 * np.where(np.arange(11) % 2, 1.0, -1.0) * np.linspace(1.0, 0.6, 11)
    y[:6], y[6:] = y[:6] - 0.35, y[6:] + 0.35
    at, error, status = inverted(x, y, 0.0)
    assert np.isnan([at, error]).all()
    assert status == UNRESOLVED


@pytest.mark.parametrize(
    ("y", "level", "status"),
    [
        ([0.0, 1.0, 2.0, 3.0], 4.0, OUT_OF_REACH),
        ([0.0, 2.0, 1.0, 3.0], 1.5, NOT_UNIQUE),
        ([0.0, np.nan, 2.0, 3.0], 1.5, TOO_FEW),
        ([0.0, 1.0, 2.0, 3.0], 1.5, OK),
    ],
)
def test_status_says_why_there_is_no_place(y, level, status):
    at, _error, found = inverted(np.arange(4.0), np.array(y), level)
    assert found == status
    assert np.isnan(at) == (status != OK)


@pytest.mark.parametrize("cells", [6, 9, 17])
@pytest.mark.parametrize(
    "curve", [np.sinh, np.expm1, lambda x: np.tanh(x - 1.5), lambda x: x + 0.02 * x**3]
)
def test_smooth_curves_are_resolved_and_errors_fall_with_spacing(curve, cells):
    """The error is proportional to the square of the spacing."""
    x = np.linspace(0.5, 3.0, cells)
    slopes = np.diff(curve(x)) / np.diff(x)
    turn = np.abs(np.diff(slopes)).max()
    for place in (0.83, 1.31, 1.97, 2.6):
        assert_covered(curve, x, place)
        at, error, _status = inverted(x, curve(x), float(curve(place)))
        assert error <= at * np.expm1(3.0 * turn / slopes.min() * (x[1] - x[0]))


def test_noise_far_below_the_slope_is_no_oscillation():
    """Small alternating changes of slope increase the error only slightly."""
    x = np.linspace(0.0, 4.0, 11)
    y = x + 0.001 * np.where(np.arange(11) % 2, 1.0, -1.0)
    at, error, status = inverted(x, y, 1.77)
    assert status == OK
    assert error < 0.02 * at * (x[1] - x[0])


def test_status_is_described():
    found = apply_reductions(
        xr.Dataset(
            {"y": ("x", [1.0, 2.0, 4.0, 8.0]), "status": ("x", np.zeros(4, np.int8))},
            coords={"x": [1.0, 2.0, 4.0, 8.0]},
        ),
        (Inverse(name="at", of="y", on="x", levels=3.0),),
    )
    assert found["at_status"].attrs["flag_meanings"].split()[3] == "unresolved"
    assert "at_status" in found["at"].attrs["ancillary_variables"]
