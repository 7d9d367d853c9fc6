"""What the commands on studies and their results do; `command_line` says how each is spelt, and
loads this when one is called.
"""

from __future__ import annotations

import contextlib
import os
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import xarray as xr

from rsfstudy import Study, recompute_cell
from rsfstudy import compare as compare_results
from rsfstudy import open as open_results
from rsfstudy import rerun as rerun_file
from rsfstudy.api import apply_overrides, find_results, prepare_run, write_report
from rsfstudy.cli import assignments, printing
from rsfstudy.cli.console import console, stderr
from rsfstudy.cli.cost import format_duration, missing_packages
from rsfstudy.cli.export_files import to_csv, to_mat
from rsfstudy.cli.options import CommandOptions
from rsfstudy.cli.printing import FAILED, OK, RunSummary
from rsfstudy.defaults import FIGURE_FORMATS, OUTPUT_DIRECTORY
from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError
from rsfstudy.execution import OutputOptions, Workers, connect_to_cluster
from rsfstudy.plots import FIGURE_NAMES, save_figure
from rsfstudy.rig import RIG_QUANTITIES, parse_number
from rsfstudy.storage import (
    find_cell_number,
    is_single_scene,
    read_dataset,
    read_declaration,
    read_provenance,
)
from rsfstudy.study import figure_name, load_study, study_names, with_rig

_FILE_SUFFIXES = {"netcdf": "nc", "zarr": "zarr"}
_RESULT_SUFFIXES = (".nc", ".zarr")
_UNIT_KINDS = ("stress", "length", "time")


def show(given: CommandOptions) -> int:
    """Show a study, or a results file."""
    if Path(given.name).suffix not in _RESULT_SUFFIXES:
        printing.print_declaration(_build_study(given.name, given), given.output)
        return OK
    if given.settings or given.rtol is not None or given.rig:
        raise click.UsageError("a results file is shown as it is, without --set, --rtol or a rig")
    return printing.print_results(_read_file(Path(given.name), given.study), given.name)


def run(given: CommandOptions) -> int:
    """Run a study, or all."""
    studies = [_build_study(name, given) for name in _selected_names(given)]
    left_out = _skip_studies_without_engine(studies) if given.every and given.engine is None else []
    studies = [study for study in studies if study.name not in {end.study for end in left_out}]
    kept = given.select("output", "format", "fresh", "keep_going", "despite_failures", "command")
    log = given.output / "workers.log" if given.every else None
    with _open_workers(given, log) as where:
        ready = [
            (s, prepare_run(s, OutputOptions(**kept), where, not given.quiet)) for s in studies
        ]
        advice = not (given.every or given.quiet)
        for study in studies:
            printing.print_expected_cost(study, given.output, given.rtol is not None, advice)
        if given.every:
            return _run_all(ready, given, left_out)
        return FAILED if _run_study(*ready[0], given).colour == "red" else OK


def _run_study(
    study: Study, compute: Callable[[], xr.Dataset], given: CommandOptions
) -> RunSummary:
    """Compute a study, draw it and print what came out, in short where others follow."""
    began = time.monotonic()
    dataset = compute()
    file = given.output / f"{study.name}.{_FILE_SUFFIXES[given.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = _save_figure(dataset, _default_figure_path(file, given), given, own)
    end = printing.run_summary(dataset, study.name, time.monotonic() - began, bool(drawn))
    (printing.print_short if given.every else printing.print_report)(dataset, end, [file, *drawn])
    return end


def _skip_studies_without_engine(studies: Sequence[Study]) -> list[RunSummary]:
    """Name the studies whose engine is not installed."""
    ends = []
    for study in studies:
        if why := missing_packages(study.accuracy.engine):
            console.print(f"{study.name}: left out: {why}", style="yellow")
            text = f"left out: {why.partition(' (')[0]}"
            ends.append(RunSummary(study.name, "-", text, colour="yellow"))
    return ends


def _run_all(
    ready: Sequence[tuple[Study, Callable[[], xr.Dataset]]],
    given: CommandOptions,
    left_out: Sequence[RunSummary],
) -> int:
    """Run one study after the other, even if some fail; only Ctrl-C ends them all."""
    ends: list[RunSummary] = []
    try:
        for study, compute in ready:
            began = time.monotonic()
            try:
                ends.append(_run_study(study, compute, given))
            except Interrupted:
                raise
            except RsfStudyError as error:
                stderr.print(f"error: {error}")
                ends.append(
                    RunSummary(
                        study.name, format_duration(time.monotonic() - began), "not finished"
                    )
                )
    finally:
        printing.print_run_summaries([*ends, *left_out])
    return FAILED if any(end.colour == "red" for end in ends) else OK


def rerun(given: CommandOptions) -> int:
    """Compute a results file anew, or one cell of it."""
    if given.place:
        place = dict(map(assignments.parse_cell_coordinate, given.place))
        try:
            with warnings.catch_warnings(record=True, action="always") as caught:
                scene, outcome = recompute_cell(given.file, place, study=given.study)
        except RsfStudyError:
            raise
        except Exception:  # it fails as it fails
            traceback.print_exc()
            return FAILED
        results = open_results(given.file)
        index = np.unravel_index(find_cell_number(results, place), results["status"].shape)
        there = results.isel(dict(zip(results["status"].dims, index, strict=True)))
        return printing.print_outcome(scene, outcome, there, [str(one.message) for one in caught])
    with _open_workers(given) as where:
        asked = given.select("study", "output", "time_limit") | {"progress": not given.quiet}
        table = rerun_file(given.file, workers=where.processes, client=where.client, **asked)
    return printing.print_agreement(table)


def report(given: CommandOptions) -> int:
    """Write a page of all results."""
    page, unread = write_report(given.directory, given.output)
    console.print(f"wrote {page}", soft_wrap=True)
    for file in unread:
        console.print(f"{file} cannot be read: the page says why", style="red", soft_wrap=True)
    return FAILED if unread else OK


def compare(given: CommandOptions) -> int:
    """Compare two results files."""
    files = [find_results(name, given.output) for name in (given.first, given.second)]
    datasets = [open_results(file) for file in files]
    return printing.print_comparison(files, datasets, compare_results(*datasets))


def check(given: CommandOptions) -> int:
    """Hold results against published values."""
    status, datasets = OK, []
    for name in _selected_names(given):
        if not given.every or (given.output / f"{name}.nc").exists():
            datasets.append(open_results(name, given.output))
        elif why := missing_packages(load_study(name).accuracy.engine):
            console.print(f"{name}: left out: {why}", style="yellow")
        else:
            console.print(f"{name}: not run yet", style="red")
            status = FAILED
    return max(status, printing.print_checks(datasets, given.claims)) if datasets else status


def plot(given: CommandOptions) -> int:
    """Draw results, or a motion."""
    status, target = OK, _figure_target(given)
    for name in _selected_names(given):
        results = find_results(name, OUTPUT_DIRECTORY if target else given.output)
        dataset = _read_file(results, given.study)
        beside = results if given.output is None else given.output / results.name
        place = target or _default_figure_path(beside, given)
        if is_single_scene(dataset):
            drawing = dataset.rsf.plot(against=given.against)
            printing.write_figure(drawing, place, given.style)
            drawn = [place]
        else:
            own = None if given.variable else _load_user_figure(dataset, given.study)
            drawn = _save_figure(dataset, place, given, own)
        status = status if drawn else FAILED
        for file in drawn:
            console.print(f"{file}")
    return status


def export(given: CommandOptions) -> int:
    """Write a file for other programs, or two."""
    writers = {"csv": to_csv, "mat": to_mat}
    asked = [ending for ending in writers if getattr(given, ending)]
    if not asked:
        raise click.UsageError("say --csv or --mat, or both")
    dataset = read_dataset(given.file)
    paths = {ending: (given.output or given.file).with_suffix(f".{ending}") for ending in asked}
    for path in paths.values():
        if os.path.lexists(path):
            raise InvalidValue("--output", str(path), "is there already", remedy="Name another.")
    if given.units:
        dataset = dataset.rsf.in_units(**dict(zip(_UNIT_KINDS, given.units, strict=True)))
    for ending, path in paths.items():
        try:
            writers[ending](dataset, path)
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error})") from error
        console.print(f"{path}")
    return OK


def _read_file(file: Path, study: Path | None) -> xr.Dataset:
    """What a file holds, once the parts of its scenes are known that a study file defines."""
    if study is not None:
        load_study(str(study))
    return read_dataset(file)


# ---- what options say -----------------------------------------------------------------------


def _selected_names(given: CommandOptions) -> list[str]:
    """The study or file that is named, or all studies."""
    if given.every == (given.name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(study_names()) if given.every else [given.name]


def _build_study(name: str, given: CommandOptions) -> Study:
    """A study with the values that options set, on the rig that they state, whose stiffness takes
    the place of those on an axis.
    """
    study, stated = load_study(name), given.rig
    varied = {field for axis in study.axes for field in axis.fields}
    taken = {"load_velocity", *(["stiffness"] * bool(varied & {"stiffness", "stiffness_ratio"}))}
    if {*stated} - taken and study.rig is None:
        rig = {name: text for name, text in stated.items() if name not in taken}
        study = with_rig(study, assignments.parse_rig(rig))
        study = replace(study, overrides={**study.overrides, **rig})
        stated = {name: text for name, text in stated.items() if name in taken}
    in_si = {
        "load_velocity": "m/s",
        **{name: about.units for name, about in RIG_QUANTITIES.items()},
    }
    texts = {n: t if parse_number(t) is None else f"{t} {in_si[n]}" for n, t in stated.items()}
    changes = texts | assignments.parse_overrides(study, given.settings)
    return apply_overrides(study, changes, **given.select("rtol", "engine", "budget"))


@contextlib.contextmanager
def _open_workers(given: CommandOptions, log: Path | None = None) -> Iterator[Workers]:
    """Where cells are computed; `log` is where worker processes write errors."""
    if given.serial and given.scheduler:
        raise click.UsageError("--serial and --scheduler exclude each other")
    nowhere = contextlib.nullcontext()
    with nowhere if given.scheduler is None else connect_to_cluster(given.scheduler) as client:
        processes = 0 if given.serial else given.workers
        with Workers(processes, client, given.time_limit, log) as workers:
            yield workers


# ---- figures --------------------------------------------------------------------------------


def _default_figure_path(results: Path, given: CommandOptions) -> Path:
    """The figure beside results, which may be no file."""
    name = results.name.removesuffix(".nc").removesuffix(".zarr")
    words = [name, given.variable, given.form or FIGURE_FORMATS[0]]
    return results.with_name(".".join(filter(None, words)))


def _figure_target(given: CommandOptions) -> Path | None:
    """The file that --output names, if it is a figure and no directory; one that looks like another
    kind of file must be a directory already.
    """
    output: Path | None = given.output
    ending = "" if output is None else output.suffix[1:].lower()
    if output is None or not ending:
        return None
    if ending in FIGURE_FORMATS:
        if given.every or given.form not in (None, ending):
            raise click.UsageError(f"{output} is one figure: no --all, nor another --figure")
        check_regular_file("--output", output)
        return output
    if not output.is_dir():
        rule = "ends in no format that figures are written in"
        remedy = "A directory with such a name must be there already."
        raise InvalidValue("--output", str(output), rule, choices=FIGURE_FORMATS, remedy=remedy)
    return None


def _load_user_figure(dataset: xr.Dataset, study: Path | None) -> Any:
    """What draws a figure that is not part of rsfstudy: the study file's own, or maps or lines."""
    if read_declaration(dataset).plot in FIGURE_NAMES:
        return None
    try:
        return load_user_figure(dataset, study)
    except RsfStudyError as error:
        if study is not None:
            raise
        stderr.print(f"note: drawn as maps or lines. {error}")
        return "lines"


def _save_figure(dataset: xr.Dataset, path: Path, given: CommandOptions, own: Any) -> list[Path]:
    """The figure, if it can be drawn; the results are there already."""
    try:
        save_figure(dataset, path, own, variable=given.variable, style=given.style)
    except (OSError, RsfStudyError) as error:
        stderr.print(f"no figure: {error}")
        return []
    return [path]


def load_user_figure(results: xr.Dataset, file: str | Path | None = None) -> Any:
    """The figure that a user wrote for a dataset, from the file that declares the study. The file
    that the dataset names is not run unasked, because the results may come from a stranger.

    Raises
    ------
    InvalidValue
        Where no file is given, or it has no such figure.
    """
    name, named_in = (
        read_declaration(results).plot,
        read_provenance(results)["declared_in"],
    )
    if file is None:
        remedy = f"Name the file that declares it: --study {named_in or 'FILE'}."
        raise InvalidValue("plot", name, "is no figure of rsfstudy", remedy=remedy)
    study = load_study(str(file))
    if study.name != results.attrs["id"] or figure_name(study.plot, study.name) != name:
        rule = f"does not draw {name!r} of {results.attrs['id']!r}"
        raise InvalidValue("study", str(file), rule)
    return None if isinstance(study.plot, str) else study.plot
