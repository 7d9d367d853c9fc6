"""Laboratory rigs: quantities in SI units, and scenes, axes and files in units.

A rig states its stiffness, normal stress, slip distance and velocities in units. The package
converts these quantities to the dimensionless fields of scenes and back, and reads tables, load
point protocols and records from files. It never integrates a motion and never fits a record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.rig.quantities import (
        RATIO_FIELD,
        RIG_QUANTITIES,
        in_display_units,
        is_friction_stiffness,
    )
    from rsfstudy.rig.rig import Rig
    from rsfstudy.rig.rig_scenes import RigScenes, put_on_rig, with_rig_value
    from rsfstudy.rig.scales import (
        DIMENSIONLESS_PREFIX,
        DISPLAY_BASE_UNITS,
        SCALES_ATTRIBUTE,
        convert_to_display_units,
        convert_units,
        drop_ratio_from_name,
        has_unexpected_units,
        read_scales,
        slip_rate_from_log,
        variable_scale,
    )
    from rsfstudy.rig.table_files import Column, read_table
    from rsfstudy.rig.unit_axes import axis_name_and_units, convert_axis, convert_values, make_axis
    from rsfstudy.rig.units import convert_to_si, expand_range, parse_number, unit_factor
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "rig.quantities": (
                "RATIO_FIELD",
                "RIG_QUANTITIES",
                "in_display_units",
                "is_friction_stiffness",
            ),
            "rig.rig": ("Rig",),
            "rig.rig_scenes": ("RigScenes", "put_on_rig", "with_rig_value"),
            "rig.scales": (
                "DIMENSIONLESS_PREFIX",
                "DISPLAY_BASE_UNITS",
                "SCALES_ATTRIBUTE",
                "convert_to_display_units",
                "convert_units",
                "drop_ratio_from_name",
                "has_unexpected_units",
                "read_scales",
                "slip_rate_from_log",
                "variable_scale",
            ),
            "rig.table_files": ("Column", "read_table"),
            "rig.unit_axes": ("axis_name_and_units", "convert_axis", "convert_values", "make_axis"),
            "rig.units": ("convert_to_si", "expand_range", "parse_number", "unit_factor"),
        },
    )

__all__ = [
    "Column",
    "DIMENSIONLESS_PREFIX",
    "DISPLAY_BASE_UNITS",
    "RATIO_FIELD",
    "RIG_QUANTITIES",
    "Rig",
    "RigScenes",
    "SCALES_ATTRIBUTE",
    "axis_name_and_units",
    "convert_axis",
    "convert_to_display_units",
    "convert_to_si",
    "convert_units",
    "convert_values",
    "drop_ratio_from_name",
    "expand_range",
    "has_unexpected_units",
    "in_display_units",
    "is_friction_stiffness",
    "make_axis",
    "parse_number",
    "put_on_rig",
    "read_scales",
    "read_table",
    "slip_rate_from_log",
    "unit_factor",
    "variable_scale",
    "with_rig_value",
]
