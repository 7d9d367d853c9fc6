"""Tests of steps of imposed normal stress and their critical size."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq
from study_runs import start_point

from rsfstudy import Scene
from rsfstudy.critical_steps.motion_after_step import motion_reaches_instability_norm
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.initial_points import compute_initial_point
from rsfstudy.motion.integrator import Integrator


@given(
    step=st.floats(-0.5, 1.0).filter(lambda x: abs(x) > 1e-6),
    alpha=st.floats(0.0, 0.6),
    inertia=st.booleans(),
)
def test_at_the_instant_of_a_step(step, alpha, inertia):
    """A step of normal stress changes state and slip rate at once.

    Spring stress is continuous, and the state changes by -alpha ln s. The slip rate jumps
    so that friction balances the spring. With inertia, the slip rate is continuous and
    friction jumps. The tolerance is the rounding error divided by a.
    """
    scene = Scene(
        normal_stress="imposed",
        alpha=alpha,
        inertia=inertia,
        normal_stress_step=step,
        load_velocity_ratio=1.0,
    )
    point, ratio = start_point(scene), 1.0 + step
    assert point.spring_stress == 0.0
    assert point.normal_stress == ratio
    assert point.state == pytest.approx(-alpha * math.log(ratio), abs=1e-15)
    if inertia:
        point = compute_initial_point(scene)
        assert point.log_slip_rate == 0.0
        stress = ratio * (scene.mu_star - alpha * math.log(ratio)) - scene.mu_star
        assert point.frictional_stress == pytest.approx(stress, abs=1e-14)
    else:
        excess = scene.mu_star / ratio - scene.mu_star + alpha * math.log(ratio)
        assert point.log_slip_rate == pytest.approx(excess / scene.a, abs=1e-12)


@pytest.mark.parametrize("law", ["slip", "slowness", "perrin_rice_zheng"])
@pytest.mark.parametrize("alpha", [0.0, 0.4])
def test_a_fall_of_normal_stress_triggers_beyond_its_closed_form(law, alpha):
    """The critical decrease of normal stress agrees with the closed form.

    The motion starts at u = mu_* (q - 1)/a - alpha (1/a - 1/b) ln q with q = sigma_*/sigma.
    If the load point is held and the norm is large, the threshold is h(u) = -q k/k_cr.
    Steps that differ by a relative 1e-6 are on both sides of it.
    """
    threshold = {"slip": lambda x: x, "slowness": lambda x: -math.log1p(-x)}
    threshold["perrin_rice_zheng"] = math.asinh
    at = threshold[law]
    scene = Scene(
        law=law,
        normal_stress="imposed",
        alpha=alpha,
        stiffness_ratio=0.4,
        instability_norm=1e20,
        b_over_a=1.6,
    )

    def start(q: float) -> float:
        direct, evolving = scene.mu_star / scene.a, alpha * (1.0 / scene.a - 1.0 / scene.b)
        return direct * (q - 1.0) - evolving * math.log(q)

    q = brentq(lambda q: start(q) - at(0.4 * q), 1.0, 1.24, xtol=1e-15)
    step = 1.0 / q - 1.0
    for share, reached in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        stepped = scene.with_(normal_stress_step=share * step)
        assert (
            motion_reaches_instability_norm(stepped, Integrator(Accuracy(1e-9, 100_000))) is reached
        )
