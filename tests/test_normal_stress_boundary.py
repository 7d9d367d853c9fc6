"""Tests of critical steps of normal stress.

The tests cover closed forms, limits, the comparison of three triggers as stress changes,
motions on both sides, both engines and invalid input.
"""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rsfstudy.named_studies._critical_triggers import Triggers

from rsfstudy import Scene
from rsfstudy.critical_steps import critical_step
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.motion_after_step import motion_reaches_instability_norm
from rsfstudy.critical_steps.stability_after_step import (
    has_closed_orbits_at_critical_stiffness,
    has_frictional_damping_only,
    is_neutrally_stable,
)
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator
from rsfstudy.slider import closed_forms, stability
from rsfstudy.status import Status

STEP, VALUE = "normal_stress_step", "critical_normal_stress_step"
FALL, RISE = CriticalStep(of=STEP, direction="down"), CriticalStep(of=STEP)
IMPOSED = {"normal_stress": "imposed"}


def found(scene: Scene, measure: CriticalStep = FALL, accuracy: Accuracy | None = None):
    """Return the value, its error estimate and the outcome of a search.

    The search must succeed.
    """
    outcome = measure(scene, accuracy or Accuracy())
    assert outcome.status is Status.OK, outcome
    return outcome.values[VALUE], outcome.values[f"{VALUE}_error"], outcome


# ---- closed forms -------------------------------------------------------------------------------


def test_an_extreme_law():
    """The threshold of the law ``perrin_rice_zheng`` is asinh(q k/k_cr)."""
    scene = Scene(
        law="perrin_rice_zheng", **IMPOSED, alpha=0.4, stiffness_ratio=2.0, instability_norm=1e12
    )
    value, error, _outcome = found(scene)
    q = 1.0 / (1.0 + value)
    start = closed_forms.compute_state_offset_after_stress_fall(
        scene.mu_star, scene.a, scene.b_over_a, 0.4, q
    )
    assert start == pytest.approx(math.asinh(2.0 * q), abs=(error + 1e-7 * abs(value)) / scene.a)


# ---- all triggers at once -----------------------------------------------------------------------


def test_triggers_are_the_critical_steps_and_their_stresses():
    """The measure returns the three critical steps and their stresses."""
    scene = Scene(law="slowness", alpha=0.4, phi=60.0, stiffness_ratio=1.2)
    outcome = Triggers()(scene, Accuracy(1e-5))
    for measure in (FALL, CriticalStep(of="displacement_step"), CriticalStep()):
        alone = measure(scene, Accuracy(1e-5)).values
        for end in ("", "_error", "_stable", "_unstable"):
            name = f"{measure.primary_output}{end}"
            assert outcome.values[name] == alone[name]
    values = outcome.values
    friction = values["effective_friction"]
    coulomb = -friction * values[VALUE]
    assert values["coulomb_stress_of_normal_stress"] == pytest.approx(coulomb, rel=1e-15)
    pulled = scene.stiffness * values["critical_displacement"]
    pulled -= friction * pulled / math.tan(math.radians(60.0))
    assert values["coulomb_stress_of_displacement"] == pytest.approx(pulled, rel=1e-12)
    assert values["coulomb_ratio"] == pytest.approx(coulomb / pulled, rel=1e-12)
    direct = scene.a * math.log(values["critical_velocity_ratio"])
    assert values["direct_stress_of_velocity"] == pytest.approx(direct, rel=1e-12)
    assert values["direct_ratio"] == pytest.approx(direct / pulled, rel=1e-12)
    tight = Triggers()(scene, Accuracy(1e-8)).values
    for name in ("coulomb_ratio", "direct_ratio", "coulomb_stress_of_displacement"):
        assert abs(values[name] - tight[name]) <= values[f"{name}_error"]


def test_a_trigger_without_a_number_is_left_out_and_told():
    soft = Triggers()(Scene(**IMPOSED, stiffness_ratio=0.5), Accuracy(1e-4))
    assert soft.status is Status.OK
    assert "load_velocity_ratio: steady sliding at V_* is unstable" in soft.message
    assert "direct_ratio" not in soft.values
    heavy = {"inertia": True, "instability_norm": 2.0, "law": "slowness"}
    far = Triggers()(Scene(**heavy, alpha=0.56, phi=50.0, stiffness_ratio=1.3), Accuracy(1e-3))
    assert far.status is Status.NORM_UNREACHABLE
    constant = Triggers()(Scene(normal_stress="constant"), Accuracy())
    assert constant.status is Status.NOT_APPLICABLE


# ---- every kind of scene ------------------------------------------------------------------------

STRESSES = [IMPOSED | {"alpha": 0.0}, IMPOSED | {"alpha": 0.56}, {"alpha": 0.4, "phi": 55.0}]
DYNAMICS = [{}, {"radiation_damping": 1e-6}, {"inertia": True, "instability_norm": 0.3}]


@settings(max_examples=10)
@given(
    law=st.sampled_from(["slip", "slowness", "family", "perrin_rice_zheng", "composite"]),
    stress=st.sampled_from(STRESSES),
    dynamics=st.sampled_from(DYNAMICS),
    ratio=st.floats(0.2, 1.8),
    b_over_a=st.floats(1.3, 4.0),
    moves=st.booleans(),
)
def test_either_side_of_a_fall(law, stress, dynamics, ratio, b_over_a, moves):
    """Motions confirm a critical step, or the outcome contains the reason.

    The motions have another tolerance.
    """
    load = {"load_velocity_ratio": 1.0} if moves and ratio > 1.05 else {}
    scene = Scene(law=law, b_over_a=b_over_a, stiffness_ratio=ratio, **stress, **dynamics, **load)
    outcome = FALL(scene, Accuracy(1e-5))
    assert outcome.status in (Status.OK, Status.NORM_UNREACHABLE), outcome
    if outcome.status is not Status.OK:
        return
    value, error = outcome.values[VALUE], outcome.values[f"{VALUE}_error"]
    stable, unstable = (outcome.values[f"{VALUE}_{side}"] for side in ("stable", "unstable"))
    assert -1.0 < value < 0.0 < error < 1e-3 * abs(value)
    assert unstable <= value <= stable < 0.0
    if "jump" in outcome.message:
        return
    for side, reached in ((1.0 - 1e-4, False), (1.0 + 1e-4, True)):
        stepped = scene.with_(normal_stress_step=math.expm1(side * math.log1p(value)))
        assert (
            motion_reaches_instability_norm(stepped, Integrator(Accuracy(1e-6, 200_000))) is reached
        )


@pytest.mark.parametrize("dynamics", DYNAMICS, ids=str)
def test_paths_and_motions_agree(dynamics, monkeypatch):
    """The path solution and the search with motions agree."""
    scene = Scene(**STRESSES[2], **dynamics, stiffness_ratio=1.2, load_velocity_ratio=1.0)
    value, error, _outcome = found(scene)
    for shot in (
        "find_critical_step_size_by_critical_path",
        "find_critical_step_size_by_limit_cycle",
    ):
        monkeypatch.setattr(critical_step, shot, lambda *_asked: None)
    forward, its_error, _outcome = found(scene, accuracy=Accuracy(1e-5))
    assert abs(value - forward) <= error + its_error


@pytest.mark.parametrize(
    ("fields", "published"),
    [
        # Sliding at the new normal stress becomes unstable near k_cr = 1.3.
        ({"law": "slip", "alpha": 0.0}, 0.16747205),
        # The first peak is critical.
        ({"law": "slowness", "alpha": 0.56}, 0.29498411),
    ],
)
def test_rises_under_a_load_point_that_moves(fields, published):
    """A rise of normal stress may trigger instability if the load point moves.

    The rise first reduces the shear stress ratio and the stability. If the load point is
    held, a rise never triggers instability.
    """
    scene = Scene(**IMPOSED, **fields, stiffness_ratio=1.3, load_velocity_ratio=1.0)
    value, error, _outcome = found(scene, RISE, Accuracy(1e-6))
    assert value == pytest.approx(published, abs=error + 1e-8)
    held = RISE(scene.with_(load_velocity_ratio=0.0, alpha=0.0), Accuracy(1e-4))
    assert held.status is Status.STABLE_FOR_ALL_STEPS


# ---- what is said of steady sliding after the step ----------------------------------------------


def test_normal_stress_that_is_imposed_is_constant_between_steps():
    """Imposed normal stress is constant between steps.

    For any alpha, friction is the only damping, orbits may be closed, and the critical
    stiffness is proportional to normal stress.
    """
    scene = Scene(**IMPOSED, alpha=0.5, load_velocity_ratio=2.0)
    assert has_frictional_damping_only(scene)
    assert has_closed_orbits_at_critical_stiffness(scene)
    assert not has_frictional_damping_only(Scene(alpha=0.5))
    stepped = scene.with_(normal_stress_step=0.25, stiffness_ratio=1.25)
    after = stability.compute_critical_stiffness(stepped, stepped.log_load_velocity)
    assert after == pytest.approx(1.25 * scene.critical_stiffness, rel=1e-9)
    law = {"law": "perrin_rice_zheng"}
    assert is_neutrally_stable(stepped.with_(**law), 1e-6)
    assert not is_neutrally_stable(scene.with_(**law, normal_stress_step=0.25), 1e-6)


def test_coulomb_stresses_add_up():
    """Without alpha, two triggers add up to the critical Coulomb stress.

    The first half is a decrease of normal stress, and the second half is a displacement
    step.
    """
    scene = Scene(**IMPOSED, alpha=0.0, stiffness_ratio=1.2)
    fallen = found(scene)[0]
    part = scene.with_(normal_stress_step=0.5 * fallen)
    pulled = CriticalStep(of="displacement_step")(part, Accuracy())
    assert pulled.status is Status.OK
    left = pulled.values["critical_displacement"] * scene.stiffness
    assert left == pytest.approx(0.5 * scene.mu_star * abs(fallen), rel=1e-4)
