"""Tests of fits of records: derivatives, estimates, errors and statuses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import synthetic_records as synthetic
from synthetic_records import (
    EXACT_PARAMETERS,
    LAW_FUNCTIONS,
    SENSITIVITY_PARAMETERS,
    SLIDE_HOLD_SLIDE,
    STEP_DOWN,
    STEP_UP,
)

from rsfstudy import Scene
from rsfstudy.fitting.window_model import (
    ACCURATE_DIFFERENCE_SCHEME,
    QUICK_DIFFERENCE_SCHEME,
    WindowModel,
)
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator

ENOUGH = 10**9


def scene_of(law: str, **fields: Any) -> Scene:
    """Return a scene of a law, with parameters that a fit replaces."""
    fields = {"normal_stress": "constant", "stiffness": 0.03, "mu_star": 0.6, **fields}
    return Scene(law=law, a=0.01, b_over_a=1.3, **fields)


def model_of(
    law: str, loading: Sequence[tuple[float, float]], times: np.ndarray, friction: np.ndarray
) -> WindowModel:
    """Return the model of a record."""
    pieces = np.array([(begins, speed, 1.0, 0.0) for begins, speed in loading])
    accuracy = Accuracy(1e-9, ENOUGH, engine="compiled")
    moved = synthetic.load_point_displacement(loading, times)
    return WindowModel(
        scene_of(law),
        times,
        moved,
        friction,
        pieces,
        Integrator(accuracy),
    )


@pytest.mark.parametrize(
    ("law", "loading", "changes"),
    [
        *((law, STEP_UP, {}) for law in LAW_FUNCTIONS),
        ("slip", STEP_UP, {"stiffness": 1e-3}),  # A third of this stiffness is critical.
        ("perrin_rice_zheng", STEP_UP, {"stiffness": 1e-3}),
        (
            "slowness",
            STEP_DOWN,
            {"stiffness": 0.05},  # Stability limits the step size.
        ),
        ("slowness", STEP_DOWN, {"b": -0.004}),
        ("slip", SLIDE_HOLD_SLIDE, {}),
        ("slowness", SLIDE_HOLD_SLIDE, {"stiffness": 1e-3}),
    ],
)
def test_derivatives_are_those_of_the_augmented_equations(
    law: str, loading: Sequence[tuple[float, float]], changes: Mapping[str, float]
) -> None:
    truth = {**EXACT_PARAMETERS, **changes}
    times = synthetic.sample_times(loading, synthetic.loading_end_time(loading), 200)
    friction, exact = synthetic.friction_and_sensitivities(law, times, loading, truth)
    model = model_of(law, loading, times, friction)
    # The tolerance is ten times the requested accuracy.
    assert np.abs(model.compute_model_friction(truth) - friction).max() < 1e-8 * truth["a"]
    largest = np.abs(exact).max(axis=0)
    fine = (
        np.abs(
            model.compute_jacobian(truth, SENSITIVITY_PARAMETERS, ACCURATE_DIFFERENCE_SCHEME)
            - exact
        ).max(axis=0)
        / largest
    )
    assert (fine < 1e-6).all(), fine
    quick = (
        np.abs(
            model.compute_jacobian(truth, SENSITIVITY_PARAMETERS, QUICK_DIFFERENCE_SCHEME) - exact
        ).max(axis=0)
        / largest
    )
    assert (quick < 2e-3).all(), quick  # This accuracy is sufficient for the optimisation.


def test_derivatives_by_offset_trend_and_time_of_a_step() -> None:
    times = synthetic.sample_times(STEP_UP, 50.0, 202)[1:]
    friction, _exact = synthetic.friction_and_sensitivities("slip", times)
    model = model_of("slip", STEP_UP, times, friction)
    found = model.compute_jacobian(
        EXACT_PARAMETERS | {"step_time": 0.0}, ("mu_star", "trend2", "step_time")
    )
    assert (found[:, 0] == 1.0).all()
    np.testing.assert_allclose(
        found[:, 1], synthetic.load_point_displacement(STEP_UP, times) ** 2, rtol=1e-15
    )
    # A delayed motion equals an earlier part of the motion.
    late = 1e-3
    ahead, behind = (
        synthetic.friction_and_sensitivities("slip", times + s * late)[0] for s in (1.0, -1.0)
    )
    exact = -(ahead - behind) / (2.0 * late)
    away = np.abs(times - 40.0) > 0.03  # Friction has a kink at the step.
    off = np.abs(found[:, 2] - exact)[away].max() / np.abs(exact).max()
    # The truncation error is of second order in ``late`` relative to D_c/V = 1 s of the peak.
    assert off < 2e-5


@pytest.mark.parametrize("exponent", [0.0, 0.012, 1.0])
def test_derivatives_at_the_ends_of_the_family(exponent: float) -> None:
    """Derivatives by the exponent agree with differences of SciPy motions.

    The differences are of sixth order and extend beyond the ends of the family.
    """
    times = synthetic.sample_times(STEP_UP, 46.0, 60)
    truth = EXACT_PARAMETERS | {"law_exponent": exponent}
    model = model_of("family", STEP_UP, times, times)

    def friction(at: float) -> np.ndarray:
        synthetic.LAW_FUNCTIONS["any"] = lambda u: (
            (math.expm1(-at * u) / at, -math.exp(-at * u)) if at else (-u, -1.0)
        )
        return synthetic.friction_and_sensitivities("any", times)[0]

    moved = {n: friction(exponent + 0.02 * n) for n in (-3, -2, -1, 1, 2, 3)}
    del synthetic.LAW_FUNCTIONS["any"]
    weights = {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}
    exact = sum(w / 0.02 * (moved[n] - moved[-n]) for n, w in weights.items())
    found = model.compute_jacobian(truth, ("law_exponent",), ACCURATE_DIFFERENCE_SCHEME)[:, 0]
    # The one-sided difference has an error of third order in its step of 0.005.
    assert np.abs(found - exact).max() < 2e-5 * np.abs(exact).max()
