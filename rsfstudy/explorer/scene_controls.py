"""Widgets of the scene view, which are generated from the fields of the parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import panel as pn

from rsfstudy.explorer.number_widgets import POSITIVE, NumberWidget, SliderRange
from rsfstudy.explorer.scene_settings import (
    DISPLAY_UNIT_BY_SCALE_SYMBOL,
    PROTOCOL_LOADING_NAME,
    QUANTITY_BY_SCENE_FIELD,
    README_RIG_QUANTITIES,
    SceneSettings,
    find_dimensional_field_name,
    get_rig_scale_in_display_units,
)
from rsfstudy.rig import Rig
from rsfstudy.slider import SceneFields, SliderParameters

#: Values of fields whose default is 0 or None, when the user selects the part of the field.
_TYPICAL_VALUE_BY_FIELD = {
    "hold_time": 100.0, "radiation_damping": 1e-3, "oscillation_amplitude": 0.01,
    "normal_stress_ramp": 0.1, "velocity_oscillation": 0.5, "velocity_ramp": 9.0,
    "velocity_steps": 2.0, "load_velocity_ratio": 1.0, "displacement_step": 1.0,
    "normal_stress_step": 0.1, "stiffness_ratio": 1.0, "stiffness": 0.01, "initial_stress": 0.01,
    "initial_state": 0.01, "oscillation_begin": 10.0, "oscillation_cycles": 5.0,
    "oscillation_phase": 90.0, "stress_dependence": 0.5, "dilatancy": 0.01,
    "direct_activation": 35.0, "evolution_activation": 35.0,
}  # fmt: skip
#: Quantities of a rig that a part needs in addition to the quantities that every rig needs.
_EXTRA_RIG_QUANTITIES_BY_PART = {
    "inertia": ("period",),
    "radiation_damping": ("shear_modulus", "density"),
    "shear_heating": (
        "thermal_diffusivity", "heat_capacity", "shear_zone_width", "reference_temperature",
    ),
    "thermal": ("pressurisation_factor",),
}  # fmt: skip
_STIFFNESS_FIELDS = {*SceneFields.ALTERNATIVE_NAMES_FOR_STIFFNESS}
#: Fields that follow from the quantities of a rig.
_FIELDS_DERIVED_FROM_RIG = {
    "inertia", "stiffness_ratio", "stiffness", "reference_rate", "period", "radiation_damping",
    "heating", "cooling", "direct_activation", "evolution_activation", "pressurisation",
}  # fmt: skip
_TYPICAL_VALUE_BY_RIG_QUANTITY = README_RIG_QUANTITIES | {
    "period": "0.01 s", "shear_modulus": "30 GPa", "density": "2700 kg/m^3",
    "thermal_diffusivity": "1 mm^2/s", "heat_capacity": "2.4 MJ/m^3/K",
    "shear_zone_width": "0.1 mm", "reference_temperature": "295 K",
    "pressurisation_factor": "0.3 MPa/K",
}  # fmt: skip
_EXAMPLE_PROTOCOL_CSV_BY_RIG_PRESENCE = {
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
        self.rebuild_widgets(settings)

    def rebuild_widgets(self, settings: SceneSettings) -> None:
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
        units.param.watch(lambda event: self._convert_settings_to_units(event.new), "value")
        cards = [self._create_card("rig", self._create_rig_widgets())] if self._rig else []
        slider_fields = SceneFields.list_part_field_names(SliderParameters)
        cards.append(
            self._create_card(
                "slider", self._create_field_widgets(SliderParameters, slider_fields[:4])
            )
        )
        cards += [
            self._create_card(
                f"{slot.name}: {self.find_name_of_selected_part(slot)}",
                self._create_part_slot_widgets(slot),
            )
            for slot in SceneFields.PART_SLOTS
        ]
        more = self._create_field_widgets(SliderParameters, slider_fields[4:])
        cards.append(self._create_card("other slider parameters", more, collapsed=True))
        self.column.objects = [units, *cards]

    # ---- parts ----------------------------------------------------------------------------------

    def find_name_of_selected_part(self, part_slot: Any) -> str:
        """Return the name of the part that the settings select for a slot.

        Parameters
        ----------
        part_slot : PartSlot
            Slot of a scene.

        Returns
        -------
        str
            Name of the part.
        """
        fields = self.settings.scene
        if part_slot.name == "loading" and self.settings.protocol:
            return PROTOCOL_LOADING_NAME
        for selecting, part in part_slot.part_class_by_selecting_field.items():
            if fields.get(selecting) or (selecting == "inertia" and "period" in self.settings.rig):
                return str(part.name)
            if selecting == "radiation_damping" and "density" in self.settings.rig:
                return str(part.name)
        return str(fields.get(part_slot.name, part_slot.default_part_name))

    def _select_part(self, part_slot: Any, part_name: str) -> None:
        """Select a part, and drop the fields of the previous part."""
        classes = {**part_slot.built_in_parts, **part_slot.user_parts}
        classes.pop(PROTOCOL_LOADING_NAME, None)
        old = classes.get(self.find_name_of_selected_part(part_slot))
        new = classes.get(part_name)
        kept = set(SceneFields.list_part_field_names(new)) if new else set()
        dropped = set(SceneFields.list_part_field_names(old)) - kept if old else set()
        dropped |= {find_dimensional_field_name(field) for field in dropped}
        fields = {n: v for n, v in self.settings.scene.items() if n not in dropped}
        if not part_slot.part_class_by_selecting_field:
            fields[part_slot.name] = part_name
        elif (
            new is not None
            and new.field_name_that_selects_part
            and (self._rig is None or part_slot.name == "loading")
        ):
            fields[new.field_name_that_selects_part] = self._find_typical_value(
                new.field_name_that_selects_part
            )
        rig = dict(self.settings.rig)
        for quantity in _EXTRA_RIG_QUANTITIES_BY_PART.get(old.name, ()) if old else ():
            rig.pop(quantity, None)
        for quantity in _EXTRA_RIG_QUANTITIES_BY_PART.get(part_name, ()) if rig else ():
            rig[quantity] = _TYPICAL_VALUE_BY_RIG_QUANTITY[quantity]
        protocol = self.settings.protocol
        if part_slot.name == "loading":
            protocol = (
                _EXAMPLE_PROTOCOL_CSV_BY_RIG_PRESENCE[bool(rig)]
                if part_name == PROTOCOL_LOADING_NAME
                else ""
            )
        self.rebuild_widgets(replace(self.settings, scene=fields, rig=rig, protocol=protocol))
        self._changed()

    def _find_typical_value(self, field_name: str) -> Any:
        """Return a typical value of a field, with units if there is a rig."""
        if field_name == "inertia":
            return True
        value = _TYPICAL_VALUE_BY_FIELD.get(
            field_name, SceneFields.map_field_names_to_defaults()[field_name]
        )
        scale = QUANTITY_BY_SCENE_FIELD[field_name].scale
        if self._rig is None or not scale:
            return value
        return (
            f"{value * get_rig_scale_in_display_units(self._rig, scale):.4g} "
            f"{DISPLAY_UNIT_BY_SCALE_SYMBOL[scale]}"
        )

    def _convert_settings_to_units(self, units: str) -> None:
        """Express the scene in rig units or in dimensionless form."""
        scene = self.settings.build_scene(self._rig)
        rig = None if units == "dimensionless" else Rig(**README_RIG_QUANTITIES)
        self.rebuild_widgets(SceneSettings.from_scene(scene, rig))
        self._changed()

    # ---- widgets --------------------------------------------------------------------------------

    def _create_card(
        self, title: str, widgets: list[Any], collapsed: bool | None = None
    ) -> pn.Card:
        """Return a card, which is collapsed if a selector is its only content."""
        is_collapsed = len(widgets) == 1 if collapsed is None else collapsed
        return pn.Card(
            *widgets, title=title.replace("_", " ").capitalize(), collapsed=is_collapsed, width=285,
            margin=(2, 0),
        )  # fmt: skip

    def _create_part_slot_widgets(self, part_slot: Any) -> list[Any]:
        """Return the selector of a slot and the widgets of the selected part."""
        name = self.find_name_of_selected_part(part_slot)
        options = [*part_slot.built_in_parts, *part_slot.user_parts]
        options += (
            [PROTOCOL_LOADING_NAME]
            if part_slot.name == "loading" and PROTOCOL_LOADING_NAME not in options
            else []
        )
        selector = pn.widgets.Select(label=part_slot.name, options=options, value=name, width=265)
        selector.param.watch(lambda event: self._select_part(part_slot, event.new), "value")
        widgets = [selector]
        if name == PROTOCOL_LOADING_NAME:
            return [*widgets, self._create_protocol_text_box()]
        part = {**part_slot.built_in_parts, **part_slot.user_parts}[name]
        return widgets + self._create_field_widgets(part, SceneFields.list_part_field_names(part))

    def _create_field_widgets(self, part: Any, field_names: tuple[str, ...]) -> list[Any]:
        """Return the widgets of the fields of a part that apply to the scene."""
        absent = (
            SceneFields.find_inapplicable_fields(self.settings.scene)
            | self._find_fields_without_widget()
        )
        if self.settings.scene.get("normal_stress") == "constant":
            absent |= {"normal_stress_step"}
        alternative = "stiffness" if "stiffness" not in self.settings.scene else "stiffness_ratio"
        return [
            self._create_field_widget(part, name)
            for name in field_names
            if name not in absent | {alternative}
        ]

    def _find_fields_without_widget(self) -> set[str]:
        """Return the fields that need no widget, because the rig or a menu sets them."""
        if self._rig is None:
            return {"inertia"}
        return _FIELDS_DERIVED_FROM_RIG - (
            set() if "stiffness" in self.settings.rig else _STIFFNESS_FIELDS
        )

    def _create_field_widget(self, part: Any, field_name: str) -> Any:
        """Return the widget of a field."""
        declared = part.__dataclass_fields__[field_name]
        about, default = declared.metadata["about"], declared.default
        name = find_dimensional_field_name(field_name) if self._rig else field_name
        stated = self.settings.scene.get(name, self.settings.scene.get(field_name))
        if isinstance(default, bool):
            box = pn.widgets.Checkbox(label=field_name, value=bool(stated))
            box.param.watch(
                lambda event: self._store_field_value(field_name, event.new or None), "value"
            )
            return box
        scale = (
            get_rig_scale_in_display_units(self._rig, about["scale"])
            if self._rig and about["scale"]
            else 1.0
        )
        unit = DISPLAY_UNIT_BY_SCALE_SYMBOL[about["scale"]] if self._rig and about["scale"] else ""
        typical = (default or _TYPICAL_VALUE_BY_FIELD.get(field_name, 1.0)) * scale
        limits = SliderRange.choose_for_field(
            default or 0.0, typical, declared.metadata["rule"], about["scale"]
        )
        number = default if stated is None else float(str(stated).partition(" ")[0])
        shown = number * scale if stated is None and number is not None else number
        return NumberWidget(
            name, unit or about["scale"], shown, limits,
            lambda value: self._store_field_value(
                name, f"{value!r} {unit}" if unit and value is not None else value
            ),
            about["long_name"],
        ).row  # fmt: skip

    def _create_rig_widgets(self) -> list[Any]:
        """Return the widgets of the quantities of the rig."""
        return list(map(self._create_rig_quantity_widget, self.settings.rig))

    def _create_rig_quantity_widget(self, quantity_name: str) -> Any:
        """Return the widget of a quantity of the rig."""
        number, _, unit = self.settings.rig[quantity_name].partition(" ")
        typical = float(_TYPICAL_VALUE_BY_RIG_QUANTITY.get(quantity_name, number).partition(" ")[0])
        limits = SliderRange.choose_for_field(typical, typical, POSITIVE, "rig")

        def change(value: float | None) -> None:
            if value is not None:
                rig = self.settings.rig | {quantity_name: f"{value!r} {unit}"}
                self.settings = replace(self.settings, rig=rig)
                self._changed()

        return NumberWidget(
            quantity_name,
            unit,
            float(number),
            limits,
            change,
            Rig.QUANTITIES[quantity_name].description,
        ).row

    def _create_protocol_text_box(self) -> Any:
        """Return the text box with the segments of the loading."""
        box = pn.widgets.TextAreaInput(
            label="Segments (CSV)", value=self.settings.protocol, rows=7, width=265
        )

        def change(event: Any) -> None:
            self.settings = replace(self.settings, protocol=event.new)
            self._changed()

        box.param.watch(change, "value")
        return box

    def _store_field_value(self, field_name: str, value: Any) -> None:
        """Store the value of a field."""
        self.settings = self.settings.with_changed_field(field_name, value)
        self._changed()
