"""Units of what is made of a lattice: by those of what it is made of, never by its name."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import replace

import xarray as xr

from rsfstudy.quantities import Quantity, format_unit_quotient
from rsfstudy.study.reductions.base import Reduction, read_undocumented_quantities
from rsfstudy.vocabulary import find_quantity

#: Coordinates of the scales that quantities are measured in.
_SCALE_COORDINATES = {"sigma_*": "sigma_star", "D_c": "slip_distance", "V_*": "reference_velocity"}


def describe_reduction_results(
    reduction: Reduction, dataset: xr.Dataset, reduction_results: xr.Dataset
) -> dict[str, Quantity]:
    """Quantities of the results of a reduction, and those that the dataset states.

    A result is what the reduction says in `quantities`, in units and scale of what it draws on
    (`unit_fields`); all others are pure numbers. The vocabulary has words for those of the same
    units and scale. What was made of cells of several scales has none, and its comment says so.
    """
    stated = {q.name: q for q in reduction.quantities}
    found, of = read_undocumented_quantities(dataset) | stated, dataset[reduction.of]
    for end, fields in {"": (), **reduction.unit_fields}.items():
        name = f"{reduction.name}{end}"
        if name not in reduction_results or (name in stated and not fields):
            continue
        drawn = [dataset[getattr(reduction, field)].attrs for field in fields] or [{}]
        units, scale = (
            format_unit_quotient([a.get(key) or "1" for a in drawn]) for key in ("units", "scale")
        )
        across = {*of.dims} - {*reduction_results[name].dims} | {vars(reduction).get("along")}
        if varied := find_varying_scale(dataset, f"{of.attrs.get('scale')} {scale}", across):
            why = f"; of cells in units of {varied}, which varies"
            reduction_results[name].attrs["comment"] = (
                reduction_results[name].attrs.get("comment", "") + why
            )
        # a law that holds a number is one of numbers without dimension
        scale = "" if varied or scale == "1" or vars(reduction).get("minus") else scale
        about = find_quantity(name, found)
        if not end and name not in stated and (about.units, about.scale) != (units, scale):
            about = Quantity(name, "", units, name.replace("_", " "))  # it is another's name
        found[name] = replace(about, units=units, scale=scale)
    return found


def find_varying_scale(
    dataset: xr.Dataset, scale_expression: str, reduced_dimensions: Collection[Hashable]
) -> str:
    """What of a scale varies across some dimensions."""
    held = {part: dataset[n].dims for part, n in _SCALE_COORDINATES.items() if n in dataset.coords}
    return next(
        (
            part
            for part, d in held.items()
            if part in scale_expression and {*reduced_dimensions} & {*d}
        ),
        "",
    )
