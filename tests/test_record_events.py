"""Tests of events of synthetic records with known drops."""

from __future__ import annotations

import numpy as np
import pytest
import record_events as synthetic

import rsfstudy
from rsfstudy.errors import InvalidValue, NoResultWarning


@pytest.mark.parametrize("kind", synthetic.KINDS)
def test_drops_are_found_with_errors_that_cover(kind: str) -> None:
    """All large drops are found, and most errors cover.

    With a coverage of 95 %, the probability that at least three of 18 errors fail is 6 %.
    """
    found = synthetic.score_record(
        synthetic.KINDS[kind](np.random.default_rng([1, *kind.encode()]))
    )
    assert found.large > 0
    assert (found.found, found.false) == (found.large, 0)
    assert found.sizes >= found.matched - 3
    assert found.times >= found.matched - 3


def test_a_drop_at_the_end_of_the_record_is_cut() -> None:
    made = synthetic.cut_record(np.random.default_rng(3))
    found = rsfstudy.events(time=made.time, shear_stress=made.stress)
    assert found["cut"].values.tolist() == [0] * (len(made.begins) - 1) + [2]
    # The record is split in the middle of the third drop.
    middle = made.begins[2] + 0.5 * made.durations[2]
    later = made.time >= middle
    begins = rsfstudy.events(time=made.time[later], shear_stress=made.stress[later])
    assert begins["cut"].values[0] == 1
    assert begins.sizes["event"] == len(made.begins) - 2


def test_a_short_drop_is_not_averaged_away() -> None:
    """The mean size of short drops is correct within its error.

    The drops last five samples.
    """
    rng = np.random.default_rng(4)
    made = synthetic.draw_record(rng, 0.01 * np.arange(8_000), size=(0.4, 0.4), lasts=(0.05, 0.05))
    found = rsfstudy.events(time=made.time, shear_stress=made.stress)
    off = found.static_stress_drop.values - 0.4
    assert len(off) == len(made.begins)
    assert abs(off.mean()) < 3.0 * off.std() / np.sqrt(len(off)) + 0.004


def test_the_sign_of_shear_stress() -> None:
    made = synthetic.sudden_drops(np.random.default_rng(5))
    positive = rsfstudy.events(time=made.time, shear_stress=made.stress)
    negative = rsfstudy.events(time=made.time, shear_stress=-made.stress)
    assert negative.attrs["sign_of_shear_stress"] == -1
    np.testing.assert_array_equal(negative.stress_before, positive.stress_before)
    shifted = made.stress - 5.0  # The shifted stress has both signs.
    centred = rsfstudy.events(time=made.time, shear_stress=-shifted, sign=-1)
    np.testing.assert_allclose(centred.time, positive.time, atol=1e-9)
    assert rsfstudy.events(time=made.time, shear_stress=shifted).sizes["event"] == len(made.begins)
    with pytest.raises(InvalidValue, match="'sign' must be 1 or -1"):
        rsfstudy.events(time=made.time, shear_stress=shifted, sign=2)


def test_stress_that_varies_without_drops_is_reported() -> None:
    time = 0.02 * np.arange(10_000)
    wave = 5.0 + np.cos(2.0 * np.pi * time / 150.0)
    noise = np.random.default_rng(6).normal(size=len(time))
    with pytest.warns(
        NoResultWarning, match="no drop was detected, although stress decreases by 2.0"
    ):
        found = rsfstudy.events(time=time, shear_stress=wave + 0.02 * noise)
    assert found.sizes["event"] == 0
    assert "times the smallest detectable drop" in found.attrs["comment"]


def test_events_of_a_record_as_fits_read_it() -> None:
    made = synthetic.sudden_drops(np.random.default_rng(7))
    columns = {"time": made.time, "displacement": made.time, "shear_stress": made.stress}
    record = rsfstudy.read_record(columns, normal_stress="8 MPa")
    with pytest.warns(
        NoResultWarning, match="does not increase faster"
    ):  # The displacement is the load point displacement.
        found = rsfstudy.events(record)
    plain = rsfstudy.events(time=made.time, shear_stress=made.stress)
    np.testing.assert_allclose(found.static_stress_drop, plain.static_stress_drop, rtol=1e-6)
    assert found.static_stress_drop.attrs["units"] == "MPa"
    with pytest.raises(InvalidValue, match="is not a record"):
        rsfstudy.events([1.0, 2.0])
