"""Functions that convert datasets from dimensionless to physical units.

The attribute ``scale`` of a dimensionless variable contains the unit in which the variable is
expressed, for example ``D_c/V_*``. The main function `convert_dataset_units` multiplies variables
by the scales from `read_si_scales`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from rsfstudy.errors import DataError, InvalidValue
from rsfstudy.netcdf_encoding import copy_with_cf_encoding
from rsfstudy.quantities import (
    format_unit_quotient,
    replace_comment_on_scales,
    split_unit_quotient,
)
from rsfstudy.rig.units import compute_conversion_factor

#: Names of velocity ratios and normal stress ratios after the conversion to physical units. The
#: name ``normal_stress`` is not available, because scenes have a field with the name
#: ``normal_stress``.
_DIMENSIONAL_NAME_BY_RATIO_NAME = {
    "velocity_ratio": "velocity",
    "normal_stress_ratio": "effective_normal_stress",
}
#: The first pattern matches the names of variables that contain logarithms of slip rates. The
#: second pattern matches words that are removed from the start and the end of variable
#: descriptions.
_LOG_SLIP_RATE_PATTERN = re.compile(r"(\w+_)?log10_slip_rate")
_LOG_SLIP_RATE_DESCRIPTION_PATTERN = re.compile(r"^decimal logarithm of (the )?| over V_star")

#: Prefix for the names of dimensionless fields. The prefix is added only if an axis with units has
#: the same name as the field.
DIMENSIONLESS_PREFIX = "dimensionless_"
#: Units of stress, length and time in tables and figures of rigs.
DISPLAY_UNITS_OF_STRESS_LENGTH_TIME = {"stress": "MPa", "length": "um", "time": "s"}
#: Name of the dataset attribute that lists the scales after a conversion.
UNIT_SCALES_ATTRIBUTE_NAME = "scales"
_COMMENT_ON_CONVERTED_UNITS = (
    "Variables have the units in their attributes. The attribute scales of the dataset lists the "
    "scales by which dimensionless values were multiplied."
)

#: Relative tolerance for the comparison of two scales. The tolerance allows for rounding errors and
#: for the limited number of digits of printed scales.
_RTOL_FOR_COMPARING_SCALES = 1e-9


class UnitScale(NamedTuple):
    """Value of one dimensionless unit in physical units.

    Parameters
    ----------
    factor : float or xarray.Variable
        Value of one dimensionless unit. A variable contains one factor per lattice cell.
    units : str
        Physical units of ``factor``.
    """

    factor: float | xr.Variable
    units: str


def read_si_scales(
    dataset: xr.Dataset,
    normal_stress: float | None = None,
    slip_distance: float | None = None,
    reference_rate: float | None = None,
) -> dict[str, UnitScale]:
    r"""Determine the SI values of the dimensionless units of a dataset.

    The function reads the scales from the coordinates of the dataset. If the dataset does not
    contain a scale, pass the scale as an argument.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a simulated motion.
    normal_stress : float, optional
        Normal stress :math:`\sigma_*` in Pa.
    slip_distance : float, optional
        Slip distance :math:`D_c` in m.
    reference_rate : float, optional
        Reference rate :math:`V_*/D_c` in 1/s.

    Returns
    -------
    dict of str to UnitScale
        Scales by name, for example ``D_c``. If a scale varies between lattice cells, its factor is
        a variable with one value per lattice cell.

    Raises
    ------
    InvalidValue
        If a scale is missing, or if an argument contradicts the dataset.
    """
    return compute_si_scales(
        _read_stored_scale_or_use_argument(
            dataset, "sigma_star", "normal_stress", normal_stress, "Pa"
        ),
        _read_stored_scale_or_use_argument(
            dataset, "slip_distance", "slip_distance", slip_distance, "m"
        ),
        _read_stored_scale_or_use_argument(
            dataset, "reference_rate", "reference_rate", reference_rate, "1/s"
        ),
    )


def _read_stored_scale_or_use_argument(
    dataset: xr.Dataset,
    coordinate_name: str,
    argument_name: str,
    stated_value: float | None,
    units: str,
) -> float | xr.Variable:
    if coordinate_name not in dataset.variables:
        if stated_value is None:
            remedy = "Pass it as an argument."
            raise InvalidValue(
                argument_name,
                None,
                "is required, because the dataset does not contain it",
                remedy=remedy,
            )
        return stated_value
    variable = dataset[coordinate_name].variable.to_base_variable()
    held = variable * float(
        compute_conversion_factor(coordinate_name, variable.attrs.get("units", units), units)
    )
    known = np.unique(held.values[np.isfinite(held.values)])
    # If the scale does not vary, the same value also applies to cells in which the scale is NaN.
    if known.size == 1:
        held = xr.Variable((), known[0])
    if stated_value is not None and not np.allclose(
        held, stated_value, rtol=_RTOL_FOR_COMPARING_SCALES, atol=0.0
    ):
        rule = f"differs from the value in the dataset, {_format_number_or_range(held)} {units}"
        remedy = (
            "Each cell is converted with its own scale. To use another scale, change the scale "
            "in the scenes."
        )
        raise InvalidValue(argument_name, stated_value, rule, remedy=remedy)
    return held


def compute_unit_scales_of_rig(rig: Mapping[str, Any]) -> dict[str, UnitScale]:
    """Compute the SI values of the dimensionless units of a rig.

    Parameters
    ----------
    rig : mapping of str to float or ndarray
        Quantities of the rig in SI units.

    Returns
    -------
    dict of str to UnitScale
        Scales by name. If the quantities are arrays, the factors are arrays.
    """
    rate = rig["reference_velocity"] / rig["slip_distance"]
    return compute_si_scales(rig["normal_stress"], rig["slip_distance"], rate)


def convert_dataset_units(
    dataset: xr.Dataset,
    si_scales: Mapping[str, UnitScale],
    stress: str,
    length: str,
    time: str,
) -> xr.Dataset:
    """Convert a dataset to physical units of stress, length and time.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dimensionless results of a study, or a dimensionless motion.
    si_scales : mapping of str to UnitScale
        Scales in SI units, from `read_si_scales`.
    stress, length, time : str
        Requested units.

    Returns
    -------
    xarray.Dataset
        Dataset in physical units. See `multiply_variables_by_unit_scales` for details.
    """
    units = {
        "sigma_*": stress, "D_c": length, "D_c/V_*": time, "V_*/D_c": f"{time}-1",
        "V_*": f"{length} {time}-1", "sigma_*/D_c": f"{stress} {length}-1",
    }  # fmt: skip
    size = {
        n: float(compute_conversion_factor("units", units[n], si_scales[n].units))
        for n in ("sigma_*", "D_c", "D_c/V_*")
    }
    size["V_*"] = size["D_c"] / size["D_c/V_*"]
    size["sigma_*/D_c"] = size["sigma_*"] / size["D_c"]
    size["V_*/D_c"] = 1.0 / size["D_c/V_*"]
    return multiply_variables_by_unit_scales(
        dataset, {n: UnitScale(s.factor / size[n], units[n]) for n, s in si_scales.items()}
    )


def compute_si_scales(
    normal_stress: float | xr.Variable,
    slip_distance: float | xr.Variable,
    reference_rate: float | xr.Variable,
) -> dict[str, UnitScale]:
    r"""Compute the SI values of all dimensionless units.

    Parameters
    ----------
    normal_stress : float or xarray.Variable
        Normal stress :math:`\sigma_*` in Pa.
    slip_distance : float or xarray.Variable
        Slip distance :math:`D_c` in m.
    reference_rate : float or xarray.Variable
        Reference rate :math:`V_*/D_c` in 1/s.

    Returns
    -------
    dict of str to UnitScale
        Scales by name. The names are the values of the attribute ``scale``.

    Raises
    ------
    InvalidValue
        If a scale is not positive or not finite.
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
    """Format a number, or the minimum and maximum of an array."""
    ends = np.unique([np.min(values), np.max(values)])
    return " to ".join(f"{end:g}" for end in ends)


def find_unit_scale_of_variable(
    variable: xr.DataArray | xr.Variable, scales_by_name: Mapping[str, UnitScale]
) -> UnitScale | None:
    """Find the physical value of the dimensionless unit of a variable.

    Parameters
    ----------
    variable : xarray.DataArray or xarray.Variable
        Variable with an attribute ``scale``. The scale may be a quotient of two scales. For
        example, ``D_c/V_* (V_*)-1`` is the quotient of ``D_c/V_*`` and ``V_*``.
    scales_by_name : mapping of str to UnitScale
        Scales of the dataset.

    Returns
    -------
    UnitScale or None
        Scale of the variable, or None if the variable has no scale or an unknown scale.
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
    """Convert the results of a rig to MPa, um and s for tables and figures.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    xarray.Dataset
        Results in MPa, um and s. A dataset without a rig is returned unchanged.
    """
    if "sigma_star" not in dataset.variables or UNIT_SCALES_ATTRIBUTE_NAME in dataset.attrs:
        return dataset
    return convert_dataset_units(
        dataset, read_si_scales(dataset), **DISPLAY_UNITS_OF_STRESS_LENGTH_TIME
    )


def has_units_other_than_display_units(dataset: xr.Dataset) -> bool:
    """Return True if results do not have the units that study figures require.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study.

    Returns
    -------
    bool
        True if the results were converted to units other than MPa, um and s, or if the results have
        physical units but no rig.
    """
    told = dataset.attrs.get(UNIT_SCALES_ATTRIBUTE_NAME, "")
    as_shown = "sigma_star" in dataset.variables and all(
        f" {u}," in told for u in DISPLAY_UNITS_OF_STRESS_LENGTH_TIME.values()
    )
    return bool(told) and not as_shown


def multiply_variables_by_unit_scales(
    dataset: xr.Dataset, scales_by_name: Mapping[str, UnitScale]
) -> xr.Dataset:
    """Multiply all variables of a dataset by their scales.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dimensionless results of a study, or a dimensionless motion.
    scales_by_name : mapping of str to UnitScale
        Scales by name.

    Returns
    -------
    xarray.Dataset
        Dataset in physical units. The attribute ``scales`` lists the scales.

    Raises
    ------
    DataError
        If no variable has a scale, or if the scale of an axis varies along another axis.

    Notes
    -----
    Each converted variable has the attribute ``units`` instead of the attribute ``scale``. The
    suffix ``_ratio`` is removed from names, for example in ``critical_velocity``, ``load_velocity``
    and ``effective_normal_stress``. For each logarithm of a slip rate, the function adds a variable
    with the slip rate. Variables without a scale do not change. A dimensionless coordinate is
    removed if the dataset also contains the same quantity in physical units.
    """
    beside = [
        n
        for n in map(str, dataset.coords)
        if convert_to_dimensional_variable_name(n) != n
        and convert_to_dimensional_variable_name(n) in dataset
    ]
    dataset = dataset.drop_vars(beside)
    result = dataset.copy()
    logarithms = [n for n in map(str, dataset.variables) if _LOG_SLIP_RATE_PATTERN.fullmatch(n)]
    sizes = {
        n: scale
        for n, v in dataset.variables.items()
        if (scale := find_unit_scale_of_variable(v, scales_by_name))
    }
    if not sizes:
        text = (
            "no variable of the dataset has the attribute scale. The dataset was already "
            "converted, or was not created by rsfstudy"
        )
        raise DataError(text)
    for name, scale in sizes.items():
        values = dataset[name].variable.to_base_variable()
        # Zero has the same value in all units, so a variable of zeros does not get the dimensions
        # of the scale.
        converted = values * scale.factor if np.any(values) else values
        if name in dataset.dims and converted.dims != (name,):
            other = next(dim for dim in converted.dims if dim != name)
            text = f"the scale of the axis {name} varies along {other}. Select one point of {other}"
            raise DataError(f"{text} first, for example dataset.isel({other}=0)")
        gone = {"scale", "symbol"} if "/" in values.attrs.get("symbol", "") else {"scale"}
        kept = {key: value for key, value in values.attrs.items() if key not in gone}
        result[name] = (converted.dims, converted.values, kept | {"units": scale.units})
    held = {"sigma_star": "sigma_*", "slip_distance": "D_c", "reference_velocity": "V_*"}
    # Convert scales that are coordinates but not axes of the lattice.
    for name in set(held) & set(dataset.coords) - set(dataset.dims):
        one = xr.Variable((), 1.0) * scales_by_name[held[name]].factor
        words = dataset[name].attrs | {"units": scales_by_name[held[name]].units}
        result[name] = one.dims, one.values, words
    for name in logarithms:
        result = result.assign(compute_slip_rate_from_log(dataset, name, *scales_by_name["V_*"]))
    new = {str(name): convert_to_dimensional_variable_name(str(name)) for name in sizes}
    result = result.rename({old: name for old, name in new.items() if name != old})
    for variable in result.variables.values():
        named = str(variable.attrs.get("ancillary_variables", "")).split()
        if named:
            variable.attrs["ancillary_variables"] = " ".join(new.get(name, name) for name in named)
    told = ", ".join(
        f"{n} = {_format_number_or_range(s.factor)} {s.units}" for n, s in scales_by_name.items()
    )
    result.attrs = replace_comment_on_scales(dataset.attrs, _COMMENT_ON_CONVERTED_UNITS)
    return copy_with_cf_encoding(result.assign_attrs({UNIT_SCALES_ATTRIBUTE_NAME: told}))


def convert_to_dimensional_variable_name(variable_name: str) -> str:
    """Return the name of a variable after the conversion to physical units.

    Parameters
    ----------
    variable_name : str
        Name of the dimensionless variable.

    Returns
    -------
    str
        Name without ``ratio`` and without the prefix ``dimensionless_``.
    """
    variable_name = variable_name.removeprefix(DIMENSIONLESS_PREFIX)
    for ratio, quantity in _DIMENSIONAL_NAME_BY_RATIO_NAME.items():
        variable_name = variable_name.replace(ratio, quantity)
    return variable_name


def compute_slip_rate_from_log(
    dataset: xr.Dataset, variable_name: str, factor: float | xr.Variable, units: str
) -> dict[str, xr.Variable]:
    """Compute slip rates from their decimal logarithms.

    Parameters
    ----------
    dataset : xarray.Dataset
        Dataset with the logarithm of a slip rate.
    variable_name : str
        Name of the logarithm.
    factor : float or xarray.Variable
        Value of :math:`V_*` in ``units``.
    units : str
        Units of the slip rate.

    Returns
    -------
    dict of str to xarray.Variable
        Slip rate by its name. If the dataset contains an error estimate of the logarithm, the
        dictionary also contains the error estimate of the slip rate.
    """
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
