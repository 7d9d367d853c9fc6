"""Command ``rsfstudy run``."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import Command
from rsfstudy.cli.printing import print_line, print_note, print_pieces
from rsfstudy.cli.results import EXIT_STATUS_FAILED, EXIT_STATUS_OK, CommandResult, output_result
from rsfstudy.defaults import Defaults
from rsfstudy.errors import Interrupted, RsfStudyError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from rsfstudy import Study
    from rsfstudy.cli.study_results import StudyResults

_FILE_SUFFIX_BY_FORMAT = {"netcdf": "nc", "zarr": "zarr"}


@dataclass(frozen=True)
class StudyRun:
    """Outcome of the run of one study.

    Parameters
    ----------
    study : str
        Name of the study.
    seconds : float, optional
        Elapsed time in s, or None if the study was skipped.
    results : StudyResults, optional
        Results of the study, or None if the run was skipped or did not finish.
    verdicts : pandas.DataFrame, optional
        Verdicts on the claims, or None if the run was skipped or did not finish.
    problems : sequence of str, optional
        Descriptions of failed cells, of changed verdicts, and of a figure that could not be drawn.
    files : sequence of Path, optional
        Paths of the results file and the figure.
    message : str, optional
        Reason why the study was skipped, or error that ended the run.
    """

    study: str
    seconds: float | None = None
    results: StudyResults | None = None
    verdicts: pd.DataFrame | None = None
    problems: Sequence[str] = ()
    files: Sequence[Path] = ()
    message: str = ""

    @property
    def outcome(self) -> str:
        """Label of the outcome: "ok", "failed", "skipped" or "not_finished"."""
        if self.seconds is None:
            return "skipped"
        if self.results is None:
            return "not_finished"
        return "failed" if self.problems else "ok"

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output that describe the run of one study."""
        from rsfstudy.cli.study_results import verdicts_to_json

        claims = [] if self.verdicts is None else verdicts_to_json(self.verdicts, self.study)
        return {
            "study": self.study,
            "outcome": self.outcome,
            "message": self.message,
            "problems": self.problems,
            "seconds": self.seconds,
            "files": self.files,
            "results": None if self.results is None else self.results.json_fields(),
            "claims": claims,
        }


@dataclass(frozen=True)
class Runs(CommandResult):
    """Output of the ``run`` command: outcomes of one or more studies."""

    studies: Sequence[StudyRun]

    @property
    def exit_status(self) -> int:
        """Exit status. The status is 1 if a run failed or did not finish."""
        failed = any(one.outcome in ("failed", "not_finished") for one in self.studies)
        return EXIT_STATUS_FAILED if failed else EXIT_STATUS_OK

    def json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        return {"studies": [one.json_fields() for one in self.studies]}


@click.command(cls=Command)
@options.study_name_or_all_argument
@options.set_values_option
@options.output_option
@options.rtol_option
@options.engine_option
@options.budget_option
@options.worker_options
@click.option("--fresh", is_flag=True, help="Recompute all cells, including finished cells.")
@click.option(
    "--keep-going",
    is_flag=True,
    help="Continue the run even if the first 10 finished cells all failed.",
)
@click.option(
    "--despite-failures", is_flag=True, help="Compute the reductions even if some cells failed."
)
@click.option(
    "--format",
    type=click.Choice(Defaults.RESULT_FORMATS),
    default=Defaults.RESULT_FORMATS[0],
    help="Results format: a single NetCDF file or a chunked Zarr store. Existing Zarr stores "
    "are never overwritten.",
)
@options.figure_options
@options.rig_options
@options.json_option
def run(given: options.CommandOptions) -> int:
    """Run a study and write its results and its figure.

    NAME is the name of a study, or a Python file that declares a study. The command writes the
    results OUTPUT/NAME.nc and the figure OUTPUT/NAME.png, and prints the reductions and the claims.
    To continue an interrupted run, enter the same command again. Finished cells are not recomputed.
    """
    from rsfstudy.api import prepare_run_with_progress
    from rsfstudy.cli.study_options import (
        build_study_from_options,
        open_worker_pool,
        selected_study_names,
    )
    from rsfstudy.execution import OutputOptions

    studies = [build_study_from_options(name, given) for name in selected_study_names(given)]
    skipped = _skip_studies_without_engine(studies) if given.every and given.engine is None else []
    if not given.as_json:
        for one in skipped:
            print_line(f"{one.study}: skipped: {one.message}", style="yellow")
    studies = [study for study in studies if study.name not in {one.study for one in skipped}]
    kept = given.collect_option_values(
        "output", "format", "fresh", "keep_going", "despite_failures", "command_line"
    )
    with open_worker_pool(given, given.output / "workers.log" if given.every else None) as where:
        ready = [
            (s, prepare_run_with_progress(s, OutputOptions(**kept), where, not given.quiet))
            for s in studies
        ]
        for study in studies:
            _print_expected_cost(study, given)
        if not given.every:
            return output_result(
                Runs([_run_study(*ready[0], given)]), _print_nothing, given.as_json
            )
        return _run_studies_in_turn(ready, given, skipped)


def _skip_studies_without_engine(studies: Sequence[Study]) -> list[StudyRun]:
    """Return the studies whose engine is not installed."""
    from rsfstudy.cli.cost_estimates import describe_missing_engine_packages

    missing = {s.name: describe_missing_engine_packages(s.accuracy.engine) for s in studies}
    return [StudyRun(name, message=why) for name, why in missing.items() if why]


def _print_expected_cost(study: Study, given: options.CommandOptions) -> None:
    """Print the estimated cost of a run if the user changed the accuracy.

    If the compiled engine would be faster, the function also recommends this engine.
    """
    from rsfstudy.cli import cost_estimates
    from rsfstudy.execution import CellPlan
    from rsfstudy.motion import Accuracy

    plan = CellPlan(study)
    if given.changes_accuracy and not given.as_json:
        ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_work
        words = f"{study.name}: {ratio:.2g} times the work of rtol {Accuracy.DEFAULT_RTOL:g}"
        print_line(f"{words}, {cost_estimates.describe_study_cost(plan, given.output)}")
    if not (given.every or given.quiet) and (
        text := cost_estimates.compiled_engine_hint(plan, given.output)
    ):
        print_note(f"note: {text}")


def _run_studies_in_turn(
    studies_with_run_functions: Sequence[tuple[Study, Callable[[], xr.Dataset]]],
    given: options.CommandOptions,
    skipped: Sequence[StudyRun],
) -> int:
    """Run studies one after another, and continue after a failed study.

    After Ctrl-C or a signal, the function does not run the remaining studies. The function always
    prints a table with one row per study.
    """
    runs: list[StudyRun] = []
    try:
        for study, compute in studies_with_run_functions:
            began = time.monotonic()
            try:
                runs.append(_run_study(study, compute, given))
            except Interrupted:
                raise
            except RsfStudyError as error:
                print_note(f"error: {error}")
                seconds = time.monotonic() - began
                runs.append(StudyRun(study.name, seconds, message=str(error)))
    except BaseException:
        if not given.as_json:
            _print_runs(Runs([*runs, *skipped]))
        raise
    return output_result(Runs([*runs, *skipped]), _print_runs, given.as_json)


def _run_study(
    study: Study, compute_dataset: Callable[[], xr.Dataset], given: options.CommandOptions
) -> StudyRun:
    """Compute a study, draw its figure, and print a report.

    The report is short if the command runs all studies. With ``--json``, the function does not
    print a report.
    """
    from rsfstudy.cli.figure_files import default_figure_path, draw_and_save_figure
    from rsfstudy.cli.study_results import StudyResults
    from rsfstudy.reporting import summarise_verdicts

    began = time.monotonic()
    dataset = compute_dataset()
    file = given.output / f"{study.name}.{_FILE_SUFFIX_BY_FORMAT[given.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = draw_and_save_figure(dataset, default_figure_path(file, given), given, own)
    results = StudyResults(dataset, str(file))
    verdicts, seconds = results.verdicts, time.monotonic() - began
    _counts, problems = summarise_verdicts(dataset, verdicts)
    if not drawn:
        problems.append("no figure")
    found = StudyRun(study.name, seconds, results, verdicts, problems, [file, *drawn])
    if not given.as_json:
        (_print_short_report if given.every else _print_report)(found)
    return found


def _print_nothing(_runs: Runs) -> None:
    """Print nothing, because the report of a single run has already been printed."""


def _print_report(done: StudyRun) -> None:
    """Print reductions, claims, failed cells and output files of a run."""
    from rsfstudy.cli.study_results import print_failures, print_study_name, print_verdicts
    from rsfstudy.reporting import (
        build_reduction_tables_and_sentences,
        format_status_counts,
        note_on_norms_near_load_velocity,
    )

    assert done.results is not None
    assert done.verdicts is not None
    dataset = done.results.dataset
    print_pieces(build_reduction_tables_and_sentences(dataset))
    if slow := note_on_norms_near_load_velocity(dataset):
        print_line(slow, style="yellow")
    print_study_name(done.results)
    print_verdicts(done.verdicts)
    print_failures(done.results)
    print_line(f"{done.study}: {format_status_counts(dataset)}")
    print_line(f"wrote {' and '.join(map(str, done.files))}", soft_wrap=True)


def _print_short_report(done: StudyRun) -> None:
    """Print a short report of a study, for a run of several studies.

    The report has one line for each table of the full report. Failed cells and verdicts that differ
    from the expected verdicts are listed individually.
    """
    from rsfstudy.cli.study_results import print_failures, print_unexpected_verdicts
    from rsfstudy.formatting import format_duration, format_overrides
    from rsfstudy.reporting import count_verdicts, summarise_study_as_text_lines

    assert done.results is not None
    assert done.verdicts is not None
    assert done.seconds is not None
    dataset, overrides = done.results.dataset, done.results.overrides
    print_line(f"{done.study}: {dataset.attrs['title']}", style="bold", soft_wrap=True)
    for line in (
        *([f"overrides: {format_overrides(overrides)}"] if overrides else []),
        *summarise_study_as_text_lines(dataset),
        f"claims: {count_verdicts(done.verdicts) or '-'}",
        f"in {format_duration(done.seconds)}, wrote {' and '.join(map(str, done.files))}",
    ):
        print_line(f"  {line}", soft_wrap=True)
    print_unexpected_verdicts(done.verdicts)
    print_failures(done.results)


def _print_runs(runs: Runs) -> None:
    """Print a table with one row per study."""
    from rsfstudy.formatting import format_duration
    from rsfstudy.reporting import TextTable, count_verdicts

    colours = {"ok": "green", "skipped": "yellow"}
    texts = {"skipped": "skipped: {}", "not_finished": "not finished", "ok": "ok"}
    rows = [
        {
            "study": one.study,
            "time": "-" if one.seconds is None else format_duration(one.seconds),
            "verdicts": "-" if one.verdicts is None else count_verdicts(one.verdicts) or "-",
            "status": ", ".join(one.problems)
            or texts[one.outcome].format(one.message.partition(" (")[0]),
        }
        for one in runs.studies
    ]
    row_colours = [colours.get(one.outcome, "red") for one in runs.studies]
    print_pieces([TextTable(rows, "", {"verdicts", "status"}, row_colours)])
