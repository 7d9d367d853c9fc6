"""Functions that run studies and process their results.

The main functions are ``run()`` and ``open()``.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import xarray as xr

from rsfstudy._deprecation import accept_former_keyword_names
from rsfstudy.api import dataset_export
from rsfstudy.api.progress import (
    compile_equations_and_print_time,
    format_reused_cells,
    show_progress,
)
from rsfstudy.api.result_paths import find_results_file, parse_output_path
from rsfstudy.defaults import Defaults
from rsfstudy.errors import IncompleteWarning, InvalidValue, RsfStudyWarning, shorten_text
from rsfstudy.exception_conversion import find_stacklevel_of_user_code, raise_only_rsfstudy_errors
from rsfstudy.execution import (
    OutputOptions,
    ProgressCallback,
    StudyRun,
    WorkerPool,
    collect_run_fingerprint,
    prepare_study_run,
)
from rsfstudy.fitting import Record
from rsfstudy.measures import Outcome
from rsfstudy.motion import Engine
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import HtmlText
from rsfstudy.reporting import (
    format_note_on_low_instability_norms,
    format_notes_on_incomplete_results,
)
from rsfstudy.slider import Scene, SceneFields
from rsfstudy.storage import (
    ResultsComparison,
    StoredDataset,
    compare_results,
    compare_results_of_same_study,
    find_cell_number,
    find_fingerprint_differences,
    read_dataset,
)
from rsfstudy.study import Study, build_verdict_table, list_study_names, load_study

if TYPE_CHECKING:
    from rsfstudy.plots import Figure


class StudiesByName(dict[str, Study]):
    """Dictionary of studies. Notebooks display the dictionary as a table."""

    def _repr_html_(self) -> str:
        """Return an HTML table of the studies."""
        rows = [
            (name, study.title, f"{study.size:,}", ", ".join({c.id: c for c in study.claims}))
            for name, study in self.items()
        ]
        return HtmlText.format_table(("study", "title", "cells", "claims"), rows)


@raise_only_rsfstudy_errors
def studies() -> dict[str, Study]:
    """Return the named studies.

    Returns
    -------
    dict of str to Study
        Studies by name. In a notebook, the dictionary is displayed as a table.

    Examples
    --------
    >>> import rsfstudy
    >>> "linear_stability" in rsfstudy.studies()
    True
    """
    return StudiesByName({name: load_study(name) for name in list_study_names()})


#: Time in s after which the progress of fits is shown.
_FIT_PROGRESS_DELAY_SECONDS = 20.0


@raise_only_rsfstudy_errors
@SceneFields.add_fields_to_signature()
def run(
    study: str | Path | Study,
    *,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = Defaults.OUTPUT_DIRECTORY,
    progress: bool | ProgressCallback = True,
    fresh: bool = False,
    rtol: float | None = None,
    engine: str | None = None,
    budget: int | None = None,
    time_limit: float = Defaults.CELL_CPU_TIME_LIMIT,
    keep_going: bool = False,
    despite_failures: bool = False,
    format: str = "netcdf",
    command: str = "rsfstudy.run",
    **overrides: Any,
) -> xr.Dataset:
    """Run a study, and return the results.

    The results and a journal of finished cells are also written to the output directory. If a run
    is interrupted, the next run continues with the remaining cells.

    Parameters
    ----------
    study : str, Path or Study
        Name of a study, path of a Python file that declares a study, or a study.
    workers : int, default: 2
        Number of worker processes of a local Dask cluster. With 0, the cells are computed in the
        current process.
    client : distributed.Client, optional
        Client of an existing Dask cluster, which replaces the local cluster.
    output : str, Path or None, default: "outputs"
        Directory for the results ``NAME.nc`` and the journal. If None, nothing is written.
    progress : bool or callable, default: True
        If True, show a progress bar. If standard error is not a terminal, lines of text replace the
        bar. A function is called with the number of finished cells and the number of all cells.
    fresh : bool, default: False
        If True, discard the finished cells of previous runs, and compute all cells.
    rtol : float, optional
        Relative tolerance of the computation in each cell. The default is the tolerance that the
        study declares.
    engine : {"scipy", "python", "compiled"} or type, optional
        Engine that integrates the motions. "compiled" is much faster, and requires Numba. A
        user-defined stepper is passed as a class. The default is the engine that the study
        declares.
    budget : int, optional
        Largest number of right-hand side evaluations of a cell. If the budget is exceeded, the
        status of the cell is ``work_budget_spent``. If the budget is increased in a later run,
        finished cells with a result are not recomputed.
    time_limit : float, default: 600.0
        CPU time in s after which a worker stops a cell. A worker also stops a cell after a wall
        time of ten times ``time_limit``, because a cell may wait without using CPU time. The limits
        do not apply if ``workers`` is 0.
    keep_going : bool, default: False
        If True, continue even if the first cells all fail.
    despite_failures : bool, default: False
        If True, compute reductions without the failed cells. The results contain a remark about the
        failed cells.
    format : {"netcdf", "zarr"}, default: "netcdf"
        Format of the results: a NetCDF file, or a Zarr store that is written in chunks. Use Zarr
        for lattices that do not fit into memory.
    command : str, default: "rsfstudy.run"
        Command line to record in the history of the dataset.
    **overrides : object
        Values that replace values of the study: other values of an axis (``b_over_a=[2, 3]``), or
        another value of a field of the scene or the measure (``stiffness_ratio=1.1``). A list for a
        fixed field turns the field into an axis.

    Returns
    -------
    xarray.Dataset
        Results on the lattice, with the axes of the study as dimensions. The variables are the
        outputs of the measure and their errors, the reductions, and ``status``, ``message``,
        ``rhs_evaluations`` and ``wall_time`` of each cell. The coordinates include the fields of
        the scene. The attributes contain the declaration and the provenance of the study. Each
        variable has the attribute ``units``, and ``scale`` if the variable is normalised.

    Raises
    ------
    InvalidValue
        If the study or an override is invalid. The error is raised before any cell is computed.
    DataError
        If the results cannot be written.
    RunError
        If the run cannot start or finish.

    Warns
    -----
    IncompleteWarning
        If cells failed, or if a reduction could not be computed because of failed cells.
    UserWarning
        If a study of a rig has results for which the instability norm is close to the load point
        velocity.

    See Also
    --------
    rsfstudy.open : Load the results of a study into memory.
    rsfstudy.rerun : Recompute the results in a file, and compare the values.

    Examples
    --------
    >>> from rsfstudy import Axis, Scene, Study, run
    >>> from rsfstudy.measures import LinearStability
    >>> study = Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=Scene(normal_stress="constant", a=0.01),
    ...     axes=[Axis("b_over_a", [1.5, 2.0])],
    ...     measure=LinearStability(),
    ... )
    >>> results = run(study, workers=0, output=None, progress=False)
    >>> results["critical_stiffness"].values.round(6)
    array([0.005, 0.01 ])
    >>> results["critical_stiffness"].dims
    ('b_over_a',)

    Override the values of the axis:

    >>> results = run(study, workers=0, output=None, progress=False, b_over_a=[3.0])
    >>> results["critical_stiffness"].values.round(6)
    array([0.02])
    """
    declared = apply_overrides_to_study(study, overrides, rtol=rtol, engine=engine, budget=budget)
    keeping = OutputOptions(
        output=parse_output_path(output),
        format=format,
        fresh=fresh,
        keep_going=keep_going,
        despite_failures=despite_failures,
        command_line=command,
    )
    with WorkerPool(workers, client, time_limit) as where:
        results = copy_with_cf_encoding(
            make_run_function_with_progress(declared, keeping, where, progress)()
        )
    if told := format_notes_on_incomplete_results(results):
        warnings.warn("; ".join(told), IncompleteWarning, stacklevel=find_stacklevel_of_user_code())
    if slow := format_note_on_low_instability_norms(results):
        warnings.warn(slow, RsfStudyWarning, stacklevel=find_stacklevel_of_user_code())
    return results


def apply_overrides_to_study(
    study: str | Path | Study, overrides: Mapping[str, Any], **accuracy_fields: Any
) -> Study:
    """Return a copy of a study with overridden values and accuracy settings.

    Parameters
    ----------
    study : str, Path or Study
        Name of a study, path of a Python file that declares a study, or a study.
    overrides : mapping of str to object
        Values that replace values of the axes, the scene or the measure.
    **accuracy_fields : object
        Fields of ``Accuracy``, such as ``rtol``. A value of None leaves the field unchanged.

    Returns
    -------
    Study
        Study with the overrides.

    Raises
    ------
    InvalidValue
        If an override is invalid.
    """
    declared = study if isinstance(study, Study) else load_study(str(study))
    changes = {name: value for name, value in accuracy_fields.items() if value is not None}
    if changes:
        declared = replace(declared, accuracy=replace(declared.accuracy, **changes))
    return declared.with_(**overrides) if overrides else declared


@dataclass(frozen=True)
class StudyRunWithProgress:
    """Callable object that runs a study and shows the progress of the run.

    Parameters
    ----------
    study_run : StudyRun
        Run of the study.
    worker_pool : WorkerPool
        Workers that compute the cells.
    show_progress_bar : bool or callable
        If True, show the progress of the run, or report it to a function.
    """

    study_run: StudyRun
    worker_pool: WorkerPool
    show_progress_bar: bool | ProgressCallback

    def __call__(self) -> xr.Dataset:
        """Compile the equations if necessary, run the study, and return the results."""
        ready, study = self.study_run, self.study_run.study
        if study.accuracy.engine == Engine.COMPILED:
            compile_equations_and_print_time(
                ready.plan.example_scenes,
                study.measure.needs_time,
                self.show_progress_bar is True,
            )
        # Fits of a record usually take a few seconds, and then need no progress report.
        is_fit = study.plot == "fits"
        appearance: Any = (
            {"item_name": "fits", "delay_seconds": _FIT_PROGRESS_DELAY_SECONDS} if is_fit else {}
        )
        with show_progress(study.name, self.show_progress_bar, **appearance) as show:
            mapper = self.worker_pool.make_cell_batch_mapper(ready.worker_log_path)
            return ready(mapper, show)

    @property
    def note_on_reused_cells(self) -> str:
        """Number of cells that an earlier run has stored, as a sentence, or an empty string."""
        reused = self.study_run.reused_cell_count
        total = len(self.study_run.plan.unique_cell_numbers)
        return format_reused_cells(reused, total) if reused else ""


def make_run_function_with_progress(
    study: Study,
    output_options: OutputOptions,
    worker_pool: WorkerPool,
    show_progress_bar: bool | ProgressCallback = True,
) -> StudyRunWithProgress:
    """Check a study, and return a function that runs the study.

    Parameters
    ----------
    study : Study
        Study to run.
    output_options : OutputOptions
        Options for the output of the run.
    worker_pool : WorkerPool
        Workers that compute the cells.
    show_progress_bar : bool or callable, default: True
        If True, show the progress of the run. A function is called with the number of finished
        cells, the number of all cells, and the estimated remaining time in s, or None.

    Returns
    -------
    StudyRunWithProgress
        Function without arguments that runs the study and returns the results.

    Raises
    ------
    InvalidValue
        If the study or an option is invalid.
    """
    Engine.check_is_usable(study.accuracy.engine)
    ready = prepare_study_run(study, output_options, worker_pool)
    return StudyRunWithProgress(ready, worker_pool, show_progress_bar)


@raise_only_rsfstudy_errors
def open(name: str | Path, output: str | Path = Defaults.OUTPUT_DIRECTORY) -> xr.Dataset:
    """Load the results of a study into memory.

    Parameters
    ----------
    name : str or Path
        Name of a study, path of a Python file that declares a study, or path of a results file
        (``.nc`` or ``.zarr``).
    output : str or Path, default: "outputs"
        Directory of the results, if ``name`` is not the path of a results file.

    Returns
    -------
    xarray.Dataset
        Results, as returned by ``rsfstudy.run``.

    Raises
    ------
    InvalidValue
        If ``name`` is neither a path nor the name of a study.
    DataError
        If the file does not exist, if it is damaged, or if rsfstudy has not written it.

    See Also
    --------
    rsfstudy.run : Run a study, and return the results.

    Examples
    --------
    >>> import tempfile
    >>> import rsfstudy
    >>> from rsfstudy.measures import LinearStability
    >>> study = rsfstudy.Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=rsfstudy.Scene(normal_stress="constant", a=0.01),
    ...     axes=[rsfstudy.Axis("b_over_a", [1.5, 2.0])],
    ...     measure=LinearStability(),
    ... )
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     _ = rsfstudy.run(study, workers=0, output=directory, progress=False)
    ...     results = rsfstudy.open("example", output=directory)
    >>> results["b_over_a"].values
    array([1.5, 2. ])
    """
    if not isinstance(name, str | Path):
        raise InvalidValue("name", name, "must be the name of a study, or a path")
    return read_study_results(find_results_file(name, output))


def read_study_results(path: Path) -> xr.Dataset:
    """Load a results file into memory.

    Parameters
    ----------
    path : Path
        Path of the file.

    Returns
    -------
    xarray.Dataset
        Results of a study.

    Raises
    ------
    DataError
        If the file does not exist, if it is damaged, if rsfstudy has not written it, or if it
        belongs to one scene.
    """
    dataset = read_dataset(path)
    StoredDataset(dataset).check_contains_study_results(shorten_text(path))
    return dataset


def _open_dataset_if_name_or_path(dataset: xr.Dataset | str | Path) -> xr.Dataset:
    """Return a results dataset, loading the results if a name or path is passed."""
    if not isinstance(dataset, xr.Dataset):
        return open(dataset)
    StoredDataset(dataset).check_contains_study_results("the dataset")
    return dataset


@accept_former_keyword_names
@partial(raise_only_rsfstudy_errors, applies_to_internal_calls=True)
def plot(
    dataset: xr.Dataset | str | Path,
    variable: str | None = None,
    *,
    style: Any = None,
    width: Any = None,
    header: bool = True,
    user_figure: Any = None,
) -> Figure:
    """Plot the results of a study.

    Parameters
    ----------
    dataset : xarray.Dataset, str or Path
        Results of a study, name of a study, or path of a results file.
    variable : str, optional
        Name of a variable to plot. If the lattice has two numeric axes, the variable is plotted as
        maps, and otherwise as lines. By default, the figure that the study declares is plotted.
    style : path, str, dict or list, optional
        Style that overrides the style of rsfstudy: the path of a style sheet with the suffix
        ``.mplstyle``, the name of a style in ``matplotlib.style.available``, a dictionary of
        matplotlib settings, or a list of styles. For example, ``{"font.size": 9}`` selects larger
        letters. Colours and line styles follow ``axes.prop_cycle``.
    width : quantity, optional
        Width of the figure, from "60 mm" to "600 mm". If the panels of a row would be narrower than
        55 mm, the row has fewer panels. By default, the figure is as wide as a column (84 mm) or
        the text (174 mm) of a journal page.
    header : bool, default: True
        If False, the figure has no header. The header lists overrides of the study, and missing and
        failed cells.
    user_figure : callable, module or Figure, optional
        User-defined figure: a function ``draw(dataset, axes)``, a module with a function ``draw``,
        or an ``rsfstudy.Figure``. The argument is required if the study was declared with a
        user-defined figure, because results files contain no code.

    Returns
    -------
    matplotlib.figure.Figure
        Figure, which can be modified with the methods of matplotlib. ``figure.axes`` contains the
        panels in the order of their letters. A notebook displays the figure, and ``figure.savefig``
        writes it to a file.

    Raises
    ------
    InvalidValue
        If the variable does not exist, if the width is invalid, if the style is invalid or contains
        an unknown setting, or if the figure cannot be drawn from the dataset.

    See Also
    --------
    rsfstudy.plot_motion : Plot a motion or a limit cycle.
    rsfstudy.plot_record : Plot a laboratory record.

    Examples
    --------
    >>> from rsfstudy import Axis, Scene, Study, plot, run
    >>> from rsfstudy.measures import LinearStability
    >>> study = Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=Scene(normal_stress="constant", a=0.01),
    ...     axes=[Axis("b_over_a", [1.5, 2.0, 3.0])],
    ...     measure=LinearStability(),
    ... )
    >>> figure = plot(run(study, workers=0, output=None, progress=False))
    >>> figure.axes[0].get_xlabel() != ""
    True
    """
    from rsfstudy.plots import draw_figure

    if isinstance(dataset, Record):
        remedy = "Call rsfstudy.plot_record(record)."
        raise InvalidValue("dataset", dataset, "must not be a record", remedy=remedy)
    dataset = _open_dataset_if_name_or_path(dataset)
    return draw_figure(
        dataset, user_figure, variable=variable, style=style, width=width, header=header
    )


@raise_only_rsfstudy_errors
def check(dataset: xr.Dataset | str | Path) -> pd.DataFrame:
    """Compare the results of a study with the published values in its claims.

    Parameters
    ----------
    dataset : xarray.Dataset, str or Path
        Results of a study, name of a study, or path of a results file.

    Returns
    -------
    pandas.DataFrame
        Table with one row per claim. The columns include the published value ``published``, the
        value ``computed``, ``tolerance``, the ``reason`` for the tolerance, ``verdict`` and
        ``verdict_changed``, which is True if the verdict differs from the expected verdict. If
        overrides change the conditions of a claim, the claim does not apply.

    Raises
    ------
    DataError
        If the dataset is not the result of a study, or if the file cannot be read.
    InvalidValue
        If the argument is neither a dataset nor the name of a study or a path.

    See Also
    --------
    rsfstudy.Claim : Claim of a study.

    Examples
    --------
    >>> from rsfstudy import Axis, Claim, Scene, Study, check, run
    >>> from rsfstudy.measures import LinearStability
    >>> study = Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=Scene(normal_stress="constant", a=0.01),
    ...     axes=[Axis("b_over_a", [1.5, 2.0])],
    ...     measure=LinearStability(),
    ... )
    >>> len(check(run(study, workers=0, output=None, progress=False)))
    0
    """
    results = _open_dataset_if_name_or_path(dataset)
    declared = StoredDataset(results).study_declaration
    return build_verdict_table(results, list(declared.claims), declared.overrides)


@raise_only_rsfstudy_errors
def rerun(
    file: str | Path,
    *,
    study: str | Path | None = None,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = None,
    progress: bool = True,
    time_limit: float = Defaults.CELL_CPU_TIME_LIMIT,
) -> pd.DataFrame:
    """Recompute the results in a file, and compare the values.

    The function recreates the study or the scene from the file. The function never executes code
    from a results file.

    Parameters
    ----------
    file : str or Path
        Path of a results file or of a motion, or name of a study.
    study : str or Path, optional
        Path of the Python file that declares the study. The argument is required if the measure or
        a reduction is not part of rsfstudy.
    workers : int, default: 2
        Number of worker processes of a local Dask cluster. With 0, the cells are computed in the
        current process.
    client : distributed.Client, optional
        Client of an existing Dask cluster, which replaces the local cluster.
    output : str or Path, optional
        Directory for the new results. The directory must not contain results of the same study. By
        default, nothing is written.
    progress : bool, default: True
        If True, show the progress of the run.
    time_limit : float, default: 600.0
        CPU time in s after which a worker stops a cell.

    Returns
    -------
    pandas.DataFrame
        Table with one row per variable. The columns are ``variable``, ``values`` (number of
        values), ``identical`` (number of identical values), ``largest_difference``, and
        ``beyond_errors`` (number of values that differ by more than the sum of both error
        estimates, or NaN if there are no error estimates). The dictionary ``attrs["differs"]`` of
        the table lists differences in provenance that affect the results.

    Raises
    ------
    InvalidValue
        If the measure or a reduction is not part of rsfstudy and ``study`` is not passed, or if
        ``output`` already contains results of the study.
    DataError
        If the file is damaged, or if the motion in the file cannot be recomputed.
    RunError
        If the run cannot start or finish.

    See Also
    --------
    rsfstudy.compare : Compare two datasets.
    rsfstudy.recompute_cell : Recompute one cell of a results file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import rsfstudy
    >>> scene = rsfstudy.Scene(load_velocity_ratio=2.0)
    >>> motion = rsfstudy.simulate(scene, duration=1.0)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     file = Path(directory) / "motion.nc"
    ...     _ = motion.to_netcdf(file)
    ...     table = rsfstudy.rerun(file)
    >>> bool((table["identical"] == table["values"]).all())
    True
    """
    theirs = read_dataset(find_results_file(file, Defaults.OUTPUT_DIRECTORY))
    if StoredDataset(theirs).is_of_single_scene:
        if study is not None:
            load_study(str(study))  # The file defines user-defined parts of the scene.
        return dataset_export.rerun_and_compare_motion(theirs)
    declared = StoredDataset(theirs).rebuild_study(study)
    place = parse_output_path(output)
    if place is not None:
        for taken in place.glob(f"{declared.name}.*"):
            rule = f"contains {taken.name}, which would be overwritten"
            raise InvalidValue("output", str(output), rule, remedy="Choose another directory.")
    keeping = OutputOptions(
        output=place,
        fresh=True,
        keep_going=True,
        despite_failures="reduced_despite" in theirs.attrs,
        command_line=f"rsfstudy.rerun {file}",
    )
    with WorkerPool(workers, client, time_limit) as where:
        ours = make_run_function_with_progress(declared, keeping, where, progress)()
    return compare_results_of_same_study(theirs, ours)


@raise_only_rsfstudy_errors
def compare(first: xr.Dataset | str | Path, second: xr.Dataset | str | Path) -> ResultsComparison:
    """Compare two datasets of results.

    The function compares the declarations, the provenance and the values. Values are compared for
    cells that have the same coordinates on all axes.

    Parameters
    ----------
    first, second : xarray.Dataset, str or Path
        Results of a study, name of a study, or path of a results file. The two lattices may differ.

    Returns
    -------
    ResultsComparison
        Differences between the datasets. The attribute ``agreement_table`` is a table with one row
        per variable, which includes the number of values that differ by more than the sum of both
        error estimates. The attribute ``agrees`` is True if the datasets have common cells, all
        common cells have the same status, and no value differs beyond the errors.

    Raises
    ------
    InvalidValue
        If an axis of one dataset corresponds neither to an axis nor to a fixed value of the other
        dataset.
    DataError
        If a file does not exist or is damaged.

    See Also
    --------
    rsfstudy.rerun : Recompute the results in a file, and compare the values.

    Examples
    --------
    >>> from rsfstudy import Axis, Scene, Study, compare, run
    >>> from rsfstudy.measures import LinearStability
    >>> study = Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=Scene(normal_stress="constant", a=0.01),
    ...     axes=[Axis("b_over_a", [1.5, 2.0])],
    ...     measure=LinearStability(),
    ... )
    >>> first = run(study, workers=0, output=None, progress=False)
    >>> second = run(study, workers=0, output=None, progress=False, b_over_a=[2.0, 3.0])
    >>> comparison = compare(first, second)
    >>> comparison.agrees, comparison.finished_cell_counts
    (True, (1, 1, 1))
    """
    return compare_results(
        _open_dataset_if_name_or_path(first), _open_dataset_if_name_or_path(second)
    )


@partial(raise_only_rsfstudy_errors, unchanged_exceptions=(Exception,))
def recompute_cell(
    file: xr.Dataset | str | Path, place: Mapping[str, Any], *, study: str | Path | None = None
) -> tuple[Scene, Outcome]:
    """Recompute one cell of a results dataset in the current process.

    Exceptions that the computation raises are not caught, so that a debugger can inspect them.

    Parameters
    ----------
    file : xarray.Dataset, str or Path
        Results of a study, path of a results file, or name of a study.
    place : mapping of str to object
        Coordinates of the cell: the value or label on each axis. Numbers may be passed as strings.
    study : str or Path, optional
        Path of the Python file that declares the study. The argument is required if the measure is
        not part of rsfstudy.

    Returns
    -------
    scene : Scene
        Scene of the cell.
    outcome : Outcome
        Status, values, message and number of right-hand side evaluations of the cell.

    Raises
    ------
    InvalidValue
        If the cell does not exist.
    DataError
        If the file does not exist or is damaged.

    Warns
    -----
    UserWarning
        If a dependency of the results, such as the version of the code, has changed since the file
        was written.

    See Also
    --------
    rsfstudy.rerun : Recompute all cells of a results file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import rsfstudy
    >>> from rsfstudy.measures import LinearStability
    >>> study = rsfstudy.Study(
    ...     name="example",
    ...     title="Critical stiffness",
    ...     base=rsfstudy.Scene(normal_stress="constant", a=0.01),
    ...     axes=[rsfstudy.Axis("b_over_a", [1.5, 2.0])],
    ...     measure=LinearStability(),
    ... )
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     _ = rsfstudy.run(study, workers=0, output=directory, progress=False)
    ...     file = Path(directory) / "example.nc"
    ...     scene, outcome = rsfstudy.recompute_cell(file, {"b_over_a": 1.5})
    >>> round(outcome.values["critical_stiffness"], 6)
    0.005
    """
    declared, number, differs = _find_cell_in_results_file(file, place, study)
    for name, (theirs, ours) in differs.items():
        text = f"{name}: {theirs} in the file, {ours} now"
        warnings.warn(text, RsfStudyWarning, stacklevel=find_stacklevel_of_user_code())
    scene, changes = declared.cell(number)
    return scene, declared.measure.with_(**changes)(scene, declared.accuracy)


@partial(raise_only_rsfstudy_errors, applies_to_internal_calls=True)
def _find_cell_in_results_file(
    results_or_path: xr.Dataset | str | Path,
    cell_coordinates: Mapping[str, Any],
    study_file: str | Path | None,
) -> tuple[Study, int, Mapping[str, tuple[Any, Any]]]:
    """Find one cell in the results of a study.

    Returns
    -------
    study : Study
        Study of the results.
    number : int
        Number of the cell in row-major order.
    differences : mapping of str to (object, object)
        Stored value and current value of each dependency that has changed, such as the version of
        the code.
    """
    results = _open_dataset_if_name_or_path(results_or_path)
    number = find_cell_number(results, cell_coordinates)
    declared = StoredDataset(results).rebuild_study(study_file)
    now = collect_run_fingerprint(declared, [declared.scene(number)])
    return (
        declared,
        number,
        find_fingerprint_differences(StoredDataset(results).provenance["fingerprint"], now),
    )
