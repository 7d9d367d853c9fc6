"""Methods of scenes: equations of motion, steady sliding and stability.

The methods are functions of other modules whose first argument is a scene. Modules that ``scene``
imports call the functions directly, because they cannot import the class ``Scene``.
"""

from __future__ import annotations

from rsfstudy.slider import (
    equations,
    friction,
    parameter_layout,
    path_length,
    stability,
    steady_state,
)


class SceneFunctions:
    """Base class of scenes, which provides equations, steady states and stability.

    The methods are not part of the interface for users, and are therefore hidden from ``dir``.
    """

    #: Name of the regime of ruptures with inertia.
    RUPTURE_REGIME = equations.RUPTURE_REGIME
    #: Lower limit of ln(V/V_*). A motion without loading ends at this slip rate.
    STOPPED_LOG_SLIP_RATE = path_length.STOPPED_LOG_SLIP_RATE
    #: Largest ln(V/V_*) whose exponential is computed.
    LARGEST_LOG_SLIP_RATE = parameter_layout.LARGEST_LOG_SLIP_RATE

    equations_between_ruptures = equations.equations_between_ruptures
    equations_in_rupture = equations.equations_in_rupture
    equations_without_mass = equations.equations_without_mass
    equations_at_imposed_slip_rate = equations.equations_at_imposed_slip_rate
    equations_against_displacement = equations.build_equations_against_displacement
    equations_against_inertial_time = equations.build_equations_against_inertial_time
    slow_manifold_point = equations.slow_manifold_point
    quasi_static_log_slip_rate = equations.quasi_static_log_slip_rate

    friction_relation = friction.build_friction_relation
    state_evolution_function = friction.build_state_evolution_function
    compute_steady_states = friction.compute_steady_states
    effective_normal_stress_at = friction.effective_normal_stress_at

    steady_sliding = steady_state.steady_sliding
    steady_friction_minus_reference = steady_state.steady_friction_minus_reference
    frictional_stress_after_jump = steady_state.frictional_stress_after_jump
    frictional_stress_for_friction = steady_state.frictional_stress_for_friction
    min_steady_log_slip_rate = steady_state.min_steady_log_slip_rate

    critical_stiffness_at = stability.critical_stiffness
    all_critical_stiffnesses = stability.all_critical_stiffnesses
    linear_growth_rates = stability.linear_growth_rates
    largest_linear_growth_rate = stability.largest_linear_growth_rate

    def __dir__(self) -> list[str]:
        """Return the public attributes, except for the methods of this class."""
        return [name for name in super().__dir__() if name not in vars(SceneFunctions)]
