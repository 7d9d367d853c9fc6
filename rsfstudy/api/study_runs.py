"""Functions for a study: run it, open its results, check and rerun them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import xarray as xr

from rsfstudy._deprecation import renamed_keywords
from rsfstudy.api import dataset_export
from rsfstudy.api.progress import compile_scenes_with_notice, show_progress
from rsfstudy.api.result_paths import find_results, output_directory
from rsfstudy.defaults import CELL_TIME_LIMIT, OUTPUT_DIRECTORY
from rsfstudy.error_boundary import error_boundary, user_stacklevel
from rsfstudy.errors import IncompleteWarning, InvalidValue, RsfStudyWarning, shorten_text
from rsfstudy.execution import OutputOptions, WorkerPool, prepare_study_run, run_fingerprint
from rsfstudy.measures import Outcome
from rsfstudy.motion import COMPILED, check_engine_is_usable
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import html_table
from rsfstudy.reporting import incomplete_notes, note_on_norms_near_load_velocity
from rsfstudy.slider import Scene, with_scene_field_signature
from rsfstudy.storage import (
    Comparison,
    check_is_of_study,
    compare_results,
    compare_same_lattice,
    find_cell_number,
    find_fingerprint_differences,
    is_of_single_scene,
    read_dataset,
    read_declaration,
    read_provenance,
    rebuild_study,
)
from rsfstudy.study import Study, build_verdict_table, load_study, study_names

if TYPE_CHECKING:
    from rsfstudy.plots import Figure


class StudiesByName(dict[str, Study]):
    """Studies by name; a notebook shows what each is about."""

    def _repr_html_(self) -> str:
        rows = [
            (name, study.title, f"{study.size:,}", ", ".join({c.id: c for c in study.claims}))
            for name, study in self.items()
        ]
        return html_table(("study", "title", "cells", "claims"), rows)


@error_boundary
def studies() -> dict[str, Study]:
    """The named studies, by name."""
    return StudiesByName({name: load_study(name) for name in study_names()})


@error_boundary
@with_scene_field_signature()
def run(
    study: str | Path | Study,
    *,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = OUTPUT_DIRECTORY,
    progress: bool = True,
    fresh: bool = False,
    rtol: float | None = None,
    engine: str | None = None,
    budget: int | None = None,
    time_limit: float = CELL_TIME_LIMIT,
    keep_going: bool = False,
    despite_failures: bool = False,
    format: str = "netcdf",
    command: str = "rsfstudy.run",
    **overrides: Any,
) -> xr.Dataset:
    """Run a study and return its dataset, which is written to ``output/NAME.nc`` too.

    Parameters
    ----------
    study : str, Path or Study
        A named study, the path of a file that declares one, or a study of your own.
    workers : int
        Worker processes of a Dask cluster made for this run; 0 computes in this process.
    client : distributed.Client, optional
        An existing Dask cluster to use instead.
    output : path, optional
        Directory for the results and the journal of finished cells; None writes nothing.
    progress : bool
        Show a progress bar, or lines where the standard error is no terminal.
    fresh : bool
        Forget the finished cells and compute all again.
    rtol : float, optional
        Accuracy of the cells.
    engine : {"scipy", "python", "compiled"}, or a class, optional
        What integrates motions; compiled, which needs Numba, is much faster.
    budget : int, optional
        Right-hand sides a cell may evaluate before it ends as `work_budget_spent`. Cells that have
        an answer keep it where more is allowed.
    time_limit : float
        CPU time in s after which a worker gives up on a cell; for one that sleeps or waits, ten
        times as much wall time. There is no limit in this process (``workers=0``).
    keep_going : bool
        Go on if the first cells all fail, instead of stopping early.
    despite_failures : bool
        Leave failed cells out of the reductions; the results say so.
    format : {"netcdf", "zarr"}
        One NetCDF file, or a Zarr store written in pieces, for lattices that do not fit in memory.
    command : str
        What to note in the history.
    **overrides
        Other axis values (``b_over_a=[2, 3]``), other fixed values of the scene or of the measure
        (``stiffness_ratio=1.1``), or, for a fixed value, a list that makes it an axis.

    Returns
    -------
    xarray.Dataset
        Lattice, reductions and attributes.

    Raises
    ------
    InvalidValue
        For a wrong declaration or override, before anything is computed.
    DataError, RunError
        If results cannot be kept, or the run cannot start or finish.

    Warns
    -----
    IncompleteWarning
        Where cells failed: how many, and with which status; and where a reduction refused to draw
        on its cells, with the reason.
    UserWarning
        Where answers for a rig are for an instability norm near the load point velocity.
    """
    declared = apply_overrides_to_study(study, overrides, rtol=rtol, engine=engine, budget=budget)
    keeping = OutputOptions(
        output=output_directory(output),
        format=format,
        fresh=fresh,
        keep_going=keep_going,
        despite_failures=despite_failures,
        command_line=command,
    )
    with WorkerPool(workers, client, time_limit) as where:
        results = copy_with_cf_encoding(
            prepare_run_with_progress(declared, keeping, where, progress)()
        )
    if told := incomplete_notes(results):
        warnings.warn("; ".join(told), IncompleteWarning, stacklevel=user_stacklevel())
    if slow := note_on_norms_near_load_velocity(results):
        warnings.warn(slow, RsfStudyWarning, stacklevel=user_stacklevel())
    return results


def apply_overrides_to_study(
    study: str | Path | Study, overrides: Mapping[str, Any], **accuracy_fields: Any
) -> Study:
    """A study with other values and fields of its accuracy, those that are not None; checked."""
    declared = study if isinstance(study, Study) else load_study(str(study))
    changes = {name: value for name, value in accuracy_fields.items() if value is not None}
    if changes:
        declared = replace(declared, accuracy=replace(declared.accuracy, **changes))
    return declared.with_(**overrides) if overrides else declared


def prepare_run_with_progress(
    study: Study,
    output_options: OutputOptions,
    worker_pool: WorkerPool,
    show_progress_bar: bool = True,
) -> Callable[[], xr.Dataset]:
    """A function that runs the study, once everything has been checked; `progress` shows how
    far it has come.

    Raises `InvalidValue` for anything wrong with the study or the options.
    """
    check_engine_is_usable(study.accuracy.engine)
    ready = prepare_study_run(study, output_options, worker_pool)

    def run() -> xr.Dataset:
        if study.accuracy.engine == COMPILED:
            compile_scenes_with_notice(
                ready.plan.example_scenes, study.measure.needs_time, show_progress_bar
            )
        with show_progress(study.name, show_progress_bar) as show:
            return ready(worker_pool.make_cell_batch_mapper(ready.worker_log_path), show)

    return run


@error_boundary
def open(name: str | Path, output: str | Path = OUTPUT_DIRECTORY) -> xr.Dataset:
    """Load the results of a named study, or a results file, into memory.

    Raises
    ------
    DataError
        If there is no such file, or it was not written by rsfstudy.
    """
    if not isinstance(name, str | Path):
        raise InvalidValue("name", name, "must be the name of a study, or a path")
    return read_results(find_results(name, output))


def read_results(path: Path) -> xr.Dataset:
    """Load the results of a study, as `read_dataset` does.

    Raises
    ------
    DataError
        If it is missing, unreadable, not written by rsfstudy, damaged, or of one scene.
    """
    dataset = read_dataset(path)
    check_is_of_study(dataset, shorten_text(path))
    return dataset


def _resolve_results_dataset(dataset: xr.Dataset | str | Path) -> xr.Dataset:
    """Results, as they are given or as their file holds them."""
    if not isinstance(dataset, xr.Dataset):
        return open(dataset)
    check_is_of_study(dataset, "the dataset")
    return dataset


@renamed_keywords
@partial(error_boundary, is_called_internally=True)
def plot(
    dataset: xr.Dataset | str | Path,
    variable: str | None = None,
    *,
    style: Any = None,
    user_figure: Any = None,
) -> Figure:
    """The figure of a dataset (or of a named study's results, or of a file), as its study declares
    it; a notebook shows it, and its `savefig` writes it.

    Parameters
    ----------
    dataset : xarray.Dataset, str or Path
    variable : str, optional
        Draw this variable instead: as maps over two numeric axes, else as lines.
    style : path, str, dict or list of those, optional
        A style on top of the style of rsfstudy: a style sheet (a file that ends in
        ``.mplstyle``), the name of a style in ``matplotlib.style.available``, or settings such as
        ``{"font.size": 9, "figure.figsize": (3.5, 2.6)}``, which is one column of a journal in
        inches. All colours and line styles come from ``axes.prop_cycle``. Unknown settings are
        rejected.
    user_figure : function or module, optional
        What draws it, where that is not part of rsfstudy: what ``Study(plot=...)`` was given.

    Returns
    -------
    matplotlib.figure.Figure
        Yours to change: its ``axes`` are the panels, in the order of their letters, and
        ``figure.axes[0].set_title("")`` and its like work as ever.

    Raises
    ------
    InvalidValue
        For a variable or a style that is none, and for a figure that does not fit.
    """
    from rsfstudy.plots import draw_figure

    return draw_figure(
        _resolve_results_dataset(dataset), user_figure, variable=variable, style=style
    )


@error_boundary
def check(dataset: xr.Dataset | str | Path) -> pd.DataFrame:
    """Compare a dataset (or a named study's results, or a file) with the claims of its study.

    Returns
    -------
    pandas.DataFrame
        One row a claim: published value, ours, tolerance and its reason, verdict, and ``moved``
        where the verdict is not the expected one.
    """
    results = _resolve_results_dataset(dataset)
    declared = read_declaration(results)
    return build_verdict_table(results, list(declared.claims), declared.overrides)


@error_boundary
def rerun(
    file: str | Path,
    *,
    study: str | Path | None = None,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = None,
    progress: bool = True,
    time_limit: float = CELL_TIME_LIMIT,
) -> pd.DataFrame:
    """Compute the cells of a results file, or a motion, again from what the file says, and compare
    the numbers.

    Parameters
    ----------
    file : path
        A results file, or that of a motion.
    study : path, optional
        The file that declares the study, where its measure is not part of rsfstudy; code is never
        taken from a results file.
    workers, client, output, progress, time_limit
        As in `run`; by default nothing is written.

    Returns
    -------
    pandas.DataFrame
        One row a variable: how many values are identical, how many there are, the largest
        difference, and how many differ by more than both error estimates. In its ``attrs``, under
        ``differs``, what decides a number and is not as it was.

    Raises
    ------
    InvalidValue
        Where the study's measure or a reduction is not part of rsfstudy.
    DataError, RunError
        Where the file is damaged, or the run cannot finish.
    """
    theirs = read_dataset(find_results(file, OUTPUT_DIRECTORY))
    if is_of_single_scene(theirs):
        if study is not None:
            load_study(str(study))  # for the parts of its scene
        return dataset_export.rerun_motion(theirs)
    declared = rebuild_study(theirs, study)
    place = output_directory(output)
    if place is not None:
        for taken in place.glob(f"{declared.name}.*"):
            rule = f"holds {taken.name}, which this would take the place of"
            raise InvalidValue("output", str(output), rule, remedy="Name another directory.")
    keeping = OutputOptions(
        output=place,
        fresh=True,
        keep_going=True,
        despite_failures="reduced_despite" in theirs.attrs,
        command_line=f"rsfstudy.rerun {file}",
    )
    with WorkerPool(workers, client, time_limit) as where:
        ours = prepare_run_with_progress(declared, keeping, where, progress)()
    return compare_same_lattice(theirs, ours)


@error_boundary
def compare(first: xr.Dataset | str | Path, second: xr.Dataset | str | Path) -> Comparison:
    """Differences between two datasets (or named studies' results, or files): in declaration, in
    what made them, and in numbers, cell by cell where both have the same place on every axis.

    Parameters
    ----------
    first, second : xarray.Dataset, str or Path
        Their lattices may differ.

    Returns
    -------
    Comparison
        Its ``numbers`` is a pandas.DataFrame, one row a variable, which tells in how many cells the
        two differ by more than the sum of both error estimates; ``agrees`` is true where none do,
        no status differs, and there is something to compare.

    Raises
    ------
    InvalidValue
        Where an axis of one has no counterpart in the other, not even a fixed value.
    DataError
        Where a file is missing or damaged.
    """
    return compare_results(_resolve_results_dataset(first), _resolve_results_dataset(second))


@partial(error_boundary, unchanged_exceptions=(Exception,))
def recompute_cell(
    file: str | Path, place: Mapping[str, Any], *, study: str | Path | None = None
) -> tuple[Scene, Outcome]:
    """Compute one cell of a results file alone, in this process; what it raises is not caught.

    Parameters
    ----------
    file : path
        A results file.
    place : mapping of str to value
        Where the cell is: the value, or label, on each axis; numbers may be text too.
    study : path, optional
        The file that declares the study, where its measure is not part of rsfstudy.

    Returns
    -------
    Scene, Outcome

    Raises
    ------
    InvalidValue
        Where there is no such cell.

    Warns
    -----
    UserWarning
        Where something that decides its numbers has changed since the file was made.
    """
    declared, number, differs = _find_cell_in_results_file(file, place, study)
    for name, (theirs, ours) in differs.items():
        text = f"{name}: {theirs} then, {ours} now"
        warnings.warn(text, RsfStudyWarning, stacklevel=user_stacklevel())
    scene, changes = declared.cell(number)
    return scene, declared.measure.with_(**changes)(scene, declared.accuracy)


@partial(error_boundary, is_called_internally=True)
def _find_cell_in_results_file(
    results_file: str | Path, cell_coordinates: Mapping[str, Any], study_file: str | Path | None
) -> tuple[Study, int, Mapping[str, tuple[Any, Any]]]:
    """The study of a file, the number of a cell, and what else decided it and has changed."""
    results = open(results_file)
    number = find_cell_number(results, cell_coordinates)
    declared = rebuild_study(results, study_file)
    now = run_fingerprint(declared)
    return (
        declared,
        number,
        find_fingerprint_differences(read_provenance(results)["fingerprint"], now),
    )
