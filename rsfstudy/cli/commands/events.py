"""Command ``rsfstudy events``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_OK, CommandResult, print_result_as_text_or_json
from rsfstudy.cli.lab_record_options import (
    collect_record_reading_options,
    make_number_with_units_option,
    record_reading_options,
)
from rsfstudy.cli.printing import print_line, print_tables_and_sentences

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class EventsCommandResult(CommandResult):
    """Stress drops in records.

    Parameters
    ----------
    record_files : sequence of Path
        Files of the records.
    event_catalogues : sequence of xarray.Dataset
        Stress drops in each record.
    """

    record_files: Sequence[Path]
    event_catalogues: Sequence[xr.Dataset]

    @property
    def exit_status(self) -> int:
        """Return the exit status for success, even if a record has no events."""
        return EXIT_STATUS_OK

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        from rsfstudy.reporting import summarise_events_as_json_fields

        pairs = zip(self.record_files, self.event_catalogues, strict=True)
        return {
            "records": [{"file": file, **summarise_events_as_json_fields(of)} for file, of in pairs]
        }


@click.command(cls=CommandWithOptionsObject)
@click.argument("records", nargs=-1, required=True, type=options.PathParameterType())
@record_reading_options
@make_number_with_units_option(
    "--stiffness",
    "Stiffness between the fault and the displacement sensor. If the record contains fault "
    "slip, pass 'inf'. Example: '0.05 MPa/um'.",
)
@click.option(
    "--sign",
    type=click.Choice(["1", "-1"]),
    help="Sign convention of the record: 1 if shear stress in the direction of sliding is "
    "recorded as positive, -1 if it is recorded as negative.  [default: -1 if all "
    "samples are negative, otherwise 1]",
)
@options.json_option
def events(command_options: options.CommandOptions) -> int:
    """Detect drops of shear stress in RECORDS.

    A record must contain shear stress or friction, and time or displacement. The command prints the
    smallest detectable drop, and a table with the times, durations, intervals and sizes of the
    drops. With --json, the command prints all quantities with their errors.
    """
    reading = collect_record_reading_options(command_options)
    sign = None if command_options.sign is None else int(command_options.sign)
    catalogues = [
        rsfstudy.events(path, stiffness=command_options.stiffness, sign=sign, **reading)
        for path in command_options.records
    ]
    return print_result_as_text_or_json(
        EventsCommandResult(command_options.records, catalogues),
        _print_events,
        command_options.as_json,
    )


def _print_events(result: EventsCommandResult) -> None:
    """Print a table of the drops in each record."""
    from rsfstudy.reporting import build_record_events_tables_and_sentences

    for file, catalogue in zip(result.record_files, result.event_catalogues, strict=True):
        if len(result.record_files) > 1:
            print_line(str(file), style="bold", soft_wrap=True)
        print_tables_and_sentences(build_record_events_tables_and_sentences(catalogue))
