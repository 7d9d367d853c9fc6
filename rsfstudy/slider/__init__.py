"""Physics of one spring-slider: parts, parameters, equations and stability.

A ``Scene`` describes a slider by five parts: a state evolution law, a normal stress condition, a
pore fluid, the dynamics and the loading. The package checks scenes and provides their equations of
motion, their steady states and the stability of these. It never integrates the equations, never
reads or writes a file, and needs nothing but Python, NumPy and SciPy.

A slider is five choices, each one file of `laws`, `normal_stress`, `fluid`, `dynamics` and
`loading`; a `scene` says which. Read in this order: `friction` puts law, normal stress and pore
pressure into one relation between stress, slip rate and state, with `states` beside it; a file of
`dynamics` says how slip rate follows; `scene_functions` makes equations of motion of both, for
whatever parts a scene has; `equations` gives what an integrator takes. Their numbers stand where
`parameter_layout` says. `steady_state` asks the same relation for steady sliding and its stability.
`closed_forms` are what others have published.

From a law to a motion, each hop a function that the next one holds:

1. ``evolution`` of a file in `laws`: the change of the state per unit slip.
2. `states.evolutions_from_single_state` makes ``evolutions`` of it, which takes a tuple of states
   and returns one; a law of several states states that itself.
   `scene_functions.build_scene_functions` chooses.
3. `friction.build_friction_functions` adds the unknowns of a fluid or a loading behind those of the
   law: ``FrictionFunctions.evolutions``.
4. `scene_functions` makes rates of it: `scene_functions.displacement_rate_function` between
   ruptures, and of a rigid slider `scene_functions.rigid_rate_function`. In a rupture
   ``dynamics.inertia.build_rupture_rate_function`` calls it; between ruptures with mass,
   ``dynamics.inertia.build_slip_rate_functions`` as well.
5. `equations` puts the rates of a scene, its unknowns and its numbers together.
6. `motion.inplace` makes functions of them that fill arrays; a stepper calls these (the one of
   SciPy calls ``Equations.rate_function`` itself), and `motion.loop` the stepper, step by step.

Where the equations of the paper are:

    1a, 4a    friction                                  friction
    1b        slip law                                  laws.slip
    4b        slowness law                              laws.slowness
    1b to 3   effect of normal stress on the state      normal_stress.variable
    5         normal stress follows shear stress        normal_stress.variable
    6         motion with mass                          dynamics.inertia
    15        quasi-static motion                       dynamics.quasi_static, scene_functions
    7, 9      critical stiffness, no steady sliding     steady_state
    8, 10, 11, 14   closed forms of boundaries          closed_forms
    12, 13    stress and slip rate after a jump         friction, steady_state
    16, 17    a rigid slider                            scene_functions, laws.slip, laws.slowness
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import lazy_exports

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
        build_friction_relation,
        build_state_evolution_function,
        compute_steady_states,
        effective_normal_stress_at,
        equations_against_displacement,
        equations_against_inertial_time,
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
        FIELD_NAMES,
        FIELD_QUANTITIES,
        FIELD_TYPES,
        FIELDS_OMITTED_IF_NONE,
        PART_SELECTING_FIELDS,
        SLOT_NAMES,
        SLOTS,
        UserPart,
        normalise_field_value,
        quantities_with_values,
        register_user_parts,
        replace_names_by_user_parts,
        scene_field_defaults,
        scene_field_quantities,
        scene_field_types,
        with_scene_field_signature,
    )
    from rsfstudy.slider.parts import Function, Numbers, field_names
    from rsfstudy.slider.sampled_loading import (
        STRESS_RATE_COLUMN,
        SampledHistory,
        build_sampled_history,
        build_sampled_history_from_table,
    )
    from rsfstudy.slider.scene import ENDLESS_SEGMENT_TABLE, Scene
    from rsfstudy.slider.scene_assembly import find_inapplicable_fields, replace_field_values
    from rsfstudy.slider.scene_caching import cached_attribute, cached_per_scene
    from rsfstudy.slider.scene_functions import (
        LOG_RATE_PER_PATH_LENGTH,
        STOPPED_LOG_SLIP_RATE,
        displacement_per_path_length,
    )
    from rsfstudy.slider.scene_view import SceneView
    from rsfstudy.slider.slider_parameters import STIFFNESS_FIELDS, SliderParameters
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
    from rsfstudy.slider.user_loadings import SEGMENT_KEYS, Protocol, UserLoading, protocol
else:
    __getattr__, __dir__ = lazy_exports(
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
                "equations_against_displacement",
                "equations_against_inertial_time",
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
            "slider.user_loadings": ("Protocol", "SEGMENT_KEYS", "UserLoading", "protocol"),
            "slider.part_registry": (
                "FIELD_NAMES",
                "FIELD_QUANTITIES",
                "FIELD_TYPES",
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
                "with_scene_field_signature",
            ),
            "slider.sampled_loading": (
                "STRESS_RATE_COLUMN",
                "SampledHistory",
                "build_sampled_history",
                "build_sampled_history_from_table",
            ),
            "slider.scene": ("ENDLESS_SEGMENT_TABLE", "Scene"),
            "slider.scene_functions": (
                "LOG_RATE_PER_PATH_LENGTH",
                "STOPPED_LOG_SLIP_RATE",
                "displacement_per_path_length",
            ),
            "slider.scene_view": ("SceneView",),
            "slider.slider_parameters": ("STIFFNESS_FIELDS", "SliderParameters"),
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
    "ENDLESS_SEGMENT_TABLE",
    "Equations",
    "FIELD_NAMES",
    "FIELD_QUANTITIES",
    "FIELD_TYPES",
    "FrictionFunctions",
    "Function",
    "LARGEST_LOG_SLIP_RATE",
    "MIN_SEGMENT_DURATION",
    "NEGLIGIBLE_SECOND_ORDER_WEIGHT",
    "Numbers",
    "FIELDS_OMITTED_IF_NONE",
    "LOG_RATE_PER_PATH_LENGTH",
    "MotionPoint",
    "Protocol",
    "RUPTURE_REGIME",
    "SEGMENT_KEYS",
    "PART_SELECTING_FIELDS",
    "SLOTS",
    "SLOT_NAMES",
    "STIFFNESS_FIELDS",
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
    "equations_against_displacement",
    "equations_against_inertial_time",
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
    "with_scene_field_signature",
]
