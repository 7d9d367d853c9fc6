"""The errors a user meets: each says the value, the rule it breaks, the choices and the remedy; and
the warnings.
"""

from __future__ import annotations

import difflib
import reprlib
import signal
from collections.abc import Iterable

#: Most characters of a text, and most choices, that a message has room for; and the most that are
#: listed beside those that look like what was given.
_MOST_CHARACTERS, _MOST_CHOICES, _FEW = 200, 60, 20
#: Most characters of a message.
_LONGEST = 5000
#: Number and length of the choices that are compared with a value, which bounds the time.
_MOST_COMPARED, _LONGEST_COMPARED = 1000, 100


class _Values(reprlib.Repr):
    """Texts of values, of bounded length; numbers of NumPy are shown as numbers."""

    def repr1(self, x: object, level: int) -> str:
        number = type(x).__module__ == "numpy" and not getattr(x, "ndim", 1)
        return super().repr1(x.item() if number and hasattr(x, "item") else x, level)


_values = _Values()
_values.maxstring = _values.maxother = _values.maxlong = 100
_values.maxlist = _values.maxtuple = _values.maxdict = _values.maxset = 20


class RsfStudyError(Exception):
    """Anything rsfstudy refuses or cannot finish; its text is meant for the user: one line, however
    long or odd the values that it shows.
    """

    def __str__(self) -> str:
        return spelt(brief(super().__str__().replace("\n", " "), _LONGEST))


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
        shown = _values.repr(value)
        text = f"{brief(name)} = {shown}: {rule}."
        compared = [c for c in choices[:_MOST_COMPARED] if len(c) <= _LONGEST_COMPARED]
        close = difflib.get_close_matches(shown.strip("'\""), compared, n=3, cutoff=0.5)
        if close:
            text += f" Did you mean {' or '.join(map(repr, close))}?"
        if choices and not (close and (len(choices) > _FEW or len(choices) == len(close))):
            more = len(choices) - _MOST_CHOICES
            text += f" Choices: {', '.join(map(brief, choices[:_MOST_CHOICES]))}"
            text += f" and {more:,} more." if more > 0 else "."
        if remedy:
            text += f" {remedy}"
        super().__init__(text)
        self.name = name
        self.value = value

    def at(self, place: str) -> InvalidValue:
        """This error, with the place where it arose."""
        placed = InvalidValue.__new__(InvalidValue)
        Exception.__init__(placed, f"{brief(place)}: {self}")
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
        return self.__cause__.exit_status if isinstance(self.__cause__, Signalled) else 1


class Signalled(KeyboardInterrupt):
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
        return spelt(brief(super().__str__(), _LONGEST))


class NoAnswer(RsfStudyWarning):
    """What was asked of one scene has no number for an answer, nothing happens in it, or what
    happens is no physics.
    """


class Incomplete(RsfStudyWarning):
    """A motion that ended early, or cells of a run that failed."""


def brief(text: object, most: int = _MOST_CHARACTERS) -> str:
    """A text without its middle where it is too long for a message."""
    whole, half = str(text), most // 2
    return whole if len(whole) <= most else f"{whole[:half]}...{whole[-half:]}"


def spelt(text: str) -> str:
    """Text with its control characters spelt out."""
    characters = (c if c.isprintable() or c == "\n" else c.encode("unicode_escape") for c in text)
    return "".join(c if isinstance(c, str) else c.decode() for c in characters)
