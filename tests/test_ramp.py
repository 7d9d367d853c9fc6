"""Tests of ramps of imposed normal stress and load point velocity.

Short ramps equal steps, and a ramp has no effect after its end. Velocity ramps are
approximated by stairs.
"""

import math

import pytest
from time_domain_reference import TimeDomainMotion

from rsfstudy import Scene, simulate
from rsfstudy.errors import InvalidValue
from rsfstudy.limit_cycles.limit_cycle import LimitCycle
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import COMPILED, ENGINE_NAMES
from rsfstudy.motion.integration_events import EventKind, approach_to_steady_state
from rsfstudy.motion.integrator import Integrator

IMPOSED = {"law": "slowness", "normal_stress": "imposed", "alpha": 0.3, "stiffness_ratio": 3.0}
SLIDERS = {
    "inclined, waves": {**IMPOSED, "normal_stress": "variable", "radiation_damping": 1e-3},
    "imposed, mass": {**IMPOSED, "inertia": True},
}
RAMP = {"normal_stress_ramp": 0.1, "ramp_duration": 4.0}


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("over", [0.3, 1.0, 1.7])
def test_where_stability_limits_steps_a_motion_ends_as_accurately_as_steps_do(over, engine):
    """The end of a ramp is as accurate as the end of a step.

    The spring is sixty times stiffer than critical, so stability limits the steps. Dense
    output within such steps has 100 times the requested error and must not be used at the
    end of the ramp.
    """
    scene = Scene(law="slip", a=0.005, b_over_a=2.4, normal_stress="imposed", alpha=0.2,
                  load_velocity_ratio=1.1, stiffness=0.36, normal_stress_ramp=0.33,
                  ramp_duration=30.5)  # fmt: skip

    def at_end(rtol: float, engine: str) -> tuple[float, float]:
        integrator = Integrator(Accuracy(rtol, 200_000, engine=engine))
        *_, end = integrator.follow(scene, with_time=True, until=over * 30.5)
        assert end.time == over * 30.5
        return end.point.log_slip_rate, end.point.spring_stress / scene.a

    exact = at_end(1e-11, COMPILED)
    # The tolerance is three times the requested accuracy, because local errors accumulate.
    for rtol in (1e-5, 1e-7, 1e-9):
        assert at_end(rtol, engine) == pytest.approx(exact, abs=3.0 * rtol)


def test_once_over_it_leaves_no_unknown():
    scene = Scene(**IMPOSED, **RAMP)
    (during, first), (after, last) = scene.segment_sequences_without_jumps
    assert (during.state_count, after.state_count) == (2, 1)
    assert [*first[0, :2], *last[0, :2]] == [0.0, 4.0, 4.0, math.inf]
    assert (
        after.parameter_values
        == Scene(**IMPOSED, normal_stress_step=0.1, load_velocity_ratio=1.0).parameter_values
    )


@pytest.mark.parametrize("slider", SLIDERS)
def test_it_settles_once_over(slider):
    scene = Scene(**SLIDERS[slider], **RAMP)
    integrator = Integrator(Accuracy(1e-8, 10**5, engine=COMPILED))
    *_earlier, end = integrator.follow(
        scene, [approach_to_steady_state(1e-3, terminal=True)], with_time=True
    )
    assert end.kind is EventKind.SETTLED
    assert end.time > 4.0
    motion = simulate(scene, duration=12.0, engine=COMPILED)
    assert (motion.time == 4.0).any()
    assert float(motion.time[-1]) == pytest.approx(12.0, rel=1e-12)


def test_what_is_not_asked_of_it():
    with pytest.raises(
        InvalidValue, match="ramp' cannot be used here, because it changes the normal"
    ):
        LimitCycle()(Scene(**IMPOSED, **RAMP), Accuracy())


# ---- load point velocity -------------------------------------------------------------------------

PLAIN = {"law": "slowness", "normal_stress": "constant", "stiffness_ratio": 3.0}


@pytest.mark.parametrize("change", [-0.8, 4.0])
def test_stairs_tend_to_a_ramp_of_velocity_as_the_square_of_their_number(change):
    """The error of stairs is inversely proportional to their number squared.

    The reference is an independent integration in time to a point after the ramp.
    """
    scene = Scene(**PLAIN, velocity_ramp=change, velocity_ramp_duration=4.0)
    known, off = (
        TimeDomainMotion(Scene(**PLAIN), velocity_ramp=change).solve([5.0])[0][0].spring_stress,
        [],
    )
    for stairs in (64, 128):
        which = scene.with_(velocity_ramp_stairs=stairs)
        *_earlier, end = Integrator(Accuracy(1e-9, 10**6)).follow(which, until=5.0)
        off.append(end.point.spring_stress - known)
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
    assert abs(off[1]) < 1e-4 * scene.a


def test_the_load_point_is_where_it_should_be():
    scene = Scene(**PLAIN, velocity_ramp=-1.0, velocity_ramp_duration=4.0, velocity_ramp_stairs=3)
    moved = 0.0
    for segment in scene.parts.loading.segments[:-1]:
        moved += segment.load_velocity * segment.duration
    assert moved == pytest.approx(2.0, rel=1e-15)
    assert scene.load_velocity == 0.0
