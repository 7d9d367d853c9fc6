"""The loop of all motions: step by step through their regimes, until there is something to tell.

Plain Python of a kind that Numba compiles. What takes the steps is a stepper (`steppers`); compiled
or not, with whatever stepper, events are found here. `running` calls it.

To follow a rupture with a debugger, simulate a scene with ``inertia=True``, because without mass
there is one regime only; with ``engine="scipy"``, or ``engine="python"`` to see inside of steps.
Each step passes `cut_short` once: a breakpoint there with the condition ``motion.regime == 1``
(`FAST`) stops at each step of a rupture, of which ``space.before`` and ``space.after`` are the
points at both ends (columns in the order of `layout.LOG_RATE` and so on). The line ``return
REGIME_ENDS`` of `through_regime` is its end with the same condition, and its beginning with
``motion.regime == 0`` (`SLOW`). `layout` says who writes which field of ``motion``.
"""

from __future__ import annotations

import math

from rsfstudy.motion.calls import copy, evaluate, first_of, moved
from rsfstudy.motion.handover import (
    GOES_ON,
    Limits,
    begins_slow,
    has_returned,
    margin,
    may_return,
    termination_of,
)
from rsfstudy.motion.layout import (
    BEGIN,
    CHANGE,
    END,
    ENDED,
    FAST,
    FRICTION,
    FUNCTIONS,
    GROWTH,
    HALTED,
    KINK,
    LOG_RATE,
    NO_LENGTH,
    PAUSES,
    PSIS,
    RATIO,
    REGIME_ENDS,
    SAMPLED,
    SEGMENT_ENDS,
    SLOW,
    SPECIFIED,
    SPRING,
    TAKEN,
    WITHIN_STEPS,
)
from rsfstudy.motion.recording import SAMPLES
from rsfstudy.motion.steppers import begin, retake
from rsfstudy.motion.steps import (
    cut,
    elapsed,
    halve_unresolved,
    passed_at_begin,
    passed_at_end,
    take_step,
)
from rsfstudy.motion.within_steps import (
    EXCESS,
    MARGIN,
    PASSED,
    excess,
    is_recorded,
    located,
    record,
    record_begin,
    report,
    report_beginning,
    report_end,
    slipped,
    waits,
)
from rsfstudy.motion.workspace import workspace
from rsfstudy.slider.places import (
    BEGINS,
    ENDS_AT,
    LAW,
    LOAD_VELOCITY,
    LOADING,
    LOG_LOAD_RATE,
    LOG_VELOCITY,
    RATE,
    RECHARGE,
    RELIEF,
    VELOCITY,
)

#: How often the clock at which a step is to end is looked for.
CORRECTIONS = 2
#: Change of ln V_0 at a kink beyond which the length of steps is found anew: displacement along the
#: path, V + V_0, is then another, and rejected steps would cost more than the first one does.
FAR = 3.0


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
    motion.events = motion.recorded = 0
    scales, functions, numbers, p, p_before = plan
    y, scales, block = first_of(y), first_of(scales), first_of(block)
    last, p, p_before = first_of(last), first_of(p), first_of(p_before)
    limits = Limits(*numbers)
    given = first_of(specs), len(specs) // len(SPECIFIED), p, p_before, limits, stepper
    if motion.at_point:
        begin_at(motion, y, last, functions, block, limits, p)
    end = REGIME_ENDS
    while end == REGIME_ENDS:
        unknowns, first = motion.unknowns, 0
        if motion.regime == FAST:
            unknowns, first = motion.unknowns_fast, motion.unknowns
        own, equations = moved(scales, first), functions[motion.regime]
        space = workspace(block, y, unknowns, own, motion.states, equations, given)
        end = through_regime(motion, space, last, samples, events, rows)
        if end == REGIME_ENDS:
            motion.regime = SLOW if motion.regime == FAST else FAST
            motion.begins, motion.length = CHANGE, 0.0
            enter(motion, y, last)
        elif end == SEGMENT_ENDS:
            regime, end = motion.regime, REGIME_ENDS
            turn(motion, space, last, kinks, rows)
            begin_at(motion, y, last, functions, block, limits, p)
            if motion.regime != regime:
                motion.length = 0.0
        if end == REGIME_ENDS and (motion.urgent or is_full(motion, space.specified, events, rows)):
            motion.urgent, end = 0, PAUSES
    return end


def is_full(motion, specified, events, rows):
    """True if the tables have no room for all that one more step may add to them."""
    full = len(events) - motion.events < 2 * specified + 4
    return full or (len(rows) > 0 and len(rows) - motion.recorded < 2 * SAMPLES)


def turn(motion, space, last, kinks, rows):
    """Go on to the next segment of loading, whose numbers take the place of those before it."""
    n, p, relief = len(kinks) - motion.kinks, space.p, PSIS + motion.states - 1 - motion.behind
    copy(space.after, last, PSIS + motion.states)
    motion.slip = slipped(motion, motion.end, motion.lasts, last[SPRING], p)
    motion.spring_stress, motion.time, motion.started = last[SPRING], kinks[n, BEGINS], 0.0
    motion.lasts = kinks[n, ENDS_AT] - kinks[n, BEGINS]
    motion.begins, motion.kinks = KINK, motion.kinks - 1
    if motion.records == WITHIN_STEPS:  # to the last digit, too
        rows[motion.recorded - 1, 0] = motion.time
    copy(p, space.p_before, LAW)
    # the length of a step goes on with the motion, unless its path has become quite another
    if not abs(kinks[n, LOG_VELOCITY] - p[LOG_LOAD_RATE]) < FAR:
        motion.length = 0.0
    p[LOAD_VELOCITY], p[LOG_LOAD_RATE] = kinks[n, VELOCITY], kinks[n, LOG_VELOCITY]
    if not math.isnan(kinks[n, RATE]):
        p[RECHARGE if motion.behind else LOADING] = kinks[n, RATE]
        last[relief] = kinks[n, RELIEF]


def begin_at(motion, y, last, functions, below, limits, p):
    """Begin in the regime that a point is for; `below` takes in the slow manifold there."""
    motion.at_point, motion.regime = 0, SLOW
    enter(motion, y, last)
    if motion.has_mass:
        evaluate(functions[SLOW, FUNCTIONS - 1], y, y, p, below)
        if not begins_slow(last[LOG_RATE], below[0], last[SPRING] - below[1], limits):
            motion.regime = FAST
            enter(motion, y, last)


def enter(motion, y, last):
    """Begin a regime at the last point of one before: spring stress, states and time carry over;
    between ruptures ln V and friction follow from these, and jump.
    """
    y[0] = last[SPRING]
    if motion.regime == FAST:
        y[1], y[2] = last[LOG_RATE], last[FRICTION]
        for i in range(1, motion.states):
            y[2 + i] = last[PSIS + i]
        y[2 + motion.states] = 0.0
    else:
        for i in range(motion.states):
            y[1 + i] = last[PSIS + i]
        y[1 + motion.states] = 0.0


def through_regime(motion, space, last, samples, events, rows):
    """Follow one regime; returns why it ends, or why the call has to."""
    if motion.begins:
        motion.pace = 0.0
        begin(motion, space)
        if motion.begins != KINK:
            motion.resolved = math.inf
    else:
        copy(moved(space.y, space.unknowns), space.rates, space.unknowns)
    evaluate(space.point, space.y, space.rates, space.p, space.before)
    while True:
        taken = take_step(motion, space)
        if taken != TAKEN:
            return taken
        if is_recorded(motion, space, samples):
            halve_unresolved(motion, space)
        evaluate(space.point, space.new, space.rates_at_end, space.p, space.after)
        if math.isnan(space.after[LOG_RATE]):
            return NO_LENGTH
        if motion.terminates and not goes_on(motion, space):
            return HALTED
        leaves, over = cut_short(motion, space)
        if motion.begins:
            record_begin(motion, space, rows)
            if report_beginning(motion, space, last, events):
                return ENDED
        complete = motion.records and record(motion, space, rows, samples, over)
        urgent = report(motion, space, events)
        if motion.begins == BEGIN and not waits(space):
            urgent = max(urgent, 2)
        motion.begins = 0
        if urgent == 3:
            return ENDED
        if complete:
            urgent = 2
            report_end(motion, space, events, SAMPLED)
        if over and motion.kinks > 0:
            motion.urgent = int(urgent == 2)
            return SEGMENT_ENDS
        if over:
            report_end(motion, space, events, END)
            return ENDED
        if leaves or returns(motion, space):
            motion.started = passed_at_end(motion, space)
            copy(space.after, last, PSIS + motion.states)
            return REGIME_ENDS
        if motion.terminates and motion.termination != GOES_ON:
            return HALTED
        move_on(motion, space)
        if urgent == 2 or is_full(motion, space.specified, events, rows):
            copy(space.rates, moved(space.y, space.unknowns), space.unknowns)
            return PAUSES


def goes_on(motion, space):
    """True if a motion does, if only through this step: that then ends where the motion does."""
    columns, velocity = space.after, space.p[LOAD_VELOCITY]
    motion.stress = columns[RATIO]
    motion.termination = termination_of(columns[LOG_RATE], motion.stress, velocity)
    if motion.termination == GOES_ON:
        return True
    at_begin = margin(space.before[LOG_RATE], space.before[RATIO], velocity)
    at_end = margin(columns[LOG_RATE], columns[RATIO], velocity)
    if at_begin <= 0.0:
        return False
    cut(motion, space, located(MARGIN, at_begin, at_end, motion, space))
    return True


def cut_short(motion, space):
    """Let the step end where the regime has to be left, and where time is over; whether it is."""
    before, after = excess(motion, space, space.before), excess(motion, space, space.after)
    leaves = after >= 0.0 > before
    if leaves:
        cut(motion, space, located(EXCESS, before, after, motion, space))
    if motion.pace > 0.0 and motion.end == motion.clock + motion.taken:
        return leaves, True
    over = passed_at_end(motion, space) >= motion.lasts
    if over:
        motion.target = motion.lasts
        at_begin = passed_at_begin(motion, space) - motion.lasts
        at_end = passed_at_end(motion, space) - motion.lasts
        end_in_time(motion, space, located(PASSED, at_begin, at_end, motion, space))
    return leaves, over


def end_in_time(motion, space, clock):
    """Let the step end where time is over.

    Dense output tells the clock. Where stability limits steps it is far less accurate than their
    ends: the step is taken anew to that clock, and again with what time it was missing.
    """
    for _ in range(CORRECTIONS):
        retake(motion, space, clock)
        late = passed_at_end(motion, space) - motion.lasts
        clock -= late / elapsed(motion, space, space.rates_at_end)
    evaluate(space.point, space.new, space.rates_at_end, space.p, space.after)


def returns(motion, space):
    """True if the full equations have done their work."""
    if motion.regime == SLOW or not may_return(space.after[LOG_RATE], space.limits):
        return False
    columns, below = space.after, space.between
    space.within[0] = columns[SPRING]
    for i in range(motion.states):
        space.within[1 + i] = columns[PSIS + i]
    evaluate(space.balance, space.within, space.within, space.p, below)
    missing = columns[SPRING] - below[1]
    return has_returned(columns[LOG_RATE], columns[GROWTH], below[0], missing, space.limits)


def move_on(motion, space):
    """The end of a step is the beginning of the next."""
    motion.clock = motion.end
    copy(space.new, space.y, space.unknowns)
    copy(space.rates_at_end, space.rates, space.unknowns)
    copy(space.after, space.before, PSIS + motion.states)
