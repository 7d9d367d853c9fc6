"""A rig: what its record states, turned into scenes, and results turned back."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import xarray as xr

from rsfstudy.errors import InvalidValue
from rsfstudy.rig.scales import Scale, rate_of, scaled, scales
from rsfstudy.rig.units import factor, in_si
from rsfstudy.slider.loading import Segment
from rsfstudy.slider.protocol import Protocol, protocol
from rsfstudy.slider.registry import QUANTITIES
from rsfstudy.slider.scene import Scene

#: What a laboratory may state: SI units, and the range that is usual; beyond it, it warns.
_STATED: Mapping[str, tuple[str, float, float]] = {
    "normal_stress": ("Pa", 1e2, 1e10),
    "slip_distance": ("m", 1e-9, 1e-1),
    "reference_velocity": ("m/s", 1e-13, 1e1),
    "stiffness": ("Pa/m", 1e4, 1e15),
    "period": ("s", 1e-6, 1e3),
    "mass": ("kg/m^2", 1e-2, 1e9),
    "shear_modulus": ("Pa", 1e5, 1e12),
    "density": ("kg/m^3", 1e2, 2e4),
}
#: SI units of fields of a scene, by what they are measured in or their own units.
_UNITS = {
    "sigma_*": "Pa", "D_c": "m", "V_*": "m/s", "D_c/V_*": "s", "sigma_*/D_c": "Pa/m",
    "V_*/D_c": "1/s", "s": "s", "s-1": "1/s",
}  # fmt: skip
_FIELDS = {about.name: about for about in QUANTITIES}
_SEGMENT = {
    "velocity": "V_*", "duration": "D_c/V_*", "distance": "D_c", "step": "D_c",
    "normal_stress": "sigma_*",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Laboratory:
    """A rig, in its own units.

    Every quantity is a plain number in SI units, a text with units ("5 MPa", "10 um", "1 um/s"), or
    a quantity of pint. The usual units are known without pint.

    Parameters
    ----------
    normal_stress : quantity
        sigma_* (Pa).
    slip_distance : quantity
        D_c (m).
    reference_velocity : quantity
        V_* (m/s): that of the load point before the test.
    stiffness : quantity, optional
        Of the machine with its sample, as stress over displacement (Pa/m); or as friction over
        displacement (a text in 1/um, say), which is multiplied by normal stress.
    period : quantity, optional
        Period of free oscillation T (s), where mass acts; or
    mass : quantity, optional
        the mass that moves over the area of the fault (kg/m^2): ``T = 2 pi sqrt(mass/stiffness)``.
        Scenes of a rig that states either have ``inertia=True``.
    shear_modulus, density : quantity, optional
        Of the medium (Pa; kg/m^3), where it radiates: damping ``sqrt(G rho)/2``, which stands in
        for mass.

    Raises
    ------
    InvalidValue
        For what is no quantity, not positive, or of another kind; and where mass is stated without
        stiffness, or twice.
    """

    normal_stress: Any
    slip_distance: Any
    reference_velocity: Any
    stiffness: Any = None
    period: Any = None
    mass: Any = None
    shear_modulus: Any = None
    density: Any = None

    def __post_init__(self) -> None:
        for name, (units, least, most) in _STATED.items():
            if getattr(self, name) is not None:
                value = self._si(name, getattr(self, name), units)
                if not value > 0.0:
                    rule, remedy = "must be positive", f"Give it in {units}."
                    raise InvalidValue(name, getattr(self, name), rule, remedy=remedy)
                object.__setattr__(self, name, value)
                if not least <= value <= most:
                    text = f"{name} is {value:g} {units}: unusual for a rig. Is the unit right?"
                    warnings.warn(text, UserWarning, stacklevel=3)
        if self.mass is not None and self.period is not None:
            rule = f"give mass or period (here {self.period:g} s), not both"
            raise InvalidValue("mass", self.mass, rule)
        if self.mass is not None and self.stiffness is None:
            remedy = "State the stiffness too, or the period."
            raise InvalidValue("mass", self.mass, "needs a stiffness to oscillate", remedy=remedy)
        if (self.shear_modulus is None) != (self.density is None):
            remedy = "State shear_modulus and density, or neither."
            raise InvalidValue("density", self.density, "goes with shear_modulus", remedy=remedy)

    @property
    def scales(self) -> dict[str, Scale]:
        """Scales of dimensionless quantities, in SI units."""
        rate = self.reference_velocity / self.slip_distance
        return scales(self.normal_stress, self.slip_distance, rate)

    def dimensionless(self, value: Any, scale: str = "D_c/V_*", name: str = "value") -> float:
        """A quantity in units of a scale: of time, unless ``D_c``, ``V_*``, ``sigma_*`` or
        ``sigma_*/D_c`` is asked for.
        """
        return float(self._si(name, value, _UNITS[scale]) / self.scales[scale].factor)

    def scene(self, **fields: Any) -> Scene:
        """A scene of this rig.

        Parameters
        ----------
        **fields
            Those of `Scene`. One that is measured in a unit of the slider (`hold_time`,
            `displacement_step` and so on) is a quantity here; a ratio stays a ratio, unless it has
            units. ``inertia=False`` leaves out the mass that the rig states.
        """
        return Scene(**self._of_rig() | {n: self._field(n, v) for n, v in fields.items()})

    def protocol(
        self, segments: Sequence[Segment | Mapping[str, Any]], name: str = "protocol"
    ) -> Protocol:
        """A loading history whose segments state quantities: see `rsfstudy.protocol`."""
        if isinstance(segments, list | tuple):
            segments = [self._segment(n, s) for n, s in enumerate(segments, start=1)]
        return protocol(segments, name)

    def in_units(
        self, dataset: xr.Dataset, *, stress: str = "Pa", length: str = "m", time: str = "s"
    ) -> xr.Dataset:
        """Results or a motion in units of the rig, which its attributes name; all of it, as
        `rsfstudy.to_si` says.

        Parameters
        ----------
        dataset : xarray.Dataset
            In units of the slider.
        stress, length, time : str
            As in ``stress="MPa", length="um"``; velocities and stiffnesses follow.

        Raises
        ------
        InvalidValue
            For units of another kind, and results at another reference rate than that of the rig.
        DataError
            For a dataset that is in other units already, or not of rsfstudy.
        """
        rate_of(dataset, self.reference_velocity / self.slip_distance)
        units = {"sigma_*": (stress, "Pa"), "D_c": (length, "m"), "D_c/V_*": (time, "s")}
        size = {name: factor("units", *pair) for name, pair in units.items()}
        size["V_*"] = size["D_c"] / size["D_c/V_*"]
        size["sigma_*/D_c"] = size["sigma_*"] / size["D_c"]
        size["V_*/D_c"] = 1.0 / size["D_c/V_*"]
        units |= {"V_*/D_c": (f"{time}-1", "")}
        units |= {"V_*": (f"{length} {time}-1", ""), "sigma_*/D_c": (f"{stress} {length}-1", "")}
        by = {n: Scale(s.factor / size[n], units[n][0]) for n, s in self.scales.items()}
        return scaled(dataset, by).assign_attrs(laboratory=json.dumps(self.as_dict()))

    def as_dict(self) -> dict[str, float]:
        """Quantities that were stated, in SI units."""
        stated = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in stated.items() if value is not None}

    def _si(self, name: str, value: Any, units: str) -> float:
        """A quantity in SI units; a stiffness may be of friction, over the normal stress."""
        try:
            return in_si(name, value, units)
        except InvalidValue:
            if units != "Pa/m":
                raise
            try:
                return in_si(name, value, "1/m") * float(self.normal_stress)
            except InvalidValue:
                pass
            raise

    def _of_rig(self) -> dict[str, float]:
        """The fields of a scene that the rig decides."""
        found = {"reference_rate": self.reference_velocity / self.slip_distance}
        if self.stiffness is not None:
            found["stiffness"] = self.stiffness * self.slip_distance / self.normal_stress
        if self.mass is not None:
            found["period"] = 2.0 * math.pi * math.sqrt(self.mass / self.stiffness)
        if self.period is not None:
            found["period"] = self.period
        if "period" in found:
            found["inertia"] = True
        if self.density is not None:
            impedance = 0.5 * math.sqrt(self.shear_modulus * self.density)
            found["radiation_damping"] = impedance * self.reference_velocity / self.normal_stress
        return found

    def _field(self, name: str, value: Any) -> Any:
        about = _FIELDS.get(name)
        plain = isinstance(value, int | float | np.number) or value is None
        if about is None or isinstance(value, type) or (plain and name.endswith("_ratio")):
            return value
        if about.scale:
            return None if value is None else self.dimensionless(value, about.scale, name)
        with_units = hasattr(value, "magnitude") or (isinstance(value, str) and about.units)
        if with_units and about.units in _UNITS:
            return in_si(name, value, _UNITS[about.units])
        return in_si(name, value, "1") if with_units and about.units == "1" else value

    def _segment(self, number: int, stated: Any) -> Any:
        if not isinstance(stated, Mapping):
            return stated  # a Segment is in units of the slider
        try:
            return {
                key: self.dimensionless(value, _SEGMENT[key], key) if key in _SEGMENT else value
                for key, value in stated.items()
            }
        except InvalidValue as error:
            raise error.at(f"segment {number}") from error
