"""The errors a user meets: each says the value, the rule it breaks, the choices and the remedy."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class RsfStudyError(Exception):
    """Anything rsfstudy refuses or cannot finish; its text is meant for the user."""


class InvalidValue(RsfStudyError, ValueError):
    """A value that breaks a rule.

    Parameters
    ----------
    name : str
        The field, option or axis the value was given for.
    value : object
        What was given.
    rule : str
        The rule it breaks, as in "must be positive".
    choices : iterable of str, optional
        The accepted values; the ones that look like `value` are suggested.
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
        text = f"{name} = {value!r}: {rule}."
        close = difflib.get_close_matches(str(value), choices, n=3, cutoff=0.5)
        if close:
            text += f" Did you mean {' or '.join(map(repr, close))}?"
        if choices:
            text += f" Choices: {', '.join(choices)}."
        if remedy:
            text += f" {remedy}"
        super().__init__(text)
        self.name = name
        self.value = value

    def at(self, place: str) -> InvalidValue:
        """The same error, with the place it was met at."""
        found = InvalidValue.__new__(InvalidValue)
        Exception.__init__(found, f"{place}: {self}")
        found.name, found.value = self.name, self.value
        return found


class DataError(RsfStudyError):
    """A file that is missing, damaged, or not what it is taken for."""


class RunError(RsfStudyError):
    """A run that could not start or could not finish."""


class Interrupted(RunError):
    """A run that the user ended."""
