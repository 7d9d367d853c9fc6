"""Integration of the equations of motion of a scene in time.

``Accuracy`` defines the tolerances, the work budget and the engine. An ``Integrator`` integrates
scenes to an accuracy and counts the work: ``Integrator.follow`` integrates a scene through its
loading segments and regimes, and yields events. A ``Recording`` also stores the samples of the
motion. To read the implementation, start with ``integrator``, followed by ``motion_driver`` and
``motion_loop``. The engines are SciPy, Python and the compiled engine. The
package never interprets a motion. The measures in ``rsfstudy.measures`` compute results from
motions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.motion.accuracy import (
        DEFAULT_EVALUATION_BUDGET,
        DEFAULT_RTOL,
        MAX_ERROR_OVER_RTOL,
        MAX_RTOL,
        MIN_RTOL,
        RELATIVE_ROUNDING_ERROR,
        Accuracy,
        estimate_error,
    )
    from rsfstudy.motion.engine_factory import check_engine_is_usable, import_compiled_engine
    from rsfstudy.motion.engines import (
        COMPILED,
        ENGINES,
        PYTHON,
        SCIPY,
        compilation_log,
        find_user_stepper,
        is_engine_installed,
        register_user_steppers,
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
    from rsfstudy.motion.former_arguments import accept_accuracy_and_meter, adapt_former_compute
    from rsfstudy.motion.initial_points import (
        compute_restart_point,
        initial_point,
        point_before_start,
        point_with_slip_rate,
        slow_manifold_point,
    )
    from rsfstudy.motion.integrator import Integrator
    from rsfstudy.motion.motion_driver import MotionDriver
    from rsfstudy.motion.neglected_inertia_error import estimate_neglected_inertia_error
    from rsfstudy.motion.recorded_motion_readings import (
        recorded_friction_coefficient,
        recorded_load_point_displacement,
        resample_motion_along_path,
    )
    from rsfstudy.motion.recording import (
        FIRST_STATE_COLUMN,
        MOTION_VARIABLES,
        RECORDED_VARIABLES,
        REGIME_COLUMN,
        SAMPLE_COLUMN,
        Recording,
        recorded_row,
    )
    from rsfstudy.motion.root_finding import build_root_finder
    from rsfstudy.motion.work_meter import (
        MIN_LOCAL_TOLERANCE,
        MotionStopped,
        WorkMeter,
        suggest_raising_budget,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "motion.accuracy": (
                "Accuracy",
                "DEFAULT_EVALUATION_BUDGET",
                "DEFAULT_RTOL",
                "MAX_ERROR_OVER_RTOL",
                "MAX_RTOL",
                "MIN_RTOL",
                "RELATIVE_ROUNDING_ERROR",
                "estimate_error",
            ),
            "motion.motion_driver": ("MotionDriver",),
            "motion.engine_factory": ("check_engine_is_usable", "import_compiled_engine"),
            "motion.engines": (
                "COMPILED",
                "ENGINES",
                "PYTHON",
                "SCIPY",
                "compilation_log",
                "is_engine_installed",
                "register_user_steppers",
                "find_user_stepper",
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
                "initial_point",
                "slow_manifold_point",
                "point_before_start",
                "compute_restart_point",
                "point_with_slip_rate",
            ),
            "motion.former_arguments": ("accept_accuracy_and_meter", "adapt_former_compute"),
            "motion.integrator": ("Integrator",),
            "motion.work_meter": (
                "MIN_LOCAL_TOLERANCE",
                "MotionStopped",
                "WorkMeter",
                "suggest_raising_budget",
            ),
            "motion.neglected_inertia_error": ("estimate_neglected_inertia_error",),
            "motion.recorded_motion_readings": (
                "recorded_friction_coefficient",
                "recorded_load_point_displacement",
                "resample_motion_along_path",
            ),
            "motion.recording": (
                "FIRST_STATE_COLUMN",
                "MOTION_VARIABLES",
                "RECORDED_VARIABLES",
                "REGIME_COLUMN",
                "Recording",
                "SAMPLE_COLUMN",
                "recorded_row",
            ),
            "motion.root_finding": ("build_root_finder",),
        },
    )

__all__ = [
    "Accuracy",
    "COMPILED",
    "DEFAULT_EVALUATION_BUDGET",
    "DEFAULT_RTOL",
    "ENGINES",
    "Event",
    "EventKind",
    "EventSpecification",
    "FIRST_STATE_COLUMN",
    "Integrator",
    "MAX_ERROR_OVER_RTOL",
    "MAX_RTOL",
    "MIN_LOCAL_TOLERANCE",
    "MIN_RTOL",
    "MOTION_VARIABLES",
    "MotionDriver",
    "MotionStopped",
    "PYTHON",
    "RECORDED_VARIABLES",
    "REGIME_COLUMN",
    "RELATIVE_ROUNDING_ERROR",
    "Recording",
    "SAMPLE_COLUMN",
    "SCIPY",
    "WorkMeter",
    "accept_accuracy_and_meter",
    "adapt_former_compute",
    "approach_to_steady_state",
    "build_root_finder",
    "check_engine_is_usable",
    "compilation_log",
    "import_compiled_engine",
    "estimate_error",
    "estimate_neglected_inertia_error",
    "fall",
    "recorded_friction_coefficient",
    "initial_point",
    "is_engine_installed",
    "suggest_raising_budget",
    "recorded_load_point_displacement",
    "slow_manifold_point",
    "maximum",
    "minimum",
    "point_before_start",
    "recorded_row",
    "register_user_steppers",
    "compute_restart_point",
    "rise",
    "resample_motion_along_path",
    "find_user_stepper",
    "point_with_slip_rate",
]
