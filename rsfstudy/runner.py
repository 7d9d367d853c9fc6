"""Runs a study: plans its cells, maps them over Dask workers or in this process, keeps what is
finished.
"""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from rsfstudy import provenance, store
from rsfstudy.errors import InvalidValue, RsfStudyError, RunError
from rsfstudy.journal import Finished, Journal, cell_key
from rsfstudy.lattice import assemble
from rsfstudy.reduce import reduced
from rsfstudy.scene import Scene
from rsfstudy.status import Status
from rsfstudy.study import Study
from rsfstudy.workers import Mapper

#: Typical time of one right-hand side in s, and the time a task should last.
_SECONDS_PER_RHS, _SECONDS_PER_TASK = 6e-6, 0.3

Progress = Callable[[int, int], None]


@dataclass
class Plan:
    """The cells of a study: each different scene once, and what is known of it."""

    study: Study
    scenes: list[Scene]
    keys: list[str] = field(init=False)
    finished: dict[str, Finished] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.keys = [cell_key(scene) for scene in self.scenes]

    def missing(self) -> dict[str, Scene]:
        """Scenes still to be computed."""
        every = dict(zip(self.keys, self.scenes, strict=True))
        return {key: scene for key, scene in every.items() if key not in self.finished}

    def outcomes(self) -> dict[int, Finished]:
        """What is known, by cell number."""
        return {i: self.finished[key] for i, key in enumerate(self.keys) if key in self.finished}


def run(
    study: Study,
    mapper: Mapper,
    *,
    output: Path | None,
    fresh: bool = False,
    workers: int = 1,
    progress: Progress = lambda _done, _all: None,
    command: str = "rsfstudy.run",
) -> xr.Dataset:
    """Compute the cells of a study that are not known yet, and assemble and reduce its dataset.

    Parameters
    ----------
    study : Study
    mapper : callable
        Where cells are computed: `workers.serial`, or what `workers.on_client` gives.
    output : Path or None
        Directory of ``NAME.nc`` and of the journal of finished cells; None writes nothing.
    fresh : bool
        Compute every cell anew.
    workers : int
        How many cells are computed at a time, to size the tasks.
    progress : callable
        Told the number of finished cells and of all.
    command : str
        What the user typed, for the history.

    Raises
    ------
    InvalidValue
        For a declaration with a cell that makes no scene, before anything is computed.
    DataError
        If results cannot be kept, or the journal holds cells computed differently.
    RunError
        When interrupted; what is finished is kept in ``NAME.partial.nc`` and in the journal.
    """
    plan = Plan(study, list(study.scenes()))
    _rehearse(plan)
    with contextlib.ExitStack() as stack:
        journal = None
        if output is not None:
            path = output / f"{study.name}.cells.sqlite"
            journal = stack.enter_context(Journal(path, provenance.fingerprint(study), fresh=fresh))
            plan.finished = journal.finished(plan.keys)
        try:
            _compute_missing(plan, mapper, journal, workers, progress)
        except (KeyboardInterrupt, RunError) as error:
            raise _interrupted(plan, output, command, error) from error
    try:
        dataset = _dataset(plan, command)
    except Exception as error:
        raise _unreduced(plan, output, command, error) from error
    if output is not None:
        store.write(dataset, output / f"{study.name}.nc")
        (output / f"{study.name}.partial.nc").unlink(missing_ok=True)
    return dataset


def _compute_missing(
    plan: Plan, mapper: Mapper, journal: Journal | None, workers: int, progress: Progress
) -> None:
    missing = plan.missing()
    keys, total = list(missing), len(set(plan.keys))
    progress(total - len(keys), total)
    if not keys:
        return
    size = _batch_size(len(keys), plan.study.measure.typical_work, workers)
    batches = [keys[i : i + size] for i in range(0, len(keys), size)]
    scenes = [[missing[key] for key in batch] for batch in batches]
    for number, finished in mapper(plan.study.measure, plan.study.accuracy, scenes):
        cells = list(zip(batches[number], finished, strict=True))
        if journal is not None:
            journal.add(cells)
        plan.finished.update(cells)
        progress(len(plan.finished), total)


def _batch_size(cells: int, typical_work: int, workers: int) -> int:
    """Cells per task: long enough to be worth sending, short enough to balance the workers."""
    worthwhile = _SECONDS_PER_TASK / (_SECONDS_PER_RHS * typical_work)
    balanced = cells / (4 * workers)
    return max(1, math.ceil(min(worthwhile, balanced)))


def _dataset(plan: Plan, command: str) -> xr.Dataset:
    dataset = assemble(plan.study, plan.scenes, plan.outcomes(), provenance.provenance(command))
    return reduced(dataset, tuple(plan.study.reductions))


def _rehearse(plan: Plan) -> None:
    """Apply the reductions to the lattice as it is before anything is computed."""
    lattice = assemble(plan.study, plan.scenes, {}, provenance.provenance("rehearsal"))
    for reduction in plan.study.reductions:
        try:
            lattice = reduced(lattice, (reduction,))
        except RsfStudyError:
            raise
        except Exception as error:
            rule = f"does not fit this lattice: {type(error).__name__}: {error}"
            raise InvalidValue("reduction", reduction.name, rule) from error


def _unreduced(plan: Plan, output: Path | None, command: str, error: Exception) -> RunError:
    """The error of a run whose cells are all there but cannot be reduced; the cells are kept."""
    text = f"{plan.study.name}: cannot be reduced ({type(error).__name__}: {error})"
    if output is None:
        return RunError(f"{text}.")
    path = output / f"{plan.study.name}.unreduced.nc"
    lattice = assemble(plan.study, plan.scenes, plan.outcomes(), provenance.provenance(command))
    store.write(lattice, path)
    return RunError(f"{text}; its cells are in {path}, without reductions.")


def _interrupted(plan: Plan, output: Path | None, command: str, error: BaseException) -> RunError:
    """The error of a run that ended early, once what is finished has been kept."""
    why = str(error) or "interrupted"
    text = (
        f"{plan.study.name}: {why}. {len(plan.outcomes())} of {plan.study.size} cells are finished"
    )
    if output is None:
        return RunError(f"{text}; nothing was to be kept (no output directory).")
    path = output / f"{plan.study.name}.partial.nc"
    store.write(_dataset(plan, command), path)
    return RunError(f"{text} and kept in {path}; the same command goes on from there.")


def estimated_cost(study: Study) -> tuple[int, float]:
    """Right-hand sides that the cells of a study usually take at its accuracy, and seconds on one
    core.
    """
    cells = len(set(study.scenes()))
    work = cells * study.measure.typical_work * study.accuracy.relative_work
    return round(work), work * _SECONDS_PER_RHS


def command_line() -> str:
    """What the user typed."""
    return " ".join(["rsfstudy", *sys.argv[1:]])


def counts(dataset: xr.Dataset) -> Mapping[str, int]:
    """How many cells ended with each status."""
    status = dataset["status"].values
    return {s.label: int((status == int(s)).sum()) for s in Status if (status == int(s)).any()}
