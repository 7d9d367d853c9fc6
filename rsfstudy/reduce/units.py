"""Units of what is made of a lattice: by those of what it is made of, never by its name."""

from __future__ import annotations

from collections.abc import Collection, Hashable
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
    units and scale. What was made of cells of several scales has none, and its comment says so.
    """
    stated = {q.name: q for q in reduction.quantities}
    found, of = stated_by(dataset) | stated, dataset[reduction.of]
    for end, fields in {"": (), **reduction.measured_in}.items():
        name = f"{reduction.name}{end}"
        if name not in made or (name in stated and not fields):
            continue
        drawn = [dataset[getattr(reduction, field)].attrs for field in fields] or [{}]
        units, scale = (quotient([a.get(key) or "1" for a in drawn]) for key in ("units", "scale"))
        across = {*of.dims} - {*made[name].dims} | {vars(reduction).get("along")}
        if varied := varied_scale(dataset, f"{of.attrs.get('scale')} {scale}", across):
            why = f"; of cells in units of {varied}, which varies"
            made[name].attrs["comment"] = made[name].attrs.get("comment", "") + why
        # a law that holds a number is one of numbers without dimension
        scale = "" if varied or scale == "1" or vars(reduction).get("minus") else scale
        about = quantity(name, found)
        if not end and name not in stated and (about.units, about.scale) != (units, scale):
            about = Quantity(name, "", units, name.replace("_", " "))  # it is another's name
        found[name] = replace(about, units=units, scale=scale)
    return found


def varied_scale(dataset: xr.Dataset, scale: str, across: Collection[Hashable]) -> str:
    """What of a scale varies across some dimensions."""
    held = {part: dataset[n].dims for part, n in _SCALES.items() if n in dataset.coords}
    return next((part for part, d in held.items() if part in scale and {*across} & {*d}), "")
