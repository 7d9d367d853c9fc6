"""Datasets in other units: by their attribute ``scale``, which says what they are measured in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import xarray as xr

from rsfstudy.errors import InvalidValue


class Scale(NamedTuple):
    """What 1 is in some units."""

    factor: float
    units: str


def scales(normal_stress: float, slip_distance: float, reference_rate: float) -> dict[str, Scale]:
    """The scales of dimensionless quantities in SI units, by the names that attributes have.

    Parameters
    ----------
    normal_stress : float
        sigma_* in Pa.
    slip_distance : float
        D_c in m.
    reference_rate : float
        V_*/D_c in 1/s.

    Raises
    ------
    InvalidValue
        For scales that are not positive and finite.
    """
    found = {
        "sigma_*": Scale(normal_stress, "Pa"),
        "D_c": Scale(slip_distance, "m"),
        "V_*": Scale(slip_distance * reference_rate, "m s-1"),
        "D_c/V_*": Scale(1.0 / reference_rate if reference_rate else 0.0, "s"),
        "V_*/D_c": Scale(reference_rate, "s-1"),
        "sigma_*/D_c": Scale(normal_stress / slip_distance, "Pa m-1"),
    }
    for of, scale in found.items():
        if not 0.0 < scale.factor < float("inf"):
            raise InvalidValue(of, scale.factor, "must be positive and finite")
    return found


def scaled(dataset: xr.Dataset, by: Mapping[str, Scale]) -> xr.Dataset:
    """A dataset with its dimensionless quantities multiplied by their scales, which it says."""
    result = dataset.copy()
    for name, values in dataset.variables.items():
        scale = by.get(values.attrs.get("scale", ""))
        if scale is not None:
            kept = {key: value for key, value in values.attrs.items() if key != "scale"}
            about = kept | {"units": scale.units}
            result[name] = (values.dims, values.values * scale.factor, about)
    return result
