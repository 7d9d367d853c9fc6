"""Results of one study, for printed output and for JSON output.

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
from rsfstudy.cli.printing import print_line, print_pieces
from rsfstudy.formatting import format_overrides, pluralize
from rsfstudy.former_data_names import NEW_VERDICT_COLUMNS
from rsfstudy.reporting import (
    TextTable,
    claims_table,
    count_pending_cells,
    count_verdicts,
    failures_table,
    summarise_study_as_fields,
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
    file : str
        Path of the results file. The path is part of the shell commands that recompute failed
        cells.
    """

    dataset: xr.Dataset
    file: str

    @property
    def name(self) -> str:
        """Name of the study."""
        return str(self.dataset.attrs["id"])

    @property
    def overrides(self) -> Mapping[str, Any]:
        """Overridden values, which differ from the declaration of the study."""
        return StoredDataset(self.dataset).declaration.overrides

    @property
    def pending_count(self) -> int:
        """Number of cells that have not been computed."""
        return count_pending_cells(self.dataset)

    @cached_property
    def failures(self) -> TextTable:
        """Table of the first failed cells."""
        return failures_table(self.dataset, self.file)

    @property
    def is_complete(self) -> bool:
        """True if all cells have been computed and no cell failed."""
        return not (self.pending_count or self.failures.rows)

    @cached_property
    def verdicts(self) -> pd.DataFrame:
        """Table of the claims of the study and their verdicts."""
        return check(self.dataset)

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output that describe one study.

        Returns
        -------
        dict of str to object
            Number of cells by status, reductions, missing reductions and failed cells.
        """
        return summarise_study_as_fields(self.dataset, self.file)


def collect_verdicts(studies: Sequence[StudyResults]) -> pd.DataFrame:
    """Collect the verdicts on the claims of one study or of several studies.

    Parameters
    ----------
    studies : sequence of StudyResults
        Results of at least one study.

    Returns
    -------
    pandas.DataFrame
        Table of the verdicts. The table of several studies has the column ``study`` and is sorted
        by the numbers in the identifiers of the claims.
    """
    if len(studies) == 1:
        return studies[0].verdicts
    together = pd.concat([one.verdicts.assign(study=one.name) for one in studies])
    if "note" in together:  # Studies without notes have no such column.
        together["note"] = together["note"].fillna("")
    number = together["id"].astype(str).str.extract(r"(\d+)", expand=False).astype(float)
    return together.assign(number=number).sort_values("number", kind="stable")


def verdicts_to_json(verdicts: pd.DataFrame, study_name: str = "") -> list[dict[str, Any]]:
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
        | {former: row[new] for former, new in NEW_VERDICT_COLUMNS.items()}
        for row in rows
    ]


def print_study_name(results: StudyResults) -> None:
    """Print the name of a study, its completeness and its overrides.

    Parameters
    ----------
    results : StudyResults
        Results of the study.
    """
    print_line(f"{results.name} ({results.dataset.attrs['completeness']})", style="bold")
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
        print_pieces([claims_table(verdicts)])
    print_unexpected_verdicts(verdicts)
    line = f"{checked} of {pluralize(len(verdicts), 'claim')} checked: {count_verdicts(verdicts)}"
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


def print_failures(results: StudyResults, with_commands: bool = True) -> None:
    """Print the failed cells, and a command that reproduces each failed cell.

    Parameters
    ----------
    results : StudyResults
        Results of the study.
    with_commands : bool, default: True
        If False, the function does not print the commands.
    """
    if results.pending_count:
        cells = pluralize(results.dataset["status"].size, "cell")
        text = f"{results.pending_count} of {cells} have not been computed yet"
        print_line(text, style="red")
    print_pieces([results.failures])
    if results.failures.rows and with_commands:
        print_line("to reproduce each cell in a single process:")
        for row in results.failures.values:
            print_line(f"  {row['command']}", soft_wrap=True)
