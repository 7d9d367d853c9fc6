"""Tests of the coverage study of error estimates with random scenes."""

import numpy as np
import pytest
import xarray as xr
from agreement import RANDOM_SCENE_TEMPLATES
from hypothesis import given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies._random_scenes import (
    LABORATORY_QUESTIONS,
    MOTION_QUESTIONS,
    random_scene,
)
from rsfstudy.named_studies.coverage import Coverage, CoverageStatistics

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator
from rsfstudy.reductions import apply_reductions
from rsfstudy.status import Status


@settings(deadline=None, derandomize=True)
@given(
    st.sampled_from([*RANDOM_SCENE_TEMPLATES, Scene(normal_stress="imposed")]),
    st.sampled_from([*MOTION_QUESTIONS, *LABORATORY_QUESTIONS]),
    st.integers(0, 10**6),
)
def test_any_draw_is_a_scene_of_its_kind_and_the_same_each_time(like, question, sample):
    if question.startswith("normal stress") and like.normal_stress == "constant":
        with pytest.raises(InvalidValue, match="constant"):
            random_scene(like, question, sample)
        return
    scene = random_scene(like, question, sample)
    assert scene == random_scene(like, question, sample)
    assert scene.law == like.law
    assert scene.effects == like.effects
    assert scene != random_scene(like, question, sample + 1)


def test_shares_worst_and_typical_are_counted():
    ratios = np.array([[0.1, 0.5], [1.0, 2.0], [np.nan, 0.25]])
    dataset = xr.Dataset(
        {
            "error_over_estimate": (("sample", "requested_digits"), ratios),
            "status": (("sample", "requested_digits"), np.zeros(ratios.shape, dtype=np.int8)),
        }
    )
    found = apply_reductions(
        dataset, (CoverageStatistics(name="c", of="error_over_estimate", by=("requested_digits",)),)
    )
    np.testing.assert_allclose(found.c_share, [1.0, 2.0 / 3.0])
    np.testing.assert_allclose(found.c_worst, [1.0, 2.0])
    # Medians of (10, 1) and of (2, 0.5, 4).
    np.testing.assert_allclose(found.c_typical, [5.5, 2.0])
    assert found.c_numbers.values.tolist() == [2, 3]


def test_an_estimate_that_is_too_small_shows(monkeypatch):
    """Errors exceed their estimates if the estimates are reduced to 1 %."""
    cell, like = Coverage(sample=3, requested_digits=5), RANDOM_SCENE_TEMPLATES[1]
    ratios = cell(like, Accuracy()).values["error_over_estimate"]
    usual = Integrator.estimate_error
    monkeypatch.setattr(Integrator, "estimate_error", lambda *given: 0.01 * usual(*given))
    smaller = cell(like, Accuracy()).values["error_over_estimate"]
    known = np.isfinite(ratios)
    assert known.sum() == 5
    assert (ratios[known] <= 1.0).all()
    assert (smaller[known] > 1.0).any()


def test_a_scene_without_a_number_counts_its_status():
    """The slip rate grows without bound at both accuracies."""
    found = Coverage(sample=0, requested_digits=4)(RANDOM_SCENE_TEMPLATES[0], Accuracy())
    assert found.status is Status.OK
    assert found.values["status_kept"] == 1.0
    assert found.values["ended_as"] == float(Status.SLIP_RATE_UNBOUNDED)
    assert "error_over_estimate" not in found.values
