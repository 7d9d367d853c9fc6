"""Recording of samples within a step.

``record_step_samples`` is called by ``motion_loop.integrate_one_regime`` after each step of a
recorded motion. Samples are recorded at even intervals within each step, or at requested times or
slips.
"""

from __future__ import annotations

from rsfstudy.motion.array_layout import (
    APPARENT_FRICTION,
    FIRST_STATE,
    FRICTIONAL_STRESS,
    LOG_SLIP_RATE,
    NORMAL_STRESS_RATIO,
    RECORD_AT_TIMES,
    RECORD_NEVER,
    RECORD_WITHIN_STEPS,
    SPRING_STRESS,
    STATE_VARIABLE,
)
from rsfstudy.motion.integration_step_root_conditions import TIME_CONDITION, locate_sign_change
from rsfstudy.motion.integration_steps import (
    compute_slip_since_motion_start,
    compute_time_at_step_begin,
    compute_time_at_step_end,
    compute_time_since_regime_start,
    evaluate_point_within_step,
)
from rsfstudy.motion.recording import (
    FIRST_STATE_COLUMN,
    REGIME_COLUMN,
    SAMPLE_NUMBER_COLUMN,
    SAMPLES_PER_INTEGRATION_STEP,
)


def record_regime_start(motion, workspace, recording_table):
    """Record the beginning of a regime.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    """
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        append_sample_row(
            motion,
            recording_table,
            motion.clock,
            motion.regime_start_time,
            workspace.point_at_begin,
            workspace.parameters,
        )
        recording_table[motion.recorded_rows - 1, SAMPLE_NUMBER_COLUMN] = 0.0


def should_record_step(motion, workspace, requested_samples):
    """Return True if samples are recorded within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.

    Returns
    -------
    bool
        In the mode ``RECORD_AT_TIMES``, True if the next requested time is before the end of the
        step. In the modes ``RECORD_WITHIN_STEPS`` and ``RECORD_AT_CLOCKS``, always True.
    """
    if motion.recording_mode != RECORD_AT_TIMES:
        return motion.recording_mode != RECORD_NEVER
    end = compute_time_at_step_end(motion, workspace) + motion.time
    return (
        motion.samples_taken < len(requested_samples)
        and requested_samples[motion.samples_taken] < end
    )


def record_step_samples(motion, workspace, recording_table, requested_samples, is_motion_over):
    """Record samples of the step, and return True if they include the last requested sample.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.
    is_motion_over : bool
        True if the motion or the loading segment ends with the step. All requested times up to
        ``motion.end_time`` are then recorded, even if the step ends slightly earlier due to
        rounding errors.

    Returns
    -------
    bool
        True if the last requested sample was recorded in this step.
    """
    if motion.recording_mode == RECORD_WITHIN_STEPS:
        record_evenly_spaced_samples(motion, workspace, recording_table)
        return False
    before = motion.samples_taken
    record_requested_samples(motion, workspace, recording_table, requested_samples, is_motion_over)
    return before < motion.samples_taken == len(requested_samples)


def record_evenly_spaced_samples(motion, workspace, recording_table):
    """Record ``SAMPLES_PER_INTEGRATION_STEP`` samples of the step.

    The last sample is the end of the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    """
    for sample in range(1, SAMPLES_PER_INTEGRATION_STEP):
        clock = motion.clock + (motion.end - motion.clock) * (sample / SAMPLES_PER_INTEGRATION_STEP)
        record_sample_within_step(motion, workspace, recording_table, clock)
        recording_table[motion.recorded_rows - 1, SAMPLE_NUMBER_COLUMN] = sample
    passed = compute_time_at_step_end(motion, workspace)
    append_sample_row(
        motion, recording_table, motion.end, passed, workspace.point_at_end, workspace.parameters
    )
    recording_table[motion.recorded_rows - 1, SAMPLE_NUMBER_COLUMN] = SAMPLES_PER_INTEGRATION_STEP


def record_requested_samples(motion, workspace, recording_table, requested_samples, is_motion_over):
    """Record the requested samples within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.
    is_motion_over : bool
        If True, the function also records the requested times between the end of the step and
        ``motion.end_time``.
    """
    at_begin, at_end = motion.clock, motion.end
    if motion.recording_mode == RECORD_AT_TIMES:
        at_begin = compute_time_at_step_begin(motion, workspace)
        at_end = compute_time_at_step_end(motion, workspace)
    last = motion.end_time if is_motion_over else at_end
    while (
        motion.samples_taken < len(requested_samples)
        and requested_samples[motion.samples_taken] - motion.time <= last
    ):
        asked = requested_samples[motion.samples_taken] - motion.time
        motion.samples_taken += 1
        if asked <= at_begin:
            passed = compute_time_at_step_begin(motion, workspace)
            append_sample_row(
                motion,
                recording_table,
                motion.clock,
                passed,
                workspace.point_at_begin,
                workspace.parameters,
            )
        elif asked >= at_end:
            passed = compute_time_at_step_end(motion, workspace)
            append_sample_row(
                motion,
                recording_table,
                motion.end,
                passed,
                workspace.point_at_end,
                workspace.parameters,
            )
        else:
            clock = asked
            if motion.recording_mode == RECORD_AT_TIMES:
                motion.target_time = asked
                clock = locate_sign_change(
                    TIME_CONDITION, at_begin - asked, at_end - asked, motion, workspace
                )
            record_sample_within_step(motion, workspace, recording_table, clock)


def record_sample_within_step(motion, workspace, recording_table, independent_variable):
    """Record a sample at a value of the independent variable within the step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    independent_variable : float
        Value of the independent variable between the beginning and the end of the step.
    """
    evaluate_point_within_step(motion, workspace, independent_variable)
    passed = motion.regime_start_time + compute_time_since_regime_start(
        motion, workspace, workspace.y_within
    )
    append_sample_row(
        motion,
        recording_table,
        independent_variable,
        passed,
        workspace.point_within,
        workspace.parameters,
    )


def append_sample_row(
    motion, recording_table, independent_variable, time, point_columns, parameters
):
    """Append a point of the motion to the recording table.

    The columns of the new row are in the order of ``recording.pack_point_into_recording_row``.

    Parameters
    ----------
    motion : record
        State of the motion.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    independent_variable : float
        Independent variable at the point.
    time : float
        Time since the start of the loading segment, in D_c/V_*.
    point_columns : array of shape (FIRST_STATE + states,)
        Point of the motion. The column indices are defined in ``array_layout``.
    parameters : array
        Parameters of the scene.
    """
    n = motion.recorded_rows
    recording_table[n, 0] = motion.time + (motion.end_time if time > motion.end_time else time)
    recording_table[n, 1] = compute_slip_since_motion_start(
        motion, independent_variable, time, point_columns[SPRING_STRESS], parameters
    )
    recording_table[n, 2], recording_table[n, 3], recording_table[n, 4] = (
        point_columns[LOG_SLIP_RATE],
        point_columns[SPRING_STRESS],
        point_columns[FRICTIONAL_STRESS],
    )
    recording_table[n, 5], recording_table[n, 6], recording_table[n, 7] = (
        point_columns[NORMAL_STRESS_RATIO],
        point_columns[STATE_VARIABLE],
        point_columns[APPARENT_FRICTION],
    )
    recording_table[n, REGIME_COLUMN], recording_table[n, SAMPLE_NUMBER_COLUMN] = motion.regime, 0.0
    for i in range(motion.states):
        recording_table[n, FIRST_STATE_COLUMN + i] = point_columns[FIRST_STATE + i]
    motion.recorded_rows = n + 1
