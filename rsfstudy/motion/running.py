"""Runs the loop of motions, and makes events of the tables that it fills."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from rsfstudy.motion import layout, workspace
from rsfstudy.motion.columns import filling
from rsfstudy.motion.engines import COMPILED, compiled_engine, stepper_of
from rsfstudy.motion.events import Event, EventSpecification, Kind
from rsfstudy.motion.handover import NO_MASS, Limits, halted
from rsfstudy.motion.loop import advance
from rsfstudy.motion.meter import TIGHTEST, TOLERANCE_OF_STRIDES, Halt, Meter
from rsfstudy.motion.recording import SAMPLES, STATES, STRESSES, Recording
from rsfstudy.motion.within_steps import BEFORE, NOWHERE, between
from rsfstudy.slider.derived import once
from rsfstudy.slider.equations import Equations, between_ruptures, in_rupture
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.places import RELIEF
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Rows of the tables of events and of recordings that one call may fill.
_EVENTS, _RECORDED = 64, 4096
_KINDS = {kind: layout.__dict__[kind.name] for kind in Kind if kind.name in layout.__dict__}
#: Columns of a point, by the names of its numbers; what is asked of none reads the first.
_COLUMNS = {name: column for column, name in enumerate(Point._fields[:-1])} | {"": 0}
#: What is told beside what was asked for: the codes of these count from the end.
_BESIDE = [(k, None) for k in (Kind.SEGMENT, Kind.SAMPLED, Kind.END, Kind.REGIME, Kind.START)]
#: Makes a named tuple of a tuple, in half the time that its name takes.
_named = tuple.__new__
_TOO_SHORT = "a step would be shorter than the spacing of numbers around the clock"
_NOTHING = layout.NEVER, np.empty(0), np.empty((0, STATES))
_NO_KINKS = np.empty((0, RELIEF + 1)), 0


class Plain:
    """The loop as it stands, and its arguments; `compiled.machine.Compiled` is the other machine
    that runs it.
    """

    def initial(self, fields: tuple[tuple[str, float], ...]) -> dict[str, float]:
        """Initial state of motions that have these numbers in their state, and others 0."""
        return {**dict.fromkeys(layout.MOTION.names or (), 0), **dict(fields)}

    def state(self, initial: dict[str, float], called_with: tuple[float, ...]) -> PlainState:
        """The state of a motion: its `memory`, and what it `says` of itself."""
        called = zip(layout.CALLED_WITH_FIELDS, called_with, strict=True)
        return PlainState(**{**initial, **dict(called)})

    def table(self, systems: tuple[Equations, ...]) -> np.ndarray:
        """The table of functions of the regimes."""
        rows = np.zeros((2, layout.FUNCTIONS), dtype=object)
        for row, system in zip(rows, systems, strict=False):
            row[:] = filling(system)
        rows[layout.FAST, -1] = rows[layout.SLOW, -1]
        return rows

    def passed(self, *arrays: np.ndarray) -> Sequence[memoryview]:
        """Arrays as the loop takes them."""
        return [memoryview(array) for array in arrays]  # type: ignore[arg-type]

    def numbers(self, p: Sequence[float]) -> Any:
        """The numbers of a scene as the loop takes them."""
        return list(p)

    def advance(self) -> Any:
        """The loop."""
        return advance


class PlainState(SimpleNamespace):
    """The state of a motion in plain Python."""

    @property
    def memory(self) -> list[PlainState]:
        """The state as the loop takes it."""
        return [self]

    def says(self) -> tuple[int, ...]:
        """Right-hand sides by regime, steps, events, rows, and Jacobians."""
        return (
            *(self.spent_slow, self.spent_fast, self.steps),
            *(self.events, self.recorded, self.jacobians),
        )

    def field(self, name: str) -> float:
        """One of its fields."""
        return float(getattr(self, name))


class Runner:
    """Runs motions by the same equations, which may differ in their numbers and beginnings.

    Parameters
    ----------
    slow : Equations
        The equations, or those between ruptures.
    fast : Equations, optional
        Those in ruptures.
    engine : str
    fields : float
        Fields of the state of a motion (`layout.MOTION`) in which such motions differ from others.
    """

    def __init__(
        self,
        slow: Equations,
        fast: Equations | None = None,
        *,
        engine: str,
        **fields: float,
    ) -> None:
        self._systems: tuple[Equations, ...] = (slow,) if fast is None else (slow, fast)
        self._machine = compiled_engine().Compiled() if engine == COMPILED else Plain()
        self._states, unknowns = slow.states, [len(system.unknowns) for system in self._systems]
        self._unknowns = max(unknowns)
        scales = np.array([scale for system in self._systems for scale in system.scales])
        self._called = *self._machine.passed(scales), self._machine.table(self._systems)
        self._p = self._machine.numbers(slow.p)
        self._regimes = [system.regime for system in self._systems]
        fields |= {
            "begins": layout.BEGIN,
            "limits_steps": not slow.is_rigid,
            "slip_is_clock": slow.is_rigid,
            "unknowns": unknowns[0],
            "states": slow.states,
            "unknowns_fast": sum(unknowns[1:]),
            "has_mass": fast is not None,
        }
        self._initial = self._machine.initial(tuple(fields.items()))

    def run(
        self,
        start: Point | Numbers,
        meter: Meter,
        specs: Sequence[EventSpecification],
        tolerance: float,
        *,
        times: tuple[float, float, float] = (math.inf, 0.0, 0.0),
        backward: bool = False,
        p: Numbers | None = None,
        between: Limits = NO_MASS,
        budget: float = math.inf,
        recording: Recording | None = None,
        kinks: tuple[np.ndarray, int] = _NO_KINKS,
        imposed: float | None = None,
    ) -> Iterator[Event]:
        """Events of a motion, a table of them by each call of the loop.

        Parameters
        ----------
        start : Point or tuple of float
            Where it begins: a point, whose regime is found, or the unknowns.
        meter : Meter
            Charged with the work.
        specs : sequence of EventSpecification
        tolerance : float
            Local error per step.
        times : tuple of float
            How long it lasts, and time and slip where it begins.
        backward : bool
            Run against the clock of the equations.
        p : tuple of float, optional
            Other numbers than those of the equations.
        between : Limits
            When to change between the regimes.
        budget : float
            Right-hand sides it may spend, if fewer than the meter leaves.
        recording : Recording, optional
        kinks : tuple of ndarray and int
            Those of the loading, and how many of the last ones are reported.
        imposed : float, optional
            Where the load point moves to and fro, shear stress that this adds when the last unknown
            is zero: while steps are taken, stresses are without what it adds, told with it.

        Raises
        ------
        Halt
            Where it cannot go on.
        """
        machine, states, systems, numbers = self._machine, self._states, self._systems, self._p
        before, turns = numbers, len(kinks[0])
        if isinstance(start, Point):
            start = start if imposed is None else _pushed(start, imposed - start.psis[-1])
            y, last, stress = np.empty(2 * self._unknowns), _columns_of(start), start.spring_stress
        else:  # behind the unknowns is room for as many
            y, last, stress = np.array((*start, *start)), np.empty(layout.PSIS + states), 0.0
        if p is not None or turns:  # numbers that are those of this motion alone
            before = numbers = machine.numbers(systems[0].p if p is None else p)
            if turns:
                before = machine.numbers(numbers)
            systems = tuple(system._replace(p=numbers) for system in systems)
        tolerance = max(tolerance, TIGHTEST)
        records, samples, rows = _to_record(recording, systems[0], states)
        state = machine.state(
            self._initial,
            (
                *(*times, stress, tolerance),
                # what limits a step must differ between two tolerances whose results tell errors
                (tolerance / TOLERANCE_OF_STRIDES) ** 0.125,
                -1.0 if backward else 1.0,
                int(min(budget, meter.budget - meter.spent)),
                *(records, turns, kinks[1]),
            ),
        )
        asked, meanings = _asked(tuple(specs))
        stepper = stepper_of(meter.engine, systems, meter.methods)
        columns = layout.POINT + layout.PSIS + states
        events = np.empty((max(_EVENTS, 2 * len(specs) + 4), columns))
        block = np.empty(workspace.size(self._unknowns, states, len(specs)))
        arguments = (
            *machine.passed(y, last, block),
            (*self._called, tuple(between), numbers, before),
            *machine.passed(asked.copy(), kinks[0], samples, events, rows),
            stepper,
        )
        regimes, psis = self._regimes, layout.POINT + layout.PSIS
        run, end, known = machine.advance(), layout.PAUSES, (0, 0, 0, 0)
        while end == layout.PAUSES:
            end = run(state.memory, *arguments)
            slow, fast, steps, happened, recorded, jacobians = state.says()
            known, settled = (slow, fast, steps, jacobians), known
            others = meter.settle(regimes, settled, known)
            if recording is not None and recorded:
                kept = rows[:recorded].copy(order="F")  # columns are what is asked for
                if imposed is not None:
                    kept[:, STRESSES] += kept[:, -1:] - imposed
                recording.take(kept, regimes)
            for line in events[:happened].tolist():
                code, regime, clock, time, slip, spent = line[: layout.POINT]
                point = _named(Point, (*line[layout.POINT : psis], tuple(line[psis:])))
                if imposed is not None:
                    point = _pushed(point, point.psis[-1] - imposed)
                kind, spec = meanings[int(code)]
                name, work = regimes[int(regime)], others + int(spent)
                yield _named(Event, (kind, spec, time, slip, point, name, work, clock))
            meter.check()
        if end != layout.ENDED:
            raise _halt(end, state, regimes, stepper)


def _pushed(point: Point, by: float) -> Point:
    return point._replace(spring_stress=point.spring_stress + by, friction=point.friction + by)


def along(
    equations: Equations,
    state: Numbers,
    tolerance: float,
    meter: Meter,
    specs: Sequence[EventSpecification] = (),
    *,
    backward: bool = False,
    recording: Recording | None = None,
) -> Iterator[Event]:
    """Events along one system of equations from a state; against its clock if `backward`.

    A rigid slider has slip for its clock: a recording that asks for values has them at slips.
    """
    runner = Runner(equations, engine=meter.engine)
    return runner.run(state, meter, specs, tolerance, backward=backward, recording=recording)


@once
def runner_of(scene: Scene, engine: str, *, clock: bool) -> Runner:
    """What runs the motions of a scene."""
    return Runner(
        between_ruptures(scene, clock=clock),
        in_rupture(scene, clock=clock) if scene.has_mass else None,
        engine=engine,
        behind=len(scene.parts.fluid.unknowns) if scene.parts.loading.unknowns else 0,
        reverses=scene.parts.law.regularised,
        at_point=1,
        terminates=1,
        has_clock=clock,
    )


def _to_record(
    recording: Recording | None, system: Equations, states: int
) -> tuple[int, np.ndarray, np.ndarray]:
    """Whether a chain of segments records, and when; the times or clocks at which to; and the table
    that the loop fills.
    """
    if recording is None:
        return _NOTHING
    if recording.at is None:
        return layout.WITHIN_STEPS, np.empty(0), np.empty((_RECORDED, STATES + states))
    samples = recording.left()
    rows = np.empty((len(samples) + 2 * SAMPLES, STATES + states))
    return layout.AT_CLOCKS if system.is_rigid else layout.AT_TIMES, samples, rows


def happening(
    before: Point,
    p_before: Numbers,
    after: Point,
    p_after: Numbers,
    specs: Sequence[EventSpecification],
) -> Iterator[tuple[EventSpecification, Point]]:
    """Events that are watched for and happen where a motion jumps from a point to another, with the
    numbers of the scene at both; and at which of them.
    """
    last, first = _columns_of(before).tolist(), _columns_of(after).tolist()
    table = _asked(tuple(specs))[0].reshape(-1, len(layout.SPECIFIED)).tolist()
    for spec, row in zip(specs, table, strict=True):
        where = between(row, last, p_before, first, p_after)
        if where != NOWHERE:
            yield spec, before if where == BEFORE else after


@lru_cache(maxsize=256)
def _asked(
    specs: tuple[EventSpecification, ...],
) -> tuple[np.ndarray, list[tuple[Kind, EventSpecification | None]]]:
    """The table of event specifications, and what codes of events mean."""
    meanings = [*((spec.kind, spec) for spec in specs), *_BESIDE]
    asked = np.zeros((len(specs), len(layout.SPECIFIED)))
    for row, spec in zip(asked, specs, strict=True):
        row[layout.KIND], row[layout.OF] = _KINDS[spec.kind], _COLUMNS[spec.of]
        row[layout.LEVEL], row[layout.ENDS] = spec.level, spec.ends
        row[layout.WAITS] = spec.waits
    return asked.ravel(), meanings


def _columns_of(point: Point) -> np.ndarray:
    """A point as the loop has it."""
    return np.array((*point[:-1], *point.psis))


def _halt(end: int, state: Any, regimes: Sequence[str], stepper: Any) -> Halt:
    """Why a motion cannot go on."""
    if end == layout.HALTED:
        return halted(int(state.field("termination")), state.field("stress"))
    why = "step without length, or a state that is not finite"
    if end == layout.NO_STEP:
        why = stepper.failure if stepper else _TOO_SHORT
    return Halt(Status.INTEGRATION_FAILED, f"{regimes[int(state.field('regime'))]}: {why}")
