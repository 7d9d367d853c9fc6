"""Oscillating normal stress: exact for ever, no part of steady sliding, and what it makes of spring
stress by linear theory.
"""

import itertools
import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsfstudy import Axis, Scene, Study, simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.measures.bifurcation import Bifurcation
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.healing import Healing
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.measures.linear_stability import LinearStability
from rsfstudy.measures.rigid_response import RigidResponse
from rsfstudy.measures.step_response import StepResponse
from rsfstudy.measures.triggered import Triggered
from rsfstudy.measures.velocity_step import VelocityStep
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import follow
from rsfstudy.motion.engines import COMPILED, ENGINES
from rsfstudy.motion.events import Kind, maximum, settling
from rsfstudy.motion.meter import Meter
from rsfstudy.slider.stability import growth_rates
from rsfstudy.status import Status

CASES = {
    "imposed": {"normal_stress": "imposed", "alpha": 0.3},
    "inclined": {"normal_stress": "variable", "alpha": 0.3, "phi": 60.0},
}
#: Each dynamics with one of them: that those are bound alike is for other tests.
SLIDERS = {
    "imposed": {"law": "slowness", **CASES["imposed"]},
    "inclined, waves": {"law": "slowness", **CASES["inclined"], "radiation_damping": 1e-3},
    "imposed, mass": {"law": "slowness", **CASES["imposed"], "inertia": True},
}
#: An oscillation, on a slider that it does not make stick and slip.
OSCILLATES = {"oscillation_amplitude": 0.02, "oscillation_period": 8.0, "stiffness_ratio": 2.0}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("slider", SLIDERS)
def test_normal_stress_is_the_sine_that_was_asked_for(slider, engine):
    """And what an inclined driving stress adds to it, along a whole motion."""
    scene = Scene(**SLIDERS[slider], **OSCILLATES)
    motion = simulate(scene, duration=30.0, engine=engine)
    imposed = 1.0 + 0.02 * np.sin(2.0 * np.pi * motion.time / 8.0)
    cotangent = 1.0 / math.tan(math.radians(60.0)) if "inclined" in slider else 0.0
    expected = imposed + cotangent * (motion.frictional_stress - scene.mu_star)
    assert np.allclose(motion.normal_stress_ratio, expected, rtol=0.0, atol=1e-9)
    assert set(motion.data_vars) == set(
        simulate(Scene(load_velocity_ratio=2.0), duration=1.0).data_vars
    )


def test_a_rupture_feels_it_too():
    """Stick-slip: normal stress is on its sine in all regimes."""
    scene = Scene(
        **SLIDERS["imposed, mass"],
        stiffness_ratio=0.5,
        oscillation_amplitude=0.02,
        oscillation_period=30.0,
    )
    motion = simulate(scene, duration=150.0, engine=COMPILED)
    assert set(np.unique(motion.regime)) == {1, 2}
    expected = 1.0 + 0.02 * np.sin(2.0 * np.pi * motion.time / 30.0)
    assert np.allclose(motion.normal_stress_ratio, expected, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("rtol", [1e-3, 1e-7])
def test_the_amplitude_does_not_drift(rtol):
    """After 300 periods it is off by less than the accuracy, and no more than after 30."""
    scene, off = Scene(**SLIDERS["imposed"], **OSCILLATES), []
    for periods in (30, 300):
        meter = Meter(10**6, engine=COMPILED)
        accuracy = Accuracy(rtol, 10**6, engine=COMPILED)
        *_earlier, end = follow(scene, accuracy, meter, until=8.0 * periods)
        _psi, ahead, relief = end.point.psis
        off.append(abs(math.hypot(ahead, relief) / 0.02 - 1.0))
        # the clock itself drifts by the accuracy in each period at most
        assert abs(relief / 0.02) < 2.0 * math.pi * periods * rtol
    assert max(off) < 0.5 * rtol
    assert off[1] < 3.0 * off[0] + 1e-12


@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_by_a_second_formulation(law):
    """LSODA in time, with the sine and Linker and Dieterich's effect written out."""
    scene = Scene(law=law, **CASES["imposed"], **{**OSCILLATES, "oscillation_amplitude": 0.05})
    a, b, mu, alpha = scene.a, scene.b, scene.mu_star, scene.alpha
    frequency = 2.0 * math.pi / 8.0

    def rates(time, state):
        f, theta = state
        ratio = 1.0 + 0.05 * math.sin(frequency * time)
        change = 0.05 * frequency * math.cos(frequency * time)
        v = math.exp(((mu + f) / ratio - mu - theta) / a)
        if law == "slip":
            evolution = -v * (theta + b * math.log(v))
        else:
            evolution = b * (math.exp(-theta / b) - v)
        return scene.stiffness * (1.0 - v), evolution - alpha * change / ratio

    known = solve_ivp(rates, (0.0, 20.0), (0.0, 0.0), method="LSODA", rtol=1e-11, atol=1e-14)
    *_earlier, end = follow(scene, Accuracy(1e-8), Meter(10**5), until=20.0)
    assert end.point.spring == pytest.approx(known.y[0, -1], abs=1e-8)
    assert end.point.state == pytest.approx(known.y[1, -1], abs=1e-8)


def test_none_is_the_scene_without_it():
    """No unknown, no term, no other number."""
    still = Scene(load_velocity_ratio=2.0)
    none = still.with_(oscillation_amplitude=0.0)
    assert none == still
    assert none.numbers == still.numbers
    assert none.states == 1
    assert none.functions is still.functions
    again = still.with_(oscillation_amplitude=0.1).with_(oscillation_amplitude=0.0)
    assert again == still


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("law", ["slip", "two_slowness_states"])
def test_steady_sliding_and_its_stability_are_those_without_it(law, case):
    of_law = {"b1_over_a": 1.5} if law.startswith("two") else {}
    still = Scene(law=law, **of_law, **CASES[case], load_velocity_ratio=3.0, stiffness_ratio=1.2)
    scene = still.with_(oscillation_amplitude=0.3)
    assert scene.critical_stiffness == still.critical_stiffness
    assert scene.stiffness == still.stiffness
    rates = growth_rates(still, still.log_load_rate)
    assert growth_rates(scene, scene.log_load_rate) == pytest.approx(rates)
    one, other = (LinearStability()(which, Accuracy()) for which in (scene, still))
    assert dict(one.values) == pytest.approx(dict(other.values), rel=1e-15, nan_ok=True)
    assert one.status is Status.OK
    one, other = (RigidResponse()(which, Accuracy()) for which in (scene, still))
    assert one.values["evolution_distance"] == pytest.approx(other.values["evolution_distance"])


def test_it_fades_in():
    """The motion of a small one tends to that without any, in proportion."""
    still = Scene(**CASES["imposed"], stiffness_ratio=2.0, load_velocity_ratio=2.0)
    small = still.with_(oscillation_amplitude=1e-7, oscillation_period=8.0)
    at = [_end(which) for which in (still, small, small.with_(oscillation_amplitude=2e-7))]
    springs = np.array([event.point.spring for event in at])
    assert 0.0 < abs(springs[1] - springs[0]) < 1e-6
    assert springs[2] - springs[0] == pytest.approx(2.0 * (springs[1] - springs[0]), rel=1e-3)


def _end(scene: Scene):
    *_earlier, end = follow(scene, Accuracy(1e-10), Meter(10**6), until=11.0)
    return end


@pytest.mark.parametrize("slider", SLIDERS)
def test_engines_tell_the_same_events(slider):
    """Maxima of slip rate; and never that it settles."""
    scene = Scene(**SLIDERS[slider], **OSCILLATES)
    rows = []
    for engine in ENGINES:
        watches = [maximum("log_rate"), maximum("reading"), settling(0.9, ends=True)]
        meter = Meter(10**5, engine=engine)
        accuracy = Accuracy(1e-8, engine=engine)
        rows.append(list(follow(scene, accuracy, meter, watches, until=40.0)))
    kinds = [[e.kind for e in events] for events in rows]
    assert kinds[0] == kinds[1] == kinds[2]
    assert kinds[0].count(Kind.MAXIMUM) > 8
    assert Kind.SETTLED not in kinds[0]
    for one, other in itertools.chain(*(zip(rows[0], events, strict=True) for events in rows[1:])):
        assert other.time == pytest.approx(one.time, rel=1e-6)
        assert other.point.spring == pytest.approx(one.point.spring, abs=1e-8)
        assert other.point.psis == pytest.approx(one.point.psis, abs=1e-8)


def test_under_a_load_point_at_rest_it_goes_on():
    """Slip dies out; time does not."""
    scene = Scene(**SLIDERS["imposed"], **OSCILLATES, load_velocity_ratio=0.0)
    for engine in ENGINES:
        motion = simulate(scene, duration=100.0, rtol=1e-8, engine=engine)
        assert float(motion.time[-1]) == pytest.approx(100.0, rel=1e-12)
        expected = 1.0 + 0.02 * np.sin(2.0 * np.pi * motion.time / 8.0)
        assert np.allclose(motion.normal_stress_ratio, expected, rtol=0.0, atol=1e-8)


def test_it_is_an_axis_and_a_file_holds_it():
    study = Study(
        name="oscillates",
        title="Oscillates",
        base=Scene(normal_stress="imposed"),
        axes=[Axis("oscillation_amplitude", [0.0, 0.1])],
        measure=LinearStability(),
    )
    scenes = list(study.scenes())
    assert [scene.states for scene in scenes] == [1, 3]
    told = json.loads(simulate(scenes[1], duration=1.0).attrs["scene"])
    assert Scene(**told) == scenes[1]


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"oscillation_amplitude": 1.0}, "must be less than 1. Normal stress stays positive"),
        ({"oscillation_amplitude": -0.1}, "must be 0 or greater. 0 is no oscillation"),
        ({"oscillation_amplitude": 0.1, "oscillation_period": 0.0}, "must be greater than 0"),
        (
            {"oscillation_amplitude": 0.1, "oscillation_period": 5e-8},
            "below the period of free oscillation, .* = 5.85e-08: mass.*Set inertia=True",
        ),
        (
            {"oscillation_amplitude": 0.1, "normal_stress": "constant"},
            "is changed by the loading.*normal_stress='imposed'",
        ),
        (
            {"oscillation_amplitude": 0.1, "fluid": "dilatant"},
            "no meaning for fluid='dilatant', whose pore pressure",
        ),
        (
            {"oscillation_amplitude": 0.1, "stress_dependence": 0.5},
            "not for normal stress that the loading changes",
        ),
        (
            {"oscillation_amplitude": 0.1, "regularised": True},
            "regularised = True: has no meaning for oscillation",
        ),
        ({"oscillation_period": 5.0}, "no meaning for step.*state oscillation_amplitude too"),
        ({"oscillation_amplitude": 0.1, "hold_time": 5.0}, "has no meaning"),
        ({"oscillation_amplitude": 0.1, "displacement_step": 5.0}, "no meaning for oscillation"),
    ],
)
def test_what_is_wrong(fields, complaint):
    with pytest.raises(InvalidValue, match=complaint):
        Scene(**fields)


def test_faster_than_free_oscillation_with_mass():
    fast = {"oscillation_amplitude": 0.1, "oscillation_period": 5e-8, "inertia": True}
    motion = simulate(Scene(**CASES["imposed"], **fast), duration=2e-7)
    assert motion.attrs["status"] == "ok"
    expected = 1.0 + 0.1 * np.sin(2.0 * np.pi * motion.time / 5e-8)
    assert np.allclose(motion.normal_stress_ratio, expected, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize(
    "measure",
    [CriticalStep(), Triggered(), LimitCycle(), StepResponse(), Bifurcation(), VelocityStep()],
    ids=lambda measure: measure.name,
)
def test_what_settles_or_repeats_is_not_asked_of_it(measure):
    with pytest.raises(InvalidValue, match="oscillation': changes normal stress all along.*_resp"):
        measure(Scene(oscillation_amplitude=0.1, load_velocity_ratio=2.0), Accuracy())


def test_it_holds_nothing():
    outcome = Healing()(Scene(oscillation_amplitude=0.1), Accuracy())
    assert outcome.status is Status.NO_STEP
