"""The command line: list, show, run, rerun, check and plot studies and their results."""

from __future__ import annotations

import contextlib
import shlex
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import click
import xarray as xr
from rich.table import Table

from rsfstudy import api, assignments, terminal
from rsfstudy.compute.cells import DEFAULT_TIME_LIMIT
from rsfstudy.compute.clusters import existing_cluster
from rsfstudy.compute.runner import FORMATS, Keeping
from rsfstudy.compute.workers import Workers
from rsfstudy.declare import catalogue
from rsfstudy.declare.study import Study
from rsfstudy.errors import Interrupted, InvalidValue, RsfStudyError, brief
from rsfstudy.files import contents, places, restore
from rsfstudy.terminal import FAILED, OK, Ended

WRONG_USAGE = 2
_ENDINGS = {"netcdf": "nc", "zarr": "zarr"}
RESULTS = (".nc", ".zarr")

_stderr = terminal.Plain(stderr=True, markup=False, emoji=False, highlight=False)

_all = click.option("--all", "every", is_flag=True, help="Every named study.")


def _directory(_context: click.Context, _option: click.Parameter, value: str | None) -> Path | None:
    return places.directory(value)


_output = click.option(
    "--output",
    type=click.Path(file_okay=False),
    callback=_directory,
    default=places.DEFAULT,
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


_rtol = click.option(
    "--rtol",
    type=float,
    help="Accuracy of each cell, 1e-11 to 0.01.  [default: the study's, 1e-07]",
)
_workers = click.option(
    "--workers",
    type=click.IntRange(1),
    default=2,
    show_default=True,
    help="Worker processes of this machine.",
)
_serial = click.option("--serial", is_flag=True, help="Compute in this process.")
_scheduler = click.option("--scheduler", metavar="ADDRESS", help="Use an existing Dask cluster.")
_time_limit = click.option(
    "--time-limit",
    type=float,
    default=DEFAULT_TIME_LIMIT,
    show_default=True,
    help="Seconds of CPU time after which a worker gives a cell up.",
)
_study = click.option(
    "--study",
    type=click.Path(path_type=Path),
    help="File that declares the study, if its measure, a part or the figure is its own.",
)
_quiet = click.option("--quiet", is_flag=True, help="No progress bar.")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="rsfstudy")
def cli() -> None:
    """Parameter studies of a spring-slider with rate- and state-dependent friction."""


def main() -> None:
    """Entry point: errors of ours end in one message and an exit status, not in a traceback."""
    warnings.filterwarnings("always", category=UserWarning, module="rsfstudy")
    # not by `_stderr`, which knows nothing of a progress bar and would write over it
    warnings.showwarning = lambda message, *_place: print(
        terminal.spelt(f"warning: {message}"), file=sys.stderr
    )
    try:
        sys.exit(cli(standalone_mode=False) or OK)
    except click.ClickException as error:
        error.message = brief(error.message)  # type: ignore[misc]
        error.show()
        sys.exit(WRONG_USAGE)
    except (click.Abort, KeyboardInterrupt):
        _stderr.print("interrupted")
        sys.exit(FAILED)
    except InvalidValue as error:
        _stderr.print(f"error: {error}")
        sys.exit(WRONG_USAGE)
    except RsfStudyError as error:
        _stderr.print(f"error: {error}")
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
@_rtol
def show(name: str, settings: tuple[str, ...], rtol: float | None) -> int:
    """Show the declaration of a study, without running it; or what is in a results file, and how
    to reproduce each cell that failed.
    """
    if Path(name).suffix in RESULTS:
        if settings or rtol is not None:
            raise click.UsageError("a results file is shown as it is, without --set or --rtol")
        return terminal.results(api.open(name), name)
    terminal.declaration(_declared(catalogue.load(name), settings, rtol))
    return OK


@cli.command()
@click.argument("name", required=False)
@_all
@_set
@_output
@_workers
@_serial
@_scheduler
@_rtol
@_time_limit
@click.option("--fresh", is_flag=True, help="Compute every cell anew.")
@click.option("--keep-going", is_flag=True, help="Go on where the first cells all fail.")
@click.option("--despite-failures", is_flag=True, help="Reduce what there is where cells failed.")
@click.option(
    "--format",
    type=click.Choice(FORMATS),
    default="netcdf",
    show_default=True,
    help="One NetCDF file, or a Zarr store written in pieces, which never replaces another.",
)
@_quiet
def run(
    name: str | None,
    every: bool,
    settings: tuple[str, ...],
    output: Path,
    workers: int,
    serial: bool,
    scheduler: str | None,
    rtol: float | None,
    time_limit: float,
    quiet: bool,
    **choices: Any,
) -> int:
    """Run a study: OUTPUT/NAME.nc, OUTPUT/NAME.png, its reductions and its claims."""
    studies = [_declared(catalogue.load(n), settings, rtol) for n in _results(name, every)]
    command = shlex.join(["rsfstudy", *sys.argv[1:]])
    keeping = Keeping(output=output, command=command, **choices)
    with _client(scheduler, serial) as client:
        where = Workers(0 if serial else workers, client, time_limit)
        ready = [(study, api.prepared(study, keeping, where, not quiet)) for study in studies]
        for study in studies if rtol is not None else ():
            terminal.announce(study)
        if every:
            return _run_all(ready, keeping)
        return OK if _run(*ready[0], keeping).is_fine else FAILED


def _run(study: Study, compute: Callable[[], xr.Dataset], keeping: Keeping) -> Ended:
    """Compute a study, draw it and print what came out."""
    assert keeping.output is not None
    began = time.monotonic()
    dataset = compute()
    file = keeping.output / f"{study.name}.{_ENDINGS[keeping.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = _drawn(dataset, keeping.output / f"{study.name}.png", own)
    terminal.report(dataset, study.name, [file, *drawn])
    return terminal.ended(dataset, study.name, time.monotonic() - began, bool(drawn))


def _run_all(ready: Sequence[tuple[Study, Callable[[], xr.Dataset]]], keeping: Keeping) -> int:
    """Run one study after the other, even if some fail; only Ctrl-C ends them all."""
    ends: list[Ended] = []
    try:
        for study, compute in ready:
            began = time.monotonic()
            try:
                ends.append(_run(study, compute, keeping))
            except Interrupted:
                raise
            except RsfStudyError as error:
                _stderr.print(f"error: {error}")
                ends.append(Ended(study.name, time.monotonic() - began, "not finished"))
    finally:
        terminal.summary(ends)
    return OK if all(end.is_fine for end in ends) else FAILED


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--cell",
    "place",
    multiple=True,
    metavar="AXIS=VALUE",
    help="Only this cell, in this process, failing as it fails.",
)
@_study
@click.option(
    "--output",
    type=click.Path(file_okay=False),
    callback=_directory,
    help="Directory to keep the new results in; nothing is written without it.",
)
@_workers
@_serial
@_scheduler
@_time_limit
@_quiet
def rerun(
    file: Path,
    place: tuple[str, ...],
    study: Path | None,
    output: Path | None,
    workers: int,
    serial: bool,
    scheduler: str | None,
    time_limit: float,
    quiet: bool,
) -> int:
    """Compute a results file anew from what it says of itself, and compare every number."""
    if place:
        with warnings.catch_warnings(record=True) as caught:
            scene, outcome = api.cell(file, dict(map(assignments.place, place)), study=study)
        return terminal.outcome(scene, outcome, [str(warning.message) for warning in caught])
    with _client(scheduler, serial) as client:
        table = api.rerun(
            file,
            study=study,
            workers=0 if serial else workers,
            client=client,
            output=output,
            progress=not quiet,
            time_limit=time_limit,
        )
    return terminal.agreement(table)


@cli.command()
@click.argument("name", required=False)
@_all
@_output
def check(name: str | None, every: bool, output: Path) -> int:
    """Hold results against published values: a named study's, or those of a file."""
    if not every:
        return terminal.checked(api.open(_results(name, every)[0], output))
    status, datasets = OK, []
    for what in catalogue.names():
        if (output / f"{what}.nc").exists():
            datasets.append(api.open(what, output))
        else:
            terminal.console.print(f"{what}: not run yet", style="red")
            status = FAILED
    return max([status, terminal.all_claims(datasets), *map(terminal.failures, datasets)])


@cli.command()
@click.argument("name", required=False)
@_all
@_output
@_study
def plot(name: str | None, every: bool, output: Path, study: Path | None) -> int:
    """Draw the figure of a named study's results, or of a file, beside it. A figure of your own is
    taken from the file that --study names, which is run.
    """
    status = OK
    for what in _results(name, every):
        dataset = api.open(what, output)
        named = Path(what)
        beside = named if named.suffix in RESULTS else output / f"{dataset.attrs['id']}.png"
        path = beside.with_suffix(".png")
        drawn = _drawn(dataset, path, _own_figure(dataset, study))
        status = status if drawn else FAILED
        for file in drawn:
            terminal.console.print(f"{file}", highlight=False)
    return status


# ---- arguments ------------------------------------------------------------------------------


def _results(name: str | None, every: bool) -> list[str]:
    if every == (name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(catalogue.names()) if name is None else [name]


def _declared(study: Study, settings: tuple[str, ...], rtol: float | None) -> Study:
    return api.declaration(study, rtol, assignments.overrides(study, settings))


@contextlib.contextmanager
def _client(scheduler: str | None, serial: bool) -> Iterator[Any]:
    if serial and scheduler:
        raise click.UsageError("--serial and --scheduler exclude each other")
    if scheduler is None:
        yield None
        return
    with existing_cluster(scheduler) as client:
        yield client


def _own_figure(dataset: xr.Dataset, study: Path | None) -> Any:
    """What draws a figure that is not part of rsfstudy: the study file's own, or plain lines."""
    from rsfstudy import plots
    from rsfstudy.plots import lines

    if contents.declaration(dataset).plot in plots.NAMES:
        if study is not None:
            catalogue.load(str(study))  # for the parts of its scenes
        return None
    try:
        return restore.own_figure(dataset, study)
    except RsfStudyError as error:
        if study is not None:
            raise
        _stderr.print(f"note: drawn as lines. {error}")
        return lines


def _drawn(dataset: xr.Dataset, path: Path, own: Any = None) -> list[Path]:
    """The figure, if it can be drawn; the results are there already."""
    from rsfstudy import plots

    try:
        plots.save(dataset, path, own)
    except (OSError, RsfStudyError) as error:
        _stderr.print(f"no figure: {error}")
        return []
    return [path]


if __name__ == "__main__":
    main()
