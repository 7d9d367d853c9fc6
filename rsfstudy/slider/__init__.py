"""Physics of one spring-slider: parts, parameters, equations and stability.

A ``Scene`` describes a slider by six parts: a state evolution law, a normal stress condition, a
pore fluid, the dynamics, the loading and the temperature. The package checks scenes and provides
their equations of motion, their steady states and the stability of steady sliding. The package
never integrates the equations, never reads or writes files, and depends only on Python, NumPy and
SciPy.

The parts are classes in the packages ``laws``, ``normal_stress``, ``fluid``, ``dynamics``,
``loading`` and ``temperature``. Each of these packages contains one module per part. We suggest
reading the other modules in the following order:

- ``scene`` combines the parts of a slider.
- ``friction`` combines the law, the normal stress and the pore pressure into a relation between
  stress, slip rate and states. Helper functions for the state variables are in ``state_functions``,
  and functions for the effects of temperature are in ``temperature_functions``.
- ``scene_functions`` combines friction with the dynamics, which determine the slip rate, into
  equations of motion for any combination of parts.
- ``equations`` provides the unknowns, rates and parameters that an integrator needs. The layout of
  the parameters is defined in ``parameter_layout``.
- ``steady_state`` and ``stability`` compute steady sliding and its linear stability from the
  friction relation.
- ``closed_forms`` contains published closed-form solutions.

The following functions convert the state evolution of a law to the rates that an integrator needs:

1. The method ``evolution`` of a law computes the change of the state per unit slip.
2. `state_functions.wrap_single_state_evolution` converts the method ``evolution`` to a function
   ``evolutions``, which receives and returns tuples. A law with several states defines
   ``evolutions`` itself. The function `scene_functions.build_scene_functions` converts the method
   only if the law does not define ``evolutions``.
3. `friction.build_friction_functions` appends the rates of the unknowns of a fluid or a loading and
   stores the combined function as ``FrictionFunctions.evolutions``.
4. The function `scene_functions.build_displacement_rate_function` computes the rates between
   ruptures, and `scene_functions.build_rate_function_of_rigid_slider` computes the rates of a rigid
   slider. For scenes with inertia, ``dynamics.inertia.build_rupture_rate_function`` computes the
   rates in ruptures, and ``dynamics.inertia.build_slip_rate_functions`` computes the slip rate
   between ruptures.
5. `equations` combines the rates, the unknowns and the parameters of a scene.
6. The ``motion`` package converts the rate functions to functions that write to arrays, and passes
   these functions to an integrator. The SciPy integrators call ``Equations.rate_function``
   directly.

The equations of doi:10.1007/s11589-014-0098-4 are implemented in the following modules:

    1a, 4a    friction                                  friction
    1b        slip law                                  laws.slip
    4b        slowness law                              laws.slowness
    1b to 3   effect of normal stress on the state      normal_stress.variable
    5         normal stress follows shear stress        normal_stress.variable
    6         motion with inertia                       dynamics.inertia
    15        quasi-static motion                       dynamics.quasi_static, scene_functions
    7, 9      critical stiffness, steady sliding        stability, steady_state
    8, 10, 11, 14   closed-form boundaries              closed_forms
    12, 13    stress and slip rate after a jump         friction, steady_state
    16, 17    rigid slider                              scene_functions, laws.slip, laws.slowness
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.slider.closed_forms import (
        CLOSED_FORMS,
        effective_friction,
    )
    from rsfstudy.slider.closed_forms import (
        critical_stiffness as critical_stiffness_closed_form,
    )
    from rsfstudy.slider.dynamics.inertia import NEGLIGIBLE_SECOND_ORDER_WEIGHT
    from rsfstudy.slider.equations import (
        RUPTURE_REGIME,
        Equations,
        build_equations_against_displacement,
        build_equations_against_inertial_time,
        build_friction_relation,
        build_state_evolution_function,
        compute_steady_states,
        effective_normal_stress_at,
        equations_at_imposed_slip_rate,
        equations_between_ruptures,
        equations_in_rupture,
        equations_without_mass,
        quasi_static_log_slip_rate,
    )
    from rsfstudy.slider.field_name_hints import hint_for_unknown_field
    from rsfstudy.slider.fluid import BUILT_IN_PARTS
    from rsfstudy.slider.friction import FrictionFunctions
    from rsfstudy.slider.loading import MIN_SEGMENT_DURATION
    from rsfstudy.slider.motion_point import MotionPoint
    from rsfstudy.slider.parameter_layout import LARGEST_LOG_SLIP_RATE
    from rsfstudy.slider.part_registry import (
        FIELDS_OMITTED_IF_NONE,
        PART_SELECTING_FIELDS,
        SCENE_FIELD_NAMES,
        SCENE_FIELD_QUANTITIES,
        SCENE_FIELD_TYPES,
        SLOT_NAMES,
        SLOTS,
        UserPart,
        add_scene_fields_to_signature,
        normalise_field_value,
        quantities_with_values,
        register_user_parts,
        replace_names_by_user_parts,
        scene_field_defaults,
        scene_field_quantities,
        scene_field_types,
    )
    from rsfstudy.slider.parts import Function, Numbers, field_names
    from rsfstudy.slider.sampled_loading import (
        STRESS_RATE_COLUMN,
        SampledHistory,
        build_sampled_history,
        build_sampled_history_from_table,
    )
    from rsfstudy.slider.scene import SINGLE_ENDLESS_SEGMENT_TABLE, Scene
    from rsfstudy.slider.scene_assembly import find_inapplicable_fields, replace_field_values
    from rsfstudy.slider.scene_caching import cached_attribute, cached_per_scene
    from rsfstudy.slider.scene_functions import (
        LOG_SLIP_RATE_PER_PATH_LENGTH,
        STOPPED_LOG_SLIP_RATE,
        displacement_per_path_length,
    )
    from rsfstudy.slider.scene_view import SceneView
    from rsfstudy.slider.slider_parameters import ALTERNATIVE_STIFFNESS_FIELDS, SliderParameters
    from rsfstudy.slider.stability import (
        all_critical_stiffnesses,
        critical_stiffness,
        largest_linear_growth_rate,
        linear_growth_rates,
    )
    from rsfstudy.slider.steady_state import (
        SteadySliding,
        frictional_stress_after_jump,
        frictional_stress_for_friction,
        min_steady_log_slip_rate,
        steady_friction_minus_reference,
        steady_sliding,
    )
    from rsfstudy.slider.user_loadings import SEGMENT_MAPPING_KEYS, Protocol, UserLoading, protocol
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "slider.scene_assembly": ("find_inapplicable_fields", "replace_field_values"),
            "slider.scene_caching": ("cached_attribute", "cached_per_scene"),
            "slider.closed_forms": (
                "CLOSED_FORMS",
                "critical_stiffness as critical_stiffness_closed_form",
                "effective_friction",
            ),
            "slider.dynamics.inertia": ("NEGLIGIBLE_SECOND_ORDER_WEIGHT",),
            "slider.equations": (
                "Equations",
                "RUPTURE_REGIME",
                "compute_steady_states",
                "equations_between_ruptures",
                "build_equations_against_displacement",
                "build_equations_against_inertial_time",
                "equations_in_rupture",
                "equations_at_imposed_slip_rate",
                "equations_without_mass",
                "build_friction_relation",
                "quasi_static_log_slip_rate",
                "effective_normal_stress_at",
                "build_state_evolution_function",
            ),
            "slider.fluid": ("BUILT_IN_PARTS",),
            "slider.friction": ("FrictionFunctions",),
            "slider.field_name_hints": ("hint_for_unknown_field",),
            "slider.loading": ("MIN_SEGMENT_DURATION",),
            "slider.parameter_layout": ("LARGEST_LOG_SLIP_RATE",),
            "slider.parts": ("Function", "Numbers", "field_names"),
            "slider.motion_point": ("MotionPoint",),
            "slider.user_loadings": ("Protocol", "SEGMENT_MAPPING_KEYS", "UserLoading", "protocol"),
            "slider.part_registry": (
                "SCENE_FIELD_NAMES",
                "SCENE_FIELD_QUANTITIES",
                "SCENE_FIELD_TYPES",
                "FIELDS_OMITTED_IF_NONE",
                "PART_SELECTING_FIELDS",
                "SLOTS",
                "SLOT_NAMES",
                "UserPart",
                "scene_field_defaults",
                "scene_field_types",
                "replace_names_by_user_parts",
                "normalise_field_value",
                "quantities_with_values",
                "register_user_parts",
                "scene_field_quantities",
                "add_scene_fields_to_signature",
            ),
            "slider.sampled_loading": (
                "STRESS_RATE_COLUMN",
                "SampledHistory",
                "build_sampled_history",
                "build_sampled_history_from_table",
            ),
            "slider.scene": ("SINGLE_ENDLESS_SEGMENT_TABLE", "Scene"),
            "slider.scene_functions": (
                "LOG_SLIP_RATE_PER_PATH_LENGTH",
                "STOPPED_LOG_SLIP_RATE",
                "displacement_per_path_length",
            ),
            "slider.scene_view": ("SceneView",),
            "slider.slider_parameters": ("ALTERNATIVE_STIFFNESS_FIELDS", "SliderParameters"),
            "slider.stability": (
                "critical_stiffness",
                "all_critical_stiffnesses",
                "linear_growth_rates",
                "largest_linear_growth_rate",
            ),
            "slider.steady_state": (
                "SteadySliding",
                "min_steady_log_slip_rate",
                "steady_friction_minus_reference",
                "steady_sliding",
                "frictional_stress_after_jump",
                "frictional_stress_for_friction",
            ),
        },
    )

__all__ = [
    "BUILT_IN_PARTS",
    "CLOSED_FORMS",
    "SINGLE_ENDLESS_SEGMENT_TABLE",
    "Equations",
    "SCENE_FIELD_NAMES",
    "SCENE_FIELD_QUANTITIES",
    "SCENE_FIELD_TYPES",
    "FrictionFunctions",
    "Function",
    "LARGEST_LOG_SLIP_RATE",
    "MIN_SEGMENT_DURATION",
    "NEGLIGIBLE_SECOND_ORDER_WEIGHT",
    "Numbers",
    "FIELDS_OMITTED_IF_NONE",
    "LOG_SLIP_RATE_PER_PATH_LENGTH",
    "MotionPoint",
    "Protocol",
    "RUPTURE_REGIME",
    "SEGMENT_MAPPING_KEYS",
    "PART_SELECTING_FIELDS",
    "SLOTS",
    "SLOT_NAMES",
    "ALTERNATIVE_STIFFNESS_FIELDS",
    "STOPPED_LOG_SLIP_RATE",
    "STRESS_RATE_COLUMN",
    "SampledHistory",
    "Scene",
    "SceneView",
    "SliderParameters",
    "SteadySliding",
    "UserLoading",
    "UserPart",
    "build_sampled_history",
    "cached_attribute",
    "cached_per_scene",
    "compute_steady_states",
    "critical_stiffness",
    "critical_stiffness_closed_form",
    "all_critical_stiffnesses",
    "effective_friction",
    "equations_between_ruptures",
    "build_equations_against_displacement",
    "build_equations_against_inertial_time",
    "equations_in_rupture",
    "equations_at_imposed_slip_rate",
    "equations_without_mass",
    "scene_field_defaults",
    "field_names",
    "scene_field_types",
    "find_inapplicable_fields",
    "build_friction_relation",
    "linear_growth_rates",
    "build_sampled_history_from_table",
    "largest_linear_growth_rate",
    "quasi_static_log_slip_rate",
    "min_steady_log_slip_rate",
    "replace_names_by_user_parts",
    "effective_normal_stress_at",
    "normalise_field_value",
    "displacement_per_path_length",
    "protocol",
    "quantities_with_values",
    "register_user_parts",
    "replace_field_values",
    "scene_field_quantities",
    "build_state_evolution_function",
    "steady_friction_minus_reference",
    "steady_sliding",
    "frictional_stress_after_jump",
    "frictional_stress_for_friction",
    "hint_for_unknown_field",
    "add_scene_fields_to_signature",
]
