"""Tables that show how well two datasets agree."""

from __future__ import annotations

import pandas as pd

from rsfstudy.reporting import TextTable, format_number_or_dash


def build_dataset_agreement_table(agreement_by_variable: pd.DataFrame) -> TextTable:
    """Build a table that shows how well two datasets agree in each variable.

    Parameters
    ----------
    agreement_by_variable : pandas.DataFrame
        Table with one row per variable. The functions ``rsfstudy.rerun`` and ``rsfstudy.compare``
        return such tables.

    Returns
    -------
    TextTable
        Table with one row per variable. Each row contains the number of identical values and the
        number of values that differ by more than the sum of both error estimates.
    """
    rows = [
        {
            "variable": row["variable"],
            "values": str(row["values"]),
            "identical": str(row["identical"]),
            "beyond error estimates": format_number_or_dash(row["beyond_errors"], ".0f"),
            "largest difference": format_number_or_dash(row["largest_difference"], ".3g"),
        }
        for row in agreement_by_variable.to_dict("records")
    ]
    return TextTable(rows)
