"""What a user calls from Python."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.progress import TimeRemainingColumn as Remaining

from rsfstudy import catalogue, runner, store
from rsfstudy.claims import Claim, verdicts
from rsfstudy.core.accuracy import DEFAULT_RTOL, Accuracy
from rsfstudy.errors import InvalidValue
from rsfstudy.measures import Measure
from rsfstudy.measures.critical_step import CriticalStep
from rsfstudy.measures.limit_cycle import LimitCycle
from rsfstudy.scene import Scene
from rsfstudy.study import Study
from rsfstudy.vocabulary import quantity
from rsfstudy.workers import Mapper, on_client, on_local_cluster, serial

OUTPUT = Path("outputs")


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
    command : str
        What to note in the history.
    **overrides
        Other axis values (``b_over_a=[2, 3]``), other fixed values (``stiffness_ratio=1.1``), or,
        for a fixed value, a list that makes it an axis.

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
    declared = study if isinstance(study, Study) else catalogue.load(str(study))
    if rtol is not None:
        declared = replace(declared, accuracy=replace(declared.accuracy, rtol=rtol))
    if overrides:
        declared = declared.with_(**overrides)
    if workers < 0:
        raise InvalidValue("workers", workers, "must be 0 or more")
    with _bar(declared.name, progress) as told:
        return runner.run(
            declared,
            _mapper(workers, client),
            output=None if output is None else Path(output),
            fresh=fresh,
            workers=max(1, workers),
            progress=told,
            command=command,
        )


def _mapper(processes: int, client: Any) -> Mapper:
    if client is not None:
        return on_client(client)
    return on_local_cluster(processes) if processes > 0 else serial


@contextlib.contextmanager
def _bar(name: str, show: bool) -> Iterator[runner.Progress]:
    if not show:
        yield lambda _done, _all: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("cells"),
        TimeElapsedColumn(),
        Remaining(),
    )
    with Progress(*columns) as bar:
        task = bar.add_task(name, total=None)

        def told(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield told


def open(name: str | Path, output: str | Path = OUTPUT) -> xr.Dataset:
    """Load the results of a named study, or a results file, into memory.

    Raises
    ------
    DataError
        If there is no such file, or it was not written by rsfstudy.
    """
    path = Path(name)
    if path.suffix == ".py":
        name = catalogue.load(str(path)).name
    return store.read(path if path.suffix == ".nc" else Path(output) / f"{name}.nc")


def check(dataset: xr.Dataset | str | Path) -> pd.DataFrame:
    """Hold a dataset (or a named study's results, or a file) against the claims its study makes.

    Returns
    -------
    pandas.DataFrame
        One row a claim: published value, ours, tolerance and its reason, verdict, and ``moved``
        where the verdict is not the expected one.
    """
    results = dataset if isinstance(dataset, xr.Dataset) else open(dataset)
    declared = store.declaration(results)
    return verdicts(
        results, [Claim(**claim) for claim in declared["claims"]], declared["overrides"]
    )


def critical_step(
    scene: Scene,
    of: str = "load_velocity_ratio",
    direction: str = "up",
    *,
    rtol: float = DEFAULT_RTOL,
) -> xr.Dataset:
    """The critical step of one scene.

    Parameters
    ----------
    scene : Scene
        The slider; whatever value it holds for the quantity sought is ignored.
    of : {"load_velocity_ratio", "displacement_step"}
        What is stepped. After a displacement step the load point is held unless the scene states
        its `load_velocity_ratio`.
    direction : {"up", "down"}
        Steps that increase, or decrease.
    rtol : float
        Relative accuracy of V_0/V_* - 1, or of the displacement.

    Returns
    -------
    xarray.Dataset
        The critical value, its numerical error, and the values beside it that were verified as
        stable and as unstable; the status, the message and the work.
    """
    return _measured(CriticalStep(of=of, direction=direction), scene, rtol)


def limit_cycle(scene: Scene, *, rtol: float = DEFAULT_RTOL) -> xr.Dataset:
    """The stick-slip limit cycle of one scene.

    Parameters
    ----------
    scene : Scene
        The slider, with the load point velocity after the step; usually with inertia.
    rtol : float
        Relative accuracy of the recurrence interval and the stress drops, and of ln V.

    Returns
    -------
    xarray.Dataset
        Recurrence interval, static and dynamic stress drop and range of slip rate, each with its
        numerical error; the orbit along ``phase``; the status (``no_limit_cycle`` where the motion
        settles), the message and the work.
    """
    return _measured(LimitCycle(), scene, rtol)


def to_si(
    dataset: xr.Dataset,
    *,
    normal_stress: float,
    slip_distance: float,
    reference_rate: float | None = None,
) -> xr.Dataset:
    """A dataset with its dimensionless quantities in SI units.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results, or a trajectory: variables whose attribute ``scale`` says what they are measured
        in.
    normal_stress : float
        sigma_* in Pa.
    slip_distance : float
        D_c in m.
    reference_rate : float, optional
        V_*/D_c in 1/s; by default that of the dataset, where it holds one.

    Raises
    ------
    InvalidValue
        For scales that are not positive, or a dataset that does not say its `reference_rate`.
    """
    if reference_rate is None:
        if "reference_rate" not in dataset or dataset["reference_rate"].ndim:
            raise InvalidValue(
                "reference_rate", None, "is not one number in the dataset", remedy="State it."
            )
        reference_rate = float(dataset["reference_rate"])
    scales = {
        "sigma_*": (normal_stress, "Pa"),
        "D_c": (slip_distance, "m"),
        "V_*": (slip_distance * reference_rate, "m s-1"),
        "D_c/V_*": (1.0 / reference_rate, "s"),
        "sigma_*/D_c": (normal_stress / slip_distance, "Pa m-1"),
    }
    for of, (scale, _units) in scales.items():
        if not 0.0 < scale < float("inf"):
            raise InvalidValue(of, scale, "must be positive and finite")
    result = dataset.copy()
    for name, values in dataset.variables.items():
        scale, units = scales.get(values.attrs.get("scale", ""), (1.0, ""))
        if units:
            about = {k: v for k, v in values.attrs.items() if k != "scale"} | {"units": units}
            result[name] = (values.dims, values.values * scale, about)
    return result


def _measured(measure: Measure, scene: Scene, rtol: float) -> xr.Dataset:
    """A measure's named numbers as a small dataset that bears the names of the lattice."""
    outcome = measure(scene, Accuracy(rtol))
    dataset = xr.Dataset(coords=dict(measure.inner_coordinates))
    dataset["reference_rate"] = ((), scene.reference_rate, {"units": "s-1"})
    for name, dims in measure.variables.items():
        about = quantity(name)
        attrs = {"long_name": about.long_name, "units": about.units, "scale": about.scale}
        missing = np.full([dataset.sizes[d] for d in dims], np.nan)
        values = outcome.values.get(name, missing)
        dataset[name] = (dims, values, {k: v for k, v in attrs.items() if v})
    dataset["rhs_evaluations"] = ((), outcome.rhs_evaluations)
    dataset.attrs = {
        "scene": json.dumps(scene.as_dict()),
        "rtol": rtol,
        "status": outcome.status.label,
        "message": outcome.message,
    }
    return dataset.set_coords("reference_rate")
