"""Event loop that integrates a motion through regimes and loading segments.

``motion_driver.MotionDriver.iterate_events`` calls ``advance_motion`` until the motion ends. The
functions are called in the following order::

    advance_motion                     integrate until the motion ends or a table is full
        enter_initial_regime           choose the regime of the initial point
        integrate_one_regime           integrate one regime within one loading segment
            begin_integration_of_regime  let the stepper evaluate the first derivatives
            take_step                  attempt steps until the error of one step is small enough
            halve_step_until_dense_output_is_accurate  improve dense output of recorded steps
            is_step_end_valid          check for the end of the motion, e.g. vanishing normal stress
            truncate_step_at_end_of_regime_or_segment
            record_regime_start        first step only
            append_start_events        first step only
            record_step_samples        append the samples of the step to ``recording_table``
            append_events_in_step      append the events of the step to ``event_table``
            has_rupture_regime_ended   check the return to the slow manifold
            move_step_begin_to_step_end  copy the end of the step to the beginning of the next step
        set_initial_unknowns_of_regime  after a change of regime
        start_next_segment             after the end of a loading segment
        enter_initial_regime           after the end of a loading segment

The functions that start regimes and segments are in ``regime_starts``. The functions that take a
step, end a step, record samples and detect events are in ``integration_steps``,
``integration_step_truncation``, ``integration_step_samples`` and ``integration_step_events``,
respectively.

The docstring of the module ``array_layout`` lists the functions that write each field of
``motion``. The class ``Workspace`` describes the arrays of a regime. The docstring of the module
``workspace`` lists the functions that write these arrays. Steppers only take integration steps. The
event loop detects and locates the events in the same way for all steppers.

The code of these modules is limited to Python features that Numba can compile. To debug a rupture,
simulate a scene with ``inertia=True`` and ``engine="scipy"``. To debug the stages of an integration
step, use ``engine="python"`` instead. Set a breakpoint in
``integration_step_truncation.truncate_step_at_end_of_regime_or_segment`` with the condition
``motion.regime == 1`` (``FAST_REGIME``). The debugger then stops once in every step of the rupture.
The arrays ``workspace.point_at_begin`` and ``workspace.point_at_end`` contain the points of the
motion at both ends of the step. The constant ``array_layout.LOG_SLIP_RATE`` and the constants
defined after it are the column indices of these arrays. To stop at the end of a rupture, set a
breakpoint with the same condition at ``return REGIME_ENDED`` in ``integrate_one_regime``. To stop
at the beginning of a rupture, set a breakpoint at ``return REGIME_ENDED`` with the condition
``motion.regime == 0``.
"""

from __future__ import annotations

import math

from rsfstudy.motion.array_layout import (
    END_CODE,
    EVENT_SPECIFICATION_COLUMNS,
    FAST_REGIME,
    FIRST_STATE,
    INVALID_STEP,
    KINK_CODE,
    LOG_SLIP_RATE,
    MOTION_ENDED,
    PAUSED,
    REGIME_CODE,
    REGIME_ENDED,
    SAMPLED_CODE,
    SEGMENT_ENDED,
    SLOW_REGIME,
    START_CODE,
    STEP_TAKEN_CODE,
    TERMINATED,
)
from rsfstudy.motion.array_operations import (
    advance_pointer_by_items,
    convert_array_to_pointer,
    copy_values,
    evaluate_function_into_array,
)
from rsfstudy.motion.integration_step_events import (
    append_events_in_step,
    append_regime_or_segment_start_events,
    append_step_end_event,
)
from rsfstudy.motion.integration_step_root_conditions import may_any_event_be_reported_later
from rsfstudy.motion.integration_step_samples import (
    record_regime_start,
    record_step_samples,
    should_record_step,
)
from rsfstudy.motion.integration_step_truncation import (
    has_rupture_regime_ended,
    is_step_end_valid,
    truncate_step_at_end_of_regime_or_segment,
)
from rsfstudy.motion.integration_steps import (
    compute_time_at_step_end,
    halve_step_until_dense_output_is_accurate,
    take_step,
)
from rsfstudy.motion.recording import SAMPLES_PER_INTEGRATION_STEP
from rsfstudy.motion.regime_starts import (
    enter_initial_regime,
    set_initial_unknowns_of_regime,
    start_next_segment,
)
from rsfstudy.motion.regime_switching import CONTINUES, RegimeSwitchThresholds
from rsfstudy.motion.steppers import begin_integration_of_regime
from rsfstudy.motion.workspace import create_workspace


def advance_motion(
    motion_state_array,
    y,
    last_point,
    workspace_block,
    loop_constants,
    event_specs,
    later_segments,
    requested_samples,
    event_table,
    recording_table,
    stepper,
):
    """Advance a motion until it ends, or until its events must be reported.

    Parameters
    ----------
    motion_state_array : array of MOTION_STATE_DTYPE, shape (1,)
        State of the motion. The loop updates it in place.
    y : array of shape (2 * unknowns,)
        Unknowns, followed by their derivatives. The loop updates both in place.
    last_point : array of shape (FIRST_STATE + states,)
        Last point of the motion in the previous regime. In the first call, pass the initial point
        of the motion.
    workspace_block : array
        Memory for the workspace of a regime. See ``workspace.compute_workspace_size``.
    loop_constants : tuple
        Five items: the scales of the unknowns of both regimes, the function table with one row per
        regime, the switch thresholds, the parameters of the scene, and memory for the parameters
        before the last kink.
    event_specs : array of shape (specifications * 7,)
        Event specifications. The columns are ``array_layout.EVENT_SPECIFICATION_COLUMNS``.
    later_segments : array of shape (segments, 6)
        Segment table rows of all loading segments after the first.
    requested_samples : array
        Times or slips at which to record the motion.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.
    stepper : Stepper
        Stepper of the motion. The compiled loop does not use it.

    Returns
    -------
    int
        Return code, for example ``PAUSED`` or ``MOTION_ENDED``. After ``PAUSED``, the caller reads
        the tables and calls the function again. If the scene has noise, the loop also pauses at the
        start of the last segment, so that the caller can append the next segments.
    """
    motion = motion_state_array[0]
    motion.event_rows = motion.recorded_rows = 0
    scales, functions, numbers, p, p_before = loop_constants
    y, scales, workspace_block = (
        convert_array_to_pointer(y),
        convert_array_to_pointer(scales),
        convert_array_to_pointer(workspace_block),
    )
    last_point, p, p_before = (
        convert_array_to_pointer(last_point),
        convert_array_to_pointer(p),
        convert_array_to_pointer(p_before),
    )
    limits = RegimeSwitchThresholds(*numbers)
    given = (
        convert_array_to_pointer(event_specs),
        len(event_specs) // len(EVENT_SPECIFICATION_COLUMNS),
        p,
        p_before,
        limits,
        stepper,
    )
    if motion.starts_at_point:
        enter_initial_regime(motion, y, last_point, functions, workspace_block, limits, p)
    end = REGIME_ENDED
    while end == REGIME_ENDED:
        unknowns, first = motion.unknowns, 0
        if motion.regime == FAST_REGIME:
            unknowns, first = motion.unknowns_fast, motion.unknowns
        own, equations = advance_pointer_by_items(scales, first), functions[motion.regime]
        workspace = create_workspace(
            workspace_block, y, unknowns, own, motion.states, equations, given
        )
        end = integrate_one_regime(
            motion, workspace, last_point, requested_samples, event_table, recording_table
        )
        if end == REGIME_ENDED:
            motion.regime = SLOW_REGIME if motion.regime == FAST_REGIME else FAST_REGIME
            motion.pending_start, motion.next_step_length = REGIME_CODE, 0.0
            set_initial_unknowns_of_regime(motion, y, last_point)
        elif end == SEGMENT_ENDED:
            regime, end = motion.regime, REGIME_ENDED
            start_next_segment(motion, workspace, last_point, later_segments, recording_table)
            enter_initial_regime(motion, y, last_point, functions, workspace_block, limits, p)
            if motion.regime != regime:
                motion.next_step_length = 0.0
        if end == REGIME_ENDED and (
            motion.must_report
            or (motion.noise_rate_index > 0 and motion.kinks_ahead == 0)
            or are_output_tables_nearly_full(
                motion, workspace.event_spec_count, event_table, recording_table
            )
        ):
            motion.must_report, end = 0, PAUSED
    return end


def are_output_tables_nearly_full(motion, event_spec_count, event_table, recording_table):
    """Return True if the output tables may be too small for one more step.

    Parameters
    ----------
    motion : record
        State of the motion.
    event_spec_count : int
        Number of event specifications.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.

    Returns
    -------
    bool
        True if a table has fewer free rows than a single step may require.
    """
    full = len(event_table) - motion.event_rows < 2 * event_spec_count + 4
    return full or (
        len(recording_table) > 0
        and len(recording_table) - motion.recorded_rows < 2 * SAMPLES_PER_INTEGRATION_STEP
    )


def integrate_one_regime(
    motion, workspace, last_point, requested_samples, event_table, recording_table
):
    """Integrate one regime, and return a code for the reason why it ended.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    last_point : array of shape (FIRST_STATE + states,)
        Last point of the previous regime. If the regime ends, the function overwrites the array
        with the last point of the regime.
    requested_samples : array
        Times in D_c/V_* or slips in D_c at which to record the motion, in increasing order.
    event_table : array of shape (rows, EVENT_POINT + FIRST_STATE + states)
        Output table of events.
    recording_table : array of shape (rows, FIRST_STATE_COLUMN + states)
        Output table of recorded samples.

    Returns
    -------
    int
        ``REGIME_ENDED``, ``SEGMENT_ENDED``, ``MOTION_ENDED``, ``TERMINATED``, ``PAUSED``, or the
        return code of a failed step. See ``integration_steps.take_step``.
    """
    if motion.pending_start:
        motion.time_per_step = 0.0
        begin_integration_of_regime(motion, workspace)
        if motion.pending_start != KINK_CODE:
            motion.dense_output_limit = math.inf
    else:
        copy_values(
            advance_pointer_by_items(workspace.y, workspace.unknown_count),
            workspace.rates,
            workspace.unknown_count,
        )
    evaluate_function_into_array(
        workspace.functions.fill_motion_point,
        workspace.y,
        workspace.rates,
        workspace.parameters,
        workspace.point_at_begin,
    )
    while True:
        taken = take_step(motion, workspace)
        if taken != STEP_TAKEN_CODE:
            return taken
        if should_record_step(motion, workspace, requested_samples):
            halve_step_until_dense_output_is_accurate(motion, workspace)
        evaluate_function_into_array(
            workspace.functions.fill_motion_point,
            workspace.y_end,
            workspace.rates_at_end,
            workspace.parameters,
            workspace.point_at_end,
        )
        if math.isnan(workspace.point_at_end[LOG_SLIP_RATE]):
            return INVALID_STEP
        if motion.may_terminate and not is_step_end_valid(motion, workspace):
            return TERMINATED
        leaves, over = truncate_step_at_end_of_regime_or_segment(motion, workspace)
        if motion.pending_start:
            record_regime_start(motion, workspace, recording_table)
            if append_regime_or_segment_start_events(motion, workspace, last_point, event_table):
                return MOTION_ENDED
        complete = motion.recording_mode and record_step_samples(
            motion, workspace, recording_table, requested_samples, over
        )
        urgent = append_events_in_step(motion, workspace, event_table)
        if motion.pending_start == START_CODE and not may_any_event_be_reported_later(workspace):
            urgent = max(urgent, 2)
        motion.pending_start = 0
        if urgent == 3:
            return MOTION_ENDED
        if complete:
            urgent = 2
            append_step_end_event(motion, workspace, event_table, SAMPLED_CODE)
        if over and motion.kinks_ahead > 0:
            motion.must_report = int(urgent == 2)
            return SEGMENT_ENDED
        if over:
            append_step_end_event(motion, workspace, event_table, END_CODE)
            return MOTION_ENDED
        if leaves or has_rupture_regime_ended(motion, workspace):
            motion.regime_start_time = compute_time_at_step_end(motion, workspace)
            copy_values(workspace.point_at_end, last_point, FIRST_STATE + motion.states)
            return REGIME_ENDED
        if motion.may_terminate and motion.termination != CONTINUES:
            return TERMINATED
        move_step_begin_to_step_end(motion, workspace)
        if urgent == 2 or are_output_tables_nearly_full(
            motion, workspace.event_spec_count, event_table, recording_table
        ):
            copy_values(
                workspace.rates,
                advance_pointer_by_items(workspace.y, workspace.unknown_count),
                workspace.unknown_count,
            )
            return PAUSED


def move_step_begin_to_step_end(motion, workspace):
    """Copy the end of the step to the beginning of the next step.

    Parameters
    ----------
    motion : record
        State of the motion.
    workspace : Workspace
        Arrays of the regime.
    """
    motion.clock = motion.end
    copy_values(workspace.y_end, workspace.y, workspace.unknown_count)
    copy_values(workspace.rates_at_end, workspace.rates, workspace.unknown_count)
    copy_values(workspace.point_at_end, workspace.point_at_begin, FIRST_STATE + motion.states)
