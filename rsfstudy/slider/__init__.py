"""Physics of one spring-slider: parts, parameters, equations and stability.

A ``Scene`` describes a slider by seven parts: a state evolution law, a normal stress condition,
a pore fluid, the dynamics, the loading, the temperature and the noise.
The package checks scenes and provides their equations of motion, their steady states and the
stability of steady sliding. The package never integrates the equations, never reads or writes
files, and depends only on Python, NumPy and SciPy.

The parts are classes in the packages ``laws``, ``normal_stress``, ``fluid``, ``dynamics``,
``loading``, ``temperature`` and ``noise``. Each of these packages contains one module per part.
We suggest reading the other modules in the following order:

- ``scene`` combines the parts of a slider.
- ``friction_relation`` defines the relation between stress, slip rate and states, and
  ``state_variable_functions`` defines functions of the state variables. ``temperature_functions``
  adds the effects of a changing temperature.
- ``rate_functions`` and ``motion_point_functions`` build the equations of motion from friction and
  from the dynamics. ``integration_path_length`` defines the independent variable.
- ``steady_state`` and ``stability`` compute steady sliding and its linear stability from the
  friction relation.
- ``closed_forms`` contains published closed-form solutions.

The right-hand side that an integrator evaluates is built from a scene in five stages. Each stage
has its own data structure:

1. Parts: ``scene_assembly.SceneParts`` holds one part per slot, and each part defines plain
   functions of floats, for example the ``evolution`` of a law.
2. Friction: ``friction.FrictionFunctions`` combines the functions of the law, the normal stress,
   the fluid and the loading into the friction relation and the evolution of all states
   (``scene.friction_law_functions``).
3. Equations: ``equations.EquationsOfMotion`` holds the rates, unknowns and parameters of a scene in
   one regime. The functions for the rates and for the points are built from the friction functions
   and from the functions of the dynamics. The SciPy integrators call
   ``EquationsOfMotion.rate_function`` directly.
4. In-place functions: ``motion.in_place_functions.InPlaceFunctions`` converts the functions of
   ``EquationsOfMotion``, which take and return tuples, to functions that fill arrays.
5. Table: ``MotionDriver`` passes a function table with one row per regime to the event loop. A row
   contains the in-place functions, or the addresses of the compiled functions.

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
        compute_coulomb_effective_friction,
    )
    from rsfstudy.slider.closed_forms import (
        compute_critical_stiffness as critical_stiffness_closed_form,
    )
    from rsfstudy.slider.dynamics.inertia import NEGLIGIBLE_SECOND_ORDER_WEIGHT
    from rsfstudy.slider.equations import (
        EquationsOfMotion,
    )
    from rsfstudy.slider.fluid import BUILT_IN_FLUID_CLASS_BY_NAME
    from rsfstudy.slider.friction import (
        FrictionFunctions,
    )
    from rsfstudy.slider.integration_path_length import (
        LOG_SLIP_RATE_PER_PATH_LENGTH,
        compute_displacement_per_path_length,
    )
    from rsfstudy.slider.loading import MIN_SEGMENT_DURATION
    from rsfstudy.slider.motion_point import MotionPoint
    from rsfstudy.slider.part_registry import (
        UserPart,
    )
    from rsfstudy.slider.parts import (
        FloatTuple,
        NumericFunction,
    )
    from rsfstudy.slider.sampled_loading import (
        SampledHistory,
    )
    from rsfstudy.slider.scene import SINGLE_ENDLESS_SEGMENT_TABLE, Scene
    from rsfstudy.slider.scene_assembly import (
        replace_field_values,
    )
    from rsfstudy.slider.scene_caching import cached_attribute, cached_per_scene
    from rsfstudy.slider.scene_fields import SceneFields
    from rsfstudy.slider.scene_view import SceneView
    from rsfstudy.slider.slider_parameters import (
        SliderParameters,
    )
    from rsfstudy.slider.steady_state import (
        SteadySliding,
    )
    from rsfstudy.slider.user_loadings import SEGMENT_MAPPING_KEYS, Protocol, UserLoading, protocol
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "slider.scene_assembly": ("replace_field_values",),
            "slider.scene_caching": ("cached_attribute", "cached_per_scene"),
            "slider.closed_forms": (
                "CLOSED_FORMS",
                "compute_critical_stiffness as critical_stiffness_closed_form",
                "compute_coulomb_effective_friction",
            ),
            "slider.dynamics.inertia": ("NEGLIGIBLE_SECOND_ORDER_WEIGHT",),
            "slider.equations": ("EquationsOfMotion",),
            "slider.fluid": ("BUILT_IN_FLUID_CLASS_BY_NAME",),
            "slider.friction": ("FrictionFunctions",),
            "slider.loading": ("MIN_SEGMENT_DURATION",),
            "slider.parts": (
                "NumericFunction",
                "FloatTuple",
            ),
            "slider.integration_path_length": (
                "LOG_SLIP_RATE_PER_PATH_LENGTH",
                "compute_displacement_per_path_length",
            ),
            "slider.motion_point": ("MotionPoint",),
            "slider.user_loadings": ("Protocol", "SEGMENT_MAPPING_KEYS", "UserLoading", "protocol"),
            "slider.part_registry": ("UserPart",),
            "slider.sampled_loading": ("SampledHistory",),
            "slider.scene": ("SINGLE_ENDLESS_SEGMENT_TABLE", "Scene"),
            "slider.scene_fields": ("SceneFields",),
            "slider.scene_view": ("SceneView",),
            "slider.slider_parameters": ("SliderParameters",),
            "slider.steady_state": ("SteadySliding",),
        },
    )

__all__ = [
    "SceneFields",
    "BUILT_IN_FLUID_CLASS_BY_NAME",
    "CLOSED_FORMS",
    "SINGLE_ENDLESS_SEGMENT_TABLE",
    "EquationsOfMotion",
    "FrictionFunctions",
    "NumericFunction",
    "MIN_SEGMENT_DURATION",
    "NEGLIGIBLE_SECOND_ORDER_WEIGHT",
    "FloatTuple",
    "LOG_SLIP_RATE_PER_PATH_LENGTH",
    "MotionPoint",
    "Protocol",
    "SEGMENT_MAPPING_KEYS",
    "SampledHistory",
    "Scene",
    "SceneView",
    "SliderParameters",
    "SteadySliding",
    "UserLoading",
    "UserPart",
    "cached_attribute",
    "cached_per_scene",
    "critical_stiffness_closed_form",
    "compute_coulomb_effective_friction",
    "compute_displacement_per_path_length",
    "protocol",
    "replace_field_values",
]
