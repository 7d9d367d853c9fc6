"""Class that converts a dataset to physical units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import xarray as xr

from rsfstudy.rig import dataset_unit_scales
from rsfstudy.rig.dataset_unit_scales import UnitScale


class DatasetUnits:
    """Converter that finds the unit scales of a dataset and converts it to physical units.

    Parameters
    ----------
    dataset : xarray.Dataset
        Results of a study, or a simulated motion.
    """

    #: Name of the dataset attribute that lists the scales after a conversion.
    UNIT_SCALES_ATTRIBUTE_NAME: ClassVar[str] = dataset_unit_scales.UNIT_SCALES_ATTRIBUTE_NAME
    #: Units of stress, length and time in tables and figures of rigs.
    DISPLAY_UNITS: ClassVar[Mapping[str, str]] = (
        dataset_unit_scales.DISPLAY_UNITS_OF_STRESS_LENGTH_TIME
    )
    #: Prefix of the name of a dimensionless field if an axis in physical units has the same name.
    DIMENSIONLESS_FIELD_NAME_PREFIX: ClassVar[str] = dataset_unit_scales.DIMENSIONLESS_PREFIX

    convert_to_dimensional_variable_name = staticmethod(
        dataset_unit_scales.convert_to_dimensional_variable_name
    )

    def __init__(self, dataset: xr.Dataset) -> None:
        """Store a reference to the dataset."""
        self._dataset = dataset

    def convert_to_units(
        self, stress: str, length: str, time: str, **si_scales: float
    ) -> xr.Dataset:
        """Convert the dataset to physical units of stress, length and time.

        Parameters
        ----------
        stress, length, time : str
            Requested units.
        **si_scales : float
            Scales that the dataset does not contain, passed as keyword arguments of
            `read_si_scales`.

        Returns
        -------
        xarray.Dataset
            Dataset in physical units.

        Raises
        ------
        InvalidValue
            If a scale is missing, or if an argument contradicts the dataset.
        """
        scales = dataset_unit_scales.read_si_scales(self._dataset, **si_scales)
        return dataset_unit_scales.convert_dataset_units(
            self._dataset, scales, stress, length, time
        )

    def convert_to_display_units(self) -> xr.Dataset:
        """Convert the results of a rig to MPa, um and s for tables and figures.

        Returns
        -------
        xarray.Dataset
            Results in MPa, um and s. A dataset without a rig is returned unchanged.
        """
        return dataset_unit_scales.convert_to_display_units(self._dataset)

    def find_unit_scale_of_variable(self, variable_name: str) -> UnitScale | None:
        """Find the SI value of the dimensionless unit of a variable.

        Parameters
        ----------
        variable_name : str
            Name of a variable of the dataset.

        Returns
        -------
        UnitScale or None
            Scale of the variable, or None if the variable has no scale or an unknown scale.

        Raises
        ------
        InvalidValue
            If the dataset does not contain the scales of its rig.
        """
        scales = dataset_unit_scales.read_si_scales(self._dataset)
        return dataset_unit_scales.find_unit_scale_of_variable(self._dataset[variable_name], scales)

    def compute_slip_rate_from_log(
        self, variable_name: str, factor: float | xr.Variable, units: str
    ) -> dict[str, xr.Variable]:
        r"""Compute slip rates from their decimal logarithms.

        Parameters
        ----------
        variable_name : str
            Name of the logarithm.
        factor : float or xarray.Variable
            Value of :math:`V_*` in ``units``.
        units : str
            Units of the slip rate.

        Returns
        -------
        dict of str to xarray.Variable
            Slip rate and its error estimate, by variable name.
        """
        return dataset_unit_scales.compute_slip_rate_from_log(
            self._dataset, variable_name, factor, units
        )

    @property
    def has_units_other_than_display_units(self) -> bool:
        """True if the results do not have the units that study figures require."""
        return dataset_unit_scales.has_units_other_than_display_units(self._dataset)
