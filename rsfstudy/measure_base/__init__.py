"""Base class of measures, and functions that several measures share.

A ``Measure`` computes named results of one scene, with a status, error estimates and the cost of
the computation. The base class checks the results. The package never defines measures of critical
steps, limit cycles, responses or fits, because these measures are in separate packages. The module
``rsfstudy.measures`` exports all measures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rsfstudy._lazy_exports import build_lazy_export_functions

if TYPE_CHECKING:
    from rsfstudy.measure_base._declaration_checks import OutputValue
    from rsfstudy.measure_base._loading_checks import (
        check_loading_changes_stress_only_in_steps,
        check_loading_has_no_noise,
    )
    from rsfstudy.measure_base._recording_measure import (
        RecordingMeasure,
        create_outputs_along_phase,
    )
    from rsfstudy.measure_base.elasticities import Elasticities
    from rsfstudy.measure_base.measure import Measure, Outcome
    from rsfstudy.measure_base.steady_sliding_stability import is_steady_sliding_linearly_stable
else:
    __getattr__, __dir__ = build_lazy_export_functions(
        __name__,
        {
            "measure_base._declaration_checks": ("OutputValue",),
            "measure_base._loading_checks": (
                "check_loading_changes_stress_only_in_steps",
                "check_loading_has_no_noise",
            ),
            "measure_base._recording_measure": ("RecordingMeasure", "create_outputs_along_phase"),
            "measure_base.elasticities": ("Elasticities",),
            "measure_base.measure": ("Measure", "Outcome"),
            "measure_base.steady_sliding_stability": ("is_steady_sliding_linearly_stable",),
        },
    )

__all__ = [
    "Elasticities",
    "Measure",
    "Outcome",
    "OutputValue",
    "RecordingMeasure",
    "check_loading_changes_stress_only_in_steps",
    "create_outputs_along_phase",
    "check_loading_has_no_noise",
    "is_steady_sliding_linearly_stable",
]
