"""Tests of motions that cannot continue, and of events before their end."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq
from study_runs import start_point

import rsfstudy
from rsfstudy import Scene
from rsfstudy.critical_steps.motion_after_step import motion_reaches_instability_norm
from rsfstudy.errors import IncompleteWarning, NoResultWarning
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.motion.integration_events import EventKind, rise
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.regime_switching import (
    CONTINUES,
    compute_margin_to_motion_termination,
    find_termination_status,
)
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.status import Status

ENGINES = (SCIPY, COMPILED)


def test_a_margin_is_left_where_a_motion_goes_on():
    rates, stresses = (-700.0, -10.0, 270.0, 280.0), (-1.0, 1e-12, 1e-9, 1.0, 1e6, 1e7)
    for load in (0.0, 1.0):
        for x in rates:
            for stress in stresses:
                goes_on = find_termination_status(x, stress, load) == CONTINUES
                assert (compute_margin_to_motion_termination(x, stress, load) > 1e-12) == goes_on, (
                    x,
                    stress,
                    load,
                )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_runaway_is_followed_to_its_end(engine):
    """All levels are reported before the slip rate becomes unbounded.

    Without inertia, the slip rate grows without bound within one step.
    """
    scene = Scene(stiffness_ratio=0.5, displacement_step=3.0)
    levels = [rise("log_slip_rate", to) for to in (50.0, 150.0, 250.0)]
    met, integrator = [], Integrator(Accuracy(1e-6, 100_000, engine=engine))

    def follow_on() -> None:
        for event in integrator.follow(scene, levels):
            met.extend([event.specification.level] if event.kind is EventKind.RISE else [])

    with pytest.raises(MotionStopped, match=r"exceeded 10\^120"):
        follow_on()
    assert met == [50.0, 150.0, 250.0]
    with (
        pytest.warns(IncompleteWarning, match="slip_rate_unbounded"),
        pytest.warns(NoResultWarning, match="exceeds the instability norm"),
    ):
        motion = rsfstudy.simulate(scene, engine=engine)
    assert float(motion.log10_slip_rate[-1]) == pytest.approx(120.0, abs=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_slip_that_nothing_loads_is_followed_to_its_end(engine):
    """Slip without loading is integrated until it stops.

    With the slowness law, ln V falls to ln(10^-290) as the state grows. The square of the
    evolution per slip overflows there.
    """
    scene = Scene(
        law="slowness", normal_stress="constant", b_over_a=5.0, stiffness_ratio=0.5,
        inertia=True, displacement_step=3.0,
    )  # fmt: skip
    integrator = Integrator(Accuracy(1e-4, 5_000, engine=engine))
    with pytest.raises(MotionStopped) as halt:
        list(integrator.follow(scene))
    assert halt.value.status is Status.SLIP_STOPPED


@pytest.mark.parametrize("engine", ENGINES)
def test_the_norm_is_met_before_normal_stress_is_lost(engine):
    """The slip rate reaches the norm before the normal stress vanishes.

    The least principal stress is negative in these scenes.
    """
    scene = Scene(
        b_over_a=1.5, stiffness_ratio=1.2, phi=38.0, alpha=0.0, law="slowness",
        load_velocity_ratio=0.0,
    )  # fmt: skip
    for step, reached in ((-0.0271, False), (-0.028, True), (-0.035, True), (-0.05, True)):
        stepped = scene.with_(normal_stress_step=step)
        for rtol in (1e-6, 1e-8):
            asked = Integrator(Accuracy(rtol, 100_000, engine=engine))
            assert motion_reaches_instability_norm(stepped, asked) is reached, (step, rtol)


@pytest.mark.parametrize("rise_by", [0.5, 5.0, 11.0, 30.0, 60.0])
@pytest.mark.parametrize("damping", [1e-6, 1e-3, 0.1])
def test_waves_after_a_large_rise_of_normal_stress(rise_by, damping):
    """The initial slip rate with radiation damping is the root of an equation.

    The equation ``mu_* + g = s (mu_* + a x - alpha ln s)`` with g = -eta (e^x - 1) and s =
    1 + e + c g has a single root. The tolerance is the rounding error divided by a.
    """
    scene = Scene(b_over_a=1.5, radiation_damping=damping, normal_stress_step=rise_by)
    cot_phi, alpha = scene.parts.normal_stress.coupling

    def missing(x: float) -> float:
        friction = -damping * math.expm1(x)
        ratio = 1.0 + rise_by + cot_phi * friction
        if ratio <= 0.0:
            return -1.0
        strength = scene.mu_star + scene.a * x - alpha * math.log(ratio)
        return scene.mu_star + friction - ratio * strength

    # The stress decreases and the strength increases with x while the normal stress is positive.
    expected = brentq(missing, -60.0, 60.0, xtol=1e-13)
    assert start_point(scene).log_slip_rate == pytest.approx(expected, abs=1e-9)
