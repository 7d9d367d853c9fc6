"""The command line: list, show, run, rerun, check and plot studies and their results."""

from __future__ import annotations

import contextlib
import shlex
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import xarray as xr
from rich.table import Table

from rsfstudy import api, assignments, cli_simulate, options, terminal
from rsfstudy.compute.clusters import existing_cluster
from rsfstudy.compute.runner import FORMATS, Keeping
from rsfstudy.compute.workers import Workers
from rsfstudy.declare import catalogue
from rsfstudy.declare.study import Study
from rsfstudy.errors import Interrupted, InvalidValue, RsfStudyError, brief
from rsfstudy.files import contents, places, restore
from rsfstudy.motion.engines import lacking
from rsfstudy.terminal import FAILED, OK, Ended

WRONG_USAGE = 2
_ENDINGS = {"netcdf": "nc", "zarr": "zarr"}
RESULTS = (".nc", ".zarr")

_stderr = terminal.Plain(stderr=True, markup=False, emoji=False, highlight=False)


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
@options.settings
@options.rtol
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
@options.every
@options.settings
@options.output
@options.workers
@options.serial
@options.scheduler
@options.rtol
@options.engine
@options.time_limit
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
@options.figure
@options.style
@options.quiet
def run(
    name: str | None,
    every: bool,
    settings: tuple[str, ...],
    output: Path,
    workers: int,
    serial: bool,
    scheduler: str | None,
    rtol: float | None,
    engine: str | None,
    time_limit: float,
    form: str | None,
    style: str | None,
    quiet: bool,
    **choices: Any,
) -> int:
    """Run a study: OUTPUT/NAME.nc, its figure OUTPUT/NAME.png, its reductions and its claims."""
    names = _results(name, every)
    studies = [_declared(catalogue.load(n), settings, rtol, engine) for n in names]
    left_out = _left_out(studies) if every and engine is None else []
    studies = [study for study in studies if study.name not in {end.study for end in left_out}]
    command = shlex.join(["rsfstudy", *sys.argv[1:]])
    keeping = Keeping(output=output, command=command, **choices)
    look = Look(form, style)
    with _client(scheduler, serial) as client:
        where = Workers(0 if serial else workers, client, time_limit)
        ready = [(study, api.prepared(study, keeping, where, not quiet)) for study in studies]
        for study in studies if rtol is not None else ():
            terminal.announce(study)
        if every:
            return _run_all(ready, keeping, look, left_out)
        return OK if _run(*ready[0], keeping, look).is_fine else FAILED


@dataclass(frozen=True)
class Look:
    """How a figure is to be drawn: its file format, its style, and of which variable."""

    form: str | None = None
    style: str | None = None
    variable: str | None = None

    def beside(self, results: Path) -> Path:
        """The figure beside results, which may be no file."""
        name = results.name.removesuffix(".nc").removesuffix(".zarr")
        words = [name, self.variable, self.form or options.FIGURES[0]]
        return results.with_name(".".join(filter(None, words)))


def _run(study: Study, compute: Callable[[], xr.Dataset], keeping: Keeping, look: Look) -> Ended:
    """Compute a study, draw it and print what came out."""
    assert keeping.output is not None
    began = time.monotonic()
    dataset = compute()
    file = keeping.output / f"{study.name}.{_ENDINGS[keeping.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = _drawn(dataset, look.beside(file), look, own)
    terminal.report(dataset, study.name, [file, *drawn])
    return terminal.ended(dataset, study.name, time.monotonic() - began, bool(drawn))


def _left_out(studies: Sequence[Study]) -> list[Ended]:
    """Name the studies whose engine is not installed."""
    ends = [
        Ended(study.name, 0.0, left_out=why)
        for study in studies
        if (why := lacking(study.accuracy.engine))
    ]
    for end in ends:
        terminal.console.print(f"{end.study}: left out: {end.left_out}", style="yellow")
    return ends


def _run_all(
    ready: Sequence[tuple[Study, Callable[[], xr.Dataset]]],
    keeping: Keeping,
    look: Look,
    left_out: Sequence[Ended],
) -> int:
    """Run one study after the other, even if some fail; only Ctrl-C ends them all."""
    ends: list[Ended] = []
    try:
        for study, compute in ready:
            began = time.monotonic()
            try:
                ends.append(_run(study, compute, keeping, look))
            except Interrupted:
                raise
            except RsfStudyError as error:
                _stderr.print(f"error: {error}")
                ends.append(Ended(study.name, time.monotonic() - began, "not finished"))
    finally:
        terminal.summary([*ends, *left_out])
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
@options.study
@click.option(
    "--output",
    type=click.Path(file_okay=False),
    callback=options.directory,
    help="Directory to keep the new results in; nothing is written without it.",
)
@options.workers
@options.serial
@options.scheduler
@options.time_limit
@options.quiet
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
@options.every
@options.output
def check(name: str | None, every: bool, output: Path) -> int:
    """Hold results against published values: a named study's, or those of a file."""
    if not every:
        return terminal.checked(api.open(_results(name, every)[0], output))
    status, datasets = OK, []
    for what in catalogue.names():
        if (output / f"{what}.nc").exists():
            datasets.append(api.open(what, output))
        elif why := lacking(catalogue.load(what).accuracy.engine):
            terminal.console.print(f"{what}: left out: {why}", style="yellow")
        else:
            terminal.console.print(f"{what}: not run yet", style="red")
            status = FAILED
    return max([status, terminal.all_claims(datasets), *map(terminal.failures, datasets)])


@cli.command()
@click.argument("name", required=False)
@options.every
@options.drawn
@options.figure
@options.style
@click.option("--variable", metavar="NAME", help="Draw this variable: maps, or lines.")
@options.study
def plot(
    name: str | None,
    every: bool,
    output: Path | None,
    form: str | None,
    style: str | None,
    variable: str | None,
    study: Path | None,
) -> int:
    """Draw the figure of a named study's results, or of a file, beside it. A figure of your own is
    taken from the file that --study names, which is run.
    """
    status, look = OK, Look(form, style, variable)
    target = _target(output, form, every)
    for what in _results(name, every):
        results = places.results(what, places.DEFAULT if target else output)
        dataset = api.open(results)
        place = results if output is None else output / results.name
        own = None if variable else _own_figure(dataset, study)
        drawn = _drawn(dataset, target or look.beside(place), look, own)
        status = status if drawn else FAILED
        for file in drawn:
            terminal.console.print(f"{file}", highlight=False)
    return status


def _target(output: Path | None, form: str | None, every: bool) -> Path | None:
    """The file that --output names, if it is a figure."""
    ending = "" if output is None else output.suffix[1:].lower()
    if ending not in options.FIGURES:
        return None
    if every or form not in (None, ending):
        raise click.UsageError(f"{output} is one figure: no --all, nor another --figure")
    return output


# ---- arguments ------------------------------------------------------------------------------


def _results(name: str | None, every: bool) -> list[str]:
    if every == (name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(catalogue.names()) if name is None else [name]


def _declared(
    study: Study, settings: tuple[str, ...], rtol: float | None, engine: str | None = None
) -> Study:
    return api.declaration(study, rtol, assignments.overrides(study, settings), engine)


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


def _drawn(dataset: xr.Dataset, path: Path, look: Look, own: Any = None) -> list[Path]:
    """The figure, if it can be drawn; the results are there already."""
    from rsfstudy import plots

    try:
        plots.save(dataset, path, own, variable=look.variable, style=look.style)
    except (OSError, RsfStudyError) as error:
        _stderr.print(f"no figure: {error}")
        return []
    return [path]


cli.add_command(cli_simulate.simulate)

if __name__ == "__main__":
    main()
