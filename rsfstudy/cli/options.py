"""Options that several commands share.

To keep the import of this module fast, slow modules are imported inside the functions that check
option values.
"""

from __future__ import annotations

import functools
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import click

from rsfstudy.cli.rig_options import EXAMPLE_VALUES_OF_RIG_OPTIONS, describe_rig_option
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import check_regular_file
from rsfstudy.motion import Engine
from rsfstudy.path_checks import check_path_is_valid

DecoratedFunction = TypeVar("DecoratedFunction", bound=Callable[..., Any])


class CommandOptions(SimpleNamespace):
    """Arguments and options of a command call, which can be read as attributes."""

    variable: str | None = None
    engine: Any = None
    budget: Any = None

    @property
    def command_line(self) -> str:
        """Command line that the user entered."""
        return shlex.join(["rsfstudy", *sys.argv[1:]])

    def collect_option_values(self, *option_names: str) -> dict[str, Any]:
        """Return the values of selected options as a dictionary.

        Parameters
        ----------
        *option_names : str
            Names of the options.

        Returns
        -------
        dict
            Values by name.
        """
        return {name: getattr(self, name) for name in option_names}

    @property
    def is_rtol_specified(self) -> bool:
        """True if the user specified a relative tolerance."""
        return self.rtol is not None

    @property
    def rig_option_texts(self) -> dict[str, str]:
        """Values of the rig options that the user specified, by option name."""
        return {
            name: text
            for name in EXAMPLE_VALUES_OF_RIG_OPTIONS
            if (text := getattr(self, name)) is not None
        }


class PathParameterType(click.Path):
    """Click parameter type for paths.

    Parameters
    ----------
    **path_settings : Any
        Keyword arguments of ``click.Path``.
    """

    def __init__(self, **path_settings: Any) -> None:
        """Create the parameter type from the settings of ``click.Path``."""
        super().__init__(path_type=Path, **path_settings)

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | bytes | os.PathLike[str]:
        """Convert a value to a path.

        Parameters
        ----------
        value : str or Path
            Value of the parameter.
        param : click.Parameter or None
            Parameter of the command. Its name is part of the error message.
        ctx : click.Context or None
            Context of the command.

        Returns
        -------
        Path
            Checked path.

        Raises
        ------
        InvalidValue
            If the path is not valid.
        """
        name = param.opts[0] if isinstance(param, click.Option) else str(param and param.name)
        check_path_is_valid(name, value)
        return super().convert(value, param, ctx)


def combine_option_decorators(
    *option_decorators: Callable[[Any], Any],
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Combine several option decorators into one decorator.

    Parameters
    ----------
    *option_decorators : callable
        Decorators that ``click.option`` or ``click.argument`` returned. The help text lists the
        options in the same order.

    Returns
    -------
    callable
        Decorator for a command.
    """
    return lambda command: functools.reduce(
        lambda c, each: each(c), reversed(option_decorators), command
    )


def make_positive_integer_option(
    option_name: str, default: int | None, help_text: str
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option whose value is a positive integer.

    Parameters
    ----------
    option_name : str
        Name of the option with leading hyphens.
    default : int or None
        Default value.
    help_text : str
        Help text.

    Returns
    -------
    callable
        Decorator for a command.
    """
    kind = click.IntRange(1)
    return click.option(option_name, type=kind, metavar="N", default=default, help=help_text)


def make_output_option(
    help_text: str, default: Path | None = None, **path_settings: bool
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create the option ``--output``.

    Parameters
    ----------
    help_text : str
        Help text.
    default : Path, optional
        Default path.
    **path_settings : bool
        Keyword arguments of ``click.Path``.

    Returns
    -------
    callable
        Decorator for a command.
    """
    return click.option(
        "--output", type=PathParameterType(**path_settings), default=default, help=help_text
    )


json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print the result as JSON to standard output."
)
study_name_or_all_argument = combine_option_decorators(
    click.argument("name", required=False),
    click.option(
        "--all", "every", is_flag=True, help="Process all studies that `rsfstudy list` shows."
    ),
)
output_directory_option = make_output_option(
    "Results directory.", Defaults.OUTPUT_DIRECTORY, file_okay=False
)
set_axis_values_option = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="AXIS=VALUES",
    help="Override an axis or a field. VALUES is a comma-separated list or a range "
    "(start:stop:count, or start:stop:count:log for logarithmic spacing). Values can have "
    "units if the study has a rig. Values of the field 'loading' can be paths of CSV files "
    "with protocols or records. Example: --set hold_time='10 s,100 s'.",
)
rtol_option = click.option(
    "--rtol",
    type=float,
    metavar="RTOL",
    help="Relative tolerance of each cell, from 1e-11 to 0.01.  [default: tolerance set by the "
    "study, otherwise 1e-07]",
)
engine_option = click.option(
    "--engine",
    type=click.Choice(Engine.NAMES),
    help="Integration engine. The compiled engine is much faster, but requires Numba.  "
    "[default: engine set by the study, otherwise scipy]",
)

evaluation_budget_option = make_positive_integer_option(
    "--budget",
    None,
    "Maximum number of right-hand-side evaluations per cell. If you increase the maximum, "
    "cells that already have a result are not recomputed.  [default: maximum set by the study, "
    "otherwise 500000]",
)
quiet_option = click.option("--quiet", is_flag=True, help="Do not show progress.")
#: Options of the worker pool that computes the cells.
worker_pool_options = combine_option_decorators(
    make_positive_integer_option("--workers", 2, "Number of worker processes on this computer."),
    click.option(
        "--serial",
        is_flag=True,
        help="Compute all cells in the main process, without worker processes.",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="Compute the cells on an existing Dask cluster. Example: tcp://localhost:8786.",
    ),
    click.option(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        default=Defaults.CELL_CPU_TIME_LIMIT,
        help="Maximum CPU time per cell in a worker process, in seconds.",
    ),
    quiet_option,
)
study_file_option = click.option(
    "--study",
    type=PathParameterType(),
    help="Python file that declares the study. The file is required if the study defines its "
    "own measures, scene parts or figures.",
)

#: Names of variables by their names on the command line. The mapping contains only abscissae that
#: have a different name on the command line.
_VARIABLE_BY_ABSCISSA_CHOICE = {"displacement": "load_point_displacement"}
abscissa_option = click.option(
    "--against",
    type=click.Choice(["displacement", "slip", "time"]),
    callback=lambda _context, _option, value: _VARIABLE_BY_ABSCISSA_CHOICE.get(value, value),
    help="Horizontal axis of motion figures: load point displacement, slip or time.  [default: "
    "slip if the load point is held fixed, otherwise displacement]",
)


def _check_style_option(
    _context: click.Context, _option: click.Parameter, value: str | None
) -> str | None:
    """Check a plotting style, and return the style.

    Raises
    ------
    InvalidValue
        If the style cannot be used.
    """
    if value is not None:
        from rsfstudy.plots import style_context

        with style_context(value):
            pass
    return value


def _check_width_option(
    _context: click.Context, _option: click.Parameter, value: str | None
) -> str | None:
    """Check the width of a figure, and return the width.

    Raises
    ------
    InvalidValue
        If the width is not a length, or if the width is out of range.
    """
    if value is not None:
        from rsfstudy.plots import style_context

        with style_context(width=value):
            pass
    return value


#: Options for the style and the width of figures.
figure_style_options = combine_option_decorators(
    click.option(
        "--style",
        metavar="STYLE",
        callback=_check_style_option,
        help="Matplotlib style sheet (FILE.mplstyle) or style name. The style modifies the "
        "default style of rsfstudy.",
    ),
    click.option(
        "--width",
        metavar="WIDTH",
        callback=_check_width_option,
        help="Figure width. Example: '85 mm'.  [default: 84 mm for a single column of panels, "
        "174 mm for several columns]",
    ),
)
figure_header_option = click.option(
    "--no-header",
    "header",
    is_flag=True,
    default=True,
    flag_value=False,
    show_default=False,
    help="Omit the figure header, which lists overrides as well as missing and failed cells.",
)
#: Options for the format and the appearance of figures.
figure_options = combine_option_decorators(
    click.option(
        "--figure",
        "form",
        type=click.Choice(Defaults.FIGURE_FORMATS),
        help="Figure format.  [default: png]",
    ),
    figure_style_options,
    figure_header_option,
)


def _check_image_path(
    _context: click.Context, option: click.Parameter, value: Path | None
) -> Path | None:
    """Check the path of a figure and return the path.

    Raises
    ------
    InvalidValue
        If the suffix is not supported, or if the path exists and is not a regular file.
    """
    if value is None:
        return None
    if value.suffix not in (".png", ".pdf", ".svg"):
        rule = "must end in .png, .pdf or .svg"
        raise InvalidValue(option.opts[0], str(value), rule)
    check_regular_file(option.opts[0], value)
    return value


def make_image_path_option(
    option_name: str, default: Path | None, help_text: str
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create an option for the path of an image file.

    Parameters
    ----------
    option_name : str
        Name of the option with leading hyphens.
    default : Path or None
        Default path.
    help_text : str
        Help text.

    Returns
    -------
    callable
        Decorator for a command.
    """
    kind = PathParameterType(dir_okay=False)
    return click.option(
        option_name, type=kind, callback=_check_image_path, default=default, help=help_text
    )


def make_set_scene_fields_option(
    help_text: str,
) -> Callable[[DecoratedFunction], DecoratedFunction]:
    """Create the option ``--set`` for the fields of a single scene.

    Parameters
    ----------
    help_text : str
        Help text.

    Returns
    -------
    callable
        Decorator for a command.
    """
    return click.option("--set", "settings", multiple=True, metavar="FIELD=VALUE", help=help_text)


#: Options that define a rig.
rig_options = combine_option_decorators(
    *(
        click.option(
            f"--{name.replace('_', '-')}", metavar="QUANTITY", help=describe_rig_option(name)
        )
        for name in EXAMPLE_VALUES_OF_RIG_OPTIONS
    )
)

record_columns_option = click.option(
    "--columns",
    metavar="NAME=HEADING,...",
    help="Columns of the record. NAME is 'time', 'displacement', 'slip', 'friction', "
    "'shear_stress' or 'normal_stress'. HEADING is a column heading or a column number, with "
    "units in parentheses and an optional scale and offset. Examples: 'time=t "
    "(s),displacement=lp (um),friction=mu', 'time=1 (s)' or 'displacement=lp (um) * 0.1 + 5'."
    "  [default: all columns with recognised headings]",
)
normal_stress_option = click.option(
    "--normal-stress",
    metavar="QUANTITY",
    help="Normal stress. This option is required if the record contains shear stress but no "
    "normal stress. Example: '20 MPa'.",
)
