"""Tests of the integrator.

The references are exact invariants, results in extended precision, and a second formulation
of the equations.
"""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_helpers import follow_until

from rsfstudy import Scene
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import PYTHON, SCIPY
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.slider.equations import (
    EquationsOfMotion,
    build_equations_against_displacement,
    build_equations_between_ruptures,
)
from rsfstudy.slider.integration_path_length import compute_displacement_per_path_length
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.slider.parameter_layout import LAW
from rsfstudy.status import Status


@pytest.mark.parametrize("load_velocity_ratio", [1.5, 20.0])
def test_invariant_of_the_slowness_law_at_critical_stiffness(load_velocity_ratio):
    """H = Omega - ln Omega + lambda (w - ln w) is conserved.

    The conservation holds at constant normal stress and k = k_cr.
    """
    scene = Scene(
        law="slowness", normal_stress="constant", b_over_a=1.7,
        load_velocity_ratio=load_velocity_ratio,
    )  # fmt: skip
    weakening, held = 0.7, []

    def invariant(point):
        steadiness = point.steady_state_offset / scene.b  # ln(V theta/D_c)
        load = scene.log_load_velocity - point.log_slip_rate + steadiness
        return math.exp(steadiness) - steadiness + weakening * (math.exp(load) - load)

    def until(event):
        held.append(invariant(event.point))
        return event.independent_variable > 300.0  # This path length covers about ten periods.

    follow_until(scene, 1e-9, until)
    # H is of order 10, and local errors of 2e-11 accumulate to its drift.
    assert np.ptp(held) < 1e-8


@pytest.mark.parametrize("b_over_a", [1.5, 2.0, math.e])
def test_separatrix_of_the_slip_law_at_critical_stiffness(b_over_a):
    """The separatrix z = kappa v0/v - kappa + f/a + lambda x = 1 is conserved.

    The path starts at V_0/V_* = 1 + 1/lambda.
    """
    weakening = b_over_a - 1.0
    load = 1.0 + 1.0 / weakening
    scene = Scene(normal_stress="constant", b_over_a=b_over_a, load_velocity_ratio=load)

    def invariant(point):
        return (
            weakening * load * math.exp(-point.log_slip_rate)
            - weakening
            + point.spring_stress / scene.a
            + weakening * point.log_slip_rate
        )

    def until(event):
        # The separatrix is repelling, so an error of 2e-12 grows with v**lambda.
        amplified = math.exp(max(1.0, weakening) * event.point.log_slip_rate)
        assert invariant(event.point) == pytest.approx(1.0, abs=1e-10 * amplified)
        return event.point.log_slip_rate > 6.0

    follow_until(scene, 1e-10, until)


def cycle(law: str, accuracy: Accuracy) -> tuple[float, float]:
    """Return the recurrence interval, and the stress drop in a sigma_*."""
    scene = Scene(law=law, normal_stress="constant", stiffness_ratio=0.8, load_velocity_ratio=2.0,
                  inertia=True)  # fmt: skip
    found = LimitCycle(phases=2)(scene, accuracy).values
    return found["recurrence_interval"], found["static_stress_drop"] / scene.a


#: Recurrence interval and stress drop in a sigma_* at constant normal stress, b/a = 2, k = 0.8
#: k_cr and V_0 = 2 V_*. The values are from an integration in extended precision, after 3 cycles
#: (slip law) and after 10 cycles (slowness law).
REFERENCES = {
    "slip": (27.3903182296427, 40.16070456254199),
    "slowness": (23.9399987067, 37.127939244),
}


@pytest.mark.parametrize("law", sorted(REFERENCES))
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-7, 1e-9])
def test_requested_tolerance_is_met_by_stick_slip_cycles(law, rtol):
    # The references have 12 digits.
    allowed = [rtol + 1e-12, rtol + 1e-11]
    for ours, exact, rel in zip(cycle(law, Accuracy(rtol)), REFERENCES[law], allowed, strict=True):
        assert ours == pytest.approx(exact, rel=rel)


def test_error_of_the_slow_manifold_goes_with_the_third_power_of_the_weight():
    """The error of the slow manifold is of third order in the weight.

    ``Accuracy.max_log_slip_rate_change_by_inertia`` relies on this order. At the switch, ln V
    increases by 12.2 per slip of D_c.
    """

    @dataclasses.dataclass(frozen=True)
    class Switched(Accuracy):
        weight: float = 1e-3

        max_inertia_weight_on_slow_manifold = property(lambda self: self.weight)
        max_log_slip_rate_change_by_inertia = property(lambda _self: math.inf)
        max_slip_in_return_to_slow_manifold = property(lambda _self: 1e-9)
        local_tolerance = property(lambda _self: 1e-11)

    exact, _drop = REFERENCES["slip"]
    errors = {
        weight: abs(cycle("slip", Switched(1e-9, 10**7, weight=weight))[0] / exact - 1.0)
        for weight in (1e-3, 2e-3)
    }
    for weight, error in errors.items():
        assert 0.001 < error / (12.2 * weight) ** 3 < 0.002
    assert 4.0 < errors[2e-3] / errors[1e-3] < 16.0


@pytest.mark.parametrize(
    "fields",
    [
        {"law": "slip"},
        {"law": "two_slowness_states", "b1_over_a": 1.5, "b2_over_a": 0.7, "length_ratio": 3.0},
        {"fluid": "dilatant", "dilatancy": 0.01, "drainage": 1.0},
        {"normal_stress": "constant", "stress_dependence": 0.1},
    ],
)
def test_growth_on_the_slow_manifold_is_that_of_its_slip_rate(fields):
    """The derivative of ln V agrees with differences along the motion.

    The weight of inertia is 1e-3.
    """
    scene = Scene(load_velocity_ratio=2.0, inertia=True, **fields)
    equations = build_equations_between_ruptures(scene, with_time=False)
    weight = math.sqrt(1e-3 * scene.a / scene.stiffness) / scene.inertial_time
    psis = (-scene.a * math.log(weight), *[1e-3] * (scene.state_count - 1))
    state, step = np.array([2e-3, *psis]), 1e-4
    rates = np.array(equations.evaluate_rates(tuple(state)))
    ahead, behind = (
        equations.evaluate_motion_point(tuple(state + s * rates)).log_slip_rate
        for s in (step, -step)
    )
    point = equations.evaluate_motion_point(tuple(state))
    assert abs(point.log_slip_rate_derivative) > 0.1
    # The error of the differences is proportional to the square of the step size.
    assert point.log_slip_rate_derivative == pytest.approx(
        (ahead - behind) / (2.0 * step), rel=1e-5
    )
    # The derivative includes the change of the inertial stress.
    assert (
        abs(
            point.log_slip_rate_derivative
            - (point.spring_stress - point.frictional_stress) / (scene.a * 1e-3)
        )
        > 1e-9
    )


@given(st.floats(-1e12, 1e12))
def test_the_way_along_a_path_is_that_of_its_two_parts(slant):
    """The path metric satisfies d(sigma)**2 = ds**2 + (slant ds)**2."""
    assert compute_displacement_per_path_length(slant) * math.hypot(1.0, slant) == pytest.approx(
        1.0, rel=1e-15
    )
    assert compute_displacement_per_path_length(-1e300) == pytest.approx(1e-300, rel=1e-15, abs=0.0)


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("log_slip_rate", [-12.0, 1.0, 9.0])
def test_rates_along_the_path_are_those_by_displacement_over_its_length(law, log_slip_rate):
    """Rates by displacement are rates along the path times the path length.

    A unit of ln V contributes a sixth of the length of a slip of D_c. Without inertia and
    at constant normal stress, dx/ds is the derivative of ln V.
    """
    scene = Scene(law=law, normal_stress="constant", load_velocity_ratio=3.0)
    state = (0.01, 0.01 - scene.a * log_slip_rate)
    by = build_equations_against_displacement(scene)
    growth = by.evaluate_motion_point(state).log_slip_rate_derivative
    along = build_equations_between_ruptures(scene, with_time=False).evaluate_rates(state)
    for ours, theirs in zip(along, by.evaluate_rates(state), strict=True):
        assert ours * math.sqrt(1.0 + (growth / 6.0) ** 2) == pytest.approx(theirs, rel=1e-12)


def test_inertia_is_integrated_only_where_it_acts():
    """The full equations are not used between slip events.

    A motion that stays slow never needs the full equations.
    """
    slow = Scene(load_velocity_ratio=1.2, stiffness_ratio=1.2, inertia=True)
    integrator = follow_until(slow, 1e-7, lambda event: event.independent_variable > 100.0)
    assert set(integrator.work_meter.evaluations_by_regime) == {"slow_manifold"}
    fast = slow.with_(stiffness_ratio=0.8)
    regimes = []

    def until(event):
        regimes.append((event.regime, event.point.log_slip_rate + math.log(fast.inertial_time)))
        return len(regimes) > 60

    follow_until(fast, 1e-7, until)
    switch = 0.5 * math.log(
        Accuracy(1e-7).max_inertia_weight_on_slow_manifold * fast.a / fast.stiffness
    )
    assert all(norm <= switch + 1e-9 for regime, norm in regimes if regime == "slow_manifold")
    assert {regime for regime, _norm in regimes} == {"slow_manifold", "inertial"}


#: The angle of 33 degrees is slightly larger than atan(0.6), so normal stress grows without
#: bound if the slider slows down.
LOCKS = {"law": "slowness", "b_over_a": 8.1, "a": 0.066, "mu_star": 0.6, "phi": 33.0, "alpha": 0.0,
         "load_velocity_ratio": 0.3}  # fmt: skip


@pytest.mark.parametrize(
    ("fields", "budget", "message", "status"),
    [
        ({"stiffness_ratio": 1.1, "load_velocity_ratio": 1.2}, 500,
         "the budget of 500 right-hand side", Status.WORK_BUDGET_SPENT),
        ({"stiffness_ratio": 0.8, "load_velocity_ratio": 2.0}, 10**4, "exceeded 10.120",
         Status.SLIP_RATE_UNBOUNDED),
        (LOCKS, 10**6, "normal stress grew", Status.LOCKED),
        ({"displacement_step": -47.0}, 10, None, Status.SHEAR_STRESS_REVERSED),
        ({"displacement_step": -106.0}, 10, None, Status.NORMAL_STRESS_LOST),
    ],
)  # fmt: skip
def test_what_ends_a_motion_is_named(fields, budget, message, status):
    with pytest.raises(MotionStopped, match=message) as halted:
        follow_until(Scene(**fields), 1e-9, lambda event: event.point.log_slip_rate > 300.0, budget)
    assert halted.value.status is status


@pytest.mark.parametrize("engine", [SCIPY, PYTHON])
def test_equations_that_fail_end_in_a_status_and_not_in_nan(engine):
    def rate(state, _p):
        return (math.nan if state[0] > 1.0 else 1.0,)

    def point(state, _rates, _p):
        return MotionPoint(*[float(state[0])] * len(MotionPoint._fields))._replace(psis=state)

    system = EquationsOfMotion("broken", ("y",), (1.0,), rate, point, (1.0,) * LAW)
    integrator = Integrator(Accuracy(budget=10**5, engine=engine))
    with np.errstate(invalid="ignore"), pytest.raises(MotionStopped) as halted:
        list(integrator.follow_equations(system, (0.0,), local_tolerance=1e-8))
    assert halted.value.status in (Status.INTEGRATION_FAILED, Status.WORK_BUDGET_SPENT)
