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
from rsfstudy.motion.regimes import fast_state, halted, slow_state
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
#: Where the states of a point begin in a line of the table of events.
_OF_STATES = table.POINT + table.PSIS
_NO_MASS = (math.nan,) * len(Limits._fields)


class _Course(NamedTuple):
    """A compiled motion, ready to begin, and what it is called with.

    Attributes
    ----------
    memory : ndarray of NOW, shape (1,)
    y, scales, functions : ndarray
        Unknowns and room for their rates; scales of the unknowns of all regimes; addresses of the
        equations of each.
    limits : tuple of float
    p : ndarray
        The numbers of the scene.
    regimes : tuple of str
        Names of those it goes through.
    """

    memory: np.ndarray
    y: np.ndarray
    scales: np.ndarray
    functions: np.ndarray
    limits: Numbers
    p: np.ndarray
    regimes: tuple[str, ...]


def prepare(scene: Scene) -> None:
    """Compile what motions of such a scene need, or find it in the cache.

    Raises
    ------
    InvalidValue
        Where a part of the scene cannot be compiled.
    """
    machine.course()
    for clock in (False, True):
        _addresses(without_mass(scene, clock=clock))
        if scene.has_mass:
            _addresses(between_ruptures(scene, clock=clock))
    if scene.has_mass:
        _addresses(in_rupture(scene))


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
    course = _course(scene, accuracy, start, clock=clock)
    now = course.memory[0]
    now["time"], now["slip"], now["spring"] = origin
    now["lasts"] = lasts
    return _told(course, meter, watches, recording=recording)


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
    memory, is_rigid = _memory(equations, tolerance), equations.regime == RIGID
    now = memory[0]
    now["direction"], now["anew"] = -1.0 if backward else 1.0, not is_rigid
    now["strides"] = not is_rigid
    scales, p = np.array(equations.scales), np.array(equations.p)
    functions, names = _table(_addresses(equations)), (equations.regime,)
    course = _Course(memory, _unknowns(state), scales, functions, _NO_MASS, p, names)
    # a rigid slider has slip for its clock
    return _told(course, meter, watches, samples, slips=table.CLOCK if is_rigid else table.SLIP)


def _course(scene: Scene, accuracy: Accuracy, start: Point, *, clock: bool) -> _Course:
    """A motion of a scene from a point."""
    both = regimes_of(scene, accuracy, clock=clock) if scene.has_mass else None
    slow = both.slow if both else without_mass(scene, clock=clock)
    memory, p = _memory(slow, accuracy.solver), np.array(slow.p)
    now = memory[0]
    now["ends_by_fate"], now["has_clock"], now["strides"], now["anew"] = 1, clock, 1, 1
    state = slow_state(start, clock)
    if both is None:
        functions, scales = _table(_addresses(slow)), np.array(slow.scales)
        return _Course(memory, _unknowns(state), scales, functions, _NO_MASS, p, (slow.regime,))
    fast = both.fast
    now["has_mass"], now["unknowns_fast"] = 1, len(fast.unknowns)
    if not both.begins_slow(start):
        now["regime"], state = table.FAST, fast_state(start)
    names, scales = (slow.regime, fast.regime), np.array((*slow.scales, *fast.scales))
    functions = _table(_addresses(slow), _addresses(fast))
    return _Course(memory, _unknowns(state), scales, functions, tuple(both.limits), p, names)


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


def _memory(equations: Equations, tolerance: float) -> np.ndarray:
    """What a motion that begins with these equations remembers."""
    unknowns = len(equations.unknowns)
    # records are copied one field after the other, and bytes at once
    template = _template(max(tolerance, TIGHTEST), unknowns, equations.states)
    return template.copy().view(table.NOW)


@lru_cache(maxsize=256)
def _template(tolerance: float, unknowns: int, states: int) -> np.ndarray:
    """The same as bytes, for all motions by these equations at a tolerance."""
    memory = np.zeros(1, table.NOW)
    now = memory[0]
    now["tolerance"], now["direction"] = tolerance, 1.0
    now["finer"] = (tolerance / TOLERANCE_OF_STRIDES) ** 0.125
    now["lasts"], now["begins"] = math.inf, table.BEGIN
    now["unknowns"], now["states"] = unknowns, states
    return memory.view(np.uint8)


def _unknowns(state: Numbers) -> np.ndarray:
    """Unknowns, with room for one more in another regime, and for their rates."""
    room = np.zeros(2 * len(state) + 2)
    room[: len(state)] = state
    return room


def _told(
    course: _Course,
    meter: Meter,
    watches: Sequence[Watch],
    samples: Sequence[float] = (),
    recording: Recording | None = None,
    slips: int = table.SLIP,
) -> Iterator[Event]:
    """Events of a motion, a table of them by each call of the compiled motion; their slip stands in
    the column `slips`.

    Raises
    ------
    Halt
        Where it cannot go on.
    """
    now, asked = course.memory[0], _asked(tuple(watches), tuple(samples)).copy()
    states = int(now["states"])
    now["budget"] = meter.budget - meter.spent
    meanings = [*((watch.kind, watch) for watch in watches), *[_SAMPLE] * len(samples), *_BESIDE]
    told = np.empty((max(_EVENTS, 2 * len(asked) + 3), table.POINT + table.PSIS + states))
    rows = np.empty((0 if recording is None else _RECORDED, STATES + states))
    space = np.empty(room.size(len(course.y), states, len(asked)))
    arguments = (*course[:4], space, np.zeros(table.PSIS + states), asked, told, rows)
    account = _Account(meter, course.regimes)
    advance, end = machine.course(), table.HANDS_OVER
    while end == table.HANDS_OVER:
        end = advance(*arguments, course.limits, course.p)
        if recording is not None:
            _keep(recording, rows[: now["recorded"]], course.regimes)
        for line in told[: now["told"]].tolist():
            code, regime, _clock, time, _slip, *work = line[: table.POINT]
            account.charge(*work)
            x, growth, spring, friction, *others = line[table.POINT : _OF_STATES]
            point = Point(x, growth, spring, friction, tuple(line[_OF_STATES:]), *others)
            kind, watch = meanings[int(code)]
            name = course.regimes[int(regime)]
            yield Event(kind, watch, time, line[slips], point, name, meter.spent)
        now["told"] = now["recorded"] = 0
    account.charge(now["steps"], now["spent_slow"], now["spent_fast"])
    if end != table.ENDED:
        raise _halt(end, now, course)


class _Account:
    """Charges a meter with what a motion has spent since it was charged last."""

    def __init__(self, meter: Meter, names: tuple[str, ...]) -> None:
        self._meter, self._names = meter, names
        self._steps = self._slow = self._fast = 0

    def charge(self, steps: float, slow: float, fast: float) -> None:
        """Charge what has been spent up to here."""
        meter, names = self._meter, self._names
        meter.steps += int(steps) - self._steps
        self._steps = int(steps)
        if slow > self._slow:
            meter.charge(names[0], int(slow) - self._slow)
            self._slow = int(slow)
        if fast > self._fast:
            meter.charge(names[1], int(fast) - self._fast)
            self._fast = int(fast)


@cache
def _asked(watches: tuple[Watch, ...], samples: tuple[float, ...]) -> np.ndarray:
    """The table of what is watched for; samples are told at clocks."""
    asked = np.zeros((len(watches) + len(samples), len(table.WATCHED)))
    for row, watch in zip(asked, watches, strict=False):
        row[table.KIND], row[table.OF] = _KINDS[watch.kind], _COLUMNS[watch.of]
        row[table.LEVEL], row[table.ENDS], row[table.WAITS] = watch.level, watch.ends, watch.waits
    for row, clock in zip(asked[len(watches) :], samples, strict=True):
        row[table.KIND], row[table.LEVEL] = table.MOMENT, clock
    return asked


def _keep(recording: Recording, rows: np.ndarray, names: tuple[str, ...]) -> None:
    """Add rows to a recording, with the numbers it has given to the regimes."""
    numbers = np.array([recording.number(name) for name in names])
    kept = rows.copy()
    kept[:, REGIME] = numbers[kept[:, REGIME].astype(int)]
    recording.add(kept)


def _halt(end: int, now: Any, course: _Course) -> Halt:
    """Why a motion cannot go on."""
    if end == table.HALTED:
        return halted(int(now["fate"]), float(now["stress"]))
    name = course.regimes[now["regime"]]
    why = "a step would be shorter than the spacing of numbers around the clock"
    if end == table.NO_LENGTH:
        why = "step without length, or a state that is not finite"
    return Halt(Status.INTEGRATION_FAILED, f"{name}: {why}")
