"""Tests of all engines against an independent integration in time.

Motions and events must agree with ``time_domain_reference``.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from time_domain_reference import TimeDomainMotion, rows_to_columns

from rsfstudy import Scene, simulate
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.engines import ENGINE_NAMES, PYTHON, SCIPY
from rsfstudy.motion.integration_events import fall, maximum, minimum, rise
from rsfstudy.motion.integrator import Integrator

CONSTANT, IMPOSED = {"normal_stress": "constant"}, {"normal_stress": "imposed", "alpha": 0.3}
INCLINED = {"normal_stress": "variable", "phi": 65.0, "alpha": 0.3}
SAME = {"a": 0.01, "b_over_a": 1.8, "mu_star": 0.7, "load_velocity_ratio": 2.0}
#: Fields with inertia for which ruptures reach the inertial limit, but are slow enough for an
#: integration in time.
MASS = {"inertia": True, "period": 2.0 * math.pi * 0.03, "reference_rate": 1.0}
WAVES = {"radiation_damping": 2e-3}
#: Strong heating, so that all terms are large within a few slip distances.
HEAT = {"temperature": "shear_heating", "heating": 0.01, "cooling": 0.2, "direct_activation": 15.0,
        "evolution_activation": 10.0}  # fmt: skip
FLASH = {"weakening_velocity_ratio": 3.0, "weakened_friction": 0.3, "weakening_exponent": 2.0}
STATES = {"b_over_a": None, "b1_over_a": 1.2, "b2_over_a": 0.6, "length_ratio": 4.0}
RAMP = {**IMPOSED, "law": "slowness", "stiffness": 0.025, "ramp_duration": 4.0}
WAVY = {"stiffness": 0.016, "oscillation_period": 8.0, "oscillation_amplitude": 0.05}
TWO_WAYS = {"regularised": True, "mu_star": 0.6, "load_velocity_ratio": 1.0, "stiffness": 0.02}


#: The compilation of each combination of parts takes seconds.
NOT_COMPILED = (SCIPY, PYTHON)


def scene(**fields) -> Scene:
    stated = {name: value for name, value in {**SAME, **fields}.items() if value is not None}
    return Scene(**stated)


#: Motions with many events and their end times, one for each effect.
EVENTFUL = {
    "slip": (scene(**CONSTANT, stiffness=0.0095), 25.0),
    "slowness": (scene(law="slowness", **CONSTANT, stiffness=0.009), 25.0),
    "inclined": (scene(**INCLINED, stiffness=0.012), 25.0),
    "waves": (scene(law="slowness", **CONSTANT, **WAVES, stiffness=0.0065), 30.0),
    "two states": (scene(law="two_slip_states", **CONSTANT, **STATES, stiffness=0.006), 40.0),
    "dilatant": (
        scene(law="slowness", **CONSTANT, fluid="dilatant", dilatancy=0.01, drainage=0.7,
              stiffness=0.008),
        12.0,
    ),
    "compaction": (
        scene(**CONSTANT, **WAVES, fluid="dilatant", dilatancy=-0.01, drainage=0.1,
              porosity_length=5.0, stiffness=0.008),
        25.0,
    ),
    "flash": (scene(law="flash_heating", **FLASH, **CONSTANT, **WAVES, stiffness=0.012), 12.0),
    "hot": (scene(law="slowness", **CONSTANT, **HEAT, **WAVES, stiffness=0.0065), 12.0),
    "pressurised": (
        scene(**CONSTANT, **HEAT, **WAVES, fluid="thermal", pressurisation=2.0, stiffness=0.0065),
        12.0,
    ),
    "ruptures": (scene(**INCLINED, **MASS, stiffness=0.0065), 15.0),
    "slowness, ruptures": (scene(law="slowness", **IMPOSED, **MASS, stiffness=0.0065), 7.5),
    "inclined, waves": (scene(**INCLINED, **WAVES, stiffness=0.0065), 30.0),
    "slowness, inclined, waves": (
        scene(law="slowness", **INCLINED, **WAVES, stiffness=0.0065), 30.0
    ),
}  # fmt: skip
#: Other laws, loadings and initial conditions.
MOTIONS = {
    **EVENTFUL,
    "two slowness states": (
        scene(law="two_slowness_states", **CONSTANT, **STATES, stiffness=0.006), 20.0
    ),
    "perrin_rice_zheng": (scene(law="perrin_rice_zheng", **INCLINED, stiffness=0.016), 25.0),
    "family": (
        scene(law="family", law_exponent=0.4, **INCLINED, stress_dependence=0.7, stiffness=0.016),
        25.0,
    ),
    "dilatant, inclined, mass": (
        scene(phi=65.0, alpha=0.0, fluid="dilatant", dilatancy=0.004, drainage=0.7, **MASS,
              porosity_length=3.0, stiffness=0.0065),
        12.0,
    ),
    "flash, mass": (
        scene(law="flash_heating", **{**FLASH, "weakened_friction": 0.5}, **CONSTANT, **MASS,
              stiffness=0.03),
        6.0,
    ),
    "flash, inclined, waves": (
        scene(law="flash_heating", **FLASH, **INCLINED, **WAVES, stiffness=0.02), 12.0
    ),
    "hot, inclined": (scene(law="perrin_rice_zheng", **INCLINED, **HEAT, stiffness=0.016), 12.0),
    "hot, inclined, mass": (scene(**INCLINED, **HEAT, **MASS, stiffness=0.0065), 12.0),
    "hot flash": (
        scene(law="flash_heating", **FLASH, **CONSTANT, **HEAT, **WAVES, stiffness=0.012), 12.0
    ),
    "hot, oscillation": (scene(**IMPOSED, **HEAT, **WAVY), 12.0),
    "hot, oscillation, inclined, waves": (
        scene(law="slowness", **INCLINED, **WAVES, **HEAT, **WAVY), 12.0
    ),
    "hot, Nagata": (scene(law="slowness", **INCLINED, **HEAT, stress_dependence=0.7,
                          stiffness=0.016), 12.0),
    "pressurised, dilatant, inclined, mass": (
        scene(phi=65.0, alpha=0.0, **HEAT, **MASS, fluid="thermal", pressurisation=0.5,
              dilatancy=-0.004, porosity_length=0.4, drainage=0.7, stiffness=0.0065), 8.0
    ),
    "pressurised, inclined, waves": (
        scene(law="slowness", **INCLINED, **HEAT, **WAVES, fluid="thermal", pressurisation=2.0,
              stiffness=0.0065), 12.0
    ),
    "ramp": (scene(**RAMP, normal_stress_ramp=0.1), 12.0),
    "ramp down": (scene(**RAMP, normal_stress_ramp=-0.1), 12.0),
    "ramp, mass": (scene(**RAMP, **MASS, normal_stress_ramp=0.1), 12.0),
    "ramp, inclined, waves": (
        scene(**{**RAMP, **INCLINED}, **WAVES, normal_stress_ramp=0.1), 12.0
    ),
    "oscillation": (scene(**IMPOSED, **WAVY), 20.0),
    "oscillation, slowness": (scene(law="slowness", **IMPOSED, **WAVY), 20.0),
    "oscillation, inclined, waves": (scene(law="slowness", **INCLINED, **WAVES, **WAVY), 20.0),
    "oscillation, mass": (scene(**IMPOSED, **MASS, **WAVY), 20.0),
    "oscillation, load at rest": (
        scene(law="slowness", **IMPOSED, **WAVY, load_velocity_ratio=0.0), 50.0
    ),
    "step of normal stress": (scene(**INCLINED, normal_stress_step=0.05, stiffness=0.016), 12.0),
    "step of normal stress, waves": (
        scene(**IMPOSED, **WAVES, normal_stress_step=-0.02, stiffness=0.016), 12.0
    ),
    "displacement step": (scene(**INCLINED, displacement_step=0.5, stiffness=0.016), 12.0),
    "hold": (
        scene(law="slowness", **INCLINED, hold_time=40.0, load_velocity_ratio=None,
              stiffness=0.016),
        60.0,
    ),
    "healed": (
        scene(law="slowness", **CONSTANT, initial_stress=-0.02, initial_state=0.08,
              load_velocity_ratio=1.0, stiffness=0.0105),
        60.0,
    ),
    "slip back": (scene(**CONSTANT, **TWO_WAYS, displacement_step=-45.0), 100.0),
    "slip back, slowness": (
        scene(law="slowness", **CONSTANT, **TWO_WAYS, displacement_step=-65.0), 150.0
    ),
    "slip back, inclined": (
        scene(law="slowness", **INCLINED, **TWO_WAYS, displacement_step=-32.0), 100.0
    ),
}  # fmt: skip


@functools.cache
def in_time(name: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return 50 times, none of which is a break, and the reference motion."""
    which, until = MOTIONS[name]
    times = np.linspace(0.0, until, 51)[1:] - 1e-3 * until
    return times, rows_to_columns(TimeDomainMotion(which).solve(times.tolist())[0])


@pytest.mark.parametrize(
    ("name", "engine"),
    [(name, by) for name in MOTIONS for by in (ENGINE_NAMES if name in EVENTFUL else NOT_COMPILED)],
)
def test_motions_are_those_of_time(name, engine):
    """Motions agree with the reference within 13 times rtol.

    Local errors are rtol/14 and accumulate over about a hundred steps. The measured error
    is 1.3 rtol in ln V, and in stresses divided by a. If ln V changes rapidly, the error of
    time contributes in proportion to the rate of ln V. The tolerance is ten times larger.
    """
    (which, _until), (times, theirs) = MOTIONS[name], in_time(name)
    rtol = 1e-8
    motion = simulate(which, times=times, rtol=rtol, engine=engine)
    allowed = 13.0 * rtol * (1.0 + np.abs(theirs["log_slip_rate_derivative"]))
    off = np.abs(motion.log10_slip_rate.values * math.log(10.0) - theirs["log_slip_rate"])
    assert (off / allowed).max() < 1.0
    for of, known in (
        ("shear_stress", which.mu_star + theirs["spring_stress"]),
        ("frictional_stress", which.mu_star + theirs["frictional_stress"]),
        ("normal_stress_ratio", theirs["normal_stress"]),
        ("state_variable", theirs["theta"]),
    ):
        assert (np.abs(motion[of].values - known) / allowed).max() < which.a, of


def events_of(which: Scene) -> tuple[tuple, ...]:
    """Return the requested events and their reference functions.

    Each reference function is zero at the event and crosses zero in the given direction.
    """
    load = which.load_velocity_ratio
    above, below = math.log(load) + 0.1, math.log(load) - 0.1
    return (
        (maximum("log_slip_rate"), lambda now: now.log_slip_rate_derivative, -1.0),
        (minimum("log_slip_rate"), lambda now: now.log_slip_rate_derivative, 1.0),
        (maximum("spring_stress"), lambda now: load - now.velocity, -1.0),
        (minimum("spring_stress"), lambda now: load - now.velocity, 1.0),
        (rise("log_slip_rate", above), lambda now: now.log_slip_rate - above, 1.0),
        (fall("log_slip_rate", below), lambda now: now.log_slip_rate - below, -1.0),
    )


@functools.cache
def events_in_time(name: str) -> list[list]:
    which, until = EVENTFUL[name]
    _watches, functions, directions = zip(*events_of(which), strict=True)
    return TimeDomainMotion(which).solve([until], functions, directions)[1]


@pytest.mark.parametrize("engine", ENGINE_NAMES)
@pytest.mark.parametrize("name", EVENTFUL)
def test_events_are_those_of_time(name, engine):
    """Events agree with the reference within 20 times rtol.

    The time error of an extremum is the error of the slope divided by the curvature, which
    is at least 0.1 in these motions. The measured errors are 5 rtol, and 9 rtol in
    ruptures. The errors of the reference are a thousand times smaller.
    """
    which, until = EVENTFUL[name]
    rtol, watches = (1e-8 if which.has_mass else 1e-9), [row[0] for row in events_of(which)]
    integrator = Integrator(Accuracy(rtol, 10**6, engine=engine))
    told = {watch: [] for watch in watches}
    for event in integrator.follow(which, watches, with_time=True, until=until):
        if event.specification is not None:
            told[event.specification].append(event)
    known = dict(zip(watches, events_in_time(name), strict=True))
    assert {w: len(events) for w, events in told.items()} == {w: len(k) for w, k in known.items()}
    assert min(map(len, known.values())) > 0
    allowed = 20.0 * rtol
    for watch, events in told.items():
        for event, (time, now) in zip(events, known[watch], strict=True):
            point = event.point
            assert event.time == pytest.approx(time, rel=0.0, abs=allowed), watch
            assert point.log_slip_rate == pytest.approx(now.log_slip_rate, rel=0.0, abs=allowed), (
                watch
            )
            ours = point.spring_stress, point.frictional_stress, point.normal_stress, point.state
            within = allowed * which.a
            assert ours == pytest.approx(
                (now.spring_stress, now.frictional_stress, now.normal_stress, now.theta),
                rel=0,
                abs=within,
            ), watch
