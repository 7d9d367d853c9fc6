"""Command ``rsfstudy rerun``."""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

import rsfstudy
from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import EXIT_STATUS_FAILED, EXIT_STATUS_OK
from rsfstudy.cli.printing import print_line, print_tables_and_sentences
from rsfstudy.errors import RsfStudyError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from rsfstudy import Scene
    from rsfstudy.measures import Outcome


@click.command(cls=CommandWithOptionsObject)
@click.argument("file", type=options.PathParameterType())
@click.option(
    "--cell",
    "place",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Recompute only one cell, in the main process. The traceback of any error is printed. "
    "Repeat this option for each axis of the study.",
)
@options.study_file_option
@options.make_output_option(
    "Directory for the recomputed results.  [default: no file is written]", file_okay=False
)
@options.worker_pool_options
def rerun(command_options: options.CommandOptions) -> int:
    """Recompute the results in a file, and compare them with the stored results.

    The command rebuilds the study from the results file. The exit status is 1 if a recomputed
    number differs from the number in the file.
    """
    from rsfstudy.cli.study_options import open_worker_pool

    if command_options.place:
        return _recompute_and_print_cell(command_options)
    with open_worker_pool(command_options) as where:
        asked = command_options.collect_option_values("study", "output", "time_limit")
        agreement = rsfstudy.rerun(
            command_options.file,
            workers=where.process_count,
            client=where.client,
            progress=not command_options.quiet,
            **asked,
        )
    _print_agreement_with_file(agreement)
    return EXIT_STATUS_OK if _are_all_values_identical(agreement) else EXIT_STATUS_FAILED


def _are_all_values_identical(agreement_by_variable: pd.DataFrame) -> bool:
    """Return True if there are numbers to compare and all of them are identical."""
    values = agreement_by_variable["values"]
    return bool(values.sum()) and bool((values == agreement_by_variable["identical"]).all())


def _print_agreement_with_file(agreement_by_variable: pd.DataFrame) -> None:
    """Print how well the recomputed results agree with the results file."""
    from rsfstudy.cli.dataset_agreement_tables import build_dataset_agreement_table

    for name, (in_file, now) in agreement_by_variable.attrs["differs"].items():
        print_line(f"{name}: {in_file} in the file, {now} now", style="yellow")
    print_tables_and_sentences([build_dataset_agreement_table(agreement_by_variable)])
    if not agreement_by_variable["values"].sum():
        print_line("nothing to compare, because the file contains no finished cell")
    else:
        same = _are_all_values_identical(agreement_by_variable)
        print_line("all numbers are identical" if same else "some numbers differ")


def _recompute_and_print_cell(command_options: options.CommandOptions) -> int:
    """Recompute one cell, and print the new values next to the stored values."""
    import numpy as np

    from rsfstudy.cli import assignment_parsing
    from rsfstudy.storage import find_cell_number

    place = dict(map(assignment_parsing.parse_cell_coordinate, command_options.place))
    try:
        with warnings.catch_warnings(record=True, action="always") as caught:
            scene, outcome = rsfstudy.recompute_cell(
                command_options.file, place, study=command_options.study
            )
    except RsfStudyError:
        raise
    except Exception:  # The traceback helps to debug the cell.
        traceback.print_exc()
        return EXIT_STATUS_FAILED
    results = rsfstudy.open(command_options.file)
    index = np.unravel_index(find_cell_number(results, place), results["status"].shape)
    stored = results.isel(dict(zip(results["status"].dims, index, strict=True)))
    for one in caught:
        print_line(str(one.message), style="yellow")
    print_recomputed_cell(scene, outcome, stored)
    return EXIT_STATUS_OK if outcome.status.is_answer else EXIT_STATUS_FAILED


def print_recomputed_cell(scene: Scene, outcome: Outcome, stored_values: xr.Dataset) -> None:
    """Print a recomputed cell next to the stored values.

    The function prints the scene, a table of numbers, and the status of the cell. For an array, the
    table shows the number of values and the range of the values.

    Parameters
    ----------
    scene : Scene
        Scene of the cell.
    outcome : Outcome
        New results.
    stored_values : xarray.Dataset
        Values of the cell in the results file.
    """
    from rsfstudy.formatting import format_fields_except_none
    from rsfstudy.reporting import TextTable

    print_line(f"{format_fields_except_none(scene.as_dict())}\n")
    print_tables_and_sentences(
        [TextTable(_build_cell_comparison_rows(outcome.values, stored_values))]
    )
    text = f"{outcome.status.label}{': ' * bool(outcome.message)}{outcome.message}"
    print_line(f"{text} ({outcome.rhs_evaluations:,} right-hand-side evaluations)")


def _build_cell_comparison_rows(
    recomputed_values: Mapping[str, Any], stored_values: xr.Dataset
) -> Sequence[dict[str, str]]:
    """Return one table row per number, with the new value and the stored value."""
    import numpy as np

    rows = []
    for name, value in recomputed_values.items():
        same = np.array_equal(value, stored_values[name], equal_nan=True)
        now = _format_number_or_array(value)
        stored = "same" if same else _format_number_or_array(stored_values[name])
        rows.append({"number": name, "now": now, "in the file": stored})
    return rows


def _format_number_or_array(value: Any) -> str:
    """Format a number with all digits, or an array as its size and range."""
    import numpy as np

    finite = np.asarray(value, dtype=float)[np.isfinite(np.asarray(value, dtype=float))]
    if not np.ndim(value) or not finite.size:
        return str(value)
    return f"{np.size(value)} values, {finite.min():.6g} to {finite.max():.6g}"
