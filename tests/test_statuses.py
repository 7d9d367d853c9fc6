"""Tests of the statuses of all measures.

Each measure has a result for every law, or a status that explains the missing result.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from rsfstudy.named_studies._bifurcation import Bifurcation
from rsfstudy.named_studies._critical_triggers import Triggers
from rsfstudy.named_studies._normal_stress_response import NormalStressResponse
from rsfstudy.named_studies._normal_stress_transient import NormalStressTransient

from rsfstudy import Scene
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.rigid_response import RigidResponse
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.slider import laws
from rsfstudy.status import Status

UP, DOWN = CriticalStep(), CriticalStep(direction="down")
CONSTANT, SLOWNESS = {"normal_stress": "constant"}, {"law": "slowness"}
IMPOSED = {"normal_stress": "imposed", "alpha": 0.3}
CYCLES = {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True}
SLOW = {"law": "two_slip_states", **CONSTANT, "a": 0.01, "load_velocity_ratio": 1.0,
        "displacement_step": 2.0}  # fmt: skip
WAVES = {**IMPOSED, "oscillation_amplitude": 1e-3, "oscillation_period": 7.0,
         "stiffness_ratio": 1.5}  # fmt: skip
STEP = {**IMPOSED, "normal_stress_step": 0.1, "load_velocity_ratio": 1.0, "stiffness_ratio": 20.0}
HELD, TWO = {"displacement_step": 0.3}, {"law": "two_slip_states"}
LOAD_HELD = {"load_velocity_ratio": 0.0}

#: Measures and scenes, with the expected status and message.
ENDS = [
    (UP, {"instability_norm": 5e-9}, Status.NORM_BELOW_LOADING_RATE,
     "because V_* T/(2 pi D_c) is 9.31e-09. Pass a value of instability_norm="),
    (UP, {"stiffness_ratio": 0.8}, Status.UNSTABLE_AT_ANY_STEP, ""),
    (UP, {"inertia": True, "instability_norm": 1e3}, Status.NORM_UNREACHABLE, ""),
    (CriticalStep(of="displacement_step", direction="down"), {}, Status.STABLE_FOR_ALL_STEPS, ""),
    # A large step has a critical path, but steady sliding is already unstable.
    (UP, {**SLOWNESS, "b_over_a": 5.0, "stiffness_ratio": 0.8}, Status.UNSTABLE_AT_ANY_STEP, ""),
    # At k = k_cr, every orbit is closed, and the rounding errors of a large decrease are
    # irrelevant.
    (DOWN, CONSTANT, Status.STABLE_FOR_ALL_STEPS, ""),
    (DOWN, {**SLOWNESS, **CONSTANT}, Status.STABLE_FOR_ALL_STEPS, ""),
    # The angle phi is close to atan(mu_*), so the normal stress grows faster than the shear
    # stress.
    (UP, {**SLOWNESS, "a": 0.066, "b_over_a": 8.1, "mu_star": 0.6, "phi": 33.0, "alpha": 0.0,
          "stiffness_ratio": 0.37}, Status.LOCKED, ""),
    (LimitCycle(), {**CYCLES, "stiffness_ratio": 1.2}, Status.NO_LIMIT_CYCLE, "settles to steady"),
    # The critical stiffness decreases with V_0, so a spring that is soft at V_* is stiff at 1000
    # V_*.
    (LimitCycle(), {**CYCLES, "load_velocity_ratio": 1000.0, "phi": 50.0}, Status.NO_LIMIT_CYCLE,
     "settles to steady sliding"),
    (LimitCycle(), {**CYCLES, **LOAD_HELD}, Status.NO_LIMIT_CYCLE, "held"),
    *(
        (measure, {**SLOW, "stiffness_ratio": ratio, **more}, status, "")
        for measure in (LimitCycle(phases=2), Bifurcation(transient=8, events=8))
        for ratio, more, status in (
            (1.4, {}, Status.NO_LIMIT_CYCLE), (0.9, LOAD_HELD, Status.NO_LIMIT_CYCLE),
            (0.8, {}, Status.SLIP_RATE_UNBOUNDED),
        )
    ),
    (LinearStability(), {"phi": 40.0, "load_velocity_ratio": 1e-4}, Status.NO_STEADY_STATE, ""),
    (LinearStability(), {"inertia": True, "period": 1e8, "load_velocity_ratio": 100.0},
     Status.UNSTABLE_AT_ANY_STIFFNESS, "direct effect"),
    *(
        (measure, {**HELD, **stress, **law}, Status.NO_STEADY_STATE, "the load point is held")
        for measure in (LinearStability(), RigidResponse(points=3))
        for stress in ({}, CONSTANT)
        for law in ({}, TWO)
    ),
    (RigidResponse(), {}, Status.NO_STEP, ""),
    (RigidResponse(), {"load_velocity_ratio": 1e-35}, Status.NO_STEADY_STATE, ""),
    (StepResponse(), {"displacement_step": 1.0}, Status.NO_STEADY_STATE, ""),
    (StepResponse(), {"load_velocity_ratio": 20.0}, Status.SLIP_RATE_UNBOUNDED, ""),
    (Triggered(), {"load_velocity_ratio": 1e5, "instability_norm": 5e-4},
     Status.NORM_BELOW_LOADING_RATE, ""),
    (Healing(), {"stiffness_ratio": 3.0}, Status.NO_STEP, "no hold"),
    (Healing(), {"oscillation_amplitude": 0.1}, Status.NO_STEP, ""),
    (VelocityStep(), {"stiffness_ratio": 3.0}, Status.NO_STEP, ""),
    *((VelocityStep(step_number=n), {"hold_time": 10.0}, Status.NOT_APPLICABLE, "")
      for n in (1, 2, 3)),
    (NormalStressResponse(), {**IMPOSED, "load_velocity_ratio": 2.0}, Status.NO_STEP, ""),
    (NormalStressResponse(), {**IMPOSED, "normal_stress_ramp": 0.1}, Status.NO_STEP, ""),
    (NormalStressResponse(), {**WAVES, **LOAD_HELD}, Status.NO_STEADY_STATE, ""),
    (NormalStressResponse(), {**WAVES, "stiffness_ratio": 0.9}, Status.NOT_APPLICABLE, ""),
    (NormalStressResponse(), {**WAVES, "stiffness_ratio": 1.1, "oscillation_amplitude": 0.1},
     Status.SLIP_RATE_UNBOUNDED, ""),
    (NormalStressTransient(), {**STEP, "normal_stress_step": 0.0}, Status.NO_STEP, "not change"),
    (NormalStressTransient(), {**STEP, **LOAD_HELD}, Status.NOT_APPLICABLE,
     "load point velocity is not V_"),
    (NormalStressTransient(), {**STEP, "displacement_step": 0.1}, Status.NOT_APPLICABLE,
     "load point velocity is not V_"),
    (NormalStressTransient(), {**STEP, "normal_stress": "variable", "phi": 60.0},
     Status.NOT_APPLICABLE, "depends on shear stress"),
    (NormalStressTransient(), {**STEP, "fluid": "dilatant"}, Status.NOT_APPLICABLE,
     "depends on shear stress or pore pressure"),
    (NormalStressTransient(), {**STEP, "stiffness_ratio": 2.0}, Status.NOT_APPLICABLE,
     "loading or unloading"),
    *(
        (Triggers(), {"stiffness_ratio": 0.5, **fields}, Status.NOT_APPLICABLE,
         "no unique effective friction")
        for fields in (CONSTANT, {"normal_stress": "imposed", "fluid": "dilatant"},
                       {"normal_stress": "imposed", "law": "composite"})
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("measure", "fields", "status", "message"), ENDS, ids=lambda x: str(getattr(x, "name", x))
)
def test_what_has_no_number_is_named(measure, fields, status, message):
    outcome = measure(Scene(**fields), Accuracy(1e-5))
    assert outcome.status is status
    assert status.is_answer
    assert outcome.message
    assert message in outcome.message
    assert not np.isfinite(outcome.values.get(measure.primary_output, math.nan)).any()


# ---- every law -----------------------------------------------------------------------------------

#: Measures and scenes of each question.
QUESTIONS = {
    "rate step": (CriticalStep(), {"stiffness_ratio": 1.25}),
    "displacement step": (CriticalStep(of="displacement_step"), {"stiffness_ratio": 1.25}),
    "cycle": (LimitCycle(phases=2), {"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0}),
    "response": (StepResponse(peaks=3), {"stiffness_ratio": 1.1, "load_velocity_ratio": 1.5}),
    "rigid": (RigidResponse(), {"load_velocity_ratio": 10.0}),
    "stability": (LinearStability(), {"load_velocity_ratio": 2.0}),
}
SLIDERS = [
    {"normal_stress": "constant"},
    {"normal_stress": "variable", "stress_dependence": 1.0, "radiation_damping": 1e-9},
    {"normal_stress": "variable", "inertia": True},
]
#: All laws, and laws with two states one of which strengthens friction.
LAWS = [{"law": law} for law in sorted(laws.BUILT_IN_LAW_CLASS_BY_NAME)]
LAWS += [
    {"law": law, "a": 0.01, "b1_over_a": 1.4, "b2_over_a": -0.6, "length_ratio": 50.0}
    for law in ("two_slip_states", "two_slowness_states")
]
#: Without inertia or damping, the slip rate of most laws becomes unbounded in a rupture.
CYCLES_END = (Status.OK, Status.SLIP_RATE_UNBOUNDED)
#: All combinations of questions and laws. Each pair of question, law and slider occurs at least
#: once.
ASKED = [
    (question, law, SLIDERS[(row + column) % len(SLIDERS)])
    for row, question in enumerate(QUESTIONS)
    for column, law in enumerate(LAWS)
]


@pytest.mark.parametrize(("question", "law", "slider"), ASKED, ids=str)
def test_every_measure_answers_for_every_law(question, law, slider):
    measure, fields = QUESTIONS[question]
    scene = Scene(**law, **slider, **fields)
    # Scenes with several states need many events.
    engine = COMPILED if question == "cycle" and scene.state_count > 1 else SCIPY
    found = measure(scene, Accuracy(1e-4, engine=engine))
    quasi_static = slider is SLIDERS[0]
    assert found.status in (CYCLES_END if question == "cycle" and quasi_static else CYCLES_END[:1])
    if found.status is Status.OK:
        assert math.isfinite(found.values[measure.primary_output])
