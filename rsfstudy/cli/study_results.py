"""Functions that prepare the results of one study for printed output and for JSON output.

Each function whose name begins with ``print`` prints one section of the results. The other
functions collect the results without printing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas as pd
import xarray as xr

from rsfstudy import check
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.formatting import format_count_with_noun, format_overrides
from rsfstudy.former_data_names import NEW_VERDICT_COLUMN_BY_FORMER_COLUMN
from rsfstudy.reporting import (
    TextTable,
    build_claims_table,
    build_failed_cells_table,
    count_pending_cells,
    format_verdict_counts,
    summarise_study_as_json_fields,
)
from rsfstudy.storage import StoredDataset
from rsfstudy.study import Claim


@dataclass(frozen=True)
class StudyResults:
    """Results of one study.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    file_path : str
        Path of the results file. The path is part of the shell commands that recompute failed
        cells.
    """

    dataset: xr.Dataset
    file_path: str

    @property
    def study_name(self) -> str:
        """Name of the study."""
        return str(self.dataset.attrs["id"])

    @property
    def overrides(self) -> Mapping[str, Any]:
        """Values that override the values in the declaration of the study."""
        return StoredDataset(self.dataset).study_declaration.overrides

    @property
    def pending_cell_count(self) -> int:
        """Number of cells that have not been computed."""
        return count_pending_cells(self.dataset)

    @cached_property
    def failed_cells_table(self) -> TextTable:
        """Table of the first failed cells."""
        return build_failed_cells_table(self.dataset, self.file_path)

    @property
    def is_complete_without_failures(self) -> bool:
        """True if all cells have been computed and no cell failed."""
        return not (self.pending_cell_count or self.failed_cells_table.rows)

    @cached_property
    def claim_verdicts(self) -> pd.DataFrame:
        """Table of the claims of the study and the verdicts on these claims."""
        return check(self.dataset)

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output that describe one study.

        Returns
        -------
        dict of str to object
            Number of cells by status, reductions, missing reductions and failed cells.
        """
        return summarise_study_as_json_fields(self.dataset, self.file_path)


def collect_verdicts(study_results: Sequence[StudyResults]) -> pd.DataFrame:
    """Collect the verdicts on the claims of one study or of several studies.

    Parameters
    ----------
    study_results : sequence of StudyResults
        Results of at least one study.

    Returns
    -------
    pandas.DataFrame
        Table of the verdicts. The table of several studies has the column ``study`` and is sorted
        by the numbers in the identifiers of the claims.
    """
    if len(study_results) == 1:
        return study_results[0].claim_verdicts
    together = pd.concat([one.claim_verdicts.assign(study=one.study_name) for one in study_results])
    if "note" in together:  # Studies without notes have no such column.
        together["note"] = together["note"].fillna("")
    number = together["id"].astype(str).str.extract(r"(\d+)", expand=False).astype(float)
    return together.assign(number=number).sort_values("number", kind="stable")


def convert_verdicts_to_json(verdicts: pd.DataFrame, study_name: str = "") -> list[dict[str, Any]]:
    """Convert verdicts to entries of the JSON output.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts from ``collect_verdicts``.
    study_name : str, optional
        Name of the study if the table has no column ``study``.

    Returns
    -------
    list of dict
        One dictionary per claim. In addition to the columns of the table, a dictionary contains the
        former names of renamed columns, which version 1.0.0 will remove.
    """
    rows = verdicts.drop(columns="number", errors="ignore").to_dict("records")
    return [
        {"study": study_name}
        | {str(key): value for key, value in row.items()}
        | {former: row[new] for former, new in NEW_VERDICT_COLUMN_BY_FORMER_COLUMN.items()}
        for row in rows
    ]


def print_study_heading(results: StudyResults) -> None:
    """Print the name of a study, its completeness and its overrides.

    Parameters
    ----------
    results : StudyResults
        Results of the study.
    """
    print_line(f"{results.study_name} ({results.dataset.attrs['completeness']})", style="bold")
    if results.overrides:
        print_line(f"overrides: {format_overrides(results.overrides)}")


def print_verdicts(verdicts: pd.DataFrame) -> None:
    """Print a table of the claims, and the number of checked claims.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts on the claims.
    """
    checked = int((verdicts["verdict"] != Claim.NOT_APPLICABLE).sum())
    if checked:
        print_tables_and_sentences([build_claims_table(verdicts)])
    print_unexpected_verdicts(verdicts)
    line = (
        f"{checked} of {format_count_with_noun(len(verdicts), 'claim')} checked: "
        f"{format_verdict_counts(verdicts)}"
    )
    print_line(line if len(verdicts) else "no claims")


def print_unexpected_verdicts(verdicts: pd.DataFrame) -> None:
    """Print the verdicts that differ from the expected verdicts.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts on the claims.
    """
    for row in verdicts[verdicts["verdict_changed"]].itertuples(index=False):
        print_line(f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red")
        if note := getattr(row, "note", ""):
            print_line(f"{row.id}: {note}", style="yellow")


def print_failed_cells(results: StudyResults, with_rerun_commands: bool = True) -> None:
    """Print the failed cells, and a command that reproduces each failed cell.

    Parameters
    ----------
    results : StudyResults
        Results of the study.
    with_rerun_commands : bool, default: True
        If False, the function does not print the commands.
    """
    if results.pending_cell_count:
        cells = format_count_with_noun(results.dataset["status"].size, "cell")
        text = f"{results.pending_cell_count} of {cells} have not been computed yet"
        print_line(text, style="red")
    print_tables_and_sentences([results.failed_cells_table])
    if results.failed_cells_table.rows and with_rerun_commands:
        print_line("to reproduce each cell in a single process:")
        for row in results.failed_cells_table.unformatted_rows:
            print_line(f"  {row['command']}", soft_wrap=True)
