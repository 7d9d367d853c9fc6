"""Runs a study: plans its cells, has the missing ones computed, records them as they finish, and
assembles, reduces and writes the dataset.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from rsfstudy.defaults import RESULT_FORMATS
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError, RunError
from rsfstudy.execution import provenance
from rsfstudy.execution.cell_computation import CellBatchMapper, CellTask, StoredCellRows
from rsfstudy.execution.cell_plan import CellBatchIterator, CellPlan, order_cells_by_golden_section
from rsfstudy.reductions import apply_reductions
from rsfstudy.status import Status
from rsfstudy.storage import (
    CellColumns,
    CellJournal,
    assemble_dataset,
    check_store_does_not_exist,
    check_zarr_installed,
    clean_attributes,
    write_dataset,
    write_store,
)
from rsfstudy.study import Study

#: Statuses of cells that ended their worker.
_STATUSES_OF_LOST_CELLS = (Status.WORKER_LOST.name, Status.TIME_LIMIT_SPENT.name)
_STATUSES_WITH_ANSWER = frozenset(status.name for status in Status if status.is_answer)
#: A run ends early when this many cells have failed and none has succeeded.
_MAX_FAILURES_WITHOUT_SUCCESS = 10

ProgressCallback = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Files that a run writes, and what it does about failed cells.

    Parameters
    ----------
    output : Path or None
        Directory of the results and of the journal of finished cells; None writes nothing.
    format : {"netcdf", "zarr"}
        One NetCDF file, or a Zarr store that is written in pieces.
    fresh : bool
        Forget the journal and compute every cell anew.
    keep_going : bool
        Go on even if the first cells all fail.
    despite_failures : bool
        Reduce the other cells where some failed.
    command_line : str
        What the user typed, for the history.
    """

    output: Path | None = None
    format: str = "netcdf"
    fresh: bool = False
    keep_going: bool = False
    despite_failures: bool = False
    command_line: str = "rsfstudy.run"

    def __post_init__(self) -> None:
        if self.format not in RESULT_FORMATS:
            raise InvalidValue("format", self.format, "is unknown", choices=RESULT_FORMATS)
        if self.format == "zarr":
            check_zarr_installed()
            if self.output is None:
                raise InvalidValue("output", None, "must name a directory for a Zarr store")


class StudyRun:
    """One run of a study.

    Parameters
    ----------
    study : Study
    options : OutputOptions
    task : Task
    workers : int
        How many cells are computed at a time, to size the tasks.

    Raises
    ------
    InvalidValue
        For a declaration with a cell that makes no scene, or reductions or claims that do not fit
        its lattice, before anything is computed.
    """

    def __init__(
        self, study: Study, options: OutputOptions, task: CellTask, workers: int = 1
    ) -> None:
        self.study, self.options, self.task, self.workers = study, options, task, workers
        self.plan = CellPlan(study)
        self.provenance = provenance.collect_provenance(study, options.command_line)
        self._check_reductions_and_claims()

    def _check_reductions_and_claims(self) -> None:
        """Apply the reductions to a lattice of pending cells, to find mistakes before any work.
        Unless values were overridden, each claim must name a variable and a place of the result.
        """
        pending = CellColumns.build_pending_cells(
            self.study.size, self.task.output_packing.packed_number_count
        )
        lattice = assemble_dataset(self.study, pending, self.provenance)
        for reduction in self.study.reductions:
            try:
                lattice = apply_reductions(lattice, (reduction,))
            except RsfStudyError:
                raise
            except Exception as error:
                rule = f"does not fit this lattice: {type(error).__name__}: {error}"
                raise InvalidValue("reduction", reduction.name, rule) from error
        for claim in () if self.study.overrides else self.study.claims:
            claim.check_selection(lattice)

    def output_path(self, file_suffix: str) -> Path:
        """A file of this run."""
        assert self.options.output is not None
        return self.options.output / f"{self.study.name}{file_suffix}"

    @property
    def worker_log_path(self) -> Path | None:
        """The file for the last words of worker processes, if anything is written."""
        return None if self.options.output is None else self.output_path(".workers.log")

    def __call__(
        self, cell_batch_mapper: CellBatchMapper, progress_callback: ProgressCallback
    ) -> xr.Dataset:
        """Compute the missing cells, then assemble, reduce and write the dataset.

        Parameters
        ----------
        cell_batch_mapper : callable
            Function that computes the cells: ``cells.compute_serially``, or the result of
            ``workers.make_dask_batch_mapper``.
        progress_callback : callable
            Called with the number of finished cells and of all cells.

        Raises
        ------
        DataError
            If results cannot be kept, or the journal holds cells computed differently.
        RunError
            When it cannot go on, or is interrupted (`Interrupted`); what is finished is kept in
            ``NAME.partial.nc`` and in the journal.
        """
        keeping = self.options
        if keeping.format == "zarr":
            check_store_does_not_exist(self.output_path(".zarr"))
        path = None if keeping.output is None else self.output_path(".cells.sqlite")
        fingerprint, layout = self.provenance["fingerprint"], self.task.output_packing
        with CellJournal(path, fingerprint, layout, fresh=keeping.fresh) as journal:
            try:
                self._compute_missing(journal, cell_batch_mapper, progress_callback)
                return self._write_results(journal)
            except (KeyboardInterrupt, RunError) as error:
                raise self._save_partial_results(journal, error) from error
            except DataError as error:
                raise DataError(f"{error} {self._describe_how_to_resume(journal)}") from error

    def _compute_missing(
        self,
        journal: CellJournal,
        cell_batch_mapper: CellBatchMapper,
        progress_callback: ProgressCallback,
    ) -> None:
        cells = self.plan.unique_cell_numbers
        # failures are tried again
        answered = journal.statuses(self.plan.keys[cells]) < int(Status.WORK_BUDGET_SPENT)
        missing = order_cells_by_golden_section(cells[~answered])
        done, failed, total = int(answered.sum()), 0, len(cells)
        progress_callback(done, total)
        if self.worker_log_path is not None:
            self.worker_log_path.unlink(missing_ok=True)  # of an earlier run
        if not len(missing):
            return
        batches = CellBatchIterator(self.plan, missing, self.workers)
        with contextlib.closing(cell_batch_mapper(self.task, batches)) as arriving:
            for finished in arriving:
                journal.add_cells(finished)
                self._warn_of_lost_cells(finished)
                for row in finished:
                    batches.record_time(row[4])
                    failed += row[1] not in _STATUSES_WITH_ANSWER
                done += len(finished)
                progress_callback(done, total)
                if (
                    failed == done >= _MAX_FAILURES_WITHOUT_SUCCESS
                    and done < total
                    and not self.options.keep_going
                ):
                    _key, status, message, *_ = row
                    raise RunError(
                        f"the first {done} cells all failed, the last with {Status[status].label}"
                        f"{': ' * bool(message)}{message}. "
                        "Mend that, or go on all the same with --keep-going (keep_going=True)"
                    )

    def _warn_of_lost_cells(self, finished_cells: StoredCellRows) -> None:
        """Warn of cells that ended their worker."""
        for key, status, message, *_ in finished_cells:
            if status in _STATUSES_OF_LOST_CELLS:
                cell = int(np.flatnonzero(self.plan.keys == np.void(key))[0])
                warnings.warn(
                    f"cell {self.study.describe_cell(cell)} failed, {Status[status].label}: "
                    f"{message}. The run goes on",
                    stacklevel=2,
                )

    # ---- from cells to results ------------------------------------------------------------------

    def _write_results(self, journal: CellJournal) -> xr.Dataset:
        zarr = self.options.format == "zarr"
        try:
            results = (
                self._write_zarr_in_slabs(journal)
                if zarr
                else self._apply_reductions(self.assemble_lattice(journal))
            )
        except RsfStudyError:
            raise
        except Exception as error:  # of a reduction
            raise RunError(f"cannot be reduced ({type(error).__name__}: {error})") from error
        if self.options.output is None:
            return clean_attributes(results)
        written = results if zarr else write_dataset(results, self.output_path(".nc"))
        for stale in (".partial.nc", ".partial.png"):
            self.output_path(stale).unlink(missing_ok=True)
        return written

    def assemble_lattice(self, journal: CellJournal) -> xr.Dataset:
        """The dataset of the cells in the journal, without reductions."""
        return assemble_dataset(self.study, journal.read_cells(self.plan.keys), self.provenance)

    def _apply_reductions(self, lattice: xr.Dataset) -> xr.Dataset:
        despite = self.options.despite_failures
        return apply_reductions(lattice, tuple(self.study.reductions), despite_failures=despite)

    def _write_zarr_in_slabs(self, journal: CellJournal) -> xr.Dataset:
        def read(some: slice) -> CellColumns:
            return journal.read_cells(self.plan.keys[some])

        return write_store(
            self.study, read, self.provenance, self._apply_reductions, self.output_path(".zarr")
        )

    def _save_partial_results(self, journal: CellJournal, error: BaseException) -> RunError:
        """Write what is finished, and give the error for a run that ended early."""
        why = f"{self.study.name}: {str(error) or 'interrupted'}. "
        if self.options.output is not None and self.options.format == "netcdf":
            lattice = self.assemble_lattice(journal)
            with contextlib.suppress(Exception):  # a reduction may not bear missing cells, or any
                lattice = self._apply_reductions(lattice)
            try:
                write_dataset(lattice, self.output_path(".partial.nc"))
            except DataError as unwritten:
                why += f"{unwritten} "
        kind = Interrupted if isinstance(error, KeyboardInterrupt) else RunError
        return kind(why + self._describe_how_to_resume(journal))

    def _describe_how_to_resume(self, journal: CellJournal) -> str:
        """A sentence: how many cells are finished, where they are, and how to go on."""
        known = int((journal.statuses(self.plan.keys) != int(Status.PENDING)).sum())
        text = f"{known} of {self.study.size} cells are finished"
        if self.options.output is None:
            return f"{text}; nothing was to be kept (no output directory)."
        where = self.output_path(".cells.sqlite")
        return f"{text} and kept in {where}; the same command goes on from there."
