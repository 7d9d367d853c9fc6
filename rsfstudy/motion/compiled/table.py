"""Where the compiled motion finds and leaves its numbers."""

from __future__ import annotations

import struct

import numpy as np

#: What a motion remembers from one call to the next; first what it is called with, and what it
#: has to say of itself.
NOW = np.dtype(
    [
        ("lasts", "f8"),  # time at which to end
        ("time", "f8"),  # time, slip and spring stress at the start
        ("slip", "f8"),
        ("spring", "f8"),
        ("budget", "i8"),  # right-hand sides, in all and spent by regime
        ("spent_slow", "i8"),
        ("spent_fast", "i8"),
        ("steps", "i8"),
        ("told", "i8"),  # rows of the table of events, and of the recording
        ("recorded", "i8"),
        ("direction", "f8"),  # of the clock: 1 or -1
        ("tolerance", "f8"),
        ("finer", "f8"),  # part of the longest steps at this tolerance
        ("started", "f8"),  # time at which the regime began
        ("clock", "f8"),  # at the beginning of a step, and at its end
        ("end", "f8"),
        ("taken", "f8"),  # length of the step; its end may have been brought forward
        ("length", "f8"),  # of the next step
        ("regime", "i8"),
        ("begins", "i8"),  # what to tell before the first event of a regime
        ("ends_by_fate", "i8"),  # whether the motion ends where it cannot go on
        ("has_mass", "i8"),  # whether there are two regimes
        ("has_clock", "i8"),  # whether time is an unknown
        ("strides", "i8"),  # whether the clock is length along the path, which limits steps
        ("at_point", "i8"),  # whether it begins at the last point of one before, not where y is
        ("is_dense", "i8"),  # whether dense output of the step is there
        ("fate", "i8"),  # why the motion cannot go on, and normal stress there
        ("stress", "f8"),
        ("unknowns", "i8"),  # between ruptures, and in them
        ("unknowns_fast", "i8"),
        ("states", "i8"),
    ]
)
#: The same as bytes: fields of records take much longer to write and to read.
CALLED_WITH, SAYS = struct.Struct("=4dq"), struct.Struct("=5q")
#: Rows of the table of addresses; and how many functions of equations have theirs there, of which
#: the last may be missing (see `machine.addresses`).
SLOW, FAST = 0, 1
FUNCTIONS = 4

#: Columns of the table of watches.
WATCHED = KIND, OF, LEVEL, ENDS, WAITS, FARTHEST = 0, 1, 2, 3, 4, 5
MAXIMUM, MINIMUM, RISE, FALL, SETTLED, MOMENT = range(6)

#: Columns of the table of events; from POINT on, those of a point.
CODE, REGIME, CLOCK, TIME, SLIP, SPENT, POINT = range(7)
#: Codes of events that are not asked for; those of others are the places of their watches, behind
#: which come the samples.
BEGIN, CHANGE, END = -1, -2, -3

#: Columns of a point; its states follow.
LOG_RATE, GROWTH, SPRING, FRICTION, PSI, STATE, IMBALANCE, UNREST, COEFFICIENT, RATIO = range(10)
READING, READING_GROWTH, PSIS = 10, 11, 12

#: Why a call returns: to hand over what it has told; because the motion has ended; because the
#: regime changes; or because it cannot go on.
HANDS_OVER, ENDED, CHANGES, HALTED, BUDGET_SPENT, NO_STEP, NO_LENGTH = range(7)
