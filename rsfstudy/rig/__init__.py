"""Laboratory rigs that create scenes and axes from quantities in physical units.

A ``Rig`` has a stiffness, a normal stress, a slip distance and a reference velocity in physical
units. The package ``rsfstudy.rig`` converts rig quantities to the dimensionless fields of scenes
and back, and reads tables, load point protocols and records from files. The package never
integrates the equations of motion and never fits a record.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.rig.column_reading import (
        ColumnsReadFromSource,
        RecordReadingOptions,
        read_columns,
    )
    from rsfstudy.rig.dataset_units import DatasetUnits
    from rsfstudy.rig.number_ranges import expand_range
    from rsfstudy.rig.protocol_files import read_protocol
    from rsfstudy.rig.record_column_detection import AcceptedRecordColumns, has_time_column
    from rsfstudy.rig.record_files import read_record
    from rsfstudy.rig.rig import Rig
    from rsfstudy.rig.rig_scenes import (
        RigAxesToScenesConverter,
    )
    from rsfstudy.rig.rig_study_axes import RigAxes
    from rsfstudy.rig.table_columns import Column
    from rsfstudy.rig.table_files import read_table
    from rsfstudy.rig.units import (
        compute_conversion_factor,
        convert_to_si,
        parse_number,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "rig.protocol_files": ("read_protocol",),
            "rig.number_ranges": ("expand_range",),
            "rig.record_files": ("read_record",),
            "rig.rig": ("Rig",),
            "rig.rig_study_axes": ("RigAxes",),
            "rig.dataset_units": ("DatasetUnits",),
            "rig.rig_scenes": ("RigAxesToScenesConverter",),
            # These are former exports, which ``DatasetUnits`` replaces.
            "rig.dataset_unit_scales": (
                "convert_dataset_units",
                "convert_to_display_units",
                "find_unit_scale_of_variable",
                "has_units_other_than_display_units",
                "read_si_scales",
                "compute_slip_rate_from_log",
            ),
            "rig.table_columns": ("Column",),
            "rig.column_reading": ("ColumnsReadFromSource", "RecordReadingOptions", "read_columns"),
            "rig.table_files": ("read_table",),
            "rig.record_column_detection": ("AcceptedRecordColumns", "has_time_column"),
            "rig.units": (
                "convert_to_si",
                "parse_number",
                "compute_conversion_factor",
            ),
        },
    )

__all__ = [
    "DatasetUnits",
    "RigAxes",
    "Column",
    "ColumnsReadFromSource",
    "RecordReadingOptions",
    "Rig",
    "AcceptedRecordColumns",
    "RigAxesToScenesConverter",
    "convert_to_si",
    "expand_range",
    "has_time_column",
    "parse_number",
    "read_columns",
    "read_protocol",
    "read_record",
    "read_table",
    "compute_conversion_factor",
]
