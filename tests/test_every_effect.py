"""Tests of the linear stability of steady sliding for all effects.

Growth rates must equal the eigenvalues of the assembled equations, and the critical
stiffness must be the stiffness at which they change sign. Small oscillations must grow at
these rates. Closed forms of single effects are tested in other modules.
"""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsfstudy import Scene
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integration_events import EventKind, maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.slider import laws, stability, steady_state
from rsfstudy.slider.equations import (
    EquationsOfMotion,
    build_equations_against_displacement,
    build_equations_against_inertial_time,
    build_equations_between_ruptures,
)
from rsfstudy.status import Status

CONSTANT = {"normal_stress": "constant"}
STRESSES = [CONSTANT, {"normal_stress": "imposed"}, {"alpha": 0.0}, {"alpha": 0.56}, {"alpha": 0.9}]
#: Two states, one of which strengthens friction, with different lengths.
STRENGTHENING = {"a": 0.01, "b1_over_a": 1.4, "b2_over_a": -0.6, "length_ratio": 50.0}
#: Effects that can be combined with a law and a normal stress.
EFFECTS = [
    {},
    {"radiation_damping": 1e-4},
    {"stress_dependence": 0.5},
    {"fluid": "dilatant", "dilatancy": 0.004, "drainage": 0.1},
    {"fluid": "dilatant", "dilatancy": 0.004, "drainage": 3.0},
    {"fluid": "dilatant", "dilatancy": -0.004, "drainage": 0.1, "porosity_length": 10.0},
    {"fluid": "dilatant", "dilatancy": 0.004, "drainage": 0.7, "radiation_damping": 1e-4},
]
#: Effects of heat. The activation terms require a law with one state.
HEAT = {"temperature": "shear_heating", "heating": 1e-3, "cooling": 0.3}
ACTIVATED = {**HEAT, "direct_activation": 30.0, "evolution_activation": 20.0}
PRESSURISED = {**HEAT, "fluid": "thermal", "pressurisation": 2.0, "drainage": 0.5}
HEAT_EFFECTS = [
    ACTIVATED,
    {**PRESSURISED, "dilatancy": 0.004, "porosity_length": 0.3, "radiation_damping": 1e-4},
    {**ACTIVATED, **PRESSURISED, "stress_dependence": 0.0},
]
#: All laws and normal stresses, with each effect that is compatible with both.
SCENES = [
    {"law": law, **stress, **effect}
    for law, stress, effect in itertools.product(
        sorted(laws.BUILT_IN_LAW_CLASS_BY_NAME), STRESSES, EFFECTS
    )
    if not ("stress_dependence" in effect and stress.get("normal_stress") == "imposed")
]
SCENES += [
    {"law": law, **stress, **effect}
    for law, stress, effect in itertools.product(
        sorted(laws.BUILT_IN_LAW_CLASS_BY_NAME), STRESSES[::2], HEAT_EFFECTS
    )
    if not (law.startswith("two_") and "direct_activation" in effect)
]
SCENES += [{"law": law, **STRENGTHENING} for law in ("two_slip_states", "two_slowness_states")]
#: Scenes with inertia, and with periods at which the effect of inertia exceeds rounding errors.
MASSIVE = [
    {"inertia": True, "period": 1e8, **stress, **effect}
    for stress in (CONSTANT, {"alpha": 0.56})
    for effect in (
        {},
        {"law": "slowness"},
        {"law": "composite"},
        *EFFECTS[2:4],
        ACTIVATED,
        PRESSURISED,
    )
]


def scene_of(fields: dict, ratio: float, log_slip_rate: float = 0.0) -> Scene:
    """Return a scene with a given stiffness ratio.

    The critical stiffness is evaluated at the velocity of the load point.
    """
    scene = Scene(**{"load_velocity_ratio": math.exp(log_slip_rate), "stiffness": 0.01, **fields})
    return scene.with_(stiffness=ratio * stability.compute_critical_stiffness(scene, log_slip_rate))


def eigenvalues(equations: EquationsOfMotion, state: tuple[float, ...]) -> np.ndarray:
    """Return the eigenvalues of the assembled equations at a steady state.

    The Jacobian consists of central differences.
    """
    at, columns = np.array(state), []
    for unit, scale in zip(np.eye(len(at)), equations.unknown_scales, strict=True):
        step = 1e-5 * scale * unit  # This step balances rounding and truncation errors.
        ahead, behind = (equations.evaluate_rates(tuple((at + s).tolist())) for s in (step, -step))
        columns.append((np.array(ahead) - np.array(behind)) / (2e-5 * scale))
    return np.sort_complex(np.linalg.eigvals(np.array(columns).T))


@pytest.mark.parametrize("fields", SCENES, ids=str)
@pytest.mark.parametrize(("ratio", "log_slip_rate"), [(0.8, -3.0), (1.2, 0.0), (0.9, 2.0)])
def test_growth_rates_are_eigenvalues_of_the_assembled_equations(fields, ratio, log_slip_rate):
    """The eigenvalues equal half of the growth rates.

    The independent variable of the equations is the sum of slip and load point
    displacement, which grows twice as fast as slip.
    """
    scene = scene_of(fields, ratio, log_slip_rate)
    found = steady_state.compute_steady_sliding(scene, log_slip_rate)
    equations, at = (
        build_equations_against_displacement(scene),
        (found.spring_stress, *found.states),
    )
    assert np.abs(equations.evaluate_rates(at)).max() < 1e-13
    ours, theirs = (
        0.5 * stability.compute_linear_growth_rates(scene, log_slip_rate),
        eigenvalues(equations, at),
    )
    assert len(ours) == 1 + scene.state_count
    # Some rates, for example of drainage, are much larger than others, and the accuracy of the
    # differences is relative to the largest rate.
    within = 1e-7 * np.abs(ours).max()
    np.testing.assert_allclose(np.sort_complex(ours), theirs, rtol=0, atol=within)


@pytest.mark.parametrize("fields", MASSIVE, ids=str)
def test_growth_rates_with_mass_are_eigenvalues_of_the_full_equations(fields):
    """Growth rates times the inertial time equal the eigenvalues."""
    scene = Scene(**{"stiffness_ratio": 0.9, **fields})
    found = steady_state.compute_steady_sliding(scene, 0.0)
    at = (found.spring_stress, 0.0, found.frictional_stress, *found.states[1:])
    ours = scene.inertial_time * stability.compute_linear_growth_rates(scene, 0.0)
    theirs = eigenvalues(build_equations_against_inertial_time(scene), at)
    np.testing.assert_allclose(np.sort_complex(ours), theirs, rtol=1e-6)


@pytest.mark.parametrize("fields", SCENES + [{**f, "period": 1e6} for f in MASSIVE], ids=str)
def test_critical_stiffness_is_where_growth_begins(fields):
    """Growth rates change sign at the critical stiffness.

    Close to it, the rates are proportional to the difference of stiffness. Slow drainage
    makes them small.
    """
    for off, grows in ((-1e-6, True), (1e-6, False)):
        rates = stability.compute_linear_growth_rates(scene_of(fields, 1.0 + off, 0.7), 0.7)
        assert bool(rates[0].real > 0.0) is grows
        assert abs(rates[0].real) < 1e-5


@given(
    law=st.sampled_from(sorted(laws.BUILT_IN_LAW_CLASS_BY_NAME)),
    alpha=st.none() | st.floats(0.0, 1.0),
    phi=st.floats(50.0, 85.0),
    log_slip_rate=st.floats(-3.0, 3.0),
    log_norm=st.none() | st.floats(-6.0, 0.3),
    log_damping=st.none() | st.floats(-25.0, 0.0),
    dilatancy=st.none() | st.floats(-0.01, 0.01),
    log_length=st.floats(-1.0, 1.0),
)
def test_the_measure_finds_the_threshold_of_growth(
    law, alpha, phi, log_slip_rate, log_norm, log_damping, dilatancy, log_length
):
    """Two independent computations of the critical stiffness agree.

    The second computation uses differences of the assembled equations instead of formulas.
    """
    stress = CONSTANT if alpha is None else {"alpha": alpha, "phi": phi}
    fields = {
        "law": law,
        "load_velocity_ratio": math.exp(log_slip_rate),
        "stiffness": 0.01,
        **stress,
    }
    if log_norm is not None:
        period = 2.0 * math.pi * 10.0**log_norm / (math.exp(log_slip_rate) * 1.17e-8)
        fields |= {"inertia": True, "period": period}
    elif log_damping is not None:
        fields["radiation_damping"] = math.exp(log_damping)
    if dilatancy is not None:
        fields |= {"fluid": "dilatant", "dilatancy": dilatancy}
        fields["porosity_length"] = 10.0**log_length
    outcome = LinearStability()(Scene(**fields), Accuracy())
    assert outcome.status in (
        Status.OK,
        Status.STABLE_AT_ANY_STIFFNESS,
        Status.UNSTABLE_AT_ANY_STIFFNESS,
        Status.NO_STEADY_STATE,
    )
    if outcome.status is Status.OK:
        told = outcome.values
        # The effect of damping is the difference of two numbers of the size of the undamped
        # stiffness. Close to the limit beyond which no stiffness is stable, the threshold is
        # ill-conditioned.
        undamped = stability.compute_critical_stiffness(
            Scene(**fields), log_slip_rate, quasi_static=True
        )
        # With inertia, growth per inertial time is proportional to the square of the slip rate
        # norm, and the Jacobian from differences has an error of a few 1e-12.
        within = 1e-6 if log_norm is None else max(1e-6, 2e-11 * 100.0 ** -max(log_norm, -3.0))
        slack = within * max(undamped, told["critical_stiffness"])
        slack *= 1.0 + max(0.0, told["rise_by_dynamics"])
        found = told["critical_stiffness_from_growth"]
        assert found == pytest.approx(told["critical_stiffness"], abs=slack)


@pytest.mark.parametrize("fields", SCENES[::3], ids=str)
def test_slip_rate_grows_as_the_unknowns_change(fields):
    """The derivative of ln V agrees with differences along the motion.

    The test state is away from steady sliding.
    """
    scene = Scene(**{"load_velocity_ratio": 3.0, "stiffness": 0.01, **fields})
    equations = build_equations_between_ruptures(scene, with_time=False)
    at = scene.a * np.array([0.3, 0.2, 0.1, 0.05, 0.02, 0.01][: 1 + scene.state_count])
    rates, step = np.array(equations.evaluate_rates(tuple(at))), 1e-5
    ahead, behind = (
        equations.evaluate_motion_point(tuple(at + s * rates)).log_slip_rate for s in (step, -step)
    )
    # The error of the differences is proportional to the square of the step size, plus the
    # rounding error divided by the step size.
    told = equations.evaluate_motion_point(tuple(at)).log_slip_rate_derivative
    assert told == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    "fields",
    [
        {"law": "perrin_rice_zheng", "stress_dependence": 0.7},
        {"law": "family", "law_exponent": 0.4, "radiation_damping": 0.002, **CONSTANT},
        {"law": "composite", "cutoff_velocity_ratio": 2.0, "stress_dependence": 2.0},
        {"law": "composite", "cutoff_velocity_ratio": 1.0, "inertia": True, "period": 3e7},
        {"law": "cut_off", "cutoff_velocity_ratio": 5.0, "stress_dependence": 0.5, **CONSTANT},
        {"law": "cut_off", "cutoff_velocity_ratio": 5.0, "inertia": True, "period": 3e7},
        {"law": "slip", "fluid": "dilatant", "dilatancy": 0.005, "drainage": 1.0},
        {
            "law": "slip",
            "fluid": "dilatant",
            "dilatancy": -0.005,
            "porosity_length": 5.0,
            **CONSTANT,
        },
        {"law": "slowness", "fluid": "dilatant", "inertia": True, **CONSTANT},
        {"law": "slowness", "fluid": "dilatant", "radiation_damping": 1e-4, "alpha": 0.0},
        {"law": "two_slip_states"},
        {"law": "two_slowness_states", "radiation_damping": 1e-4},
        {"law": "two_slip_states", **STRENGTHENING, **CONSTANT},
    ],
    ids=str,
)
@pytest.mark.parametrize("ratio", [0.95, 1.05])
def test_small_oscillations_grow_as_linear_theory_says(fields, ratio):
    """Interval and growth of the peaks agree with linear theory to 1e-3.

    A small displacement step starts the oscillation. The nonlinear deviation is of second
    order.
    """
    # The full equations are stiff at these slip rates, so the step must exceed their integration
    # errors.
    small = 1e-4 if "period" in fields else 1e-5
    scene = Scene(stiffness_ratio=ratio, load_velocity_ratio=1.0, displacement_step=small, **fields)
    rates = stability.compute_linear_growth_rates(scene, 0.0)
    turning = max((rate for rate in rates if rate.imag), key=lambda rate: rate.real)
    peaks = []
    for event in Integrator(Accuracy(1e-9, 10**6)).follow(
        scene, [maximum("log_slip_rate")], with_time=True
    ):
        if event.kind is EventKind.MAXIMUM:
            peaks.append((event.time, event.point.log_slip_rate))
        if len(peaks) == 8:
            break
    (begin, first), (end, last) = peaks[5], peaks[7]
    period = 0.5 * (end - begin)
    found = complex(0.5 * math.log(last / first), 2.0 * math.pi) / period
    expected = complex(turning.real, abs(turning.imag))
    assert abs(found - expected) < 1e-3 * abs(expected)
    assert cmath.isfinite(expected)
