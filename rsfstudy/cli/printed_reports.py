"""Printed output of the commands.

The module prints study declarations, run reports, results, verdicts of claims, and comparisons of
two results files. The function ``print_claims_and_failed_cells`` also returns the exit status of a
check.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy import Scene, Study, check
from rsfstudy.cli import cost_estimates, table_layout
from rsfstudy.cli.console import stderr_console, stdout_console
from rsfstudy.errors import DataError, InvalidValue, shorten_text
from rsfstudy.execution import CellPlan
from rsfstudy.formatting import (
    format_list,
    format_nonempty_fields,
    format_overrides,
    format_value,
    pluralize,
)
from rsfstudy.measures import Outcome
from rsfstudy.motion import DEFAULT_RTOL
from rsfstudy.reporting import (
    TextTable,
    all_fits_are_valid,
    build_reduction_tables_and_sentences,
    build_summary_tables_and_sentences,
    claims_table,
    count_pending_cells,
    count_verdicts,
    describe_dataset_origin,
    describe_scene_and_rig_fields,
    failures_table,
    format_number_or_dash,
    format_status_counts,
    is_fit,
    note_on_norms_near_load_velocity,
    summarise_study_as_text_lines,
    summarise_verdicts,
)
from rsfstudy.status import Status
from rsfstudy.storage import Comparison, is_of_single_scene, read_declaration, read_provenance
from rsfstudy.study import NOT_APPLICABLE_VERDICT
from rsfstudy.vocabulary import find_coverage_content_type

if TYPE_CHECKING:
    from rsfstudy.plots import Figure

EXIT_STATUS_OK, EXIT_STATUS_FAILED = 0, 1
#: Maximum number of printed values of an axis, maximum number of printed cells with different
#: statuses, and maximum number of characters of a printed value.
_MAX_PRINTED_AXIS_POINTS, _MAX_DIFFERING_CELLS, _MAX_VALUE_CHARACTERS = 40, 10, 60


def print_study_declaration(study: Study, output_directory: Path) -> None:
    """Print the declaration of a study and its expected cost.

    Parameters
    ----------
    study : Study
        Study to print.
    output_directory : Path
        Directory of results. Measured times in this directory are used for the cost.
    """
    stdout_console.print(f"{study.name}: {study.title}\n", style="bold")
    if study.summary:
        stdout_console.print(study.summary + "\n")
    varied = {field for axis in study.axes for field in axis.fields}
    if study.scene_builder:
        varied |= {
            name
            for name, (dims, _values) in study.scene_builder.build_scale_coordinates().items()
            if dims
        }
    rig = study.rig.as_dict() if study.rig else {}
    measured = {n: v for n, v in study.measure.describe().items() if n not in varied}
    measured |= {n: f"{len(v)} of them" for n, v in measured.items() if isinstance(v, tuple | list)}
    gives = study.measure.variables
    with_errors = {n: " (with its error)" * (f"{n}_error" in gives) for n in gives}
    plan = CellPlan(study)
    different = len(plan.unique_cell_numbers)
    others = f", of which {different:,} differ" if different < study.size else ""
    costs = filter(
        None,
        (
            cost_estimates.describe_study_cost(plan, output_directory),
            cost_estimates.compiled_engine_hint(plan, output_directory),
        ),
    )
    about = {
        **{
            f"axis {axis.dimension} ({len(axis)})": _format_axis_points(axis.point_names)
            for axis in study.axes
        },
        **describe_scene_and_rig_fields("fixed", study.base.as_dict(), rig, varied),
        "measure": ", ".join(f"{n} = {v}" for n, v in measured.items()),
        "gives": ", ".join(f"{n}{w}" for n, w in with_errors.items() if not n.endswith("_error")),
        "reduced to": ", ".join(r.describe()["name"] for r in study.reductions),
        "claims": ", ".join(dict.fromkeys(c.id for c in study.claims)),
        "cells": f"{study.size:,}{others}",
        "cost": "; ".join(costs),
    }
    table_layout.print_summary_piece({name: text or "-" for name, text in about.items()})


def _format_axis_points(axis_points: Sequence[str]) -> str:
    """Format the values of an axis, and abbreviate a long list."""
    return ", ".join(
        axis_points
        if len(axis_points) <= _MAX_PRINTED_AXIS_POINTS
        else [*axis_points[:10], "...", *axis_points[-3:]]
    )


def print_expected_cost(
    study: Study, output_directory: Path, accuracy_was_changed: bool, suggest_faster_engine: bool
) -> None:
    """Print the expected cost of a run.

    Parameters
    ----------
    study : Study
        Study to run.
    output_directory : Path
        Directory of results.
    accuracy_was_changed : bool
        If True, also print the ratio of the expected work to the work at the default tolerance.
    suggest_faster_engine : bool
        If True, print a hint if the compiled engine would be much faster.
    """
    plan = CellPlan(study)
    if accuracy_was_changed:
        ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_work
        words = f"{study.name}: {ratio:.2g} times the work of rtol {DEFAULT_RTOL:g}"
        stdout_console.print(
            f"{words}, {cost_estimates.describe_study_cost(plan, output_directory)}"
        )
    if suggest_faster_engine and (
        text := cost_estimates.compiled_engine_hint(plan, output_directory)
    ):
        stderr_console.print(f"note: {text}")


# ---- reports of runs ----------------------------------------------------------------------------


@dataclass(frozen=True)
class RunSummary:
    """Summary of the run of one study.

    Parameters
    ----------
    study : str
        Name of the study.
    elapsed_time_text : str
        Elapsed time.
    status : str, default: "ok"
        "ok", or a description of the failures.
    verdicts : str, default: "-"
        Number of claims with each verdict.
    colour : str, default: "red"
        Colour of the status. The value "red" marks a failure.
    """

    study: str
    elapsed_time_text: str
    status: str = "ok"
    verdicts: str = "-"
    colour: str = "red"


def summarise_run(
    dataset: xr.Dataset, study_name: str, seconds: float, figure_was_drawn: bool
) -> RunSummary:
    """Summarise a finished run.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    study_name : str
        Name of the study.
    seconds : float
        Elapsed time in s.
    figure_was_drawn : bool
        False if drawing the figure failed.

    Returns
    -------
    RunSummary
        Summary of the run. The colour is "green" if there are no failures.
    """
    verdicts, wrong = summarise_verdicts(dataset, check(dataset))
    text = ", ".join([*wrong, *["no figure"] * (not figure_was_drawn)])
    colour = "red" if text else "green"
    return RunSummary(
        study_name, cost_estimates.format_duration(seconds), text or "ok", verdicts or "-", colour
    )


def print_run_report(
    dataset: xr.Dataset, summary_of_run: RunSummary, written_files: Sequence[Path]
) -> None:
    """Print reductions, claims, failed cells and output files of a run.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    summary_of_run : RunSummary
        Summary of the run.
    written_files : sequence of Path
        Results file and figure.
    """
    for piece in build_reduction_tables_and_sentences(dataset):
        table_layout.print_summary_piece(piece)
    if slow := note_on_norms_near_load_velocity(dataset):
        stdout_console.print(slow, style="yellow")
    _print_verdicts(_collect_verdicts([dataset]))
    print_failures(dataset, str(written_files[0]))
    stdout_console.print(f"{summary_of_run.study}: {format_status_counts(dataset)}")
    stdout_console.print(f"wrote {' and '.join(map(str, written_files))}", soft_wrap=True)


def print_short_run_report(
    dataset: xr.Dataset, summary_of_run: RunSummary, written_files: Sequence[Path]
) -> None:
    """Print a short report of the run of one of several studies.

    The report has one line for each table of ``print_run_report``. Failed cells are
    listed individually. Verdicts that differ from the expected verdicts are also listed.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of the study.
    summary_of_run : RunSummary
        Summary of the run.
    written_files : sequence of Path
        Results file and figure.
    """
    stdout_console.print(
        f"{summary_of_run.study}: {dataset.attrs['title']}", style="bold", soft_wrap=True
    )
    overrides = read_declaration(dataset).overrides
    for line in (
        *([f"not as declared: {format_overrides(overrides)}"] if overrides else []),
        *summarise_study_as_text_lines(dataset),
        f"claims: {summary_of_run.verdicts}",
        f"in {summary_of_run.elapsed_time_text}, wrote {' and '.join(map(str, written_files))}",
    ):
        stdout_console.print(f"  {line}", soft_wrap=True)
    _print_unexpected_verdicts(check(dataset))
    print_failures(dataset, str(written_files[0]))


def print_run_summaries(run_summaries: Sequence[RunSummary]) -> None:
    """Print a table with one row per study.

    Parameters
    ----------
    run_summaries : sequence of RunSummary
        Summaries of the runs.
    """
    rows = [
        {
            "study": end.study,
            "time": end.elapsed_time_text,
            "verdicts": end.verdicts,
            "status": end.status,
        }
        for end in run_summaries
    ]
    colours = [end.colour for end in run_summaries]
    table_layout.print_summary_piece(
        TextTable(rows, wrappable_columns={"verdicts", "status"}, row_colours=colours)
    )


# ---- results ------------------------------------------------------------------------------------


def print_results_summary(dataset: xr.Dataset, results_file: str) -> int:
    """Print the contents and the provenance of a results file.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, a fit, or results of a single scene.
    results_file : str
        Path of the file, which is used in commands that reproduce failed cells.

    Returns
    -------
    int
        Exit status. The status is ``EXIT_STATUS_FAILED`` if a cell, a fit or a motion failed.
    """
    title = dataset.attrs.get("title", "answer for one scene")
    name = f"{dataset.attrs['id']}: " if "id" in dataset.attrs else ""
    stdout_console.print(f"{name}{title}\n", style="bold")
    table_layout.print_summary_piece(describe_dataset_origin(dataset))
    for piece in build_summary_tables_and_sentences(dataset):
        table_layout.print_summary_piece(piece)
    if not is_of_single_scene(dataset) and not is_fit(dataset):
        table_layout.print_summary_piece(build_contents_table(dataset))
        return print_failures(dataset, results_file)
    return exit_status_of_dataset(dataset)


def exit_status_of_dataset(dataset: xr.Dataset) -> int:
    """Return the exit status for a fit or for results of a single scene.

    Parameters
    ----------
    dataset : xarray.Dataset
        Fit, motion or other results of a single scene.

    Returns
    -------
    int
        ``EXIT_STATUS_OK`` if all fits are valid or if the status of the scene is ``ok``. Otherwise
        ``EXIT_STATUS_FAILED``.
    """
    if is_fit(dataset):
        return EXIT_STATUS_OK if all_fits_are_valid(dataset) else EXIT_STATUS_FAILED
    return EXIT_STATUS_OK if dataset.attrs["status"] == Status.OK.label else EXIT_STATUS_FAILED


def print_failures(dataset: xr.Dataset, results_file: str = "") -> int:
    """Print the failed cells, and a command that reproduces each failed cell.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.
    results_file : str, default: ""
        Path of the results file. Without a path, the commands are not printed.

    Returns
    -------
    int
        Exit status. The status is ``EXIT_STATUS_FAILED`` if a cell failed or has not been computed
        yet.
    """
    if undone := count_pending_cells(dataset):
        size = dataset["status"].size
        stdout_console.print(f"{undone} of {pluralize(size, 'cell')} not computed yet", style="red")
    failed, commands = failures_table(dataset, results_file)
    table_layout.print_summary_piece(failed)
    if commands and results_file:
        stdout_console.print("each alone, in one process:")
        for command in commands:
            stdout_console.print(f"  {command}", soft_wrap=True)
    return EXIT_STATUS_FAILED if undone or commands else EXIT_STATUS_OK


def print_recomputed_cell(
    scene: Scene, outcome: Outcome, stored_values: xr.Dataset, warning_texts: Sequence[str] = ()
) -> int:
    """Print a recomputed cell next to the stored values.

    The function prints warnings, the scene, a table of numbers, and the status of the cell. For an
    array, the table contains the number of values and their range.

    Parameters
    ----------
    scene : Scene
        Scene of the cell.
    outcome : Outcome
        New results.
    stored_values : xarray.Dataset
        Values of the cell in the results file.
    warning_texts : sequence of str, optional
        Warnings that were emitted during the computation.

    Returns
    -------
    int
        Exit status. The exit status is ``EXIT_STATUS_OK`` if the new status of the cell is an
        answer.
    """
    for text in warning_texts:
        stdout_console.print(text, style="yellow")
    stdout_console.print(f"{format_nonempty_fields(scene.as_dict())}\n")
    rows = []
    for name, value in outcome.values.items():
        same = np.array_equal(value, stored_values[name], equal_nan=True)
        rows.append(
            {
                "number": name,
                "now": _format_number_or_array(value),
                "in the file": "same" if same else _format_number_or_array(stored_values[name]),
            }
        )
    table_layout.print_summary_piece(TextTable(rows))
    text = f"{outcome.status.label}{': ' * bool(outcome.message)}{outcome.message}"
    stdout_console.print(f"{text} ({outcome.rhs_evaluations:,} right-hand sides)")
    return EXIT_STATUS_OK if outcome.status.is_answer else EXIT_STATUS_FAILED


def _format_number_or_array(value: Any) -> str:
    """Format a number in full, or an array as its size and its range."""
    finite = np.asarray(value, dtype=float)[np.isfinite(np.asarray(value, dtype=float))]
    if not np.ndim(value) or not finite.size:
        return str(value)
    return f"{np.size(value)} values, {finite.min():.6g} to {finite.max():.6g}"


def write_figure(figure: Figure, path: Path, style: str | None = None) -> None:
    """Write a figure to an image file.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure to write.
    path : Path
        Path of the file. The suffix determines the format.
    style : str, optional
        Style sheet of Matplotlib.

    Raises
    ------
    DataError
        If the file cannot be written.
    """
    from rsfstudy.plots import render_figure, style_context, write_image

    try:
        with style_context(style):
            write_image(render_figure(figure, path.suffix[1:]), path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error})") from error


# ---- verdicts -----------------------------------------------------------------------------------


def print_claims_and_failed_cells(
    datasets: Sequence[xr.Dataset], claim_ids: Sequence[str] = ()
) -> int:
    """Print the claims and the failed cells of studies.

    Parameters
    ----------
    datasets : sequence of xarray.Dataset
        Results of one or more studies.
    claim_ids : sequence of str, optional
        Identifiers of the claims to check. By default, all claims are checked.

    Returns
    -------
    int
        Exit status. The status is ``EXIT_STATUS_FAILED`` if a verdict differs from the expected
        verdict or if a cell failed. The status is also ``EXIT_STATUS_FAILED`` if a requested claim
        does not apply to the results, or if no claim applies.

    Raises
    ------
    InvalidValue
        If an identifier does not belong to a claim of the results.
    """
    found = _collect_verdicts(datasets)
    for claim in claim_ids:
        if claim not in (choices := list(dict.fromkeys(found["id"]))):
            raise InvalidValue("--claim", claim, "is no claim of these results", choices=choices)
    found = found[found["id"].isin(claim_ids)] if claim_ids else found
    others = found["id"][found["verdict"] == NOT_APPLICABLE_VERDICT]
    status = max(_print_verdicts(found), *map(print_failures, datasets))
    if len(others) and (claim_ids or len(others) == len(found)):
        which = ", ".join(dict.fromkeys(others))
        stdout_console.print(
            f"not checked, because they do not apply to these results: {which}", style="red"
        )
        return EXIT_STATUS_FAILED
    return status


def _collect_verdicts(datasets: Sequence[xr.Dataset]) -> pd.DataFrame:
    """Return the claims of one study or of several studies.

    For a single study, the function also prints the name of the study and its overrides. The claims
    of several studies are sorted by the numbers in their identifiers.
    """
    if len(datasets) == 1:
        about = datasets[0].attrs
        stdout_console.print(f"{about['id']} ({about['completeness']})", style="bold")
        if overrides := read_declaration(datasets[0]).overrides:
            stdout_console.print(f"not as declared: {format_overrides(overrides)}")
        return check(datasets[0])
    frames = [check(dataset).assign(study=dataset.attrs["id"]) for dataset in datasets]
    together = pd.concat(frames)
    number = together["id"].astype(str).str.extract(r"(\d+)", expand=False).astype(float)
    return together.assign(number=number).sort_values("number", kind="stable")


def _print_verdicts(verdicts: pd.DataFrame) -> int:
    """Print claims and the number of checked claims.

    The exit status is ``EXIT_STATUS_FAILED`` if a verdict differs from the expected verdict.
    """
    checked = int((verdicts["verdict"] != NOT_APPLICABLE_VERDICT).sum())
    if checked:
        table_layout.print_summary_piece(claims_table(verdicts))
    status = _print_unexpected_verdicts(verdicts)
    line = f"{checked} of {pluralize(len(verdicts), 'claim')} checked: {count_verdicts(verdicts)}"
    stdout_console.print(line if len(verdicts) else "no claims")
    return status


def _print_unexpected_verdicts(verdicts: pd.DataFrame) -> int:
    """Print the verdicts that differ from the expected verdicts.

    The exit status is ``EXIT_STATUS_FAILED`` if there are unexpected verdicts.
    """
    others = verdicts[verdicts["moved"]]
    for row in others.itertuples(index=False):
        stdout_console.print(
            f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red"
        )
    return EXIT_STATUS_FAILED if len(others) else EXIT_STATUS_OK


# ---- comparisons --------------------------------------------------------------------------------


def print_rerun_agreement(agreement_table: pd.DataFrame) -> int:
    """Print the agreement of recomputed results with a results file.

    Parameters
    ----------
    agreement_table : pandas.DataFrame
        Agreement by variable, as ``rsfstudy.rerun`` returns it.

    Returns
    -------
    int
        Exit status. The status is ``EXIT_STATUS_FAILED`` if a number differs or if there are no
        numbers to compare.
    """
    for name, (theirs, ours) in agreement_table.attrs["differs"].items():
        stdout_console.print(f"{name}: {theirs} then, {ours} now", style="yellow")
    _print_agreement_table(agreement_table)
    if not agreement_table["values"].sum():
        stdout_console.print("nothing to compare: no cell of the file is finished")
        return EXIT_STATUS_FAILED
    same = bool((agreement_table["values"] == agreement_table["identical"]).all())
    stdout_console.print("every number is the same" if same else "not every number is the same")
    return EXIT_STATUS_OK if same else EXIT_STATUS_FAILED


def print_comparison(
    files: Sequence[Path], datasets: Sequence[xr.Dataset], comparison: Comparison
) -> int:
    """Print the comparison of two results files.

    Parameters
    ----------
    files : sequence of Path
        Paths of both files.
    datasets : sequence of xarray.Dataset
        Contents of both files.
    comparison : Comparison
        Differences between the datasets.

    Returns
    -------
    int
        Exit status. The status is ``EXIT_STATUS_FAILED`` if a status differs, if a number differs
        by more than the sum of both error estimates, or if the files have no finished cell in
        common.
    """
    for letter, file, dataset in zip("AB", files, datasets, strict=True):
        about = read_provenance(dataset)
        stdout_console.print(f"{letter}: {file}, {about['time']}, {about['command']}")
    for title, pairs in (("declaration", comparison.declaration), ("made by", comparison.origin)):
        heads = f"{title} differs", "A", "B"
        rows = [
            (n, *(shorten_text(format_value(v), _MAX_VALUE_CHARACTERS) for v in ab))
            for n, ab in pairs.items()
        ]
        table_layout.print_summary_piece(
            TextTable([dict(zip(heads, row, strict=True)) for row in rows], wrappable_columns=heads)
        )
    both, first, second = comparison.finished_cell_counts
    stdout_console.print(
        f"{pluralize(both, 'cell')} in both, {first:,} only in A, {second:,} only in B"
    )
    for axis, alone in comparison.differing_axis_points.items():
        for letter, points in zip("AB", alone, strict=True):
            if points:
                stdout_console.print(
                    f"{axis} only in {letter} ({len(points)}): {format_list(points)}"
                )
    _print_differing_statuses(comparison.statuses)
    differs = comparison.agreement_table["identical"] < comparison.agreement_table["values"]
    is_result = (
        comparison.agreement_table["variable"].map(find_coverage_content_type) == "modelResult"
    )
    _print_agreement_table(
        comparison.agreement_table[
            is_result & (differs | comparison.agreement_table["beyond_errors"].notna())
        ]
    )
    for why in dict.fromkeys(comparison.uncompared_variables.values()):
        names = [name for name, reason in comparison.uncompared_variables.items() if reason == why]
        stdout_console.print(f"not compared, because {why}: {', '.join(names)}")
    wrong = [f"{name} differs beyond error estimates" for name in comparison.beyond_errors]
    wrong += [f"{pluralize(len(comparison.statuses), 'cell')} ended otherwise"] * bool(
        len(comparison.statuses)
    )
    verdict = "; ".join(wrong) or "nothing differs beyond error estimates"
    if not both:
        verdict = "nothing to compare: no finished cell is in both"
    stdout_console.print(verdict, style="green" if comparison.agrees else "red")
    return EXIT_STATUS_OK if comparison.agrees else EXIT_STATUS_FAILED


def _print_differing_statuses(differing_statuses: pd.DataFrame) -> None:
    """Print the cells whose statuses in the two files differ."""
    first = differing_statuses[:_MAX_DIFFERING_CELLS]
    places = first.drop(columns=["first", "second"]).to_dict("records")
    rows = [
        {
            "cell": format_nonempty_fields({str(name): value for name, value in place.items()}),
            "A": a,
            "B": b,
        }
        for place, a, b in zip(places, first["first"], first["second"], strict=True)
    ]
    table_layout.print_summary_piece(TextTable(rows, wrappable_columns={"cell"}))
    if len(differing_statuses) > _MAX_DIFFERING_CELLS:
        stdout_console.print(f"and {len(differing_statuses) - _MAX_DIFFERING_CELLS} more")


def _print_agreement_table(agreement_table: pd.DataFrame) -> None:
    """Print the agreement of each variable.

    The table lists the number of identical values, and the number of values that differ by more
    than the sum of both error estimates.
    """
    rows = [
        {
            "variable": row["variable"],
            "values": str(row["values"]),
            "identical": str(row["identical"]),
            "beyond errors": format_number_or_dash(row["beyond_errors"], ".0f"),
            "largest difference": format_number_or_dash(row["largest_difference"], ".3g"),
        }
        for row in agreement_table.to_dict("records")
    ]
    table_layout.print_summary_piece(TextTable(rows))


def build_contents_table(dataset: xr.Dataset) -> TextTable:
    """Return a table of the results that a dataset contains.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    TextTable
        Name, description and dimensions of each result.
    """
    rows = [
        {
            "it holds": str(name),  # users may add variables without long_name
            "what": f"{v.attrs.get('long_name', '')} ({', '.join(map(str, v.dims))})".strip(),
        }
        for name, v in dataset.data_vars.items()
        if find_coverage_content_type(str(name)) == "modelResult"
    ]
    return TextTable(rows, wrappable_columns={"what"})
