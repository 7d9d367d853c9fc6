"""Command ``rsfstudy show``."""

from __future__ import annotations

from pathlib import Path

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import print_result_as_text_or_json

_SUFFIXES_OF_RESULTS_FILES = (".nc", ".zarr")


@click.command(cls=CommandWithOptionsObject)
@click.argument("name")
@options.set_axis_values_option
@options.rtol_option
@options.output_directory_option
@options.study_file_option
@options.rig_options
@options.json_option
def show(command_options: options.CommandOptions) -> int:
    """Show a study before a run, or summarise a results file.

    If you pass the name or the Python file of a study, the command prints the axes, the fixed
    fields, the measure and the expected cost. If the results directory contains cells of an earlier
    run, the expected cost is based on the computing times of these cells. If you pass a results
    file, the command prints the results and their provenance. For each failed cell, the command
    also prints a command line that recomputes the cell.
    """
    from rsfstudy.cli import study_options
    from rsfstudy.cli.file_summaries import FileSummary, print_file_summary
    from rsfstudy.cli.study_declarations import StudyDeclaration, print_study_declaration

    if Path(command_options.name).suffix not in _SUFFIXES_OF_RESULTS_FILES:
        study = study_options.build_study_from_options(command_options.name, command_options)
        declared = StudyDeclaration(study, command_options.output)
        return print_result_as_text_or_json(
            declared, print_study_declaration, command_options.as_json
        )
    if (
        command_options.settings
        or command_options.is_rtol_specified
        or command_options.rig_option_texts
    ):
        rule = (
            "--set, --rtol and rig options cannot be used with a results file. Omit these options."
        )
        raise click.UsageError(rule)
    dataset = study_options.read_results_file(Path(command_options.name), command_options.study)
    return print_result_as_text_or_json(
        FileSummary(dataset, command_options.name), print_file_summary, command_options.as_json
    )
