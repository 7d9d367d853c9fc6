"""What happens within a step, for the compiler: located where a sign changes, told in order."""

from __future__ import annotations

import math

from rsfstudy.motion.compiled.calls import moved
from rsfstudy.motion.compiled.steps import elapsed, point_within, unknowns_at
from rsfstudy.motion.compiled.table import (
    CHANGE,
    CLOCK,
    CODE,
    ENDS,
    FARTHEST,
    FRICTION,
    GROWTH,
    KIND,
    LEVEL,
    LOG_RATE,
    MAXIMUM,
    MINIMUM,
    MOMENT,
    OF,
    POINT,
    PSIS,
    RATIO,
    READING,
    READING_GROWTH,
    REGIME,
    RISE,
    SETTLED,
    SLIP,
    SLOW,
    SPENT,
    SPRING,
    STATE,
    TIME,
    UNREST,
    WAITS,
    WATCHED,
)
from rsfstudy.motion.handover import room_left, weight_of_mass
from rsfstudy.motion.recording import REGIME as RECORDED_REGIME
from rsfstudy.motion.recording import SAMPLES, STATES
from rsfstudy.slider.slots import LOAD_VELOCITY, LOG_LOAD_RATE, SIZE, STIFFNESS

#: What is read off a step beside the watches: how far the regime is from being left, time, and how
#: far the motion is from its end.
#: Not whole numbers, of each of which the compiler would make a case of its own.
EXCESS, PASSED, ROOM = -1.0, -2.0, -3.0
_MOST_ITERATIONS = 100


def quantity(watch, columns, p):
    """What changes sign where it happens: a slope, or the distance from a level."""
    if watch[KIND] == MAXIMUM or watch[KIND] == MINIMUM:
        if watch[OF] == LOG_RATE:
            return columns[GROWTH]
        if watch[OF] == READING:
            return columns[READING_GROWTH]
        return p[LOG_LOAD_RATE] - columns[LOG_RATE]
    return columns[int(watch[OF])] - watch[LEVEL]


def watch_of(room, number):
    """One of the watches."""
    return moved(room.watches, len(WATCHED) * number)


def waits(room):
    """Whether the asker can wait for anything; for the beginning then, too."""
    found = False
    for w in range(room.asked):
        found = found or watch_of(room, w)[WAITS] != 0.0
    return found


def excess(now, columns, limits):
    """Not negative where the slow manifold has to be left; always negative elsewhere."""
    if now.regime != SLOW or not now.has_mass:
        return -1.0
    missing = columns[SPRING] - columns[FRICTION]
    return weight_of_mass(columns[LOG_RATE], missing, limits) - 1.0


def happens(watch, before, after, direction):
    """Whether a quantity that changes so has done what is watched for."""
    upwards = watch[KIND] == RISE or watch[KIND] == MINIMUM
    # against the clock, slopes change sign the other way round
    if direction < 0.0 and (watch[KIND] == MAXIMUM or watch[KIND] == MINIMUM):
        upwards = not upwards
    if upwards:
        return before < 0.0 <= after
    return before > 0.0 >= after


def reading(what, clock, now, room, limits):
    """The quantity of a watch, `EXCESS`, `PASSED` or `ROOM`, at a clock within the step."""
    if what == PASSED:
        unknowns_at(now, room, clock)
        return now.started + elapsed(now, room, room.within, limits) - now.lasts
    point_within(now, room, clock)
    if what == EXCESS:
        return excess(now, room.between, limits)
    if what == ROOM:
        return room_left(room.between[LOG_RATE], room.between[RATIO], room.p[LOAD_VELOCITY])
    return quantity(watch_of(room, int(what)), room.between, room.p)


def located(what, at_begin, at_end, now, room, limits):
    """Clock within the step at which a reading, given at both ends, changes sign: Brent's method,
    to 1e-13 of the step.
    """
    width = abs(now.end - now.clock)
    finest, relative = (1e-15 * width, 1e-15) if what == PASSED else (1e-13 * width, 1e-14)
    latest, best, other = now.clock, now.end, now.clock
    at_latest, at_best, at_other = at_begin, at_end, at_begin
    move = earlier = best - latest
    for _ in range(_MOST_ITERATIONS):
        if at_latest != 0.0 and at_best != 0.0 and (at_latest < 0.0) != (at_best < 0.0):
            other, at_other = latest, at_latest
            move = earlier = best - latest
        if abs(at_other) < abs(at_best):
            latest, best, other = best, other, best
            at_latest, at_best, at_other = at_best, at_other, at_best
        enough = 0.5 * (finest + relative * abs(best))
        half = 0.5 * (other - best)
        if at_best == 0.0 or abs(half) < enough:
            return best
        tried = half
        if abs(earlier) > enough and abs(at_best) < abs(at_latest):
            tried = guess(latest, best, other, at_latest, at_best, at_other)
            if not 2.0 * abs(tried) < min(abs(earlier), 3.0 * abs(half) - enough):
                tried = move = half
        else:
            move = half
        earlier, move = move, tried
        latest, at_latest = best, at_best
        best += move if abs(move) > enough else math.copysign(enough, half)
        at_best = reading(what, best, now, room, limits)
    return best


def guess(latest, best, other, at_latest, at_best, at_other):
    """How far from the best point the root is: by a line, or by inverse quadratic interpolation."""
    if latest == other:
        return -at_best * (best - latest) / (at_best - at_latest)
    to_latest = (at_latest - at_best) / (latest - best)
    to_other = (at_other - at_best) / (other - best)
    numerator = at_other * to_other - at_latest * to_latest
    return -at_best * numerator / (to_other * to_latest * (at_other - at_latest))


def tell(now, told, code, clock, passed, columns, p):
    """Add an event to the table."""
    n = now.told
    told[n, CODE], told[n, REGIME], told[n, CLOCK] = code, now.regime, clock
    told[n, TIME] = now.time + passed
    told[n, SLIP] = now.slip + slipped(now, passed, columns[SPRING], p)
    told[n, SPENT] = now.spent_slow + now.spent_fast
    for i in range(told.shape[1] - POINT):
        told[n, POINT + i] = columns[i]
    now.told = n + 1


def slipped(now, passed, spring, p):
    """Slip since the start, from the spring: ``f = f_0 + K (V_0 t - slip)``."""
    return p[LOAD_VELOCITY] * passed - (spring - now.spring) / p[STIFFNESS]


def tell_beginning(now, room, last, told, limits):
    """Tell that a regime has begun, and what happened on the way to it from the last point of the
    one before: at the more extreme of both, or at the first beyond a level. Returns whether that
    ends the motion.
    """
    p, passed = room.p, now.started + elapsed(now, room, room.y, limits)
    tell(now, told, float(now.begins), now.clock, passed, room.before, p)
    if now.begins != CHANGE:
        return False
    for w in range(room.asked):
        watch = watch_of(room, w)
        if watch[KIND] == SETTLED or watch[KIND] == MOMENT:
            continue
        if happens(watch, quantity(watch, last, p), quantity(watch, room.before, p), 1.0):
            x, y = last[LOG_RATE], room.before[LOG_RATE]
            kept = (watch[KIND] == MAXIMUM and x > y) or (watch[KIND] == MINIMUM and x < y)
            kept = kept and watch[OF] == LOG_RATE
            tell(now, told, float(w), now.clock, passed, last if kept else room.before, p)
            if watch[ENDS]:
                return True
    return False


def watched(now, room, limits):
    """Find when each thing watched for happens within the step; NaN where it does not. Returns how
    many do.
    """
    count, p = 0, room.p
    for w in range(room.asked):
        watch = watch_of(room, w)
        room.when[w] = math.nan
        if watch[KIND] == SETTLED:
            away = max(abs(room.after[LOG_RATE] - p[LOG_LOAD_RATE]), room.after[UNREST] / p[SIZE])
            watch[FARTHEST] = max(watch[FARTHEST], away)
            if away < watch[LEVEL] * watch[FARTHEST]:
                room.when[w] = now.end
        elif watch[KIND] == MOMENT:
            if now.clock < watch[LEVEL] <= now.end or watch[LEVEL] == now.clock == 0.0:
                room.when[w] = watch[LEVEL]
        else:
            before, after = quantity(watch, room.before, p), quantity(watch, room.after, p)
            if happens(watch, before, after, now.direction):
                room.when[w] = located(float(w), before, after, now, room, limits)
        if not math.isnan(room.when[w]):
            count += 1
    return count


def tell_watched(now, room, told, limits):
    """Tell what happens within the step, in its order. Returns 0 where nothing does, 1 where the
    asker can wait for it, 2 where not, and 3 where it ends the motion.
    """
    urgent, p = 0, room.p
    for _ in range(watched(now, room, limits)):
        first = -1
        for w in range(room.asked):
            later = first >= 0 and now.direction * (room.when[w] - room.when[first]) >= 0.0
            if not math.isnan(room.when[w]) and not later:
                first = w
        clock = room.when[first]
        room.when[first] = math.nan
        if clock == now.end:
            tell(now, told, float(first), clock, passed_at_end(now, room, limits), room.after, p)
        else:
            point_within(now, room, clock)
            passed = now.started + elapsed(now, room, room.within, limits)
            tell(now, told, float(first), clock, passed, room.between, p)
        watch = watch_of(room, first)
        urgent = max(urgent, 1 if watch[WAITS] else 2)
        if watch[ENDS]:
            return 3
    return urgent


def passed_at_end(now, room, limits):
    """Time since the start, at the end of the step."""
    return now.started + elapsed(now, room, room.new, limits)


def record(now, room, rows, limits):
    """Record the step: evenly spaced along its clock, up to its end."""
    for sample in range(1, SAMPLES):
        clock = now.clock + (now.end - now.clock) * (sample / SAMPLES)
        point_within(now, room, clock)
        passed = now.started + elapsed(now, room, room.within, limits)
        record_point(now, rows, passed, room.between, room.p)
    record_point(now, rows, passed_at_end(now, room, limits), room.after, room.p)


def record_point(now, rows, passed, columns, p):
    """Add what is recorded of a point (see `recording.row`)."""
    n = now.recorded
    rows[n, 0] = now.time + passed
    rows[n, 1] = now.slip + slipped(now, passed, columns[SPRING], p)
    rows[n, 2], rows[n, 3], rows[n, 4] = columns[LOG_RATE], columns[SPRING], columns[FRICTION]
    rows[n, 5], rows[n, 6], rows[n, 7] = columns[RATIO], columns[STATE], columns[READING]
    rows[n, RECORDED_REGIME] = now.regime
    for i in range(now.states):
        rows[n, STATES + i] = columns[PSIS + i]
    now.recorded = n + 1
