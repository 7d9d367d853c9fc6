"""The response of a rigid slider to a step of its slip rate: direct effect, evolution, and how much
slip it takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import brentq

from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure, Outcome
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.stepping import Halt, Meter, steps
from rsfstudy.slider import steady_state
from rsfstudy.slider.equations import rigid, strength_of
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status


@dataclass(frozen=True)
class RigidResponse(Measure):
    """Stress against slip of a rigid slider whose slip rate steps from V_* to V, the
    `load_velocity_ratio` of the scene.

    Parameters
    ----------
    slip : float
        How far to follow it, in D_c.
    points : int
        Points of the response that are kept, evenly spaced along `slip`.
    """

    slip: float = 10.0
    points: int = 201
    name: ClassVar[str] = "rigid_response"

    def __post_init__(self) -> None:
        if not 1.0 <= self.slip < math.inf:
            raise InvalidValue("slip", self.slip, "must be at least 1 D_c")
        if self.points < 2:
            raise InvalidValue("points", self.points, "must be at least 2")

    @property
    def headline(self) -> str:
        return "evolution_distance"

    @property
    def variables(self) -> Mapping[str, tuple[str, ...]]:
        scalars = (
            "evolution_distance",
            "evolution_distance_error",
            "direct_stress_change",
            "direct_asymmetry",
            "evolution_asymmetry",
            "steady_stress_change",
            "stress_left_at_unit_slip",
            "closed_form_misfit",
            "exponential_misfit",
        )
        profiles = ("shear_stress", "normal_stress_ratio", "state_variable")
        return dict.fromkeys(scalars, ()) | dict.fromkeys(profiles, ("slip",))

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"slip": np.linspace(0.0, self.slip, self.points)}

    @property
    def typical_work(self) -> int:
        return 800

    def find(self, scene: Scene, accuracy: Accuracy, meter: Meter) -> Outcome:
        """Integrate the one unknown over slip, twice at different tolerances for the error."""
        log_rate = scene.log_load_rate
        lowest = steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, scene.cot_phi)
        if log_rate == 0.0:
            return Outcome(Status.NO_STEP, message="V = V_* is no step")
        if log_rate <= lowest:
            return Outcome(Status.NO_STEADY_STATE, message="no steady state at this slip rate")
        start = friction_after_step(scene, log_rate)
        steady = _steady_stress(scene, log_rate)
        level = steady + (start - steady) / math.e
        distance, left, rows = self._follow(scene, start, level, accuracy.solver, meter)
        loose, _left, _rows = self._follow(scene, start, level, 10.0 * accuracy.solver, meter)
        slip = self.inner_coordinates["slip"]
        exponential = steady + (start - steady) * np.exp(-slip)
        departs = (rows[:, 0] - exponential) / (start - steady)
        return Outcome(
            Status.OK,
            {
                "evolution_distance": distance,
                "evolution_distance_error": abs(loose - distance) + accuracy.solver * distance,
                "direct_stress_change": start,
                **_asymmetry(scene, log_rate),
                "steady_stress_change": steady,
                "stress_left_at_unit_slip": left - steady,
                "closed_form_misfit": _closed_form_misfit(scene, slip, rows[:, 0]),
                "exponential_misfit": float(departs[np.abs(departs).argmax()]),
                "shear_stress": scene.mu_star + rows[:, 0],
                "normal_stress_ratio": 1.0 + scene.cot_phi * rows[:, 0],
                "state_variable": rows[:, 1],
            },
        )

    def _follow(
        self, scene: Scene, start: float, level: float, tolerance: float, meter: Meter
    ) -> tuple[float, float, np.ndarray]:
        """Slip at which stress passes the level, stress after D_c, and (stress, state) at the
        points.
        """
        at = self.inner_coordinates["slip"]
        rows: list[tuple[float, float]] = []
        distance = left = math.nan
        equations = rigid(scene, scene.log_load_rate)
        for step in steps(equations, [start], tolerance, meter):
            passes = (step.before.friction - level) * (step.after.friction - level) <= 0.0
            if passes and math.isnan(distance):
                distance = step.locate(lambda point: point.friction - level)
            if step.start < 1.0 <= step.end:
                left = step.point_at(1.0).friction
            while len(rows) < len(at) and at[len(rows)] <= step.end:
                point = step.point_at(float(at[len(rows)]))
                rows.append((point.friction, point.imbalance - scene.b * scene.log_load_rate))
            if len(rows) == len(at) and not math.isnan(distance):
                return distance, left, np.array(rows)
        raise Halt(Status.INTEGRATION_FAILED, "a response ended by itself")


def _closed_form_misfit(scene: Scene, slip: np.ndarray, stress: np.ndarray) -> float:
    """Largest departure of the stress change from the closed forms at constant normal stress, over
    sigma_*; NaN at variable normal stress.

    Above its steady value (a - b) ln(V/V_*), stress is ``b ln[1 + (V/V_* - 1) exp(-slip/D_c)]`` for
    the slowness law and ``b ln(V/V_*) exp(-slip/D_c)`` for the slip law (eqs. 17a and 17b of the
    paper, less mu_* sigma + a sigma ln(V/V_*), which they leave out).
    """
    if scene.normal_stress == "variable":
        return math.nan
    rate = scene.log_load_rate
    evolving = {
        "slowness": np.log(-np.expm1(-slip) + np.exp(rate - slip)),
        "slip": rate * np.exp(-slip),
    }
    if scene.law not in evolving:
        return math.nan
    exact = (scene.a - scene.b) * rate + scene.b * evolving[scene.law]
    return float(np.abs(stress - exact).max())


def _steady_stress(scene: Scene, log_rate: float) -> float:
    """Deviation of steady-state stress at ln(V/V_*)."""
    mu_ss = steady_state.steady_friction(log_rate, scene.mu_star, scene.a, scene.b)
    return steady_state.steady_shear_stress(mu_ss, scene.mu_star, scene.cot_phi)


def _asymmetry(scene: Scene, log_rate: float) -> dict[str, float]:
    """How much more a step changes than its inverse: at once, and over its evolution to the new
    steady state.

    NaN where the inverse step has no steady state to go to.
    """
    lowest = steady_state.lowest_log_rate(scene.mu_star, scene.a, scene.b, scene.cot_phi)
    if -log_rate <= lowest:
        return {}
    direct, inverse = (friction_after_step(scene, x) for x in (log_rate, -log_rate))
    evolves = direct - _steady_stress(scene, log_rate)
    inverse_evolves = inverse - _steady_stress(scene, -log_rate)
    return {
        "direct_asymmetry": -direct / inverse - 1.0,
        "evolution_asymmetry": -evolves / inverse_evolves - 1.0,
    }


def friction_after_step(scene: Scene, log_rate: float) -> float:
    """Deviation of frictional stress just after a step to ln(V/V_*), the state freed of normal
    stress unchanged.

    Solves ``strength(g) = a ln(V/V_*)``; strength grows with g.

    Raises
    ------
    Halt
        With `normal_stress_lost` where no stress above the fault's opening is that weak, and
        `locked` where none is that strong.
    """
    strength, wanted = strength_of(scene), scene.a * log_rate
    lowest = -1e3 if scene.cot_phi == 0.0 else -(1.0 - 1e-9) / scene.cot_phi
    if strength(lowest)[0] >= wanted:
        raise Halt(Status.NORMAL_STRESS_LOST, "the direct effect takes normal stress away")
    if strength(1e6)[0] <= wanted:
        raise Halt(Status.LOCKED, "no stress is strong enough for the direct effect")
    return float(brentq(lambda g: strength(g)[0] - wanted, lowest, 1e6, xtol=1e-16, rtol=1e-15))
