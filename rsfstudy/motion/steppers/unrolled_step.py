"""Source of steps of order eight, written out for so many unknowns.

The tableau is that of SciPy's DOP853 (Hairer, Norsett and Wanner 1993). Loops over stages and
unknowns would cost as much as simple equations do; and what is the same in all stages a compiler
finds only where the equations stand in the step itself.

What is known of a step beside its stages is one block of numbers: its sizes, the unknowns at its
end, their scales, and the rows of its dense output.
"""

from __future__ import annotations

import linecache
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any
from zlib import crc32

import numpy as np
from scipy.integrate import DOP853

#: Stages of a step, of its dense output beyond the step's end, and rows of that.
STAGE_COUNT, EXTRA_STAGE_COUNT, DENSE_ROW_COUNT = 12, 3, 7
TOTAL_STAGE_COUNT = STAGE_COUNT + 1 + EXTRA_STAGE_COUNT
#: Weights of the stages before each stage, of which the last is the end of the step, and of all of
#: them in its errors of fifth and third order.
_RATE_WEIGHTS_BY_SUM_NAME: Mapping[str, np.ndarray] = {
    **{f"stage_{s}": DOP853.A[s, :s] for s in range(1, STAGE_COUNT)},
    f"stage_{STAGE_COUNT}": DOP853.B,
    "error_of_fifth": DOP853.E5,
    "error_of_third": DOP853.E3,
}
#: Places of the sizes of a step, in front of its block, and how many they are: its length, the
#: tolerance, and its local error over what is allowed.
LENGTH_INDEX, TOLERANCE_INDEX, ERROR_INDEX, HEADER_SIZE = 0, 1, 2, 3

Function = Callable[..., Any]


def build_step_attempt_function(
    rate_function: Function, unknown_count: int, unpack_parameters: Function
) -> Function:
    """One step by rates of so many unknowns: ``attempt(y, stages, p, step)``.

    From `y`, whose rates are the first stage, it fills in the other stages, the unknowns at its
    end, and its local error over what is allowed. `unpack_parameters` makes the tuple of numbers
    that `rate` reads of `p`.
    """
    made: Function = _build_step_attempt_factory(unknown_count)(rate_function, unpack_parameters)
    return made


@cache
def _build_step_attempt_factory(unknown_count: int) -> Function:
    """Source of such steps of ``rate_of`` and ``numbers``."""
    n, scales = range(unknown_count), HEADER_SIZE + unknown_count
    lines = [
        f"step[{ERROR_INDEX}] = math.nan",
        "of_scene = numbers(p)",
        f"length, tolerance = step[{LENGTH_INDEX}], step[{TOLERANCE_INDEX}]",
        *(f"y{i}, k0_{i} = y[{i}], stages[{i}]" for i in n),
    ]
    for s in range(1, STAGE_COUNT + 1):
        unknown, rates = (", ".join(f"{x}{i}" for i in n) for x in ("z", f"k{s}_"))
        lines += [
            *(f"z{i} = y{i} + length * {_sum_call_source(f'stage_{s}', i)}" for i in n),
            f"{rates}, = rate_of(({unknown},), of_scene)",
            *(f"stages[{s * unknown_count + i}] = k{s}_{i}" for i in n),
        ]
    for i in n:
        lines += [
            f"step[{HEADER_SIZE + i}] = z{i}",
            f"allowed = tolerance * (step[{scales + i}] + max(abs(y{i}), abs(z{i})))",
            f"fifth{i} = {_sum_call_source('error_of_fifth', i)} / allowed",
            f"third{i} = {_sum_call_source('error_of_third', i)} / allowed",
        ]
    lines += [
        f"fifth = {' + '.join(f'fifth{i} * fifth{i}' for i in n)}",
        f"both = fifth + 0.01 * ({' + '.join(f'third{i} * third{i}' for i in n)})",
        f"error = abs(length) * fifth / math.sqrt(both * {unknown_count}.0) if both != "
        "0.0 else 0.0",
        f"step[{ERROR_INDEX}] = error",
    ]
    inner = "\n        ".join(["def attempt(y, stages, p, step):", *lines])
    return _compile_function_source(
        "attempts", "rate_of, numbers", [inner, "return attempt"], _compile_weighted_sum_functions()
    )


@cache
def _compile_weighted_sum_functions() -> dict[str, Any]:
    """Weighted sums of the rates in all stages, as functions: compiled once for all equations."""
    return {
        name: _compile_function_source(
            name, _sum_argument_source(name), [f"return {_weighted_sum_source(name)}"], {}
        )
        for name in _RATE_WEIGHTS_BY_SUM_NAME
    }


def _sum_call_source(sum_name: str, unknown_index: int) -> str:
    """A weighted sum of the rates of an unknown."""
    rates = _sum_argument_source(sum_name).split(", ")
    return f"{sum_name}({', '.join(f'{rate}_{unknown_index}' for rate in rates)})"


def _sum_argument_source(sum_name: str) -> str:
    """Terms of a sum."""
    return ", ".join(f"k{s}" for s in np.flatnonzero(_RATE_WEIGHTS_BY_SUM_NAME[sum_name]))


def _weighted_sum_source(sum_name: str) -> str:
    return " + ".join(
        f"{float(x)!r} * k{s}" for s, x in enumerate(_RATE_WEIGHTS_BY_SUM_NAME[sum_name]) if x
    )


def _compile_function_source(
    function_name: str,
    argument_source: str,
    body_lines: Sequence[str],
    global_values: Mapping[str, Any],
) -> Function:
    """The function that some lines define, which a debugger shows."""
    made: dict[str, Any] = {**global_values, "__name__": __name__, "math": math}
    text = "\n    ".join([f"def {function_name}({argument_source}):", *body_lines])
    file = f"<{__name__}.{function_name} {crc32(text.encode()):08x}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    exec(compile(text, file, "exec"), made)
    function: Function = made[function_name]
    return function
