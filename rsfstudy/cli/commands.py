"""What the commands do; how each is spelt is in `cli`, which loads this when one is called."""

from __future__ import annotations

import contextlib
import shlex
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click
import xarray as xr

from rsfstudy.api import exchange, runs
from rsfstudy.api import report as reports
from rsfstudy.cli import assignments, commands_fit, commands_simulate, terminal, terminal_numbers
from rsfstudy.cli.console import console, stderr
from rsfstudy.cli.options import RIG
from rsfstudy.cli.terminal import FAILED, OK, Ended
from rsfstudy.compute.clusters import existing_cluster
from rsfstudy.compute.runner import Keeping
from rsfstudy.compute.workers import SharedProcesses, Workers
from rsfstudy.declare import catalogue, names
from rsfstudy.declare.study import Study
from rsfstudy.defaults import FIGURES, OUTPUT
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError
from rsfstudy.files import contents, places, restore, store
from rsfstudy.motion.engines import lacking
from rsfstudy.rig import lattice
from rsfstudy.rig.quantities import STATED
from rsfstudy.rig.units import number

_ENDINGS = {"netcdf": "nc", "zarr": "zarr"}
_RESULTS = (".nc", ".zarr")


def show(
    name: str, settings: tuple[str, ...], rtol: float | None, output: Path, **rig: str | None
) -> int:
    """Show a study, or a results file."""
    if Path(name).suffix in _RESULTS:
        if settings or rtol is not None or any(rig.values()):
            text = "a results file is shown as it is, without --set, --rtol or a rig"
            raise click.UsageError(text)
        dataset = store.read_any(Path(name))
        if contents.is_of_a_scene(dataset):
            return commands_simulate.show(dataset)
        if commands_fit.is_fit(dataset):
            return commands_fit.show(dataset)
        return terminal.results(dataset, name)
    terminal.declaration(_declared(catalogue.load(name), settings, rig, rtol=rtol), output)
    return OK


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
    budget: int | None,
    time_limit: float,
    form: str | None,
    style: str | None,
    quiet: bool,
    **choices: Any,
) -> int:
    """Run a study, or all."""
    rig = {option: choices.pop(option, None) for option in RIG}
    names = _results(name, every)
    studies = [
        _declared(catalogue.load(n), settings, rig, rtol=rtol, engine=engine, budget=budget)
        for n in names
    ]
    left_out = _left_out(studies) if every and engine is None else []
    studies = [study for study in studies if study.name not in {end.study for end in left_out}]
    command = shlex.join(["rsfstudy", *sys.argv[1:]])
    keeping = Keeping(output=output, command=command, **choices)
    look = Look(form, style)
    with _client(scheduler, serial) as client, contextlib.ExitStack() as stack:
        where = Workers(0 if serial else workers, client, time_limit)
        if every and where.processes and client is None:
            log = output / "workers.log"
            shared = stack.enter_context(SharedProcesses(where.processes, log))
            where = replace(where, shared=shared)
        ready = [(study, runs.prepared(study, keeping, where, not quiet)) for study in studies]
        for study in studies:
            terminal.announce(study, output, accuracy=rtol is not None, advice=not (every or quiet))
        if every:
            return _run_all(ready, keeping, look, left_out)
        return OK if _run(*ready[0], keeping, look, many=False).is_fine else FAILED


@dataclass(frozen=True)
class Look:
    """How a figure is to be drawn: its file format, its style, and of which variable."""

    form: str | None = None
    style: str | None = None
    variable: str | None = None

    def beside(self, results: Path) -> Path:
        """The figure beside results, which may be no file."""
        name = results.name.removesuffix(".nc").removesuffix(".zarr")
        words = [name, self.variable, self.form or FIGURES[0]]
        return results.with_name(".".join(filter(None, words)))


def _run(
    study: Study, compute: Callable[[], xr.Dataset], keeping: Keeping, look: Look, many: bool
) -> Ended:
    """Compute a study, draw it and print what came out, in short where others follow."""
    assert keeping.output is not None
    began = time.monotonic()
    dataset = compute()
    file = keeping.output / f"{study.name}.{_ENDINGS[keeping.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = _drawn(dataset, look.beside(file), look, own)
    end = terminal.ended(dataset, study.name, time.monotonic() - began, bool(drawn))
    (terminal.in_short if many else terminal.report)(dataset, end, [file, *drawn])
    return end


def _left_out(studies: Sequence[Study]) -> list[Ended]:
    """Name the studies whose engine is not installed."""
    ends = [
        Ended(study.name, 0.0, left_out=why)
        for study in studies
        if (why := lacking(study.accuracy.engine))
    ]
    for end in ends:
        console.print(f"{end.study}: left out: {end.left_out}", style="yellow")
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
                ends.append(_run(study, compute, keeping, look, many=True))
            except Interrupted:
                raise
            except RsfStudyError as error:
                stderr.print(f"error: {error}")
                ends.append(Ended(study.name, time.monotonic() - began, "not finished"))
    finally:
        terminal.summary([*ends, *left_out])
    return OK if all(end.is_fine for end in ends) else FAILED


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
    """Compute a results file anew, or one cell of it."""
    if place:
        try:
            with warnings.catch_warnings(record=True) as caught:
                scene, outcome = runs.cell(file, dict(map(assignments.place, place)), study=study)
        except RsfStudyError:
            raise
        except Exception:  # it fails as it fails
            traceback.print_exc()
            return FAILED
        return terminal.outcome(scene, outcome, [str(warning.message) for warning in caught])
    with _client(scheduler, serial) as client:
        table = runs.rerun(
            file,
            study=study,
            workers=0 if serial else workers,
            client=client,
            output=output,
            progress=not quiet,
            time_limit=time_limit,
        )
    return terminal.agreement(table)


def report(directory: Path, output: str | None) -> int:
    """Write a page of all results."""
    page, unread = reports.written(directory, output)
    console.print(f"wrote {page}", soft_wrap=True)
    for file in unread:
        console.print(f"{file} cannot be read: the page says why", style="red", soft_wrap=True)
    return FAILED if unread else OK


def compare(first: str, second: str, output: Path) -> int:
    """Compare two results files."""
    files = [places.results(name, output) for name in (first, second)]
    datasets = [runs.open(file) for file in files]
    return terminal_numbers.comparison(files, datasets, runs.compare(*datasets))


def check(name: str | None, every: bool, output: Path) -> int:
    """Hold results against published values."""
    if not every:
        return terminal.checked(runs.open(_results(name, every)[0], output))
    status, datasets = OK, []
    for what in names.names():
        if (output / f"{what}.nc").exists():
            datasets.append(runs.open(what, output))
        elif why := lacking(catalogue.load(what).accuracy.engine):
            console.print(f"{what}: left out: {why}", style="yellow")
        else:
            console.print(f"{what}: not run yet", style="red")
            status = FAILED
    return max([status, terminal.all_claims(datasets), *map(terminal.failures, datasets)])


def plot(
    name: str | None,
    every: bool,
    output: Path | None,
    form: str | None,
    style: str | None,
    variable: str | None,
    study: Path | None,
    against: str | None,
) -> int:
    """Draw results, or a motion."""
    status, look = OK, Look(form, style, variable)
    target = _target(output, form, every)
    for what in _results(name, every):
        results = places.results(what, OUTPUT if target else output)
        dataset = store.read_any(results)
        place = target or look.beside(results if output is None else output / results.name)
        if contents.is_of_a_scene(dataset):
            commands_simulate.draw(dataset, place, against, style)
            drawn = [place]
        else:
            own = None if variable else _own_figure(dataset, study)
            drawn = _drawn(dataset, place, look, own)
        status = status if drawn else FAILED
        for file in drawn:
            console.print(f"{file}")
    return status


def export(file: Path, csv: bool, mat: bool, output: Path | None) -> int:
    """Write a file for other programs, or two."""
    if not csv and not mat:
        raise click.UsageError("say --csv or --mat, or both")
    if csv and mat and output:
        raise click.UsageError(f"{output} is one file: no --csv beside --mat")
    asked = {"csv": (csv, exchange.to_csv), "mat": (mat, exchange.to_mat)}
    files = {output or file.with_suffix(f".{e}"): to for e, (wanted, to) in asked.items() if wanted}
    for path in files:
        if path.exists():
            raise InvalidValue("--output", str(path), "is there already", remedy="Name another.")
    dataset = store.read_any(file)
    for path, write in files.items():
        try:
            write(dataset, path)
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error})") from error
        console.print(f"{path}")
    return OK


def _target(output: Path | None, form: str | None, every: bool) -> Path | None:
    """The file that --output names, if it is a figure and no directory; one that looks like another
    kind of file must be a directory already.
    """
    ending = "" if output is None else output.suffix[1:].lower()
    if output is None or not ending:
        return None
    if ending in FIGURES:
        if every or form not in (None, ending):
            raise click.UsageError(f"{output} is one figure: no --all, nor another --figure")
        return output
    if not output.is_dir():
        rule = "ends in no format that figures are written in"
        remedy = "A directory with such a name must be there already."
        raise InvalidValue("--output", str(output), rule, choices=FIGURES, remedy=remedy)
    return None


# ---- arguments ------------------------------------------------------------------------------


def _results(name: str | None, every: bool) -> list[str]:
    if every == (name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(names.names()) if name is None else [name]


def _declared(
    study: Study, settings: tuple[str, ...], rig: Mapping[str, str | None], **accuracy: Any
) -> Study:
    """A study with the values that options set, on the rig that they state."""
    stated = {name: text for name, text in rig.items() if text is not None}
    if {*stated} - {"load_velocity"} and study.laboratory is None:
        study = lattice.on(study, assignments.laboratory(stated))
        study = replace(study, overrides={**study.overrides, **stated})
        stated = {name: text for name, text in stated.items() if name == "load_velocity"}
    in_si = {"load_velocity": "m/s", **{name: about.units for name, about in STATED.items()}}
    texts = {n: t if number(t) is None else f"{t} {in_si[n]}" for n, t in stated.items()}
    changes = texts | assignments.overrides(study, settings)
    return runs.declaration(study, changes, **accuracy)


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
    """What draws a figure that is not part of rsfstudy: the study file's own, or maps or lines."""
    from rsfstudy import plots

    if contents.declaration(dataset).plot in plots.NAMES:
        if study is not None:
            catalogue.load(str(study))  # for the parts of its scenes
        return None
    try:
        return restore.own_figure(dataset, study)
    except RsfStudyError as error:
        if study is not None:
            raise
        stderr.print(f"note: drawn as maps or lines. {error}")
        return "lines"


def _drawn(dataset: xr.Dataset, path: Path, look: Look, own: Any = None) -> list[Path]:
    """The figure, if it can be drawn; the results are there already."""
    from rsfstudy import plots

    try:
        plots.save(dataset, path, own, variable=look.variable, style=look.style)
    except (OSError, RsfStudyError) as error:
        stderr.print(f"no figure: {error}")
        return []
    return [path]
