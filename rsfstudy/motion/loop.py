"""The loop of all motions: step by step through their regimes, until there is something to tell.

Plain Python of a kind that Numba compiles. What takes the steps is a stepper (`steppers`); compiled
or not, with whatever stepper, events are found here. `driver` calls it.

To follow a rupture with a debugger, simulate a scene with ``inertia=True``, because without mass
there is one regime only; with ``engine="scipy"``, or ``engine="python"`` to see inside of steps.
Each step passes `truncate_step` once: a breakpoint there with the condition ``motion.regime == 1``
(`FAST_REGIME`) stops at each step of a rupture, of which ``space.point_at_begin`` and
``space.point_at_end`` are the points at both ends (columns in the order of `layout.LOG_SLIP_RATE`
and so on). The line ``return REGIME_ENDED`` of `follow_regime` is its end with the same condition,
and its beginning with ``motion.regime == 0`` (`SLOW_REGIME`). `layout` says who writes which field
of ``motion``.
"""

from __future__ import annotations

import math

from rsfstudy.motion.array_calls import as_pointer, copy_values, evaluate, offset_by
from rsfstudy.motion.layout import (
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
from rsfstudy.motion.recording import SAMPLES_PER_STEP
from rsfstudy.motion.regime_switching import (
    CONTINUES,
    SwitchThresholds,
    find_termination,
    may_switch_back,
    should_switch_back,
    starts_on_manifold,
    termination_margin,
)
from rsfstudy.motion.step_events import (
    SWITCH_CONDITION,
    TERMINATION_CONDITION,
    TIME_CONDITION,
    has_deferrable_event,
    is_step_recorded,
    locate_crossing,
    record_regime_start,
    record_step,
    report_events,
    report_start,
    report_step_end,
    slip_since_start,
    switch_excess,
)
from rsfstudy.motion.steppers import begin, retake
from rsfstudy.motion.steps import (
    halve_unresolved_step,
    regime_time,
    take_step,
    time_at_begin,
    time_at_end,
    truncate_at,
)
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
END_TIME_CORRECTIONS = 2
#: Change of ln V_0 at a kink beyond which the length of steps is found anew: displacement along the
#: path, V + V_0, is then another, and rejected steps would cost more than the first one does.
MAX_LOG_LOAD_RATE_CHANGE = 3.0


def advance(memory, y, last, block, plan, specs, kinks, samples, events, rows, stepper):
    """Follow a motion from where `memory` and `y` are.

    Parameters
    ----------
    memory : array of MOTION, shape (1,)
        The state of the motion.
    y : array
        Unknowns, and behind them their rates.
    last : array
        The last point of the regime before; at first, the point at which to begin.
    block : array
        Memory for the workspace of a regime.
    plan : tuple
        Scales of the unknowns, of which those in a rupture follow those between ruptures; the table
        of functions, a row for each regime; the limits of the regimes; the numbers of the
        scene; and as many that take in what those were before a kink.
    specs, samples : array
        Event specifications, one row of numbers after the other, and when to record.
    kinks : array
        The segments of loading that follow on the first without a jump.
    events, rows : array
        What happens, and what is recorded.
    stepper : Stepper
        What takes the steps.

    Returns
    -------
    int
        Why it returns.
    """
    motion = memory[0]
    motion.event_rows = motion.recorded_rows = 0
    scales, functions, numbers, p, p_before = plan
    y, scales, block = as_pointer(y), as_pointer(scales), as_pointer(block)
    last, p, p_before = as_pointer(last), as_pointer(p), as_pointer(p_before)
    limits = SwitchThresholds(*numbers)
    given = (
        as_pointer(specs),
        len(specs) // len(SPECIFICATION_COLUMNS),
        p,
        p_before,
        limits,
        stepper,
    )
    if motion.starts_at_point:
        enter_initial_regime(motion, y, last, functions, block, limits, p)
    end = REGIME_ENDED
    while end == REGIME_ENDED:
        unknowns, first = motion.unknowns, 0
        if motion.regime == FAST_REGIME:
            unknowns, first = motion.unknowns_fast, motion.unknowns
        own, equations = offset_by(scales, first), functions[motion.regime]
        space = create_workspace(block, y, unknowns, own, motion.states, equations, given)
        end = follow_regime(motion, space, last, samples, events, rows)
        if end == REGIME_ENDED:
            motion.regime = SLOW_REGIME if motion.regime == FAST_REGIME else FAST_REGIME
            motion.pending_start, motion.next_step_length = REGIME_CODE, 0.0
            enter_regime(motion, y, last)
        elif end == SEGMENT_ENDED:
            regime, end = motion.regime, REGIME_ENDED
            enter_segment(motion, space, last, kinks, rows)
            enter_initial_regime(motion, y, last, functions, block, limits, p)
            if motion.regime != regime:
                motion.next_step_length = 0.0
        if end == REGIME_ENDED and (
            motion.must_report or tables_full(motion, space.spec_count, events, rows)
        ):
            motion.must_report, end = 0, PAUSED
    return end


def tables_full(motion, spec_count, events, rows):
    """True if the tables have no room for all that one more step may add to them."""
    full = len(events) - motion.event_rows < 2 * spec_count + 4
    return full or (len(rows) > 0 and len(rows) - motion.recorded_rows < 2 * SAMPLES_PER_STEP)


def enter_segment(motion, space, last, kinks, rows):
    """Go on to the next segment of loading, whose numbers take the place of those before it."""
    n, p, relief = (
        len(kinks) - motion.kinks_ahead,
        space.parameters,
        FIRST_STATE + motion.states - 1 - motion.unknowns_behind_fluid,
    )
    copy_values(space.point_at_end, last, FIRST_STATE + motion.states)
    motion.slip = slip_since_start(motion, motion.end, motion.end_time, last[SPRING_STRESS], p)
    motion.spring_stress, motion.time, motion.regime_start_time = (
        last[SPRING_STRESS],
        kinks[n, SEGMENT_START],
        0.0,
    )
    motion.end_time = kinks[n, SEGMENT_END] - kinks[n, SEGMENT_START]
    motion.pending_start, motion.kinks_ahead = KINK_CODE, motion.kinks_ahead - 1
    if motion.recording_mode == RECORD_WITHIN_STEPS:  # to the last digit, too
        rows[motion.recorded_rows - 1, 0] = motion.time
    copy_values(p, space.parameters_before, LAW)
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
        last[relief] = kinks[n, SEGMENT_STRESS_FALL]


def enter_initial_regime(motion, y, last, functions, manifold, limits, p):
    """Begin in the regime that a point is for; `below` takes in the slow manifold there."""
    motion.starts_at_point, motion.regime = 0, SLOW_REGIME
    enter_regime(motion, y, last)
    if motion.has_mass:
        evaluate(functions[SLOW_REGIME, FUNCTIONS_PER_REGIME - 1], y, y, p, manifold)
        if not starts_on_manifold(
            last[LOG_SLIP_RATE], manifold[0], last[SPRING_STRESS] - manifold[1], limits
        ):
            motion.regime = FAST_REGIME
            enter_regime(motion, y, last)


def enter_regime(motion, y, last):
    """Begin a regime at the last point of one before: spring stress, states and time carry over;
    between ruptures ln V and friction follow from these, and jump.
    """
    y[0] = last[SPRING_STRESS]
    if motion.regime == FAST_REGIME:
        y[1], y[2] = last[LOG_SLIP_RATE], last[FRICTIONAL_STRESS]
        for i in range(1, motion.states):
            y[2 + i] = last[FIRST_STATE + i]
        y[2 + motion.states] = 0.0
    else:
        for i in range(motion.states):
            y[1 + i] = last[FIRST_STATE + i]
        y[1 + motion.states] = 0.0


def follow_regime(motion, space, last, samples, events, rows):
    """Follow one regime; returns why it ends, or why the call has to."""
    if motion.pending_start:
        motion.time_per_step = 0.0
        begin(motion, space)
        if motion.pending_start != KINK_CODE:
            motion.dense_output_limit = math.inf
    else:
        copy_values(offset_by(space.y, space.unknowns), space.rates, space.unknowns)
    evaluate(space.point, space.y, space.rates, space.parameters, space.point_at_begin)
    while True:
        taken = take_step(motion, space)
        if taken != STEP_TAKEN:
            return taken
        if is_step_recorded(motion, space, samples):
            halve_unresolved_step(motion, space)
        evaluate(space.point, space.y_end, space.rates_at_end, space.parameters, space.point_at_end)
        if math.isnan(space.point_at_end[LOG_SLIP_RATE]):
            return INVALID_STEP
        if motion.may_terminate and not is_valid(motion, space):
            return TERMINATED
        leaves, over = truncate_step(motion, space)
        if motion.pending_start:
            record_regime_start(motion, space, rows)
            if report_start(motion, space, last, events):
                return MOTION_ENDED
        complete = motion.recording_mode and record_step(motion, space, rows, samples, over)
        urgent = report_events(motion, space, events)
        if motion.pending_start == START_CODE and not has_deferrable_event(space):
            urgent = max(urgent, 2)
        motion.pending_start = 0
        if urgent == 3:
            return MOTION_ENDED
        if complete:
            urgent = 2
            report_step_end(motion, space, events, SAMPLED_CODE)
        if over and motion.kinks_ahead > 0:
            motion.must_report = int(urgent == 2)
            return SEGMENT_ENDED
        if over:
            report_step_end(motion, space, events, END_CODE)
            return MOTION_ENDED
        if leaves or has_left_rupture(motion, space):
            motion.regime_start_time = time_at_end(motion, space)
            copy_values(space.point_at_end, last, FIRST_STATE + motion.states)
            return REGIME_ENDED
        if motion.may_terminate and motion.termination != CONTINUES:
            return TERMINATED
        accept_step(motion, space)
        if urgent == 2 or tables_full(motion, space.spec_count, events, rows):
            copy_values(space.rates, offset_by(space.y, space.unknowns), space.unknowns)
            return PAUSED


def is_valid(motion, space):
    """True if a motion does, if only through this step: that then ends where the motion does."""
    columns, velocity = space.point_at_end, space.parameters[LOAD_VELOCITY]
    motion.final_normal_stress = columns[NORMAL_STRESS_RATIO]
    motion.termination = find_termination(
        columns[LOG_SLIP_RATE], motion.final_normal_stress, velocity
    )
    if motion.termination == CONTINUES:
        return True
    at_begin = termination_margin(
        space.point_at_begin[LOG_SLIP_RATE], space.point_at_begin[NORMAL_STRESS_RATIO], velocity
    )
    at_end = termination_margin(columns[LOG_SLIP_RATE], columns[NORMAL_STRESS_RATIO], velocity)
    if at_begin <= 0.0:
        return False
    truncate_at(
        motion, space, locate_crossing(TERMINATION_CONDITION, at_begin, at_end, motion, space)
    )
    return True


def truncate_step(motion, space):
    """Let the step end where the regime has to be left, and where time is over; whether it is."""
    before, after = (
        switch_excess(motion, space, space.point_at_begin),
        switch_excess(motion, space, space.point_at_end),
    )
    leaves = after >= 0.0 > before
    if leaves:
        truncate_at(motion, space, locate_crossing(SWITCH_CONDITION, before, after, motion, space))
    if motion.time_per_step > 0.0 and motion.end == motion.clock + motion.step_length:
        return leaves, True
    over = time_at_end(motion, space) >= motion.end_time
    if over:
        motion.target_time = motion.end_time
        at_begin = time_at_begin(motion, space) - motion.end_time
        at_end = time_at_end(motion, space) - motion.end_time
        end_at_time(motion, space, locate_crossing(TIME_CONDITION, at_begin, at_end, motion, space))
    return leaves, over


def end_at_time(motion, space, clock):
    """Let the step end where time is over.

    Dense output tells the clock. Where stability limits steps it is far less accurate than their
    ends: the step is taken anew to that clock, and again with what time it was missing.
    """
    for _ in range(END_TIME_CORRECTIONS):
        retake(motion, space, clock)
        late = time_at_end(motion, space) - motion.end_time
        clock -= late / regime_time(motion, space, space.rates_at_end)
    evaluate(space.point, space.y_end, space.rates_at_end, space.parameters, space.point_at_end)


def has_left_rupture(motion, space):
    """True if the full equations have done their work."""
    if motion.regime == SLOW_REGIME or not may_switch_back(
        space.point_at_end[LOG_SLIP_RATE], space.limits
    ):
        return False
    columns, below = space.point_at_end, space.point_within
    space.y_within[0] = columns[SPRING_STRESS]
    for i in range(motion.states):
        space.y_within[1 + i] = columns[FIRST_STATE + i]
    evaluate(space.balance, space.y_within, space.y_within, space.parameters, below)
    missing = columns[SPRING_STRESS] - below[1]
    return should_switch_back(
        columns[LOG_SLIP_RATE], columns[LOG_SLIP_RATE_GROWTH], below[0], missing, space.limits
    )


def accept_step(motion, space):
    """The end of a step is the beginning of the next."""
    motion.clock = motion.end
    copy_values(space.y_end, space.y, space.unknowns)
    copy_values(space.rates_at_end, space.rates, space.unknowns)
    copy_values(space.point_at_end, space.point_at_begin, FIRST_STATE + motion.states)
