"""The command line: list, show, run, check and plot named studies."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
import pandas as pd
import xarray as xr
from rich.console import Console
from rich.table import Column, Table

from rsfstudy import api, catalogue, runner, store
from rsfstudy.claims import NOT_APPLICABLE
from rsfstudy.core.accuracy import DEFAULT_RTOL
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.status import Status
from rsfstudy.study import Study
from rsfstudy.workers import existing_cluster

OK, FAILED, WRONG_USAGE = 0, 1, 2

_console = Console()
_stderr = Console(stderr=True)

_all = click.option("--all", "every", is_flag=True, help="Every named study.")
_output = click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    default=api.OUTPUT,
    show_default=True,
    help="Directory of the results.",
)
_set = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="AXIS=VALUES",
    help="Other values: a comma list, or start:stop:count.",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="rsfstudy")
def cli() -> None:
    """Parameter studies of a spring-slider with rate- and state-dependent friction."""


def main() -> None:
    """Entry point: errors of ours end in one message and an exit status, not in a traceback."""
    try:
        sys.exit(cli(standalone_mode=False) or OK)
    except click.ClickException as error:
        error.show()
        sys.exit(WRONG_USAGE)
    except (click.Abort, KeyboardInterrupt):
        _stderr.print("interrupted")
        sys.exit(FAILED)
    except InvalidValue as error:
        _stderr.print(f"error: {error}", markup=False, highlight=False)
        sys.exit(WRONG_USAGE)
    except RsfStudyError as error:
        _stderr.print(f"error: {error}", markup=False, highlight=False)
        sys.exit(FAILED)


@cli.command("list")
def list_studies() -> None:
    """Name the studies."""
    table = Table("study", "cells", "what it shows", box=None)
    for name, study in api.studies().items():
        table.add_row(name, str(study.size), study.title)
    _console.print(table)


@cli.command()
@click.argument("name")
@_set
def show(name: str, settings: tuple[str, ...]) -> None:
    """Show the declaration of a study, without running it."""
    study = _declared(name, settings)
    scenes = list(study.scenes())
    _console.print(f"[bold]{study.name}[/bold]: {study.title}\n")
    if study.summary:
        _console.print(study.summary + "\n")
    table = Table("", "", box=None, show_header=False)
    for axis in study.axes:
        points = axis.labels or [_short(row[axis.dimension]) for row in axis.rows]
        table.add_row(f"axis {axis.dimension} ({len(axis)})", ", ".join(points))
    varied = {field for axis in study.axes for field in axis.fields}
    fixed = {n: v for n, v in study.base.as_dict().items() if n not in varied and v is not None}
    table.add_row("fixed", ", ".join(f"{n} = {_short(v)}" for n, v in fixed.items()))
    table.add_row("measure", ", ".join(f"{n} = {v}" for n, v in study.measure.describe().items()))
    table.add_row("gives", ", ".join(study.measure.variables))
    table.add_row("reduced to", ", ".join(r.describe()["name"] for r in study.reductions) or "-")
    table.add_row("claims", ", ".join(dict.fromkeys(c.id for c in study.claims)) or "-")
    work = len(set(scenes)) * study.measure.typical_work
    seconds = runner.estimated_seconds(study, len(set(scenes)))
    table.add_row("cells", f"{study.size}, of which {len(set(scenes))} differ")
    table.add_row(
        "cost",
        f"about {work:,} right-hand sides, {seconds:.0f} s on one core at rtol {DEFAULT_RTOL:g}",
    )
    _console.print(table)


@cli.command()
@click.argument("name", required=False)
@_all
@_set
@_output
@click.option("--workers", type=click.IntRange(1), default=2, show_default=True)
@click.option("--serial", is_flag=True, help="Compute in this process.")
@click.option("--scheduler", metavar="ADDRESS", help="Use an existing Dask cluster.")
@click.option("--rtol", type=float, help="Accuracy of each cell.")
@click.option("--fresh", is_flag=True, help="Compute every cell anew.")
@click.option("--quiet", is_flag=True, help="No progress bar.")
def run(
    name: str | None,
    every: bool,
    settings: tuple[str, ...],
    output: Path,
    workers: int,
    serial: bool,
    scheduler: str | None,
    rtol: float | None,
    fresh: bool,
    quiet: bool,
) -> int:
    """Run a study: OUTPUT/NAME.nc, OUTPUT/NAME.png, its reductions and its claims."""
    if serial and scheduler:
        raise click.UsageError("--serial and --scheduler exclude each other")
    status = OK
    with _client(scheduler) as client:
        for study in _named(name, every):
            dataset = api.run(
                _overridden(study, settings),
                workers=0 if serial else workers,
                client=client,
                output=output,
                fresh=fresh,
                rtol=rtol,
                progress=not quiet,
                command=runner.command_line(),
            )
            _draw(dataset, output / f"{study.name}.png")
            status = max(status, _report(dataset, study.name, output))
    return status


@cli.command()
@click.argument("name", required=False)
@_all
@_output
def check(name: str | None, every: bool, output: Path) -> int:
    """Hold results against published values: a named study's, or those of a file."""
    status = OK
    for what in _results(name, every):
        if every and not (output / f"{what}.nc").exists():
            _console.print(f"{what}: not run yet", style="red")
            status = FAILED
            continue
        dataset = api.open(what, output)
        status = max(status, _claims(dataset), _failures(dataset))
    return status


@cli.command()
@click.argument("name", required=False)
@_all
@_output
def plot(name: str | None, every: bool, output: Path) -> None:
    """Draw the figure of a named study's results, or of a file, beside it."""
    for what in _results(name, every):
        dataset = api.open(what, output)
        path = Path(what).with_suffix(".png") if what.endswith(".nc") else output / f"{what}.png"
        _draw(dataset, path)
        _console.print(f"{path}", highlight=False)


# ---- what was asked for
# ---------------------------------------------------------------------------


def _named(name: str | None, every: bool) -> list[Study]:
    return [catalogue.load(what) for what in _results(name, every)]


def _results(name: str | None, every: bool) -> list[str]:
    if every == (name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(catalogue.names()) if name is None else [name]


def _declared(name: str, settings: tuple[str, ...]) -> Study:
    return _overridden(catalogue.load(name), settings)


def _overridden(study: Study, settings: tuple[str, ...]) -> Study:
    overrides = dict(_setting(text) for text in settings)
    return study.with_(**overrides) if overrides else study


def _setting(text: str) -> tuple[str, Any]:
    """One ``AXIS=VALUES``: a single value, a comma list, or start:stop:count."""
    name, equals, values = text.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise InvalidValue("--set", text, "must read AXIS=VALUES, as in b_over_a=2,3,4")
    parts = [part.strip() for part in values.split(",")]
    if len(parts) > 1:
        return name.strip(), [_value(part) for part in parts if part]
    if values.count(":") == 2:
        start, stop, count = values.split(":")
        try:
            spaced = np.linspace(float(start), float(stop), int(count))
        except ValueError as error:
            raise InvalidValue(
                "--set", text, "must read start:stop:count, two numbers and a count"
            ) from error
        return name.strip(), spaced.tolist()
    if ":" in values:
        raise InvalidValue("--set", text, "must read start:stop:count, two numbers and a count")
    return name.strip(), _value(parts[0])


def _value(text: str) -> Any:
    flags = {"true": True, "false": False}
    if text.lower() in flags:
        return flags[text.lower()]
    try:
        return float(text)
    except ValueError:
        return text


@contextlib.contextmanager
def _client(scheduler: str | None) -> Iterator[Any]:
    if scheduler is None:
        yield None
        return
    with existing_cluster(scheduler) as client:
        yield client


# ---- what is shown
# --------------------------------------------------------------------------------


def _draw(dataset: xr.Dataset, path: Path) -> None:
    from rsfstudy import plots

    plots.save(dataset, path)


def _report(dataset: xr.Dataset, name: str, output: Path) -> int:
    _reductions(dataset)
    moved = _claims(dataset)
    failed = _failures(dataset)
    work = int(dataset["rhs_evaluations"].sum())
    tally = ", ".join(f"{count} {label}" for label, count in runner.counts(dataset).items())
    _console.print(f"{name}: {tally}; {work:,} right-hand sides", highlight=False)
    _console.print(f"wrote {output / name}.nc and {output / name}.png", highlight=False)
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
            table.add_row(*(_short(value) for value in row))
        _console.print(table)


def _claims(dataset: xr.Dataset) -> int:
    """Print the claims; FAILED where a verdict is not the expected one."""
    table_of = api.check(dataset)
    overrides = store.declaration(dataset)["overrides"]
    _console.print(f"[bold]{dataset.attrs['id']}[/bold] ({dataset.attrs['completeness']})")
    if overrides:
        _console.print(f"not as declared: {_settings(overrides)}", highlight=False, markup=False)
    if (table_of.empty or table_of["verdict"].eq(NOT_APPLICABLE).all()) and not _undone(dataset):
        _console.print("no claim applies")
        return OK
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
    for row in table_of.itertuples(index=False):
        table.add_row(*_claim_row(row))
    _console.print(table)
    moved = table_of[table_of["moved"]]
    for row in moved.itertuples(index=False):
        _console.print(
            f"{row.id}: {row.verdict}, expected {row.expected}: {row.claim}", style="red"
        )
    return FAILED if len(moved) else OK


def _settings(overrides: Mapping[str, Any]) -> str:
    texts = {
        name: ",".join(map(_short, value)) if isinstance(value, list) else _short(value)
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
        row.claim,
        f"{sign}{row.published:g}",
        "-" if pd.isna(row.ours) else f"{row.ours:.6g}",
        reason,
        f"[{colour}]{row.verdict}[/{colour}]",
    )


def _failures(dataset: xr.Dataset) -> int:
    """Print the cells that failed; FAILED if there are any."""
    if _undone(dataset):
        size = dataset["status"].size
        _console.print(f"{_undone(dataset)} of {size} cells are not computed yet", style="red")
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
        place = ", ".join(f"{d} = {_short(cell[d].item())}" for d in map(str, failed.dims))
        table.add_row(place, labels[int(cell["status"])], str(cell["message"].item()))
    _console.print(table)
    return FAILED


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float | np.floating) else str(value)


if __name__ == "__main__":
    main()
