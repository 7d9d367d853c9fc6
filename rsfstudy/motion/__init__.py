"""Classes that integrate the equations of motion of a scene in time.

``Accuracy`` defines the tolerances, the work budget and the engine. An ``Integrator`` integrates
scenes to the requested accuracy and counts right-hand side evaluations. The method
``Integrator.follow`` integrates a scene through its loading segments and regimes, and yields
events. A ``MotionRecorder`` also stores the samples of the motion. To read the implementation,
start with the module ``integrator``, followed by the modules ``motion_driver`` and ``motion_loop``.
The engines are SciPy, Python and the compiled engine. The package only integrates motions, and
never computes results from a motion. The measures in ``rsfstudy.measures`` compute the results.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.motion.accuracy import (
        Accuracy,
        estimate_error,
    )
    from rsfstudy.motion.deprecated_arguments import (
        accept_deprecated_accuracy_and_meter,
    )
    from rsfstudy.motion.engine_factory import Engine
    from rsfstudy.motion.integration_events import (
        Event,
        EventKind,
        EventSpecification,
        approach_to_steady_state,
        fall,
        maximum,
        minimum,
        rise,
    )
    from rsfstudy.motion.integrator import Integrator
    from rsfstudy.motion.motion_driver import MotionDriver
    from rsfstudy.motion.motion_resampling import (
        resample_motion_along_path,
    )
    from rsfstudy.motion.neglected_inertia_error import estimate_neglected_inertia_error
    from rsfstudy.motion.recording import (
        MotionRecorder,
    )
    from rsfstudy.motion.root_finding import build_root_finder
    from rsfstudy.motion.work_meter import (
        MotionStopped,
        WorkMeter,
    )
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "motion.accuracy": (
                "Accuracy",
                "estimate_error",
            ),
            "motion.motion_driver": ("MotionDriver",),
            "motion.engine_factory": ("Engine",),
            "motion.integration_events": (
                "Event",
                "EventKind",
                "EventSpecification",
                "approach_to_steady_state",
                "fall",
                "maximum",
                "minimum",
                "rise",
            ),
            "motion.deprecated_arguments": ("accept_deprecated_accuracy_and_meter",),
            "motion.integrator": ("Integrator",),
            # Former export. ``Scene`` has a method that replaces this function.
            "slider.equations": ("compute_slow_manifold_point as slow_manifold_point",),
            "motion.work_meter": (
                "MotionStopped",
                "WorkMeter",
            ),
            "motion.neglected_inertia_error": ("estimate_neglected_inertia_error",),
            "motion.motion_resampling": ("resample_motion_along_path",),
            "motion.recording": ("MotionRecorder",),
            "motion.root_finding": ("build_root_finder",),
        },
    )

__all__ = [
    "Engine",
    "Accuracy",
    "Event",
    "EventKind",
    "EventSpecification",
    "Integrator",
    "MotionDriver",
    "MotionStopped",
    "MotionRecorder",
    "WorkMeter",
    "accept_deprecated_accuracy_and_meter",
    "approach_to_steady_state",
    "build_root_finder",
    "estimate_error",
    "estimate_neglected_inertia_error",
    "fall",
    "maximum",
    "minimum",
    "rise",
    "resample_motion_along_path",
]
