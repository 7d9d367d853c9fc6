"""Command ``rsfstudy plot``."""

from __future__ import annotations

from pathlib import Path

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK
from rsfstudy.cli.lab_record_options import (
    NAMES_OF_RECORD_OPTIONS,
    collect_record_reading_options,
    record_reading_options,
)
from rsfstudy.cli.printing import print_line
from rsfstudy.defaults import Defaults
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import check_regular_file
from rsfstudy.study import list_study_names


@click.command(cls=CommandWithOptionsObject)
@options.study_name_or_all_argument
@options.make_output_option(
    "Directory that contains the results. The figure is written to the same directory. You can "
    "also pass the path of a single figure, for example fig.pdf.  [default: the directory "
    "'outputs' if NAME is a study, or the directory of NAME if NAME is a file]"
)
@options.figure_options
@click.option(
    "--variable",
    metavar="NAME",
    help="Draw maps or lines of this variable instead of the default figure.",
)
@options.study_file_option
@options.abscissa_option
@record_reading_options
def plot(command_options: options.CommandOptions) -> int:
    """Draw the figure of a study, a motion or a record.

    NAME is the name of a study, or a file that contains results, a motion, a table of holds or a
    laboratory record. To specify how a record is read, use the same options as for the ``fit``
    command. By default, the command writes the figure to the directory of the file. If the study
    defines its own figure, pass the Python file of the study with --study. The Python file is
    executed.
    """
    from rsfstudy.api import find_results_file
    from rsfstudy.cli.figure_files import build_default_figure_path
    from rsfstudy.cli.study_options import list_selected_study_names

    if _is_file_of_record(command_options.name):
        print_line(f"{_draw_record(command_options)}")
        return EXIT_STATUS_OK
    if specified := _list_record_options(command_options):
        raise click.UsageError(f"{', '.join(specified)} can only be used with a record.")
    status, target = EXIT_STATUS_OK, _find_figure_path_in_output_option(command_options)
    for name in list_selected_study_names(command_options):
        results = find_results_file(
            name, Defaults.OUTPUT_DIRECTORY if target else command_options.output
        )
        beside = (
            results if command_options.output is None else command_options.output / results.name
        )
        drawn = _draw_figure(
            results, target or build_default_figure_path(beside, command_options), command_options
        )
        status = status if drawn else EXIT_STATUS_FAILED
        for file in drawn:
            print_line(f"{file}")
    return status


def _is_file_of_record(name: str | None) -> bool:
    """Return True if a name is the path of a file that may be a laboratory record.

    Results files, Python files and the names of studies are excluded.
    """
    if name is None or Path(name).suffix in (".nc", ".zarr", ".py") or not Path(name).is_file():
        return False
    return name not in list_study_names()


def _list_record_options(command_options: options.CommandOptions) -> list[str]:
    """Return the specified options that apply only to records."""
    context = click.get_current_context()
    return [
        f"--{name.replace('_', '-')}"
        for name in NAMES_OF_RECORD_OPTIONS
        if context.get_parameter_source(name) is not click.core.ParameterSource.DEFAULT
    ]


def _draw_record(command_options: options.CommandOptions) -> Path:
    """Draw a laboratory record, and return the path of the figure."""
    import rsfstudy
    from rsfstudy.cli.figure_files import build_default_figure_path, write_figure

    if command_options.variable is not None or command_options.study is not None:
        raise click.UsageError("--variable and --study cannot be used with a record.")
    source, output = Path(command_options.name), command_options.output
    beside = (source if output is None else output / source.name).with_suffix("")
    path = _find_figure_path_in_output_option(command_options) or build_default_figure_path(
        beside, command_options
    )
    reading = collect_record_reading_options(command_options)
    record = rsfstudy.read_record(source, **reading)
    against = {None: "time", "load_point_displacement": "displacement"}.get(
        command_options.against, command_options.against
    )
    appearance = command_options.collect_option_values("style", "width")
    figure = rsfstudy.plot_record(record, against=against, **appearance)
    write_figure(figure, path, command_options.style)
    return path


def _draw_figure(
    results: Path, figure_path: Path, command_options: options.CommandOptions
) -> list[Path]:
    """Draw the figure of a results file, and return the paths of the new files."""
    from rsfstudy.cli import figure_files
    from rsfstudy.cli.study_options import read_results_file
    from rsfstudy.reporting import is_hold_table
    from rsfstudy.storage import StoredDataset

    dataset = read_results_file(results, command_options.study)
    if contents := StoredDataset(dataset).table_contents:
        if not is_hold_table(dataset):
            remedy = f"Print the table: `rsfstudy show {results}`."
            raise InvalidValue(
                "NAME", str(results), f"contains {contents}, which has no figure", remedy=remedy
            )
        appearance = command_options.collect_option_values("style", "width")
        figure = dataset.rsf.plot(**appearance)
        figure_files.write_figure(figure, figure_path, command_options.style)
        return [figure_path]
    if StoredDataset(dataset).is_of_single_scene:
        if command_options.variable is not None:
            rule = "applies only to results of a study, but the file contains a motion"
            raise InvalidValue(
                "--variable", command_options.variable, rule, remedy="Use --against."
            )
        appearance = command_options.collect_option_values("against", "style", "width", "header")
        figure_files.write_figure(
            dataset.rsf.plot(**appearance), figure_path, command_options.style
        )
        return [figure_path]
    if command_options.against is not None:
        rule = "applies only to a motion, but the file contains results of a study"
        raise InvalidValue("--against", command_options.against, rule, remedy="Use --variable.")
    own = (
        None
        if command_options.variable
        else figure_files.load_user_figure_or_default(dataset, command_options.study)
    )
    return figure_files.draw_and_save_figure(dataset, figure_path, command_options, own)


def _find_figure_path_in_output_option(command_options: options.CommandOptions) -> Path | None:
    """Return the value of ``--output`` if it is the path of a figure file.

    If the value is a directory, the function returns None. If the value has a suffix that is not a
    figure format, the value must be an existing directory.
    """
    output: Path | None = command_options.output
    ending = "" if output is None else output.suffix[1:].lower()
    if output is None or not ending:
        return None
    if ending in Defaults.FIGURE_FORMATS:
        if command_options.every or command_options.form not in (None, ending):
            raise click.UsageError(
                f"--output {str(output)!r} is the path of a single figure, which determines the "
                "figure format. Pass a directory, or omit --all and --figure."
            )
        check_regular_file("--output", output)
        return output
    if not output.is_dir():
        *suffixes, last_suffix = (f".{suffix}" for suffix in Defaults.FIGURE_FORMATS)
        rule = f"must end in {', '.join(suffixes)} or {last_suffix}, or be an existing directory"
        raise InvalidValue("--output", str(output), rule)
    return None
