"""Options of the commands that read laboratory records."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from rsfstudy.cli.options import (
    CommandOptions,
    DecoratedFunction,
    combine_option_decorators,
    normal_stress_option,
    record_columns_option,
)
from rsfstudy.errors import InvalidValue

#: Names of command-line options that are passed unchanged to the functions that read records.
_OPTIONS_PASSED_TO_RECORD_READERS = ("decimal", "sheet", "area", "begin", "end", "thin", "filter")

#: Names of all command-line options that determine how a record is read.
NAMES_OF_RECORD_OPTIONS = ("columns", "normal_stress", "rows", *_OPTIONS_PASSED_TO_RECORD_READERS)


def _parse_number_or_text(
    _context: click.Context, _option: click.Parameter, text: str | None
) -> Any:
    """Convert the value of an option to a number if the value has no units."""
    from rsfstudy.cli.assignment_parsing import parse_number_or_text

    return None if text is None else parse_number_or_text(text)


def make_number_with_units_option(
    option_name: str, help_text: str, default: str | None = None
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option for a number with units.

    Parameters
    ----------
    option_name : str
        Name of the option with leading hyphens.
    help_text : str
        Help text, which describes the default.
    default : str, optional
        Default value.

    Returns
    -------
    callable
        Decorator for a command.
    """
    about: dict[str, Any] = {
        "metavar": "QUANTITY",
        "default": default,
        "show_default": False,
        "help": help_text,
    }
    return click.option(option_name, callback=_parse_number_or_text, **about)


record_reading_options = combine_option_decorators(
    record_columns_option,
    normal_stress_option,
    click.option(
        "--decimal",
        type=click.Choice([".", ","]),
        default=".",
        help="Decimal separator in text files.",
    ),
    click.option(
        "--sheet",
        metavar="NAME",
        default="",
        show_default=False,
        help="Name of a workbook sheet or TDMS group.  [default: first sheet or group]",
    ),
    click.option(
        "--area",
        metavar="QUANTITY",
        help="Fault area. Pass the area if the record contains forces, which are divided by "
        "the area to obtain stresses. Example: '25 cm2'.",
    ),
    click.option(
        "--rows",
        metavar="FIRST,LAST",
        help="Numbers of the first and last rows to read, counted from 1. Example: 100,4000.  "
        "[default: all rows]",
    ),
    make_number_with_units_option(
        "--begin",
        "First time or load point displacement to read. Examples: '100 s' or '2 mm'.",
    ),
    make_number_with_units_option(
        "--end",
        "Last time or load point displacement to read. Examples: '100 s' or '2 mm'.",
    ),
    click.option(
        "--thin",
        type=click.IntRange(1),
        metavar="N",
        default=1,
        show_default=False,
        help="Keep every Nth row, after --filter has been applied.  [default: keep all rows]",
    ),
    click.option(
        "--filter",
        metavar="FILTER",
        default="",
        show_default=False,
        help="Filter for friction and stresses: mean, trailing_mean, first_order, "
        "butterworth_2 or butterworth_4, followed by an averaging time or a corner "
        "frequency. Fits apply the same filter to the model. Examples: 'mean 1 s' or "
        "'butterworth_2 2 Hz'.  [default: no filter]",
    ),
)


def collect_record_reading_options(command_options: CommandOptions) -> dict[str, Any]:
    """Return the keyword arguments of the functions that read records.

    Parameters
    ----------
    command_options : CommandOptions
        Options of the command.

    Returns
    -------
    dict of str to object
        Keyword arguments of ``read_record`` and ``events``.

    Raises
    ------
    InvalidValue
        If the option ``--columns`` or ``--rows`` cannot be parsed.
    """
    from rsfstudy.cli.assignment_parsing import parse_column_assignments

    return {
        "columns": parse_column_assignments(command_options.columns),
        "normal_stress": command_options.normal_stress,
        "rows": None
        if command_options.rows is None
        else _parse_first_and_last_row(command_options.rows),
        **command_options.collect_option_values(*_OPTIONS_PASSED_TO_RECORD_READERS),
    }


def _parse_first_and_last_row(text: str) -> tuple[int, ...]:
    """Convert the value of the option ``--rows``."""
    numbers = [part.strip() for part in text.split(",")]
    if not all(number.isdecimal() and len(number) < 16 for number in numbers):
        rule = (
            "must be the numbers of the first and the last row, separated by a comma, for "
            "example 100,4000"
        )
        raise InvalidValue("--rows", text, rule)
    return tuple(map(int, numbers))
