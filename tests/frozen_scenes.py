"""Motions whose events are kept: every law, slot, loading and end, by few rows each.

`test_frozen_events.py` holds all engines to `frozen_events.json`. None amplifies rounding: a last
bit of any field moves no number by more than a tenth of what the tests allow (`python
tests/telling.py sensitivity` measures it).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from rsfstudy import Scene, protocol
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.course import along, follow
from rsfstudy.motion.events import EventSpecification, Kind, fall, maximum, minimum, rise, settling
from rsfstudy.motion.meter import Meter
from rsfstudy.motion.recording import OBSERVED, Recording
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
BOTH, SLOWING = (*READ, *EXTREMA[2:]), (*EXTREMA, fall("log_slip_rate", -1.0))
REVERSING = (*EXTREMA[2:], rise("friction", -0.5), rise("state", 0.01))


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


def motion(law: str, *parts: Mapping[str, Any], **stated: Any) -> Motion:
    """A motion of a law, with the fields of parts, fields of its own, and what a motion states."""
    own = {name: stated.pop(name) for name in Motion._fields if name in stated}
    fields = {"law": law}
    for part in parts:
        fields |= part
    return Motion(fields | stated, **own)


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
    "slip": motion("slip", VARIABLE, UP),
    "slowness, down": motion("slowness", VARIABLE, load_velocity_ratio=0.4, stiffness_ratio=1.3,
        watches=SLOWING, rtol=3e-8),
    "family": motion("family", CONSTANT, UP, watches=(*USUAL, settling(0.03, ends=True)), rows=30),
    "perrin_rice_zheng": motion("perrin_rice_zheng", IMPOSED, UP, rtol=1e-6),
    "two slip states": motion("two_slip_states", IMPOSED, load_velocity_ratio=2.0,
        stiffness_ratio=3.0, watches=(*USUAL, settling(0.03, ends=True))),
    "two slowness states": motion("two_slowness_states", VARIABLE, UP),
    "composite, dilatant": motion("composite", IMPOSED, DILATANT, UP, rtol=1e-8),
    "cut_off, dilatant": motion("cut_off", VARIABLE, DILATANT, UP),
    "slip, dilatant": motion("slip", VARIABLE, DILATANT, UP, watches=(*EXTREMA,
        fall("normal_stress", 1.01))),
    "slowness, dilatant, slips": motion("slowness", CONSTANT, LESS_DILATANT, SLIPS, rows=9),
    # radiation damping: each law
    "slip, damped": motion("slip", CONSTANT, DAMPING, SLIPS),
    "slowness, damped, dilatant": motion("slowness", IMPOSED, DILATANT, DAMPING, UP),
    "family, damped, dilatant": motion("family", IMPOSED, DILATANT, DAMPING, UP),
    "perrin_rice_zheng, damped": motion("perrin_rice_zheng", VARIABLE, DAMPING, SLIPS),
    "composite, damped": motion("composite", VARIABLE, DAMPING, SLIPS, rtol=1e-8),
    "cut_off, damped, dilatant": motion("cut_off", CONSTANT, DILATANT, DAMPING, UP),
    "two slip states, damped, dilatant": motion("two_slip_states", VARIABLE, DILATANT, DAMPING, UP),
    "two slowness states, damped": motion("two_slowness_states", CONSTANT, DAMPING, SLIPS),
    # ruptures with mass: each law
    "slip, mass, dilatant": motion("slip", IMPOSED, LESS_DILATANT, MORE_MASS, SLIPS),
    "slowness, mass": motion("slowness", VARIABLE, MASS, SLIPS),
    "family, mass": motion("family", VARIABLE, MASS, SLIPS, rows=4),
    "perrin_rice_zheng, mass, dilatant": motion("perrin_rice_zheng", CONSTANT, LESS_DILATANT,
        MORE_MASS, SLIPS, rows=6),
    "composite, mass, dilatant": motion("composite", CONSTANT, LESS_DILATANT, MORE_MASS, SLIPS,
        rtol=1e-6),
    "cut_off, mass": motion("cut_off", IMPOSED, MASS, SLIPS),
    "two slip states, mass": motion("two_slip_states", CONSTANT, MORE_MASS, SLIPS, b1_over_a=1.5,
        b2_over_a=0.5, length_ratio=3.0),
    "two slowness states, mass, dilatant": motion("two_slowness_states", IMPOSED, LESS_DILATANT,
        MASS, SLIPS),
    "slowness, mass that acts throughout": motion("slowness", VARIABLE, MASS, UP, period=1.0,
        reference_rate=6.0, watches=BOTH, rtol=1e-8),
    # stress that acts on the state; slip that reverses
    "slip, stress dependence": motion("slip", CONSTANT, UP, stress_dependence=0.5),
    "composite, stress dependence": motion("composite", VARIABLE, stress_dependence=2.0,
        load_velocity_ratio=2.0, stiffness_ratio=2.0, rows=5, rtol=1e-8),
    "perrin_rice_zheng, stress dependence, mass": motion("perrin_rice_zheng", VARIABLE, MASS, SLIPS,
        stress_dependence=1.0, period=50000.0, rtol=1e-8),
    "slip, reversed": motion("slip", CONSTANT, BACK, displacement_step=-30.0, watches=REVERSING),
    "slowness, reversed": motion("slowness", VARIABLE, BACK, displacement_step=-21.0,
        watches=REVERSING),
    # other loadings, and another beginning
    "slip, displacement step": motion("slip", VARIABLE, stiffness_ratio=1.25, displacement_step=0.8,
        watches=SLOWING),
    "slowness, displacement step, mass": motion("slowness", VARIABLE, MASS, stiffness_ratio=1.25,
        displacement_step=2.0, watches=SLOWING, until=100.0),
    "perrin_rice_zheng, normal stress step": motion("perrin_rice_zheng", IMPOSED,
        stiffness_ratio=1.2, normal_stress_step=-0.01, watches=SLOWING),
    "two slowness states, normal stress step": motion("two_slowness_states", VARIABLE,
        stiffness_ratio=1.5, normal_stress_step=0.05, load_velocity_ratio=1.0, watches=EXTREMA),
    "slip, hold": motion("slip", VARIABLE, DILATANT, HOLD, watches=EXTREMA, rows=10),
    "two slip states, hold": motion("two_slip_states", IMPOSED, HOLD, watches=EXTREMA, until=60.0),
    "family, velocity steps": motion("family", CONSTANT, STEPS, stiffness_ratio=6.0,
        watches=EXTREMA, until=3.0, rows=20),
    "slip, velocity ramp, mass": motion("slip", IMPOSED, DILATANT, MASS, STAIRS,
        stiffness_ratio=1.5),
    "two slowness states, protocol": motion("two_slowness_states", VARIABLE, stiffness_ratio=2.0,
        loading=MOVES),
    "perrin_rice_zheng, protocol": motion("perrin_rice_zheng", IMPOSED, stiffness_ratio=2.0,
        loading=PRESSES, watches=EXTREMA, rtol=1e-8),
    "slowness, begins elsewhere": motion("slowness", VARIABLE, stiffness_ratio=1.5,
        initial_stress=0.02, initial_state=0.01, load_velocity_ratio=1.0, watches=EXTREMA),
    "slowness, oscillation": motion("slowness", IMPOSED, SINE, stiffness_ratio=1.5, watches=BOTH,
        rows=4),
    "slip, oscillation": motion("slip", VARIABLE, SINE, stiffness_ratio=2.5, watches=BOTH, rows=8),
    "slowness, train": motion("slowness", IMPOSED, WAVES, stiffness_ratio=1.5,
        oscillation_amplitude=0.05, watches=READ, rows=4),
    "slip, train of the load point": motion("slip", VARIABLE, WAVES, stiffness_ratio=2.5,
        velocity_oscillation=0.5, watches=READ, rows=4),
    "slip, ramp": motion("slip", VARIABLE, RAMP, stiffness_ratio=2.0, watches=READ),
    "slowness, ramp": motion("slowness", IMPOSED, RAMP, stiffness_ratio=1.5, watches=READ,
        rtol=1e-6),
    # without time
    "slip, path": Track({"law": "slip", **VARIABLE, "load_velocity_ratio": 3.0,
        "stiffness_ratio": 1.2}, (0.04, 0.01), (maximum("spring_stress"), rise("log_slip_rate",
        1.5), fall("friction", 0.02), fall("psi", -0.01)), rows=5),
    "slip, path backward": Track({"law": "slip", **VARIABLE, "load_velocity_ratio": 3.0,
        "stiffness_ratio": 1.2}, (0.046, -0.03), (maximum("spring_stress"), fall("log_slip_rate",
        -1.0), fall("friction", 0.02), rise("psi", -0.01)), rows=5, backward=True),
    "slip, rigid": Track({"law": "slip", **VARIABLE, "load_velocity_ratio": 10.0}, (0.05,),
        (fall("friction", 0.03), fall("state", -0.1)), rows=6, samples=(0.0, 0.5, 1.0),
        log_slip_rate=math.log(10.0)),
    # motions that cannot go on
    "slip, unbounded": motion("slip", CONSTANT, SLIPS, stress_dependence=0.5),
    "family, budget spent": motion("family", CONSTANT, UP, budget=295),
    "perrin_rice_zheng, normal stress lost": motion("perrin_rice_zheng", MASS, phi=37.13,
        mu_star=0.664, alpha=0.59, stress_dependence=1.0, period=1.04, a=0.022, b_over_a=1.58,
        stiffness_ratio=1.618, load_velocity_ratio=1.947, watches=(rise("log_slip_rate", 1.0),)),
}  # fmt: skip
