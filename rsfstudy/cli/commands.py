"""Implementation of the commands for studies and their results.

The module ``command_line`` defines the options of the commands, and imports this module when a
command is called.
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
from rsfstudy.api import (
    apply_overrides_to_study,
    find_results,
    prepare_run_with_progress,
    write_report,
)
from rsfstudy.cli import assignment_parsing, printed_reports
from rsfstudy.cli.console import stderr_console, stdout_console
from rsfstudy.cli.cost_estimates import describe_missing_engine_packages, format_duration
from rsfstudy.cli.export_files import to_csv, to_mat
from rsfstudy.cli.options import CommandOptions
from rsfstudy.cli.printed_reports import EXIT_STATUS_FAILED, EXIT_STATUS_OK, RunSummary
from rsfstudy.defaults import FIGURE_FORMATS, OUTPUT_DIRECTORY
from rsfstudy.error_boundary import check_regular_file
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError
from rsfstudy.execution import OutputOptions, WorkerPool, connect_to_cluster
from rsfstudy.plots import FIGURE_NAMES, save_figure
from rsfstudy.rig import RIG_QUANTITIES, parse_number
from rsfstudy.storage import (
    find_cell_number,
    is_of_single_scene,
    read_dataset,
    read_declaration,
    read_provenance,
)
from rsfstudy.study import convert_study_to_rig_units, load_study, name_of_figure, study_names

_FILE_SUFFIX_BY_FORMAT = {"netcdf": "nc", "zarr": "zarr"}
_SUFFIXES_OF_RESULTS_FILES = (".nc", ".zarr")
_UNIT_OPTION_NAMES = ("stress", "length", "time")


def show(options: CommandOptions) -> int:
    """Print a study or the summary of a results file.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    click.UsageError
        If the command has options that change a study, but prints a results file.
    """
    if Path(options.name).suffix not in _SUFFIXES_OF_RESULTS_FILES:
        printed_reports.print_study_declaration(
            _build_study_from_options(options.name, options), options.output
        )
        return EXIT_STATUS_OK
    if options.settings or options.rtol is not None or options.rig_option_texts:
        raise click.UsageError("a results file is shown as it is, without --set, --rtol or a rig")
    return printed_reports.print_results_summary(
        _read_results_file(Path(options.name), options.study), options.name
    )


def run(options: CommandOptions) -> int:
    """Run a study or all studies.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    studies = [_build_study_from_options(name, options) for name in _selected_study_names(options)]
    left_out = (
        _skip_studies_without_engine(studies) if options.every and options.engine is None else []
    )
    studies = [study for study in studies if study.name not in {end.study for end in left_out}]
    kept = options.collect_option_values(
        "output", "format", "fresh", "keep_going", "despite_failures", "command_line"
    )
    log = options.output / "workers.log" if options.every else None
    with _open_worker_pool(options, log) as where:
        ready = [
            (s, prepare_run_with_progress(s, OutputOptions(**kept), where, not options.quiet))
            for s in studies
        ]
        advice = not (options.every or options.quiet)
        for study in studies:
            printed_reports.print_expected_cost(
                study, options.output, options.rtol is not None, advice
            )
        if options.every:
            return _run_studies_in_turn(ready, options, left_out)
        return (
            EXIT_STATUS_FAILED if _run_study(*ready[0], options).colour == "red" else EXIT_STATUS_OK
        )


def _run_study(
    study: Study, compute_dataset: Callable[[], xr.Dataset], options: CommandOptions
) -> RunSummary:
    """Compute a study, draw its figure and print a report.

    The report is short if all studies are run.
    """
    began = time.monotonic()
    dataset = compute_dataset()
    file = options.output / f"{study.name}.{_FILE_SUFFIX_BY_FORMAT[options.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = _save_figure(dataset, _default_figure_path(file, options), options, own)
    end = printed_reports.summarise_run(dataset, study.name, time.monotonic() - began, bool(drawn))
    (printed_reports.print_short_run_report if options.every else printed_reports.print_run_report)(
        dataset, end, [file, *drawn]
    )
    return end


def _skip_studies_without_engine(studies: Sequence[Study]) -> list[RunSummary]:
    """Print and return the studies whose engine is not installed."""
    ends = []
    for study in studies:
        if why := describe_missing_engine_packages(study.accuracy.engine):
            stdout_console.print(f"{study.name}: left out: {why}", style="yellow")
            text = f"left out: {why.partition(' (')[0]}"
            ends.append(RunSummary(study.name, "-", text, colour="yellow"))
    return ends


def _run_studies_in_turn(
    studies_with_run_functions: Sequence[tuple[Study, Callable[[], xr.Dataset]]],
    options: CommandOptions,
    summaries_of_skipped: Sequence[RunSummary],
) -> int:
    """Run studies one after another, and continue after a failed study.

    The sequence ends early only after Ctrl-C or a signal.
    """
    ends: list[RunSummary] = []
    try:
        for study, compute in studies_with_run_functions:
            began = time.monotonic()
            try:
                ends.append(_run_study(study, compute, options))
            except Interrupted:
                raise
            except RsfStudyError as error:
                stderr_console.print(f"error: {error}")
                ends.append(
                    RunSummary(
                        study.name, format_duration(time.monotonic() - began), "not finished"
                    )
                )
    finally:
        printed_reports.print_run_summaries([*ends, *summaries_of_skipped])
    return EXIT_STATUS_FAILED if any(end.colour == "red" for end in ends) else EXIT_STATUS_OK


def rerun(options: CommandOptions) -> int:
    """Compute a results file or one of its cells again.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    if options.place:
        place = dict(map(assignment_parsing.parse_cell_coordinate, options.place))
        try:
            with warnings.catch_warnings(record=True, action="always") as caught:
                scene, outcome = recompute_cell(options.file, place, study=options.study)
        except RsfStudyError:
            raise
        except Exception:  # the traceback helps to debug the cell
            traceback.print_exc()
            return EXIT_STATUS_FAILED
        results = open_results(options.file)
        index = np.unravel_index(find_cell_number(results, place), results["status"].shape)
        there = results.isel(dict(zip(results["status"].dims, index, strict=True)))
        return printed_reports.print_recomputed_cell(
            scene, outcome, there, [str(one.message) for one in caught]
        )
    with _open_worker_pool(options) as where:
        asked = options.collect_option_values("study", "output", "time_limit") | {
            "progress": not options.quiet
        }
        table = rerun_file(options.file, workers=where.process_count, client=where.client, **asked)
    return printed_reports.print_rerun_agreement(table)


def report(options: CommandOptions) -> int:
    """Write an HTML page of all results in a directory.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    page, unread = write_report(options.directory, options.output)
    stdout_console.print(f"wrote {page}", soft_wrap=True)
    for file in unread:
        stdout_console.print(
            f"{file} cannot be read: the page says why", style="red", soft_wrap=True
        )
    return EXIT_STATUS_FAILED if unread else EXIT_STATUS_OK


def compare(options: CommandOptions) -> int:
    """Compare two results files.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    files = [find_results(name, options.output) for name in (options.first, options.second)]
    datasets = [open_results(file) for file in files]
    return printed_reports.print_comparison(files, datasets, compare_results(*datasets))


def check(options: CommandOptions) -> int:
    """Compare results with published values.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    status, datasets = EXIT_STATUS_OK, []
    for name in _selected_study_names(options):
        if not options.every or (options.output / f"{name}.nc").exists():
            datasets.append(open_results(name, options.output))
        elif why := describe_missing_engine_packages(load_study(name).accuracy.engine):
            stdout_console.print(f"{name}: left out: {why}", style="yellow")
        else:
            stdout_console.print(f"{name}: not run yet", style="red")
            status = EXIT_STATUS_FAILED
    return (
        max(status, printed_reports.print_claims_and_failed_cells(datasets, options.claims))
        if datasets
        else status
    )


def plot(options: CommandOptions) -> int:
    """Draw the figure of results or of a motion.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.
    """
    status, target = EXIT_STATUS_OK, _figure_path_from_output_option(options)
    for name in _selected_study_names(options):
        results = find_results(name, OUTPUT_DIRECTORY if target else options.output)
        dataset = _read_results_file(results, options.study)
        beside = results if options.output is None else options.output / results.name
        place = target or _default_figure_path(beside, options)
        if is_of_single_scene(dataset):
            drawing = dataset.rsf.plot(against=options.against)
            printed_reports.write_figure(drawing, place, options.style)
            drawn = [place]
        else:
            own = None if options.variable else _load_user_figure(dataset, options.study)
            drawn = _save_figure(dataset, place, options, own)
        status = status if drawn else EXIT_STATUS_FAILED
        for file in drawn:
            stdout_console.print(f"{file}")
    return status


def export(options: CommandOptions) -> int:
    """Export results to a CSV file, a MATLAB file, or both.

    Parameters
    ----------
    options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    click.UsageError
        If no file format is chosen.
    InvalidValue
        If an output file exists.
    DataError
        If an output file cannot be written.
    """
    writers = {"csv": to_csv, "mat": to_mat}
    asked = [ending for ending in writers if getattr(options, ending)]
    if not asked:
        raise click.UsageError("say --csv or --mat, or both")
    dataset = read_dataset(options.file)
    paths = {ending: (options.output or options.file).with_suffix(f".{ending}") for ending in asked}
    for path in paths.values():
        if os.path.lexists(path):
            raise InvalidValue("--output", str(path), "is there already", remedy="Name another.")
    if options.units:
        dataset = dataset.rsf.in_units(**dict(zip(_UNIT_OPTION_NAMES, options.units, strict=True)))
    for ending, path in paths.items():
        try:
            writers[ending](dataset, path)
        except OSError as error:
            raise DataError(f"{path}: cannot be written ({error})") from error
        stdout_console.print(f"{path}")
    return EXIT_STATUS_OK


def _read_results_file(file: Path, study_file: Path | None) -> xr.Dataset:
    """Read a results file.

    If a study file is passed, the file is executed first, because the file may define laws or other
    components of the scenes.
    """
    if study_file is not None:
        load_study(str(study_file))
    return read_dataset(file)


# ---- options --------------------------------------------------------------------------------


def _selected_study_names(options: CommandOptions) -> list[str]:
    """Return the requested study name or file, or the names of all studies."""
    if options.every == (options.name is not None):
        raise click.UsageError("name one study, or say --all")
    return list(study_names()) if options.every else [options.name]


def _build_study_from_options(study_name: str, options: CommandOptions) -> Study:
    """Load a study, and apply the overrides and the rig of the options.

    If the rig has a stiffness, the stiffness of the rig replaces the values of a stiffness axis.
    """
    study, stated = load_study(study_name), options.rig_option_texts
    varied = {field for axis in study.axes for field in axis.fields}
    taken = {"load_velocity", *(["stiffness"] * bool(varied & {"stiffness", "stiffness_ratio"}))}
    if {*stated} - taken and study.rig is None:
        rig = {name: text for name, text in stated.items() if name not in taken}
        study = convert_study_to_rig_units(study, assignment_parsing.parse_rig(rig))
        study = replace(study, overrides={**study.overrides, **rig})
        stated = {name: text for name, text in stated.items() if name in taken}
    in_si = {
        "load_velocity": "m/s",
        **{name: about.si_units for name, about in RIG_QUANTITIES.items()},
    }
    texts = {n: t if parse_number(t) is None else f"{t} {in_si[n]}" for n, t in stated.items()}
    changes = texts | assignment_parsing.parse_overrides(study, options.settings)
    return apply_overrides_to_study(
        study, changes, **options.collect_option_values("rtol", "engine", "budget")
    )


@contextlib.contextmanager
def _open_worker_pool(
    options: CommandOptions, log_path: Path | None = None
) -> Iterator[WorkerPool]:
    """Open the worker pool that computes the cells.

    Worker processes write their errors to ``log_path``.
    """
    if options.serial and options.scheduler:
        raise click.UsageError("--serial and --scheduler exclude each other")
    nowhere = contextlib.nullcontext()
    with nowhere if options.scheduler is None else connect_to_cluster(options.scheduler) as client:
        processes = 0 if options.serial else options.workers
        with WorkerPool(processes, client, options.time_limit, log_path) as workers:
            yield workers


# ---- figures --------------------------------------------------------------------------------


def _default_figure_path(results_path: Path, options: CommandOptions) -> Path:
    """Return the path of the figure in the directory of the results.

    The results file need not exist.
    """
    name = results_path.name.removesuffix(".nc").removesuffix(".zarr")
    words = [name, options.variable, options.form or FIGURE_FORMATS[0]]
    return results_path.with_name(".".join(filter(None, words)))


def _figure_path_from_output_option(options: CommandOptions) -> Path | None:
    """Return the path of ``--output`` if it is a figure file.

    If the path is a directory, the function returns None. If the path has the suffix of another
    file type, the path must be an existing directory.
    """
    output: Path | None = options.output
    ending = "" if output is None else output.suffix[1:].lower()
    if output is None or not ending:
        return None
    if ending in FIGURE_FORMATS:
        if options.every or options.form not in (None, ending):
            raise click.UsageError(f"{output} is one figure: no --all, nor another --figure")
        check_regular_file("--output", output)
        return output
    if not output.is_dir():
        rule = "ends in no format that figures are written in"
        remedy = "A directory with such a name must be there already."
        raise InvalidValue("--output", str(output), rule, choices=FIGURE_FORMATS, remedy=remedy)
    return None


def _load_user_figure(dataset: xr.Dataset, study_file: Path | None) -> Any:
    """Load the user-defined figure of a dataset.

    The function returns None if the study uses a figure of rsfstudy. If the figure cannot be loaded
    and the user passed no study file, the function prints a note and returns "lines", so that maps
    or lines are drawn.
    """
    if read_declaration(dataset).plot in FIGURE_NAMES:
        return None
    try:
        return load_user_figure(dataset, study_file)
    except RsfStudyError as error:
        if study_file is not None:
            raise
        stderr_console.print(f"note: drawn as maps or lines. {error}")
        return "lines"


def _save_figure(
    dataset: xr.Dataset, figure_path: Path, options: CommandOptions, user_figure: Any
) -> list[Path]:
    """Save the figure and return its path.

    If the figure cannot be drawn, the function prints a message and returns an empty list, because
    the results have already been written.
    """
    try:
        save_figure(
            dataset, figure_path, user_figure, variable=options.variable, style=options.style
        )
    except (OSError, RsfStudyError) as error:
        stderr_console.print(f"no figure: {error}")
        return []
    return [figure_path]


def load_user_figure(results: xr.Dataset, study_file: str | Path | None = None) -> Any:
    """Load the user-defined figure of a dataset from a study file.

    Parameters
    ----------
    results : xarray.Dataset
        Results of the study.
    study_file : str or Path, optional
        Python file that declares the study. The file is executed.

    Returns
    -------
    callable or None
        Function that draws the figure. The value is None if the study uses a figure of rsfstudy.

    Raises
    ------
    InvalidValue
        If no study file is passed, or if the file does not define the figure.

    Notes
    -----
    The dataset contains the path of the study file, but the function never executes this path,
    because the results may come from an untrusted source.
    """
    name, named_in = (
        read_declaration(results).plot,
        read_provenance(results)["declared_in"],
    )
    if study_file is None:
        remedy = f"Name the file that declares it: --study {named_in or 'FILE'}."
        raise InvalidValue("plot", name, "is no figure of rsfstudy", remedy=remedy)
    study = load_study(str(study_file))
    if study.name != results.attrs["id"] or name_of_figure(study.plot, study.name) != name:
        rule = f"does not draw {name!r} of {results.attrs['id']!r}"
        raise InvalidValue("study", str(study_file), rule)
    return None if isinstance(study.plot, str) else study.plot
