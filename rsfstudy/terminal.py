"""What commands print: tables of slopes, claims and failed cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from rich.console import Console
from rich.table import Column, Table

from rsfstudy import api, runner, store
from rsfstudy.claims import NOT_APPLICABLE
from rsfstudy.status import Status

OK, FAILED = 0, 1

console = Console()


def report(dataset: xr.Dataset, name: str, output: Path) -> int:
    """What a run ends with: slopes, claims, failures and where the files are."""
    _reductions(dataset)
    _costs(dataset)
    moved = claims(dataset)
    failed = failures(dataset)
    work = int(dataset["rhs_evaluations"].sum())
    tally = ", ".join(f"{count} {label}" for label, count in runner.counts(dataset).items())
    console.print(f"{name}: {tally}; {work:,} right-hand sides", highlight=False)
    console.print(f"wrote {output / name}.nc and {output / name}.png", highlight=False)
    return max(moved, failed)


def _reductions(dataset: xr.Dataset) -> None:
    """Slopes and their like: variables with a standard error, one row for each point of their
    dimensions.
    """
    for slope in [str(n) for n in dataset.data_vars if f"{n}_stderr" in dataset]:
        frame = dataset[[slope, f"{slope}_stderr", f"{slope}_misfit", f"{slope}_points"]]
        rows = frame.to_dataframe().reset_index()
        columns = [*dataset[slope].dims, slope, "standard error", "largest misfit", "points"]
        table = Table(
            *map(str, columns), title=dataset[slope].attrs["comment"], title_justify="left"
        )
        wanted = [
            *dataset[slope].dims,
            slope,
            f"{slope}_stderr",
            f"{slope}_misfit",
            f"{slope}_points",
        ]
        for row in rows[wanted].itertuples(index=False):
            table.add_row(*(short(value) for value in row))
        console.print(table)


def _costs(dataset: xr.Dataset) -> None:
    """Where integrators were compared: the cheapest for each number of digits."""
    if "cheapest_integrator" not in dataset:
        return
    numbers = ("cheapest_work", "cheapest_default_work", "cheapest_default_request")
    frame = dataset[["cheapest_integrator", *numbers]].reset_coords(drop=True).to_dataframe()
    table = Table("", "digits", "cheapest", "its work", "work of the default", "rtol to ask for")
    for place, digits, name, least, work, request in frame.reset_index().itertuples(index=False):
        asked = f"{10.0**-request:.1g}"
        table.add_row(str(place), f"{digits:g}", name, f"{least:,.0f}", f"{work:,.0f}", asked)
    console.print(table)


def claims(dataset: xr.Dataset) -> int:
    """Print the claims; FAILED where a verdict is not the expected one."""
    table_of = api.check(dataset)
    overrides = store.declaration(dataset)["overrides"]
    console.print(f"[bold]{dataset.attrs['id']}[/bold] ({dataset.attrs['completeness']})")
    if overrides:
        console.print(f"not as declared: {_settings(overrides)}", highlight=False, markup=False)
    if (table_of.empty or table_of["verdict"].eq(NOT_APPLICABLE).all()) and not _undone(dataset):
        console.print("no claim applies")
        return OK
    return OK if table_of.empty else _table(table_of)


def all_claims(datasets: Sequence[xr.Dataset]) -> int:
    """Print the claims of several studies in one table, in the order of their identifiers."""
    frames = [api.check(dataset).assign(study=dataset.attrs["id"]) for dataset in datasets]
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


def _settings(overrides: Mapping[str, Any]) -> str:
    texts = {
        name: ",".join(map(short, value)) if isinstance(value, list) else short(value)
        for name, value in overrides.items()
    }
    return ", ".join(f"{name}={text}" for name, text in texts.items())


def _undone(dataset: xr.Dataset) -> int:
    """Number of cells that are not computed yet."""
    return int((dataset["status"] == int(Status.PENDING)).sum())


def _claim_row(row: Any) -> tuple[str, ...]:
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
        f"[{colour}]{row.verdict}[/{colour}]",
    )


def failures(dataset: xr.Dataset) -> int:
    """Print the cells that failed; FAILED if there are any."""
    if _undone(dataset):
        size = dataset["status"].size
        console.print(f"{_undone(dataset)} of {size} cells are not computed yet", style="red")
    failed = dataset["status"] >= int(Status.WORK_BUDGET_SPENT)
    if not bool(failed.any()):
        return OK
    failed = failed & (dataset["status"] != int(Status.PENDING))
    if not bool(failed.any()):
        return FAILED
    table = Table("cell", "status", "message", title=f"{int(failed.sum())} cells failed")
    labels = {int(s): s.label for s in Status}
    for index in np.argwhere(failed.values)[:20]:
        cell = dataset[["status", "message"]].isel(dict(zip(failed.dims, index, strict=True)))
        place = ", ".join(f"{d} = {short(cell[d].item())}" for d in map(str, failed.dims))
        table.add_row(place, labels[int(cell["status"])], str(cell["message"].item()))
    console.print(table)
    return FAILED


def short(value: Any) -> str:
    """A value with the digits a reader wants."""
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)
