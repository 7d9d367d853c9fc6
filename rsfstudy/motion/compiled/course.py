"""The course of a compiled motion: step by step through its regimes, until it is time to hand over.

One compiled function serves all equations; `engine` calls it.
"""

from __future__ import annotations

import math

from rsfstudy.motion.compiled.calls import evaluate, first_of, moved
from rsfstudy.motion.compiled.happenings import (
    EXCESS,
    PASSED,
    ROOM,
    excess,
    located,
    passed_at_end,
    record,
    record_point,
    tell,
    tell_beginning,
    tell_watched,
    waits,
)
from rsfstudy.motion.compiled.order_eight import copy
from rsfstudy.motion.compiled.room import room
from rsfstudy.motion.compiled.steps import TAKEN, begin, cut, elapsed, retake, take_step
from rsfstudy.motion.compiled.table import (
    BEGIN,
    CHANGE,
    CHANGES,
    END,
    ENDED,
    FAST,
    FRICTION,
    FUNCTIONS,
    GROWTH,
    HALTED,
    HANDS_OVER,
    LOG_RATE,
    NO_LENGTH,
    PSIS,
    RATIO,
    SLOW,
    SPRING,
)
from rsfstudy.motion.compiled.unrolled import STAGES, TOLERANCE
from rsfstudy.motion.handover import (
    GOES_ON,
    Limits,
    begins_slow,
    fate,
    has_landed,
    may_land,
    room_left,
)
from rsfstudy.motion.recording import SAMPLES
from rsfstudy.motion.timeline import CORRECTIONS
from rsfstudy.slider.slots import LOAD_VELOCITY


def advance(memory, y, scales, functions, space, last, watches, told, rows, numbers, p):
    """Follow a motion from where `memory` and `y` are.

    Parameters
    ----------
    memory : ndarray of NOW, shape (1,)
    y : ndarray
        Unknowns, and behind them their rates.
    scales : ndarray
        Of the unknowns; those in a rupture follow those between ruptures.
    functions : ndarray of int
        Addresses of the equations of each regime.
    space : ndarray
        Room for the arrays of a regime.
    last : ndarray
        The last point of the regime before; at first, the point at which to begin.
    watches, told, rows : ndarray
        What is watched for, what happens, and what is recorded.
    numbers : tuple of float
        The limits of the regimes.
    p : ndarray
        The numbers of the scene.

    Returns
    -------
    int
        Why it returns.
    """
    now = memory[0]
    now.told = now.recorded = 0
    y, scales, space = first_of(y), first_of(scales), first_of(space)
    last, p = first_of(last), first_of(p)
    limits = Limits(numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5])
    if now.at_point:
        begin_at(now, y, last, functions, space, limits, p)
    end = CHANGES
    while end == CHANGES:
        place = begun(now, y, scales, functions, space, watches, p)
        end = through_regime(now, place, last, told, rows, limits)
        if end == CHANGES:
            now.regime, now.begins = FAST - now.regime, CHANGE
            enter(now, y, last)
            if is_full(now, len(watches), told, rows):
                end = HANDS_OVER
    return end


def is_full(now, watched, told, rows):
    """Whether the tables have no room for all that one more step may add to them."""
    full = len(told) - now.told < 2 * watched + 3
    return full or (len(rows) > 0 and len(rows) - now.recorded < 2 * SAMPLES)


def begin_at(now, y, last, functions, below, limits, p):
    """Begin in the regime that a point is for; `below` takes in the slow manifold there."""
    now.at_point, now.regime = 0, SLOW
    enter(now, y, last)
    if now.has_mass:
        evaluate(functions[SLOW, FUNCTIONS - 1], y, y, p, below)
        if not begins_slow(last[LOG_RATE], below[0], last[SPRING] - below[1], limits):
            now.regime = FAST
            enter(now, y, last)


def enter(now, y, last):
    """Begin a regime at the last point of one before."""
    y[0] = last[SPRING]
    if now.regime == FAST:
        y[1], y[2] = last[LOG_RATE], last[FRICTION]
        for i in range(1, now.states):
            y[2 + i] = last[PSIS + i]
        y[2 + now.states] = 0.0
    else:
        for i in range(now.states):
            y[1 + i] = last[PSIS + i]
        y[1 + now.states] = 0.0


def begun(now, y, scales, functions, space, watches, p):
    """Room for the regime that a motion is in."""
    unknowns, first = now.unknowns, 0
    if now.regime == FAST:
        unknowns, first = now.unknowns_fast, now.unknowns
    of_regime, asked = functions[now.regime], first_of(watches)
    scales = moved(scales, first)
    return room(space, y, unknowns, scales, now.states, of_regime, asked, len(watches), p)


def through_regime(now, place, last, told, rows, limits):
    """Follow one regime; returns why it ends, or why the call has to."""
    unknowns, p, recording = place.unknowns, place.p, len(rows) > 0
    place.step[TOLERANCE] = now.tolerance
    if now.begins:
        begin(now, place)
    else:
        for i in range(unknowns):
            place.stages[i] = place.y[unknowns + i]
    evaluate(place.point, place.y, place.stages, p, place.before)
    rates_at_end = moved(place.stages, STAGES * unknowns)
    while True:
        taken = take_step(now, place)
        if taken != TAKEN:
            return taken
        evaluate(place.point, place.new, rates_at_end, p, place.after)
        if math.isnan(place.after[LOG_RATE]):
            return NO_LENGTH
        if now.ends_by_fate:
            now.stress = place.after[RATIO]
            now.fate = fate(place.after[LOG_RATE], now.stress, p[LOAD_VELOCITY])
            if now.fate != GOES_ON and not cut_at_the_end(now, place, limits):
                return HALTED
        leaves, over = cut_short(now, place, limits)
        if now.begins:
            if recording:
                record_point(now, rows, now.started, place.before, p)
            if tell_beginning(now, place, last, told, limits):
                return ENDED
        if recording:
            record(now, place, rows, limits)
        urgent = tell_watched(now, place, told, limits)
        if now.begins == BEGIN and not waits(place):
            urgent = max(urgent, 2)
        now.begins = 0
        if urgent == 3:
            return ENDED
        if over:
            tell(now, told, float(END), now.end, passed_at_end(now, place, limits), place.after, p)
            return ENDED
        if leaves or lands(now, place, limits):
            now.started = passed_at_end(now, place, limits)
            copy(place.after, last, PSIS + now.states)
            return CHANGES
        if now.ends_by_fate and now.fate != GOES_ON:
            return HALTED
        move_on(now, place)
        if urgent == 2 or is_full(now, place.asked, told, rows):
            for i in range(unknowns):
                place.y[unknowns + i] = place.stages[i]
            return HANDS_OVER


def cut_at_the_end(now, place, limits):
    """Let the step end where the motion cannot go on; whether it began before that."""
    before, after, p = place.before, place.after, place.p
    at_begin = room_left(before[LOG_RATE], before[RATIO], p[LOAD_VELOCITY])
    at_end = room_left(after[LOG_RATE], after[RATIO], p[LOAD_VELOCITY])
    if at_begin <= 0.0:
        return False
    cut(now, place, located(ROOM, at_begin, at_end, now, place, limits))
    return True


def cut_short(now, place, limits):
    """Let the step end where the regime has to be left, and where time is over; whether it is."""
    before, after = excess(now, place.before, limits), excess(now, place.after, limits)
    leaves = after >= 0.0 > before
    if leaves:
        cut(now, place, located(EXCESS, before, after, now, place, limits))
    over = passed_at_end(now, place, limits) >= now.lasts
    if over:
        at_begin = now.started + elapsed(now, place, place.y, limits) - now.lasts
        at_end = passed_at_end(now, place, limits) - now.lasts
        end_in_time(now, place, located(PASSED, at_begin, at_end, now, place, limits), limits)
    return leaves, over


def end_in_time(now, place, clock, limits):
    """Let the step end where time is over, which dense output tells about a clock (see
    `timeline.ended`).
    """
    rates_at_end = moved(place.stages, STAGES * place.unknowns)
    for _ in range(CORRECTIONS):
        retake(now, place, clock)
        late = passed_at_end(now, place, limits) - now.lasts
        clock -= late / elapsed(now, place, rates_at_end, limits)
    evaluate(place.point, place.new, rates_at_end, place.p, place.after)


def lands(now, place, limits):
    """Whether the full equations have done their work."""
    if now.regime == SLOW or not may_land(place.after[LOG_RATE], limits):
        return False
    columns, below = place.after, place.between
    place.within[0] = columns[SPRING]
    for i in range(now.states):
        place.within[1 + i] = columns[PSIS + i]
    evaluate(place.balance, place.within, place.within, place.p, below)
    missing = columns[SPRING] - below[1]
    return has_landed(columns[LOG_RATE], columns[GROWTH], below[0], missing, limits)


def move_on(now, place):
    """The end of a step is the beginning of the next."""
    now.clock = now.end
    copy(place.new, place.y, place.unknowns)
    copy(moved(place.stages, STAGES * place.unknowns), place.stages, place.unknowns)
    copy(place.after, place.before, PSIS + now.states)
