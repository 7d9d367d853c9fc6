"""What a user calls for a study: run it, open its results, check and rerun them."""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr
from rich import progress as bars

from rsfstudy.compute import own_code, provenance, runner
from rsfstudy.compute.cells import DEFAULT_TIME_LIMIT, Mapper, Task, sendable, serial
from rsfstudy.compute.runner import Keeping, Progress
from rsfstudy.compute.workers import on_client, on_local_cluster, threads
from rsfstudy.declare import catalogue
from rsfstudy.declare.axis import check_text
from rsfstudy.declare.claims import verdicts
from rsfstudy.declare.study import Study, figure_name
from rsfstudy.errors import DataError, InvalidValue, brief
from rsfstudy.files import contents, restore, store
from rsfstudy.files.comparison import cell_number, compared, differences
from rsfstudy.files.lattice import coordinates
from rsfstudy.measures import Outcome
from rsfstudy.slider.scene import Scene

OUTPUT = Path("outputs")
#: No cell takes three years, and no clock of ours goes much further than `WAITING` times that.
_LONGEST = 1e8
#: Most worker processes for each core, and what any machine may have.
_A_CORE, _ANYWHERE = 4, 8


def studies() -> dict[str, Study]:
    """The named studies, by name."""
    return {name: catalogue.load(name) for name in catalogue.names()}


def run(
    study: str | Path | Study,
    *,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = OUTPUT,
    progress: bool = True,
    fresh: bool = False,
    rtol: float | None = None,
    time_limit: float = DEFAULT_TIME_LIMIT,
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
        Show a progress bar.
    fresh : bool
        Compute every cell anew.
    rtol : float, optional
        Accuracy of the cells.
    time_limit : float
        CPU time in s after which a worker gives a cell up, or ten times as long on the clock where
        the cell sleeps or waits; it does not bind in this process.
    keep_going : bool
        Go on where the first cells all fail, instead of stopping early.
    despite_failures : bool
        Reduce what there is where cells failed; the results say so.
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
        For a declaration or an override that makes no sense, before anything is computed.
    DataError, RunError
        If results cannot be kept, or the run cannot start or finish.
    """
    declared = declaration(study, rtol, overrides)
    keeping = Keeping(
        output=directory(output),
        format=format,
        fresh=fresh,
        keep_going=keep_going,
        despite_failures=despite_failures,
        command=command,
    )
    return prepared(declared, keeping, Workers(workers, client, time_limit, progress))()


def declaration(
    study: str | Path | Study, rtol: float | None, overrides: Mapping[str, Any]
) -> Study:
    """A study with another accuracy and other values, checked."""
    declared = study if isinstance(study, Study) else catalogue.load(str(study))
    if rtol is not None:
        declared = replace(declared, accuracy=replace(declared.accuracy, rtol=rtol))
    return declared.with_(**overrides) if overrides else declared


@dataclass(frozen=True)
class Workers:
    """Where cells are computed, and whether a bar shows how far it is."""

    processes: int = 2
    client: Any = None
    time_limit: float = DEFAULT_TIME_LIMIT
    progress: bool = True

    def __post_init__(self) -> None:
        whole = isinstance(self.processes, int) and not isinstance(self.processes, bool)
        if not whole or self.processes < 0:
            raise InvalidValue("workers", self.processes, "must be a whole number, 0 or more")
        most = max(_ANYWHERE, _A_CORE * (os.cpu_count() or 1))
        if self.client is None and self.processes > most:
            rule = f"must be at most {most} here: {_A_CORE} for each core, or {_ANYWHERE}"
            remedy = "A cluster has room for more: --scheduler ADDRESS (client=)."
            raise InvalidValue("workers", self.processes, rule, remedy=remedy)
        if self.client is not None and not hasattr(self.client, "submit"):
            raise InvalidValue("client", self.client, "must be a distributed.Client")
        limit: object = self.time_limit
        if not isinstance(limit, int | float) or not 0.0 < limit <= _LONGEST:
            rule = f"must be a number greater than 0, up to {_LONGEST:g} s"
            raise InvalidValue("time_limit", limit, rule)

    def threads(self) -> int:
        """How many cells are computed at a time."""
        at_a_time = self.processes if self.client is None else threads(self.client)
        return max(1, at_a_time)

    def mapper(self, log: Path | None = None) -> Mapper:
        """What computes batches of cells there; `log` is for what processes of ours say when they
        end.
        """
        if self.client is not None:
            return on_client(self.client)
        return on_local_cluster(self.processes, log) if self.processes > 0 else serial


def directory(output: str | Path | None) -> Path | None:
    """Where results go: a directory, which need not be there yet, or nowhere.

    Raises
    ------
    InvalidValue
        For what cannot be the path of one.
    """
    if output is None:
        return None
    if not isinstance(output, str | Path):
        raise InvalidValue("output", output, "must be a path, or None")
    check_text("output", str(output))
    if output == "":
        remedy = "Name a directory; . is the one you are in."
        raise InvalidValue("output", output, "is empty", remedy=remedy)
    try:
        Path(output).exists()
    except OSError as error:
        raise InvalidValue("output", str(output), f"cannot be used ({error.strerror})") from error
    return Path(output)


def prepared(study: Study, keeping: Keeping, workers: Workers) -> Callable[[], xr.Dataset]:
    """A run that only has to be called.

    Raises
    ------
    InvalidValue
        For whatever is wrong with it.
    """
    parts = tuple(study.own_parts.values())
    digest = own_code.digest(type(study.measure), *parts)
    task = Task(study.measure, study.accuracy, workers.time_limit, parts=parts, own_code=digest)
    if workers.mapper() is not serial:
        sendable(task)  # told before any work, if it is not
    ready = runner.Run(study, keeping, task, workers.threads())

    def run() -> xr.Dataset:
        with _bar(study.name, workers.progress) as told:
            return ready(workers.mapper(ready.worker_log), told)

    return run


@contextlib.contextmanager
def _bar(name: str, show: bool) -> Iterator[Progress]:
    if not show:
        yield lambda _done, _all: None
        return
    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TextColumn("cells"),
        bars.TimeElapsedColumn(),
        bars.TimeRemainingColumn(),
    )
    bar = bars.Progress(*columns)
    task = bar.add_task(name, total=None)

    def told(done: int, total: int) -> None:
        bar.start()  # not before there is something to tell
        bar.update(task, completed=done, total=total)

    try:
        yield told
    finally:
        bar.stop()


def open(name: str | Path, output: str | Path = OUTPUT) -> xr.Dataset:
    """Load the results of a named study, or a results file, into memory.

    Raises
    ------
    DataError
        If there is no such file, or it was not written by rsfstudy.
    """
    if not isinstance(name, str | Path):
        raise InvalidValue("name", name, "must be the name of a study, or a path")
    path = Path(name)
    if path.suffix not in (".nc", ".zarr"):
        study = catalogue.load(str(path)).name if path.suffix == ".py" else str(name)
        try:
            path = _results(study, directory(output) or OUTPUT)
        except OSError as error:
            raise DataError(f"{brief(name)} cannot be looked for: {error.strerror}") from error
    return store.read(path)


def _results(name: str, output: Path) -> Path:
    """The results of a study, by its name."""
    file, in_pieces = output / f"{name}.nc", output / f"{name}.zarr"
    if file.exists() and in_pieces.exists():
        raise DataError(f"{file} and {in_pieces} are both there: name one, ending and all.")
    if file.exists() or in_pieces.exists():
        return file if file.exists() else in_pieces
    partial = output / f"{name}.partial.nc"
    if partial.exists():
        raise DataError(
            f"{file} does not exist, but {partial} does: run the study again, or name it."
        )
    there = any(file.name.startswith(f"{name}.") for file in output.glob("*"))
    if not there and name not in catalogue.names():
        rule, remedy = f"has no results in {brief(output)}", "Results files end in .nc or .zarr."
        raise InvalidValue("study", name, rule, choices=catalogue.names(), remedy=remedy)
    return file


def check(dataset: xr.Dataset | str | Path) -> pd.DataFrame:
    """Hold a dataset (or a named study's results, or a file) against the claims its study makes.

    Returns
    -------
    pandas.DataFrame
        One row a claim: published value, ours, tolerance and its reason, verdict, and ``moved``
        where the verdict is not the expected one.
    """
    results = dataset if isinstance(dataset, xr.Dataset) else open(dataset)
    declared = contents.declaration(results)
    return verdicts(results, list(declared.claims), declared.overrides)


def rerun(
    file: str | Path,
    *,
    study: str | Path | None = None,
    workers: int = 2,
    client: Any = None,
    output: str | Path | None = None,
    progress: bool = True,
    time_limit: float = DEFAULT_TIME_LIMIT,
) -> pd.DataFrame:
    """Compute a results file anew from what it says of itself, and hold the numbers against it.

    Parameters
    ----------
    file : path
        A results file.
    study : path, optional
        The file that declares the study, where its measure is not part of rsfstudy; code is never
        taken from a results file.
    workers, client, output, progress, time_limit
        As in `run`; by default nothing is written.

    Returns
    -------
    pandas.DataFrame
        One row a variable: how many values are identical, how many there are, the largest
        difference. In its ``attrs``, under ``differs``, what decides a number and is not as it was.

    Raises
    ------
    InvalidValue
        Where the study's measure or a reduction is not part of rsfstudy.
    DataError, RunError
        Where the file is damaged, or the run cannot finish.
    """
    theirs = open(file)
    declared = study_of(theirs, study)
    place = directory(output)
    if place is not None:
        for taken in place.glob(f"{declared.name}.*"):
            rule = f"holds {taken.name}, which this would take the place of"
            raise InvalidValue("output", str(output), rule, remedy="Name another directory.")
    keeping = Keeping(
        output=place,
        fresh=True,
        keep_going=True,
        despite_failures="reduced_despite" in theirs.attrs,
        command=f"rsfstudy.rerun {file}",
    )
    ours = prepared(declared, keeping, Workers(workers, client, time_limit, progress))()
    return compared(theirs, ours)


def study_of(results: xr.Dataset, file: str | Path | None = None) -> Study:
    """The study that made a dataset: from its own declaration, or, where that does not suffice,
    from the file that declares it.
    """
    declared = contents.declaration(results)
    if file is None:
        about = contents.provenance(results)
        if about["fingerprint"]["own_code"] != "none":
            rule = "is a user's own, and code is never taken from a results file"
            remedy = "Name the file that declares it: --study FILE (study=)."
            if about["declared_in"]:
                remedy += f" It was {brief(about['declared_in'])}."
            name, value = contents.own_part(declared) or ("measure", declared.measure["name"])
            raise InvalidValue(name, value, rule, remedy=remedy)
        study = restore.study(declared)
    else:
        named = catalogue.load(str(file))
        if named.name != declared.name:
            rule = f"declares the study {named.name!r}, and the results are of {declared.name!r}"
            raise InvalidValue("study", str(file), rule)
        study = restore.study(declared, of_its_own=named)
    _check_lattice(study, results)
    return study


def own_figure(results: xr.Dataset, file: str | Path | None = None) -> Any:
    """What draws a dataset with a figure of the user's own, from the file that declares the study;
    the code that results name is not run unasked, because they may be a stranger's.

    Raises
    ------
    InvalidValue
        Where no file is given, or it has no such figure.
    """
    name, named_in = contents.declaration(results).plot, contents.provenance(results)["declared_in"]
    if file is None:
        remedy = f"Name the file that declares it: --study {named_in or 'FILE'}."
        raise InvalidValue("plot", name, "is no figure of rsfstudy", remedy=remedy)
    study = catalogue.load(str(file))
    if study.name != results.attrs["id"] or figure_name(study.plot) != name:
        rule = f"does not draw {name!r} of {results.attrs['id']!r}"
        raise InvalidValue("study", str(file), rule)
    return None if isinstance(study.plot, str) else study.plot


def _check_lattice(study: Study, results: xr.Dataset) -> None:
    """Refuse results whose cells are not those of their own declaration."""
    ours, dims = xr.Dataset(coords=coordinates(study)), results["status"].dims
    if dims != study.dimensions:
        raise contents.refused("status", f"lies along {dims}, not the axes of the declaration")
    for name in study.dimensions:
        if ours[name].values.tolist() != results[name].values.tolist():
            raise contents.refused(name, "is not that axis of the declaration")


def cell(
    file: str | Path, place: Mapping[str, Any], *, study: str | Path | None = None
) -> tuple[Scene, Outcome]:
    """Compute one cell of a results file alone, in this process, letting it raise what it raises.

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
        Where what decides its numbers is not what it was for the file.
    """
    results = open(file)
    number = cell_number(results, place)
    declared = study_of(results, study)
    now = provenance.fingerprint(declared)
    then = contents.provenance(results)["fingerprint"]
    for name, (theirs, ours) in differences(then, now).items():
        warnings.warn(f"{name}: {theirs} then, {ours} now", stacklevel=2)
    scene, changes = declared.cell(number)
    return scene, declared.measure.with_(**changes)(scene, declared.accuracy)
