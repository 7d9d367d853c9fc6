"""What commands print: studies, how runs end, results, verdicts, and how two results compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy import Scene, Study, check
from rsfstudy.cli import cost, table_layout
from rsfstudy.cli.console import console, stderr
from rsfstudy.errors import DataError, InvalidValue, shorten
from rsfstudy.execution import Plan
from rsfstudy.formatting import (
    format_fields,
    format_list,
    format_overrides,
    format_value,
    pluralize,
)
from rsfstudy.measures import Outcome
from rsfstudy.motion import DEFAULT_RTOL
from rsfstudy.reporting import (
    Table,
    all_answered,
    claims_table,
    count_pending,
    count_verdicts,
    describe_fields,
    describe_origin,
    failures_table,
    format_number,
    format_status_counts,
    is_fit,
    reduction_pieces,
    slow_norm_note,
    summarise_in_lines,
    summarise_verdicts,
    summary_pieces,
)
from rsfstudy.status import Status
from rsfstudy.storage import Comparison, is_single_scene, read_declaration, read_provenance
from rsfstudy.study import NOT_APPLICABLE
from rsfstudy.vocabulary import coverage_content_type

if TYPE_CHECKING:
    from rsfstudy.plots import Figure

OK, FAILED = 0, 1
#: Most points of an axis, and most cells that ended otherwise; most characters of a value.
_MAX_POINTS, _MAX_DIFFERING_CELLS, _MAX_VALUE_CHARACTERS = 40, 10, 60


def print_declaration(study: Study, output: Path) -> None:
    """Print a study: its axes, what is fixed and measured, its cells and what they cost, by what is
    kept in a directory of results.
    """
    console.print(f"{study.name}: {study.title}\n", style="bold")
    if study.summary:
        console.print(study.summary + "\n")
    varied = {field for axis in study.axes for field in axis.fields}
    if study.scene_builder:
        varied |= {
            name
            for name, (dims, _values) in study.scene_builder.scale_coordinates().items()
            if dims
        }
    rig = study.rig.as_dict() if study.rig else {}
    measured = {n: v for n, v in study.measure.describe().items() if n not in varied}
    measured |= {n: f"{len(v)} of them" for n, v in measured.items() if isinstance(v, tuple | list)}
    gives = study.measure.variables
    with_errors = {n: " (with its error)" * (f"{n}_error" in gives) for n in gives}
    plan = Plan(study)
    different = len(plan.unique_cells)
    others = f", of which {different:,} differ" if different < study.size else ""
    costs = filter(None, (cost.cost_text(plan, output), cost.compiled_engine_hint(plan, output)))
    about = {
        **{
            f"axis {axis.dimension} ({len(axis)})": _format_points(axis.point_names)
            for axis in study.axes
        },
        **describe_fields("fixed", study.base.as_dict(), rig, varied),
        "measure": ", ".join(f"{n} = {v}" for n, v in measured.items()),
        "gives": ", ".join(f"{n}{w}" for n, w in with_errors.items() if not n.endswith("_error")),
        "reduced to": ", ".join(r.describe()["name"] for r in study.reductions),
        "claims": ", ".join(dict.fromkeys(c.id for c in study.claims)),
        "cells": f"{study.size:,}{others}",
        "cost": "; ".join(costs),
    }
    table_layout.print_piece({name: text or "-" for name, text in about.items()})


def _format_points(points: Sequence[str]) -> str:
    """The points of an axis, without the middle where they are many."""
    return ", ".join(points if len(points) <= _MAX_POINTS else [*points[:10], "...", *points[-3:]])


def print_expected_cost(study: Study, output: Path, accuracy: bool, advice: bool) -> None:
    """Print what a run at another accuracy will cost, and what would be faster."""
    plan = Plan(study)
    if accuracy:
        ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_work
        words = f"{study.name}: {ratio:.2g} times the work of rtol {DEFAULT_RTOL:g}"
        console.print(f"{words}, {cost.cost_text(plan, output)}")
    if advice and (text := cost.compiled_engine_hint(plan, output)):
        stderr.print(f"note: {text}")


# ---- how runs end -------------------------------------------------------------------------------


@dataclass(frozen=True)
class RunSummary:
    """End of the run of a study, as the summary tells it.

    Parameters
    ----------
    study : str
    time : str
        Time it took.
    status : str
        "ok", or what went wrong.
    verdicts : str
        How many claims had which verdict.
    colour : str
        Of its status; "red" if anything went wrong.
    """

    study: str
    time: str
    status: str = "ok"
    verdicts: str = "-"
    colour: str = "red"


def run_summary(dataset: xr.Dataset, name: str, seconds: float, drawn: bool) -> RunSummary:
    """End of a run, in few words."""
    verdicts, wrong = summarise_verdicts(dataset, check(dataset))
    text = ", ".join([*wrong, *["no figure"] * (not drawn)])
    colour = "red" if text else "green"
    return RunSummary(name, cost.format_duration(seconds), text or "ok", verdicts or "-", colour)


def print_report(dataset: xr.Dataset, end: RunSummary, files: Sequence[Path]) -> None:
    """Print what a run ends with: slopes, claims, failures and where the files are."""
    for piece in reduction_pieces(dataset):
        table_layout.print_piece(piece)
    if slow := slow_norm_note(dataset):
        console.print(slow, style="yellow")
    _print_verdicts(_collect_claims([dataset]))
    print_failures(dataset, str(files[0]))
    console.print(f"{end.study}: {format_status_counts(dataset)}")
    console.print(f"wrote {' and '.join(map(str, files))}", soft_wrap=True)


def print_short(dataset: xr.Dataset, end: RunSummary, files: Sequence[Path]) -> None:
    """Print a short report of one of several runs.

    The report has one line for each table of ``print_report``. It lists changed verdicts and failed
    cells in full.
    """
    console.print(f"{end.study}: {dataset.attrs['title']}", style="bold", soft_wrap=True)
    overrides = read_declaration(dataset).overrides
    for line in (
        *([f"not as declared: {format_overrides(overrides)}"] if overrides else []),
        *summarise_in_lines(dataset),
        f"claims: {end.verdicts}",
        f"in {end.time}, wrote {' and '.join(map(str, files))}",
    ):
        console.print(f"  {line}", soft_wrap=True)
    _print_unexpected_verdicts(check(dataset))
    print_failures(dataset, str(files[0]))


def print_run_summaries(ends: Sequence[RunSummary]) -> None:
    """Print how several runs ended."""
    rows = [{n: getattr(end, n) for n in ("study", "time", "verdicts", "status")} for end in ends]
    colours = [end.colour for end in ends]
    table_layout.print_piece(Table(rows, wrappable={"verdicts", "status"}, colours=colours))


# ---- results ------------------------------------------------------------------------------------


def print_results(dataset: xr.Dataset, file: str) -> int:
    """Print what a file holds, whatever it is of, and where it comes from; FAILED where cells, fits
    or a motion failed.
    """
    title = dataset.attrs.get("title", "answer for one scene")
    name = f"{dataset.attrs['id']}: " if "id" in dataset.attrs else ""
    console.print(f"{name}{title}\n", style="bold")
    table_layout.print_piece(describe_origin(dataset))
    for piece in summary_pieces(dataset):
        table_layout.print_piece(piece)
    if not is_single_scene(dataset) and not is_fit(dataset):
        table_layout.print_piece(contents_table(dataset))
        return print_failures(dataset, file)
    return exit_status(dataset)


def exit_status(dataset: xr.Dataset) -> int:
    """OK where every fit has numbers, or a motion ended as asked."""
    if is_fit(dataset):
        return OK if all_answered(dataset) else FAILED
    return OK if dataset.attrs["status"] == Status.OK.label else FAILED


def print_failures(dataset: xr.Dataset, file: str = "") -> int:
    """Print the cells that failed, and how to reproduce one alone; FAILED if there are any."""
    if undone := count_pending(dataset):
        size = dataset["status"].size
        console.print(f"{undone} of {pluralize(size, 'cell')} not computed yet", style="red")
    failed, commands = failures_table(dataset, file)
    table_layout.print_piece(failed)
    if commands and file:
        console.print("each alone, in one process:")
        for command in commands:
            console.print(f"  {command}", soft_wrap=True)
    return FAILED if undone or commands else OK


def print_outcome(
    scene: Scene, ending: Outcome, there: xr.Dataset, warned: Sequence[str] = ()
) -> int:
    """Print one cell: warnings, its scene, its numbers beside those of its file, and how it ended;
    of an array how many values it has, and their range.
    """
    for text in warned:
        console.print(text, style="yellow")
    console.print(f"{format_fields(scene.as_dict())}\n")
    rows = []
    for name, value in ending.values.items():
        same = np.array_equal(value, there[name], equal_nan=True)
        rows.append(
            {
                "number": name,
                "now": _format_array(value),
                "in the file": "same" if same else _format_array(there[name]),
            }
        )
    table_layout.print_piece(Table(rows))
    text = f"{ending.status.label}{': ' * bool(ending.message)}{ending.message}"
    console.print(f"{text} ({ending.rhs_evaluations:,} right-hand sides)")
    return OK if ending.status.is_answer else FAILED


def _format_array(value: Any) -> str:
    """A number with all its digits, or how many there are and their range."""
    finite = np.asarray(value, dtype=float)[np.isfinite(np.asarray(value, dtype=float))]
    if not np.ndim(value) or not finite.size:
        return str(value)
    return f"{np.size(value)} values, {finite.min():.6g} to {finite.max():.6g}"


def write_figure(drawn: Figure, path: Path, style: str | None = None) -> None:
    """Write a figure into a file, which `DataError` names where it cannot be written."""
    from rsfstudy.plots import render_figure, style_context, write_image

    try:
        with style_context(style):
            write_image(render_figure(drawn, path.suffix[1:]), path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error})") from error


# ---- verdicts -----------------------------------------------------------------------------------


def print_checks(datasets: Sequence[xr.Dataset], named: Sequence[str] = ()) -> int:
    """Print the claims and the failed cells of studies; FAILED where a verdict is not the expected
    one, a cell failed, or what was to be checked could not be.

    Parameters
    ----------
    datasets : sequence of xarray.Dataset
    named : sequence of str
        Identifiers of claims; all of them must then apply. Else one of all claims must.
    """
    found = _collect_claims(datasets)
    for claim in named:
        if claim not in (choices := list(dict.fromkeys(found["id"]))):
            raise InvalidValue("--claim", claim, "is no claim of these results", choices=choices)
    found = found[found["id"].isin(named)] if named else found
    others = found["id"][found["verdict"] == NOT_APPLICABLE]
    status = max(_print_verdicts(found), *map(print_failures, datasets))
    if len(others) and (named or len(others) == len(found)):
        which = ", ".join(dict.fromkeys(others))
        console.print(
            f"not checked, because they do not apply to these results: {which}", style="red"
        )
        return FAILED
    return status


def _collect_claims(datasets: Sequence[xr.Dataset]) -> pd.DataFrame:
    """The claims of a study, under what is not as it declares; or those of several studies in the
    order of their identifiers.
    """
    if len(datasets) == 1:
        about = datasets[0].attrs
        console.print(f"{about['id']} ({about['completeness']})", style="bold")
        if overrides := read_declaration(datasets[0]).overrides:
            console.print(f"not as declared: {format_overrides(overrides)}")
        return check(datasets[0])
    frames = [check(dataset).assign(study=dataset.attrs["id"]) for dataset in datasets]
    together = pd.concat(frames)
    number = together["id"].astype(str).str.extract(r"(\d+)", expand=False).astype(float)
    return together.assign(number=number).sort_values("number", kind="stable")


def _print_verdicts(found: pd.DataFrame) -> int:
    """Print claims and how many were checked; FAILED where a verdict is not the expected one."""
    checked = int((found["verdict"] != NOT_APPLICABLE).sum())
    if checked:
        table_layout.print_piece(claims_table(found))
    status = _print_unexpected_verdicts(found)
    line = f"{checked} of {pluralize(len(found), 'claim')} checked: {count_verdicts(found)}"
    console.print(line if len(found) else "no claims")
    return status


def _print_unexpected_verdicts(found: pd.DataFrame) -> int:
    """Print the verdicts that are not the expected ones; FAILED if there are any."""
    others = found[found["moved"]]
    for row in others.itertuples(index=False):
        console.print(f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red")
    return FAILED if len(others) else OK


# ---- two results --------------------------------------------------------------------------------


def print_agreement(frame: pd.DataFrame) -> int:
    """Print how a rerun agrees with its file; returns FAILED where a number is not the same."""
    for name, (theirs, ours) in frame.attrs["differs"].items():
        console.print(f"{name}: {theirs} then, {ours} now", style="yellow")
    _print_agreement_table(frame)
    if not frame["values"].sum():
        console.print("nothing to compare: no cell of the file is finished")
        return FAILED
    same = bool((frame["values"] == frame["identical"]).all())
    console.print("every number is the same" if same else "not every number is the same")
    return OK if same else FAILED


def print_comparison(
    files: Sequence[Path], datasets: Sequence[xr.Dataset], found: Comparison
) -> int:
    """Print how two results files compare; FAILED where a number or a status differs beyond the
    error estimates, or there is nothing to compare.
    """
    for letter, file, dataset in zip("AB", files, datasets, strict=True):
        about = read_provenance(dataset)
        console.print(f"{letter}: {file}, {about['time']}, {about['command']}")
    for title, pairs in (("declaration", found.declaration), ("made by", found.origin)):
        heads = f"{title} differs", "A", "B"
        rows = [
            (n, *(shorten(format_value(v), _MAX_VALUE_CHARACTERS) for v in ab))
            for n, ab in pairs.items()
        ]
        table_layout.print_piece(
            Table([dict(zip(heads, row, strict=True)) for row in rows], wrappable=heads)
        )
    both, first, second = found.cells
    console.print(f"{pluralize(both, 'cell')} in both, {first:,} only in A, {second:,} only in B")
    for axis, alone in found.points.items():
        for letter, points in zip("AB", alone, strict=True):
            if points:
                console.print(f"{axis} only in {letter} ({len(points)}): {format_list(points)}")
    _print_differing_statuses(found.statuses)
    differs = found.numbers["identical"] < found.numbers["values"]
    is_result = found.numbers["variable"].map(coverage_content_type) == "modelResult"
    _print_agreement_table(
        found.numbers[is_result & (differs | found.numbers["beyond_errors"].notna())]
    )
    for why in dict.fromkeys(found.left_out.values()):
        names = [name for name, reason in found.left_out.items() if reason == why]
        console.print(f"not compared, because {why}: {', '.join(names)}")
    wrong = [f"{name} differs beyond error estimates" for name in found.beyond_errors]
    wrong += [f"{pluralize(len(found.statuses), 'cell')} ended otherwise"] * bool(
        len(found.statuses)
    )
    verdict = "; ".join(wrong) or "nothing differs beyond error estimates"
    if not both:
        verdict = "nothing to compare: no finished cell is in both"
    console.print(verdict, style="green" if found.agrees else "red")
    return OK if found.agrees else FAILED


def _print_differing_statuses(statuses: pd.DataFrame) -> None:
    """Print the cells that ended otherwise."""
    first = statuses[:_MAX_DIFFERING_CELLS]
    places = first.drop(columns=["first", "second"]).to_dict("records")
    rows = [
        {"cell": format_fields({str(name): value for name, value in place.items()}), "A": a, "B": b}
        for place, a, b in zip(places, first["first"], first["second"], strict=True)
    ]
    table_layout.print_piece(Table(rows, wrappable={"cell"}))
    if len(statuses) > _MAX_DIFFERING_CELLS:
        console.print(f"and {len(statuses) - _MAX_DIFFERING_CELLS} more")


def _print_agreement_table(frame: pd.DataFrame) -> None:
    """Print how many numbers are the same, or differ beyond both error estimates."""
    rows = [
        {
            "variable": row["variable"],
            "values": str(row["values"]),
            "identical": str(row["identical"]),
            "beyond errors": format_number(row["beyond_errors"], ".0f"),
            "largest difference": format_number(row["largest_difference"], ".3g"),
        }
        for row in frame.to_dict("records")
    ]
    table_layout.print_piece(Table(rows))


def contents_table(dataset: xr.Dataset) -> Table:
    """The results that a file holds, what they are and along what."""
    rows = [
        {
            "it holds": str(name),  # what a notebook added may have no words
            "what": f"{v.attrs.get('long_name', '')} ({', '.join(map(str, v.dims))})".strip(),
        }
        for name, v in dataset.data_vars.items()
        if coverage_content_type(str(name)) == "modelResult"
    ]
    return Table(rows, wrappable={"what"})
