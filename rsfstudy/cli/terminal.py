"""What commands print: studies, how runs end, results, verdicts, and how two results compare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.api import fit_results, runs, summaries, tables
from rsfstudy.api.tables import Table
from rsfstudy.cli import cost, layout
from rsfstudy.cli.console import console, stderr
from rsfstudy.compute.plan import Plan
from rsfstudy.declare.claims import NOT_APPLICABLE
from rsfstudy.declare.study import Study
from rsfstudy.errors import DataError, InvalidValue, brief
from rsfstudy.files import contents
from rsfstudy.files.comparison import Comparison
from rsfstudy.measures import Outcome
from rsfstudy.motion.accuracy import DEFAULT_RTOL
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import coverage
from rsfstudy.wording import counted, listed, settings, short, stated

if TYPE_CHECKING:
    from rsfstudy.plots import Figure

OK, FAILED = 0, 1
#: Most points of an axis, and most cells that ended otherwise; most characters of a value.
_MOST_POINTS, _MOST_ENDS, _MOST_CHARACTERS = 40, 10, 60


def declaration(study: Study, output: Path) -> None:
    """Print a study: its axes, what is fixed and measured, its cells and what they cost, by what is
    kept in a directory of results.
    """
    console.print(f"{study.name}: {study.title}\n", style="bold")
    if study.summary:
        console.print(study.summary + "\n")
    varied = {field for axis in study.axes for field in axis.fields}
    if study.rig:
        varied |= {name for name, (dims, _values) in study.rig.beside().items() if dims}
    rig = study.laboratory.as_dict() if study.laboratory else {}
    measured = {n: v for n, v in study.measure.describe().items() if n not in varied}
    measured |= {n: f"{len(v)} of them" for n, v in measured.items() if isinstance(v, tuple | list)}
    gives = study.measure.variables
    with_errors = {n: " (with its error)" * (f"{n}_error" in gives) for n in gives}
    plan = Plan(study)
    different = len(plan.different)
    others = f", of which {different:,} differ" if different < study.size else ""
    costs = filter(None, (cost.in_words(plan, output), cost.faster(plan, output)))
    about = {
        **{f"axis {axis.dimension} ({len(axis)})": _points(axis.points) for axis in study.axes},
        **tables.given("fixed", study.base.as_dict(), rig, varied),
        "measure": ", ".join(f"{n} = {v}" for n, v in measured.items()),
        "gives": ", ".join(f"{n}{w}" for n, w in with_errors.items() if not n.endswith("_error")),
        "reduced to": ", ".join(r.describe()["name"] for r in study.reductions),
        "claims": ", ".join(dict.fromkeys(c.id for c in study.claims)),
        "cells": f"{study.size:,}{others}",
        "cost": "; ".join(costs),
    }
    layout.show({name: text or "-" for name, text in about.items()})


def _points(points: Sequence[str]) -> str:
    """The points of an axis, without the middle where they are many."""
    return ", ".join(points if len(points) <= _MOST_POINTS else [*points[:10], "...", *points[-3:]])


def announce(study: Study, output: Path, accuracy: bool, advice: bool) -> None:
    """Print what a run at another accuracy will cost, and what would be faster."""
    plan = Plan(study)
    if accuracy:
        ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_work
        words = f"{study.name}: {ratio:.2g} times the work of rtol {DEFAULT_RTOL:g}"
        console.print(f"{words}, {cost.in_words(plan, output)}")
    if advice and (text := cost.faster(plan, output)):
        stderr.print(f"note: {text}")


# ---- how runs end -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ended:
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


def ended(dataset: xr.Dataset, name: str, seconds: float, drawn: bool) -> Ended:
    """End of a run, in few words."""
    verdicts, wrong = tables.ended(dataset, runs.check(dataset))
    text = ", ".join([*wrong, *["no figure"] * (not drawn)])
    colour = "red" if text else "green"
    return Ended(name, cost.clock(seconds), text or "ok", verdicts or "-", colour)


def report(dataset: xr.Dataset, end: Ended, files: Sequence[Path]) -> None:
    """Print what a run ends with: slopes, claims, failures and where the files are."""
    for table in tables.reductions(dataset):
        layout.show(table)
    for name, why in tables.unreduced(dataset).items():
        console.print(f"no {name}: {why}")
    if slow := tables.slow_norm(dataset):
        console.print(slow, style="yellow")
    _verdicts(_claims([dataset]))
    failures(dataset, str(files[0]))
    console.print(f"{end.study}: {tables.tally(dataset)}")
    console.print(f"wrote {' and '.join(map(str, files))}", soft_wrap=True)


def in_short(dataset: xr.Dataset, end: Ended, files: Sequence[Path]) -> None:
    """Print what one of many runs ends with: as much as `report`, in a line for each table, but for
    verdicts that have moved and cells that failed.
    """
    console.print(f"{end.study}: {dataset.attrs['title']}", style="bold", soft_wrap=True)
    overrides = contents.declaration(dataset).overrides
    for line in (
        *([f"not as declared: {settings(overrides)}"] if overrides else []),
        *tables.in_short(dataset),
        f"claims: {end.verdicts}",
        f"in {end.time}, wrote {' and '.join(map(str, files))}",
    ):
        console.print(f"  {line}", soft_wrap=True)
    _moved(runs.check(dataset))
    failures(dataset, str(files[0]))


def summary(ends: Sequence[Ended]) -> None:
    """Print how several runs ended."""
    rows = [{n: getattr(end, n) for n in ("study", "time", "verdicts", "status")} for end in ends]
    colours = [end.colour for end in ends]
    layout.show(Table(rows, prose={"verdicts", "status"}, colours=colours))


# ---- results ------------------------------------------------------------------------------------


def results(dataset: xr.Dataset, file: str) -> int:
    """Print what a file holds, whatever it is of, and where it comes from; FAILED where cells, fits
    or a motion failed.
    """
    title = dataset.attrs.get("title", "answer for one scene")
    name = f"{dataset.attrs['id']}: " if "id" in dataset.attrs else ""
    console.print(f"{name}{title}\n", style="bold")
    layout.show(summaries.origin(dataset))
    for piece in summaries.numbers(dataset):
        layout.show(piece)
    if not contents.is_of_a_scene(dataset) and not fit_results.is_fit(dataset):
        layout.show(tables.held(dataset))
        return failures(dataset, file)
    return status_of(dataset)


def status_of(dataset: xr.Dataset) -> int:
    """OK where every fit has numbers, or a motion ended as asked."""
    if fit_results.is_fit(dataset):
        return OK if fit_results.answered(dataset) else FAILED
    return OK if dataset.attrs["status"] == Status.OK.label else FAILED


def failures(dataset: xr.Dataset, file: str = "") -> int:
    """Print the cells that failed, and how to reproduce one alone; FAILED if there are any."""
    if undone := tables.undone(dataset):
        size = dataset["status"].size
        console.print(f"{undone} of {counted(size, 'cell')} not computed yet", style="red")
    failed, places = tables.failures(dataset)
    layout.show(failed)
    if places and file:
        console.print("each alone, in one process:")
        for place in places:
            console.print(f"  {tables.reproducing(dataset, file, place)}", soft_wrap=True)
    return FAILED if undone or places else OK


def outcome(scene: Scene, ending: Outcome, there: xr.Dataset, warned: Sequence[str] = ()) -> int:
    """Print one cell: warnings, its scene, its numbers beside those of its file, and how it ended;
    of an array how many values it has, and their range.
    """
    for text in warned:
        console.print(text, style="yellow")
    console.print(f"{stated(scene.as_dict())}\n")
    rows = []
    for name, value in ending.values.items():
        same = np.array_equal(value, there[name], equal_nan=True)
        rows.append(
            {
                "number": name,
                "now": _brief(value),
                "in the file": "same" if same else _brief(there[name]),
            }
        )
    layout.show(Table(rows))
    text = f"{ending.status.label}{': ' * bool(ending.message)}{ending.message}"
    console.print(f"{text} ({ending.rhs_evaluations:,} right-hand sides)")
    return OK if ending.status.is_answer else FAILED


def _brief(value: Any) -> str:
    """A number with all its digits, or how many there are and their range."""
    finite = np.asarray(value, dtype=float)[np.isfinite(np.asarray(value, dtype=float))]
    if not np.ndim(value) or not finite.size:
        return str(value)
    return f"{np.size(value)} values, {finite.min():.6g} to {finite.max():.6g}"


def write_figure(drawn: Figure, path: Path, style: str | None = None) -> None:
    """Write a figure into a file, which `DataError` names where it cannot be written."""
    from rsfstudy.plots import rendered, styled, write_image

    try:
        with styled(style):
            write_image(rendered(drawn, path.suffix[1:]), path)
    except OSError as error:
        raise DataError(f"{path}: cannot be written ({error})") from error


# ---- verdicts -----------------------------------------------------------------------------------


def checked(datasets: Sequence[xr.Dataset], named: Sequence[str] = ()) -> int:
    """Print the claims and the failed cells of studies; FAILED where a verdict is not the expected
    one, a cell failed, or what was to be checked could not be.

    Parameters
    ----------
    datasets : sequence of xarray.Dataset
    named : sequence of str
        Identifiers of claims; all of them must then apply. Else one of all claims must.
    """
    found = _claims(datasets)
    for claim in named:
        if claim not in (choices := list(dict.fromkeys(found["id"]))):
            raise InvalidValue("--claim", claim, "is no claim of these results", choices=choices)
    found = found[found["id"].isin(named)] if named else found
    others = found["id"][found["verdict"] == NOT_APPLICABLE]
    status = max(_verdicts(found), *map(failures, datasets))
    if len(others) and (named or len(others) == len(found)):
        which = ", ".join(dict.fromkeys(others))
        console.print(
            f"not checked, because they do not apply to these results: {which}", style="red"
        )
        return FAILED
    return status


def _claims(datasets: Sequence[xr.Dataset]) -> pd.DataFrame:
    """The claims of a study, under what is not as it declares; or those of several studies in the
    order of their identifiers.
    """
    if len(datasets) == 1:
        about = datasets[0].attrs
        console.print(f"{about['id']} ({about['completeness']})", style="bold")
        if overrides := contents.declaration(datasets[0]).overrides:
            console.print(f"not as declared: {settings(overrides)}")
        return runs.check(datasets[0])
    frames = [runs.check(dataset).assign(study=dataset.attrs["id"]) for dataset in datasets]
    together = pd.concat(frames)
    number = together["id"].astype(str).str.extract(r"(\d+)", expand=False).astype(float)
    return together.assign(number=number).sort_values("number", kind="stable")


def _verdicts(found: pd.DataFrame) -> int:
    """Print claims and how many were checked; FAILED where a verdict is not the expected one."""
    checked = int((found["verdict"] != NOT_APPLICABLE).sum())
    if checked:
        layout.show(tables.claims(found))
    status = _moved(found)
    line = f"{checked} of {counted(len(found), 'claim')} checked: {tables.verdicts_of(found)}"
    console.print(line if len(found) else "no claims")
    return status


def _moved(found: pd.DataFrame) -> int:
    """Print the verdicts that are not the expected ones; FAILED if there are any."""
    others = found[found["moved"]]
    for row in others.itertuples(index=False):
        console.print(f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red")
    return FAILED if len(others) else OK


# ---- two results --------------------------------------------------------------------------------


def agreement(frame: pd.DataFrame) -> int:
    """Print how a rerun agrees with its file; returns FAILED where a number is not the same."""
    for name, (theirs, ours) in frame.attrs["differs"].items():
        console.print(f"{name}: {theirs} then, {ours} now", style="yellow")
    _numbers(frame)
    if not frame["values"].sum():
        console.print("nothing to compare: no cell of the file is finished")
        return FAILED
    same = bool((frame["values"] == frame["identical"]).all())
    console.print("every number is the same" if same else "not every number is the same")
    return OK if same else FAILED


def comparison(files: Sequence[Path], datasets: Sequence[xr.Dataset], found: Comparison) -> int:
    """Print how two results files compare; FAILED where a number or a status differs beyond the
    error estimates, or there is nothing to compare.
    """
    for letter, file, dataset in zip("AB", files, datasets, strict=True):
        about = contents.provenance(dataset)
        console.print(f"{letter}: {file}, {about['time']}, {about['command']}")
    for title, pairs in (("declaration", found.declaration), ("made by", found.origin)):
        heads = f"{title} differs", "A", "B"
        rows = [(n, *(brief(short(v), _MOST_CHARACTERS) for v in ab)) for n, ab in pairs.items()]
        layout.show(Table([dict(zip(heads, row, strict=True)) for row in rows], prose=heads))
    both, first, second = found.cells
    console.print(f"{counted(both, 'cell')} in both, {first:,} only in A, {second:,} only in B")
    for axis, alone in found.points.items():
        for letter, points in zip("AB", alone, strict=True):
            if points:
                console.print(f"{axis} only in {letter} ({len(points)}): {listed(points)}")
    _ends(found.statuses)
    differs = found.numbers["identical"] < found.numbers["values"]
    is_result = found.numbers["variable"].map(coverage) == "modelResult"
    _numbers(found.numbers[is_result & (differs | found.numbers["beyond_errors"].notna())])
    for why in dict.fromkeys(found.left_out.values()):
        names = [name for name, reason in found.left_out.items() if reason == why]
        console.print(f"not compared, because {why}: {', '.join(names)}")
    wrong = [f"{name} differs beyond error estimates" for name in found.beyond_errors]
    wrong += [f"{counted(len(found.statuses), 'cell')} ended otherwise"] * bool(len(found.statuses))
    verdict = "; ".join(wrong) or "nothing differs beyond error estimates"
    if not both:
        verdict = "nothing to compare: no finished cell is in both"
    console.print(verdict, style="green" if found.agrees else "red")
    return OK if found.agrees else FAILED


def _ends(statuses: pd.DataFrame) -> None:
    """Print the cells that ended otherwise."""
    first = statuses[:_MOST_ENDS]
    places = first.drop(columns=["first", "second"]).to_dict("records")
    rows = [
        {"cell": stated({str(name): value for name, value in place.items()}), "A": a, "B": b}
        for place, a, b in zip(places, first["first"], first["second"], strict=True)
    ]
    layout.show(Table(rows, prose={"cell"}))
    if len(statuses) > _MOST_ENDS:
        console.print(f"and {len(statuses) - _MOST_ENDS} more")


def _numbers(frame: pd.DataFrame) -> None:
    """Print how many numbers are the same, or differ beyond both error estimates."""
    rows = [
        {
            "variable": row["variable"],
            "values": str(row["values"]),
            "identical": str(row["identical"]),
            "beyond errors": tables.number(row["beyond_errors"], ".0f"),
            "largest difference": tables.number(row["largest_difference"], ".3g"),
        }
        for row in frame.to_dict("records")
    ]
    layout.show(Table(rows))
