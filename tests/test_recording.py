"""Tests of the recording of motions.

Samples are recorded at the exact requested times and agree with motions that end there.
Values between the steps are as accurate as values at the end of steps.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from rsfstudy import Scene, protocol, simulate
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integration_events import Event, EventKind
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.motion_resampling import resample_motion_along_path
from rsfstudy.motion.recording import FIRST_STATE_COLUMN, RECORDED_VARIABLE_NAMES, MotionRecorder
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.status import Status

RTOL = 1e-6
#: A protocol in which the load point moves, is held, is displaced while it moves again, and
#: changes its velocity.
PROTOCOL = protocol(
    [
        {"velocity": 2.0, "duration": 3.0},
        {"velocity": 0.0, "duration": 5.0},
        {"velocity": 1.0, "step": -0.4, "duration": 4.0},
        {"velocity": 1.3},
    ]
)
SCENES = {
    "one segment": Scene(stiffness_ratio=1.5, load_velocity_ratio=1.5),
    # Stability limits the steps.
    "stiff": Scene(stiffness_ratio=30.0, load_velocity_ratio=3.0),
    "protocol": Scene(loading=PROTOCOL, stiffness_ratio=2.0),
    "protocol with mass": Scene(loading=PROTOCOL, stiffness_ratio=1.6, inertia=True),
    "ramp": Scene(law="slowness", normal_stress="imposed", alpha=0.3, stiffness_ratio=3.0,
                  normal_stress_ramp=0.1, ramp_duration=4.0),
    "dilatant": Scene(fluid="dilatant", loading=PROTOCOL, stiffness_ratio=2.0),
}  # fmt: skip
#: Times that include the start, two samples within one step, the end of a segment, the beginning
#: of a segment, and the end of the motion.
TIMES = np.array([0.0, 1e-9, 0.7, 0.7000001, 3.0, 3.5, 8.0, 8.0 + 1e-9, 10.0, 12.0, 13.7, 15.0])


def recorded(scene: Scene, engine: str, times: np.ndarray, until: float = math.inf):
    """Return the recorded table and the events of a motion."""
    recording, events = MotionRecorder(sample_times=times), list[Event]()
    integrator = Integrator(Accuracy(RTOL, 10**6, engine=engine))
    motion = integrator.follow(scene, with_time=True, until=until, recording=recording)
    for event in motion:
        events.append(event)
        if event.kind is EventKind.ALL_SAMPLES_RECORDED and math.isinf(until):
            break
    return recording.as_table(scene), events


def row_of(scene: Scene, event: Event) -> list[float]:
    """Return the recorded variables of an event, starting with slip."""
    point = event.point
    stresses = (
        scene.mu_star + point.spring_stress,
        scene.mu_star + point.frictional_stress,
        point.normal_stress,
    )
    log_slip_rate = point.log_slip_rate / math.log(10.0)
    return [event.slip, log_slip_rate, *stresses, point.state, point.apparent_friction]


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("name", SCENES)
def test_values_are_those_of_motions_that_end_there(name, engine):
    """Samples agree with motions that end at the same times.

    The times are bitwise equal. Both motions meet the tolerance, and one of them uses dense
    output, so 30 times the tolerance is allowed.
    """
    scene = SCENES[name]
    table, events = recorded(scene, engine, TIMES, until=15.0)
    assert table[:, 0].tolist() == TIMES.tolist()
    assert [event.kind for event in events].count(EventKind.ALL_SAMPLES_RECORDED) == 1
    assert [event.kind for event in events[-2:]] == [EventKind.ALL_SAMPLES_RECORDED, EventKind.END]
    for time, row in zip(TIMES[1:], table[1:], strict=True):
        integrator = Integrator(Accuracy(RTOL, 10**6, engine=engine))
        *_, end = integrator.follow(scene, with_time=True, until=time)
        assert (end.kind, end.time) == (EventKind.END, time)
        states = list(end.point.psis[: len(row) - FIRST_STATE_COLUMN])
        expected = [*row_of(scene, end), *states]
        # Scales that correspond to a change of 1 in ln V: a for stress and states. The scale of
        # slip follows from stress.
        scales = [1.0 + scene.a / scene.stiffness, 1.0, *[scene.a] * (len(expected) - 2)]
        apart = (
            np.abs(
                [*row[1 : len(RECORDED_VARIABLE_NAMES)], *row[FIRST_STATE_COLUMN:]]
                - np.array(expected)
            )
            / scales
        )
        assert apart.max() < 30.0 * RTOL, (time, apart)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_the_end_of_a_segment_is_recorded_and_not_the_beginning_of_the_next(engine):
    """A sample at a boundary belongs to the earlier segment.

    The spring stress jumps with the load point. A time that is requested twice is recorded
    twice.
    """
    scene = SCENES["protocol"]
    table, events = recorded(scene, engine, np.array([8.0, 8.0, 8.0 + 1e-12, 8.5]))
    (begun,) = (
        event for event in events if event.kind is EventKind.SEGMENT_START and event.time == 8.0
    )
    spring_stress = table[:, RECORDED_VARIABLE_NAMES.index("shear_stress")] - scene.mu_star
    jump = -0.4 * scene.stiffness
    assert (
        spring_stress[0]
        == spring_stress[1]
        == pytest.approx(begun.point.spring_stress - jump, rel=1e-12)
    )
    assert spring_stress[2] == pytest.approx(begun.point.spring_stress, abs=1e-9 * scene.a)
    assert events[-1].kind is EventKind.ALL_SAMPLES_RECORDED


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_what_lies_beyond_the_end_is_not_recorded(engine):
    table, events = recorded(SCENES["one segment"], engine, np.array([1.0, 2.0, 3.0]), until=2.0)
    assert table[:, 0].tolist() == [1.0, 2.0]
    assert [event.kind for event in events] == [EventKind.START, EventKind.END]


# ---- between the steps ---------------------------------------------------------------------------

#: Tolerance in units of rtol and of the change that corresponds to 1 in ln V.
ALLOWED = 30.0


def weights(scene: Scene) -> dict[str, float]:
    """Return the changes of the variables that correspond to 1 in ln V."""
    stresses = ("shear_stress", "frictional_stress", "state_variable")
    return {"log10_slip_rate": np.log10(np.e), "slip": 1.0} | dict.fromkeys(stresses, scene.a)


def exactly(scene: Scene, times: np.ndarray) -> dict[str, np.ndarray]:
    """Return the motion at given times with a much smaller tolerance."""
    recording = MotionRecorder(sample_times=times)
    integrator = Integrator(Accuracy(1e-11, 10**7, engine=COMPILED))
    list(integrator.follow(scene, until=float(times[-1]), recording=recording))
    return dict(zip(RECORDED_VARIABLE_NAMES, recording.as_table(scene).T, strict=False))


@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("stiff", [3.0, 17.0])
def test_rows_between_the_steps_of_a_stiff_slider(stiff, engine, rtol):
    """Rows within the steps of a stiff slider meet the tolerance.

    Stability limits the steps, and plain dense output would have 720 times the requested
    error.
    """
    scene = Scene(normal_stress="constant", stiffness_ratio=stiff, load_velocity_ratio=10.0)
    rows = simulate(scene, duration=3.0, rtol=rtol, engine=engine)
    exact = exactly(scene, rows.time.values)
    for name, weight in weights(scene).items():
        off = np.abs(rows[name].values - exact[name]).max() / weight
        assert off < ALLOWED * rtol, name


@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_points_along_a_response_are_those_of_the_motion(law):
    """Points along a response lie on the motion.

    Linear interpolation between rows would have an error of 1e-3.
    """
    scene, rtol = Scene(law=law, stiffness_ratio=1.1, load_velocity_ratio=1.3), 1e-7
    found = StepResponse(phases=150)(scene, Accuracy(rtol, engine=COMPILED))
    assert found.status is Status.OK
    times = found.values["time"]
    assert (np.diff(times) >= 0.0).all()
    exact = exactly(scene, times)
    for name, weight in weights(scene).items():
        off = np.abs(found.values[name] - exact[name]).max() / weight
        assert off < ALLOWED * rtol, name


@pytest.mark.parametrize("fields", [{"inertia": True}, {"radiation_damping": 1e-6}])
@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_the_extremes_of_a_cycle_are_points_of_its_orbit(law, fields):
    """The extrema of an orbit agree with the outputs within their errors."""
    scene = Scene(law=law, stiffness_ratio=0.8, load_velocity_ratio=2.0, **fields)
    found = LimitCycle(phases=80)(scene, Accuracy(1e-6, engine=COMPILED)).values
    orbit, stress = found["log10_slip_rate"], found["shear_stress"]
    for name, extreme in (
        ("max_log10_slip_rate", orbit.max()),
        ("min_log10_slip_rate", orbit.min()),
        ("static_stress_drop", np.ptp(stress)),
        ("dynamic_stress_drop", stress.max() - stress[orbit.argmax()]),
    ):
        assert extreme == pytest.approx(found[name], abs=2.0 * found[f"{name}_error"]), name
    # The spring stress follows from the difference between load point displacement and slip.
    moved = scene.load_velocity * found["time"] - found["slip"]
    assert stress - stress[0] == pytest.approx(scene.stiffness * moved, abs=1e-9 * scene.a)


def test_points_along_a_path_are_those_of_the_compiled_loop():
    """Both engines select the same points along a path.

    The path contains a rupture. Rounding errors may move a flat extremum to a neighbouring
    point, and all other points agree to rounding.
    """
    scene = Scene(law="slip", stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True)
    recording, changes = MotionRecorder(), 0
    for event in Integrator(Accuracy(1e-6, 20_000)).follow(
        scene, with_time=True, recording=recording
    ):
        changes += event.kind is EventKind.REGIME_CHANGE
        if changes == 2:
            break
    table = recording.as_table(scene)
    ours, theirs = (
        resample_motion_along_path(table, 50),
        resample_motion_along_path(table, 50, engine=COMPILED),
    )
    for name, values in ours.items():
        off = np.abs(theirs[name] - values) > 1e-11 * max(1.0, np.ptp(values))
        assert np.count_nonzero(off) <= 4, name
