"""Command ``rsfstudy check``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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
from rsfstudy.cli.printing import print_line
from rsfstudy.errors import InvalidValue

if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy.cli.study_results import StudyResults


@dataclass(frozen=True)
class CheckCommandResult(CommandResult):
    """Comparison of study results with published values.

    Parameters
    ----------
    study_results : sequence of StudyResults
        Results of the studies that have been run.
    claim_verdicts : pandas.DataFrame or None
        Table of the claims and their verdicts, or None if there are no results.
    inapplicable_claim_ids : sequence of str, optional
        Identifiers of the requested claims that do not apply to the results.
    skip_reason_by_study : mapping of str to str, optional
        Reason for skipping a study, by name of the study. The command reports a skipped study but
        does not fail.
    study_names_without_results : sequence of str, optional
        Names of the studies that have no results and are not in ``skip_reason_by_study``.
    """

    study_results: Sequence[StudyResults]
    claim_verdicts: pd.DataFrame | None
    inapplicable_claim_ids: Sequence[str] = ()
    skip_reason_by_study: Mapping[str, str] = field(default_factory=dict)
    study_names_without_results: Sequence[str] = ()

    @property
    def exit_status(self) -> int:
        """Exit status of the ``check`` command.

        The status is 1 if a verdict differs from the expected verdict, if a cell failed or has not
        been computed, or if a study or a claim was not checked.
        """
        changed = self.claim_verdicts is not None and bool(
            self.claim_verdicts["verdict_changed"].any()
        )
        complete = all(one.is_complete_without_failures for one in self.study_results)
        failed = (
            changed
            or not complete
            or self.inapplicable_claim_ids
            or self.study_names_without_results
        )
        return EXIT_STATUS_FAILED if failed else EXIT_STATUS_OK

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        from rsfstudy.cli.study_results import convert_verdicts_to_json

        only = self.study_results[0].study_name if len(self.study_results) == 1 else ""
        claims = (
            []
            if self.claim_verdicts is None
            else convert_verdicts_to_json(self.claim_verdicts, only)
        )
        return {
            "studies": [one.to_json_fields() for one in self.study_results],
            "claims": claims,
            "unapplied_claims": self.inapplicable_claim_ids,
            "skipped": self.skip_reason_by_study,
            "not_run": self.study_names_without_results,
        }


@click.command(cls=CommandWithOptionsObject)
@options.study_name_or_all_argument
@options.output_directory_option
@click.option(
    "--claim",
    "claims",
    multiple=True,
    metavar="ID",
    help="Check only the claim with this ID, which must be a claim about the given results. "
    "Example: C6.",
)
@options.json_option
def check(command_options: options.CommandOptions) -> int:
    """Compare results with published values.

    NAME is the name of a study, or a results file. The exit status is 1 if a verdict differs from
    the expected verdict, if a cell failed, or if no claim applies to the results.
    """
    return print_result_as_text_or_json(
        _check_studies(command_options), _print_check_result, command_options.as_json
    )


def _check_studies(command_options: options.CommandOptions) -> CheckCommandResult:
    """Read the results of the requested studies, and check their claims."""
    from rsfstudy.api import find_results_file
    from rsfstudy.cli.cost_estimates import describe_missing_engine_packages
    from rsfstudy.cli.study_options import list_selected_study_names
    from rsfstudy.cli.study_results import StudyResults, collect_verdicts
    from rsfstudy.study import Claim, load_study

    studies, skipped, not_run = [], {}, []
    for name in list_selected_study_names(command_options):
        if not command_options.every or (command_options.output / f"{name}.nc").exists():
            dataset = rsfstudy.open(name, command_options.output)
            studies.append(
                StudyResults(dataset, str(find_results_file(name, command_options.output)))
            )
        elif why := describe_missing_engine_packages(load_study(name).accuracy.engine):
            skipped[name] = why
        else:
            not_run.append(name)
    if not studies:
        return CheckCommandResult([], None, (), skipped, not_run)
    verdicts = _select_verdicts_of_claims(collect_verdicts(studies), command_options.claims)
    others = verdicts["id"][verdicts["verdict"] == Claim.NOT_APPLICABLE]
    unapplied = (
        list(dict.fromkeys(others))
        if command_options.claims or len(others) == len(verdicts)
        else []
    )
    return CheckCommandResult(studies, verdicts, unapplied, skipped, not_run)


def _select_verdicts_of_claims(verdicts: pd.DataFrame, claim_ids: Sequence[str]) -> pd.DataFrame:
    """Return the verdicts on the requested claims. By default, return all verdicts."""
    for claim in claim_ids:
        if claim not in (choices := list(dict.fromkeys(verdicts["id"]))):
            raise InvalidValue("--claim", claim, "is not a claim of these results", choices=choices)
    return verdicts[verdicts["id"].isin(claim_ids)] if claim_ids else verdicts


def _print_check_result(result: CheckCommandResult) -> None:
    """Print the verdicts and the failed cells."""
    from rsfstudy.cli.study_results import print_failed_cells, print_study_heading, print_verdicts

    for name, reason in result.skip_reason_by_study.items():
        print_line(f"{name}: skipped: {reason}", style="yellow")
    for name in result.study_names_without_results:
        print_line(f"{name}: not run yet", style="red")
    if result.claim_verdicts is None:
        return
    if len(result.study_results) == 1:
        print_study_heading(result.study_results[0])
    print_verdicts(result.claim_verdicts)
    for one in result.study_results:
        print_failed_cells(one, with_rerun_commands=False)
    if result.inapplicable_claim_ids:
        text = "not checked, because they do not apply to these results"
        print_line(f"{text}: {', '.join(result.inapplicable_claim_ids)}", style="red")
