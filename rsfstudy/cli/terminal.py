"""Tables that commands print: of slopes, claims and failed cells."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from rich import box
from rich.table import Column, Table
from rich.text import Text

from rsfstudy.api import runs
from rsfstudy.cli import cost, terminal_numbers
from rsfstudy.cli.console import console
from rsfstudy.compute import runner
from rsfstudy.compute.plan import Plan, estimated_cost
from rsfstudy.declare.claims import NOT_APPLICABLE
from rsfstudy.declare.study import Study
from rsfstudy.declare.wording import settings, short
from rsfstudy.files import contents
from rsfstudy.measures import Outcome
from rsfstudy.motion.accuracy import DEFAULT_RTOL
from rsfstudy.rig.quantities import STATED
from rsfstudy.rig.scales import in_units_of_rig
from rsfstudy.slider.scene import Scene
from rsfstudy.status import Status
from rsfstudy.vocabulary import coverage

OK, FAILED = 0, 1
_MOST_SHOWN = 40
#: Characters of a number, as `short` writes it.
_A_NUMBER = 10
#: What is told of a slope, by the ends of names: headings and formats.
_OF_SLOPES = {
    "stderr": ("standard error", ".2g"),
    "misfit": ("largest misfit", ".2g"),
    "points": ("points", ".0f"),
    "error": ("numerical error", ".2g"),
}


def declaration(study: Study, output: Path) -> None:
    """Print a study: its axes, what is fixed and measured, its cells and what they cost, by what is
    kept in a directory of results.
    """
    console.print(f"{study.name}: {study.title}\n", style="bold")
    if study.summary:
        console.print(study.summary + "\n")
    table = Table("", "", box=None, show_header=False)
    for axis in study.axes:
        points = axis.points
        if len(points) > _MOST_SHOWN:
            points = [*points[:10], "...", *points[-3:]]
        table.add_row(f"axis {axis.dimension} ({len(axis)})", ", ".join(points))
    varied = {field for axis in study.axes for field in axis.fields}
    if study.rig:
        varied |= {name for name, (dims, _values) in study.rig.beside().items() if dims}
    fixed = {n: v for n, v in study.base.as_dict().items() if n not in varied and v is not None}
    table.add_row("fixed", ", ".join(f"{n} = {short(v)}" for n, v in fixed.items() if v))
    table.add_row("0 or absent", ", ".join(n for n, v in fixed.items() if not v) or "-")
    if study.laboratory:
        rig = {n: f"{v:g} {STATED[n][0]}" for n, v in study.laboratory.as_dict().items()}
        table.add_row("laboratory", ", ".join(f"{n} = {v}" for n, v in rig.items()))
    about = {n: v for n, v in study.measure.describe().items() if n not in varied}
    table.add_row("measure", ", ".join(f"{n} = {_brief(v)}" for n, v in about.items()))
    gives = study.measure.variables
    with_errors = {n: " (with its error)" * (f"{n}_error" in gives) for n in gives}
    told = [f"{n}{words}" for n, words in with_errors.items() if not n.endswith("_error")]
    table.add_row("gives", ", ".join(told))
    table.add_row("reduced to", ", ".join(r.describe()["name"] for r in study.reductions) or "-")
    table.add_row("claims", ", ".join(dict.fromkeys(c.id for c in study.claims)) or "-")
    plan = Plan(study)
    different = len(plan.different)
    others = f", of which {different:,} differ" if different < study.size else ""
    table.add_row("cells", f"{study.size:,}{others}")
    table.add_row("cost", cost.in_words(plan, output))
    console.print(table)


def _brief(value: Any) -> str:
    """A field of a measure; of a list of whole problems, how many they are."""
    return f"{len(value)} of them" if isinstance(value, tuple | list) else str(value)


def announce(study: Study) -> None:
    """Print what a run at this accuracy will cost, before it starts."""
    work, seconds = estimated_cost(Plan(study))
    ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_work
    console.print(
        f"{study.name} at rtol {study.accuracy.rtol:g}: {ratio:.2g} times "
        f"the work of rtol {DEFAULT_RTOL:g}, about {work:,} right-hand sides, "
        f"{cost.guessed(seconds)}",
    )


@dataclass(frozen=True)
class Ended:
    """End of the run of a study.

    Parameters
    ----------
    study : str
    seconds : float
        Time it took.
    wrong : str
        What went wrong; empty if nothing did.
    verdicts : str
        How many claims had which verdict.
    left_out : str
        Why it was not run, if it was left out.
    """

    study: str
    seconds: float
    wrong: str = ""
    verdicts: str = ""
    left_out: str = ""

    @property
    def is_fine(self) -> bool:
        """True where nothing is wrong."""
        return not self.wrong


def report(dataset: xr.Dataset, name: str, files: Sequence[Path]) -> None:
    """Print what a run ends with: slopes, claims, failures and where the files are."""
    _reductions(dataset)
    _costs(dataset)
    claims(dataset)
    failures(dataset, str(files[0]))
    console.print(f"{name}: {_tally(dataset)}")
    console.print(f"wrote {' and '.join(map(str, files))}", soft_wrap=True)


def ended(dataset: xr.Dataset, name: str, seconds: float, drawn: bool) -> Ended:
    """End of a run, in few words."""
    claimed = runs.check(dataset)
    wrong = [f"{count} {label}" for label, count in runner.failures(dataset).items()]
    verdicts = ""
    if len(claimed):
        wrong += [f"{claim} moved" for claim in dict.fromkeys(claimed["id"][claimed["moved"]])]
        verdicts = ", ".join(f"{n} {v}" for v, n in claimed["verdict"].value_counts().items())
    wrong += [] if drawn else ["no figure"]
    return Ended(name, seconds, ", ".join(wrong), verdicts)


def summary(ends: Sequence[Ended]) -> None:
    """Print how several runs ended."""
    table = Table("study", "status", Column("time", justify="right"), "verdicts")
    for end in ends:
        status = Text(end.wrong or "ok", style="green" if end.is_fine else "red")
        if end.left_out:
            status = Text(f"left out: {end.left_out.partition(' (')[0]}", style="yellow")
        table.add_row(end.study, status, cost.clock(end.seconds), end.verdicts or "-")
    console.print(table)


def _tally(dataset: xr.Dataset) -> str:
    work = int(dataset["rhs_evaluations"].sum())
    counts = ", ".join(f"{count} {label}" for label, count in runner.counts(dataset).items())
    return f"{counts}; {work:,} right-hand sides"


def results(dataset: xr.Dataset, file: str) -> int:
    """The numbers of a results file, where they come from, what else is in it, and which cells
    failed; FAILED if any did.
    """
    attrs, about = dataset.attrs, contents.provenance(dataset)
    console.print(f"{attrs['id']}: {attrs['title']}\n", style="bold")
    table = Table("", "", box=None, show_header=False)
    dims = dataset["status"].dims
    table.add_row("lattice", " x ".join(f"{dataset.sizes[d]} {d}" for d in dims))
    table.add_row("cells", f"{attrs['completeness']}; {_tally(dataset)}")
    if "reduced_despite" in attrs:
        table.add_row("reductions", attrs["reduced_despite"])
    table.add_row("made by", f"{about['command']}, {about['time']}")
    versions = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    table.add_row("with", f"{versions}; git {about['git']}; {about['machine']}")
    console.print(table)
    terminal_numbers.headline(dataset)
    _reductions(dataset)
    holds = Table(Column("it holds", overflow="fold"), "", box=None)
    for name, values in dataset.data_vars.items():
        if coverage(str(name)) == "modelResult":
            words = values.attrs.get("long_name", "")  # what a notebook added may have none
            holds.add_row(str(name), f"{words} ({', '.join(map(str, values.dims))})".strip())
    console.print(holds)
    return failures(dataset, file)


def outcome(scene: Scene, ending: Outcome, warned: Sequence[str] = ()) -> int:
    """Print one cell: warnings, its scene, its numbers and how it ended."""
    for text in warned:
        console.print(text, style="yellow")
    fields = {name: value for name, value in scene.as_dict().items() if value is not None}
    console.print(", ".join(f"{n} = {short(v)}" for n, v in fields.items()))
    for name, value in ending.values.items():
        console.print(f"{name} = {value!r}")
    text = f"{ending.status.label}{': ' * bool(ending.message)}{ending.message}"
    console.print(f"{text} ({ending.rhs_evaluations:,} right-hand sides)")
    return OK if ending.status.is_answer else FAILED


def agreement(frame: pd.DataFrame) -> int:
    """Print how a rerun agrees with its file; returns FAILED where a number is not the same."""
    for name, (theirs, ours) in frame.attrs["differs"].items():
        console.print(f"{name}: {theirs} then, {ours} now", style="yellow")
    table = Table("variable", "values", "identical", "largest difference", box=None)
    for row in frame.to_dict("records"):
        gap = row["largest_difference"]
        text = "-" if pd.isna(gap) else f"{gap:.3g}"
        table.add_row(row["variable"], str(row["values"]), str(row["identical"]), text)
    console.print(table)
    if not frame["values"].sum():
        console.print("nothing to compare: no cell of the file is finished")
        return FAILED
    same = bool((frame["values"] == frame["identical"]).all())
    console.print("every number is the same" if same else "not every number is the same")
    return OK if same else FAILED


def _reductions(dataset: xr.Dataset) -> None:
    """Slopes and their like: reductions with a standard error, one row for each point of their
    dimensions.
    """
    dataset = in_units_of_rig(dataset)
    for slope in (reduction["name"] for reduction in contents.declaration(dataset).reductions):
        if not {slope, f"{slope}_stderr"} <= set(dataset.data_vars):
            continue  # of another kind, or a notebook left it out
        told = {n: about for end, about in _OF_SLOPES.items() if (n := f"{slope}_{end}") in dataset}
        named = [terminal_numbers.with_units(dataset[n]) for n in (*dataset[slope].dims, slope)]
        places = [Column(name, overflow="fold") for name in named[:-1]]
        beside = [
            Column(heading, overflow="fold", min_width=len("1.0e-05"))
            for heading, _form in told.values()
        ]
        table = Table(
            *places,
            Column(named[-1], overflow="fold", min_width=_A_NUMBER),
            *beside,
            box=box.SIMPLE_HEAD,
            title=dataset[slope].attrs.get("comment", slope),
            title_justify="left",
        )
        frame = dataset[[slope, *told]].to_dataframe().reset_index()
        for row in frame[[*dataset[slope].dims, slope, *told]].itertuples(index=False):
            first = len(places) + 1
            forms = (form for _heading, form in told.values())
            table.add_row(*map(short, row[:first]), *map(format, row[first:], forms))
        console.print(table)


def _costs(dataset: xr.Dataset) -> None:
    """Print the cheapest integrator for each number of digits, where integrators were compared."""
    numbers = ("cheapest_work", "cheapest_default_work", "cheapest_default_request")
    if not {"cheapest_integrator", *numbers} <= set(dataset.data_vars):
        return
    frame = dataset[["cheapest_integrator", *numbers]].reset_coords(drop=True).to_dataframe()
    table = Table("", "digits", "cheapest", "its work", "work of the default", "rtol to ask for")
    for place, digits, name, least, work, request in frame.reset_index().itertuples(index=False):
        asked = f"{10.0**-request:.1g}"
        table.add_row(str(place), f"{digits:g}", name, f"{least:,.0f}", f"{work:,.0f}", asked)
    console.print(table)


def checked(dataset: xr.Dataset) -> int:
    """Print the claims and the failed cells; FAILED where a verdict is not the expected one, a cell
    failed, or none of the study's claims could be held against anything.
    """
    verdicts = runs.check(dataset)
    vacuous = len(verdicts) > 0 and bool(verdicts["verdict"].eq(NOT_APPLICABLE).all())
    status = max(claims(dataset), failures(dataset))
    if vacuous:
        console.print(f"nothing was checked: of {len(verdicts)} claims none applies", style="red")
    return FAILED if vacuous else status


def claims(dataset: xr.Dataset) -> int:
    """Print the claims; FAILED where a verdict is not the expected one."""
    table_of = runs.check(dataset)
    overrides = contents.declaration(dataset).overrides
    console.print(f"{dataset.attrs['id']} ({dataset.attrs['completeness']})", style="bold")
    if overrides:
        console.print(f"not as declared: {settings(overrides)}")
    if (table_of.empty or table_of["verdict"].eq(NOT_APPLICABLE).all()) and not _undone(dataset):
        console.print("no claim applies")
        return OK
    return OK if table_of.empty else _table(table_of)


def all_claims(datasets: Sequence[xr.Dataset]) -> int:
    """Print the claims of several studies in one table, in the order of their identifiers."""
    frames = [runs.check(dataset).assign(study=dataset.attrs["id"]) for dataset in datasets]
    together = pd.concat([frame for frame in frames if len(frame)] or [pd.DataFrame()])
    if together.empty:
        return OK
    number = together["id"].str.extract(r"(\d+)", expand=False).astype(float)
    ordered = together.assign(number=number).sort_values("number", kind="stable")
    status = _table(ordered)
    counts = ordered["verdict"].value_counts()
    console.print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    return status


def _table(claims: pd.DataFrame) -> int:
    """Print a table of verdicts; FAILED where one is not the expected one."""
    table = Table(
        "",
        Column("claim", ratio=3),
        Column("published", no_wrap=True),
        Column("ours", no_wrap=True),
        Column("tolerance, and why", ratio=4),
        Column("verdict", no_wrap=True),
        expand=True,
        padding=(0, 0),
    )
    for row in claims.itertuples(index=False):
        table.add_row(*_claim_row(row))
    console.print(table)
    moved = claims[claims["moved"]]
    for row in moved.itertuples(index=False):
        console.print(f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red")
    return FAILED if len(moved) else OK


def _undone(dataset: xr.Dataset) -> int:
    """Number of cells that are not computed yet."""
    return int((dataset["status"] == int(Status.PENDING)).sum())


def _claim_row(row: Any) -> tuple[str | Text, ...]:
    sign = {"equals": "", "below": "< ", "above": "> "}[row.relation]
    reason = f"{row.tolerance:g}: {row.reason}"
    if row.because:
        reason += f". It differs because {row.because}"
    colour = "red" if row.moved else "green" if row.verdict == "reproduced" else "yellow"
    return (
        row.id,
        f"{row.study}: {row.claim}" if hasattr(row, "study") else row.claim,
        f"{sign}{row.published:g}",
        "-" if pd.isna(row.ours) else f"{row.ours:.6g}",
        reason,
        Text(row.verdict, style=colour),
    )


def failures(dataset: xr.Dataset, file: str = "") -> int:
    """Print the cells that failed, and how to reproduce one alone; FAILED if there are any."""
    if _undone(dataset):
        size = dataset["status"].size
        console.print(f"{_undone(dataset)} of {size} cells are not computed yet", style="red")
    failed = dataset["status"] >= int(Status.WORK_BUDGET_SPENT)
    if not bool(failed.any()):
        return OK
    failed = failed & (dataset["status"] != int(Status.PENDING))
    if not bool(failed.any()):
        return FAILED
    many, shown = int(failed.sum()), 20
    table = Table("cell", "status", "message", title=f"{many} cells failed", title_justify="left")
    labels = {int(s): s.label for s in Status}
    commands = []
    for index in np.argwhere(failed.values)[:shown]:
        cell = dataset[["status", "message"]].isel(dict(zip(failed.dims, index, strict=True)))
        place = {str(d): cell[d].item() for d in failed.dims}
        text = ", ".join(f"{name} = {short(value)}" for name, value in place.items())
        table.add_row(text, labels[int(cell["status"])], str(cell["message"].item()))
        commands.append(_reproducing(dataset, file, place))
    console.print(table)
    if many > shown:
        console.print(f"and {many - shown} more")
    if file:
        console.print("each alone, in one process:")
        for command in commands:
            console.print(f"  {command}", soft_wrap=True)
    return FAILED


def _reproducing(dataset: xr.Dataset, file: str, place: Mapping[str, Any]) -> str:
    """The command that computes one cell alone."""
    words = ["rsfstudy", "rerun", file]
    declared_in = contents.provenance(dataset)["declared_in"]
    if declared_in:
        words += ["--study", declared_in]
    for name, value in place.items():
        words += ["--cell", f"{name}={value}"]
    return shlex.join(words)
