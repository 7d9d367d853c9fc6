"""Command ``rsfstudy healing``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import (
    EXIT_STATUS_FAILED,
    EXIT_STATUS_OK,
    CommandResult,
    print_result_as_text_or_json,
)
from rsfstudy.cli.lab_record_options import collect_record_reading_options, record_reading_options
from rsfstudy.cli.printing import print_line, print_tables_and_sentences

if TYPE_CHECKING:
    import xarray as xr

    from rsfstudy.fitting import Record


@dataclass(frozen=True)
class HealingCommandResult(CommandResult):
    """Healing in the holds of a record.

    Parameters
    ----------
    record : Record
        Record of the holds.
    hold_table : xarray.Dataset
        Table of the holds.
    machine_stiffness : xarray.Dataset
        Stiffness of the machine, measured in the record.
    output_files : sequence of Path
        Figure and data file.
    """

    record: Record
    hold_table: xr.Dataset
    machine_stiffness: xr.Dataset
    output_files: Sequence[Path]

    @property
    def exit_status(self) -> int:
        """Return a failure status if no hold has a friction peak on reloading."""
        has_peak = bool(self.hold_table["healing"].notnull().any())
        return EXIT_STATUS_OK if has_peak else EXIT_STATUS_FAILED

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        per_hold = [str(name) for name in self.hold_table.variables if self.hold_table[name].dims]
        return {
            "record": self.record.name,
            "rows": len(self.record),
            "holds": [
                {name: self.hold_table[name][number].item() for name in per_hold}
                for number in range(self.hold_table.sizes["hold"])
            ],
            **{str(n): of.item() for n, of in self.hold_table.data_vars.items() if not of.dims},
            **{n: self.machine_stiffness[n].item() for n in ("stiffness", "stiffness_stderr")},
            "files": self.output_files,
        }


@click.command(cls=CommandWithOptionsObject)
@click.argument("record", type=options.PathParameterType())
@record_reading_options
@click.option(
    "--stiffness",
    help="Stiffness of the machine. This option is required if the record contains fault slip "
    "instead of load point displacement. Example: '0.03 MPa/um'.",
)
@options.make_image_path_option(
    "--output",
    Path("healing.png"),
    "Figure path. The data are written to a NetCDF file in the same directory.",
)
@options.figure_style_options
@options.json_option
def healing(command_options: options.CommandOptions) -> int:
    """Measure frictional healing in the holds of RECORD.

    The command prints one row per hold with its duration, the friction before the hold, the peak
    friction on reloading, healing and relaxation. The standard errors account for the correlation
    of the noise. The healing rate is the increase in healing per decade of hold duration. The
    command also prints the stiffness of the machine. The holds are written to a figure and a data
    file.

    The exit status is 1 if friction does not reach a peak on reloading after any of the holds, and
    2 if the command line is invalid. Otherwise the exit status is 0.
    """
    from rsfstudy.cli.figure_files import write_figure
    from rsfstudy.cli.overwrite_checks import check_output_may_be_replaced
    from rsfstudy.execution import build_provenance_attributes
    from rsfstudy.reporting import is_hold_table
    from rsfstudy.storage import write_dataset

    data = command_options.output.with_suffix(".nc")
    check_output_may_be_replaced(data, is_hold_table, "table of holds")
    about = {
        "stiffness": command_options.stiffness,
        **collect_record_reading_options(command_options),
    }
    record = rsfstudy.read_record(command_options.record, **about)
    table = rsfstudy.healing(record).assign_attrs(
        build_provenance_attributes(command_options.command_line)
    )
    write_dataset(table, data)
    appearance = command_options.collect_option_values("style", "width")
    write_figure(
        rsfstudy.plot_healing(table, record, **appearance),
        command_options.output,
        command_options.style,
    )
    result = HealingCommandResult(record, table, record.stiffness(), [command_options.output, data])
    return print_result_as_text_or_json(result, _print_healing, command_options.as_json)


def _print_healing(result: HealingCommandResult) -> None:
    """Print the table of holds, the healing rate and the stiffness."""
    from rsfstudy.reporting import format_value_with_stderr, summarise_holds

    print_line(f"{result.record.name}: {len(result.record):,} rows")
    print_tables_and_sentences(summarise_holds(result.hold_table))
    value, stderr = (result.machine_stiffness[n].item() for n in ("stiffness", "stiffness_stderr"))
    if math.isfinite(value):
        print_line(
            f"stiffness divided by normal stress: {format_value_with_stderr(value, stderr)} 1/um"
        )
    print_line(f"wrote {' and '.join(map(str, result.output_files))}", soft_wrap=True)
