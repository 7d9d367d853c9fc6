"""A rig: what its record states, turned into scenes, and results turned back."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import xarray as xr

from rsfstudy._deprecation import renamed_members, renamed_names
from rsfstudy.axes import Axis
from rsfstudy.error_boundary import guard_methods
from rsfstudy.errors import InvalidValue
from rsfstudy.parts import Segment
from rsfstudy.quantities import HtmlTableMixin, Quantity
from rsfstudy.rig import axes_with_units
from rsfstudy.rig.dataset_scales import (
    UnitScale,
    build_scales_of_rig,
    convert_dataset_units,
    read_si_scales,
)
from rsfstudy.rig.rig_quantities import (
    AXIS_NAME_BY_RIG_NAME,
    RATIO_FIELD_BY_DIMENSIONAL_NAME,
    RIG_QUANTITIES,
    SCENE_QUANTITY_BY_FIELD_NAME,
    SI_UNIT_BY_SCALE,
    check_rig_quantities_are_consistent,
    convert_rig_value_and_warn_if_unusual,
    convert_rig_value_to_si,
    derive_scene_fields_from_rig,
    find_si_units_of_field,
)
from rsfstudy.rig.units import convert_to_si
from rsfstudy.slider import Protocol, Scene, protocol, with_scene_field_signature

__getattr__ = renamed_names(__name__)

#: Units of the slider of what a segment of a protocol states.
SLIDER_UNITS_OF_SEGMENT_FIELDS = {
    "velocity": "V_*", "duration": "D_c/V_*", "distance": "D_c", "step": "D_c",
    "normal_stress": "sigma_*",
}  # fmt: skip


@renamed_members
@guard_methods
@dataclass(frozen=True, kw_only=True)
class Rig(HtmlTableMixin):
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
        for name in ("normal_stress", "slip_distance", "reference_velocity"):
            if getattr(self, name) is None:
                raise InvalidValue(name, None, "is required", remedy="Give a value with units.")
        for name in RIG_QUANTITIES:
            if getattr(self, name) is not None:
                object.__setattr__(
                    self,
                    name,
                    convert_rig_value_and_warn_if_unusual(
                        name, getattr(self, name), self._normal_stress_in_pa
                    ),
                )
        check_rig_quantities_are_consistent(self.as_dict())

    def quantities_with_values(self) -> Iterator[tuple[Quantity, object]]:
        """What the rig states, in SI units."""
        for name, value in self.as_dict().items():
            about = RIG_QUANTITIES[name]
            yield Quantity(name, about.symbol, about.si_units, about.meaning), value

    @property
    def scales(self) -> dict[str, UnitScale]:
        """Scales of dimensionless quantities, in SI units."""
        return build_scales_of_rig(self.as_dict())

    def dimensionless(self, value: Any, scale: str = "D_c/V_*", name: str = "value") -> float:
        """A quantity in units of a scale: of time, unless ``D_c``, ``V_*``, ``sigma_*`` or
        ``sigma_*/D_c`` is asked for.
        """
        if scale not in self.scales:
            raise InvalidValue("scale", scale, "is no scale of a rig", choices=self.scales)
        return float(
            convert_rig_value_to_si(name, value, SI_UNIT_BY_SCALE[scale], self._normal_stress_in_pa)
            / self.scales[scale].factor
        )

    @with_scene_field_signature(*RATIO_FIELD_BY_DIMENSIONAL_NAME)
    def scene(self, **fields: Any) -> Scene:
        """A scene of this rig.

        Parameters
        ----------
        **fields
            Those of `Scene`. One that is measured in a unit of the slider (`hold_time`,
            `displacement_step` and so on) is a quantity here; a ratio stays a ratio, unless it has
            units. `instability_norm` may be a slip rate ("10 mm/s"): the scene has the number that
            this is with its period. ``inertia=False`` leaves out the mass that the rig states.
            Normal stress is constant, or imposed where the loading changes it, unless a field says
            otherwise.
        """
        if find_si_units_of_field("instability_norm", norm := fields.get("instability_norm")):
            scene = self.scene(**{n: v for n, v in fields.items() if n != "instability_norm"})
            return scene.with_(instability_norm=compute_instability_norm(self, norm, scene))
        for name in RATIO_FIELD_BY_DIMENSIONAL_NAME.keys() & fields.keys():
            if RATIO_FIELD_BY_DIMENSIONAL_NAME[name] in fields:
                raise InvalidValue(
                    name,
                    fields[name],
                    f"give {name} or {RATIO_FIELD_BY_DIMENSIONAL_NAME[name]}, not both",
                )
        fields = {
            RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n): self._convert_to_scene_field(
                RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n), v
            )
            for n, v in fields.items()
        }
        fields = {**derive_scene_fields_from_rig(self.as_dict()), **fields}
        for simplest in ("constant", "imposed") if "normal_stress" not in fields else ():
            with contextlib.suppress(InvalidValue):
                return Scene(normal_stress=simplest, **fields)
        return Scene(**fields)

    def axis(self, dimension: str, values: Any, units: Mapping[str, str] | None = None) -> Axis:
        """An axis of a study of this rig, in the units stated; see
        `rsfstudy.rig.axes_with_units.make_axis`.

        Parameters
        ----------
        dimension : str
            A quantity of the rig (``"slip_distance"``, or ``"normal_stress"``, which is called
            `sigma_star` there), or a field of a scene: ``"hold_time"``, ``"load_velocity"``.
        values : sequence of quantity, str, or mapping
            ``["10 s", "100 s"]``; ``"1:100:20:log um/s"``, which is first, last, how many, and how
            spaced; or, for a zipped axis, the fields at each label, or the rig; or a table, as
            `rsfstudy.Axis.cases` takes one.
        units : mapping of str to str, optional
            Of columns of a table that do not state them; SI units by default.
        """
        return axes_with_units.make_axis_with_units(dimension, values, units or "")

    def protocol(
        self, segments: Sequence[Segment | Mapping[str, Any]], name: str = "protocol"
    ) -> Protocol:
        """A loading history whose segments state quantities: see `rsfstudy.protocol`."""
        if isinstance(segments, list | tuple):
            segments = [self._convert_to_segment(n, s) for n, s in enumerate(segments, start=1)]
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
            For units of another kind, and results of other rigs, or at another reference rate.
        DataError
            For a dataset that is in other units already, or not of rsfstudy.
        """
        rate = self.reference_velocity / self.slip_distance
        si = read_si_scales(dataset, self.normal_stress, self.slip_distance, rate)
        found = convert_dataset_units(dataset, si, stress, length, time)
        return found.assign_attrs(laboratory=json.dumps(self.as_dict()))

    def as_dict(self) -> dict[str, float]:
        """Quantities that were stated, in SI units."""
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in found.items() if value is not None}

    @property
    def axis_fields(self) -> dict[str, float]:
        """Quantities that were stated, by the names that they have on axes, in SI units."""
        return {
            AXIS_NAME_BY_RIG_NAME.get(name, name): value for name, value in self.as_dict().items()
        }

    @property
    def _normal_stress_in_pa(self) -> float | None:
        """sigma_* in Pa, once it is known."""
        return self.normal_stress if isinstance(self.normal_stress, float) else None

    def _convert_to_scene_field(self, field_name: str, value: Any) -> Any:
        units = find_si_units_of_field(field_name, value)
        if units is None or value is None:
            return value
        scale = SCENE_QUANTITY_BY_FIELD_NAME[field_name].scale
        return (
            self.dimensionless(value, scale, field_name)
            if scale
            else convert_to_si(field_name, value, units)
        )

    def _convert_to_segment(self, segment_number: int, segment_fields: Any) -> Any:
        if not isinstance(segment_fields, Mapping):
            return segment_fields  # a Segment is in units of the slider
        try:
            return {
                key: self.dimensionless(value, SLIDER_UNITS_OF_SEGMENT_FIELDS[key], key)
                if key in SLIDER_UNITS_OF_SEGMENT_FIELDS
                else value
                for key, value in segment_fields.items()
            }
        except InvalidValue as error:
            raise error.with_location(f"segment {segment_number}") from error


def compute_instability_norm(rig: Rig, norm_or_slip_rate: Any, scene: Scene) -> float:
    """The norm V T/(2 pi D_c) of a scene of a rig, where it may be stated as the slip rate V."""
    try:
        return convert_to_si("instability_norm", norm_or_slip_rate, "1")
    except InvalidValue:
        return rig.dimensionless(norm_or_slip_rate, "V_*", "instability_norm") * scene.inertial_time
