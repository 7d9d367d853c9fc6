"""Layout of the numbers of the loop of motions: the state of a motion, and its tables.

Who writes the fields of the state of a motion (`MOTION`), and when:

    end_time, time, slip, spring_stress  running.MotionDriver.run as it starts;
                                         loop.enter_segment at each kink
    tolerance, step_limit_factor,
    direction, budget, recording_mode,
    reported_kinks                       running.MotionDriver.run as it starts
    kinks_ahead                          the same; loop.enter_segment, one less at each kink
    may_reverse, may_terminate, has_mass,
    has_clock, clock_is_path_length,
    slip_is_clock, unknowns,
    unknowns_fast, states,
    unknowns_behind_fluid                running.MotionDriver as it is made, for all its motions
    starts_at_point                      the same; loop.enter_initial_regime clears it
    regime                               loop.enter_initial_regime as it starts and at kinks;
                                         loop.advance where the regime changes
    pending_start                        running.MotionDriver (START_CODE), loop.advance
                                         (REGIME_CODE), loop.enter_segment (KINK_CODE);
                                         loop.follow_regime clears it once told
    regime_start_time                    loop.follow_regime where a regime ends;
                                         loop.enter_segment, 0
    clock                                the stepper as it begins, 0; loop.accept_step after each
                                         step
    end, step_length                     the stepper by each step; steps.truncate_at brings the end
                                         forward
    next_step_length                     the stepper, for the next step;
                                         steps.halve_unresolved_step; 0 by loop.advance and
                                         loop.enter_segment where none is known
    time_per_step                        the stepper by each step; 0 by loop.follow_regime
    is_dense                             steppers.order_eight: cleared by a step, set by the first
                                         look into it
    dense_output_limit                   loop.follow_regime as a regime begins; then
                                         steps.halve_unresolved_step
    steps                                steps.take_step
    evaluations_slow, evaluations_fast   workspace.count_evaluations at each right-hand side
    jacobians                            steppers.scipy
    target_time                          who looks for a time, before that: loop.truncate_step,
                                         within_steps.record_requested
    event_rows, recorded_rows            within_steps.add_event and record_point, by each row;
                                         loop.advance, 0 by each call
    samples_taken                        within_steps.record_requested
    must_report                          loop.follow_regime at a kink; loop.advance clears it
    termination, final_normal_stress     loop.is_valid by each step, where the motion may end so
"""

from __future__ import annotations

import struct

import numpy as np

#: The state of a motion, which it keeps from one call to the next; first what it is called with,
#: and what it has to say of itself.
MOTION_STATE_DTYPE = np.dtype(
    [
        ("end_time", "f8"),  # time at which to end
        ("time", "f8"),  # time, slip and spring stress at the start
        ("slip", "f8"),
        ("spring_stress", "f8"),
        ("tolerance", "f8"),
        ("step_limit_factor", "f8"),  # part of the longest steps at this tolerance
        ("direction", "f8"),  # of the clock: 1 or -1
        ("budget", "i8"),  # right-hand sides that it may spend
        ("recording_mode", "i8"),  # when the slider is recorded
        ("kinks_ahead", "i8"),  # kinks of the loading ahead, and the last of them that are reported
        ("reported_kinks", "i8"),
        ("evaluations_slow", "i8"),  # right-hand sides, by regime
        ("evaluations_fast", "i8"),
        ("steps", "i8"),
        ("event_rows", "i8"),  # rows of the table of events, and of the recording
        ("recorded_rows", "i8"),
        ("jacobians", "i8"),
        ("regime_start_time", "f8"),  # time at which the regime began
        ("clock", "f8"),  # at the beginning of a step, and at its end
        ("end", "f8"),
        ("step_length", "f8"),  # length of the step; its end may have been brought forward
        ("next_step_length", "f8"),  # of the next step; 0 where none is known
        ("time_per_step", "f8"),  # change of time by the clock of a step against time; 0 of others
        ("dense_output_limit", "f8"),  # longest step with dense output as accurate as is wanted
        ("regime", "i8"),
        ("pending_start", "i8"),  # what to tell before the first event of a regime
        ("may_reverse", "i8"),  # whether slip may, with shear stress
        ("may_terminate", "i8"),  # whether the motion ends where it cannot go on
        ("has_mass", "i8"),  # whether there are two regimes
        ("has_clock", "i8"),  # whether time is an unknown
        ("clock_is_path_length", "i8"),  # whether it is, which limits steps
        ("slip_is_clock", "i8"),  # whether the clock is slip
        ("samples_taken", "i8"),  # how often the slider was recorded at values asked for
        ("target_time", "f8"),  # time that is looked for
        ("must_report", "i8"),  # whether what was told at a kink cannot wait
        ("starts_at_point", "i8"),  # whether it begins at the last point, not where y is
        ("is_dense", "i8"),  # whether dense output of the step is there
        ("termination", "i8"),  # why the motion cannot go on, and normal stress there
        ("final_normal_stress", "f8"),
        ("unknowns", "i8"),  # between ruptures, and in them
        ("unknowns_fast", "i8"),
        ("states", "i8"),
        ("unknowns_behind_fluid", "i8"),  # unknowns of a fluid behind the one that a kink sets
    ]
)
#: The same as bytes: fields of records take much longer to write and to read.
CALL_FORMAT, COUNTER_FORMAT = struct.Struct("=7d4q"), struct.Struct("=6q")
CALL_ARGUMENT_FIELDS = (MOTION_STATE_DTYPE.names or ())[:11]
#: Rows of the table of functions; and how many equations have there, of which the last may be
#: missing (see `inplace.InPlaceFunctions`).
SLOW_REGIME, FAST_REGIME = 0, 1
FUNCTIONS_PER_REGIME = 4

#: Columns of the table of event specifications.
SPECIFICATION_COLUMNS = (
    SPEC_KIND,
    SPEC_QUANTITY,
    SPEC_LEVEL,
    SPEC_TERMINAL,
    SPEC_MAY_DEFER,
    SPEC_MAX_DISTANCE,
    SPEC_MAX_FRICTION_DISTANCE,
) = 0, 1, 2, 3, 4, 5, 6
MAXIMUM, MINIMUM, RISE, FALL, SETTLED = range(5)

#: When the slider is recorded: never, evenly within each step, or at clocks or times asked for.
RECORD_NEVER, RECORD_WITHIN_STEPS, RECORD_AT_CLOCKS, RECORD_AT_TIMES = range(4)


#: Columns of the table of events; from EVENT_POINT on, those of a point.
EVENT_CODE, EVENT_REGIME, EVENT_CLOCK, EVENT_TIME, EVENT_SLIP, EVENT_EVALUATIONS, EVENT_POINT = (
    range(7)
)
#: Codes of events that are not asked for; those of others are the places of their specifications.
START_CODE, REGIME_CODE, END_CODE, SAMPLED_CODE, KINK_CODE = -1, -2, -3, -4, -5

#: Columns of a point, in the order of `Point`, of which the states are the last.
(
    LOG_SLIP_RATE,
    LOG_SLIP_RATE_GROWTH,
    SPRING_STRESS,
    FRICTIONAL_STRESS,
    STATE_SUM,
    STATE_VARIABLE,
    STEADY_STATE_OFFSET,
    STEADY_STATE_DISTANCE,
    FRICTION_COEFFICIENT,
    NORMAL_STRESS_RATIO,
) = range(10)
APPARENT_FRICTION, APPARENT_FRICTION_RATE, FIRST_STATE = 10, 11, 12

#: Why a call returns: to be called again once its tables are read; because the motion has ended;
#: because its regime ends; because it cannot go on; or because its segment of loading ends. (The
#: change of regimes has a file, `regime_switching`; `REGIME_CODE` and `KINK_CODE` above are what is
#: told of both.)
(
    PAUSED,
    MOTION_ENDED,
    REGIME_ENDED,
    TERMINATED,
    BUDGET_EXCEEDED,
    NO_STEP_POSSIBLE,
    INVALID_STEP,
    SEGMENT_ENDED,
) = range(8)
#: What `steps.take_step` returns where it has taken one.
STEP_TAKEN = -1
