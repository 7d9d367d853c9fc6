"""Command ``rsfstudy explore``."""

from __future__ import annotations

import sys

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line
from rsfstudy.errors import SignalInterrupt


@click.command(cls=CommandWithOptionsObject)
@click.argument("file", required=False, type=options.PathParameterType(exists=True))
@click.option(
    "--state",
    metavar="SETTINGS",
    help="Initial settings of the page. Copy the settings from the 'Code' tab of the page.",
)
@click.option(
    "--port",
    type=click.IntRange(1, 65535),
    metavar="PORT",
    help="Port of the server.  [default: 8067, or another free port if 8067 is in use]",
)
@click.option(
    "--no-browser", is_flag=True, help="Print the address of the page without opening a browser."
)
def explore(command_options: options.CommandOptions) -> int:
    """Show a scene, results or a record in the browser.

    If FILE is omitted, the page shows a spring-slider model with sliders for its parameters. If
    FILE contains the results of a study (.nc or .zarr), the page shows the results. If FILE is
    another file, such as a CSV file, the page shows a laboratory record, which you can fit.

    The server accepts connections only from this computer. To stop the server, press Ctrl-C.
    """
    from rsfstudy.explorer import serve

    try:
        serve(
            command_options.file,
            command_options.state,
            port=command_options.port,
            open_browser=not command_options.no_browser,
            address_callback=_print_explorer_address,
        )
    except SignalInterrupt:
        raise
    except KeyboardInterrupt:
        print_line("stopped")
    return EXIT_STATUS_OK


def _print_explorer_address(url: str) -> None:
    """Print the first address of the page."""
    print_line(f"{url}\nThe page is open until you press Ctrl-C.", soft_wrap=True)
    sys.stdout.flush()
