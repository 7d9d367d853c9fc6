"""Run of a study.

Calling a ``StudyRun`` computes the missing cells, adds each finished cell to the journal, assembles
the dataset, applies the reductions and writes the results file.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from rsfstudy.defaults import Defaults
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError, RunError
from rsfstudy.execution import provenance
from rsfstudy.execution.cell_computation import CellBatchMapper, CellJournalRows, SharedCellSettings
from rsfstudy.execution.cell_plan import CellBatchIterator, CellPlan, order_cells_by_golden_section
from rsfstudy.execution.remaining_time_estimate import RemainingTimeEstimator
from rsfstudy.reductions import apply_reductions
from rsfstudy.status import Status
from rsfstudy.storage import (
    CellJournal,
    CellResultArrays,
    ZarrStore,
    assemble_study_dataset,
    convert_attributes_for_netcdf,
    write_dataset,
)
from rsfstudy.study import Study

#: Status names of cells whose worker process ended before the cell was finished.
_STATUSES_OF_LOST_CELLS = (Status.WORKER_LOST.name, Status.TIME_LIMIT_SPENT.name)
_NAMES_OF_ANSWER_STATUSES = frozenset(status.name for status in Status if status.is_answer)
#: Number of failed cells after which a run ends early, provided that no cell has succeeded.
_MAX_FAILURES_WITHOUT_SUCCESS = 10

#: Function of the number of finished cells, the number of all cells, and the estimated remaining
#: time in s. The time is None if it is unknown.
ProgressCallback = Callable[[int, int, float | None], None]


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Options for the output files of a run and for the handling of failed cells.

    Parameters
    ----------
    output : Path or None, default: None
        Directory for the results file and the journal. If None, the run writes no files.
    format : {"netcdf", "zarr"}, default: "netcdf"
        Format of the results. A Zarr store is written in slabs, so the lattice does not need to fit
        in memory.
    fresh : bool, default: False
        If True, delete the journal and compute all cells again.
    keep_going : bool, default: False
        If True, the run continues even if the first cells have all failed.
    despite_failures : bool, default: False
        If True, the reductions ignore failed cells. If False, a reduction that depends on a failed
        cell has no result.
    command_line : str, default: "rsfstudy.run"
        Command line or Python call of the user. The results file contains this text in its history.

    Raises
    ------
    InvalidValue
        If the format is unknown. The error is also raised if the format is "zarr" and there is no
        output directory or the package zarr is not installed.
    """

    output: Path | None = None
    format: str = "netcdf"
    fresh: bool = False
    keep_going: bool = False
    despite_failures: bool = False
    command_line: str = "rsfstudy.run"

    def __post_init__(self) -> None:
        """Check the format and the output directory."""
        if self.format not in Defaults.RESULT_FORMATS:
            raise InvalidValue("format", self.format, "is unknown", choices=Defaults.RESULT_FORMATS)
        if self.format == "zarr":
            ZarrStore.check_zarr_is_installed()
            if self.output is None:
                raise InvalidValue("output", None, "must be a directory if the format is Zarr")


class StudyRun:
    """Run of a study.

    Calling a ``StudyRun`` object computes the missing cells and writes the results.

    Parameters
    ----------
    study : Study
        Study to run.
    options : OutputOptions
        Output files, and handling of failed cells.
    cell_settings : SharedCellSettings
        Scene, measure and accuracy of the cells.
    workers : int, default: 1
        Number of cells that are computed at the same time. The sizes of the batches depend on this
        number.

    Raises
    ------
    InvalidValue
        If the scene of a cell is invalid, or if a reduction or a claim cannot be applied to the
        lattice. The constructor performs these checks, so errors are raised before any cell is
        computed.

    Attributes
    ----------
    reused_cell_count : int
        Number of cells that an earlier run has stored, and that the run therefore did not compute.
    written_path : Path or None
        Path of the results if the run has written them completely, and None otherwise.
    """

    def __init__(
        self,
        study: Study,
        options: OutputOptions,
        cell_settings: SharedCellSettings,
        workers: int = 1,
    ) -> None:
        self.study, self.options, self.cell_settings, self.workers = (
            study,
            options,
            cell_settings,
            workers,
        )
        self.reused_cell_count = 0
        self.written_path: Path | None = None
        self.plan = CellPlan(study)
        self.provenance = provenance.collect_provenance(
            study, options.command_line, self.plan.example_scenes
        )
        self._check_reductions_and_claims()

    def _check_reductions_and_claims(self) -> None:
        """Check that the reductions and claims of the study can be applied.

        The check uses a lattice whose cells are all pending, so mistakes in a study are found
        before any cell is computed. If the user changed values of the study, for example with
        ``--set``, the claims are not checked.
        """
        pending = CellResultArrays.build_for_pending_cells(
            self.study.size, self.cell_settings.output_packer.packed_number_count
        )
        lattice = assemble_study_dataset(
            self.study, self.plan.lattice_coordinates, pending, self.provenance
        )
        for reduction in self.study.reductions:
            try:
                lattice = apply_reductions(lattice, (reduction,))
            except RsfStudyError:
                raise
            except Exception as error:
                rule = f"does not fit this lattice: {type(error).__name__}: {error}"
                raise InvalidValue("reduction", reduction.name, rule) from error
        for claim in () if self.study.overrides else self.study.claims:
            claim.check_applies_to_dataset(lattice)

    def build_output_path(self, file_suffix: str) -> Path:
        """Return the path of an output file of this run.

        Parameters
        ----------
        file_suffix : str
            Suffix of the file name. The file name consists of the name of the study and the suffix.

        Returns
        -------
        Path
            Path in the output directory.
        """
        assert self.options.output is not None
        return self.options.output / f"{self.study.name}{file_suffix}"

    @property
    def worker_log_path(self) -> Path | None:
        """Path of the worker log, or None if there is no output directory."""
        return None if self.options.output is None else self.build_output_path(".workers.log")

    def __call__(
        self, cell_batch_mapper: CellBatchMapper, progress_callback: ProgressCallback
    ) -> xr.Dataset:
        """Compute the missing cells, and write the results.

        When all cells are finished, the method assembles the dataset, applies the reductions and
        writes the results file.

        Parameters
        ----------
        cell_batch_mapper : callable
            Function that computes the cells: ``cell_computation.compute_cell_batches_serially``, or
            the result of ``worker_pool.make_dask_batch_mapper``.
        progress_callback : callable
            Function that is called with the number of finished cells, the number of all cells, and
            the estimated remaining time.

        Returns
        -------
        xarray.Dataset
            Results of the study.

        Raises
        ------
        DataError
            If the results cannot be written, or if the journal contains cells that were computed
            with different settings.
        RunError
            If the run cannot continue. The finished cells are stored in the journal. If the output
            format is NetCDF, they are also stored in the file ``NAME.partial.nc``.
        Interrupted
            If the user interrupts the run. The finished cells are stored in the same way as for
            ``RunError``.
        """
        keeping = self.options
        if keeping.format == "zarr":
            ZarrStore(self.build_output_path(".zarr")).check_does_not_exist()
        path = None if keeping.output is None else self.build_output_path(".cells.sqlite")
        fingerprint, layout = self.provenance["fingerprint"], self.cell_settings.output_packer
        with CellJournal(path, fingerprint, layout, fresh=keeping.fresh) as journal:
            try:
                self._compute_missing_cells(journal, cell_batch_mapper, progress_callback)
                return self._write_results(journal)
            except (KeyboardInterrupt, RunError) as error:
                if self.written_path is not None:
                    raise
                raise self._save_partial_results(journal, error) from error
            except DataError as error:
                raise DataError(f"{error} {self._describe_how_to_resume(journal)}") from error

    def _compute_missing_cells(
        self,
        journal: CellJournal,
        cell_batch_mapper: CellBatchMapper,
        progress_callback: ProgressCallback,
    ) -> None:
        """Compute the cells that are missing from the journal or that failed in an earlier run."""
        cells = self.plan.unique_cell_numbers
        # Failed cells are computed again.
        answered = journal.read_statuses(self.plan.keys[cells]) < int(Status.WORK_BUDGET_SPENT)
        missing = order_cells_by_golden_section(cells[~answered])
        self.reused_cell_count = int(answered.sum())
        done, failed, total = self.reused_cell_count, 0, len(cells)
        progress_callback(done, total, None)
        if self.worker_log_path is not None:
            self.worker_log_path.unlink(missing_ok=True)  # An earlier run may have left this file.
        if not len(missing):
            return
        batches = CellBatchIterator(self.plan, missing, self.workers)
        estimate = RemainingTimeEstimator(self.workers)
        with contextlib.closing(cell_batch_mapper(self.cell_settings, batches)) as arriving:
            for finished in arriving:
                journal.add_cells(finished)
                self._warn_of_lost_cells(finished)
                for row in finished:
                    batches.record_cell_time(row[4])
                    estimate.record_cell_time(row[4])
                    failed += row[1] not in _NAMES_OF_ANSWER_STATUSES
                done += len(finished)
                progress_callback(done, total, estimate.estimate_remaining_seconds(total - done))
                if (
                    failed == done >= _MAX_FAILURES_WITHOUT_SUCCESS
                    and done < total
                    and not self.options.keep_going
                ):
                    _key, status, message, *_ = row
                    raise RunError(
                        f"all of the first {done} cells failed. The last of these cells has the "
                        f"status {Status[status].label}{': ' * bool(message)}{message}. Correct "
                        "the cause, or continue with --keep-going (keep_going=True)"
                    )

    def _warn_of_lost_cells(self, finished_cells: CellJournalRows) -> None:
        """Warn about cells that were lost because their worker process ended."""
        for key, status, message, *_ in finished_cells:
            if status in _STATUSES_OF_LOST_CELLS:
                cell = int(np.flatnonzero(self.plan.keys == np.void(key))[0])
                warnings.warn(
                    f"cell {self.study.describe_cell(cell)} failed, {Status[status].label}: "
                    f"{message}. The run continues with the other cells.",
                    stacklevel=2,
                )

    # ---- from cells to results ------------------------------------------------------------------

    def _write_results(self, journal: CellJournal) -> xr.Dataset:
        """Assemble the dataset, apply the reductions and write the results."""
        zarr = self.options.format == "zarr"
        try:
            results = (
                self._write_zarr_in_slabs(journal)
                if zarr
                else self._apply_reductions(self.assemble_lattice_dataset(journal))
            )
        except RsfStudyError:
            raise
        except Exception as error:  # A reduction may raise any exception.
            raise RunError(f"a reduction failed ({type(error).__name__}: {error})") from error
        if self.options.output is None:
            return convert_attributes_for_netcdf(results)
        path = self.build_output_path(".zarr" if zarr else ".nc")
        written = results if zarr else write_dataset(results, path)
        self.written_path = path
        for stale in (".partial.nc", ".partial.png"):
            self.build_output_path(stale).unlink(missing_ok=True)
        return written

    def assemble_lattice_dataset(self, journal: CellJournal) -> xr.Dataset:
        """Assemble a dataset from the cells in the journal, without reductions.

        Parameters
        ----------
        journal : CellJournal
            Journal of the run.

        Returns
        -------
        xarray.Dataset
            Dataset with all cells of the study. Cells that are not in the journal are pending.
        """
        cells = journal.read_cells(self.plan.keys)
        return assemble_study_dataset(
            self.study, self.plan.lattice_coordinates, cells, self.provenance
        )

    def _apply_reductions(self, lattice: xr.Dataset) -> xr.Dataset:
        despite = self.options.despite_failures
        return apply_reductions(lattice, tuple(self.study.reductions), despite_failures=despite)

    def _write_zarr_in_slabs(self, journal: CellJournal) -> xr.Dataset:
        def read(some: slice) -> CellResultArrays:
            return journal.read_cells(self.plan.keys[some])

        return ZarrStore(self.build_output_path(".zarr")).write_study_results(
            self.study,
            self.plan.lattice_coordinates,
            read,
            self.provenance,
            self._apply_reductions,
        )

    def _save_partial_results(self, journal: CellJournal, error: BaseException) -> RunError:
        """Write the finished cells to a file, and return an error that explains how to resume."""
        why = f"{self.study.name}: {str(error) or 'interrupted'}. "
        if self.options.output is not None and self.options.format == "netcdf":
            lattice = self.assemble_lattice_dataset(journal)
            with contextlib.suppress(Exception):  # Reductions may fail for missing cells.
                lattice = self._apply_reductions(lattice)
            try:
                write_dataset(lattice, self.build_output_path(".partial.nc"))
            except DataError as unwritten:
                why += f"{unwritten} "
        kind = Interrupted if isinstance(error, KeyboardInterrupt) else RunError
        return kind(why + self._describe_how_to_resume(journal))

    def _describe_how_to_resume(self, journal: CellJournal) -> str:
        """Describe how many cells are finished, and how to resume the run."""
        known = int((journal.read_statuses(self.plan.keys) != int(Status.PENDING)).sum())
        text = f"{known} of {self.study.size} cells are finished"
        if self.options.output is None:
            return f"{text}. The finished cells are lost, because the run has no output directory."
        where = self.build_output_path(".cells.sqlite")
        return f"{text} and stored in {where}. To resume the run, run the same command again."
