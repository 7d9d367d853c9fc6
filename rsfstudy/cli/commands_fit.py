"""The command `fit`, and what `show` prints of its files; how it is spelt is in
`command_line_fit`.
"""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy import plots
from rsfstudy.analysis.fitting.joint import plain
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.api import fit_results, fitting
from rsfstudy.api.tables import Table
from rsfstudy.cli import commands_simulate, layout, terminal
from rsfstudy.cli.console import console
from rsfstudy.errors import InvalidValue
from rsfstudy.files import contents, store
from rsfstudy.rig.records import read_record
from rsfstudy.status import Status

#: Most fits beside each other, and steps of a record that are listed.
_BESIDE, _MOST_STEPS = 3, 24
#: How fits end that have numbers.
_ANSWERS = (Status.OK.label, Status.NOT_IDENTIFIED.label)
#: Error over the number beyond which neither is printed.
_BOUNDLESS = 1e4
#: Chance below which residuals are called correlated.
_CHANCE = 0.01


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
    if output.suffix not in (".png", ".pdf", ".svg"):
        raise InvalidValue("--output", str(output), "must end in .png, .pdf or .svg")
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
        **commands_simulate.fields(settings),
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
    found = {}
    for text in texts:
        name, equals, heading = (part.strip() for part in text.partition("="))
        if not (name and equals and heading):
            rule = "must read NAME=HEADING, as in 'time=t (s)'"
            raise InvalidValue("--columns", text, rule)
        found[name] = heading
    return found or None


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
    if left := len(record.found) - _MOST_STEPS:
        console.print(f"and {left} more" if left > 0 else "", end="\n" * (left > 0))


# ---- tables ------------------------------------------------------------------------------------


def tables(dataset: xr.Dataset) -> int:
    """Print all fits, those of one step beside each other; FAILED where one has no numbers that
    are verified.
    """
    cells = fit_results.cells(dataset)
    places: dict[tuple[str, ...], list[xr.Dataset]] = {}
    for one in cells:
        where = tuple(f"{n} {value}" for n, value in fit_results.place(one).items())
        places.setdefault(where, []).append(one)
    measure: Any = contents.declaration(dataset).measure
    together = measure.get("together", ())
    for where, fits in places.items():
        if together:
            each = ", ".join(f"step {step} of {record}" for record, step in together)
            console.print(f"\ntogether: {each}; the window is that of the first")
        for first in range(0, len(fits), _BESIDE):
            _table(", ".join(where), fits[first : first + _BESIDE])
        for one in fits:
            _remarks(one)
    answers = [fit_results.status(one) in _ANSWERS for one in cells]
    return terminal.OK if all(answers) else terminal.FAILED


def _table(where: str, fits: Sequence[xr.Dataset]) -> None:
    told = [np.isfinite(one["rows_fitted"].item()) for one in fits]
    for line in (where, _window(fits[told.index(True)]) if any(told) else ""):
        if line:
            console.print(line)
    lines: dict[str, list[str]] = {}
    for name, (short, units) in fit_results.shown(fits[0]).items():
        lines[f"{short} ({units})" if units else short] = [with_error(one, name) for one in fits]
    for heading, of in {
        "R2": _explained,
        "criterion": _criterion,
        "noise": _noise,
        "worth": _worth,
    }.items():
        lines[heading] = [of(one) if has else "-" for one, has in zip(fits, told, strict=True)]
    lines["status"] = [fit_results.status(one) for one in fits]
    laws = [_law(one) for one in fits]
    layout.show(Table([
        {"parameter": heading, **dict(zip(laws, texts, strict=True))}
        for heading, texts in lines.items()
    ]))  # fmt: skip


def _window(one: xr.Dataset) -> str:
    """The step and the window of a fit."""
    speeds = (one[n].item() for n in ("velocity_before", "velocity_after"))
    ends = (one[n].item() for n in ("window_begins", "window_ends"))
    rows = int(one["rows_fitted"].item())
    return (
        f"{' to '.join(f'{v:.4g}' for v in speeds)} um/s, "
        f"fitted from {' to '.join(f'{x:.6g}' for x in ends)} um, {rows:,} rows"
    )


def with_error(one: xr.Dataset, name: str) -> str:
    """A number and its standard error, to two digits of the error."""
    value, error = one[name].item(), one[f"{name}_stderr"].item()
    if not math.isfinite(value):
        return "-"
    if error > _BOUNDLESS * abs(value) > 0.0:
        return "not told"
    if not (math.isfinite(error) and error > 0.0):
        return f"{value:.6g} +- {error:g}"
    digits = 1 - math.floor(math.log10(error))
    size = math.floor(math.log10(max(abs(value), error)))
    if -5 <= size < 6 and digits <= 9:
        digits = max(digits, 0)
        return f"{value:.{digits}f} +- {error:.{digits}f}"
    scale = 10.0**size
    digits = max(digits + size, 0)
    return f"({value / scale:.{digits}f} +- {error / scale:.{digits}f})e{size:+03d}"


def _law(one: xr.Dataset) -> str:
    return str(one["law"].item())


def _explained(one: xr.Dataset) -> str:
    return f"{one['r_squared'].item():.4f}"


def _criterion(one: xr.Dataset) -> str:
    return f"{one['criterion'].item():.1f}"


def _noise(one: xr.Dataset) -> str:
    order = int(one["noise_order"].item())
    process = f"AR({order})" if order else "white"
    return f"{process}, sd {one['noise_size'].item():.2g}"


def _worth(one: xr.Dataset) -> str:
    return f"{one['effective_samples'].item():,.0f} independent rows"


def _remarks(one: xr.Dataset) -> None:
    """Print what a fit does not tell, and whether noise is left that the errors do not count."""
    law, message = _law(one), str(one["message"].item())
    names = [str(name) for name in one["parameter"].values]
    if message:
        console.print(f"{law}: {fit_results.status(one).replace('_', ' ')}: {message}")
    spreads = {n: one[f"{n}_windows"] for n in fit_results.shown(one) if f"{n}_windows" in one}
    if spreads:
        each = ", ".join(
            f"{fit_results.SHORT[plain(n)][0]} {v.item():.2g}" for n, v in spreads.items()
        )
        console.print(f"{law}: among windows parameters differ by {each}")
    if "posterior" in one and math.isfinite(one["autocorrelation_time"].item()):
        ends = {n: one["posterior"].sel(parameter=n).quantile([0.025, 0.975]).values for n in names}
        each = ", ".join(f"{n} {low:.4g} to {high:.4g}" for n, (low, high) in ends.items())
        time = f"{one['autocorrelation_time'].item():.2g} steps"
        console.print(f"{law}: 95 % of the posterior: {each} (autocorrelation time {time})")
    chance = one["whiteness"].item()
    if math.isfinite(chance):
        verdict = "white" if chance > _CHANCE else "still correlated"
        console.print(f"{law}: residuals freed of correlation are {verdict} (chance {chance:.2g})")
