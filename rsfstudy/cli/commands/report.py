"""Command ``rsfstudy report``."""

from __future__ import annotations

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line
from rsfstudy.defaults import Defaults


@click.command(cls=CommandWithOptionsObject)
@click.argument("directory", default=Defaults.OUTPUT_DIRECTORY, type=options.PathParameterType())
@click.option(
    "--output",
    type=options.PathParameterType(dir_okay=False),
    metavar="FILE",
    help="Path of the HTML page.  [default: DIRECTORY/report.html]",
)
def report(command_options: options.CommandOptions) -> int:
    """Write an HTML page that shows all results in a directory.

    For each file, the page contains the verdicts, the figure, the slopes, the failed cells and the
    provenance. The page is a single file that can be viewed in a browser or printed. The exit
    status is 1 if a results file cannot be read. In this case, the page shows the reason.
    """
    from rsfstudy.api import write_html_report

    page, unread = write_html_report(command_options.directory, command_options.output)
    print_line(f"wrote {page}", soft_wrap=True)
    for file in unread:
        text = f"{file} cannot be read (see the page for the reason)"
        print_line(text, style="red", soft_wrap=True)
    return EXIT_STATUS_FAILED if unread else EXIT_STATUS_OK
