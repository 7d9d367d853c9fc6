"""Runs a study: plans its cells, has those computed that are not known yet, keeps what is
finished, and assembles, reduces and writes the dataset.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from rsfstudy.compute import provenance
from rsfstudy.compute.cells import Found, Mapper, Task
from rsfstudy.compute.plan import Batches, Plan, scattered
from rsfstudy.declare.study import Study
from rsfstudy.errors import DataError, Interrupted, InvalidValue, RsfStudyError, RunError
from rsfstudy.files import pieces, store
from rsfstudy.files.journal import Columns, Journal, Layout
from rsfstudy.files.lattice import assemble
from rsfstudy.measures import Outcome
from rsfstudy.reduce import reduced
from rsfstudy.status import Status

#: How a cell ends that ends its worker.
_LOST = (Status.WORKER_LOST, Status.TIME_LIMIT_SPENT)
#: A run ends early where so many cells have failed before any is answered.
_HOPELESS = 10

FORMATS = ("netcdf", "zarr")

Progress = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True)
class Keeping:
    """What a run keeps, and what it does about failures.

    Parameters
    ----------
    output : Path or None
        Directory of the results and of the journal of finished cells; None writes nothing.
    format : {"netcdf", "zarr"}
        One NetCDF file, or a Zarr store that is written in pieces.
    fresh : bool
        Forget the journal and compute every cell anew.
    keep_going : bool
        Go on where the first cells all fail.
    despite_failures : bool
        Reduce what there is where cells failed.
    command : str
        What the user typed, for the history.
    """

    output: Path | None = None
    format: str = "netcdf"
    fresh: bool = False
    keep_going: bool = False
    despite_failures: bool = False
    command: str = "rsfstudy.run"

    def __post_init__(self) -> None:
        if self.format not in FORMATS:
            raise InvalidValue("format", self.format, "is unknown", choices=FORMATS)
        if self.format == "zarr":
            pieces.check_installed()
            if self.output is None:
                raise InvalidValue("output", None, "must name a directory for a Zarr store")


class Run:
    """One run of a study.

    Parameters
    ----------
    study : Study
    keeping : Keeping
    workers : int
        How many cells are computed at a time, to size the tasks.
    time_limit : float, optional
        Time in s a cell may take on a worker.

    Raises
    ------
    InvalidValue
        For a declaration with a cell that makes no scene, or reductions or claims that do not fit
        its lattice, before anything is computed.
    """

    def __init__(self, study: Study, keeping: Keeping, task: Task, workers: int = 1) -> None:
        self.study, self.keeping, self.task, self.workers = study, keeping, task, workers
        self.plan = Plan(study)
        self.about = provenance.provenance(study, keeping.command)
        self._rehearse()

    def _rehearse(self) -> None:
        """Apply the reductions to the lattice as it is before anything is computed; where it is as
        declared, the claims must speak of what comes out.
        """
        pending = Columns.pending(self.study.size, Layout(self.study.measure).width)
        lattice = assemble(self.study, pending, self.about)
        for reduction in self.study.reductions:
            try:
                lattice = reduced(lattice, (reduction,))
            except RsfStudyError:
                raise
            except Exception as error:
                rule = f"does not fit this lattice: {type(error).__name__}: {error}"
                raise InvalidValue("reduction", reduction.name, rule) from error
        for claim in () if self.study.overrides else self.study.claims:
            claim.check_place(lattice)

    def path(self, ending: str) -> Path:
        """A file of this run."""
        assert self.keeping.output is not None
        return self.keeping.output / f"{self.study.name}{ending}"

    @property
    def worker_log(self) -> Path | None:
        """What worker processes say when they end, if anything is kept."""
        return None if self.keeping.output is None else self.path(".workers.log")

    def __call__(self, mapper: Mapper, progress: Progress) -> xr.Dataset:
        """Compute the cells that are not known yet, and assemble, reduce and write the dataset.

        Parameters
        ----------
        mapper : callable
            Where cells are computed: `cells.serial`, or what `workers.on_client` gives.
        progress : callable
            Told the number of finished cells and of all.

        Raises
        ------
        DataError
            If results cannot be kept, or the journal holds cells computed differently.
        RunError
            When it cannot go on, or is interrupted (`Interrupted`); what is finished is kept in
            ``NAME.partial.nc`` and in the journal.
        """
        keeping = self.keeping
        if keeping.format == "zarr":
            pieces.check_free(self.path(".zarr"))
        path = None if keeping.output is None else self.path(".cells.sqlite")
        layout = Layout(self.study.measure)
        with Journal(path, self.about["fingerprint"], layout, fresh=keeping.fresh) as journal:
            try:
                self._compute_missing(journal, mapper, progress)
                return self._finished(journal)
            except (KeyboardInterrupt, RunError) as error:
                raise self._interrupted(journal, error) from error
            except DataError as error:
                raise DataError(f"{error} {self._resumable(journal)}") from error

    def _compute_missing(self, journal: Journal, mapper: Mapper, progress: Progress) -> None:
        cells = self.plan.different
        # failures are tried again
        answered = journal.ended(self.plan.keys[cells]) < int(Status.WORK_BUDGET_SPENT)
        missing = scattered(cells[~answered])
        done, failed, total = int(answered.sum()), 0, len(cells)
        progress(done, total)
        if self.worker_log is not None:
            self.worker_log.unlink(missing_ok=True)  # of an earlier run
        if not len(missing):
            return
        batches = Batches(self.plan, missing, self.workers)
        with contextlib.closing(mapper(self.task, batches)) as arriving:
            for found in arriving:
                journal.add(found)
                self._tell_lost(found)
                for _key, (outcome, seconds) in found:
                    batches.learn(seconds)
                    failed += not outcome.status.is_answer
                done += len(found)
                progress(done, total)
                if failed == done >= _HOPELESS and done < total and not self.keeping.keep_going:
                    raise _hopeless(done, outcome)

    def _tell_lost(self, found: Found) -> None:
        """Name the cells that ended their worker, as soon as they have."""
        for key, (outcome, _seconds) in found:
            if outcome.status in _LOST:
                cell = int(np.flatnonzero(self.plan.keys == np.void(key))[0])
                warnings.warn(
                    f"cell {self.study.place(cell)} failed, {outcome.status.label}: "
                    f"{outcome.message}. The run goes on",
                    stacklevel=2,
                )

    # ---- what is made of the cells --------------------------------------------------------------

    def _finished(self, journal: Journal) -> xr.Dataset:
        zarr = self.keeping.format == "zarr"
        with self._reducing(journal):
            found = self._in_pieces(journal) if zarr else self._reduced(self.lattice(journal))
        if self.keeping.output is None:
            return store.sealed(found)
        written = found if zarr else store.write(found, self.path(".nc"))
        for stale in (".partial.nc", ".partial.png", ".unreduced.nc", ".unreduced.png"):
            self.path(stale).unlink(missing_ok=True)
        return written

    def lattice(self, journal: Journal) -> xr.Dataset:
        """What is known, as a dataset without reductions."""
        return assemble(self.study, journal.read(self.plan.keys), self.about)

    def _reduced(self, lattice: xr.Dataset) -> xr.Dataset:
        despite = self.keeping.despite_failures
        return reduced(lattice, tuple(self.study.reductions), despite_failures=despite)

    def _in_pieces(self, journal: Journal) -> xr.Dataset:
        def read(start: int, stop: int) -> Columns:
            return journal.read(self.plan.keys[start:stop])

        return pieces.write(self.study, read, self.about, self._reduced, self.path(".zarr"))

    @contextlib.contextmanager
    def _reducing(self, journal: Journal) -> Iterator[None]:
        """Keep the cells where they are all there but cannot be reduced."""
        try:
            yield
        except RsfStudyError:
            raise
        except Exception as error:
            text = f"{self.study.name}: cannot be reduced ({type(error).__name__}: {error})"
            if self.keeping.output is None:
                raise RunError(f"{text}.") from error
            path = self.path(".unreduced.nc")
            store.write(self.lattice(journal), path)
            raise DataError(f"{text}; its cells are in {path}, without reductions.") from error

    def _interrupted(self, journal: Journal, error: BaseException) -> RunError:
        """The error of a run that ended early, once what is finished has been kept."""
        why = f"{self.study.name}: {str(error) or 'interrupted'}. "
        if self.keeping.output is not None and self.keeping.format == "netcdf":
            lattice = self.lattice(journal)
            with contextlib.suppress(Exception):  # a reduction may not bear missing cells
                lattice = self._reduced(lattice)
            try:
                store.write(lattice, self.path(".partial.nc"))
            except DataError as unwritten:
                why += f"{unwritten} "
        kind = Interrupted if isinstance(error, KeyboardInterrupt) else RunError
        return kind(why + self._resumable(journal))

    def _resumable(self, journal: Journal) -> str:
        """How much is finished, where it is, and how to go on."""
        known = int((journal.ended(self.plan.keys) != int(Status.PENDING)).sum())
        text = f"{known} of {self.study.size} cells are finished"
        if self.keeping.output is None:
            return f"{text}; nothing was to be kept (no output directory)."
        where = self.path(".cells.sqlite")
        return f"{text} and kept in {where}; the same command goes on from there."


def _hopeless(cells: int, last: Outcome) -> RunError:
    return RunError(
        f"the first {cells} cells all failed, the last with {last.status.label}"
        f"{': ' * bool(last.message)}{last.message}. "
        "Mend that, or go on all the same with --keep-going (keep_going=True)"
    )


def counts(dataset: xr.Dataset) -> Mapping[str, int]:
    """How many cells ended with each status."""
    status = np.asarray(dataset["status"].values)
    return {s.label: int((status == int(s)).sum()) for s in Status if (status == int(s)).any()}
