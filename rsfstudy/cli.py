"""The command line: list, show, run, check and plot named studies."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import xarray as xr
from rich.console import Console
from rich.table import Table

from rsfstudy import api, catalogue, runner, terminal
from rsfstudy.core.accuracy import DEFAULT_RTOL
from rsfstudy.errors import InvalidValue, RsfStudyError
from rsfstudy.study import Study
from rsfstudy.terminal import FAILED, OK
from rsfstudy.workers import existing_cluster

WRONG_USAGE = 2

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
    terminal.console.print(table)


@cli.command()
@click.argument("name")
@_set
def show(name: str, settings: tuple[str, ...]) -> None:
    """Show the declaration of a study, without running it."""
    study = _declared(name, settings)
    scenes = list(study.scenes())
    terminal.console.print(f"[bold]{study.name}[/bold]: {study.title}\n")
    if study.summary:
        terminal.console.print(study.summary + "\n")
    table = Table("", "", box=None, show_header=False)
    for axis in study.axes:
        points = axis.labels or [terminal.short(row[axis.dimension]) for row in axis.rows]
        table.add_row(f"axis {axis.dimension} ({len(axis)})", ", ".join(points))
    varied = {field for axis in study.axes for field in axis.fields}
    fixed = {n: v for n, v in study.base.as_dict().items() if n not in varied and v is not None}
    table.add_row("fixed", ", ".join(f"{n} = {terminal.short(v)}" for n, v in fixed.items()))
    table.add_row("measure", ", ".join(f"{n} = {v}" for n, v in study.measure.describe().items()))
    table.add_row("gives", ", ".join(study.measure.variables))
    table.add_row("reduced to", ", ".join(r.describe()["name"] for r in study.reductions) or "-")
    table.add_row("claims", ", ".join(dict.fromkeys(c.id for c in study.claims)) or "-")
    work, seconds = runner.estimated_cost(study)
    table.add_row("cells", f"{study.size}, of which {len(set(scenes))} differ")
    table.add_row(
        "cost",
        f"about {work:,} right-hand sides, {seconds:.0f} s on one core at rtol "
        f"{study.accuracy.rtol:g}",
    )
    terminal.console.print(table)


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
        for named in _named(name, every):
            study = _overridden(named, settings)
            if rtol is not None:
                study = replace(study, accuracy=replace(study.accuracy, rtol=rtol))
                _announce(study)
            dataset = api.run(
                study,
                workers=0 if serial else workers,
                client=client,
                output=output,
                fresh=fresh,
                progress=not quiet,
                command=runner.command_line(),
            )
            _draw(dataset, output / f"{study.name}.png")
            status = max(status, terminal.report(dataset, study.name, output))
    return status


@cli.command()
@click.argument("name", required=False)
@_all
@_output
def check(name: str | None, every: bool, output: Path) -> int:
    """Hold results against published values: a named study's, or those of a file."""
    if not every:
        dataset = api.open(_results(name, every)[0], output)
        return max(terminal.claims(dataset), terminal.failures(dataset))
    status, found = OK, []
    for what in catalogue.names():
        if (output / f"{what}.nc").exists():
            found.append(api.open(what, output))
        else:
            terminal.console.print(f"{what}: not run yet", style="red")
            status = FAILED
    return max([status, terminal.all_claims(found), *map(terminal.failures, found)])


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
        terminal.console.print(f"{path}", highlight=False)


# ---- what was asked for ---------------------------------------------------------------------


def _named(name: str | None, every: bool) -> list[Study]:
    return [catalogue.load(what) for what in _results(name, every)]


def _results(name: str | None, every: bool) -> list[str]:
    if every == (name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(catalogue.names()) if name is None else [name]


def _declared(name: str, settings: tuple[str, ...]) -> Study:
    return _overridden(catalogue.load(name), settings)


def _overridden(study: Study, settings: tuple[str, ...]) -> Study:
    labels = {label for axis in study.axes for label in axis.labels or ()}
    overrides = dict(_setting(text, labels) for text in settings)
    return study.with_(**overrides) if overrides else study


def _setting(text: str, labels: Collection[str]) -> tuple[str, Any]:
    """One ``AXIS=VALUES``: a label, a single value, a comma list, or start:stop:count."""
    name, equals, values = text.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise InvalidValue("--set", text, "must read AXIS=VALUES, as in b_over_a=2,3,4")
    if values.strip() in labels:
        return name.strip(), [values.strip()]
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


def _announce(study: Study) -> None:
    """Say what an accuracy will cost, before it does."""
    work, seconds = runner.estimated_cost(study)
    terminal.console.print(
        f"{study.name} at rtol {study.accuracy.rtol:g}: {study.accuracy.relative_work:.2g} times "
        f"the work of rtol {DEFAULT_RTOL:g}, about {work:,} right-hand sides, {seconds:.0f} s on "
        "one core",
        highlight=False,
    )


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


def _draw(dataset: xr.Dataset, path: Path) -> None:
    from rsfstudy import plots

    plots.save(dataset, path)


if __name__ == "__main__":
    main()
