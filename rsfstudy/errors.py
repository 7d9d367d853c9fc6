"""The errors a user meets: each says the value, the rule it breaks, the choices and the remedy; and
the warnings.
"""

from __future__ import annotations

import difflib
import reprlib
import signal
from collections.abc import Iterable

from rsfstudy._deprecation import renamed_members, renamed_names

__getattr__ = renamed_names(__name__)

#: Most characters of a text, and most choices, that a message has room for; and the most that are
#: listed beside those that look like what was given.
_MAX_CHARACTERS_OF_VALUE, _MAX_CHOICES, _MAX_CHOICES_WITH_SUGGESTIONS = 200, 60, 20
#: Most characters of a message.
_MAX_MESSAGE_LENGTH = 5000
#: Number and length of the choices that are compared with a value, which bounds the time.
_MAX_COMPARED_CHOICES, _MAX_CHOICE_LENGTH_FOR_SUGGESTION = 1000, 100


class _ShortValueRepr(reprlib.Repr):
    """Texts of values, of bounded length; numbers of NumPy are shown as numbers."""

    def repr1(self, x: object, level: int) -> str:
        number = type(x).__module__ == "numpy" and not getattr(x, "ndim", 1)
        return super().repr1(x.item() if number and hasattr(x, "item") else x, level)


_short_value_repr = _ShortValueRepr()
_short_value_repr.maxstring = _short_value_repr.maxother = _short_value_repr.maxlong = 100
_short_value_repr.maxlist = _short_value_repr.maxtuple = _short_value_repr.maxdict = (
    _short_value_repr.maxset
) = 20


class RsfStudyError(Exception):
    """Anything rsfstudy refuses or cannot finish; its text is meant for the user: one line, however
    long or odd the values that it shows.
    """

    def __str__(self) -> str:
        return escape_control_characters(
            shorten_text(super().__str__().replace("\n", " "), _MAX_MESSAGE_LENGTH)
        )


@renamed_members
class InvalidValue(RsfStudyError, ValueError):
    """A value that breaks a rule; of what is long, the message leaves the middle out.

    Parameters
    ----------
    name : str
        The field, option or axis the value was given for.
    value : object
        What was given.
    rule : str
        The rule it breaks, as in "must be positive".
    choices : iterable of str, optional
        The accepted values; the ones that look like `value` are suggested, alone where there are
        many.
    remedy : str, optional
        What to do instead.
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
        choices = list(choices)
        shown = _short_value_repr.repr(value)
        text = f"{shorten_text(name)} = {shown}: {rule}."
        compared = [
            c
            for c in choices[:_MAX_COMPARED_CHOICES]
            if len(c) <= _MAX_CHOICE_LENGTH_FOR_SUGGESTION
        ]
        close = difflib.get_close_matches(shown.strip("'\""), compared, n=3, cutoff=0.5)
        if close:
            text += f" Did you mean {' or '.join(map(repr, close))}?"
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

    def with_location(self, place: str) -> InvalidValue:
        """This error, with the place where it arose."""
        placed = InvalidValue.__new__(InvalidValue)
        Exception.__init__(placed, f"{shorten_text(place)}: {self}")
        placed.name, placed.value = self.name, self.value
        return placed


class CallError(RsfStudyError, TypeError):
    """Error raised if the arguments of a call do not match the signature."""


class DataError(RsfStudyError):
    """A file that is missing, damaged, or not a results file of rsfstudy."""


class RunError(RsfStudyError):
    """A run that could not start or could not finish."""


class Interrupted(RunError):
    """A run that the user ended, or a signal."""

    @property
    def exit_status(self) -> int:
        """Exit status of the process: 128 and the number of the signal, but 1 after Ctrl-C."""
        return self.__cause__.exit_status if isinstance(self.__cause__, SignalInterrupt) else 1


class SignalInterrupt(KeyboardInterrupt):
    """A signal that ends the process in order, as Ctrl-C does."""

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.exit_status = 128 + number


class RsfStudyWarning(UserWarning):
    """Base class of all warnings of rsfstudy.

    The message is shortened, and control characters are escaped, so that the message can be printed
    safely on a terminal.
    """

    def __str__(self) -> str:
        return escape_control_characters(shorten_text(super().__str__(), _MAX_MESSAGE_LENGTH))


class NoResultWarning(RsfStudyWarning):
    """What was asked of one scene has no number for an answer, nothing happens in it, or what
    happens is no physics.
    """


class IncompleteWarning(RsfStudyWarning):
    """A motion that ended early, or cells of a run that failed."""


def shorten_text(text: object, max_length: int = _MAX_CHARACTERS_OF_VALUE) -> str:
    """A text without its middle where it is too long for a message."""
    whole, half = str(text), max_length // 2
    return whole if len(whole) <= max_length else f"{whole[:half]}...{whole[-half:]}"


def escape_control_characters(text: str) -> str:
    """Text with its control characters spelt out."""
    characters = (c if c.isprintable() or c == "\n" else c.encode("unicode_escape") for c in text)
    return "".join(c if isinstance(c, str) else c.decode() for c in characters)
