"""Datasets in other units: by their attribute ``scale``, which says what they are measured in."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import format_unit_quotient, split_unit_quotient
from rsfstudy.rig.units import unit_factor

#: What ratios of the slider are, once they are in other units. Scenes have another `normal_stress`.
_DIMENSIONAL_NAMES_OF_RATIOS = {
    "velocity_ratio": "velocity",
    "normal_stress_ratio": "effective_normal_stress",
}
#: Names of logarithms of slip rates, and how their descriptions begin and end.
_LOG_SLIP_RATE_PATTERN = re.compile(r"(\w+_)?log10_slip_rate")
_LOG_SLIP_RATE_DESCRIPTION_PATTERN = re.compile(r"^decimal logarithm of (the )?| over V_star")

#: What stands before the name of a field where that is the name of an axis in units.
DIMENSIONLESS_PREFIX = "dimensionless_"
#: Units in which results and motions of a rig are told, in tables and figures.
DISPLAY_BASE_UNITS = {"stress": "MPa", "length": "um", "time": "s"}
#: Attribute of a dataset in other units that tells their scales.
SCALES_ATTRIBUTE = "scales"


#: Relative difference of two reference rates that are one: of rounding, and of what was printed.
_REFERENCE_RATE_RTOL = 1e-9


class UnitScale(NamedTuple):
    """Value of 1 in some units; of each cell, where it varies among them."""

    factor: float | xr.Variable
    units: str


def read_si_scales(
    dataset: xr.Dataset,
    normal_stress: float | None = None,
    slip_distance: float | None = None,
    reference_rate: float | None = None,
) -> dict[str, UnitScale]:
    """The scales of a dataset in SI units, cell by cell: those that it holds, else those stated.

    Parameters
    ----------
    dataset : xarray.Dataset
    normal_stress, slip_distance, reference_rate : float, optional
        sigma_* in Pa, D_c in m, and V_*/D_c in 1/s.

    Raises
    ------
    InvalidValue
        Where it does not hold one that is not stated, or another is stated.
    """
    return build_si_scales(
        _resolve_scale_of_dataset(dataset, "sigma_star", "normal_stress", normal_stress, "Pa"),
        _resolve_scale_of_dataset(dataset, "slip_distance", "slip_distance", slip_distance, "m"),
        _resolve_scale_of_dataset(
            dataset, "reference_rate", "reference_rate", reference_rate, "1/s"
        ),
    )


def _resolve_scale_of_dataset(
    dataset: xr.Dataset,
    coordinate_name: str,
    argument_name: str,
    stated_value: float | None,
    units: str,
) -> float | xr.Variable:
    if coordinate_name not in dataset.variables:
        if stated_value is None:
            remedy = "State it."
            raise InvalidValue(argument_name, None, "is not in the dataset", remedy=remedy)
        return stated_value
    variable = dataset[coordinate_name].variable.to_base_variable()
    held = variable * float(unit_factor(coordinate_name, variable.attrs.get("units", units), units))
    known = np.unique(held.values[np.isfinite(held.values)])
    if known.size == 1:  # that of the rig, which cells without need of it do not tell
        held = xr.Variable((), known[0])
    if stated_value is not None and not np.allclose(
        held, stated_value, rtol=_REFERENCE_RATE_RTOL, atol=0.0
    ):
        rule = f"contradicts that of the dataset, {_format_number_or_range(held)} {units}"
        remedy = "Each cell is converted by its own: state another to the scenes."
        raise InvalidValue(argument_name, stated_value, rule, remedy=remedy)
    return held


def build_scales_of_rig(rig: Mapping[str, Any]) -> dict[str, UnitScale]:
    """The scales of a rig, in SI units; of arrays of its quantities arrays."""
    rate = rig["reference_velocity"] / rig["slip_distance"]
    return build_si_scales(rig["normal_stress"], rig["slip_distance"], rate)


def convert_dataset_units(
    dataset: xr.Dataset,
    si_scales: Mapping[str, UnitScale],
    stress: str,
    length: str,
    time: str,
) -> xr.Dataset:
    """A dataset in units of stress, length and time, by its scales in SI units; see
    `apply_scales`.
    """
    units = {
        "sigma_*": stress, "D_c": length, "D_c/V_*": time, "V_*/D_c": f"{time}-1",
        "V_*": f"{length} {time}-1", "sigma_*/D_c": f"{stress} {length}-1",
    }  # fmt: skip
    size = {
        n: float(unit_factor("units", units[n], si_scales[n].units))
        for n in ("sigma_*", "D_c", "D_c/V_*")
    }
    size["V_*"] = size["D_c"] / size["D_c/V_*"]
    size["sigma_*/D_c"] = size["sigma_*"] / size["D_c"]
    size["V_*/D_c"] = 1.0 / size["D_c/V_*"]
    return apply_scales_to_dataset(
        dataset, {n: UnitScale(s.factor / size[n], units[n]) for n, s in si_scales.items()}
    )


def build_si_scales(
    normal_stress: float | xr.Variable,
    slip_distance: float | xr.Variable,
    reference_rate: float | xr.Variable,
) -> dict[str, UnitScale]:
    """The scales of dimensionless quantities in SI units, by the names that attributes have.

    Parameters
    ----------
    normal_stress : float or xarray.Variable
        sigma_* in Pa.
    slip_distance : float or xarray.Variable
        D_c in m.
    reference_rate : float or xarray.Variable
        V_*/D_c in 1/s.

    Raises
    ------
    InvalidValue
        For scales that are not positive and finite.
    """
    for of, value in (
        ("sigma_*", normal_stress), ("D_c", slip_distance), ("V_*/D_c", reference_rate),
    ):  # fmt: skip
        _check_scale_is_positive(of, value)
    found = {
        "sigma_*": UnitScale(normal_stress, "Pa"),
        "D_c": UnitScale(slip_distance, "m"),
        "V_*": UnitScale(slip_distance * reference_rate, "m s-1"),
        "D_c/V_*": UnitScale(1.0 / reference_rate, "s"),
        "V_*/D_c": UnitScale(reference_rate, "s-1"),
        "sigma_*/D_c": UnitScale(normal_stress / slip_distance, "Pa m-1"),
    }
    for of, scale in found.items():
        _check_scale_is_positive(of, scale.factor)
    return found


def _check_scale_is_positive(scale_name: str, scale_factor: float | xr.Variable) -> None:
    values = np.asarray(scale_factor)
    if not (np.isfinite(values) & (values > 0.0)).all():
        raise InvalidValue(scale_name, values.tolist(), "must be positive and finite")


def _format_number_or_range(values: float | xr.Variable) -> str:
    """A number, or the least and the largest where it varies."""
    ends = np.unique([np.min(values), np.max(values)])
    return " to ".join(f"{end:g}" for end in ends)


def find_scale_of_variable(
    variable: xr.DataArray | xr.Variable, scales_by_name: Mapping[str, UnitScale]
) -> UnitScale | None:
    """What 1 of a variable is, in its units: of ``D_c/V_* (V_*)-1``, that of the first over that of
    the other; None of what says no scale, or one that is not known.
    """
    named = split_unit_quotient(variable.attrs.get("scale", ""))
    known = {"1": UnitScale(1.0, "1"), **scales_by_name}
    if not {*named} <= {*known}:
        return None
    first, *others = (known[each] for each in named)
    beside = split_unit_quotient(variable.attrs.get("units", "1"))[1:]
    size = first.factor / math.prod(each.factor for each in others)
    return UnitScale(
        size, format_unit_quotient([first.units, *(each.units for each in others), *beside])
    )


def convert_to_display_units(dataset: xr.Dataset) -> xr.Dataset:
    """Results of a rig as tables and figures show them, in MPa, um and s; others as they are."""
    if "sigma_star" not in dataset.variables or SCALES_ATTRIBUTE in dataset.attrs:
        return dataset
    return convert_dataset_units(dataset, read_si_scales(dataset), **DISPLAY_BASE_UNITS)


def has_units_unlike_its_study(dataset: xr.Dataset) -> bool:
    """True of results in units that figures of their study do not expect."""
    told = dataset.attrs.get(SCALES_ATTRIBUTE, "")
    as_shown = "sigma_star" in dataset.variables and all(
        f" {u}," in told for u in DISPLAY_BASE_UNITS.values()
    )
    return bool(told) and not as_shown


def apply_scales_to_dataset(
    dataset: xr.Dataset, scales_by_name: Mapping[str, UnitScale]
) -> xr.Dataset:
    """A dataset in other units, all of it.

    What says its ``scale`` is multiplied by it and says its units instead; its name no longer calls
    it a ratio: ``critical_velocity``, ``load_velocity``, ``effective_normal_stress``. Beside the
    logarithm of each slip rate stands the slip rate. Pure numbers stay as they are. What stands
    beside an axis in units, without dimension, is left out. The attribute ``scales`` tells what was
    1.

    Raises
    ------
    DataError
        Where nothing says its scale, or that of an axis varies along another.
    """
    beside = [
        n
        for n in map(str, dataset.coords)
        if drop_ratio_from_name(n) != n and drop_ratio_from_name(n) in dataset
    ]
    dataset = dataset.drop_vars(beside)
    result = dataset.copy()
    logarithms = [n for n in map(str, dataset.variables) if _LOG_SLIP_RATE_PATTERN.fullmatch(n)]
    sizes = {
        n: scale
        for n, v in dataset.variables.items()
        if (scale := find_scale_of_variable(v, scales_by_name))
    }
    if not sizes:
        text = "nothing in the dataset says its scale: it is in other units already, or not ours"
        raise DataError(text)
    for name, scale in sizes.items():
        values = dataset[name].variable.to_base_variable()
        converted = values * scale.factor if np.any(values) else values  # 0 has no dimensions
        if name in dataset.dims and converted.dims != (name,):
            other = next(dim for dim in converted.dims if dim != name)
            text = f"the scale of the axis {name} varies along {other}: select one place on that"
            raise DataError(f"{text} first, as in dataset.isel({other}=0)")
        gone = {"scale", "symbol"} if "/" in values.attrs.get("symbol", "") else {"scale"}
        kept = {key: value for key, value in values.attrs.items() if key not in gone}
        result[name] = (converted.dims, converted.values, kept | {"units": scale.units})
    held = {"sigma_star": "sigma_*", "slip_distance": "D_c", "reference_velocity": "V_*"}
    for name in set(held) & set(dataset.coords) - set(dataset.dims):  # beside the axes
        one = xr.Variable((), 1.0) * scales_by_name[held[name]].factor
        words = dataset[name].attrs | {"units": scales_by_name[held[name]].units}
        result[name] = one.dims, one.values, words
    for name in logarithms:
        result = result.assign(slip_rate_from_log(dataset, name, *scales_by_name["V_*"]))
    new = {str(name): drop_ratio_from_name(str(name)) for name in sizes}
    result = result.rename({old: name for old, name in new.items() if name != old})
    for variable in result.variables.values():
        named = str(variable.attrs.get("ancillary_variables", "")).split()
        if named:
            variable.attrs["ancillary_variables"] = " ".join(new.get(name, name) for name in named)
    told = ", ".join(
        f"{n} = {_format_number_or_range(s.factor)} {s.units}" for n, s in scales_by_name.items()
    )
    return copy_with_cf_encoding(result.assign_attrs({SCALES_ATTRIBUTE: told}))


def drop_ratio_from_name(variable_name: str) -> str:
    """A name for what is no ratio any more."""
    variable_name = variable_name.removeprefix(DIMENSIONLESS_PREFIX)
    for ratio, quantity in _DIMENSIONAL_NAMES_OF_RATIOS.items():
        variable_name = variable_name.replace(ratio, quantity)
    return variable_name


def slip_rate_from_log(
    dataset: xr.Dataset, variable_name: str, factor: float | xr.Variable, units: str
) -> dict[str, xr.Variable]:
    """The slip rate of a logarithm of one, and of its error, if there is one."""
    log, plain = dataset[variable_name].variable, variable_name.replace("log10_", "")
    words = str(log.attrs.get("long_name", plain))
    about = {"long_name": re.sub(_LOG_SLIP_RATE_DESCRIPTION_PATTERN, "", words), "units": units}
    rates = xr.Variable(log.dims, 10.0**log.values) * factor
    found = {plain: xr.Variable(rates.dims, rates.values, about)}
    if f"{variable_name}_error" in dataset:
        error = dataset[f"{variable_name}_error"].variable
        about = about | {"long_name": f"numerical error estimate of {about['long_name']}"}
        size = rates * (math.log(10.0) * xr.Variable(error.dims, error.values))
        found[f"{plain}_error"] = xr.Variable(size.dims, size.values, about)
    return found
