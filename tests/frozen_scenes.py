"""Frozen motions, whose events are stored in ``frozen_events.json``.

The motions cover every law, every selector field, every loading and every reason for
termination, with a few rows each. ``test_frozen_events.py`` compares all engines with the
stored events. No motion amplifies rounding errors: a change in the last bit of any field
changes the stored numbers by less than a tenth of the tolerances of the tests. Run ``python
tests/frozen_motion_comparison.py sensitivity`` to measure the changes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from rsfstudy import Scene, protocol
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integration_events import (
    EventKind,
    EventSpecification,
    approach_to_steady_state,
    fall,
    maximum,
    minimum,
    rise,
)
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.recording import MOTION_VARIABLE_NAMES, MotionRecorder
from rsfstudy.slider.equations import (
    build_equations_at_imposed_slip_rate,
    build_equations_between_ruptures,
)

#: Maximum number of rows per motion, and work budget of a motion.
ROWS, BUDGET = 12, 40_000


#: Events that most motions request: extrema, and crossings of levels that do not coincide with
#: other events.
EXTREMA = (
    maximum("log_slip_rate"),
    minimum("log_slip_rate"),
    maximum("spring_stress"),
    minimum("spring_stress"),
)
USUAL_EVENTS = (*EXTREMA, rise("log_slip_rate", 0.9), fall("log_slip_rate", 0.5))
#: Extrema of the apparent friction, which differ from the extrema of spring stress.
FRICTION_EVENTS = (
    maximum("apparent_friction"),
    minimum("apparent_friction"),
    maximum("log_slip_rate"),
    minimum("log_slip_rate"),
)
ALL_EXTREMA, SLOWING_EVENTS = (
    (*FRICTION_EVENTS, *EXTREMA[2:]),
    (*EXTREMA, fall("log_slip_rate", -1.0)),
)
REVERSAL_EVENTS = (*EXTREMA[2:], rise("frictional_stress", -0.5), rise("state", 0.01))


class Motion(NamedTuple):
    """A motion of a scene with time.

    Attributes
    ----------
    fields : mapping
        Fields of the scene.
    watches : tuple of EventSpecification
        Requested events.
    until : float
        End time, in D_c/V_*.
    rows : int
        Maximum number of events.
    rtol : float
        Requested relative accuracy.
    budget : int
        Maximum number of right-hand-side evaluations.
    """

    fields: Mapping[str, Any]
    watches: tuple[EventSpecification, ...] = USUAL_EVENTS
    until: float = 40.0
    rows: int = ROWS
    rtol: float = 1e-7
    budget: int = BUDGET

    def events(self, scene: Scene, engine: str) -> Iterator[Any]:
        """Yield the events of the motion."""
        integrator = Integrator(Accuracy(self.rtol, self.budget, engine=engine))
        return integrator.follow(scene, self.watches, with_time=True, until=self.until)


def frozen_motion(law: str, *parts: Mapping[str, Any], **stated: Any) -> Motion:
    """Return a motion of a law.

    The scene combines the fields of all ``parts`` with the keyword arguments. Keyword
    arguments that are fields of ``Motion`` configure the motion instead of the scene.
    """
    own = {name: stated.pop(name) for name in Motion._fields if name in stated}
    fields = {"law": law}
    for part in parts:
        fields |= part
    return Motion(fields | stated, **own)


class Track(NamedTuple):
    """A path of a system of equations without time, forward or backward.

    If ``log_slip_rate`` is given, the path is the response of a rigid slider at this slip
    rate.
    """

    fields: Mapping[str, Any]
    state: tuple[float, ...]
    watches: tuple[EventSpecification, ...]
    rows: int
    backward: bool = False
    samples: tuple[float, ...] = ()
    log_slip_rate: float | None = None
    rtol: float = 1e-7
    budget: int = BUDGET

    def events(self, scene: Scene, engine: str) -> Iterator[Any]:
        """Yield the events along the path."""
        if self.log_slip_rate is None:
            equations = build_equations_between_ruptures(scene, with_time=False)
        else:
            equations = build_equations_at_imposed_slip_rate(scene, self.log_slip_rate)
        integrator = Integrator(Accuracy(budget=self.budget, engine=engine))
        follow = functools.partial(
            integrator.follow_equations,
            equations,
            self.state,
            self.watches,
            local_tolerance=0.07 * self.rtol,
            backward=self.backward,
        )
        return self._recorded_events(scene, equations, follow) if self.samples else follow()

    def _recorded_events(
        self, scene: Scene, equations: Any, follow: Callable[..., Iterator[Any]]
    ) -> Iterator[Any]:
        """Yield the events and the recorded samples, ordered by slip.

        Only a rigid slider with one state variable is supported.
        """
        recording, events = MotionRecorder(sample_times=np.array(self.samples)), []
        for event in follow(recording=recording):
            if event.kind is EventKind.ALL_SAMPLES_RECORDED:
                break
            events.append(event)
        friction = (
            recording.as_table(scene)[:, MOTION_VARIABLE_NAMES.index("frictional_stress")]
            - scene.mu_star
        )
        events += [
            event._replace(slip=slip, point=equations.evaluate_motion_point((stress,)))
            for slip, stress in zip(self.samples, friction.tolist(), strict=True)
        ]
        return iter(sorted(events, key=lambda event: event.slip))


#: A direct effect larger than the default, because a rounding error of mu_* changes ln V by the
#: rounding error divided by ``a``.
CONSTANT = {"normal_stress": "constant", "a": 0.05}
VARIABLE = {"normal_stress": "variable", "phi": 75.0, "alpha": 0.3, "a": 0.05}
IMPOSED, DILATANT = {"normal_stress": "imposed", "a": 0.05}, {"fluid": "dilatant"}
LESS_DILATANT = {**DILATANT, "dilatancy": 1e-3}
SHEAR_HEATING = {"temperature": "shear_heating"}
WITH_INERTIA, WITH_LONG_PERIOD = {"inertia": True}, {"inertia": True, "period": 5e3}
DAMPING = {"radiation_damping": 1e-3}
STEP_UP = {"load_velocity_ratio": 2.0, "stiffness_ratio": 1.3}
UNSTABLE_STEP_UP = {"load_velocity_ratio": 2.0, "stiffness_ratio": 0.8}
WAVES = {
    "oscillation_period": 3.0,
    "oscillation_begin": 1.0,
    "oscillation_phase": 30.0,
    "oscillation_cycles": 1.25,
}
SINE = {"oscillation_amplitude": 0.05, "oscillation_period": 8.0, "load_velocity_ratio": 1.5}
RAMP = {"normal_stress_ramp": 0.1, "ramp_duration": 4.0, "load_velocity_ratio": 1.5}
REVERSED_LOADING = {
    "regularised": True,
    "mu_star": 0.6,
    "b_over_a": 1.5,
    "stiffness": 0.03,
    "load_velocity_ratio": 1.0,
}
#: A hold of the load point, velocity steps, a velocity ramp with three stairs, and two
#: protocols.
HOLD = {"hold_time": 30.0, "stiffness_ratio": 3.0}
STEPS = {"velocity_steps": 4, "velocity_ratio": 5.0, "displacement_between_steps": 1.0}
STAIRS = {"velocity_ramp": 2.0, "velocity_ramp_duration": 3.0, "velocity_ramp_stairs": 3}
VELOCITY_PROTOCOL = protocol(
    [
        {"velocity": 3.0, "distance": 4.0},
        {"velocity": 0.0, "duration": 5.0},
        {"velocity": 0.5, "duration": 3.0, "step": 1.0},
        {"velocity": 2.0},
    ],
    name="moves",
)
NORMAL_STRESS_PROTOCOL = protocol(
    [
        {"velocity": 1.0, "duration": 2.0, "normal_stress": 1.1},
        {"velocity": 1.5, "duration": 6.0, "normal_stress": 1.05},
        {"velocity": 1.5, "normal_stress": 1.0},
    ],
    name="presses",
)

#: Frozen motions by name. The combinations of parts match the combinations in ``test_compiled`` if
#: possible, so that both modules share compiled code.
MOTIONS: dict[str, Motion | Track] = {
    # Steps of load velocity, for each law.
    "slip": frozen_motion("slip", VARIABLE, STEP_UP),
    "slowness, down": frozen_motion(
        "slowness",
        VARIABLE,
        load_velocity_ratio=0.4,
        stiffness_ratio=1.3,
        watches=SLOWING_EVENTS,
        rtol=3e-8,
    ),
    "family": frozen_motion(
        "family",
        CONSTANT,
        STEP_UP,
        watches=(*USUAL_EVENTS, approach_to_steady_state(0.03, terminal=True)),
        rows=30,
    ),
    "perrin_rice_zheng": frozen_motion("perrin_rice_zheng", IMPOSED, STEP_UP, rtol=1e-6),
    "two slip states": frozen_motion(
        "two_slip_states",
        IMPOSED,
        load_velocity_ratio=2.0,
        stiffness_ratio=3.0,
        watches=(*USUAL_EVENTS, approach_to_steady_state(0.03, terminal=True)),
    ),
    "two slowness states": frozen_motion("two_slowness_states", VARIABLE, STEP_UP),
    "composite, dilatant": frozen_motion("composite", IMPOSED, DILATANT, STEP_UP, rtol=1e-8),
    "cut_off, dilatant": frozen_motion("cut_off", VARIABLE, DILATANT, STEP_UP),
    "slip, dilatant": frozen_motion(
        "slip", VARIABLE, DILATANT, STEP_UP, watches=(*EXTREMA, fall("normal_stress", 1.01))
    ),
    "slip, compaction, damped": frozen_motion(
        "slip",
        CONSTANT,
        DAMPING,
        STEP_UP,
        fluid="dilatant",
        dilatancy=-0.02,
        porosity_length=5.0,
        drainage=0.1,
    ),
    "slowness, dilatant, slips": frozen_motion(
        "slowness", CONSTANT, LESS_DILATANT, UNSTABLE_STEP_UP, rows=9
    ),
    # Heat.
    "flash heating": frozen_motion(
        "flash_heating", VARIABLE, STEP_UP, weakening_velocity_ratio=10.0, weakened_friction=0.5
    ),
    "slip, shear heating": frozen_motion(
        "slip",
        CONSTANT,
        SHEAR_HEATING,
        STEP_UP,
        direct_activation=0.5,
        evolution_activation=1.0,
        cooling=10.0,
    ),
    "slowness, thermal, damped": frozen_motion(
        "slowness", VARIABLE, SHEAR_HEATING, DAMPING, STEP_UP, fluid="thermal"
    ),
    # Noise of the loading.
    "slip, white noise, damped": frozen_motion(
        "slip",
        IMPOSED,
        DAMPING,
        STEP_UP,
        loading_noise="white",
        stress_noise=1e-4,
        normal_stress_noise=1e-4,
        noise_interval=0.25,
        noise_seed=3,
    ),
    "slowness, correlated noise, damped": frozen_motion(
        "slowness",
        CONSTANT,
        DAMPING,
        STEP_UP,
        loading_noise="correlated",
        stress_noise=1e-4,
        noise_interval=0.25,
        noise_seed=3,
    ),
    # Radiation damping, for each law.
    "slip, damped": frozen_motion("slip", CONSTANT, DAMPING, UNSTABLE_STEP_UP),
    "slowness, damped, dilatant": frozen_motion("slowness", IMPOSED, DILATANT, DAMPING, STEP_UP),
    "family, damped, dilatant": frozen_motion("family", IMPOSED, DILATANT, DAMPING, STEP_UP),
    "perrin_rice_zheng, damped": frozen_motion(
        "perrin_rice_zheng", VARIABLE, DAMPING, UNSTABLE_STEP_UP
    ),
    "composite, damped": frozen_motion("composite", VARIABLE, DAMPING, UNSTABLE_STEP_UP, rtol=1e-8),
    "cut_off, damped, dilatant": frozen_motion("cut_off", CONSTANT, DILATANT, DAMPING, STEP_UP),
    "two slip states, damped, dilatant": frozen_motion(
        "two_slip_states", VARIABLE, DILATANT, DAMPING, STEP_UP
    ),
    "two slowness states, damped": frozen_motion(
        "two_slowness_states", CONSTANT, DAMPING, UNSTABLE_STEP_UP
    ),
    # Ruptures with inertia, for each law.
    "slip, mass, dilatant": frozen_motion(
        "slip", IMPOSED, LESS_DILATANT, WITH_LONG_PERIOD, UNSTABLE_STEP_UP
    ),
    "slowness, mass": frozen_motion("slowness", VARIABLE, WITH_INERTIA, UNSTABLE_STEP_UP),
    "family, mass": frozen_motion("family", VARIABLE, WITH_INERTIA, UNSTABLE_STEP_UP, rows=4),
    "perrin_rice_zheng, mass, dilatant": frozen_motion(
        "perrin_rice_zheng", CONSTANT, LESS_DILATANT, WITH_LONG_PERIOD, UNSTABLE_STEP_UP, rows=6
    ),
    "composite, mass, dilatant": frozen_motion(
        "composite", CONSTANT, LESS_DILATANT, WITH_LONG_PERIOD, UNSTABLE_STEP_UP, rtol=1e-6
    ),
    "cut_off, mass": frozen_motion("cut_off", IMPOSED, WITH_INERTIA, UNSTABLE_STEP_UP),
    "two slip states, mass": frozen_motion(
        "two_slip_states",
        CONSTANT,
        WITH_LONG_PERIOD,
        UNSTABLE_STEP_UP,
        b1_over_a=1.5,
        b2_over_a=0.5,
        length_ratio=3.0,
    ),
    "two slowness states, mass, dilatant": frozen_motion(
        "two_slowness_states", IMPOSED, LESS_DILATANT, WITH_INERTIA, UNSTABLE_STEP_UP
    ),
    "slowness, mass that acts throughout": frozen_motion(
        "slowness",
        VARIABLE,
        WITH_INERTIA,
        STEP_UP,
        period=1.0,
        reference_rate=6.0,
        watches=ALL_EXTREMA,
        rtol=1e-8,
    ),
    # Stress-dependent state evolution, and reversed slip.
    "slip, stress dependence": frozen_motion("slip", CONSTANT, STEP_UP, stress_dependence=0.5),
    "composite, stress dependence": frozen_motion(
        "composite",
        VARIABLE,
        stress_dependence=2.0,
        load_velocity_ratio=2.0,
        stiffness_ratio=2.0,
        rows=5,
        rtol=1e-8,
    ),
    "perrin_rice_zheng, stress dependence, mass": frozen_motion(
        "perrin_rice_zheng",
        VARIABLE,
        WITH_INERTIA,
        UNSTABLE_STEP_UP,
        stress_dependence=1.0,
        period=50000.0,
        rtol=1e-8,
    ),
    "slip, reversed": frozen_motion(
        "slip", CONSTANT, REVERSED_LOADING, displacement_step=-30.0, watches=REVERSAL_EVENTS
    ),
    "slowness, reversed": frozen_motion(
        "slowness", VARIABLE, REVERSED_LOADING, displacement_step=-21.0, watches=REVERSAL_EVENTS
    ),
    # Other loadings, and another initial condition.
    "slip, displacement step": frozen_motion(
        "slip", VARIABLE, stiffness_ratio=1.25, displacement_step=0.8, watches=SLOWING_EVENTS
    ),
    "slowness, displacement step, mass": frozen_motion(
        "slowness",
        VARIABLE,
        WITH_INERTIA,
        stiffness_ratio=1.25,
        displacement_step=2.0,
        watches=SLOWING_EVENTS,
        until=100.0,
    ),
    "perrin_rice_zheng, normal stress step": frozen_motion(
        "perrin_rice_zheng",
        IMPOSED,
        stiffness_ratio=1.2,
        normal_stress_step=-0.01,
        watches=SLOWING_EVENTS,
    ),
    "two slowness states, normal stress step": frozen_motion(
        "two_slowness_states",
        VARIABLE,
        stiffness_ratio=1.5,
        normal_stress_step=0.05,
        load_velocity_ratio=1.0,
        watches=EXTREMA,
    ),
    "slip, hold": frozen_motion("slip", VARIABLE, DILATANT, HOLD, watches=EXTREMA, rows=10),
    "two slip states, hold": frozen_motion(
        "two_slip_states", IMPOSED, HOLD, watches=EXTREMA, until=60.0
    ),
    "family, velocity steps": frozen_motion(
        "family", CONSTANT, STEPS, stiffness_ratio=6.0, watches=EXTREMA, until=3.0, rows=20
    ),
    "slip, velocity ramp, mass": frozen_motion(
        "slip", IMPOSED, DILATANT, WITH_INERTIA, STAIRS, stiffness_ratio=1.5
    ),
    "two slowness states, protocol": frozen_motion(
        "two_slowness_states", VARIABLE, stiffness_ratio=2.0, loading=VELOCITY_PROTOCOL
    ),
    "perrin_rice_zheng, protocol": frozen_motion(
        "perrin_rice_zheng",
        IMPOSED,
        stiffness_ratio=2.0,
        loading=NORMAL_STRESS_PROTOCOL,
        watches=EXTREMA,
        rtol=1e-8,
    ),
    "slowness, begins elsewhere": frozen_motion(
        "slowness",
        VARIABLE,
        stiffness_ratio=1.5,
        initial_stress=0.02,
        initial_state=0.01,
        load_velocity_ratio=1.0,
        watches=EXTREMA,
    ),
    "slowness, oscillation": frozen_motion(
        "slowness", IMPOSED, SINE, stiffness_ratio=1.5, watches=ALL_EXTREMA, rows=4
    ),
    "slip, oscillation": frozen_motion(
        "slip", VARIABLE, SINE, stiffness_ratio=2.5, watches=ALL_EXTREMA, rows=8
    ),
    "slowness, train": frozen_motion(
        "slowness",
        IMPOSED,
        WAVES,
        stiffness_ratio=1.5,
        oscillation_amplitude=0.05,
        watches=FRICTION_EVENTS,
        rows=4,
    ),
    "slip, train of the load point": frozen_motion(
        "slip",
        VARIABLE,
        WAVES,
        stiffness_ratio=2.5,
        velocity_oscillation=0.5,
        watches=FRICTION_EVENTS,
        rows=4,
    ),
    "slip, ramp": frozen_motion(
        "slip", VARIABLE, RAMP, stiffness_ratio=2.0, watches=FRICTION_EVENTS
    ),
    "slowness, ramp": frozen_motion(
        "slowness", IMPOSED, RAMP, stiffness_ratio=1.5, watches=FRICTION_EVENTS, rtol=1e-6
    ),
    # Paths without time.
    "slip, path": Track(
        {"law": "slip", **VARIABLE, "load_velocity_ratio": 3.0, "stiffness_ratio": 1.2},
        (0.04, 0.01),
        (
            maximum("spring_stress"),
            rise("log_slip_rate", 1.5),
            fall("frictional_stress", 0.02),
            fall("psi", -0.01),
        ),
        rows=5,
    ),
    "slip, path backward": Track(
        {"law": "slip", **VARIABLE, "load_velocity_ratio": 3.0, "stiffness_ratio": 1.2},
        (0.046, -0.03),
        (
            maximum("spring_stress"),
            fall("log_slip_rate", -1.0),
            fall("frictional_stress", 0.02),
            rise("psi", -0.01),
        ),
        rows=5,
        backward=True,
    ),
    "slip, rigid": Track(
        {"law": "slip", **VARIABLE, "load_velocity_ratio": 10.0},
        (0.05,),
        (fall("frictional_stress", 0.03), fall("state", -0.1)),
        rows=6,
        samples=(0.0, 0.5, 1.0),
        log_slip_rate=math.log(10.0),
    ),
    # Motions that stop early.
    "slip, unbounded": frozen_motion("slip", CONSTANT, UNSTABLE_STEP_UP, stress_dependence=0.5),
    "family, budget spent": frozen_motion("family", CONSTANT, STEP_UP, budget=295),
    "perrin_rice_zheng, normal stress lost": frozen_motion(
        "perrin_rice_zheng",
        WITH_INERTIA,
        phi=37.13,
        mu_star=0.664,
        alpha=0.59,
        stress_dependence=1.0,
        period=1.04,
        a=0.022,
        b_over_a=1.58,
        stiffness_ratio=1.618,
        load_velocity_ratio=1.947,
        watches=(rise("log_slip_rate", 1.0),),
    ),
}
