"""Fits of friction parameters to records, as users ask for them; and what laboratories tabulate."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.analysis.fitting.model import LOGARITHMIC
from rsfstudy.analysis.fitting.record import Record
from rsfstudy.api import runs
from rsfstudy.declare.axis import Axis
from rsfstudy.declare.study import Study
from rsfstudy.doors import door
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.files import contents
from rsfstudy.measures.fit import Fit
from rsfstudy.motion.accuracy import DEFAULT_RTOL, Accuracy
from rsfstudy.motion.engines import COMPILED, SCIPY, is_installed
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.rig.units import in_si
from rsfstudy.slider.scene import Scene

#: Right-hand sides a fit may evaluate.
BUDGET = 50_000_000
#: What is looked for unless something else is asked for.
FREE = ("a", "b", "slip_distance", "mu_star", "trend1")
#: Slip distance to begin with, as part of the load point displacement that is fitted after a step.
_GUESS = 0.05
#: First guesses of a scene: those of a record take their place.
_SCENE = {"a": 0.01, "b_over_a": 1.2, "mu_star": 0.6, "normal_stress": "constant"}
_TWO = {"b1_over_a": 0.9, "b2_over_a": 0.3, "length_ratio": 10.0}


@door
def fit(
    record: Record | Sequence[Record],
    rig: Laboratory | None = None,
    *,
    laws: Sequence[str] = ("slip", "slowness"),
    free: Sequence[str] = FREE,
    steps: Sequence[int] = (),
    together: bool = False,
    before: Any = 0.0,
    after: Any = 0.0,
    noise: str = "ar",
    loading: str = "steps",
    stiffness: float | None = None,
    engine: Any = None,
    rtol: float = DEFAULT_RTOL,
    budget: int = BUDGET,
    workers: int = 0,
    **scene: Any,
) -> xr.Dataset:
    """The friction parameters that a record tells, with errors that count correlated noise.

    Parameters
    ----------
    record : Record or sequence of Record
        As `rsfstudy.read_record` gives it.
    rig : Laboratory, optional
        Its stiffness is that of the machine, its slip distance the first guess.
    laws : sequence of str
        State evolution laws, a fit by each.
    free : sequence of str
        What to look for: ``a``, ``b`` (``b1``, ``b2`` and ``slip_distance_2`` of laws with two
        states), ``slip_distance``, ``mu_star``, ``stiffness``, ``alpha``, ``law_exponent``,
        ``step_time``, and ``trend1``, ``trend2`` and so on.
    steps : sequence of int
        Numbers of the steps to fit, from 1; all of them, if none is given. ``record.steps()``
        lists them.
    together : bool
        Fit these steps, of all records, as one: with one a, b and slip distance, and friction
        before it, trends and time of its own for each step (``mu_star_1``, ``mu_star_2``).
    before, after : quantity
        Load point displacement that is fitted around each ("100 um"); 0: all up to the next step,
        and half the way back to the one before.
    noise : str
        "white", "ar" (autoregressive, of an order that a criterion chooses), or "ar1" and so on.
    loading : {"steps", "recorded"}
        The load point as its steps say, or as it was recorded, and normal stress with it where that
        is no constant of the scene (``normal_stress="imposed"``).
    stiffness : float, optional
        Stiffness over normal stress in 1/um, where no rig states one.
    engine, rtol, budget, workers
        As in `rsfstudy.run`; the engine is "compiled" where that is installed.
    **scene
        Other fields of the scene: what is not looked for.

    Returns
    -------
    xarray.Dataset
        By law, and by step and record where there are several: each parameter with its standard
        error (``_stderr``), the ends of its 95 % interval and its numerical error; covariance;
        along the rows of the record, the friction of the fit and what it leaves. Lengths are in um.
        ``dataset.rsf.table()``, ``.rsf.plot()`` and ``.rsf.draw()`` say more.

    Raises
    ------
    InvalidValue
        For parameters that a law does not have, no stiffness, and records without steps.
    """
    records: tuple[Any, ...] = (record,) if isinstance(record, Record) else tuple(record)
    for one in records:
        if not isinstance(one, Record):
            remedy = "Make one by rsfstudy.read_record."
            raise InvalidValue("record", one, "is no record", remedy=remedy)
    numbers = _numbers(records, steps)
    guess = _guess(records[0], rig, numbers[0])
    if "alpha" in free:
        scene = {"normal_stress": "imposed", **scene}
    first = _first_scene(laws, scene, _stiffness(rig, stiffness, free) * guess)
    _check_free(free, laws, first)
    measure = Fit(
        records=records,
        free=tuple(free),
        slip_distance_guess=guess,
        slip_distance_2_guess=10.0 * guess,
        step=numbers[0],
        together=_together(records, numbers) if together else (),
        before=_micrometres("before", before),
        after=_micrometres("after", after),
        noise=noise,
        loading=loading,
    )
    axes = [Axis("law", list(laws))]
    if len(records) > 1 and not together:
        axes.append(Axis("record", [one.name for one in records]))
    if len(numbers) > 1 and not together:
        axes.append(Axis("step", list(numbers)))
    engine = engine or (COMPILED if is_installed(COMPILED) else SCIPY)
    study = Study(
        name="fit",
        title="Friction parameters of a record",
        base=first,
        axes=axes,
        measure=measure,
        plot="fits",
        accuracy=Accuracy(rtol, budget, engine=engine),
    )
    return runs.run(study, workers=workers, output=None, progress=False, keep_going=True)


def _numbers(records: Sequence[Record], steps: Sequence[int]) -> tuple[int, ...]:
    count = max(len(one.found) for one in records)
    if not count:
        remedy = "State them: record.with_steps([(begins, ends, before, after)])."
        rule = "has no step of load point velocity"
        raise InvalidValue("record", records[0].name, rule, remedy=remedy)
    numbers = tuple(steps) or tuple(range(1, count + 1))
    for number in numbers:
        if not 1 <= number <= count:
            rule = f"is not the number of a step: the record has {count}"
            raise InvalidValue("steps", number, rule)
    return numbers


def _together(records: Sequence[Record], numbers: Sequence[int]) -> tuple[tuple[str, int], ...]:
    """The steps of all records, those that there are."""
    return tuple((r.name, n) for r in records for n in numbers if n <= len(r.found))


def _guess(record: Record, rig: Laboratory | None, number: int) -> float:
    """Slip distance to begin with, in um."""
    if rig is not None:
        return float(rig.slip_distance * 1e6)
    begins = record.found[number - 1].begins
    moved = record.columns["displacement"]
    return float(_GUESS * (moved[-1] - np.interp(begins, record.time, moved)))


def _stiffness(rig: Laboratory | None, stated: float | None, free: Sequence[str]) -> float:
    """Stiffness over normal stress, in 1/um."""
    if stated is not None:
        return stated
    if rig is not None and rig.stiffness is not None:
        return float(rig.stiffness / rig.normal_stress * 1e-6)
    if "stiffness" in free:
        return 1e-3
    remedy = (
        "Give a rig that states it, or stiffness in 1/um, or look for it: free=[..., 'stiffness']."
    )
    raise InvalidValue("stiffness", None, "is needed, and not stated", remedy=remedy)


def _first_scene(laws: Sequence[str], stated: Mapping[str, Any], stiffness: float) -> Scene:
    fields = {**_SCENE, "law": laws[0], "stiffness": stiffness, **stated}
    if str(laws[0]).startswith("two_"):
        fields = {n: v for n, v in fields.items() if n != "b_over_a"}
        fields = {**_TWO, **fields}
    return Scene(**fields)


def _check_free(free: Sequence[str], laws: Sequence[str], scene: Scene) -> None:
    """Refuse parameters that a law does not have."""
    for law in laws:
        states = (
            scene.with_(law=law).parts.law.states if law != scene.law else scene.parts.law.states
        )
        wrong = {"b1", "b2", "slip_distance_2"} if states == 1 else {"b"}
        if law != "family":
            wrong.add("law_exponent")
        if scene.parts.normal_stress.name == "constant":
            wrong.add("alpha")
        for name in free:
            if name in wrong:
                raise InvalidValue("free", name, f"is no parameter with law={law!r}")


def _micrometres(name: str, value: Any) -> float:
    return float(value) if isinstance(value, int | float) else in_si(name, value, "m") * 1e6


def cells(dataset: xr.Dataset) -> list[xr.Dataset]:
    """The fits that a dataset holds, one by one."""
    if "rows_fitted" not in dataset:
        raise DataError("the dataset holds no fit: it is not what rsfstudy.fit gives")
    dims = dataset["rows_fitted"].dims
    sizes = [dataset.sizes[d] for d in dims]
    return [dataset.isel(dict(zip(dims, at, strict=True))) for at in np.ndindex(*sizes)]


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """One row a fit, with the columns that laboratories use; lengths in um.

    ``_std`` are standard errors; NaN stands where something was not looked for.
    """
    names = {"a": "a", "b": "b", "b1": "b1", "b2": "b2", "slip_distance": "Dc"}
    names |= {"slip_distance_2": "Dc2", "stiffness": "k", "law_exponent": "exponent"}
    names |= {"mu_star": "mu_0", "trend1": "trend"}
    rows = []
    for one in cells(dataset):
        row: dict[str, Any] = {n: one[n].item() for n in ("record", "step") if n in one.coords}
        for name, short in names.items():
            if name in one.data_vars:
                row[short] = one[name].item()
                row[f"{short}_std"] = one[f"{name}_stderr"].item()
        row |= {
            "a_minus_b": one["a_minus_b"].item(),
            "a_minus_b_std": one["a_minus_b_stderr"].item(),
        }
        row |= {"V0": one["velocity_before"].item(), "V1": one["velocity_after"].item()}
        row |= {"law": one["law"].item() if "law" in one.coords else ""}
        row["window"] = f"{one['window_begins'].item():g} to {one['window_ends'].item():g}"
        row["R2"], row["criterion"] = one["r_squared"].item(), one["criterion"].item()
        row["status"] = _label(one)
        rows.append(row)
    return pd.DataFrame(rows)


def _label(one: xr.Dataset) -> str:
    flags = dict(
        zip(one["status"].flag_values.tolist(), one["status"].flag_meanings.split(), strict=True)
    )
    return str(flags[one["status"].item()])


def draw(dataset: xr.Dataset, n: int, seed: int = 0) -> xr.Dataset:
    """Samples of the parameters of one fit, as its errors let them be.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of which one fit is selected.
    n : int
        How many.
    seed : int

    Returns
    -------
    xarray.Dataset
        Each parameter along ``draw``. Slip distances and stiffness stay positive: their logarithms
        are drawn. The distribution is Student's t.
    """
    found = cells(dataset)
    if len(found) != 1:
        remedy = "Select one first, as in dataset.sel(law='slip')."
        raise InvalidValue("dataset", len(found), "holds several fits", remedy=remedy)
    if not isinstance(n, int) or n < 1:
        raise InvalidValue("n", n, "must be a whole number, 1 or more")
    one = found[0]
    names = [str(name) for name in one["parameter"].values]
    at = np.array([one[name].item() for name in names])
    covariance = one["covariance"].values
    if not np.isfinite(covariance).all():
        raise InvalidValue("dataset", _label(one), "has no covariance to draw from")
    logs = np.array([name in LOGARITHMIC for name in names])
    scales = np.where(logs, at, 1.0)
    rng = np.random.default_rng(seed)
    degrees = one["degrees_of_freedom"].item()
    spread = rng.multivariate_normal(np.zeros(len(at)), covariance / np.outer(scales, scales), n)
    spread /= np.sqrt(rng.chisquare(degrees, n) / degrees)[:, None]
    drawn = np.where(logs, at * np.exp(np.where(logs, spread, 0.0)), at + spread)
    data = {
        name: ("draw", drawn[:, place], {"units": one[name].attrs.get("units", "1")})
        for place, name in enumerate(names)
    }
    return xr.Dataset(data, coords={"draw": np.arange(n)})


def scene(dataset: xr.Dataset) -> Scene:
    """The scene of one fit, with the parameters that it found, in units of its slip distance and of
    the velocity before the step.
    """
    found = cells(dataset)
    if len(found) != 1:
        remedy = "Select one first, as in dataset.sel(law='slip')."
        raise InvalidValue("dataset", len(found), "holds several fits", remedy=remedy)
    one, plain = found[0], json.loads(dataset.attrs["declaration"])
    first = contents.scene(plain["base"], {})
    if "law" in one.coords:
        first = first.with_(law=str(one["law"].item()))
    value = {n: one[n].item() for n in map(str, one["parameter"].values)}
    guess = float(plain["measure"]["slip_distance_guess"])
    distance, a = value.get("slip_distance", guess), value.get("a", first.a)
    changes: dict[str, Any] = {
        n: value[n] for n in ("a", "mu_star", "alpha", "law_exponent") if n in value
    }
    changes |= {f"{n}_over_a": value[n] / a for n in ("b", "b1", "b2") if n in value}
    if "slip_distance_2" in value:
        changes["length_ratio"] = value["slip_distance_2"] / distance
    changes["stiffness"] = value.get("stiffness", first.stiffness / guess) * distance
    changes["reference_rate"] = one["velocity_before"].item() / distance
    return first.with_(**changes)
