"""Tests of motions with a given initial stress and state."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from study_runs import start_point

from rsfstudy import Scene
from rsfstudy.motion.initial_points import compute_initial_point

DYNAMICS = ({}, {"radiation_damping": 1e-3}, {"inertia": True})


@given(
    stress=st.floats(-0.3, 0.3),
    state=st.floats(-0.2, 0.2),
    normal_stress=st.sampled_from(["constant", "imposed", "variable"]),
    dependence=st.sampled_from([0.0, 2.0]),
    dynamics=st.sampled_from(DYNAMICS),
)
def test_it_begins_as_stated(stress, state, normal_stress, dependence, dynamics):
    """The initial point has the given spring stress and state variable.

    The slip rate follows from friction. The values agree to rounding error, divided by a
    for the slip rate.
    """
    scene = Scene(
        normal_stress=normal_stress,
        stress_dependence=dependence,
        initial_stress=stress,
        initial_state=state,
        **dynamics,
    )
    begin = start_point(scene)
    assert begin.spring_stress == stress
    # A root finder solves for the state to rounding, which inertia amplifies at high slip rates.
    assert begin.state == pytest.approx(state, abs=1e-12)
    friction = scene.mu_star + scene.a * begin.log_slip_rate + state
    assert begin.friction_coefficient == pytest.approx(friction, abs=1e-12)


def test_steps_come_on_top():
    """With inertia, the slip rate does not change at the time of a step."""
    scene = Scene(initial_state=0.05, inertia=True, normal_stress="imposed", alpha=0.3)
    begin = compute_initial_point(scene)
    after = compute_initial_point(scene.with_(displacement_step=0.5, normal_stress_step=-0.01))
    assert after.log_slip_rate == pytest.approx(begin.log_slip_rate, abs=1e-12)
    assert after.spring_stress == scene.stiffness * 0.5
    after = start_point(scene.with_(displacement_step=0.5, normal_stress_step=-0.01))
    assert after.state == pytest.approx(0.05 - 0.3 * math.log(0.99), abs=1e-14)
