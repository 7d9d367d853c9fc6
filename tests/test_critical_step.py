"""Tests of critical steps.

The references are closed forms, limits, results with a smaller tolerance, a second
formulation and published numbers. The statuses of failures are tested too.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_helpers import cot_phi, reaches_instability_norm
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from time_domain_reference import TimeDomainMotion

import rsfstudy
from rsfstudy import Scene
from rsfstudy.critical_steps import critical_step, motion_after_step
from rsfstudy.critical_steps.critical_path import CriticalPath, compile_if_engine_is_compiled
from rsfstudy.critical_steps.critical_step import CriticalStep
from rsfstudy.critical_steps.slow_manifold_accuracy import estimate_slow_manifold_relative_error
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.root_finding import build_root_finder
from rsfstudy.slider.equations import (
    build_equations_between_ruptures,
    compute_quasi_static_log_slip_rate,
)
from rsfstudy.slider.motion_point import MotionPoint
from rsfstudy.status import Status

RATE, DISPLACEMENT, FALL = "load_velocity_ratio", "displacement_step", "normal_stress_step"
CONSTANT, VARIABLE = {"normal_stress": "constant"}, {"alpha": 0.4, "phi": 55.0}


def found(scene: Scene, of: str = RATE, direction: str = "up", rtol=1e-7, engine=SCIPY):
    """Return the value, its error estimate and the outcome of a search.

    The search must succeed.
    """
    measure = CriticalStep(of=of, direction=direction)
    outcome = measure(scene, Accuracy(rtol, engine=engine))
    assert outcome.status is Status.OK, outcome
    name = measure.primary_output
    return outcome.values[name], outcome.values[f"{name}_error"], outcome


# ---- closed forms and limits
# ----------------------------------------------------------------------


@pytest.mark.parametrize("weakening", [1.0, math.e - 1.0, 2.0, 5.0, 10.0])
def test_eq_10_at_a_large_norm(weakening):
    """V_0/V_* = 1 + a/(b-a) for a large instability norm.

    At a norm of 1e3, the remaining difference is below norm**(-lambda**2/kappa).
    """
    scene = Scene(b_over_a=1.0 + weakening, instability_norm=1e3, **CONSTANT)
    value, error, _outcome = found(scene)
    left = (scene.instability_norm / scene.inertial_time) ** -weakening
    assert value - 1.0 == pytest.approx(1.0 / weakening, abs=5 * left + error + 1e-7 / weakening)


def test_eq_10_is_approached_from_below_as_the_norm_grows():
    """The critical step approaches eq. 10 from below as the norm grows.

    At a/(b-a) = 4, the norm of the paper results in 4.66 instead of 5.
    """
    values = [
        found(Scene(b_over_a=1.25, instability_norm=norm, **CONSTANT))[0]
        for norm in (5e-4, 1.0, 1e6, 1e12)
    ]
    assert values[0] == pytest.approx(4.66, abs=0.005)
    assert values == sorted(values)
    distance = [5.0 - value for value in values]
    # The bias is proportional to norm**-(lambda**2/kappa) = norm**-0.25.
    assert math.log(distance[-2] / distance[-1]) / math.log(1e6) == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize("stiffness_ratio", [1.0, 1.1, 1.5, 3.0])
@pytest.mark.parametrize("b_over_a", [1.5, 2.0, 4.0])
def test_eq_14_displacement_step_at_a_large_norm(stiffness_ratio, b_over_a):
    """The critical displacement is D_c/lambda for every stiffness k >= k_cr.

    The load point is held, and the normal stress is constant.
    """
    scene = Scene(
        b_over_a=b_over_a, stiffness_ratio=stiffness_ratio, instability_norm=1e12,
        **CONSTANT,
    )  # fmt: skip
    value, error, _outcome = found(scene, DISPLACEMENT)
    left = (scene.instability_norm / scene.inertial_time) ** (-(b_over_a - 1.0) / stiffness_ratio)
    assert value == pytest.approx(1.0 / (b_over_a - 1.0), abs=20 * left + error + 1e-8)


@pytest.mark.parametrize("of", [RATE, DISPLACEMENT])
@pytest.mark.parametrize(
    ("faint", "without"), [({"phi": 90.0 - 1e-8}, CONSTANT), ({"alpha": 1e-9}, {"alpha": 0.0})]
)
def test_a_vanishing_effect_is_the_effect_absent(faint, without, of):
    vanishing, error, _outcome = found(Scene(**faint), of)
    absent, _error, _outcome = found(Scene(**without), of)
    assert vanishing == pytest.approx(absent, abs=2 * error + 1e-8)


def test_alpha_zero_is_not_constant_normal_stress():
    assert found(Scene(alpha=0.0))[0] == pytest.approx(2.0584, abs=1e-4)


# ---- the requested accuracy
# -----------------------------------------------------------------------

ACCURACY_SCENES = [
    ({}, RATE),
    ({"alpha": 0.25}, RATE),
    (CONSTANT, RATE),
    ({"b_over_a": 5.0}, RATE),
    ({"b_over_a": 1.25}, RATE),
    ({"law": "slowness"}, RATE),
    ({"law": "slowness", "b_over_a": math.e, "stiffness_ratio": 1.5}, RATE),
    ({"law": "slowness", **CONSTANT}, RATE),
    ({}, DISPLACEMENT),
    ({"stiffness_ratio": 1.5, "load_velocity_ratio": 1.0}, DISPLACEMENT),
    ({"law": "slowness"}, DISPLACEMENT),
    (CONSTANT, DISPLACEMENT),
]


@pytest.mark.parametrize(("fields", "of"), ACCURACY_SCENES)
def test_default_accuracy_and_work(fields, of):
    """The default accuracy is met within 8,000 evaluations.

    The value of V_0/V_* - 1, or of the displacement, agrees to 1e-7 with the result for
    rtol = 1e-11.
    """
    scene = Scene(**fields)
    value, error, outcome = found(scene, of)
    exact, _error, _outcome = found(scene, of, rtol=1e-11)
    size = exact - 1.0 if of == RATE else exact
    assert abs(value - exact) < 1e-7 * size
    assert abs(value - exact) <= error
    assert error < 1e-6 * size
    assert outcome.rhs_evaluations <= 8_000


@pytest.mark.parametrize("rtol", [1e-4, 1e-5, 1e-6, 1e-8, 1e-9, 1e-10])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_requested_tolerance_is_met(law, rtol):
    scene = Scene(law=law, b_over_a=math.e)
    value, error, _outcome = found(scene, rtol=rtol)
    exact, finest, _outcome = found(scene, rtol=1e-11)
    assert abs(value - exact) < rtol * (exact - 1.0) + finest
    assert abs(value - exact) <= error + finest


@settings(max_examples=20)
@given(
    law=st.sampled_from(["slip", "slowness"]),
    weakening=st.floats(0.2, 6.0),
    stiffness_ratio=st.floats(1.0, 2.0),
    alpha=st.floats(0.0, 0.7),
    phi=st.floats(50.0, 85.0),
    of=st.sampled_from([RATE, DISPLACEMENT]),
)
def test_the_error_estimate_covers_the_true_error(law, weakening, stiffness_ratio, alpha, phi, of):
    scene = Scene(
        law=law, b_over_a=1.0 + weakening, stiffness_ratio=stiffness_ratio, alpha=alpha, phi=phi,
    )  # fmt: skip
    measure = CriticalStep(of=of)
    loose, tight = measure(scene, Accuracy(1e-6)), measure(scene, Accuracy(1e-10))
    assert loose.status is tight.status
    if loose.status is Status.OK:
        name = measure.primary_output
        value, exact = loose.values[name], tight.values[name]
        allowed = loose.values[f"{name}_error"] + tight.values[f"{name}_error"]
        assert abs(value - exact) <= allowed
        # The three values are equal if the jump of slip rate at the step is critical.
        assert loose.values[f"{name}_stable"] <= value <= loose.values[f"{name}_unstable"]


# ---- a second formulation
# ---------------------------------------------------------------------------


def peak_in_time(scene: Scene) -> float:
    """Return the peak of ln V after a step, limited to the norm.

    The integration in time uses no code of the package.
    """
    theirs, norm = TimeDomainMotion(scene), scene.log_slip_rate_at_instability

    def at_norm(t, y):
        return theirs.rates_and_state(t, y, 0.0)[1].log_slip_rate - norm

    def slowing(t, y):
        return theirs.rates_and_state(t, y, 0.0)[1].log_slip_rate_derivative

    at_norm.terminal = slowing.terminal = True
    slowing.direction = -1.0
    motion = solve_ivp(
        lambda t, y: theirs.rates_and_state(t, y, 0.0)[0],
        (0.0, 1e3),
        theirs.initial_unknowns(),
        "DOP853",
        rtol=1e-12,
        atol=1e-15,
        events=(at_norm, slowing),
    )
    assert motion.status == 1
    return float(theirs.rates_and_state(motion.t[-1], motion.y[:, -1], 0.0)[1].log_slip_rate)


@pytest.mark.parametrize(
    ("fields", "of"), [case for case in ACCURACY_SCENES if case[0] != CONSTANT]
)
def test_a_second_formulation_agrees_on_both_sides(fields, of):
    """Only steps above the critical step reach the norm.

    The steps differ from the critical step by 2e-7, and the peaks are from an independent
    integration in time.
    """
    scene = Scene(**fields)
    value, _error, _outcome = found(scene, of, rtol=1e-9)
    held = scene.load_velocity_ratio or 0.0
    for side, reaches in ((-2e-7, False), (2e-7, True)):
        if of == RATE:
            stepped = {RATE: 1.0 + (value - 1.0) * (1.0 + side)}
        else:
            stepped = {of: value * (1.0 + side), RATE: held}
        peak = peak_in_time(scene.with_(**stepped))
        # The integration stops at the norm, to rounding error.
        assert (peak >= scene.log_slip_rate_at_instability - 1e-9) is reaches


# ---- mass
# -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("of", [RATE, DISPLACEMENT])
def test_mass_hardly_moves_a_boundary_at_the_norm_of_the_paper(law, of):
    """Inertia changes the boundary by less than (K/a) w**2 = 5e-7."""
    without = found(Scene(law=law), of)
    with_mass = found(Scene(law=law, inertia=True), of)
    assert with_mass[0] == pytest.approx(without[0], rel=5e-7)


#: Cases (law, b/a, k/k_cr, V/V_* at the norm) with a norm of a few V_*, in which inertia matters
#: most.
SLOW_NORMS = [("slip", 3.0, 1.9, 1.5), ("slip", 3.0, 1.9, 4.0), ("slowness", 3.0, 1.2, 10.0)]


def whose_norm_is_slow(law, b_over_a, stiffness_ratio, rate, norm) -> Scene:
    return Scene(
        law=law, b_over_a=b_over_a, stiffness_ratio=stiffness_ratio, inertia=True,
        instability_norm=norm, period=1000.0, reference_rate=norm * 2.0 * math.pi / 1000.0 / rate,
        **CONSTANT,
    )  # fmt: skip


@pytest.mark.parametrize("case", SLOW_NORMS)
def test_paths_on_the_slow_manifold_agree_with_motions_of_the_full_equations(case, monkeypatch):
    """Two formulations of the effect of inertia on a boundary agree.

    The path solution includes the first order of inertia, and the forward motion integrates
    inertia. The difference between the two results is within the bound of the second order.
    """
    scene = whose_norm_is_slow(*case, norm=0.01)
    without = found(scene.with_(inertia=False), rtol=1e-8)[0]
    values = {}
    for heavy in (False, True):
        for module in (critical_step, motion_after_step):
            monkeypatch.setattr(
                module, "is_slow_manifold_inaccurate", lambda *_scene, heavy=heavy: heavy
            )
        values[heavy] = found(scene, rtol=1e-8)[:2]
    (path, error), (forward, its_error) = values[False], values[True]
    assert abs(path - forward) <= error + its_error
    moved = abs(math.log(without / path) / math.log(path))
    weight = scene.stiffness / scene.a * scene.instability_norm**2
    # The path contains the first order of inertia, and the remaining difference is below the
    # second-order bound.
    assert 0.05 * weight < moved < 0.8 * weight
    left = abs(math.log(forward / path) / math.log(path))
    assert left < estimate_slow_manifold_relative_error(scene) + 1e-8


def test_mass_counts_at_a_norm_just_above_the_loading_rate():
    """Inertia changes V_0/V_* by 2.0e-7, which exceeds the accuracy."""
    scene = whose_norm_is_slow("slip", 3.0, 1.9, 1.5, norm=5e-4)
    value, error, _outcome = found(scene)
    without = found(scene.with_(inertia=False))[0]
    assert without - value == pytest.approx(2.0e-7, abs=1e-8)
    assert error < 5e-9


def test_a_limit_cycle_that_touches_the_norm_is_found_at_once():
    """A step down that ends in a limit cycle is critical at a root.

    The search finds the root of the peak in five times the usual work. The limit cycle is
    weakly attracting, so about seven digits are the best possible accuracy.
    """
    scene = Scene(
        law="slip", a=0.007085837776968529, b_over_a=1.2474392015687674, mu_star=0.8169914402658061,
        period=45.49055212614619, reference_rate=1.9386488840293015e-07, phi=84.62982593790218,
        alpha=0.4888343561900566,
    )  # fmt: skip
    value, error, outcome = found(scene, direction="down")
    tight = CriticalStep(direction="down")(scene, Accuracy(1e-9))
    assert abs(value - tight.values["critical_velocity_ratio"]) <= error
    assert tight.status is Status.UNVERIFIED
    assert "was requested" in tight.message
    assert error < 1e-5 * (1.0 - value)
    assert outcome.rhs_evaluations < 100_000


# ---- statuses
# -------------------------------------------------------------------------------------


def test_a_displacement_step_may_jump_to_the_norm_at_once():
    """A step is critical if its jump of slip rate reaches the norm.

    For a slider that slows down from the start, the critical step follows from eq. 13.
    """
    scene = Scene(law="slowness", stiffness_ratio=5.0, instability_norm=0.01)
    value, _error, outcome = found(scene, DISPLACEMENT)
    jump = compute_quasi_static_log_slip_rate(scene, scene.stiffness * value, 0.0)
    assert jump == pytest.approx(scene.log_slip_rate_at_instability, rel=1e-8)
    assert "jump" in outcome.message
    with_mass = found(scene.with_(inertia=True), DISPLACEMENT)[0]
    assert with_mass == pytest.approx(value, rel=1e-3)
    # The step also supplies the stress that radiation damping carries at the norm.
    damped = scene.with_(stiffness=scene.stiffness, radiation_damping=1e-7)
    carried = damped.radiation_damping * math.expm1(scene.log_slip_rate_at_instability)
    more = found(damped, DISPLACEMENT)[0] - value
    assert more == pytest.approx(carried / scene.stiffness, rel=1e-5)


def test_the_survey_says_how_far_it_came():
    """Very low velocities end the survey without an error.

    The time of such a motion exceeds the digits of a float.
    """
    scene = Scene(law="slowness", normal_stress="constant", stiffness_ratio=1.5, b_over_a=5.0)
    outcome = CriticalStep(direction="down")(scene, Accuracy())
    assert outcome.status is Status.STABLE_FOR_ALL_STEPS
    assert 1e-20 < outcome.values["critical_velocity_ratio_stable"] < 1e-6


def test_an_orbit_that_grows_slowly_is_known_to_reach_the_norm_in_a_few_leaps():
    """A slowly growing orbit reaches the norm in a few extrapolations.

    Extrapolations that were shortened each time would need ten times the work.
    """
    slowly = {"law": "slowness", "b_over_a": 2.46, "phi": 82.8, "alpha": 0.129}
    scene = Scene(**slowly, stiffness_ratio=0.998, load_velocity_ratio=0.16, instability_norm=3e-4)
    assert motion_after_step.motion_reaches_instability_norm(
        scene, Integrator(Accuracy(1e-6, 15_000))
    )


def test_mass_holds_an_orbit_that_would_close_beyond_the_norm():
    """Inertia limits an orbit that would otherwise exceed the norm.

    At k = k_cr and constant normal stress, the orbit without inertia peaks at 10^87 V_*.
    """
    scene = Scene(law="slowness", load_velocity_ratio=200.0, instability_norm=10.0, **CONSTANT)
    for inertia in (False, True):
        reached = motion_after_step.motion_reaches_instability_norm(
            scene.with_(inertia=inertia), Integrator(Accuracy(1e-6, 500_000))
        )
        assert reached is not inertia


def test_a_limit_cycle_below_the_norm_is_not_leapt_over():
    """Extrapolation does not skip a limit cycle below the norm.

    After these steps down, the motion ends in limit cycles with peaks of 9.57 and 8.49 in
    ln V, below the norm at 10.89.
    """
    for load, peak in ((0.25, 9.57), (0.3, 8.49)):
        scene = Scene(law="slowness", b_over_a=1.6, load_velocity_ratio=load)
        assert peak < scene.log_slip_rate_at_instability
        assert not motion_after_step.motion_reaches_instability_norm(
            scene, Integrator(Accuracy(1e-6, 500_000))
        )
    low = Scene(law="slowness", b_over_a=1.6, load_velocity_ratio=0.15)
    assert motion_after_step.motion_reaches_instability_norm(
        low, Integrator(Accuracy(1e-6, 500_000))
    )


def test_a_spent_budget_is_a_failure_with_a_name():
    outcome = CriticalStep()(Scene(), Accuracy(budget=300))
    assert outcome.status is Status.WORK_BUDGET_SPENT
    assert outcome.values == {}
    assert 300 < outcome.rhs_evaluations < 400


def test_public_call_returns_a_small_dataset():
    """The search ignores the scene's value of the solved field.

    All other fields of the scene are used.
    """
    dataset = rsfstudy.critical_step(Scene(load_velocity_ratio=7.0))
    assert float(dataset.critical_velocity_ratio) == pytest.approx(1.66025, abs=1e-5)
    assert dataset.attrs["status"] == "ok"
    assert dataset.critical_velocity_ratio.attrs["scale"] == "V_*"
    step = rsfstudy.critical_step(Scene(displacement_step=9.0), of=DISPLACEMENT)
    held = rsfstudy.critical_step(Scene(load_velocity_ratio=0.0), of=DISPLACEMENT)
    moving = rsfstudy.critical_step(Scene(load_velocity_ratio=1.0), of=DISPLACEMENT)
    assert float(step.critical_displacement) == float(held.critical_displacement)
    assert float(moving.critical_displacement) < float(held.critical_displacement)
    assert np.isfinite(float(step.slip_rate_after_step))


@pytest.mark.parametrize("law", ["slip", "slowness"])
@pytest.mark.parametrize("load", [0.0, 1.5])
def test_the_critical_path_touches_the_norm_at_rest(law, load):
    """At the tangency point, ln V equals the norm and is stationary."""
    scene = Scene(law=law, load_velocity_ratio=load)
    start = CriticalPath.from_scene(
        scene, Integrator(Accuracy())
    ).tangency_point_at_instability_norm
    assert start is not None
    system = build_equations_between_ruptures(scene, with_time=False)
    point = system.evaluate_motion_point(start)
    assert point.log_slip_rate == pytest.approx(scene.log_slip_rate_at_instability, rel=1e-12)
    assert point.log_slip_rate_derivative == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("normal_stress", ["constant", "variable"])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_where_a_path_begins_and_ends_is_the_same_by_all_engines(law, normal_stress):
    """The start and end of a path are the same for all engines.

    The compiled functions may round sums differently. The state shows the difference,
    because it is a difference of numbers below ten.
    """
    for load in (1e-3, 1.5, 40.0):
        scene = Scene(law=law, normal_stress=normal_stress, load_velocity_ratio=load)
        paths = [
            CriticalPath.from_scene(scene, Integrator(Accuracy(engine=engine)))
            for engine in (SCIPY, COMPILED)
        ]
        plain, compiled = (path.tangency_point_at_instability_norm for path in paths)
        assert compiled == pytest.approx(plain, rel=1e-12, abs=1e-14)
        begin = (0.01, -0.02), paths[0].scene_parameter_values
        at = [
            compile_if_engine_is_compiled(
                path.motion_point_evaluator, path.integrator.engine, *begin
            )(*begin)
            for path in paths
        ]
        assert all(isinstance(point, MotionPoint) for point in at)
        assert np.hstack(at[1]) == pytest.approx(np.hstack(at[0]), rel=1e-11, abs=1e-14)


def test_a_root_is_that_of_the_same_method_elsewhere():
    """The root and the number of evaluations equal the results of SciPy."""
    asked = list[float]()

    def function(x, given):
        asked.append(x)
        return given * math.atan(x - 0.3) + x**3

    root = build_root_finder(function)
    for low, high, finest, relative in ((-1.0, 2.0, 1e-15, 1e-14), (-9.0, 0.7, 1e-6, 1e-9)):
        expected, how = brentq(
            lambda x: function(x, 2.0), low, high, xtol=finest, rtol=relative, full_output=True
        )
        asked.clear()
        ends = function(low, 2.0), function(high, 2.0)
        assert root(low, high, *ends, finest, relative, 2.0) == expected
        assert len(asked) == how.function_calls


# ---- motions on each side
# ------------------------------------------------------------------------


def test_a_fall_of_normal_stress_leaves_sigma_3_positive():
    """The search ends where the least principal stress vanishes.

    Beyond this limit, friction decreases faster with slip than the stress, and every motion
    accelerates. Here, all smaller steps are stable.
    """
    scene = Scene(law="slowness", b_over_a=2.87, stiffness_ratio=2.41, phi=44.45, alpha=0.445)
    outcome = CriticalStep(of=FALL, direction="down")(scene, Accuracy(1e-4))
    assert outcome.status is Status.STABLE_FOR_ALL_STEPS
    largest = outcome.values["critical_normal_stress_step_stable"]
    assert 1.0 + largest == pytest.approx(scene.mu_star * cot_phi(scene), rel=1e-6)


ASKED = [
    *((of, way, stress) for of in (RATE, DISPLACEMENT) for way in ("up", "down")
      for stress in (CONSTANT, VARIABLE)),
    (FALL, "down", VARIABLE),
]  # fmt: skip


@pytest.mark.parametrize("law", ["slip", "slowness", "family", "perrin_rice_zheng", "composite"])
@pytest.mark.parametrize(("of", "direction", "stress"), ASKED)
def test_motions_on_each_side_go_as_told(law, of, direction, stress):
    """The norm is reached above the critical step, but not below it.

    The motions are integrated forward over many peaks without early termination. If all
    steps are stable, the largest step does not reach the norm.
    """
    measure = CriticalStep(of=of, direction=direction)
    scene = Scene(law=law, b_over_a=2.4, stiffness_ratio=1.4, **stress)
    outcome = measure(scene, Accuracy(1e-6, engine=COMPILED))
    held = {} if of == RATE else {"load_velocity_ratio": 0.0}
    if outcome.status is Status.STABLE_FOR_ALL_STEPS:
        largest = outcome.values[f"{measure.primary_output}_stable"]
        assert not reaches_instability_norm(scene.with_(**{of: largest}, **held), 1e-10, 10)
        return
    assert outcome.status is Status.OK
    critical = outcome.values[measure.primary_output]
    for share, reaches in ((1.0 - 1e-5, False), (1.0 + 1e-5, True)):
        step = critical**share if of == RATE else critical * share
        assert reaches_instability_norm(scene.with_(**{of: step}, **held), 1e-10, 100) is reaches
