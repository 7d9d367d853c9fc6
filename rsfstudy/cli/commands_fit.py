"""What the command `fit` does."""

from __future__ import annotations

import xarray as xr

from rsfstudy import plots
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.api import fitting, told
from rsfstudy.api.tables import Table
from rsfstudy.cli import assignments, commands_simulate, layout, terminal
from rsfstudy.cli.console import console
from rsfstudy.cli.options import Given
from rsfstudy.errors import InvalidValue
from rsfstudy.files import store
from rsfstudy.rig.records import read_record

#: Most steps of a record that are listed.
_MOST_STEPS = 24
#: Options that `rsfstudy.fit` takes as they are.
_TAKEN = ("stiffness", "slip_distance", "laws", "free", "together", "before", "after", "windows",
    "noise", "loading", "posterior", "budget", "engine")  # fmt: skip


def fit(given: Given) -> int:
    """Fit records, print the parameters, draw the fits and write them."""
    data = given.output.with_suffix(".nc")
    commands_simulate.check_replaceable(data, _is_fit, "fit")
    rule = "must read NAME=HEADING, as in 'time=t (s)'"
    columns = dict(assignments.named("--columns", text, rule) for text in given.columns) or None
    stress = given.normal_stress
    records = [read_record(path, columns, normal_stress=stress) for path in given.records]
    for record in records:
        _list_steps(record)
    dataset = fitting.fit(
        records,
        steps=[_number(text) for text in given.steps],
        command=given.command,
        **{name: getattr(given, name) for name in _TAKEN},
        **assignments.fields(given.settings),
    )
    dataset = store.write(dataset, data)
    plots.save(dataset, given.output)
    for piece in told.numbers(dataset):
        layout.show(piece)
    console.print(f"wrote {given.output} and {data}", soft_wrap=True)
    return terminal.status_of(dataset)


def _is_fit(there: xr.Dataset) -> bool:
    return "rows_fitted" in there and "declaration" in there.attrs


def _number(text: str) -> int:
    if not text.isdecimal():
        raise InvalidValue("--step", text, "must be a whole number, or several: 1,2")
    return int(text)


def _list_steps(record: Record) -> None:
    """Print the steps of a record."""
    console.print(f"{record.name}: {len(record):,} rows, {len(record.found)} steps")
    rows = [
        {
            "step": str(number),
            "time (s)": f"{step.begins:.6g}",
            "lasts (s)": f"{step.ends - step.begins:.6g}",
            "V0 (um/s)": f"{step.before:.6g}",
            "V1 (um/s)": f"{step.after:.6g}",
        }
        for number, step in enumerate(record.found[:_MOST_STEPS], start=1)
    ]
    layout.show(Table(rows))
    if (left := len(record.found) - _MOST_STEPS) > 0:
        console.print(f"and {left} more")
