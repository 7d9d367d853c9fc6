"""Reduction that converts results to rig units, so that other reductions can use them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.quantities import Quantity
from rsfstudy.rig import DatasetUnits, compute_conversion_factor
from rsfstudy.study.reductions.base import DerivativesAndCellCoordinates, Reduction


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class InUnits(Reduction):
    """Reduction that converts a variable to rig units with the scales of each cell.

    Convert a variable before you compute its mean over samples with different scales. The mean of
    the dimensionless values would combine values that have different scales.

    Parameters
    ----------
    name : str
        Name of the result.
    of : str
        Name of the variable to reduce.
    units : str
        Units of the result, such as ``"s"``.

    Examples
    --------
    >>> import xarray as xr
    >>> from rsfstudy.reductions import InUnits
    >>> attributes = {"units": "1", "scale": "D_c/V_*"}
    >>> dataset = xr.Dataset(
    ...     {"time": ("cell", [10.0, 20.0], attributes)},
    ...     coords={
    ...         "sigma_star": ((), 5.0, {"units": "MPa"}),
    ...         "slip_distance": ((), 1e-5, {"units": "m"}),
    ...         "reference_rate": ((), 0.2, {"units": "s-1"}),
    ...     },
    ... )
    >>> seconds = InUnits(name="seconds", of="time", units="s")(dataset)
    >>> seconds["seconds"].values.round(6).tolist()
    [50.0, 100.0]
    """

    units: str = ""
    kind: ClassVar[str] = "in_units"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Quantity that describes the result, with the requested units."""
        return (Quantity(self.name, "", self.units, self.name.replace("_", " ")),)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """Multiply the variable by its scale in the requested units.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        xarray.Dataset
            Converted variable.

        Raises
        ------
        InvalidValue
            If the variable has no scale.
        """
        about = {
            "units": self.units,
            "comment": f"{self.of}, converted in each cell with the scales of the cell",
        }
        values = (dataset[self.of] * self._compute_unit_conversion_factor(dataset)).drop_attrs(
            deep=False
        )
        return xr.Dataset({self.name: values.assign_attrs(about)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesAndCellCoordinates:
        """Return the scale factor of each cell.

        Parameters
        ----------
        dataset : xarray.Dataset
            Results of all cells of the lattice, including the variable ``status``.

        Returns
        -------
        sequence of (xarray.DataArray, mapping)
            Pairs of a derivative and the position of the cells, as described in
            `Reduction.derivatives`.
        """
        return [
            (self._compute_unit_conversion_factor(dataset) * xr.ones_like(dataset[self.of]), {})
        ]

    def _compute_unit_conversion_factor(self, dataset: xr.Dataset) -> xr.DataArray:
        """Compute the scale of each cell in the requested units."""
        scale = DatasetUnits(dataset).find_unit_scale_of_variable(self.of)
        if scale is None:
            raise InvalidValue(
                "of", self.of, "has no scale, so it cannot be converted to units of a rig"
            )
        return xr.DataArray(
            scale.factor / float(compute_conversion_factor(self.name, self.units, scale.units))
        )
