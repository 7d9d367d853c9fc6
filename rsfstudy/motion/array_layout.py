"""Layout of the arrays that the event loop reads and writes.

The module defines the fields of the motion state and the columns of the tables. A kink is a
boundary between two loading segments at which the loading rate changes, but the stress does not
jump. The fields of ``MOTION_STATE_DTYPE`` are written by the following functions. Functions without
a module name belong to ``motion_loop``, ``regime_starts`` or ``integration_step_truncation``.

======================================== =====================================================
Fields                                   Written by
======================================== =====================================================
end_time, time, slip, spring_stress      MotionDriver.iterate_events (initial values),
                                         start_next_segment (at each kink)
tolerance, step_limit_factor, direction, MotionDriver.iterate_events (initial values)
budget, recording_mode, reported_kinks
kinks_ahead                              MotionDriver.iterate_events (initial value),
                                         start_next_segment (decremented)
may_reverse, may_terminate, has_clock,   motion_driver.get_motion_driver (constant)
unknowns_behind_fluid
has_mass, clock_is_path_length, states,  MotionDriver (constant)
slip_is_clock, unknowns, unknowns_fast
starts_at_point                          motion_driver.get_motion_driver (set),
                                         enter_initial_regime (cleared)
regime                                   enter_initial_regime (at the start and at kinks),
                                         advance_motion (at changes of regime)
pending_start                            MotionDriver (START_CODE), advance_motion
                                         (REGIME_CODE), start_next_segment (KINK_CODE),
                                         integrate_one_regime (cleared after the first step)
regime_start_time                        integrate_one_regime (at the end of a regime),
                                         start_next_segment (set to 0)
clock                                    stepper (set to 0 at the start of a regime),
                                         move_step_begin_to_step_end
end, step_length                         stepper (each step),
                                         integration_steps.truncate_step_at (end only)
next_step_length                         stepper, advance_motion and start_next_segment (set to 0),
                                         integration_steps.halve_step_until_dense_output_is_accurate
time_per_step                            stepper (each step), integrate_one_regime (set to 0)
is_dense                                 steppers.order_eight (cleared by each step, set by the
                                         first interpolation)
dense_output_limit                       integrate_one_regime (at the start of a regime),
                                         integration_steps.halve_step_until_dense_output_is_accurate
steps                                    integration_steps.take_step
evaluations_slow, evaluations_fast       workspace.count_evaluations, steppers.scipy
jacobians                                steppers.scipy
target_time                              truncate_step_at_end_of_regime_or_segment,
                                         integration_step_samples.record_requested_samples
event_rows, recorded_rows                integration_step_events.append_event_row,
                                         integration_step_samples.append_sample_row,
                                         advance_motion (set to 0 in each call)
samples_taken                            integration_step_samples.record_requested_samples
must_report                              integrate_one_regime (at a kink), advance_motion (cleared)
termination, final_normal_stress         is_step_end_valid (if may_terminate is set)
======================================== =====================================================
"""

from __future__ import annotations

import struct

import numpy as np

#: Fields of the motion state. The motion state persists between calls of the event loop. The first
#: fields are the arguments of the motion (``MOTION_STATE_FIELDS_SET_BY_CALLER``), and the next
#: fields are the counters.
MOTION_STATE_DTYPE = np.dtype(
    [
        ("end_time", "f8"),  # duration of the loading segment
        ("time", "f8"),  # time, slip and spring stress at the start of the loading segment
        ("slip", "f8"),
        ("spring_stress", "f8"),
        ("tolerance", "f8"),
        ("step_limit_factor", "f8"),  # factor of the maximum step size at this tolerance
        ("direction", "f8"),  # direction of the independent variable: 1 or -1
        ("budget", "i8"),  # maximum number of right-hand side evaluations
        ("recording_mode", "i8"),  # RECORD_NEVER, RECORD_WITHIN_STEPS, ...
        ("kinks_ahead", "i8"),  # number of remaining kinks
        ("reported_kinks", "i8"),  # number of final kinks that are reported as events
        ("evaluations_slow", "i8"),  # right-hand side evaluations in each regime
        ("evaluations_fast", "i8"),
        ("steps", "i8"),
        ("event_rows", "i8"),  # number of filled rows of the event table
        ("recorded_rows", "i8"),  # number of filled rows of the recording table
        ("jacobians", "i8"),
        ("regime_start_time", "f8"),  # start time of the regime, from segment start
        ("clock", "f8"),  # independent variable at the beginning of the step
        ("end", "f8"),  # independent variable at the end of the step, which may be truncated
        ("step_length", "f8"),  # signed step size before truncation
        ("next_step_length", "f8"),  # size of the next step, or 0 if it is unknown
        ("time_per_step", "f8"),  # dt/d(clock) of a step with time as independent variable, or 0
        ("dense_output_limit", "f8"),  # maximum step size with sufficiently accurate dense output
        ("regime", "i8"),  # SLOW_REGIME or FAST_REGIME
        ("pending_start", "i8"),  # code of the start event to report after the first step, or 0
        ("may_reverse", "i8"),  # 1 if slip and shear stress may change sign
        ("may_terminate", "i8"),  # 1 if the loop checks whether the motion can continue
        ("has_mass", "i8"),  # 1 if the motion has two regimes
        ("has_clock", "i8"),  # 1 if time is an unknown
        ("clock_is_path_length", "i8"),  # 1 if path length is the independent variable
        ("slip_is_clock", "i8"),  # 1 if slip is the independent variable
        ("samples_taken", "i8"),  # number of requested samples recorded so far
        ("target_time", "f8"),  # time of the root that is being located
        ("must_report", "i8"),  # 1 if the loop must return after a kink to report an event
        ("starts_at_point", "i8"),  # 1 if the motion starts at last_point instead of y
        ("is_dense", "i8"),  # 1 if the dense output of the step has been computed
        ("termination", "i8"),  # termination status
        ("final_normal_stress", "f8"),  # normal stress ratio at termination
        ("unknowns", "i8"),  # number of unknowns between ruptures
        ("unknowns_fast", "i8"),  # number of unknowns in ruptures
        ("states", "i8"),  # number of states
        ("unknowns_behind_fluid", "i8"),  # number of fluid unknowns, which are last
        ("noise_rate_index", "i8"),  # index of the rate of noise in the parameters, or 0
    ]
)
#: Byte formats of two groups of motion state fields: the arguments and the counters. Packing these
#: fields into bytes is much faster than assigning them one by one.
CALL_FORMAT, COUNTER_FORMAT = struct.Struct("=7d4q"), struct.Struct("=6q")
MOTION_STATE_FIELDS_SET_BY_CALLER = (MOTION_STATE_DTYPE.names or ())[:11]
#: Row indices of the function table. The first row contains functions for the slow manifold, and
#: the second row contains functions for the inertial equations of motion in ruptures.
SLOW_REGIME, FAST_REGIME = 0, 1
#: Number of functions in each row of the function table. The functions are in the order of
#: ``in_place_functions.InPlaceFunctions``.
FUNCTION_TABLE_COLUMN_COUNT = 4

#: Columns of the table of event specifications.
EVENT_SPECIFICATION_COLUMNS = (
    SPEC_KIND,
    SPEC_QUANTITY,
    SPEC_LEVEL,
    SPEC_TERMINAL,
    SPEC_MAY_REPORT_LATER,
    SPEC_MAX_DISTANCE,
    SPEC_MAX_FRICTION_DISTANCE,
) = 0, 1, 2, 3, 4, 5, 6
#: Codes of event kinds in the column SPEC_KIND.
MAXIMUM, MINIMUM, RISE, FALL, SETTLED = range(5)

#: Recording modes: no recording, samples at even intervals within each step, or samples at
#: requested slips or times.
RECORD_NEVER, RECORD_WITHIN_STEPS, RECORD_AT_CLOCKS, RECORD_AT_TIMES = range(4)


#: Columns of the event table. The columns from EVENT_POINT onwards contain the point of the motion
#: (slip rate, stresses and states) at the event.
EVENT_CODE, EVENT_REGIME, EVENT_CLOCK, EVENT_TIME, EVENT_SLIP, EVENT_EVALUATIONS, EVENT_POINT = (
    range(7)
)
#: Codes of events that are always reported. If an event was requested, its code is the index of its
#: specification.
START_CODE, REGIME_CODE, END_CODE, SAMPLED_CODE, KINK_CODE = -1, -2, -3, -4, -5

#: Array columns of a point of the motion, in the order of the fields of ``MotionPoint``. The last
#: columns contain the state variables.
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

#: Return codes of the event loop and of the functions that it calls. After PAUSED, the caller reads
#: the tables and calls the loop again. TERMINATED means that the motion cannot continue, for
#: example because normal stress has vanished. The codes REGIME_ENDED and SEGMENT_ENDED are only
#: used within the loop.
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
#: Return code of ``integration_steps.take_step`` for a successful step.
STEP_TAKEN_CODE = -1
