"""Tests of the measures of velocity steps and holds.

The references are identities, closed forms and the approach to them, and a second
formulation.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from rsfstudy import Scene, protocol, simulate
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY
from rsfstudy.responses.healing import Healing
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.status import Status

LAWS = ("slip", "slowness")
PLAIN = {"normal_stress": "constant", "stiffness_ratio": 3.0}


def read(measure, scene: Scene, rtol: float = 1e-7, **options) -> dict:
    outcome = measure(scene, Accuracy(rtol, **options))
    assert outcome.status is Status.OK, outcome
    return outcome.values


@pytest.mark.parametrize("law", LAWS)
def test_a_step_back_is_the_step_down_from_there(law):
    """A step from 5 V_* to V_* equals a step from V_* to V_*/5.

    Friction has no intrinsic velocity scale once the slider is in steady state.
    """
    stepped = Scene(
        law=law, **PLAIN, velocity_steps=2, velocity_ratio=5.0, displacement_between_steps=25.0
    )
    back = read(VelocityStep(step_number=2, phases=50), stepped)
    down = read(
        VelocityStep(phases=2), Scene(law=law, **PLAIN, velocity_steps=1, velocity_ratio=0.2)
    )
    for name in ("apparent_a", "apparent_b", "apparent_a_minus_b", "corrected_slip_distance"):
        # A fraction of exp(-25) of the first evolution remains.
        assert back[name] == pytest.approx(down[name], rel=2e-7), name
    assert back["friction_before"] - stepped.mu_star == pytest.approx(
        (stepped.a - stepped.b) * math.log(5.0), rel=1e-7
    )
    # The record begins with the step, at the maximum of slip rate.
    assert back["slip"][0] == 0.0
    assert back["log10_slip_rate"].argmax() == 0


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("normal_stress", ["constant", "variable"])
def test_what_is_read_adds_up_and_a_minus_b_is_true(law, normal_stress):
    """The measured friction changes by (a - b) ln V between steady states.

    The change is the same for constant and variable normal stress.
    """
    scene = Scene(law=law, normal_stress=normal_stress, stiffness_ratio=4.0, load_velocity_ratio=2)
    found = read(VelocityStep(record=25.0, phases=50), scene)
    assert found["apparent_a_minus_b"] == pytest.approx(scene.a - scene.b, rel=1e-6)
    assert found["apparent_a"] - found["apparent_b"] == pytest.approx(
        found["apparent_a_minus_b"], rel=1e-12
    )
    assert found["settled"] == 1.0
    assert 0.3 * scene.a < found["apparent_a"] < scene.a
    assert found["friction_coefficient"][-1] == pytest.approx(found["friction_after"], rel=1e-12)
    assert found["load_point_displacement"][-1] == pytest.approx(25.0, rel=1e-9)


def late(law: str, rate: float) -> float:
    """Return the first-order deviation in a/K, in units of b a/K.

    The function repeats the definition of the study velocity_steps.
    """
    if law == "slowness":
        return rate * math.exp(-rate) - math.expm1(-rate)
    return quad(lambda y: y / math.expm1(y) if y else 1.0, 0.0, rate)[0] + rate


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("ratio", [0.2, 5.0])
def test_a_stiff_slider_comes_close_to_a_rigid_one(law, ratio):
    """The deviation from the closed form agrees with its first order.

    The remaining difference is proportional to 1/K.
    """
    left = []
    for stiffness in (100.0, 1000.0):
        scene = Scene(
            law=law, normal_stress="constant", stiffness_ratio=stiffness,
            velocity_steps=1, velocity_ratio=ratio,
        )  # fmt: skip
        found = read(VelocityStep(record=1.0, phases=2), scene, 1e-6)
        first = scene.b * scene.a / scene.stiffness * abs(late(law, math.log(ratio)))
        left.append(found["closed_form_departure"] / first - 1.0)
    assert abs(left[1]) < 0.1
    assert abs(left[1]) < 0.25 * abs(left[0])


SOFT = {"normal_stress": "constant", "stiffness": 5.0, "velocity_steps": 2, "velocity_ratio": 2.0}


@pytest.mark.parametrize(
    ("number", "fields", "known"),
    [
        (2, {"law": "slip"}, True),
        (2, {"law": "slip", "displacement_between_steps": 0.5}, False),
        (1, {"law": "cut_off"}, True),
        (2, {"law": "cut_off"}, False),
        (1, {"law": "slip", "stress_dependence": 1.0}, False),
        (1, {"law": "slip", "fluid": "dilatant"}, False),
        (1, {"law": "slip", "normal_stress": "variable"}, False),
        (1, {"law": "composite"}, False),
    ],
)
def test_where_there_is_no_closed_form_there_is_no_departure(number, fields, known):
    scene = Scene(**{**SOFT, **fields})
    found = read(VelocityStep(step_number=number, phases=2), scene, 1e-5, engine=COMPILED)
    assert math.isfinite(found["closed_form_departure"]) is known


DILATANT = {"normal_stress": "constant", "fluid": "dilatant", "dilatancy": 0.02, "drainage": 1.0}
#: Scenes in which the extrema of spring stress and apparent friction differ.
APART = [
    {**DILATANT, "stiffness": 0.5},
    {**DILATANT, "stiffness": 0.05, "drainage": 10.0},
    {**DILATANT, "stiffness": 0.5, "normal_stress": "variable", "radiation_damping": 1e-4},
    {"stiffness": 5.0, "radiation_damping": 1e-3},
    {"stiffness": 5.0, "radiation_damping": 1e-2},
]


def recorded(scene: Scene, begins: float, lasts: float) -> tuple:
    """Return the extrema of apparent friction of a simulated motion.

    The function returns a spline of friction, and the times of its maximum and minimum.
    """
    motion = simulate(scene, duration=begins + lasts, rtol=1e-11, engine=COMPILED)
    since, kept = np.unique(motion.time.values - begins, return_index=True)
    spline = CubicSpline(since, motion.friction_coefficient.values[kept])
    turns = [t for t in spline.derivative().roots(extrapolate=False) if 0.0 < t < lasts]
    turns = np.array([*turns, lasts])
    return spline, turns[spline(turns).argmax()], turns[spline(turns).argmin()]


@pytest.mark.parametrize("ratio", [0.2, 10.0])
@pytest.mark.parametrize("fields", APART)
def test_a_step_is_read_off_friction_not_off_the_spring(fields, ratio):
    """Peak and slip distance of a step agree with the apparent friction."""
    scene = Scene(law="slowness", b_over_a=1.5, load_velocity_ratio=ratio, **fields)
    friction, highest, lowest = recorded(scene, 0.0, 20.0 / ratio)
    peak, end = (highest if ratio > 1.0 else lowest), 20.0 / ratio
    level = friction(end) + (friction(peak) - friction(end)) / math.e
    left = brentq(lambda t: friction(t) - level, peak, end)
    found = read(VelocityStep(phases=2), scene, 1e-8, engine=COMPILED)
    assert found["peak_friction"] == pytest.approx(friction(peak), abs=1e-7)
    assert found["apparent_slip_distance"] == pytest.approx(ratio * (left - peak), rel=2e-4)


@pytest.mark.parametrize("fields", APART)
def test_healing_is_read_off_friction_not_off_the_spring(fields):
    scene = Scene(law="slip", b_over_a=1.5, hold_time=100.0, **fields)
    friction, highest, _lowest = recorded(scene, 100.0, 20.0)
    for engine in (SCIPY, COMPILED):
        found = read(Healing(phases=2), scene, 1e-8, engine=engine)
        assert found["healing"] == pytest.approx(friction(highest) - scene.mu_star, abs=1e-7)
        assert found["peak_displacement"] == pytest.approx(highest, rel=1e-3)


def test_a_hold_of_a_longer_protocol_is_read_from_where_it_begins():
    """A hold after a velocity step equals a hold from steady sliding.

    The hold starts from 2 V_*, so it is twice as long in its own time scale.
    """
    rows = [
        {"velocity": 2.0, "distance": 30.0},
        {"velocity": 0.0, "duration": 50.0},
        {"velocity": 2.0},
    ]
    common = {"law": "slowness", **PLAIN}
    later = read(Healing(phases=20), Scene(**common, loading=protocol(rows)))
    first = read(Healing(phases=20), Scene(**common, hold_time=100.0))
    for name in ("healing", "relaxation", "peak_displacement"):
        assert later[name] == pytest.approx(first[name], rel=1e-6), name
    assert later["time"][0] == 0.0
    assert (np.diff(later["time"]) >= 0.0).all()


@pytest.mark.parametrize("displaced", [0, 1])
def test_a_displacement_is_no_part_of_a_hold(displaced):
    """A hold with a displacement step is not applicable.

    Spring stress would jump at the measured points.
    """
    rows = [{"velocity": 0.0, "duration": 10.0}, {"velocity": 1.0}]
    rows[displaced]["step"] = -0.5
    scene = Scene(law="slowness", **PLAIN, loading=protocol(rows))
    outcome = Healing(phases=2)(scene, Accuracy())
    assert (outcome.status, outcome.values) == (Status.NOT_APPLICABLE, {})
    assert "a displacement step or a normal stress step" in outcome.message
    earlier = [{"velocity": 1.0, "step": 0.1, "duration": 40.0}, *rows]
    earlier[1 + displaced] = {**rows[displaced], "step": 0.0}
    assert read(Healing(phases=2), scene.with_(loading=protocol(earlier)))["healing"] > 0.0


def test_friction_that_still_changes_has_not_settled():
    """The flag ``settled`` is independent of the number of steps."""
    scene = Scene(law="slip", **PLAIN, velocity_steps=1, velocity_ratio=1.5)
    for record, settled in ((1.0, 0.0), (2.0, 0.0), (25.0, 1.0)):
        found = read(VelocityStep(record=record, phases=2), scene, 1e-4)
        assert found["settled"] == settled


def with_mass(hold: float, scene: Scene) -> float:
    """Return the apparent friction after a hold, minus mu_*.

    The full equations with inertia are integrated in time, with the state variable itself.
    """
    a, b, mu, stiffness = scene.a, scene.b, scene.mu_star, scene.stiffness
    cot, alpha, inertia = scene.parts.normal_stress.cot_phi, scene.alpha, scene.inertial_time

    def rates(_time, y):
        spring, rate, theta = y
        coefficient = mu + a * rate + theta
        g = (coefficient - mu) / (1.0 - cot * coefficient)
        stress, slip_rate = 1.0 + cot * g, math.exp(rate)
        rises = (spring - g) / (stiffness * inertia**2 * slip_rate)
        evolves = b * (math.exp(-theta / b) - slip_rate)
        by_g = stress * (a * rises + evolves) / (1.0 - cot * coefficient + alpha * cot)
        return -stiffness * slip_rate, rises, evolves - alpha * cot * by_g / stress

    y = solve_ivp(rates, (0.0, hold), (0.0, 0.0, 0.0), "Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    coefficient = mu + a * y[1] + y[2]
    stress = 1.0 + cot * (coefficient - mu) / (1.0 - cot * coefficient)
    return (mu + y[0]) / stress - mu


def test_friction_of_a_mass_is_read_the_instant_before_the_load_point_changes():
    """Friction with inertia is measured just before the velocity changes.

    The inertial stress still belongs to the previous velocity.
    """
    plain = {"law": "slowness", "normal_stress": "variable", "a": 0.01, "b_over_a": 1.2}
    plain |= {"mu_star": 0.6, "stiffness": 0.05, "alpha": 0.3, "inertia": True}
    scene = Scene(**plain, reference_rate=1e-3, period=2.0 * math.pi)
    step = read(VelocityStep(phases=2), scene.with_(load_velocity_ratio=10.0))
    assert step["friction_before"] == pytest.approx(0.6, abs=1e-15)
    held = scene.with_(hold_time=5.0, load_velocity_ratio=10.0)
    hold = read(Healing(phases=2), held)
    # A measurement after the start of the hold would have an error of 1e-7.
    assert hold["relaxation"] == pytest.approx(with_mass(5.0, held), abs=1e-9)
    rows = [{"velocity": 2.0, "distance": 30.0}, {"velocity": 20.0}]
    later = read(VelocityStep(step_number=2, phases=2), scene.with_(loading=protocol(rows)))
    steady = 0.6 + (scene.a - scene.b) * math.log(2.0)
    # The tolerance is three times the error estimate, and a fraction of exp(-30) of the earlier
    # evolution remains.
    assert later["friction_before"] == pytest.approx(steady, abs=2e-9)
