"""Error boundary that converts the exceptions of the public functions and classes.

Every exception raised by a public function is an instance of an rsfstudy error class. The error
message contains the invalid argument, the rule that it violates, and a remedy. Calls from within
rsfstudy bypass the boundary, so that the error refers to the function that the user called.
"""

from __future__ import annotations

import bdb
import difflib
import functools
import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, ParamSpec, Self, TypeVar

from rsfstudy._deprecation import find_stacklevel_of_user_code as find_stacklevel_of_user_code
from rsfstudy.argument_checks import (
    check_argument_lengths,
    convert_numpy_number_to_python,
    find_string_instead_of_list_error,
    find_type_mismatch_error,
    find_unusable_value_error,
)
from rsfstudy.errors import CallError, DataError, InvalidValue, RsfStudyError, shorten_text

FunctionParameters = ParamSpec("FunctionParameters")
FunctionResult = TypeVar("FunctionResult")
WrappedClass = TypeVar("WrappedClass", bound=type)

#: Exceptions that the error boundary does not convert.
_EXCEPTIONS_PASSED_UNCHANGED = (RsfStudyError, Warning, bdb.BdbQuit)
#: Special methods that are wrapped in addition to the methods without a leading underscore.
_WRAPPED_SPECIAL_METHODS = ("__init__", "__new__", "__call__", "__getitem__")
#: Modules that are skipped when the error boundary looks for the calling module, because they only
#: forward calls from other modules.
_MODULES_SKIPPED_WHEN_FINDING_CALLER = ("dataclasses", "functools", "rsfstudy._deprecation")


def raise_only_rsfstudy_errors(
    function: Callable[FunctionParameters, FunctionResult],
    *,
    applies_to_internal_calls: bool = False,
    unchanged_exceptions: tuple[type[Exception], ...] = _EXCEPTIONS_PASSED_UNCHANGED,
) -> Callable[FunctionParameters, FunctionResult]:
    """Wrap a function so that it raises only errors of rsfstudy.

    Parameters
    ----------
    function : callable
        A public function or method.
    applies_to_internal_calls : bool, default: False
        If True, the error boundary also converts exceptions in calls from within rsfstudy.
    unchanged_exceptions : tuple of type, optional
        Exceptions that are not converted. The defaults are errors of rsfstudy, warnings, and the
        exception that a debugger raises to quit.

    Returns
    -------
    callable
        Wrapped function.

    Notes
    -----
    If the arguments do not match the signature, the wrapped function raises ``CallError``, which is
    a ``TypeError`` that lists the parameters. Any other exception is converted to ``InvalidValue``,
    or to ``DataError`` if a dataset caused the exception. The original exception is the cause of
    the new exception.
    """
    return _wrap_to_raise_rsfstudy_errors(
        function,
        applies_to_internal_calls=applies_to_internal_calls,
        unchanged_exceptions=unchanged_exceptions,
    )


def make_methods_raise_rsfstudy_errors(wrapped_class: WrappedClass) -> WrappedClass:
    """Apply the error boundary to the constructor and the public methods.

    The wrapped constructor also rejects arguments that do not match their annotations. Most
    dataclasses accept any argument, so without this check a wrong argument would cause an error
    much later. Static methods are not wrapped, because the engines compile the static methods of
    friction laws and other model components.

    Parameters
    ----------
    wrapped_class : type
        Class to wrap. This class is modified in place.

    Returns
    -------
    type
        The modified class.
    """
    for name, member in list(vars(wrapped_class).items()):
        if name.startswith("_") and name not in _WRAPPED_SPECIAL_METHODS:
            continue
        is_constructor = name in ("__init__", "__new__")
        is_static = isinstance(member, staticmethod)
        if isinstance(member, classmethod) or (is_static and is_constructor):
            guarded = _wrap_to_raise_rsfstudy_errors(member.__func__, is_constructor=is_constructor)
            setattr(wrapped_class, name, type(member)(guarded))
        elif inspect.isfunction(member):
            setattr(
                wrapped_class,
                name,
                _wrap_to_raise_rsfstudy_errors(member, is_constructor=is_constructor),
            )
    return wrapped_class


class ConstructorKeywordCheckMixin:
    """Base class for classes that users define, such as measures.

    If a keyword argument of the constructor is unknown, the error lists the valid keywords. The
    check is needed because ``make_methods_raise_rsfstudy_errors`` is not applied to user-defined
    classes.

    Parameters
    ----------
    *args : Any
        Positional arguments of the subclass.
    **keywords : Any
        Keyword arguments of the subclass.

    Raises
    ------
    CallError
        If a keyword is not a parameter of the class.
    """

    def __new__(cls, *args: Any, **keywords: Any) -> Self:
        """Create an instance after checking the keyword arguments."""
        kind: type = cls
        valid = _list_constructor_parameters(kind)
        for name in keywords if valid else ():
            if name not in valid:
                raise _build_unknown_keyword_error(cls.__name__, name, valid)
        return super().__new__(cls)


@functools.cache
def _list_constructor_parameters(inspected_class: type) -> tuple[str, ...]:
    """Return the parameter names of the constructor of a class.

    The tuple is empty if the constructor accepts arbitrary keyword arguments.
    """
    parameters = inspect.signature(inspected_class.__init__).parameters  # type: ignore[misc]
    takes_any = any(p.kind is p.VAR_KEYWORD for p in parameters.values())
    return () if takes_any else tuple(parameters)[1:]


def _wrap_to_raise_rsfstudy_errors(
    function: Callable[FunctionParameters, FunctionResult],
    *,
    applies_to_internal_calls: bool = False,
    is_constructor: bool = False,
    unchanged_exceptions: tuple[type[Exception], ...] = _EXCEPTIONS_PASSED_UNCHANGED,
) -> Callable[FunctionParameters, FunctionResult]:
    """Wrap a function in the error boundary.

    If ``is_constructor`` is True, NumPy numbers are converted to Python numbers, which can be
    stored in files. In this case, the arguments are also checked against their annotations. The
    check runs after the call, so that the more specific errors of the constructor are raised
    first. If the function has a ``convert_arguments`` attribute, the wrapper calls this attribute
    to convert deprecated arguments.
    """
    signature = inspect.signature(inspect.unwrap(function))
    name = function.__qualname__.removesuffix(".__init__").removesuffix(".__new__")
    remedy = f"See the documentation of {name}."
    convert_arguments = getattr(function, "convert_arguments", None)

    def bind(args: tuple[Any, ...], options: dict[str, Any]) -> dict[str, Any]:
        try:
            return signature.bind(*args, **options).arguments
        except TypeError as error:
            names = [n for n in signature.parameters if n not in ("self", "cls", "_cls")]
            unknown = [keyword for keyword in options if keyword not in names]
            if unknown:
                raise _build_unknown_keyword_error(name, unknown[0], names) from None
            text = f"{name}() {shorten_text(error)}. Parameters: {', '.join(names) or 'none'}."
            raise CallError(text) from None

    @functools.wraps(function)
    def wrapper(
        *args: FunctionParameters.args, **options: FunctionParameters.kwargs
    ) -> FunctionResult:
        if convert_arguments:
            args, options = convert_arguments(args, options)
        if is_constructor:
            args = tuple(map(convert_numpy_number_to_python, args))  # type: ignore[assignment]
            options = {key: convert_numpy_number_to_python(value) for key, value in options.items()}  # type: ignore[assignment]
        if not applies_to_internal_calls and _is_called_from_rsfstudy():
            try:
                return function(*args, **options)
            except TypeError:
                bind(args, options)
                raise
        arguments = bind(args, options)
        check_argument_lengths(arguments)
        try:
            answered = function(*args, **options)
        except InvalidValue as error:
            if wrong := find_string_instead_of_list_error(function, arguments, error):
                raise wrong from error
            raise
        except unchanged_exceptions:
            raise
        except Exception as error:
            wrong = find_type_mismatch_error(function, arguments, remedy)
            wrong = wrong or find_unusable_value_error(arguments, error, remedy)
            raise wrong or _build_failed_call_error(name, arguments, error) from error
        if is_constructor:
            # The constructor may have converted the arguments to other types.
            made = getattr(arguments.get("self"), "__dict__", {})
            stored = {name: made.get(name, value) for name, value in arguments.items()}
            if wrong := find_type_mismatch_error(function, stored, remedy):
                raise wrong
        return answered

    return wrapper


def _build_unknown_keyword_error(
    callable_name: str, keyword: str, valid_keywords: Iterable[str]
) -> CallError:
    """Return the error for an unknown keyword of a function or class."""
    names = list(valid_keywords)
    close = difflib.get_close_matches(shorten_text(keyword), names, n=1)
    hint = "".join(f" Did you mean {each!r}?" for each in close)
    takes = ", ".join(names) or "none"
    return CallError(
        f"{callable_name}() has no parameter {shorten_text(keyword)!r}.{hint} Parameters: {takes}."
    )


def _is_called_from_rsfstudy() -> bool:
    """Return True if the caller is a module of rsfstudy other than the command line."""
    frame = sys._getframe(2)
    while (
        name := frame.f_globals.get("__name__")
    ) in _MODULES_SKIPPED_WHEN_FINDING_CALLER and frame.f_back:
        frame = frame.f_back
    return _is_internal_module(name)


@functools.cache
def _is_internal_module(module_name: str | None) -> bool:
    """Return True if a module belongs to rsfstudy, but not to the command line."""
    name = str(module_name)
    return name.startswith("rsfstudy.") and not name.startswith("rsfstudy.cli.")


def _build_failed_call_error(
    callable_name: str, arguments: dict[str, Any], error: Exception
) -> RsfStudyError:
    """Return the error for a call that failed although all arguments have valid types."""
    reason = format_exception(error)
    if any(map(_is_dataset_or_accessor, arguments.values())):
        rule = (
            f"was modified, or was not created by rsfstudy ({reason.partition(': ')[2] or reason})"
        )
        if isinstance(error, KeyError) and len(error.args) == 1:
            # The message of xarray continues with a list of all variables.
            missing = str(error.args[0]).partition(". ")[0].removeprefix("No variable named ")
            if str(error.args[0]).startswith("No variable") or missing.isidentifier():
                rule = f"has no {shorten_text(missing)}, although datasets of rsfstudy contain it"
        remedy = "Pass the unmodified dataset, or run the study again."
        return DataError(f"{callable_name}: the dataset {rule}. {remedy}")
    if isinstance(error, MemoryError):
        return InvalidValue(
            callable_name, ..., f"requires more memory than is available ({shorten_text(error)})"
        )
    given = {key: value for key, value in arguments.items() if value is not None}
    remedy = f"See the documentation of {callable_name}."
    return InvalidValue(
        callable_name, given, f"failed for these arguments ({reason})", remedy=remedy
    )


def _is_dataset_or_accessor(value: object) -> bool:
    """Return True if a value is a dataset or the accessor of a dataset."""
    return hasattr(type(value), "data_vars") or "_dataset" in getattr(value, "__dict__", {})


def format_exception(error: BaseException) -> str:
    """Format the type and the message of an exception.

    Parameters
    ----------
    error : BaseException
        Exception to format.

    Returns
    -------
    str
        Type and message. If the message cannot be formatted, only the type is returned.
    """
    try:
        return f"{type(error).__name__}: {shorten_text(error)}"
    except Exception:  # str(error) may raise an exception
        return type(error).__name__


def check_regular_file(argument_name: str, path: str | Path) -> None:
    """Reject the path of a directory, a pipe or a device.

    Reading from a pipe or a device might never return. The function accepts a path that does not
    exist.

    Parameters
    ----------
    argument_name : str
        Name of the argument or option, for the error message.
    path : str or Path
        Path of a file.

    Raises
    ------
    InvalidValue
        If the path exists but is not a regular file, or if the path is not valid.
    """
    try:
        is_other = Path(path).exists() and not Path(path).is_file()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidValue(
            argument_name, str(path), f"cannot be used as the path of a file: {reason}"
        ) from error
    if is_other:
        remedy = "Pass the path of a regular file."
        raise InvalidValue(
            argument_name, str(path), "is a directory, a pipe or a device", remedy=remedy
        )
