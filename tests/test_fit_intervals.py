"""Tests of fit intervals against brute-force likelihood profiles.

The test record is a relaxation that barely constrains the parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from rsfstudy.fitting import confidence_intervals
from rsfstudy.fitting.fit_problem import FitProblem, FitSolution
from rsfstudy.fitting.window_model import (
    QUICK_DIFFERENCE_SCHEME,
    FiniteDifferenceScheme,
    ParameterValues,
)

ROWS, SIZE = 80, 1e-3
FREE = ("b", "slip_distance", "mu_star")


class Relaxation:
    """Model ``mu_star - b (1 - exp(-x/D_c))`` over a displacement of 30 um."""

    friction_averaging_time = 0.0

    @property
    def recorded_friction_per_window(self) -> list[np.ndarray]:
        return [self.recorded_friction]

    def __init__(self, truth: ParameterValues, seed: int = 2) -> None:
        self.time_since_start_of_each_window = self.load_point_displacement = np.linspace(
            0.0, 30.0, ROWS
        )
        noise = np.random.default_rng(seed).standard_normal(ROWS)
        self.recorded_friction = self.compute_model_friction(truth) + SIZE * noise

    def compute_model_friction(
        self,
        values: ParameterValues,
        *,
        with_refined_tolerances: bool = False,
        require_stable: bool = False,
    ) -> np.ndarray:
        """Return the friction of the model."""
        return np.asarray(
            values["mu_star"]
            - values["b"] * -np.expm1(-self.load_point_displacement / values["slip_distance"])
        )

    def compute_friction_trend(self, _values: ParameterValues) -> np.ndarray:
        """Return a trend of zero."""
        return np.zeros(ROWS)

    def is_linear_in_parameter(self, name: str) -> bool:
        """Return True for the friction level only."""
        return name == "mu_star"

    def check_parameters_define_valid_scenes(self, values: ParameterValues) -> None:
        """Accept all values."""

    def compute_friction_change_by_loading_error(self, _values: ParameterValues) -> np.ndarray:
        """Return no changes, because there is no load point."""
        return np.zeros((ROWS, 0))

    def compute_jacobian(
        self,
        values: ParameterValues,
        free: Sequence[str],
        difference_scheme: FiniteDifferenceScheme = QUICK_DIFFERENCE_SCHEME,
    ) -> np.ndarray:
        """Return the derivatives in closed form."""
        over = self.load_point_displacement / values["slip_distance"]
        columns = {
            "b": np.expm1(-over),
            "slip_distance": values["b"] * over * np.exp(-over),
            "mu_star": np.ones(ROWS),
        }
        return np.column_stack([columns[name] for name in free])


def fit(distance: float) -> tuple[Relaxation, FitProblem, FitSolution]:
    """Return a model, its fit problem and the solution."""
    truth = {"a": 0.01, "b": 0.01, "slip_distance": distance, "mu_star": 0.6}
    model = Relaxation(truth)
    search = FitProblem(model, truth, FREE, "white")  # type: ignore[arg-type]
    return model, search, search.solve()


def squares(model: Relaxation, b: float, distance: float) -> float:
    """Return the minimum of the sum of squares over mu_star."""
    left = model.recorded_friction + b * -np.expm1(-model.load_point_displacement / distance)
    return ROWS * float(np.var(left))


def by_hand(model: Relaxation, b: float) -> float:
    """Return the minimum of the sum of squares over mu_star and D_c."""
    logs = np.linspace(math.log(1.0), math.log(300.0), 400)
    at = int(np.argmin([squares(model, b, math.exp(u)) for u in logs]))
    ends = logs[max(at - 1, 0)], logs[min(at + 1, 399)]
    best = minimize_scalar(lambda u: squares(model, b, math.exp(u)), bounds=ends, method="bounded")
    return float(best.fun)


def test_intervals_end_where_the_likelihood_has_fallen() -> None:
    model, search, found = fit(25.0)
    far = confidence_intervals.compute_student_t_quantile(
        found, confidence_intervals.CONFIDENCE_LEVEL
    )
    b = found.parameter_values["b"]
    low, high = confidence_intervals.compute_confidence_interval(search, found, "b")
    # To first order, the squared distances have an error of 20 % on the side where the
    # likelihood is nearly parabolic.
    for end, slack in ((low, 0.25), (high, 0.06)):
        fallen = (by_hand(model, end) - by_hand(model, b)) / found.noise_sd**2
        assert fallen == pytest.approx(far**2, rel=slack)
    assert high - b > 1.5 * (b - low)  # The likelihood is not parabolic.


def test_noise_alone_tells_neither_b_nor_its_slip_distance() -> None:
    first = {"a": 0.01, "b": 2.0 * SIZE, "slip_distance": 4.0, "mu_star": 0.6}
    told = dict.fromkeys((0.0, 4.0 * SIZE), 0)
    for size in told:
        for seed in range(20):
            model = Relaxation(first | {"b": size}, seed)
            search = FitProblem(model, first, FREE, "ar")  # type: ignore[arg-type]
            told[size] += not {"b", "slip_distance"} & set(search.solve().unidentified_parameters)
    # A difference of ten in the AIC occurs by chance in a few of a thousand records.
    assert told[0.0] == 0
    assert told[4.0 * SIZE] > 15
