"""Steps of order eight, for the compiler: how long the controller of SciPy's DOP853 has them, and
what there is within them.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853

from rsfstudy.motion.compiled.calls import evaluate, moved
from rsfstudy.motion.compiled.unrolled import ALL_STAGES, EXTRA, ROWS, STAGES

#: Weights of the stages of dense output, and of all stages in its rows.
_EXTRA_WEIGHTS, _DENSE_WEIGHTS = map(np.ascontiguousarray, (DOP853.A_EXTRA, DOP853.D))
_SAFETY, _LEAST, _MOST, _EXPONENT = 0.9, 0.2, 10.0, -1.0 / 8.0


def copy(source, target, count):
    """Copy so many numbers."""
    for i in range(count):
        target[i] = source[i]


def stretched(length, error, rejected):
    """Length of the step after one that was accepted with this error."""
    factor = _MOST if error == 0.0 else min(_MOST, _SAFETY * error**_EXPONENT)
    return length * (min(1.0, factor) if rejected else factor)


def shortened(length, error):
    """Length of the next attempt after one that was rejected; its error may be no number."""
    factor = _SAFETY * error**_EXPONENT
    return length * (factor if factor > _LEAST else _LEAST)


def first_length(room, direction, tolerance):
    """Length of the first step, by two evaluations of the rates."""
    y, first, count = room.y, room.stages, room.unknowns
    d0 = d1 = 0.0
    for i in range(count):
        scale = tolerance * (room.scales[i] + abs(y[i]))
        d0 += (y[i] / scale) ** 2
        d1 += (first[i] / scale) ** 2
    d0, d1 = math.sqrt(d0 / count), math.sqrt(d1 / count)
    trial = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    for i in range(count):
        room.new[i] = y[i] + trial * direction * first[i]
    evaluate(room.rates, room.new, y, room.p, room.within)
    d2 = 0.0
    for i in range(count):
        scale = tolerance * (room.scales[i] + abs(y[i]))
        d2 += ((room.within[i] - first[i]) / scale) ** 2
    d2 = math.sqrt(d2 / count) / trial
    if d1 <= 1e-15 and d2 <= 1e-15:
        length = max(1e-6, trial * 1e-3)
    else:
        length = (0.01 / max(d1, d2)) ** -_EXPONENT
    return min(100.0 * trial, length)


def prepare_interpolation(room, length):
    """Fill in the rows of dense output, by three more evaluations of the rates."""
    count, y, stages, rows = room.unknowns, room.y, room.stages, room.dense
    for s in range(EXTRA):
        for i in range(count):
            together = 0.0
            for j in range(STAGES + 1 + s):
                together += _EXTRA_WEIGHTS[s, j] * stages[j * count + i]
            room.within[i] = y[i] + length * together
        rates = moved(stages, (STAGES + 1 + s) * count)
        evaluate(room.rates, room.within, y, room.p, rates)
    for i in range(count):
        first, last, change = stages[i], stages[STAGES * count + i], room.new[i] - y[i]
        rows[i] = change
        rows[count + i] = length * first - change
        rows[2 * count + i] = 2.0 * change - length * (last + first)
        for r in range(ROWS - 3):
            together = 0.0
            for j in range(ALL_STAGES):
                together += _DENSE_WEIGHTS[r, j] * stages[j * count + i]
            rows[(3 + r) * count + i] = length * together


def interpolate(room, part):
    """Unknowns at a part of a step from its beginning."""
    for i in range(room.unknowns):
        value = 0.0
        for r in range(ROWS):
            row = room.dense[(ROWS - 1 - r) * room.unknowns + i]
            value = (value + row) * (part if r % 2 == 0 else 1.0 - part)
        room.within[i] = room.y[i] + value
