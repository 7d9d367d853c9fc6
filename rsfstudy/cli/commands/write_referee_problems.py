"""Command ``rsfstudy write_referee_problems``."""

from __future__ import annotations

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line


@click.command("problems", cls=CommandWithOptionsObject)
@click.argument("directory", metavar="DIR", type=options.PathParameterType())
def write_referee_problems(command_options: options.CommandOptions) -> int:
    """Write all benchmark problems to a new directory.

    Each problem includes its reference solution, a table to fill in, and an example in plain SciPy.
    """
    from rsfstudy.referee import write_shipped_problems

    count = write_shipped_problems(command_options.directory)
    print_line(f"wrote {count} problems into {command_options.directory}")
    return EXIT_STATUS_OK
