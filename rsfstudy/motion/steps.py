"""Steps of one regime: taken, looked into, and cut short."""

from __future__ import annotations

import math

from rsfstudy.motion.calls import copy, evaluate
from rsfstudy.motion.layout import (
    BUDGET_SPENT,
    FAST,
    LOG_RATE,
    NO_LENGTH,
    NO_STEP,
    PSIS,
    RATIO,
    TAKEN,
)
from rsfstudy.motion.steppers import attempt, reach, retake, unknowns_at
from rsfstudy.motion.workspace import rate_of_step, spend
from rsfstudy.slider.equations import LONGEST_STEP, longest_step
from rsfstudy.slider.places import LOG_LOAD_RATE

#: What slopes of dense output may differ by from rates over a step, in local tolerances; how often
#: a step is halved for that, and by how much the next may be longer; and how far apart, over the
#: length of the step, values of dense output give its slopes.
ALLOWED, MOST_HALVINGS, GROWS, APART = 300.0, 6, 1.3, 5e-3


def elapsed(motion, space, y):
    """Time since the regime began, at some unknowns; NaN where nothing tells it."""
    if not motion.has_clock:
        return math.nan
    unit = space.limits.inertial_time if motion.regime == FAST else 1.0
    return unit * y[space.unknowns - 1]


def passed_at_begin(motion, space):
    """Time since the start, at the beginning of the step."""
    return motion.started + elapsed(motion, space, space.y)


def passed_at_end(motion, space):
    """Time since the start, at the end of the step."""
    return motion.started + elapsed(motion, space, space.new)


def take_step(motion, space):
    """Take a step whose local error is allowed; why not, where there is none."""
    longest = LONGEST_STEP
    if motion.limits_steps:
        longest = longest_step(space.before[LOG_RATE], space.before[RATIO], space.p[LOG_LOAD_RATE])
    longest *= motion.finer
    if motion.records:
        longest = min(longest, motion.resolved)
    length = 0.0
    if motion.kinks > 0:
        length = step_to_kink(motion, space, min(longest, motion.length))
    if length == 0.0:
        length = attempt(motion, space, longest)
    motion.steps += 1
    if length <= 0.0:
        return NO_STEP if length == 0.0 else BUDGET_SPENT
    total = 0.0
    for i in range(space.unknowns):
        total += space.new[i]
    if motion.end == motion.clock or not math.isfinite(total):
        return NO_LENGTH
    return TAKEN


def step_to_kink(motion, space, longest):
    """Length of a step that ends at the next kink, if that is not farther; else 0."""
    left = motion.lasts - passed_at_begin(motion, space)
    length = left / elapsed(motion, space, space.rates)
    return reach(motion, space, length) if 0.0 < length <= longest else 0.0


def halve_unresolved(motion, space):
    """Halve the step of a recorded motion until what lies within it is known as well as its
    end: where stability limits steps, and not accuracy, dense output is far less accurate.
    """
    for _ in range(MOST_HALVINGS):
        if is_resolved(motion, space):
            motion.resolved *= GROWS
            return
        retake(motion, space, motion.clock + 0.5 * (motion.end - motion.clock))
        motion.length = motion.resolved = abs(motion.taken)


def is_resolved(motion, space):
    """True if the slopes of dense output are the rates there, as well as is wanted.

    With an error e of dense output, they differ by its own slope, a few times e over the length of
    the step, and by what the rates make of e, as much where stability limits the step.
    """
    for i in range(space.unknowns):
        space.rates_within[i] = 0.0
    for part in (0.3, 0.7):
        clock = motion.clock + part * motion.taken
        for i in range(space.unknowns):
            space.slopes[i] = 0.0
        for shift, weight in ((2.0, -1.0), (1.0, 8.0), (-1.0, -8.0), (-2.0, 1.0)):
            unknowns_at(motion, space, clock + shift * APART * motion.taken)
            for i in range(space.unknowns):
                space.slopes[i] += weight / (12.0 * APART) * space.within[i]
        unknowns_at(motion, space, clock)
        spend(motion, 1)
        rate_of_step(motion, space, space.within, space.rates_within)
        for i in range(space.unknowns):
            differ = abs(motion.taken * space.rates_within[i] - space.slopes[i])
            size = space.scales[i] + max(abs(space.y[i]), abs(space.new[i]))
            # a number that is none is not resolved
            if not differ <= ALLOWED * motion.tolerance * size:
                return False
    return True


def point_within(motion, space, clock):
    """Fill in what the slider does at a clock within the step."""
    unknowns_at(motion, space, clock)
    spend(motion, 1)
    evaluate(space.rate, space.within, space.within, space.p, space.rates_within)
    evaluate(space.point, space.within, space.rates_within, space.p, space.between)


def cut(motion, space, clock):
    """Let the step end at a clock within it."""
    if clock != motion.end:
        point_within(motion, space, clock)
        copy(space.between, space.after, PSIS + motion.states)
        copy(space.within, space.new, space.unknowns)
        motion.end = clock
