"""Integration of the equations of motion of a scene in time.

``Accuracy`` selects tolerances, the work budget and the engine. The event loop advances a motion
through the segments of its loading and through its regimes (quasi-static, and with inertia), finds
events, and records the motion on request. There are three engines: SciPy, Python and compiled. The
package never decides what a motion means: measures do that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.motion.accuracy import (
        DEFAULT_BUDGET,
        DEFAULT_RTOL,
        MAX_ERROR_RATIO,
        MAX_RTOL,
        MIN_RTOL,
        ROUNDING_ERROR,
        Accuracy,
        estimate_error,
        relative_work,
    )
    from rsfstudy.motion.driver import MotionDriver, events_along
    from rsfstudy.motion.engine_factory import (
        check_engine,
        compiled_engine,
        missing_packages,
        scalar_function,
    )
    from rsfstudy.motion.engines import (
        COMPILED,
        ENGINES,
        PYTHON,
        SCIPY,
        compilation_log,
        is_installed,
        package_versions,
        register_steppers,
        user_stepper,
    )
    from rsfstudy.motion.events import (
        Event,
        EventKind,
        EventSpecification,
        approach_to_steady_state,
        fall,
        maximum,
        minimum,
        rise,
    )
    from rsfstudy.motion.initial_points import (
        build_point_function,
        check_start,
        initial_point,
        manifold_point,
        point_before_start,
        unevaluated_point,
        with_slip_rate,
    )
    from rsfstudy.motion.integrate import integrate_events
    from rsfstudy.motion.meter import (
        MIN_LOCAL_TOLERANCE,
        MotionStopped,
        WorkMeter,
        larger_budget_remedy,
    )
    from rsfstudy.motion.neglected_inertia import estimate_neglected_inertia
    from rsfstudy.motion.readings import (
        distance_from_steady,
        friction_coefficient,
        friction_event_quantity,
        growth_rate_along_path,
        load_point_displacement,
        sample_along_path,
    )
    from rsfstudy.motion.recording import (
        FIRST_STATE_COLUMN,
        MOTION_VARIABLES,
        RECORDED_VARIABLES,
        REGIME_COLUMN,
        SAMPLE_COLUMN,
        Recording,
        pack_row,
        to_recorded_units,
        truncate_table,
        with_increasing_times,
    )
    from rsfstudy.motion.regime_switching import (
        inertia_matters,
        inertia_weight,
        slow_manifold_error,
        switch_thresholds,
    )
    from rsfstudy.motion.roots import build_root_finder
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "motion.accuracy": (
                "Accuracy",
                "DEFAULT_BUDGET",
                "DEFAULT_RTOL",
                "MAX_ERROR_RATIO",
                "MAX_RTOL",
                "MIN_RTOL",
                "ROUNDING_ERROR",
                "estimate_error",
                "relative_work",
            ),
            "motion.driver": ("MotionDriver", "events_along"),
            "motion.engine_factory": (
                "check_engine",
                "compiled_engine",
                "missing_packages",
                "scalar_function",
            ),
            "motion.engines": (
                "COMPILED",
                "ENGINES",
                "PYTHON",
                "SCIPY",
                "compilation_log",
                "is_installed",
                "package_versions",
                "register_steppers",
                "user_stepper",
            ),
            "motion.events": (
                "Event",
                "EventKind",
                "EventSpecification",
                "approach_to_steady_state",
                "fall",
                "maximum",
                "minimum",
                "rise",
            ),
            "motion.initial_points": (
                "build_point_function",
                "check_start",
                "initial_point",
                "manifold_point",
                "point_before_start",
                "unevaluated_point",
                "with_slip_rate",
            ),
            "motion.integrate": ("integrate_events",),
            "motion.meter": (
                "MIN_LOCAL_TOLERANCE",
                "MotionStopped",
                "WorkMeter",
                "larger_budget_remedy",
            ),
            "motion.neglected_inertia": ("estimate_neglected_inertia",),
            "motion.readings": (
                "distance_from_steady",
                "friction_coefficient",
                "friction_event_quantity",
                "growth_rate_along_path",
                "load_point_displacement",
                "sample_along_path",
            ),
            "motion.recording": (
                "FIRST_STATE_COLUMN",
                "MOTION_VARIABLES",
                "RECORDED_VARIABLES",
                "REGIME_COLUMN",
                "Recording",
                "SAMPLE_COLUMN",
                "pack_row",
                "to_recorded_units",
                "truncate_table",
                "with_increasing_times",
            ),
            "motion.regime_switching": (
                "inertia_matters",
                "inertia_weight",
                "slow_manifold_error",
                "switch_thresholds",
            ),
            "motion.roots": ("build_root_finder",),
        },
    )

__all__ = [
    "Accuracy",
    "COMPILED",
    "DEFAULT_BUDGET",
    "DEFAULT_RTOL",
    "ENGINES",
    "Event",
    "EventKind",
    "EventSpecification",
    "FIRST_STATE_COLUMN",
    "MAX_ERROR_RATIO",
    "MAX_RTOL",
    "MIN_LOCAL_TOLERANCE",
    "MIN_RTOL",
    "MOTION_VARIABLES",
    "MotionDriver",
    "MotionStopped",
    "PYTHON",
    "RECORDED_VARIABLES",
    "REGIME_COLUMN",
    "ROUNDING_ERROR",
    "Recording",
    "SAMPLE_COLUMN",
    "SCIPY",
    "WorkMeter",
    "approach_to_steady_state",
    "build_point_function",
    "build_root_finder",
    "check_engine",
    "check_start",
    "compilation_log",
    "compiled_engine",
    "distance_from_steady",
    "estimate_error",
    "estimate_neglected_inertia",
    "events_along",
    "fall",
    "friction_coefficient",
    "friction_event_quantity",
    "growth_rate_along_path",
    "inertia_matters",
    "inertia_weight",
    "initial_point",
    "integrate_events",
    "is_installed",
    "larger_budget_remedy",
    "load_point_displacement",
    "manifold_point",
    "maximum",
    "minimum",
    "missing_packages",
    "pack_row",
    "package_versions",
    "point_before_start",
    "register_steppers",
    "relative_work",
    "rise",
    "sample_along_path",
    "scalar_function",
    "slow_manifold_error",
    "switch_thresholds",
    "to_recorded_units",
    "truncate_table",
    "unevaluated_point",
    "user_stepper",
    "with_increasing_times",
    "with_slip_rate",
]
