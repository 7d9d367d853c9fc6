"""Layout of the numbers of the loop of motions: the state of a motion, and its tables.

Who writes the fields of the state of a motion (`MOTION`), and when:

    lasts, time, slip, spring_stress     running.Runner.run as it starts; loop.turn at each kink
    tolerance, finer, direction,
    budget, records, reported            running.Runner.run as it starts
    kinks                                the same; loop.turn, one less at each kink
    reverses, terminates, has_mass,
    has_clock, limits_steps,
    slip_is_clock, unknowns,
    unknowns_fast, states, behind        running.Runner as it is made, for all its motions
    at_point                             the same; loop.begin_at clears it
    regime                               loop.begin_at as it starts and at kinks; loop.advance where
                                         the regime changes
    begins                               running.Runner (BEGIN), loop.advance (CHANGE), loop.turn
                                         (KINK); loop.through_regime clears it once told
    started                              loop.through_regime where a regime ends; loop.turn, 0
    clock                                the stepper as it begins, 0; loop.move_on after each step
    end, taken                           the stepper by each step; steps.cut brings the end forward
    length                               the stepper, for the next step; steps.halve_unresolved;
                                         0 by loop.advance and loop.turn where none is known
    pace                                 the stepper by each step; 0 by loop.through_regime
    is_dense                             steppers.order_eight: cleared by a step, set by the first
                                         look into it
    resolved                             loop.through_regime as a regime begins; then
                                         steps.halve_unresolved
    steps                                steps.take_step
    spent_slow, spent_fast               workspace.spend at each right-hand side
    jacobians                            steppers.scipy
    target                               who looks for a time, before that: loop.cut_short,
                                         within_steps.record_asked
    events, recorded                     within_steps.add_event and record_point, by each row;
                                         loop.advance, 0 by each call
    sampled                              within_steps.record_asked
    urgent                               loop.through_regime at a kink; loop.advance clears it
    termination, stress                  loop.goes_on by each step, where the motion may end so
"""

from __future__ import annotations

import struct

import numpy as np

#: The state of a motion, which it keeps from one call to the next; first what it is called with,
#: and what it has to say of itself.
MOTION = np.dtype(
    [
        ("lasts", "f8"),  # time at which to end
        ("time", "f8"),  # time, slip and spring stress at the start
        ("slip", "f8"),
        ("spring_stress", "f8"),
        ("tolerance", "f8"),
        ("finer", "f8"),  # part of the longest steps at this tolerance
        ("direction", "f8"),  # of the clock: 1 or -1
        ("budget", "i8"),  # right-hand sides that it may spend
        ("records", "i8"),  # when the slider is recorded
        ("kinks", "i8"),  # kinks of the loading ahead, and the last of them that are reported
        ("reported", "i8"),
        ("spent_slow", "i8"),  # right-hand sides, by regime
        ("spent_fast", "i8"),
        ("steps", "i8"),
        ("events", "i8"),  # rows of the table of events, and of the recording
        ("recorded", "i8"),
        ("jacobians", "i8"),
        ("started", "f8"),  # time at which the regime began
        ("clock", "f8"),  # at the beginning of a step, and at its end
        ("end", "f8"),
        ("taken", "f8"),  # length of the step; its end may have been brought forward
        ("length", "f8"),  # of the next step; 0 where none is known
        ("pace", "f8"),  # change of time by the clock of a step against time; 0 of others
        ("resolved", "f8"),  # longest step within which dense output is as accurate as is wanted
        ("regime", "i8"),
        ("begins", "i8"),  # what to tell before the first event of a regime
        ("reverses", "i8"),  # whether slip may, with shear stress
        ("terminates", "i8"),  # whether the motion ends where it cannot go on
        ("has_mass", "i8"),  # whether there are two regimes
        ("has_clock", "i8"),  # whether time is an unknown
        ("limits_steps", "i8"),  # whether the clock is length along the path, which limits steps
        ("slip_is_clock", "i8"),  # whether the clock is slip
        ("sampled", "i8"),  # how often the slider was recorded at values asked for
        ("target", "f8"),  # time that is looked for
        ("urgent", "i8"),  # whether what was told at a kink cannot wait
        ("at_point", "i8"),  # whether it begins at the last point of one before, not where y is
        ("is_dense", "i8"),  # whether dense output of the step is there
        ("termination", "i8"),  # why the motion cannot go on, and normal stress there
        ("stress", "f8"),
        ("unknowns", "i8"),  # between ruptures, and in them
        ("unknowns_fast", "i8"),
        ("states", "i8"),
        ("behind", "i8"),  # unknowns of a fluid behind the one that a kink sets
    ]
)
#: The same as bytes: fields of records take much longer to write and to read.
CALLED_WITH, SAYS = struct.Struct("=7d4q"), struct.Struct("=6q")
CALLED_WITH_FIELDS = (MOTION.names or ())[:11]
#: Rows of the table of functions; and how many equations have there, of which the last may be
#: missing (see `columns.Filling`).
SLOW, FAST = 0, 1
FUNCTIONS = 4

#: Columns of the table of event specifications.
SPECIFIED = KIND, OF, LEVEL, ENDS, WAITS, FARTHEST, FARTHEST_FRICTION = 0, 1, 2, 3, 4, 5, 6
MAXIMUM, MINIMUM, RISE, FALL, SETTLED = range(5)

#: When the slider is recorded: never, evenly within each step, or at clocks or times asked for.
NEVER, WITHIN_STEPS, AT_CLOCKS, AT_TIMES = range(4)


#: Columns of the table of events; from POINT on, those of a point.
CODE, EVENT_REGIME, CLOCK, TIME, SLIP, SPENT, POINT = range(7)
#: Codes of events that are not asked for; those of others are the places of their specifications.
BEGIN, CHANGE, END, SAMPLED, KINK = -1, -2, -3, -4, -5

#: Columns of a point, in the order of `Point`, of which the states are the last.
LOG_RATE, GROWTH, SPRING, FRICTION, PSI, STATE, IMBALANCE, DISTANCE, COEFFICIENT, RATIO = range(10)
READING, READING_GROWTH, PSIS = 10, 11, 12

#: Why a call returns: to be called again once its tables are read; because the motion has ended;
#: because its regime ends; because it cannot go on; or because its segment of loading ends. (The
#: change of regimes has a file, `handover`; `CHANGE` and `KINK` above are what is told of both.)
PAUSES, ENDED, REGIME_ENDS, HALTED, BUDGET_SPENT, NO_STEP, NO_LENGTH, SEGMENT_ENDS = range(8)
#: What `steps.take_step` returns where it has taken one.
TAKEN = -1
