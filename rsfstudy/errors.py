"""Exceptions and warnings that users see.

Each error message contains the value, the rule that the value breaks, the valid choices and the
remedy.
"""

from __future__ import annotations

import difflib
import reprlib
import signal
from collections.abc import Iterable
from numbers import Number

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names

__getattr__ = build_getattr_for_former_names(__name__)

#: Maximum number of characters of a value in a message, maximum number of listed choices, and
#: maximum number of choices that are listed in addition to suggestions.
_MAX_CHARACTERS_OF_VALUE, _MAX_CHOICES, _MAX_CHOICES_WITH_SUGGESTIONS = 200, 60, 20
#: Kinds of objects that an error message identifies by name, as in "column 'speed' is unknown".
_KINDS_OF_NAMED_OBJECTS = frozenset(
    {"axis", "column", "dimension", "directory", "field", "header", "heading", "key", "line"}
    | {"axis name", "point", "variable name"}
    | {"override", "problem", "reduction", "segment", "sheet", "study", "table", "variable"}
)
#: Maximum number of characters of a message.
_MAX_MESSAGE_LENGTH = 5000
#: Maximum number and maximum length of the valid choices that are compared with an invalid value to
#: suggest similar choices. The limits bound the computing time of the comparison.
_MAX_COMPARED_CHOICES, _MAX_CHOICE_LENGTH_FOR_SUGGESTION = 1000, 100


class _ShortValueRepr(reprlib.Repr):
    """Formatter that limits the length of formatted values.

    NumPy scalars are formatted as Python numbers. Tables and datasets are formatted as the name of
    their type.
    """

    def repr1(self, x: object, level: int) -> str:
        """Format a value at a nesting level.

        Parameters
        ----------
        x : object
            Value to format.
        level : int
            Remaining number of nesting levels.

        Returns
        -------
        str
            Formatted value.
        """
        package = type(x).__module__.partition(".")[0]
        if package in ("pandas", "xarray"):
            return f"<{type(x).__name__}>"
        number = package == "numpy" and not getattr(x, "ndim", 1)
        return super().repr1(x.item() if number and hasattr(x, "item") else x, level)


_short_value_repr = _ShortValueRepr()
_short_value_repr.maxstring = _short_value_repr.maxother = _short_value_repr.maxlong = 100
_short_value_repr.maxlist = _short_value_repr.maxtuple = _short_value_repr.maxdict = (
    _short_value_repr.maxset
) = 20


class RsfStudyError(Exception):
    """Base class of all errors of rsfstudy.

    The message is a single line of limited length, in which control characters are escaped.
    """

    def __str__(self) -> str:
        """Return the message as a single line of limited length."""
        return escape_control_characters(
            shorten_text(super().__str__().replace("\n", " "), _MAX_MESSAGE_LENGTH)
        )


@add_former_member_names
class InvalidValue(RsfStudyError, ValueError):
    """Error raised if a value breaks a rule.

    Long values are abbreviated in the message.

    Parameters
    ----------
    name : str
        Name of the field, option or axis.
    value : object
        Invalid value. If it is the ellipsis ``...``, the message does not contain a value.
    rule : str
        Rule that the value breaks, for example "must be positive". The rule continues the sentence
        that begins with the name of the field.
    choices : iterable of str, optional
        Valid values. The message suggests up to three similar choices. If there are many choices,
        the message lists only the similar choices.
    remedy : str, optional
        Sentence that explains how to avoid the error.
    """

    def __init__(
        self,
        name: str,
        value: object,
        rule: str,
        *,
        choices: Iterable[str] = (),
        remedy: str = "",
    ) -> None:
        """Build the message from the value, the rule and the choices."""
        choices = list(choices)
        if rule == "is unknown" and choices and not isinstance(value, str):
            rule, choices = f"must be {_format_alternatives(choices)}", []
        shown = _short_value_repr.repr(value)
        text = _format_rule_violation(shorten_text(name), value, shown, rule)
        compared = [
            c
            for c in choices[:_MAX_COMPARED_CHOICES]
            if len(c) <= _MAX_CHOICE_LENGTH_FOR_SUGGESTION
        ]
        close = difflib.get_close_matches(shown.strip("'\""), compared, n=3, cutoff=0.6)
        if close:
            text += f" Did you mean {_format_alternatives(close)}?"
        if choices and not (
            close and (len(choices) > _MAX_CHOICES_WITH_SUGGESTIONS or len(choices) == len(close))
        ):
            more = len(choices) - _MAX_CHOICES
            text += f" Choices: {', '.join(map(shorten_text, choices[:_MAX_CHOICES]))}"
            text += f" and {more:,} more." if more > 0 else "."
        if remedy:
            text += f" {remedy}"
        super().__init__(text)
        self.name = name
        self.value = value

    def with_location(self, location: str) -> InvalidValue:
        """Return a copy of the error with a location at the beginning of the message.

        Parameters
        ----------
        location : str
            Location of the invalid value, for example a file name and a line.

        Returns
        -------
        InvalidValue
            Copy of the error with the same name and value.
        """
        placed = InvalidValue.__new__(InvalidValue)
        Exception.__init__(placed, f"{shorten_text(location)}: {self}")
        placed.name, placed.value = self.name, self.value
        return placed


class CallError(RsfStudyError, TypeError):
    """Error raised if the arguments of a call do not match the signature."""


class DataError(RsfStudyError):
    """Error raised if a file is missing, damaged, or not a results file."""


class RunError(RsfStudyError):
    """Error raised if a run cannot start or cannot finish."""


class Interrupted(RunError):
    """Error raised if the user or a signal ends a run."""

    @property
    def exit_status(self) -> int:
        """Exit status of the process.

        After a signal, the exit status is 128 plus the signal number. After Ctrl-C, the exit status
        is 1.
        """
        return self.__cause__.exit_status if isinstance(self.__cause__, SignalInterrupt) else 1


class SignalInterrupt(KeyboardInterrupt):
    """Exception raised if a signal ends the process.

    The process is terminated in the same orderly way as after Ctrl-C.

    Parameters
    ----------
    number : int
        Signal number.

    Attributes
    ----------
    exit_status : int
        Exit status of the process, which is 128 plus the signal number.
    """

    def __init__(self, number: int) -> None:
        """Set the message and the exit status."""
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.exit_status = 128 + number


class RsfStudyWarning(UserWarning):
    """Base class of all warnings of rsfstudy.

    The message is shortened, and control characters are escaped, so that the message can be printed
    safely on a terminal.
    """

    def __str__(self) -> str:
        """Return the shortened message with escaped control characters."""
        return escape_control_characters(shorten_text(super().__str__(), _MAX_MESSAGE_LENGTH))


class NoResultWarning(RsfStudyWarning):
    """Warning issued if a computation for one scene has no valid result.

    Possible reasons are that the requested quantity has no numerical value, that the slider does
    not move, or that the motion is unphysical.
    """


class IncompleteWarning(RsfStudyWarning):
    """Warning issued if a motion ended early or if cells of a run failed."""


def _format_rule_violation(name: str, value: object, shown_value: str, rule: str) -> str:
    """Write a sentence that contains a name, its invalid value and the violated rule."""
    is_kind = name in _KINDS_OF_NAMED_OBJECTS
    # A name such as "where" could be read as an English word, so it is written in quotation marks.
    subject = repr(name) if name.isalpha() and not is_kind else name
    if value is ... or (value is None and rule.startswith(("is required", "is missing"))):
        return f"{subject} {rule}."
    is_short = value is None or isinstance(value, str | Number) or callable(value)
    if (rule.startswith(("must ", "accepts ")) or not is_short) and "(got " not in rule:
        requirement, conjunction, reason = rule.partition(", because")
        return f"{subject} {requirement} (got {shown_value}){conjunction}{reason}."
    if name == "field" and rule.startswith("is not a scene field"):
        return f"{shown_value} {rule}."
    relation = " " if is_kind and isinstance(value, str | int) else " = "
    return f"{name}{relation}{shown_value} {rule}."


def _format_alternatives(choices: list[str]) -> str:
    """Format valid choices as a list whose last two items are joined by "or"."""
    *others, last = map(repr, choices[:_MAX_CHOICES])
    return f"{', '.join(others)} or {last}" if others else last


def shorten_text(text: object, max_length: int = _MAX_CHARACTERS_OF_VALUE) -> str:
    """Shorten a string by replacing its middle with an ellipsis.

    Parameters
    ----------
    text : object
        String, or an object that is converted to a string.
    max_length : int, default: 200
        Maximum number of characters without the ellipsis.

    Returns
    -------
    str
        The unchanged string if it is short enough. Otherwise the beginning and the end of the
        string.
    """
    whole, half = str(text), max_length // 2
    return whole if len(whole) <= max_length else f"{whole[:half]}...{whole[-half:]}"


def escape_control_characters(text: str) -> str:
    """Replace control characters with visible escape sequences.

    Parameters
    ----------
    text : str
        Message. Newline characters are not replaced.

    Returns
    -------
    str
        Message that can be printed safely on a terminal.
    """
    characters = (c if c.isprintable() or c == "\n" else c.encode("unicode_escape") for c in text)
    return "".join(c if isinstance(c, str) else c.decode() for c in characters)
