"""Tests of loadings as sequences of segments.

The motion is independent of the partition into segments.
"""

from dataclasses import dataclass
from itertools import pairwise

import pytest

from rsfstudy import Scene, simulate
from rsfstudy.errors import IncompleteWarning
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integration_events import (
    EventKind,
    approach_to_steady_state,
    fall,
    maximum,
    minimum,
    rise,
)
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.responses.linear_stability import LinearStability
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider.loading import Loading, Segment
from rsfstudy.slider.parts import number
from rsfstudy.slider.stability import compute_linear_growth_rates
from rsfstudy.status import Status


@dataclass(frozen=True, kw_only=True)
class TwoSegments(Loading):
    first_velocity: float = number(1.0, "", "1", "load point velocity of the first segment")
    first_displacement: float = number(0.0, "", "1", "displacement at its beginning")
    first_duration: float = number(1.0, "", "1", "how long it lasts")
    then_velocity: float = number(1.0, "", "1", "load point velocity afterwards")
    then_displacement: float = number(0.0, "", "1", "displacement at its beginning")

    name = "two_segments"

    @property
    def segments(self):
        return (
            Segment(self.first_velocity, self.first_displacement, self.first_duration),
            Segment(self.then_velocity, self.then_displacement),
        )


def scene(first=(1.0, 0.0, 1.0), then=(1.0, 0.0), **fields) -> Scene:
    names = ("first_velocity", "first_displacement", "first_duration")
    loading = dict(zip(names, first, strict=True))
    loading |= dict(zip(("then_velocity", "then_displacement"), then, strict=True))
    usual = {"law": "slowness", "normal_stress": "constant", "stiffness_ratio": 0.8}
    return Scene(**{**usual, **fields}, loading=TwoSegments, **loading)


def told(of: Scene, *watches, until: float, rtol: float = 1e-7) -> list:
    return list(Integrator(Accuracy(rtol, 10**6)).follow(of, watches, until=until))


@pytest.mark.parametrize(
    "first", [(0.0, 0.0, 1e4), (1.0, 0.1, 120.0), (3.0, 0.0, 60.0), (1e-6, 0.0, 1e4)]
)
def test_the_limit_cycle_is_that_of_the_last_segment(first):
    """The limit cycle is independent of earlier segments.

    The earlier segments are a hold, or cycles at another velocity.
    """
    outcome = LimitCycle(phases=10)(scene(first, inertia=True), Accuracy(1e-6))
    assert outcome.status is Status.OK
    assert outcome.values["recurrence_interval"] == pytest.approx(49.1365, rel=2e-6)
    assert outcome.values["slip_per_event"] == pytest.approx(49.1365, rel=2e-6)


def test_a_hold_does_not_count_as_far_from_steady_sliding():
    response = StepResponse(peaks=4, phases=10)(
        scene((0.0, 0.0, 100.0), stiffness_ratio=1.5), Accuracy(1e-6)
    )
    slow = StepResponse(peaks=4, phases=10)(
        scene((1e-9, 0.0, 100.0), stiffness_ratio=1.5), Accuracy(1e-6)
    )
    peaks = response.values["peak_log10_slip_rate"]
    assert peaks == pytest.approx(slow.values["peak_log10_slip_rate"], abs=1e-5)


def test_jumps_between_segments_are_told():
    """Jumps between segments are reported as events.

    A displacement step jumps across a level of slip rate, and a change of velocity ends the
    increase of spring stress.
    """
    jump = told(
        scene((1.0, 0.0, 5.0), (1.0, 1.2), stiffness_ratio=4.0),
        rise("log_slip_rate", 4.0),
        fall("log_slip_rate", 4.0),
        maximum("log_slip_rate"),
        until=8.0,
    )
    kinds = [event.kind for event in jump]
    assert kinds[:4] == [EventKind.START, EventKind.SEGMENT_START, EventKind.RISE, EventKind.FALL]
    assert [event.time for event in jump[1:3]] == [5.0, 5.0]
    assert kinds.count(EventKind.END) == 1
    held = told(scene((10.0, 0.0, 0.05), (0.0, 0.0)), maximum("spring_stress"), until=1.0)
    (highest,) = (event for event in held if event.kind is EventKind.MAXIMUM)
    assert highest.time == pytest.approx(0.05)
    assert highest.point.spring_stress == max(event.point.spring_stress for event in held)


def test_what_ends_a_motion_ends_it_between_regimes_too():
    """A terminal event may occur at a change of regime.

    At the end of a rupture, the slip rate jumps across the level.
    """
    of = scene((1.0, 0.1, 1e3), stiffness_ratio=0.5, inertia=True)
    *_before, last = told(of, fall("log_slip_rate", 8.0, terminal=True), until=500.0)
    assert (last.kind, last.regime) == (EventKind.FALL, "slow_manifold")
    assert last.point.log_slip_rate <= 8.0


def test_events_come_in_order_and_take_turns():
    of = scene((2.0, 0.2, 30.0), (5.0, -0.1), inertia=True)
    watches = (
        maximum("log_slip_rate"), minimum("log_slip_rate"),
        rise("log_slip_rate", 2.0), fall("log_slip_rate", 2.0),
        approach_to_steady_state(1e-9),
    )  # fmt: skip
    events = told(of, *watches, until=60.0)
    assert all(
        b.time >= a.time and b.evaluation_count >= a.evaluation_count for a, b in pairwise(events)
    )
    for pair in ({EventKind.MAXIMUM, EventKind.MINIMUM}, {EventKind.RISE, EventKind.FALL}):
        turns = [event.kind for event in events if event.kind in pair]
        assert len(turns) > 4
        assert all(a is not b for a, b in pairwise(turns))


def test_a_step_that_takes_all_stress_is_refused_wherever_it_stands():
    of = scene((1.0, 0.0, 1.0), (1.0, -100.0), stiffness_ratio=1.5)
    with pytest.raises(MotionStopped) as halt:
        told(of, until=5.0)
    assert halt.value.status is Status.SHEAR_STRESS_REVERSED
    with pytest.warns(IncompleteWarning, match="after 1 of 5 .*shear_stress_reversed"):
        motion = simulate(of, duration=5.0)
    assert motion.attrs["status"] == "shear_stress_reversed"
    assert float(motion.time[-1]) == pytest.approx(1.0)


IMPOSED = {"normal_stress": "imposed", "alpha": 0.3, "stiffness_ratio": 1.2}
INCLINED = {"normal_stress": "variable", "alpha": 0.3, "phi": 60.0, "stiffness_ratio": 1.2}


@pytest.mark.parametrize("law", ["slip", "two_slowness_states", "cut_off"])
@pytest.mark.parametrize("still", [IMPOSED, INCLINED], ids=["imposed", "inclined"])
@pytest.mark.parametrize(
    "idle",
    [
        {"normal_stress_step": 0.0}, {"oscillation_amplitude": 0.0}, {"normal_stress_ramp": 0.0},
        {"velocity_ramp": 0.0}, {"hold_time": 0.0}, {"velocity_steps": 0.0},
        {"radiation_damping": 0.0}, {"stress_dependence": 0.0}, {"inertia": False},
    ],
    ids=str,
)  # fmt: skip
def test_no_strength_is_the_scene_without_the_effect(idle, still, law):
    """An effect of zero strength adds no unknowns, numbers or functions."""
    if "stress_dependence" in idle and still is IMPOSED:
        still = {**still, "normal_stress": "constant", "alpha": None}
    plain = Scene(law=law, **still)
    scene = plain.with_(**idle)
    assert scene == plain
    assert scene.parameter_values == plain.parameter_values
    assert scene.friction_law_functions == plain.friction_law_functions
    assert scene.state_count == plain.state_count


@pytest.mark.parametrize("law", ["slip", "two_slowness_states"])
@pytest.mark.parametrize("still", [IMPOSED, INCLINED], ids=["imposed", "inclined"])
@pytest.mark.parametrize(
    "change",
    [{"normal_stress_step": 0.3}, {"oscillation_amplitude": 0.3}, {"normal_stress_ramp": 0.1}],
    ids=str,
)
def test_steady_sliding_and_its_stability_are_those_before_normal_stress_changes(
    change, still, law
):
    of_law = {"b1_over_a": 1.5} if law.startswith("two") else {}
    still = Scene(law=law, **of_law, **still, load_velocity_ratio=3.0)
    scene = still.with_(**change)
    assert scene.critical_stiffness == still.critical_stiffness
    assert scene.stiffness == still.stiffness
    if "normal_stress_step" in change:  # After the step, steady sliding occurs at another stress.
        return
    rates = compute_linear_growth_rates(still, still.log_load_velocity)
    assert compute_linear_growth_rates(scene, scene.log_load_velocity) == pytest.approx(rates)
    one, other = (LinearStability()(which, Accuracy()) for which in (scene, still))
    assert one.status is other.status is Status.OK
    assert dict(one.values) == pytest.approx(dict(other.values), rel=1e-12, nan_ok=True)
