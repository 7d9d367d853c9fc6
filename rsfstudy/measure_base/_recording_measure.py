"""Base class of measures that record a motion along the dimension ``phase``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rsfstudy._deprecation import build_getattr_for_former_names
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.measure_base.measure import Measure
from rsfstudy.quantities import Output
from rsfstudy.slider import cached_attribute

#: Variables along ``phase`` that are recorded if normal stress changes.
VARIABLES_RECORDED_ALONG_PHASE = (
    "time",
    "load_point_displacement",
    "slip",
    "friction_coefficient",
    "normal_stress_ratio",
    "log10_slip_rate",
)


def create_outputs_along_phase(*names: str) -> tuple[Output, ...]:
    """Create outputs that have the dimension ``phase``.

    Parameters
    ----------
    *names : str
        Names of quantities in the common vocabulary.

    Returns
    -------
    tuple of Output
        One output per name.
    """
    return tuple(Output(name, dims=("phase",)) for name in names)


@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True)
class RecordingMeasure(Measure):
    """Base class for measures whose results include a motion along the `phase` dimension.

    A subclass defines the field ``phases``, which sets the number of points of the record.
    """

    def __post_init__(self) -> None:
        """Check the number of points of the record."""
        if self.recorded_point_count < 2:
            raise InvalidValue("phases", self.recorded_point_count, "must be at least 2")

    @property
    def recorded_point_count(self) -> int:
        """Number of points of the stored record."""
        return int(self.scalar_field_values["phases"])

    @cached_attribute
    def output_coordinates(self) -> Mapping[str, np.ndarray]:
        """Coordinate values of ``phase``, from 0 to 1."""
        return {"phase": np.linspace(0.0, 1.0, self.recorded_point_count)}


if not TYPE_CHECKING:
    __getattr__ = build_getattr_for_former_names(__name__)
