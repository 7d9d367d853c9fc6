"""Tests of settling: a motion settles only if small perturbations decay."""

import math
import re
from dataclasses import dataclass

import numpy as np
import pytest

from rsfstudy import Scene
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.measure_base.steady_sliding_stability import is_steady_sliding_linearly_stable
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, PYTHON, SCIPY
from rsfstudy.motion.integration_events import EventKind, approach_to_steady_state, rise
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.quantities import Quantity
from rsfstudy.responses._recorded_motion import compute_settled_friction_flag
from rsfstudy.responses.step_response import StepResponse
from rsfstudy.slider.equations import build_equations_between_ruptures
from rsfstudy.slider.fluid import Fluid
from rsfstudy.slider.parameter_layout import FLUID, LOG_SLOWNESS_UPPER_LIMIT
from rsfstudy.slider.parts import POSITIVE, FloatTuple, number
from rsfstudy.slider.stability import compute_largest_linear_growth_rate
from rsfstudy.status import Status

SLIDER = {
    "law": "slowness",
    "normal_stress": "constant",
    "a": 0.01,
    "b_over_a": 1.6,
    "mu_star": 0.6,
    "radiation_damping": 1e-6,
}
#: Unstable and stable steady sliding.
CYCLES = {**SLIDER, "stiffness_ratio": 0.7, "load_velocity_ratio": 2.0}
DECAYS = {**SLIDER, "stiffness_ratio": 1.1, "load_velocity_ratio": 300.0}


def auxiliary_rates(log_slip_rate, states, fraction, p):
    """Return dE/dt = V**2 - c E of a passive unknown, and a pressure decay."""
    energy, pressure = states
    time = fraction * math.exp(min(-log_slip_rate, LOG_SLOWNESS_UPPER_LIMIT))
    return fraction * math.exp(log_slip_rate) - p[FLUID] * time * energy, -time * pressure


def auxiliary_steady_states(log_slip_rate, p):
    return math.exp(2.0 * log_slip_rate) / p[FLUID], 0.0


@dataclass(frozen=True, kw_only=True)
class Dissipation(Fluid):
    """A passive unknown whose steady value in a rupture is 1e10."""

    energy_loss: float = number(0.3, "$c$", "1", "decay rate of energy", "V_*/D_c", rule=POSITIVE)

    name = "dissipation"
    unknowns = (
        Quantity("energy", "$E$", "1", "dissipated energy", "1"),
        Quantity("pore_pressure", "$P$", "1", "pore pressure", "sigma_*"),
    )
    auxiliary_rates = staticmethod(auxiliary_rates)
    auxiliary_steady_states = staticmethod(auxiliary_steady_states)

    @property
    def effects(self):
        return ("dissipation",)

    def parameter_values(self, scene: Scene) -> FloatTuple:
        return (self.energy_loss,)


@dataclass(frozen=True, kw_only=True)
class Excluded(Dissipation):
    name = "excluded_dissipation"
    excluded_from_distance = ("energy",)


@pytest.mark.parametrize(("fluid", "loss"), [(Dissipation, 0.3), (Excluded, 0.001)])
def test_a_passive_unknown_does_not_change_the_limit_cycle(fluid, loss):
    accuracy, measure = Accuracy(1e-5), LimitCycle(phases=2)
    drained = measure(Scene(**CYCLES), accuracy)
    ours = measure(Scene(**CYCLES, fluid=fluid, energy_loss=loss), accuracy)
    assert ours.status is drained.status is Status.OK
    for name in ("recurrence_interval", "static_stress_drop", "max_log10_slip_rate"):
        allowed = ours.values[f"{name}_error"] + drained.values[f"{name}_error"]
        assert ours.values[name] == pytest.approx(drained.values[name], abs=allowed), name


@pytest.mark.parametrize("engine", [SCIPY, PYTHON, COMPILED])
def test_a_passive_unknown_does_not_end_a_damped_oscillation(engine):
    """A passive unknown does not end the motion too early.

    In an earlier version, the motion ended after the first peak, when the unknown had
    decayed to 1e-6 of its maximum.
    """
    measure = StepResponse(peaks=4, phases=2)
    drained = measure(Scene(**DECAYS), Accuracy(1e-5))
    passive = measure(Scene(**DECAYS, fluid=Dissipation), Accuracy(1e-5, engine=engine))
    peaks = drained.values["peak_log10_slip_rate"]
    assert np.isfinite(peaks).all()
    # Later peaks contain the errors of all earlier oscillations.
    assert passive.values["peak_log10_slip_rate"] == pytest.approx(peaks, abs=1e-3)


def events_until_third_rise(scene, *settling):
    """Return the events of a motion until ln V has exceeded ln V_0 three times."""
    asked = (*settling, rise("log_slip_rate", scene.log_load_velocity))
    events = []
    for event in Integrator(Accuracy(1e-4)).follow(scene, asked):
        events.append(event)
        if sum(each.kind is EventKind.RISE for each in events) == 3:
            break
    return [(event.kind, event.point, event.evaluation_count) for event in events]


@pytest.mark.parametrize("terminal", [False, True])
def test_no_motion_settles_where_small_changes_grow(terminal):
    """A motion around unstable steady sliding does not settle.

    The distance from steady sliding falls far below the level after each rupture. The motion and
    its work are the same as without the settling event.
    """
    scene = Scene(**CYCLES, fluid=Dissipation)
    growth = compute_largest_linear_growth_rate(scene, scene.log_load_velocity)
    assert growth is not None
    assert growth.is_positive
    events = events_until_third_rise(scene, approach_to_steady_state(0.5, terminal=terminal))
    assert EventKind.SETTLED not in [kind for kind, _point, _count in events]
    assert events == events_until_third_rise(scene)


@pytest.mark.parametrize(("fluid", "level"), [("drained", 1e-3), (Dissipation, 0.5)])
def test_stability_is_computed_at_the_first_settling_event(fluid, level, monkeypatch):
    """The growth rate is not computed for a motion that never approaches steady sliding."""
    scenes = []

    def growth_rate(scene, log_slip_rate):
        scenes.append(scene)
        return compute_largest_linear_growth_rate(scene, log_slip_rate)

    monkeypatch.setattr(Scene, "compute_largest_linear_growth_rate", growth_rate)
    scene = Scene(**CYCLES, fluid=fluid)
    events_until_third_rise(scene, approach_to_steady_state(level))
    assert bool(scenes) == (fluid is Dissipation)


def test_an_excluded_unknown_is_left_out_of_the_distance():
    start, distance = (0.02, 0.01, 5.0, 0.0), []
    for fluid in (Dissipation, Excluded):
        scene = Scene(**CYCLES, fluid=fluid)
        point = build_equations_between_ruptures(scene, with_time=False).evaluate_motion_point(
            start
        )
        distance.append(point.distance_from_steady_state)
        steady = point.state + scene.b * point.log_slip_rate
    assert distance[0] > 5.0
    assert distance[1] == pytest.approx(abs(steady), rel=1e-12)


@pytest.mark.parametrize(
    ("excluded", "said"), [(("heat",), "energy, pore_pressure"), ("energy", "('energy',)")]
)
def test_only_unknowns_can_be_excluded(excluded, said):
    @dataclass(frozen=True, kw_only=True)
    class Wrong(Dissipation):
        name = "wrong_exclusion"
        excluded_from_distance = excluded

    with pytest.raises(InvalidValue, match=re.escape(said)):
        Scene(**CYCLES, fluid=Wrong)


def test_a_small_oscillation_that_grows_becomes_a_limit_cycle():
    """A growing oscillation with a small amplitude has not settled.

    The amplitude is below 1e-3 in ln V at first, which an earlier version accepted as
    settled.
    """
    unstable = {**SLIDER, "stiffness_ratio": 0.95, "load_velocity_ratio": 1.0}
    small, large = (
        LimitCycle(phases=2)(Scene(**unstable, displacement_step=step), Accuracy(1e-4))
        for step in (1e-4, 1.0)
    )
    assert small.status is large.status is Status.OK
    allowed = small.values["recurrence_interval_error"] + large.values["recurrence_interval_error"]
    interval = large.values["recurrence_interval"]
    assert small.values["recurrence_interval"] == pytest.approx(interval, abs=allowed)


@pytest.mark.parametrize(("off", "settles"), [(0.0, None), (1e-12, None), (1e-6, True)])
def test_growth_of_zero_is_undecided(off, settles):
    fields = {"law": "slip", "normal_stress": "constant", "a": 0.01, "b_over_a": 1.5}
    scene = Scene(**fields, stiffness_ratio=1.0 + off, displacement_step=1e-4)
    scene = scene.with_(load_velocity_ratio=1.0)
    outcome = LimitCycle(phases=2)(scene, Accuracy(1e-4))
    if settles:
        assert outcome.status is Status.NO_LIMIT_CYCLE
        assert is_steady_sliding_linearly_stable(scene)
    else:
        assert outcome.status is Status.UNVERIFIED
        assert "undecided" in outcome.message
        with pytest.raises(MotionStopped, match="undecided"):
            is_steady_sliding_linearly_stable(scene)


@pytest.mark.parametrize(("ratio", "flag"), [(0.99, 0.0), (1.0, math.nan), (1.2, 1.0)])
def test_a_flat_record_has_settled_only_if_small_changes_decay(ratio, flag):
    scene = Scene(law="slip", normal_stress="constant", a=0.01, stiffness_ratio=ratio)
    assert compute_settled_friction_flag(scene, is_friction_constant=True) == pytest.approx(
        flag, nan_ok=True
    )
    assert compute_settled_friction_flag(scene, is_friction_constant=False) == 0.0
