"""The loop of all motions: step by step through their regimes, until there is something to tell.

Plain Python of a kind that Numba compiles. What takes the steps is a stepper (`steppers`); compiled
or not, with whatever stepper, events are found here. `driver` calls it.

To follow a rupture with a debugger, simulate a scene with ``inertia=True``, because without mass
there is one regime only; with ``engine="scipy"``, or ``engine="python"`` to see inside of steps.
Each step passes `truncate_step` once: a breakpoint there with the condition ``motion.regime == 1``
(`FAST_REGIME`) stops at each step of a rupture, of which ``workspace.point_at_begin`` and
``workspace.point_at_end`` are the points at both ends (columns in the order of
`layout.LOG_SLIP_RATE` and so on). The line ``return REGIME_ENDED`` of `follow_regime` is its end
with the same condition, and its beginning with ``motion.regime == 0`` (`SLOW_REGIME`). `layout`
says who writes which field of ``motion``.
"""

from __future__ import annotations

import math

from rsfstudy.motion.array_layout import (
    END_CODE,
    FAST_REGIME,
    FIRST_STATE,
    FRICTIONAL_STRESS,
    FUNCTIONS_PER_REGIME,
    INVALID_STEP,
    KINK_CODE,
    LOG_SLIP_RATE,
    LOG_SLIP_RATE_GROWTH,
    MOTION_ENDED,
    NORMAL_STRESS_RATIO,
    PAUSED,
    RECORD_WITHIN_STEPS,
    REGIME_CODE,
    REGIME_ENDED,
    SAMPLED_CODE,
    SEGMENT_ENDED,
    SLOW_REGIME,
    SPECIFICATION_COLUMNS,
    SPRING_STRESS,
    START_CODE,
    STEP_TAKEN,
    TERMINATED,
)
from rsfstudy.motion.array_operations import (
    array_as_pointer,
    copy_values,
    evaluate_in_place,
    offset_pointer,
)
from rsfstudy.motion.recording import SAMPLES_PER_STEP
from rsfstudy.motion.regime_switching import (
    CONTINUES,
    SwitchThresholds,
    find_termination_status,
    margin_to_termination,
    may_switch_back_to_slow_manifold,
    should_switch_back_to_slow_manifold,
    starts_on_slow_manifold,
)
from rsfstudy.motion.step_events import (
    SWITCH_CONDITION,
    TERMINATION_CONDITION,
    TIME_CONDITION,
    append_events_in_step,
    append_start_events,
    append_step_end_event,
    has_deferrable_event,
    is_step_recorded,
    locate_sign_change,
    record_regime_start,
    record_step,
    regime_switch_excess,
    slip_since_start,
)
from rsfstudy.motion.step_integration import (
    halve_unresolved_step,
    take_step,
    time_at_step_begin,
    time_at_step_end,
    time_since_regime_start,
    truncate_step_at_clock,
)
from rsfstudy.motion.steppers import begin_regime, retake_step
from rsfstudy.motion.workspace import create_workspace
from rsfstudy.parts import (
    BOUNDARY_PRESSURE_RATE,
    LAW,
    LOAD_VELOCITY,
    LOADING,
    LOG_LOAD_VELOCITY,
    SEGMENT_END,
    SEGMENT_LOG_VELOCITY,
    SEGMENT_START,
    SEGMENT_STRESS_FALL,
    SEGMENT_STRESS_RATE,
    SEGMENT_VELOCITY,
)

#: How often the clock at which a step is to end is looked for.
END_TIME_CORRECTION_COUNT = 2
#: Change of ln V_0 at a kink beyond which the length of steps is found anew: displacement along the
#: path, V + V_0, is then another, and rejected steps would cost more than the first one does.
MAX_LOG_LOAD_RATE_CHANGE = 3.0


def advance_motion(
    motion_memory,
    y,
    last_point,
    workspace_block,
    loop_constants,
    event_specs,
    kinks,
    requested_samples,
    event_table,
    recording_table,
    stepper,
):
    """Follow a motion from where `memory` and `y` are.

    Parameters
    ----------
    motion_memory : array of MOTION, shape (1,)
        The state of the motion.
    y : array
        Unknowns, and behind them their rates.
    last_point : array
        The last point of the regime before; at first, the point at which to begin.
    workspace_block : array
        Memory for the workspace of a regime.
    loop_constants : tuple
        Scales of the unknowns, of which those in a rupture follow those between ruptures; the table
        of functions, a row for each regime; the limits of the regimes; the numbers of the
        scene; and as many that take in what those were before a kink.
    event_specs, requested_samples : array
        Event specifications, one row of numbers after the other, and when to record.
    kinks : array
        The segments of loading that follow on the first without a jump.
    event_table, recording_table : array
        What happens, and what is recorded.
    stepper : Stepper
        What takes the steps.

    Returns
    -------
    int
        Why it returns.
    """
    motion = motion_memory[0]
    motion.event_rows = motion.recorded_rows = 0
    scales, functions, numbers, p, p_before = loop_constants
    y, scales, workspace_block = (
        array_as_pointer(y),
        array_as_pointer(scales),
        array_as_pointer(workspace_block),
    )
    last_point, p, p_before = (
        array_as_pointer(last_point),
        array_as_pointer(p),
        array_as_pointer(p_before),
    )
    limits = SwitchThresholds(*numbers)
    given = (
        array_as_pointer(event_specs),
        len(event_specs) // len(SPECIFICATION_COLUMNS),
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
        own, equations = offset_pointer(scales, first), functions[motion.regime]
        workspace = create_workspace(
            workspace_block, y, unknowns, own, motion.states, equations, given
        )
        end = follow_regime(
            motion, workspace, last_point, requested_samples, event_table, recording_table
        )
        if end == REGIME_ENDED:
            motion.regime = SLOW_REGIME if motion.regime == FAST_REGIME else FAST_REGIME
            motion.pending_start, motion.next_step_length = REGIME_CODE, 0.0
            set_unknowns_of_regime(motion, y, last_point)
        elif end == SEGMENT_ENDED:
            regime, end = motion.regime, REGIME_ENDED
            start_next_segment(motion, workspace, last_point, kinks, recording_table)
            enter_initial_regime(motion, y, last_point, functions, workspace_block, limits, p)
            if motion.regime != regime:
                motion.next_step_length = 0.0
        if end == REGIME_ENDED and (
            motion.must_report
            or are_tables_full(motion, workspace.event_spec_count, event_table, recording_table)
        ):
            motion.must_report, end = 0, PAUSED
    return end


def are_tables_full(motion, event_spec_count, event_table, recording_table):
    """True if the tables have no room for all that one more step may add to them."""
    full = len(event_table) - motion.event_rows < 2 * event_spec_count + 4
    return full or (
        len(recording_table) > 0
        and len(recording_table) - motion.recorded_rows < 2 * SAMPLES_PER_STEP
    )


def start_next_segment(motion, workspace, last_point, kinks, recording_table):
    """Go on to the next segment of loading, whose numbers take the place of those before it."""
    n, p, relief = (
        len(kinks) - motion.kinks_ahead,
        workspace.parameters,
        FIRST_STATE + motion.states - 1 - motion.unknowns_behind_fluid,
    )
    copy_values(workspace.point_at_end, last_point, FIRST_STATE + motion.states)
    motion.slip = slip_since_start(
        motion, motion.end, motion.end_time, last_point[SPRING_STRESS], p
    )
    motion.spring_stress, motion.time, motion.regime_start_time = (
        last_point[SPRING_STRESS],
        kinks[n, SEGMENT_START],
        0.0,
    )
    motion.end_time = kinks[n, SEGMENT_END] - kinks[n, SEGMENT_START]
    motion.pending_start, motion.kinks_ahead = KINK_CODE, motion.kinks_ahead - 1
    if motion.recording_mode == RECORD_WITHIN_STEPS:  # to the last digit, too
        recording_table[motion.recorded_rows - 1, 0] = motion.time
    copy_values(p, workspace.parameters_before, LAW)
    # the length of a step goes on with the motion, unless its path has become quite another
    if not abs(kinks[n, SEGMENT_LOG_VELOCITY] - p[LOG_LOAD_VELOCITY]) < MAX_LOG_LOAD_RATE_CHANGE:
        motion.next_step_length = 0.0
    p[LOAD_VELOCITY], p[LOG_LOAD_VELOCITY] = (
        kinks[n, SEGMENT_VELOCITY],
        kinks[n, SEGMENT_LOG_VELOCITY],
    )
    if not math.isnan(kinks[n, SEGMENT_STRESS_RATE]):
        p[BOUNDARY_PRESSURE_RATE if motion.unknowns_behind_fluid else LOADING] = kinks[
            n, SEGMENT_STRESS_RATE
        ]
        last_point[relief] = kinks[n, SEGMENT_STRESS_FALL]


def enter_initial_regime(
    motion, y, last_point, functions, manifold_values, switch_thresholds, parameters
):
    """Begin in the regime that a point is for; `below` takes in the slow manifold there."""
    motion.starts_at_point, motion.regime = 0, SLOW_REGIME
    set_unknowns_of_regime(motion, y, last_point)
    if motion.has_mass:
        evaluate_in_place(
            functions[SLOW_REGIME, FUNCTIONS_PER_REGIME - 1], y, y, parameters, manifold_values
        )
        if not starts_on_slow_manifold(
            last_point[LOG_SLIP_RATE],
            manifold_values[0],
            last_point[SPRING_STRESS] - manifold_values[1],
            switch_thresholds,
        ):
            motion.regime = FAST_REGIME
            set_unknowns_of_regime(motion, y, last_point)


def set_unknowns_of_regime(motion, y, last_point):
    """Begin a regime at the last point of one before: spring stress, states and time carry over;
    between ruptures ln V and friction follow from these, and jump.
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


def follow_regime(motion, workspace, last_point, requested_samples, event_table, recording_table):
    """Follow one regime; returns why it ends, or why the call has to."""
    if motion.pending_start:
        motion.time_per_step = 0.0
        begin_regime(motion, workspace)
        if motion.pending_start != KINK_CODE:
            motion.dense_output_limit = math.inf
    else:
        copy_values(
            offset_pointer(workspace.y, workspace.unknown_count),
            workspace.rates,
            workspace.unknown_count,
        )
    evaluate_in_place(
        workspace.fill_point,
        workspace.y,
        workspace.rates,
        workspace.parameters,
        workspace.point_at_begin,
    )
    while True:
        taken = take_step(motion, workspace)
        if taken != STEP_TAKEN:
            return taken
        if is_step_recorded(motion, workspace, requested_samples):
            halve_unresolved_step(motion, workspace)
        evaluate_in_place(
            workspace.fill_point,
            workspace.y_end,
            workspace.rates_at_end,
            workspace.parameters,
            workspace.point_at_end,
        )
        if math.isnan(workspace.point_at_end[LOG_SLIP_RATE]):
            return INVALID_STEP
        if motion.may_terminate and not is_step_end_valid(motion, workspace):
            return TERMINATED
        leaves, over = truncate_step_at_regime_or_time_end(motion, workspace)
        if motion.pending_start:
            record_regime_start(motion, workspace, recording_table)
            if append_start_events(motion, workspace, last_point, event_table):
                return MOTION_ENDED
        complete = motion.recording_mode and record_step(
            motion, workspace, recording_table, requested_samples, over
        )
        urgent = append_events_in_step(motion, workspace, event_table)
        if motion.pending_start == START_CODE and not has_deferrable_event(workspace):
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
        if leaves or has_left_rupture(motion, workspace):
            motion.regime_start_time = time_at_step_end(motion, workspace)
            copy_values(workspace.point_at_end, last_point, FIRST_STATE + motion.states)
            return REGIME_ENDED
        if motion.may_terminate and motion.termination != CONTINUES:
            return TERMINATED
        advance_to_step_end(motion, workspace)
        if urgent == 2 or are_tables_full(
            motion, workspace.event_spec_count, event_table, recording_table
        ):
            copy_values(
                workspace.rates,
                offset_pointer(workspace.y, workspace.unknown_count),
                workspace.unknown_count,
            )
            return PAUSED


def is_step_end_valid(motion, workspace):
    """True if a motion does, if only through this step: that then ends where the motion does."""
    columns, velocity = workspace.point_at_end, workspace.parameters[LOAD_VELOCITY]
    motion.final_normal_stress = columns[NORMAL_STRESS_RATIO]
    motion.termination = find_termination_status(
        columns[LOG_SLIP_RATE], motion.final_normal_stress, velocity
    )
    if motion.termination == CONTINUES:
        return True
    at_begin = margin_to_termination(
        workspace.point_at_begin[LOG_SLIP_RATE],
        workspace.point_at_begin[NORMAL_STRESS_RATIO],
        velocity,
    )
    at_end = margin_to_termination(columns[LOG_SLIP_RATE], columns[NORMAL_STRESS_RATIO], velocity)
    if at_begin <= 0.0:
        return False
    truncate_step_at_clock(
        motion,
        workspace,
        locate_sign_change(TERMINATION_CONDITION, at_begin, at_end, motion, workspace),
    )
    return True


def truncate_step_at_regime_or_time_end(motion, workspace):
    """Let the step end where the regime has to be left, and where time is over; whether it is."""
    before, after = (
        regime_switch_excess(motion, workspace, workspace.point_at_begin),
        regime_switch_excess(motion, workspace, workspace.point_at_end),
    )
    leaves = after >= 0.0 > before
    if leaves:
        truncate_step_at_clock(
            motion,
            workspace,
            locate_sign_change(SWITCH_CONDITION, before, after, motion, workspace),
        )
    if motion.time_per_step > 0.0 and motion.end == motion.clock + motion.step_length:
        return leaves, True
    over = time_at_step_end(motion, workspace) >= motion.end_time
    if over:
        motion.target_time = motion.end_time
        at_begin = time_at_step_begin(motion, workspace) - motion.end_time
        at_end = time_at_step_end(motion, workspace) - motion.end_time
        end_step_at_end_time(
            motion,
            workspace,
            locate_sign_change(TIME_CONDITION, at_begin, at_end, motion, workspace),
        )
    return leaves, over


def end_step_at_end_time(motion, workspace, clock):
    """Let the step end where time is over.

    Dense output tells the clock. Where stability limits steps it is far less accurate than their
    ends: the step is taken anew to that clock, and again with what time it was missing.
    """
    for _ in range(END_TIME_CORRECTION_COUNT):
        retake_step(motion, workspace, clock)
        late = time_at_step_end(motion, workspace) - motion.end_time
        clock -= late / time_since_regime_start(motion, workspace, workspace.rates_at_end)
    evaluate_in_place(
        workspace.fill_point,
        workspace.y_end,
        workspace.rates_at_end,
        workspace.parameters,
        workspace.point_at_end,
    )


def has_left_rupture(motion, workspace):
    """True if the full equations have done their work."""
    if motion.regime == SLOW_REGIME or not may_switch_back_to_slow_manifold(
        workspace.point_at_end[LOG_SLIP_RATE], workspace.switch_thresholds
    ):
        return False
    columns, below = workspace.point_at_end, workspace.point_within
    workspace.y_within[0] = columns[SPRING_STRESS]
    for i in range(motion.states):
        workspace.y_within[1 + i] = columns[FIRST_STATE + i]
    evaluate_in_place(
        workspace.fill_balance, workspace.y_within, workspace.y_within, workspace.parameters, below
    )
    missing = columns[SPRING_STRESS] - below[1]
    return should_switch_back_to_slow_manifold(
        columns[LOG_SLIP_RATE],
        columns[LOG_SLIP_RATE_GROWTH],
        below[0],
        missing,
        workspace.switch_thresholds,
    )


def advance_to_step_end(motion, workspace):
    """The end of a step is the beginning of the next."""
    motion.clock = motion.end
    copy_values(workspace.y_end, workspace.y, workspace.unknown_count)
    copy_values(workspace.rates_at_end, workspace.rates, workspace.unknown_count)
    copy_values(workspace.point_at_end, workspace.point_at_begin, FIRST_STATE + motion.states)
