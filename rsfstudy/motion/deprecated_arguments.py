"""Functions that support calls with the deprecated arguments ``accuracy`` and ``meter``.

Functions that had the arguments ``accuracy`` and ``meter`` now have the argument ``integrator``.
Until version 1.0.0, calls with the deprecated arguments still work and emit a
``DeprecationWarning``. The same applies to user-defined measures whose method ``compute`` has the
deprecated arguments.
"""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import find_stacklevel_of_user_code
from rsfstudy.motion.accuracy import Accuracy
from rsfstudy.motion.integrator import Integrator
from rsfstudy.motion.work_meter import WorkMeter

AnyFunction = TypeVar("AnyFunction", bound=Callable[..., Any])

_FORMER_ARGUMENT_NAMES = ("accuracy", "meter")
_REMEDY_FOR_FORMER_ARGUMENTS = (
    "Pass integrator=integrator, as Measure.compute receives it. The arguments accuracy=accuracy, "
    "meter=meter will be removed in 1.0.0."
)


def accept_deprecated_accuracy_and_meter(function: AnyFunction) -> AnyFunction:
    """Make a function that takes an ``integrator`` also accept the deprecated arguments.

    Parameters
    ----------
    function : callable or type
        Function or method to modify. It must be wrapped in the error boundary, because the error
        boundary converts the arguments. For a measure class, the method ``compute`` is modified,
        and a user-defined ``compute`` method with the former signature is adapted.

    Returns
    -------
    callable or type
        The same function or class.
    """
    if isinstance(function, type):
        _adapt_former_compute_method(function)
        return function
    function.convert_arguments = replace_former_arguments_by_integrator  # type: ignore[attr-defined]
    return function


def replace_former_arguments_by_integrator(
    arguments: tuple[Any, ...], keywords: dict[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Replace the arguments ``accuracy`` and ``meter`` by an integrator.

    Parameters
    ----------
    arguments : tuple
        Positional arguments of a call.
    keywords : dict
        Keyword arguments of a call.

    Returns
    -------
    arguments : tuple
        Positional arguments without the accuracy and the work meter.
    keywords : dict
        Keyword arguments. If the call contains the deprecated arguments, an integrator is added.

    Raises
    ------
    InvalidValue
        If the call contains only one of the deprecated arguments, or if a deprecated argument has
        the wrong type.
    """
    pair = {
        **dict(
            zip(
                _FORMER_ARGUMENT_NAMES,
                (a for a in arguments if isinstance(a, Accuracy | WorkMeter)),
                strict=False,
            )
        ),
        **{
            name: keywords[name]
            for name in _FORMER_ARGUMENT_NAMES
            if keywords.get(name) is not None
        },
    }
    if not pair:
        return arguments, keywords
    accuracy, meter = (pair.get(name) for name in _FORMER_ARGUMENT_NAMES)
    if not (isinstance(accuracy, Accuracy) and isinstance(meter, WorkMeter)):
        rule = "must be an Accuracy and a WorkMeter"
        remedy = _REMEDY_FOR_FORMER_ARGUMENTS
        if isinstance(accuracy, Accuracy) and meter is None:
            remedy = (
                "To set the accuracy, pass rtol=..., budget=... or engine=.... In a user-defined "
                f"measure: {remedy}"
            )
        raise InvalidValue("accuracy, meter", (accuracy, meter), rule, remedy=remedy)
    text = (
        "An integrator has replaced the arguments accuracy and meter. "
        f"{_REMEDY_FOR_FORMER_ARGUMENTS}"
    )
    warnings.warn(text, DeprecationWarning, stacklevel=find_stacklevel_of_user_code())
    rest = tuple(a for a in arguments if not isinstance(a, Accuracy | WorkMeter))
    others = {name: value for name, value in keywords.items() if name not in _FORMER_ARGUMENT_NAMES}
    return rest, {**others, "integrator": Integrator(accuracy).with_work_meter(meter)}


def _adapt_former_compute_method(measure_class: type) -> None:
    """Adapt the method ``compute`` of a measure to take an integrator.

    A method with the former parameters ``scene``, ``accuracy`` and ``meter`` is replaced by a
    method that takes an integrator. The class is modified in place.
    """
    compute = vars(measure_class).get("compute")
    if not inspect.isfunction(compute):
        return
    if not _takes_accuracy_and_meter(compute):
        accept_deprecated_accuracy_and_meter(compute)
        return
    text = (
        f"{measure_class.__name__}.compute takes scene, accuracy and meter. Write "
        "compute(self, scene, integrator), pass integrator=integrator to rsfstudy.simulate, and "
        "replace accuracy.rtol by integrator.rtol. The old signature will be removed in 1.0.0."
    )
    warnings.warn(text, DeprecationWarning, stacklevel=find_stacklevel_of_user_code())

    @functools.wraps(compute)
    def compute_with_integrator(*arguments: Any, **keywords: Any) -> Any:
        (measure, scene, *given), keywords = replace_former_arguments_by_integrator(
            arguments, keywords
        )
        integrator = given[0] if given else keywords["integrator"]
        return compute(measure, scene, integrator.accuracy, integrator.work_meter)

    measure_class.compute = compute_with_integrator  # type: ignore[attr-defined]


def _takes_accuracy_and_meter(compute_method: Callable[..., Any]) -> bool:
    """Return True if a method has three parameters in addition to ``self``."""
    kinds = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    parameters = inspect.signature(compute_method).parameters.values()
    required = [p for p in parameters if p.kind in kinds and p.default is p.empty]
    return len(required) == 4
