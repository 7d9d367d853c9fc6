"""Methods of scenes that build equations of motion and compute steady sliding and stability.

Each method is defined in another module, as a function whose first argument is a scene. Modules
that are imported by the module ``scene`` call these functions directly, because an import of the
class ``Scene`` would be circular.
"""

from __future__ import annotations

from rsfstudy.slider import (
    equations,
    friction,
    integration_path_length,
    parameter_layout,
    stability,
    steady_state,
)


class SceneFunctions:
    """Base class of scenes that defines methods for equations, steady sliding and stability.

    The methods are not part of the interface for users, and are therefore hidden from ``dir``.
    """

    #: Name of the regime of ruptures with inertia.
    RUPTURE_REGIME = equations.RUPTURE_REGIME
    #: Lower limit of ln(V/V_*). A motion without loading ends at this slip rate.
    LOG_SLIP_RATE_OF_STOPPED_SLIP = integration_path_length.LOG_SLIP_RATE_OF_STOPPED_SLIP
    #: Largest ln(V/V_*) whose exponential is computed.
    LOG_SLIP_RATE_UPPER_LIMIT = parameter_layout.LOG_SLIP_RATE_UPPER_LIMIT

    equations_between_ruptures = equations.build_equations_between_ruptures
    equations_in_rupture = equations.build_equations_in_rupture
    equations_without_mass = equations.build_equations_without_mass
    equations_at_imposed_slip_rate = equations.build_equations_at_imposed_slip_rate
    equations_against_displacement = equations.build_equations_against_displacement
    equations_against_inertial_time = equations.build_equations_against_inertial_time
    compute_slow_manifold_point = equations.compute_slow_manifold_point
    compute_quasi_static_log_slip_rate = equations.compute_quasi_static_log_slip_rate

    build_friction_relation = friction.build_friction_relation
    build_state_evolution_function = friction.build_state_evolution_function
    compute_steady_states = friction.compute_steady_states
    compute_effective_normal_stress = friction.compute_effective_normal_stress

    compute_steady_sliding = steady_state.compute_steady_sliding
    steady_friction_minus_reference = steady_state.compute_steady_friction_minus_reference
    frictional_stress_from_strength = steady_state.compute_frictional_stress_from_strength
    frictional_stress_from_friction = steady_state.compute_frictional_stress_from_friction
    find_min_steady_log_slip_rate = steady_state.find_min_steady_log_slip_rate

    critical_stiffness_at = stability.compute_critical_stiffness
    compute_all_critical_stiffnesses = stability.compute_all_critical_stiffnesses
    linear_growth_rates = stability.compute_linear_growth_rates
    compute_largest_linear_growth_rate = stability.compute_largest_linear_growth_rate

    def __dir__(self) -> list[str]:
        """Return the public attributes, except for the methods of this class."""
        return [name for name in super().__dir__() if name not in vars(SceneFunctions)]
