"""Functions that describe numerical overflows in user-defined functions.

The integrators reject a trial step whose rates overflow. The rates may also overflow at the point
where a step or a motion starts, so that no step is possible. In this case, the functions of this
module describe the user-defined function that overflows and its arguments.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, ParamSpec, TypeVar

from rsfstudy.errors import shorten_text
from rsfstudy.motion.work_meter import MotionStopped
from rsfstudy.parts import Part
from rsfstudy.status import Status

FunctionParameters = ParamSpec("FunctionParameters")
FunctionResult = TypeVar("FunctionResult")


def call_and_describe_overflow(function: Callable[..., Any], *arguments: Any) -> str:
    """Call a function, and return a description of the overflow if an overflow occurs.

    Parameters
    ----------
    function : callable
        Function to call.
    *arguments : Any
        Arguments of the function.

    Returns
    -------
    str
        Sentence that names the part, the function of the part and its arguments. The string is
        empty if the function does not overflow.
    """
    try:
        function(*arguments)
    except OverflowError as error:
        return _describe_overflow_error(error)
    return ""


def convert_overflow_to_motion_stopped(
    function: Callable[FunctionParameters, FunctionResult],
) -> Callable[FunctionParameters, FunctionResult]:
    """Decorate a function, so that an overflow raises ``MotionStopped``.

    Parameters
    ----------
    function : callable
        Function to decorate.

    Returns
    -------
    callable
        Function that raises ``MotionStopped`` instead of ``OverflowError``.
    """

    @functools.wraps(function)
    def evaluate(
        *args: FunctionParameters.args, **options: FunctionParameters.kwargs
    ) -> FunctionResult:
        try:
            return function(*args, **options)
        except OverflowError as error:
            raise MotionStopped(
                Status.INTEGRATION_FAILED, _describe_overflow_error(error)
            ) from error

    return evaluate


def _describe_overflow_error(error: OverflowError) -> str:
    """Describe the function of a scene part that overflowed, and list its arguments."""
    for frame in _iterate_frames(error):
        if owner := _find_part_and_function_of_frame(frame):
            return (
                f"the function {owner} overflows ({shorten_text(error)}) for "
                f"{_format_arguments(frame)}. Limit the exponents in the function, for example to "
                "700"
            )
    return f"the right-hand side overflows ({shorten_text(error)})"


def _iterate_frames(error: BaseException) -> Iterator[FrameType]:
    """Yield the frames of a traceback, starting with the outermost frame."""
    traceback = error.__traceback__
    while traceback is not None:
        yield traceback.tb_frame
        traceback = traceback.tb_next


def _find_part_and_function_of_frame(frame: FrameType) -> str:
    """Return the names of the part and of the function executed in a frame."""
    for part in _iterate_subclasses(Part):
        for name, member in vars(part).items():
            function = getattr(member, "__func__", member)
            if getattr(function, "__code__", None) is frame.f_code:
                return f"{name} of the part {getattr(part, 'name', part.__name__)!r}"
    return ""


def _iterate_subclasses(base: type[Any]) -> Iterator[type[Any]]:
    """Yield all direct and indirect subclasses of a class."""
    subclasses: list[type[Any]] = base.__subclasses__()
    for subclass in subclasses:
        yield subclass
        yield from _iterate_subclasses(subclass)


def _format_arguments(frame: FrameType) -> str:
    """Return the argument names and values of the function executed in a frame."""
    names, _args, _keywords, values = inspect.getargvalues(frame)
    return ", ".join(f"{name} = {_format_value(values[name])}" for name in names if name in values)


def _format_value(value: Any) -> str:
    """Format a number or a tuple of numbers with six digits."""
    if isinstance(value, tuple | list):
        return f"({', '.join(map(_format_value, value))})"
    return f"{value:.6g}" if isinstance(value, int | float) else shorten_text(value)
