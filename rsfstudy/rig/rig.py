"""Laboratory rig that converts scenes and results between physical and dimensionless units.

`Rig.scene` creates dimensionless scenes from quantities in physical units. `Rig.in_units` converts
dimensionless results to physical units.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import xarray as xr

from rsfstudy._deprecation import add_former_member_names, build_getattr_for_former_names
from rsfstudy.axes import Axis
from rsfstudy.errors import InvalidValue
from rsfstudy.exception_conversion import make_methods_raise_rsfstudy_errors
from rsfstudy.parts import Segment
from rsfstudy.quantities import HtmlTableMixin, Quantity
from rsfstudy.rig import axes_with_units
from rsfstudy.rig.dataset_unit_scales import (
    UnitScale,
    compute_unit_scales_of_rig,
    convert_dataset_units,
    read_si_scales,
)
from rsfstudy.rig.fault_parameters import replace_b_by_b_over_a
from rsfstudy.rig.rig_quantities import (
    AXIS_NAME_BY_RIG_QUANTITY,
    RATIO_FIELD_BY_DIMENSIONAL_NAME,
    RIG_QUANTITIES,
    SCENE_QUANTITY_BY_FIELD_NAME,
    SI_UNIT_BY_DIMENSIONLESS_UNIT,
    check_rig_quantities_are_consistent,
    convert_rig_to_display_units,
    convert_rig_value_to_si,
    convert_to_si_and_warn_if_unusual,
    derive_scene_fields_from_rig,
    find_si_units_of_scene_field,
    is_stiffness_in_friction_per_length,
)
from rsfstudy.rig.units import convert_to_si
from rsfstudy.slider import Protocol, Scene, SceneFields, protocol

__getattr__ = build_getattr_for_former_names(__name__)

#: Dimensionless units of the fields of a loading segment.
SCALE_SYMBOL_BY_LOADING_SEGMENT_FIELD = {
    "velocity": "V_*", "duration": "D_c/V_*", "distance": "D_c", "step": "D_c",
    "normal_stress": "sigma_*",
}  # fmt: skip


@add_former_member_names
@make_methods_raise_rsfstudy_errors
@dataclass(frozen=True, kw_only=True)
class Rig(HtmlTableMixin):
    r"""Laboratory rig with quantities in physical units.

    Each quantity is a plain number in SI units, a string such as ``"5 MPa"``, ``"10 um"`` or ``"1
    um/s"``, or a `pint.Quantity`. The package pint is not required for common units.

    Parameters
    ----------
    normal_stress : quantity
        Normal stress :math:`\sigma_*` in Pa.
    slip_distance : quantity
        Slip distance :math:`D_c` in m.
    reference_velocity : quantity
        Reference velocity :math:`V_*` in m/s, which is the velocity of the load point before the
        test.
    stiffness : quantity, optional
        Stiffness of the machine and the sample in Pa/m. A stiffness in units of friction divided by
        displacement, for example ``"2e-3 1/um"``, is multiplied by the normal stress.
    period : quantity, optional
        Period of free oscillation :math:`T` in s. If the rig has a period or a mass, its scenes
        have ``inertia=True``.
    mass : quantity, optional
        Mass per fault area in kg/m². A mass can be passed instead of a period, and requires a
        stiffness.
    shear_modulus : quantity, optional
        Shear modulus :math:`G` of the medium in Pa, for radiation damping.
    density : quantity, optional
        Density :math:`\rho` of the medium in kg/m³, for radiation damping. Pass both the shear
        modulus and the density, or neither of them.
    thermal_diffusivity : quantity, optional
        Thermal diffusivity :math:`\alpha_{th}` in m²/s. If the rig has a thermal diffusivity, its
        scenes have ``temperature="shear_heating"``. Shear heating also requires the next three
        quantities.
    heat_capacity : quantity, optional
        Heat capacity :math:`\rho c` per volume in J/m³/K.
    shear_zone_width : quantity, optional
        Width :math:`w` of the shear zone in m.
    reference_temperature : quantity, optional
        Absolute temperature :math:`T_*` of steady sliding at :math:`V_*` in K.
    heat_loss_width : quantity, optional
        Effective width :math:`w_h` of the heat loss in m, which determines the cooling rate. The
        default is the width of the shear zone. If heat flows through rock with the thickness
        :math:`L` on each side, use :math:`w_h = \sqrt{w L/2}`.
    direct_activation_energy, evolution_activation_energy : quantity, optional
        Activation energies :math:`Q_a` and :math:`Q_b` of the direct effect and of the evolution
        effect in J/mol.
    pressurisation_factor : quantity, optional
        Undrained increase :math:`\Lambda_p` in pore pressure per unit increase in temperature, in
        Pa/K. If the rig has a pressurisation factor, its scenes have ``fluid="thermal"``.

    Raises
    ------
    InvalidValue
        If a value is not a quantity, if a value is not positive, if units are incompatible, if both
        mass and period are given, if a mass is given without a stiffness, if only one of shear
        modulus and density is given, or if a quantity that shear heating requires is missing.

    Notes
    -----
    For a mass :math:`m` and a stiffness :math:`k`, the period is :math:`T = 2 \pi \sqrt{m/k}`. The
    coefficient of radiation damping, :math:`\eta = \sqrt{G \rho}/2`, approximates the inertia of
    the medium. The fields of shear heating are

    .. math::

        H = \frac{\sigma_* D_c}{\rho c \, w \, T_*}, \quad
        C = \frac{\alpha_{th} D_c}{w_h^2 V_*}, \quad q_i = \frac{Q_i}{R \, T_*}, \quad
        \text{pressurisation} = \frac{\Lambda_p T_*}{\sigma_*}.

    Examples
    --------
    >>> import rsfstudy
    >>> rig = rsfstudy.Rig(
    ...     normal_stress="5 MPa",
    ...     slip_distance="10 um",
    ...     reference_velocity="1 um/s",
    ...     stiffness="0.05 MPa/um",
    ... )
    >>> scene = rig.scene(law="slip", a=0.01, b_over_a=1.5, hold_time="1000 s")
    >>> round(scene.stiffness, 9)
    0.1
    >>> round(scene.parts.loading.hold_time, 9)
    100.0
    """

    #: Quantities of a rig by name, with their units and limits.
    QUANTITIES: ClassVar = RIG_QUANTITIES
    is_stiffness_in_friction_per_length = staticmethod(is_stiffness_in_friction_per_length)
    convert_quantities_for_display = staticmethod(convert_rig_to_display_units)

    normal_stress: Any
    slip_distance: Any
    reference_velocity: Any
    stiffness: Any = None
    period: Any = None
    mass: Any = None
    shear_modulus: Any = None
    density: Any = None
    thermal_diffusivity: Any = None
    heat_capacity: Any = None
    shear_zone_width: Any = None
    reference_temperature: Any = None
    heat_loss_width: Any = None
    direct_activation_energy: Any = None
    evolution_activation_energy: Any = None
    pressurisation_factor: Any = None

    def __post_init__(self) -> None:
        """Convert all quantities to SI units and check their values."""
        for name in ("normal_stress", "slip_distance", "reference_velocity"):
            if getattr(self, name) is None:
                raise InvalidValue(name, None, "is required", remedy="Pass a value with units.")
        for name in RIG_QUANTITIES:
            if getattr(self, name) is not None:
                object.__setattr__(
                    self,
                    name,
                    convert_to_si_and_warn_if_unusual(
                        name, getattr(self, name), self._normal_stress_in_pa
                    ),
                )
        check_rig_quantities_are_consistent(self.as_dict())

    def iterate_quantities_with_values(self) -> Iterator[tuple[Quantity, object]]:
        """Iterate over the quantities of the rig.

        Yields
        ------
        quantity : Quantity
            Description of the quantity, with its symbol and SI units.
        value : object
            Value in SI units. Optional quantities without a value are skipped.
        """
        for name, value in self.as_dict().items():
            about = RIG_QUANTITIES[name]
            yield Quantity(name, about.symbol, about.si_units, about.description), value

    @property
    def si_scale_by_dimensionless_unit(self) -> dict[str, UnitScale]:
        """SI values of dimensionless units such as ``D_c/V_*``."""
        return compute_unit_scales_of_rig(self.as_dict())

    def dimensionless(self, value: Any, scale: str = "D_c/V_*", name: str = "value") -> float:
        """Convert a quantity to a dimensionless number.

        Parameters
        ----------
        value : quantity
            Value to convert.
        scale : {"D_c/V_*", "D_c", "V_*", "sigma_*", "V_*/D_c", "sigma_*/D_c"}
            Dimensionless unit of the result. The default is the unit of time, ``D_c/V_*``.
        name : str, default: "value"
            Name of the quantity for error messages.

        Returns
        -------
        float
            Value in the dimensionless unit.

        Raises
        ------
        InvalidValue
            If the value is not a quantity, if its units are incompatible, or if the scale is
            unknown.
        """
        if scale not in self.si_scale_by_dimensionless_unit:
            raise InvalidValue(
                "scale",
                scale,
                "is not a scale of a rig",
                choices=self.si_scale_by_dimensionless_unit,
            )
        return float(
            convert_rig_value_to_si(
                name, value, SI_UNIT_BY_DIMENSIONLESS_UNIT[scale], self._normal_stress_in_pa
            )
            / self.si_scale_by_dimensionless_unit[scale].factor
        )

    def __repr__(self) -> str:
        """Return a string that lists the specified quantities of the rig with units."""
        shown = convert_rig_to_display_units(self.as_dict())
        parts = [f"{name}='{value:.12g} {units}'" for name, (value, units) in shown.items()]
        return f"Rig({', '.join(parts)})"

    @SceneFields.add_fields_to_signature("b", *RATIO_FIELD_BY_DIMENSIONAL_NAME)
    def scene(self, **fields: Any) -> Scene:
        """Create a scene of this rig.

        Parameters
        ----------
        **fields : dict
            Fields of `Scene`. Pass dimensionless fields such as ``hold_time`` or
            ``displacement_step`` as quantities with physical units. A velocity may be a ratio, as
            in ``load_velocity_ratio=10``, or a quantity, as in ``load_velocity="10 um/s"``. The
            field ``instability_norm`` may be a slip rate, for example ``"10 mm/s"``. The parameter
            ``b`` can be passed together with ``a`` instead of ``b_over_a``. The friction
            coefficient at :math:`V_*` is ``mu_star``, which is 0.76 if you do not pass it. Pass
            ``inertia=False`` to ignore the mass or the period of the rig, and
            ``temperature="isothermal"`` to ignore heat.

        Returns
        -------
        Scene
            Dimensionless scene. By default, the field ``normal_stress`` is "constant". If the
            loading changes the normal stress, or if you pass ``alpha``, the default is "imposed".
            If you pass ``phi``, the default is "variable". The default of `Scene` differs: it is
            always "variable".

        Raises
        ------
        InvalidValue
            If a field is unknown or invalid, if a velocity is given both as a ratio and as a
            quantity, if ``b`` is given together with ``b_over_a``, or if ``b`` is given without
            ``a``.
        """
        if "b" in fields:
            fields = replace_b_by_b_over_a(fields)
        if find_si_units_of_scene_field("instability_norm", norm := fields.get("instability_norm")):
            scene = self.scene(**{n: v for n, v in fields.items() if n != "instability_norm"})
            return scene.with_(instability_norm=convert_to_instability_norm(self, norm, scene))
        for name in RATIO_FIELD_BY_DIMENSIONAL_NAME.keys() & fields.keys():
            if RATIO_FIELD_BY_DIMENSIONAL_NAME[name] in fields:
                raise InvalidValue(
                    name,
                    fields[name],
                    f"cannot be combined with {RATIO_FIELD_BY_DIMENSIONAL_NAME[name]}",
                    remedy="Omit one of the two.",
                )
        fields = {
            RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n): self._convert_to_scene_field(
                RATIO_FIELD_BY_DIMENSIONAL_NAME.get(n, n), v
            )
            for n, v in fields.items()
        }
        hot = fields.get("temperature") != "isothermal"
        fields = {**derive_scene_fields_from_rig(self.as_dict(), with_shear_heating=hot), **fields}
        for simplest in ("constant", "imposed") if "normal_stress" not in fields else ():
            with contextlib.suppress(InvalidValue):
                return Scene(normal_stress=simplest, **fields)
        return Scene(**fields)

    def axis(self, dimension: str, values: Any, units: Mapping[str, str] | None = None) -> Axis:
        """Create an axis with physical units for a study of this rig.

        Parameters
        ----------
        dimension : str
            Name of a rig quantity, for example ``"slip_distance"``, or of a scene field, for
            example ``"hold_time"`` or ``"load_velocity"``. For the normal stress of the rig, pass
            ``"sigma_star"``.
        values : sequence of quantity, str, or mapping
            Values such as ``["10 s", "100 s"]``, or a range such as ``"1:100:20:log um/s"``. A
            range contains the first value, the last value, the number of values and the spacing.
            For a zipped axis, pass a mapping of labels to field values or to rigs. A table is
            interpreted as in `rsfstudy.Axis.cases`.
        units : mapping of str to str, optional
            Units of table columns without units. The default is SI units.

        Returns
        -------
        Axis
            Axis in the units of its first value. An axis with labels is in SI units, because the
            first value of a labelled axis does not determine the units.

        Raises
        ------
        InvalidValue
            If a value is not a quantity, if its units are incompatible, or if a rig quantity is not
            positive.
        """
        return axes_with_units.make_axis_with_units(dimension, values, units or "")

    def protocol(
        self, segments: Sequence[Segment | Mapping[str, Any]], name: str = "protocol"
    ) -> Protocol:
        """Create a loading history from segments with physical units.

        Parameters
        ----------
        segments : sequence of Segment or mapping
            Segments in chronological order, as in `rsfstudy.protocol`. The values of a mapping are
            quantities with physical units.
        name : str, default: "protocol"
            Name of the protocol in results.

        Returns
        -------
        Protocol
            Loading history for the field ``loading`` of a scene.

        Raises
        ------
        InvalidValue
            If a segment is invalid, or if its units are incompatible.
        """
        if isinstance(segments, list | tuple):
            segments = [
                self._convert_to_dimensionless_segment(n, s)
                for n, s in enumerate(segments, start=1)
            ]
        return protocol(segments, name)

    def in_units(
        self, dataset: xr.Dataset, *, stress: str = "Pa", length: str = "m", time: str = "s"
    ) -> xr.Dataset:
        """Convert results or a motion to physical units.

        Parameters
        ----------
        dataset : xarray.Dataset
            Dimensionless results or dimensionless motion of a scene of this rig.
        stress : str, default: "Pa"
            Unit of stress, for example ``"MPa"``.
        length : str, default: "m"
            Unit of length, for example ``"um"``.
        time : str, default: "s"
            Unit of time. The units of velocities and stiffnesses are computed from the units of
            stress, length and time.

        Returns
        -------
        xarray.Dataset
            Dataset in physical units. The attribute ``laboratory`` contains the quantities of the
            rig.

        Raises
        ------
        InvalidValue
            If the units are incompatible, if the dataset belongs to another rig, or if the
            reference rates of the dataset and the rig differ.
        DataError
            If the dataset is already in physical units, or if the dataset was not created by
            rsfstudy.

        See Also
        --------
        rsfstudy.to_si : Convert results to SI units.
        """
        rate = self.reference_velocity / self.slip_distance
        si = read_si_scales(dataset, self.normal_stress, self.slip_distance, rate)
        found = convert_dataset_units(dataset, si, stress, length, time)
        return found.assign_attrs(laboratory=json.dumps(self.as_dict()))

    def as_dict(self) -> dict[str, float]:
        """Return the quantities of the rig in SI units.

        Returns
        -------
        dict of str to float
            Quantities by name. Optional quantities without a value are omitted.
        """
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in found.items() if value is not None}

    @property
    def si_values_by_axis_name(self) -> dict[str, float]:
        """Rig quantities in SI units, keyed by the names that axes use."""
        return {
            AXIS_NAME_BY_RIG_QUANTITY.get(name, name): value
            for name, value in self.as_dict().items()
        }

    @property
    def _normal_stress_in_pa(self) -> float | None:
        """Normal stress in Pa, or None before the conversion to SI units."""
        return self.normal_stress if isinstance(self.normal_stress, float) else None

    def _convert_to_scene_field(self, field_name: str, value: Any) -> Any:
        units = find_si_units_of_scene_field(field_name, value)
        if units is None or value is None:
            return value
        scale = SCENE_QUANTITY_BY_FIELD_NAME[field_name].scale
        return (
            self.dimensionless(value, scale, field_name)
            if scale
            else convert_to_si(field_name, value, units)
        )

    def _convert_to_dimensionless_segment(self, segment_number: int, segment_fields: Any) -> Any:
        if not isinstance(segment_fields, Mapping):
            return segment_fields  # A Segment is dimensionless.
        try:
            return {
                key: self.dimensionless(value, SCALE_SYMBOL_BY_LOADING_SEGMENT_FIELD[key], key)
                if key in SCALE_SYMBOL_BY_LOADING_SEGMENT_FIELD
                else value
                for key, value in segment_fields.items()
            }
        except InvalidValue as error:
            raise error.with_location(f"segment {segment_number}") from error


def convert_to_instability_norm(rig: Rig, norm_or_slip_rate: Any, scene: Scene) -> float:
    r"""Compute the instability norm (dimensionless slip rate) of a scene.

    Parameters
    ----------
    rig : Rig
        Rig of the scene.
    norm_or_slip_rate : quantity
        Instability norm :math:`V T/(2 \pi D_c)` as a number, or the corresponding slip rate
        :math:`V`.
    scene : Scene
        Scene with the period :math:`T`.

    Returns
    -------
    float
        Instability norm.
    """
    try:
        return convert_to_si("instability_norm", norm_or_slip_rate, "1")
    except InvalidValue:
        return rig.dimensionless(norm_or_slip_rate, "V_*", "instability_norm") * scene.inertial_time
