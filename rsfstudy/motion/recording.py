"""Recording along a motion: where each regime begins, and within each step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import brentq

from rsfstudy.motion.engines import SCIPY, on_arrays
from rsfstudy.motion.events import Event
from rsfstudy.slider.point import Point
from rsfstudy.slider.scene import Scene

#: What is recorded, in this order.
OBSERVED = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "frictional_stress",
    "normal_stress_ratio",
    "state_variable",
)
#: Those that are shear stress.
STRESSES = slice(OBSERVED.index("shear_stress"), OBSERVED.index("frictional_stress") + 1)
#: The same, and what a rig reads.
READ = (*OBSERVED, "friction_coefficient")
#: Columns behind those: the regime; the place within a step, 0 where a regime begins and `SAMPLES`
#: at the end of each step; and from this one on the states.
REGIME, PLACE, STATES = range(len(READ), len(READ) + 3)
#: Times that follow each other differ by so many floating-point numbers, and by so much, at least:
#: they still differ in other units, where each is rounded anew.
_APART, _LEAST = 4, 1e-290
#: Samples within each integration step of a recorded motion: enough for a smooth curve.
SAMPLES = 6


@dataclass
class Recording:
    """Takes in what a motion does, from the engine that integrates it.

    Attributes
    ----------
    regimes : list of str
        Those of the motion, as they came.
    at : ndarray, optional
        Times at which to record, in D_c/V_*, or slips in D_c of a rigid slider; they must not fall.
        Without it, all of the motion is recorded, evenly within each step. Where a segment of
        loading begins at such a time, what it ends with is recorded.
    """

    regimes: list[str] = field(default_factory=list)
    at: np.ndarray | None = None
    _rows: list[np.ndarray] = field(default_factory=list)
    _ended: int = 0

    def number(self, regime: str) -> int:
        """Place of a regime among those of the motion."""
        if regime not in self.regimes:
            self.regimes.append(regime)
        return self.regimes.index(regime)

    def left(self) -> np.ndarray:
        """Times that are still to be recorded."""
        assert self.at is not None
        return np.asarray(self.at, dtype=float)[sum(map(len, self._rows)) :]

    def take(self, rows: np.ndarray, regimes: Sequence[str]) -> None:
        """Take in rows as the loop makes them, in which regimes are numbered as in a list."""
        if self.at is not None and not np.isnan(rows[0, 0]):
            rows[:, 0] = self.at[len(self.at) - len(self.left()) :][: len(rows)]
        numbers = [self.number(name) for name in regimes]
        if numbers != list(range(len(numbers))):
            rows[:, REGIME] = np.array(numbers)[rows[:, REGIME].astype(int)]
        self._rows.append(rows)

    def ends_at(self, time: float) -> None:
        """End at this time what was taken in since the last such time, or the start."""
        if self.at is not None:
            return
        for rows in self._rows[self._ended :]:
            np.minimum(rows[:, 0], time, out=rows[:, 0])
        if self._ended < len(self._rows):
            self._rows[-1][-1:, 0] = time
        self._ended = len(self._rows)

    def seen(self, scene: Scene, until: Event | None = None) -> np.ndarray:
        """The quantities of `READ`, the number of the regime and the states freed of stress, in
        columns; up to an event. Of states, those that there are in every segment of loading.
        """
        rows = self._rows or [np.empty((0, STATES + scene.states))]
        columns = min(part.shape[1] for part in rows)
        table = np.concatenate([part[:, :columns] for part in rows])
        if until is not None:
            last = row(until.time, until.slip, until.point, self.number(until.regime))
            table = up_to(table, np.array(last[:columns]))
        return in_units_of(scene, table)


def in_units_of(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """The same rows, of which slip rates become decimal logarithms, and stresses those that act."""
    rows[..., 2] /= math.log(10.0)
    rows[..., STRESSES] += scene.mu_star
    return rows


def row(time: float, slip: float, point: Point, regime: int) -> tuple[float, ...]:
    """Row that is recorded of a point: the quantities of `READ`, less scales and offsets, the
    regime, the place within a step, and the states.
    """
    stresses = point.spring_stress, point.friction, point.normal_stress
    return (
        *(time, slip, point.log_slip_rate, *stresses, point.state, point.reading),
        *(regime, 0.0, *point.psis),
    )


def strictly_later(table: np.ndarray) -> np.ndarray:
    """A recorded motion whose times strictly increase.

    A regime or segment begins with a row at the time at which another has ended. It takes the place
    of one that holds the same; where they differ, it follows a few floating-point numbers later, as
    do rows of a rupture shorter than the spacing of those numbers.
    """
    same = (np.diff(np.delete(table, [REGIME, PLACE], axis=1), axis=0) == 0.0).all(axis=1)
    table = table[~np.append(same, np.zeros(min(len(table), 1), dtype=bool))]
    times, earliest = table[:, 0].tolist(), -math.inf
    for place, time in enumerate(times):
        times[place] = max(time, earliest)
        earliest = times[place] + max(_APART * math.ulp(times[place]), _LEAST)
    table[:, 0] = times
    return table


def up_to(table: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Rows up to one within a step, or at its end, evenly spaced in what is left of the step, whose
    rows in the table they replace. Its time tells where in the step it is.
    """
    after = int(table[:, 0].searchsorted(last[0]))
    place = int(table[after, PLACE]) if after < len(table) else 0
    begin = after - place
    if not place or begin + SAMPLES >= len(table):  # nothing was recorded beyond it
        return np.vstack([table[:after], last])
    part, times = float(place), table[begin : begin + SAMPLES + 1, 0]
    if times[place] > last[0] > times[place - 1]:
        late = (_INVERSE @ (times - last[0])).tolist()
        sides = (place - 1.0) / HALF - 1.0, place / HALF - 1.0
        if _polynomial(sides[0], late) < 0.0 < _polynomial(sides[1], late):
            part = HALF * (1.0 + brentq(_polynomial, *sides, args=(late,)))
    within = part / SAMPLES * _PLACES[1:-1]
    step = table[begin + 1 : begin + SAMPLES + 1]
    step[:-1], step[-1] = _weights(within).T @ table[begin : begin + SAMPLES + 1], last
    step[:, REGIME], step[:, PLACE] = last[REGIME], _PLACES[1:]
    return table[: begin + SAMPLES + 1]


def along_path(
    table: np.ndarray, points: int, names: Sequence[str] = OBSERVED, engine: str = SCIPY
) -> dict[str, np.ndarray]:
    """Columns of a record, by the names of the first columns, at points spread evenly along the
    path, half by its length in time, ln V and stress, half by the steps the integrator took, which
    are short where the path bends. Each extreme of slip rate and of stress is one of the points.
    """
    if not len(table):
        return {name: np.full(points, np.nan) for name in names}
    columns, found = np.ascontiguousarray(table.T), np.empty((len(names), points))
    path, at, room = np.zeros(len(table)), np.empty(points), np.empty(SAMPLES + 1)
    seen = [columns[place] for place in (*_PATH, PLACE)]
    on_arrays(spread_along_path, engine, columns, *seen, path, at, room, found)
    # times of a rupture may differ by less than rounding
    np.maximum.accumulate(found[0], out=found[0])
    return dict(zip(names, found, strict=True))


def spread_along_path(  # type: ignore[no-untyped-def]
    columns, time, rate, stress, places, path, at, room, found
):
    """Fill in how far along the path the rows are, numbers of rows and parts that are spread evenly
    along it, and the first columns there.
    """
    last, points, total = len(path) - 1, len(at), 0.0
    for values in (time, rate, stress):
        lowest = highest = values[0]
        for value in values:
            lowest, highest = min(lowest, value), max(highest, value)
        spread, before = (highest - lowest if highest > lowest else 1.0), values[0]
        for i in range(1, last + 1):
            value = values[i]
            path[i] += abs(value - before) / spread
            before = value
    for length in path:
        total += length
    share, passed = 1.0 / (total if total > 0.0 else 1.0), 0.0
    for i in range(1, last + 1):
        passed += path[i] * share + 1.0 / last
        path[i] = passed
    row, apart = 0, passed / (points - 1)
    for i in range(points):
        while row < last - 1 and path[row + 1] <= i * apart:
            row += 1
        at[i] = row + (i * apart - path[row]) / (path[row + 1] - path[row]) if last else 0.0
    at[points - 1] = last
    for values in (rate, stress):
        top = bottom = 0
        for i in range(last + 1):
            if values[i] > values[top]:
                top = i
            elif values[i] < values[bottom]:
                bottom = i
        put_nearest(at, extreme_at(values, places, top, room))
        put_nearest(at, extreme_at(values, places, bottom, room))
    at_rows(columns, at, found)


def put_nearest(at: Any, place: float) -> None:
    """Put a place among others that rise where the nearest of those between the ends is."""
    nearest = 1
    while nearest < len(at) - 2 and abs(at[nearest + 1] - place) <= abs(at[nearest] - place):
        nearest += 1
    if nearest < len(at) - 1:
        at[nearest] = place


def extreme_at(values: Any, places: Any, top: int, room: Any) -> float:
    """Number of the row, and part to the next, where values are extreme; next to an extreme row."""
    for after in (top, top + 1):  # the step it lies in, or ends, and the one that begins with it
        begin = after - int(places[after]) if after < len(values) else after
        if begin == after or begin + SAMPLES >= len(values):
            continue
        for power in range(SAMPLES + 1):
            room[power] = 0.0
            for k in range(SAMPLES + 1):
                room[power] += COEFFICIENTS[power][k] * (values[begin + k] - values[top])
        at = (top - begin) / HALF - 1.0
        for _ in range(4):
            slope = bend = 0.0
            for power in range(SAMPLES, 1, -1):
                slope = slope * at + power * room[power]
                bend = bend * at + power * (power - 1) * room[power]
            slope = slope * at + room[1]
            at -= slope / bend if bend != 0.0 else 0.0
        place = HALF * (1.0 + at)
        if abs(place - (top - begin)) < 1.0 and 0.0 <= place <= SAMPLES:
            return begin + place
    return float(top)


def at_rows(columns: np.ndarray, at: np.ndarray, found: np.ndarray) -> None:
    """Fill in values of columns between rows, at numbers of rows and parts: of the polynomial
    through those of the step. The compiler has a loop in place of this (`compiled.calls`).
    """
    columns, at, found = map(np.asarray, (columns, at, found))
    after = np.ceil(at).astype(int)
    within = columns[PLACE, after].astype(int)
    # from one regime to the next there is a straight line
    jumps = np.flatnonzero((within == 0) & (at > 0.0))
    within[jumps] = 1
    begin = after - within
    part = at - begin
    columns = columns[: len(found)]
    around = columns.take(begin + _PLACES[:, None], axis=1, mode="clip")
    np.einsum("kp,ckp->cp", _weights(part), around, out=found)
    at_a_row = np.flatnonzero(part == np.rint(part))
    found[:, at_a_row] = columns[:, (begin + part.astype(int))[at_a_row]]
    line, share = begin[jumps], part[jumps]
    found[:, jumps] = (1.0 - share) * columns[:, line] + share * columns[:, line + 1]


#: Columns by which the length of a path is measured.
_PATH = tuple(OBSERVED.index(name) for name in ("time", "log10_slip_rate", "shear_stress"))
#: Coefficients of the polynomial through the values at the places of a step, by those values: in
#: places from its middle, over half of them.
HALF, _PLACES = 0.5 * SAMPLES, np.arange(SAMPLES + 1)
_INVERSE = np.linalg.inv(np.vander(np.linspace(-1.0, 1.0, SAMPLES + 1), increasing=True))
COEFFICIENTS = tuple(tuple(row) for row in _INVERSE.tolist())


def _polynomial(at: float, coefficients: Sequence[float]) -> float:
    """Value of a polynomial, by the coefficients of rising powers."""
    value = 0.0
    for coefficient in reversed(coefficients):
        value = coefficient + at * value
    return value


def _weights(parts: np.ndarray) -> np.ndarray:
    """Weights of the values at the places of a step, a row each, at parts of it in places."""
    return np.asarray(_INVERSE.T @ (parts / HALF - 1.0) ** _PLACES[:, None])
