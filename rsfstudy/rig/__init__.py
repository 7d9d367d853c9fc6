"""Laboratory rigs, with scenes, axes and files in physical units.

A ``Rig`` has a stiffness, a normal stress, a slip distance and a reference velocity in physical
units. The package ``rsfstudy.rig`` converts rig quantities to the dimensionless fields of scenes
and back, and reads tables, load point protocols and records from files. The package never
integrates the equations of motion and never fits a record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.rig.axes_with_units import (
        axis_name_and_units,
        convert_axis_to_stated_units,
        convert_values_to_units,
        make_axis_with_units,
    )
    from rsfstudy.rig.column_reading import ColumnsOfSource, ReadingOptions, read_columns
    from rsfstudy.rig.columns import Column
    from rsfstudy.rig.dataset_scales import (
        DIMENSIONLESS_PREFIX,
        DISPLAY_BASE_UNITS,
        NAME_OF_SCALES_ATTRIBUTE,
        convert_dataset_units,
        convert_to_dimensional_name,
        convert_to_display_units,
        find_scale_of_variable,
        has_units_unexpected_by_its_figures,
        read_si_scales,
        slip_rate_from_log,
    )
    from rsfstudy.rig.ranges import expand_range
    from rsfstudy.rig.record_files import read_record
    from rsfstudy.rig.rig import Rig
    from rsfstudy.rig.rig_quantities import (
        RATIO_FIELD_BY_DIMENSIONAL_NAME,
        RIG_QUANTITIES,
        in_display_units,
        is_stiffness_over_normal_stress,
    )
    from rsfstudy.rig.rig_scenes import (
        LatticeScenesOnRig,
        convert_scene_and_axes_to_rig,
        replace_rig_quantity,
    )
    from rsfstudy.rig.table_files import read_table
    from rsfstudy.rig.units import (
        compute_conversion_factor,
        convert_to_si,
        parse_number,
    )
    from rsfstudy.rig.usual_headings import UsableColumns, has_time_column
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "rig.rig_quantities": (
                "RATIO_FIELD_BY_DIMENSIONAL_NAME",
                "RIG_QUANTITIES",
                "in_display_units",
                "is_stiffness_over_normal_stress",
            ),
            "rig.ranges": ("expand_range",),
            "rig.record_files": ("read_record",),
            "rig.rig": ("Rig",),
            "rig.rig_scenes": (
                "LatticeScenesOnRig",
                "convert_scene_and_axes_to_rig",
                "replace_rig_quantity",
            ),
            "rig.dataset_scales": (
                "DIMENSIONLESS_PREFIX",
                "DISPLAY_BASE_UNITS",
                "NAME_OF_SCALES_ATTRIBUTE",
                "convert_to_display_units",
                "convert_dataset_units",
                "convert_to_dimensional_name",
                "has_units_unexpected_by_its_figures",
                "read_si_scales",
                "slip_rate_from_log",
                "find_scale_of_variable",
            ),
            "rig.columns": ("Column",),
            "rig.column_reading": ("ColumnsOfSource", "ReadingOptions", "read_columns"),
            "rig.table_files": ("read_table",),
            "rig.axes_with_units": (
                "axis_name_and_units",
                "convert_axis_to_stated_units",
                "convert_values_to_units",
                "make_axis_with_units",
            ),
            "rig.usual_headings": ("UsableColumns", "has_time_column"),
            "rig.units": (
                "convert_to_si",
                "parse_number",
                "compute_conversion_factor",
            ),
        },
    )

__all__ = [
    "Column",
    "ColumnsOfSource",
    "DIMENSIONLESS_PREFIX",
    "DISPLAY_BASE_UNITS",
    "RATIO_FIELD_BY_DIMENSIONAL_NAME",
    "RIG_QUANTITIES",
    "ReadingOptions",
    "Rig",
    "UsableColumns",
    "LatticeScenesOnRig",
    "NAME_OF_SCALES_ATTRIBUTE",
    "axis_name_and_units",
    "convert_axis_to_stated_units",
    "convert_to_display_units",
    "convert_to_si",
    "convert_dataset_units",
    "convert_values_to_units",
    "convert_to_dimensional_name",
    "expand_range",
    "has_time_column",
    "has_units_unexpected_by_its_figures",
    "in_display_units",
    "is_stiffness_over_normal_stress",
    "make_axis_with_units",
    "parse_number",
    "convert_scene_and_axes_to_rig",
    "read_columns",
    "read_record",
    "read_si_scales",
    "read_table",
    "slip_rate_from_log",
    "compute_conversion_factor",
    "find_scale_of_variable",
    "replace_rig_quantity",
]
