"""Command ``rsfstudy list``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import Command
from rsfstudy.cli.results import EXIT_STATUS_OK, CommandResult, output_result
from rsfstudy.study import study_titles


@dataclass(frozen=True)
class StudyList(CommandResult):
    """Output of the ``list`` command: names and titles of the named studies."""

    titles: Mapping[str, str]
    exit_status = EXIT_STATUS_OK

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        return {"studies": [{"name": n, "title": title} for n, title in self.titles.items()]}


@click.command("list", cls=Command)
@options.json_option
def list_studies(given: options.CommandOptions) -> int:
    """List all studies with their titles."""
    return output_result(StudyList(study_titles()), _print_titles, given.as_json)


def _print_titles(result: StudyList) -> None:
    """Print one line per study."""
    text = click.get_current_context().make_formatter()
    text.write_dl(list(result.titles.items()))
    text.write_paragraph()
    text.write_text(
        "Use rsfstudy show NAME for the details of a study, and rsfstudy run NAME to compute the "
        "study."
    )
    click.echo(text.getvalue().rstrip())
