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
- ``friction_relation`` defines the relation between stress, slip rate and states, and
  ``state_functions`` defines functions of the state variables. ``temperature_functions`` adds the
  effects of a temperature that changes.
- ``rate_functions`` and ``point_functions`` build the equations of motion from friction and from
  the dynamics. ``path_length`` defines the independent variable.
- ``steady_state`` and ``stability`` compute steady sliding and its linear stability from the
  friction relation.
- ``closed_forms`` contains published closed-form solutions.

Five containers lead from a scene to the right-hand side that an integrator evaluates:

1. Parts: ``scene_assembly.SceneParts`` holds one part per slot, and each part defines plain
   functions of floats, for example the ``evolution`` of a law.
2. Friction: ``friction.FrictionFunctions`` combines the functions of the law, the normal stress,
   the fluid and the loading into the friction relation and the evolution of all states
   (``scene.friction_functions``).
3. Equations: ``equations.Equations`` holds the rates, unknowns and parameters of a scene in one
   regime. The rates and the points are built from friction and from the functions of the dynamics,
   and the SciPy integrators call ``Equations.rate_function`` directly.
4. In-place functions: ``motion.in_place_functions.InPlaceFunctions`` converts the functions of
   equations, which take and return tuples, to functions that fill arrays.
5. Table: ``MotionDriver`` passes a table to the event loop, with one row of in-place functions, or
   of their compiled addresses, per regime.

The equations of doi:10.1007/s11589-014-0098-4 are implemented in the following modules:

    1a, 4a    friction                                  friction_relation
    1b        slip law                                  laws.slip
    4b        slowness law                              laws.slowness
    1b to 3   effect of normal stress on the state      normal_stress.variable
    5         normal stress follows shear stress        normal_stress.variable
    6         motion with inertia                       dynamics.inertia
    15        quasi-static motion                       dynamics.quasi_static, rate_functions
    7, 9      critical stiffness, steady sliding        stability, steady_state
    8, 10, 11, 14   closed-form boundaries              closed_forms
    12, 13    stress and slip rate after a jump         friction, steady_state
    16, 17    rigid slider                              rate_functions, laws.slip, laws.slowness
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
        equations_at_imposed_slip_rate,
        equations_between_ruptures,
        equations_in_rupture,
        equations_without_mass,
        quasi_static_log_slip_rate,
    )
    from rsfstudy.slider.field_name_hints import hint_for_unknown_field
    from rsfstudy.slider.fluid import BUILT_IN_PARTS
    from rsfstudy.slider.friction import (
        FrictionFunctions,
        build_friction_relation,
        build_state_evolution_function,
        compute_steady_states,
        effective_normal_stress_at,
    )
    from rsfstudy.slider.loading import MIN_SEGMENT_DURATION
    from rsfstudy.slider.motion_point import MotionPoint
    from rsfstudy.slider.parameter_layout import LARGEST_LOG_SLIP_RATE
    from rsfstudy.slider.part_registry import (
        OMITTED_DEFAULTS,
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
    from rsfstudy.slider.path_length import (
        LOG_SLIP_RATE_PER_PATH_LENGTH,
        STOPPED_LOG_SLIP_RATE,
        displacement_per_path_length,
    )
    from rsfstudy.slider.sampled_loading import (
        STRESS_RATE_COLUMN,
        SampledHistory,
        build_sampled_history,
        build_sampled_history_from_table,
    )
    from rsfstudy.slider.scene import SINGLE_ENDLESS_SEGMENT_TABLE, Scene
    from rsfstudy.slider.scene_assembly import find_inapplicable_fields, replace_field_values
    from rsfstudy.slider.scene_caching import cached_attribute, cached_per_scene
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
                "equations_between_ruptures",
                "build_equations_against_displacement",
                "build_equations_against_inertial_time",
                "equations_in_rupture",
                "equations_at_imposed_slip_rate",
                "equations_without_mass",
                "quasi_static_log_slip_rate",
            ),
            "slider.fluid": ("BUILT_IN_PARTS",),
            "slider.friction": (
                "FrictionFunctions",
                "build_friction_relation",
                "build_state_evolution_function",
                "compute_steady_states",
                "effective_normal_stress_at",
            ),
            "slider.field_name_hints": ("hint_for_unknown_field",),
            "slider.loading": ("MIN_SEGMENT_DURATION",),
            "slider.parameter_layout": ("LARGEST_LOG_SLIP_RATE",),
            "slider.parts": ("Function", "Numbers", "field_names"),
            "slider.path_length": (
                "LOG_SLIP_RATE_PER_PATH_LENGTH",
                "STOPPED_LOG_SLIP_RATE",
                "displacement_per_path_length",
            ),
            "slider.motion_point": ("MotionPoint",),
            "slider.user_loadings": ("Protocol", "SEGMENT_MAPPING_KEYS", "UserLoading", "protocol"),
            "slider.part_registry": (
                "SCENE_FIELD_NAMES",
                "SCENE_FIELD_QUANTITIES",
                "SCENE_FIELD_TYPES",
                "OMITTED_DEFAULTS",
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
    "OMITTED_DEFAULTS",
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
