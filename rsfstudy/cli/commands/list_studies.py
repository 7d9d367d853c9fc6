"""Command ``rsfstudy list``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_OK, CommandResult, print_result_as_text_or_json
from rsfstudy.study import read_study_titles


@dataclass(frozen=True)
class ListStudiesCommandResult(CommandResult):
    """Output of the ``list`` command: names and titles of the named studies."""

    title_by_study: Mapping[str, str]
    exit_status = EXIT_STATUS_OK

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        return {
            "studies": [{"name": n, "title": title} for n, title in self.title_by_study.items()]
        }


@click.command("list", cls=CommandWithOptionsObject)
@options.json_option
def list_studies(command_options: options.CommandOptions) -> int:
    """List all studies with their titles."""
    return print_result_as_text_or_json(
        ListStudiesCommandResult(read_study_titles()), _print_study_titles, command_options.as_json
    )


def _print_study_titles(result: ListStudiesCommandResult) -> None:
    """Print one line per study."""
    text = click.get_current_context().make_formatter()
    text.write_dl(list(result.title_by_study.items()))
    text.write_paragraph()
    text.write_text(
        "Use rsfstudy show NAME for the details of a study, and rsfstudy run NAME to compute the "
        "study."
    )
    click.echo(text.getvalue().rstrip())
