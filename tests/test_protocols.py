"""Tests of protocols as segments of loading."""

import copy
import json
import pickle

import cloudpickle
import numpy as np
import pytest
from rsfstudy.named_studies._bifurcation import Bifurcation
from study_runs import run, study_of

from rsfstudy import Axis, Scene, Segment, protocol, simulate
from rsfstudy.critical_steps.triggered_instability import Triggered
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind, maximum
from rsfstudy.motion.integrator import Integrator
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.responses.velocity_step import VelocityStep
from rsfstudy.slider import loading
from rsfstudy.slider.user_loadings import Protocol
from rsfstudy.status import Status

STIFF = {"law": "slowness", "normal_stress": "constant", "stiffness_ratio": 3.0}


def same_motion(one: Scene, other: Scene, duration: float) -> None:
    first, second = simulate(one, duration=duration), simulate(other, duration=duration)
    for name in ("time", "slip", "shear_stress", "log10_slip_rate", "state_variable"):
        np.testing.assert_array_equal(first[name].values, second[name].values)


def test_a_protocol_of_one_segment_is_a_step_to_the_bit():
    stepped = Scene(**STIFF, load_velocity_ratio=10.0, displacement_step=0.1)
    same_motion(stepped, Scene(**STIFF, loading=protocol([Segment(10.0, 0.1)])), 3.0)
    one = Scene(**STIFF, velocity_steps=1, velocity_ratio=10.0)
    same_motion(one, stepped.with_(displacement_step=0.0), 3.0)


def test_protocols_are_what_their_fields_say():
    held = Scene(**STIFF, hold_time=50.0, load_velocity_ratio=2.0)
    assert held.parts.loading.segments == (Segment(0.0, 0.0, 50.0), Segment(2.0))
    rows = [{"velocity": 0.0, "duration": 50.0}, {"velocity": 2.0}]
    same_motion(held, Scene(**STIFF, loading=protocol(rows)), 55.0)
    stepped = Scene(**STIFF, velocity_steps=3, velocity_ratio=4.0, displacement_between_steps=8.0)
    rows = [{"velocity": v, "distance": 8.0} for v in (4.0, 1.0, 4.0)]
    same_motion(stepped, Scene(**STIFF, loading=protocol(rows)), 12.0)
    assert protocol(rows).duration == 2.0 + 8.0 + 2.0


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("begins", [0.0, 7.0])
def test_a_segment_may_be_as_short_as_time_can_tell(engine, begins):
    """Segments may be as short as the resolution of time.

    Shorter segments are rejected. The pulse moves the load point by 1e-11 D_c, and rtol is
    1e-7.
    """
    before = [{"velocity": 1.0, "duration": begins}] if begins else []
    after, short = {"velocity": 2.0}, max(1e-16, float(np.spacing(begins)))

    def ends_with(*segments):
        scene = Scene(**STIFF, loading=protocol([*before, *segments, after]))
        return simulate(scene, duration=begins + 5.0, engine=engine).shear_stress[-1].item()

    pulse = {"velocity": 1e4, "duration": short}
    assert ends_with(pulse) == pytest.approx(ends_with(), abs=1e-7)
    with pytest.raises(InvalidValue, match="must be at least 1e-16 D_c/V_"):
        ends_with({**pulse, "duration": 0.4 * short})


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_a_step_may_end_where_its_clock_rounds_to_the_begin(engine, monkeypatch):
    """A step that is shorter than the resolution of time changes nothing.

    The step is a hold in this test, but it may also be a step of slip.
    """
    monkeypatch.setattr(loading, "MIN_SEGMENT_DURATION", 0.0)
    ends = [
        simulate(Scene(**STIFF, load_velocity_ratio=2.0, **hold), duration=5.0, engine=engine)
        for hold in ({}, {"hold_time": 1e-300})
    ]
    one, other = (motion.shear_stress[-1].item() for motion in ends)
    assert one == pytest.approx(other, abs=1e-7)  # The tolerance is rtol.


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_a_very_long_hold_ends_when_it_should(engine):
    """A very long hold ends at the exact time.

    The independent variable is slip, which resolves time to 1e-7 after such a hold. The
    loading determines the end.
    """
    scene = Scene(**STIFF, hold_time=1e10)
    asked = Integrator(Accuracy(engine=engine, budget=10**5)).follow(
        scene,
        [maximum("spring_stress")],
        until=1e10 + 40.0,
    )
    events = list(asked)
    (reload,) = (event for event in events if event.kind is EventKind.SEGMENT_START)
    assert reload.time == 1e10
    assert events[-1].time == 1e10 + 40.0
    motion = simulate(scene, duration=1e10 + 40.0, engine=engine)
    assert (np.diff(motion.time) > 0.0).all()


HOLDS = [{"velocity": 0.0, "duration": 5.0}, {"velocity": 1.0, "step": 0.5}]


def test_scenes_differ_by_the_segments_of_their_protocols():
    short = Scene(**STIFF, loading=protocol(HOLDS, "held"))
    long = Scene(**STIFF, loading=protocol([{**HOLDS[0], "duration": 50.0}, HOLDS[1]], "held"))
    same = Scene(**STIFF, loading=protocol(HOLDS, "held"))
    assert short != long
    assert len({short, long, same}) == 2
    assert short == same
    assert short == short.with_(a=0.02).with_(a=short.a)


def test_a_trajectory_tells_the_segments_of_its_protocol():
    """The dataset of a motion contains the segments of its protocol."""
    scene = Scene(**STIFF, loading=protocol(HOLDS, "held"))
    motion = simulate(scene, duration=6.0, rtol=1e-4)
    told = json.loads(motion.attrs["scene"])
    assert told["segments"] == HOLDS
    assert protocol(told["segments"], "held").input_segments == scene.parts.loading.segments
    assert "segments" not in json.loads(simulate(Scene(hold_time=1.0), duration=0.1).attrs["scene"])


@pytest.mark.parametrize("last", [{"velocity": 2.0}, {"velocity": 2.0, "duration": 3.0}])
def test_protocols_are_pickled_by_their_segments(last):
    scene = Scene(**STIFF, loading=protocol([*HOLDS[:1], last], "held"))
    for protocol_number in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(scene, protocol_number))
        assert again == scene
        assert again.parts.loading.duration == scene.parts.loading.duration
    assert cloudpickle.loads(cloudpickle.dumps(scene)) == scene
    assert copy.deepcopy(scene) == scene
    assert pickle.loads(pickle.dumps(Protocol)) is Protocol


def test_protocols_are_points_of_an_axis():
    rows = [{"velocity": 3.0, "distance": 20.0}, {"velocity": 1.0}]
    up, higher = protocol(rows, "up"), protocol([{"velocity": 9.0}], "higher")
    study = study_of(
        "two_protocols",
        VelocityStep(phases=2),
        Axis("loading", [up, higher]),
        Axis("step_number", [1, 2]),
        base=Scene(**STIFF),
    )
    found = run(study, rtol=1e-4)
    assert found.loading.values.tolist() == ["up", "higher"]
    assert found.apparent_a.notnull().values.tolist() == [[True, True], [True, False]]


@pytest.mark.parametrize(
    "idle",
    [
        {"loading": protocol([{"velocity": 1.0}])},
        {"loading": protocol([{"velocity": 1.0, "duration": 5.0}, {"velocity": 1.0}])},
        {"velocity_steps": 1, "velocity_ratio": 1.0},
    ],
)
def test_a_history_without_a_step_is_that_of_the_plain_scene(idle):
    plain = Scene(law="slip", normal_stress="constant", stiffness_ratio=0.8, inertia=True)
    idle, accuracy = plain.with_(**idle), Accuracy(1e-4, 10**5)
    assert StepResponse()(idle, accuracy).status is Status.NO_STEP
    for measure in (LimitCycle(phases=2), Bifurcation(transient=4, events=4)):
        found, expected = measure(idle, accuracy), measure(plain, accuracy)
        assert found.status is expected.status is Status.OK
        assert found.values[measure.primary_output] == expected.values[measure.primary_output]
    if len(idle.parts.loading.segments) == 1:
        assert Triggered()(idle, accuracy).values["unstable"] == 0.0
