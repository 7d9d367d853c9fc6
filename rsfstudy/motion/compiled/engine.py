"""Events of compiled motions, as those of other engines."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.compiled import machine, table
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
_BESIDE = {table.BEGIN: Kind.START, table.CHANGE: Kind.REGIME, table.END: Kind.END}
_NO_MASS = (math.nan,) * len(Limits._fields)


class _Course(NamedTuple):
    """A compiled motion, ready to begin, and what it is called with.

    Attributes
    ----------
    memory : ndarray of NOW, shape (1,)
    y, scales : ndarray
        Unknowns and room for their rates; scales of the unknowns of all regimes.
    limits : tuple of float
    p : ndarray
        The numbers of the scene.
    regimes : tuple of str
        Names of those it goes through.
    """

    memory: np.ndarray
    y: np.ndarray
    scales: np.ndarray
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
    for event, _clock in _told(course, meter, watches, (), recording):
        yield event


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
    course = _Course(memory, _unknowns(state), scales, _NO_MASS, p, (equations.regime,))
    for event, at in _told(course, meter, watches, samples, None):
        yield event._replace(slip=at) if is_rigid else event


def _course(scene: Scene, accuracy: Accuracy, start: Point, *, clock: bool) -> _Course:
    """A motion of a scene from a point."""
    both = regimes_of(scene, accuracy, clock=clock) if scene.has_mass else None
    slow = both.slow if both else without_mass(scene, clock=clock)
    memory, p = _memory(slow, accuracy.solver), np.array(slow.p)
    now = memory[0]
    now["ends_by_fate"], now["has_clock"], now["strides"], now["anew"] = 1, clock, 1, 1
    state = slow_state(start, clock)
    if both is None:
        return _Course(memory, _unknowns(state), np.array(slow.scales), _NO_MASS, p, (slow.regime,))
    fast = both.fast
    now["has_mass"] = 1
    now["fast_rates"], now["fast_point"] = _addresses(fast)[:2]
    now["balance"] = _addresses(slow)[2]
    if not both.begins_slow(start):
        now["regime"], state = table.FAST, fast_state(start)
    names, scales = (slow.regime, fast.regime), np.array((*slow.scales, *fast.scales))
    return _Course(memory, _unknowns(state), scales, tuple(both.limits), p, names)


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


def _memory(equations: Equations, tolerance: float) -> np.ndarray:
    """What a motion that begins with these equations remembers."""
    return _template(
        max(tolerance, TIGHTEST),
        len(equations.unknowns),
        equations.states,
        *_addresses(equations)[:2],
    ).copy()


@lru_cache(maxsize=256)
def _template(tolerance: float, unknowns: int, states: int, rates: int, point: int) -> np.ndarray:
    """The same, for all motions by these equations at a tolerance."""
    memory = np.zeros(1, table.NOW)
    now = memory[0]
    now["tolerance"], now["direction"] = tolerance, 1.0
    now["finer"] = (tolerance / TOLERANCE_OF_STRIDES) ** 0.125
    now["lasts"], now["begins"] = math.inf, table.BEGIN
    now["unknowns"], now["states"] = unknowns, states
    now["slow_rates"], now["slow_point"] = rates, point
    return memory


def _unknowns(state: Numbers) -> np.ndarray:
    """Unknowns, with room for one more in another regime, and for their rates."""
    room = np.zeros(2 * len(state) + 2)
    room[: len(state)] = state
    return room


def _told(
    course: _Course,
    meter: Meter,
    watches: Sequence[Watch],
    samples: Sequence[float],
    recording: Recording | None,
) -> Iterator[tuple[Event, float]]:
    """Events of a motion, each with its clock; a call of the compiled motion fills a table.

    Raises
    ------
    Halt
        Where it cannot go on.
    """
    now, asked = course.memory[0], _asked(tuple(watches), tuple(samples)).copy()
    now["budget"] = meter.budget - meter.spent
    point, advance = table.PSIS + int(now["states"]), machine.course()
    told = np.empty((max(_EVENTS, 2 * len(asked) + 3), table.POINT + point))
    rows = np.empty((0 if recording is None else _RECORDED, STATES + int(now["states"])))
    account = _Account(meter, course.regimes)
    arguments = course.memory, course.y, course.scales, np.zeros(point), asked, told, rows
    end = table.HANDS_OVER
    while end == table.HANDS_OVER:
        end = advance(*arguments, course.limits, course.p)
        if recording is not None:
            _keep(recording, rows[: now["recorded"]], course.regimes)
        for line in told[: now["told"]].tolist():
            account.charge(*line[table.STEPS : table.POINT])
            yield _event(line, watches, course.regimes, meter.spent), line[table.CLOCK]
        now["told"] = now["recorded"] = 0
    account.charge(now["steps"], now["spent_slow"], now["spent_fast"])
    if end != table.ENDED:
        raise _halt(end, now, course)


class _Account:
    """Charges a meter with what a motion has spent since it was charged last."""

    def __init__(self, meter: Meter, names: tuple[str, ...]) -> None:
        self._meter, self._names = meter, names
        self._steps, self._spent = 0, (0, 0)

    def charge(self, steps: float, *spent: float) -> None:
        """Charge what has been spent up to here."""
        before, self._spent = self._spent, (int(spent[0]), int(spent[1]))
        self._meter.steps += int(steps) - self._steps
        self._steps = int(steps)
        for name, now, then in zip(self._names, self._spent, before, strict=False):
            if now > then:
                self._meter.charge(name, now - then)


def _event(
    line: Sequence[float], watches: Sequence[Watch], names: tuple[str, ...], spent: int
) -> Event:
    """The event of a line of the table."""
    code, at = int(line[table.CODE]), table.POINT
    watch = watches[code] if 0 <= code < len(watches) else None
    kind = watch.kind if watch is not None else _BESIDE.get(code, Kind.SAMPLE)
    x, growth, spring, friction, *others = line[at : at + table.PSIS]
    point = Point(x, growth, spring, friction, tuple(line[at + table.PSIS :]), *others)
    time, slip, regime = line[table.TIME], line[table.SLIP], names[int(line[table.REGIME])]
    return Event(kind, watch, time, slip, point, regime, spent)


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
