"""Presets of the scene view, taken from the figures of the paper and the README."""

from __future__ import annotations

from typing import Any

from rsfstudy.explorer.scene_settings import README_RIG_QUANTITIES, SceneSettings

_README_PROTOCOL_CSV = """velocity (um/s), distance (um), duration (min)
10, 300,
1, 300,
0,, 10
1, 300,
"""
#: Parameters that the figures of doi:10.1007/s11589-014-0098-4 have in common are the default
#: values of ``Scene``.
_SCENE_FIELDS_BY_PAPER_FIGURE: dict[str, dict[str, Any]] = {
    "Fig. 5: velocity step below the boundary": {
        "law": "slip", "stiffness_ratio": 1.0, "load_velocity_ratio": 1.6,
    },
    "Fig. 5: velocity step above the boundary": {
        "law": "slip", "stiffness_ratio": 1.0, "load_velocity_ratio": 1.75,
    },
    "Fig. 6: stiffer spring, b/a = e": {
        "law": "slowness", "b_over_a": 2.718281828459045, "stiffness_ratio": 1.5,
        "load_velocity_ratio": 2000.0,
    },
    "Fig. 7: displacement step": {
        "law": "slip", "stiffness_ratio": 1.0, "displacement_step": 0.9,
    },
    "Fig. 8: bounded slip rate, slowness law": {
        "law": "slowness", "stiffness_ratio": 1.0, "load_velocity_ratio": 2.0,
    },
    "Fig. 9: stick-slip, slip law": {
        "law": "slip", "stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True,
    },
    "Figs. 10 and 11: stick-slip, slowness law": {
        "law": "slowness", "stiffness_ratio": 0.8, "load_velocity_ratio": 2.0, "inertia": True,
    },
    "Fig. 12: large velocity step with inertia": {
        "law": "slowness", "stiffness_ratio": 1.0, "load_velocity_ratio": 200.0, "inertia": True,
    },
}  # fmt: skip
_README_FRICTION_FIELDS = {
    "law": "slowness",
    "normal_stress": "constant",
    "a": 0.01,
    "b_over_a": 1.4,
}
#: Settings by the label of the preset.
SETTINGS_BY_PRESET_LABEL: dict[str, SceneSettings] = {
    "README: velocity steps and a hold": SceneSettings(
        _README_FRICTION_FIELDS, README_RIG_QUANTITIES, _README_PROTOCOL_CSV
    ),
    "README: velocity step": SceneSettings(
        _README_FRICTION_FIELDS | {"load_velocity": "10 um/s"},
        README_RIG_QUANTITIES,
        duration="60 s",
    ),
    "README: stick-slip": SceneSettings(
        _README_FRICTION_FIELDS | {"load_velocity": "10 um/s"},
        README_RIG_QUANTITIES
        | {"normal_stress": "100 MPa", "stiffness": "0.03 MPa/um", "period": "10 ms"},
        duration="200 s",
    ),
    **{
        label: SceneSettings({"law": "slip", "normal_stress": "variable"} | fields)
        for label, fields in _SCENE_FIELDS_BY_PAPER_FIGURE.items()
    },
}
