"""Functions that start a regime or a loading segment."""

from __future__ import annotations

import math

from rsfstudy.motion.array_layout import (
    FAST_REGIME,
    FIRST_STATE,
    FRICTIONAL_STRESS,
    FUNCTION_TABLE_COLUMN_COUNT,
    KINK_CODE,
    LOG_SLIP_RATE,
    RECORD_WITHIN_STEPS,
    SLOW_REGIME,
    SPRING_STRESS,
)
from rsfstudy.motion.array_operations import copy_values, evaluate_function_into_array
from rsfstudy.motion.integration_steps import compute_slip_since_motion_start
from rsfstudy.motion.regime_switching import can_start_on_slow_manifold
from rsfstudy.parts import (
    BOUNDARY_PRESSURE_RATE,
    LAW,
    LOAD_VELOCITY,
    LOADING,
    LOG_LOAD_VELOCITY,
    SEGMENT_END,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_NOISE_RATE,
    SEGMENT_START,
    SEGMENT_STRESS_FALL,
    SEGMENT_STRESS_RATE,
    SEGMENT_VELOCITY,
)

#: Change in ln V_0 between two loading segments above which the stepper selects a new initial step
#: size. The path length depends on V + V_0, so the step size of the previous segment would be
#: rejected several times.
LOG_VELOCITY_JUMP_RESETTING_STEP_SIZE = 3.0


def start_next_segment(motion, workspace, last_point, later_segments, recording_table):
    """Replace the loading parameters by the parameters of the next segment.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime at the end of the previous segment.
    last_point : array of shape (FIRST_STATE + states,)
        Output array for the last point of the previous segment.
    later_segments : array of shape (segments, 6)
        Segment table rows of all loading segments after the first.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    """
    n, p, relief = (
        len(later_segments) - motion.kinks_ahead,
        workspace.parameters,
        FIRST_STATE + motion.states - 1 - motion.unknowns_behind_fluid,
    )
    copy_values(workspace.point_at_end, last_point, FIRST_STATE + motion.states)
    motion.slip = compute_slip_since_motion_start(
        motion, motion.end, motion.end_time, last_point[SPRING_STRESS], p
    )
    motion.spring_stress, motion.time, motion.regime_start_time = (
        last_point[SPRING_STRESS],
        later_segments[n, SEGMENT_START],
        0.0,
    )
    motion.end_time = later_segments[n, SEGMENT_END] - later_segments[n, SEGMENT_START]
    motion.pending_start, motion.kinks_ahead = KINK_CODE, motion.kinks_ahead - 1
    # The located end of a segment has a rounding error.
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        recording_table[motion.recorded_rows - 1, 0] = motion.time
    copy_values(p, workspace.parameters_before, LAW)
    # The step size remains valid unless the load point velocity changes strongly.
    if (
        not abs(later_segments[n, SEGMENT_LOG_VELOCITY] - p[LOG_LOAD_VELOCITY])
        < LOG_VELOCITY_JUMP_RESETTING_STEP_SIZE
    ):
        motion.next_step_length = 0.0
    p[LOAD_VELOCITY], p[LOG_LOAD_VELOCITY] = (
        later_segments[n, SEGMENT_VELOCITY],
        later_segments[n, SEGMENT_LOG_VELOCITY],
    )
    if not math.isnan(later_segments[n, SEGMENT_STRESS_RATE]):
        p[BOUNDARY_PRESSURE_RATE if motion.unknowns_behind_fluid else LOADING] = later_segments[
            n, SEGMENT_STRESS_RATE
        ]
        last_point[relief] = later_segments[n, SEGMENT_STRESS_FALL]
    if motion.noise_rate_index > 0:
        p[motion.noise_rate_index] = later_segments[n, SEGMENT_NOISE_RATE]


def enter_initial_regime(
    motion, y, last_point, functions, slow_manifold_values, switch_thresholds, parameters
):
    """Choose the regime at the initial point, and set the unknowns of this regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    y : array of shape (2 * unknowns,)
        Output array of the unknowns.
    last_point : array of shape (FIRST_STATE + states,)
        Initial point of the motion or of the loading segment.
    functions : array of shape (2, FUNCTION_TABLE_COLUMN_COUNT)
        Function table with one row per regime.
    slow_manifold_values : array
        Memory for ln(V/V_*) and friction on the slow manifold.
    switch_thresholds : RegimeSwitchThresholds
        Thresholds for changes between the regimes.
    parameters : array
        Parameters of the scene.
    """
    motion.starts_at_point, motion.regime = 0, SLOW_REGIME
    set_initial_unknowns_of_regime(motion, y, last_point)
    if motion.has_mass:
        evaluate_function_into_array(
            functions[SLOW_REGIME, FUNCTION_TABLE_COLUMN_COUNT - 1],
            y,
            y,
            parameters,
            slow_manifold_values,
        )
        if not can_start_on_slow_manifold(
            last_point[LOG_SLIP_RATE],
            slow_manifold_values[0],
            last_point[SPRING_STRESS] - slow_manifold_values[1],
            switch_thresholds,
        ):
            motion.regime = FAST_REGIME
            set_initial_unknowns_of_regime(motion, y, last_point)


def set_initial_unknowns_of_regime(motion, y, last_point):
    """Set the unknowns of a regime from the last point of the previous regime.

    A change of regime does not change the spring stress, the states or the time. If the new regime
    is the slow manifold, ln V and friction may jump, because they are computed from spring stress
    and states.

    Parameters
    ----------
    motion : record
        State of the motion.
    y : array of shape (2 * unknowns,)
        Output array of the unknowns.
    last_point : array of shape (FIRST_STATE + states,)
        Last point of the previous regime.
    """
    y[0] = last_point[SPRING_STRESS]
    if motion.regime == FAST_REGIME:
        y[1], y[2] = last_point[LOG_SLIP_RATE], last_point[FRICTIONAL_STRESS]
        for i in range(1, motion.states):
            y[2 + i] = last_point[FIRST_STATE + i]
        y[2 + motion.states] = 0.0
    else:
        for i in range(motion.states):
            y[1 + i] = last_point[FIRST_STATE + i]
        y[1 + motion.states] = 0.0
