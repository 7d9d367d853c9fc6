"""Examples of scene components, measures and reductions for the reference page."""

from __future__ import annotations

#: Example scene for each built-in friction law, normal stress condition, fluid, dynamics, loading,
#: temperature and noise.
SCENES = {
    "composite": 'Scene(law="composite", b_over_a=1.5, cutoff_velocity_ratio=0.1)',
    "cut_off": 'Scene(law="cut_off", b_over_a=1.5, cutoff_velocity_ratio=1000)',
    "flash_heating": 'Scene(law="flash_heating", b_over_a=1.4, weakening_velocity_ratio=1e5)',
    "family": 'Scene(law="family", law_exponent=0.5)',
    "perrin_rice_zheng": 'Scene(law="perrin_rice_zheng", b_over_a=1.5)',
    "slip": 'Scene(law="slip", b_over_a=1.5)',
    "slowness": 'Scene(law="slowness", b_over_a=1.5, regularised=True)',
    "two_slip_states": 'Scene(law="two_slip_states", b1_over_a=1, b2_over_a=0.5, length_ratio=10)',
    "two_slowness_states": 'Scene(law="two_slowness_states", b2_over_a=0.5, length_ratio=10)',
    "constant": 'Scene(normal_stress="constant")',
    "imposed": 'Scene(normal_stress="imposed", alpha=0.25, normal_stress_step=0.1)',
    "variable": 'Scene(normal_stress="variable", alpha=0.25, phi=55)',
    "dilatant": 'Scene(fluid="dilatant", dilatancy=0.01, drainage=1)',
    "drained": 'Scene(fluid="drained")',
    "thermal": 'Scene(fluid="thermal", temperature="shear_heating", pressurisation=1.5)',
    "isothermal": 'Scene(temperature="isothermal")',
    "shear_heating": 'Scene(temperature="shear_heating", cooling=5, direct_activation=35)',
    "none": 'Scene(loading_noise="none")',
    "white": 'Scene(loading_noise="white", stress_noise=1e-4, noise_interval=0.25, noise_seed=3)',
    "correlated": 'Scene(loading_noise="correlated", stress_noise=1e-4, noise_correlation_time=2)',
    "inertia": "Scene(inertia=True, stiffness_ratio=0.8)",
    "quasi_static": "Scene(stiffness_ratio=1.2)",
    "radiation_damping": "Scene(radiation_damping=1e-4, stiffness_ratio=0.8)",
    "oscillation": "Scene(alpha=0.25, oscillation_amplitude=0.05, oscillation_period=10)",
    "ramp": 'Scene(normal_stress="imposed", normal_stress_ramp=0.2, ramp_duration=5)',
    "slide_hold_slide": "Scene(hold_time=100, stiffness_ratio=5)",
    "step": "Scene(load_velocity_ratio=10)",
    "velocity_oscillation": "Scene(velocity_oscillation=0.5, oscillation_period=10)",
    "velocity_ramp": "Scene(velocity_ramp=9, velocity_ramp_duration=20)",
    "velocity_steps": "Scene(velocity_steps=3, velocity_ratio=3, displacement_between_steps=20)",
}

#: Examples of measures and reductions that are not part of a named study.
CALLS = {
    "Elasticities": 'Elasticities(LimitCycle(), parameters=("a", "b_over_a"))',
    "EventStatistics": "EventStatistics(cycles=1000)",
    "Fit": 'Fit(records=(record,), free=("a", "b", "slip_distance"), step=1)',
    "PowerLaw": 'PowerLaw(name="exponent", of="recurrence_interval", on="load_velocity_ratio")',
}
