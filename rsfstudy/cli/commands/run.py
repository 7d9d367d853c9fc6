"""Command ``rsfstudy run``."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rsfstudy.cli import options
from rsfstudy.cli.command_group import CommandWithOptionsObject
from rsfstudy.cli.command_results import (
    EXIT_STATUS_FAILED,
    EXIT_STATUS_OK,
    CommandResult,
    print_result_as_text_or_json,
)
from rsfstudy.cli.printing import print_line, print_on_stderr, print_tables_and_sentences
from rsfstudy.defaults import Defaults
from rsfstudy.errors import Interrupted, RsfStudyError

if TYPE_CHECKING:
    import pandas as pd

    from rsfstudy import Study
    from rsfstudy.api import StudyRunWithProgress
    from rsfstudy.cli.study_results import StudyResults

_FILE_SUFFIX_BY_FORMAT = {"netcdf": "nc", "zarr": "zarr"}


@dataclass(frozen=True)
class StudyRunOutcome:
    """Outcome of the run of one study.

    Parameters
    ----------
    study_name : str
        Name of the study.
    elapsed_seconds : float, optional
        Elapsed time in s, or None if the study was skipped.
    study_results : StudyResults, optional
        Results of the study, or None if the run was skipped or did not finish.
    claim_verdicts : pandas.DataFrame, optional
        Verdicts on the claims, or None if the run was skipped or did not finish.
    failure_descriptions : sequence of str, optional
        Descriptions of failed cells, of changed verdicts, and of a figure that could not be drawn.
    output_files : sequence of Path, optional
        Paths of the results file and the figure.
    reason_for_missing_results : str, optional
        Reason why the study was skipped, or error that ended the run.
    note_on_reused_cells : str, optional
        Note on the number of cells that an earlier run has stored.
    """

    study_name: str
    elapsed_seconds: float | None = None
    study_results: StudyResults | None = None
    claim_verdicts: pd.DataFrame | None = None
    failure_descriptions: Sequence[str] = ()
    output_files: Sequence[Path] = ()
    reason_for_missing_results: str = ""
    note_on_reused_cells: str = ""

    @property
    def outcome_label(self) -> str:
        """Label of the outcome: "ok", "failed", "skipped" or "not_finished"."""
        if self.elapsed_seconds is None:
            return "skipped"
        if self.study_results is None:
            return "not_finished"
        return "failed" if self.failure_descriptions else "ok"

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output that describe the run of one study."""
        from rsfstudy.cli.study_results import convert_verdicts_to_json

        claims = (
            []
            if self.claim_verdicts is None
            else convert_verdicts_to_json(self.claim_verdicts, self.study_name)
        )
        return {
            "study": self.study_name,
            "outcome": self.outcome_label,
            "message": self.reason_for_missing_results,
            "problems": self.failure_descriptions,
            "seconds": self.elapsed_seconds,
            "files": self.output_files,
            "results": None if self.study_results is None else self.study_results.to_json_fields(),
            "claims": claims,
        }


@dataclass(frozen=True)
class RunCommandResult(CommandResult):
    """Output of the ``run`` command: outcomes of one or more studies."""

    study_run_outcomes: Sequence[StudyRunOutcome]

    @property
    def exit_status(self) -> int:
        """Exit status. The status is 1 if a run failed or did not finish."""
        failed = any(
            one.outcome_label in ("failed", "not_finished") for one in self.study_run_outcomes
        )
        return EXIT_STATUS_FAILED if failed else EXIT_STATUS_OK

    def to_json_fields(self) -> dict[str, Any]:
        """Return the fields of the JSON output."""
        return {"studies": [one.to_json_fields() for one in self.study_run_outcomes]}


@click.command(cls=CommandWithOptionsObject)
@options.study_name_or_all_argument
@options.set_axis_values_option
@options.output_directory_option
@options.rtol_option
@options.engine_option
@options.evaluation_budget_option
@options.worker_pool_options
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
def run(command_options: options.CommandOptions) -> int:
    """Run a study and write its results and its figure.

    NAME is the name of a study, or a Python file that declares a study. The command writes the
    results OUTPUT/NAME.nc and the figure OUTPUT/NAME.png, and prints the reductions and the claims.
    To continue an interrupted run, enter the same command again. Finished cells are not recomputed.
    """
    from rsfstudy.api import make_run_function_with_progress
    from rsfstudy.cli.study_options import (
        build_study_from_options,
        list_selected_study_names,
        open_worker_pool,
    )
    from rsfstudy.execution import OutputOptions

    studies = [
        build_study_from_options(name, command_options)
        for name in list_selected_study_names(command_options)
    ]
    skipped = (
        _find_studies_with_missing_engine(studies)
        if command_options.every and command_options.engine is None
        else []
    )
    if not command_options.as_json:
        for one in skipped:
            print_line(
                f"{one.study_name}: skipped: {one.reason_for_missing_results}", style="yellow"
            )
    studies = [study for study in studies if study.name not in {one.study_name for one in skipped}]
    kept = command_options.collect_option_values(
        "output", "format", "fresh", "keep_going", "despite_failures", "command_line"
    )
    runs: list[StudyRunWithProgress] = []
    log = command_options.output / "workers.log" if command_options.every else None
    with (
        _name_complete_file_after_interrupt(runs),
        open_worker_pool(command_options, log) as where,
    ):
        is_shown = not command_options.quiet
        for study in studies:
            kept_by_run = OutputOptions(**kept)
            runs.append(make_run_function_with_progress(study, kept_by_run, where, is_shown))
        ready = list(zip(studies, runs, strict=True))
        for study in studies:
            _print_expected_cost(study, command_options)
        if not command_options.every:
            return print_result_as_text_or_json(
                RunCommandResult([_run_study(*ready[0], command_options)]),
                _print_nothing,
                command_options.as_json,
            )
        return _run_studies_in_turn(ready, command_options, skipped)


@contextlib.contextmanager
def _name_complete_file_after_interrupt(runs: Sequence[StudyRunWithProgress]) -> Iterator[None]:
    """Report the path of a complete results file if the run is interrupted."""
    try:
        yield
    except KeyboardInterrupt as error:
        written = [run.study_run for run in runs if run.study_run.written_path is not None]
        if not written:
            raise
        study_name, file = written[-1].study.name, written[-1].written_path
        raise Interrupted(
            f"{study_name}: {str(error) or 'interrupted'} after the results were written. {file} "
            f"is complete. If the figure is missing, use rsfstudy plot {file}"
        ) from error


def _find_studies_with_missing_engine(studies: Sequence[Study]) -> list[StudyRunOutcome]:
    """Return the studies whose engine is not installed."""
    from rsfstudy.cli.cost_estimates import describe_missing_engine_packages

    missing = {s.name: describe_missing_engine_packages(s.accuracy.engine) for s in studies}
    return [
        StudyRunOutcome(name, reason_for_missing_results=why)
        for name, why in missing.items()
        if why
    ]


def _print_expected_cost(study: Study, command_options: options.CommandOptions) -> None:
    """Print the estimated cost of a run if the user changed the accuracy.

    If the compiled engine would be faster, the function also recommends this engine.
    """
    from rsfstudy.cli import cost_estimates
    from rsfstudy.execution import CellPlan
    from rsfstudy.motion import Accuracy

    plan = CellPlan(study)
    if command_options.is_rtol_specified and not command_options.as_json:
        ratio = study.measure.expected_work(study.accuracy) / study.measure.typical_rhs_evaluations
        words = f"{study.name}: {ratio:.2g} times the work of rtol {Accuracy.DEFAULT_RTOL:g}"
        print_line(f"{words}, {cost_estimates.describe_study_cost(plan, command_options.output)}")
    if not (command_options.every or command_options.quiet) and (
        text := cost_estimates.suggest_compiled_engine(plan, command_options.output)
    ):
        print_on_stderr(f"note: {text}")


def _run_studies_in_turn(
    studies_with_run_functions: Sequence[tuple[Study, StudyRunWithProgress]],
    command_options: options.CommandOptions,
    skipped_run_outcomes: Sequence[StudyRunOutcome],
) -> int:
    """Run studies one after another, and continue after a failed study.

    After Ctrl-C or a signal, the function does not run the remaining studies. The function always
    prints a table with one row per study.
    """
    runs: list[StudyRunOutcome] = []
    try:
        for study, compute in studies_with_run_functions:
            began = time.monotonic()
            try:
                runs.append(_run_study(study, compute, command_options))
            except Interrupted:
                raise
            except RsfStudyError as error:
                print_on_stderr(f"error: {error}")
                seconds = time.monotonic() - began
                runs.append(
                    StudyRunOutcome(study.name, seconds, reason_for_missing_results=str(error))
                )
    except BaseException:
        if not command_options.as_json:
            _print_table_of_study_runs(RunCommandResult([*runs, *skipped_run_outcomes]))
        raise
    return print_result_as_text_or_json(
        RunCommandResult([*runs, *skipped_run_outcomes]),
        _print_table_of_study_runs,
        command_options.as_json,
    )


def _run_study(
    study: Study, compute_dataset: StudyRunWithProgress, command_options: options.CommandOptions
) -> StudyRunOutcome:
    """Compute a study, draw its figure, and print a report.

    The report is short if the command runs all studies. With ``--json``, the function does not
    print a report.
    """
    from rsfstudy.cli.figure_files import build_default_figure_path, draw_and_save_figure
    from rsfstudy.cli.study_results import StudyResults
    from rsfstudy.reporting import summarise_verdicts_and_failures

    began = time.monotonic()
    dataset = compute_dataset()
    file = command_options.output / f"{study.name}.{_FILE_SUFFIX_BY_FORMAT[command_options.format]}"
    own = None if isinstance(study.plot, str) else study.plot
    drawn = draw_and_save_figure(
        dataset, build_default_figure_path(file, command_options), command_options, own
    )
    results = StudyResults(dataset, str(file))
    verdicts, seconds = results.claim_verdicts, time.monotonic() - began
    _counts, problems = summarise_verdicts_and_failures(dataset, verdicts)
    if not drawn:
        problems.append("no figure")
    reused = compute_dataset.note_on_reused_cells
    found = StudyRunOutcome(
        study.name, seconds, results, verdicts, problems, [file, *drawn], "", reused
    )
    if not command_options.as_json:
        (_print_short_study_report if command_options.every else _print_study_report)(found)
    return found


def _print_nothing(_command_result: RunCommandResult) -> None:
    """Print nothing, because the report of a single run has already been printed."""


def _print_study_report(run_outcome: StudyRunOutcome) -> None:
    """Print reductions, claims, failed cells and output files of a run."""
    from rsfstudy.cli.study_results import print_failed_cells, print_study_heading, print_verdicts
    from rsfstudy.reporting import (
        build_reduction_tables_and_sentences,
        format_note_on_low_instability_norms,
        format_status_counts,
    )

    assert run_outcome.study_results is not None
    assert run_outcome.claim_verdicts is not None
    dataset = run_outcome.study_results.dataset
    print_tables_and_sentences(build_reduction_tables_and_sentences(dataset))
    if slow := format_note_on_low_instability_norms(dataset):
        print_line(slow, style="yellow")
    print_study_heading(run_outcome.study_results)
    print_verdicts(run_outcome.claim_verdicts)
    print_failed_cells(run_outcome.study_results)
    print_line(f"{run_outcome.study_name}: {format_status_counts(dataset)}")
    if note := run_outcome.note_on_reused_cells:
        print_line(f"{note}, and the evaluations include these cells")
    print_line(f"wrote {' and '.join(map(str, run_outcome.output_files))}", soft_wrap=True)


def _print_short_study_report(run_outcome: StudyRunOutcome) -> None:
    """Print a short report of a study, for a run of several studies.

    The report has one line for each table of the full report. Failed cells and verdicts that differ
    from the expected verdicts are listed individually.
    """
    from rsfstudy.cli.study_results import print_failed_cells, print_unexpected_verdicts
    from rsfstudy.formatting import format_duration, format_overrides
    from rsfstudy.reporting import format_verdict_counts, summarise_study_as_text_lines

    assert run_outcome.study_results is not None
    assert run_outcome.claim_verdicts is not None
    assert run_outcome.elapsed_seconds is not None
    dataset, overrides = run_outcome.study_results.dataset, run_outcome.study_results.overrides
    print_line(f"{run_outcome.study_name}: {dataset.attrs['title']}", style="bold", soft_wrap=True)
    for line in (
        *([f"overrides: {format_overrides(overrides)}"] if overrides else []),
        *summarise_study_as_text_lines(dataset),
        *([note] if (note := run_outcome.note_on_reused_cells) else []),
        f"claims: {format_verdict_counts(run_outcome.claim_verdicts) or '-'}",
        f"in {format_duration(run_outcome.elapsed_seconds)}, wrote "
        f"{' and '.join(map(str, run_outcome.output_files))}",
    ):
        print_line(f"  {line}", soft_wrap=True)
    print_unexpected_verdicts(run_outcome.claim_verdicts)
    print_failed_cells(run_outcome.study_results)


def _print_table_of_study_runs(command_result: RunCommandResult) -> None:
    """Print a table with one row per study."""
    from rsfstudy.formatting import format_duration
    from rsfstudy.reporting import TextTable, format_verdict_counts

    colours = {"ok": "green", "skipped": "yellow"}
    texts = {"skipped": "skipped: {}", "not_finished": "not finished", "ok": "ok"}
    rows = [
        {
            "study": one.study_name,
            "time": "-" if one.elapsed_seconds is None else format_duration(one.elapsed_seconds),
            "verdicts": "-"
            if one.claim_verdicts is None
            else format_verdict_counts(one.claim_verdicts) or "-",
            "status": ", ".join(one.failure_descriptions)
            or texts[one.outcome_label].format(one.reason_for_missing_results.partition(" (")[0]),
        }
        for one in command_result.study_run_outcomes
    ]
    row_colours = [
        colours.get(one.outcome_label, "red") for one in command_result.study_run_outcomes
    ]
    print_tables_and_sentences([TextTable(rows, "", {"verdicts", "status"}, row_colours)])
