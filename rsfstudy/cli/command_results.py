"""Classes with the results of commands, and functions that print them as text or JSON.

Each command first creates a result object and then prints the result. The result object also
determines the exit status of the command. The printed text and the JSON output are generated from
the same result object.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import click

from rsfstudy.errors import RunError

EXIT_STATUS_OK, EXIT_STATUS_FAILED = 0, 1
#: Version of the JSON format. The version is increased if a key is removed, renamed or redefined.
JSON_FORMAT_VERSION = 1


class CommandResult(ABC):
    """Base class of the results of commands."""

    @property
    @abstractmethod
    def exit_status(self) -> int:
        """Exit status of the command."""

    @abstractmethod
    def to_json_fields(self) -> Mapping[str, Any]:
        """Return the fields of the JSON output.

        Returns
        -------
        mapping of str to object
            Numbers, strings, Boolean values, and sequences and mappings of these.
        """


AnyCommandResult = TypeVar("AnyCommandResult", bound=CommandResult)


def print_result_as_text_or_json(
    result: AnyCommandResult, text_printer: Callable[[AnyCommandResult], None], as_json: bool
) -> int:
    """Print a result as text or as JSON.

    Parameters
    ----------
    result : CommandResult
        Result of a command.
    text_printer : callable
        Function that prints the result as text.
    as_json : bool
        If True, print JSON instead of text.

    Returns
    -------
    int
        Exit status of the command.

    Raises
    ------
    RunError
        If the output cannot be written, for example because the disk is full.
    """
    if not as_json:
        text_printer(result)
        return result.exit_status
    import json

    about = {
        "command": click.get_current_context().info_name,
        "format": JSON_FORMAT_VERSION,
        "exit_status": result.exit_status,
    }
    text = json.dumps(
        convert_to_json_value(about | {**result.to_json_fields()}), indent=2, allow_nan=False
    )
    try:
        click.echo(text)
    except OSError as error:
        raise RunError(f"cannot print: {error.strerror}.") from error
    return result.exit_status


def convert_to_json_value(value: Any) -> Any:
    """Convert a value to a type that JSON can represent.

    Parameters
    ----------
    value : object
        Value to convert.

    Returns
    -------
    object
        Converted value. The function converts mappings, sequences and arrays element by element.
        NaN and infinite numbers become None. Values of other types, such as paths, become strings.
    """
    if hasattr(value, "tolist"):  # a scalar or an array of NumPy
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {str(name): convert_to_json_value(part) for name, part in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [convert_to_json_value(part) for part in value]
    return str(value)
