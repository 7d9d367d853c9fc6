"""The command `fit`, and what `show` prints of its files; how it is spelt is in
`command_line_fit`.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

from rsfstudy import plots
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.api import fit_tables, fitting
from rsfstudy.api.tables import Table
from rsfstudy.cli import assignments, commands_simulate, layout, terminal
from rsfstudy.cli.console import console
from rsfstudy.errors import InvalidValue
from rsfstudy.files import contents, store
from rsfstudy.rig.records import read_record

#: Most steps of a record that are listed.
_MOST_STEPS = 24


def fit(
    records: Sequence[Path],
    columns: Sequence[str],
    normal_stress: str | None,
    steps: Sequence[str],
    settings: tuple[str, ...],
    output: Path,
    **given: Any,
) -> int:
    """Fit records, print the parameters, draw the fits and write them."""
    data = output.with_suffix(".nc")
    commands_simulate.check_replaceable(data, is_fit, "fit")
    named = _columns(columns)
    read = [read_record(path, named, normal_stress=normal_stress) for path in records]
    for record in read:
        _steps(record)
    dataset = fitting.fit(
        read,
        steps=[_number(text) for text in steps],
        command=shlex.join(["rsfstudy", *sys.argv[1:]]),
        **given,
        **assignments.fields(settings),
    )
    dataset = store.write(dataset, data)
    plots.save(dataset, output)
    status = tables(dataset)
    console.print(f"wrote {output} and {data}", soft_wrap=True)
    return status


def show(dataset: xr.Dataset) -> int:
    """Print the fits of a file, and where they come from."""
    about = contents.provenance(dataset)
    console.print(f"{dataset.attrs['title']}\n", style="bold")
    console.print(
        f"made by {about['command']}, {about['time']}, git {about['git']}\n", soft_wrap=True
    )
    return tables(dataset)


def is_fit(dataset: xr.Dataset) -> bool:
    """True for fits of records."""
    return "rows_fitted" in dataset and "declaration" in dataset.attrs


def _columns(texts: Sequence[str]) -> dict[str, str] | None:
    rule = "must read NAME=HEADING, as in 'time=t (s)'"
    return dict(assignments.named("--columns", text, rule) for text in texts) or None


def _number(text: str) -> int:
    if not text.isdecimal():
        raise InvalidValue("--step", text, "must be a whole number, or several: 1,2")
    return int(text)


def _steps(record: Record) -> None:
    """Print the steps of a record."""
    console.print(f"{record.name}: {len(record):,} rows, {len(record.found)} steps")
    heads = ("step", "time (s)", "lasts (s)", "V0 (um/s)", "V1 (um/s)")
    rows = []
    for number, step in enumerate(record.found[:_MOST_STEPS], start=1):
        values = step.begins, step.ends - step.begins, step.before, step.after
        rows.append(dict(zip(heads, (str(number), *(f"{v:.6g}" for v in values)), strict=True)))
    layout.show(Table(rows))
    if (left := len(record.found) - _MOST_STEPS) > 0:
        console.print(f"and {left} more")


def tables(dataset: xr.Dataset) -> int:
    """Print all fits; FAILED where one has no numbers that are verified."""
    for one in fit_tables.told(dataset):
        if isinstance(one, Table):
            layout.show(one)
        else:
            console.print(one)
    return terminal.OK if fit_tables.answered(dataset) else terminal.FAILED
