"""Command ``rsfstudy check``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import Command
from rsfstudy.cli.printing import print_line
from rsfstudy.cli.results import EXIT_STATUS_FAILED, EXIT_STATUS_OK, CommandResult, output_result
from rsfstudy.errors import InvalidValue

if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy.cli.study_results import StudyResults


@dataclass(frozen=True)
class Check(CommandResult):
    """Comparison of study results with published values.

    Parameters
    ----------
    studies : sequence of StudyResults
        Results of the studies that have been run.
    verdicts : pandas.DataFrame or None
        Table of the claims and their verdicts, or None if there are no results.
    unapplied_claims : sequence of str, optional
        Identifiers of the requested claims that do not apply to the results.
    skipped : mapping of str to str, optional
        Reason for skipping a study, by name of the study. The command reports a skipped study but
        does not fail.
    not_run : sequence of str, optional
        Names of the studies that have no results and are not in ``skipped``.
    """

    studies: Sequence[StudyResults]
    verdicts: pd.DataFrame | None
    unapplied_claims: Sequence[str] = ()
    skipped: Mapping[str, str] = field(default_factory=dict)
    not_run: Sequence[str] = ()

    @property
    def exit_status(self) -> int:
        """Exit status of the command ``check``.

        The status is 1 if a verdict changed, if a cell failed or has not been computed, or if a
        study or a claim was not checked.
        """
        changed = self.verdicts is not None and bool(self.verdicts["verdict_changed"].any())
        complete = all(one.is_complete for one in self.studies)
        failed = changed or not complete or self.unapplied_claims or self.not_run
        return EXIT_STATUS_FAILED if failed else EXIT_STATUS_OK

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        from rsfstudy.cli.study_results import verdicts_to_json

        only = self.studies[0].name if len(self.studies) == 1 else ""
        claims = [] if self.verdicts is None else verdicts_to_json(self.verdicts, only)
        return {
            "studies": [one.json_fields() for one in self.studies],
            "claims": claims,
            "unapplied_claims": self.unapplied_claims,
            "skipped": self.skipped,
            "not_run": self.not_run,
        }


@click.command(cls=Command)
@options.study_name_or_all_argument
@options.output_option
@click.option(
    "--claim",
    "claims",
    multiple=True,
    metavar="ID",
    help="Check only this claim. The claim must apply to the results. Example: C6.",
)
@options.json_option
def check(given: options.CommandOptions) -> int:
    """Compare results with published values.

    NAME is the name of a study, or a results file. The exit status is 1 if a verdict differs from
    the expected verdict, if a cell failed, or if no claim applies to the results.
    """
    return output_result(_check_studies(given), _print_check, given.as_json)


def _check_studies(given: options.CommandOptions) -> Check:
    """Read the results of the requested studies, and check their claims."""
    from rsfstudy.api import find_results
    from rsfstudy.cli.cost_estimates import describe_missing_engine_packages
    from rsfstudy.cli.study_options import selected_study_names
    from rsfstudy.cli.study_results import StudyResults, collect_verdicts
    from rsfstudy.study import Claim, load_study

    studies, skipped, not_run = [], {}, []
    for name in selected_study_names(given):
        if not given.every or (given.output / f"{name}.nc").exists():
            dataset = rsfstudy.open(name, given.output)
            studies.append(StudyResults(dataset, str(find_results(name, given.output))))
        elif why := describe_missing_engine_packages(load_study(name).accuracy.engine):
            skipped[name] = why
        else:
            not_run.append(name)
    if not studies:
        return Check([], None, (), skipped, not_run)
    verdicts = _select_claims(collect_verdicts(studies), given.claims)
    others = verdicts["id"][verdicts["verdict"] == Claim.NOT_APPLICABLE]
    unapplied = list(dict.fromkeys(others)) if given.claims or len(others) == len(verdicts) else []
    return Check(studies, verdicts, unapplied, skipped, not_run)


def _select_claims(verdicts: pd.DataFrame, claim_ids: Sequence[str]) -> pd.DataFrame:
    """Return the verdicts on the requested claims. By default, return all verdicts."""
    for claim in claim_ids:
        if claim not in (choices := list(dict.fromkeys(verdicts["id"]))):
            raise InvalidValue("--claim", claim, "is not a claim of these results", choices=choices)
    return verdicts[verdicts["id"].isin(claim_ids)] if claim_ids else verdicts


def _print_check(result: Check) -> None:
    """Print the verdicts and the failed cells."""
    from rsfstudy.cli.study_results import print_failures, print_study_name, print_verdicts

    for name, reason in result.skipped.items():
        print_line(f"{name}: skipped: {reason}", style="yellow")
    for name in result.not_run:
        print_line(f"{name}: not run yet", style="red")
    if result.verdicts is None:
        return
    if len(result.studies) == 1:
        print_study_name(result.studies[0])
    print_verdicts(result.verdicts)
    for one in result.studies:
        print_failures(one, with_commands=False)
    if result.unapplied_claims:
        text = "not checked, because they do not apply to these results"
        print_line(f"{text}: {', '.join(result.unapplied_claims)}", style="red")
