"""Results of a study of a rig in its units, cell by cell, for what is made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import xarray as xr

from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.quantities import Quantity
from rsfstudy.rig import find_scale_of_variable, read_si_scales, unit_factor
from rsfstudy.study.reductions.base import DerivativesByVariable, Reduction


@guard_methods
@dataclass(frozen=True)
class InUnits(Reduction):
    """A variable in units of the rig, in each cell by its own scales: what a mean over samples
    needs in which a scale varies.

    Parameters
    ----------
    name, of : str
    units : str
        As in "s".
    """

    units: str = ""
    kind: ClassVar[str] = "in_units"

    @property
    def quantities(self) -> Sequence[Quantity]:
        return (Quantity(self.name, "", self.units, self.name.replace("_", " ")),)

    def __call__(self, dataset: xr.Dataset) -> xr.Dataset:
        """The variable times its scale."""
        about = {"units": self.units, "comment": f"{self.of}, each cell by its own scales"}
        values = (dataset[self.of] * self._scale_factor(dataset)).drop_attrs(deep=False)
        return xr.Dataset({self.name: values.assign_attrs(about)})

    def derivatives(self, dataset: xr.Dataset) -> DerivativesByVariable:
        """The scale."""
        return [(self._scale_factor(dataset) * xr.ones_like(dataset[self.of]), {})]

    def _scale_factor(self, dataset: xr.Dataset) -> xr.DataArray:
        scale = find_scale_of_variable(dataset[self.of], read_si_scales(dataset))
        if scale is None:
            raise InvalidValue("of", self.of, "is a pure number, in no units of a rig")
        return xr.DataArray(scale.factor / float(unit_factor(self.name, self.units, scale.units)))
