"""Widgets of the scene view, which are generated from the fields of the parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import panel as pn

from rsfstudy.explorer.field_widgets import POSITIVE, NumberWidget, SliderRange
from rsfstudy.explorer.scene_settings import (
    PROTOCOL,
    QUANTITY_BY_FIELD,
    README_RIG,
    UNITS_BY_SCALE,
    SceneSettings,
    rig_name,
    scale_in_units,
)
from rsfstudy.rig import Rig
from rsfstudy.slider import SceneFields, SliderParameters

#: Values of fields whose default is 0 or None, when the user selects the part of the field.
_TYPICAL_VALUES = {
    "hold_time": 100.0, "radiation_damping": 1e-3, "oscillation_amplitude": 0.01,
    "normal_stress_ramp": 0.1, "velocity_oscillation": 0.5, "velocity_ramp": 9.0,
    "velocity_steps": 2.0, "load_velocity_ratio": 1.0, "displacement_step": 1.0,
    "normal_stress_step": 0.1, "stiffness_ratio": 1.0, "stiffness": 0.01, "initial_stress": 0.01,
    "initial_state": 0.01, "oscillation_begin": 10.0, "oscillation_cycles": 5.0,
    "oscillation_phase": 90.0, "stress_dependence": 0.5, "dilatancy": 0.01,
    "direct_activation": 35.0, "evolution_activation": 35.0,
}  # fmt: skip
#: Quantities of a rig that a part needs in addition to the quantities that every rig needs.
_RIG_QUANTITIES_OF_PART = {
    "inertia": ("period",),
    "radiation_damping": ("shear_modulus", "density"),
    "shear_heating": (
        "thermal_diffusivity", "heat_capacity", "shear_zone_width", "reference_temperature",
    ),
    "thermal": ("pressurisation_factor",),
}  # fmt: skip
_STIFFNESS = {*SceneFields.ALTERNATIVE_STIFFNESS}
#: Fields that follow from the quantities of a rig.
_FIELDS_OF_RIG = {
    "inertia", "stiffness_ratio", "stiffness", "reference_rate", "period", "radiation_damping",
    "heating", "cooling", "direct_activation", "evolution_activation", "pressurisation",
}  # fmt: skip
_TYPICAL_RIG_QUANTITIES = README_RIG | {
    "period": "0.01 s", "shear_modulus": "30 GPa", "density": "2700 kg/m^3",
    "thermal_diffusivity": "1 mm^2/s", "heat_capacity": "2.4 MJ/m^3/K",
    "shear_zone_width": "0.1 mm", "reference_temperature": "295 K",
    "pressurisation_factor": "0.3 MPa/K",
}  # fmt: skip
_PROTOCOL_TEMPLATE = {
    True: "velocity (um/s), duration (s)\n10, 60\n0, 600\n10, 60\n",
    False: "velocity (V_*), duration (D_c/V_*)\n10, 6\n0, 60\n10, 6\n",
}


class SceneControls:
    """Cards with the widgets of a scene.

    Parameters
    ----------
    settings : SceneSettings
        Settings that the widgets show.
    changed : callable
        Function without arguments that is called after the user has changed a setting.

    Attributes
    ----------
    column : panel.Column
        Cards, one for the slider and one for each slot of a scene.
    settings : SceneSettings
        Present settings.
    """

    def __init__(self, settings: SceneSettings, changed: Callable[[], None]) -> None:
        """Create the cards."""
        self.column = pn.Column(margin=0)
        self._changed = changed
        self.show(settings)

    def show(self, settings: SceneSettings) -> None:
        """Recreate the widgets after the settings have changed.

        Parameters
        ----------
        settings : SceneSettings
            Settings that the widgets show.
        """
        self.settings = settings
        self._rig = settings.build_rig()
        units = pn.widgets.RadioButtonGroup(
            label="Units", options=["dimensionless", "rig"], value="rig" if self._rig else
            "dimensionless", width=270,
        )  # fmt: skip
        units.param.watch(lambda event: self._choose_units(event.new), "value")
        cards = [self._card("rig", self._rig_widgets())] if self._rig else []
        slider_fields = SceneFields.names_of_part(SliderParameters)
        cards.append(self._card("slider", self._fields(SliderParameters, slider_fields[:4])))
        cards += [
            self._card(f"{slot.name}: {self.part_of_slot(slot)}", self._slot_widgets(slot))
            for slot in SceneFields.SLOTS
        ]
        more = self._fields(SliderParameters, slider_fields[4:])
        cards.append(self._card("other slider parameters", more, collapsed=True))
        self.column.objects = [units, *cards]

    # ---- parts ----------------------------------------------------------------------------------

    def part_of_slot(self, slot: Any) -> str:
        """Return the name of the part that the settings select for a slot.

        Parameters
        ----------
        slot : Slot
            Slot of a scene.

        Returns
        -------
        str
            Name of the part.
        """
        fields = self.settings.scene
        if slot.name == "loading" and self.settings.protocol:
            return PROTOCOL
        for selecting, part in slot.part_class_by_selecting_field.items():
            if fields.get(selecting) or (selecting == "inertia" and "period" in self.settings.rig):
                return str(part.name)
            if selecting == "radiation_damping" and "density" in self.settings.rig:
                return str(part.name)
        return str(fields.get(slot.name, slot.default_part_name))

    def _choose_part(self, slot: Any, name: str) -> None:
        """Select a part, and drop the fields of the previous part."""
        classes = {**slot.built_in_parts, **slot.user_parts}
        classes.pop(PROTOCOL, None)
        old = classes.get(self.part_of_slot(slot))
        new = classes.get(name)
        kept = set(SceneFields.names_of_part(new)) if new else set()
        dropped = set(SceneFields.names_of_part(old)) - kept if old else set()
        dropped |= {rig_name(field) for field in dropped}
        fields = {n: v for n, v in self.settings.scene.items() if n not in dropped}
        if not slot.part_class_by_selecting_field:
            fields[slot.name] = name
        elif new is not None and new.selected_by and (self._rig is None or slot.name == "loading"):
            fields[new.selected_by] = self._typical(new.selected_by)
        rig = dict(self.settings.rig)
        for quantity in _RIG_QUANTITIES_OF_PART.get(old.name, ()) if old else ():
            rig.pop(quantity, None)
        for quantity in _RIG_QUANTITIES_OF_PART.get(name, ()) if rig else ():
            rig[quantity] = _TYPICAL_RIG_QUANTITIES[quantity]
        protocol = self.settings.protocol
        if slot.name == "loading":
            protocol = _PROTOCOL_TEMPLATE[bool(rig)] if name == PROTOCOL else ""
        self.show(replace(self.settings, scene=fields, rig=rig, protocol=protocol))
        self._changed()

    def _typical(self, field: str) -> Any:
        """Return a typical value of a field, with units if there is a rig."""
        if field == "inertia":
            return True
        value = _TYPICAL_VALUES.get(field, SceneFields.defaults()[field])
        scale = QUANTITY_BY_FIELD[field].scale
        if self._rig is None or not scale:
            return value
        return f"{value * scale_in_units(self._rig, scale):.4g} {UNITS_BY_SCALE[scale]}"

    def _choose_units(self, units: str) -> None:
        """Express the scene in rig units or in dimensionless form."""
        scene = self.settings.build_scene(self._rig)
        rig = None if units == "dimensionless" else Rig(**README_RIG)
        self.show(SceneSettings.from_scene(scene, rig))
        self._changed()

    # ---- widgets --------------------------------------------------------------------------------

    def _card(self, title: str, widgets: list[Any], collapsed: bool | None = None) -> pn.Card:
        """Return a card, which is collapsed if a selector is its only content."""
        is_collapsed = len(widgets) == 1 if collapsed is None else collapsed
        return pn.Card(
            *widgets, title=title.replace("_", " ").capitalize(), collapsed=is_collapsed, width=285,
            margin=(2, 0),
        )  # fmt: skip

    def _slot_widgets(self, slot: Any) -> list[Any]:
        """Return the selector of a slot and the widgets of the selected part."""
        name = self.part_of_slot(slot)
        options = [*slot.built_in_parts, *slot.user_parts]
        options += [PROTOCOL] if slot.name == "loading" and PROTOCOL not in options else []
        selector = pn.widgets.Select(label=slot.name, options=options, value=name, width=265)
        selector.param.watch(lambda event: self._choose_part(slot, event.new), "value")
        widgets = [selector]
        if name == PROTOCOL:
            return [*widgets, self._protocol_box()]
        part = {**slot.built_in_parts, **slot.user_parts}[name]
        return widgets + self._fields(part, SceneFields.names_of_part(part))

    def _fields(self, part: Any, names: tuple[str, ...]) -> list[Any]:
        """Return the widgets of the fields of a part that apply to the scene."""
        absent = SceneFields.find_inapplicable(self.settings.scene) | self._fields_of_rig()
        if self.settings.scene.get("normal_stress") == "constant":
            absent |= {"normal_stress_step"}
        alternative = "stiffness" if "stiffness" not in self.settings.scene else "stiffness_ratio"
        return [
            self._field_widget(part, name) for name in names if name not in absent | {alternative}
        ]

    def _fields_of_rig(self) -> set[str]:
        """Return the fields that the rig or a menu sets, and that need no widget."""
        if self._rig is None:
            return {"inertia"}
        return _FIELDS_OF_RIG - (set() if "stiffness" in self.settings.rig else _STIFFNESS)

    def _field_widget(self, part: Any, field: str) -> Any:
        """Return the widget of a field."""
        declared = part.__dataclass_fields__[field]
        about, default = declared.metadata["about"], declared.default
        name = rig_name(field) if self._rig else field
        stated = self.settings.scene.get(name, self.settings.scene.get(field))
        if isinstance(default, bool):
            box = pn.widgets.Checkbox(label=field, value=bool(stated))
            box.param.watch(lambda event: self._set_field(field, event.new or None), "value")
            return box
        scale = scale_in_units(self._rig, about["scale"]) if self._rig and about["scale"] else 1.0
        unit = UNITS_BY_SCALE[about["scale"]] if self._rig and about["scale"] else ""
        typical = (default or _TYPICAL_VALUES.get(field, 1.0)) * scale
        limits = SliderRange.of_field(
            default or 0.0, typical, declared.metadata["rule"], about["scale"]
        )
        number = default if stated is None else float(str(stated).partition(" ")[0])
        shown = number * scale if stated is None and number is not None else number
        return NumberWidget(
            name, unit or about["scale"], shown, limits,
            lambda value: self._set_field(
                name, f"{value!r} {unit}" if unit and value is not None else value
            ),
            about["long_name"],
        ).row  # fmt: skip

    def _rig_widgets(self) -> list[Any]:
        """Return the widgets of the quantities of the rig."""
        return list(map(self._rig_widget, self.settings.rig))

    def _rig_widget(self, name: str) -> Any:
        """Return the widget of a quantity of the rig."""
        number, _, unit = self.settings.rig[name].partition(" ")
        typical = float(_TYPICAL_RIG_QUANTITIES.get(name, number).partition(" ")[0])
        limits = SliderRange.of_field(typical, typical, POSITIVE, "rig")

        def change(value: float | None) -> None:
            if value is not None:
                rig = self.settings.rig | {name: f"{value!r} {unit}"}
                self.settings = replace(self.settings, rig=rig)
                self._changed()

        return NumberWidget(
            name, unit, float(number), limits, change, Rig.QUANTITIES[name].meaning
        ).row

    def _protocol_box(self) -> Any:
        """Return the text box with the segments of the loading."""
        box = pn.widgets.TextAreaInput(
            label="Segments (CSV)", value=self.settings.protocol, rows=7, width=265
        )

        def change(event: Any) -> None:
            self.settings = replace(self.settings, protocol=event.new)
            self._changed()

        box.param.watch(change, "value")
        return box

    def _set_field(self, name: str, value: Any) -> None:
        """Store the value of a field."""
        self.settings = self.settings.with_field(name, value)
        self._changed()
