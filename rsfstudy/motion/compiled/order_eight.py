"""Steps of order eight with dense output, for the compiler: the tableau and the controller of
SciPy's DOP853 (Hairer, Norsett and Wanner 1993), written out for a few unknowns.

`rates` is the address of the equations.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import DOP853

from rsfstudy.motion.compiled.calls import evaluate

#: Weights of the stages, of the end of a step behind them, and of the stages of its dense output.
_A, _A_EXTRA = np.vstack([DOP853.A, DOP853.B]), np.ascontiguousarray(DOP853.A_EXTRA)
_E3, _E5, _D = (np.ascontiguousarray(table) for table in (DOP853.E3, DOP853.E5, DOP853.D))
#: Stages of a step, of its dense output beyond the step's end, and rows of that.
STAGES, EXTRA, ROWS = 12, 3, 7
ALL_STAGES = STAGES + 1 + EXTRA

_SAFETY, _LEAST, _MOST, _EXPONENT = 0.9, 0.2, 10.0, -1.0 / 8.0


def copy(source, target):
    """Copy an array into another one, which may be longer."""
    for i in range(len(source)):
        target[i] = source[i]


def combined(y, stages, count, weights, row, length, result):
    """Fill in ``y + length * (weights . stages)``, over the first stages and a row of weights."""
    for i in range(len(result)):
        together = 0.0
        for j in range(count):
            together += weights[row, j] * stages[j, i]
        result[i] = y[i] + length * together


def attempt(y, stages, length, new, rates, p):
    """One step from `y`, whose rates are the first stage: to `new`, whose rates are stage 12."""
    for s in range(1, STAGES + 1):
        combined(y, stages, s, _A, s, length, new)
        evaluate(rates, new, y, p, stages[s])


def error_norm(y, new, stages, length, scales, tolerance):
    """Local error of a step over what is allowed."""
    fifth = third = 0.0
    for i in range(len(new)):
        e5 = e3 = 0.0
        for j in range(STAGES + 1):
            e5 += _E5[j] * stages[j, i]
            e3 += _E3[j] * stages[j, i]
        scale = tolerance * (scales[i] + max(abs(y[i]), abs(new[i])))
        fifth += (e5 / scale) ** 2
        third += (e3 / scale) ** 2
    if fifth == 0.0 and third == 0.0:
        return 0.0
    return abs(length) * fifth / math.sqrt((fifth + 0.01 * third) * len(new))


def stretched(length, error, rejected):
    """Length of the step after one that was accepted with this error."""
    factor = _MOST if error == 0.0 else min(_MOST, _SAFETY * error**_EXPONENT)
    return length * (min(1.0, factor) if rejected else factor)


def shortened(length, error):
    """Length of the next attempt after one that was rejected; its error may be no number."""
    factor = _SAFETY * error**_EXPONENT
    return length * (factor if factor > _LEAST else _LEAST)


def first_length(y, stages, new, direction, scales, tolerance, rates, p):
    """Length of the first step, by two evaluations of the rates."""
    d0 = d1 = 0.0
    for i in range(len(new)):
        scale = tolerance * (scales[i] + abs(y[i]))
        d0 += (y[i] / scale) ** 2
        d1 += (stages[0, i] / scale) ** 2
    d0, d1 = math.sqrt(d0 / len(new)), math.sqrt(d1 / len(new))
    trial = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    for i in range(len(new)):
        new[i] = y[i] + trial * direction * stages[0, i]
    evaluate(rates, new, y, p, stages[1])
    d2 = 0.0
    for i in range(len(new)):
        scale = tolerance * (scales[i] + abs(y[i]))
        d2 += ((stages[1, i] - stages[0, i]) / scale) ** 2
    d2 = math.sqrt(d2 / len(new)) / trial
    if d1 <= 1e-15 and d2 <= 1e-15:
        length = max(1e-6, trial * 1e-3)
    else:
        length = (0.01 / max(d1, d2)) ** -_EXPONENT
    return min(100.0 * trial, length)


def interpolate(y, new, within, stages, length, rows, rates, p):
    """Prepare dense output: its rows, by three more evaluations of the rates."""
    for s in range(EXTRA):
        count = STAGES + 1 + s
        combined(y, stages, count, _A_EXTRA, s, length, within)
        evaluate(rates, within, y, p, stages[count])
    for i in range(len(new)):
        first, last, moved = stages[0, i], stages[STAGES, i], new[i] - y[i]
        rows[0, i] = moved
        rows[1, i] = length * first - moved
        rows[2, i] = 2.0 * moved - length * (last + first)
        for r in range(ROWS - 3):
            together = 0.0
            for j in range(ALL_STAGES):
                together += _D[r, j] * stages[j, i]
            rows[3 + r, i] = length * together


def interpolated(y, rows, part, result):
    """Unknowns at a part of a step from its beginning."""
    for i in range(len(result)):
        value = 0.0
        for r in range(ROWS):
            value = (value + rows[ROWS - 1 - r, i]) * (part if r % 2 == 0 else 1.0 - part)
        result[i] = y[i] + value
