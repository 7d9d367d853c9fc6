"""The response of a rigid slider to a step of its slip rate: direct effect, evolution, and how much
slip it takes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.measure_base import Measure, Outcome
from rsfstudy.motion import (
    RECORDED_VARIABLES,
    Accuracy,
    EventKind,
    MotionStopped,
    Recording,
    WorkMeter,
    events_along,
    fall,
    rise,
)
from rsfstudy.quantities import Output
from rsfstudy.responses._recorded_motion import estimate_instant_error
from rsfstudy.slider import (
    Scene,
    compute_steady_states,
    equations_of_rigid_slider,
    steady_sliding,
    stress_after_jump,
)
from rsfstudy.status import Status

#: Part of a by which friction evolves after a step, at least: less is lost to rounding.
_MIN_RELATIVE_EVOLUTION = 1e-9

#: Stress changes over sigma_*, and their quotients.
_STRESS_CHANGE_OUTPUTS = (
    ("direct_stress_change", "sigma_*", "stress change just after a rate step"),
    ("direct_asymmetry", "", "direct stress change of the step over that of its inverse, less 1"),
    (
        "evolution_asymmetry",
        "",
        "stress change from direct effect to steady state over that of the inverse step, less 1",
    ),
    ("steady_stress_change", "sigma_*", "change of steady-state stress by a rate step"),
    ("stress_left_at_unit_slip", "sigma_*", "stress above its steady state after a slip of D_c"),
    (
        "closed_form_misfit",
        "sigma_*",
        "largest departure of stress from the closed form at constant normal stress",
    ),
    (
        "exponential_misfit",
        "",
        "largest departure from exponential decay over D_c, as a fraction of the stress change",
    ),
)
_OUTPUTS = (
    Output("evolution_distance", error=True),
    *(Output(name, "", "1", meaning, scale) for name, scale, meaning in _STRESS_CHANGE_OUTPUTS),
    *(
        Output(name, dims=("slip",))
        for name in ("shear_stress", "normal_stress_ratio", "state_variable")
    ),
)


@guard_methods
@dataclass(frozen=True)
class RigidResponse(Measure):
    """Stress against slip of a rigid slider whose slip rate steps from V_* to V, the
    `load_velocity_ratio` of the scene.

    At once stress changes by a sigma ln(V/V_*), the direct effect; then its state evolves over
    slip. At constant normal stress, with r = V/V_* and x slip over D_c, friction less mu_* is

        a ln r - b ln r [1 - exp(-x)]                       (slip law),
        (a - b) ln r + b ln[1 + (r - 1) exp(-x)]            (slowness law).

    `evolution_distance` is the slip in D_c at which 1/e of the change from just after the step to
    steady sliding is left: 1 by the slip law. Stresses are over sigma_*. `shear_stress`,
    `normal_stress_ratio` and `state_variable` have the shape (points,), along `slip`.

    Parameters
    ----------
    slip : float
        How far to follow it, in D_c.
    points : int
        Points of the response that are kept, evenly spaced along `slip`.

    References
    ----------
    Section 2.3 and eqs. 16 and 17 of doi:10.1007/s11589-014-0098-4; Ruina (1983), J. Geophys. Res.
    88, 10359-10370.
    """

    slip: float = 10.0
    points: int = 201
    name: ClassVar[str] = "rigid_response"
    primary_output = "evolution_distance"
    typical_work = 800
    outputs = _OUTPUTS
    needs_time: ClassVar[tuple[bool, ...]] = ()

    def __post_init__(self) -> None:
        if not 1.0 <= self.slip < math.inf:
            raise InvalidValue("slip", self.slip, "must be at least 1 D_c")
        if self.points < 2:
            raise InvalidValue("points", self.points, "must be at least 2")

    @property
    def inner_coordinates(self) -> Mapping[str, np.ndarray]:
        return {"slip": np.linspace(0.0, self.slip, self.points)}

    def error_scales(self, scene: Scene, values: Mapping[str, Any]) -> Mapping[str, float]:
        """The distance itself, that ends where stress falls by 1/e of its evolution over D_c."""
        evolution = abs(values["direct_stress_change"] - values["steady_stress_change"])
        part = 1.0 + math.e * scene.a / evolution
        return {"evolution_distance": part * abs(values["evolution_distance"])}

    def compute(self, scene: Scene, accuracy: Accuracy, meter: WorkMeter) -> Outcome:
        """The response, followed over slip at two tolerances: their difference is the error."""
        log_slip_rate = scene.log_load_velocity
        if log_slip_rate == 0.0:
            return Outcome(Status.NO_STEP, message="V = V_* is no step")
        if log_slip_rate == -math.inf:
            return Outcome(Status.NO_STEADY_STATE, message="the load point is held: nothing slips")
        sliding = steady_sliding(scene, log_slip_rate)
        if sliding is None:
            return Outcome(Status.NO_STEADY_STATE, message="no steady state at this slip rate")
        start, steady = friction_after_step(scene, log_slip_rate), sliding.frictional_stress
        if abs(start - steady) < _MIN_RELATIVE_EVOLUTION * scene.a:
            return Outcome(Status.NOT_APPLICABLE, message="friction does not evolve after the step")
        level = steady + (start - steady) / math.e
        distance, left, rows = self._follow_response(scene, start, level, accuracy, meter)
        again, _left, _rows = self._follow_response(scene, start, level, accuracy.refined(), meter)
        # where an exponential has 1/e left
        by_friction = math.e * distance / (start - steady)
        slip = self.inner_coordinates["slip"]
        exponential = steady + (start - steady) * np.exp(-slip)
        departs = (rows[:, 0] - exponential) / (start - steady)
        return Outcome(
            Status.OK,
            {
                "evolution_distance": distance,
                "evolution_distance_error": estimate_instant_error(
                    distance, again, by_friction, scene, accuracy
                ),
                "direct_stress_change": start,
                **_compute_asymmetries(scene, log_slip_rate),
                "steady_stress_change": steady,
                "stress_left_at_unit_slip": left - steady,
                "closed_form_misfit": _closed_form_misfit(scene, steady, slip, rows[:, 0]),
                "exponential_misfit": float(departs[np.abs(departs).argmax()]),
                "shear_stress": scene.mu_star + rows[:, 0],
                "normal_stress_ratio": rows[:, 2],
                "state_variable": rows[:, 1],
            },
        )

    def _follow_response(
        self, scene: Scene, start: float, level: float, accuracy: Accuracy, meter: WorkMeter
    ) -> tuple[float, float, np.ndarray]:
        """Slip at which stress passes the level, stress after D_c, and (stress, state, normal
        stress) at the points.
        """
        at, distance = self.inner_coordinates["slip"], math.nan
        recording = Recording(sample_times=np.union1d(at, [1.0]))
        equations = equations_of_rigid_slider(scene, scene.log_load_velocity)
        watches = (rise("frictional_stress", level), fall("frictional_stress", level))
        # states freed of stress are still those of steady sliding at V_* before the step
        state = (start, *compute_steady_states(scene, 0.0, 0.0)[1:])
        tolerance, complete = accuracy.local_tolerance, False
        for event in events_along(equations, state, tolerance, meter, watches, recording=recording):
            if event.specification is not None and math.isnan(distance):
                distance = event.slip
            complete = complete or event.kind is EventKind.SAMPLED
            if complete and not math.isnan(distance):
                break
        names = ("slip", "frictional_stress", "state_variable", "normal_stress_ratio")
        columns = [RECORDED_VARIABLES.index(name) for name in names]
        slips, *values = recording.table(scene)[:, columns].T
        values[0] = values[0] - scene.mu_star
        rows = np.stack(values, axis=1)
        return distance, float(rows[slips == 1.0, 0][0]), rows[np.isin(slips, at)]


def _closed_form_misfit(scene: Scene, steady: float, slip: np.ndarray, stress: np.ndarray) -> float:
    """Largest departure of the stress change from the closed form of the law at normal stress that
    is constant after the step (eqs. 17a and 17b of the paper, less mu_* sigma + a sigma ln(V/V_*),
    which they leave out), over sigma_*; NaN where there is none.
    """
    law, parts = scene.parts.law, scene.parts
    stress_acts = parts.normal_stress.effects or parts.fluid.effects or law.depends_on_stress
    if stress_acts or law.relaxation is None:
        return math.nan
    left = np.array([law.relaxation(scene.log_load_velocity, at) for at in slip.tolist()])
    exact = steady + (1.0 + scene.imposed_normal_stress) * scene.b * left
    return float(np.abs(stress - exact).max())


def _compute_asymmetries(scene: Scene, log_slip_rate: float) -> dict[str, float]:
    """Relative excess of the change by a step over that by its inverse: at once, and over its
    evolution to the new steady state.

    Empty where the inverse step has no steady state to go to.
    """
    steady, inverse_steady = (steady_sliding(scene, x) for x in (log_slip_rate, -log_slip_rate))
    if steady is None or inverse_steady is None:
        return {}
    direct, inverse = (friction_after_step(scene, x) for x in (log_slip_rate, -log_slip_rate))
    evolves = direct - steady.frictional_stress
    inverse_evolves = inverse - inverse_steady.frictional_stress
    return {
        "direct_asymmetry": -direct / inverse - 1.0,
        "evolution_asymmetry": -evolves / inverse_evolves - 1.0,
    }


def friction_after_step(scene: Scene, log_slip_rate: float) -> float:
    """Deviation of frictional stress just after a step to ln(V/V_*), the state freed of normal
    stress unchanged.

    Raises
    ------
    MotionStopped
        With `normal_stress_lost` where no stress above the fault's opening is that weak, and
        `locked` where none is that strong.
    """
    friction = stress_after_jump(scene, scene.a * log_slip_rate)
    if friction is None and log_slip_rate < 0.0:
        raise MotionStopped(Status.NORMAL_STRESS_LOST, "the direct effect takes normal stress away")
    if friction is None:
        raise MotionStopped(Status.LOCKED, "no stress is strong enough for the direct effect")
    return friction
