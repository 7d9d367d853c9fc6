"""Command ``rsfstudy compare``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.errors import shorten_text

if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy.reporting import TextTable
    from rsfstudy.storage import ResultsComparison

#: Maximum number of cells in the printed table of different statuses, and maximum length of a
#: printed value in characters.
_MAX_DIFFERING_CELLS, _MAX_VALUE_CHARACTERS = 10, 60


@dataclass(frozen=True)
class CompareCommandResult(CommandResult):
    """Comparison of two results files.

    Parameters
    ----------
    results_files : sequence of Path
        Paths of both files.
    provenance_of_files : sequence of mapping of str to object
        Provenance of both files.
    differences : ResultsComparison
        Differences between the files.
    """

    results_files: Sequence[Path]
    provenance_of_files: Sequence[Mapping[str, Any]]
    differences: ResultsComparison

    @property
    def exit_status(self) -> int:
        """Exit status. The status is 1 if the files differ or have no common cell."""
        return EXIT_STATUS_OK if self.differences.agrees else EXIT_STATUS_FAILED

    @property
    def summary_sentence(self) -> str:
        """Sentence that summarises the comparison."""
        found = self.differences
        if not found.finished_cell_counts[0]:
            return "nothing to compare, because the files have no finished cell in common"
        wrong = [
            f"{name} differs beyond error estimates"
            for name in found.variables_differing_beyond_errors
        ]
        if len(found.differing_statuses):
            from rsfstudy.formatting import format_count_with_noun

            wrong.append(
                f"{format_count_with_noun(len(found.differing_statuses), 'cell')} with "
                "different statuses"
            )
        return "; ".join(wrong) or "nothing differs beyond error estimates"

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        found = self.differences
        both, first, second = found.finished_cell_counts
        places = found.differing_statuses.drop(columns=["first", "second"]).to_dict("records")
        statuses = found.differing_statuses[["first", "second"]].to_dict("records")
        return {
            "files": [
                {"file": file, "time": about["time"], "command_line": about["command"]}
                for file, about in zip(self.results_files, self.provenance_of_files, strict=True)
            ],
            "agrees": found.agrees,
            "verdict": self.summary_sentence,
            "cells": {"both": both, "first_only": first, "second_only": second},
            "declaration": _convert_differences_to_json(found.differing_declaration_entries),
            "provenance": _convert_differences_to_json(found.differing_provenance),
            "axes": [
                {"dimension": name, "first_only": first, "second_only": second}
                for name, (first, second) in found.differing_axis_points.items()
            ],
            "statuses": [
                {"coordinates": place, **labels}
                for place, labels in zip(places, statuses, strict=True)
            ],
            "variables": found.agreement_table.to_dict("records"),
            "uncompared_variables": found.uncompared_variables,
        }


def _convert_differences_to_json(
    differences: Mapping[str, tuple[Any, Any]],
) -> list[dict[str, Any]]:
    """Convert differences to a list of entries for the JSON output."""
    return [{"name": n, "first": a, "second": b} for n, (a, b) in differences.items()]


@click.command(cls=CommandWithOptionsObject)
@click.argument("first")
@click.argument("second")
@options.output_directory_option
@options.json_option
def compare(command_options: options.CommandOptions) -> int:
    """Compare the declarations, versions and numbers of two results files.

    To compare the results of two named studies, pass the names of the studies. The command compares
    cells with equal coordinates. Two numbers agree if they differ by no more than the sum of both
    error estimates. The exit status is 0 if all numbers and statuses agree. The exit status is 1 if
    a number or a status differs, or if the files have no cell in common.
    """
    from rsfstudy.api import find_results_file
    from rsfstudy.storage import StoredDataset

    files = [
        find_results_file(name, command_options.output)
        for name in (command_options.first, command_options.second)
    ]
    datasets = [rsfstudy.open(file) for file in files]
    result = CompareCommandResult(
        files, [StoredDataset(one).provenance for one in datasets], rsfstudy.compare(*datasets)
    )
    return print_result_as_text_or_json(result, _print_file_comparison, command_options.as_json)


def _print_file_comparison(result: CompareCommandResult) -> None:
    """Print the files, the differences and the verdict."""
    from rsfstudy.cli.dataset_agreement_tables import build_dataset_agreement_table
    from rsfstudy.formatting import format_abbreviated_list, format_count_with_noun

    found = result.differences
    for letter, file, about in zip(
        "AB", result.results_files, result.provenance_of_files, strict=True
    ):
        print_line(f"{letter}: {file}, {about['time']}, {about['command']}")
    print_tables_and_sentences(
        [_build_differences_table("declaration", found.differing_declaration_entries)]
    )
    print_tables_and_sentences([_build_differences_table("provenance", found.differing_provenance)])
    both, first, second = found.finished_cell_counts
    print_line(
        f"{format_count_with_noun(both, 'cell')} in both, {first:,} only in A, {second:,} only in B"
    )
    for axis, alone in found.differing_axis_points.items():
        for letter, points in zip("AB", alone, strict=True):
            if points:
                print_line(
                    f"{axis} only in {letter} ({len(points)}): {format_abbreviated_list(points)}"
                )
    print_tables_and_sentences([_build_differing_statuses_table(found.differing_statuses)])
    if len(found.differing_statuses) > _MAX_DIFFERING_CELLS:
        print_line(f"and {len(found.differing_statuses) - _MAX_DIFFERING_CELLS} more cells")
    print_tables_and_sentences(
        [build_dataset_agreement_table(_select_rows_with_differences(found.agreement_table))]
    )
    for line in _describe_uncompared_variables(found.uncompared_variables):
        print_line(line)
    print_line(result.summary_sentence, style="green" if found.agrees else "red")


def _build_differences_table(
    section_name: str, differences: Mapping[str, tuple[Any, Any]]
) -> TextTable:
    """Return a table of the entries that differ between the files."""
    from rsfstudy.formatting import format_number_or_text
    from rsfstudy.reporting import TextTable

    headings = f"{section_name} entry that differs", "A", "B"
    rows = [
        (name, *(shorten_text(format_number_or_text(v), _MAX_VALUE_CHARACTERS) for v in pair))
        for name, pair in differences.items()
    ]
    return TextTable([dict(zip(headings, row, strict=True)) for row in rows], "", headings)


def _build_differing_statuses_table(differing_statuses: pd.DataFrame) -> TextTable:
    """Return a table of the first cells that have different statuses."""
    from rsfstudy.formatting import format_fields_except_none
    from rsfstudy.reporting import TextTable

    few = differing_statuses[:_MAX_DIFFERING_CELLS]
    places: list[dict[Any, Any]] = few.drop(columns=["first", "second"]).to_dict("records")
    rows = [
        {
            "cell": format_fields_except_none({str(name): value for name, value in place.items()}),
            "A": a,
            "B": b,
        }
        for place, a, b in zip(places, few["first"], few["second"], strict=True)
    ]
    return TextTable(rows, "", {"cell"})


def _select_rows_with_differences(agreement_table: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of results that differ or that have error estimates."""
    from rsfstudy.vocabulary import find_coverage_content_type

    differs = agreement_table["identical"] < agreement_table["values"]
    is_result = agreement_table["variable"].map(find_coverage_content_type) == "modelResult"
    return agreement_table[is_result & (differs | agreement_table["beyond_errors"].notna())]


def _describe_uncompared_variables(uncompared_variables: Mapping[str, str]) -> Iterator[str]:
    """Yield one line of text for each reason why variables are not compared."""
    for why in dict.fromkeys(uncompared_variables.values()):
        names = [name for name, reason in uncompared_variables.items() if reason == why]
        yield f"not compared, because {why}: {', '.join(names)}"
