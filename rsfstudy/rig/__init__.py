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
    from rsfstudy.rig.dataset_units import DatasetUnits
    from rsfstudy.rig.rig import Rig
    from rsfstudy.rig.rig_axes import RigAxes
    from rsfstudy.rig.rig_scenes import (
        LatticeScenesOnRig,
    )
    from rsfstudy.rig.table_files import Column, read_table
    from rsfstudy.rig.units import (
        compute_conversion_factor,
        convert_to_si,
        expand_range,
        parse_number,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "rig.rig": ("Rig",),
            "rig.rig_axes": ("RigAxes",),
            "rig.dataset_units": ("DatasetUnits",),
            "rig.rig_scenes": ("LatticeScenesOnRig",),
            # Except for the prefix, these are former exports, which ``DatasetUnits`` replaces.
            "rig.dataset_scales": (
                "convert_dataset_units",
                "convert_to_display_units",
                "find_scale_of_variable",
                "has_units_unexpected_by_its_figures",
                "read_si_scales",
                "slip_rate_from_log",
            ),
            "rig.table_files": ("Column", "read_table"),
            "rig.units": (
                "convert_to_si",
                "expand_range",
                "parse_number",
                "compute_conversion_factor",
            ),
        },
    )

__all__ = [
    "DatasetUnits",
    "RigAxes",
    "Column",
    "Rig",
    "LatticeScenesOnRig",
    "convert_to_si",
    "expand_range",
    "parse_number",
    "read_table",
    "compute_conversion_factor",
]
