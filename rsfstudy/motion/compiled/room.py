"""Where one regime of a compiled motion finds and leaves its numbers."""

from __future__ import annotations

from typing import Any, NamedTuple

from rsfstudy.motion.compiled.calls import moved
from rsfstudy.motion.compiled.order_eight import copy
from rsfstudy.motion.compiled.table import FUNCTIONS, PSIS, SLOW
from rsfstudy.motion.compiled.unrolled import ALL_STAGES, ROWS, SIZES

Pointer = Any


class Room(NamedTuple):
    """How many unknowns there are. Pointers to them at the beginning of a step, at its end and
    within, and to their rates there; to its stages; to a block of what else is known of it, and of
    this to the scales and the rows of dense output; to the points there; to when events happen; and
    to what stays: the addresses of the equations, the watches and how many they are, and the
    numbers of the scene.
    """

    unknowns: int
    y: Pointer
    new: Pointer
    within: Pointer
    rates_within: Pointer
    stages: Pointer
    step: Pointer
    scales: Pointer
    dense: Pointer
    before: Pointer
    after: Pointer
    between: Pointer
    when: Pointer
    rates: int
    point: int
    attempt: int
    balance: int
    watches: Pointer
    asked: int
    p: Pointer


def size(unknowns: int, states: int, watches: int) -> int:
    """How many numbers it takes."""
    return SIZES + (1 + ROWS + 1 + ALL_STAGES + 1 + 1) * unknowns + 3 * (PSIS + states) + watches


def room(space, y, unknowns, scales, states, functions, watches, watched, p):
    """Room for a regime, in a space of that size."""
    new = moved(space, SIZES)
    own = moved(new, unknowns)
    dense = moved(own, unknowns)
    stages = moved(dense, ROWS * unknowns)
    within = moved(stages, ALL_STAGES * unknowns)
    rates_within = moved(within, unknowns)
    before = moved(rates_within, unknowns)
    after = moved(before, PSIS + states)
    between = moved(after, PSIS + states)
    when = moved(between, PSIS + states)
    copy(scales, own, unknowns)
    return Room(
        unknowns,
        y,
        new,
        within,
        rates_within,
        stages,
        space,
        own,
        dense,
        before,
        after,
        between,
        when,
        functions[0],
        functions[1],
        functions[2],
        functions[FUNCTIONS - 1],
        watches,
        watched,
        p,
    )


def spend(now, evaluations):
    """Count right-hand sides."""
    if now.regime == SLOW:
        now.spent_slow += evaluations
    else:
        now.spent_fast += evaluations
