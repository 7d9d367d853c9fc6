"""Functions that derive the units and scales of the results of reductions.

The units of a result are derived from the units of the input variables, never from the name of the
result.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import replace

import xarray as xr

from rsfstudy.quantities import Quantity, format_unit_quotient
from rsfstudy.study.reductions.base import Reduction, read_quantities_not_in_vocabulary
from rsfstudy.vocabulary import find_quantity

#: Names of the coordinates that contain the scales of quantities, by the symbol of the scale.
_SCALE_COORDINATE_BY_SCALE_SYMBOL = {
    "sigma_*": "sigma_star",
    "D_c": "slip_distance",
    "V_*": "reference_velocity",
}


def build_result_quantities(
    reduction: Reduction, dataset: xr.Dataset, reduction_results: xr.Dataset
) -> dict[str, Quantity]:
    """Determine the units and descriptions of the results of a reduction.

    ``Reduction.fields_determining_result_units`` names one or two variables for each result. If one
    variable is named, the result has the units and the scale of this variable. If two variables are
    named, the units and the scale of the first variable are divided by the units and the scale of
    the second variable. Results without an entry in ``Reduction.fields_determining_result_units``
    are dimensionless. If the scale varies between the cells that were combined, the result has no
    scale, and a note is appended to its ``comment`` attribute. The description in the vocabulary is
    used only if its units and scale agree with the units and scale of the result.

    Parameters
    ----------
    reduction : Reduction
        Reduction that computed the results.
    dataset : xarray.Dataset
        Dataset to which the reduction was applied.
    reduction_results : xarray.Dataset
        Results of the reduction.

    Returns
    -------
    dict of str to Quantity
        Quantities by name. The dictionary contains the quantities of the results and the quantities
        of the dataset that are not in the vocabulary.
    """
    stated = {q.name: q for q in reduction.quantities}
    found, of = read_quantities_not_in_vocabulary(dataset) | stated, dataset[reduction.of]
    for end, fields in {"": (), **reduction.fields_determining_result_units}.items():
        name = f"{reduction.name}{end}"
        if name not in reduction_results or (name in stated and not fields):
            continue
        drawn = [dataset[getattr(reduction, field)].attrs for field in fields] or [{}]
        units, scale = (
            format_unit_quotient([a.get(key) or "1" for a in drawn]) for key in ("units", "scale")
        )
        across = {*of.dims} - {*reduction_results[name].dims} | {vars(reduction).get("along")}
        if varied := find_scale_varying_along_dimensions(
            dataset, f"{of.attrs.get('scale')} {scale}", across
        ):
            why = f"; combines cells in units of {varied}, which varies between the cells"
            reduction_results[name].attrs["comment"] = (
                reduction_results[name].attrs.get("comment", "") + why
            )
        # A fit with a nonzero intercept treats its variable as dimensionless.
        scale = "" if varied or scale == "1" or vars(reduction).get("intercept") else scale
        about = find_quantity(name, found)
        if not end and name not in stated and (about.units, about.scale) != (units, scale):
            # The result has the name of a vocabulary entry, but is a different quantity.
            about = Quantity(name, "", units, name.replace("_", " "))
        found[name] = replace(about, units=units, scale=scale)
    return found


def find_scale_varying_along_dimensions(
    dataset: xr.Dataset, scale_expression: str, reduced_dimensions: Collection[Hashable]
) -> str:
    """Find the first scale that varies along the reduced dimensions.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study. In a study with a rig, the coordinates contain the scales.
    scale_expression : str
        Scale of a variable, such as ``"D_c/V_*"``.
    reduced_dimensions : collection of str
        Dimensions along which the variable is reduced.

    Returns
    -------
    str
        Symbol of the first scale in the expression that varies along the reduced dimensions. The
        string is empty if no scale varies.
    """
    held = {
        part: dataset[n].dims
        for part, n in _SCALE_COORDINATE_BY_SCALE_SYMBOL.items()
        if n in dataset.coords
    }
    return next(
        (
            part
            for part, d in held.items()
            if part in scale_expression and {*reduced_dimensions} & {*d}
        ),
        "",
    )
