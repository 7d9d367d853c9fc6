"""Study axes in physical units."""

from __future__ import annotations

from rsfstudy.rig import axes_with_units, rig_quantities, rig_scenes


class RigAxes:
    """Namespace that contains the functions for creating and converting the study axes of a rig."""

    #: Names of the ratios to which the scene converts dimensional fields.
    RATIO_FIELD_BY_DIMENSIONAL_NAME = rig_quantities.RATIO_FIELD_BY_DIMENSIONAL_NAME

    create_axis = staticmethod(axes_with_units.make_axis_with_units)
    find_axis_name_and_si_units = staticmethod(axes_with_units.find_axis_name_and_si_units)
    convert_values_to_units = staticmethod(axes_with_units.convert_values_to_units)
    convert_axis_values_to_axis_units = staticmethod(
        axes_with_units.convert_axis_values_to_axis_units
    )
    replace_rig_quantity = staticmethod(rig_scenes.replace_rig_quantity)
    convert_scene_and_axes_to_rig_units = staticmethod(
        rig_scenes.convert_scene_and_axes_to_rig_units
    )
