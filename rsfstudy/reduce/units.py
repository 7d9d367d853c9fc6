"""Units of what is made of a lattice: by those of what it is made of, never by its name."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import replace

import xarray as xr

from rsfstudy.quantity import Quantity, quotient
from rsfstudy.reduce.base import Reduction, stated_by
from rsfstudy.vocabulary import quantity

#: Coordinates of the scales that quantities are measured in.
_SCALES = {"sigma_*": "sigma_star", "D_c": "slip_distance", "V_*": "reference_velocity"}


def described(reduction: Reduction, dataset: xr.Dataset, made: xr.Dataset) -> dict[str, Quantity]:
    """Quantities of the results of a reduction, and those that the dataset states.

    A result is what the reduction says in `quantities`, in units and scale of what it draws on
    (`measured_in`); all others are pure numbers. The vocabulary has words for those of the same
    units and scale. Where cells of several scales went into one number it has none, and its comment
    says so.
    """
    stated = {q.name: q for q in reduction.quantities}
    found = stated_by(dataset) | stated
    ends: dict[str, Sequence[str]] = {} if reduction.name in stated else {"": ()}
    for end, of in (ends | dict(reduction.measured_in)).items():
        name = f"{reduction.name}{end}"
        if name not in made:
            continue
        units, scale, why = _measured(reduction, of, dataset, made[name])
        if why:
            made[name].attrs["comment"] = f"{made[name].attrs['comment']}; {why}"
        about = quantity(name, found)
        if not end and name not in stated and (about.units, about.scale) != (units, scale):
            about = Quantity(name, "", units, name.replace("_", " "))  # it is another's name
        found[name] = replace(about, units=units, scale=scale)
    return found


def _measured(
    reduction: Reduction, of: Sequence[str], dataset: xr.Dataset, result: xr.DataArray
) -> tuple[str, str, str]:
    """Units and scale of a result, and why it has no scale though what it is made of has."""
    units, scales = [], []
    for field in of:
        values = dataset[getattr(reduction, field)]
        units.append(values.attrs.get("units") or "1")
        scales.append(values.attrs.get("scale") or "1")
        across = {*values.dims} - {*result.dims}
        if field == "of":
            across |= {vars(reduction).get("along", "")}
        if varied := varied_scale(dataset, values, across):
            return quotient(units), "", f"{values.name} is in units of {varied}, which varies"
    scale = "1" if reduction.dimensionless else quotient(scales)
    return quotient(units), "" if scale == "1" else scale, ""


def varied_scale(dataset: xr.Dataset, of: xr.DataArray, across: Collection[Hashable]) -> str:
    """A scale that a variable is measured in and that varies across some dimensions."""
    scale = of.attrs.get("scale", "")
    varied = (
        symbol
        for symbol, name in _SCALES.items()
        if name in dataset.coords and {*across} & {*dataset[name].dims}
    )
    return next((symbol for symbol in varied if symbol in scale), "")
