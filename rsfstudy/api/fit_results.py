"""Fits of records as laboratories tabulate them: tables, samples of parameters, scenes."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from rsfstudy.analysis.fitting.joint import of_window, plain
from rsfstudy.analysis.fitting.model import LOGARITHMIC, fields_of, parameters_of
from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.files import contents
from rsfstudy.rig.laboratory import Laboratory
from rsfstudy.slider.scene import Scene
from rsfstudy.status import LABELS

#: What laboratories call parameters, and their units.
SHORT = {
    "a": ("a", ""),
    "b": ("b", ""),
    "b1": ("b1", ""),
    "b2": ("b2", ""),
    "a_minus_b": ("a_minus_b", ""),
    "slip_distance": ("Dc", "um"),
    "slip_distance_2": ("Dc2", "um"),
    "mu_star": ("mu_0", ""),
    "stiffness": ("k", "1/um"),
    "alpha": ("alpha", ""),
    "law_exponent": ("law_exponent", ""),
    "step_time": ("step_time", "s"),
    "trend1": ("trend", "1/um"),
    **{f"trend{n}": (f"trend{n}", f"1/um^{n}") for n in range(2, 6)},
}


def is_fit(dataset: xr.Dataset) -> bool:
    """True of fits of records."""
    return "rows_fitted" in dataset


def cells(dataset: xr.Dataset) -> list[xr.Dataset]:
    """The fits that a dataset holds, one by one; of several windows, that of the whole one."""
    if not is_fit(dataset):
        raise DataError("the dataset holds no fit: it is not what rsfstudy.fit gives")
    if "part" in dataset.dims:
        dataset = dataset.isel(part=0)
    dims = dataset["rows_fitted"].dims
    sizes = [dataset.sizes[d] for d in dims]
    return [dataset.isel(dict(zip(dims, at, strict=True))) for at in np.ndindex(*sizes)]


def _only(dataset: xr.Dataset) -> xr.Dataset:
    """The one fit that a dataset holds."""
    found = cells(dataset)
    if len(found) != 1:
        remedy = "Select one first, as in dataset.sel(law='slip')."
        raise InvalidValue("dataset", len(found), "holds several fits", remedy=remedy)
    return found[0]


def place(one: xr.Dataset) -> dict[str, Any]:
    """Record and step of a fit, where there are several."""
    found = {n: one[n].item() for n in ("record", "step") if n in one.coords}
    return {n: value if n == "record" else int(value) for n, value in found.items()}


def shown(one: xr.Dataset) -> dict[str, tuple[str, str]]:
    """Numbers that tables show, in their order: what laboratories call each, and its units."""
    names = [*map(str, one["parameter"].values), "a_minus_b"]
    found = {}
    for short in SHORT:
        for name in (n for n in names if plain(n) == short):
            called, units = SHORT[short]
            found[name] = called + name.removeprefix(short), units
    return found


def table(dataset: xr.Dataset) -> pd.DataFrame:
    """One row a fit, with the columns that laboratories use; lengths in um.

    ``_std`` are standard errors, ``_windows`` ranges of parameters among windows; NaN stands
    where something was not looked for.
    """
    rows = []
    for one in cells(dataset):
        row: dict[str, Any] = dict(place(one))
        for name, (short, _units) in shown(one).items():
            row[short] = one[name].item()
            row[f"{short}_std"] = one[f"{name}_stderr"].item()
            if f"{name}_windows" in one:
                row[f"{short}_windows"] = one[f"{name}_windows"].item()
        row |= {"V0": one["velocity_before"].item(), "V1": one["velocity_after"].item()}
        row |= {"law": one["law"].item() if "law" in one.coords else ""}
        row["window"] = f"{one['window_begins'].item():g} to {one['window_ends'].item():g}"
        row["R2"], row["criterion"] = one["r_squared"].item(), one["criterion"].item()
        row["status"] = status(one)
        rows.append(row)
    return pd.DataFrame(rows)


def status(one: xr.Dataset) -> str:
    """How a fit ended."""
    return LABELS[int(one["status"])]


def draw(dataset: xr.Dataset, n: int, seed: int = 0) -> xr.Dataset:
    """Samples of the parameters of one fit, as `Accessor.draw` says."""
    one = _only(dataset)
    if not isinstance(n, int) or n < 1:
        raise InvalidValue("n", n, "must be a whole number, 1 or more")
    names = [str(name) for name in one["parameter"].values]
    at = np.array([one[name].item() for name in names])
    covariance = one["covariance"].values
    if not np.isfinite(covariance).all():
        raise InvalidValue("dataset", status(one), "has no covariance to draw from")
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
    """The scene of one fit, with the parameters that it found and the velocity step that it is of,
    in units of its slip distance and of the velocity before the step.
    """
    one = _only(dataset)
    plain = json.loads(dataset.attrs["declaration"])
    first = contents.scene(plain["base"], {})
    if "law" in one.coords:
        first = first.with_(law=str(one["law"].item()))
    distances = (
        float(plain["measure"][f"{n}_guess"]) for n in ("slip_distance", "slip_distance_2")
    )
    values = parameters_of(first, *distances)
    found = {n: one[n].item() for n in map(str, one["parameter"].values)}
    values |= of_window(found, 1)
    before, after = one["velocity_before"].item(), one["velocity_after"].item()
    return first.with_(**fields_of(values, before), load_velocity_ratio=after / before)


def laboratory(dataset: xr.Dataset) -> Laboratory:
    """The rig of one fit, as `Accessor.laboratory` says."""
    one, slider = _only(dataset), scene(dataset)
    stress = one["normal_stress_before"].item() if "normal_stress_before" in one else math.nan
    if not stress > 0.0:
        remedy = (
            "Read the record with normal_stress=, or make a rsfstudy.Laboratory that states it."
        )
        raise InvalidValue("normal_stress", None, "is not in the record", remedy=remedy)
    velocity = one["velocity_before"].item() * 1e-6
    distance = velocity / slider.reference_rate
    return Laboratory(
        normal_stress=stress,
        slip_distance=distance,
        reference_velocity=velocity,
        stiffness=slider.stiffness * stress / distance,
    )
