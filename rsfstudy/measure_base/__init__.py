"""Base class of measures, and functions that several measures share.

A ``Measure`` computes named results of one scene, with a status, error estimates and the cost of
the computation. The base class checks the results. The package never contains a measure of a single
topic: critical steps, limit cycles, responses and fits have their own packages, and
``rsfstudy.measures`` exports all measures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy import lazy_exports

if TYPE_CHECKING:
    from rsfstudy.measure_base._declaration_checks import OutputValue
    from rsfstudy.measure_base._loading_checks import (
        SLOW_NORM_PREFIX,
        check_single_step,
        check_steady_loading,
        norm_below_loading_outcome,
        slow_norm_warning,
    )
    from rsfstudy.measure_base._recorded_motion import (
        COINCIDENCE_FLOOR,
        RecordedMotion,
        RecordingMeasure,
        estimate_instant_error,
        estimate_instant_errors,
        phase_outputs,
        record_motion,
        relative_to_start,
    )
    from rsfstudy.measure_base.elasticities import Elasticities
    from rsfstudy.measure_base.measure import Measure, Outcome
    from rsfstudy.measure_base.settling_checks import settled_flag, settles_to_steady_sliding
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "measure_base._declaration_checks": ("OutputValue",),
            "measure_base._loading_checks": (
                "SLOW_NORM_PREFIX",
                "check_single_step",
                "check_steady_loading",
                "norm_below_loading_outcome",
                "slow_norm_warning",
            ),
            "measure_base._recorded_motion": (
                "COINCIDENCE_FLOOR",
                "RecordedMotion",
                "RecordingMeasure",
                "estimate_instant_error",
                "estimate_instant_errors",
                "phase_outputs",
                "record_motion",
                "relative_to_start",
            ),
            "measure_base.elasticities": ("Elasticities",),
            "measure_base.measure": ("Measure", "Outcome"),
            "measure_base.settling_checks": ("settled_flag", "settles_to_steady_sliding"),
        },
    )

__all__ = [
    "COINCIDENCE_FLOOR",
    "Elasticities",
    "Measure",
    "Outcome",
    "OutputValue",
    "RecordedMotion",
    "RecordingMeasure",
    "SLOW_NORM_PREFIX",
    "check_single_step",
    "check_steady_loading",
    "estimate_instant_error",
    "estimate_instant_errors",
    "norm_below_loading_outcome",
    "phase_outputs",
    "record_motion",
    "relative_to_start",
    "settled_flag",
    "settles_to_steady_sliding",
    "slow_norm_warning",
]
