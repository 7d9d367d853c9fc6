"""Motions whose events are kept: every law, slot, loading and end, by few rows each.

`gate.py` compares what two work trees tell of them, and `test_frozen_events.py` holds both engines
to `frozen_events.json`. None amplifies rounding: a last bit of any field moves no number by more
than a tenth of what the tests allow (`gate.py sensitivity` measures it).

What is asked of the package here is `follow`, `along` and what they take, because another tree than
this one answers too.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from rsfstudy import Scene, protocol
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import along, follow
from rsfstudy.motion.events import EventSpecification, Kind, fall, maximum, minimum, rise, settling
from rsfstudy.motion.recording import OBSERVED, Recording

try:
    from rsfstudy.motion.meter import Meter
except ImportError:  # in a tree of before
    from rsfstudy.motion.stepping import Meter
from rsfstudy.slider.equations import between_ruptures, rigid

#: Rows of a motion that are kept, and what those without end may cost.
ROWS, BUDGET = 12, 40_000


#: What most motions are asked for: extrema, and levels where nothing else happens.
EXTREMA = (
    maximum("log_slip_rate"),
    minimum("log_slip_rate"),
    maximum("spring_stress"),
    minimum("spring_stress"),
)
USUAL = (*EXTREMA, rise("log_slip_rate", 0.9), fall("log_slip_rate", 0.5))
#: Where the friction coefficient that is read has extrema of its own.
READ = maximum("reading"), minimum("reading"), maximum("log_slip_rate"), minimum("log_slip_rate")


class Motion(NamedTuple):
    """A scene that is followed with time.

    Attributes
    ----------
    fields : mapping
        Of the scene.
    watches : tuple of Watch
    until : float
        When to end, in D_c/V_*.
    rows : int
        Events after which not to go on.
    rtol : float
    budget : int
        Right-hand sides that it may cost.
    """

    fields: Mapping[str, Any]
    watches: tuple[EventSpecification, ...] = USUAL
    until: float = 40.0
    rows: int = ROWS
    rtol: float = 1e-7
    budget: int = BUDGET

    def events(self, scene: Scene, engine: str) -> Iterator[Any]:
        """What is told, one event after the other."""
        accuracy, meter = Accuracy(self.rtol, engine=engine), Meter(self.budget, engine=engine)
        return follow(scene, accuracy, meter, self.watches, clock=True, until=self.until)


class Track(NamedTuple):
    """A system of equations that is followed without time, forward or backward; of a rigid slider
    where a slip rate is prescribed.
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
        """What is told, one event after the other."""
        if self.log_slip_rate is None:
            equations = between_ruptures(scene, clock=False)
        else:
            equations = rigid(scene, self.log_slip_rate)
        meter, how = Meter(self.budget, engine=engine), {"backward": self.backward}
        asked = (equations, self.state, 0.07 * self.rtol, meter, self.watches)
        if not self.samples:
            return along(*asked, **how)
        if "samples" in inspect.signature(along).parameters:  # of another tree
            return along(*asked, **how, samples=self.samples)
        return self._recorded(scene, *asked, **how)

    def _recorded(self, scene: Scene, *asked: Any, **how: Any) -> Iterator[Any]:
        """The same, and the rows that are recorded of a rigid slider of one state, in their order;
        all told with the last of them.
        """
        recording, events = Recording(at=np.array(self.samples)), []
        for event in along(*asked, **how, recording=recording):
            if event.kind is Kind.SAMPLED:
                break
            events.append(event)
        friction = recording.seen(scene)[:, OBSERVED.index("frictional_stress")] - scene.mu_star
        events += [
            event._replace(slip=slip, point=asked[0].at((stress,)))
            for slip, stress in zip(self.samples, friction.tolist(), strict=True)
        ]
        return iter(sorted(events, key=lambda event: event.slip))


#: A direct effect three times the usual one: rounding of mu_* moves ln V by as much over a.
CONSTANT = {"normal_stress": "constant", "a": 0.05}
VARIABLE = {"normal_stress": "variable", "phi": 75.0, "alpha": 0.3, "a": 0.05}
IMPOSED, DILATANT = {"normal_stress": "imposed", "a": 0.05}, {"fluid": "dilatant"}
LESS_DILATANT = {**DILATANT, "dilatancy": 1e-3}
MASS, MORE_MASS = {"inertia": True}, {"inertia": True, "period": 5e3}
DAMPING = {"radiation_damping": 1e-3}
UP = {"load_velocity_ratio": 2.0, "stiffness_ratio": 1.3}
SLIPS = {"load_velocity_ratio": 2.0, "stiffness_ratio": 0.8}
WAVES = {
    "oscillation_period": 3.0,
    "oscillation_begin": 1.0,
    "oscillation_phase": 30.0,
    "oscillation_cycles": 1.25,
}
SINE = {"oscillation_amplitude": 0.05, "oscillation_period": 8.0, "load_velocity_ratio": 1.5}
RAMP = {"normal_stress_ramp": 0.1, "ramp_duration": 4.0, "load_velocity_ratio": 1.5}
BACK = {
    "regularised": True,
    "mu_star": 0.6,
    "b_over_a": 1.5,
    "stiffness": 0.03,
    "load_velocity_ratio": 1.0,
}
#: A load point that is held, moves in steps, in a ramp of three stairs, and by protocols.
HOLD = {"hold_time": 30.0, "stiffness_ratio": 3.0}
STEPS = {"velocity_steps": 4, "velocity_ratio": 5.0, "displacement_between_steps": 1.0}
STAIRS = {"velocity_ramp": 2.0, "velocity_ramp_duration": 3.0, "velocity_ramp_stairs": 3}
MOVES = protocol(
    [
        {"velocity": 3.0, "distance": 4.0},
        {"velocity": 0.0, "duration": 5.0},
        {"velocity": 0.5, "duration": 3.0, "step": 1.0},
        {"velocity": 2.0},
    ],
    name="moves",
)
PRESSES = protocol(
    [
        {"velocity": 1.0, "duration": 2.0, "normal_stress": 1.1},
        {"velocity": 1.5, "duration": 6.0, "normal_stress": 1.05},
        {"velocity": 1.5, "normal_stress": 1.0},
    ],
    name="presses",
)

#: By what they are called. Parts stand together as in `test_compiled`, where they can: what has
#: been compiled for one serves the other.
MOTIONS: dict[str, Motion | Track] = {
    # steps of rate: each law
    "slip": Motion({"law": "slip", **VARIABLE, **UP}),
    "slowness, down": Motion(
        {"law": "slowness", **VARIABLE, "load_velocity_ratio": 0.4, "stiffness_ratio": 1.3},
        (*EXTREMA, fall("log_slip_rate", -1.0)),
        rtol=3e-8,
    ),
    "family": Motion(
        {"law": "family", **CONSTANT, **UP}, (*USUAL, settling(0.03, ends=True)), rows=30
    ),
    "perrin_rice_zheng": Motion({"law": "perrin_rice_zheng", **IMPOSED, **UP}, rtol=1e-6),
    "two slip states": Motion(
        {"law": "two_slip_states", **IMPOSED, "load_velocity_ratio": 2.0, "stiffness_ratio": 3.0},
        (*USUAL, settling(0.03, ends=True)),
    ),
    "two slowness states": Motion({"law": "two_slowness_states", **VARIABLE, **UP}),
    "composite, dilatant": Motion({"law": "composite", **IMPOSED, **DILATANT, **UP}, rtol=1e-8),
    "cut_off, dilatant": Motion({"law": "cut_off", **VARIABLE, **DILATANT, **UP}),
    "slip, dilatant": Motion(
        {"law": "slip", **VARIABLE, **DILATANT, **UP}, (*EXTREMA, fall("normal_stress", 1.01))
    ),
    "slowness, dilatant, slips": Motion(
        {"law": "slowness", **CONSTANT, **LESS_DILATANT, **SLIPS}, rows=9
    ),
    # radiation damping: each law
    "slip, damped": Motion({"law": "slip", **CONSTANT, **DAMPING, **SLIPS}),
    "slowness, damped, dilatant": Motion(
        {"law": "slowness", **IMPOSED, **DILATANT, **DAMPING, **UP}
    ),
    "family, damped, dilatant": Motion({"law": "family", **IMPOSED, **DILATANT, **DAMPING, **UP}),
    "perrin_rice_zheng, damped": Motion(
        {"law": "perrin_rice_zheng", **VARIABLE, **DAMPING, **SLIPS}
    ),
    "composite, damped": Motion({"law": "composite", **VARIABLE, **DAMPING, **SLIPS}, rtol=1e-8),
    "cut_off, damped, dilatant": Motion(
        {"law": "cut_off", **CONSTANT, **DILATANT, **DAMPING, **UP}
    ),
    "two slip states, damped, dilatant": Motion(
        {"law": "two_slip_states", **VARIABLE, **DILATANT, **DAMPING, **UP}
    ),
    "two slowness states, damped": Motion(
        {"law": "two_slowness_states", **CONSTANT, **DAMPING, **SLIPS}
    ),
    # ruptures with mass: each law
    "slip, mass, dilatant": Motion(
        {"law": "slip", **IMPOSED, **LESS_DILATANT, **MORE_MASS, **SLIPS}
    ),
    "slowness, mass": Motion({"law": "slowness", **VARIABLE, **MASS, **SLIPS}),
    "family, mass": Motion({"law": "family", **VARIABLE, **MASS, **SLIPS}, rows=4),
    "perrin_rice_zheng, mass, dilatant": Motion(
        {"law": "perrin_rice_zheng", **CONSTANT, **LESS_DILATANT, **MORE_MASS, **SLIPS}, rows=6
    ),
    "composite, mass, dilatant": Motion(
        {"law": "composite", **CONSTANT, **LESS_DILATANT, **MORE_MASS, **SLIPS}, rtol=1e-6
    ),
    "cut_off, mass": Motion({"law": "cut_off", **IMPOSED, **MASS, **SLIPS}),
    "two slip states, mass": Motion(
        {
            "law": "two_slip_states",
            **CONSTANT,
            **MORE_MASS,
            **SLIPS,
            "b1_over_a": 1.5,
            "b2_over_a": 0.5,
            "length_ratio": 3.0,
        },
    ),
    "two slowness states, mass, dilatant": Motion(
        {"law": "two_slowness_states", **IMPOSED, **LESS_DILATANT, **MASS, **SLIPS}
    ),
    "slowness, mass that acts throughout": Motion(
        {
            "law": "slowness",
            **VARIABLE,
            **MASS,
            **UP,
            "period": 1.0,
            "reference_rate": 6.0,
        },
        (*READ, *EXTREMA[2:]),
        rtol=1e-8,
    ),
    # stress that acts on the state; slip that reverses
    "slip, stress dependence": Motion({"law": "slip", **CONSTANT, "stress_dependence": 0.5, **UP}),
    "composite, stress dependence": Motion(
        {
            "law": "composite",
            **VARIABLE,
            "stress_dependence": 2.0,
            "load_velocity_ratio": 2.0,
            "stiffness_ratio": 2.0,
        },
        rows=5,
        rtol=1e-8,
    ),
    "perrin_rice_zheng, stress dependence, mass": Motion(
        {
            "law": "perrin_rice_zheng",
            **VARIABLE,
            "stress_dependence": 1.0,
            **MASS,
            **SLIPS,
            "period": 5e4,
        },
        rtol=1e-8,
    ),
    "slip, reversed": Motion(
        {"law": "slip", **CONSTANT, **BACK, "displacement_step": -30.0},
        (*EXTREMA[2:], rise("friction", -0.5), rise("state", 0.01)),
    ),
    "slowness, reversed": Motion(
        {"law": "slowness", **VARIABLE, **BACK, "displacement_step": -21.0},
        (*EXTREMA[2:], rise("friction", -0.5), rise("state", 0.01)),
    ),
    # other loadings, and another beginning
    "slip, displacement step": Motion(
        {"law": "slip", **VARIABLE, "stiffness_ratio": 1.25, "displacement_step": 0.8},
        (*EXTREMA, fall("log_slip_rate", -1.0)),
    ),
    "slowness, displacement step, mass": Motion(
        {"law": "slowness", **VARIABLE, **MASS, "stiffness_ratio": 1.25, "displacement_step": 2.0},
        (*EXTREMA, fall("log_slip_rate", -1.0)),
        until=100.0,
    ),
    "perrin_rice_zheng, normal stress step": Motion(
        {
            "law": "perrin_rice_zheng",
            **IMPOSED,
            "stiffness_ratio": 1.2,
            "normal_stress_step": -0.01,
        },
        (*EXTREMA, fall("log_slip_rate", -1.0)),
    ),
    "two slowness states, normal stress step": Motion(
        {
            "law": "two_slowness_states",
            **VARIABLE,
            "stiffness_ratio": 1.5,
            "normal_stress_step": 0.05,
            "load_velocity_ratio": 1.0,
        },
        EXTREMA,
    ),
    "slip, hold": Motion({"law": "slip", **VARIABLE, **DILATANT, **HOLD}, EXTREMA, rows=10),
    "two slip states, hold": Motion(
        {"law": "two_slip_states", **IMPOSED, **HOLD}, EXTREMA, until=60.0
    ),
    "family, velocity steps": Motion(
        {"law": "family", **CONSTANT, "stiffness_ratio": 6.0, **STEPS}, EXTREMA, until=3.0, rows=20
    ),
    "slip, velocity ramp, mass": Motion(
        {"law": "slip", **IMPOSED, **DILATANT, **MASS, "stiffness_ratio": 1.5, **STAIRS}
    ),
    "two slowness states, protocol": Motion(
        {"law": "two_slowness_states", **VARIABLE, "stiffness_ratio": 2.0, "loading": MOVES}
    ),
    "perrin_rice_zheng, protocol": Motion(
        {"law": "perrin_rice_zheng", **IMPOSED, "stiffness_ratio": 2.0, "loading": PRESSES},
        EXTREMA,
        rtol=1e-8,
    ),
    "slowness, begins elsewhere": Motion(
        {
            "law": "slowness",
            **VARIABLE,
            "stiffness_ratio": 1.5,
            "initial_stress": 0.02,
            "initial_state": 0.01,
            "load_velocity_ratio": 1.0,
        },
        EXTREMA,
    ),
    "slowness, oscillation": Motion(
        {"law": "slowness", **IMPOSED, "stiffness_ratio": 1.5, **SINE},
        (*READ, *EXTREMA[2:]),
        rows=4,
    ),
    "slip, oscillation": Motion(
        {"law": "slip", **VARIABLE, "stiffness_ratio": 2.5, **SINE}, (*READ, *EXTREMA[2:]), rows=8
    ),
    "slowness, train": Motion(
        {
            "law": "slowness",
            **IMPOSED,
            "stiffness_ratio": 1.5,
            "oscillation_amplitude": 0.05,
            **WAVES,
        },
        READ,
        rows=4,
    ),
    "slip, train of the load point": Motion(
        {"law": "slip", **VARIABLE, "stiffness_ratio": 2.5, "velocity_oscillation": 0.5, **WAVES},
        READ,
        rows=4,
    ),
    "slip, ramp": Motion({"law": "slip", **VARIABLE, "stiffness_ratio": 2.0, **RAMP}, READ),
    "slowness, ramp": Motion(
        {"law": "slowness", **IMPOSED, "stiffness_ratio": 1.5, **RAMP}, READ, rtol=1e-6
    ),
    # without time
    "slip, path": Track(
        {"law": "slip", **VARIABLE, "load_velocity_ratio": 3.0, "stiffness_ratio": 1.2},
        (0.04, 0.01),
        (
            maximum("spring_stress"),
            rise("log_slip_rate", 1.5),
            fall("friction", 0.02),
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
            fall("friction", 0.02),
            rise("psi", -0.01),
        ),
        rows=5,
        backward=True,
    ),
    "slip, rigid": Track(
        {"law": "slip", **VARIABLE, "load_velocity_ratio": 10.0},
        (0.05,),
        (fall("friction", 0.03), fall("state", -0.1)),
        rows=6,
        samples=(0.0, 0.5, 1.0),
        log_slip_rate=math.log(10.0),
    ),
    # motions that cannot go on
    "slip, unbounded": Motion({"law": "slip", **CONSTANT, "stress_dependence": 0.5, **SLIPS}),
    "family, budget spent": Motion({"law": "family", **CONSTANT, **UP}, budget=295),
    "perrin_rice_zheng, normal stress lost": Motion(
        {
            "law": "perrin_rice_zheng",
            "phi": 37.13,
            "mu_star": 0.664,
            "alpha": 0.59,
            "stress_dependence": 1.0,
            **MASS,
            "period": 1.04,
            "a": 0.022,
            "b_over_a": 1.58,
            "stiffness_ratio": 1.618,
            "load_velocity_ratio": 1.947,
        },
        (rise("log_slip_rate", 1.0),),
    ),
}
