"""Functions that create studies and worker pools from the options of a command."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import xarray as xr

from rsfstudy import Study
from rsfstudy.api import apply_overrides_to_study
from rsfstudy.cli import assignment_parsing
from rsfstudy.cli.options import CommandOptions
from rsfstudy.execution import WorkerPool, connect_to_cluster
from rsfstudy.rig import Rig, parse_number
from rsfstudy.storage import read_dataset
from rsfstudy.study import convert_study_to_rig_units, list_study_names, load_study


def list_selected_study_names(command_options: CommandOptions) -> list[str]:
    """Return the requested study name or file, or the names of all studies.

    Parameters
    ----------
    command_options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    list of str
        Names of studies, or paths of files.

    Raises
    ------
    click.UsageError
        If the user passed both a name and ``--all``, or neither of them.
    """
    if command_options.every == (command_options.name is not None):
        raise click.UsageError("Pass either the name of a study or --all, not both.")
    return list(list_study_names()) if command_options.every else [command_options.name]


def build_study_from_options(study_name: str, command_options: CommandOptions) -> Study:
    """Load a study, and apply the values of ``--set`` and the rig options.

    If the rig has a stiffness and the study has a stiffness axis, the stiffness of the rig replaces
    the values of the axis.

    Parameters
    ----------
    study_name : str
        Name of a study, or path of a study file.
    command_options : CommandOptions
        Arguments and options of the command.

    Returns
    -------
    Study
        Study with the changed values.

    Raises
    ------
    InvalidValue
        If an option is invalid.
    """
    study, stated = load_study(study_name), command_options.rig_option_texts
    varied = {field for axis in study.axes for field in axis.fields}
    taken = {"load_velocity", *(["stiffness"] * bool(varied & {"stiffness", "stiffness_ratio"}))}
    if {*stated} - taken and study.rig is None:
        rig = {name: text for name, text in stated.items() if name not in taken}
        study = convert_study_to_rig_units(study, assignment_parsing.build_rig_from_options(rig))
        study = replace(study, overrides={**study.overrides, **rig})
        stated = {name: text for name, text in stated.items() if name in taken}
    in_si = {
        "load_velocity": "m/s",
        **{name: about.si_units for name, about in Rig.QUANTITIES.items()},
    }
    texts = {n: t if parse_number(t) is None else f"{t} {in_si[n]}" for n, t in stated.items()}
    changes = texts | assignment_parsing.parse_overrides(study, command_options.settings)
    return apply_overrides_to_study(
        study, changes, **command_options.collect_option_values("rtol", "engine", "budget")
    )


@contextlib.contextmanager
def open_worker_pool(
    command_options: CommandOptions, log_path: Path | None = None
) -> Iterator[WorkerPool]:
    """Open the worker pool that computes the cells.

    Parameters
    ----------
    command_options : CommandOptions
        Arguments and options of the command.
    log_path : Path, optional
        File for the error output of the worker processes.

    Yields
    ------
    WorkerPool
        Pool of local worker processes or, if the user specified a scheduler, of cluster workers.

    Raises
    ------
    click.UsageError
        If the options are contradictory.
    """
    if command_options.serial and command_options.scheduler:
        raise click.UsageError("--serial and --scheduler cannot be combined. Omit one of them.")
    nowhere = contextlib.nullcontext()
    with (
        nowhere
        if command_options.scheduler is None
        else connect_to_cluster(command_options.scheduler) as client
    ):
        processes = 0 if command_options.serial else command_options.workers
        with WorkerPool(processes, client, command_options.time_limit, log_path) as workers:
            yield workers


def read_results_file(file: Path, study_file: Path | None) -> xr.Dataset:
    """Read a results file.

    If a study file is passed, the function first executes the study file, because the study file
    may define laws or other parts of the scenes.

    Parameters
    ----------
    file : Path
        Results file.
    study_file : Path or None
        Python file that declares the study.

    Returns
    -------
    xarray.Dataset
        Contents of the results file.
    """
    if study_file is not None:
        load_study(str(study_file))
    return read_dataset(file, allow_tables=True)
