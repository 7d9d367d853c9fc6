"""Events of compiled motions, as those of other engines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.compiled import machine, room, table
from rsfstudy.motion.events import Event, Kind, Watch
from rsfstudy.motion.handover import Limits
from rsfstudy.motion.recording import REGIME, STATES, Recording
from rsfstudy.motion.regimes import Regimes, halted
from rsfstudy.motion.regimes import regimes as regimes_of
from rsfstudy.motion.stepping import TIGHTEST, TOLERANCE_OF_STRIDES, Halt, Meter
from rsfstudy.slider.equations import RIGID, Equations, between_ruptures, in_rupture, without_mass
from rsfstudy.slider.forms import Point
from rsfstudy.slider.parts import Numbers
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status

#: Rows of the tables of events and of recordings that one call may fill.
_EVENTS, _RECORDED = 64, 4096
_KINDS = {
    Kind.MAXIMUM: table.MAXIMUM,
    Kind.MINIMUM: table.MINIMUM,
    Kind.RISE: table.RISE,
    Kind.FALL: table.FALL,
    Kind.SETTLED: table.SETTLED,
}
_COLUMNS = {
    "log_rate": table.LOG_RATE,
    "growth": table.GROWTH,
    "spring": table.SPRING,
    "friction": table.FRICTION,
    "psi": table.PSI,
    "state": table.STATE,
    "imbalance": table.IMBALANCE,
    "unrest": table.UNREST,
    "coefficient": table.COEFFICIENT,
    "normal_stress": table.RATIO,
    "reading": table.READING,
    "": 0,
}
#: What is told beside what was asked for: the codes of these count from the end.
_SAMPLE = Kind.SAMPLE, None
_BESIDE = [(Kind.END, None), (Kind.REGIME, None), (Kind.START, None)]
#: Where the states of a point begin in a line of the table of events; and where the numbers of a
#: `Point` are that come before its states, and behind them.
_OF_STATES = table.POINT + table.PSIS
_BEFORE = slice(table.POINT, table.POINT + Point._fields.index("psis"))
_BEHIND = slice(_BEFORE.stop, _OF_STATES)
#: Makes a named tuple of a tuple, in half the time that its name takes.
_named = tuple.__new__
_NO_MASS = (math.nan,) * len(Limits._fields)
#: How segments of loading are followed.
_OF_SEGMENTS = ("at_point", 1), ("ends_by_fate", 1), ("strides", 1)
#: How long paths last that have no time, and where they begin.
_FOR_EVER = math.inf, 0.0, 0.0, 0.0


class _Plan(NamedTuple):
    """What all motions by the same equations begin and are called with.

    Attributes
    ----------
    memory : bytes
        What they remember at first, one NOW.
    scales, functions : ndarray
        Scales of the unknowns of all regimes, and addresses of the equations of each.
    limits : tuple of float
    p : ndarray
        The numbers of the scene.
    regimes : tuple of str
        Names of those they go through.
    unknowns : int
        The most that a regime has.
    """

    memory: bytes
    scales: np.ndarray
    functions: np.ndarray
    limits: Numbers
    p: np.ndarray
    regimes: tuple[str, ...]
    unknowns: int


def prepare(scene: Scene, *, clock: bool) -> None:
    """Compile what motions of such a scene need, with time or without it, or find it in the cache.
    What carries no time may also be a path that leaves mass out.

    Raises
    ------
    InvalidValue
        Where a part of the scene cannot be compiled.
    """
    machine.course()
    if scene.has_mass:
        _addresses(between_ruptures(scene, clock=clock))
        _addresses(in_rupture(scene, clock=clock))
    if not (scene.has_mass and clock):
        _addresses(without_mass(scene, clock=clock))


def segment(
    scene: Scene,
    accuracy: Accuracy,
    meter: Meter,
    start: Point,
    watches: Sequence[Watch],
    *,
    origin: Numbers,
    lasts: float,
    clock: bool,
    recording: Recording | None,
) -> Iterator[Event]:
    """Events of one segment of loading; the last is its end, unless one ends the motion earlier.

    Parameters
    ----------
    scene, accuracy, meter, start, watches, clock, recording
        As those of `course.follow`.
    origin : tuple of float
        Time, slip and spring stress where the segment begins.
    lasts : float
        How long it lasts.
    """
    plan = _planned(scene, accuracy, clock=clock)
    begins = np.empty(2 * plan.unknowns), _columns_of(start)
    return _told(plan, (lasts, *origin), begins, meter, watches, recording=recording)


def along(
    equations: Equations,
    state: Numbers,
    tolerance: float,
    meter: Meter,
    watches: Sequence[Watch],
    *,
    backward: bool,
    samples: Sequence[float],
) -> Iterator[Event]:
    """Events along one system of equations; the arguments are those of `course.along`."""
    counts = len(equations.unknowns), equations.states, 0
    flags = ("direction", -1.0 if backward else 1.0), ("strides", equations.regime != RIGID)
    memory = _beginning(flags, tolerance, counts)
    begins = np.array((*state, *state)), np.empty(table.PSIS + equations.states)
    return _told(_plan(memory, equations), _FOR_EVER, begins, meter, watches, samples)


def _planned(scene: Scene, accuracy: Accuracy, *, clock: bool) -> _Plan:
    """What all motions of a scene at an accuracy have in common; found once."""
    key = "compiled", accuracy.rtol, accuracy.refinement, clock
    if key not in scene.made:
        both = regimes_of(scene, accuracy, clock=clock) if scene.has_mass else None
        slow = both.slow if both else without_mass(scene, clock=clock)
        counts = len(slow.unknowns), slow.states, len(both.fast.unknowns) if both else 0
        memory = _beginning((*_OF_SEGMENTS, ("has_clock", clock)), accuracy.solver, counts)
        scene.made[key] = _plan(memory, slow, both)
    found: _Plan = scene.made[key]
    return found


def _plan(memory: bytes, slow: Equations, both: Regimes | None = None) -> _Plan:
    """A plan of motions by equations, and by those of another regime."""
    systems = (slow,) if both is None else (slow, both.fast)
    return _Plan(
        memory,
        scales=np.array([scale for system in systems for scale in system.scales]),
        functions=_table(*(_addresses(system) for system in systems)),
        limits=_NO_MASS if both is None else tuple(both.limits),
        p=np.array(slow.p),
        regimes=tuple(system.regime for system in systems),
        unknowns=max(len(system.unknowns) for system in systems),
    )


@lru_cache(maxsize=256)
def _beginning(
    flags: tuple[tuple[str, float], ...], tolerance: float, counts: tuple[int, int, int]
) -> bytes:
    """What motions remember at first, as bytes: records are copied one field after the other.

    Counts are those of unknowns, of states, and of unknowns in ruptures (0 where mass is none).
    """
    memory = np.zeros(1, table.NOW)
    now, tolerance = memory[0], max(tolerance, TIGHTEST)
    now["tolerance"], now["direction"] = tolerance, 1.0
    now["finer"] = (tolerance / TOLERANCE_OF_STRIDES) ** 0.125
    now["begins"] = table.BEGIN
    now["unknowns"], now["states"], now["unknowns_fast"] = counts
    now["has_mass"] = counts[-1] > 0
    for name, value in flags:
        now[name] = value
    return memory.tobytes()


def _addresses(equations: Equations) -> tuple[int, ...]:
    """Where the compiled functions of equations are."""
    return machine.addresses(
        equations.rate,
        equations.point,
        equations.balance,
        len(equations.unknowns),
        equations.states,
        len(equations.p),
    )


@cache
def _table(slow: tuple[int, ...], fast: tuple[int, ...] = ()) -> np.ndarray:
    """The table of addresses; both regimes know of the balance between ruptures."""
    rows = np.zeros((2, table.FUNCTIONS), dtype=np.int64)
    rows[table.SLOW, : len(slow)], rows[table.FAST, : len(fast)] = slow, fast
    rows[table.FAST, -1] = rows[table.SLOW, -1]
    return rows


def _told(
    plan: _Plan,
    times: tuple[float, ...],
    begins: tuple[np.ndarray, np.ndarray],
    meter: Meter,
    watches: Sequence[Watch],
    samples: Sequence[float] = (),
    recording: Recording | None = None,
) -> Iterator[Event]:
    """Events of a motion, a table of them by each call of the compiled one.

    Parameters
    ----------
    times : tuple of float
        How long it lasts, and time, slip and spring stress where it begins.
    begins : tuple of ndarray
        The unknowns with which it begins, behind which is room for as many; and the columns of the
        point at which it begins, if it is that which the plan begins with.

    Raises
    ------
    Halt
        Where it cannot go on.
    """
    regimes, (y, last) = plan.regimes, begins
    memory, states = bytearray(plan.memory), len(last) - table.PSIS
    table.CALLED_WITH.pack_into(memory, 0, *times, meter.budget - meter.spent)
    now = np.frombuffer(memory, table.NOW)
    asked, meanings = _asked(tuple(watches), tuple(samples))
    asked = asked.copy()
    told = np.empty((max(_EVENTS, 2 * len(asked) + 3), _OF_STATES + states))
    rows = np.empty((0 if recording is None else _RECORDED, STATES + states))
    space = np.empty(room.size(len(y) // 2, states, len(asked)))
    # a rigid slider has slip for its clock
    slips = table.CLOCK if regimes[0] == RIGID else table.SLIP
    arguments = plan.scales, plan.functions, space, last, asked, told, rows, plan.limits, plan.p
    advance, end, account = machine.course(), table.HANDS_OVER, _Account(meter, regimes)
    while end == table.HANDS_OVER:
        end = advance(now, y, *arguments)
        *spent, happened, recorded = table.SAYS.unpack_from(memory, table.CALLED_WITH.size)
        before = account.settle(*spent)
        if recording is not None:
            _keep(recording, rows[:recorded], regimes)
        for line in told[:happened].tolist():
            psis = tuple(line[_OF_STATES:])
            point = _named(Point, (*line[_BEFORE], psis, *line[_BEHIND]))
            kind, watch = meanings[int(line[table.CODE])]
            name = regimes[int(line[table.REGIME])]
            work = before + int(line[table.SPENT])
            yield _named(Event, (kind, watch, line[table.TIME], line[slips], point, name, work))
        meter.check()
    if end != table.ENDED:
        raise _halt(end, now[0], regimes)


class _Account:
    """What a motion has spent in its regimes, and a meter has been told of."""

    def __init__(self, meter: Meter, regimes: tuple[str, ...]) -> None:
        self._meter, self._regimes = meter, regimes
        self._slow = self._fast = self._steps = 0

    def settle(self, slow: int, fast: int, steps: int) -> int:
        """Add what it has spent since the last time to the meter; returns what else is on that."""
        meter = self._meter
        before = meter.spent - self._slow - self._fast
        if slow > self._slow:
            meter.add(self._regimes[0], slow - self._slow)
        if fast > self._fast:
            meter.add(self._regimes[1], fast - self._fast)
        meter.steps += steps - self._steps
        self._slow, self._fast, self._steps = slow, fast, steps
        return before


@lru_cache(maxsize=256)
def _asked(
    watches: tuple[Watch, ...], samples: tuple[float, ...]
) -> tuple[np.ndarray, list[tuple[Kind, Watch | None]]]:
    """The table of what is watched for, and what codes of events mean; samples are told at
    clocks.
    """
    meanings = [*((watch.kind, watch) for watch in watches), *[_SAMPLE] * len(samples), *_BESIDE]
    asked = np.zeros((len(watches) + len(samples), len(table.WATCHED)))
    for row, watch in zip(asked, watches, strict=False):
        row[table.KIND], row[table.OF] = _KINDS[watch.kind], _COLUMNS[watch.of]
        row[table.LEVEL], row[table.ENDS], row[table.WAITS] = watch.level, watch.ends, watch.waits
    for row, clock in zip(asked[len(watches) :], samples, strict=True):
        row[table.KIND], row[table.LEVEL] = table.MOMENT, clock
    return asked, meanings


def _keep(recording: Recording, rows: np.ndarray, names: tuple[str, ...]) -> None:
    """Add rows to a recording, with the numbers it has given to the regimes."""
    numbers = np.array([recording.number(name) for name in names])
    kept = rows.copy()
    kept[:, REGIME] = numbers[kept[:, REGIME].astype(int)]
    recording.add(kept)


def _columns_of(point: Point) -> np.ndarray:
    """A point as the compiled motion has it."""
    log_rate, growth, spring, friction, psis, *others = point
    return np.array((log_rate, growth, spring, friction, *others, *psis))


def _halt(end: int, now: Any, regimes: tuple[str, ...]) -> Halt:
    """Why a motion cannot go on."""
    if end == table.HALTED:
        return halted(int(now["fate"]), float(now["stress"]))
    name = regimes[now["regime"]]
    why = "a step would be shorter than the spacing of numbers around the clock"
    if end == table.NO_LENGTH:
        why = "step without length, or a state that is not finite"
    return Halt(Status.INTEGRATION_FAILED, f"{name}: {why}")
