"""Recording along a motion: where each regime begins, and within each step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import brentq

from rsfstudy.motion.events import Event
from rsfstudy.slider import MotionPoint, Scene

#: What is recorded, in this order.
MOTION_VARIABLES = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "frictional_stress",
    "normal_stress_ratio",
    "state_variable",
)
#: Those that are shear stress.
SHEAR_STRESS_COLUMNS = slice(
    MOTION_VARIABLES.index("shear_stress"), MOTION_VARIABLES.index("frictional_stress") + 1
)
#: The same, and what a rig reads.
RECORDED_VARIABLES = (*MOTION_VARIABLES, "friction_coefficient")
#: Columns behind those: the regime; the place within a step, 0 where a regime begins and
#: `SAMPLES_PER_STEP` at the end of each step; and from this one on the states.
REGIME_COLUMN, SAMPLE_COLUMN, FIRST_STATE_COLUMN = range(
    len(RECORDED_VARIABLES), len(RECORDED_VARIABLES) + 3
)
#: Samples within each integration step of a recorded motion: enough for a smooth curve.
SAMPLES_PER_STEP = 6


@dataclass
class Recording:
    """Takes in what a motion does, from the engine that integrates it.

    Attributes
    ----------
    regime_names : list of str
        Those of the motion, as they came.
    sample_times : ndarray, optional
        Times at which to record, in D_c/V_*, or slips in D_c of a rigid slider; they must not fall.
        Without it, all of the motion is recorded, evenly within each step. Where a segment of
        loading begins at such a time, what it ends with is recorded.
    """

    regime_names: list[str] = field(default_factory=list)
    sample_times: np.ndarray | None = None
    _row_blocks: list[np.ndarray] = field(default_factory=list)
    _clipped_block_count: int = 0

    def index_of_regime(self, regime_name: str) -> int:
        """Place of a regime among those of the motion."""
        if regime_name not in self.regime_names:
            self.regime_names.append(regime_name)
        return self.regime_names.index(regime_name)

    def remaining_sample_times(self) -> np.ndarray:
        """Times that are still to be recorded."""
        assert self.sample_times is not None
        return np.asarray(self.sample_times, dtype=float)[sum(map(len, self._row_blocks)) :]

    def append_rows(self, rows: np.ndarray, regime_names: Sequence[str]) -> None:
        """Take in rows as the loop makes them, in which regimes are numbered as in a list."""
        if self.sample_times is not None and not np.isnan(rows[0, 0]):
            rows[:, 0] = self.sample_times[
                len(self.sample_times) - len(self.remaining_sample_times()) :
            ][: len(rows)]
        numbers = [self.index_of_regime(name) for name in regime_names]
        if numbers != list(range(len(numbers))):
            rows[:, REGIME_COLUMN] = np.array(numbers)[rows[:, REGIME_COLUMN].astype(int)]
        self._row_blocks.append(rows)

    def clip_times_to(self, max_time: float) -> None:
        """End at this time what was taken in since the last such time, or the start."""
        if self.sample_times is not None:
            return
        for rows in self._row_blocks[self._clipped_block_count :]:
            np.minimum(rows[:, 0], max_time, out=rows[:, 0])
        if self._clipped_block_count < len(self._row_blocks):
            self._row_blocks[-1][-1:, 0] = max_time
        self._clipped_block_count = len(self._row_blocks)

    def as_table(self, scene: Scene, end_event: Event | None = None) -> np.ndarray:
        """The quantities of `RECORDED_VARIABLES`, the number of the regime and the states freed of
        stress, in columns; up to an event. Of states, those that there are in every segment of
        loading.
        """
        rows = self._row_blocks or [np.empty((0, FIRST_STATE_COLUMN + scene.state_count))]
        columns = min(part.shape[1] for part in rows)
        table = np.concatenate([part[:, :columns] for part in rows])
        if end_event is not None:
            last = pack_recorded_row(
                end_event.time,
                end_event.slip,
                end_event.point,
                self.index_of_regime(end_event.regime),
            )
            table = truncate_recording_at_row(table, np.array(last[:columns]))
        return convert_to_recorded_units(scene, table)

    def table_up_to_row(self, scene: Scene, last_row: np.ndarray) -> np.ndarray:
        """The same, up to a row within a step or at its end."""
        return truncate_recording_at_row(self.as_table(scene), last_row)


def convert_to_recorded_units(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """The same rows, of which slip rates become decimal logarithms, and stresses those that act."""
    rows[..., 2] /= math.log(10.0)
    rows[..., SHEAR_STRESS_COLUMNS] += scene.mu_star
    return rows


def pack_recorded_row(
    time: float, slip: float, point: MotionPoint, regime_number: int
) -> tuple[float, ...]:
    """Row that is recorded of a point: the quantities of `RECORDED_VARIABLES`, less scales and
    offsets, the regime, the place within a step, and the states.
    """
    stresses = point.spring_stress, point.frictional_stress, point.normal_stress
    return (
        *(time, slip, point.log_slip_rate, *stresses, point.state, point.apparent_friction),
        *(regime_number, 0.0, *point.psis),
    )


def recorded_row(
    scene: Scene, time: float, slip: float, point: MotionPoint, regime: int
) -> np.ndarray:
    """Row of a point as `Recording.table` has it."""
    return convert_to_recorded_units(scene, np.array(pack_recorded_row(time, slip, point, regime)))


def truncate_recording_at_row(motion_table: np.ndarray, last_row: np.ndarray) -> np.ndarray:
    """Rows up to one within a step, or at its end, evenly spaced in what is left of the step, whose
    rows in the table they replace. Its time tells where in the step it is.
    """
    after = int(motion_table[:, 0].searchsorted(last_row[0]))
    place = int(motion_table[after, SAMPLE_COLUMN]) if after < len(motion_table) else 0
    begin = after - place
    if not place or begin + SAMPLES_PER_STEP >= len(motion_table):  # nothing was recorded beyond it
        return np.vstack([motion_table[:after], last_row])
    part, times = float(place), motion_table[begin : begin + SAMPLES_PER_STEP + 1, 0]
    if times[place] > last_row[0] > times[place - 1]:
        late = (_INVERSE_VANDERMONDE @ (times - last_row[0])).tolist()
        sides = (place - 1.0) / HALF_SAMPLES - 1.0, place / HALF_SAMPLES - 1.0
        if _evaluate_polynomial(sides[0], late) < 0.0 < _evaluate_polynomial(sides[1], late):
            part = HALF_SAMPLES * (1.0 + brentq(_evaluate_polynomial, *sides, args=(late,)))
    within = part / SAMPLES_PER_STEP * _SAMPLE_INDICES[1:-1]
    step = motion_table[begin + 1 : begin + SAMPLES_PER_STEP + 1]
    step[:-1], step[-1] = (
        _interpolation_weights(within).T @ motion_table[begin : begin + SAMPLES_PER_STEP + 1],
        last_row,
    )
    step[:, REGIME_COLUMN], step[:, SAMPLE_COLUMN] = last_row[REGIME_COLUMN], _SAMPLE_INDICES[1:]
    return motion_table[: begin + SAMPLES_PER_STEP + 1]


def resample_along_path(  # type: ignore[no-untyped-def]
    columns,
    time,
    log_slip_rate,
    stress,
    step_sample_numbers,
    path_lengths,
    row_positions,
    work_array,
    result,
):
    """Fill in how far along the path the rows are, numbers of rows and parts that are spread evenly
    along it, and the first columns there.
    """
    last, points, total = len(path_lengths) - 1, len(row_positions), 0.0
    for values in (time, log_slip_rate, stress):
        lowest = highest = values[0]
        for value in values:
            lowest, highest = min(lowest, value), max(highest, value)
        spread, before = (highest - lowest if highest > lowest else 1.0), values[0]
        for i in range(1, last + 1):
            value = values[i]
            path_lengths[i] += abs(value - before) / spread
            before = value
    for length in path_lengths:
        total += length
    share, passed = 1.0 / (total if total > 0.0 else 1.0), 0.0
    for i in range(1, last + 1):
        passed += path_lengths[i] * share + 1.0 / last
        path_lengths[i] = passed
    row, apart = 0, passed / (points - 1)
    for i in range(points):
        while row < last - 1 and path_lengths[row + 1] <= i * apart:
            row += 1
        row_positions[i] = (
            row + (i * apart - path_lengths[row]) / (path_lengths[row + 1] - path_lengths[row])
            if last
            else 0.0
        )
    row_positions[points - 1] = last
    for values in (log_slip_rate, stress):
        top = bottom = 0
        for i in range(last + 1):
            if values[i] > values[top]:
                top = i
            elif values[i] < values[bottom]:
                bottom = i
        replace_nearest_row_position(
            row_positions, find_extreme_position(values, step_sample_numbers, top, work_array)
        )
        replace_nearest_row_position(
            row_positions, find_extreme_position(values, step_sample_numbers, bottom, work_array)
        )
    interpolate_rows(columns, row_positions, result)


def replace_nearest_row_position(row_positions: Any, row_position: float) -> None:
    """Put a place among others that rise where the nearest of those between the ends is."""
    nearest = 1
    while nearest < len(row_positions) - 2 and abs(
        row_positions[nearest + 1] - row_position
    ) <= abs(row_positions[nearest] - row_position):
        nearest += 1
    if nearest < len(row_positions) - 1:
        row_positions[nearest] = row_position


def find_extreme_position(
    values: Any, step_sample_numbers: Any, extreme_row: int, work_array: Any
) -> float:
    """Number of the row, and part to the next, where values are extreme; next to an extreme row."""
    for after in (
        extreme_row,
        extreme_row + 1,
    ):  # the step it lies in, or ends, and the one that begins with it
        begin = after - int(step_sample_numbers[after]) if after < len(values) else after
        if begin == after or begin + SAMPLES_PER_STEP >= len(values):
            continue
        for power in range(SAMPLES_PER_STEP + 1):
            work_array[power] = 0.0
            for k in range(SAMPLES_PER_STEP + 1):
                work_array[power] += INTERPOLATION_COEFFICIENTS[power][k] * (
                    values[begin + k] - values[extreme_row]
                )
        at = (extreme_row - begin) / HALF_SAMPLES - 1.0
        for _ in range(4):
            slope = bend = 0.0
            for power in range(SAMPLES_PER_STEP, 1, -1):
                slope = slope * at + power * work_array[power]
                bend = bend * at + power * (power - 1) * work_array[power]
            slope = slope * at + work_array[1]
            at -= slope / bend if bend != 0.0 else 0.0
        place = HALF_SAMPLES * (1.0 + at)
        if abs(place - (extreme_row - begin)) < 1.0 and 0.0 <= place <= SAMPLES_PER_STEP:
            return begin + place
    return float(extreme_row)


def interpolate_rows(columns: np.ndarray, row_positions: np.ndarray, result: np.ndarray) -> None:
    """Fill in values of columns between rows, at numbers of rows and parts: of the polynomial
    through those of the step. The compiler has a loop in place of this (`compiled.calls`).
    """
    columns, row_positions, result = map(np.asarray, (columns, row_positions, result))
    after = np.ceil(row_positions).astype(int)
    within = columns[SAMPLE_COLUMN, after].astype(int)
    # from one regime to the next there is a straight line
    jumps = np.flatnonzero((within == 0) & (row_positions > 0.0))
    within[jumps] = 1
    begin = after - within
    part = row_positions - begin
    columns = columns[: len(result)]
    around = columns.take(begin + _SAMPLE_INDICES[:, None], axis=1, mode="clip")
    np.einsum("kp,ckp->cp", _interpolation_weights(part), around, out=result)
    at_a_row = np.flatnonzero(part == np.rint(part))
    result[:, at_a_row] = columns[:, (begin + part.astype(int))[at_a_row]]
    line, share = begin[jumps], part[jumps]
    result[:, jumps] = (1.0 - share) * columns[:, line] + share * columns[:, line + 1]


#: Coefficients of the polynomial through the values at the places of a step, by those values: in
#: places from its middle, over half of them.
HALF_SAMPLES, _SAMPLE_INDICES = 0.5 * SAMPLES_PER_STEP, np.arange(SAMPLES_PER_STEP + 1)
_INVERSE_VANDERMONDE = np.linalg.inv(
    np.vander(np.linspace(-1.0, 1.0, SAMPLES_PER_STEP + 1), increasing=True)
)
INTERPOLATION_COEFFICIENTS = tuple(tuple(row) for row in _INVERSE_VANDERMONDE.tolist())


def _evaluate_polynomial(x: float, coefficients: Sequence[float]) -> float:
    """Value of a polynomial, by the coefficients of rising powers."""
    value = 0.0
    for coefficient in reversed(coefficients):
        value = coefficient + x * value
    return value


def _interpolation_weights(step_positions: np.ndarray) -> np.ndarray:
    """Weights of the values at the places of a step, a row each, at parts of it in places."""
    return np.asarray(
        _INVERSE_VANDERMONDE.T @ (step_positions / HALF_SAMPLES - 1.0) ** _SAMPLE_INDICES[:, None]
    )
