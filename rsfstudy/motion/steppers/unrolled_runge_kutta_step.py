"""Functions that generate a Runge-Kutta step without loops for a given number of unknowns.

The Butcher tableau is the same as in SciPy's DOP853 (Hairer, Norsett and Wanner 1993). For a simple
scene, loops over stages and unknowns would take as much time as the evaluation of the equations. If
the code is unrolled and the equations are inlined, the compiler can also share expressions between
the stages. ``build_step_attempt_function`` is the main function.

The results of a step are stored in two arrays. The first array contains the derivatives at all
stages. The second array, called the block, contains a header, the unknowns at the end of the step,
the scales of the unknowns, and the coefficients of the dense output.
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

#: Number of stages of a step, number of additional stages for dense output, and number of rows of
#: dense output coefficients.
STAGE_COUNT, EXTRA_STAGE_COUNT, DENSE_ROW_COUNT = 12, 3, 7
STAGE_COUNT_WITH_DENSE_OUTPUT = STAGE_COUNT + 1 + EXTRA_STAGE_COUNT
#: Weights of the derivatives in each weighted sum. The weighted sums are the stages and the error
#: estimates of order five and three. The last stage is the end of the step.
_RUNGE_KUTTA_WEIGHTS_BY_SUM_NAME: Mapping[str, np.ndarray] = {
    **{f"stage_{s}": DOP853.A[s, :s] for s in range(1, STAGE_COUNT)},
    f"stage_{STAGE_COUNT}": DOP853.B,
    "error_of_fifth": DOP853.E5,
    "error_of_third": DOP853.E3,
}
#: Indices of the items in the block header: step size, tolerance, and error divided by the
#: tolerance. The last constant is the length of the header.
LENGTH_INDEX, TOLERANCE_INDEX, ERROR_INDEX, HEADER_SIZE = 0, 1, 2, 3

AnyCallable = Callable[..., Any]


def build_step_attempt_function(
    rate_function: AnyCallable, unknown_count: int, unpack_parameters: AnyCallable
) -> AnyCallable:
    """Build a function that attempts one step.

    Parameters
    ----------
    rate_function : callable
        Right-hand side ``rate_function(unknowns, parameters)`` of the equations.
    unknown_count : int
        Number of unknowns.
    unpack_parameters : callable
        Function that converts an array of parameters to a tuple.

    Returns
    -------
    callable
        Function ``attempt(y, stages, p, step)``. Its arguments are the initial unknowns, the
        derivatives in all stages, the parameters and the block. The first stage must contain the
        derivatives at ``y``. The function fills in the other stages, the final unknowns and the
        error.
    """
    made: AnyCallable = _build_step_attempt_factory(unknown_count)(rate_function, unpack_parameters)
    return made


@cache
def _build_step_attempt_factory(unknown_count: int) -> AnyCallable:
    """Compile a function that builds step functions from right-hand sides."""
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
            *(f"z{i} = y{i} + length * {_generate_weighted_sum_call(f'stage_{s}', i)}" for i in n),
            f"{rates}, = rate_of(({unknown},), of_scene)",
            *(f"stages[{s * unknown_count + i}] = k{s}_{i}" for i in n),
        ]
    for i in n:
        lines += [
            f"step[{HEADER_SIZE + i}] = z{i}",
            f"allowed = tolerance * (step[{scales + i}] + max(abs(y{i}), abs(z{i})))",
            f"fifth{i} = {_generate_weighted_sum_call('error_of_fifth', i)} / allowed",
            f"third{i} = {_generate_weighted_sum_call('error_of_third', i)} / allowed",
        ]
    lines += [
        f"fifth = {' + '.join(f'fifth{i} * fifth{i}' for i in n)}",
        f"both = fifth + 0.01 * ({' + '.join(f'third{i} * third{i}' for i in n)})",
        f"error = abs(length) * fifth / math.sqrt(both * {unknown_count}.0) if both != "
        "0.0 else 0.0",
        f"step[{ERROR_INDEX}] = error",
    ]
    inner = "\n        ".join(["def attempt(y, stages, p, step):", *lines])
    return _compile_function_from_source(
        "attempts", "rate_of, numbers", [inner, "return attempt"], _compile_weighted_sum_functions()
    )


@cache
def _compile_weighted_sum_functions() -> dict[str, Any]:
    """Compile one function for each weighted sum of the derivatives.

    All systems of equations share the compiled functions.
    """
    return {
        name: _compile_function_from_source(
            name,
            _generate_weighted_sum_argument_code(name),
            [f"return {_generate_weighted_sum_expression(name)}"],
            {},
        )
        for name in _RUNGE_KUTTA_WEIGHTS_BY_SUM_NAME
    }


def _generate_weighted_sum_call(sum_name: str, unknown_index: int) -> str:
    """Return the source code of a call that computes a weighted sum for one unknown."""
    rates = _generate_weighted_sum_argument_code(sum_name).split(", ")
    return f"{sum_name}({', '.join(f'{rate}_{unknown_index}' for rate in rates)})"


def _generate_weighted_sum_argument_code(sum_name: str) -> str:
    """Return the source code that lists the arguments of a weighted-sum function."""
    return ", ".join(f"k{s}" for s in np.flatnonzero(_RUNGE_KUTTA_WEIGHTS_BY_SUM_NAME[sum_name]))


def _generate_weighted_sum_expression(sum_name: str) -> str:
    """Return the source code of the expression that computes a weighted sum."""
    return " + ".join(
        f"{float(x)!r} * k{s}"
        for s, x in enumerate(_RUNGE_KUTTA_WEIGHTS_BY_SUM_NAME[sum_name])
        if x
    )


def _compile_function_from_source(
    function_name: str,
    argument_source: str,
    body_lines: Sequence[str],
    global_values: Mapping[str, Any],
) -> AnyCallable:
    """Compile a function from source code that a debugger can display."""
    made: dict[str, Any] = {**global_values, "__name__": __name__, "math": math}
    text = "\n    ".join([f"def {function_name}({argument_source}):", *body_lines])
    file = f"<{__name__}.{function_name} {crc32(text.encode()):08x}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    exec(compile(text, file, "exec"), made)
    function: AnyCallable = made[function_name]
    return function
