"""Tests of periodic and aperiodic motions, and of Floquet multipliers."""

import math

import numpy as np
import pytest
from rsfstudy.named_studies._bifurcation import Bifurcation

from rsfstudy import Scene
from rsfstudy.limit_cycles import return_map
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.limit_cycles.limit_cycle_search import (
    LimitCycleSearch,
    follow_motion_to_periodic_orbit,
)
from rsfstudy.limit_cycles.return_map import (
    ReturnMap,
    extract_section_coordinates,
    multiply_return_map_derivatives,
)
from rsfstudy.limit_cycles.stick_slip_cycles import StickSlipCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integrator import Integrator
from rsfstudy.slider.stability import compute_linear_growth_rates
from rsfstudy.status import Status

#: Slow oscillations of two slip states, started close to their attractor (Gu et al. 1984).
SLOW = {
    "law": "two_slip_states",
    "normal_stress": "constant",
    "a": 0.01,
    "load_velocity_ratio": 1.0,
    "displacement_step": 2.0,
}


def slow(ratio: float, **fields) -> Scene:
    return Scene(**{**SLOW, "stiffness_ratio": ratio, **fields})


def quick(rtol: float) -> Accuracy:
    """Return an accuracy with the compiled engine, for hundreds of events."""
    return Accuracy(rtol, 2_000_000, engine=COMPILED)


def came_to(scene: Scene, events: int = 64, rtol: float = 1e-7, **how):
    return follow_motion_to_periodic_orbit(scene, Integrator(quick(rtol)), events, **how)


@pytest.mark.parametrize("law", ["slip", "slowness"])
def test_the_multiplier_of_one_state_is_the_slope_of_its_return_map(law):
    """The multiplier equals the slope from two successive cycles."""
    scene = Scene(law=law, stiffness_ratio=0.8, load_velocity_ratio=2.0, inertia=True)
    integrator = Integrator(Accuracy(1e-8, 2_000_000))
    approach = LimitCycleSearch(scene, integrator)
    assert approach.follow_cycles_until_converged(300)
    orbit = follow_motion_to_periodic_orbit(scene, integrator, 64).attracting_periodic_orbit
    assert orbit.period_in_cycles == 1
    multiplier, forgotten = orbit.floquet_multipliers
    assert multiplier.imag == 0.0
    assert abs(forgotten) < 1e-12
    assert approach.last_cycle_as_periodic_orbit.floquet_multipliers[0].real == pytest.approx(
        multiplier.real, abs=1e-3
    )


def test_close_to_critical_stiffness_a_multiplier_is_what_growth_leaves():
    """Near the critical stiffness, the multiplier follows from growth rates.

    After a Hopf bifurcation, deviations from the limit cycle decay at twice the growth rate
    of small oscillations, over a period of 2 pi/omega.
    """
    for off in (2e-3, 5e-4):
        scene = slow(1.0 - off, displacement_step=0.02 + 14.0 * math.sqrt(off))
        fastest = compute_linear_growth_rates(scene, 0.0)[0]
        expected = math.exp(-2.0 * fastest.real * 2.0 * math.pi / abs(fastest.imag))
        found = Bifurcation(transient=60, events=4)(scene, quick(1e-8)).values
        assert 1.0 - found["floquet_multiplier"] == pytest.approx(1.0 - expected, rel=40.0 * off)


def followed(scene: Scene, count: int) -> list[StickSlipCycle]:
    return came_to(scene, count, 1e-9, follow_all_cycles=True).cycles


@pytest.mark.parametrize(
    ("ratio", "period"), [(0.95, 1), (0.9, 1), (0.868, 1), (0.865, 2), (0.86, 2), (0.856, 4)]
)
def test_periods(ratio, period):
    """The motion repeats after each period to the requested accuracy."""
    scene = slow(ratio)
    found = LimitCycle(phases=50)(scene, quick(1e-7))
    assert found.status is Status.OK
    assert found.values["period_events"] == period
    orbit = came_to(scene).attracting_periodic_orbit.orbit_starting_at_largest_event
    assert orbit.period_in_cycles == period
    assert orbit.is_attracting
    begin, end = map(
        extract_section_coordinates,
        (orbit.cycles[0].motion_point_at_start, orbit.cycles[-1].motion_point_at_end),
    )
    assert np.abs(end - begin).max() < 1e-6 * scene.a
    # The orbit covers the whole period, and the outputs belong to its largest event.
    assert found.values["time"][-1] == pytest.approx(
        sum(cycle.recurrence_interval for cycle in orbit.cycles), rel=1e-6
    )
    largest = orbit.cycles[0]
    assert found.values["max_log10_slip_rate"] == pytest.approx(
        largest.max_log_slip_rate / math.log(10.0), abs=1e-6
    )
    assert found.values["recurrence_interval"] == pytest.approx(
        largest.recurrence_interval, rel=1e-6
    )
    assert np.ptp(found.values["shear_stress"]) >= 0.99 * found.values["static_stress_drop"]
    # Slip over a period equals the load point displacement. Slip per event also depends on the
    # change of spring stress.
    slips = [
        cycle.recurrence_interval
        - (cycle.motion_point_at_end.spring_stress - cycle.motion_point_at_start.spring_stress)
        / scene.stiffness
        for cycle in orbit.cycles
    ]
    assert found.values["slip_per_event"] == pytest.approx(slips[0], rel=1e-6)
    assert found.values["slip"][-1] == pytest.approx(sum(slips), rel=1e-6)


def test_multipliers_of_a_period_are_those_of_all_its_events():
    orbit = came_to(slow(0.856)).attracting_periodic_orbit
    whole = multiply_return_map_derivatives(orbit.return_map_derivatives_per_cycle)
    size = len(whole)
    assert whole == pytest.approx(
        np.linalg.multi_dot([e[:size] for e in orbit.return_map_derivatives_per_cycle[::-1]])
    )
    turned = orbit.orbit_starting_at_largest_event.floquet_multipliers
    assert turned[0] == pytest.approx(orbit.floquet_multipliers[0], rel=1e-5)


def test_a_multiplier_passes_minus_one_where_the_period_doubles():
    before, after = (
        Bifurcation(transient=64, events=16)(slow(ratio), quick(1e-7)).values
        for ratio in (0.8664, 0.8661)
    )
    assert (before["period_events"], after["period_events"]) == (1.0, 2.0)
    assert after["floquet_multiplier"] < -1.0 < before["floquet_multiplier"] < -0.99
    assert after["floquet_multiplier_error"] < 1e-4
    assert before["lyapunov_exponent"] == pytest.approx(
        math.log(-before["floquet_multiplier"]), abs=1e-5
    )
    # The one-event cycle still exists, and the peaks lie on both sides of it.
    peaks = after["peak_log10_slip_rate"]
    assert peaks.min() < after["one_event_log10_peak"] < peaks.max()
    assert after["peak_spread"] == pytest.approx(np.ptp(peaks), abs=1e-12)


@pytest.mark.parametrize("engine", ENGINE_NAMES)
def test_what_never_repeats_itself_says_so(engine):
    accuracy = Accuracy(1e-6, engine=engine)
    cycle = LimitCycle(phases=2)(slow(0.853), accuracy)
    assert cycle.status is Status.NOT_PERIODIC
    assert cycle.status.is_answer
    assert "peak slip rates of 10^0.5" in cycle.message
    assert "recurrence_interval" not in cycle.values
    found = Bifurcation(transient=32, events=32)(slow(0.853), accuracy)
    assert found.status is Status.NOT_PERIODIC
    assert "period_events" not in found.values
    assert found.values["lyapunov_exponent"] > 0.2
    assert found.values["peak_spread"] > 0.5
    assert found.values["floquet_multiplier"] == pytest.approx(-1.6183, abs=1e-3)


def test_swings_that_still_shrink_are_not_called_aperiodic():
    """Decaying oscillations are not reported as aperiodic.

    Above the critical stiffness, each oscillation is a fraction of the previous
    oscillation, and twelve events are not enough to settle.
    """
    found = LimitCycle(events=12)(slow(1.12, load_velocity_ratio=1.02), quick(1e-6))
    assert found.status is Status.WORK_BUDGET_SPENT
    assert "the motion does not repeat itself yet" in found.message


def test_the_growth_of_departures_is_that_of_the_motion_alone(monkeypatch):
    """The Lyapunov exponent is independent of the initial deviation.

    The reference uses derivatives of each event over more events. The derivatives vary over
    about 1 % of the oscillation, so steps of 1e-4 times the oscillation cause an error of
    about 1e-4. The reference uses a smaller step, because the curvature is larger in other
    directions.
    """
    scene, transient, events = slow(0.853), 24, 16
    found = Bifurcation(transient=transient, events=events)(scene, quick(1e-7)).values
    seen = came_to(scene, transient + events, 1e-7, follow_all_cycles=True).cycles
    by = ReturnMap(scene, Integrator(quick(1e-7)))
    monkeypatch.setattr(return_map, "DIFFERENCE_STEP_OVER_LOG_RATE_RANGE", 3e-5)
    direction, grown = np.array([0.2, 1.0, -0.3]), []
    for cycle in seen:
        begin = extract_section_coordinates(cycle.motion_point_at_start)
        (slopes,) = by.compute_return_map_derivatives_per_cycle(
            begin, 1, scene.a * cycle.log_slip_rate_range
        )
        direction = slopes[: len(begin)] @ direction / np.linalg.norm(direction)
        grown.append(math.log(np.linalg.norm(direction)))
    expected = np.mean(grown[transient:])
    assert found["lyapunov_exponent"] == pytest.approx(expected, abs=1e-3)
