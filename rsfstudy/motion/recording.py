"""What is recorded along a motion: where each regime begins, and within each step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rsfstudy.motion.events import Event
from rsfstudy.slider.forms import Point
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
#: The same, and what a rig reads.
READ = (*OBSERVED, "friction_coefficient")
#: Columns behind those: the regime, and from this one on the states.
REGIME, STATES = len(READ), len(READ) + 1
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
    """

    regimes: list[str] = field(default_factory=list)
    _rows: list[np.ndarray] = field(default_factory=list)
    _ended: int = 0

    def number(self, regime: str) -> int:
        """Place of a regime among those of the motion."""
        if regime not in self.regimes:
            self.regimes.append(regime)
        return self.regimes.index(regime)

    def add(self, rows: Sequence[tuple[float, ...]] | np.ndarray) -> None:
        """Rows as `row` makes them."""
        self._rows.append(np.array(rows, dtype=float))

    def ends_at(self, time: float) -> None:
        """What was taken in since the last such time, or the start, has ended at this one."""
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
            table = np.vstack([table[table[:, 0] < until.time], last[:columns]])
        table[:, 2] /= math.log(10.0)
        table[:, 3:5] += scene.mu_star
        return table


def row(time: float, slip: float, point: Point, regime: int) -> tuple[float, ...]:
    """What is recorded of a point: the quantities of `READ`, less scales and offsets, the
    regime, and the states.
    """
    stresses = point.spring, point.friction, point.normal_stress
    return (
        *(time, slip, point.log_rate, *stresses, point.state, point.reading),
        *(regime, *point.psis),
    )


def strictly_later(table: np.ndarray) -> np.ndarray:
    """A recorded motion whose times strictly increase.

    A regime or segment begins with a row at the time at which another has ended. It takes the place
    of one that holds the same; where they differ, it follows a few floating-point numbers later, as
    do rows of a rupture shorter than the spacing of those numbers.
    """
    same = (np.diff(np.delete(table, REGIME, axis=1), axis=0) == 0.0).all(axis=1)
    table = table[~np.append(same, np.zeros(min(len(table), 1), dtype=bool))]
    times, earliest = table[:, 0].tolist(), -math.inf
    for place, time in enumerate(times):
        times[place] = max(time, earliest)
        earliest = times[place] + max(_APART * math.ulp(times[place]), _LEAST)
    table[:, 0] = times
    return table


def along_path(
    table: np.ndarray, points: int, names: Sequence[str] = OBSERVED
) -> dict[str, np.ndarray]:
    """What was seen, by the names of the first columns, at points spread evenly along the path,
    half by its length in time, ln V and stress, half by the steps the integrator took, which are
    short where the path bends.
    """
    table = table[:, : len(names)]
    table = table[np.append(True, (np.diff(table, axis=0) != 0.0).any(axis=1))]
    seen = table[:, [OBSERVED.index(n) for n in ("time", "log10_slip_rate", "shear_stress")]]
    spread = np.ptp(seen, axis=0)
    strides = np.abs(np.diff(seen, axis=0) / np.where(spread > 0.0, spread, 1.0)).sum(axis=1)
    strides = strides / strides.sum() + 1.0 / len(strides)
    path = np.concatenate([[0.0], np.cumsum(strides)])
    at = np.linspace(0.0, path[-1], points)
    return {name: np.interp(at, path, table[:, i]) for i, name in enumerate(names)}
