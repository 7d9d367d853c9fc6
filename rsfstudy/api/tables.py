"""Tables of results, as texts: what commands print, and what a report shows."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.compute import runner
from rsfstudy.declare import verdicts
from rsfstudy.declare.wording import listed, short, stated
from rsfstudy.files import contents, numbers
from rsfstudy.rig.scales import in_units_of_rig, renamed
from rsfstudy.status import LABELS, Status
from rsfstudy.vocabulary import coverage, quantity

#: Most cells of a lattice that are shown, and most that failed.
MOST_CELLS, _MOST_FAILURES = 24, 20
#: What is told of a slope, by the ends of names: headings and formats.
_OF_SLOPES = {
    "stderr": ("standard error", ".2g"),
    "misfit": ("largest misfit", ".2g"),
    "points": ("points", ".0f"),
    "error": ("numerical error", ".2g"),
}


@dataclass(frozen=True)
class Table:
    """Rows of texts under headings.

    Parameters
    ----------
    rows : sequence of mapping
        Each a row, by the headings.
    caption : str
        What it shows.
    prose : collection of str
        Headings of columns whose texts may be broken between words; no other is.
    colours : sequence of str
        Colour of the last cell of each row.
    """

    rows: Sequence[Mapping[str, str]]
    caption: str = ""
    prose: Collection[str] = ()
    colours: Sequence[str] = ()


def number(value: float, form: str = ".8g") -> str:
    """A number, or a dash where there is none."""
    return "-" if np.isnan(value) else format(value, form)


def units_of(values: xr.DataArray) -> str:
    """The units of values, or what those without units are measured in; "1" for numbers."""
    units = values.attrs.get("scale") or values.attrs.get("units", "1")
    return str(units).replace(" s-1", "/s")


def with_units(along: xr.DataArray) -> str:
    """The name of an axis, and its units where it is that of a rig."""
    name, units = str(along.name), along.attrs.get("units", "1")
    return name if units in ("1", quantity(name).units) else f"{name} ({units})"


def tally(dataset: xr.Dataset) -> str:
    """How many cells ended how, with what that means where none is ok, and their work."""
    work, counts = int(dataset["rhs_evaluations"].sum()), runner.counts(dataset)
    nothing = Status.OK.label not in counts
    told = ", ".join(
        f"{count} {label}" + f" ({Status[label.upper()].meaning})" * nothing
        for label, count in counts.items()
    )
    return f"{told}; {work:,} right-hand sides"


def origin(dataset: xr.Dataset) -> dict[str, str]:
    """What the results of a study are of, and where they come from, by what each is."""
    attrs, about = dataset.attrs, contents.provenance(dataset)
    dims = dataset["status"].dims
    reduced = attrs.get("reduced_despite")
    versions = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    return {
        "lattice": " x ".join(f"{dataset.sizes[d]} {d}" for d in dims),
        "cells": f"{attrs['completeness']}; {tally(dataset)}",
        **({"reductions": reduced} if reduced else {}),
        "made by": f"{about['command']}, {about['time']}",
        "with": f"{versions}; git {about['git']}; {about['machine']}",
    }


def headline(dataset: xr.Dataset) -> Table:
    """The headline along the axes, with its error estimate and how each cell ended; no row where
    there is none.
    """
    name = numbers.headline(dataset)
    if name is None:
        return Table([])
    dataset = in_units_of_rig(dataset)
    name = name if name in dataset else renamed(name)
    status, error = dataset["status"], f"{name}_error"
    dims = [str(d) for d in status.dims]
    at = numbers.sample({d: status.sizes[d] for d in dims}, MOST_CELLS)
    few = dataset[[n for n in (name, error, "status") if n in dataset]].isel(at)
    few = few.transpose(*dims).load()
    others = bool((few["status"] != int(Status.OK)).any())
    rows = []
    for index in np.ndindex(few["status"].shape):
        cell = few.isel(dict(zip(dims, index, strict=True)))
        row = {with_units(dataset[d]): short(cell[d].item()) for d in dims}
        row[name] = number(cell[name].item())
        if error in few:
            row["error"] = number(cell[error].item(), ".1e")
        if others:
            row["status"] = LABELS[int(cell["status"])]
        rows.append(row)
    units = units_of(dataset[name])
    caption = dataset[name].attrs.get("long_name", name) + f", in {units}" * (units != "1")
    if len(rows) < status.size:
        caption += f" ({len(rows)} of {status.size:,} cells)"
    return Table(rows, caption)


def in_short(dataset: xr.Dataset) -> list[str]:
    """The headline and the slopes in a line each, and how cells ended in another."""
    lines, converted = [], in_units_of_rig(dataset)
    if (name := numbers.headline(dataset)) is not None:
        values = converted[name if name in converted else renamed(name)]
        told = np.unique(values.values[np.isfinite(values.values)])
        least_and_most = " to ".join(
            short(value) for value in dict.fromkeys((*told[:1], *told[-1:]))
        )
        units = units_of(values)
        text = f"{values.name}: {least_and_most or 'no number'}"
        lines.append(text + f" {units}" * bool(least_and_most and units != "1"))
    slopes = {slope: converted[slope].values.ravel().tolist() for slope in _slopes(converted)}
    return [
        *lines,
        *(f"{n}: {listed(values, ', ')}" for n, values in slopes.items()),
        tally(dataset),
    ]


def reductions(dataset: xr.Dataset) -> Iterator[Table]:
    """Slopes and their like, those with a standard error, with one row for each point of their
    dimensions; and, where integrators were compared, the cheapest for each number of digits.
    """
    converted = in_units_of_rig(dataset)
    for slope in _slopes(converted):
        yield _slope(converted, slope)
    work = ("cheapest_work", "cheapest_default_work", "cheapest_default_request")
    if {"cheapest_integrator", *work} <= set(dataset.data_vars):
        frame = dataset[["cheapest_integrator", *work]].reset_coords(drop=True).to_dataframe()
        rows = [
            {
                "problem": str(place),
                "digits": f"{digits:g}",
                "cheapest": str(name),
                "its work": f"{least:,.0f}",
                "work of the default": f"{default:,.0f}",
                "rtol to ask for": f"{10.0**-request:.1g}",
            }
            for place, digits, name, least, default, request in (
                frame.reset_index().itertuples(index=False)
            )
        ]
        yield Table(rows, prose={"problem", "cheapest"})


def _slopes(dataset: xr.Dataset) -> list[str]:
    """Names of the reductions that have a standard error."""
    named = [reduction["name"] for reduction in contents.declaration(dataset).reductions]
    return [name for name in named if {name, f"{name}_stderr"} <= set(dataset.data_vars)]


def _slope(dataset: xr.Dataset, name: str) -> Table:
    slopes = dataset[name]
    told = {n: about for end, about in _OF_SLOPES.items() if (n := f"{name}_{end}") in dataset}
    rows = []
    for at in np.ndindex(slopes.shape):
        one = dataset[[name, *told]].isel(dict(zip(slopes.dims, at, strict=True)))
        row = {with_units(dataset[n]): short(one[n].item()) for n in (*slopes.dims, name)}
        rows.append(row | {head: format(one[n].item(), form) for n, (head, form) in told.items()})
    prose = {with_units(dataset[d]) for d in slopes.dims}
    return Table(rows, slopes.attrs.get("comment", name), prose)


def claims(frame: pd.DataFrame) -> Table:
    """Claims and their verdicts, as `rsfstudy.check` gives them, of one study or of several."""
    rows = frame.to_dict("records")
    colours = [
        "red" if row["moved"] else "green" if row["verdict"] == "reproduced" else "yellow"
        for row in rows
    ]
    return Table(
        [verdicts.told(row) for row in rows], prose={"claim", "tolerance, and why"}, colours=colours
    )


def ended(dataset: xr.Dataset, found: pd.DataFrame) -> tuple[str, list[str]]:
    """How many claims have which verdict, and what went wrong, in words."""
    wrong = [f"{count} {label}" for label, count in runner.failures(dataset).items()]
    if not len(found):
        return "", wrong
    wrong += [f"{claim} moved" for claim in dict.fromkeys(found["id"][found["moved"]])]
    return ", ".join(f"{n} {v}" for v, n in found["verdict"].value_counts().items()), wrong


def cells(dataset: xr.Dataset, where: xr.DataArray, axes: Sequence[str]) -> pd.DataFrame:
    """Some cells, one row each: their places on axes, how each ended, and the message."""
    at = where.values
    columns = {name: dataset[name].broadcast_like(where).values[at] for name in axes}
    columns["status"] = [LABELS[code] for code in dataset["status"].values[at].tolist()]
    return pd.DataFrame(columns | {"message": dataset["message"].values[at]})


def failures(dataset: xr.Dataset) -> tuple[Table, list[dict[Any, Any]]]:
    """The first cells that failed, and the place of each on the axes."""
    status = dataset["status"]
    failed = (status >= int(Status.WORK_BUDGET_SPENT)) & (status != int(Status.PENDING))
    found = cells(dataset, failed, list(map(str, failed.dims)))
    first = found[:_MOST_FAILURES]
    places: list[dict[Any, Any]] = first[list(failed.dims)].to_dict("records")
    rows = [
        {"cell": stated(place), "status": label, "message": message}
        for place, label, message in zip(places, first["status"], first["message"], strict=True)
    ]
    caption = f"{len(found)} cells failed"
    if len(found) > len(rows):
        caption += f", of which the first {len(rows)}"
    return Table(rows, caption, prose={"cell", "message"}), places


def reproducing(dataset: xr.Dataset, file: str, place: Mapping[str, Any]) -> str:
    """The command that computes one cell alone."""
    words = ["rsfstudy", "rerun", file]
    declared_in = contents.provenance(dataset)["declared_in"]
    if declared_in:
        words += ["--study", declared_in]
    for name, value in place.items():
        words += ["--cell", f"{name}={value}"]
    return shlex.join(words)


def undone(dataset: xr.Dataset) -> int:
    """Number of cells that are not computed yet."""
    return int((dataset["status"] == int(Status.PENDING)).sum())


def held(dataset: xr.Dataset) -> Table:
    """The results that a file holds, what they are and along what."""
    rows = [
        {
            "it holds": str(name),  # what a notebook added may have no words
            "what": f"{v.attrs.get('long_name', '')} ({', '.join(map(str, v.dims))})".strip(),
        }
        for name, v in dataset.data_vars.items()
        if coverage(str(name)) == "modelResult"
    ]
    return Table(rows, prose={"what"})
