"""Functions that list the verdicts on claims in a table and count the claims per verdict."""

from __future__ import annotations

import pandas as pd
import xarray as xr

from rsfstudy.formatting import format_count_with_noun
from rsfstudy.reporting.cell_tables import count_failed_cells_by_status
from rsfstudy.reporting.text_tables import TextTable
from rsfstudy.study import Claim, format_verdict_row_for_report


def build_claims_table(verdicts: pd.DataFrame) -> TextTable | str:
    """Build a table of claims and their verdicts.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts of one or several studies, from ``rsfstudy.check``.

    Returns
    -------
    TextTable or str
        Table of the claims. If no claim applies, the function returns a sentence with the reason.
        If there are no claims, the function returns an empty string.
    """
    rows = verdicts.to_dict("records")
    if not any(row["verdict"] != Claim.NOT_APPLICABLE for row in rows):
        return (
            f"{format_count_with_noun(len(rows), 'claim')} not checked: "
            f"{format_verdict_counts(verdicts)}" * bool(rows)
        )
    colours = [
        "red" if row["verdict_changed"] else "green" if row["verdict"] == "reproduced" else "yellow"
        for row in rows
    ]
    return TextTable(
        [format_verdict_row_for_report(row) for row in rows],
        wrappable_columns={"claim", "tolerance and reason"},
        last_column_colours=colours,
    )


def format_verdict_counts(verdicts: pd.DataFrame) -> str:
    """Count the claims with each verdict.

    Parameters
    ----------
    verdicts : pandas.DataFrame
        Verdicts, from ``rsfstudy.check``.

    Returns
    -------
    str
        String with the number of claims with each verdict. If no claim applies, the string contains
        the reason.
    """
    given = list(verdicts["verdict"])
    if set(given) == {Claim.NOT_APPLICABLE}:
        return "no published values for overrides or other units"
    return ", ".join(f"{given.count(v)} {v}" for v in Claim.VERDICTS if v in given)


def summarise_verdicts_and_failures(
    dataset: xr.Dataset, verdicts: pd.DataFrame
) -> tuple[str, list[str]]:
    """Summarise the verdicts of a study, and describe its failed cells.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    verdicts : pandas.DataFrame
        Verdicts, from ``rsfstudy.check``.

    Returns
    -------
    counts : str
        Text with the number of claims with each verdict.
    problems : list of str
        Descriptions of failed cells, and of claims whose verdict differs from the expected verdict.
    """
    wrong = [f"{count} {label}" for label, count in count_failed_cells_by_status(dataset).items()]
    changed = verdicts["id"][verdicts["verdict_changed"]]
    wrong += [f"verdict of {claim} changed" for claim in dict.fromkeys(changed)]
    return format_verdict_counts(verdicts), wrong
