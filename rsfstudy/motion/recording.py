"""Classes and functions that record a motion as a table of samples.

The event loop fills blocks of rows, which ``motion_driver`` appends to a ``MotionRecorder``.
``MotionRecorder.as_table`` converts the blocks to a table. ``resample_along_path`` reduces the
table to a fixed number of points for plots and files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from rsfstudy.motion.integration_events import Event
from rsfstudy.slider import MotionPoint, Scene

#: Names of the first columns of a recorded motion.
MOTION_VARIABLE_NAMES = (
    "time",
    "slip",
    "log10_slip_rate",
    "shear_stress",
    "frictional_stress",
    "normal_stress_ratio",
    "state_variable",
)
#: Columns of the spring stress and the frictional stress in a recorded motion.
SPRING_AND_FRICTIONAL_STRESS_COLUMNS = slice(
    MOTION_VARIABLE_NAMES.index("shear_stress"),
    MOTION_VARIABLE_NAMES.index("frictional_stress") + 1,
)
#: Names of all recorded variables. The last variable is the apparent friction that a rig measures.
RECORDED_VARIABLE_NAMES = (*MOTION_VARIABLE_NAMES, "friction_coefficient")
#: Columns after the recorded variables: the regime, the sample number within the step, and the
#: first state. The sample number is 0 at the beginning of a regime and
#: ``SAMPLES_PER_INTEGRATION_STEP`` at the end of each step.
REGIME_COLUMN, SAMPLE_NUMBER_COLUMN, FIRST_STATE_COLUMN = range(
    len(RECORDED_VARIABLE_NAMES), len(RECORDED_VARIABLE_NAMES) + 3
)
#: Number of samples per integration step. With this number of samples, the interpolating polynomial
#: looks smooth in plots.
SAMPLES_PER_INTEGRATION_STEP = 6


@dataclass
class MotionRecorder:
    """Recorder of a motion.

    Parameters
    ----------
    regime_names : list of str, optional
        Names of the regimes in the order of their first occurrence.
    sample_times : ndarray, optional
        Requested times in D_c/V_*, in increasing order. For a rigid slider, pass the requested
        values of slip in D_c. If a loading segment begins at a requested time, the end of the
        previous segment is recorded. By default, samples are recorded at even intervals within each
        step.
    """

    #: Names of the first columns of a recorded motion, and of all recorded variables.
    MOTION_VARIABLE_NAMES: ClassVar = MOTION_VARIABLE_NAMES
    RECORDED_VARIABLE_NAMES: ClassVar = RECORDED_VARIABLE_NAMES
    #: Columns after the recorded variables.
    REGIME_COLUMN_INDEX: ClassVar = REGIME_COLUMN
    SAMPLE_NUMBER_COLUMN_INDEX: ClassVar = SAMPLE_NUMBER_COLUMN
    FIRST_STATE_COLUMN_INDEX: ClassVar = FIRST_STATE_COLUMN

    regime_names: list[str] = field(default_factory=list)
    sample_times: np.ndarray | None = None
    _row_blocks: list[np.ndarray] = field(default_factory=list)
    _time_capped_block_count: int = 0

    def get_or_add_regime_index(self, regime_name: str) -> int:
        """Return the index of a regime, and add the regime to the list if it is new.

        Parameters
        ----------
        regime_name : str
            Name of the regime.

        Returns
        -------
        int
            Index of the regime in ``regime_names``.
        """
        if regime_name not in self.regime_names:
            self.regime_names.append(regime_name)
        return self.regime_names.index(regime_name)

    def list_unrecorded_sample_times(self) -> np.ndarray:
        """Return the requested times that have not been recorded yet.

        Returns
        -------
        ndarray
            Remaining times or slips.
        """
        assert self.sample_times is not None
        return np.asarray(self.sample_times, dtype=float)[sum(map(len, self._row_blocks)) :]

    def append_rows(self, rows: np.ndarray, regime_names: Sequence[str]) -> None:
        """Append rows of the recording table of the event loop.

        Parameters
        ----------
        rows : ndarray
            Rows of the recording table. The method may change the array in place.
        regime_names : sequence of str
            Names of the regimes in the order of their numbers in ``rows``.
        """
        if self.sample_times is not None and not np.isnan(rows[0, 0]):
            rows[:, 0] = self.sample_times[
                len(self.sample_times) - len(self.list_unrecorded_sample_times()) :
            ][: len(rows)]
        numbers = [self.get_or_add_regime_index(name) for name in regime_names]
        if numbers != list(range(len(numbers))):
            rows[:, REGIME_COLUMN] = np.array(numbers)[rows[:, REGIME_COLUMN].astype(int)]
        self._row_blocks.append(rows)

    def cap_recorded_times_at(self, end_time: float) -> None:
        """Replace recorded times that exceed the end time of a chain of loading segments.

        Parameters
        ----------
        end_time : float
            End time of the segment chain. The method assigns this time to the last recorded row.
        """
        if self.sample_times is not None:
            return
        for rows in self._row_blocks[self._time_capped_block_count :]:
            np.minimum(rows[:, 0], end_time, out=rows[:, 0])
        if self._time_capped_block_count < len(self._row_blocks):
            self._row_blocks[-1][-1:, 0] = end_time
        self._time_capped_block_count = len(self._row_blocks)

    def as_table(self, scene: Scene, end_event: Event | None = None) -> np.ndarray:
        """Return the recorded motion as a table.

        Parameters
        ----------
        scene : Scene
            Scene of the motion.
        end_event : Event, optional
            Event at which the table ends. By default, the table contains all samples.

        Returns
        -------
        ndarray
            Table with one row per sample. The columns are ``RECORDED_VARIABLE_NAMES``, the regime,
            the sample number, and the states that all loading segments have in common.
        """
        rows = self._row_blocks or [np.empty((0, FIRST_STATE_COLUMN + scene.state_count))]
        columns = min(part.shape[1] for part in rows)
        table = np.concatenate([part[:, :columns] for part in rows])
        if end_event is not None:
            last = pack_point_into_recording_row(
                end_event.time,
                end_event.slip,
                end_event.point,
                self.get_or_add_regime_index(end_event.regime),
            )
            table = truncate_recording_at_row(table, np.array(last[:columns]))
        return convert_recorded_rows_to_output_units(scene, table)

    def as_table_up_to_row(self, scene: Scene, last_row: np.ndarray) -> np.ndarray:
        """Return the recorded motion up to a row within an integration step.

        Parameters
        ----------
        scene : Scene
            Scene of the motion.
        last_row : ndarray
            Last row of the table, from ``recorded_row``.

        Returns
        -------
        ndarray
            Table with one row per sample.
        """
        return truncate_recording_at_row(self.as_table(scene), last_row)

    @staticmethod
    def convert_point_to_row(
        scene: Scene, time: float, slip: float, point: MotionPoint, regime_index: int
    ) -> np.ndarray:
        """Convert a point of the motion to a row of ``MotionRecorder.as_table``.

        Parameters
        ----------
        scene : Scene
            Scene of the motion.
        time, slip : float
            Time in D_c/V_* and slip in D_c since the start.
        point : MotionPoint
            Point to convert.
        regime_index : int
            Index of the regime.

        Returns
        -------
        ndarray
            Row in the units of recorded motions. The sample number of the row is 0.
        """
        return convert_recorded_rows_to_output_units(
            scene, np.array(pack_point_into_recording_row(time, slip, point, regime_index))
        )

    @staticmethod
    def get_friction_coefficient(recorded_rows: np.ndarray) -> np.ndarray:
        """Return the apparent friction coefficient along a recorded motion.

        Parameters
        ----------
        recorded_rows : ndarray
            Rows of a recorded motion.

        Returns
        -------
        ndarray
            Friction coefficient of each row.
        """
        return recorded_rows[:, RECORDED_VARIABLE_NAMES.index("friction_coefficient")]

    @staticmethod
    def compute_load_point_displacement(scene: Scene, recorded_rows: np.ndarray) -> np.ndarray:
        """Compute the load point displacement along a recorded motion.

        The displacement is the sum of the slip and the elongation of the spring. The displacement
        is zero before the first loading step.

        Parameters
        ----------
        scene : Scene
            Scene of the motion.
        recorded_rows : ndarray
            Rows of a recorded motion.

        Returns
        -------
        ndarray
            Displacement of each row, in D_c.
        """
        longer = (
            recorded_rows[:, MOTION_VARIABLE_NAMES.index("shear_stress")] - scene.mu_star
        ) / scene.stiffness
        return np.asarray(recorded_rows[:, MOTION_VARIABLE_NAMES.index("slip")] + longer)


def convert_recorded_rows_to_output_units(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """Convert recorded rows in place from event loop units to output units.

    Natural logarithms of slip rates are converted to decimal logarithms, and stress deviations are
    converted to total stresses.

    Parameters
    ----------
    scene : Scene
        Scene of the motion.
    rows : ndarray
        Rows of the recording table of the loop.

    Returns
    -------
    ndarray
        The array ``rows``.
    """
    rows[..., 2] /= math.log(10.0)
    rows[..., SPRING_AND_FRICTIONAL_STRESS_COLUMNS] += scene.mu_star
    return rows


def pack_point_into_recording_row(
    time: float, slip: float, point: MotionPoint, regime_number: int
) -> tuple[float, ...]:
    """Convert a point of the motion to a row of the recording table.

    Parameters
    ----------
    time, slip : float
        Time in D_c/V_* and slip in D_c since the start.
    point : MotionPoint
        Point to record.
    regime_number : int
        Index of the regime.

    Returns
    -------
    tuple of float
        Row in the units of the event loop. The sample number of the row is 0.
    """
    stresses = point.spring_stress, point.frictional_stress, point.normal_stress
    return (
        *(time, slip, point.log_slip_rate, *stresses, point.state, point.apparent_friction),
        *(regime_number, 0.0, *point.psis),
    )


def truncate_recording_at_row(recorded_rows: np.ndarray, last_row: np.ndarray) -> np.ndarray:
    """Truncate a recorded motion at a row within an integration step.

    The samples of the truncated step are replaced by evenly spaced samples up to the last row. The
    position of the last row within the step is computed from the time of the row.

    Parameters
    ----------
    recorded_rows : ndarray
        Recorded motion. The function may change it in place.
    last_row : ndarray
        Last row of the truncated motion.

    Returns
    -------
    ndarray
        Truncated motion.
    """
    after = int(recorded_rows[:, 0].searchsorted(last_row[0]))
    place = int(recorded_rows[after, SAMPLE_NUMBER_COLUMN]) if after < len(recorded_rows) else 0
    begin = after - place
    # If the recording ends before the end of the step, no samples need to be replaced.
    if not place or begin + SAMPLES_PER_INTEGRATION_STEP >= len(recorded_rows):
        return np.vstack([recorded_rows[:after], last_row])
    part, times = float(place), recorded_rows[begin : begin + SAMPLES_PER_INTEGRATION_STEP + 1, 0]
    if times[place] > last_row[0] > times[place - 1]:
        late = (_INVERSE_VANDERMONDE_MATRIX @ (times - last_row[0])).tolist()
        sides = (place - 1.0) / HALF_SAMPLES - 1.0, place / HALF_SAMPLES - 1.0
        if _evaluate_polynomial(sides[0], late) < 0.0 < _evaluate_polynomial(sides[1], late):
            part = HALF_SAMPLES * (1.0 + brentq(_evaluate_polynomial, *sides, args=(late,)))
    within = part / SAMPLES_PER_INTEGRATION_STEP * _SAMPLE_INDICES[1:-1]
    step = recorded_rows[begin + 1 : begin + SAMPLES_PER_INTEGRATION_STEP + 1]
    step[:-1], step[-1] = (
        _compute_interpolation_weights(within).T
        @ recorded_rows[begin : begin + SAMPLES_PER_INTEGRATION_STEP + 1],
        last_row,
    )
    step[:, REGIME_COLUMN], step[:, SAMPLE_NUMBER_COLUMN] = (
        last_row[REGIME_COLUMN],
        _SAMPLE_INDICES[1:],
    )
    return recorded_rows[: begin + SAMPLES_PER_INTEGRATION_STEP + 1]


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
    """Resample a recorded motion at points along its path.

    Changes in time, ln V and stress contribute half of the path length. The other half of the path
    length is proportional to the number of rows. The points closest to extrema of slip rate and
    stress are moved to the extrema.

    Parameters
    ----------
    columns : array of shape (columns, rows)
        Columns of the recorded motion.
    time, log_slip_rate, stress : array of shape (rows,)
        Columns that define the path length.
    step_sample_numbers : array of shape (rows,)
        Sample numbers within the steps.
    path_lengths : array of shape (rows,)
        Output array for the path length at each row. All initial values must be 0.
    row_positions : array of shape (points,)
        Output array for the fractional row numbers of the points.
    work_array : array of shape (SAMPLES_PER_STEP + 1,)
        Memory for intermediate results.
    result : array of shape (result columns, points)
        Output array. Row ``i`` contains the resampled values of column ``i``. The output array may
        have fewer rows than there are columns.
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
        move_nearest_row_position_to(
            row_positions,
            find_fractional_row_of_extremum(values, step_sample_numbers, top, work_array),
        )
        move_nearest_row_position_to(
            row_positions,
            find_fractional_row_of_extremum(values, step_sample_numbers, bottom, work_array),
        )
    interpolate_at_fractional_rows(columns, row_positions, result)


def move_nearest_row_position_to(row_positions: Any, target_position: float) -> None:
    """Replace the nearest interior row position by a given row position.

    Parameters
    ----------
    row_positions : array
        Increasing row positions. The first and last positions are never replaced.
    target_position : float
        Row position to insert.
    """
    nearest = 1
    while nearest < len(row_positions) - 2 and abs(
        row_positions[nearest + 1] - target_position
    ) <= abs(row_positions[nearest] - target_position):
        nearest += 1
    if nearest < len(row_positions) - 1:
        row_positions[nearest] = target_position


def find_fractional_row_of_extremum(
    column_values: Any, step_sample_numbers: Any, extreme_row: int, work_array: Any
) -> float:
    """Find the fractional row number of an extremum.

    The function interpolates the samples of a step with a polynomial, and finds the extremum of the
    polynomial by Newton's method.

    Parameters
    ----------
    column_values : array of shape (rows,)
        Column of a recorded motion.
    step_sample_numbers : array of shape (rows,)
        Sample numbers within the steps.
    extreme_row : int
        Row with the largest or smallest value.
    work_array : array of shape (SAMPLES_PER_STEP + 1,)
        Memory for the coefficients of the polynomial.

    Returns
    -------
    float
        Fractional row number. If the polynomial has no extremum near ``extreme_row``, the result is
        ``extreme_row``.
    """
    for after in (
        extreme_row,
        extreme_row + 1,
    ):  # The row belongs to the first step, and the second step may begin at the row.
        begin = after - int(step_sample_numbers[after]) if after < len(column_values) else after
        if begin == after or begin + SAMPLES_PER_INTEGRATION_STEP >= len(column_values):
            continue
        for power in range(SAMPLES_PER_INTEGRATION_STEP + 1):
            work_array[power] = 0.0
            for k in range(SAMPLES_PER_INTEGRATION_STEP + 1):
                work_array[power] += SAMPLE_INTERPOLATION_COEFFICIENTS[power][k] * (
                    column_values[begin + k] - column_values[extreme_row]
                )
        at = (extreme_row - begin) / HALF_SAMPLES - 1.0
        for _ in range(4):
            slope = bend = 0.0
            for power in range(SAMPLES_PER_INTEGRATION_STEP, 1, -1):
                slope = slope * at + power * work_array[power]
                bend = bend * at + power * (power - 1) * work_array[power]
            slope = slope * at + work_array[1]
            at -= slope / bend if bend != 0.0 else 0.0
        place = HALF_SAMPLES * (1.0 + at)
        if (
            abs(place - (extreme_row - begin)) < 1.0
            and 0.0 <= place <= SAMPLES_PER_INTEGRATION_STEP
        ):
            return begin + place
    return float(extreme_row)


def interpolate_at_fractional_rows(
    columns: np.ndarray, row_positions: np.ndarray, result: np.ndarray
) -> None:
    """Interpolate columns at fractional row numbers.

    Within a step, the function evaluates the polynomial through the samples of the step. Between
    two regimes, the function interpolates linearly. In compiled code,
    ``compiled.array_operations.interpolate_at_fractional_rows`` replaces this function.

    Parameters
    ----------
    columns : array of shape (columns, rows)
        Columns of the recorded motion.
    row_positions : array of shape (points,)
        Fractional row numbers.
    result : array of shape (result columns, points)
        Output array. Row ``i`` contains the interpolated values of column ``i``. The output array
        may have fewer rows than there are columns.
    """
    columns, row_positions, result = map(np.asarray, (columns, row_positions, result))
    after = np.ceil(row_positions).astype(int)
    within = columns[SAMPLE_NUMBER_COLUMN, after].astype(int)
    # Between two regimes, the interpolation is linear.
    jumps = np.flatnonzero((within == 0) & (row_positions > 0.0))
    within[jumps] = 1
    begin = after - within
    part = row_positions - begin
    columns = columns[: len(result)]
    around = columns.take(begin + _SAMPLE_INDICES[:, None], axis=1, mode="clip")
    np.einsum("kp,ckp->cp", _compute_interpolation_weights(part), around, out=result)
    at_a_row = np.flatnonzero(part == np.rint(part))
    result[:, at_a_row] = columns[:, (begin + part.astype(int))[at_a_row]]
    line, share = begin[jumps], part[jumps]
    result[:, jumps] = (1.0 - share) * columns[:, line] + share * columns[:, line + 1]


#: Coefficients of the interpolation within a step. The variable of the polynomial is -1 at the
#: beginning of the step and 1 at its end. ``SAMPLE_INTERPOLATION_COEFFICIENTS[power][k]`` is the
#: contribution of sample ``k`` to the coefficient of ``power``.
HALF_SAMPLES, _SAMPLE_INDICES = (
    0.5 * SAMPLES_PER_INTEGRATION_STEP,
    np.arange(SAMPLES_PER_INTEGRATION_STEP + 1),
)
_INVERSE_VANDERMONDE_MATRIX = np.linalg.inv(
    np.vander(np.linspace(-1.0, 1.0, SAMPLES_PER_INTEGRATION_STEP + 1), increasing=True)
)
SAMPLE_INTERPOLATION_COEFFICIENTS = tuple(
    tuple(row) for row in _INVERSE_VANDERMONDE_MATRIX.tolist()
)


def _evaluate_polynomial(x: float, coefficients: Sequence[float]) -> float:
    """Evaluate a polynomial. The coefficients are in order of increasing powers."""
    value = 0.0
    for coefficient in reversed(coefficients):
        value = coefficient + x * value
    return value


def _compute_interpolation_weights(positions_within_step: np.ndarray) -> np.ndarray:
    """Compute the interpolation weights of the samples of a step, one row per sample."""
    return np.asarray(
        _INVERSE_VANDERMONDE_MATRIX.T
        @ (positions_within_step / HALF_SAMPLES - 1.0) ** _SAMPLE_INDICES[:, None]
    )
