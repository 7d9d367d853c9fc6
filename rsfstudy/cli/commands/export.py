"""Command ``rsfstudy export``."""

from __future__ import annotations

import os

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line
from rsfstudy.errors import DataError, InvalidValue

_QUANTITY_ORDER_IN_UNITS_OPTION = ("stress", "length", "time")


@click.command(cls=CommandWithOptionsObject)
@click.argument("file", type=options.PathParameterType())
@click.option("--csv", is_flag=True, help="Write a CSV table. Constant columns are omitted.")
@click.option("--mat", is_flag=True, help="Write all variables to a MATLAB file.")
@click.option(
    "--units",
    nargs=3,
    metavar="STRESS LENGTH TIME",
    help="Convert the values to these units. This option requires results that were "
    "computed with a rig. Example: --units MPa um s.",
)
@click.option(
    "--output",
    type=options.PathParameterType(dir_okay=False),
    help="Path of the output file. The suffix is replaced by .csv or .mat.  [default: path of "
    "the input file with the new suffix]",
)
def export(command_options: options.CommandOptions) -> int:
    """Export results, a motion or a table to other programs.

    The command writes a CSV table, a MATLAB file, or both. The CSV table of a study has one row per
    cell. The CSV table of a motion has one row per time.
    """
    import rsfstudy.api  # noqa: F401  # The import registers the accessor ``dataset.rsf``.
    from rsfstudy.cli.export_files import to_csv, to_mat
    from rsfstudy.storage import read_dataset

    writers = {"csv": to_csv, "mat": to_mat}
    asked = [ending for ending in writers if getattr(command_options, ending)]
    if not asked:
        raise click.UsageError("Pass --csv, --mat, or both.")
    dataset = read_dataset(command_options.file, allow_tables=True)
    paths = {
        ending: (command_options.output or command_options.file).with_suffix(f".{ending}")
        for ending in asked
    }
    for path in paths.values():
        if os.path.lexists(path):
            remedy = "Choose another path."
            raise InvalidValue("--output", str(path), "already exists", remedy=remedy)
    if command_options.units:
        dataset = dataset.rsf.in_units(
            **dict(zip(_QUANTITY_ORDER_IN_UNITS_OPTION, command_options.units, strict=True))
        )
    for ending, path in paths.items():
        try:
            writers[ending](dataset, path)
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error})") from error
        print_line(f"{path}")
    return EXIT_STATUS_OK
